//! Which components a goal takes, before they are coded.

use super::allocate::{self, Curve};
use super::matrices::Steps;
use super::modes::Modes;
use super::{Allocate, Analysis, Goal, Params, Rounding};
use rayon::prelude::*;

/// Bits for the choice of a cluster and the size of a component, about.
const SIDE_BITS: f64 = 8.0;
/// The share of the error of leaving components out that rounding may add where bits are chosen for a
/// number of components.
const SHARE: f64 = 0.1;

/// The steps of all clusters and the components, by cluster, in the order that gains most first.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The steps of each cluster.
    pub steps: Vec<Steps>,
    /// Number of clusters.
    clusters: usize,
    /// The cluster of each component.
    pub order: Vec<usize>,
    /// How many of them the goal takes, by estimates; none where all are not enough.
    pub taken: Option<usize>,
    /// The error by estimates, and the bits, with that number.
    pub squared_error: f64,
    /// Estimated bits.
    pub rate: f64,
    /// Bits of columns and rows.
    pub bits: f64,
}

/// What the modes of a cluster cost in whatever steps.
#[derive(Debug, Clone)]
pub struct Costs {
    /// For each mode the mean magnitude of what is left of the column, times its singular value, and of
    /// the row, after what neighbours foretell.
    spreads: Vec<[f64; 2]>,
    /// The least and the largest number of columns and rows, of each mode.
    ranges: Vec<[[f64; 2]; 2]>,
}

/// Bits of a number whose mean magnitude is this, about: the entropy of a geometric source, and a sign.
fn entropy(mean: f64) -> f64 {
    if mean <= 1e-9 {
        return 0.0;
    }
    (1.0 + mean).log2() + mean * (1.0 + 1.0 / mean).log2() + mean / (1.0 + mean)
}

impl Analysis<'_> {
    /// What the modes of all clusters cost.
    pub fn costs(&self, modes: &[Modes]) -> Vec<Costs> {
        let of = |(i, modes): (usize, &Modes)| {
            let hierarchy = &self.layout.groups[i].hierarchy;
            let mut costs = Costs {
                spreads: Vec::new(),
                ranges: Vec::new(),
            };
            for (column, sigma) in modes.columns.iter().zip(&modes.sigmas) {
                let row = self.matrices[i].onto(column);
                let (mut plain, mut missed) = (0.0, 0.0);
                for field in column.chunks_exact(hierarchy.len()) {
                    for (rank, x) in field.iter().enumerate() {
                        let ring = hierarchy.rings.of(rank);
                        let ring = &ring[..hierarchy.inner[rank] as usize];
                        let sum: f64 = ring.iter().map(|u| field[*u as usize]).sum();
                        plain += x.abs();
                        missed += (x - sum / ring.len().max(1) as f64).abs();
                    }
                }
                let at = |f: usize, ago: usize| f.checked_sub(ago).map_or(0.0, |f| row[f]);
                let mut times = [0.0f64; 3];
                for (f, x) in row.iter().enumerate() {
                    times[0] += x.abs();
                    times[1] += (x - at(f, 1)).abs();
                    times[2] += (x - 2.0 * at(f, 1) + at(f, 2)).abs();
                }
                let time = times.into_iter().fold(f64::INFINITY, f64::min);
                let columns = sigma * plain.min(missed) / column.len() as f64;
                costs.spreads.push([columns, time / row.len() as f64]);
                // With zero among them, as numbers are counted from there.
                let range = |x: &[f64]| {
                    let low = x.iter().copied().fold(0.0, f64::min);
                    [low, x.iter().copied().fold(0.0, f64::max)]
                };
                costs.ranges.push([range(column), range(&row)]);
            }
            costs
        };
        modes.par_iter().enumerate().map(of).collect()
    }

    /// The step that all numbers have with so many bits.
    fn even_step(&self, bits: f64) -> f64 {
        let step = self.side * (self.layout.frames as f64).sqrt() / bits.exp2();
        if step > 0.0 { step } else { 1.0 }
    }

    /// The error that so many components leave unrounded, and what rounding adds.
    fn errors(&self, modes: &Modes, steps: &Steps, rows: usize, components: usize) -> (f64, f64) {
        let square = |s: &f64| s * s;
        let left = modes.sigmas[components..].iter().map(square).sum::<f64>() + modes.rest;
        let (rows, frames) = (rows as f64, self.layout.frames as f64);
        let held = &modes.sigmas[..components];
        let rounding = match steps {
            // A component is never held worse than not at all.
            Steps::Even(step) => {
                let each = (rows + frames) * step * step / 12.0;
                held.iter().map(|s| each.min(s * s)).sum()
            }
            Steps::Ranges {
                columns,
                rows: row_step,
            } => {
                let rounded = components as f64 * frames * row_step * row_step / 12.0;
                rounded + rows * columns * columns / 12.0 * held.iter().map(square).sum::<f64>()
            }
        };
        (left, rounding)
    }

    /// Steps of a cluster with so many components.
    fn steps(&self, costs: &Costs, bits: f64, components: usize) -> Steps {
        if self.params.rounding == Rounding::Balanced {
            return Steps::Even(self.even_step(bits));
        }
        let step = |which: usize| {
            let all = costs.ranges[..components].iter();
            let range = all.fold([0.0f64; 2], |[lo, hi], ranges| {
                [lo.min(ranges[which][0]), hi.max(ranges[which][1])]
            });
            // As it is written.
            let step = f64::from(((range[1] - range[0]) / bits.exp2()) as f32);
            if step > 0.0 { step } else { 1.0 }
        };
        Steps::Ranges {
            columns: step(0),
            rows: step(1),
        }
    }

    /// Estimated bits against squared errors of every cluster.
    fn curves(&self, modes: &[Modes], costs: &[Costs], bits: f64) -> Vec<Curve> {
        let of = |i: usize| {
            let (modes, costs) = (&modes[i], &costs[i]);
            let rows = self.matrices[i].rows();
            let mut curve = Curve::default();
            for components in 0..=modes.sigmas.len() {
                let steps = self.steps(costs, bits, components);
                let (left, rounding) = self.errors(modes, &steps, rows, components);
                curve.distortion.push(left + rounding);
                let held = costs.spreads[..components].iter().zip(&modes.sigmas);
                let mut rate = held.map(|([column, row], sigma)| {
                    let (column_step, row_step) = match steps {
                        Steps::Even(step) => (step, step),
                        Steps::Ranges { columns, rows } => (columns * sigma, rows),
                    };
                    rows as f64 * entropy(column / column_step)
                        + self.layout.frames as f64 * entropy(row / row_step)
                        + SIDE_BITS
                });
                let before = curve.rate.last().copied();
                curve.rate.push(match (before, steps) {
                    (None, _) => 0.0,
                    (Some(before), Steps::Even(_)) => before + rate.next_back().unwrap_or(0.0),
                    // Wider ranges must not make more components cheaper.
                    (Some(before), _) => rate.sum::<f64>().max(before + SIDE_BITS),
                });
            }
            curve
        };
        (0..modes.len()).map(of).collect()
    }

    /// The squared errors that so many components of each cluster make: left out, and rounded.
    pub fn foretold(&self, modes: &[Modes], plan: &Plan, components: &[usize]) -> (f64, f64) {
        let mut sums = (0.0, 0.0);
        for (i, components) in components.iter().enumerate() {
            let rows = self.matrices[i].rows();
            let (left, rounding) = self.errors(&modes[i], &plan.steps[i], rows, *components);
            sums = (sums.0 + left, sums.1 + rounding);
        }
        sums
    }

    /// The squared error of the points of frames of reference, foretold from their step.
    pub fn foretold_seeds(&self) -> f64 {
        let points = self.layout.corners.len() * 3 * self.layout.frames;
        3.0 * points as f64 * self.layout.lattice.step.powi(2) / 12.0
    }

    /// Bits that so many components of each cluster take, by estimates.
    pub fn estimated(&self, modes: &[Modes], bits: f64, components: &[usize]) -> f64 {
        let curves = self.curves(modes, &self.costs(modes), bits);
        let rates = curves
            .iter()
            .zip(components)
            .map(|(curve, l)| curve.rate[*l]);
        self.fixed_bits() + rates.sum::<f64>()
    }

    /// Bits of a window without components, about.
    fn fixed_bits(&self) -> f64 {
        8.0 * (self.head.len() + 64) as f64
    }

    /// A plan for a goal, with the bits asked for or the best ones.
    pub fn plan(&self, modes: &[Modes], goal: Goal) -> Plan {
        let costs = self.costs(modes);
        if let Some(bits) = self.params.bits {
            return self.plan_with(modes, &costs, f64::from(bits), goal);
        }
        let tries = (4 * 3..=4 * Params::MOST_BITS).map(|quarters| f64::from(quarters) / 4.0);
        if let Goal::Components(_) = goal {
            let mut last = None;
            for bits in tries {
                let plan = self.plan_with(modes, &costs, bits, goal);
                let (left, rounding) = self.foretold(modes, &plan, &plan.counts());
                if rounding <= SHARE * left {
                    return plan;
                }
                last = Some(plan);
            }
            return last.unwrap_or_else(|| self.plan_with(modes, &costs, 12.0, goal));
        }
        let plans: Vec<Plan> = tries
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|bits| self.plan_with(modes, &costs, bits, goal))
            .collect();
        // The goal must be reached; then what is not asked for shall be least.
        let worth = |plan: &Plan| match (goal, plan.taken) {
            (Goal::SquaredError(_), None) => (true, plan.squared_error),
            (Goal::SquaredError(_), _) => (false, plan.rate),
            _ => (false, plan.squared_error),
        };
        let better = |a: &Plan, b: &Plan| {
            let (a, b) = (worth(a), worth(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        };
        let best = plans.into_iter().min_by(better);
        best.unwrap_or_else(|| self.plan_with(modes, &costs, 12.0, goal))
    }

    /// A plan with so many bits.
    pub fn plan_with(&self, modes: &[Modes], costs: &[Costs], bits: f64, goal: Goal) -> Plan {
        let curves = self.curves(modes, costs, bits);
        let most: Vec<usize> = modes.iter().map(|modes| modes.sigmas.len()).collect();
        let even = |l: usize| most.iter().map(|most| l.min(*most)).collect::<Vec<_>>();
        let (order, counted) = match self.params.allocate {
            Allocate::Uniform => {
                let deepest = most.iter().copied().max().unwrap_or(0);
                let most = &most;
                let round = |l: usize| (0..most.len()).filter(move |i| l < most[*i]);
                let order: Vec<usize> = (0..deepest).flat_map(round).collect();
                let counted = match goal {
                    Goal::Components(l) => Some(even(l).iter().sum()),
                    _ => None,
                };
                (order, counted)
            }
            Allocate::Paper => {
                let roots: Vec<Curve> = curves_of_roots(modes);
                let budget = |l: usize| even(l).iter().sum::<usize>() as f64;
                shared_out(&roots, 1, goal, budget)
            }
            Allocate::RateDistortion => {
                let budget = |l: usize| {
                    let all = even(l).into_iter().zip(&curves);
                    all.map(|(l, curve)| curve.rate[l]).sum()
                };
                shared_out(&curves, 0, goal, budget)
            }
        };
        let mut counts = vec![0; most.len()];
        let mut rate = self.fixed_bits();
        let mut error: f64 = curves.iter().map(|curve| curve.distortion[0]).sum();
        error += self.seed_squared_error;
        let mut taken = None;
        let mut at = (error, rate);
        for n in 0..=order.len() {
            let (fits, enough) = match (goal, counted) {
                (_, Some(counted)) => (true, n == counted),
                (Goal::SquaredError(wanted), _) => (true, error <= wanted),
                (Goal::Bits(budget), _) => (rate <= budget, n == order.len()),
                (Goal::Components(_), None) => (true, n == order.len()),
            };
            if !fits && n > 0 {
                break;
            }
            at = (error, rate);
            taken = (enough || matches!(goal, Goal::Bits(_))).then_some(n);
            let Some(i) = order.get(n).filter(|_| !enough && fits) else {
                break;
            };
            let (l, curve) = (counts[*i], &curves[*i]);
            rate += curve.rate[l + 1] - curve.rate[l];
            error += curve.distortion[l + 1] - curve.distortion[l];
            counts[*i] += 1;
        }
        let mut plan = Plan {
            steps: Vec::new(),
            clusters: modes.len(),
            order,
            taken,
            squared_error: at.0,
            rate: at.1,
            bits,
        };
        let counts = plan.counts();
        let all = costs.iter().zip(&counts);
        plan.steps = all.map(|(costs, l)| self.steps(costs, bits, *l)).collect();
        plan
    }
}

impl Plan {
    /// Components that each cluster gets.
    pub fn counts(&self) -> Vec<usize> {
        let mut counts = vec![0; self.clusters];
        for i in &self.order[..self.taken.unwrap_or(self.order.len())] {
            counts[*i] += 1;
        }
        counts
    }
}

/// Roots of errors against counts.
fn curves_of_roots(modes: &[Modes]) -> Vec<Curve> {
    let of = |modes: &Modes| {
        let mut left = modes.rest;
        let mut roots = vec![left.sqrt()];
        for sigma in modes.sigmas.iter().rev() {
            left += sigma * sigma;
            roots.push(left.sqrt());
        }
        roots.reverse();
        Curve {
            rate: (0..roots.len()).map(|l| l as f64).collect(),
            distortion: roots,
        }
    };
    modes.iter().map(of).collect()
}

/// The order of components along the hulls of curves, and, where the goal is a number of components,
/// how many of them fit into what that number for each cluster makes.
fn shared_out(
    curves: &[Curve],
    start: usize,
    goal: Goal,
    budget: impl Fn(usize) -> f64,
) -> (Vec<usize>, Option<usize>) {
    let chosen = match goal {
        Goal::Components(l) => {
            let chosen = allocate::within(curves, start, budget(l));
            // The paper goes along the hulls and no further.
            let as_it_is = start > 0;
            Some(if as_it_is {
                chosen
            } else {
                allocate::refined(curves, chosen, budget(l))
            })
        }
        _ => None,
    };
    let (mut order, mut counts) = (Vec::new(), vec![0; curves.len()]);
    let mut raise = |i: usize, to: usize| {
        while counts[i] < to {
            counts[i] += 1;
            order.push(i);
        }
    };
    let limit = |i: usize, to: usize| chosen.as_ref().map_or(to, |chosen| to.min(chosen[i]));
    for (i, curve) in curves.iter().enumerate() {
        raise(i, limit(i, start.min(curve.rate.len().saturating_sub(1))));
    }
    for step in allocate::steps(curves, start) {
        raise(step.cluster, limit(step.cluster, step.components));
    }
    if let Some(chosen) = &chosen {
        for (i, to) in chosen.iter().enumerate() {
            raise(i, *to);
        }
    }
    let counted = chosen.map(|_| order.len());
    (order, counted)
}
