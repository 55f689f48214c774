//! Shadow rays: Tables 2 and 3 of Forest, Barthe and Paulin (2009) in layout, with what they lack.

use super::{Plan, scenes};
use scantle::image::plot::{Axis, Line, Plot, Point, Scale, Series};
use scantle::mesh::Mesh;
use scantle::progress::{Progress, Silent};
use scantle::render::shadow::{self, Method, Near, Params};
use serde_json::json;
use std::fmt::Write;
use std::sync::Mutex;
use std::time::Instant;

/// One of the paper's tables.
struct Table {
    /// What varies.
    name: &'static str,
    title: &'static str,
    size: [u32; 2],
    /// Resolution and rays for each pixel.
    settings: &'static [[u32; 2]],
}

/// At 128^3.
const RAYS: Table = Table {
    name: "rays",
    title: "Rays for each pixel and seconds, 128 voxels along the longest side",
    size: [256, 192],
    settings: &[
        [128, 1],
        [128, 4],
        [128, 8],
        [128, 16],
        [128, 32],
        [128, 128],
        [128, 512],
    ],
};

/// With one ray.
const RESOLUTION: Table = Table {
    name: "resolution",
    title: "Resolution and seconds, one ray for each pixel",
    size: [512, 384],
    settings: &[
        [8, 1],
        [16, 1],
        [32, 1],
        [64, 1],
        [128, 1],
        [256, 1],
        [512, 1],
    ],
};

/// With sixteen.
const FINE: Table = Table {
    name: "fine",
    title: "Resolution and seconds, 16 rays for each pixel",
    size: [512, 384],
    settings: &[[128, 16], [256, 16], [512, 16]],
};

/// What was measured at one setting.
struct Row {
    setting: [u32; 2],
    shadow_rays: u64,
    octree: f64,
    skipping: f64,
    exact: f64,
    leaks: f64,
    falsely: f64,
    difference: f64,
}

/// Hears when the rays start.
struct Clock(Mutex<Instant>);

impl Progress for Clock {
    fn stage(&self, _name: &'static str, _units: u64) {
        *self.0.lock().expect("no holder panics") = Instant::now();
    }

    fn advance(&self, _units: u64) {}
}

/// The least seconds of each of some settings in turn, without what is built for the rays; and the
/// rays of the first.
fn traced<const N: usize>(plan: &Plan, mesh: &Mesh, settings: [&Params; N]) -> ([f64; N], u64) {
    let clock = Clock(Mutex::new(Instant::now()));
    let mut least = [f64::INFINITY; N];
    let mut rays = 0;
    let rounds = if settings[0].rays > 32 {
        1
    } else {
        plan.repeats().min(3)
    };
    for _ in 0..rounds {
        for (params, least) in settings.iter().zip(&mut least).rev() {
            let (_, stats) = shadow::draw(mesh, params, &clock).expect("the shapes have triangles");
            let started = *clock.0.lock().expect("no holder panics");
            *least = least.min(started.elapsed().as_secs_f64());
            rays = stats.shadow_rays;
        }
    }
    (least, rays)
}

/// Runs the tables on the paper's scenes, prints each row, and writes the manual's page if asked to.
pub fn run(plan: &Plan) {
    if !plan.wants("shadow") {
        return;
    }
    let mut page = OPENING.to_owned();
    for table in [RAYS, RESOLUTION, FINE] {
        let found: Vec<(&str, Vec<Row>)> = scenes::all()
            .iter()
            .map(|(name, mesh)| (*name, table.rows(plan, name, mesh)))
            .collect();
        table.describe(&found, &mut page);
        if plan.manual {
            let path = format!("man/shadow-{}.svg", table.name);
            std::fs::write(path, table.plot(&found).svg()).expect("the folder of the manual");
        }
    }
    if plan.manual {
        std::fs::write("man/shadow.md", page).expect("the folder of the manual");
    }
}

impl Table {
    fn rows(&self, plan: &Plan, name: &str, mesh: &Mesh) -> Vec<Row> {
        let bench = format!("shadow-{}-{name}", self.name);
        let mut rows = Vec::new();
        for setting in self.settings {
            let [resolution, rays] = *setting;
            if !plan.wants(&bench) || plan.quick && (resolution > 128 || rays > 8) {
                continue;
            }
            let size = if plan.quick { [64, 48] } else { self.size };
            let octree = Params {
                resolution,
                rays,
                size,
                ..Params::DEFAULT
            };
            let skipping = Params {
                near: Near::Skip,
                ..octree.clone()
            };
            let exact = Params {
                method: Method::Exact,
                ..octree.clone()
            };
            let ([octree_s, skipping_s, exact_s], shadow_rays) =
                traced(plan, mesh, [&octree, &skipping, &exact]);
            let verifying = Params {
                verify: true,
                rays: 1,
                ..octree
            };
            let (_, verified) =
                shadow::draw(mesh, &verifying, &Silent).expect("the shapes have triangles");
            let found = verified.verified.expect("was asked for");
            let share = |count: u64| count as f64 / verified.shaded as f64;
            let row = Row {
                setting: *setting,
                shadow_rays,
                octree: octree_s,
                skipping: skipping_s,
                exact: exact_s,
                leaks: share(found.light_leaks),
                falsely: share(found.false_shadows),
                difference: found.mean_difference,
            };
            let line = json!({
                "bench": bench,
                "triangles": mesh.triangles.len(),
                "resolution": resolution,
                "rays": rays,
                "pixels": size,
                "shadow_rays": row.shadow_rays,
                "seconds": row.octree,
                "seconds_skipping_near": row.skipping,
                "seconds_exact": row.exact,
                "light_leaks": row.leaks,
                "false_shadow": row.falsely,
                "mean_difference": row.difference,
                "threads": rayon::current_num_threads(),
            });
            println!("{line}");
            rows.push(row);
        }
        rows
    }

    /// What varies of a setting.
    fn varied(&self, setting: [u32; 2]) -> u32 {
        setting[usize::from(self.name == "rays")]
    }

    fn describe(&self, found: &[(&str, Vec<Row>)], page: &mut String) {
        let [width, height] = self.size;
        let _ = write!(
            page,
            "\n## {}\n\nPictures of {width} x {height}.\n\n",
            self.title
        );
        let what = if self.name == "rays" {
            "rays"
        } else {
            "voxels"
        };
        let _ = writeln!(
            page,
            "| scene | {what} | shadow rays | octree s | skipping near s | exact s | false shadow | leaks |\n|---|---|---|---|---|---|---|---|"
        );
        for (name, rows) in found {
            for row in rows {
                let _ = writeln!(
                    page,
                    "| {name} | {} | {} | {:.3} | {:.3} | {:.3} | {:.2} % | {:.2} % |",
                    self.varied(row.setting),
                    row.shadow_rays,
                    row.octree,
                    row.skipping,
                    row.exact,
                    100.0 * row.falsely,
                    100.0 * row.leaks
                );
            }
        }
        let _ = writeln!(page, "\n![{}](shadow-{}.svg)", self.title, self.name);
    }

    fn plot(&self, found: &[(&str, Vec<Row>)]) -> Plot {
        let what = if self.name == "rays" {
            "rays for each pixel"
        } else {
            "voxels along the longest side"
        };
        let mut plot = Plot::new(
            self.title,
            Axis::new(what, Scale::Log2),
            Axis::new("time (s)", Scale::Log),
        );
        for (index, (name, rows)) in found.iter().enumerate() {
            let line = |method: &str, look: usize, seconds: &dyn Fn(&Row) -> f64| {
                let point = |row: &Row| Point {
                    x: f64::from(self.varied(row.setting)),
                    y: seconds(row),
                    ..Point::default()
                };
                let points = rows.iter().map(point).collect();
                Series {
                    line: Line::Straight,
                    ..Series::new(format!("{name}, {method}"), look, points)
                }
            };
            let octree = line("octree", 2 * index, &|r| r.octree);
            let exact = line("exact", 2 * index + 1, &|r| r.exact);
            plot.series.extend([octree, exact]);
        }
        plot
    }
}

const OPENING: &str = "\
# Shadow rays: voxels against triangles

The tables of Forest, Barthe and Paulin (2009) on scenes like theirs: a torus knot of 52,992 triangles, 27 spheres and a tree of 590,480 triangles. They lack what is last here: the share of pixels with a ray that voxels block and triangles do not, and of those with a ray that passes a blocker, at one ray for each pixel. Seconds are those of primary and shadow rays on the machine that wrote this page, without what is built before: `cargo bench --bench throughput -- shadow --manual` writes it anew.
";
