//! What a stream is asked to be.

use super::local::{self, Allocate, Frame, Rounding};
use crate::error::{Error, Result};

/// How the motion is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The shortest of `trajectory` and `delta`.
    Auto,
    /// Components of all trajectories over the mesh.
    Trajectory,
    /// The paper's: clusters that move with frames of their own, principal components in each.
    Rlpca,
    /// Clusters as in `rlpca`, without frames.
    Lpca,
    /// Principal components of all vertices together.
    Pca,
    /// Every frame from the one before.
    Delta,
}

impl Method {
    /// All, by name.
    pub const NAMES: &[&str] = &["auto", "trajectory", "rlpca", "lpca", "pca", "delta"];
    const ALL: [Method; 6] = [
        Method::Auto,
        Method::Trajectory,
        Method::Rlpca,
        Method::Lpca,
        Method::Pca,
        Method::Delta,
    ];

    /// Lower-case name.
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// From where clusters are seen, for the methods that have any.
    pub fn space(self) -> Option<local::Space> {
        match self {
            Method::Rlpca => Some(local::Space::Relative),
            Method::Lpca => Some(local::Space::World),
            Method::Pca => Some(local::Space::Whole),
            Method::Auto | Method::Trajectory | Method::Delta => None,
        }
    }

    /// The method of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        let at = Self::NAMES.iter().position(|n| *n == name)?;
        Some(Self::ALL[at])
    }
}

impl Frame {
    /// All, by name.
    pub const NAMES: &[&str] = &["seed", "wide"];

    /// Lower-case name.
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// The one of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        let all = [Frame::Seed, Frame::Wide];
        all.into_iter().find(|frame| frame.name() == name)
    }
}

impl Allocate {
    /// All, by name.
    pub const NAMES: &[&str] = &["rd", "paper", "uniform"];

    /// Lower-case name.
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// The one of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        let all = [Allocate::RateDistortion, Allocate::Paper, Allocate::Uniform];
        all.into_iter().find(|allocate| allocate.name() == name)
    }
}

impl Rounding {
    /// All, by name.
    pub const NAMES: &[&str] = &["balanced", "ranges"];

    /// Lower-case name.
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// The one of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        let all = [Rounding::Balanced, Rounding::Ranges];
        all.into_iter().find(|rounding| rounding.name() == name)
    }
}

/// What decides the accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// Error of Karni and Gotsman about each frame's centroid, in percent, at most.
    Kg(f64),
    /// Root of the mean squared distance of a vertex, in the unit of the coordinates, at most.
    Rmse(f64),
    /// Distance of every vertex in every frame, in the unit of the coordinates, at most.
    Max(f64),
    /// Bits per vertex and frame, without those of the faces, at most.
    Bpvf(f64),
}

impl Target {
    /// The number asked for.
    pub fn value(self) -> f64 {
        match self {
            Target::Kg(x) | Target::Rmse(x) | Target::Max(x) | Target::Bpvf(x) => x,
        }
    }

    /// The long option that asks for it, without dashes.
    pub fn option(self) -> &'static str {
        match self {
            Target::Kg(_) => "target-kg",
            Target::Rmse(_) => "target-rmse",
            Target::Max(_) => "target-max",
            Target::Bpvf(_) => "target-bpvf",
        }
    }
}

/// How clusters are made and coded, for the methods that have them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clusters {
    /// How many there are; none tries several and takes what is shortest.
    pub count: Option<usize>,
    /// Components of every cluster, or as many in all as that makes; it stands for the target.
    pub components: Option<usize>,
    /// Bits of the numbers of components; none chooses them.
    pub bits: Option<u32>,
    /// The triangles that carry frames of reference.
    pub frame: Frame,
    /// How components are shared out.
    pub allocate: Allocate,
    /// How numbers of components are rounded.
    pub rounding: Rounding,
}

/// What a stream is asked to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Params {
    /// How the motion is told.
    pub method: Method,
    /// What decides the accuracy.
    pub target: Target,
    /// Frames that are told together, at most; a range of frames is decoded from the windows that
    /// hold it.
    pub window: usize,
    /// Clusters, for `rlpca` and `lpca`; of `pca` the components and bits.
    pub clusters: Clusters,
}

impl Params {
    /// A tenth of a percent, by the shortest method.
    pub const DEFAULT: Params = Params {
        method: Method::Auto,
        target: Target::Kg(0.1),
        window: 256,
        clusters: Clusters {
            count: None,
            components: None,
            bits: None,
            frame: Frame::Wide,
            allocate: Allocate::RateDistortion,
            rounding: Rounding::Balanced,
        },
    };

    /// Errs where a value is out of range.
    pub fn check(&self) -> Result<()> {
        let (option, value) = (self.target.option(), self.target.value());
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::parameter(option, value, "must be above 0"));
        }
        if !(1..=1024).contains(&self.window) {
            return Err(Error::parameter(
                "window",
                self.window,
                "must be between 1 and 1024",
            ));
        }
        let Clusters {
            count,
            components,
            bits,
            ..
        } = self.clusters;
        if components == Some(0) {
            return Err(Error::parameter("components", 0, "must be 1 or more"));
        }
        if count == Some(0) {
            return Err(Error::parameter("clusters", 0, "must be 1 or more"));
        }
        let range = 2..=local::Params::MOST_BITS;
        if let Some(bits) = bits.filter(|bits| !range.contains(bits)) {
            let problem = format!("must be between 2 and {}", local::Params::MOST_BITS);
            return Err(Error::parameter("bits", bits, problem));
        }
        Ok(())
    }
}
