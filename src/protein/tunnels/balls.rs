//! Atoms as sets of equal balls, as CAVER 3 takes them: an upper bound of every width.
//!
//! Each atom larger than the smallest becomes `K` balls of the smallest radius inside it, touching its
//! surface from within, and one in its middle. The Voronoi diagram of their centres is exact for them, and
//! they lie inside the atoms: no way between the atoms is wider than the widest between the balls.

use crate::numeric::vector::{add, scale};
use crate::protein::clearance::Ball;

/// How many balls may stand for an atom: the corners of the regular solids.
pub const COUNTS: [usize; 5] = [4, 6, 8, 12, 20];

/// Unit vectors to the corners of the regular solid with that many.
pub fn directions(count: usize) -> Vec<[f64; 3]> {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let signs = [1.0, -1.0];
    let mut all: Vec<[f64; 3]> = Vec::new();
    let cube = || {
        signs
            .iter()
            .flat_map(|x| signs.iter().flat_map(move |y| signs.map(|z| [*x, *y, z])))
    };
    // Corners (0, a, b) in all signs and cyclic orders.
    let rectangles = |a: f64, b: f64| {
        signs.into_iter().flat_map(move |s| {
            signs.into_iter().flat_map(move |t| {
                let (a, b) = (s * a, t * b);
                [[0.0, a, b], [b, 0.0, a], [a, b, 0.0]]
            })
        })
    };
    match count {
        4 => all.extend(cube().filter(|[x, y, z]| x * y * z > 0.0)),
        6 => {
            for axis in 0..3 {
                for sign in signs {
                    let mut corner = [0.0; 3];
                    corner[axis] = sign;
                    all.push(corner);
                }
            }
        }
        8 => all.extend(cube()),
        12 => all.extend(rectangles(1.0, golden)),
        _ => {
            all.extend(cube());
            all.extend(rectangles(1.0 / golden, golden));
        }
    }
    let unit = |v: [f64; 3]| scale(v, 1.0 / crate::numeric::vector::length(v));
    all.into_iter().map(unit).collect()
}

/// The balls that stand for `atoms`, of the smallest of their radii.
pub fn replace(atoms: &[Ball], count: usize) -> Vec<Ball> {
    let smallest = atoms
        .iter()
        .map(|ball| ball.radius)
        .fold(f64::INFINITY, f64::min);
    let directions = directions(count);
    let mut made = Vec::new();
    for atom in atoms {
        made.push(Ball {
            centre: atom.centre,
            radius: smallest,
        });
        let out = atom.radius - smallest;
        if out > 0.0 {
            made.extend(directions.iter().map(|d| Ball {
                centre: add(atom.centre, scale(*d, out)),
                radius: smallest,
            }));
        }
    }
    made
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::vector::{dot, length, sub};

    #[test]
    fn directions_are_the_corners_of_the_regular_solids() {
        // Cosine of the angle between neighbours, and how many each corner has.
        let solids = [
            (4, -1.0 / 3.0, 3),
            (6, 0.0, 4),
            (8, 1.0 / 3.0, 3),
            (12, 1.0 / 5f64.sqrt(), 5),
            (20, 5f64.sqrt() / 3.0, 3),
        ];
        for (count, cosine, neighbours) in solids {
            let all = directions(count);
            assert_eq!(all.len(), count);
            for d in &all {
                assert!((length(*d) - 1.0).abs() < 1e-15);
                let others = all.iter().filter(|e| *e != d);
                let cosines: Vec<f64> = others.map(|e| dot(*d, *e)).collect();
                assert!(cosines.iter().all(|c| *c < cosine + 1e-12), "{count}");
                let near = cosines
                    .iter()
                    .filter(|c| (**c - cosine).abs() < 1e-12)
                    .count();
                assert_eq!(near, neighbours, "{count}");
            }
        }
    }

    #[test]
    fn what_stands_for_an_atom_lies_inside_it_and_touches_it() {
        let atoms = [
            Ball {
                centre: [1.0, 2.0, 3.0],
                radius: 1.85,
            },
            Ball {
                centre: [9.0, 0.0, 0.0],
                radius: 1.2,
            },
        ];
        for count in COUNTS {
            let made = replace(&atoms, count);
            assert_eq!(made.len(), count + 2);
            for ball in &made[..=count] {
                let reach = length(sub(ball.centre, atoms[0].centre)) + ball.radius;
                assert!(reach < 1.85 + 1e-12);
            }
            assert_eq!(made[count + 1], atoms[1]);
        }
    }

    #[test]
    fn twelve_balls_leave_dents_of_the_depth_they_should() {
        let (large, small) = (1.85, 1.2);
        let atoms = [
            Ball {
                centre: [1.0, 2.0, 3.0],
                radius: large,
            },
            Ball {
                centre: [9.0, 0.0, 0.0],
                radius: small,
            },
        ];
        let made = replace(&atoms, 12);
        let all = directions(12);
        let next = |d: [f64; 3], e: [f64; 3]| (dot(d, e) - 1.0 / 5f64.sqrt()).abs() < 1e-12;
        let e = *all
            .iter()
            .find(|e| next(all[0], **e))
            .expect("five are next to it");
        let f = *all
            .iter()
            .find(|f| next(all[0], **f) && next(e, **f))
            .expect("two are next to both");
        let middle = add(add(all[0], e), f);
        let middle = scale(middle, 1.0 / length(middle));
        // Outwards through the middle of a face, at t from its corners.
        let (cosine, out) = (dot(middle, all[0]), large - small);
        let sine = (1.0 - cosine * cosine).sqrt();
        assert!((cosine.acos().to_degrees() - 37.38).abs() < 0.005);
        let reach = out * cosine + (small * small - (out * sine).powi(2)).sqrt();
        let surface = add([1.0, 2.0, 3.0], scale(middle, reach));
        let near = made[..13]
            .iter()
            .map(|b| b.distance(surface))
            .fold(f64::INFINITY, f64::min);
        assert!(near.abs() < 1e-12, "{near}");
        assert!((large - reach - 0.200).abs() < 5e-4);
    }
}
