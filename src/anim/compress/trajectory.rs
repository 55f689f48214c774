//! Animation as a sum of components, each a motion over time with a weight at every vertex.
//!
//! The mean shape comes first, then component after component. A component is a direction in the
//! space of trajectories, coded as a cosine transform, and a field of weights over the mesh, coded
//! from coarse to fine vertices. Both are in units that make the same squared error everywhere, so one
//! step decides the accuracy of all; a number is rounded down where that saves more than it costs, and
//! components end where one more does not pay. How weights lie over the mesh is foreseen from the mean
//! shape and the weights before: on a rigid part all of them are affine functions of the place.
//!
//! Sources: L. Váša and V. Skala, "Coddyac: Connectivity driven dynamic mesh compression" (2007), for
//! components of trajectories; the fields, their order and their prediction are this program's.

use super::coder::{Coder, Reader, Unwritten, Writer};
use super::container::{push_number, take_f64, take_number};
use super::field::{self, Fields, Wanted};
use super::hierarchy::Hierarchy;
use super::integers::{CLASSES, Context, Integers, class_of};
use super::prediction::Weights;
use super::spectrum::{Cosines, Products, Spectrum, Trajectories, spectrum};
use crate::error::Fault;
use crate::numeric::vector::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// Squared steps that a bit outweighs: near the slope of distortion over rate, less what rounding
/// down costs in what is foreseen from it.
const PRICE: f64 = 0.08;
/// The step of a direction in terms of that of its weights.
const COARSER: f64 = 1.8;
/// How much more affine functions of the place are expected of weights than any other.
pub const AFFINE: f64 = 100.0;
/// Numbers of components after which weights are foreseen anew.
const STAGES: [usize; 5] = [1, 2, 4, 8, 16];
/// Components that do not pay before no more are tried.
const PATIENCE: usize = 4;
/// Bytes of a part, before it ends.
const PART: usize = 3000;
/// Components of a window at most.
const MOST: usize = 4096;
/// Directions that trajectories are multiplied with at a time.
const TOGETHER: usize = 16;

/// What is known of a window before a step is chosen.
#[derive(Debug)]
pub struct Analysis<'a> {
    trajectories: Trajectories<'a>,
    hierarchy: &'a Hierarchy,
    means: Vec<Vec3>,
    spectrum: Spectrum,
    energy: f64,
    cosines: Cosines,
}

/// A window as a stream holds it.
#[derive(Debug, Clone, Default)]
pub struct Encoded {
    /// The payload of its first section.
    pub window: Vec<u8>,
    /// The payloads of its parts.
    pub parts: Vec<Vec<u8>>,
    /// The squared error, in local units.
    pub squared_error: f64,
    /// Bits of the mean shape.
    pub shape_bits: f64,
    /// Bits of the directions.
    pub basis_bits: f64,
    /// Bits of the weights.
    pub weight_bits: f64,
    /// Components.
    pub components: usize,
}

/// Vertices that are computed together.
pub const LANES: usize = 8;

/// The components of a window that are known.
#[derive(Debug, Clone, Default)]
pub struct Components {
    /// The mean position of each vertex.
    pub means: Vec<Vec3>,
    /// The weights of [`LANES`] vertices together: for each such block one row for each component.
    pub weights: Vec<[f64; LANES]>,
    /// For each component `3 F` numbers: for every axis a cosine transform over the frames.
    pub directions: Vec<Vec<f64>>,
}

/// Codes directions, one after the other.
#[derive(Debug, Clone)]
struct Directions {
    model: Integers<6>,
    steps: Integers<1>,
    frames: usize,
    before: Vec<f32>,
    exponent: i32,
    met: usize,
}

impl Directions {
    const NUMBERS: usize = 64;

    fn new(frames: usize) -> Self {
        let pairs = CLASSES * CLASSES;
        let cells = [
            CLASSES,
            CLASSES,
            pairs,
            3 * Self::NUMBERS,
            Self::NUMBERS,
            pairs,
        ];
        Directions {
            model: Integers::new(cells, 1),
            steps: Integers::new([1], 1),
            frames,
            before: vec![0.0; 3 * frames],
            exponent: 0,
            met: 0,
        }
    }

    /// Quarters of a power of two that make the step of a direction of this length.
    fn exponent(step: f64, length: f64) -> i32 {
        (4.0 * (length / (COARSER * step)).log2())
            .round()
            .clamp(-4000.0, 4000.0) as i32
    }

    /// `2^(-exponent / 4)`.
    fn step(exponent: i32) -> f64 {
        const ROOTS: [f64; 4] = [
            1.0,
            0.8408964152537145,
            std::f64::consts::FRAC_1_SQRT_2,
            0.5946035575013605,
        ];
        ROOTS[exponent.rem_euclid(4) as usize] * 2f64.powi(-exponent.div_euclid(4))
    }

    /// Codes a direction; returns the one the stream holds. `given` is the direction and its
    /// exponent, `held` the numbers of one that was chosen before.
    fn code(
        &mut self,
        coder: &mut impl Coder,
        given: Option<(&[f64], i32)>,
        chosen: Option<&[i32]>,
    ) -> (Vec<f64>, Vec<i32>) {
        let exponent = given.map_or(0, |(_, exponent)| exponent);
        let context = Context { cells: [0], set: 0 };
        let change = self.steps.code(coder, &context, exponent - self.exponent);
        self.exponent = self.exponent.saturating_add(change).clamp(-4000, 4000);
        let step = Self::step(self.exponent);
        let frames = self.frames;
        let mut numbers = vec![0i32; 3 * frames];
        let mut sizes = vec![0.0f32; 3 * frames];
        // The means over the frames are coded before all directions, so frequency 0 is empty.
        for k in 1..frames {
            for axis in 0..3 {
                let context = self.context(&sizes, k, axis);
                let at = axis * frames + k;
                let number = match (chosen, given) {
                    (Some(chosen), _) => chosen[at],
                    (None, Some((direction, _))) => {
                        let price = PRICE / (COARSER * COARSER);
                        self.model.quantised(&context, direction[at] / step, price)
                    }
                    (None, None) => 0,
                };
                let number = self.model.code(coder, &context, number);
                numbers[at] = number;
                sizes[at] = number.unsigned_abs() as f32;
            }
        }
        self.before = sizes;
        self.met += 1;
        (
            numbers.iter().map(|n| f64::from(*n) * step).collect(),
            numbers,
        )
    }

    fn context(&self, sizes: &[f32], k: usize, axis: usize) -> Context<6> {
        let frames = self.frames;
        let lower = |j: usize, axis: usize| match k.checked_sub(j) {
            Some(k) => sizes[axis * frames + k],
            None => 4.0,
        };
        let near = (2.0 * lower(1, axis) + lower(2, axis) + 0.5 * lower(3, axis)) / 3.5;
        let other = match axis {
            0 => lower(1, 2),
            axis => lower(0, axis - 1),
        };
        let third = match axis {
            2 => lower(0, 0),
            _ => lower(1, 1),
        };
        let last = |k: usize| self.before[axis * frames + k.min(frames - 1)];
        let last = (2.0 * last(k) + last(k - 1) + last(k + 1)) / 4.0;
        let pair = |x: f32, y: f32| class_of(x) * CLASSES + class_of(y);
        Context {
            cells: [
                class_of(near),
                class_of((other + third) / 2.0),
                pair(near, last),
                axis * Self::NUMBERS + k * Self::NUMBERS / frames,
                self.met.min(Self::NUMBERS - 1),
                pair((near + other) / 2.0, third),
            ],
            set: 0,
        }
    }
}

/// What foresees the weights: it learns from the fields that are known.
struct Foresight<'a> {
    hierarchy: &'a Hierarchy,
    affine: f64,
    places: Vec<f64>,
    dims: usize,
    weights: Weights,
}

impl<'a> Foresight<'a> {
    /// From three fields: the mean shape.
    fn new(hierarchy: &'a Hierarchy, affine: f64, shape: &[Vec<f64>]) -> Self {
        let of = |rank: usize| shape.iter().map(move |field| field[rank]);
        let places: Vec<f64> = (0..hierarchy.len()).flat_map(of).collect();
        let dims = shape.len();
        let weights = Weights::new(hierarchy, &places, dims, affine);
        Foresight {
            hierarchy,
            affine,
            places,
            dims,
            weights,
        }
    }

    /// Takes up the last fields, where it is time; `lengths` are those of their directions.
    fn learn(&mut self, fields: &[Vec<f64>], lengths: &[f64]) {
        if !STAGES.contains(&fields.len()) {
            return;
        }
        let known = self.dims - 3;
        let dims = 3 + fields.len();
        let mut places = Vec::with_capacity(self.hierarchy.len() * dims);
        for (rank, place) in self.places.chunks_exact(self.dims).enumerate() {
            places.extend_from_slice(place);
            let new = fields.iter().zip(lengths).skip(known);
            places.extend(new.map(|(field, length)| field[rank] * length));
        }
        self.weights = Weights::new(self.hierarchy, &places, dims, self.affine);
        (self.places, self.dims) = (places, dims);
    }
}

/// The part of the head of a window that is not entropy coded.
#[derive(Debug, Clone, Copy)]
struct Head {
    step: f64,
    affine: f64,
}

/// Components while they are coded.
struct State<'a> {
    foresight: Foresight<'a>,
    fields: Fields,
    directions: Directions,
    step: f64,
    /// The first fields and the lengths of their directions: as many as weights are foreseen from.
    first: Vec<Vec<f64>>,
    lengths: Vec<f64>,
}

impl State<'_> {
    /// Codes the weights of a direction of this length; returns those the stream holds.
    fn weights(&mut self, coder: &mut impl Coder, length: f64, values: Option<&[f64]>) -> Vec<f64> {
        let wanted = Wanted {
            values,
            step: if length > 0.0 {
                self.step / length
            } else {
                0.0
            },
            price: PRICE,
        };
        let hierarchy = self.foresight.hierarchy;
        let field = self
            .fields
            .code(coder, hierarchy, &self.foresight.weights, &wanted);
        if self.first.len() < STAGES[STAGES.len() - 1] {
            self.first.push(field.clone());
            self.lengths.push(length);
            self.foresight.learn(&self.first, &self.lengths);
        }
        field
    }
}

/// The mean shape and what follows from it; `given` are its three fields.
fn begin<'a>(
    coder: &mut impl Coder,
    hierarchy: &'a Hierarchy,
    frames: usize,
    head: Head,
    given: Option<&[Vec<f64>]>,
) -> (State<'a>, Vec<Vec<f64>>) {
    let given = given.map(|given| [0, 1, 2].map(|axis| given[axis].as_slice()));
    let shape = field::shape(coder, hierarchy, given, head.step, PRICE).to_vec();
    let state = State {
        foresight: Foresight::new(hierarchy, head.affine, &shape),
        fields: Fields::new(hierarchy),
        directions: Directions::new(frames),
        step: head.step,
        first: Vec::new(),
        lengths: Vec::new(),
    };
    (state, shape)
}

fn length(direction: &[f64]) -> f64 {
    direction.iter().fold(0.0, |sum, x| sum + x * x).sqrt()
}

impl<'a> Analysis<'a> {
    /// Looks for the principal directions; see [`spectrum`] for the cost.
    pub fn new(trajectories: Trajectories<'a>, hierarchy: &'a Hierarchy) -> Self {
        let means = trajectories.means();
        let spectrum = spectrum(&trajectories, &means);
        Analysis {
            energy: trajectories.energy(&means),
            cosines: Cosines::new(trajectories.frames()),
            trajectories,
            hierarchy,
            means,
            spectrum,
        }
    }

    /// Frames of the window.
    pub fn frames(&self) -> usize {
        self.trajectories.frames()
    }

    /// A step to begin a search with, for a squared error in local units.
    pub fn first_step(&self, squared_error: f64) -> f64 {
        // Components whose energy is beyond the error, each number of which has a twelfth of a
        // squared step as its error.
        let (mut rest, mut count) = (self.energy, 3.0);
        for energy in &self.spectrum.energies {
            if rest < 0.5 * squared_error {
                break;
            }
            rest -= energy;
            count += 1.0;
        }
        (4.0 * squared_error / (count * self.means.len() as f64)).sqrt()
    }

    /// Codes the window with a step, in local units.
    pub fn encode(&self, step: f64, affine: f64) -> Encoded {
        let (hierarchy, frames) = (self.hierarchy, self.frames());
        let head = Head { step, affine };
        let mut window = Vec::new();
        window.extend_from_slice(&step.to_le_bytes());
        window.extend_from_slice(&affine.to_le_bytes());
        let root = (frames as f64).sqrt();
        let shape: Vec<Vec<f64>> = (0..3)
            .map(|axis| {
                let of = |v: &u32| self.means[*v as usize][axis] * root;
                hierarchy.vertices.iter().map(of).collect()
            })
            .collect();
        let mut writer = Writer::new();
        let (mut state, held) = begin(&mut writer, hierarchy, frames, head, Some(&shape));
        let mut made = Encoded {
            shape_bits: writer.spent(),
            squared_error: self.energy,
            ..Encoded::default()
        };
        for (given, held) in shape.iter().zip(&held) {
            let apart = given.iter().zip(held).map(|(x, y)| (x - y) * (x - y));
            made.squared_error += apart.sum::<f64>();
        }
        window.extend(writer.finish());
        made.window = window;
        self.components(&mut state, &mut made);
        made
    }

    /// The directions that may pay with a step, as a stream holds them: numbers and exponents.
    fn directions(&self, step: f64) -> (Vec<Vec<i32>>, Vec<i32>, Vec<Vec<f64>>) {
        let size = 3 * self.frames();
        // Even at a hundredth of a bit for each of its numbers a direction of less energy is not worth
        // having.
        let least = PRICE * step * step * 0.01 * (size + self.means.len()) as f64;
        let energies = self.spectrum.energies.iter();
        let count = energies
            .take_while(|energy| **energy > least)
            .count()
            .min(MOST);
        let mut coder = Directions::new(self.frames());
        let (mut numbers, mut exponents, mut held) = (Vec::new(), Vec::new(), Vec::new());
        let vectors = self.spectrum.vectors.chunks_exact(size);
        for (vector, energy) in vectors.zip(&self.spectrum.energies).take(count) {
            let exponent = Directions::exponent(step, energy.sqrt());
            let (direction, chosen) = coder.code(&mut Unwritten, Some((vector, exponent)), None);
            numbers.push(chosen);
            exponents.push(exponent);
            held.push(direction);
        }
        (numbers, exponents, held)
    }

    /// Codes components until one more does not pay.
    fn components(&self, state: &mut State, made: &mut Encoded) {
        let (numbers, exponents, directions) = self.directions(state.step);
        let mut part = Part::new();
        let mut held: Vec<Vec<f32>> = Vec::new();
        // Of each component the bits of its direction and of its weights, and the error it takes away.
        let mut each: Vec<[f64; 3]> = Vec::new();
        let mut failed: Option<(usize, Part)> = None;
        let mut onto = Products::default();
        for (q, direction) in directions.iter().enumerate() {
            if q % TOGETHER == 0 {
                let some = &directions[q..directions.len().min(q + TOGETHER)];
                onto = self.onto(some);
            }
            let before = part.clone();
            let start = part.writer.spent();
            let given = Some(([].as_slice(), exponents[q]));
            let coder = &mut part.writer;
            state.directions.code(coder, given, Some(&numbers[q]));
            let basis = coder.spent() - start;
            let length = length(direction);
            let values = self.left(&onto, &held, &directions, q);
            let field = state.weights(coder, length, Some(&values));
            let bits = coder.spent() - start;
            let gain = values.iter().zip(&field);
            let gain = gain.map(|(v, h)| v * v - (v - h) * (v - h)).sum::<f64>() * length * length;
            held.push(field.iter().map(|x| *x as f32).collect());
            each.push([basis, bits - basis, gain]);
            part.components += 1;
            if gain > PRICE * state.step * state.step * bits {
                failed = None;
            } else {
                let (since, _) = failed.get_or_insert((q, before));
                if q + 1 - *since >= PATIENCE {
                    break;
                }
            }
            if failed.is_none() && part.bytes() >= PART {
                part.end(&mut made.parts);
            }
        }
        // The last ones that do not pay are left out.
        if let Some((since, before)) = failed {
            part = before;
            each.truncate(since);
        }
        part.end(&mut made.parts);
        made.components = each.len();
        for [basis, weights, gain] in each {
            made.basis_bits += basis;
            made.weight_bits += weights;
            made.squared_error -= gain;
        }
    }

    /// The products of all trajectories with some directions.
    fn onto(&self, directions: &[Vec<f64>]) -> Products {
        let frames = self.frames();
        let mut time = vec![0.0; directions.len() * 3 * frames];
        let axes = time.par_chunks_mut(frames).enumerate();
        axes.for_each(|(i, time)| {
            let there = &directions[i / 3][i % 3 * frames..(i % 3 + 1) * frames];
            self.cosines.inverse(there, time);
        });
        self.trajectories.onto(&time, &self.means)
    }

    /// The weights of direction `q` that take up what the components before leave, by rank; `onto` are
    /// the products of the trajectories with it and those beside it.
    fn left(
        &self,
        onto: &Products,
        held: &[Vec<f32>],
        directions: &[Vec<f64>],
        q: usize,
    ) -> Vec<f64> {
        let this = &directions[q];
        let vertices = self.hierarchy.vertices.iter();
        let value = |v: &u32| onto.at(q % TOGETHER, *v as usize);
        let mut values: Vec<f64> = vertices.map(value).collect();
        for (field, direction) in held.iter().zip(directions) {
            // Directions are nearly at right angles, so single precision does for the rest.
            let common = direction.iter().zip(this);
            let common = common.fold(0.0, |sum, (x, y)| sum + x * y);
            if common != 0.0 {
                for (value, weight) in values.iter_mut().zip(field) {
                    *value -= common * f64::from(*weight);
                }
            }
        }
        let squared = length(this).powi(2);
        for value in &mut values {
            *value = if squared > 0.0 { *value / squared } else { 0.0 };
        }
        values
    }
}

/// Components that go into one section.
#[derive(Clone)]
struct Part {
    writer: Writer,
    components: usize,
}

impl Part {
    fn new() -> Self {
        Part {
            writer: Writer::new(),
            components: 0,
        }
    }

    fn bytes(&self) -> usize {
        (self.writer.spent() / 8.0) as usize
    }

    /// Ends the part, where there is anything in it, and begins the next.
    fn end(&mut self, parts: &mut Vec<Vec<u8>>) {
        let part = std::mem::replace(self, Part::new());
        if part.components > 0 {
            let mut payload = Vec::new();
            push_number(&mut payload, part.components as u64);
            payload.extend(part.writer.finish());
            parts.push(payload);
        }
    }
}

/// Reads a window, as far as there are parts; `window` and `parts` are what [`Analysis::encode`] made.
pub fn decode(
    hierarchy: &Hierarchy,
    frames: usize,
    mut window: &[u8],
    parts: &[&[u8]],
) -> Result<Components, Fault> {
    let damaged = |what: &str| Fault::whole(format!("a window's {what}; damaged"));
    let step = take_f64(&mut window).filter(|step| step.is_finite() && *step > 0.0);
    let affine = take_f64(&mut window).filter(|affine| affine.is_finite() && *affine >= 0.0);
    let (Some(step), Some(affine)) = (step, affine) else {
        return Err(damaged("step is no number above 0"));
    };
    let mut reader = Reader::new(window);
    let head = Head { step, affine };
    let (mut state, shape) = begin(&mut reader, hierarchy, frames, head, None);
    reader.check()?;
    let mut counts = parts.iter().map(|part| take_number(&mut &**part));
    let count = counts.try_fold(0u64, |sum, count| Some(sum.saturating_add(count?)));
    let count = count
        .filter(|count| *count <= MOST as u64)
        .map(|count| count as usize);
    let count = count.ok_or_else(|| damaged("parts have no sound number of components"))?;
    let mut made = Components {
        means: vec![[0.0; 3]; hierarchy.len()],
        weights: vec![[0.0; LANES]; hierarchy.len().div_ceil(LANES) * count],
        directions: Vec::with_capacity(count),
    };
    let root = (frames as f64).sqrt();
    for (rank, v) in hierarchy.vertices.iter().enumerate() {
        made.means[*v as usize] = std::array::from_fn(|axis| shape[axis][rank] / root);
    }
    for mut part in parts.iter().copied() {
        let some = take_number(&mut part).unwrap_or(0);
        let mut reader = Reader::new(part);
        for _ in 0..some {
            let (direction, _) = state.directions.code(&mut reader, None, None);
            let field = state.weights(&mut reader, length(&direction), None);
            let q = made.directions.len();
            for (v, weight) in hierarchy.vertices.iter().map(|v| *v as usize).zip(field) {
                made.weights[v / LANES * count + q][v % LANES] = weight;
            }
            made.directions.push(direction);
        }
        reader.check()?;
    }
    Ok(made)
}

impl Components {
    /// Positions at some frames of the window, one frame after the other, in local coordinates.
    ///
    /// Cost: three products for each vertex, component and frame; weights are read once.
    pub fn frames(&self, cosines: &Cosines, frames: Range<usize>, out: &mut [Vec3]) {
        let (count, vertices) = (self.directions.len(), self.means.len());
        let mut motions = vec![[0.0; 3]; frames.len() * count];
        let mut time = vec![0.0; frames.len()];
        for (q, direction) in self.directions.iter().enumerate() {
            for (axis, numbers) in direction.chunks_exact(cosines.frames()).enumerate() {
                cosines.inverse_at(numbers, frames.clone(), &mut time);
                for (f, time) in time.iter().enumerate() {
                    motions[f * count + q][axis] = *time;
                }
            }
        }
        for first in (0..vertices).step_by(LANES) {
            let means = &self.means[first..vertices.min(first + LANES)];
            let weights = &self.weights[first / LANES * count..][..count];
            for f in 0..frames.len() {
                let motions = &motions[f * count..(f + 1) * count];
                let out = &mut out[f * vertices + first..][..means.len()];
                block(means, motions, weights, out);
            }
        }
    }
}

/// Positions of [`LANES`] vertices at most.
#[inline]
fn block(means: &[Vec3], motions: &[Vec3], weights: &[[f64; LANES]], out: &mut [Vec3]) {
    let mut sums = [[0.0; LANES]; 3];
    for (i, mean) in means.iter().enumerate() {
        for axis in 0..3 {
            sums[axis][i] = mean[axis];
        }
    }
    for (motion, weights) in motions.iter().zip(weights) {
        for axis in 0..3 {
            for i in 0..LANES {
                sums[axis][i] += motion[axis] * weights[i];
            }
        }
    }
    for (i, out) in out.iter_mut().enumerate() {
        *out = std::array::from_fn(|axis| sums[axis][i]);
    }
}
