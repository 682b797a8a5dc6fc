//! Factors as functions of independent standard normal variables: the isoprobabilistic transformation for a Gaussian
//! copula (Der Kiureghian & Liu, J. Eng. Mech. 112, 1986).

use super::{Marginal, SamplingKind};
use crate::case::{Bounds, Correlation, Factor};
use statrs::distribution::{ContinuousCDF, Normal};

/// The transformation. Standard normal variables give factors with the distribution from which independent members are
/// drawn.
#[derive(Clone, Debug)]
pub struct StandardNormalSpace {
    marginals: Vec<Marginal>,
    /// Rows of the Cholesky factor of the correlation; a factor without correlation has a row of zeros and a one.
    rows: Vec<Vec<f64>>,
}

impl StandardNormalSpace {
    /// The space of factors between their bounds.
    pub fn new(factors: &[Factor], bounds: Bounds, kind: SamplingKind, correlation: &Correlation) -> Self {
        let marginals: Vec<Marginal> =
            factors.iter().map(|factor| Marginal::new(factor.nominal, factor.bounds(bounds), kind)).collect();
        let alone = |factor: usize| (0..=factor).map(|other| if other == factor { 1.0 } else { 0.0 }).collect();
        let mut rows: Vec<Vec<f64>> = (0..factors.len()).map(alone).collect();
        if !correlation.is_empty() {
            for (row, correlated) in rows.iter_mut().zip(correlation.cholesky_rows()) {
                *row = correlated.to_vec();
            }
        }
        Self { marginals, rows }
    }

    /// Number of variables: one per factor.
    pub fn variables(&self) -> usize {
        self.marginals.len()
    }

    /// The factors at standard normal variables.
    pub fn factors(&self, scores: &[f64]) -> Vec<f64> {
        let of = |(marginal, score): (&Marginal, f64)| marginal.quantile(Normal::standard().cdf(score));
        self.marginals.iter().zip(self.correlated(scores)).map(of).collect()
    }

    /// Derivatives by the variables of a quantity with these derivatives by the factors (chain rule).
    pub fn gradient(&self, scores: &[f64], by_factor: &[f64]) -> Vec<f64> {
        let mut by_score = vec![0.0; scores.len()];
        let correlated = self.correlated(scores);
        for (((marginal, row), score), by) in self.marginals.iter().zip(&self.rows).zip(correlated).zip(by_factor) {
            let slope = by * marginal.slope_by_score(score);
            row.iter().zip(&mut by_score).for_each(|(weight, sum)| *sum += weight * slope);
        }
        by_score
    }

    fn correlated(&self, scores: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| row.iter().zip(scores).map(|(weight, score)| weight * score).sum()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::ensemble::{Ensemble, Sampling};

    fn space(case: &Case, kind: SamplingKind) -> StandardNormalSpace {
        StandardNormalSpace::new(&case.factors, Bounds::Small, kind, &case.correlation)
    }

    /// A case whose factors are correlated.
    fn case() -> Case {
        let mut case = Case::load("cases/slab".as_ref()).expect("a shipped case");
        case.correlation = Correlation::new(2, &[(0, 1, 0.6)]).expect("a correlation");
        case
    }

    #[test]
    fn factors_of_standard_normal_variables_are_distributed_as_drawn_members_are() {
        let case = case();
        let mut numbers = crate::random::RandomStream::new(5, 0);
        let space = space(&case, SamplingKind::Normal);
        let sampling = Sampling { kind: SamplingKind::Normal, seed: 3 };
        let drawn = Ensemble::sample(&case.factors, Bounds::Small, &sampling, 20_000).correlated(&case.correlation);
        let share = |rows: &mut dyn Iterator<Item = Vec<f64>>| {
            rows.filter(|row| row[0] > 1.1 && row[1] > 1.1).count() as f64 / 20_000.0
        };
        let transformed = share(&mut (0..20_000).map(|_| space.factors(&[numbers.normal(), numbers.normal()])));
        let sampled = share(&mut (0..20_000).map(|member| drawn.member(member)));
        // Three standard errors of the difference of two shares of 9 %.
        assert!((transformed - sampled).abs() < 0.009, "{transformed} and {sampled}");
        // Negative control: without correlation fewer members are high in both.
        let alone =
            StandardNormalSpace::new(&case.factors, Bounds::Small, SamplingKind::Normal, &Correlation::default());
        let independent = share(&mut (0..20_000).map(|_| alone.factors(&[numbers.normal(), numbers.normal()])));
        assert!(independent < sampled - 0.02, "{independent} and {sampled}");
    }

    #[test]
    fn the_gradient_is_the_derivative_of_the_transformation() {
        for kind in [SamplingKind::Normal, SamplingKind::Uniform] {
            let space = space(&case(), kind);
            let scores = [0.7, -1.4];
            let of =
                |scores: &[f64]| -> f64 { space.factors(scores).iter().zip([2.0, -3.0]).map(|(x, c)| x * c).sum() };
            let found = space.gradient(&scores, &[2.0, -3.0]);
            for variable in 0..2 {
                let at = |by: f64| {
                    let mut moved = scores;
                    moved[variable] += by;
                    of(&moved)
                };
                let expected = (at(1e-4) - at(-1e-4)) / 2e-4;
                assert!((found[variable] - expected).abs() < 1e-6, "{} and {expected}", found[variable]);
            }
        }
    }
}
