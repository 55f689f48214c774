//! What is made where rays go is what is made at once.

use super::*;
use crate::mesh::shapes;
use crate::numeric::rng::Rng;
use crate::volume::octree::RayTree;
use crate::volume::trace::{GridRay, Visits};

fn params(mode: Mode, resolution: u32) -> Params {
    Params {
        size: Size::Resolution(resolution),
        mode,
        grid: Storage::Sparse,
        ..Params::DEFAULT
    }
}

fn tree_of(mesh: &Mesh, params: &Params) -> (Volume, Stats) {
    voxelize(mesh, params, &Silent).expect("a grid")
}

#[test]
fn rays_find_the_same_voxels_whether_made_before_or_on_the_way() {
    let mesh = shapes::torus_knot(2, 3, 0.4, 60, 12);
    for mode in [Mode::Conservative, Mode::ThreeAxis] {
        for resolution in [10, 40, 100] {
            let params = params(mode, resolution);
            let (volume, stats) = tree_of(&mesh, &params);
            let Data::Sparse(octree) = &volume.data else {
                panic!("a sparse grid was asked for");
            };
            let tree = RayTree::new(octree);
            let lazy = Lazy::new(&mesh, &params, &Silent).expect("a grid");
            assert_eq!(lazy.lattice(), stats.lattice());
            let dims = stats.dims.map(|d| d as f64);
            let mut hits = 0;
            for i in 0..400 {
                let mut rng = Rng::new(5, i);
                let mut place = || dims.map(|d| rng.range(-0.5, 1.5) * d);
                let (from, to) = (place(), place());
                let ray = GridRay::new(from, crate::numeric::vector::sub(to, from), [0.0, 1.0]);
                let wanted = tree.any_hit(&ray, true, &mut Visits::default());
                assert_eq!(
                    lazy.any_hit(&ray, &mut Visits::default()),
                    wanted,
                    "{ray:?}"
                );
                hits += u64::from(wanted);
            }
            assert!(hits > 50, "{hits}");
        }
    }
}

#[test]
fn no_ray_makes_nothing_and_rays_everywhere_make_all() {
    let mesh = shapes::torus_knot(2, 3, 0.4, 60, 12);
    let params = params(Mode::Conservative, 40);
    let (volume, stats) = tree_of(&mesh, &params);
    let Data::Sparse(octree) = &volume.data else {
        panic!("a sparse grid was asked for");
    };
    let lazy = Lazy::new(&mesh, &params, &Silent).expect("a grid");
    assert_eq!(lazy.extent().set_voxels, 0);
    assert_eq!(lazy.extent().nodes, 1);
    let [nx, ny, nz] = octree.dims();
    let point = |x: usize, y: usize, z: usize| {
        let centre = [x, y, z].map(|c| c as f64 + 0.5);
        GridRay::new(centre, [0.0; 3], [0.0; 2])
    };
    let beside = lazy.any_hit(&point(nx / 2, ny / 2, nz / 2), &mut Visits::default());
    assert!(!beside);
    let few = lazy.extent();
    assert!(few.set_voxels < stats.set_voxels / 4, "{few:?}");
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let hit = lazy.any_hit(&point(x, y, z), &mut Visits::default());
                assert_eq!(hit, octree.get(x, y, z), "{x} {y} {z}");
            }
        }
    }
    let all = lazy.extent();
    assert_eq!(all.set_voxels, stats.set_voxels);
    assert_eq!(all.nodes, stats.octree_nodes);
    let (made, full) = (lazy.modelled(), stats.modelled());
    assert_eq!((made.made, made.full), (full.made, full.full));
}
