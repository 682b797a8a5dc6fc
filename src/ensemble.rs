//! Which variations of a case to march.

pub mod marginal;
pub mod sampling;

pub use marginal::Marginal;
pub use sampling::Sampling;

use crate::case::{Bounds, Correlation, Factor};
use sampling::Draw;

/// Members × factors, made row by row when asked for, so that a million members need no memory.
#[derive(Clone, Debug)]
pub struct Ensemble {
    factors: usize,
    members: usize,
    rows: Rows,
}

#[derive(Clone, Debug)]
enum Rows {
    Given(Vec<f64>),
    Drawn(Draw),
}

impl Ensemble {
    /// One member: every factor at its nominal value.
    pub fn nominal(factors: &[Factor]) -> Self {
        Self::at(factors.len(), factors.iter().map(|factor| factor.nominal).collect())
    }

    /// Exactly these rows of factor values, row after row. Without factors there is one member, which varies nothing.
    ///
    /// # Panics
    /// When the values are not a whole number of rows.
    pub fn at(factors: usize, values: Vec<f64>) -> Self {
        let members = values.len().checked_div(factors).unwrap_or(1);
        assert_eq!(values.len(), members * factors, "values are not whole rows of {factors} factors");
        Self { factors, members, rows: Rows::Given(values) }
    }

    /// Members drawn between the side constraints, as [`Sampling`] says.
    pub fn sample(factors: &[Factor], bounds: Bounds, sampling: &Sampling, members: usize) -> Self {
        Self { factors: factors.len(), members, rows: Rows::Drawn(Draw::new(factors, bounds, sampling, members)) }
    }

    /// The same members, drawn so that factors go together as a correlation says; rows that were given stay.
    ///
    /// Factors behind those that the correlation knows go with nothing.
    pub fn correlated(self, correlation: &Correlation) -> Self {
        match self.rows {
            Rows::Drawn(draw) => Self { rows: Rows::Drawn(draw.correlated(correlation)), ..self },
            Rows::Given(_) => self,
        }
    }

    /// Number of members.
    pub fn len(&self) -> usize {
        self.members
    }

    /// Whether it has no members.
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
    /// When there is no such member.
    pub fn member(&self, member: usize) -> Vec<f64> {
        assert!(member < self.members, "no member {member} in an ensemble of {}", self.members);
        match &self.rows {
            Rows::Given(values) => values[member * self.factors..(member + 1) * self.factors].to_vec(),
            Rows::Drawn(draw) => draw.row(member),
        }
    }
}

/// What the members are drawn from.
///
/// All but `Uniform` follow one distribution, a normal of mean nominal and standard deviation (high − low)/4 that is
/// cut off at the side constraints: they are two deviations away where the nominal value lies midway, as the paper
/// has it. A nominal value outside its side constraints counts as the nearer one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SamplingKind {
    /// Independent draws.
    #[default]
    Normal,
    /// Independent draws, every value between the side constraints equally likely.
    Uniform,
    /// Each factor's distribution is cut into as many equally likely strata as there are members, and each stratum
    /// holds one member (McKay, Beckman & Conover, Technometrics 21, 1979).
    LatinHypercube,
    /// A Sobol sequence with hashed Owen scrambling (Burley, J. Comput. Graph. Tech. 9(4), 2020): even coverage of all
    /// factors together. Every 65,536 members, and every 256 factors, begin a sequence scrambled anew.
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

    /// The kind of this name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Normal, Self::Uniform, Self::LatinHypercube, Self::Sobol].into_iter().find(|kind| kind.name() == name)
    }
}
