//! A molecule cut open along a tunnel, so that a picture shows the way out.

use super::Tunnel;
use super::shape::{area, bounds, tube, union};
use super::solid::Lattice;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, add, cross, dot, length, normalize, scale, sub};
use crate::progress::Progress;
use crate::protein::clearance::{Ball, Clearance};
use crate::spatial::aabb::Aabb;

/// Radius of the probe that does not enter the body: that of water.
const PROBE: f64 = 1.4;

/// How far from where the probe touches an atom its places are kept, in spacings: the diagonal of a cell.
const NEAR_TOUCH: f64 = 1.8;

/// Distance of the balls that open the way from a tunnel to the viewer, and how many there are at most.
const SHAFT_STEP: f64 = 0.4;
const MOST_SHAFT: f64 = 1000.0;

/// How much of their own surface balls show at most: in a molecule neighbours cover more.
const SHOWN: f64 = 0.3;

/// Balls of a tunnel that reach no further than this out of one of a tunnel before it are left out.
const SHARED: f64 = 0.1;

/// A molecule cut open, and how to look at it.
#[derive(Debug, Clone, PartialEq)]
pub struct CutOpen {
    /// What is left of the molecule: a closed surface.
    pub mesh: Mesh,
    /// The surface of each tunnel, without the course that it shares with those before it.
    pub tunnels: Vec<Mesh>,
    /// A unit vector from the cut to the viewer.
    pub viewer: Vec3,
    /// A unit vector that points up, across the viewer: from the start of the first tunnel to its end.
    pub up: Vec3,
}

/// How finely a molecule is cut open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fineness {
    /// Side of a cell for the molecule.
    pub molecule: f64,
    /// Side of a cell for tunnels.
    pub tunnels: f64,
}

/// Coordinates of the cut: x to the right, y up, z to the viewer, 0 at the cut.
#[derive(Debug, Clone, Copy)]
struct Plane {
    point: Vec3,
    axes: [Vec3; 3],
}

impl Plane {
    fn local(&self, p: Vec3) -> Vec3 {
        self.axes.map(|axis| dot(sub(p, self.point), axis))
    }

    fn world(&self, p: Vec3) -> Vec3 {
        (0..3).fold(self.point, |sum, a| add(sum, scale(self.axes[a], p[a])))
    }

    /// How far a place is in front of it.
    fn height(&self, p: Vec3) -> f64 {
        self.local(p)[2]
    }
}

/// The surface of a molecule with the half taken away that hides its first tunnel, and its tunnels.
///
/// The body is what a probe of radius 1.4 does not enter, without the tunnels, cut by the plane through
/// both ends of the first tunnel that its stops are nearest to; where a tunnel lies behind the plane, what
/// is in front of it goes too. Without tunnels the cut is through the middle. Lengths are in the unit of
/// the coordinates; details smaller than a cell are lost. Vertices lie on a surface that stands for the
/// probe's places by balls around points of a grid: it is for looking at, not for measuring.
///
/// Errs for a fineness that is not above 0, and with [`Error::Limit`] where it takes more than `memory`
/// bytes. Cost: linear in the points of a grid around the molecule, with three searches for each.
pub fn cut_open(
    balls: &[Ball],
    tunnels: &[Tunnel],
    fineness: Fineness,
    memory: u64,
    progress: &dyn Progress,
) -> Result<CutOpen> {
    let plane = plane(balls, tunnels);
    let atoms = Clearance::new(balls);
    let tubes: Vec<Vec<Ball>> = tunnels.iter().map(|t| tube(t, &atoms)).collect();
    let spacing = fineness.molecule;
    let lattice = Lattice::around(&bounds_of_probe(balls, plane, spacing), spacing)?;
    let mut needed = 2 * lattice.bytes(shown(balls));
    for tube in &tubes {
        needed += Lattice::around(&bounds(tube), fineness.tunnels)?.bytes(area(tube));
    }
    if needed > u128::from(memory) {
        let what = format!("cutting the molecule open at a spacing of {spacing}");
        return Err(Error::over_memory(what, needed, memory, None));
    }
    let probe = places_of_probe(&atoms, &lattice, plane, spacing);
    let ways = Clearance::new(&ways(&tubes, plane));
    let value = |local: Vec3| {
        let cut = -local[2];
        // Where it is cut away, nothing else has to be known.
        if cut < -spacing {
            return cut;
        }
        let p = plane.world(local);
        // Only what is near the surface has to be known exactly.
        let within = |balls: &Clearance, far: f64| balls.between(p, f64::NEG_INFINITY, far);
        let free = PROBE - within(&atoms, PROBE + spacing);
        let held = within(&probe, spacing).min(within(&ways, spacing));
        cut.min(free).min(held)
    };
    let inside = lattice.select(|p| value(p) >= 0.0);
    let mut mesh = lattice.surface(inside, value, progress)?;
    for p in &mut mesh.positions {
        *p = plane.world(*p);
    }
    let [_, up, viewer] = plane.axes;
    Ok(CutOpen {
        mesh,
        tunnels: apart(&tubes, fineness.tunnels, progress)?,
        viewer,
        up,
    })
}

/// The surface of each tube, without balls that one of those before it all but holds: where tunnels share a
/// course their surfaces would be in one place.
fn apart(tubes: &[Vec<Ball>], spacing: f64, progress: &dyn Progress) -> Result<Vec<Mesh>> {
    let mut before: Vec<Ball> = Vec::new();
    let mut all = Vec::with_capacity(tubes.len());
    for tube in tubes {
        let others = Clearance::new(&before);
        let is_own = |ball: &&Ball| others.at(ball.centre) + ball.radius > SHARED;
        let own: Vec<Ball> = tube.iter().filter(is_own).copied().collect();
        let lattice = Lattice::around(&bounds(&own), spacing)?;
        all.push(union(&own, &lattice, progress)?);
        before.extend_from_slice(tube);
    }
    Ok(all)
}

/// How much of balls shows at most.
fn shown(balls: &[Ball]) -> f64 {
    let square: f64 = balls.iter().map(|ball| ball.radius * ball.radius).sum();
    SHOWN * 4.0 * std::f64::consts::PI * square
}

/// The box, in coordinates of the cut, around balls and the places of the probe that touches them.
fn bounds_of_probe(balls: &[Ball], plane: Plane, spacing: f64) -> Aabb {
    let beyond = PROBE + NEAR_TOUCH * spacing;
    let grown: Vec<Ball> = balls
        .iter()
        .map(|ball| Ball {
            centre: plane.local(ball.centre),
            radius: ball.radius + beyond,
        })
        .collect();
    bounds(&grown)
}

/// Balls that no atom enters, large enough for the probe: around points near where it touches atoms.
///
/// Further out the clearance itself tells where the probe may be.
fn places_of_probe(atoms: &Clearance, lattice: &Lattice, plane: Plane, spacing: f64) -> Clearance {
    let reach = PROBE + NEAR_TOUCH * spacing;
    let clearance = |p: Vec3| atoms.between(plane.world(p), PROBE, reach);
    let near = lattice.select(|p| {
        // What is further in front of the cut leaves nothing behind it as it is.
        let clearance = if p[2] > reach { reach } else { clearance(p) };
        clearance > PROBE && clearance < reach
    });
    let place = |p: Vec3| Ball {
        centre: plane.world(p),
        radius: clearance(p),
    };
    let places: Vec<Ball> = lattice.points(&near).map(place).collect();
    Clearance::new(&places)
}

/// The balls of all tubes, and of each that lies behind the plane those from it to the plane.
fn ways(tubes: &[Vec<Ball>], plane: Plane) -> Vec<Ball> {
    let mut all = Vec::new();
    for ball in tubes.iter().flatten() {
        let depth = (-plane.height(ball.centre)).max(0.0);
        let steps = (depth / SHAFT_STEP).ceil().min(MOST_SHAFT);
        let step = depth / steps.max(1.0);
        all.extend((0..=steps as usize).map(|k| Ball {
            centre: add(ball.centre, scale(plane.axes[2], step * k as f64)),
            radius: ball.radius,
        }));
    }
    all
}

/// The plane of the cut.
fn plane(balls: &[Ball], tunnels: &[Tunnel]) -> Plane {
    let ends = tunnels.first().and_then(|tunnel| {
        let [start, exit] = [tunnel.stops.first()?, tunnel.stops.last()?].map(|s| s.centre);
        let way = normalize(sub(exit, start));
        (length(way) > 0.5).then_some((tunnel, start, way))
    });
    let Some((tunnel, point, up)) = ends else {
        return Plane {
            point: if balls.is_empty() {
                [0.0; 3]
            } else {
                bounds(balls).centre()
            },
            axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        };
    };
    // Two directions across the way, and the one of them that the stops spread along.
    let least = (0..3).fold(0, |l, a| if up[a].abs() < up[l].abs() { a } else { l });
    let mut other = [0.0; 3];
    other[least] = 1.0;
    let u = normalize(cross(up, other));
    let v = cross(up, u);
    let mut spread = [0.0; 3];
    for stop in &tunnel.stops {
        let from = sub(stop.centre, point);
        let [x, y] = [dot(from, u), dot(from, v)];
        spread[0] += x * x;
        spread[1] += y * y;
        spread[2] += x * y;
    }
    let angle = 0.5 * (2.0 * spread[2]).atan2(spread[0] - spread[1]);
    let normal = normalize(sub(scale(v, angle.cos()), scale(u, angle.sin())));
    // Of both sides, the one to which more of the tunnels lies.
    let stops = tunnels.iter().flat_map(|tunnel| &tunnel.stops);
    let height: f64 = stops.map(|stop| dot(sub(stop.centre, point), normal)).sum();
    let viewer = if height < 0.0 {
        scale(normal, -1.0)
    } else {
        normal
    };
    Plane {
        point,
        axes: [cross(up, viewer), up, viewer],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::topology::topology;
    use crate::progress::Silent;
    use crate::protein::tunnels::{Params, find};

    /// A cubic crystal, whose voids are channels along all axes.
    fn crystal() -> (Vec<Ball>, Vec<Tunnel>) {
        let point = |k: usize| [k % 6, k / 6 % 6, k / 36].map(|c| 4.2 * c as f64);
        let ball = |k: usize| Ball {
            centre: point(k),
            radius: 1.7,
        };
        let balls: Vec<Ball> = (0..216).map(ball).collect();
        let params = Params {
            count: 2,
            ..Params::DEFAULT
        };
        let found = find(&balls, [10.5; 3], &params, &Silent).expect("tunnels");
        (balls, found.tunnels)
    }

    fn fineness(molecule: f64) -> Fineness {
        Fineness {
            molecule,
            tunnels: 0.3,
        }
    }

    #[test]
    fn what_is_left_is_closed_and_shows_the_tunnel() {
        let (balls, tunnels) = crystal();
        let cut = cut_open(&balls, &tunnels, fineness(0.5), u64::MAX, &Silent).expect("a cut");
        let found = topology(&cut.mesh, &Silent).expect("a topology");
        assert!(found.closed && found.oriented, "{found:?}");
        assert!((length(cut.viewer) - 1.0).abs() < 1e-12);
        assert!(dot(cut.viewer, cut.up).abs() < 1e-12);
        let start = tunnels[0].stops[0].centre;
        let front = cut.mesh.positions.iter();
        let front = front.map(|p| dot(sub(*p, start), cut.viewer));
        let front = front.fold(f64::NEG_INFINITY, f64::max);
        assert!(front.abs() < 1e-6, "{front}");
        // The cut is flat: its vertices are on the plane, whatever the directions of the axes.
        let on_plane = |p: &&Vec3| dot(sub(**p, start), cut.viewer).abs() < 1e-6;
        assert!(cut.mesh.positions.iter().filter(on_plane).count() > 500);
        // No vertex lies in a tunnel, or before one.
        let atoms = Clearance::new(&balls);
        for ball in tube(&tunnels[0], &atoms) {
            for p in &cut.mesh.positions {
                assert!(ball.distance(*p) > -1e-6);
                let from = sub(*p, ball.centre);
                let before = dot(from, cut.viewer);
                let beside = length(sub(from, scale(cut.viewer, before)));
                let hides = before > 0.0 && beside < 0.9 * ball.radius;
                assert!(!hides, "{p:?} hides {ball:?}");
            }
        }
    }

    #[test]
    fn tunnels_are_drawn_once_where_they_share_a_course() {
        let (balls, tunnels) = crystal();
        let cut = cut_open(&balls, &tunnels, fineness(0.8), u64::MAX, &Silent).expect("a cut");
        assert_eq!(cut.tunnels.len(), 2);
        for mesh in &cut.tunnels {
            let found = topology(mesh, &Silent).expect("a topology");
            assert!(found.closed && found.oriented, "{found:?}");
        }
        let whole = cut_open(&balls, &tunnels[1..], fineness(0.8), u64::MAX, &Silent);
        let whole = &whole.expect("a cut").tunnels[0];
        assert!(cut.tunnels[1].triangles.len() < whole.triangles.len());
        let twice = [0, 0].map(|k: usize| tunnels[k].clone());
        let cut = cut_open(&balls, &twice, fineness(0.8), u64::MAX, &Silent).expect("a cut");
        assert!(!cut.tunnels[0].is_empty() && cut.tunnels[1].is_empty());
    }

    #[test]
    fn a_plane_goes_through_both_ends_and_near_the_stops() {
        let (balls, mut tunnels) = crystal();
        let tunnel = &mut tunnels[0];
        let bend = |k: usize| {
            let t = k as f64 / 20.0;
            [10.0 * t, 3.0 * (6.0 * t).sin() + 2.0, 0.1 * (9.0 * t).sin()]
        };
        let first = tunnel.stops[0];
        tunnel.stops = (0..=20)
            .map(|k| super::super::Stop {
                centre: bend(k),
                ..first
            })
            .collect();
        let plane = plane(&balls, &tunnels[..1]);
        let exit = plane.height(bend(20));
        assert!(exit.abs() < 1e-12, "{exit}");
        let [right, up, viewer] = plane.axes;
        assert!(viewer[2].abs() > 0.99, "{viewer:?}");
        assert!(dot(up, sub(bend(20), bend(0))) > 9.0);
        assert!(dot(cross(right, up), viewer) > 1.0 - 1e-12);
        let p = [3.0, -2.0, 7.0];
        assert!(length(sub(plane.world(plane.local(p)), p)) < 1e-12);
    }

    #[test]
    fn without_tunnels_the_cut_is_through_the_middle() {
        let (balls, mut tunnels) = crystal();
        let cut = cut_open(&balls, &[], fineness(0.8), u64::MAX, &Silent).expect("a cut");
        let highest = cut.mesh.positions.iter().map(|p| p[2]);
        let highest = highest.fold(f64::NEG_INFINITY, f64::max);
        assert!((highest - 10.5).abs() < 1e-6, "{highest}");
        tunnels
            .iter_mut()
            .for_each(|tunnel| tunnel.stops.truncate(1));
        cut_open(&balls, &tunnels, fineness(0.8), u64::MAX, &Silent).expect("a cut");
        let none = cut_open(&[], &[], fineness(0.8), u64::MAX, &Silent).expect("nothing");
        assert!(none.mesh.is_empty());
        let refused =
            cut_open(&balls, &tunnels, fineness(0.8), 1000, &Silent).expect_err("a limit");
        assert!(refused.to_string().contains("over the limit of 1000 bytes"));
    }
}
