//! From a clip to a stream of the size or the error that is asked for.

use super::coder::Writer;
use super::container::{self, Kind, push_number};
use super::corrections;
use super::hierarchy::Hierarchy;
use super::params::{Clusters, Method, Params, Target};
use super::search::{self, Trial};
use super::spectrum::Trajectories;
use super::stream::{Header, Motion, edges};
use super::trajectory::{self, Analysis};
use super::{delta, faces};
use crate::anim::Clip;
use crate::error::{Error, Result};
use crate::mesh::{Mesh, Polygons};
use crate::numeric::vector::Vec3;
use crate::progress::Progress;
use schemars::JsonSchema;
use serde::Serialize;

/// Frames by which `auto` judges the method that tells one frame after the other.
const SAMPLE: usize = 12;

/// Share of the whole below which an error that is what sums leave of one another is measured instead.
const ROUNDED: f64 = 1e-9;

/// What a stream became.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Stats {
    /// How the motion is told.
    pub method: String,
    /// Windows of frames that are told together.
    pub windows: u64,
    /// Components of each window, or of each cluster; empty where the method has none.
    pub components: Vec<u64>,
    /// Clusters of each window; empty where the method has none.
    pub clusters: Vec<u64>,
    /// The step that numbers are rounded to, in the unit of the coordinates; 0 where each has its own.
    pub step: f64,
    /// Vertices of frames that are moved to keep within `--target-max`.
    pub corrected: u64,
    /// Bits by what they tell.
    pub bits: Bits,
    /// Numbers that are told: of the mean shape or the first frame, of components, of corrections.
    pub numbers: u64,
    /// Streams that were made on the way to the target.
    pub trials: u64,
    /// The squared error that the encoder expects of a decoder: the sum over all vertices and frames.
    pub predicted_squared_error: f64,
}

/// Bits of a stream by what they tell.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Bits {
    /// The faces.
    pub faces: f64,
    /// The mean shape, or the first frame.
    pub shape: f64,
    /// Which cluster each vertex is in.
    pub labels: f64,
    /// The points that carry frames of reference.
    pub seeds: f64,
    /// How components move over time.
    pub basis: f64,
    /// How strong each component is at each vertex, or what changes from frame to frame.
    pub weights: f64,
    /// What keeps vertices within a bound.
    pub corrections: f64,
    /// The header, checksums, lengths and the ends of sections.
    pub framing: f64,
    /// All of it.
    pub total: f64,
}

impl Bits {
    /// Those that tell something: all but the framing.
    pub fn told(&self) -> f64 {
        let Bits {
            faces,
            shape,
            labels,
            seeds,
            basis,
            weights,
            corrections,
            ..
        } = self;
        faces + shape + labels + seeds + basis + weights + corrections
    }

    /// All of them times a factor.
    pub fn scaled(self, factor: f64) -> Bits {
        Bits {
            faces: self.faces * factor,
            shape: self.shape * factor,
            labels: self.labels * factor,
            seeds: self.seeds * factor,
            basis: self.basis * factor,
            weights: self.weights * factor,
            corrections: self.corrections * factor,
            framing: self.framing * factor,
            total: self.total * factor,
        }
    }
}

/// A stream and what it became.
#[derive(Debug, Clone)]
pub struct Made {
    /// The stream.
    pub bytes: Vec<u8>,
    /// What it became.
    pub stats: Stats,
}

/// A window that is told.
#[derive(Debug, Clone, Default)]
pub(super) struct Told {
    pub window: Vec<u8>,
    pub parts: Vec<Vec<u8>>,
    pub corrections: Option<Vec<u8>>,
    pub squared_error: f64,
    pub bits: Bits,
    /// Components of the window, or of each of its clusters.
    pub components: Vec<usize>,
    /// Numbers that tell what moves, and the mean shape or first frame.
    pub numbers: usize,
    pub corrected: u64,
}

impl Told {
    /// Bytes of its sections, to a byte or two.
    pub fn bytes(&self) -> usize {
        let sections = self.parts.iter().chain(&self.corrections);
        let sections = sections.map(|payload| container::whole(payload.len() + 1));
        container::whole(self.window.len() + 2) + sections.sum::<usize>()
    }
}

/// A clip that is ready to be coded, again and again.
#[derive(Debug)]
pub struct Encoder<'a> {
    pub(super) ground: &'a Ground,
    pub(super) header: Header,
    pub(super) method: Method,
    pub(super) clusters: Clusters,
    pub(super) windows: Vec<Trajectories<'a>>,
    analyses: Vec<Analysis<'a>>,
    faces: Vec<u8>,
    face_bits: f64,
    /// Sum of the squared distances to each frame's centroid, in local units; 0 where every frame is
    /// a point.
    norm: f64,
}

/// What does not change from target to target but must outlive an [`Encoder`].
#[derive(Debug)]
pub struct Ground {
    pub(super) polygons: Polygons,
    pub(super) hierarchy: Hierarchy,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Ground {
    /// The faces of a mesh, and the order of its vertices that follows from them.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        let polygons = faces_of(mesh);
        let hierarchy = Hierarchy::new(mesh.positions.len(), edges(&polygons))?;
        Ok(Ground {
            polygons,
            hierarchy,
            triangles: mesh.triangles.clone(),
        })
    }
}

/// The faces of a mesh as they stand in its file.
fn faces_of(mesh: &Mesh) -> Polygons {
    match &mesh.polygons {
        Some(polygons) => polygons.clone(),
        None => {
            let mut polygons = Polygons::default();
            mesh.triangles.iter().for_each(|t| polygons.push(t));
            polygons
        }
    }
}

/// Origin and unit of local coordinates: the middle of the box, and the power of two that is not less
/// than the farthest from it.
fn place(clip: &Clip) -> (Vec3, i32) {
    let bounds = clip.bounds();
    let origin: Vec3 = std::array::from_fn(|i| bounds.lo[i] + (bounds.hi[i] - bounds.lo[i]) * 0.5);
    let reach = (0..3).map(|i| (bounds.hi[i] - origin[i]).max(origin[i] - bounds.lo[i]));
    let reach = reach.fold(0.0, f64::max);
    let mut exponent = 0;
    if reach > 0.0 {
        exponent = reach.log2().ceil().clamp(-1000.0, 1000.0) as i32;
    }
    (origin, exponent)
}

impl<'a> Encoder<'a> {
    /// Looks at a clip; `ground` is that of its mesh.
    ///
    /// Errs with [`Error::Parameter`] where `params` are out of range. Cost: that of the principal
    /// directions of each window.
    pub fn new(
        clip: &'a Clip,
        ground: &'a Ground,
        params: &Params,
        progress: &dyn Progress,
    ) -> Result<Self> {
        params.check()?;
        let (origin, exponent) = place(clip);
        let header = Header {
            vertices: clip.vertices(),
            frames: clip.frames(),
            faces: ground.polygons.len(),
            window: params.window.min(clip.frames()).max(1),
            rate: clip.rate,
            start: clip.start,
            origin,
            exponent,
        };
        let mut writer = Writer::new();
        let given = ground.polygons.iter();
        faces::code(&mut writer, header.vertices as u32, header.faces, given)
            .map_err(Error::Geometry)?;
        let face_bits = writer.spent();
        let of = |number: usize| {
            let frames = header.frames_of(number);
            Trajectories {
                positions: &clip.positions
                    [frames.start * header.vertices..frames.end * header.vertices],
                vertices: header.vertices,
                origin,
                scale: 2f64.powi(-exponent),
            }
        };
        let windows: Vec<_> = (0..header.windows()).map(of).collect();
        progress.stage("analyse", windows.len() as u64);
        let analyses = match params.method {
            Method::Auto | Method::Trajectory => {
                let looked = windows.iter().map(|window| {
                    let analysis = Analysis::new(*window, &ground.hierarchy);
                    progress.advance(1);
                    analysis
                });
                looked.collect()
            }
            _ => Vec::new(),
        };
        let norm = windows.iter().map(|w| about_centroids(w)).sum();
        Ok(Encoder {
            ground,
            header,
            method: params.method,
            clusters: params.clusters,
            windows,
            analyses,
            faces: writer.finish(),
            face_bits,
            norm,
        })
    }
}

/// Sum of the squared distances of all vertices to the centroid of their frame.
fn about_centroids(window: &Trajectories) -> f64 {
    let count = window.vertices as f64;
    let axis = |frame: usize, axis: usize| {
        let values = || (0..window.vertices).map(|v| window.at(frame, v, axis));
        let centre = values().sum::<f64>() / count;
        values().map(|x| (x - centre) * (x - centre)).sum::<f64>()
    };
    (0..window.frames())
        .map(|frame| (0..3).map(|a| axis(frame, a)).sum::<f64>())
        .sum()
}

impl Encoder<'_> {
    /// Sum of the squared distances of all vertices to the centroids of their frames, in the unit of
    /// the coordinates: what the error of Karni and Gotsman is a share of.
    pub fn norm(&self) -> f64 {
        self.norm * self.header.unit() * self.header.unit()
    }

    /// The squared error in local units that a target allows; none where it is not about that.
    pub(super) fn squared_error(&self, target: Target) -> Option<f64> {
        let positions = (self.header.vertices * self.header.frames) as f64;
        match target {
            Target::Kg(percent) => {
                // Points have no extent that an error could be a share of: theirs is one of the way.
                let whole = if self.norm > 0.0 {
                    self.norm
                } else {
                    positions
                };
                Some(whole * (percent / 100.0) * (percent / 100.0))
            }
            Target::Rmse(x) => {
                let x = x / self.header.unit();
                Some(positions * x * x)
            }
            Target::Max(_) | Target::Bpvf(_) => None,
        }
    }

    /// Steps from the finest, whose numbers just fit, to the coarsest, of which nothing is left.
    fn steps(&self) -> [f64; 2] {
        let root = (self.header.window as f64).sqrt();
        [root * 2f64.powi(-29), root * 4.0]
    }

    /// A step to begin with.
    fn first_step(&self, squared_error: f64) -> f64 {
        let share = squared_error / self.header.frames as f64;
        let steps = self
            .analyses
            .iter()
            .map(|a| a.first_step(share * a.frames() as f64));
        let middle = steps.sum::<f64>() / self.analyses.len() as f64;
        // No step is known for the last method: a cube's numbers miss by a twelfth of its square.
        let all = (3 * self.header.vertices * self.header.frames) as f64;
        if middle.is_finite() {
            middle
        } else {
            (12.0 * squared_error / all).sqrt()
        }
    }

    /// A stream for a target.
    ///
    /// Errs with [`Error::Parameter`] where a target cannot be reached, and says what can. Cost: 3 to 6
    /// trials, each of which is one pass over all components.
    pub fn make(&self, target: Target, progress: &dyn Progress) -> Result<Made> {
        progress.stage("encode", 0);
        if self.method.space().is_some() {
            return self.make_clustered(target, progress);
        }
        let method = match self.method {
            Method::Auto if self.delta_is_shorter(target) => Method::Delta,
            Method::Auto => Method::Trajectory,
            method => method,
        };
        let trial = |step: f64| {
            let trial = self.trial(method, step, None);
            progress.advance(1);
            trial
        };
        let (best, trials) = match target {
            Target::Max(bound) => {
                let local = bound / self.header.unit();
                let all = (self.header.vertices * self.header.frames) as f64;
                let first = self.first_step(all * local * local / 12.0);
                search::least_bits(first, self.steps(), |step| {
                    let trial = self.trial(method, step, Some(local));
                    progress.advance(1);
                    trial
                })
            }
            Target::Bpvf(bits) => {
                let positions = (self.header.vertices * self.header.frames) as f64;
                let first = self.first_step(1e-6 * self.norm.max(1e-3 * positions));
                let wanted = search::Wanted::Bits(bits * positions - self.overhead());
                search::search(wanted, first, self.steps(), trial)
            }
            Target::Kg(_) | Target::Rmse(_) => {
                let error = self.squared_error(target).unwrap_or_default();
                let wanted = search::Wanted::SquaredError(error);
                search::search(wanted, self.first_step(error), self.steps(), trial)
            }
        };
        self.check_reached(target, &best)?;
        Ok(self.assemble(method, best, trials))
    }

    /// Bits that every stream of the clip takes beside those of its windows and faces.
    pub(super) fn overhead(&self) -> f64 {
        let header = container::whole(self.header.write().len());
        let faces = container::whole(self.faces.len()) as f64 - self.face_bits / 8.0;
        8.0 * ((container::begin().len() + header + container::whole(0)) as f64 + faces)
    }

    /// A squared error in local units as a target says it.
    pub(super) fn as_target(&self, target: Target, squared_error: f64) -> f64 {
        let positions = (self.header.vertices * self.header.frames) as f64;
        match target {
            Target::Kg(_) => 100.0 * (squared_error / self.norm).sqrt(),
            _ => self.header.unit() * (squared_error / positions).sqrt(),
        }
    }

    /// Errs where the best there is misses its target.
    pub(super) fn check_reached(&self, target: Target, best: &Trial<Vec<Told>>) -> Result<()> {
        let positions = (self.header.vertices * self.header.frames) as f64;
        let reached = match target {
            Target::Kg(_) | Target::Rmse(_) => self.as_target(target, best.squared_error),
            Target::Bpvf(_) => (best.bits + self.overhead()) / positions,
            Target::Max(_) => return Ok(()),
        };
        let wanted = target.value();
        if reached <= wanted || self.norm == 0.0 && matches!(target, Target::Kg(_)) {
            return Ok(());
        }
        let problem = format!("cannot be reached; the least for this clip is {reached:.6e}");
        Err(Error::parameter(target.option(), wanted, problem))
    }

    /// Whether telling one frame after the other is shorter for the same error: judged by a few frames in
    /// the middle of the first window.
    fn delta_is_shorter(&self, target: Target) -> bool {
        let window = &self.windows[0];
        let positions = (self.header.vertices * self.header.frames) as f64;
        let error = match self.squared_error(target) {
            Some(error) => error,
            None => 1e-6 * self.norm.max(1e-3 * positions),
        };
        let step = self.first_step(error);
        let whole = self.analyses[0].encode(step, trajectory::AFFINE);
        let whole_bits = whole.shape_bits + whole.basis_bits + whole.weight_bits;
        let frames = window.frames();
        let count = frames.min(SAMPLE);
        let from = (frames - count) / 2 * window.vertices;
        let sample = Trajectories {
            positions: &window.positions[from..from + count * window.vertices],
            ..*window
        };
        // As much error in each frame as the components have on the mean.
        let error = whole.squared_error / frames as f64;
        let step = (12.0 * error / (3 * window.vertices) as f64).sqrt();
        if step.is_nan() || step <= 0.0 {
            return false;
        }
        let told = delta::encode(
            &sample,
            &self.ground.hierarchy,
            step.min(self.steps()[1]),
            count,
        );
        let each = told.motion_bits / (count - 1).max(1) as f64;
        told.shape_bits + each * (frames - 1) as f64 <= 0.98 * whole_bits
    }

    /// All windows with a step, within a bound where one is given.
    fn trial(&self, method: Method, step: f64, bound: Option<f64>) -> Trial<Vec<Told>> {
        let of = |number: usize| {
            let mut told = match method {
                Method::Delta => self.by_frames(number, step),
                _ => self.by_components(number, step),
            };
            match bound {
                Some(bound) => self.correct(number, method, bound, &mut told),
                None if told.squared_error < ROUNDED * self.norm => {
                    self.correct(number, method, f64::INFINITY, &mut told);
                }
                None => {}
            }
            told
        };
        let made: Vec<Told> = (0..self.windows.len()).map(of).collect();
        let bytes: usize = made.iter().map(Told::bytes).sum();
        Trial {
            step,
            bits: 8.0 * bytes as f64,
            squared_error: made.iter().map(|told| told.squared_error).sum(),
            made,
        }
    }

    fn by_components(&self, number: usize, step: f64) -> Told {
        let made = self.analyses[number].encode(step, trajectory::AFFINE);
        Told {
            window: made.window,
            parts: made.parts,
            squared_error: made.squared_error,
            bits: Bits {
                shape: made.shape_bits,
                basis: made.basis_bits,
                weights: made.weight_bits,
                ..Bits::default()
            },
            components: vec![made.components],
            numbers: 3 * self.header.vertices
                + made.components * (self.header.vertices + 3 * self.windows[number].frames()),
            ..Told::default()
        }
    }

    fn by_frames(&self, number: usize, step: f64) -> Told {
        let window = &self.windows[number];
        let made = delta::encode(window, &self.ground.hierarchy, step, window.frames());
        Told {
            window: made.window,
            parts: made.parts,
            squared_error: made.squared_error,
            bits: Bits {
                shape: made.shape_bits,
                weights: made.motion_bits,
                ..Bits::default()
            },
            numbers: 3 * self.header.vertices * window.frames(),
            ..Told::default()
        }
    }

    /// Adds what keeps every vertex within a bound, in local units, and measures the error.
    pub(super) fn correct(&self, number: usize, method: Method, bound: f64, told: &mut Told) {
        let window = &self.windows[number];
        let motion = Motion::read(
            method,
            &self.ground.hierarchy,
            window.frames(),
            &told.window,
            &told.parts,
        );
        let motion = motion.expect("what was just written is read");
        let mut encoder = corrections::Encoder::new(window.vertices, bound);
        let mut given = vec![[0.0; 3]; window.vertices];
        told.squared_error = 0.0;
        motion.each_frame(window.vertices, 0..window.frames(), |f, frame| {
            for (v, given) in given.iter_mut().enumerate() {
                *given = std::array::from_fn(|axis| window.at(f, v, axis));
            }
            encoder.frame(frame, &given);
            let apart = frame
                .iter()
                .zip(&given)
                .map(|(p, q)| (0..3).map(|i| (p[i] - q[i]) * (p[i] - q[i])).sum::<f64>());
            told.squared_error += apart.sum::<f64>();
        });
        told.corrected = encoder.count;
        told.bits.corrections = encoder.spent();
        told.corrections = (encoder.count > 0).then(|| encoder.finish());
    }

    /// The stream of a trial: what all windows begin with first, then their parts in turn, so that a
    /// stream that is cut off keeps as much of each.
    pub(super) fn assemble(&self, method: Method, best: Trial<Vec<Told>>, trials: u64) -> Made {
        let mut bytes = container::begin();
        container::push(&mut bytes, Kind::Header, &self.header.write());
        container::push(&mut bytes, Kind::Faces, &self.faces);
        let mut section = |kind: Kind, window: usize, method: Option<Method>, payload: &[u8]| {
            let mut whole = Vec::with_capacity(payload.len() + 3);
            push_number(&mut whole, window as u64);
            whole.extend(method.map(|method| method as u8));
            whole.extend_from_slice(payload);
            container::push(&mut bytes, kind, &whole);
        };
        let windows = &best.made;
        for (number, told) in windows.iter().enumerate() {
            section(Kind::Window, number, Some(method), &told.window);
        }
        let rounds = windows
            .iter()
            .map(|told| told.parts.len())
            .max()
            .unwrap_or(0);
        for round in 0..rounds {
            for (number, told) in windows.iter().enumerate() {
                if let Some(part) = told.parts.get(round) {
                    section(Kind::Part, number, None, part);
                }
            }
        }
        for (number, told) in windows.iter().enumerate() {
            if let Some(corrections) = &told.corrections {
                section(Kind::Corrections, number, None, corrections);
            }
        }
        container::push(&mut bytes, Kind::End, &[]);
        let mut bits = Bits {
            faces: self.face_bits,
            total: 8.0 * bytes.len() as f64,
            ..Bits::default()
        };
        for told in windows {
            bits.shape += told.bits.shape;
            bits.labels += told.bits.labels;
            bits.seeds += told.bits.seeds;
            bits.basis += told.bits.basis;
            bits.weights += told.bits.weights;
            bits.corrections += told.bits.corrections;
        }
        bits.framing = bits.total - bits.told();
        let unit = self.header.unit();
        let stats = Stats {
            method: method.name().to_owned(),
            windows: windows.len() as u64,
            components: windows
                .iter()
                .flat_map(|w| &w.components)
                .map(|c| *c as u64)
                .collect(),
            clusters: windows
                .iter()
                .filter(|_| method.space().is_some())
                .map(|w| w.components.len() as u64)
                .collect(),
            step: best.step * unit,
            corrected: windows.iter().map(|told| told.corrected).sum(),
            bits,
            numbers: windows
                .iter()
                .map(|w| w.numbers as u64 + 3 * w.corrected)
                .sum(),
            trials,
            predicted_squared_error: best.squared_error * unit * unit,
        };
        Made { bytes, stats }
    }
}
