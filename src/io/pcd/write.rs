//! Writing: binary rows.

use crate::io::cloud::to_byte;
use crate::io::text::spill;
use crate::mesh::Mesh;
use crate::numeric::vector::Vec3;
use std::io::{self, Write};

/// Writes the vertices as binary PCD 0.7: positions, normals, colours and classes.
///
/// Coordinates and normals are of single precision where all of them are exactly that, else double.
/// Colours are rounded to bytes: `rgb`, packed in a float as most readers expect it, or `rgba` where one
/// is not opaque. Cost: linear.
pub fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let plan = Plan::new(mesh);
    let mut bytes = plan.header(mesh).into_bytes();
    for (v, position) in mesh.positions.iter().enumerate() {
        push(&mut bytes, *position, plan.wide_positions);
        if let Some(normals) = &mesh.normals {
            push(&mut bytes, normals[v], plan.wide_normals);
        }
        if let Some(colors) = &mesh.colors {
            let [red, green, blue, alpha] = colors[v].map(to_byte);
            let alpha = if plan.alpha { alpha } else { 0 };
            bytes.extend([blue, green, red, alpha]);
        }
        if let Some(classes) = &mesh.classes {
            bytes.push(classes[v]);
        }
        spill(&mut bytes, out)?;
    }
    out.write_all(&bytes)
}

/// The types chosen.
struct Plan {
    wide_positions: bool,
    wide_normals: bool,
    alpha: bool,
}

impl Plan {
    fn new(mesh: &Mesh) -> Plan {
        let colors = mesh.colors.as_deref().unwrap_or_default();
        Plan {
            wide_positions: is_wide(&mesh.positions),
            wide_normals: is_wide(mesh.normals.as_deref().unwrap_or_default()),
            alpha: colors.iter().any(|color| to_byte(color[3]) != u8::MAX),
        }
    }

    fn header(&self, mesh: &Mesh) -> String {
        let mut columns: Vec<(&str, usize, char)> = Vec::new();
        let wide = |wide: bool| if wide { 8 } else { 4 };
        let size = wide(self.wide_positions);
        columns.extend(["x", "y", "z"].map(|name| (name, size, 'F')));
        if mesh.normals.is_some() {
            let size = wide(self.wide_normals);
            columns.extend(["normal_x", "normal_y", "normal_z"].map(|name| (name, size, 'F')));
        }
        if mesh.colors.is_some() {
            columns.push(if self.alpha {
                ("rgba", 4, 'U')
            } else {
                ("rgb", 4, 'F')
            });
        }
        if mesh.classes.is_some() {
            columns.push(("classification", 1, 'U'));
        }
        let line = |key: &str, word: &dyn Fn(&(&str, usize, char)) -> String| {
            let words: Vec<String> = columns.iter().map(word).collect();
            format!("{key} {}\n", words.join(" "))
        };
        let count = mesh.positions.len();
        [
            "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n".to_owned(),
            line("FIELDS", &|(name, _, _)| (*name).to_owned()),
            line("SIZE", &|(_, size, _)| size.to_string()),
            line("TYPE", &|(_, _, kind)| kind.to_string()),
            line("COUNT", &|_| "1".to_owned()),
            format!("WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"),
            format!("POINTS {count}\nDATA binary\n"),
        ]
        .concat()
    }
}

/// Whether a coordinate is not exactly a 32-bit number.
fn is_wide(vectors: &[Vec3]) -> bool {
    let is_wide = |c: &f64| f64::from(*c as f32) != *c;
    vectors.as_flattened().iter().any(is_wide)
}

fn push(bytes: &mut Vec<u8>, vector: Vec3, wide: bool) {
    for c in vector {
        if wide {
            bytes.extend(c.to_le_bytes());
        } else {
            bytes.extend((c as f32).to_le_bytes());
        }
    }
}
