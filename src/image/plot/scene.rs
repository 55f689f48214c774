//! What both writers draw: a list of shapes in pixels from the top left.

use super::super::colour::Srgb;
use super::super::text::{self, Align};
use super::Marker;

/// The size of an exponent, as a share of its base.
pub(super) const RAISED: f64 = 0.72;

/// How far an exponent stands above the baseline, as a share of a capital.
pub(super) const RAISE: f64 = 0.55;

/// White between a base and its exponent, as a share of a capital.
const KERN: f64 = 0.12;

/// White around letters with a halo, in pixels, both sides together.
pub(super) const HALO: f64 = 3.0;

/// All shapes, from the lowest to the topmost.
pub(super) struct Scene {
    pub width: usize,
    pub height: usize,
    pub shapes: Vec<Shape>,
}

pub(super) enum Shape {
    /// A rectangle filled with one colour.
    Box {
        from: [f64; 2],
        to: [f64; 2],
        colour: Srgb,
    },
    /// A line of straight pieces with round ends.
    Path {
        points: Vec<[f64; 2]>,
        width: f64,
        colour: Srgb,
        /// Lengths of ink and of white.
        dash: Option<[f64; 2]>,
    },
    Mark {
        marker: Marker,
        at: [f64; 2],
        radius: f64,
        colour: Srgb,
        hint: String,
    },
    Text(Text),
}

/// A text, or a number with an exponent.
#[derive(Clone)]
pub(super) struct Text {
    pub words: Words,
    /// Where it hangs, on its baseline.
    pub at: [f64; 2],
    /// Height of a capital.
    pub cap: f64,
    pub align: Align,
    pub colour: Srgb,
    /// Whether it runs upwards.
    pub turned: bool,
    /// Whether lines below it make room for it.
    pub halo: bool,
}

/// What a text says: a base, and an exponent that may be empty.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Words {
    pub base: String,
    pub power: String,
}

impl Words {
    pub fn plain(text: impl Into<String>) -> Self {
        Words {
            base: text.into(),
            power: String::new(),
        }
    }

    /// The width in pixels, for capitals `cap` high.
    pub fn width(&self, cap: f64) -> f64 {
        let base = text::width(&self.base, cap);
        if self.power.is_empty() {
            return base;
        }
        base + KERN * cap + text::width(&self.power, cap * RAISED)
    }
}

impl Text {
    /// How far left of its point the text begins.
    pub fn before(&self) -> f64 {
        self.words.width(self.cap)
            * match self.align {
                Align::Left => 0.0,
                Align::Centre => 0.5,
                Align::Right => 1.0,
            }
    }

    /// The base and the exponent: the text, how far along its line it begins, how far above the
    /// baseline it stands, and its size.
    pub fn parts(&self) -> impl Iterator<Item = (&str, f64, f64, f64)> {
        let power = text::width(&self.words.base, self.cap) + KERN * self.cap;
        [
            (self.words.base.as_str(), 0.0, 0.0, self.cap),
            (
                self.words.power.as_str(),
                power,
                RAISE * self.cap,
                RAISED * self.cap,
            ),
        ]
        .into_iter()
        .filter(|(words, ..)| !words.is_empty())
        .map(|(words, along, above, cap)| (words, along - self.before(), above, cap))
    }
}

/// The outline of a marker around the origin.
pub(super) enum Outline {
    Circle { radius: f64, full: bool },
    Polygon(Vec<[f64; 2]>),
    Strokes([[[f64; 2]; 2]; 2]),
}

/// Strokes of rings and crosses, in pixels.
pub(super) const MARK_STROKE: f64 = 1.9;

/// White around full markers, in pixels: markers that overlap stay apart.
pub(super) const MARK_EDGE: f64 = 1.0;

/// The outline of a marker as large as a circle of `radius`; `None` for no marker.
pub(super) fn outline(marker: Marker, radius: f64) -> Option<Outline> {
    let polygon = |points: &[[f64; 2]]| {
        let scaled = points.iter().map(|p| p.map(|c| c * radius));
        Some(Outline::Polygon(scaled.collect()))
    };
    // Sizes at which the shapes have about the area of the circle.
    const SIDE: f64 = 0.88;
    const TIP: f64 = 1.24;
    const LEG: f64 = 0.8;
    match marker {
        Marker::None => None,
        Marker::Disc => Some(Outline::Circle { radius, full: true }),
        Marker::Ring => Some(Outline::Circle {
            radius,
            full: false,
        }),
        Marker::Square => polygon(&[[-SIDE, -SIDE], [SIDE, -SIDE], [SIDE, SIDE], [-SIDE, SIDE]]),
        Marker::Diamond => polygon(&[[0.0, -TIP], [TIP, 0.0], [0.0, TIP], [-TIP, 0.0]]),
        Marker::Triangle => polygon(&[[0.0, -1.35], [1.2, 0.8], [-1.2, 0.8]]),
        Marker::Inverted => polygon(&[[0.0, 1.35], [-1.2, -0.8], [1.2, -0.8]]),
        Marker::Plus => {
            let r = radius * 1.1;
            Some(Outline::Strokes([
                [[-r, 0.0], [r, 0.0]],
                [[0.0, -r], [0.0, r]],
            ]))
        }
        Marker::Cross => {
            let r = radius * LEG;
            Some(Outline::Strokes([[[-r, -r], [r, r]], [[-r, r], [r, -r]]]))
        }
    }
}
