//! The command line: subcommands and their options.
#![expect(
    rustdoc::broken_intra_doc_links,
    rustdoc::invalid_html_tags,
    reason = "the comments of options are their help in a terminal"
)]

mod choices;
pub mod convert;
mod design;
mod examples;
mod fit;
mod history;
mod import;
mod init;
mod resume;
mod sweep;
mod twin;

pub use choices::{
    BackendArg, BoundsArg, CriterionArg, DerivativeArg, DirectionArg, KeepArg, MinimiserArg, OutsideArg, PatoHeatArg,
    PrecisionArg, PriorArg, SamplingArg, TemplateArg,
};
pub use design::DesignArgs;
pub use fit::{FitArgs, ObservationArgs, PosteriorArgs};
pub use history::HistoryArgs;
pub use import::{ImportCommand, PatoArgs, RecordArgs, TableArgs};
pub use init::InitArgs;
pub use resume::ResumeArgs;
pub use sweep::{MergeArgs, RequirementArgs, SizeArgs, SweepArgs, TradeArgs};
pub use twin::TwinArgs;

use clap::{Args, CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use std::path::PathBuf;

/// Thermal response of flexible heat shields: prediction, uncertainty, sensitivity, and estimation from thermocouples.
#[derive(Debug, Parser)]
#[command(name = "bondline", version, max_term_width = 100, after_long_help = examples::BONDLINE)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

impl Cli {
    /// The description of the command line, from which completions and manual pages are generated.
    pub fn description() -> clap::Command {
        Self::command()
    }
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// A commented case to start from, written into a folder
    #[command(after_long_help = examples::INIT)]
    Init(InitArgs),
    /// What was read of the measured data: rate, gaps, noise, spikes, stuck and open channels, drift
    #[command(after_long_help = examples::OBSERVATIONS)]
    Observations(CaseArgs),
    /// Temperatures and heat balance at nominal factors, compared with the observations
    #[command(after_long_help = examples::PREDICT)]
    Predict {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        profiles: ProfileArgs,
    },
    /// Prediction intervals and sensitivity indices of the factors, by Monte Carlo sampling
    #[command(after_long_help = examples::UNCERTAINTY)]
    Uncertainty {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        sweep: SweepArgs,
        #[command(flatten)]
        resume: ResumeArgs,
        #[command(flatten)]
        profiles: ProfileArgs,
        /// Draw members, at most -n, until a 95 % interval is as narrow as "TC4 P99 ± 2 K", "P(TC4 > 623 K) ± 0.001"
        /// or "P(TC4 > 623 K) ± 10 %"; +- is ± too
        #[arg(
            long,
            value_name = "TARGET",
            conflicts_with_all = ["part", "piece", "keep", "resume", "checkpoint_interval", "depth_profiles"]
        )]
        until: Option<String>,
        /// Write a Parquet file with every member
        #[arg(long, value_enum)]
        keep: Option<KeepArg>,
        /// Run only members A to B-1 of the -n drawn, and write their statistics to a file for `merge`
        #[arg(
            long = "members",
            value_name = "A..B",
            conflicts_with_all = ["json", "max_failed", "depth_profiles"]
        )]
        part: Option<String>,
        /// Run only piece K of N equal ones, from 1, unless its file is there; in a Slurm job array N is enough
        #[arg(long, value_name = "K/N", conflicts_with_all = ["json", "max_failed", "part"])]
        piece: Option<String>,
    },
    /// The report of a whole sweep, from the parts written by `uncertainty --members`
    #[command(after_long_help = examples::MERGE)]
    Merge(MergeArgs),
    /// Derivatives with respect to the factors, and which factors can be estimated together
    #[command(after_long_help = examples::SENSITIVITY)]
    Sensitivity {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        data: ObservationArgs,
        /// How derivatives are computed [default: tangent; difference if --step is given]
        #[arg(long, value_enum)]
        method: Option<DerivativeArg>,
        /// Relative step of a central difference [default: 1e-5 in f64, 1e-3 in f32]
        #[arg(long)]
        step: Option<f64>,
    },
    /// Factors fitted to observations by least squares, with 95 % confidence intervals
    #[command(after_long_help = examples::ESTIMATE)]
    Estimate {
        #[command(flatten)]
        case: CaseArgs,
        /// Further cases to fit at once; factors of one name that scale the same material are shared
        #[arg(value_name = "CASE", conflicts_with = "compare")]
        others: Vec<PathBuf>,
        #[command(flatten)]
        data: ObservationArgs,
        #[command(flatten)]
        fit: FitArgs,
        #[command(flatten)]
        posterior: PosteriorArgs,
        /// Seed of the MCMC random numbers
        #[arg(long, default_value_t = 1, requires = "posterior")]
        seed: u64,
        /// Fit this case to the same observations too, and compare the misfits of both
        #[arg(long, value_name = "CASE")]
        compare: Option<PathBuf>,
        #[command(flatten)]
        resume: ResumeArgs,
    },
    /// Prediction, uncertainty, sensitivity and estimate in one report
    #[command(after_long_help = examples::STUDY)]
    Study {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        sweep: SweepArgs,
        #[command(flatten)]
        resume: ResumeArgs,
        #[command(flatten)]
        profiles: ProfileArgs,
        #[command(flatten)]
        data: ObservationArgs,
        #[command(flatten)]
        fit: FitArgs,
        #[command(flatten)]
        posterior: PosteriorArgs,
    },
    /// Thickness of a ply for a temperature limit: nominal, and with a margin for uncertainty
    #[command(after_long_help = examples::SIZE)]
    Size {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        size: SizeArgs,
        #[command(flatten)]
        sweep: SweepArgs,
        #[command(flatten)]
        resume: ResumeArgs,
    },
    /// Layups of all choices of materials, each sized for a temperature limit, by mass per area
    #[command(after_long_help = examples::TRADE, mut_arg("members", |members| members.default_value("2000")))]
    Trade {
        #[command(flatten)]
        case: CaseArgs,
        /// Further cases whose exposures every layup must hold too
        #[arg(value_name = "CASE")]
        exposures: Vec<PathBuf>,
        #[command(flatten)]
        trade: TradeArgs,
        #[command(flatten)]
        sweep: SweepArgs,
        #[command(flatten)]
        resume: ResumeArgs,
    },
    /// The next experiment: depths of thermocouples, exposure and run length for the smallest standard errors
    #[command(after_long_help = examples::DESIGN)]
    Design {
        #[command(flatten)]
        case: CaseArgs,
        /// Further cases as alternative exposures of the same factors
        #[arg(value_name = "CASE")]
        others: Vec<PathBuf>,
        #[command(flatten)]
        design: DesignArgs,
    },
    /// Heating of the hot face over time, from thermocouples (inverse heat conduction)
    #[command(after_long_help = examples::HISTORY)]
    History {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        data: ObservationArgs,
        #[command(flatten)]
        history: HistoryArgs,
    },
    /// Synthetic observations from known factors, or a coverage study of many sets of them
    #[command(after_long_help = examples::TWIN)]
    Twin {
        #[command(flatten)]
        twin: TwinArgs,
        #[command(flatten)]
        resume: ResumeArgs,
        #[command(flatten)]
        data: ObservationArgs,
        #[command(flatten)]
        fit: FitArgs,
    },
    /// Vulkan devices, their limits and self-tests, and the choice of `--backend auto`
    #[command(after_long_help = examples::DEVICES)]
    Devices {
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// The material database: list, properties of a material, check and import of material files
    #[command(after_long_help = examples::MATERIALS)]
    Materials {
        #[command(subcommand)]
        action: MaterialsCommand,
    },
    /// Verification table: exact solutions, orders, other codes, balances, GPU against CPU
    #[command(after_long_help = examples::VERIFY)]
    Verify {
        /// Print the table as JSON
        #[arg(long)]
        json: bool,
        /// Only the rows of this group: exact, orders, codes, adapted, balance, fit, coverage or cross-backend
        #[arg(long)]
        group: Option<String>,
        #[command(flatten)]
        march: MarchArgs,
    },
    /// Completion script of a shell, on standard output
    #[command(after_long_help = examples::COMPLETIONS)]
    Completions {
        /// The shell
        shell: Shell,
    },
    /// Manual pages, one per command, written into a folder
    #[command(after_long_help = examples::MAN)]
    Man {
        /// Folder for the pages, which is created if it does not exist
        folder: PathBuf,
    },
}

#[derive(Debug, Subcommand)]
pub enum MaterialsCommand {
    /// All built-in materials, one per line
    #[command(after_long_help = examples::MATERIALS_LIST)]
    List,
    /// Tables, curves and sources of one material
    #[command(after_long_help = examples::MATERIALS_SHOW)]
    Show {
        /// Name of the material, as `list` prints it
        name: String,
    },
    /// Errors of a material file, with line and column
    #[command(after_long_help = examples::MATERIALS_CHECK)]
    Check {
        /// The material file
        file: PathBuf,
    },
    /// A material file from a table or from the files of another program
    #[command(after_long_help = examples::MATERIALS_IMPORT)]
    Import {
        #[command(subcommand)]
        from: Box<ImportCommand>,
    },
}

/// The case, the output, and how the case is computed.
#[derive(Debug, Args)]
pub struct CaseArgs {
    /// Case file, or folder with a case.toml
    pub case: PathBuf,
    /// Folder for the report [default: out/<case>/<command>]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Overwrite a folder that holds the report of another case
    #[arg(long)]
    pub force: bool,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
    /// End after this time, such as "2 h": a sweep with the members so far, other studies without an answer
    #[arg(long, value_name = "TIME")]
    pub limit_time: Option<String>,
    #[command(flatten)]
    pub march: MarchArgs,
}

/// Profiles through the thickness.
#[derive(Debug, Args)]
pub struct ProfileArgs {
    /// Profiles through the thickness at these times, as "10s,40s", or at a number of evenly spaced times
    #[arg(long, value_name = "TIMES")]
    pub depth_profiles: Option<String>,
}

/// The device, the precision, and changes to the case.
#[derive(Clone, Debug, Args)]
pub struct MarchArgs {
    /// Device that integrates the members in time
    #[arg(long, value_enum, default_value = "auto")]
    pub backend: BackendArg,
    /// Floating-point precision [default: f64 on the CPU, f32 on a GPU]
    #[arg(long, value_enum)]
    pub precision: Option<PrecisionArg>,
    /// Part of the name of the Vulkan device to use
    #[arg(long)]
    pub device: Option<String>,
    /// SIMD instruction set of the CPU: avx-512, avx2, neon or scalar, for tests and measurements
    #[arg(long, value_name = "NAME", hide = true)]
    pub instruction_set: Option<String>,
    /// Override a key of the case file or the nominal value of a factor; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub sets: Vec<String>,
    /// No progress bar and no remarks
    #[arg(long, short)]
    pub quiet: bool,
}
