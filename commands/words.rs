//! Figures put into words for people, and into JSON for programs.

use crate::table::short;
use scantle::measure::animation_error::AnimationError;
use scantle::report::{Content, Input, Output, Warning};
use serde::Serialize;
use std::fmt::Write;

/// A JSON document that ends with a newline: spread out, or on one line.
pub fn json(value: &impl Serialize, spread: bool) -> Vec<u8> {
    let text = if spread {
        serde_json::to_vec_pretty(value)
    } else {
        serde_json::to_vec(value)
    };
    let mut text = text.expect("what is reported has names for keys");
    text.push(b'\n');
    text
}

/// `8 vertices, 12 triangles`, `64 x 64 x 32 voxels of u8`, `1 document`.
pub fn content(content: &Content) -> String {
    let mut parts = Vec::new();
    let counts = [
        (content.vertices, "vertex", "vertices"),
        (content.triangles, "triangle", "triangles"),
        (content.segments, "segment", "segments"),
        (content.points, "point", "points"),
        (content.splats, "splat", "splats"),
        (content.atoms, "atom", "atoms"),
        (content.residues, "residue", "residues"),
        (content.models, "model", "models"),
        (content.frames, "frame", "frames"),
        (content.features, "feature", "features"),
        (content.places, "place", "places"),
        (content.documents, "document", "documents"),
    ];
    for (count, one, many) in counts {
        if let Some(count) = count {
            parts.push(counted(count, one, many));
        }
    }
    if let Some([x, y, z]) = content.dims {
        let sample = content.sample_type.as_deref().unwrap_or("unknown type");
        parts.push(format!("{x} x {y} x {z} voxels of {sample}"));
    }
    if let Some([x, y]) = content.pixels {
        let (channels, bits) = (content.channels.unwrap_or(0), content.bits.unwrap_or(0));
        let channels = counted(channels, "channel", "channels");
        parts.push(format!("{x} x {y} pixels, {channels} of {bits} bits"));
    }
    if let Some([x, y]) = content.cells {
        let sample = content.sample_type.as_deref().unwrap_or("unknown type");
        parts.push(format!("{x} x {y} heights of {sample}"));
    }
    if let Some(crs) = &content.crs {
        parts.push(crs.chars().flat_map(char::escape_debug).collect());
    }
    parts.join(", ")
}

/// `1 vertex`, `8 vertices`.
pub fn counted(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// How many frames of how many vertices.
pub fn frames(frames: u64, vertices: u64) -> String {
    let [frames, vertices] = [
        (frames, "frame", "frames"),
        (vertices, "vertex", "vertices"),
    ]
    .map(|(count, one, many)| counted(count, one, many));
    format!("{frames} of {vertices}")
}

/// How far an animation is from another.
pub fn animation_error(error: &AnimationError) -> String {
    let share = match error.kg_centroid_percent {
        Some(percent) => format!("{} %", short(percent)),
        None => "no share of a reference without extent".to_owned(),
    };
    let (rmse, farthest) = (short(error.rmse), &error.max_error);
    let mut said = format!("error {share}, root mean square {rmse}");
    if farthest.distance > 0.0 {
        let distance = short(farthest.distance);
        let (frame, vertex) = (farthest.frame, farthest.vertex);
        said += &format!(", at most {distance} (frame {frame}, vertex {vertex})");
    }
    said
}

/// A word from a file, short and without what a terminal takes for a command.
pub fn shown(word: &str) -> String {
    word.chars().take(32).flat_map(char::escape_debug).collect()
}

/// What was read.
pub fn input(input: &Input) -> String {
    let (format, bytes) = (&input.format, input.bytes);
    format!("{format}, {bytes} bytes, {}", content(&input.content))
}

/// Where something was written: ` -> cube.ply (ply, 394 bytes)`.
pub fn output(output: &Output) -> String {
    let (path, format, bytes) = (&output.path, &output.format, output.bytes);
    format!(" -> {path} ({format}, {bytes} bytes)")
}

/// `faces without area (12, first 4711)`.
pub fn warning(warning: &Warning) -> String {
    let mut text = format!("{} ({}", warning.message, warning.count);
    if let Some(first) = warning.first {
        let _ = write!(text, ", first {first}");
    }
    text.push(')');
    text
}

/// Words as one line of shell, quoted where there is need.
pub fn shell(words: &[String]) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_@%+=:,./-".contains(c);
    let quoted: Vec<String> = words
        .iter()
        .map(|word| {
            if !word.is_empty() && word.chars().all(is_plain) {
                word.clone()
            } else {
                format!("'{}'", word.replace('\'', r"'\''"))
            }
        })
        .collect();
    quoted.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_the_words_back() {
        let words = ["a b.ply", "it's", "", "--mode=z", "$x", "1,-2.5"].map(str::to_owned);
        let line = shell(&words);
        assert_eq!(line, r"'a b.ply' 'it'\''s' '' --mode=z '$x' 1,-2.5");
    }

    #[test]
    fn counts_are_said_in_the_right_number() {
        let mesh = Content {
            vertices: Some(1),
            triangles: Some(12),
            ..Content::default()
        };
        assert_eq!(content(&mesh), "1 vertex, 12 triangles");
        let grid = Content {
            dims: Some([4, 5, 6]),
            sample_type: Some("u8".into()),
            ..Content::default()
        };
        assert_eq!(content(&grid), "4 x 5 x 6 voxels of u8");
    }

    #[test]
    fn a_warning_names_the_first() {
        let first = |first| warning(&Warning::new("flat", "flat faces", 12, first));
        assert_eq!(first(Some(4711)), "flat faces (12, first 4711)");
        assert_eq!(first(None), "flat faces (12)");
    }
}
