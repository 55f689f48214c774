//! The models of a file, one after the other.

use super::result::Solved;
use super::solve::Model;
use crate::job::Job;
use scantle::error::{Error, Fault, Result};
use scantle::protein::Molecule;
use schemars::JsonSchema;
use serde::Serialize;

/// Which models of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Models {
    /// The first.
    First,
    /// Each of them.
    All,
    /// The one of this number.
    Numbered(i32),
}

impl Models {
    /// Those of a word: `first`, `all`, or a number.
    pub fn read(text: &str) -> Result<Models, String> {
        match text {
            "first" => Ok(Models::First),
            "all" => Ok(Models::All),
            number => {
                let number = number.parse().map(Models::Numbered);
                number.map_err(|_| "neither `first`, `all` nor the number of a model".to_owned())
            }
        }
    }

    /// The word for them.
    pub fn name(self) -> String {
        match self {
            Models::First => "first".to_owned(),
            Models::All => "all".to_owned(),
            Models::Numbered(number) => number.to_string(),
        }
    }

    /// Their indices.
    fn of(self, molecule: &Molecule) -> Result<Vec<usize>> {
        let numbers = || molecule.models.iter().map(|model| model.number);
        match self {
            Models::First => Ok((0..molecule.models.len().min(1)).collect()),
            Models::All => Ok((0..molecule.models.len()).collect()),
            Models::Numbered(number) => {
                let at = numbers().position(|other| other == number);
                at.map(|at| vec![at]).ok_or_else(|| {
                    let there: Vec<String> = numbers().map(|n| n.to_string()).collect();
                    let problem = format!("is not there: the models are {}", there.join(", "));
                    Error::parameter("models", number, problem)
                })
            }
        }
    }
}

/// A model that nothing can be found in.
#[derive(Debug, Serialize, JsonSchema)]
pub struct FailedModel {
    /// Index in the file, from 0.
    index: usize,
    /// Number of the model.
    model: i32,
    /// What is wrong with it.
    message: String,
}

/// What was found in the models that were asked for.
pub struct Each {
    /// The first of those that did not fail.
    pub first: Model,
    /// What the report says of it.
    pub own: Solved,
    /// And of those after it.
    pub others: Vec<Solved>,
    /// Those that failed.
    pub failed: Vec<FailedModel>,
}

/// Finds tunnels in each of the models that were asked for.
///
/// Where one fails the others are still due: what is wrong with it is said at the end of the job. Errs where
/// all fail.
pub fn each(
    job: &mut Job,
    molecule: &Molecule,
    models: Models,
    solve: impl Fn(&Job, usize) -> Result<Model>,
) -> Result<Each> {
    let chosen = models.of(molecule)?;
    let is_alone = chosen.len() == 1;
    let (mut found, mut others): (Option<(Model, Solved)>, _) = (None, Vec::new());
    let (mut failed, mut errors) = (Vec::new(), Vec::new());
    for index in chosen {
        match solve(job, index) {
            Ok(model) => {
                let solved = Solved::new(molecule, &model);
                match &found {
                    None => found = Some((model, solved)),
                    Some(_) => others.push(solved),
                }
            }
            Err(error) if is_alone => return Err(error),
            Err(error) => {
                let number = molecule.models[index].number;
                failed.push(FailedModel {
                    index,
                    model: number,
                    message: error.to_string(),
                });
                errors.push(in_model(error, number));
            }
        }
    }
    let Some((first, own)) = found else {
        let last = errors.pop();
        errors.into_iter().for_each(|error| job.set_aside(error));
        let nothing = || Error::Geometry(Fault::whole("holds no model"));
        return Err(last.unwrap_or_else(nothing));
    };
    errors
        .into_iter()
        .for_each(|error| job.set_aside(of_input(error)));
    Ok(Each {
        first,
        own,
        others,
        failed,
    })
}

/// An error that says which model it is about.
fn in_model(error: Error, number: i32) -> Error {
    let told = |problem: String| format!("in model {number}, {problem}");
    match error {
        Error::Geometry(mut fault) => {
            fault.problem = told(fault.problem);
            Error::Geometry(fault)
        }
        Error::Parameter {
            option,
            value,
            problem,
        } => Error::Parameter {
            option,
            value,
            problem: told(problem),
        },
        Error::Limit {
            what,
            needed,
            limit,
            hint,
        } => Error::Limit {
            what: told(what),
            needed,
            limit,
            hint,
        },
        other => other,
    }
}

/// What the command line asks for is there in other models: that it is not in one is a fault of the input.
fn of_input(error: Error) -> Error {
    match error {
        Error::Parameter { .. } => Error::Geometry(Fault::whole(error.to_string())),
        other => other,
    }
}
