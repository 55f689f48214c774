//! Shapes to SVG.

use super::super::colour::Srgb;
use super::super::font::CAP_OF_EM;
use super::super::text::Align;
use super::scene::{HALO, MARK_EDGE, MARK_STROKE, Outline, Scene, Shape, Text, outline};
use std::fmt::Write;

/// One family with its usual stand-ins, all of them no wider than the stroke font that the layout
/// measures with.
const FONTS: &str = "Helvetica, Arial, 'Liberation Sans', sans-serif";

/// The scene as a document that ends with a newline.
pub(super) fn write(scene: &Scene, title: &str) -> String {
    let (width, height) = (scene.width, scene.height);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"{FONTS}\" stroke-linecap=\"round\" \
         stroke-linejoin=\"round\">\n"
    );
    push(&mut out, format_args!("<title>{}</title>", escaped(title)));
    let page = format_args!("<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>");
    push(&mut out, page);
    for shape in &scene.shapes {
        match shape {
            Shape::Box { from, to, colour } => push(
                &mut out,
                format_args!(
                    "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"/>",
                    short(from[0]),
                    short(from[1]),
                    short(to[0] - from[0]),
                    short(to[1] - from[1]),
                    hex(*colour)
                ),
            ),
            Shape::Path {
                points,
                width,
                colour,
                dash,
            } => path(&mut out, points, *width, *colour, *dash),
            Shape::Mark {
                marker,
                at,
                radius,
                colour,
                hint,
            } => {
                if let Some(outline) = outline(*marker, *radius) {
                    mark(&mut out, &outline, *at, *colour, hint);
                }
            }
            Shape::Text(text) => words(&mut out, text),
        }
    }
    out.push_str("</svg>\n");
    out
}

fn push(out: &mut String, line: std::fmt::Arguments) {
    writeln!(out, "{line}").expect("a string takes all text");
}

fn path(out: &mut String, points: &[[f64; 2]], width: f64, colour: Srgb, dash: Option<[f64; 2]>) {
    let dash = dash.map_or(String::new(), |[ink, white]| {
        format!(
            " stroke-dasharray=\"{} {}\" stroke-linecap=\"butt\"",
            short(ink),
            short(white)
        )
    });
    push(
        out,
        format_args!(
            "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{dash}/>",
            along(points, [0.0; 2]),
            hex(colour),
            short(width)
        ),
    );
}

/// Points, moved by `by`, as the data of a path.
fn along(points: &[[f64; 2]], by: [f64; 2]) -> String {
    let mut data = String::new();
    for (i, p) in points.iter().enumerate() {
        let verb = if i == 0 { 'M' } else { 'L' };
        let (x, y) = (short(p[0] + by[0]), short(p[1] + by[1]));
        write!(data, "{verb}{x} {y}").expect("a string takes all text");
    }
    data
}

fn mark(out: &mut String, outline: &Outline, at: [f64; 2], colour: Srgb, hint: &str) {
    let colour = hex(colour);
    let edge = short(MARK_EDGE);
    let stroke = short(MARK_STROKE);
    let (name, shape) = match outline {
        Outline::Circle { radius, full } => {
            let (x, y) = (short(at[0]), short(at[1]));
            let look = if *full {
                format!("fill=\"{colour}\" stroke=\"#fff\" stroke-width=\"{edge}\"")
            } else {
                format!("fill=\"#fff\" stroke=\"{colour}\" stroke-width=\"{stroke}\"")
            };
            let r = short(*radius);
            ("circle", format!("cx=\"{x}\" cy=\"{y}\" r=\"{r}\" {look}"))
        }
        Outline::Polygon(points) => {
            let data = along(points, at);
            let look = format!("fill=\"{colour}\" stroke=\"#fff\" stroke-width=\"{edge}\"");
            ("path", format!("d=\"{data}Z\" {look}"))
        }
        Outline::Strokes(strokes) => {
            let data: String = strokes.iter().map(|s| along(s, at)).collect();
            let look = format!("stroke=\"{colour}\" stroke-width=\"{stroke}\"");
            ("path", format!("d=\"{data}\" {look}"))
        }
    };
    if hint.is_empty() {
        push(out, format_args!("<{name} {shape}/>"));
    } else {
        let hint = escaped(hint);
        push(
            out,
            format_args!("<{name} {shape}><title>{hint}</title></{name}>"),
        );
    }
}

fn words(out: &mut String, text: &Text) {
    let at = text.at.map(short);
    let turn = if text.turned {
        format!(" transform=\"rotate(-90 {} {})\"", at[0], at[1])
    } else {
        String::new()
    };
    let colour = hex(text.colour);
    for (words, across, above, cap) in text.parts() {
        // A text in one piece hangs as it is told, whatever its font's widths are; an exponent
        // needs its base to begin where it was measured.
        let (x, anchor) = match (text.align, text.words.power.is_empty()) {
            (Align::Centre, true) => (text.at[0], " text-anchor=\"middle\""),
            (Align::Right, true) => (text.at[0], " text-anchor=\"end\""),
            _ => (text.at[0] + across, ""),
        };
        let place = format!(
            "x=\"{}\" y=\"{}\" font-size=\"{}\"{anchor}{turn}",
            short(x),
            short(text.at[1] - above),
            short(cap / CAP_OF_EM)
        );
        let words = escaped(words);
        if text.halo {
            // Twice, as not every viewer can be told to paint the stroke first.
            let halo = format!(
                "fill=\"none\" stroke=\"#fff\" stroke-width=\"{}\"",
                short(HALO)
            );
            push(
                out,
                format_args!("<text {place} {halo} aria-hidden=\"true\">{words}</text>"),
            );
        }
        push(
            out,
            format_args!("<text {place} fill=\"{colour}\">{words}</text>"),
        );
    }
}

/// A length with at most two decimals, and no more than it needs.
fn short(v: f64) -> String {
    let text = format!("{v:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match text {
        "-0" => "0".to_owned(),
        _ => text.to_owned(),
    }
}

fn hex([r, g, b]: Srgb) -> String {
    if [r, g, b] == [255; 3] {
        return "#fff".to_owned();
    }
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Text as XML allows it: marks of its own are written out, control characters become spaces.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
