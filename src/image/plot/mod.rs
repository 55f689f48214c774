//! Plots: one description, written as SVG or as PNG.
//!
//! A [`Plot`] says what is to be seen, never where: the layout turns it into shapes once, and two
//! writers draw the same shapes. Colours are those of all pictures, but nothing depends on them:
//! series differ in their markers, a front is a black line. Equal plots give equal bytes.

mod axis;
mod labels;
mod layout;
mod paint;
mod scene;
mod svg;
#[cfg(test)]
mod tests;

use super::colour::{OKABE_ITO, Srgb};
use super::png;

/// Series of points over two axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// What the plot is about, at the top.
    pub title: String,
    /// The one figure that matters, in the lower right corner.
    pub caption: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The series, the most important one first: it is drawn on top of the others, and its labels
    /// are the last to be left out.
    pub series: Vec<Series>,
    /// Values that divide good from bad, drawn as dashed lines across the plot.
    pub guides: Vec<Guide>,
    /// Pixels across, at least [`Plot::SMALLEST`].
    pub width: usize,
    /// Pixels down, at least [`Plot::SMALLEST`].
    pub height: usize,
}

/// One of the two axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The quantity, and its unit in brackets: `cost (s)`.
    pub title: String,
    /// How numbers become lengths.
    pub scale: Scale,
    /// Numbers that the axis reaches whatever the points are; `None` fits it to the points.
    pub reach: Option<[f64; 2]>,
}

/// How numbers become lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equal lengths.
    Linear,
    /// Equal ratios are equal lengths; ticks at powers of ten. Zero has a lane of its own.
    Log,
    /// Equal ratios are equal lengths; ticks at powers of two. Zero has a lane of its own.
    Log2,
}

/// Points of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The name in the legend; a series without one is not in it.
    pub name: String,
    /// The points, in the order of the line, the most important label first.
    pub points: Vec<Point>,
    /// The line through the points.
    pub line: Line,
    /// What stands at a point.
    pub marker: Marker,
    /// The colour of both.
    pub colour: Srgb,
}

/// One point. One that has no place on the axes (not finite, or negative on a logarithmic axis) is
/// left out, and a note on the plot counts it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Point {
    /// Where it is along the horizontal axis.
    pub x: f64,
    /// Where it is along the vertical axis.
    pub y: f64,
    /// The least and the greatest `x` seen, drawn as a horizontal bar.
    pub x_spread: Option<[f64; 2]>,
    /// The least and the greatest `y` seen, drawn as a vertical bar.
    pub y_spread: Option<[f64; 2]>,
    /// What is written beside it where there is room; empty for nothing.
    pub label: String,
}

/// The line through the points of a series. It is broken where a point is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Line {
    /// Points only.
    None,
    /// Straight from point to point.
    Straight,
    /// Level to the next point's `x`, then up or down to it: a front, which promises between two
    /// settings no more than the cheaper one reaches.
    Steps,
}

/// What stands at a point. All differ in their outline, so that they can be told apart in grey.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// Nothing.
    None,
    /// A full circle.
    Disc,
    /// A full square.
    Square,
    /// A full triangle that stands on its base.
    Triangle,
    /// A full square that stands on a corner.
    Diamond,
    /// A full triangle that stands on its tip.
    Inverted,
    /// An upright cross.
    Plus,
    /// A lying cross.
    Cross,
    /// An empty circle: what is there but counts less.
    Ring,
}

/// A value worth a line across the plot, such as a limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Guide {
    /// The axis on which the value lies.
    pub on: On,
    /// The value; the axis reaches it. One that has no place on the axis draws nothing.
    pub value: f64,
    /// What is written along the line.
    pub text: String,
}

/// One of the axes, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum On {
    /// The horizontal axis: the line is upright.
    X,
    /// The vertical axis: the line is level.
    Y,
}

impl Plot {
    /// Pixels across, unless asked otherwise.
    pub const WIDTH: usize = 1024;

    /// Pixels down, unless asked otherwise.
    pub const HEIGHT: usize = 640;

    /// The smallest plot either way, in pixels: below it there is no room for the axes.
    pub const SMALLEST: usize = 320;

    /// A plot of the usual size without points.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Plot {
            title: title.into(),
            caption: String::new(),
            x,
            y,
            series: Vec::new(),
            guides: Vec::new(),
            width: Self::WIDTH,
            height: Self::HEIGHT,
        }
    }

    /// The plot as an SVG document: text stays text, no scripts, and the label of a point is its
    /// tooltip.
    ///
    /// Cost: linear in the points, about 80 bytes each and once its label; placing labels is
    /// linear in points times labels.
    pub fn svg(&self) -> String {
        svg::write(&layout::scene(self), &self.title)
    }

    /// The plot as a PNG file, with fewer colours where it would be too large for a first page.
    ///
    /// Cost: as of [`Plot::svg`], and linear in the pixels.
    pub fn png(&self) -> Vec<u8> {
        let picture = paint::picture(&layout::scene(self));
        let full = png::encode(&picture);
        if full.len() <= png::README_LIMIT {
            return full;
        }
        png::encode_within(&picture, png::README_LIMIT)
    }
}

impl Axis {
    /// An axis that fits its points.
    pub fn new(title: impl Into<String>, scale: Scale) -> Self {
        Axis {
            title: title.into(),
            scale,
            reach: None,
        }
    }
}

impl Series {
    /// Points in the look of series `index`: a colour and a marker for each, which go round after
    /// seven.
    pub fn new(name: impl Into<String>, index: usize, points: Vec<Point>) -> Self {
        /// Blue, vermillion, green, purple, orange, sky blue, black: those that stand out most on
        /// white first, and no yellow.
        const COLOURS: [usize; 7] = [5, 6, 3, 7, 1, 2, 0];
        const MARKERS: [Marker; 7] = [
            Marker::Disc,
            Marker::Square,
            Marker::Triangle,
            Marker::Diamond,
            Marker::Inverted,
            Marker::Plus,
            Marker::Cross,
        ];
        Series {
            name: name.into(),
            points,
            line: Line::None,
            marker: MARKERS[index % MARKERS.len()],
            colour: OKABE_ITO[COLOURS[index % COLOURS.len()]],
        }
    }

    /// The points of a front from the cheapest to the dearest: full circles on a black line.
    pub fn front(name: impl Into<String>, points: Vec<Point>) -> Self {
        Series {
            line: Line::Steps,
            colour: OKABE_ITO[0],
            ..Series::new(name, 0, points)
        }
    }
}
