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
        let in_front = self.camera.near().is_none_or(|near| depth >= near);
        let steps = |v: f64| (v * SUBPIXEL).round() as i32;
        // Written so that a place that is not a number is clipped.
        let place = (in_front && x.abs() <= GUARD && y.abs() <= GUARD)
            .then(|| [steps(x), steps(y)]);
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
            f([(a, corners[0].key), (b, corners[1].key), (c, corners[2].key)]);
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
                    kept.push(lerp(p, q, at_p / (at_p - at_q)));
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
        let hi = (p.max(q).max(r) - 128).div_euclid(256).min(count as i64 - 1);
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
        let edges = [Edge::new(b.0, c.0), Edge::new(c.0, a.0), Edge::new(a.0, b.0)];
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
