//! `scantle schema`: the JSON Schema of the reports.

use crate::exit::Exit;
use crate::streams::print;
use crate::{
    compare, compress_anim, convert, drape, formats, info, isosurface, shadow, smooth_mc,
    splat_gen, splat_trace, stability, tradeoff, tunnels, vector_overlay, voxelize, words,
};
use clap::builder::PossibleValuesParser;
use scantle::error::Result;
use scantle::report::Report;
use schemars::{Schema, schema_for};
use serde_json::Value;

/// Print the JSON Schema of a command's report
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// The command; without it, the schema of what all reports have in common
    #[arg(value_name = "COMMAND", value_parser = PossibleValuesParser::new(SCHEMAS.iter().map(|(name, _)| *name)))]
    command: Option<String>,
}

const EXAMPLES: &str = "\
Examples:
  scantle schema info
  scantle schema
";

/// A command, and how the schema of its document is made.
type Row = (&'static str, fn() -> Schema);

/// The schema of every command that prints JSON.
const SCHEMAS: &[Row] = &[
    ("compare", || schema_for!(compare::Report)),
    ("compress-anim", || schema_for!(compress_anim::Report)),
    ("convert", || schema_for!(convert::Report)),
    ("formats", || schema_for!(formats::Table)),
    ("info", || schema_for!(info::Report)),
    ("isosurface", || schema_for!(isosurface::Report)),
    ("tunnels", || schema_for!(tunnels::Report)),
    ("shadow", || schema_for!(shadow::Report)),
    ("smooth-mc", || schema_for!(smooth_mc::Report)),
    ("splat-gen", || schema_for!(splat_gen::Report)),
    ("splat-trace", || schema_for!(splat_trace::Report)),
    ("vector-overlay", || schema_for!(vector_overlay::Report)),
    ("drape", || schema_for!(drape::Report)),
    ("stability", || schema_for!(stability::Report)),
    ("tradeoff", || schema_for!(tradeoff::Report)),
    ("voxelize", || schema_for!(voxelize::Report)),
];

/// Prints it.
pub fn run(args: &Args) -> Result<Exit> {
    let name = args.command.as_deref();
    let row = SCHEMAS.iter().find(|(row, _)| Some(*row) == name);
    let schema = match row {
        Some((_, make)) => make(),
        None => schema_for!(Report<Value, Value>),
    };
    print(&words::json(&schema, true))?;
    Ok(Exit::Done)
}
