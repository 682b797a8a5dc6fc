//! The question of `uncertainty`: a Monte Carlo sweep over the factors.

use super::draw::{Draw, check_members};
use super::error::InputError;
use super::goal::Goal;
use super::predict::check_profiles;
use super::quantity;
use crate::case::Case;
use crate::kept_work::sweep_piece::equal_piece;
use crate::study::depth_profiles::ProfileInstants;
use crate::study::sequential_sampling::PrecisionTarget;
use crate::study::uncertainty::Sweep;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Prediction intervals and sensitivity indices of the factors, by Monte Carlo sampling.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct Uncertainty {
    /// Number of members (random samples of the factors)
    #[cfg_attr(feature = "command", arg(
        short = 'n',
        value_name = "MEMBERS",
        default_value_t = Uncertainty::default().members,
        value_parser = quantity::count::parse
    ))]
    #[serde(with = "quantity::count")]
    pub members: usize,
    /// How they are drawn.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub draw: Draw,
    /// Profiles through the thickness at these times, as "10s,40s", or at a number of evenly spaced times
    #[cfg_attr(feature = "command", arg(long, value_name = "TIMES"))]
    #[serde(with = "quantity::text")]
    pub depth_profiles: Option<ProfileInstants>,
    /// Which of them are marched.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub goal: Goal,
}

impl Default for Uncertainty {
    fn default() -> Self {
        Self { members: 5000, draw: Draw::default(), depth_profiles: None, goal: Goal::Whole }
    }
}

impl Uncertainty {
    /// Check the question for a case, before any computation.
    ///
    /// # Errors
    /// When an option is wrong or without effect, or the case has no factors.
    pub fn check(&self, case: &Case) -> Result<(), InputError> {
        check_members(self.members, case)?;
        check_profiles(self.depth_profiles.as_ref(), case)?;
        if self.depth_profiles.is_some() && self.goal != Goal::Whole {
            return Err(InputError::for_option("depth_profiles", ": only a whole sweep has profiles"));
        }
        match &self.goal {
            Goal::Whole => Ok(()),
            Goal::Until(target) => self.target(target, case).map(drop),
            Goal::Part(_) | Goal::Piece { .. } => self.part().map(drop),
        }
    }

    /// The members of the whole sweep.
    pub fn sweep(&self) -> Sweep {
        self.draw.sweep(self.members)
    }

    /// The members that are marched, and the number of equal pieces if these are one of them.
    ///
    /// # Errors
    /// When there are no such members.
    pub fn part(&self) -> Result<(Range<usize>, Option<usize>), InputError> {
        match self.goal {
            Goal::Whole | Goal::Until(_) => Ok((0..self.members, None)),
            Goal::Part(Range { start, end }) if start < end && end <= self.members => Ok((start..end, None)),
            Goal::Part(Range { start, end }) => {
                let message = format!(
                    " {start}..{end}: expected a first member before the end, and an end no higher than the {} drawn",
                    self.members
                );
                Err(InputError::for_option("part", message))
            }
            Goal::Piece { number, pieces } => {
                let piece = equal_piece(number, pieces, self.members).map(|piece| (piece, Some(pieces)));
                piece.ok_or_else(|| {
                    let message = format!(
                        " {number}/{pieces}: expected K/N with K from 1 to N, and N at most the {} members drawn",
                        self.members
                    );
                    InputError::for_option("piece", message)
                })
            }
        }
    }

    /// The quantity and its half-width.
    pub(crate) fn target(&self, text: &str, case: &Case) -> Result<PrecisionTarget, InputError> {
        let target = PrecisionTarget::parse(text, case);
        let target = target.map_err(|message| InputError::for_option("until", format!(" {text:?}: {message}")))?;
        if !self.draw.sampling.has_independent_members() {
            let message = format!(
                " {}: expected normal or uniform, as the intervals of a target are those of independent members",
                self.draw.sampling.name()
            );
            return Err(InputError::for_option("sampling", message));
        }
        Ok(target)
    }
}
