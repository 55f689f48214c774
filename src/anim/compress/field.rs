//! One number for each vertex, as smooth over the mesh as it may be.

use super::coder::Coder;
use super::hierarchy::Hierarchy;
use super::integers::{CLASSES, Context, Integers, class_of};
use super::prediction::Weights;

/// Fields in a row are told apart up to this many.
const NUMBERS: usize = 64;
const VIEWS: usize = 7;

/// Codes field after field over one mesh, from coarse to fine vertices; what each field needed where
/// tells what the next will need.
#[derive(Debug, Clone)]
pub struct Fields {
    model: Integers<VIEWS>,
    /// Magnitudes of the last three fields at each rank, the latest first.
    before: [Vec<f32>; 3],
    met: usize,
}

/// The field to code, and how finely.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// The value at each rank; none where the stream tells it.
    pub values: Option<&'a [f64]>,
    /// The unit of the numbers that are coded.
    pub step: f64,
    /// How many squared steps a bit outweighs; 0 takes the nearest number always.
    pub price: f64,
}

impl Fields {
    /// None coded yet.
    pub fn new(hierarchy: &Hierarchy) -> Self {
        let levels = Hierarchy::LEVELS;
        let pairs = CLASSES * CLASSES;
        let cells = [
            CLASSES * levels,
            CLASSES * levels,
            pairs,
            pairs,
            pairs,
            levels * NUMBERS,
            pairs,
        ];
        let still = vec![0.0; hierarchy.len()];
        Fields {
            model: Integers::new(cells, levels),
            before: [still.clone(), still.clone(), still],
            met: 0,
        }
    }

    /// Codes a field; returns the one the stream holds, a value for each rank.
    ///
    /// Cost: a ring and the neighbours of each vertex.
    pub fn code(
        &mut self,
        coder: &mut impl Coder,
        hierarchy: &Hierarchy,
        weights: &Weights,
        wanted: &Wanted,
    ) -> Vec<f64> {
        let mut held = vec![0.0; hierarchy.len()];
        let mut sizes = vec![-1.0f32; hierarchy.len()];
        for rank in 0..hierarchy.len() {
            let expected = weights.expected(hierarchy, rank, &held);
            let context = self.context(hierarchy, rank, &sizes);
            let number = wanted.values.map_or(0, |values| {
                let apart = (values[rank] - expected) / wanted.step;
                self.model.quantised(&context, apart, wanted.price)
            });
            let number = self.model.code(coder, &context, number);
            sizes[rank] = number.unsigned_abs() as f32;
            held[rank] = expected + f64::from(number) * wanted.step;
        }
        self.before.rotate_right(1);
        self.before[0] = sizes;
        self.met += 1;
        held
    }

    /// What the numbers around tell of the one at a rank; `sizes` are below zero where none is known.
    fn context(&self, hierarchy: &Hierarchy, rank: usize, sizes: &[f32]) -> Context<VIEWS> {
        let [before, earlier, first] = &self.before;
        let ring = &hierarchy.rings.of(rank)[..hierarchy.inner[rank] as usize];
        let coarser = ring.iter().fold(0.0, |sum, u| sum + sizes[*u as usize]);
        let coarser = if ring.is_empty() {
            1.0
        } else {
            coarser * share(ring.len())
        };
        let near = hierarchy.neighbours.of(rank);
        let (mut beside, mut count, mut last) = (0.0f32, 0usize, 0.0f32);
        for u in near {
            let size = sizes[*u as usize];
            beside += size.max(0.0);
            count += usize::from(size >= 0.0);
            last += before[*u as usize];
        }
        let beside = if count > 0 {
            beside * share(count)
        } else {
            coarser
        };
        let last = last * share(near.len());
        let here = (2.0 * before[rank] + earlier[rank] + 0.5 * first[rank]) * (1.0 / 3.5);
        let level = hierarchy.level(rank);
        let all = (coarser + beside + here + last) * 0.25;
        let [coarser, beside, here, last] = [coarser, beside, here, last].map(class_of);
        Context {
            cells: [
                coarser * Hierarchy::LEVELS + level,
                here * Hierarchy::LEVELS + level,
                coarser * CLASSES + here,
                beside * CLASSES + last,
                here * CLASSES + last,
                level * NUMBERS + self.met.min(NUMBERS - 1),
                class_of(all) * CLASSES + class_of(before[rank]),
            ],
            set: level,
        }
    }
}

/// One over a count; 0 of none.
#[inline]
fn share(count: usize) -> f32 {
    const SHARES: [f32; 32] = {
        let mut shares = [0.0; 32];
        let mut i = 1;
        while i < 32 {
            shares[i] = 1.0 / i as f32;
            i += 1;
        }
        shares
    };
    SHARES.get(count).copied().unwrap_or(1.0 / count as f32)
}

/// The three coordinates of a shape, each foreseen from those before it too; `given` are their values at
/// each rank, none where the stream tells them.
pub fn shape(
    coder: &mut impl Coder,
    hierarchy: &Hierarchy,
    given: Option<[&[f64]; 3]>,
    step: f64,
    price: f64,
) -> [Vec<f64>; 3] {
    let even = Weights::even(hierarchy);
    let mut fields = Fields::new(hierarchy);
    let mut wanted = |axis: usize, weights: &Weights| {
        let wanted = Wanted {
            values: given.map(|given| given[axis]),
            step,
            price,
        };
        fields.code(coder, hierarchy, weights, &wanted)
    };
    let x = wanted(0, &even);
    let y = wanted(1, &even.through(hierarchy, &[&x]));
    let z = wanted(2, &even.through(hierarchy, &[&x, &y]));
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::compress::coder::{Reader, Writer};
    use crate::mesh::shapes;

    #[test]
    fn fields_come_back_within_half_a_step_and_smooth_ones_are_short() {
        let mesh = shapes::icosphere([0.0; 3], 1.0, 4);
        let edges = mesh
            .triangles
            .iter()
            .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        let hierarchy = Hierarchy::new(mesh.positions.len(), edges).unwrap();
        let of = |rank: usize| mesh.positions[hierarchy.vertices[rank] as usize];
        let places: Vec<f64> = (0..hierarchy.len()).flat_map(of).collect();
        let weights = Weights::new(&hierarchy, &places, 3, 100.0);
        let values: Vec<Vec<f64>> = (0..5)
            .map(|i| {
                let wave = |p: [f64; 3]| (p[0] * f64::from(i + 1)).sin() + p[1];
                (0..hierarchy.len()).map(|rank| wave(of(rank))).collect()
            })
            .collect();
        let wanted = |values| Wanted {
            values,
            step: 1e-3,
            price: 0.0,
        };
        let (mut fields, mut writer) = (Fields::new(&hierarchy), Writer::new());
        let mut held = Vec::new();
        for field in &values {
            held.push(fields.code(&mut writer, &hierarchy, &weights, &wanted(Some(field))));
        }
        let bytes = writer.finish();
        let bits = 8.0 * bytes.len() as f64 / (5 * hierarchy.len()) as f64;
        // Plain numbers of this step take eleven bits.
        assert!(bits < 3.5, "{bits} bits a value");
        let (mut fields, mut reader) = (Fields::new(&hierarchy), Reader::new(&bytes));
        for (field, held) in values.iter().zip(&held) {
            let back = fields.code(&mut reader, &hierarchy, &weights, &wanted(None));
            assert_eq!(&back, held);
            let apart = field.iter().zip(&back).map(|(x, y)| (x - y).abs());
            assert!(apart.fold(0.0, f64::max) <= 0.5001e-3);
        }
    }
}
