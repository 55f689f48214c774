//! What a command found, and whether it is good enough.

use scantle::error::number;
use scantle::report::{Accuracy, Measures, Modelled};

/// What a command found: the part of the report that is its own.
pub struct Found<P, R> {
    pub(crate) parameters: P,
    pub(crate) result: R,
    pub(crate) summary: String,
    pub(crate) accuracy: Option<Measures>,
    pub(crate) modelled: Option<Modelled>,
    check: Option<(&'static str, f64)>,
    beyond: Option<String>,
}

impl<P, R> Found<P, R> {
    /// Parameters and result for the report, and a few words for a person.
    pub fn new(parameters: P, result: R, summary: impl Into<String>) -> Self {
        Found {
            parameters,
            result,
            summary: summary.into(),
            accuracy: None,
            modelled: None,
            check: None,
            beyond: None,
        }
    }

    /// With the error that was made.
    pub fn accuracy(mut self, accuracy: Measures) -> Self {
        self.accuracy = Some(accuracy);
        self
    }

    /// With how much of the full model was built.
    pub fn modelled(mut self, modelled: Modelled) -> Self {
        self.modelled = Some(modelled);
        self
    }

    /// With the check that the error is no larger than what `--OPTION` says, if it says anything.
    pub fn check(mut self, option: &'static str, most: Option<f64>) -> Self {
        self.check = most.map(|most| (option, most));
        self
    }

    /// With what no measure tells, if there is anything: the check fails for it, whatever it allows.
    pub fn beyond_measure(mut self, what: Option<String>) -> Self {
        self.beyond = what;
        self
    }

    /// Why the check fails, if it was asked for and does. It is about the first measure.
    pub(crate) fn failure(&self) -> Option<String> {
        let (option, most) = self.check?;
        if let Some(what) = &self.beyond {
            return Some(format!("{what}, which no --{option} allows"));
        }
        let first = match &self.accuracy {
            Some(Measures::One(accuracy)) => Some(accuracy),
            Some(Measures::Many(all)) => all.first(),
            None => None,
        };
        let Some(Accuracy {
            measure,
            unit,
            bound,
            reached,
            ..
        }) = first
        else {
            return Some(format!("no error is known to compare with --{option}"));
        };
        let (verb, error) = match (reached, bound) {
            (Some(reached), _) => ("is", *reached),
            (None, Some(bound)) => ("may be up to", *bound),
            (None, None) => {
                return Some(format!(
                    "{measure} is neither measured nor bounded; --verify measures it"
                ));
            }
        };
        // Written so that an error which is no number fails too.
        let holds = error <= most;
        let [error, most] = [error, most].map(number);
        (!holds).then(|| format!("{measure} {verb} {error} {unit}, larger than --{option} {most}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(reached: Option<f64>, bound: Option<f64>, most: Option<f64>) -> Found<(), ()> {
        let accuracy = Accuracy {
            measure: "distance".into(),
            unit: "voxel".into(),
            bound,
            reached,
            reference: "sphere".into(),
            verified: reached.is_some(),
        };
        Found::new((), (), "")
            .accuracy(Measures::One(accuracy))
            .check("max-error", most)
    }

    #[test]
    fn the_error_reached_is_checked_and_else_its_bound() {
        assert_eq!(found(Some(2.0), None, None).failure(), None);
        assert_eq!(found(Some(0.5), Some(0.9), Some(0.5)).failure(), None);
        assert_eq!(
            found(Some(0.6), Some(0.9), Some(0.5)).failure().as_deref(),
            Some("distance is 0.6 voxel, larger than --max-error 0.5")
        );
        assert_eq!(
            found(None, Some(0.9), Some(0.5)).failure().as_deref(),
            Some("distance may be up to 0.9 voxel, larger than --max-error 0.5")
        );
        assert!(found(Some(f64::NAN), None, Some(0.5)).failure().is_some());
        assert!(found(None, None, Some(0.5)).failure().is_some());
        let nothing: Found<(), ()> = Found::new((), (), "").check("max-error", Some(1.0));
        assert!(nothing.failure().is_some());
    }

    #[test]
    fn what_no_measure_tells_fails_only_a_check() {
        let beyond = |most| found(Some(0.0), None, most).beyond_measure(Some("x is gone".into()));
        assert_eq!(beyond(None).failure(), None);
        assert_eq!(
            beyond(Some(9.0)).failure().as_deref(),
            Some("x is gone, which no --max-error allows")
        );
        let nothing = found(Some(0.0), None, Some(0.0)).beyond_measure(None);
        assert_eq!(nothing.failure(), None);
    }
}
