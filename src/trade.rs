//! What a command trades for what: declared once, beside its `Params`.
//!
//! `scantle tradeoff` and `scantle stability` read nothing else about a command, and know none by
//! its name.

/// The trade of one command.
#[derive(Debug, Clone, Copy)]
pub struct Trade {
    /// The options that buy accuracy with time or memory.
    pub knobs: &'static [Knob],
    /// The one of the report's measures that compares all settings.
    pub error: Measure,
    /// What that error is verified against.
    pub reference: &'static str,
    /// Name of the format that holds every result without loss.
    pub result: &'static str,
    /// Options whose values stand in the input's space; they are moved with it.
    pub placed: &'static [Placed],
    /// Options whose values name what a changed copy of the input does not hold.
    pub tied: &'static [Tied],
    /// What the result does not depend on.
    pub invariant: &'static [Invariance],
}

/// An option that buys accuracy with time or memory.
#[derive(Debug, Clone, Copy)]
pub struct Knob {
    /// The long option, without dashes.
    pub name: &'static str,
    /// Some of its values, cheapest first.
    pub ladder: &'static [&'static str],
    /// Whether its values are numbers, of which the smaller are cheaper, or the larger where the ladder
    /// falls; else they are names, and what the ladder leaves out is cheaper than all of it.
    pub numeric: bool,
    /// Knobs, and a value of each, with which this one has no effect.
    pub idle: &'static [(&'static str, &'static str)],
}

impl Knob {
    /// Whether its values are numbers of which the larger are cheaper: the ladder falls.
    pub fn is_falling(&self) -> bool {
        let number = |value: Option<&&str>| value.and_then(|value| value.parse::<f64>().ok());
        let ends = number(self.ladder.first()).zip(number(self.ladder.last()));
        self.numeric && ends.is_some_and(|(first, last)| first > last)
    }
}

/// An option whose value stands in the input's space.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    /// The long option, without dashes. Where it may be given several times, each value is moved.
    pub option: &'static str,
    /// What stands before the numbers; a value without it holds none, nor does a share of the input, which
    /// ends in `%`. Empty as a rule.
    pub prefix: &'static str,
    /// What its comma-separated numbers are, in order.
    pub parts: &'static [Part],
}

impl Placed {
    /// An option whose value is nothing but numbers.
    pub const fn new(option: &'static str, parts: &'static [Part]) -> Self {
        Placed {
            option,
            prefix: "",
            parts,
        }
    }
}

/// An option whose value names something in the input by what only its own file says of it, such as the
/// name of a residue: it means nothing, or something else, in a changed copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tied {
    /// The long option, without dashes.
    pub option: &'static str,
    /// What to do instead, as an order.
    pub instead: &'static str,
}

/// What some numbers of an option's value are, in the input's space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// One number: a length in the input's unit.
    Length,
    /// Three: a point.
    Point,
    /// Three: a direction, whose length says nothing.
    Direction,
    /// Six: a box along the axes, its lower corner, then its upper.
    Box,
    /// One: what no motion changes, such as an angle.
    Number,
}

impl Part {
    /// How many numbers it takes.
    pub const fn numbers(self) -> usize {
        match self {
            Part::Length | Part::Number => 1,
            Part::Point | Part::Direction => 3,
            Part::Box => 6,
        }
    }
}

/// A measure of the report's `accuracy`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Measure {
    /// Its name in the report.
    pub name: &'static str,
    /// Its unit in the report.
    pub unit: &'static str,
}

/// A change of the input, or of its place, that changes nothing in the result but what must change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Invariance {
    /// The change.
    pub under: Change,
    /// Options on whose value it depends, with the values that it holds for: `("fill", &["none"])`, or
    /// [`GIVEN`].
    pub only: &'static [(&'static str, &'static [&'static str])],
}

/// Any value, where there is one: the user gave it, or it is there by default.
pub const GIVEN: &[&str] = &[];

impl Invariance {
    /// An invariance under every setting.
    pub const fn always(under: Change) -> Self {
        Invariance { under, only: &[] }
    }
}

/// The changes of an input under which stability is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    /// All coordinates times a power of two.
    Scale,
    /// All points moved by one vector.
    Shift,
    /// Turned by 90 degrees about an axis of the coordinates.
    QuarterTurn,
    /// Turned about an axis that is none of the coordinates'.
    Turn,
    /// Vertices, or atoms, in another order.
    VertexOrder,
    /// Elements in another order.
    FaceOrder,
    /// Vertices of their own for every element.
    SplitVertices,
    /// Every element, or atom, twice.
    DuplicateFaces,
    /// Triangles without area added at vertices in use.
    DegenerateFaces,
    /// Every coordinate one bit up, down, or as it is.
    Jitter,
}

impl Change {
    /// Stable name for reports.
    pub const fn name(self) -> &'static str {
        match self {
            Change::Scale => "scale",
            Change::Shift => "shift",
            Change::QuarterTurn => "quarter-turn",
            Change::Turn => "turn",
            Change::VertexOrder => "vertex-order",
            Change::FaceOrder => "face-order",
            Change::SplitVertices => "split-vertices",
            Change::DuplicateFaces => "duplicate-faces",
            Change::DegenerateFaces => "degenerate-faces",
            Change::Jitter => "jitter",
        }
    }
}

impl Trade {
    /// The knob of a long option.
    pub fn knob(&self, name: &str) -> Option<&'static Knob> {
        self.knobs.iter().find(|knob| knob.name == name)
    }

    /// Whether the result is declared not to depend on a change, where `value` tells the value of
    /// an option.
    pub fn is_invariant(&self, under: Change, value: impl Fn(&str) -> Option<String>) -> bool {
        self.invariant.iter().any(|row| {
            row.under == under
                && row.only.iter().all(|(option, fit)| {
                    value(option).is_some_and(|v| fit.is_empty() || fit.contains(&v.as_str()))
                })
        })
    }
}

/// Names of the values of an option, as the command line and the report write them.
macro_rules! named {
    ($type:ident { $($variant:ident = $name:literal),* $(,)? }) => {
        impl $type {
            /// The names of all values.
            pub const NAMES: &'static [&'static str] = &[$($name),*];

            /// The name of this value.
            pub fn name(self) -> &'static str {
                match self { $($type::$variant => $name),* }
            }

            /// The value of a name.
            pub fn from_name(name: &str) -> Option<Self> {
                match name { $($name => Some($type::$variant),)* _ => None }
            }
        }
    };
}
pub(crate) use named;
