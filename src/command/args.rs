//! The command line: subcommands and their options.
#![expect(
    rustdoc::broken_intra_doc_links,
    rustdoc::invalid_html_tags,
    reason = "the comments of options are their help in a terminal"
)]

mod choices;
mod examples;
mod import;
mod init;
mod merge;
mod resume;

pub use choices::{DirectionArg, KeepArg, OutsideArg, PatoHeatArg, TemplateArg};
pub use import::{ImportCommand, PatoArgs, RecordArgs, TableArgs};
pub use init::InitArgs;
pub use merge::{MergeArgs, RepeatArgs};
pub use resume::ResumeArgs;

use crate::command::exit::{Failure, input};
use crate::march::backend_selection::BackendOptions;
use crate::question;
use crate::question::quantity::time;
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
    Observations {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        question: question::Observations,
    },
    /// Temperatures and heat balance at nominal factors, compared with the observations
    #[command(after_long_help = examples::PREDICT)]
    Predict {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        question: question::Predict,
    },
    /// Prediction intervals and sensitivity indices of the factors, by Monte Carlo sampling
    #[command(after_long_help = examples::UNCERTAINTY)]
    Uncertainty {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        question: question::Uncertainty,
        #[command(flatten)]
        failures: FailureArgs,
        #[command(flatten)]
        resume: ResumeArgs,
        /// Write a Parquet file with every member
        #[arg(long, value_enum)]
        keep: Option<KeepArg>,
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
        question: question::Sensitivity,
    },
    /// Factors fitted to observations by least squares, with 95 % confidence intervals
    #[command(after_long_help = examples::ESTIMATE)]
    Estimate {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        question: question::Estimate,
        #[command(flatten)]
        resume: ResumeArgs,
    },
    /// Prediction, uncertainty, sensitivity and estimate in one report
    #[command(after_long_help = examples::STUDY)]
    Study {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        question: question::Study,
        #[command(flatten)]
        failures: FailureArgs,
        #[command(flatten)]
        resume: ResumeArgs,
    },
    /// Thickness of a ply for a temperature limit: nominal, and with a margin for uncertainty
    #[command(after_long_help = examples::SIZE)]
    Size {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        question: question::Size,
        #[command(flatten)]
        failures: FailureArgs,
        #[command(flatten)]
        resume: ResumeArgs,
    },
    /// Layups of all choices of materials, each sized for a temperature limit, by mass per area
    #[command(after_long_help = examples::TRADE)]
    Trade {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        question: question::Trade,
        #[command(flatten)]
        failures: FailureArgs,
        #[command(flatten)]
        resume: ResumeArgs,
    },
    /// The next experiment: depths of thermocouples, exposure and run length for the smallest standard errors
    #[command(after_long_help = examples::DESIGN)]
    Design {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        question: question::Design,
    },
    /// Heating of the hot face over time, from thermocouples (inverse heat conduction)
    #[command(after_long_help = examples::HISTORY)]
    History {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        question: question::History,
    },
    /// Synthetic observations from known factors, or a coverage study of many sets of them
    #[command(
        after_long_help = examples::TWIN,
        mut_arg("out", |out| out.help(
            "CSV file for the observations, or folder for the report of a study [default: measured.csv, \
             out/<case>/twin]"
        )),
        mut_arg("force", |force| force.help(
            "Overwrite an existing file, or a folder that holds the report of another case"
        ))
    )]
    Twin {
        #[command(flatten)]
        case: CaseArgs,
        #[command(flatten)]
        question: question::Twin,
        #[command(flatten)]
        resume: ResumeArgs,
    },
    /// The question of a report, asked again of the case as it was, and the difference of the outputs
    #[command(after_long_help = examples::REPEAT)]
    Repeat(RepeatArgs),
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
    #[arg(id = "limit_time", long = "limit-time", value_name = "TIME", value_parser = time::parse)]
    pub limit_time_s: Option<f64>,
    #[command(flatten)]
    pub march: MarchArgs,
}

/// Members that may fail.
#[derive(Clone, Copy, Debug, Args)]
pub struct FailureArgs {
    /// Maximum number of failed members before exit code 1 [default: 1 % of all]
    #[arg(long)]
    pub max_failed: Option<usize>,
}

/// The device, the precision, and changes to the case.
#[derive(Clone, Debug, Args)]
pub struct MarchArgs {
    #[command(flatten)]
    pub backend: BackendOptions,
    /// Discretisation error for which cells and time steps are chosen, K; `None`: that of the case.
    #[arg(skip)]
    pub tolerance_k: Option<f64>,
    /// Override a key of the case file or the nominal value of a factor; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub sets: Vec<String>,
    /// No progress bar and no remarks
    #[arg(long, short)]
    pub quiet: bool,
}

impl MarchArgs {
    /// Names and values of `--set`.
    pub fn overrides(&self) -> Result<Vec<(String, String)>, Failure> {
        pairs(&self.sets, "--set")
    }
}

/// Names and values of an option that may be repeated, each name once.
pub fn pairs(texts: &[String], option: &str) -> Result<Vec<(String, String)>, Failure> {
    let mut pairs: Vec<(String, String)> = Vec::new();
    for text in texts {
        let expected = || input(format!("{option} {text:?}: expected NAME=VALUE"));
        let (name, value) = text.split_once('=').ok_or_else(expected)?;
        if pairs.iter().any(|(earlier, _)| earlier == name) {
            return Err(input(format!("{option} names {name:?} twice")));
        }
        pairs.push((name.to_owned(), value.to_owned()));
    }
    Ok(pairs)
}
