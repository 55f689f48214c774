//! The grid of settings: all combinations of the values of some knobs.

/// A knob with the values it is to have.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// How many values there are, cheapest first.
    pub count: usize,
    /// The values as numbers, where they are numbers.
    pub numbers: Option<Vec<f64>>,
}

/// All combinations of the values of some knobs.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// The knobs.
    pub axes: Vec<Axis>,
    /// What has no effect: a knob, with a value of another knob.
    pub idle: Vec<Idle>,
}

/// A knob that has no effect where another has a certain value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Idle {
    /// Which knob.
    pub axis: usize,
    /// Which other.
    pub by: usize,
    /// Its value, from 0.
    pub value: usize,
}

impl Grid {
    /// The settings in the order of cost as far as that is known beforehand: none stands before one
    /// that is cheaper in some knob and dearer in none. Each names a value of each knob, from 0; a
    /// knob without effect stays at its first, so that no setting stands there twice.
    pub fn settings(&self) -> Vec<Vec<usize>> {
        let mut all = vec![Vec::new()];
        for axis in &self.axes {
            all = all
                .iter()
                .flat_map(|setting: &Vec<usize>| {
                    (0..axis.count).map(|value| {
                        let mut longer = setting.clone();
                        longer.push(value);
                        longer
                    })
                })
                .collect();
        }
        all.retain(|setting| {
            (0..setting.len()).all(|a| setting[a] == 0 || !self.is_idle(setting, a))
        });
        // The sort is stable: settings of one sum stay in the order of their values.
        all.sort_by_key(|setting| setting.iter().sum::<usize>());
        all
    }

    /// Whether a knob has no effect in a setting.
    pub fn is_idle(&self, setting: &[usize], axis: usize) -> bool {
        let mut idle = self.idle.iter().filter(|idle| idle.axis == axis);
        idle.any(|idle| setting[idle.by] == idle.value)
    }

    /// How much dearer a setting is taken to be than its neighbour one step down an axis while
    /// nothing was seen: numbers are taken to cost by the cube, as a grid does, others double.
    pub(super) fn assumed_growth(&self, axis: usize, setting: &[usize]) -> f64 {
        let at = setting[axis];
        let numbers = self.axes[axis].numbers.as_deref();
        let ratio = numbers.and_then(|n| Some(n.get(at)? / n.get(at.checked_sub(1)?)?));
        match ratio {
            Some(ratio) if ratio.is_finite() && ratio > 1.0 => ratio.powi(3),
            _ => 2.0,
        }
    }
}

/// Place among the settings of the one `steps` down an axis, if there is one.
pub(super) fn step_down(
    settings: &[Vec<usize>],
    from: usize,
    axis: usize,
    steps: usize,
) -> Option<usize> {
    let mut below = settings[from].clone();
    below[axis] = below[axis].checked_sub(steps)?;
    settings.iter().position(|other| *other == below)
}
