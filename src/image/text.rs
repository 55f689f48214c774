//! Text on pictures.

use super::colour::Srgb;
use super::font::{CAP, GAP, glyph};
use super::raster::Picture;

/// Width of a stroke, as a share of a capital's height.
const STROKE: f64 = 0.125;

/// Degrees between points on a curve.
const STEP: f64 = 12.0;

/// Where a text hangs on its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// It begins there.
    Left,
    /// Its middle is there.
    Centre,
    /// It ends there.
    Right,
}

/// The width of a text in pixels, for capitals `cap` pixels high.
pub fn width(text: &str, cap: f64) -> f64 {
    let units: f64 = text.chars().map(|c| glyph(c).0 + GAP).sum();
    (units - GAP).max(0.0) * cap / CAP
}

/// The text itself when it is at most `room` pixels wide, else its beginning and an ellipsis.
pub fn shortened(text: &str, cap: f64, room: f64) -> String {
    if width(text, cap) <= room {
        return text.to_owned();
    }
    let mut units = glyph('…').0;
    let mut end = None;
    for (at, c) in text.char_indices() {
        if units * cap / CAP > room {
            break;
        }
        end = Some(at);
        units += glyph(c).0 + GAP;
    }
    end.map_or(String::new(), |end| format!("{}…", &text[..end]))
}

/// Writes a text with its baseline at height `at[1]`, hung at `at[0]`, in pixels from the top left.
///
/// Letters are smooth: a pixel takes as much ink as the stroke covers of a disc in it.
pub fn draw(picture: &mut Picture, text: &str, at: [f64; 2], cap: f64, align: Align, colour: Srgb) {
    let left = match align {
        Align::Left => at[0],
        Align::Centre => at[0] - width(text, cap) * 0.5,
        Align::Right => at[0] - width(text, cap),
    };
    for mut strokes in letters(text, cap) {
        for s in &mut strokes {
            *s = s.map(|[x, y]| [left + x, at[1] + y]);
        }
        draw_strokes(picture, &strokes, stroke(cap), colour);
    }
}

/// The width of a letter's strokes in pixels, for capitals `cap` pixels high.
pub(super) fn stroke(cap: f64) -> f64 {
    (cap * STROKE).max(1.0)
}

/// The strokes of each letter, in pixels from where the text begins on its baseline, y downwards.
pub(super) fn letters(text: &str, cap: f64) -> impl Iterator<Item = Vec<[[f64; 2]; 2]>> {
    let unit = cap / CAP;
    text.chars().scan(0.0, move |begin, c| {
        let (ink, path) = glyph(c);
        let mut strokes = segments(path);
        for s in &mut strokes {
            *s = s.map(|[px, py]| [*begin + px * unit, -py * unit]);
        }
        *begin += (ink + GAP) * unit;
        Some(strokes)
    })
}

/// Draws round-ended strokes, all as one shape: where they cross, ink is not laid twice.
///
/// Cost: linear in the pixels of the boxes around each stroke.
pub(super) fn draw_strokes(
    picture: &mut Picture,
    strokes: &[[[f64; 2]; 2]],
    width: f64,
    colour: Srgb,
) {
    let reach = width * 0.5 + 1.0;
    let size = [picture.width() as f64, picture.height() as f64];
    // The first and the last pixel of a stroke along an axis, cut to the picture.
    let span = |[a, b]: [[f64; 2]; 2], axis: usize| {
        let low = (a[axis].min(b[axis]) - reach).floor();
        let high = (a[axis].max(b[axis]) + reach).ceil();
        low.clamp(0.0, size[axis]) as usize..high.clamp(0.0, size[axis]) as usize
    };
    let whole = |axis: usize| {
        let spans = || strokes.iter().map(|s| span(*s, axis));
        let low = spans().map(|s| s.start).min().unwrap_or(0);
        low..spans().map(|s| s.end).max().unwrap_or(0)
    };
    let (columns, rows) = (whole(0), whole(1));
    let mut cover = vec![0.0_f64; columns.len() * rows.len()];
    for s in strokes {
        for y in span(*s, 1) {
            for x in span(*s, 0) {
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let at = &mut cover[(y - rows.start) * columns.len() + x - columns.start];
                *at = at.max(width * 0.5 - distance(p, *s) + 0.5);
            }
        }
    }
    for (row, y) in cover.chunks(columns.len().max(1)).zip(rows) {
        for (part, x) in row.iter().zip(columns.clone()) {
            if *part > 0.0 {
                picture.blend(x as isize, y as isize, colour, *part);
            }
        }
    }
}

/// The distance of a point from a stroke's centre line.
pub(super) fn distance(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = along[0] * along[0] + along[1] * along[1];
    let t = if square > 0.0 {
        ((to[0] * along[0] + to[1] * along[1]) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (to[0] - along[0] * t).hypot(to[1] - along[1] * t)
}

/// The strokes of a path as straight pieces, in its own units.
fn segments(path: &str) -> Vec<[[f64; 2]; 2]> {
    let mut pieces = Vec::new();
    let mut pen: Option<[f64; 2]> = None;
    let mut words = path.split_ascii_whitespace();
    while let Some(word) = words.next() {
        let mut number = || words.next().and_then(|w| w.parse().ok()).unwrap_or(0.0);
        let mut line_to = |pen: &mut Option<[f64; 2]>, to: [f64; 2]| {
            if let Some(from) = *pen {
                pieces.push([from, to]);
            }
            *pen = Some(to);
        };
        match word {
            "m" => pen = Some([number(), number()]),
            "l" => line_to(&mut pen, [number(), number()]),
            "d" => {
                let at = [number(), number()];
                // A dot is a short ring, thicker than the stroke.
                for turn in 0..4 {
                    let angle = f64::from(turn) * std::f64::consts::FRAC_PI_2;
                    let to = [at[0] + 0.22 * angle.cos(), at[1] + 0.22 * angle.sin()];
                    pieces.push([at, to]);
                }
                pen = None;
            }
            _ => {
                let (centre, radius) = ([number(), number()], [number(), number()]);
                let (from, to) = match word {
                    "o" => (0.0, 360.0),
                    _ => (number(), number()),
                };
                if word != "a" {
                    pen = None;
                }
                let steps = ((to - from).abs() / STEP).ceil().max(1.0);
                for i in 0..=steps as u32 {
                    let angle = (from + (to - from) * f64::from(i) / steps).to_radians();
                    let on = [
                        centre[0] + radius[0] * angle.cos(),
                        centre[1] + radius[1] * angle.sin(),
                    ];
                    line_to(&mut pen, on);
                }
                if word == "o" {
                    pen = None;
                }
            }
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::super::colour::{INK, WHITE};
    use super::super::font::GLYPHS;
    use super::*;

    #[test]
    fn the_font_has_all_of_ascii_and_its_paths_are_well_formed() {
        for c in ' '..='~' {
            assert!(GLYPHS.iter().any(|g| g.0 == c), "{c:?}");
        }
        for (c, ink, path) in GLYPHS {
            for word in path.split_ascii_whitespace() {
                let known = ["m", "l", "a", "A", "o", "d"].contains(&word);
                assert!(known || word.parse::<f64>().is_ok(), "{c:?}: {word}");
            }
            for [x, y] in segments(path).into_iter().flatten() {
                assert!((-0.8..=ink + 0.8).contains(&x), "{c:?}: {x} of {ink}");
                assert!((-5.0..=18.0).contains(&y), "{c:?}: {y}");
            }
        }
    }

    #[test]
    fn no_two_letters_look_alike() {
        let look = |c: char| {
            let mut picture = Picture::new(24, 24, WHITE);
            draw(
                &mut picture,
                &c.to_string(),
                [4.0, 18.0],
                12.0,
                Align::Left,
                INK,
            );
            picture
        };
        let letters: Vec<char> = (' '..='~').collect();
        for (i, a) in letters.iter().enumerate() {
            for b in &letters[..i] {
                assert_ne!(look(*a), look(*b), "{a} {b}");
            }
        }
    }

    #[test]
    fn text_stays_where_it_was_hung() {
        let mut picture = Picture::new(200, 30, WHITE);
        draw(
            &mut picture,
            "right",
            [190.0, 20.0],
            10.0,
            Align::Right,
            INK,
        );
        let wide = width("right", 10.0);
        for y in 0..30 {
            for x in 0..200 {
                let inside = (190.0 - wide - 2.0..192.0).contains(&(x as f64));
                assert!(inside || picture.get(x, y) == WHITE, "{x} {y}");
            }
        }
        draw(
            &mut picture,
            "far outside",
            [-1e9, 1e9],
            10.0,
            Align::Left,
            INK,
        );
    }

    #[test]
    fn a_long_text_is_cut_to_its_room() {
        let long = "a very long name of a file that does not fit";
        let short = shortened(long, 10.0, 120.0);
        assert!(width(&short, 10.0) <= 120.0 && short.ends_with('…') && short.len() > 10);
        assert_eq!(shortened("fits", 10.0, 120.0), "fits");
        assert_eq!(shortened("no room", 10.0, 0.5), "");
    }
}
