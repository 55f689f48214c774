//! Shapes to pixels.

use super::super::colour::{Srgb, WHITE};
use super::super::raster::Picture;
use super::super::text;
use super::scene::{HALO, MARK_EDGE, MARK_STROKE, Outline, Scene, Shape, Text, outline};

/// Draws all shapes on white.
pub(super) fn picture(scene: &Scene) -> Picture {
    let mut picture = Picture::new(scene.width, scene.height, WHITE);
    for shape in &scene.shapes {
        match shape {
            Shape::Box { from, to, colour } => picture.fill(*from, *to, *colour),
            Shape::Path {
                points,
                width,
                colour,
                dash,
            } => path(&mut picture, points, *width, *colour, *dash),
            Shape::Mark {
                marker,
                at,
                radius,
                colour,
                ..
            } => {
                if let Some(outline) = outline(*marker, *radius) {
                    mark(&mut picture, &outline, *at, *radius, *colour);
                }
            }
            Shape::Text(text) => words(&mut picture, text),
        }
    }
    picture
}

fn path(
    picture: &mut Picture,
    points: &[[f64; 2]],
    width: f64,
    colour: Srgb,
    dash: Option<[f64; 2]>,
) {
    let pieces = points.windows(2).map(|w| [w[0], w[1]]);
    let Some([ink, white]) = dash else {
        text::draw_strokes(picture, &pieces.collect::<Vec<_>>(), width, colour);
        return;
    };
    for [a, b] in pieces {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let at = |s: f64| {
            let t = s.min(length) / length.max(f64::MIN_POSITIVE);
            [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
        };
        let dashes = (length / (ink + white)).ceil() as usize;
        for i in 0..dashes {
            // Round ends add half a width on either side.
            let from = i as f64 * (ink + white) + width * 0.5;
            let piece = [at(from), at(from + ink - width)];
            text::draw_strokes(picture, &[piece], width, colour);
        }
    }
}

fn mark(picture: &mut Picture, outline: &Outline, at: [f64; 2], radius: f64, colour: Srgb) {
    let reach = radius * 2.0 + MARK_STROKE + MARK_EDGE;
    let range = |c: f64| (c - reach).floor() as isize..=(c + reach).ceil() as isize;
    for y in range(at[1]) {
        for x in range(at[0]) {
            let p = [x as f64 + 0.5 - at[0], y as f64 + 0.5 - at[1]];
            let mut lay = |colour, inside: f64| {
                if inside > -0.5 {
                    picture.blend(x, y, colour, inside + 0.5);
                }
            };
            match outline {
                Outline::Circle { radius, full } => {
                    let inside = radius - p[0].hypot(p[1]);
                    if *full {
                        lay(WHITE, inside + MARK_EDGE * 0.5);
                        lay(colour, inside - MARK_EDGE * 0.5);
                    } else {
                        lay(WHITE, inside);
                        lay(colour, MARK_STROKE * 0.5 - inside.abs());
                    }
                }
                Outline::Polygon(points) => {
                    let inside = depth(p, points);
                    lay(WHITE, inside + MARK_EDGE * 0.5);
                    lay(colour, inside - MARK_EDGE * 0.5);
                }
                Outline::Strokes(strokes) => {
                    let nearest = strokes.iter().map(|s| text::distance(p, *s));
                    let nearest = nearest.fold(f64::INFINITY, f64::min);
                    lay(colour, MARK_STROKE * 0.5 - nearest);
                }
            }
        }
    }
}

/// How deep a point lies inside a convex polygon, clockwise on the screen; negative outside.
fn depth(p: [f64; 2], points: &[[f64; 2]]) -> f64 {
    let mut depth = f64::INFINITY;
    for (i, a) in points.iter().enumerate() {
        let b = points[(i + 1) % points.len()];
        let along = [b[0] - a[0], b[1] - a[1]];
        let to = [p[0] - a[0], p[1] - a[1]];
        let area = along[0] * to[1] - along[1] * to[0];
        depth = depth.min(area / along[0].hypot(along[1]).max(f64::MIN_POSITIVE));
    }
    depth
}

fn words(picture: &mut Picture, text: &Text) {
    let place = |[x, y]: [f64; 2]| {
        let by = if text.turned { [y, -x] } else { [x, y] };
        [text.at[0] + by[0], text.at[1] + by[1]]
    };
    let letters: Vec<_> = text
        .parts()
        .flat_map(|(words, across, above, cap)| {
            text::letters(words, cap).map(move |strokes| (strokes, across, above, cap))
        })
        .map(|(strokes, across, above, cap)| {
            let put = |p: [f64; 2]| place([p[0] + across, p[1] - above]);
            let placed: Vec<_> = strokes.into_iter().map(|s| s.map(put)).collect();
            (placed, text::stroke(cap))
        })
        .collect();
    if text.halo {
        for (strokes, width) in &letters {
            text::draw_strokes(picture, strokes, width + HALO, WHITE);
        }
    }
    for (strokes, width) in &letters {
        text::draw_strokes(picture, strokes, *width, text.colour);
    }
}
