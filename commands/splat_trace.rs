//! `scantle splat-trace`: a picture of surfaces of discs, with mirrors and glass.

mod look;

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::found::Found;
use crate::job::Job;
use crate::shared::{
    Common, InputFormat, MaxError, Output, Seed, Verify, list, named, picture_size,
};
use clap::value_parser;
use look::{Look, colour, look, materials};
use scantle::error::Result;
use scantle::image::colour::Srgb;
use scantle::image::samples::Image;
use scantle::io;
use scantle::io::format::Kind;
use scantle::io::source::Source;
use scantle::measure::splat_error::{
    PictureError, Sight, SurfaceError, picture_error, surface_error,
};
use scantle::mesh::Mesh;
use scantle::render::splats::{
    self, Accelerator, Blend, Drawing, Ground, Light, MOST_DEPTH, MOST_SAMPLES, Material, Params,
    Scene, SelfHit, Sphere, TRADE,
};
use scantle::render::view::View;
use scantle::report::{Accuracy, Measures};
use schemars::JsonSchema;
use serde::Serialize;

/// Draw surfaces of splats with shadows, mirrors and glass
///
/// Rays meet the discs that splat-gen makes; where discs overlap, the one counts whose centre is nearest,
/// and normals are blended, so that few flat discs look smooth. All inputs, meshes and spheres make one
/// scene; they are numbered in that order from 0. All lights together are as bright as one, at any
/// distance.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER)]
pub struct Args {
    /// Files of splats, all in one scene; `-` for standard input
    #[arg(value_name = "SPLATS", required = true)]
    inputs: Vec<String>,
    #[command(flatten)]
    format: InputFormat,
    /// A mesh in the scene; may be given several times
    #[arg(long, value_name = "FILE")]
    mesh: Vec<String>,
    /// A sphere in the scene: its centre and radius; may be given several times
    #[arg(long, value_name = "X,Y,Z,RADIUS", value_parser = list::<4>, allow_hyphen_values = true)]
    sphere: Vec<[f64; 4]>,
    /// How object N looks: `clay`, `gloss`, `mirror` or `glass`, and any of colour=#RRGGBB, ambient,
    /// diffuse, specular, shininess, mirror, transparent and index, each with = and a number; later
    /// ones win. May be given several times, as 0:mirror=0.8,colour=#ff8800 or 1:glass,index=1.33
    #[arg(long, value_name = "N:WORD,...", value_parser = look)]
    material: Vec<Look>,
    /// Where a light is; may be given several times. Without it there is one to the upper left of the
    /// viewer
    #[arg(long, value_name = "X,Y,Z", value_parser = list::<3>, allow_hyphen_values = true)]
    light: Vec<[f64; 3]>,
    /// The colour of a light, the first for the first --light; white for those without
    #[arg(long, value_name = "#RRGGBB", value_parser = colour, requires = "light")]
    light_colour: Vec<Srgb>,
    /// The camera: where it is, the point that it looks at, the direction that is up, and the angle
    /// from bottom to top in degrees. Without it the scene is seen from the right of its front, y up
    #[arg(long, value_name = "EYE,TARGET,UP,ANGLE", value_parser = list::<10>, allow_hyphen_values = true)]
    camera: Option<[f64; 10]>,
    /// How often a ray may be reflected or refracted; after that it sees the sky
    #[arg(long, value_name = "N", default_value_t = Params::DEFAULT.depth, value_parser = value_parser!(u32).range(0..=i64::from(MOST_DEPTH)))]
    depth: u32,
    /// Rays along each side of a pixel: N x N for each
    #[arg(long, value_name = "N", default_value_t = Params::DEFAULT.samples, value_parser = value_parser!(u32).range(1..=i64::from(MOST_SAMPLES)))]
    samples: u32,
    /// How rays find discs, which changes no picture: `bvh`, a hierarchy of boxes, which is faster;
    /// `octree`, that of the paper, made where rays go
    #[arg(long, default_value = Params::DEFAULT.accelerator.name(), value_parser = named(Accelerator::NAMES, Accelerator::from_name))]
    accelerator: Accelerator,
    /// What a ray that starts on a disc does not meet: `overlap`, discs that overlap that one and agree
    /// with it; `ball`, what is nearer than twice the error of the discs there, as in the paper
    #[arg(long, default_value = Params::DEFAULT.self_hit.name(), value_parser = named(SelfHit::NAMES, SelfHit::from_name))]
    self_hit: SelfHit,
    /// What is averaged where discs overlap: `none`; `normals`, and colours; `depth`, places too
    #[arg(long, default_value = Params::DEFAULT.blend.name(), value_parser = named(Blend::NAMES, Blend::from_name))]
    blend: Blend,
    /// What lies under the scene: `none`; `shadow`, a plane that shows shadows alone; `checker`, one of
    /// squares
    #[arg(long, default_value = Params::DEFAULT.ground.name(), value_parser = named(Ground::NAMES, Ground::from_name))]
    ground: Ground,
    /// The colour behind the scene
    #[arg(long, value_name = "#RRGGBB", default_value = "#ffffff", value_parser = colour)]
    background: Srgb,
    /// The colour straight up, which mirrors and glass show
    #[arg(long, value_name = "#RRGGBB", default_value = "#94bae2", value_parser = colour)]
    sky: Srgb,
    /// Columns and rows of the picture
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = picture_size)]
    size: [u32; 2],
    /// A mesh that all splats together stand for: what the picture, the surface and its normals are
    /// measured against
    #[arg(long, value_name = "FILE")]
    reference: Option<String>,
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
The first measure of `accuracy`, which --max-error checks, is the share of wrong pixels: those more than
2 of 255 off the picture of the mesh that --reference names, drawn with the same settings, or else, with
--verify, off the same discs with 8 bounces, 16 rays a pixel and places blended. --verify also tries
every disc for some of the rays: the tree must give the same to the last bit.

Examples:
  scantle splat-trace fixtures/splats/sphere.ply --size 320x240 -o sphere.png
  scantle splat-trace fixtures/splats/sphere.ply --sphere 2,0,0,.5 --material 1:mirror -o m.png
";

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// Meshes of the scene.
    meshes: Vec<String>,
    /// Spheres of the scene.
    spheres: Vec<Sphere>,
    /// Materials by the number of the object; objects beyond the last are of clay.
    materials: Vec<Material>,
    /// The lights; none where that of the default is taken.
    lights: Vec<Light>,
    /// The camera; null where that of the default is taken.
    camera: Option<View>,
    /// How often a ray may be reflected or refracted.
    depth: u32,
    /// Rays along each side of a pixel.
    samples: u32,
    /// How rays find discs.
    accelerator: Accelerator,
    /// What a ray that starts on a disc does not meet.
    self_hit: SelfHit,
    /// What is averaged where discs overlap.
    blend: Blend,
    /// What lies under the scene.
    ground: Ground,
    /// The colour behind the scene, sRGB bytes.
    background: Srgb,
    /// The colour straight up, sRGB bytes.
    sky: Srgb,
    /// Columns and rows of the picture.
    size: [u32; 2],
    /// What places in a pixel are drawn from; null where there is one, in the middle.
    seed: Option<u64>,
    /// The mesh that the splats stand for; null where none is known.
    reference: Option<String>,
}

impl Asked {
    fn new(args: &Args, scene: &Scene, params: &Params) -> Self {
        Asked {
            meshes: args.mesh.clone(),
            spheres: scene.spheres.clone(),
            materials: scene.materials.clone(),
            lights: params.lights.clone(),
            camera: params.camera,
            depth: params.depth,
            samples: params.samples,
            accelerator: params.accelerator,
            self_hit: params.self_hit,
            blend: params.blend,
            ground: params.ground,
            background: params.background,
            sky: params.sky,
            size: params.size,
            seed: (params.samples > 1).then_some(params.seed),
            reference: args.reference.clone(),
        }
    }
}

/// What was drawn, and how far it is from what it stands for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    #[serde(flatten)]
    made: splats::Stats,
    /// The picture against that of the reference, or with `--verify` of the finest setting.
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<PictureError>,
    /// What is seen of the splats against the mesh of `--reference`.
    #[serde(skip_serializing_if = "Option::is_none")]
    surface: Option<SurfaceError>,
}

/// The report of this command.
pub type Report = scantle::report::Report<Asked, Stats>;

impl Args {
    fn params(&self) -> Params {
        let colours = self.light_colour.iter().copied().map(Some);
        let colours = colours.chain(std::iter::repeat(None));
        let lights = self.light.iter().zip(colours);
        Params {
            camera: self.camera.map(|c| View {
                eye: [c[0], c[1], c[2]],
                target: [c[3], c[4], c[5]],
                up: [c[6], c[7], c[8]],
                fov_deg: c[9],
            }),
            lights: lights
                .map(|(place, colour)| Light {
                    place: *place,
                    colour: colour.unwrap_or([255; 3]),
                })
                .collect(),
            depth: self.depth,
            accelerator: self.accelerator,
            samples: self.samples,
            self_hit: self.self_hit,
            blend: self.blend,
            ground: self.ground,
            background: self.background,
            sky: self.sky,
            size: self.size,
            seed: self.seed.seed,
            verify: self.verify.verify,
        }
    }
}

/// Draws the scene.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let params = args.params();
    params.check()?;
    let files = Files::together(&args.inputs, &args.format)
        .output(&args.output)
        .reads("reference", &args.reference);
    let files = (args.mesh.iter()).fold(files, |files, word| {
        files.reads("mesh", &Some(word.clone()))
    });
    context.run("splat-trace", &files, |job| trace(job, &params, args))
}

fn trace(job: &mut Job, params: &Params, args: &Args) -> Result<Found<Asked, Stats>> {
    job.expect_output(&[Kind::Image])?;
    let scene = read(job, args)?;
    let [width, height] = params.size.map(u128::from);
    // Light and bytes of up to two pictures, and what is seen in each pixel.
    job.expect_room("the picture", width * height * 160)?;
    let (drawing, made) = splats::draw(&scene, params, job.progress())?;
    job.write_image(&Image::from_light(&drawing.light))?;
    job.warn(made.warnings.clone());
    let rays = made.rays.sum();
    let summary = format!(
        "{rays} rays, {} of {} pixel rays hit, {:.1} discs tested a ray",
        made.hits, made.rays.primary, made.tests_per_ray
    );
    let exact = drawing.exact.as_ref();
    let stats = Stats {
        picture: exact.map(|exact| picture_error(&drawing.light, exact)),
        surface: surface(&drawing),
        made,
    };
    let accuracy = stats.accuracy(&scene);
    let modelled = stats.made.modelled();
    Ok(Found::new(Asked::new(args, &scene, params), stats, summary)
        .accuracy(Measures::Many(accuracy))
        .modelled(modelled)
        .check("max-error", args.max_error.max_error))
}

fn read(job: &mut Job, args: &Args) -> Result<Scene> {
    let covers = (0..job.words().len()).map(|_| job.read_splats());
    let covers = covers.collect::<Result<_>>()?;
    let meshes = args.mesh.iter().map(|word| read_beside(job, word));
    let meshes = meshes.collect::<Result<_>>()?;
    let reference = args.reference.as_ref();
    let sphere = |[x, y, z, radius]: &[f64; 4]| Sphere {
        centre: [*x, *y, *z],
        radius: *radius,
    };
    Ok(Scene {
        covers,
        meshes,
        spheres: args.sphere.iter().map(sphere).collect(),
        materials: materials(&args.material),
        reference: reference.map(|word| read_beside(job, word)).transpose()?,
    })
}

/// A mesh that an option names.
fn read_beside(job: &mut Job, word: &str) -> Result<Mesh> {
    job.read_beside(|memory| {
        let source = Source::open(word, memory)?;
        let (mesh, input, warnings) = io::read_mesh(&source, None)?;
        Ok((mesh, vec![input], warnings))
    })
}

/// How far what is seen of the splats is from the reference, where there is one.
fn surface(drawing: &Drawing) -> Option<SurfaceError> {
    let mesh = drawing.surface.as_ref()?;
    let looks = &drawing.looks;
    let sight = |at: usize| {
        let look = looks[at];
        Sight {
            origin: look.origin,
            direction: look.direction,
            depth: look.depth,
            normal: look.normal,
            outside: look.outside,
        }
    };
    let width = drawing.light.width();
    Some(surface_error(
        mesh,
        drawing.diagonal,
        width,
        looks.len(),
        sight,
    ))
}

impl Stats {
    fn accuracy(&self, scene: &Scene) -> Vec<Accuracy> {
        let by = match (&scene.reference, self.picture) {
            (Some(_), _) => "the mesh, drawn with the same settings",
            (None, Some(_)) => "the same discs with 8 bounces, 16 rays a pixel and places blended",
            (None, None) => "measured with --reference or --verify",
        };
        let (name, unit) = (TRADE.error.name, TRADE.error.unit);
        let wrong = Accuracy {
            measure: name.to_owned(),
            unit: unit.to_owned(),
            bound: None,
            reached: self.picture.map(|picture| picture.wrong_share),
            reference: by.to_owned(),
            verified: self.picture.is_some(),
        };
        let mut all = vec![wrong];
        if let Some(surface) = &self.surface {
            all.extend(surface.accuracy());
        }
        all.push(self.made.accuracy());
        all
    }
}
