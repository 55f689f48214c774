//! Shadow rays, and what they tell.

use super::{Light, Near, Params, REFERENCE_RAYS};
use crate::mesh::tracer::{Ray, Tracer};
use crate::numeric::rng::Rng;
use crate::numeric::vector::{Vec3, add, cross, dot, length, normalize, scale, sub};
use crate::report;
use crate::volume::Data;
use crate::volume::octree::{Octree, RayTree};
use crate::volume::trace::{GridRay, Visits, any_set};
use crate::volume::voxelize::{Lattice, Lazy};
use std::f64::consts::TAU;

/// Rays go by triangles for at least so many voxels: a voxel that holds the start reaches no farther.
pub const NEAR_LEAST: f64 = 1.732_050_807_568_877_3;

/// Rays start this far over the surface, in lengths of which the model has less than one along its
/// longest side: more than the rounding of a place on it.
const LIFT: f64 = 1.0 / (1u64 << 34) as f64;

/// The angle between one end of a ray and the next, by which they cover a disc evenly.
const GOLDEN: f64 = 2.399_963_229_728_653;

/// Samples of the reference are drawn from the seed turned over.
const OTHER: u64 = 0x5bd1_e995_7c4a_11a3;

/// Casts shadow rays.
pub(super) struct Caster<'a> {
    tracer: &'a Tracer,
    grid: Option<Grid<'a>>,
    lights: &'a [Light],
    params: &'a Params,
}

/// The voxels that shadow rays meet.
pub(super) struct Grid<'a> {
    pub lattice: Lattice,
    pub voxels: Voxels<'a>,
}

/// How voxels are held.
pub(super) enum Voxels<'a> {
    /// An octree that is there.
    Octree(RayTree<'a>, &'a Octree),
    /// An octree made where rays go.
    Lazy(Box<Lazy<'a>>),
    /// Voxels to be looked at one by one.
    Each(&'a Data),
}

/// A place from which shadow rays start.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    place: Vec3,
    normal: Vec3,
    /// Whether it is on the mesh, in whose voxels it then lies.
    on_mesh: bool,
}

/// The rays of one pixel or vertex.
pub(super) struct Rays {
    /// For each start: light that comes in, light that would if nothing were in the way, rays meant.
    starts: [[f64; 3]; 4],
    count: usize,
    cast: u64,
    blocked: u64,
    /// Of the same rays by triangles.
    blocked_exactly: u64,
    leaking: u64,
    falsely: u64,
    /// Blocked share of the rays of the reference.
    reference: Option<f64>,
    visits: Visits,
    unmasked: Visits,
    crossed: Visits,
}

/// What many rays told.
#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    pub shaded: u64,
    pub rays: u64,
    pub blocked: u64,
    pub differing: u64,
    pub leaks: u64,
    pub falses: u64,
    pub leaking: u64,
    pub falsely: u64,
    pub difference: f64,
    pub error: f64,
    pub visits: Visits,
    pub unmasked: Visits,
    pub crossed: Visits,
}

impl Tally {
    /// Counts the rays of one pixel or vertex.
    pub fn note(&mut self, rays: &Rays) {
        if rays.cast == 0 {
            return;
        }
        let share = |blocked: u64| blocked as f64 / rays.cast as f64;
        self.shaded += 1;
        self.rays += rays.cast;
        self.blocked += rays.blocked;
        self.leaks += u64::from(rays.leaking > 0);
        self.falses += u64::from(rays.falsely > 0);
        self.differing += u64::from(rays.leaking + rays.falsely > 0);
        self.leaking += rays.leaking;
        self.falsely += rays.falsely;
        self.difference += (share(rays.blocked) - share(rays.blocked_exactly)).abs();
        if let Some(reference) = rays.reference {
            self.error += (share(rays.blocked) - reference).abs();
        }
        self.visits += rays.visits;
        self.unmasked += rays.unmasked;
        self.crossed += rays.crossed;
    }

    /// Adds what comes later in order.
    pub fn add(&mut self, more: &Tally) {
        self.shaded += more.shaded;
        self.rays += more.rays;
        self.blocked += more.blocked;
        self.differing += more.differing;
        self.leaks += more.leaks;
        self.falses += more.falses;
        self.leaking += more.leaking;
        self.falsely += more.falsely;
        self.difference += more.difference;
        self.error += more.error;
        self.visits += more.visits;
        self.unmasked += more.unmasked;
        self.crossed += more.crossed;
    }
}

impl Rays {
    /// Mean cosine of the light that comes in at a start, 0 to 1; that of the whole pixel where no
    /// ray was meant for this start.
    pub fn seen(&self, start: usize) -> f64 {
        let [light, _, meant] = self.figures(start);
        light / meant.max(1.0)
    }

    /// Light that comes in over light that would if nothing were in the way; 1 where none would.
    pub fn open(&self, start: usize) -> f64 {
        let [light, whole, _] = self.figures(start);
        if whole > 0.0 { light / whole } else { 1.0 }
    }

    fn figures(&self, start: usize) -> [f64; 3] {
        if self.starts[start][2] > 0.0 {
            return self.starts[start];
        }
        let all = &self.starts[..self.count];
        all.iter().fold([0.0; 3], |sum, s| add(sum, *s))
    }
}

impl<'a> Caster<'a> {
    pub fn new(
        tracer: &'a Tracer,
        grid: Option<Grid<'a>>,
        lights: &'a [Light],
        params: &'a Params,
    ) -> Self {
        Caster {
            tracer,
            grid,
            lights,
            params,
        }
    }

    /// The voxels; none where rays go by triangles alone.
    pub fn grid(&self) -> Option<&Grid<'a>> {
        self.grid.as_ref()
    }

    /// A place on a surface with a unit normal towards the side that is seen.
    pub fn start(&self, place: Vec3, normal: Vec3, on_mesh: bool) -> Start {
        let lift = if on_mesh { LIFT } else { 0.0 };
        Start {
            place: add(place, scale(normal, lift)),
            normal,
            on_mesh,
        }
    }

    /// Lights whose centre lies in a voxel that is set.
    pub fn lights_in_voxels(&self) -> report::Tally {
        let mut found = report::Tally::default();
        let Some(grid) = &self.grid else {
            return found;
        };
        for (index, light) in self.lights.iter().enumerate() {
            let centre = grid.lattice.to_grid(light.centre);
            let point = GridRay::new(centre, [0.0; 3], [0.0; 2]);
            if grid.any_hit(&point, &mut Visits::default()) {
                found.note(index as u64);
            }
        }
        found
    }

    /// Casts the rays of one pixel or vertex, spread over up to four starts.
    pub fn rays(&self, starts: &[Start], index: u64) -> Rays {
        let starts = &starts[..starts.len().min(4)];
        let mut rays = Rays {
            starts: [[0.0; 3]; 4],
            count: starts.len(),
            cast: 0,
            blocked: 0,
            blocked_exactly: 0,
            leaking: 0,
            falsely: 0,
            reference: None,
            visits: Visits::default(),
            unmasked: Visits::default(),
            crossed: Visits::default(),
        };
        if starts.is_empty() {
            return rays;
        }
        let count = self.params.rays;
        self.aim(
            starts,
            index,
            self.params.seed,
            count,
            |which, target, cosine| {
                let start = &starts[which];
                rays.starts[which][2] += 1.0;
                if cosine <= 0.0 {
                    return;
                }
                let blocked = self.is_blocked(start, target, cosine, &mut rays);
                rays.cast += 1;
                rays.blocked += u64::from(blocked);
                rays.starts[which][1] += cosine;
                if !blocked {
                    rays.starts[which][0] += cosine;
                }
                let exactly = self.params.verify && self.is_blocked_exactly(start, target, 1.0);
                if self.params.verify {
                    rays.blocked_exactly += u64::from(exactly);
                    rays.leaking += u64::from(exactly && !blocked);
                    rays.falsely += u64::from(blocked && !exactly);
                }
            },
        );
        if self.params.verify && rays.cast > 0 {
            rays.reference = Some(self.reference(starts, index));
        }
        rays
    }

    /// Calls `f(start, end, cosine)` for each ray to each light.
    fn aim(
        &self,
        starts: &[Start],
        index: u64,
        seed: u64,
        count: u32,
        mut f: impl FnMut(usize, Vec3, f64),
    ) {
        let lights = self.lights.len() as u64;
        for (number, light) in (0u64..).zip(self.lights) {
            let mut rng = Rng::new(seed, index.wrapping_mul(lights).wrapping_add(number));
            let (jitter, turn) = (rng.unit(), rng.unit() * TAU);
            for k in 0..count as usize {
                let which = k % starts.len();
                let start = &starts[which];
                // Each is turned on by the golden angle, and covers as much of the disc (Vogel 1979).
                let radius = ((k as f64 + jitter) / f64::from(count)).sqrt() * light.radius;
                let (sin, cos) = (k as f64 * GOLDEN + turn).sin_cos();
                let [e, f_] = across(sub(light.centre, start.place));
                let on_disc = add(scale(e, radius * cos), scale(f_, radius * sin));
                let target = add(light.centre, on_disc);
                let way = sub(target, start.place);
                f(which, target, dot(start.normal, normalize(way)));
            }
        }
    }

    /// The blocked share by triangles of rays of their own: few where these agree, more where not.
    fn reference(&self, starts: &[Start], index: u64) -> f64 {
        let few = self.reference_of(REFERENCE_RAYS, starts, index);
        if few == 0.0 || few == 1.0 {
            return few;
        }
        let more = self.params.rays.saturating_mul(4);
        self.reference_of(more.max(4 * REFERENCE_RAYS), starts, index)
    }

    fn reference_of(&self, count: u32, starts: &[Start], index: u64) -> f64 {
        let (mut cast, mut blocked) = (0u64, 0u64);
        let seed = !self.params.seed ^ OTHER;
        self.aim(starts, index, seed, count, |which, target, cosine| {
            if cosine > 0.0 {
                cast += 1;
                blocked += u64::from(self.is_blocked_exactly(&starts[which], target, 1.0));
            }
        });
        blocked as f64 / cast.max(1) as f64
    }

    fn is_blocked_exactly(&self, start: &Start, target: Vec3, end: f64) -> bool {
        self.tracer.any(&Ray {
            origin: start.place,
            direction: sub(target, start.place),
            reach: [0.0, end],
        })
    }

    /// Whether something is between a start and a place on a light.
    fn is_blocked(&self, start: &Start, target: Vec3, cosine: f64, rays: &mut Rays) -> bool {
        let Some(grid) = &self.grid else {
            return self.is_blocked_exactly(start, target, 1.0);
        };
        let mut from = 0.0;
        let is_exact = self.params.near == Near::Exact;
        // What lies beside the mesh is in none of its voxels, but maybe near some of them.
        if is_exact || start.on_mesh {
            let thick: f64 = start.normal.iter().map(|c| c.abs()).sum();
            let near = ((thick + 1.0) / cosine).max(NEAR_LEAST) * grid.lattice.h;
            let way = length(sub(target, start.place));
            // Written so that a light on the start itself is near.
            from = if near < way { near / way } else { 1.0 };
            if is_exact && self.is_blocked_exactly(start, target, from) {
                return true;
            }
            if from >= 1.0 {
                return false;
            }
        }
        let origin = grid.lattice.to_grid(start.place);
        let direction = sub(grid.lattice.to_grid(target), origin);
        let ray = GridRay::new(origin, direction, [from, 1.0]);
        if self.params.verify {
            if let Voxels::Octree(tree, _) = &grid.voxels {
                tree.any_hit(&ray, false, &mut rays.unmasked);
            }
            grid.walk(&ray, &mut rays.crossed);
        }
        grid.any_hit(&ray, &mut rays.visits)
    }
}

impl Grid<'_> {
    /// Whether a ray hits a voxel.
    fn any_hit(&self, ray: &GridRay, visits: &mut Visits) -> bool {
        match &self.voxels {
            Voxels::Octree(tree, _) => tree.any_hit(ray, true, visits),
            Voxels::Lazy(tree) => tree.any_hit(ray, visits),
            Voxels::Each(_) => self.walk(ray, visits),
        }
    }

    /// The same voxel by voxel; no voxel of an octree that is made where rays go.
    fn walk(&self, ray: &GridRay, visits: &mut Visits) -> bool {
        let dims = self.lattice.dims;
        match &self.voxels {
            Voxels::Lazy(_) => false,
            Voxels::Octree(_, tree) => any_set(dims, ray, |x, y, z| tree.get(x, y, z), visits),
            Voxels::Each(Data::Sparse(tree)) => {
                any_set(dims, ray, |x, y, z| tree.get(x, y, z), visits)
            }
            Voxels::Each(Data::Bits(bits)) => {
                any_set(dims, ray, |x, y, z| bits.get(x, y, z), visits)
            }
            Voxels::Each(_) => false,
        }
    }
}

/// Two unit vectors across a direction and each other; any two across 0.
fn across(direction: Vec3) -> [Vec3; 2] {
    let d = normalize(direction);
    let least = (0..3).fold(0, |l, a| if d[a].abs() < d[l].abs() { a } else { l });
    let mut other = [0.0; 3];
    other[least] = 1.0;
    let e = normalize(cross(other, d));
    [e, cross(d, e)]
}
