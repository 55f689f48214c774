//! Vectors on terrain, exact in every pixel of a picture.
//!
//! The paper's method extrudes features to closed polyhedra through the terrain and counts their faces in
//! front of what a pixel shows, in a stencil (Schneider and Klein 2007, "Efficient and accurate rendering of
//! vector data on virtual landscapes"). The other one looks each pixel's place up on the map. Both are exact;
//! a texture, the comparator, is not.

pub mod extrude;
pub mod params;
pub mod shape;
pub mod stencil;
pub mod trade;

pub use params::{Cap, Caps, Join, Method, NearRule, Params, Style, Unit};
pub use trade::TRADE;

use super::pyramid::Pyramid;
use super::surface::Surface;
use super::view::{Scene, Seen, look};
use crate::camera::{Camera, Size};
use crate::error::Result;
use crate::image::colour::{Linear, to_linear};
use crate::image::raster::Raster;
use crate::numeric::vector::Vec3;
use crate::progress::Progress;
use crate::vector::index::{Area, Index};
use crate::vector::rings::Dropped;
use crate::vector::{Shape, Vec2};
use extrude::{Polyhedron, heights_under, margin};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::atomic::{AtomicU64, Ordering};
use stencil::{Band, Count, Projected, key, project};

/// A feature and how it is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Drawn<'a> {
    /// Where it is.
    pub shape: &'a Shape,
    /// How it is drawn.
    pub style: Style,
}

/// A picture.
#[derive(Debug, Clone)]
pub struct Overlay {
    /// Light.
    pub raster: Raster,
    /// The number of the last feature on each pixel, from 1, at its first sample; 0 for none.
    pub ids: Vec<u32>,
    /// What each pixel shows, at its first sample.
    pub seen: Vec<Seen>,
}

/// What was drawn.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Stats {
    /// Features given.
    pub features: u64,
    /// Those without a shape, or without a usable one.
    pub empty: u64,
    /// Parts left out of shapes.
    pub dropped: Dropped,
    /// Pixels of the picture.
    pub pixels: u64,
    /// Samples that show terrain.
    pub terrain_samples: u64,
    /// Samples with a feature.
    pub covered_samples: u64,
    /// Samples of each feature, whether or not a later one lies on it; with a texture, of the last one.
    pub feature_samples: Vec<u64>,
    /// Triangles of all polyhedra.
    pub polyhedron_triangles: u64,
    /// Polyhedra counted with z-pass.
    pub zpass: u64,
    /// Polyhedra counted with z-fail.
    pub zfail: u64,
    /// Samples of faces that were counted.
    pub fragments: u64,
    /// Largest size of a counter.
    pub stencil_max: u32,
    /// Samples whose count an 8-bit counter takes for 0.
    pub stencil_lost: u64,
    /// Counters that were not 0 when all was done: always 0.
    pub stencil_left: u64,
    /// Nodes of the pyramid looked at for caps.
    pub nodes_visited: u64,
    /// Nodes of the pyramid.
    pub nodes: u64,
    /// Bytes of the index or of the texture.
    pub lookup_bytes: u64,
}

/// The light of the ground at a visible place, and of the sky at a pixel.
pub trait Light: Sync {
    /// Of the ground.
    fn ground(&self, surface: &Surface, seen: &Seen) -> Linear;

    /// Of the sky, from 0 at the top of the picture to 1 at its bottom.
    fn sky(&self, height: f64) -> Linear;
}

/// Features and a camera brought to coordinates around the terrain's first height.
///
/// Local places are steps on the map from the centre of the first cell, local heights are above the surface's
/// lowest: neither has the size of the map's coordinates.
pub struct Stage<'a> {
    surface: &'a Surface<'a>,
    pyramid: &'a Pyramid,
    camera: Camera,
    size: Size,
    origin: Vec2,
    /// Areas on the map in local coordinates.
    pub areas: Vec<Area>,
    dropped: Dropped,
}

impl<'a> Stage<'a> {
    /// Features with their widths. Errs where a style is out of range. Cost: linear in the vertices.
    pub fn new(
        scene: &Scene<'a>,
        features: &[Drawn],
        camera: &Camera,
        size: Size,
    ) -> Result<Stage<'a>> {
        let surface = scene.surface;
        let origin = surface.from_lattice([0.0, 0.0]);
        let mut target = camera.target;
        target[0] -= origin[0];
        target[1] -= origin[1];
        target[2] -= surface.base();
        let mut stage = Stage {
            surface,
            pyramid: scene.pyramid,
            camera: Camera { target, ..*camera },
            size,
            origin,
            areas: Vec::new(),
            dropped: Dropped::default(),
        };
        for drawn in features {
            drawn.style.check()?;
        }
        let made: Vec<(Area, Dropped)> = features.par_iter().map(|d| stage.area(d)).collect();
        for (area, dropped) in made {
            stage.areas.push(area);
            stage.dropped = stage.dropped.plus(dropped);
        }
        Ok(stage)
    }

    fn area(&self, drawn: &Drawn) -> (Area, Dropped) {
        let mut dropped = Dropped::default();
        let local = |p: Vec2| [p[0] - self.origin[0], p[1] - self.origin[1]];
        let half = |p: Vec2| match drawn.style.unit {
            Unit::Map => 0.5 * drawn.style.width,
            Unit::Pixels => 0.5 * drawn.style.width * self.pixel(p),
        };
        let area = shape::area(drawn.shape, &drawn.style, local, half, &mut dropped);
        (area, dropped)
    }

    /// Length of a pixel on the map at a local place of the surface.
    fn pixel(&self, p: Vec2) -> f64 {
        let z = self.surface.local_height(self.to_lattice(p)).unwrap_or(0.0);
        let view = self.camera.to_view([p[0], p[1], z]);
        let least = self.camera.near().unwrap_or(0.0);
        let depth = (self.camera.distance - view[2]).max(least);
        self.camera.unit / self.camera.magnification(self.size, depth)
    }

    fn to_lattice(&self, p: Vec2) -> Vec2 {
        self.surface.to_lattice_step(p)
    }

    /// The local place of a place on the lattice.
    #[inline]
    pub fn place(&self, at: Vec2) -> Vec2 {
        let [across, down] = self.surface.steps();
        [0, 1].map(|k| at[0] * across[k] + at[1] * down[k])
    }

    /// The local point that is seen.
    fn point(&self, seen: &Seen) -> Vec3 {
        let [x, y] = self.place(seen.at);
        [x, y, seen.z]
    }

    /// The polyhedra of an area, and the nodes visited for their caps: one for a polygon, one for each segment,
    /// join and disc of a line.
    pub fn polyhedra(&self, area: &Area, is_polygon: bool, caps: Caps) -> (Vec<Polyhedron>, u64) {
        let mut rings = area.rings.clone();
        rings.extend(area.discs.iter().map(|disc| self.disc(*disc)));
        let groups: Vec<Vec<Vec<Vec2>>> = if is_polygon {
            vec![rings]
        } else {
            rings.into_iter().map(|ring| vec![ring]).collect()
        };
        let whole = self.pyramid.whole();
        let mut visited = 0;
        let mut out = Vec::with_capacity(groups.len());
        for rings in groups {
            let span = match caps {
                Caps::Global => whole,
                Caps::Tight => {
                    let found = heights_under(&rings, self.pyramid, |p| self.to_lattice(p));
                    visited += found.visited;
                    found.span
                }
            };
            if !rings.is_empty() && !span.is_empty() {
                let around = margin(self.surface);
                let caps = [f64::from(span.low) - around, f64::from(span.high) + around];
                out.push(Polyhedron { rings, caps });
            }
        }
        (out, visited)
    }

    /// A disc as a polygon that is nowhere a quarter of a pixel inside of it, with 8 to 64 corners.
    fn disc(&self, (centre, radius): (Vec2, f64)) -> Vec<Vec2> {
        let pixels = radius / self.pixel(centre);
        let half_angle = (1.0 - 0.25 / pixels.max(0.3)).clamp(-1.0, 1.0).acos();
        let corners = (std::f64::consts::PI / half_angle).ceil().clamp(8.0, 64.0);
        (0..corners as usize)
            .map(|k| {
                let angle = std::f64::consts::TAU * (k as f64 + 0.5) / corners;
                [
                    centre[0] + radius * angle.cos(),
                    centre[1] + radius * angle.sin(),
                ]
            })
            .collect()
    }

    /// Whether a polyhedron is to be counted with z-fail.
    fn is_near(&self, polyhedron: &Polyhedron, rule: NearRule) -> bool {
        let Some(near) = self.camera.near() else {
            return false;
        };
        let corner = self.camera.from_screen(0.0, 0.0, near, self.size);
        let eye = [0.0, 0.0, self.camera.distance];
        let reach = match rule {
            NearRule::GrownBox => {
                let d = crate::numeric::vector::sub(corner, eye);
                crate::numeric::vector::length(d) * self.camera.unit
            }
            NearRule::Box => 0.0,
        };
        polyhedron.bounds().distance_squared(self.camera.eye()) <= reach * reach
    }
}

/// What one sample of every pixel shows.
struct Sample {
    seen: Vec<Seen>,
    light: Vec<Linear>,
    ids: Vec<u32>,
}

/// A picture of the terrain with the features on it, in order, each on those before.
///
/// The camera and the features are in the map's coordinates, heights in its unit. Errs where a parameter or a
/// style is out of range. Cost: a ray for each sample, and a look-up or the fragments of the polyhedra.
pub fn overlay(
    scene: &Scene,
    features: &[Drawn],
    camera: &Camera,
    size: Size,
    light: &dyn Light,
    params: &Params,
    progress: &dyn Progress,
) -> Result<(Overlay, Stats)> {
    params.check()?;
    progress.stage("extrude", 0);
    let stage = Stage::new(scene, features, camera, size)?;
    let mut stats = Stats {
        features: features.len() as u64,
        empty: stage.areas.iter().filter(|area| area.is_empty()).count() as u64,
        dropped: stage.dropped,
        pixels: (size.width * size.height) as u64,
        nodes: scene.pyramid.nodes(),
        ..Stats::default()
    };
    let work = Work::new(&stage, features, params, &mut stats);
    let mut total = vec![[0.0f32; 3]; size.width * size.height];
    let mut first = None;
    for k in 0..params.samples {
        let offset = offset(k, params.samples);
        let seen = look(scene, camera, size, offset, progress);
        progress.stage("mask", size.height as u64);
        let sample = work.sample(&stage, features, light, params, offset, seen, &mut stats);
        for (sum, light) in total.iter_mut().zip(&sample.light) {
            for c in 0..3 {
                sum[c] += light[c];
            }
        }
        first.get_or_insert(sample);
    }
    let share = 1.0 / params.samples as f32;
    total
        .iter_mut()
        .for_each(|sum| *sum = sum.map(|c| c * share));
    let (ids, seen) = first.map_or_else(Default::default, |s| (s.ids, s.seen));
    let raster = Raster::from_pixels(size.width, total);
    Ok((Overlay { raster, ids, seen }, stats))
}

/// Where a sample is, from the pixel's centre: a lattice turned so that no two share a row or a column.
fn offset(k: u32, samples: u32) -> Vec2 {
    if samples == 1 {
        return [0.0; 2];
    }
    let n = f64::from(samples);
    // Steps of the golden ratio (Korobov 1959) spread any number of rows over the columns.
    let across = (f64::from(k) * 0.618_033_988_749_895 + 0.5 / n).fract();
    [across - 0.5, (f64::from(k) + 0.5) / n - 0.5]
}

/// What a method asks for each pixel.
enum Work {
    Index(Index),
    Texture {
        texels: Vec<u32>,
        columns: usize,
        rows: usize,
    },
    Stencil(Vec<Vec<(Polyhedron, Count)>>),
}

impl Work {
    fn new(stage: &Stage, features: &[Drawn], params: &Params, stats: &mut Stats) -> Work {
        let work = match params.method {
            Method::Distance => Work::Index(Index::build(&stage.areas)),
            Method::Texture(columns) => texture(stage, columns as usize),
            _ => Work::stencil(stage, features, params, stats),
        };
        stats.lookup_bytes = match &work {
            Work::Index(index) => index.bytes() as u64,
            Work::Texture { texels, .. } => size_of_val(&texels[..]) as u64,
            Work::Stencil(_) => 0,
        };
        work
    }

    fn stencil(stage: &Stage, features: &[Drawn], params: &Params, stats: &mut Stats) -> Work {
        let made: Vec<(Vec<(Polyhedron, Count)>, u64)> = stage
            .areas
            .par_iter()
            .zip(features)
            .map(|(area, drawn)| {
                let is_polygon = matches!(drawn.shape, Shape::Polygons(_));
                let (all, visited) = stage.polyhedra(area, is_polygon, params.caps);
                let counted = all.into_iter().map(|polyhedron| {
                    let count = match params.method {
                        Method::StencilZpass => Count::Pass,
                        Method::StencilZfail => Count::Fail,
                        _ if stage.is_near(&polyhedron, params.near_rule) => Count::Fail,
                        _ => Count::Pass,
                    };
                    (polyhedron, count)
                });
                (counted.collect(), visited)
            })
            .collect();
        for (polyhedra, visited) in &made {
            stats.nodes_visited += visited;
            for (polyhedron, count) in polyhedra {
                stats.polyhedron_triangles += polyhedron.triangles();
                stats.zpass += u64::from(*count == Count::Pass);
                stats.zfail += u64::from(*count == Count::Fail);
            }
        }
        Work::Stencil(made.into_iter().map(|(polyhedra, _)| polyhedra).collect())
    }

    #[allow(clippy::too_many_arguments)]
    fn sample(
        &self,
        stage: &Stage,
        features: &[Drawn],
        light: &dyn Light,
        params: &Params,
        offset: Vec2,
        seen: Vec<Seen>,
        stats: &mut Stats,
    ) -> Sample {
        let size = stage.size;
        let width = size.width.max(1);
        let mut pixels = vec![([0.0f32; 3], 0u32); seen.len()];
        let projected: Vec<Vec<Projected>> = match self {
            Work::Stencil(all) => all
                .par_iter()
                .map(|feature| {
                    let shifted = |p: &(Polyhedron, Count)| {
                        let mut projected = project(&p.0, &stage.camera, size, p.1);
                        projected.shift(offset, size);
                        projected
                    };
                    feature.iter().map(shifted).collect()
                })
                .collect(),
            _ => Vec::new(),
        };
        let counts: Vec<AtomicU64> = features.iter().map(|_| AtomicU64::new(0)).collect();
        let styles: Vec<(Linear, f32)> = features
            .iter()
            .map(|d| (to_linear(d.style.colour), d.style.opacity as f32))
            .collect();
        let draw = |pixel: &mut (Linear, u32), feature: usize| {
            let (colour, opacity) = styles[feature];
            for c in 0..3 {
                pixel.0[c] += (colour[c] - pixel.0[c]) * opacity;
            }
            pixel.1 = feature as u32 + 1;
            counts[feature].fetch_add(1, Ordering::Relaxed);
        };
        let bands: Vec<Counts> = pixels
            .par_chunks_mut(width * BAND)
            .enumerate()
            .map(|(band, pixels)| {
                let first = band * BAND;
                let seen = &seen[first * width..first * width + pixels.len()];
                for (k, (pixel, seen)) in pixels.iter_mut().zip(seen).enumerate() {
                    pixel.0 = if seen.is_sky() {
                        light.sky((first + k / width) as f64 / size.height as f64)
                    } else {
                        light.ground(stage.surface, seen)
                    };
                }
                match self {
                    Work::Stencil(_) => {
                        let rows = first..first + pixels.len() / width;
                        stencil_band(stage, &projected, features, params, rows, seen, |at, f| {
                            draw(&mut pixels[at], f)
                        })
                    }
                    _ => {
                        for (pixel, seen) in pixels.iter_mut().zip(seen) {
                            if !seen.is_sky() {
                                self.look_up(stage, seen, |feature| draw(pixel, feature));
                            }
                        }
                        Counts::default()
                    }
                }
            })
            .collect();
        for band in bands {
            stats.fragments += band.fragments;
            stats.stencil_max = stats.stencil_max.max(band.largest);
            stats.stencil_lost += band.lost;
            stats.stencil_left += band.left;
        }
        stats.terrain_samples += seen.iter().filter(|seen| !seen.is_sky()).count() as u64;
        stats.covered_samples += pixels.iter().filter(|pixel| pixel.1 != 0).count() as u64;
        stats.feature_samples.resize(features.len(), 0);
        for (sum, count) in stats.feature_samples.iter_mut().zip(counts) {
            *sum += count.into_inner();
        }
        let (light, ids) = pixels.into_iter().unzip();
        Sample { seen, light, ids }
    }

    fn look_up(&self, stage: &Stage, seen: &Seen, mut draw: impl FnMut(usize)) {
        match self {
            Work::Index(index) => index.visit(stage.place(seen.at), draw),
            Work::Texture {
                texels,
                columns,
                rows,
            } => {
                let squares = stage.surface.squares();
                let at = |a: usize, count: usize| {
                    let share = seen.at[a] / squares[a] as f64;
                    ((share * count as f64) as usize).min(count - 1)
                };
                let texel = texels[at(1, *rows) * columns + at(0, *columns)];
                if texel > 0 {
                    draw(texel as usize - 1);
                }
            }
            Work::Stencil(_) => {}
        }
    }
}

/// Rows of a picture that are drawn together.
const BAND: usize = 16;

#[derive(Default)]
struct Counts {
    fragments: u64,
    largest: u32,
    lost: u64,
    left: u64,
}

/// Counts and draws all features on some rows.
fn stencil_band(
    stage: &Stage,
    projected: &[Vec<Projected>],
    features: &[Drawn],
    params: &Params,
    rows: std::ops::Range<usize>,
    seen: &[Seen],
    mut draw: impl FnMut(usize, usize),
) -> Counts {
    let width = stage.size.width;
    let depth = |seen: &Seen| stage.camera.distance - stage.camera.to_view(stage.point(seen))[2];
    let keys: Vec<f64> = seen
        .iter()
        .map(|seen| match seen.is_sky() {
            true => f64::INFINITY,
            false => key(&stage.camera, depth(seen)),
        })
        .collect();
    let mut counters = vec![0; seen.len()];
    let mut counts = Counts::default();
    for (feature, all) in projected.iter().enumerate() {
        let mut touched: Option<[std::ops::Range<usize>; 2]> = None;
        let mut band = Band {
            width,
            rows: rows.clone(),
            keys: &keys,
            counters: &mut counters,
            fragments: 0,
        };
        for polyhedron in all {
            band.count(polyhedron);
            let (r, c) = (&polyhedron.rows, &polyhedron.columns);
            if r.start < rows.end && rows.start < r.end {
                let with = |all: &std::ops::Range<usize>, own: &std::ops::Range<usize>| {
                    all.start.min(own.start)..all.end.max(own.end)
                };
                touched = Some(match touched {
                    Some([rows, columns]) => [with(&rows, r), with(&columns, c)],
                    None => [r.clone(), c.clone()],
                });
            }
        }
        counts.fragments += band.fragments;
        // Only its own box is read, and set to zero again.
        let fill = match features[feature].shape {
            Shape::Polygons(_) => features[feature].style.fill,
            _ => crate::vector::rings::Fill::NonZero,
        };
        let Some([touched_rows, columns]) = touched else {
            continue;
        };
        for row in touched_rows.start.max(rows.start)..touched_rows.end.min(rows.end) {
            for column in columns.clone() {
                let at = (row - rows.start) * width + column;
                let count = std::mem::take(&mut counters[at]);
                if count == 0 {
                    continue;
                }
                counts.largest = counts.largest.max(count.unsigned_abs());
                let kept = if params.stencil_bits == 8 {
                    count & 0xff
                } else {
                    count
                };
                counts.lost += u64::from(kept == 0);
                if fill.covers(kept) && !seen[at].is_sky() {
                    draw(at, feature);
                }
            }
        }
    }
    counts.left = counters.iter().filter(|count| **count != 0).count() as u64;
    counts
}

/// The last feature at the centre of each texel over the whole terrain.
fn texture(stage: &Stage, columns: usize) -> Work {
    let squares = stage.surface.squares();
    let sides = stage.surface.steps().map(|s| s[0].hypot(s[1]));
    let aspect = (squares[1] as f64 * sides[1]) / (squares[0] as f64 * sides[0]);
    let rows = ((columns as f64 * aspect).round() as usize).max(1);
    let index = Index::build(&stage.areas);
    let mut texels = vec![0u32; columns * rows];
    texels
        .par_chunks_mut(columns)
        .enumerate()
        .for_each(|(row, texels)| {
            for (column, texel) in texels.iter_mut().enumerate() {
                let at = [
                    (column as f64 + 0.5) / columns as f64 * squares[0] as f64,
                    (row as f64 + 0.5) / rows as f64 * squares[1] as f64,
                ];
                *texel = index
                    .topmost(stage.place(at))
                    .map_or(0, |feature| feature as u32 + 1);
            }
        });
    Work::Texture {
        texels,
        columns,
        rows,
    }
}
