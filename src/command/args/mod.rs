//! The command line: subcommands and their options.

pub(crate) mod convert;
mod fit;
mod trace;

pub(crate) use fit::Fit;
pub(crate) use trace::Trace;

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Thermal response of flexible heat shields: predict it, say how uncertain it is, and fit it to thermocouples.
#[derive(Debug, Parser)]
#[command(name = "bondline", version, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// March the case at its nominal factors and hold it against its observations
    Predict(Ask),
    /// Monte Carlo over the factors: spreads, and the factors' shares in them
    Uncertainty {
        #[command(flatten)]
        ask: Ask,
        #[command(flatten)]
        sweep: Sweep,
        /// What to keep of every member: factors and peaks, or the traces too
        #[arg(long, value_enum)]
        keep: Option<Keep>,
        /// March a piece, members A to B less one of the -n drawn, and leave its statistics for `merge`
        #[arg(long = "members", value_name = "A..B", conflicts_with_all = ["json", "max_failed"])]
        piece: Option<String>,
    },
    /// Put the pieces that `uncertainty --members` left together: the report of the whole sweep
    Merge(Merge),
    /// Derivatives of every temperature by every factor, and which factors can be estimated together
    Sensitivity {
        #[command(flatten)]
        ask: Ask,
        #[command(flatten)]
        data: Trusted,
        /// How to differentiate [default: tangent, difference where a step is given]
        #[arg(long, value_enum)]
        method: Option<Method>,
        /// Relative step of a difference [default: 1e-5 in f64, 1e-3 in f32]
        #[arg(long)]
        step: Option<f64>,
    },
    /// Fit factors to the observations by Levenberg-Marquardt
    Estimate {
        #[command(flatten)]
        ask: Ask,
        /// Further cases to fit at once: what they mean by a factor of one name is one factor
        #[arg(value_name = "CASE", conflicts_with = "beside")]
        others: Vec<PathBuf>,
        #[command(flatten)]
        data: Trusted,
        #[command(flatten)]
        fit: Fit,
        #[command(flatten)]
        walk: Walk,
        /// The same seed walks the same way
        #[arg(long, default_value_t = 1, requires = "posterior")]
        seed: u64,
        /// Fit this case to the same observations too, and tell what its physics explains
        #[arg(long, value_name = "CASE")]
        beside: Option<PathBuf>,
    },
    /// Predict, uncertainty, sensitivity and estimate in one report
    Study {
        #[command(flatten)]
        ask: Ask,
        #[command(flatten)]
        sweep: Sweep,
        #[command(flatten)]
        data: Trusted,
        #[command(flatten)]
        fit: Fit,
        #[command(flatten)]
        walk: Walk,
    },
    /// How thick a ply must be for a sensor to stay below its limit, and what uncertainty adds to that
    Size {
        #[command(flatten)]
        ask: Ask,
        #[command(flatten)]
        limit: Limit,
        #[command(flatten)]
        sweep: Sweep,
    },
    /// How the hot face was heated: a flux or a gas temperature through time, from what sensors read (inverse heat conduction)
    History {
        #[command(flatten)]
        ask: Ask,
        #[command(flatten)]
        data: Trusted,
        #[command(flatten)]
        trace: Trace,
    },
    /// Make synthetic observations from known factors, or make many and fit them all
    Twin {
        #[command(flatten)]
        twin: Twin,
        #[command(flatten)]
        data: Trusted,
        #[command(flatten)]
        fit: Fit,
    },
    /// Vulkan adapters, their limits and self-tests, and what `--backend auto` takes
    Devices {
        /// The same as JSON
        #[arg(long)]
        json: bool,
    },
    /// The material database
    Materials {
        #[command(subcommand)]
        look: Materials,
    },
    /// Hold the march against exact solutions, other codes and itself
    Verify {
        /// The table as JSON
        #[arg(long)]
        json: bool,
        /// Only rows of this group: exact, orders, codes, adapted, balance, fit or twins
        #[arg(long)]
        group: Option<String>,
        #[command(flatten)]
        on: On,
    },
}

#[derive(Debug, Subcommand)]
pub(crate) enum Materials {
    /// One line a material
    List,
    /// Tables, curves and sources of one
    Show { name: String },
    /// Find the faults of a material file
    Check { file: PathBuf },
}

/// A question about a case.
#[derive(Debug, Args)]
pub(crate) struct Ask {
    /// Case file, or folder with case.toml
    pub case: PathBuf,
    /// Folder for the report [default: out/<case>/<command>]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Overwrite a folder that holds another case
    #[arg(long)]
    pub force: bool,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub on: On,
}

/// Pieces of one sweep.
#[derive(Debug, Args)]
pub(crate) struct Merge {
    /// Files that `uncertainty --members` left, in any order
    #[arg(required = true)]
    pub pieces: Vec<PathBuf>,
    /// Where the case lies now [default: where it lay when it was marched]
    #[arg(long)]
    pub case: Option<PathBuf>,
    /// Folder for the report [default: out/<case>/merge]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Overwrite a folder that holds another case
    #[arg(long)]
    pub force: bool,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
    /// Failed members that are put up with before the exit code says so [default: one in a hundred]
    #[arg(long)]
    pub max_failed: Option<usize>,
}

/// What marches, and with which changes to the case.
#[derive(Clone, Debug, Args)]
pub(crate) struct On {
    /// What marches
    #[arg(long, value_enum, default_value = "auto")]
    pub backend: BackendKind,
    /// Arithmetic [default: f64 on the processor, f32 on a GPU]
    #[arg(long, value_enum)]
    pub precision: Option<PrecisionKind>,
    /// Part of the name of the Vulkan device to take
    #[arg(long)]
    pub device: Option<String>,
    /// Change the case: a factor's nominal value or a key of the file, as NAME=VALUE; may be given often
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub sets: Vec<String>,
    /// No progress and no remarks
    #[arg(long, short)]
    pub quiet: bool,
}

/// A sweep over the factors.
#[derive(Debug, Args)]
pub(crate) struct Sweep {
    /// Members to draw and march
    #[arg(short = 'n', value_name = "MEMBERS", default_value_t = 5000)]
    pub members: usize,
    /// How members are drawn within the side constraints
    #[arg(long, value_enum, default_value = "normal")]
    pub sampling: SamplingKind,
    /// The same seed draws the same members
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Failed members that are put up with before the exit code says so [default: one in a hundred]
    #[arg(long)]
    pub max_failed: Option<usize>,
    /// Side constraints to draw between [default: small]
    #[arg(long, value_enum)]
    pub spread: Option<BoundsKind>,
}

/// What is to be held by which ply.
#[derive(Debug, Args)]
pub(crate) struct Limit {
    /// The ply to size, or a group whose plies are stretched alike
    #[arg(long)]
    pub ply: String,
    /// What is to stay cool, as "TC4 < 623 K": its highest temperature over the run counts
    #[arg(long)]
    pub limit: String,
    /// The share of members that are to hold the limit
    #[arg(long, default_value_t = 0.99)]
    pub probability: f64,
    /// Thinnest and thickest allowed, as "3 mm:20 mm" [default: a quarter of what is drawn to four times that]
    #[arg(long)]
    pub between: Option<String>,
}

/// Observations to make; and with `--study` what is asked of them, with the options of `estimate`.
#[derive(Debug, Args)]
pub(crate) struct Twin {
    /// Case file, or folder with case.toml
    pub case: PathBuf,
    /// True factors, as NAME=VALUE,...; the others stay nominal
    #[arg(long, value_delimiter = ',', conflicts_with = "study")]
    pub truth: Vec<String>,
    /// Standard deviation of the noise, with its unit [default: 0 K; of a study that of the observations]
    #[arg(long)]
    pub noise: Option<String>,
    /// Time over which noise forgets itself, with its unit: it correlates by exp(-t/this) [default: at once]
    #[arg(long)]
    pub correlation: Option<String>,
    /// Fit so many data sets, of truths drawn between the small side constraints, and tell how often intervals hold them
    #[arg(long, value_name = "N")]
    pub study: Option<usize>,
    /// The same seed makes the same truths and noise [default: 1]
    #[arg(long)]
    pub seed: Option<u64>,
    /// CSV file to write, or folder for the report of a study [default: measured.csv, out/<case>/twin]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Overwrite an existing file, or a folder that holds another case
    #[arg(long)]
    pub force: bool,
    /// Print the summary of a study as JSON
    #[arg(long, requires = "study")]
    pub json: bool,
    #[command(flatten)]
    pub on: On,
}

/// Which data to trust; the case file says what is not given.
#[derive(Debug, Args)]
pub(crate) struct Trusted {
    /// Sensors, as TC3,TC4
    #[arg(long, value_delimiter = ',')]
    pub sensors: Vec<String>,
    /// Start and end in seconds, as 0:80, of every sensor, whatever window it has of its own
    #[arg(long)]
    pub window: Option<String>,
    /// Side constraints of the factors
    #[arg(long, value_enum)]
    pub bounds: Option<BoundsKind>,
}

/// How likely the values of what is fitted are.
#[derive(Debug, Args)]
pub(crate) struct Walk {
    /// Draw factors as often as they are likely, by an ensemble of walkers: intervals of any shape, bands of every sensor
    #[arg(long)]
    pub posterior: bool,
    /// Walkers, half of which march at a time
    #[arg(long, default_value_t = 2000, requires = "posterior")]
    pub walkers: usize,
    /// Moves of each walker
    #[arg(long, default_value_t = 500, requires = "posterior")]
    pub moves: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum BackendKind {
    /// A hardware GPU where there is one and the work is worth it, else the processor
    Auto,
    /// The processor
    Cpu,
    /// Any Vulkan device, software too
    Gpu,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PrecisionKind {
    F32,
    F64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SamplingKind {
    /// Normal, two standard deviations to each side constraint, cut off there
    Normal,
    Uniform,
    /// Latin hypercube
    Lhs,
    /// Scrambled Sobol sequence
    Sobol,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum BoundsKind {
    Small,
    Large,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PriorKind {
    /// Nothing: the data alone speak
    None,
    Small,
    Large,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Minimiser {
    /// Steps within a radius that their gain moves
    TrustRegion,
    /// The paper's: ten times the damping after a failure, a tenth after a success
    Paper,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Method {
    /// Exact, marched beside the temperatures
    Tangent,
    /// Central differences, the paper's
    Difference,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Keep {
    Members,
    Traces,
}
