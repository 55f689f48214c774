//! Fixtures that are made by formula are what the formula makes, but for the last digits of sines
//! and cosines, which differ between systems.
//!
//! `UPDATE_FIXTURES=1 cargo test fixtures` writes them anew.

use crate::support::{Workplace, files_below, root, updating};
use scantle::io::format::{Format, Kind};
use scantle::io::sink::Sink;
use scantle::io::source::Source;
use scantle::io::{
    read_mesh, read_molecule, write_mesh, write_molecule, write_splats, write_terrain,
    write_vectors, write_volume,
};
use scantle::mesh::{Mesh, shapes};
use scantle::numeric::vector::{add, cross, dot, length, normalize, scale, sub};
use scantle::points::{Splat, Splats, splat};
use scantle::progress::Silent;
use scantle::protein::builder::{Builder, Place};
use scantle::protein::{Atom, Element, Molecule, Name};
use scantle::terrain::{Grid, Samples, Transform};
use scantle::vector::crs::Crs;
use scantle::vector::{Feature, Layer, Polygon, Shape};
use scantle::volume::isosurface::{Border, Select, at_level, axis_of, extract};
use scantle::volume::{Data, Frame, Volume};
use std::fs;

/// A file below `fixtures/`, and what is in it. Its format is that of its name.
type Row<T> = (&'static str, fn() -> T);

const MESHES: &[Row<Mesh>] = &[
    ("shapes/cube.obj", || shapes::cuboid([0.0; 3], [1.0; 3])),
    ("shapes/cube.ply", || shapes::cuboid([0.0; 3], [1.0; 3])),
    ("shapes/open-box.obj", || {
        shapes::open_box([-1.0, -1.0, 0.0], [1.0, 1.0, 0.5])
    }),
    ("shapes/sheet.off", || shapes::sheet(2.0, 1.0, 8, 4)),
    ("shapes/sphere.stl", || {
        shapes::uv_sphere([0.0; 3], 1.0, 16, 8)
    }),
    ("shapes/torus.obj", || {
        shapes::torus([0.0; 3], 1.0, 0.25, 48, 16)
    }),
    ("shapes/torus-knot.ply", || {
        shapes::torus_knot(2, 3, 0.4, 160, 24)
    }),
    ("shapes/staircase.ply", || marching_cubes(false)),
    ("shapes/grey.ply", || marching_cubes(true)),
    ("shapes/points.ply", || Mesh {
        points: (0..96).collect(),
        ..helix(96)
    }),
    ("shapes/polyline.obj", || Mesh {
        segments: (1..96).map(|i| [i - 1, i]).collect(),
        ..helix(96)
    }),
];

const CLOUDS: &[Row<Mesh>] = &[
    ("clouds/hills.ply", hills),
    ("clouds/hills.pcd", hills),
    ("clouds/hills.csv", hills),
    ("clouds/ball.xyz", || points_of_a_ball(4)),
    ("clouds/line.xyz", || {
        cloud((0..9).map(|i| [f64::from(i), 2.0 * f64::from(i), 0.5]))
    }),
    ("clouds/plane.xyz", || {
        let lattice = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 3.0]);
        cloud(lattice)
    }),
    ("clouds/same.xyz", || cloud((0..5).map(|_| [1.0, 2.0, 3.0]))),
    ("clouds/two.xyz", || {
        cloud((0..2).map(|i| [f64::from(i), 0.0, 0.0]))
    }),
    ("clouds/flipped.ply", flipped),
    ("clouds/hills.xyz", || Mesh {
        classes: None,
        ..hills()
    }),
    ("clouds/hills.las", || Mesh {
        normals: None,
        ..hills()
    }),
    ("clouds/hills.laz", || Mesh {
        normals: None,
        ..hills()
    }),
];

const SPLATS: &[Row<Splats>] = &[
    ("clouds/splats.ply", splats_of_hills),
    ("splats/sphere.ply", splats_of_a_ball),
];

const VOLUMES: &[Row<Volume>] = &[
    ("volumes/ball.nrrd", || ball(16)),
    ("volumes/ball.mha", || ball(16)),
    ("volumes/labels.nii", labels),
    ("volumes/nothing.npy", || of_values(|_| 0)),
    ("volumes/not-a-number.npy", || Volume {
        data: Data::F32(
            (0..64)
                .map(|i| if i == 21 { f32::NAN } else { i as f32 })
                .collect(),
        ),
        ..of_values(|_| 0)
    }),
];

const MOLECULES: &[Row<Molecule>] = &[
    ("molecules/helix.pdb", helix_of_atoms),
    ("molecules/helix.cif", helix_of_atoms),
    ("molecules/ring.xyzr", ring_of_spheres),
    ("molecules/ring.csv", ring_of_spheres),
    ("molecules/porthole.xyzr", portholes),
    ("molecules/nanometres.xyzr", portholes_in_nanometres),
];

const TERRAINS: &[Row<Grid>] = &[
    ("terrain/hills.tif", hills_on_a_map),
    ("terrain/hills.asc", hills_on_a_map),
    ("terrain/nothing.tif", || Grid {
        samples: Samples::I16(vec![-9999; 48 * 32]),
        ..hills_on_a_map()
    }),
];

const LAYERS: &[Row<Layer>] = &[("vectors/hills.geojson", features_on_hills)];

/// 48 x 32 cells of 25 m with two hills, a valley and, in the south east, a lake without heights.
fn hills_on_a_map() -> Grid {
    let (columns, rows) = (48, 32);
    let height = |at: i64| {
        let (x, y) = (at % columns, at / columns);
        if (x - 40).pow(2) + (y - 26).pow(2) < 12 {
            return -9999;
        }
        let hill = |cx: i64, cy: i64, high: i64, wide: i64| {
            let away = (x - cx).pow(2) + (y - cy).pow(2);
            high * wide / (wide + away)
        };
        (400 + 4 * x - 3 * y + hill(12, 10, 300, 60) + hill(33, 18, 420, 40)) as i16
    };
    Grid {
        columns: 48,
        rows: 32,
        transform: Transform::north_up([300_000.0, 6_240_800.0], [25.0, 25.0]),
        samples: Samples::I16((0..columns * rows).map(height).collect()),
        nodata: Some(-9999.0),
        crs: Some(Crs::from_epsg(32734)),
    }
}

/// A road, paths, a wood with a clearing, two fields, huts and a feature without a shape, on the hills.
fn features_on_hills() -> Layer {
    let at = |x: f64, y: f64| [300_000.0 + x, 6_240_000.0 + y];
    let ring = |places: &[[f64; 2]]| places.iter().map(|[x, y]| at(*x, *y)).collect::<Vec<_>>();
    let square = |x: f64, y: f64, side: f64| {
        ring(&[[x, y], [x + side, y], [x + side, y + side], [x, y + side]])
    };
    let mut clearing = square(340.0, 480.0, 60.0);
    clearing[1..].reverse();
    let wood = ring(&[
        [200.0, 400.0],
        [480.0, 380.0],
        [520.0, 620.0],
        [300.0, 700.0],
        [180.0, 560.0],
    ]);
    let polygon = |rings| Polygon { rings };
    let shapes = [
        (
            "road",
            Shape::Lines(vec![ring(&[
                [-20.0, 100.0],
                [300.0, 210.0],
                [610.0, 420.0],
                [1220.0, 700.0],
            ])]),
        ),
        (
            "paths",
            Shape::Lines(vec![
                ring(&[[300.0, 210.0], [330.0, 400.0], [310.0, 545.0]]),
                ring(&[[610.0, 420.0], [825.0, 350.0]]),
            ]),
        ),
        ("wood", Shape::Polygons(vec![polygon(vec![wood, clearing])])),
        (
            "fields",
            Shape::Polygons(vec![
                polygon(vec![square(700.0, 60.0, 150.0)]),
                polygon(vec![square(880.0, 60.0, 150.0)]),
            ]),
        ),
        (
            "huts",
            Shape::Points(vec![at(310.0, 545.0), at(825.0, 350.0)]),
        ),
        ("nowhere", Shape::Empty),
    ];
    let feature = |(number, (name, shape)): (usize, (&str, Shape))| Feature {
        shape,
        properties: [
            ("name".to_owned(), name.into()),
            ("number".to_owned(), number.into()),
        ]
        .into_iter()
        .collect(),
    };
    Layer {
        name: "hills".to_owned(),
        crs: Some(Crs::from_epsg(32734)),
        features: shapes.into_iter().enumerate().map(feature).collect(),
    }
}

/// An atom as a molecule has it: its place and name in a residue, an element and a letter.
fn atom(position: [f64; 3], name: &str, symbol: &str, hetero: bool) -> Atom {
    Atom {
        // Adding 0 takes the sign of a zero away.
        position: position.map(|c| (c * 1000.0).round() / 1000.0 + 0.0),
        radius: None,
        serial: 0,
        name: Name::new(name.as_bytes()).expect("a name"),
        residue: 0,
        occupancy: 1.0,
        b_factor: 20.0,
        element: Element::from_symbol(symbol.as_bytes()).unwrap_or_default(),
        altloc: b' ',
        hetero,
    }
}

fn at_place(name: &str, chain: &str, number: i32) -> Place {
    Place {
        name: Name::new(name.as_bytes()).expect("a name"),
        chain: Name::new(chain.as_bytes()).expect("a name"),
        number,
        insertion: b' ',
        in_polymer: false,
    }
}

/// Atoms of a residue of an alpha helix, by radius, angle in degrees and height from its first carbon:
/// bonds within 0.02 angstrom of those of proteins.
const OF_A_HELIX: [(&str, [f64; 3]); 5] = [
    ("N", [1.57, -27.7, -0.87]),
    ("CA", [2.29, 0.0, 0.0]),
    ("C", [1.66, 26.5, 1.07]),
    ("O", [1.93, 31.0, 2.28]),
    ("CB", [3.29, -18.0, 0.77]),
];

/// Two models of a helix of ten residues: alanines, one of them with an insertion code, a selenomethionine
/// and a serine with its oxygen at two places; beside it a zinc ion, a ring of carbons and three molecules
/// of water. Serial and residue numbers go on in hybrid-36.
fn helix_of_atoms() -> Molecule {
    let mut builder = Builder::default();
    builder.set_id("0HLX".to_owned());
    for model in 1..=2 {
        builder.begin_model(model);
        let mut serial = 99_960;
        let mut put = |builder: &mut Builder, place: &Place, atom: Atom| {
            serial += 1;
            builder.push(place, Atom { serial, ..atom }).expect("room");
        };
        // The second model is turned a little about the axis.
        let turned = 5.0 * f64::from(model - 1);
        for index in 0..10 {
            let around = |[radius, angle, height]: [f64; 3]| {
                let (sin, cos) = (angle + turned + 100.0 * f64::from(index))
                    .to_radians()
                    .sin_cos();
                [radius * cos, radius * sin, height + 1.5 * f64::from(index)]
            };
            let (name, number, insertion) = match index {
                3 => ("MSE", 4, b' '),
                5 => ("ALA", 5, b'A'),
                6 => ("SER", 6, b' '),
                _ => ("ALA", if index > 5 { index } else { index + 1 }, b' '),
            };
            let place = Place {
                insertion,
                in_polymer: name == "MSE",
                ..at_place(name, "A", number)
            };
            for (atom_name, polar) in OF_A_HELIX {
                let found = atom(around(polar), atom_name, &atom_name[..1], name == "MSE");
                put(&mut builder, &place, found);
            }
            if name == "SER" {
                for (altloc, angle, occupancy) in [(b'A', -10.0, 0.6), (b'B', -26.0, 0.4)] {
                    let found = atom(around([4.4, angle, 0.2]), "OG", "O", false);
                    let found = Atom {
                        altloc,
                        occupancy,
                        ..found
                    };
                    put(&mut builder, &place, found);
                }
            }
        }
        put(
            &mut builder,
            &at_place("ZN", "B", 9998),
            atom([9.0, 0.0, 7.0], "ZN", "ZN", true),
        );
        for index in 0..6 {
            let (sin, cos) = (60.0 * f64::from(index)).to_radians().sin_cos();
            let found = atom(
                [1.39 * cos, 12.0 + 1.39 * sin, 7.0],
                &format!("C{}", index + 1),
                "C",
                true,
            );
            put(&mut builder, &at_place("BNZ", "B", 9999), found);
        }
        for index in 0..3 {
            let found = atom([-8.0, 3.0 * f64::from(index), 7.0], "O", "O", true);
            put(&mut builder, &at_place("HOH", "B", 10_000 + index), found);
        }
    }
    builder.finish()
}

/// Eight spheres in a circle of radius 4, of radii from 1.2 to 1.9.
fn ring_of_spheres() -> Molecule {
    let mut builder = Builder::default();
    for index in 0..8 {
        let (sin, cos) = (45.0 * f64::from(index)).to_radians().sin_cos();
        let sphere = Atom {
            radius: Some(f64::from(12 + index) / 10.0),
            serial: i64::from(index) + 1,
            ..atom([4.0 * cos, 4.0 * sin, 0.0], "", "", false)
        };
        builder.push(&at_place("", "", 0), sphere).expect("room");
    }
    builder.finish()
}

/// Portholes: the way out through each, and its radius.
const PORTHOLES: [([f64; 3], f64); 3] = [
    ([0.9, 0.2, 0.3], 2.0),
    ([-0.6, 0.8, -0.2], 1.6),
    ([-0.1, -0.5, -1.0], 1.2),
];

/// Radii of the atoms around them, in turn.
const OF_A_HULL: [f64; 5] = [1.7, 1.52, 1.55, 1.7, 1.8];

/// The same in nanometres.
fn portholes_in_nanometres() -> Molecule {
    let mut molecule = portholes();
    for atom in &mut molecule.atoms {
        atom.position = atom.position.map(|c| (c * 100.0).round() / 1000.0 + 0.0);
        atom.radius = atom.radius.map(|r| (r * 100.0).round() / 1000.0);
    }
    molecule
}

/// Two layers of atoms around the origin, closed but for round portholes. Three atoms of the rim of each
/// touch a circle of its radius in both layers; the others stand back.
fn portholes() -> Molecule {
    let mut builder = Builder::default();
    let mut put = |centre: [f64; 3], radius: f64| {
        let sphere = Atom {
            radius: Some(radius),
            serial: builder.len() as i64 + 1,
            ..atom(centre, "", "", false)
        };
        builder.push(&at_place("", "", 0), sphere).expect("room");
    };
    for (layer, count, out) in [(0.0, 330, 9.5), (1.0, 410, 11.4)] {
        for k in 0..count {
            // A spiral of equal steps in height, turned by the golden angle, with bumps.
            let (at, radius) = (f64::from(k), OF_A_HULL[k as usize % OF_A_HULL.len()]);
            let z = 1.0 - (2.0 * at + 1.0) / f64::from(count);
            let (sin, cos) = (2.399_963_229_728_653 * at + layer).sin_cos();
            let around = (1.0 - z * z).sqrt();
            let bumpy = out + 0.25 * (3.1 * at).sin();
            let centre = scale([around * cos, around * sin, z], bumpy);
            let is_open = PORTHOLES.iter().any(|(way, hole)| {
                let along = dot(centre, normalize(*way));
                let off = sub(centre, scale(normalize(*way), along));
                along > 0.0 && length(off) < hole + radius + 0.9
            });
            if !is_open {
                put(centre, radius);
            }
        }
        for (way, hole) in PORTHOLES {
            let axis = normalize(way);
            let across = normalize(cross(axis, [0.0, 0.0, 1.0]));
            let sides = [across, cross(axis, across)];
            let count = 3 * ((hole + 1.65) * std::f64::consts::TAU / 4.5).ceil() as u32;
            for k in 0..count {
                let radius = OF_A_HULL[k as usize % OF_A_HULL.len()];
                let angle = std::f64::consts::TAU * f64::from(k) / f64::from(count) + layer;
                let (back, up) = match k % (count / 3) {
                    0 => (0.0, 0.0),
                    _ => (0.15 + 0.1 * angle.sin(), 0.3 * (2.3 * f64::from(k)).sin()),
                };
                let off = hole + radius + back;
                let foot = scale(axis, out + up);
                let aside = add(
                    scale(sides[0], off * angle.cos()),
                    scale(sides[1], off * angle.sin()),
                );
                put(add(foot, aside), radius);
            }
        }
    }
    builder.finish()
}

/// Vertices along three turns of a helix: radius 1, height 1.5, 32 to a turn.
fn helix(n: u32) -> Mesh {
    let at = |i: u32| {
        let turns = f64::from(i) / 32.0;
        let (sin, cos) = (std::f64::consts::TAU * turns).sin_cos();
        [cos, sin, 0.5 * turns]
    };
    Mesh {
        positions: (0..n).map(at).collect(),
        ..Mesh::default()
    }
}

/// A scan of 12 by 9 points, a metre apart, of ground (2) with a house (6) on it, in metres of a map:
/// hundredths of a metre far from the origin. Only sums, products and roots: the same on every system.
fn hills() -> Mesh {
    let point = |i: u32| {
        let (x, y) = (f64::from(i % 12), f64::from(i / 12));
        let is_roof = (4..8).contains(&(i % 12)) && (3..6).contains(&(i / 12));
        let slope = [(6.0 - x) / 12.0, (y - 4.0) / 16.0];
        let height = if is_roof {
            f64::from(i % 12) / 4.0 + 7.0
        } else {
            (x * (12.0 - x) + y * (y - 8.0) * 0.75) / 24.0
        };
        let lean = if is_roof { [0.25, 0.0] } else { slope };
        let position = [
            637_000.25 + x,
            849_500.5 + y,
            ((height + 406.0) * 100.0).round() / 100.0,
        ];
        (position, normalize([-lean[0], -lean[1], 1.0]), is_roof)
    };
    let points: Vec<_> = (0..108).map(point).collect();
    let color = |is_roof: bool| {
        if is_roof {
            [1.0, 0.2, 0.0, 1.0]
        } else {
            [0.2, 0.6, 0.4, 1.0]
        }
    };
    Mesh {
        positions: points.iter().map(|(position, _, _)| *position).collect(),
        points: (0..108).collect(),
        normals: Some(points.iter().map(|(_, normal, _)| *normal).collect()),
        colors: Some(
            points
                .iter()
                .map(|(_, _, is_roof)| color(*is_roof))
                .collect(),
        ),
        classes: Some(
            points
                .iter()
                .map(|(_, _, is_roof)| if *is_roof { 6 } else { 2 })
                .collect(),
        ),
        ..Mesh::default()
    }
}

/// Points alone.
fn cloud(positions: impl Iterator<Item = [f64; 3]>) -> Mesh {
    let positions: Vec<_> = positions.collect();
    Mesh {
        points: (0..positions.len() as u32).collect(),
        positions,
        ..Mesh::default()
    }
}

/// Points on the unit sphere, in thousandths.
fn points_of_a_ball(level: u32) -> Mesh {
    let sphere = shapes::icosphere([0.0; 3], 1.0, level);
    let rounded = |p: &[f64; 3]| p.map(|x| (x * 1000.0).round() / 1000.0);
    cloud(sphere.positions.iter().map(rounded))
}

/// The same with normals, every other of which points inwards.
fn flipped() -> Mesh {
    let ball = points_of_a_ball(2);
    let normal = |(i, p): (usize, &[f64; 3])| {
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        scale(normalize(*p), sign)
    };
    Mesh {
        normals: Some(ball.positions.iter().enumerate().map(normal).collect()),
        ..ball
    }
}

/// Discs over points on the unit sphere.
fn splats_of_a_ball() -> Splats {
    let params = splat::Params {
        delta: splat::Length::Absolute(0.05),
        ..splat::Params::DEFAULT
    };
    let ball = shapes::icosphere([0.0; 3], 1.0, 4);
    let points = Mesh {
        normals: Some(ball.positions.iter().map(|p| normalize(*p)).collect()),
        ..cloud(ball.positions.into_iter())
    };
    splat::generate(&points, &params, &Silent)
        .expect("points of a ball")
        .0
}

/// A disc for every fourth point of [`hills`], of radius 1.5.
fn splats_of_hills() -> Splats {
    let hills = hills();
    let normals = hills.normals.expect("normals");
    let splat = |point: u32| {
        let at = point as usize;
        let normal = normals[at];
        Splat {
            centre: hills.positions[at],
            normal,
            tangent: normalize(cross([0.0, 1.0, 0.0], normal)),
            radius: 1.5,
            field: scale(normal, 0.96875),
            slopes: [0.0625, -0.03125],
            error: 0.125,
            count: 9,
            source: point,
        }
    };
    let chosen = (0..108).step_by(4);
    Splats {
        splats: chosen.clone().map(splat).collect(),
        colors: hills
            .colors
            .map(|all| chosen.clone().map(|v| all[v as usize]).collect()),
        classes: hills
            .classes
            .map(|all| chosen.map(|v| all[v as usize]).collect()),
    }
}

/// The signed distance to a sphere of radius 0.75 around the origin, positive inside, in a cube
/// of edge 2 with `n` samples along each axis.
fn ball(n: usize) -> Volume {
    let spacing = 2.0 / n as f64;
    let first = -1.0 + spacing / 2.0;
    let frame = Frame::straight([n; 3], [first; 3], [spacing; 3]);
    let at = |i: usize| first + spacing * i as f64;
    let samples = (0..n * n * n).map(|i| {
        let [x, y, z] = [at(i % n), at(i / n % n), at(i / n / n)];
        (0.75 - (x * x + y * y + z * z).sqrt()) as f32
    });
    Volume {
        frame,
        data: Data::F32(samples.collect()),
    }
}

/// Two halves of a ball that touch (1 and 3), a plate of one voxel that stands in both (4), a voxel of
/// its own (7) and a rod (9); voxels are not cubes, and the grid is not at the origin.
fn labels() -> Volume {
    let dims = [24, 22, 18];
    let value = |i: usize| {
        let [x, y, z] = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]];
        let [dx, dy, dz] = [x as f64 - 10.2, y as f64 - 10.7, 1.5 * (z as f64 - 8.4)];
        if [x, y, z] == [21, 3, 3] {
            7
        } else if y == 1 && z == 15 && (2..22).contains(&x) {
            9
        } else if z == 8 && y > 4 && x > 4 && x < 22 {
            4
        } else if dx * dx + dy * dy + dz * dz > 64.0 {
            0
        } else if dx + 0.3 * dy < 0.0 {
            1
        } else {
            3
        }
    };
    Volume {
        frame: Frame::straight(dims, [10.0, -4.0, 2.0], [0.5, 0.5, 0.75]),
        data: Data::U8((0..dims.iter().product()).map(value).collect()),
    }
}

/// A cube of four voxels along each side.
fn of_values(value: impl Fn(usize) -> u8) -> Volume {
    Volume {
        frame: Frame::straight([4; 3], [0.0; 3], [1.0; 3]),
        data: Data::U8((0..64).map(value).collect()),
    }
}

/// The surface of marching cubes around label 1 of [`labels`], or where [`ball`] is 0.
fn marching_cubes(grey: bool) -> Mesh {
    let (volume, select) = if grey {
        (ball(16), Select::AtLeast(0.0))
    } else {
        (labels(), Select::Equal(1.0))
    };
    let surface = extract(&volume, &select, Border::Closed, &Silent).expect("a surface");
    let along = if grey {
        at_level(&volume, &surface, 0.0)
    } else {
        vec![0.0; surface.len()]
    };
    let positions = surface.positions(&volume.frame, |v| {
        let mut offset = [0.0; 3];
        offset[axis_of(surface.places[v])] = along[v];
        offset
    });
    let triangles = surface.triangles(&positions);
    Mesh::from_triangles(positions, triangles)
}

/// Whether two files are the same, or hold meshes that differ by the roundings of single precision, or
/// molecules that differ by the last digit of a PDB file.
fn are_near(name: &str, a: Vec<u8>, b: Vec<u8>) -> bool {
    let mesh = |bytes| {
        let source = Source::from_bytes(name, bytes).ok()?;
        read_mesh(&source, None).ok().map(|(mesh, _, _)| mesh)
    };
    if a == b {
        return true;
    }
    let molecule = |bytes: &[u8]| {
        let source = Source::from_bytes(name, bytes.to_vec()).ok()?;
        read_molecule(&source, None)
            .ok()
            .map(|(molecule, _, _)| molecule)
    };
    if let (Some(mut a), Some(b)) = (molecule(&a), molecule(&b)) {
        let mut atoms = a.atoms.iter_mut().zip(&b.atoms);
        let near = atoms.all(|(x, y)| {
            let near = (0..3).all(|k| (x.position[k] - y.position[k]).abs() < 1.5e-3);
            x.position = y.position;
            near
        });
        return near && a == b;
    }
    let (Some(a), Some(b)) = (mesh(a), mesh(b)) else {
        return false;
    };
    let coordinates = a
        .positions
        .iter()
        .flatten()
        .zip(b.positions.iter().flatten());
    a.positions.len() == b.positions.len()
        && a.triangles == b.triangles
        && a.segments == b.segments
        && a.points == b.points
        && coordinates.into_iter().all(|(x, y)| (x - y).abs() < 1e-6)
}

#[test]
fn made_fixtures_are_current() {
    let place = Workplace::new();
    let mut stale = Vec::new();
    let mut check = |name: &str, write: &dyn Fn(&Sink) -> scantle::error::Result<()>| {
        let fresh = place.path(&name.replace('/', "-"));
        write(&Sink::File(fresh.clone())).expect("a fixture is written");
        let (fresh, kept) = (
            fs::read(fresh).expect("it"),
            root().join("fixtures").join(name),
        );
        if updating("UPDATE_FIXTURES") {
            fs::create_dir_all(kept.parent().expect("a folder")).expect("a folder");
            fs::write(kept, fresh).expect("a fixture is written");
        } else if !fs::read(kept).is_ok_and(|kept| are_near(name, kept, fresh)) {
            stale.push(name.to_owned());
        }
    };
    for (name, make) in SPLATS {
        check(name, &|sink| {
            write_splats(&make(), sink, Format::Splats).map(drop)
        });
    }
    for (name, make) in MESHES.iter().chain(CLOUDS) {
        check(name, &|sink| {
            let format = sink.format().expect("the name tells the format");
            let format = format.holding(Kind::Mesh);
            write_mesh(&make(), sink, format).map(drop)
        });
    }
    for (name, make) in VOLUMES {
        check(name, &|sink| {
            let format = sink.format().expect("the name tells the format");
            write_volume(&make(), sink, format).map(drop)
        });
    }
    for (name, make) in MOLECULES {
        check(name, &|sink| {
            let format = sink.format().expect("the name tells the format");
            write_molecule(&make(), sink, format).map(drop)
        });
    }
    for (name, make) in TERRAINS {
        check(name, &|sink| {
            let format = sink.format().expect("the name tells the format");
            write_terrain(&make(), sink, format.holding(Kind::Terrain)).map(drop)
        });
    }
    for (name, make) in LAYERS {
        check(name, &|sink| {
            let format = sink.format().expect("the name tells the format");
            write_vectors(&make(), sink, format).map(drop)
        });
    }
    assert!(stale.is_empty(), "{stale:?} are not what the formula makes");
}

#[test]
fn every_folder_of_fixtures_says_where_they_are_from() {
    let readme = fs::read_to_string(root().join("fixtures/README.md")).expect("fixtures/README.md");
    for folder in fs::read_dir(root().join("fixtures")).expect("fixtures/") {
        let folder = folder.expect("an entry");
        if folder.path().is_dir() {
            let name = format!("`{}/`", folder.file_name().display());
            let is_golden = files_below(&folder.path())
                .iter()
                .any(|file| file.file_name().is_some_and(|name| name == "cmd"));
            let is_described = readme.contains(&name);
            assert!(is_golden || is_described, "fixtures/README.md lacks {name}");
        }
    }
}
