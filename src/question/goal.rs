//! Which members of a sweep are marched.

use super::quantity;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// The end of a sweep.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "GoalOptions", into = "GoalOptions")]
pub enum Goal {
    /// All members are drawn.
    #[default]
    Whole,
    /// Members are drawn, at most all, until the 95 % interval of a percentile or of a probability is narrow enough:
    /// `TC4 P99 ± 2 K`.
    Until(String),
    /// The first of some members, and one past the last.
    Part(Range<usize>),
    /// The piece of this number, from 1, of so many equal ones.
    Piece {
        /// The number of the piece, from 1.
        number: usize,
        /// The number of pieces.
        pieces: usize,
    },
}

/// The options of a goal, of which at most one is given.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default)]
struct GoalOptions {
    /// Draw members, at most -n, until a 95 % interval is as narrow as "TC4 P99 ± 2 K", "P(TC4 > 623 K) ± 0.001" or
    /// "P(TC4 > 623 K) ± 10 %"; +- is ± too
    #[cfg_attr(
        feature = "command",
        arg(
            long,
            value_name = "TARGET",
            conflicts_with_all = ["part", "piece", "keep", "resume", "checkpoint_interval", "depth_profiles"]
        )
    )]
    until: Option<String>,
    /// Run only members A to B-1 of the -n drawn, and write their statistics to a file for `merge`
    #[cfg_attr(
        feature = "command",
        arg(
            long = "members",
            value_name = "A..B",
            conflicts_with_all = ["json", "max_failed", "depth_profiles"]
        )
    )]
    #[serde(with = "quantity::text")]
    part: Option<MemberRange>,
    /// Run only piece K of N equal ones, from 1, unless its file is there; in a Slurm job array N is enough
    #[cfg_attr(
        feature = "command",
        arg(long, value_name = "K/N", conflicts_with_all = ["json", "max_failed", "depth_profiles", "part"])
    )]
    #[serde(with = "quantity::text")]
    piece: Option<PieceNumber>,
}

/// Members A to B-1, written `A..B`.
#[derive(Clone, Debug)]
struct MemberRange(Range<usize>);

/// Number K of N equal pieces, written `K/N`.
#[derive(Clone, Copy, Debug)]
struct PieceNumber {
    number: usize,
    pieces: usize,
}

impl TryFrom<GoalOptions> for Goal {
    type Error = &'static str;

    fn try_from(options: GoalOptions) -> Result<Self, &'static str> {
        match options {
            GoalOptions { until: None, part: None, piece: None } => Ok(Self::Whole),
            GoalOptions { until: Some(target), part: None, piece: None } => Ok(Self::Until(target)),
            GoalOptions { until: None, part: Some(MemberRange(part)), piece: None } => Ok(Self::Part(part)),
            GoalOptions { until: None, part: None, piece: Some(PieceNumber { number, pieces }) } => {
                Ok(Self::Piece { number, pieces })
            }
            _ => Err("until, part and piece: expected one of them at most"),
        }
    }
}

impl From<Goal> for GoalOptions {
    fn from(goal: Goal) -> Self {
        match goal {
            Goal::Whole => Self::default(),
            Goal::Until(target) => Self { until: Some(target), ..Self::default() },
            Goal::Part(part) => Self { part: Some(MemberRange(part)), ..Self::default() },
            Goal::Piece { number, pieces } => Self { piece: Some(PieceNumber { number, pieces }), ..Self::default() },
        }
    }
}

impl fmt::Display for MemberRange {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}..{}", self.0.start, self.0.end)
    }
}

impl FromStr for MemberRange {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, &'static str> {
        let ends = text.split_once("..");
        let ends = ends.and_then(|(first, end)| first.trim().parse().ok().zip(end.trim().parse().ok()));
        let range = ends.map(|(first, end)| Self(first..end));
        range.ok_or("expected FIRST..END such as 0..2500, which ends with member 2499")
    }
}

impl fmt::Display for PieceNumber {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}/{}", self.number, self.pieces)
    }
}

/// Without K it is the number of the task in a Slurm job array.
impl FromStr for PieceNumber {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let task = || {
            std::env::var("SLURM_ARRAY_TASK_ID").map_err(|_| {
                "expected K/N such as 3/16, as SLURM_ARRAY_TASK_ID is not set (this is no task of a Slurm job array)"
            })
        };
        let (number, pieces, from) = match text.split_once('/') {
            Some((number, pieces)) => (number.to_owned(), pieces, ""),
            None => (task()?, text, " from SLURM_ARRAY_TASK_ID"),
        };
        let numbers = number.trim().parse().ok().zip(pieces.trim().parse().ok());
        let numbers = numbers.filter(|(number, pieces)| (1..=*pieces).contains(number));
        let piece = numbers.map(|(number, pieces)| Self { number, pieces });
        piece.ok_or_else(|| format!("expected K/N with K from 1 to N, found piece {number:?}{from} of {pieces:?}"))
    }
}

#[cfg(feature = "command")]
impl clap::FromArgMatches for Goal {
    fn from_arg_matches(matches: &clap::ArgMatches) -> Result<Self, clap::Error> {
        let options = GoalOptions::from_arg_matches(matches)?;
        Self::try_from(options).map_err(|message| clap::Error::raw(clap::error::ErrorKind::ArgumentConflict, message))
    }

    fn update_from_arg_matches(&mut self, matches: &clap::ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

#[cfg(feature = "command")]
impl clap::Args for Goal {
    fn augment_args(command: clap::Command) -> clap::Command {
        GoalOptions::augment_args(command)
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        GoalOptions::augment_args_for_update(command)
    }
}
