//! How fast things go: one JSON line per measurement, on data made by formula.
//!
//! `cargo bench --bench throughput` runs three sizes, each four times the one before, so that the
//! exponent shows; `-- --quick` runs the smallest once; further words pick benches by name. The
//! seconds are the least of the repetitions. `-- shadow --manual` writes `man/shadow.md` too.

use scantle::error::Fault;
use scantle::io;
use scantle::io::source::Source;
use scantle::io::{npy, nrrd, obj, off, ply, stl};
use scantle::mesh::{Mesh, shapes};
use scantle::progress::Silent;
use scantle::volume::voxelize::{Fill, Mode, Params, Size, Storage, voxelize};
use scantle::volume::{Data, Frame, Volume};
use serde_json::json;
use std::io::Write;
use std::time::Instant;

mod clouds;
mod molecules;
mod scenes;
mod shadows;

/// What to run.
struct Plan {
    quick: bool,
    /// Whether the page of the manual is written.
    manual: bool,
    names: Vec<String>,
}

impl Plan {
    fn from_words(words: impl Iterator<Item = String>) -> Self {
        let (options, names): (Vec<_>, Vec<_>) = words.partition(|word| word.starts_with("--"));
        Plan {
            // `cargo bench` adds `--bench`.
            quick: options.iter().any(|option| option == "--quick"),
            manual: options.iter().any(|option| option == "--manual"),
            names,
        }
    }

    fn wants(&self, name: &str) -> bool {
        self.names.is_empty() || self.names.iter().any(|part| name.contains(part))
    }

    /// Three sizes, each four times the one before.
    fn sizes(&self, smallest: usize) -> Vec<usize> {
        let sizes = [smallest, 4 * smallest, 16 * smallest];
        sizes[..if self.quick { 1 } else { 3 }].to_vec()
    }

    /// The least seconds that `work` takes, and what it returns.
    fn time<T>(&self, repeats: usize, mut work: impl FnMut() -> T) -> (f64, T) {
        let mut once = || {
            let start = Instant::now();
            let result = std::hint::black_box(work());
            (start.elapsed().as_secs_f64(), result)
        };
        let first = once();
        (1..repeats).fold(first, |(least, _), _| {
            let (seconds, result) = once();
            (least.min(seconds), result)
        })
    }

    fn repeats(&self) -> usize {
        if self.quick { 1 } else { 5 }
    }

    /// Measures `work` on `elements` of a `unit` and prints a line. It returns the bytes it passed.
    fn measure(&self, name: &str, unit: &str, elements: usize, work: impl FnMut() -> usize) {
        let repeats = self.repeats();
        let (least, bytes) = self.time(repeats, work);
        let line = json!({
            "bench": name,
            "unit": unit,
            "elements": elements,
            "bytes": bytes,
            "seconds": least,
            "elements_per_second": elements as f64 / least,
            "bytes_per_second": bytes as f64 / least,
            "repeats": repeats,
            "threads": rayon::current_num_threads(),
        });
        println!("{line}");
    }
}

type MeshWriter = fn(&Mesh, &mut dyn Write) -> std::io::Result<()>;
type VolumeWriter = fn(&Volume, &mut dyn Write) -> std::io::Result<()>;

fn read_back(name: &str, bytes: &[u8]) -> Result<io::Content, Fault> {
    let source = Source::from_bytes(name, bytes.to_vec());
    let content = source.and_then(|source| io::read(&source, None));
    content
        .map(|(content, _, _)| content)
        .map_err(|error| Fault::whole(error.to_string()))
}

fn meshes(plan: &Plan) {
    let writers: [(&str, MeshWriter); 4] = [
        ("obj", obj::write),
        ("off", off::write),
        ("ply", ply::write),
        ("stl", stl::write),
    ];
    for (format, write) in writers {
        let (writing, reading) = (format!("write-{format}"), format!("read-{format}"));
        if !plan.wants(&writing) && !plan.wants(&reading) {
            continue;
        }
        for triangles in plan.sizes(16_384) {
            let around = ((triangles / 2) as f64).sqrt() as usize;
            let mesh = shapes::torus([0.0; 3], 1.0, 0.25, around, around);
            let count = mesh.triangles.len();
            let mut bytes = Vec::new();
            plan.measure(&writing, "triangles", count, || {
                bytes.clear();
                write(&mesh, &mut bytes).expect("memory can be written");
                bytes.len()
            });
            let name = format!("bench.{format}");
            plan.measure(&reading, "triangles", count, || {
                read_back(&name, &bytes).expect("what was written is read");
                bytes.len()
            });
        }
    }
}

fn volumes(plan: &Plan) {
    let writers: [(&str, VolumeWriter); 2] = [("npy", npy::write), ("nrrd", nrrd::write)];
    for (format, write) in writers {
        let (writing, reading) = (format!("write-{format}"), format!("read-{format}"));
        if !plan.wants(&writing) && !plan.wants(&reading) {
            continue;
        }
        for voxels in plan.sizes(1 << 18) {
            let dims = [64, 64, voxels / 4096];
            let volume = Volume {
                frame: Frame::straight(dims, [0.0; 3], [1.0; 3]),
                data: Data::F32((0..voxels).map(|i| (i % 1021) as f32).collect()),
            };
            let mut bytes = Vec::new();
            plan.measure(&writing, "voxels", voxels, || {
                bytes.clear();
                write(&volume, &mut bytes).expect("memory can be written");
                bytes.len()
            });
            let name = format!("bench.{format}");
            plan.measure(&reading, "voxels", voxels, || {
                read_back(&name, &bytes).expect("what was written is read");
                bytes.len()
            });
        }
    }
}

/// What is voxelized, and how.
struct Voxelization {
    name: &'static str,
    resolution: u32,
    mode: Mode,
    fill: Fill,
    grid: Storage,
}

const SURFACE: Voxelization = Voxelization {
    name: "surface",
    resolution: 256,
    mode: Mode::Conservative,
    fill: Fill::None,
    grid: Storage::Dense,
};

/// Each kind of result once.
const VOXELIZATIONS: &[Voxelization] = &[
    SURFACE,
    Voxelization {
        name: "surface",
        resolution: 512,
        ..SURFACE
    },
    Voxelization {
        name: "three-axis",
        mode: Mode::ThreeAxis,
        ..SURFACE
    },
    Voxelization {
        name: "sparse",
        resolution: 1024,
        grid: Storage::Sparse,
        ..SURFACE
    },
    Voxelization {
        name: "parity",
        fill: Fill::Parity,
        ..SURFACE
    },
    Voxelization {
        name: "winding",
        fill: Fill::Winding,
        ..SURFACE
    },
];

impl Voxelization {
    /// Measures it on a mesh and prints a line; a quick plan takes a quarter of the resolution.
    fn measure(&self, plan: &Plan, of: &str, mesh: &Mesh) {
        let resolution = if plan.quick {
            self.resolution / 4
        } else {
            self.resolution
        };
        let params = Params {
            size: Size::Resolution(resolution),
            mode: self.mode,
            fill: self.fill,
            grid: self.grid,
            ..Params::DEFAULT
        };
        let repeats = plan.repeats();
        let (seconds, stats) = plan.time(repeats, || {
            let (_, stats) =
                voxelize(mesh, &params, &Silent).expect("the shapes have size and fit in memory");
            stats
        });
        let triangles = mesh.triangles.len();
        let line = json!({
            "bench": format!("voxelize-{}-{of}", self.name),
            "resolution": resolution,
            "triangles": triangles,
            "set_voxels": stats.set_voxels,
            "seconds": seconds,
            "triangles_per_second": triangles as f64 / seconds,
            "set_voxels_per_second": stats.set_voxels as f64 / seconds,
            "repeats": repeats,
            "threads": rayon::current_num_threads(),
        });
        println!("{line}");
    }
}

/// A torus knot in each way; 4 x 4 x 4 spheres at three numbers of triangles.
fn voxelizations(plan: &Plan) {
    let wanted =
        |of: &str, case: &Voxelization| plan.wants(&format!("voxelize-{}-{of}", case.name));
    let knot = shapes::torus_knot(2, 3, 0.4, 288, 92);
    for case in VOXELIZATIONS {
        if wanted("knot", case) {
            case.measure(plan, "knot", &knot);
        }
    }
    if !wanted("spheres", &SURFACE) {
        return;
    }
    for triangles in plan.sizes(32_768) {
        let detail = ((triangles / 64 / 8) as f64).sqrt() as usize;
        let spheres = shapes::sphere_grid(4, 0.8, 2.0, detail);
        SURFACE.measure(plan, "spheres", &spheres);
    }
}

fn main() {
    let plan = Plan::from_words(std::env::args().skip(1));
    meshes(&plan);
    volumes(&plan);
    voxelizations(&plan);
    shadows::run(&plan);
    molecules::run(&plan);
    clouds::run(&plan);
}
