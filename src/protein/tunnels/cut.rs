//! A molecule cut open along a tunnel, so that a picture shows the way out.

use super::Tunnel;
use super::shape::{bounds, tube};
use super::solid::Lattice;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, add, cross, dot, length, normalize, scale, sub};
use crate::progress::Progress;
use crate::protein::clearance::{Ball, Clearance};

/// Radius of the probe that does not enter the body: that of water.
const PROBE: f64 = 1.4;

/// How far from where the probe touches an atom its places are kept, in spacings: the diagonal of a cell.
const NEAR_TOUCH: f64 = 1.8;

/// Distance of the balls that open the way from a tunnel to the viewer, and how many there are at most.
const SHAFT_STEP: f64 = 0.4;
const MOST_SHAFT: f64 = 1000.0;

/// How much of their own surface balls show at most: in a molecule neighbours cover more.
const SHOWN: f64 = 0.3;

/// A molecule cut open, and how to look at it.
#[derive(Debug, Clone, PartialEq)]
pub struct CutOpen {
    /// What is left of the molecule: a closed surface.
    pub mesh: Mesh,
    /// A unit vector from the cut to the viewer.
    pub viewer: Vec3,
    /// A unit vector that points up, across the viewer: from the start of the first tunnel to its end.
    pub up: Vec3,
}

/// The plane of a cut: through a point, across a unit vector.
#[derive(Debug, Clone, Copy)]
struct Plane {
    point: Vec3,
    normal: Vec3,
}

impl Plane {
    /// How far a place is in front of it.
    fn height(&self, p: Vec3) -> f64 {
        dot(sub(p, self.point), self.normal)
    }
}

/// The surface of a molecule with the half taken away that hides its first tunnel.
///
/// The body is what a probe of radius 1.4 does not enter, without the tunnels, cut by the plane through
/// both ends of the first tunnel that its stops are nearest to; where a tunnel lies behind the plane, what
/// is in front of it goes too. Without tunnels the cut is through the middle. Lengths are in the unit of
/// the coordinates; `spacing` is the side of a cell, and details smaller than it are lost. Vertices lie on
/// a surface that stands for the probe's places by those nearest to points of a grid: it is for looking
/// at, not for measuring.
///
/// Errs for a spacing that is not above 0, and with [`Error::Limit`] where it takes more than `memory`
/// bytes. Cost: linear in the points of a grid around the molecule, with two searches for each.
pub fn cut_open(
    balls: &[Ball],
    tunnels: &[Tunnel],
    spacing: f64,
    memory: u64,
    progress: &dyn Progress,
) -> Result<CutOpen> {
    let (plane, up) = plane(balls, tunnels);
    let lattice = Lattice::around(&bounds(balls), spacing)?;
    let needed = 2 * lattice.bytes(area(balls));
    if needed > u128::from(memory) {
        let what = format!("cutting the molecule open at a spacing of {spacing}");
        return Err(Error::over_memory(what, needed, memory, None));
    }
    let atoms = Clearance::new(balls);
    let probe = places_of_probe(&atoms, &lattice, spacing);
    let ways = Clearance::new(&ways(tunnels, &atoms, plane));
    let value = |p: Vec3| {
        let cut = -plane.height(p);
        // Where it is cut away, nothing else has to be known.
        if cut < -spacing {
            return cut;
        }
        let free = PROBE - atoms.at(p);
        cut.min(free).min(probe.at(p)).min(ways.at(p))
    };
    let inside = lattice.select(|p| value(p) >= 0.0);
    let mesh = lattice.surface(inside, value, progress)?;
    Ok(CutOpen {
        mesh,
        viewer: plane.normal,
        up,
    })
}

fn area(balls: &[Ball]) -> f64 {
    let square: f64 = balls.iter().map(|ball| ball.radius * ball.radius).sum();
    SHOWN * 4.0 * std::f64::consts::PI * square
}

/// Balls that no atom enters, large enough for the probe: around points near where it touches atoms.
///
/// Further out the clearance itself tells where the probe may be.
fn places_of_probe(atoms: &Clearance, lattice: &Lattice, spacing: f64) -> Clearance {
    let reach = PROBE + NEAR_TOUCH * spacing;
    let clearance = |p: Vec3| atoms.between(p, PROBE, reach);
    let near = lattice.select(|p| {
        let clearance = clearance(p);
        clearance > PROBE && clearance < reach
    });
    let place = |p: Vec3| Ball {
        centre: p,
        radius: clearance(p),
    };
    let places: Vec<Ball> = lattice.points(&near).map(place).collect();
    Clearance::new(&places)
}

/// The balls of all tunnels, and of each that lies behind the plane those from it to the plane.
fn ways(tunnels: &[Tunnel], atoms: &Clearance, plane: Plane) -> Vec<Ball> {
    let mut all = Vec::new();
    for ball in tunnels.iter().flat_map(|tunnel| tube(tunnel, atoms)) {
        let depth = (-plane.height(ball.centre)).max(0.0);
        let steps = (depth / SHAFT_STEP).ceil().min(MOST_SHAFT);
        let step = depth / steps.max(1.0);
        all.extend((0..=steps as usize).map(|k| Ball {
            centre: add(ball.centre, scale(plane.normal, step * k as f64)),
            radius: ball.radius,
        }));
    }
    all
}

/// The plane of the cut, its normal to the viewer, and what is up there.
fn plane(balls: &[Ball], tunnels: &[Tunnel]) -> (Plane, Vec3) {
    let ends = tunnels.first().and_then(|tunnel| {
        let [start, exit] = [tunnel.stops.first()?, tunnel.stops.last()?].map(|s| s.centre);
        let way = normalize(sub(exit, start));
        (length(way) > 0.5).then_some((tunnel, start, way))
    });
    let Some((tunnel, point, up)) = ends else {
        let normal = [0.0, 0.0, 1.0];
        let point = bounds(balls).centre();
        return (Plane { point, normal }, [0.0, 1.0, 0.0]);
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
    let normal = sub(scale(v, angle.cos()), scale(u, angle.sin()));
    let plane = Plane { point, normal };
    // Of both sides, the one to which more of the tunnels lies.
    let stops = tunnels.iter().flat_map(|tunnel| &tunnel.stops);
    let height: f64 = stops.map(|stop| plane.height(stop.centre)).sum();
    let normal = if height < 0.0 {
        scale(normal, -1.0)
    } else {
        normal
    };
    (Plane { point, normal }, up)
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

    #[test]
    fn what_is_left_is_closed_and_shows_the_tunnel() {
        let (balls, tunnels) = crystal();
        let cut = cut_open(&balls, &tunnels, 0.5, u64::MAX, &Silent).expect("a cut");
        let found = topology(&cut.mesh, &Silent).expect("a topology");
        assert!(found.closed && found.oriented, "{found:?}");
        assert!((length(cut.viewer) - 1.0).abs() < 1e-12);
        assert!(dot(cut.viewer, cut.up).abs() < 1e-12);
        let start = tunnels[0].stops[0].centre;
        let front = cut.mesh.positions.iter();
        let front = front.map(|p| dot(sub(*p, start), cut.viewer));
        let front = front.fold(f64::NEG_INFINITY, f64::max);
        assert!(front.abs() < 1e-6, "{front}");
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
        let (plane, up) = plane(&balls, &tunnels[..1]);
        let exit = plane.height(bend(20));
        assert!(exit.abs() < 1e-12, "{exit}");
        assert!(plane.normal[2].abs() > 0.99, "{:?}", plane.normal);
        assert!(dot(up, sub(bend(20), bend(0))) > 9.0);
    }

    #[test]
    fn without_tunnels_the_cut_is_through_the_middle() {
        let (balls, mut tunnels) = crystal();
        let cut = cut_open(&balls, &[], 0.8, u64::MAX, &Silent).expect("a cut");
        let highest = cut.mesh.positions.iter().map(|p| p[2]);
        let highest = highest.fold(f64::NEG_INFINITY, f64::max);
        assert!((highest - 10.5).abs() < 1e-6, "{highest}");
        tunnels
            .iter_mut()
            .for_each(|tunnel| tunnel.stops.truncate(1));
        cut_open(&balls, &tunnels, 0.8, u64::MAX, &Silent).expect("a cut");
        let none = cut_open(&[], &[], 0.8, u64::MAX, &Silent).expect("nothing");
        assert!(none.mesh.is_empty());
        let refused = cut_open(&balls, &tunnels, 0.8, 1000, &Silent).expect_err("a limit");
        assert!(refused.to_string().contains("over the limit of 1000 bytes"));
    }
}
