//! Writing points as text.

use crate::io::cloud::to_byte;
use crate::io::text::{push_number, spill};
use crate::mesh::Mesh;
use std::io::{self, Write};

/// Writes the vertices parted by blanks: positions, then normals, then colours in bytes.
///
/// Every number is the shortest that reads back as the same. Cost: linear.
pub fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let plain = Columns {
        between: b' ',
        alpha: false,
        classes: false,
    };
    plain.write(mesh, Vec::new(), out)
}

/// Writes the vertices parted by commas after a line of names: positions, normals, colours in bytes, with
/// alpha where one is not opaque, and classes. Cost: linear.
pub fn write_csv(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let colors = mesh.colors.as_deref().unwrap_or_default();
    let columns = Columns {
        between: b',',
        alpha: colors.iter().any(|color| to_byte(color[3]) != u8::MAX),
        classes: true,
    };
    let parts = [
        ("x,y,z", true),
        (",nx,ny,nz", mesh.normals.is_some()),
        (",red,green,blue", mesh.colors.is_some()),
        (",alpha", columns.alpha),
        (",classification", mesh.classes.is_some()),
        ("\n", true),
    ];
    let names = parts.into_iter().filter(|(_, has)| *has);
    let names: String = names.map(|(name, _)| name).collect();
    columns.write(mesh, names.into_bytes(), out)
}

/// What is written beside positions, normals and colours.
struct Columns {
    between: u8,
    alpha: bool,
    classes: bool,
}

impl Columns {
    fn write(&self, mesh: &Mesh, mut text: Vec<u8>, out: &mut dyn Write) -> io::Result<()> {
        let classes = mesh.classes.as_ref().filter(|_| self.classes);
        for (v, [x, y, z]) in mesh.positions.iter().enumerate() {
            push_number(&mut text, *x);
            self.push(&mut text, *y);
            self.push(&mut text, *z);
            if let Some(normals) = &mesh.normals {
                normals[v].iter().for_each(|c| self.push(&mut text, *c));
            }
            if let Some(colors) = &mesh.colors {
                let channels = if self.alpha { 4 } else { 3 };
                let bytes = colors[v][..channels].iter().map(|c| to_byte(*c));
                bytes.for_each(|byte| self.push(&mut text, f64::from(byte)));
            }
            if let Some(classes) = classes {
                self.push(&mut text, f64::from(classes[v]));
            }
            text.push(b'\n');
            spill(&mut text, out)?;
        }
        out.write_all(&text)
    }

    fn push(&self, text: &mut Vec<u8>, value: f64) {
        text.push(self.between);
        push_number(text, value);
    }
}
