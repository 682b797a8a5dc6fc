//! Ensembles: the factor values of every member of a sweep.

pub mod marginal;
pub mod sampling;
pub mod standard_normal;

pub use marginal::Marginal;
pub use sampling::Sampling;
pub use standard_normal::StandardNormalSpace;

use crate::case::{Bounds, Correlation, Factor};
use sampling::Sampler;

/// Factor values, member × factor. Rows are generated on request, so a million members need no memory.
#[derive(Clone, Debug)]
pub struct Ensemble {
    factors: usize,
    members: usize,
    source: FactorSource,
}

#[derive(Clone, Debug)]
enum FactorSource {
    Given(Vec<f64>),
    Sampled(Sampler),
}

impl Ensemble {
    /// One member: every factor at its nominal value.
    pub fn nominal(factors: &[Factor]) -> Self {
        Self::from_values(factors.len(), factors.iter().map(|factor| factor.nominal).collect())
    }

    /// Members with these factor values, row-major (member × factor). Without factors the ensemble has one member.
    ///
    /// # Panics
    /// When the number of values is not a multiple of `factors`.
    pub fn from_values(factors: usize, values: Vec<f64>) -> Self {
        let members = values.len().checked_div(factors).unwrap_or(1);
        assert_eq!(
            values.len(),
            members * factors,
            "{} values do not fill whole rows of {factors} factors",
            values.len()
        );
        Self { factors, members, source: FactorSource::Given(values) }
    }

    /// Members sampled between the factor bounds as [`Sampling`] states.
    pub fn sample(factors: &[Factor], bounds: Bounds, sampling: &Sampling, members: usize) -> Self {
        Self {
            factors: factors.len(),
            members,
            source: FactorSource::Sampled(Sampler::new(factors, bounds, sampling, members)),
        }
    }

    /// The same sampled members with correlated factors (Gaussian copula). Members with given values do not change.
    ///
    /// Factors beyond those in the correlation stay independent.
    pub fn correlated(self, correlation: &Correlation) -> Self {
        match self.source {
            FactorSource::Sampled(draw) => Self { source: FactorSource::Sampled(draw.correlated(correlation)), ..self },
            FactorSource::Given(_) => self,
        }
    }

    /// Number of members.
    pub fn len(&self) -> usize {
        self.members
    }

    /// Whether the ensemble has no members.
    pub fn is_empty(&self) -> bool {
        self.members == 0
    }

    /// Number of factors of every member.
    pub fn factors(&self) -> usize {
        self.factors
    }

    /// The factor values of one member.
    ///
    /// # Panics
    /// When `member` is out of range.
    pub fn member(&self, member: usize) -> Vec<f64> {
        assert!(member < self.members, "no member {member} in an ensemble of {}", self.members);
        match &self.source {
            FactorSource::Given(values) => values[member * self.factors..(member + 1) * self.factors].to_vec(),
            FactorSource::Sampled(draw) => draw.member(member),
        }
    }
}

/// Sampling method.
///
/// All kinds but `Uniform` draw from a split normal distribution: its density has its maximum at the nominal value, and
/// each bound lies two standard deviations of its side away and truncates it. With a central nominal value this is the
/// normal distribution of the paper. A nominal value outside the bounds is replaced by the nearer bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "command", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum SamplingKind {
    /// Normal, with two standard deviations at each bound, truncated there.
    ///
    /// Draws are independent.
    #[default]
    Normal,
    /// Uniform between the bounds.
    ///
    /// Draws are independent.
    Uniform,
    /// Latin hypercube.
    ///
    /// The distribution of each factor is divided into as many equiprobable strata as there are members, with one
    /// member in each (McKay, Beckman & Conover, Technometrics 21, 1979).
    #[cfg_attr(feature = "command", value(name = "lhs"))]
    #[serde(rename = "lhs")]
    LatinHypercube,
    /// Scrambled Sobol sequence.
    ///
    /// Hashed Owen scrambling (Burley, J. Comput. Graph. Tech. 9(4), 2020). A new scrambling starts every 65,536
    /// members and every 256 factors.
    Sobol,
}

impl SamplingKind {
    /// `normal`, `uniform`, `lhs` or `sobol`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Uniform => "uniform",
            Self::LatinHypercube => "lhs",
            Self::Sobol => "sobol",
        }
    }

    /// Whether members are drawn independently of each other, as intervals by Clopper and Pearson, order statistics and
    /// Wilks assume.
    pub fn has_independent_members(self) -> bool {
        matches!(self, Self::Normal | Self::Uniform)
    }
}
