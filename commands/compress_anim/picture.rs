//! The picture of an animation as it was, as it is decoded, and where they differ.

use scantle::anim::Clip;
use scantle::anim::compress::Stream;
use scantle::error::{Error, Result, number};
use scantle::image::colour::{CLAY, Srgb, amount};
use scantle::measure::animation_error::AnimationError;
use scantle::mesh::Mesh;
use scantle::numeric::vector::{length, sub};
use scantle::render::preview::{self, Panel, What};

/// Colours that distances are told apart by.
const SHADES: usize = 24;

/// Draws the frame of most error three times: the original, the decoded, and the decoded in the colours
/// of its distance from the original, as a PNG file.
pub fn of_stream(
    clip: &Clip,
    bytes: &[u8],
    error: &AnimationError,
    caption: &str,
) -> Result<Vec<u8>> {
    let frame = worst(error);
    let given = clip.mesh_at(frame);
    let stream = Stream::open(bytes, Some(frame..frame + 1)).map_err(Error::Geometry)?;
    let mut decoded = given.clone();
    stream
        .each_frame(frame..frame + 1, |_, positions| {
            decoded.positions = positions.to_vec()
        })
        .map_err(Error::Geometry)?;
    let most = error.per_frame[frame].max;
    let shaded = shades(&given, &decoded, most);
    let parts: Vec<(&Mesh, Srgb)> = shaded
        .iter()
        .map(|(mesh, colour)| (mesh, *colour))
        .collect();
    let name = format!("frame {frame}");
    let label = format!("error, 0 to {}", number((most * 1e4).round() / 1e4));
    let label = if most < 1e-3 {
        format!("error, 0 to {most:.1e}")
    } else {
        label
    };
    let panel = |label, what| Panel {
        label,
        what,
        colour: CLAY,
    };
    let panels = [
        panel(&name, What::Mesh(&given)),
        panel("decoded", What::Mesh(&decoded)),
        panel(&label, What::Parts(&parts)),
    ];
    preview::side_by_side(&panels, caption, "", &preview::Params::DEFAULT)
}

/// The frame of most error.
fn worst(error: &AnimationError) -> usize {
    let frames = error.per_frame.iter().enumerate();
    frames.fold(0, |worst, (f, frame)| {
        if frame.rms > error.per_frame[worst].rms {
            f
        } else {
            worst
        }
    })
}

/// The triangles of a mesh by how far their corners are from where they should be, from 0 to `most`.
fn shades(given: &Mesh, decoded: &Mesh, most: f64) -> Vec<(Mesh, Srgb)> {
    let apart = |v: u32| {
        length(sub(
            given.positions[v as usize],
            decoded.positions[v as usize],
        ))
    };
    let shade = |t: &[u32; 3]| {
        let mean = t.iter().map(|v| apart(*v)).sum::<f64>() / 3.0;
        let share = if most > 0.0 { mean / most } else { 0.0 };
        ((share * SHADES as f64) as usize).min(SHADES - 1)
    };
    let mut triangles = vec![Vec::new(); SHADES];
    for t in &decoded.triangles {
        triangles[shade(t)].push(*t);
    }
    let made = triangles
        .into_iter()
        .enumerate()
        .filter(|(_, some)| !some.is_empty());
    made.map(|(i, triangles)| {
        let mesh = Mesh::from_triangles(decoded.positions.clone(), triangles).compacted();
        (mesh, amount((i as f64 + 0.5) / SHADES as f64))
    })
    .collect()
}
