//! How far a picture of discs, and the surface in it, are from a mesh that they stand for.

use crate::image::colour::to_srgb;
use crate::image::raster::Raster;
use crate::mesh::Mesh;
use crate::mesh::tracer::{Ray, Tracer};
use crate::numeric::vector::{Vec3, add, cross, dot, length, normalize, scale, sub};
use crate::report::Accuracy;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// A pixel is wrong where a channel differs by more than so many steps of 255.
pub const WRONG_STEPS: u8 = 2;

/// What is seen from the other side, deeper than the mesh by more than this share of the diagonal, is
/// seen through a hole.
const THROUGH: f64 = 0.01;

/// Pixels of two pictures of one size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct PictureError {
    /// Pixels of each picture.
    pub pixels: u64,
    /// Pixels that differ by more than 2 of 255 in a channel.
    pub wrong: u64,
    /// `wrong / pixels`.
    pub wrong_share: f64,
    /// Peak signal-to-noise ratio in decibels; null where no pixel differs.
    pub psnr_db: Option<f64>,
}

/// Compares two pictures as they are stored, in bytes on the sRGB curve.
///
/// What one has more rows of than the other is left out. Cost: linear in the pixels.
pub fn picture_error(a: &Raster, b: &Raster) -> PictureError {
    let pairs = a.pixels().iter().zip(b.pixels());
    let (mut pixels, mut wrong, mut squares) = (0u64, 0u64, 0u64);
    for (a, b) in pairs {
        let (a, b) = (to_srgb(*a), to_srgb(*b));
        let off: [u8; 3] = std::array::from_fn(|c| a[c].abs_diff(b[c]));
        pixels += 1;
        wrong += u64::from(off.iter().any(|c| *c > WRONG_STEPS));
        squares += off
            .iter()
            .map(|c| u64::from(*c) * u64::from(*c))
            .sum::<u64>();
    }
    let mean = squares as f64 / (3 * pixels).max(1) as f64;
    PictureError {
        pixels,
        wrong,
        wrong_share: wrong as f64 / pixels.max(1) as f64,
        psnr_db: (squares > 0).then(|| 10.0 * (255.0 * 255.0 / mean).log10()),
    }
}

/// A line of sight, and what is seen of discs on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// A place on the line, near the scene.
    pub origin: Vec3,
    /// Unit vector away from the viewer.
    pub direction: Vec3,
    /// From the origin to what is seen; infinite where nothing is.
    pub depth: f64,
    /// The unit normal there.
    pub normal: Vec3,
    /// Whether it is seen from the side to which its surface's normals point.
    pub outside: bool,
}

/// Amounts of some error.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Amounts {
    /// The mean.
    pub mean: f64,
    /// The root mean square.
    pub rms: f64,
    /// The largest, sign left aside.
    pub max: f64,
}

/// How a surface of discs, seen from somewhere, differs from a mesh.
///
/// All is about lines of sight that meet the mesh more than a pixel from its outline: those of which
/// all eight neighbours meet it too.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct SurfaceError {
    /// Those lines of sight.
    pub inside: u64,
    /// Those of them that meet no disc, or pass to the inner side of what lies behind.
    pub holes: u64,
    /// `holes / inside`.
    pub hole_share: f64,
    /// How much deeper discs are than the mesh along the others, as shares of the diagonal of the
    /// scene's box; null where there is none.
    pub depth: Option<Amounts>,
    /// Between their normals that shade and those of the mesh, in degrees; null where there is none.
    pub normal_deg: Option<Amounts>,
    /// Lines of sight that meet discs but not the mesh: how far discs stand out, in pixels.
    pub beyond_outline: u64,
    /// Lines of sight near the outline that meet the mesh but no disc.
    pub short_of_outline: u64,
}

impl SurfaceError {
    /// Depths, normals and holes, as the accuracy of a report.
    pub fn accuracy(&self) -> [Accuracy; 3] {
        let measure = |measure: &str, unit: &str, reached: Option<f64>| Accuracy {
            measure: measure.to_owned(),
            unit: unit.to_owned(),
            bound: None,
            reached,
            reference: "the mesh on the same lines of sight".to_owned(),
            verified: reached.is_some(),
        };
        let holes = (self.inside > 0).then_some(self.hole_share);
        let diagonal = "share of the diagonal";
        [
            measure(
                "rms difference in depth",
                diagonal,
                self.depth.map(|d| d.rms),
            ),
            measure(
                "rms difference of normals",
                "degree",
                self.normal_deg.map(|n| n.rms),
            ),
            measure(
                "holes",
                "share of the lines of sight inside the outline",
                holes,
            ),
        ]
    }
}

/// What a mesh shows on a line of sight: the way, and the normal towards the viewer.
#[derive(Debug, Clone, Copy)]
struct Shown {
    t: f64,
    normal: Vec3,
    outside: bool,
}

/// Compares what is seen of discs with a mesh, pixel by pixel of rows of `width`.
///
/// Normals are those of the mesh's vertices where it has some, else of its triangles; the side that
/// is seen counts. Lines of sight are not bounded behind. Cost: a ray for each.
pub fn surface_error(
    mesh: &Mesh,
    diagonal: f64,
    width: usize,
    count: usize,
    sight: impl Fn(usize) -> Sight + Sync,
) -> SurfaceError {
    let tracer = Tracer::new(mesh);
    let shown: Vec<Option<Shown>> = (0..count)
        .into_par_iter()
        .with_min_len(256)
        .map(|at| show(mesh, &tracer, &sight(at)))
        .collect();
    let mut sums = Sums::default();
    // In order: sums do not depend on threads.
    for at in 0..count {
        sums.note(at, width, &shown, &sight(at), diagonal);
    }
    sums.told()
}

fn show(mesh: &Mesh, tracer: &Tracer, sight: &Sight) -> Option<Shown> {
    let hit = tracer.closest(&Ray {
        origin: sight.origin,
        direction: sight.direction,
        reach: [0.0, f64::INFINITY],
    })?;
    let triangle = hit.triangle as usize;
    let [a, b, c] = mesh.corners(triangle);
    let plane = normalize(cross(sub(b, a), sub(c, a)));
    let outside = dot(plane, sight.direction) < 0.0;
    let normal = mesh.normals.as_ref().map_or(plane, |normals| {
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let corners = mesh.triangles[triangle].iter().zip(weights);
        normalize(corners.fold([0.0; 3], |sum, (v, weight)| {
            add(sum, scale(normals[*v as usize], weight))
        }))
    });
    Some(Shown {
        t: hit.t,
        normal: if outside { normal } else { scale(normal, -1.0) },
        outside,
    })
}

#[derive(Default)]
struct Sums {
    inside: u64,
    holes: u64,
    beyond: u64,
    short: u64,
    compared: u64,
    depth: Amounts,
    normal: Amounts,
}

impl Amounts {
    fn note(&mut self, amount: f64) {
        self.mean += amount;
        self.rms += amount * amount;
        self.max = self.max.max(amount.abs());
    }

    fn over(self, count: u64) -> Option<Amounts> {
        (count > 0).then(|| Amounts {
            mean: self.mean / count as f64,
            rms: (self.rms / count as f64).sqrt(),
            max: self.max,
        })
    }
}

impl Sums {
    fn note(
        &mut self,
        at: usize,
        width: usize,
        shown: &[Option<Shown>],
        sight: &Sight,
        diagonal: f64,
    ) {
        let seen = sight.depth.is_finite();
        let Some(mesh) = shown[at] else {
            self.beyond += u64::from(seen);
            return;
        };
        if !is_inside(at, width, shown) {
            self.short += u64::from(!seen);
            return;
        }
        self.inside += 1;
        let deeper = (sight.depth - mesh.t) / diagonal;
        if !seen || (sight.outside != mesh.outside && deeper > THROUGH) {
            self.holes += 1;
            return;
        }
        self.compared += 1;
        self.depth.note(deeper);
        let side = if sight.outside { 1.0 } else { -1.0 };
        let normal = scale(sight.normal, side);
        let angle = length(cross(normal, mesh.normal)).atan2(dot(normal, mesh.normal));
        self.normal.note(angle.to_degrees());
    }

    fn told(self) -> SurfaceError {
        SurfaceError {
            inside: self.inside,
            holes: self.holes,
            hole_share: self.holes as f64 / self.inside.max(1) as f64,
            depth: self.depth.over(self.compared),
            normal_deg: self.normal.over(self.compared),
            beyond_outline: self.beyond,
            short_of_outline: self.short,
        }
    }
}

/// Whether the eight neighbours of a pixel are in the picture and show the mesh.
fn is_inside(at: usize, width: usize, shown: &[Option<Shown>]) -> bool {
    let (x, y) = (at % width, at / width);
    if x == 0 || y == 0 || x + 1 >= width || (y + 1) * width >= shown.len() {
        return false;
    }
    let rows = [at - width, at, at + width];
    rows.iter()
        .all(|row| shown[row - 1..=row + 1].iter().all(Option::is_some))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    const SIDE: usize = 80;

    /// Parallel lines of sight onto a ball of radius 1, and a ball of another radius seen on them.
    fn sight(radius: f64) -> impl Fn(usize) -> Sight + Sync {
        move |at| {
            let place = |i: usize| (i as f64 + 0.5) / SIDE as f64 * 2.4 - 1.2;
            let origin = [place(at % SIDE), place(at / SIDE), 3.0];
            let square = radius * radius - origin[0] * origin[0] - origin[1] * origin[1];
            let hit = [origin[0], origin[1], square.max(0.0).sqrt()];
            Sight {
                origin,
                direction: [0.0, 0.0, -1.0],
                depth: if square > 0.0 {
                    3.0 - hit[2]
                } else {
                    f64::INFINITY
                },
                normal: normalize(hit),
                outside: true,
            }
        }
    }

    fn error(sight: impl Fn(usize) -> Sight + Sync) -> SurfaceError {
        let mut mesh = shapes::octasphere([0.0; 3], 1.0, 96);
        mesh.normals = Some(mesh.positions.iter().map(|p| normalize(*p)).collect());
        surface_error(&mesh, 2.0, SIDE, SIDE * SIDE, sight)
    }

    #[test]
    fn a_surface_is_itself() {
        let same = error(sight(1.0));
        assert!(same.inside > 3000 && same.holes == 0);
        let (depth, normal) = (same.depth.expect("hits"), same.normal_deg.expect("hits"));
        assert!(depth.max < 1e-3 && normal.max < 0.1, "{same:?}");
    }

    #[test]
    fn a_smaller_ball_lies_deeper() {
        let smaller = error(sight(0.98));
        let depth = smaller.depth.expect("hits");
        // 0.02 in the middle, of a diagonal of 2, and more towards the outline.
        assert!((0.01..0.02).contains(&depth.mean) && depth.rms > depth.mean);
        let larger = error(sight(1.05));
        assert!(larger.depth.expect("hits").mean < -0.025 && larger.beyond_outline > 100);
    }

    #[test]
    fn holes_are_counted_whether_nothing_or_the_inner_side_is_seen() {
        let with_holes = |at: usize| {
            let whole = sight(1.0)(at);
            let depth = 6.0 - whole.depth;
            match at % SIDE {
                30..=33 if whole.depth.is_finite() => Sight {
                    depth,
                    outside: false,
                    ..whole
                },
                50..=51 => Sight {
                    depth: f64::INFINITY,
                    ..whole
                },
                _ => whole,
            }
        };
        let holed = error(with_holes);
        let columns = |some: &[usize]| -> u64 {
            let mesh = shapes::octasphere([0.0; 3], 1.0, 96);
            let found = surface_error(&mesh, 2.0, SIDE, SIDE * SIDE, |at| Sight {
                depth: if some.contains(&(at % SIDE)) {
                    f64::INFINITY
                } else {
                    3.0
                },
                ..sight(1.0)(at)
            });
            found.holes
        };
        // At the very outline the far side is not deeper enough to tell.
        let all = columns(&[30, 31, 32, 33, 50, 51]);
        assert!(
            holed.holes > 300 && all - holed.holes <= 4,
            "{} of {all}",
            holed.holes
        );
    }

    #[test]
    fn pixels_are_wrong_from_three_steps_on() {
        let raster = |light: f32| Raster::from_pixels(4, vec![[light, 0.5, 0.5]; 16]);
        let same = picture_error(&raster(0.5), &raster(0.5));
        assert_eq!((same.wrong, same.pixels, same.psnr_db), (0, 16, None));
        let near = picture_error(&raster(0.5), &raster(0.507));
        assert!(near.wrong == 0 && near.psnr_db.is_some_and(|db| db > 45.0));
        let far = picture_error(&raster(0.5), &raster(0.6));
        assert_eq!(far.wrong_share, 1.0);
    }
}
