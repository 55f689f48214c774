//! `scantle smooth-mc`: a binary volume becomes a smooth surface that keeps every voxel on its side.

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, MaxError, Output, Preview, Verify, list, named};
use clap::value_parser;
use scantle::error::{Error, Result};
use scantle::image::colour::{CLAY, OKABE_ITO};
use scantle::io::format::Kind;
use scantle::measure::smooth_error::{self, SmoothError};
use scantle::mesh::Mesh;
use scantle::numeric::vector::length;
use scantle::render::preview::{self, Panel, What};
use scantle::report::{Accuracy, Measures, Modelled, Warning};
use scantle::volume::isosurface::{self, Border, Select, Surface};
use scantle::volume::smooth_mc::region::Constraint;
use scantle::volume::smooth_mc::{self, Energy, Params, Thin, Update};
use scantle::volume::{Frame, Volume};
use schemars::JsonSchema;
use serde::Serialize;
