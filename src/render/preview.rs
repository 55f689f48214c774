//! Previews: what a command made, beside what it was made from.

use super::shade::{Subject, render};
use crate::camera::{Camera, Size, THREE_QUARTER};
use crate::error::Result;
use crate::image::colour::{self, FAINT_INK, INK, Linear, Srgb, WHITE};
use crate::image::png::{README_LIMIT, encode_within};
use crate::image::raster::Picture;
use crate::image::text::{self, Align};
use crate::mesh::Mesh;
use crate::numeric::vector::Vec3;
use crate::spatial::aabb::Aabb;
use crate::volume::Volume;
use crate::volume::surface::{boundary_faces, reduced};
use std::borrow::Cow;

/// Volumes of more voxels than this along a side are drawn reduced, which the caption then says.
pub const MAX_VOXELS: usize = 256;

/// Heights of capitals: of labels, of the caption and the scale bar.
const LABEL_CAP: f64 = 11.0;
const CAPTION_CAP: f64 = 9.5;

/// Rows under the panels for labels, and for caption and scale bar.
const LABEL_ROWS: usize = 26;
const FOOT_ROWS: usize = 50;

/// White at the left and right of text.
const SIDE: f64 = 24.0;

/// The direction that a model calls up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Up {
    /// +y, as in most files of graphics.
    Y,
    /// +z, as in files of engineering and of volumes.
    Z,
}

impl Up {
    fn direction(self) -> Vec3 {
        match self {
            Up::Y => [0.0, 1.0, 0.0],
            Up::Z => [0.0, 0.0, 1.0],
        }
    }

    /// From the model to the viewer.
    fn viewer(self) -> Vec3 {
        let [x, y, z] = THREE_QUARTER;
        match self {
            Up::Y => [x, y, z],
            Up::Z => [x, -z, y],
        }
    }
}

/// Where a model is looked at from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// From the model to the viewer.
    pub viewer: Vec3,
    /// What is up.
    pub up: Vec3,
}

/// How a preview is laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// Columns of the picture; rows follow from the shape of the model.
    pub width: usize,
    /// Rows for the model at most.
    pub rows: usize,
    /// What is up.
    pub up: Up,
    /// Where it is looked at from, instead of the three-quarter view with that up.
    pub view: Option<View>,
}

impl Params {
    /// The look of all previews.
    pub const DEFAULT: Params = Params {
        width: 1024,
        rows: 480,
        up: Up::Y,
        view: None,
    };

    /// Where models are looked at from.
    fn view(&self) -> View {
        self.view.unwrap_or(View {
            viewer: self.up.viewer(),
            up: self.up.direction(),
        })
    }
}

/// Something to draw.
#[derive(Debug, Clone, Copy)]
pub enum What<'a> {
    /// The triangles of a mesh.
    Mesh(&'a Mesh),
    /// The triangles of several meshes, each in a colour of its own.
    Parts(&'a [(&'a Mesh, Srgb)]),
    /// The set voxels of a volume, as cubes.
    Voxels(&'a Volume),
}

/// One of the pictures that stand side by side.
#[derive(Debug, Clone, Copy)]
pub struct Panel<'a> {
    /// What is written under it.
    pub label: &'a str,
    /// What is drawn.
    pub what: What<'a>,
    /// In which colour, unless parts have their own: [`colour::CLAY`], or one of the palette for the thing
    /// of interest.
    pub colour: Srgb,
}

/// Draws panels beside each other, all from one side and at one scale, as a PNG file.
///
/// Under them stand their labels, then the caption on the left and on the right a scale bar with a
/// round length in `unit` (the file's own where it is empty). The bar holds for lengths across the
/// line of sight, anywhere: rays are parallel. Volumes beyond [`MAX_VOXELS`] voxels along a side
/// are drawn reduced, and the caption says so. The file is below 200 kB in all but pathological
/// cases. Equal input gives equal bytes, on any number of threads.
///
/// Errors as [`boundary_faces`], and where parts together have 2^32 vertices. Cost: linear in the triangles, the set voxels and the pixels.
pub fn side_by_side(
    panels: &[Panel],
    caption: &str,
    unit: &str,
    params: &Params,
) -> Result<Vec<u8>> {
    let width = params.width.clamp(64, 8192);
    let drawn: Vec<Drawn> = panels.iter().map(Drawn::new).collect::<Result<_>>()?;
    let column = (width / panels.len().max(1)).max(1);
    let (camera, rows) = common_view(&drawn, column, params);
    let size = Size {
        width: column,
        height: rows,
    };
    let mut picture = Picture::new(width, rows + LABEL_ROWS + FOOT_ROWS, WHITE);
    for (i, (panel, drawn)) in panels.iter().zip(&drawn).enumerate() {
        let subject = Subject {
            positions: &drawn.mesh.positions,
            triangles: &drawn.mesh.triangles,
            colours: &drawn.colours,
            squares: drawn.squares,
        };
        let raster = render(&subject, &camera, size, params.view().up);
        picture.paste(&raster, i * column, 0);
        let at = [(i as f64 + 0.5) * column as f64, (rows + 14) as f64];
        let label = text::shortened(panel.label, LABEL_CAP, column as f64 - SIDE);
        text::draw(&mut picture, &label, at, LABEL_CAP, Align::Centre, INK);
    }
    let mut caption = caption.to_owned();
    if let Some(factor) = drawn.iter().map(|d| d.factor).max().filter(|f| *f > 1) {
        caption.push_str(&format!(" · drawn at 1/{factor}"));
    }
    let taken = scale_bar(&mut picture, camera.pixel(size), unit);
    let base = (picture.height() - 18) as f64;
    let room = width as f64 - taken - 3.0 * SIDE;
    let caption = text::shortened(&caption, CAPTION_CAP, room);
    text::draw(
        &mut picture,
        &caption,
        [SIDE, base],
        CAPTION_CAP,
        Align::Left,
        FAINT_INK,
    );
    Ok(encode_within(&picture, README_LIMIT))
}

/// A panel's content as triangles.
struct Drawn<'a> {
    mesh: Cow<'a, Mesh>,
    /// Colours, each with the first triangle that has it.
    colours: Vec<(usize, Linear)>,
    squares: bool,
    factor: usize,
}

impl<'a> Drawn<'a> {
    fn new(panel: &Panel<'a>) -> Result<Self> {
        let whole = vec![(0, colour::to_linear(panel.colour))];
        Ok(match panel.what {
            What::Mesh(mesh) => Drawn {
                mesh: Cow::Borrowed(mesh),
                colours: whole,
                squares: false,
                factor: 1,
            },
            What::Parts(parts) => {
                let mut joined = Mesh::default();
                let mut colours = Vec::with_capacity(parts.len());
                for (mesh, colour) in parts {
                    colours.push((joined.triangles.len(), colour::to_linear(*colour)));
                    joined.append(mesh)?;
                }
                Drawn {
                    mesh: Cow::Owned(joined),
                    colours,
                    squares: false,
                    factor: 1,
                }
            }
            What::Voxels(volume) => {
                let (small, factor) = if volume.frame.dims.iter().any(|d| *d > MAX_VOXELS) {
                    let (small, factor) = reduced(volume, MAX_VOXELS);
                    (Cow::Owned(small), factor)
                } else {
                    (Cow::Borrowed(volume), 1)
                };
                Drawn {
                    mesh: Cow::Owned(boundary_faces(&small)?),
                    colours: whole,
                    squares: true,
                    factor,
                }
            }
        })
    }
}

/// One camera for all panels, and the rows that the model needs in a column of this width.
fn common_view(drawn: &[Drawn], column: usize, params: &Params) -> (Camera, usize) {
    let bounds = drawn
        .iter()
        .map(|d| d.mesh.used_bounds())
        .fold(Aabb::EMPTY, Aabb::union);
    let View { viewer, up } = params.view();
    let camera = Camera::framing(&bounds, viewer, up, 1.0);
    let seen = drawn
        .iter()
        .map(|d| camera.seen(&shown_vertices(&d.mesh)))
        .fold(Aabb::EMPTY, Aabb::union);
    let [wide, high, _] = seen.extent();
    let shape = if wide > 0.0 { high / wide } else { 1.0 };
    let rows = (column as f64 * shape.clamp(0.45, 1.0)).round() as usize;
    let size = Size {
        width: column,
        height: rows.clamp(32, params.rows.clamp(32, 8192)),
    };
    (camera.fitted(seen, size.aspect()), size.height)
}

/// The vertices that something drawn uses: others do not widen the view.
fn shown_vertices(mesh: &Mesh) -> Cow<'_, [Vec3]> {
    let used = mesh.used_vertices();
    if used.iter().all(|used| *used) {
        return Cow::Borrowed(&mesh.positions);
    }
    let all = mesh.positions.iter().zip(used);
    all.filter_map(|(p, used)| used.then_some(*p)).collect()
}

/// Draws a scale bar into the lower right corner and returns the width it takes.
fn scale_bar(picture: &mut Picture, pixel: f64, unit: &str) -> f64 {
    let (length, name) = round_length(pixel * picture.width() as f64 * 0.11);
    let pixels = length / pixel;
    if !(pixels.is_finite() && pixels > 0.0) {
        return 0.0;
    }
    let name = with_unit(&name, unit);
    let (right, base) = (
        picture.width() as f64 - SIDE,
        (picture.height() - 18) as f64,
    );
    let left = (right - pixels).round();
    picture.fill([left, base - 3.0], [right, base], INK);
    for end in [left, right - 1.5] {
        picture.fill([end, base - 7.0], [end + 1.5, base], INK);
    }
    let wide = text::width(&name, CAPTION_CAP);
    let at = [left - 12.0, base];
    text::draw(picture, &name, at, CAPTION_CAP, Align::Right, INK);
    pixels + wide + 12.0
}

/// `5 mm`; without a name for the unit `5 units`, and `1 unit`.
fn with_unit(length: &str, unit: &str) -> String {
    let unit = match unit {
        "" if length == "1" => "unit",
        "" => "units",
        unit => unit,
    };
    format!("{length} {unit}")
}

/// The largest of 1, 2 and 5 times a power of ten that is not above `most`, and how it is written.
fn round_length(most: f64) -> (f64, String) {
    if !(most.is_finite() && most > 0.0) {
        return (0.0, String::new());
    }
    let mut power = most.log10().floor() as i32;
    // A logarithm near a whole number may round up.
    if 10f64.powi(power) > most {
        power -= 1;
    }
    let digit = [5, 2, 1]
        .into_iter()
        .find(|d| f64::from(*d) * 10f64.powi(power) <= most)
        .unwrap_or(1);
    let name = match power {
        0..=4 => format!("{digit}{}", "0".repeat(power as usize)),
        -4..=-1 => format!("0.{}{digit}", "0".repeat((-power - 1) as usize)),
        _ => format!("{digit}e{power}"),
    };
    (f64::from(digit) * 10f64.powi(power), name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::volume::bits::BitGrid;
    use crate::volume::{Data, Frame};

    #[test]
    fn one_unit_is_singular() {
        assert_eq!(with_unit("1", ""), "1 unit");
        assert_eq!(with_unit("0.1", ""), "0.1 units");
        assert_eq!(with_unit("10", ""), "10 units");
        assert_eq!(with_unit("1", "mm"), "1 mm");
    }

    /// A ball of voxels of edge `h` around the origin.
    fn ball(radius: f64, n: usize) -> Volume {
        let h = 2.0 * radius / n as f64;
        let mut bits = BitGrid::new([n; 3]);
        let at = |i: usize| (i as f64 + 0.5) * h - radius;
        for i in 0..n * n * n {
            let [x, y, z] = [i % n, i / n % n, i / n / n];
            if crate::numeric::vector::length([at(x), at(y), at(z)]) <= radius {
                bits.set(x, y, z);
            }
        }
        Volume {
            frame: Frame::straight([n; 3], [at(0); 3], [h; 3]),
            data: Data::Bits(bits),
        }
    }

    fn both(mesh: &Mesh, volume: &Volume, width: usize, threads: usize) -> Vec<u8> {
        let panels = [
            Panel {
                label: "ball.obj",
                what: What::Mesh(mesh),
                colour: colour::CLAY,
            },
            Panel {
                label: "16 × 16 × 16 voxels",
                what: What::Voxels(volume),
                colour: colour::class(1),
            },
        ];
        let params = Params {
            width,
            ..Params::DEFAULT
        };
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| side_by_side(&panels, "error ≤ 0.87 voxel", "mm", &params))
            .expect("a picture")
    }

    /// Width, height and pixels.
    fn decode(bytes: &[u8]) -> (usize, usize, Vec<Srgb>) {
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().expect("a header");
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut bytes).expect("a frame");
        let pixels = bytes.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        (info.width as usize, info.height as usize, pixels)
    }

    #[test]
    fn a_preview_is_the_same_on_any_number_of_threads_and_small() {
        let (mesh, volume) = (shapes::octasphere([0.0; 3], 1.0, 24), ball(1.0, 16));
        let one = both(&mesh, &volume, 1024, 1);
        assert_eq!(one, both(&mesh, &volume, 1024, 4));
        assert!(one.len() < README_LIMIT, "{}", one.len());
        let (width, height, _) = decode(&one);
        assert_eq!(width, 1024);
        assert!((300..700).contains(&height), "{height}");
    }

    #[test]
    fn models_stand_on_white_in_their_colours() {
        let (mesh, volume) = (shapes::octasphere([0.0; 3], 1.0, 24), ball(1.0, 16));
        let (width, height, pixels) = decode(&both(&mesh, &volume, 400, 2));
        let at = |x: usize, y: usize| pixels[y * width + x];
        for y in 0..height {
            assert_eq!([at(0, y), at(width - 1, y)], [WHITE; 2], "{y}");
        }
        assert!((0..width).all(|x| at(x, 0) == WHITE && at(x, height - 1) == WHITE));
        let rows = height - LABEL_ROWS - FOOT_ROWS;
        let [r, g, b] = at(100, rows / 2).map(i32::from);
        assert!(
            r >= b && r - b < 40 && g > 60 && r < 250,
            "clay: {r} {g} {b}"
        );
        let [r, _, b] = at(300, rows / 2).map(i32::from);
        assert!(b - r > 50, "blue: {r} {b}");
        // The ball is lit from the upper left.
        let left = i32::from(at(70, rows / 3)[1]);
        let right = i32::from(at(135, rows * 3 / 4)[1]);
        assert!(left > right + 40, "{left} {right}");
        let ink = |x: std::ops::Range<usize>| {
            let dark = |x: usize, y: usize| at(x, y).iter().all(|c| *c < 150);
            (rows + 30..height).any(|y| x.clone().any(|x| dark(x, y)))
        };
        assert!(ink(20..200), "a caption on the left");
        assert!(ink(300..380), "a scale bar on the right");
    }

    #[test]
    fn parts_have_their_own_colours_and_the_view_is_the_one_asked_for() {
        let [left, right] = [-1.2, 1.2].map(|x| shapes::octasphere([x, 0.0, 0.0], 1.0, 20));
        let parts = [(&left, colour::CLAY), (&right, colour::OKABE_ITO[5])];
        let panel = Panel {
            label: "two",
            what: What::Parts(&parts),
            colour: colour::CLAY,
        };
        let seen = |viewer: Vec3, up: Vec3| {
            let params = Params {
                width: 300,
                rows: 90,
                view: Some(View { viewer, up }),
                ..Params::DEFAULT
            };
            let bytes = side_by_side(&[panel], "", "", &params).expect("a picture");
            let (width, height, pixels) = decode(&bytes);
            assert_eq!((width, height), (300, 90 + LABEL_ROWS + FOOT_ROWS));
            let blue = |x: usize, y: usize| {
                let [r, _, b] = pixels[y * width + x].map(i32::from);
                b - r > 40
            };
            [[150 - 40, 45], [150 + 40, 45], [150, 20], [150, 70]].map(|[x, y]| blue(x, y))
        };
        let front = seen([0.0, 0.0, 1.0], [0.0, 1.0, 0.0]);
        assert_eq!(front[..2], [false, true]);
        let behind = seen([0.0, 0.0, -1.0], [0.0, 1.0, 0.0]);
        assert_eq!(behind[..2], [true, false]);
        let turned = seen([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        assert_eq!(turned[2..], [true, false]);
    }

    #[test]
    fn nothing_and_hostile_things_are_drawn_without_a_fault() {
        let params = Params {
            width: 200,
            up: Up::Z,
            ..Params::DEFAULT
        };
        let flat = shapes::sheet(1.0, 1.0, 2, 2);
        let speck = Mesh::from_triangles(vec![[1e9; 3]; 3], vec![[0, 1, 2]]);
        let huge = shapes::cuboid([-1e300; 3], [1e300; 3]);
        for mesh in [Mesh::default(), flat, speck, huge] {
            let panel = Panel {
                label: "",
                what: What::Mesh(&mesh),
                colour: colour::CLAY,
            };
            let (width, _, _) =
                decode(&side_by_side(&[panel], "", "", &params).expect("a picture"));
            assert_eq!(width, 200);
        }
        let (width, _, _) = decode(&side_by_side(&[], "none", "", &params).expect("a picture"));
        assert_eq!(width, 200);
    }

    #[test]
    fn round_lengths_are_round_and_not_above() {
        for (most, length, name) in [
            (1.0, 1.0, "1"),
            (0.999, 0.5, "0.5"),
            (47.0, 20.0, "20"),
            (5000.0, 5000.0, "5000"),
            (0.03, 0.02, "0.02"),
            (3e-30, 2e-30, "2e-30"),
            (9.9e30, 5e30, "5e30"),
        ] {
            let (found, written) = round_length(most);
            assert!((found / length - 1.0).abs() < 1e-12, "{most}: {found}");
            assert_eq!(written, name);
        }
        assert_eq!(round_length(f64::NAN).0, 0.0);
        assert_eq!(round_length(0.0).0, 0.0);
    }
}
