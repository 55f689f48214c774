//! Covering clouds and tracing what covers them: points and pixels per second, on one thread and on all.

use super::Plan;
use scantle::measure::splat_cover::coverage;
use scantle::mesh::{Mesh, sampling, shapes};
use scantle::points::Splats;
use scantle::points::splat::{self, Params};
use scantle::progress::Silent;
use scantle::render::splats::{self, Accelerator, Scene};
use serde_json::json;

pub fn run(plan: &Plan) {
    if plan.wants("splat-gen") {
        plan.sizes(12_500).into_iter().for_each(|n| cover(plan, n));
    }
    if plan.wants("splat-trace") {
        trace(plan);
    }
}

/// Points on a torus knot, without their normals.
fn cloud(points: usize) -> Mesh {
    let knot = shapes::torus_knot(2, 3, 0.4, 288, 92);
    let cloud = sampling::sample(&knot, points as u64, 0).expect("the knot has an area");
    Mesh {
        normals: None,
        ..cloud
    }
}

fn covered(cloud: &Mesh) -> Splats {
    let made = splat::generate(cloud, &Params::DEFAULT, &Silent);
    made.expect("points on a surface have discs").0
}

fn cover(plan: &Plan, points: usize) {
    let cloud = cloud(points);
    plan.measure("splat-gen", "points", points, || {
        let splats = covered(&cloud);
        let check = coverage(&cloud.positions, &splats.splats, f64::INFINITY, None);
        assert_eq!(check.uncovered, 0);
        std::mem::size_of_val(&splats.splats[..])
    });
}

fn trace(plan: &Plan) {
    let covers = vec![covered(&cloud(if plan.quick { 5_000 } else { 200_000 }))];
    let discs = covers[0].splats.len();
    let scene = Scene {
        covers,
        ..Scene::default()
    };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one = one.expect("a thread can be started");
    for pixels in plan.sizes(96 * 72) {
        let height = ((pixels * 3 / 4) as f64).sqrt() as u32;
        let size = [height * 4 / 3, height];
        for accelerator in [Accelerator::Bvh, Accelerator::Octree] {
            let params = splats::Params {
                size,
                accelerator,
                ..splats::Params::DEFAULT
            };
            let draw = || splats::draw(&scene, &params, &Silent).expect("a picture");
            let (seconds, (_, stats)) = plan.time(plan.repeats(), draw);
            let (alone, _) = one.install(|| plan.time(plan.repeats(), draw));
            let line = json!({
                "bench": format!("splat-trace-{}", accelerator.name()),
                "discs": discs,
                "pixels": size,
                "rays": stats.rays,
                "seconds": seconds,
                "seconds_on_one_thread": alone,
                "pixels_per_second": (size[0] * size[1]) as f64 / seconds,
                "threads": rayon::current_num_threads(),
            });
            println!("{line}");
        }
    }
}
