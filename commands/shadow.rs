//! `scantle shadow`: a mesh under soft shadows.

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, MaxError, Output, Seed, Verify, list, named, picture_size};
use clap::builder::PossibleValue;
use clap::{ValueEnum, value_parser};
use scantle::error::Result;
use scantle::image::samples::Image;
use scantle::io::format::Kind;
use scantle::render::shadow::{self, Light, MOST_RAYS, Method, Near, Params, Stats, View};
use scantle::report::Measures;
use scantle::volume::voxelize::Mode;
use schemars::JsonSchema;
use serde::Serialize;

/// Draw a mesh with the soft shadows of area lights
///
/// Shadow rays are answered by an octree of the voxels that the surface sets, voxel by voxel, or by
/// the triangles themselves; --verify says by how much the shadows differ. All lights together are
/// as bright as one, at any distance. Triangles have no inside: a light in a closed mesh shines on
/// its inner side, and a camera there sees it.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    /// How shadow rays are answered: `octree`, by the octree of the voxels, which pays where many small
    /// triangles stand apart, as the twigs of a tree do; `dda`, voxel by voxel; `exact`, by the
    /// triangles
    #[arg(long, default_value = Params::DEFAULT.method.name(), value_parser = named(Method::NAMES, Method::from_name))]
    method: Method,
    /// Voxels along the longest side of the model
    #[arg(long, value_name = "N", default_value_t = Params::DEFAULT.resolution, value_parser = value_parser!(u32).range(1..=65_536))]
    resolution: u32,
    /// Make the octree only where shadow rays go; the picture is the same
    #[arg(long)]
    lazy: bool,
    /// Which voxels the surface sets: `three-axis`, those it meets on a line through their centres;
    /// `conservative`, all it touches, so that no light leaks but where --near skip lets it
    #[arg(long, default_value = Params::DEFAULT.mode.name(), value_parser = named(&["three-axis", "conservative"], Mode::from_name))]
    mode: Mode,
    /// What a ray does until it has left the voxels of the surface on which it starts: `exact`, go by
    /// the triangles; `skip`, pass everything, which is faster and lets light through where things
    /// touch
    #[arg(long, default_value = Params::DEFAULT.near.name(), value_parser = named(Near::NAMES, Near::from_name))]
    near: Near,
    /// Shadow rays for each pixel, or vertex, and light
    #[arg(long, value_name = "S", default_value_t = Params::DEFAULT.rays, value_parser = value_parser!(u32).range(1..=i64::from(MOST_RAYS)))]
    rays: u32,
    /// A light: the centre and the radius of a ball, in the mesh's unit; may be given several times.
    /// Without it there is one to the upper left of the viewer
    #[arg(long, value_name = "X,Y,Z,RADIUS", value_parser = list::<4>, allow_hyphen_values = true)]
    light: Vec<[f64; 4]>,
    /// The camera: where it is, the point that it looks at, the direction that is up, and the angle
    /// from bottom to top in degrees. Without it the model is seen from the right of its front, y up
    #[arg(long, value_name = "EYE,TARGET,UP,ANGLE", value_parser = list::<10>, allow_hyphen_values = true)]
    camera: Option<[f64; 10]>,
    /// Columns and rows of the picture
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = picture_size)]
    size: [u32; 2],
    /// Write the mesh instead of a picture, with the light that each vertex gets as its colour
    #[arg(long, value_enum, conflicts_with_all = ["camera", "size"])]
    bake: Option<Bake>,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    seed: Seed,
    #[command(flatten)]
    max_error: MaxError,
    #[command(flatten)]
    verify: Verify,
    #[command(flatten)]
    common: Common,
}

const AFTER: &str = "\
The first measure of `accuracy`, which --max-error checks, is the mean error of the share of the
lights that is blocked, over the pixels (or vertices) that a shadow ray starts from; it holds what
too few rays are off by, and what voxels are. The others compare the same rays, one by one.

Examples:
  scantle shadow fixtures/shapes/torus-knot.ply --size 320x240 -o knot.png
  scantle shadow fixtures/shapes/torus.obj --bake vertices --method exact -o torus.ply
";

/// What shadows are baked into.
#[derive(Debug, Clone, Copy)]
enum Bake {
    Vertices,
}

impl ValueEnum for Bake {
    fn value_variants<'a>() -> &'a [Self] {
        &[Bake::Vertices]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new("vertices"))
    }
}

/// What was asked for; null is what has no effect together with the rest.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// How shadow rays are answered.
    method: Method,
    /// Voxels along the longest side of the model; null for `exact`.
    resolution: Option<u32>,
    /// Whether the octree is made only where rays go; null for other methods.
    lazy: Option<bool>,
    /// Which voxels the surface sets; null for `exact`.
    mode: Option<Mode>,
    /// What rays through voxels do near the surface they start on; null for `exact`.
    near: Option<Near>,
    /// Shadow rays for each pixel, or vertex, and light.
    rays: u32,
    /// The lights; none where that of the default is taken.
    lights: Vec<Light>,
    /// The camera; null where that of the default is taken, or nothing is drawn.
    camera: Option<View>,
    /// Columns and rows of the picture; null where nothing is drawn.
    size: Option<[u32; 2]>,
    /// What the places of the rays' ends are drawn from.
    seed: u64,
    /// What the shadows were baked into, null where a picture was drawn.
    bake: Option<&'static str>,
}

impl Asked {
    fn new(params: &Params, bake: Option<Bake>) -> Self {
        let by_voxels = params.method != Method::Exact;
        Asked {
            method: params.method,
            resolution: by_voxels.then_some(params.resolution),
            lazy: (params.method == Method::Octree).then_some(params.lazy),
            mode: by_voxels.then_some(params.mode),
            near: by_voxels.then_some(params.near),
            rays: params.rays,
            lights: params.lights.clone(),
            camera: params.camera,
            size: bake.is_none().then_some(params.size),
            seed: params.seed,
            bake: bake.map(|_| "vertices"),
        }
    }
}

/// The report of this command.
pub type Report = scantle::report::Report<Asked, Stats>;

/// Draws each input.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let light = |[x, y, z, radius]: &[f64; 4]| Light {
        centre: [*x, *y, *z],
        radius: *radius,
    };
    let view = |c: [f64; 10]| View {
        eye: [c[0], c[1], c[2]],
        target: [c[3], c[4], c[5]],
        up: [c[6], c[7], c[8]],
        fov_deg: c[9],
    };
    let params = Params {
        method: args.method,
        resolution: args.resolution,
        lazy: args.lazy,
        mode: args.mode,
        near: args.near,
        rays: args.rays,
        lights: args.light.iter().map(light).collect(),
        camera: args.camera.map(view),
        size: args.size,
        seed: args.seed.seed,
        verify: args.verify.verify,
        max_memory: context.memory(),
    };
    params.check()?;
    let files = Files::each(&args.inputs).output(&args.output);
    context.run("shadow", &files, |job| shadow(job, &params, args))
}

fn shadow(job: &mut Job, params: &Params, args: &Args) -> Result<Found<Asked, Stats>> {
    job.expect_output(&[if args.bake.is_some() {
        Kind::Mesh
    } else {
        Kind::Image
    }])?;
    let mesh = job.read_mesh()?;
    let stats = if args.bake.is_some() {
        let (baked, stats) = shadow::bake(&mesh, params, job.progress())?;
        job.write_mesh(&baked)?;
        stats
    } else {
        let [width, height] = params.size.map(u128::from);
        // Four samples of light for each pixel, and the pixels themselves.
        job.expect_room("the picture", width * height * 64)?;
        let (light, stats) = shadow::draw(&mesh, params, job.progress())?;
        job.write_image(&Image::from_light(&light))?;
        stats
    };
    job.warn(stats.warnings.clone());
    let summary = format!(
        "{} of {} shadow rays blocked",
        stats.blocked_rays, stats.shadow_rays
    );
    let (accuracy, modelled) = (stats.accuracy(), stats.modelled());
    let asked = Asked::new(params, args.bake);
    Ok(Found::new(asked, stats, summary)
        .accuracy(Measures::Many(accuracy))
        .modelled(modelled)
        .check("max-error", args.max_error.max_error))
}
