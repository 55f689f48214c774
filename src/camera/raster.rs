//! Triangles onto a raster: what is nearest in each pixel.

use super::{Camera, Size};
use crate::numeric::vector::{Vec3, lerp};
use rayon::prelude::*;

/// The triangle of a pixel that shows none.
pub const NOTHING: u32 = u32::MAX;

/// Steps of a pixel that vertices are rounded to; all decisions after that are exact.
const SUBPIXEL: f64 = 256.0;

/// Places on the screen beyond this many pixels are clipped, so that no product overflows.
const GUARD: f64 = (1 << 20) as f64;

/// Rows that one thread fills at a time.
const BAND: usize = 16;

/// Triangles sorted into bands at a time.
const CHUNK: usize = 1 << 15;

/// Boxes wider than this many pixels are filled by spans, narrower ones pixel by pixel.
const NARROW: i64 = 8;

/// What a raster of triangles shows: the nearest triangle at the centre of each pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct GBuffer {
    /// Columns and rows.
    pub size: Size,
    /// Depth along the viewing axis in the camera's unit, row by row from the top left; infinite
    /// where there is nothing.
    pub depth: Vec<f32>,
    /// Index of the triangle, [`NOTHING`] where there is none.
    pub triangle: Vec<u32>,
}

/// A vertex on the screen.
#[derive(Clone, Copy)]
struct Corner {
    /// Place in steps of a pixel; `None` when it must be clipped first.
    place: Option<[i32; 2]>,
    /// Number that is linear on the screen and grows with depth.
    key: f64,
}

/// Draws triangles, both sides alike.
///
/// A pixel belongs to a triangle when its centre is inside; a centre on a shared edge belongs to
/// exactly one of two triangles on either side of it, so that closed surfaces have no holes and no
/// pixel is drawn twice. Of triangles at equal depth the first is kept. Vertices are rounded to
/// 1/256 pixel. Triangles that reach behind the near plane are cut there. Corners must be in range
/// and coordinates finite.
///
/// The same on any number of threads. Cost: linear in vertices, triangles and the pixels they cover.
///
/// Source of the edge functions: Pineda, "A parallel algorithm for polygon rasterization" (1988).
pub fn rasterize(
    camera: &Camera,
    size: Size,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
) -> GBuffer {
    let lens = Projector { camera, size };
    let corners: Vec<Corner> = positions
        .par_iter()
        .map(|p| lens.corner(camera.to_view(*p)))
        .collect();
    let scene = Scene {
        lens,
        positions,
        triangles,
        corners: &corners,
    };
    let bins: Vec<Vec<Vec<u32>>> = triangles
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, part)| scene.sort_into_bands(chunk * CHUNK, part.len()))
        .collect();
    let pixels = size.width * size.height;
    let mut buffer = GBuffer {
        size,
        depth: vec![f32::INFINITY; pixels],
        triangle: vec![NOTHING; pixels],
    };
    let rows = BAND * size.width.max(1);
    buffer
        .depth
        .par_chunks_mut(rows)
        .zip(buffer.triangle.par_chunks_mut(rows))
        .enumerate()
        .for_each(|(band, (depth, triangle))| {
            let mut target = Band {
                width: size.width,
                first: band * BAND,
                depth,
                triangle,
            };
            for id in bins.iter().flat_map(|chunk| &chunk[band]) {
                scene.pieces(*id, |piece| target.draw(&piece, *id));
            }
            target.depth.iter_mut().for_each(|key| {
                *key = lens.depth(*key);
            });
        });
    buffer
}

#[derive(Clone, Copy)]
struct Projector<'a> {
    camera: &'a Camera,
    size: Size,
}

impl Projector<'_> {
    fn corner(&self, view: Vec3) -> Corner {
        let [x, y, depth] = self.camera.to_screen(view, self.size);
        // What was cut at the near plane lies on it but for rounding.
        let in_front = self.camera.near().is_none_or(|near| depth >= near * 0.999);
        let steps = |v: f64| (v * SUBPIXEL).round() as i32;
        // Written so that a place that is not a number is clipped.
        let place =
            (in_front && x.abs() <= GUARD && y.abs() <= GUARD).then(|| [steps(x), steps(y)]);
        Corner {
            place,
            key: match self.camera.near() {
                None => depth,
                Some(_) => -1.0 / depth,
            },
        }
    }

    /// The depth of a key; nothing stays infinitely far.
    fn depth(&self, key: f32) -> f32 {
        match self.camera.near() {
            Some(_) if key.is_finite() => -1.0 / key,
            _ => key,
        }
    }

    /// Signed distances of a view point to the planes that clip: near, right, left, top, bottom.
    fn inside(&self, p: Vec3, plane: usize) -> f64 {
        // The guard planes are the sides of the view, pushed out by half the guard band.
        let depth = self.camera.distance - p[2];
        let reach = |pixels: usize| {
            let edge = self.camera.from_screen(
                self.size.width as f64 * 0.5 + pixels as f64,
                self.size.height as f64 * 0.5,
                1.0,
                self.size,
            );
            match self.camera.near() {
                None => edge[0],
                Some(_) => edge[0] * depth,
            }
        };
        let half = (GUARD * 0.5) as usize;
        match plane {
            0 => self.camera.near().map_or(1.0, |near| depth - near),
            1 => reach(half) - p[0],
            2 => reach(half) + p[0],
            3 => reach(half) - p[1],
            _ => reach(half) + p[1],
        }
    }
}

#[derive(Clone, Copy)]
struct Scene<'a> {
    lens: Projector<'a>,
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    corners: &'a [Corner],
}

/// Three corners on the screen.
type Piece = [([i32; 2], f64); 3];

impl Scene<'_> {
    /// Calls `f` with what of a triangle is to be drawn: itself, or the pieces that clipping leaves.
    fn pieces(&self, id: u32, mut f: impl FnMut(Piece)) {
        let corners = self.triangles[id as usize].map(|v| self.corners[v as usize]);
        if let [Some(a), Some(b), Some(c)] = corners.map(|c| c.place) {
            f([
                (a, corners[0].key),
                (b, corners[1].key),
                (c, corners[2].key),
            ]);
            return;
        }
        let view = self.triangles[id as usize]
            .map(|v| self.lens.camera.to_view(self.positions[v as usize]));
        let clipped: Vec<Corner> = self
            .clipped(view.to_vec())
            .into_iter()
            .map(|p| self.lens.corner(p))
            .collect();
        for i in 2..clipped.len() {
            let fan = [clipped[0], clipped[i - 1], clipped[i]];
            if let [Some(a), Some(b), Some(c)] = fan.map(|c| c.place) {
                f([(a, fan[0].key), (b, fan[1].key), (c, fan[2].key)]);
            }
        }
    }

    /// A polygon of view space cut by the near plane and the guard band (Sutherland and Hodgman 1974).
    fn clipped(&self, mut polygon: Vec<Vec3>) -> Vec<Vec3> {
        for plane in 0..5 {
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            for (i, p) in polygon.iter().enumerate() {
                let q = &polygon[(i + 1) % polygon.len()];
                let (at_p, at_q) = (self.lens.inside(*p, plane), self.lens.inside(*q, plane));
                if at_p >= 0.0 {
                    kept.push(*p);
                }
                if (at_p >= 0.0) != (at_q >= 0.0) {
                    // From the inside out, whoever asks: neighbours get the same point.
                    let (p, q, at_p, at_q) = if at_p >= 0.0 {
                        (*p, *q, at_p, at_q)
                    } else {
                        (*q, *p, at_q, at_p)
                    };
                    let mut cut = lerp(p, q, at_p / (at_p - at_q));
                    if let (0, Some(near)) = (plane, self.lens.camera.near()) {
                        // Rounding of a far end must not move the cut back behind the eye.
                        cut[2] = self.lens.camera.distance - near;
                    }
                    kept.push(cut);
                }
            }
            polygon = kept;
        }
        polygon
    }

    /// For each band, the triangles of a chunk that may have pixels in it, in order.
    fn sort_into_bands(&self, first: usize, count: usize) -> Vec<Vec<u32>> {
        let height = self.lens.size.height;
        let mut bands = vec![Vec::new(); height.div_ceil(BAND)];
        for id in first..first + count {
            let id = id as u32;
            let mut rows: Option<(usize, usize)> = None;
            self.pieces(id, |piece| {
                let Some([x0, x1, y0, y1]) = pixels_of(&piece, self.lens.size) else {
                    return;
                };
                debug_assert!(x0 <= x1);
                let (lo, hi) = rows.unwrap_or((usize::MAX, 0));
                rows = Some((lo.min(y0 as usize), hi.max(y1 as usize)));
            });
            if let Some((lo, hi)) = rows {
                for band in &mut bands[lo / BAND..=hi / BAND] {
                    band.push(id);
                }
            }
        }
        bands
    }
}

/// First and last column and row whose centres are in the box of a piece; none if there is none.
fn pixels_of(piece: &Piece, size: Size) -> Option<[i64; 4]> {
    let range = |a: usize, count: usize| {
        let [p, q, r] = piece.map(|(place, _)| i64::from(place[a]));
        // Centres lie at 256 i + 128.
        let lo = (p.min(q).min(r) + 127).div_euclid(256).max(0);
        let hi = (p.max(q).max(r) - 128)
            .div_euclid(256)
            .min(count as i64 - 1);
        (lo <= hi).then_some((lo, hi))
    };
    let (x0, x1) = range(0, size.width)?;
    let (y0, y1) = range(1, size.height)?;
    Some([x0, x1, y0, y1])
}

/// Some rows of a buffer that is being filled.
struct Band<'a> {
    width: usize,
    first: usize,
    depth: &'a mut [f32],
    triangle: &'a mut [u32],
}

/// The signed distance from an edge times its length, as a plane over the screen.
#[derive(Clone, Copy)]
struct Edge {
    /// Value at the centre of pixel (0, 0), in square steps; inside is 0 or more.
    start: i64,
    /// Change from a pixel to the next on the right and below.
    right: i64,
    down: i64,
    /// What the fill rule takes off `start`: 1 for edges that own no centre on them.
    taken: i64,
}

impl Edge {
    fn new(a: [i32; 2], b: [i32; 2]) -> Self {
        let [dx, dy] = [0, 1].map(|i| i64::from(b[i]) - i64::from(a[i]));
        let [px, py] = [0, 1].map(|i| 128 - i64::from(a[i]));
        // Of the two directions that a shared edge is met in, exactly one owns the edge.
        let owns = dy > 0 || (dy == 0 && dx > 0);
        Edge {
            start: dx * py - dy * px - i64::from(!owns),
            right: -dy * 256,
            down: dx * 256,
            taken: i64::from(!owns),
        }
    }

    #[inline]
    fn at(&self, x: i64, y: i64) -> i64 {
        self.start + x * self.right + y * self.down
    }

    /// The columns of `from..=to` in a row that starts at `value` for column 0 where it is 0 or more.
    fn span(&self, value: i64, (from, to): (i64, i64)) -> (i64, i64) {
        match self.right {
            0 if value >= 0 => (from, to),
            0 => (1, 0),
            // value + x right >= 0
            r if r > 0 => (from.max((-value + r - 1).div_euclid(r)), to),
            r => (from, to.min(value.div_euclid(-r))),
        }
    }
}

impl Band<'_> {
    fn draw(&mut self, piece: &Piece, id: u32) {
        let rows = self.depth.len() / self.width.max(1);
        let size = Size {
            width: self.width,
            height: self.first + rows,
        };
        let Some([x0, x1, y0, y1]) = pixels_of(piece, size) else {
            return;
        };
        let [mut a, mut b, c] = *piece;
        let turn = |a: [i32; 2], b: [i32; 2], c: [i32; 2]| {
            let d = |p: [i32; 2], i: usize| i64::from(p[i]) - i64::from(c[i]);
            d(a, 0) * d(b, 1) - d(a, 1) * d(b, 0)
        };
        let mut area = turn(a.0, b.0, c.0);
        if area < 0 {
            std::mem::swap(&mut a, &mut b);
            area = -area;
        }
        if area == 0 {
            return;
        }
        // Edge i is opposite corner i, so that its share of the area is the corner's weight.
        let edges = [
            Edge::new(b.0, c.0),
            Edge::new(c.0, a.0),
            Edge::new(a.0, b.0),
        ];
        let slope = [(a.1 - c.1) / area as f64, (b.1 - c.1) / area as f64];
        for y in y0.max(self.first as i64)..=y1 {
            let values = edges.map(|e| e.at(0, y));
            let mut span = (x0, x1);
            if x1 - x0 > NARROW {
                for (edge, value) in edges.iter().zip(values) {
                    span = edge.span(value, span);
                }
            }
            let row = (y as usize - self.first) * self.width;
            for x in span.0..=span.1 {
                let [wa, wb, wc] = [0, 1, 2].map(|i| values[i] + x * edges[i].right);
                if wa | wb | wc < 0 {
                    continue;
                }
                let (wa, wb) = (wa + edges[0].taken, wb + edges[1].taken);
                let key = (c.1 + wa as f64 * slope[0] + wb as f64 * slope[1]) as f32;
                let at = row + x as usize;
                // Triangles come in order: the first of equals is already there.
                if key < self.depth[at] {
                    self.depth[at] = key;
                    self.triangle[at] = id;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Lens, THREE_QUARTER};
    use crate::numeric::rng::Rng;
    use crate::spatial::aabb::Aabb;

    /// One unit of view space is one pixel; x right, y up from the middle.
    fn flat(size: Size) -> Camera {
        Camera {
            target: [0.0; 3],
            unit: 1.0,
            axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            distance: 8.0,
            lens: Lens::Orthographic {
                height: size.height as f64,
            },
        }
    }

    #[test]
    fn a_fan_around_a_pixel_centre_covers_every_pixel_once() {
        let size = Size {
            width: 41,
            height: 33,
        };
        for seed in 0..20 {
            let mut rng = Rng::new(seed, 0);
            // The hub lies on a pixel centre, and so do some of the rim: ties in every direction.
            let rim = 12;
            let mut positions = vec![[0.0, 0.0, 0.0]];
            for i in 0..rim {
                let angle = f64::from(i) / f64::from(rim) * std::f64::consts::TAU;
                let radius = 40.0 + rng.range(0.0, 9.0).round();
                positions.push([
                    (radius * angle.cos()).round(),
                    (radius * angle.sin()).round(),
                    0.0,
                ]);
            }
            let mut count = vec![0; size.width * size.height];
            for i in 0..rim as u32 {
                let triangle = [[0, 1 + i, 1 + (i + 1) % rim as u32]];
                let one = rasterize(&flat(size), size, &positions, &triangle);
                for (n, t) in count.iter_mut().zip(&one.triangle) {
                    *n += i32::from(*t != NOTHING);
                }
            }
            assert!(count.iter().all(|n| *n == 1), "{seed}");
        }
    }

    #[test]
    fn pixels_are_those_whose_centre_is_inside() {
        use crate::numeric::predicates::orient2d;
        let size = Size {
            width: 37,
            height: 29,
        };
        for seed in 0..300 {
            let mut rng = Rng::new(7, seed);
            // Places are multiples of 1/256, which rounding leaves alone; some far outside.
            let spread = if seed % 3 == 0 { 3000.0 } else { 30.0 };
            let mut place = || (rng.range(-spread, spread) * 256.0).round() / 256.0;
            let positions: Vec<Vec3> = (0..3).map(|_| [place(), place(), 0.0]).collect();
            let drawn = rasterize(&flat(size), size, &positions, &[[0, 1, 2]]);
            let [a, b, c] = [0, 1, 2].map(|i: usize| [positions[i][0], positions[i][1]]);
            for y in 0..size.height {
                for x in 0..size.width {
                    let p = [x as f64 + 0.5 - 18.5, 14.5 - y as f64 - 0.5];
                    let turns = [orient2d(a, b, p), orient2d(b, c, p), orient2d(c, a, p)];
                    let inside = turns == [1; 3] || turns == [-1; 3];
                    let found = drawn.triangle[y * size.width + x] == 0;
                    assert!(found == inside || turns.contains(&0), "{seed}: {x} {y}");
                }
            }
        }
    }

    #[test]
    fn the_nearer_triangle_wins_and_of_equals_the_first() {
        let size = Size {
            width: 16,
            height: 16,
        };
        let square = |z: f64| [[-9.0, -9.0, z], [30.0, -9.0, z], [-9.0, 30.0, z]];
        let positions = [square(0.0), square(1.0), square(1.0)].concat();
        let triangles = [[0, 1, 2], [3, 4, 5], [6, 7, 8]];
        let drawn = rasterize(&flat(size), size, &positions, &triangles);
        assert!(drawn.triangle.iter().all(|t| *t == 1));
        assert!(drawn.depth.iter().all(|d| *d == 7.0));
    }

    #[test]
    fn depth_is_that_of_the_plane_under_either_lens() {
        let size = Size {
            width: 64,
            height: 48,
        };
        let positions = [[-3.0, -2.0, 0.5], [3.0, -2.0, -1.0], [0.0, 3.0, 0.2]];
        let plane = |p: Vec3| {
            let [a, b, c] = positions;
            let n = crate::numeric::vector::cross(
                crate::numeric::vector::sub(b, a),
                crate::numeric::vector::sub(c, a),
            );
            crate::numeric::vector::dot(n, crate::numeric::vector::sub(p, a))
        };
        let bounds = Aabb::around(&positions);
        let up = [0.0, 1.0, 0.0];
        for camera in [
            Camera::framing(&bounds, THREE_QUARTER, up, size.aspect()),
            Camera::look_at([1.0, 2.0, 5.0], [0.0; 3], up, 0.8),
        ] {
            let drawn = rasterize(&camera, size, &positions, &[[0, 1, 2]]);
            let mut shown = 0;
            for (at, depth) in drawn.depth.iter().enumerate() {
                if drawn.triangle[at] == 0 {
                    shown += 1;
                    let (x, y) = (at % size.width, at / size.width);
                    let view =
                        camera.from_screen(x as f64 + 0.5, y as f64 + 0.5, f64::from(*depth), size);
                    let turned = camera.turn_back(view);
                    let world: Vec3 =
                        std::array::from_fn(|a| camera.target[a] + turned[a] * camera.unit);
                    // Rounding vertices to 1/256 pixel moves the plane by about as much.
                    assert!(plane(world).abs() < 0.2, "{}", plane(world));
                }
            }
            assert!(shown > 300, "{shown}");
        }
    }

    #[test]
    fn a_floor_that_passes_under_the_eye_reaches_the_horizon() {
        let size = Size {
            width: 40,
            height: 40,
        };
        let far = 1e7;
        let positions = [
            [-far, 0.0, -far],
            [far, 0.0, -far],
            [far, 0.0, far],
            [-far, 0.0, far],
        ];
        let triangles = [[0, 2, 1], [0, 3, 2]];
        let camera = Camera::look_at([0.0, 1.0, 0.0], [0.0, 1.0, -1.0], [0.0, 1.0, 0.0], 1.2);
        let drawn = rasterize(&camera, size, &positions, &triangles);
        for y in 0..40 {
            for x in 0..40 {
                let shown = drawn.triangle[y * 40 + x] != NOTHING;
                assert_eq!(shown, y >= 20, "{x} {y}");
            }
        }
    }

    #[test]
    fn threads_and_size_change_nothing() {
        let size = Size {
            width: 120,
            height: 90,
        };
        let mut rng = Rng::new(11, 0);
        let mut place = || [0; 3].map(|_| rng.range(-1.0, 1.0));
        let soup: Vec<Vec3> = (0..300).map(|_| place()).collect();
        let triangles: Vec<[u32; 3]> = (0..100).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let draw = |factor: f64, threads| {
            let positions: Vec<Vec3> = soup.iter().map(|p| p.map(|c| c * factor)).collect();
            let bounds = Aabb::around(&positions);
            let camera = Camera::framing(&bounds, THREE_QUARTER, [0.0, 1.0, 0.0], size.aspect());
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a pool");
            pool.install(|| rasterize(&camera, size, &positions, &triangles))
        };
        let base = draw(1.0, 1);
        assert!(base.triangle.iter().filter(|t| **t != NOTHING).count() > 2000);
        assert_eq!(base, draw(1.0, 4));
        assert_eq!(base, draw(2f64.powi(-100), 3));
        assert_eq!(base, draw(2f64.powi(100), 2));
    }
}
