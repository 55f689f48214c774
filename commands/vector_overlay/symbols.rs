//! What is drawn of features: areas, lines and points by the styles of their layers.

use scantle::terrain::overlay::{Drawn, Style, Unit};
use scantle::terrain::style::{Breadth, Sheet, dashes};
use scantle::vector::{Layer, Shape};
use std::borrow::Cow;

/// A part of a feature that is drawn in one colour.
struct Symbol<'a> {
    shape: Cow<'a, Shape>,
    style: Style,
    /// Counted from 1 over all layers.
    feature: u32,
}

/// All that is drawn, in order.
pub struct Symbols<'a> {
    symbols: Vec<Symbol<'a>>,
    empty: u64,
}

impl<'a> Symbols<'a> {
    /// Areas, then their outlines; lines; points: layer by layer in the order of their features.
    pub fn of(layers: &'a [Layer], sheet: &Sheet) -> Self {
        let mut all = Symbols {
            symbols: Vec::new(),
            empty: 0,
        };
        let mut feature = 0;
        for (number, layer) in layers.iter().enumerate() {
            for one in &layer.features {
                feature += 1;
                let look = sheet.style(&layer.name, number, one);
                let fill = look.fill.map(Style::of);
                let stroke = look
                    .stroke
                    .map(|colour| wide(Style::of(colour), look.width));
                let mut push = |shape: Cow<'a, Shape>, style: Option<Style>| {
                    let style = style.map(|style| Style {
                        opacity: look.opacity,
                        ..style
                    });
                    all.symbols.extend(style.map(|style| Symbol {
                        shape,
                        style,
                        feature,
                    }));
                };
                match &one.shape {
                    Shape::Empty => all.empty += 1,
                    Shape::Points(_) => {
                        let dot = fill.map(|style| wide(style, twice(look.radius)));
                        push(Cow::Borrowed(&one.shape), dot);
                    }
                    Shape::Lines(lines) => {
                        let shape = match look.dash {
                            Some(dash) => Cow::Owned(dashed(lines.iter(), dash)),
                            None => Cow::Borrowed(&one.shape),
                        };
                        push(shape, stroke);
                    }
                    Shape::Polygons(areas) => {
                        push(Cow::Borrowed(&one.shape), fill);
                        let outlines: Vec<_> = areas
                            .iter()
                            .flat_map(|area| &area.rings)
                            .map(|ring| ring.iter().chain(ring.first()).copied().collect())
                            .collect();
                        let shape = match look.dash {
                            Some(dash) => dashed(outlines.iter(), dash),
                            None => Shape::Lines(outlines),
                        };
                        push(Cow::Owned(shape), stroke);
                    }
                }
            }
        }
        all
    }

    /// What is drawn.
    pub fn drawn(&self) -> Vec<Drawn<'_>> {
        let all = self.symbols.iter();
        all.map(|symbol| Drawn {
            shape: &symbol.shape,
            style: symbol.style,
        })
        .collect()
    }

    /// Features without a shape.
    pub fn empty(&self) -> u64 {
        self.empty
    }

    /// The features of pixels, from the numbers of what is drawn on them.
    pub fn features_of(&self, drawn: &[u32]) -> Vec<u32> {
        let feature = |number: &u32| match number.checked_sub(1) {
            Some(at) => self.symbols[at as usize].feature,
            None => 0,
        };
        drawn.iter().map(feature).collect()
    }
}

fn wide(style: Style, width: Breadth) -> Style {
    let (width, unit) = match width {
        Breadth::Ground(width) => (width, Unit::Map),
        Breadth::Pixels(width) => (width, Unit::Pixels),
    };
    Style {
        width,
        unit,
        ..style
    }
}

fn twice(length: Breadth) -> Breadth {
    match length {
        Breadth::Ground(length) => Breadth::Ground(2.0 * length),
        Breadth::Pixels(length) => Breadth::Pixels(2.0 * length),
    }
}

fn dashed<'a>(lines: impl Iterator<Item = &'a Vec<[f64; 2]>>, dash: [f64; 2]) -> Shape {
    Shape::Lines(lines.flat_map(|line| dashes(line, dash)).collect())
}
