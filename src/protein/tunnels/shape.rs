//! Tunnels as things: balls for programs that show molecules, and the surface of a tube.

use super::Tunnel;
use super::solid::Lattice;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, length, lerp, sub};
use crate::progress::Progress;
use crate::protein::clearance::{Ball, Clearance};
use crate::protein::{Atom, Element, Model, Molecule, Name, Residue};
use crate::spatial::aabb::Aabb;

/// Name of the residues that tunnels are.
pub const RESIDUE: &[u8] = b"TUN";

/// Name of the chain that holds them.
pub const CHAIN: &[u8] = b"T";

/// Balls of a tube between two stops, for each stop.
const DENSITY: f64 = 4.0;

/// Balls of a tube at most, for whatever steps: closer ones change nothing that can be seen.
const SMALLEST_GAP: f64 = 0.02;

/// Each tunnel's grid is moved by one more of these shares of the spacing: where tunnels share a course, no
/// vertex of one is at the place of another's, which those who join vertices by their places would take
/// for one.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// The stops of tunnels as atoms: a residue for each tunnel, in order, numbered from 1.
///
/// Atoms are hydrogens with names of their own, as readers drop the second of a name; each has the
/// clearance at its stop for radius and temperature factor (0 where it is negative). Tunnels without stops
/// are left out, but counted. Cost: linear in the stops.
pub fn spheres(tunnels: &[Tunnel]) -> Molecule {
    let mut molecule = Molecule::default();
    for (number, tunnel) in (1..).zip(tunnels).filter(|(_, t)| !t.stops.is_empty()) {
        let first = molecule.atoms.len() as u32;
        let residue = molecule.residues.len() as u32;
        for (index, stop) in tunnel.stops.iter().enumerate() {
            let radius = stop.radius.max(0.0);
            molecule.atoms.push(Atom {
                position: stop.centre,
                radius: Some(radius),
                serial: molecule.atoms.len() as i64 + 1,
                name: name_of(index),
                residue,
                occupancy: 1.0,
                b_factor: radius as f32,
                element: Element::HYDROGEN,
                altloc: b' ',
                hetero: true,
            });
        }
        molecule.residues.push(Residue {
            name: Name::new(RESIDUE).unwrap_or_default(),
            chain: Name::new(CHAIN).unwrap_or_default(),
            number,
            insertion: b' ',
            in_polymer: false,
            atoms: first..molecule.atoms.len() as u32,
        });
    }
    let end = molecule.atoms.len() as u32;
    if end > 0 {
        molecule.models.push(Model {
            number: 1,
            atoms: 0..end,
        });
    }
    molecule
}

/// `H1` to `H999`, then `HA00` to `HZZZ`, then again: four columns hold no more.
fn name_of(index: usize) -> Name {
    const DIGITS: &[u8; 36] = b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ";
    /// The first of three digits in base 36 that begin with a letter, and how many there are.
    const LETTERS: [usize; 2] = [10 * 36 * 36, 26 * 36 * 36];
    let text = match (index + 1) % (1000 + LETTERS[1]) {
        number @ 0..1000 => format!("H{number}").into_bytes(),
        number => {
            let code = LETTERS[0] + number - 1000;
            let digit = |place: usize| DIGITS[code / place % 36];
            vec![b'H', digit(36 * 36), digit(36), digit(1)]
        }
    };
    Name::new(&text).unwrap_or_default()
}

/// Balls along a tunnel, four for each step between stops: none enters an atom.
///
/// The radius of each is the clearance there; where that is not above 0 there is none.
pub(super) fn tube(tunnel: &Tunnel, clearance: &Clearance) -> Vec<Ball> {
    let ball = |centre: Vec3| Ball {
        centre,
        radius: clearance.at(centre),
    };
    let mut balls: Vec<Ball> = tunnel
        .stops
        .first()
        .map(|stop| ball(stop.centre))
        .into_iter()
        .collect();
    for pair in tunnel.stops.windows(2) {
        let gap = length(sub(pair[1].centre, pair[0].centre));
        let pieces = (gap / SMALLEST_GAP).ceil().clamp(1.0, DENSITY);
        let between = (1..=pieces as usize).map(|k| k as f64 / pieces);
        balls.extend(between.map(|t| ball(lerp(pair[0].centre, pair[1].centre, t))));
    }
    balls.retain(|ball| ball.radius > 0.0 && ball.radius.is_finite());
    balls
}

/// Over how much of a surface balls along a line spread at most: their own, and the sides between them.
pub(super) fn area(balls: &[Ball]) -> f64 {
    use std::f64::consts::PI;
    let ends = [balls.first(), balls.last()].into_iter().flatten();
    let caps: f64 = ends.map(|ball| 2.0 * PI * ball.radius * ball.radius).sum();
    let side = |pair: &[Ball]| {
        let gap = length(sub(pair[1].centre, pair[0].centre));
        let change = (pair[1].radius - pair[0].radius).abs();
        2.0 * PI * pair[0].radius.max(pair[1].radius) * (gap + change)
    };
    caps + balls.windows(2).map(side).sum::<f64>()
}

/// The box around balls.
pub(super) fn bounds(balls: &[Ball]) -> Aabb {
    let box_of = |ball: &Ball| Aabb {
        lo: ball.centre.map(|c| c - ball.radius),
        hi: ball.centre.map(|c| c + ball.radius),
    };
    balls.iter().map(box_of).fold(Aabb::EMPTY, Aabb::union)
}

/// The spacing for the surface of tunnels: a quarter of the least radius of the narrowest, but between 0.1
/// and 0.5.
///
/// At a quarter of a tube's radius its surface keeps to one piece, and is off by a thirtieth of that at
/// most. Cost: linear in the tunnels.
pub fn spacing_for(tunnels: &[Tunnel]) -> f64 {
    let radii = tunnels.iter().map(|tunnel| tunnel.narrowest.radius);
    (0.25 * radii.fold(f64::INFINITY, f64::min)).clamp(0.1, 0.5)
}

/// The surface of each tunnel: that of all balls along its centreline that touch the nearest atom.
///
/// Lengths are in the unit of the coordinates. Each tunnel is a closed mesh of its own, and all are joined
/// in order; [`Mesh::sides`] tells of each triangle the number of the tunnel inside, from 1, with 0
/// outside. Where tunnels share a course their surfaces run through one another. `clearance` is that of
/// the atoms: no vertex lies in one. Vertices lie on the surface of the balls to a billionth of the
/// spacing; in the midst of triangles, which cut corners, the error is up to 0.5 `spacing`^2 over the
/// radius of the ball there, and in a crease between balls up to `spacing`. Parts narrower than the
/// spacing may be lost.
///
/// Errs for a spacing that is not above 0, and with [`Error::Limit`] where the work takes more than
/// `memory` bytes. Cost: linear in the points of a grid around each tunnel, which take a bit each, and in
/// the vertices.
pub fn surface(
    tunnels: &[Tunnel],
    clearance: &Clearance,
    spacing: f64,
    memory: u64,
    progress: &dyn Progress,
) -> Result<Mesh> {
    let tubes: Vec<Vec<Ball>> = tunnels.iter().map(|t| tube(t, clearance)).collect();
    let mut lattices = Vec::with_capacity(tubes.len());
    let (mut kept, mut largest) = (0, 0);
    for (rank, tube) in tubes.iter().enumerate() {
        let share = (rank as f64 * GOLDEN).fract();
        let lattice = Lattice::around(&bounds(tube), spacing)?.moved(share);
        let [grid, all] = [lattice.bytes(0.0), lattice.bytes(area(tube))];
        kept += all - grid;
        largest = largest.max(grid);
        lattices.push(lattice);
    }
    let needed = kept + largest;
    if needed > u128::from(memory) {
        let what = format!("the surface of the tunnels at a spacing of {spacing}");
        let hint = Some("a larger spacing takes less");
        return Err(Error::over_memory(what, needed, memory, hint));
    }
    let mut joined = Mesh::default();
    let mut sides = Vec::new();
    for ((number, tube), lattice) in (1..).zip(&tubes).zip(&lattices) {
        let mesh = union(tube, lattice, progress)?;
        joined.append(&mesh)?;
        sides.resize(joined.triangles.len(), [number, 0]);
    }
    joined.sides = Some(sides);
    Ok(joined)
}

/// The surface of balls together.
pub(super) fn union(balls: &[Ball], lattice: &Lattice, progress: &dyn Progress) -> Result<Mesh> {
    let near = Clearance::new(balls);
    // The first ball found to hold a point tells that it is inside.
    let inside = lattice.select(|p| near.between(p, 0.0, f64::INFINITY) <= 0.0);
    lattice.surface(inside, |p| -near.at(p), progress)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::distance::point_triangle;
    use crate::mesh::topology::topology;
    use crate::numeric::rng::Rng;
    use crate::numeric::vector::{add, normalize, scale};
    use crate::progress::Silent;
    use crate::protein::tunnels::{Params, find};

    fn ball(centre: Vec3, radius: f64) -> Ball {
        Ball { centre, radius }
    }

    fn surface_of(balls: &[Ball], spacing: f64) -> Mesh {
        let lattice = Lattice::around(&bounds(balls), spacing).expect("a lattice");
        union(balls, &lattice, &Silent).expect("a surface")
    }

    /// The volume that a surface encloses, once it is sure to be closed.
    fn volume(mesh: &Mesh) -> f64 {
        let found = topology(mesh, &Silent).expect("a topology");
        assert!(found.closed && found.oriented, "{found:?}");
        found.volume.expect("a volume")
    }

    /// How far vertices are from the surface of balls, and places in the midst of triangles.
    fn errors(mesh: &Mesh, balls: &[Ball]) -> [f64; 2] {
        let near = Clearance::new(balls);
        let largest =
            |all: &mut dyn Iterator<Item = Vec3>| all.map(|p| near.at(p).abs()).fold(0.0, f64::max);
        let mut rng = Rng::new(3, 0);
        let mut within = (0..8 * mesh.triangles.len()).map(|k| {
            let [a, b, c] = mesh.corners(k / 8);
            let (mut u, mut v) = (rng.unit(), rng.unit());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let along = scale(sub(b, a), u);
            add(a, add(along, scale(sub(c, a), v)))
        });
        let vertices = largest(&mut mesh.positions.iter().copied());
        [vertices, largest(&mut within)]
    }

    #[test]
    fn vertices_lie_on_a_ball_and_triangles_near_it() {
        let mut rng = Rng::new(4, 0);
        for spacing in [0.7, 0.31, 0.1] {
            let centre = [0, 1, 2].map(|_| rng.range(-40.0, 40.0));
            let balls = [ball(centre, 1.3)];
            let mesh = surface_of(&balls, spacing);
            let [at, between] = errors(&mesh, &balls);
            assert!(at <= 1e-9 * spacing, "{at}");
            let bound = 0.5 * spacing * spacing / 1.3;
            assert!(between <= bound, "{between} {bound}");
            // No bound is of use that is far from what is reached.
            assert!(between >= 0.1 * bound, "{between} {bound}");
            let short = 1.0 - volume(&mesh) / (4.0 / 3.0 * std::f64::consts::PI * 1.3f64.powi(3));
            assert!(short > 0.0 && short < 2.0 * bound / 1.3, "{short}");
        }
    }

    #[test]
    fn two_balls_that_overlap_make_one_surface_with_a_crease() {
        let balls = [ball([0.0; 3], 1.5), ball([1.1, 0.7, -0.4], 1.2)];
        let spacing = 0.15;
        let mesh = surface_of(&balls, spacing);
        let [at, between] = errors(&mesh, &balls);
        assert!(at <= 1e-9 * spacing, "{at}");
        assert!(between <= spacing, "{between}");
        // Away from the crease it is as near as on one ball.
        let gap = [0, 1].map(|k: usize| move |p: Vec3| balls[k].distance(p));
        let creased = |t: usize| {
            let sides = mesh.corners(t).map(|p| gap[0](p) < gap[1](p));
            sides[0] != sides[1] || sides[1] != sides[2]
        };
        let smooth: Vec<usize> = (0..mesh.triangles.len()).filter(|t| !creased(*t)).collect();
        let plain = Mesh {
            triangles: smooth.iter().map(|t| mesh.triangles[*t]).collect(),
            ..mesh.clone()
        };
        let [_, between] = errors(&plain, &balls);
        assert!(between <= 0.5 * spacing * spacing / 1.2, "{between}");
        // And no part of the balls' surface is far from the mesh.
        let mut rng = Rng::new(5, 0);
        let mut furthest: f64 = 0.0;
        for k in 0..400 {
            let ball = balls[k % 2];
            let way = normalize([0, 1, 2].map(|_| rng.range(-1.0, 1.0)));
            let p = add(ball.centre, scale(way, ball.radius));
            if balls[(k + 1) % 2].distance(p) < 0.0 {
                continue;
            }
            let gaps = (0..mesh.triangles.len()).map(|t| {
                let closest = point_triangle(p, mesh.corners(t));
                length(sub(closest.point, p))
            });
            furthest = furthest.max(gaps.fold(f64::INFINITY, f64::min));
        }
        assert!(furthest <= spacing, "{furthest}");
        let lens = two_balls(&balls);
        let short = (volume(&mesh) - lens) / lens;
        assert!(short < 0.0 && short > -0.02, "{short}");
    }

    /// The volume of two balls that overlap.
    fn two_balls([a, b]: &[Ball; 2]) -> f64 {
        use std::f64::consts::PI;
        let d = length(sub(a.centre, b.centre));
        let whole: f64 = [a, b]
            .map(|o| 4.0 / 3.0 * PI * o.radius.powi(3))
            .iter()
            .sum();
        let (r, s) = (a.radius, b.radius);
        let lens = PI * (r + s - d).powi(2) * (d * d + 2.0 * d * (r + s) - 3.0 * (r - s).powi(2))
            / (12.0 * d);
        whole - lens
    }

    /// A cubic crystal with a wide place in its middle, and its tunnels.
    fn crystal() -> (Vec<Ball>, Vec<Tunnel>) {
        let point = |k: usize| [k % 6, k / 6 % 6, k / 36].map(|c| 4.5 * c as f64);
        let balls: Vec<Ball> = (0..216).map(|k| ball(point(k), 1.7)).collect();
        let params = Params {
            count: 3,
            ..Params::DEFAULT
        };
        let found = find(&balls, [11.25; 3], &params, &Silent).expect("tunnels");
        assert_eq!(found.tunnels.len(), 3);
        (balls, found.tunnels)
    }

    #[test]
    fn stops_become_atoms_that_readers_keep() {
        let (_, tunnels) = crystal();
        let molecule = spheres(&tunnels);
        molecule.check().expect("a sound molecule");
        assert_eq!(molecule.residues.len(), 3);
        for (k, (residue, tunnel)) in molecule.residues.iter().zip(&tunnels).enumerate() {
            assert_eq!(residue.to_string(), format!("T:{}", k + 1));
            let atoms = molecule.atoms_in(&residue.atoms);
            assert_eq!(atoms.len(), tunnel.stops.len());
            let least = atoms.iter().filter_map(|a| a.radius);
            let least = least.fold(f64::INFINITY, f64::min);
            assert!((least - tunnel.narrowest.radius).abs() < 1e-12);
            let mut names: Vec<Name> = atoms.iter().map(|atom| atom.name).collect();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), atoms.len());
        }
        assert!(spheres(&[]).atoms.is_empty());
    }

    #[test]
    fn names_of_atoms_have_four_columns() {
        let names = [0, 998, 999, 999 + 26 * 1296 - 1].map(|k| name_of(k).to_string());
        assert_eq!(names, ["H1", "H999", "HA00", "HZZZ"]);
        let mut all: Vec<Name> = (0..34_000).map(name_of).collect();
        assert!(
            all.iter()
                .all(|name| (2..=4).contains(&name.as_bytes().len()))
        );
        all.sort();
        all.dedup();
        assert_eq!(all.len(), 34_000);
    }

    #[test]
    fn tubes_are_closed_and_enter_no_atom() {
        let (balls, tunnels) = crystal();
        let clearance = Clearance::new(&balls);
        let spacing = spacing_for(&tunnels);
        let mesh = surface(&tunnels, &clearance, spacing, u64::MAX, &Silent).expect("a surface");
        let deepest = mesh.positions.iter().map(|p| clearance.at(*p));
        let deepest = deepest.fold(f64::INFINITY, f64::min);
        assert!(deepest >= -1e-9 * spacing, "{deepest}");
        // As one, too, though the tunnels begin alike.
        assert!(volume(&mesh) > 0.0);
        let sides = mesh.sides.as_ref().expect("sides");
        assert_eq!(sides.len(), mesh.triangles.len());
        for number in 1..=3 {
            let own = mesh.triangles.iter().zip(sides);
            let own = own.filter(|(_, side)| **side == [number, 0]);
            let own = Mesh {
                triangles: own.map(|(t, _)| *t).collect(),
                ..mesh.clone()
            };
            let own = own.compacted();
            assert!(volume(&own) > 0.0);
            // Every stop is inside, as far as its radius less what triangles cut off.
            let tunnel = &tunnels[number as usize - 1];
            for stop in tunnel.stops.iter().step_by(5) {
                let gaps = own.positions.iter().map(|p| length(sub(*p, stop.centre)));
                let nearest = gaps.fold(f64::INFINITY, f64::min);
                assert!(nearest >= stop.radius - 1e-9, "{nearest} {}", stop.radius);
            }
        }
        let refused = surface(&tunnels, &clearance, spacing, 1000, &Silent).expect_err("a limit");
        assert!(
            refused.to_string().contains("over the limit of 1000 bytes"),
            "{refused}"
        );
    }

    #[test]
    fn hostile_tunnels_make_no_surface_and_no_fault() {
        let (balls, mut tunnels) = crystal();
        let clearance = Clearance::new(&balls);
        tunnels.truncate(2);
        tunnels[0].stops.clear();
        for stop in &mut tunnels[1].stops {
            // In the midst of an atom.
            stop.centre = [0.0; 3];
        }
        let mesh = surface(&tunnels, &clearance, 0.3, u64::MAX, &Silent).expect("nothing");
        assert!(mesh.is_empty() && mesh.sides.is_some_and(|sides| sides.is_empty()));
        let none = surface(&[], &clearance, 0.3, 0, &Silent).expect("nothing");
        assert!(none.is_empty());
        assert!(surface(&tunnels, &clearance, 0.0, u64::MAX, &Silent).is_err());
    }
}
