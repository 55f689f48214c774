//! Which cluster gets the next component.

/// Ways to share out that are all tried.
const FEW: usize = 5000;
/// Changes of [`refined`] at most.
const CHANGES: usize = 60;
/// The share of a budget that its sums may be rounded by.
const SLACK: f64 = 1e-9;

/// What a cluster costs and errs with 0, 1, 2, ... components.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// The cost; never falls.
    pub rate: Vec<f64>,
    /// The error.
    pub distortion: Vec<f64>,
}

/// Components that one cluster gets at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The cluster.
    pub cluster: usize,
    /// How many it has then.
    pub components: usize,
    /// What they cost.
    pub rate: f64,
    /// What they take off the error.
    pub gain: f64,
}

impl Curve {
    /// The corners of the lower convex hull from `start` components on, as far as the error falls.
    fn hull(&self, start: usize) -> Vec<usize> {
        let mut corners: Vec<usize> = Vec::new();
        for l in start..self.rate.len() {
            while let [.., a, b] = corners[..] {
                // Whether `b` is on or above the line from `a` to `l`.
                let (rate, error) = (&self.rate, &self.distortion);
                let up = (error[b] - error[a]) * (rate[l] - rate[a]);
                if up < (error[l] - error[a]) * (rate[b] - rate[a]) {
                    break;
                }
                corners.pop();
            }
            match corners.last() {
                Some(last) if self.distortion[l] >= self.distortion[*last] => {}
                _ => corners.push(l),
            }
        }
        corners
    }
}

/// All steps along the hulls of all clusters, the one that gains most for its cost first; of equals that
/// of the lower cluster. Every cluster begins with `start` components or all it has.
///
/// Source: section 3.4 of the paper named in [`super`], after P. Westerink, J. Biemond, D. Boekee,
/// "An optimal bit allocation algorithm for sub-band coding" (1988).
pub fn steps(curves: &[Curve], start: usize) -> Vec<Step> {
    let mut all: Vec<(f64, Step)> = Vec::new();
    for (cluster, curve) in curves.iter().enumerate() {
        let start = start.min(curve.rate.len().saturating_sub(1));
        let mut slope = f64::INFINITY;
        for pair in curve.hull(start).windows(2) {
            let step = Step {
                cluster,
                components: pair[1],
                rate: curve.rate[pair[1]] - curve.rate[pair[0]],
                gain: curve.distortion[pair[0]] - curve.distortion[pair[1]],
            };
            // Rounding must not put a later step of a cluster first.
            slope = slope.min(step.gain / step.rate);
            all.push((slope, step));
        }
    }
    all.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    all.into_iter().map(|(_, step)| step).collect()
}

/// The numbers of components that a budget allows.
///
/// A step that does not fit is not taken, and its cluster gets no more; the others go on.
pub fn within(curves: &[Curve], start: usize, budget: f64) -> Vec<usize> {
    let last = |curve: &Curve| curve.rate.len().saturating_sub(1);
    let mut chosen: Vec<usize> = curves.iter().map(|c| start.min(last(c))).collect();
    let mut spent = spent(curves, &chosen);
    let mut frozen = vec![false; curves.len()];
    for step in steps(curves, start) {
        if frozen[step.cluster] {
            continue;
        }
        if spent + step.rate <= budget * (1.0 + SLACK) {
            spent += step.rate;
            chosen[step.cluster] = step.components;
        } else {
            frozen[step.cluster] = true;
        }
    }
    chosen
}

/// Numbers of components within the same budget whose error is no larger.
///
/// Where there are few ways to share out, the best of all; or else, as long as it helps, one cluster
/// gives some up, or none, and another takes as many as fit then. Cost: [`FEW`] ways, or for each of at
/// most [`CHANGES`] changes the squared number of clusters times components.
pub fn refined(curves: &[Curve], chosen: Vec<usize>, budget: f64) -> Vec<usize> {
    let ways = curves
        .iter()
        .fold(1usize, |ways, c| ways.saturating_mul(c.rate.len().max(1)));
    match ways <= FEW {
        true => best_of_all(curves, chosen, budget),
        false => exchanged(curves, chosen, budget),
    }
}

/// The best of all ways to share out; the one given where none is better.
fn best_of_all(curves: &[Curve], mut best: Vec<usize>, budget: f64) -> Vec<usize> {
    let error = |chosen: &[usize]| -> f64 {
        let pairs = curves.iter().zip(chosen);
        pairs
            .map(|(c, l)| c.distortion.get(*l).copied().unwrap_or(0.0))
            .sum()
    };
    let mut least = error(&best);
    let mut chosen = vec![0; curves.len()];
    loop {
        if spent(curves, &chosen) <= budget * (1.0 + SLACK) && error(&chosen) < least {
            least = error(&chosen);
            best.clone_from(&chosen);
        }
        // The next number whose digits are those of the clusters.
        let ends = |i: &usize| chosen[*i] + 1 >= curves[*i].rate.len();
        let Some(place) = (0..curves.len()).find(|i| !ends(i)) else {
            return best;
        };
        chosen[..place].fill(0);
        chosen[place] += 1;
    }
}

fn exchanged(curves: &[Curve], mut chosen: Vec<usize>, budget: f64) -> Vec<usize> {
    for _ in 0..CHANGES {
        let free = budget * (1.0 + SLACK) - spent(curves, &chosen);
        let mut best: Option<(f64, [(usize, usize); 2])> = None;
        for (i, giver) in curves.iter().enumerate() {
            let Some(&given) = giver.rate.get(chosen[i]) else {
                continue;
            };
            for (less, rate) in giver.rate[..=chosen[i]].iter().enumerate() {
                let room = free + given - rate;
                let loss = giver.distortion[less] - giver.distortion[chosen[i]];
                for (j, taker) in curves
                    .iter()
                    .enumerate()
                    .filter(|(j, c)| *j != i && !c.rate.is_empty())
                {
                    let from = taker.rate[chosen[j]];
                    let more = taker.rate.partition_point(|rate| rate - from <= room);
                    let Some(more) = more.checked_sub(1).filter(|more| *more > chosen[j]) else {
                        continue;
                    };
                    let gain = taker.distortion[chosen[j]] - taker.distortion[more] - loss;
                    let least = 1e-9 * taker.distortion[0].abs();
                    if gain > least && best.is_none_or(|(most, _)| gain > most) {
                        best = Some((gain, [(i, less), (j, more)]));
                    }
                }
            }
        }
        // One alone has nobody to take from.
        let Some((_, changes)) = best else {
            break;
        };
        for (i, l) in changes {
            chosen[i] = l;
        }
    }
    chosen
}

fn spent(curves: &[Curve], chosen: &[usize]) -> f64 {
    let rates = curves
        .iter()
        .zip(chosen)
        .map(|(c, l)| c.rate.get(*l).copied().unwrap_or(0.0));
    rates.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    fn random(rng: &mut Rng, squared: bool) -> Curve {
        let rate = rng.range(50.0, 400.0);
        let decay = rng.range(0.2, 0.8);
        let first = rng.range(1.0, 100.0);
        let sigmas: Vec<f64> = (0..8)
            .map(|l| first * decay.powi(l) * rng.range(0.7, 1.3))
            .collect();
        let left = |l: usize| sigmas[l..].iter().sum::<f64>() + 0.01;
        Curve {
            rate: (0..=8)
                .map(|l| if squared { rate * l as f64 } else { l as f64 })
                .collect(),
            distortion: (0..=8)
                .map(|l| if squared { left(l) } else { left(l).sqrt() })
                .collect(),
        }
    }

    fn sums(curves: &[Curve], chosen: &[usize]) -> (f64, f64) {
        let pairs = curves.iter().zip(chosen);
        pairs.fold((0.0, 0.0), |(r, d), (c, l)| {
            (r + c.rate[*l], d + c.distortion[*l])
        })
    }

    #[test]
    fn never_over_the_budget_and_close_to_the_best_of_all() {
        let mut rng = Rng::new(8, 0);
        let (mut worst, mut sum) = (0.0f64, 0.0);
        for _ in 0..200 {
            let curves: Vec<Curve> = (0..3).map(|_| random(&mut rng, true)).collect();
            let all = sums(&curves, &[8; 3]).0;
            let budget = all * rng.range(0.1, 0.9);
            let greedy = within(&curves, 0, budget);
            let (spent, error) = sums(&curves, &exchanged(&curves, greedy.clone(), budget));
            assert!(spent <= budget * (1.0 + 1e-9), "{spent} of {budget}");
            let (spent, least) = sums(&curves, &refined(&curves, greedy, budget));
            assert!(spent <= budget * (1.0 + 1e-9), "{spent} of {budget}");
            let mut best = f64::INFINITY;
            for code in 0..729 {
                let (r, d) = sums(&curves, &[code / 81, code / 9 % 9, code % 9]);
                if r <= budget {
                    best = best.min(d);
                }
            }
            assert!(least <= best * (1.0 + 1e-9), "{least} {best}");
            worst = worst.max(error / best);
            sum += error / best / 200.0;
        }
        assert!(worst < 1.1 && sum < 1.005, "{sum} {worst}");
    }

    #[test]
    fn where_a_corner_of_the_hull_fits_exactly_it_is_the_best() {
        let mut rng = Rng::new(9, 0);
        for _ in 0..50 {
            let curves: Vec<Curve> = (0..3).map(|_| random(&mut rng, true)).collect();
            let mut chosen = [0; 3];
            for step in steps(&curves, 0) {
                chosen[step.cluster] = step.components;
                let (budget, error) = sums(&curves, &chosen);
                for code in 0..729 {
                    let (r, d) = sums(&curves, &[code / 81, code / 9 % 9, code % 9]);
                    assert!(r > budget * (1.0 - 1e-9) || d >= error * (1.0 - 1e-9));
                }
            }
        }
    }

    #[test]
    fn the_way_of_the_paper_by_hand() {
        // Roots of errors against counts, from one component on. Hulls: the first 1, 2, 3, 4; the
        // second 1, 3, 4, as 2 is above the line from 1 to 3.
        let count = |errors: &[f64]| Curve {
            rate: (0..errors.len()).map(|l| l as f64).collect(),
            distortion: errors.to_vec(),
        };
        let curves = [
            count(&[99.0, 10.0, 6.0, 4.0, 3.0]),
            count(&[50.0, 12.0, 11.0, 5.0, 4.5]),
        ];
        let order: Vec<(usize, usize)> = steps(&curves, 1)
            .iter()
            .map(|s| (s.cluster, s.components))
            .collect();
        // Slopes -4, -3.5 (twice one), -2, -1, -0.5.
        assert_eq!(order, [(0, 2), (1, 3), (0, 3), (0, 4), (1, 4)]);
        assert_eq!(within(&curves, 1, 2.0), [1, 1]);
        assert_eq!(within(&curves, 1, 3.0), [2, 1]);
        // The two of the second cluster do not fit: it is left, and the first goes on.
        assert_eq!(within(&curves, 1, 4.0), [3, 1]);
        assert_eq!(within(&curves, 1, 5.0), [2, 3]);
        assert_eq!(within(&curves, 1, 6.0), [3, 3]);
        assert_eq!(within(&curves, 1, 100.0), [4, 4]);
    }

    #[test]
    fn clusters_without_components_get_none() {
        let empty = Curve {
            rate: vec![0.0],
            distortion: vec![0.0],
        };
        assert_eq!(within(&[empty.clone(), Curve::default()], 1, 10.0), [0, 0]);
        assert!(steps(&[empty], 0).is_empty());
    }
}
