//! From a plan to a stream.

use super::decode::Head;
use super::matrices::{Models, State, Steps};
use super::modes::{Matrix, Modes};
use super::plan::{Costs, Plan};
use super::{Allocate, Analysis, Encoded, Floor, Goal, LEVELS, Params, Rounding};
use crate::anim::compress::coder::Writer;
use crate::anim::compress::container::push_number;

/// Bytes of a part, before it ends.
const PART: f64 = 3000.0;
/// Bits that ending a part takes at most, with its number of components.
const ENDING: f64 = 80.0;
/// Times a plan whose error was estimated too low is made again.
const RETRIES: usize = 8;
/// Times a plan whose bits were estimated wrongly is made again.
const CORRECTIONS: usize = 2;

/// A stream while it grows.
struct Growing<'a> {
    models: Models,
    states: Vec<State<'a>>,
    /// What the components up to now leave of each cluster, once there are any.
    left: Vec<Option<Matrix>>,
    /// Its energy.
    errors: Vec<f64>,
    writer: Writer,
    components: usize,
    made: Encoded,
}

impl Growing<'_> {
    /// Bits up to now, with those of ending the part.
    fn bits(&self) -> f64 {
        let whole: usize = self.made.parts.iter().map(Vec::len).sum();
        8.0 * (self.made.window.len() + whole) as f64 + self.writer.spent() + ENDING
    }

    /// Ends the part, where there is anything in it.
    fn end(&mut self) {
        let writer = std::mem::take(&mut self.writer);
        if self.components > 0 {
            let mut payload = Vec::new();
            push_number(&mut payload, self.components as u64);
            payload.extend(writer.finish());
            self.made.parts.push(payload);
        }
        self.components = 0;
    }

    /// Adds the next component of a cluster; whether it fits into a budget of bits. Where it does not,
    /// nothing has changed.
    fn add(&mut self, i: usize, (matrix, modes): (&Matrix, &Modes), budget: Option<f64>) -> bool {
        let l = self.states[i].met;
        let (unit, sigma) = (&modes.columns[l], modes.sigmas[l]);
        let before = budget.map(|_| {
            (
                self.models.clone(),
                self.states[i].clone(),
                self.writer.clone(),
            )
        });
        let start = self.writer.spent();
        let (models, state, writer) = (&mut self.models, &mut self.states[i], &mut self.writer);
        models.whose(writer, i);
        models.scale(writer, state, sigma);
        let sized = writer.spent();
        let column = models.column(writer, state, Some(unit));
        let based = writer.spent();
        let row = match (state.steps, &self.left[i]) {
            (Steps::Ranges { .. }, _) => matrix.onto(unit),
            (Steps::Even(_), left) => {
                // What suits the column as it is held, and what the components before leave.
                let mut row = left.as_ref().unwrap_or(matrix).onto(&column);
                let square: f64 = column.iter().map(|x| x * x).sum();
                let share = if square > 0.0 { 1.0 / square } else { 0.0 };
                row.iter_mut().for_each(|x| *x *= share);
                row
            }
        };
        let row = models.row(writer, state, &column, Some(&row));
        let end = writer.spent();
        if budget.is_some_and(|budget| self.bits() > budget) {
            if let Some((models, state, writer)) = before {
                (self.models, self.states[i], self.writer) = (models, state, writer);
            }
            return false;
        }
        let left = self.left[i].get_or_insert_with(|| matrix.clone());
        self.errors[i] = left.deflate(&column, &row);
        self.made.range_bits += sized - start;
        self.made.basis_bits += based - sized;
        self.made.coefficient_bits += end - based;
        self.components += 1;
        if self.writer.spent() >= 8.0 * PART {
            self.end();
        }
        true
    }
}

impl Encoded {
    /// Bits of all payloads together.
    pub fn bits_taken(&self) -> f64 {
        let parts: usize = self.parts.iter().map(Vec::len).sum();
        8.0 * (self.window.len() + parts) as f64
    }
}

impl Analysis<'_> {
    /// Codes the window for a goal.
    ///
    /// A squared error is that of the stream as it is decoded where rounding is balanced, and the one
    /// foretold where steps are those of ranges. Errs with the least error to be had where the goal is
    /// below it. A budget of bits below what frames and clusters take leaves no component. Cost:
    /// `V F` for each component of every cluster, and the entropy coder's.
    pub fn encode(&self, goal: Goal) -> Result<Encoded, Floor> {
        let mut level = 0;
        loop {
            let modes = self.modes(level);
            let enough = match goal {
                Goal::Components(l) => modes.iter().all(|m| m.complete || m.sigmas.len() >= l),
                _ => true,
            };
            level += 1;
            if level < LEVELS && !enough {
                continue;
            }
            let plan = self.plan(modes, goal);
            if level == LEVELS || !self.wants_more(modes, &plan, goal) {
                return self.at_level(modes, plan, goal);
            }
        }
    }

    /// Whether a plan takes all modes of some cluster that has more.
    fn wants_more(&self, modes: &[Modes], plan: &Plan, goal: Goal) -> bool {
        if let (Allocate::Uniform, Goal::Components(_)) = (self.params.allocate, goal) {
            return false;
        }
        let pairs = modes.iter().zip(plan.counts());
        pairs
            .into_iter()
            .any(|(modes, count)| !modes.complete && count == modes.sigmas.len())
    }

    /// Codes the window with these modes.
    fn at_level(&self, modes: &[Modes], mut plan: Plan, goal: Goal) -> Result<Encoded, Floor> {
        match goal {
            Goal::Components(_) => Ok(self.stream(modes, &plan, goal)),
            Goal::Bits(budget) => Ok(self.within_bits(modes, plan, budget)),
            Goal::SquaredError(wanted) => {
                for _ in 0..RETRIES {
                    // Where the estimate says it cannot be, the stream might still say otherwise; but
                    // not by far.
                    if plan.squared_error > 2.0 * wanted {
                        break;
                    }
                    let made = self.stream(modes, &plan, goal);
                    let ranges = matches!(plan.steps.first(), Some(Steps::Ranges { .. }));
                    if made.squared_error <= wanted || ranges && plan.taken.is_some() {
                        return Ok(made);
                    }
                    let most = f64::from(Params::MOST_BITS);
                    if self.params.bits.is_some() || plan.bits + 0.25 > most {
                        break;
                    }
                    plan = self.plan_with(modes, &self.costs(modes), plan.bits + 0.25, goal);
                }
                Err(self.floor(modes, &plan, wanted))
            }
        }
    }

    /// Codes the window with at most so many bits.
    ///
    /// Estimated bits are mostly too many by some part; where the steps follow from them, what the
    /// first stream took tells by how much.
    fn within_bits(&self, modes: &[Modes], plan: Plan, budget: f64) -> Encoded {
        let mut best = self.stream(modes, &plan, Goal::Bits(budget));
        if self.params.bits.is_some() && self.params.rounding == Rounding::Balanced {
            return best;
        }
        let (mut plan, mut last) = (plan, best.clone());
        for _ in 0..CORRECTIONS {
            let ratio = self.estimated(modes, plan.bits, &last.components) / last.bits_taken();
            plan = self.plan(modes, Goal::Bits(budget * ratio.clamp(0.5, 4.0)));
            last = self.stream(modes, &plan, Goal::Bits(budget));
            if last.squared_error < best.squared_error {
                best = last.clone();
            }
        }
        best
    }

    /// The least error with the bits at hand, and the bits that the goal takes.
    fn floor(&self, modes: &[Modes], plan: &Plan, wanted: f64) -> Floor {
        let least = |modes: &[Modes], costs: &[Costs], bits: f64| {
            let all = self.plan_with(modes, costs, bits, Goal::SquaredError(0.0));
            all.squared_error
        };
        let mut floor = Floor {
            squared_error: least(modes, &self.costs(modes), plan.bits),
            seed_squared_error: self.seed_squared_error,
            bits: None,
        };
        if self.seed_squared_error > wanted {
            return floor;
        }
        // More bits may need more modes.
        let mut more = plan.bits as u32 + 1..=Params::MOST_BITS;
        for level in 0..LEVELS {
            let modes = self.modes(level);
            let costs = self.costs(modes);
            floor.bits = more.find(|bits| least(modes, &costs, f64::from(*bits)) <= wanted);
            if floor.bits.is_some() || modes.iter().all(|modes| modes.complete) {
                break;
            }
            more = plan.bits as u32 + 1..=Params::MOST_BITS;
        }
        floor
    }

    /// Codes components in the order of a plan, up to the goal.
    fn stream(&self, modes: &[Modes], plan: &Plan, goal: Goal) -> Encoded {
        let head = Head {
            anchor: self.layout.anchor,
            lattice: self.layout.lattice,
            steps: plan.steps.clone(),
        };
        let mut window = head.write();
        let head_bits = 8.0 * window.len() as f64;
        window.extend_from_slice(&self.head);
        let groups = self.layout.groups.iter().zip(&plan.steps);
        let frames = self.layout.frames;
        let mut growing = Growing {
            models: Models::new(self.clusters(), frames),
            states: groups
                .map(|(group, steps)| State::new(group, frames, *steps))
                .collect(),
            left: vec![None; self.clusters()],
            errors: self.matrices.iter().map(Matrix::energy).collect(),
            writer: Writer::new(),
            components: 0,
            made: Encoded {
                window,
                label_bits: self.spent.labels,
                seed_bits: self.spent.tracks,
                range_bits: head_bits,
                clusters: self.clusters(),
                bits: plan.bits,
                ..Encoded::default()
            },
        };
        let budget = match goal {
            Goal::Bits(budget) => Some(budget),
            _ => None,
        };
        // Where a step is that of a range, it is only good for the components that are planned.
        let bound = matches!(plan.steps.first(), Some(Steps::Ranges { .. }));
        let taken = match goal {
            Goal::Components(_) => plan.taken,
            _ => plan.taken.filter(|_| bound),
        };
        let mut frozen = vec![false; self.clusters()];
        for i in &plan.order[..taken.unwrap_or(plan.order.len())] {
            let wanted = match goal {
                Goal::SquaredError(wanted) if !bound => wanted,
                _ => f64::NEG_INFINITY,
            };
            if self.seed_squared_error + growing.errors.iter().sum::<f64>() <= wanted {
                break;
            }
            if !frozen[*i] && !growing.add(*i, (&self.matrices[*i], &modes[*i]), budget) {
                frozen[*i] = true;
            }
        }
        growing.end();
        let mut made = growing.made;
        made.components = growing.states.iter().map(|state| state.met).collect();
        made.squared_error = self.seed_squared_error + growing.errors.iter().sum::<f64>();
        let (left, rounding) = self.foretold(modes, plan, &made.components);
        made.truncation_squared_error = left;
        made.predicted_squared_error = left + rounding + self.foretold_seeds();
        made
    }
}
