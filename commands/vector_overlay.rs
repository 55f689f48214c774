//! `scantle vector-overlay`: features drawn on terrain, exact in every pixel.

mod symbols;

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::found::Found;
use crate::job::Job;
use crate::land::Land;
use crate::shared::{
    Common, InputFormat, MaxError, Output, Verify, list, named, parsed, picture_size,
};
use clap::value_parser;
use scantle::camera::{Camera, Lens, Size};
use scantle::error::{Error, Result};
use scantle::image::samples::{Image, Samples};
use scantle::io;
use scantle::io::format::{Format, Kind};
use scantle::io::geotiff::{self, Cells};
use scantle::io::source::Source;
use scantle::measure::overlay_error::{OverlayError, overlay_error};
use scantle::render::view::View;
use scantle::report::{Accuracy, Measures, Modelled, Warning};
use scantle::terrain::frame::Frame;
use scantle::terrain::overlay::{self, Method, Overlay, Params};
use scantle::terrain::plan;
use scantle::terrain::pyramid::Pyramid;
use scantle::terrain::style::{Painted, Sheet};
use scantle::terrain::surface::{self, Surface};
use scantle::terrain::view::Scene;
use scantle::terrain::{Grid, Transform};
use scantle::vector::{Feature, Layer};
use schemars::JsonSchema;
use serde::Serialize;
use symbols::Symbols;

/// Draw features on terrain, exact in every pixel
///
/// Each pixel shows a place of the land, and it is decided for that place which features cover it: there is
/// no texture between, and no line that floats over the land or sinks into it. From above, masks and numbers
/// of features follow the rules of GDAL. Layers in another reference system are brought into that of the
/// terrain.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER)]
pub struct Args {
    #[command(flatten)]
    land: Land,
    /// From where: `perspective`, by a camera; `plan`, from straight above, as a map
    #[arg(long, default_value = "perspective", value_parser = named(ViewKind::NAMES, ViewKind::from_name))]
    view: ViewKind,
    /// What pixels hold: `map`, the colours of land and features; `mask`, 255 where there is a feature;
    /// `ids`, the number of the last feature there, counted from 1 over all layers
    #[arg(long, default_value = "map", value_parser = named(Show::NAMES, Show::from_name))]
    show: Show,
    /// The camera: where it is, the point that it looks at, the direction that is up, and the angle
    /// from bottom to top in degrees, on the map and in its unit. Without it the land is seen from the
    /// south
    #[arg(long, value_name = "EYE,TARGET,UP,ANGLE", value_parser = list::<10>, allow_hyphen_values = true)]
    camera: Option<[f64; 10]>,
    /// Columns and rows of the picture; by default 1600x1000, and from above those of the terrain
    #[arg(long, value_name = "WxH", value_parser = picture_size)]
    size: Option<[u32; 2]>,
    /// How features look: a style sheet in JSON
    #[arg(long, value_name = "FILE")]
    style: Option<String>,
    /// How it is found what a pixel shows: `distance`, in an index of the features; `stencil`, by counting
    /// the faces of polyhedra as the paper does, and `stencil-zpass`, `stencil-zfail` by one rule for all;
    /// `texture:N`, in a picture of them so many texels wide, which is not exact
    #[arg(long, value_name = "METHOD", default_value = "distance", value_parser = parsed(Method::from_name, "distance, stencil, stencil-zpass, stencil-zfail or texture:N"))]
    method: Method,
    /// Places looked at in each pixel: more of them smooth edges
    #[arg(long, value_name = "N", default_value_t = Params::DEFAULT.samples, value_parser = value_parser!(u32).range(1..=64))]
    samples: u32,
    /// From above, set every pixel that a line or an edge passes through, not only those by their centres
    #[arg(long)]
    all_touched: bool,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    max_error: MaxError,
    #[command(flatten)]
    verify: Verify,
    #[command(flatten)]
    common: Common,
}

const AFTER: &str = "\
Pictures are PNG; masks and numbers from above are GeoTIFF too. The measure of `accuracy`, which --verify
measures and --max-error checks, is the share of pixels that show the wrong feature: each pixel's place is
tried against each feature by its definition.

Examples:
  scantle vector-overlay --terrain fixtures/terrain/hills.tif \\
    --vectors fixtures/vectors/hills.geojson --size 640x400 -o hills.png
  scantle vector-overlay --terrain fixtures/terrain/hills.tif \\
    --vectors fixtures/vectors/hills.geojson --view plan --show mask -o mask.tif
";

/// From where the land is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ViewKind {
    /// By a camera.
    Perspective,
    /// From straight above.
    Plan,
}

impl ViewKind {
    const NAMES: &'static [&'static str] = &["perspective", "plan"];

    fn from_name(name: &str) -> Option<Self> {
        match name {
            "perspective" => Some(ViewKind::Perspective),
            "plan" => Some(ViewKind::Plan),
            _ => None,
        }
    }
}

impl ViewKind {
    fn name(self) -> &'static str {
        match self {
            ViewKind::Perspective => "perspective",
            ViewKind::Plan => "plan",
        }
    }
}

/// What pixels hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Show {
    /// Colours.
    Map,
    /// Whether there is a feature.
    Mask,
    /// Which feature there is.
    Ids,
}

impl Show {
    const NAMES: &'static [&'static str] = &["map", "mask", "ids"];

    fn from_name(name: &str) -> Option<Self> {
        match name {
            "map" => Some(Show::Map),
            "mask" => Some(Show::Mask),
            "ids" => Some(Show::Ids),
            _ => None,
        }
    }
}

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// The surface between heights.
    surface: surface::Kind,
    /// From where.
    view: ViewKind,
    /// What pixels hold.
    show: Show,
    /// The camera; null from above.
    camera: Option<View>,
    /// Columns and rows.
    size: [u32; 2],
    /// The style sheet; null for what the names of layers tell.
    style: Option<String>,
    /// How it was found what pixels show; null for masks and numbers from above.
    method: Option<Method>,
    /// Places in each pixel.
    samples: u32,
    /// Whether all pixels that are touched were set.
    all_touched: bool,
}

/// What was found.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// The layers, in order.
    layers: Vec<Shown>,
    /// What was drawn by a camera, or as a map.
    #[serde(skip_serializing_if = "Option::is_none")]
    drawn: Option<overlay::Stats>,
    /// Pixels from above by the rules of GDAL.
    #[serde(skip_serializing_if = "Option::is_none")]
    plan: Option<plan::Stats>,
    /// The picture against the definition of each feature, where `--verify` looked.
    #[serde(skip_serializing_if = "Option::is_none")]
    wrong: Option<OverlayError>,
}

/// A layer in the picture.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Shown {
    /// Its name.
    name: String,
    /// Its features.
    features: u64,
    /// Pixels that show one of them.
    pixels: u64,
}

/// The report of this command.
pub type Report = scantle::report::Report<Asked, Stats>;

/// Bytes that a pixel of a picture takes: of light, of what is seen, of what is drawn.
const BYTES_PER_PIXEL: u128 = 96;
/// Bytes that one takes from above: the number of a feature, and what is written of it.
const BYTES_FROM_ABOVE: u128 = 8;

/// Draws the layers.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    params(args).check()?;
    if args.all_touched && (args.view != ViewKind::Plan || args.show == Show::Map) {
        let problem = "has no --all-touched: that is for --view plan with --show mask or ids";
        return Err(Error::parameter("view", args.view.name(), problem));
    }
    if let Some(view) = view_of(args) {
        view.check()?;
        if args.view == ViewKind::Plan {
            let problem = "takes no --camera: it is straight above";
            return Err(Error::parameter("view", args.view.name(), problem));
        }
    }
    let words = args.land.words();
    let format = InputFormat { input_format: None };
    let files = Files::together(&words, &format)
        .output(&args.output)
        .reads("style", &args.style);
    context.run("vector-overlay", &files, |job| draw(job, args))
}

fn params(args: &Args) -> Params {
    Params {
        method: args.method,
        samples: args.samples,
        ..Params::DEFAULT
    }
}

fn view_of(args: &Args) -> Option<View> {
    args.camera.map(|c| View {
        eye: [c[0], c[1], c[2]],
        target: [c[3], c[4], c[5]],
        up: [c[6], c[7], c[8]],
        fov_deg: c[9],
    })
}

fn draw(job: &mut Job, args: &Args) -> Result<Found<Asked, Stats>> {
    let from_above = args.view == ViewKind::Plan && args.show != Show::Map;
    job.expect_output(match from_above {
        true => &[Kind::Terrain, Kind::Image],
        false => &[Kind::Image],
    })?;
    let sheet = sheet(job, args)?;
    let (grid, layers) = args.land.read(job)?;
    let names: Vec<&str> = layers.iter().map(|layer| &*layer.name).collect();
    job.warn(unused(&sheet, &names));
    let size = args.size.unwrap_or(match args.view {
        ViewKind::Perspective => [1600, 1000],
        ViewKind::Plan => [grid.columns, grid.rows].map(|n| n.min(1 << 14) as u32),
    });
    let pixels = size.map(u128::from).iter().product::<u128>();
    let bytes = match from_above {
        true => BYTES_FROM_ABOVE,
        false => BYTES_PER_PIXEL,
    };
    job.expect_room("the picture", pixels * bytes)?;
    match from_above {
        true => plan_of(job, args, &grid, layers, size),
        false => picture_of(job, args, &grid, &layers, size, &sheet),
    }
}

/// The style sheet, which is empty where none is given.
fn sheet(job: &mut Job, args: &Args) -> Result<Sheet> {
    let Some(word) = &args.style else {
        return Ok(Sheet::default());
    };
    job.read_beside(|memory| {
        let source = Source::open(word, memory)?;
        let (sheet, input) = io::read_style(&source)?;
        Ok((sheet, vec![input], Vec::new()))
    })
}

fn unused(sheet: &Sheet, layers: &[&str]) -> Vec<Warning> {
    let unused = sheet.unused(layers);
    if unused.is_empty() {
        return Vec::new();
    }
    let (count, first) = (unused.len() as u64, unused[0]);
    let message = format!("layers of the style sheet are not drawn here, {first} among them");
    vec![Warning::new("unused-styles", message, count, None)]
}

/// Masks and numbers of features from straight above.
fn plan_of(
    job: &mut Job,
    args: &Args,
    grid: &Grid,
    layers: Vec<Layer>,
    size: [u32; 2],
) -> Result<Found<Asked, Stats>> {
    let [width, height] = size.map(|n| n as usize);
    let frame = Frame::of(grid, 1).resized(width, height)?;
    let counts: Vec<(String, usize)> = layers
        .iter()
        .map(|layer| (layer.name.clone(), layer.features.len()))
        .collect();
    let features: Vec<Feature> = layers.into_iter().flat_map(|l| l.features).collect();
    let rule = plan::Params {
        all_touched: args.all_touched,
    };
    let (ids, stats) = plan::ids(&features, &frame, &rule, job.progress())?;
    warn_of(job, stats.empty, stats.outside);
    write_ids(job, args.show, &ids, size, Some((&frame.transform, grid)))?;
    let layers = shown(&counts, &ids);
    let summary = format!("{} of {} pixels show a feature", stats.pixels, ids.len());
    let accuracy = Accuracy {
        measure: overlay::TRADE.error.name.to_owned(),
        unit: overlay::TRADE.error.unit.to_owned(),
        bound: Some(0.0),
        reached: None,
        reference: "the rules by which GDAL sets pixels, of which this is one".to_owned(),
        verified: false,
    };
    let modelled = Modelled::new(
        "pixels with a feature",
        stats.pixels,
        ids.len() as u64,
        4 * ids.len() as u64,
    );
    let found = Stats {
        layers,
        drawn: None,
        plan: Some(stats),
        wrong: None,
    };
    let asked = asked(args, None, size);
    Ok(Found::new(asked, found, summary)
        .accuracy(Measures::One(accuracy))
        .modelled(modelled)
        .check("max-error", args.max_error.max_error))
}

/// A picture by a camera, or from straight above.
fn picture_of(
    job: &mut Job,
    args: &Args,
    grid: &Grid,
    layers: &[Layer],
    size: [u32; 2],
    sheet: &Sheet,
) -> Result<Found<Asked, Stats>> {
    let surface = args.land.surface_of(grid)?;
    job.progress().stage("pyramid", 0);
    let pyramid = Pyramid::new(&surface);
    let scene = Scene {
        surface: &surface,
        pyramid: &pyramid,
    };
    let symbols = Symbols::of(layers, sheet);
    let pixels = Size {
        width: size[0] as usize,
        height: size[1] as usize,
    };
    let view = (args.view == ViewKind::Perspective)
        .then(|| view_of(args).unwrap_or_else(|| from_the_south(grid, &surface)));
    let camera = match view {
        Some(view) => {
            above_ground(&view, &surface)?;
            Camera::look_at(view.eye, view.target, view.up, view.fov_deg.to_radians())
        }
        None => straight_above(grid, pixels),
    };
    let [low, high] = surface.range();
    let light = Painted {
        ground: sheet.ground(),
        relief: high - low,
    };
    let params = params(args);
    let drawn = symbols.drawn();
    let (overlay, stats) = overlay::overlay(
        &scene,
        &drawn,
        &camera,
        pixels,
        &light,
        &params,
        job.progress(),
    )?;
    let wrong = args.verify.verify.then(|| {
        job.progress().stage("check", 0);
        overlay_error(&surface, &drawn, &camera, pixels, &overlay)
    });
    warn_of(job, symbols.empty(), 0);
    let ids = symbols.features_of(&overlay.ids);
    write_picture(job, args, &overlay, &ids, size, grid)?;
    let counts: Vec<(String, usize)> = layers
        .iter()
        .map(|layer| (layer.name.clone(), layer.features.len()))
        .collect();
    let covered = ids.iter().filter(|id| **id != 0).count();
    let summary = format!(
        "{covered} of {} pixels show a feature{}",
        ids.len(),
        wrong.map_or(String::new(), |w| format!(", {} the wrong one", w.wrong))
    );
    let accuracy = Accuracy {
        measure: overlay::TRADE.error.name.to_owned(),
        unit: overlay::TRADE.error.unit.to_owned(),
        bound: None,
        reached: wrong.map(|w| w.wrong as f64 / w.covered.max(1) as f64),
        reference: overlay::TRADE.reference.to_owned(),
        verified: wrong.is_some(),
    };
    let modelled = modelled(&stats, &params);
    let found = Stats {
        layers: shown(&counts, &ids),
        drawn: Some(stats),
        plan: None,
        wrong,
    };
    let asked = asked(args, view, size);
    Ok(Found::new(asked, found, summary)
        .accuracy(Measures::One(accuracy))
        .modelled(modelled)
        .check("max-error", args.max_error.max_error))
}

fn asked(args: &Args, camera: Option<View>, size: [u32; 2]) -> Asked {
    let is_drawn = args.view == ViewKind::Perspective || args.show == Show::Map;
    Asked {
        surface: args.land.surface(),
        view: args.view,
        show: args.show,
        camera,
        size,
        style: args.style.clone(),
        method: is_drawn.then_some(args.method),
        samples: if is_drawn { args.samples } else { 1 },
        all_touched: args.all_touched,
    }
}

/// How much of all that pixels and features could be asked was asked.
fn modelled(stats: &overlay::Stats, params: &Params) -> Modelled {
    let samples = stats.pixels * u64::from(params.samples);
    match params.method {
        Method::Distance | Method::Texture(_) => Modelled::new(
            "places looked up",
            stats.terrain_samples,
            samples,
            stats.lookup_bytes,
        ),
        _ => Modelled::new(
            "fragments of polyhedra",
            stats.fragments,
            samples * stats.features,
            4 * samples,
        ),
    }
}

fn warn_of(job: &mut Job, empty: u64, outside: u64) {
    let mut all = Vec::new();
    if empty > 0 {
        let message = "features have no usable shape";
        all.push(Warning::new("empty-features", message, empty, None));
    }
    if outside > 0 {
        let message = "features lie wholly outside the terrain";
        all.push(Warning::new("outside", message, outside, None));
    }
    job.warn(all);
}

/// Pixels of each layer.
fn shown(layers: &[(String, usize)], ids: &[u32]) -> Vec<Shown> {
    let mut ends = Vec::with_capacity(layers.len());
    let mut last = 0;
    for (_, count) in layers {
        last += *count as u32;
        ends.push(last);
    }
    let mut pixels = vec![0; layers.len()];
    for id in ids.iter().filter(|id| **id != 0) {
        pixels[ends.partition_point(|end| end < id)] += 1;
    }
    let layers = layers.iter().zip(pixels);
    layers
        .map(|((name, features), pixels)| Shown {
            name: name.clone(),
            features: *features as u64,
            pixels,
        })
        .collect()
}

/// A camera in the south that has all of the land in view, not from as steep as a map.
fn from_the_south(grid: &Grid, surface: &Surface) -> View {
    let [low, high] = grid.extent();
    let [bottom, top] = surface.range();
    let centre = [0, 1].map(|a| 0.5 * low[a] + 0.5 * high[a]);
    let half = 0.5 * (high[0] - low[0]).hypot(high[1] - low[1]);
    let target = [centre[0], centre[1], bottom + 0.5 * (top - bottom)];
    let fov_deg = 30.0f64;
    let distance = half / (0.5 * fov_deg).to_radians().tan() * 0.64 + (top - bottom);
    let (sin, cos) = 38.0f64.to_radians().sin_cos();
    View {
        eye: [
            target[0],
            target[1] - distance * cos,
            target[2] + distance * sin,
        ],
        target,
        up: [0.0, 0.0, 1.0],
        fov_deg,
    }
}

/// The camera of a map: all of the terrain, north up.
fn straight_above(grid: &Grid, size: Size) -> Camera {
    let [low, high] = grid.extent();
    let [width, height] = [high[0] - low[0], high[1] - low[1]];
    let unit = width.max(height);
    Camera {
        target: [
            0.5 * low[0] + 0.5 * high[0],
            0.5 * low[1] + 0.5 * high[1],
            0.0,
        ],
        unit,
        axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        distance: 8.0,
        lens: Lens::Orthographic {
            height: height.max(width / size.aspect()) / unit,
        },
    }
}

/// Errs where the viewer stands in the ground.
fn above_ground(view: &View, surface: &Surface) -> Result<()> {
    let [x, y, z] = view.eye;
    match surface.height([x, y]) {
        Some(height) if height > z => {
            let numbers = [view.eye, view.target, view.up].concat();
            let mut words: Vec<String> = numbers.iter().map(|v| format!("{v}")).collect();
            words.push(format!("{}", view.fov_deg));
            let problem =
                format!("the eye is at a height of {z}, and the ground there at {height}");
            Err(Error::parameter("camera", words.join(","), problem))
        }
        _ => Ok(()),
    }
}

fn write_picture(
    job: &mut Job,
    args: &Args,
    overlay: &Overlay,
    ids: &[u32],
    size: [u32; 2],
    grid: &Grid,
) -> Result<()> {
    if args.show != Show::Map {
        return write_ids(job, args.show, ids, size, None);
    }
    let place = (args.view == ViewKind::Plan).then(|| {
        let [width, height] = size.map(|n| n as usize);
        Frame::of(grid, 1).resized(width, height)
    });
    let place = place.transpose()?.map(|frame| frame.transform);
    job.write_map(&Image::from_light(&overlay.raster), place.as_ref())
}

/// Writes a mask, or numbers of features, as a raster on the map or as a picture.
fn write_ids(
    job: &mut Job,
    show: Show,
    ids: &[u32],
    size: [u32; 2],
    place: Option<(&Transform, &Grid)>,
) -> Result<()> {
    let [columns, rows] = size.map(|n| n as usize);
    let largest = ids.iter().copied().max().unwrap_or(0);
    let mask = || ids.iter().map(|id| if *id > 0 { 255 } else { 0 }).collect();
    let short = || ids.iter().map(|id| *id as u16).collect::<Vec<u16>>();
    match (job.output_format_for(Kind::Image), place) {
        (Some(Format::GeoTiff), Some((transform, grid))) => {
            let (bytes, words): (Vec<u8>, Vec<u16>);
            let cells = match show {
                Show::Ids if largest > u32::from(u16::MAX) => Cells::U32(ids),
                Show::Ids => {
                    words = short();
                    Cells::U16(&words)
                }
                _ => {
                    bytes = mask();
                    Cells::U8(&bytes)
                }
            };
            let raster = geotiff::Raster {
                columns,
                rows,
                transform: *transform,
                cells,
                nodata: None,
                crs: grid.crs.as_ref(),
            };
            job.write_raster(&raster)
        }
        (Some(_), place) => {
            if show == Show::Ids && largest > u32::from(u16::MAX) {
                let problem = format!("{largest} features do not fit into 16 bits: write GeoTIFF");
                return Err(job.wrong_output(problem));
            }
            let image = Image {
                width: columns,
                height: rows,
                channels: 1,
                samples: match show {
                    Show::Ids => Samples::Sixteen(short()),
                    _ => Samples::Eight(mask()),
                },
            };
            job.write_map(&image, place.map(|(transform, _)| transform))
        }
        (None, _) => Ok(()),
    }
}
