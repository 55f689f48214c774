//! Holes between discs: what is seen from around of a surface, and not of the discs on it.
//!
//! Where the surface is known by its points alone, pieces stand for it, made with the neighbourhoods and
//! planes that discs start from; the rasters that pieces and discs are drawn on share nothing with either.

use crate::mesh::Mesh;
use crate::mesh::tracer::{Ray, Tracer};
use crate::numeric::vector::{Vec3, add, cross, dot, normalize, scale, sub};
use crate::points::Splat;
use crate::points::normals::{Neighbourhoods, planes};
use crate::spatial::aabb::Aabb;
use crate::spatial::kdtree::KdTree;
use crate::spatial::local::{CornerFrame, LocalFrame};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// Nearer to the silhouette than this cosine between normal and view nothing is judged.
const GRAZING: f64 = 0.2;

/// A round piece of the surface that discs should cover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Its centre.
    pub centre: Vec3,
    /// Its unit normal.
    pub normal: Vec3,
    /// Its radius.
    pub radius: f64,
}

impl Piece {
    fn seen_in(&self, frame: &CornerFrame) -> Piece {
        Piece {
            centre: frame.to_local(self.centre),
            radius: frame.length_to_local(self.radius),
            ..*self
        }
    }

    /// A piece around each point: the circle about the square that it stands for, in the plane through
    /// `neighbours` others. Points on a line with their neighbours have none.
    ///
    /// Cost: a search for each point.
    pub fn around(positions: &[Vec3], neighbours: usize) -> Vec<Piece> {
        let frame = LocalFrame::around(Aabb::around(positions));
        let points: Vec<Vec3> = positions.iter().map(|p| frame.to_local(*p)).collect();
        let tree = KdTree::build(&points);
        let near = Neighbourhoods::of(&tree, &points, neighbours);
        let planes = planes(&tree, &points, &near).into_iter().zip(positions);
        planes
            .filter(|(plane, _)| plane.normal != [0.0; 3])
            .map(|(plane, p)| Piece {
                centre: *p,
                normal: plane.normal,
                radius: frame.length(plane.spacing * std::f64::consts::FRAC_1_SQRT_2),
            })
            .collect()
    }
}

/// What the surface is where holes are looked for.
pub enum Truth<'a> {
    /// Pieces, such as a disc of the spacing around each point.
    Pieces(&'a [Piece]),
    /// The triangles of a mesh.
    Mesh(&'a Mesh),
}

/// Views to look from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Views {
    /// How many directions, spread evenly.
    pub count: usize,
    /// Pixels along each side of a picture.
    pub pixels: usize,
}

/// What is seen of a surface through its discs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Holes {
    /// Pixels, of all views, that show the surface.
    pub seen: u64,
    /// Those of them that show no disc there: nothing, or something behind.
    pub holes: u64,
    /// Their share.
    pub share: f64,
    /// Their area, in the square of the unit: as the views see them, on average.
    pub area: f64,
}

/// Looks at discs from around, along parallel rays, for places where the surface shows and no disc does.
///
/// A disc is there when it is no farther behind the surface than `tolerance` along the surface's normal.
/// Pixels beside the silhouette, and those that see the surface at less than some 12 degrees, are not
/// judged. The views are spread as the seeds of a sunflower. Cost: for each view the pixels that discs
/// and pieces cover, or a ray for each pixel.
pub fn holes(truth: &Truth, splats: &[Splat], tolerance: f64, views: Views) -> Holes {
    let bounds = splats
        .iter()
        .fold(Aabb::EMPTY, |all, s| all.union(s.bounds()));
    let bounds = match truth {
        Truth::Pieces(pieces) => pieces.iter().fold(bounds, |all, p| all.with(p.centre)),
        Truth::Mesh(mesh) => bounds.union(mesh.bounds()),
    };
    if bounds.is_empty() || views.count == 0 || views.pixels == 0 {
        return Holes::default();
    }
    let frame = CornerFrame::around(bounds);
    let surface = match truth {
        Truth::Pieces(pieces) => {
            Surface::Pieces(pieces.iter().map(|p| p.seen_in(&frame)).collect())
        }
        Truth::Mesh(mesh) => {
            let mut local = Mesh {
                triangles: mesh.triangles.clone(),
                ..Mesh::default()
            };
            let place = |p: &Vec3| frame.to_local(*p);
            local.positions = mesh.positions.iter().map(place).collect();
            Surface::Mesh(Box::new((Tracer::new(&local), local)))
        }
    };
    let disc = |s: &Splat| Piece {
        centre: s.centre,
        normal: s.normal,
        radius: s.radius,
    };
    let discs: Vec<Piece> = splats.iter().map(|s| disc(s).seen_in(&frame)).collect();
    let tolerance = frame.length_to_local(tolerance);
    let bounds = Aabb {
        lo: frame.to_local(bounds.lo),
        hi: frame.to_local(bounds.hi),
    };
    let half = 0.5 * bounds.diagonal();
    let pixel = 2.0 * half / views.pixels as f64;
    let (mut seen, mut missing) = (0u64, 0u64);
    for view in 0..views.count {
        let screen = Screen::new(spread(view, views.count), &bounds, half, views.pixels);
        let (s, m) = screen.judge(&surface, &discs, tolerance);
        seen += s;
        missing += m;
    }
    let side = frame.length_from_local(pixel);
    Holes {
        seen,
        holes: missing,
        share: missing as f64 / seen.max(1) as f64,
        area: missing as f64 / views.count as f64 * side * side,
    }
}

/// The truth in the frame of the views.
enum Surface {
    Pieces(Vec<Piece>),
    Mesh(Box<(Tracer, Mesh)>),
}

/// One of directions spread evenly over the sphere.
fn spread(i: usize, count: usize) -> Vec3 {
    let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
    let turn = i as f64 * std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let r = (1.0 - z * z).sqrt();
    [r * turn.cos(), r * turn.sin(), z]
}

/// A picture by parallel rays.
struct Screen {
    /// Right, up, and the way the rays go.
    axes: [Vec3; 3],
    /// Where the ray of the lower left corner begins.
    origin: Vec3,
    pixel: f64,
    size: usize,
}

/// What is nearest in a pixel: its depth, and the normal of it.
type Seen = Option<(f64, Vec3)>;

impl Screen {
    fn new(way: Vec3, bounds: &Aabb, half: f64, size: usize) -> Self {
        let side = if way[2].abs() < 0.9 {
            [0.0, 0.0, 1.0]
        } else {
            [1.0, 0.0, 0.0]
        };
        let right = normalize(cross(way, side));
        let up = cross(right, way);
        let back = add(scale(way, 2.0), add(right, up));
        Screen {
            axes: [right, up, way],
            origin: sub(bounds.centre(), scale(back, half)),
            pixel: 2.0 * half / size as f64,
            size,
        }
    }

    fn ray(&self, x: usize, y: usize) -> Vec3 {
        let at = |p: usize, axis: Vec3| scale(axis, (p as f64 + 0.5) * self.pixel);
        add(self.origin, add(at(x, self.axes[0]), at(y, self.axes[1])))
    }

    fn judge(&self, surface: &Surface, discs: &[Piece], tolerance: f64) -> (u64, u64) {
        let wanted = match surface {
            Surface::Pieces(pieces) => self.draw(pieces),
            Surface::Mesh(mesh) => (0..self.size * self.size)
                .into_par_iter()
                .with_min_len(256)
                .map(|i| self.hit(i % self.size, i / self.size, &mesh.0, &mesh.1))
                .collect(),
        };
        let found = self.draw(discs);
        let (mut seen, mut missing) = (0, 0);
        for y in 1..self.size.saturating_sub(1) {
            for x in 1..self.size - 1 {
                let at = |dx: usize, dy: usize| wanted[(y + dy - 1) * self.size + x + dx - 1];
                let Some((depth, normal)) = at(1, 1) else {
                    continue;
                };
                let slant = dot(normal, self.axes[2]).abs();
                let inside = (0..9).all(|k| at(k % 3, k / 3).is_some());
                if !inside || slant < GRAZING {
                    continue;
                }
                seen += 1;
                let there = found[y * self.size + x]
                    .is_some_and(|(other, _)| (other - depth) * slant <= tolerance);
                missing += u64::from(!there);
            }
        }
        (seen, missing)
    }

    /// What a mesh shows in a pixel.
    fn hit(&self, x: usize, y: usize, tracer: &Tracer, mesh: &Mesh) -> Seen {
        let hit = tracer.closest(&Ray {
            origin: self.ray(x, y),
            direction: self.axes[2],
            reach: [0.0, f64::INFINITY],
        })?;
        let [a, b, c] = mesh.corners(hit.triangle as usize);
        Some((hit.t, normalize(cross(sub(b, a), sub(c, a)))))
    }

    /// The nearest of round pieces in each pixel.
    fn draw(&self, pieces: &[Piece]) -> Vec<Seen> {
        let mut picture: Vec<Seen> = vec![None; self.size * self.size];
        for piece in pieces {
            let d = sub(piece.centre, self.origin);
            let [x, y, depth] = self.axes.map(|a| dot(d, a));
            let [nx, ny, nz] = self.axes.map(|a| dot(piece.normal, a));
            if nz == 0.0 {
                continue;
            }
            let span = |at: f64, n: f64| {
                let reach = piece.radius * (1.0 - n * n).max(0.0).sqrt();
                let cell = |c: f64| (c / self.pixel - 0.5).clamp(-1.0, self.size as f64);
                let first = cell(at - reach).ceil().max(0.0) as usize;
                let last = cell(at + reach).floor();
                first..(last + 1.0).clamp(0.0, self.size as f64) as usize
            };
            for row in span(y, ny) {
                let dy = (row as f64 + 0.5) * self.pixel - y;
                for column in span(x, nx) {
                    let dx = (column as f64 + 0.5) * self.pixel - x;
                    let dz = -(nx * dx + ny * dy) / nz;
                    if dx * dx + dy * dy + dz * dz > piece.radius * piece.radius {
                        continue;
                    }
                    let pixel = &mut picture[row * self.size + column];
                    if pixel.is_none_or(|(nearest, _)| depth + dz < nearest) {
                        *pixel = Some((depth + dz, piece.normal));
                    }
                }
            }
        }
        picture
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::splat_cover::coverage;
    use crate::measure::splat_cover::tests::disc;
    use crate::measure::test_shapes;
    use crate::points::splat::{Cover, Length, Params, generate};
    use crate::points::test_clouds::sphere;
    use crate::progress::Silent;

    #[test]
    fn a_missing_disc_is_found_by_points_and_by_views() {
        let grid = |i: i32| [f64::from(i % 20), f64::from(i / 20), 0.0];
        let positions: Vec<Vec3> = (0..400).map(grid).collect();
        let up = [0.0, 0.0, 1.0];
        let all: Vec<Splat> = positions.iter().map(|p| disc(*p, up, 0.75, 0.0)).collect();
        let pieces: Vec<Piece> = positions
            .iter()
            .map(|p| Piece {
                centre: *p,
                normal: up,
                radius: 0.75,
            })
            .collect();
        let found = Piece::around(&positions, 8);
        assert_eq!(found.len(), 400);
        // Eight neighbours up to the diagonal of a square share out their disc.
        let radius = (2.0 * std::f64::consts::PI / 8.0 / 2.0).sqrt();
        assert!(
            (found[210].radius - radius).abs() < 1e-12,
            "{:?}",
            found[210]
        );
        assert!(found.iter().all(|p| p.normal[2].abs() > 1.0 - 1e-12));
        let views = Views {
            count: 6,
            pixels: 200,
        };
        let found = coverage(&positions, &all, 0.0, Some(&vec![up; 400]));
        assert_eq!((found.uncovered, found.over_bound), (0, 0));
        assert_eq!(found.max_distance, Some(0.0));
        assert_eq!(found.normal_max_deg, Some(0.0));
        let truth = Truth::Pieces(&pieces);
        let whole = holes(&truth, &all, 0.1, views);
        assert!(whole.holes == 0 && whole.seen > 1000, "{whole:?}");
        let mut some = all.clone();
        some.remove(210);
        let found = coverage(&positions, &some, 0.0, None);
        assert_eq!((found.uncovered, found.first_uncovered), (1, Some(210)));
        let gap = found.max_distance.expect("a distance");
        assert!((gap - 0.25).abs() < 1e-12, "{gap}");
        let open = holes(&truth, &some, 0.1, views);
        assert!(open.holes > 0 && open.seen == whole.seen, "{open:?}");
        // Lengths are those of the model, at any size.
        for size in [2f64.powi(-900), 2f64.powi(400)] {
            let grown: Vec<Splat> = some
                .iter()
                .map(|s| disc(scale(s.centre, size), up, s.radius * size, 0.0))
                .collect();
            let pieces: Vec<Piece> = pieces
                .iter()
                .map(|p| Piece {
                    centre: scale(p.centre, size),
                    radius: p.radius * size,
                    ..*p
                })
                .collect();
            let other = holes(&Truth::Pieces(&pieces), &grown, 0.1 * size, views);
            assert_eq!((other.seen, other.holes), (open.seen, open.holes));
            assert_eq!(other.area, open.area * size * size);
        }
        // A disc that is there but too far behind fills no hole.
        some.push(disc([10.0, 10.0, -1.0], up, 0.75, 0.0));
        some.push(disc([10.0, 10.0, 1.0], up, 0.0, 0.0));
        assert!(holes(&truth, &some, 0.1, views).holes > 0);
    }

    #[test]
    fn the_sphere_of_the_paper_has_no_hole_until_few_discs_are_left() {
        let cloud = sphere(113_682, 1);
        let surface = test_shapes::sphere(200, 1.0);
        let views = Views {
            count: 20,
            pixels: 512,
        };
        let paper = Params {
            delta: Length::Absolute(0.1),
            max_radius: Length::Absolute(10.0),
            ..Params::DEFAULT
        };
        let holes = |params: Params| {
            let (splats, _) = generate(&cloud, &params, &Silent).expect("discs");
            holes(&Truth::Mesh(&surface), &splats.splats, 0.4, views)
        };
        let found = holes(paper);
        assert!(found.holes == 0 && found.seen > 1_000_000, "{found:?}");
        // The measure sees what is missing where a set cover leaves no more than the points need.
        let found = holes(Params {
            cover: Cover::Greedy,
            ..paper
        });
        assert!((1e-4..0.02).contains(&found.share), "{found:?}");
    }
}
