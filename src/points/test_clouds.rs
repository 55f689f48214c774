//! Clouds on surfaces whose normals are known.

use crate::mesh::Mesh;
use crate::numeric::rng::Rng;
use crate::numeric::vector::{Vec3, add, normalize, scale};

/// Points on the unit sphere, evenly at random, with their normals.
pub fn sphere(count: u64, seed: u64) -> Mesh {
    let place = |i| {
        let mut rng = Rng::new(seed, i);
        let z = rng.range(-1.0, 1.0);
        let (sin, cos) = rng.range(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        normalize([r * cos, r * sin, z])
    };
    let normals: Vec<Vec3> = (0..count).map(place).collect();
    Mesh {
        positions: normals.clone(),
        normals: Some(normals),
        ..Mesh::default()
    }
}

/// Points of the unit square at height 0, evenly at random, with their normals.
pub fn square(count: u64) -> Mesh {
    let place = |i| {
        let mut rng = Rng::new(11, i);
        [rng.unit(), rng.unit(), 0.0]
    };
    Mesh {
        positions: (0..count).map(place).collect(),
        normals: Some(vec![[0.0, 0.0, 1.0]; count as usize]),
        ..Mesh::default()
    }
}

/// Points on the faces of a box with these half sides, evenly at random, with their normals.
pub fn slab(count: u64, half: Vec3) -> Mesh {
    let areas: Vec3 = std::array::from_fn(|a| half[(a + 1) % 3] * half[(a + 2) % 3]);
    let whole: f64 = areas.iter().sum();
    let mut cloud = Mesh::default();
    let mut normals = Vec::new();
    for i in 0..count {
        let mut rng = Rng::new(13, i);
        let pick = rng.unit() * whole;
        let axis = if pick < areas[0] {
            0
        } else if pick < areas[0] + areas[1] {
            1
        } else {
            2
        };
        let side = if rng.unit() < 0.5 { -1.0 } else { 1.0 };
        let mut p: Vec3 = std::array::from_fn(|a| rng.range(-half[a], half[a]));
        p[axis] = side * half[axis];
        let mut n = [0.0; 3];
        n[axis] = side;
        cloud.positions.push(p);
        normals.push(n);
    }
    cloud.normals = Some(normals);
    cloud
}

/// The cloud with each coordinate moved by up to `size`.
pub fn shaken(mut cloud: Mesh, size: f64) -> Mesh {
    for (i, p) in cloud.positions.iter_mut().enumerate() {
        let mut rng = Rng::new(17, i as u64);
        *p = p.map(|c| c + rng.range(-size, size));
    }
    cloud
}

/// Two clouds together, the second moved.
pub fn both(a: &Mesh, b: &Mesh, shift: Vec3) -> Mesh {
    let mut all = a.clone();
    all.positions
        .extend(b.positions.iter().map(|p| add(*p, shift)));
    if let (Some(normals), Some(more)) = (&mut all.normals, &b.normals) {
        normals.extend(more);
    }
    all
}

/// The cloud without its normals.
pub fn bare(mut cloud: Mesh) -> Mesh {
    cloud.normals = None;
    cloud
}

/// The cloud with its points in another order, which depends on the seed.
pub fn shuffled(cloud: &Mesh, seed: u64) -> Mesh {
    let mut order: Vec<usize> = (0..cloud.positions.len()).collect();
    order.sort_by_key(|i| Rng::new(seed, *i as u64).bits());
    let normals = cloud.normals.as_ref();
    Mesh {
        positions: order.iter().map(|i| cloud.positions[*i]).collect(),
        normals: normals.map(|n| order.iter().map(|i| n[*i]).collect()),
        ..Mesh::default()
    }
}

/// The cloud scaled, then moved.
pub fn placed(cloud: &Mesh, size: f64, shift: Vec3) -> Mesh {
    let place = |p: &Vec3| add(scale(*p, size), shift);
    Mesh {
        positions: cloud.positions.iter().map(place).collect(),
        ..cloud.clone()
    }
}
