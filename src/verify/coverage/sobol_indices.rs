//! Coverage of the 95 % intervals of sensitivity indices and correlations, counted over seeds. Sobol indices of the
//! functions are known from quadrature, correlations from a large sample.

use super::{Counted, covered_row};
use crate::case::{Bounds, Correlation, Factor, Property};
use crate::ensemble::{Ensemble, Marginal, Sampling, SamplingKind};
use crate::statistics::{Accumulator, ConfidenceInterval, SensitivityIndices};
use crate::verify::VerificationRow;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Error of the exact indices by the midpoint rule, largest for jumps.
const QUADRATURE: f64 = 5e-4;
/// A jump of an output in K or s, in which quanta are negligible.
const SCALE: f64 = 1000.0;
const SEEDS: u64 = 100;

/// A function of factors between −1 and 1.
enum Model {
    /// A function of the first few factors.
    OfFew(&'static str, usize, fn(&[f64]) -> f64),
    /// A product of a function of the number and value of each factor.
    Product(&'static str, fn(usize, f64) -> f64),
}

const MODELS: [Model; 13] = [
    Model::OfFew("kink of one factor", 1, |x| (x[0] - 0.3).max(0.0)),
    Model::OfFew("jump of one factor", 1, |x| f64::from(x[0] > 0.35)),
    Model::OfFew("product of two", 2, |x| (1.0 + x[0]) * (1.0 + x[1])),
    Model::OfFew("rare jump", 2, |x| f64::from(x[0] + x[1] > 1.1)),
    Model::OfFew("oscillation", 2, |x| (9.0 * x[0]).sin() + x[1]),
    Model::OfFew("interaction of three", 3, |x| x[0] + 3.0 * x[0] * x[1] * x[2]),
    Model::OfFew("product of three", 3, |x| x[0] * x[1] * x[2]),
    Model::OfFew("peak with a kink", 3, |x| x[0].max(0.7 * x[1] + 0.3 * x[2])),
    Model::OfFew("rare kink", 3, |x| (x[0] + 0.5 * x[1] + 0.3 * x[2] - 0.9).max(0.0)),
    Model::OfFew("time of a peak", 3, |x| f64::from(x[0] + 0.5 * x[1] > 0.2) + 0.05 * x[2]),
    Model::OfFew("smooth", 3, |x| 1.0 / (1.3 + 0.5 * x[0] + 0.2 * x[1]) + 0.1 * (2.0 * x[2]).sin()),
    Model::Product("product of all", |_, x| 1.0 + 0.5 * x),
    Model::Product("exponential", |factor, x| (1.2 * x / (1 + factor) as f64).exp()),
];

impl Model {
    fn name(&self) -> &'static str {
        match self {
            Self::OfFew(name, ..) | Self::Product(name, _) => name,
        }
    }

    /// The number of factors that have an effect, of `factors`.
    fn active(&self, factors: usize) -> usize {
        match self {
            Self::OfFew(_, active, _) => *active,
            Self::Product(..) => factors,
        }
    }

    fn value(&self, x: &[f64]) -> f64 {
        match self {
            Self::OfFew(_, active, f) => f(&x[..*active]),
            Self::Product(_, f) => x.iter().enumerate().map(|(factor, x)| f(factor, *x)).product(),
        }
    }
}

/// How the factors are distributed and drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Distribution {
    kind: SamplingKind,
    /// Nominal values of the factors, in turn.
    nominal: [f64; 4],
}

const CENTRED: [f64; 4] = [0.0; 4];
/// The default.
const NORMAL: Distribution = Distribution { kind: SamplingKind::Normal, nominal: CENTRED };

impl Distribution {
    fn nominal(&self, factor: usize) -> f64 {
        self.nominal[factor % self.nominal.len()]
    }

    fn marginal(&self, factor: usize) -> Marginal {
        Marginal::new(self.nominal(factor), (-1.0, 1.0), self.kind)
    }

    /// Values of a factor at equal steps of probability.
    fn nodes(&self, factor: usize, count: usize) -> Vec<f64> {
        let marginal = self.marginal(factor);
        (0..count).map(|node| marginal.quantile((node as f64 + 0.5) / count as f64)).collect()
    }
}

/// The exact indices of the factors with an effect, and of their pairs.
struct Exact {
    first: Vec<f64>,
    total: Vec<f64>,
    second: BTreeMap<(usize, usize), f64>,
}

impl Exact {
    /// Exact indices from the closed indices `Var(E[f | factors]) / Var(f)` of sets of factors, given as predicates.
    fn from_closed(active: usize, closed: impl Fn(&dyn Fn(usize) -> bool) -> f64) -> Self {
        let first: Vec<f64> = (0..active).map(|one| closed(&|factor| factor == one)).collect();
        let pairs = (0..active).flat_map(|one| (one + 1..active).map(move |other| (one, other)));
        let second = |(one, other)| {
            ((one, other), closed(&|factor| factor == one || factor == other) - first[one] - first[other])
        };
        let total = (0..active).map(|one| 1.0 - closed(&|factor| factor != one)).collect();
        Self { second: pairs.map(second).collect(), total, first }
    }

    fn of(model: &Model, factors: usize, distribution: &Distribution) -> Self {
        match model {
            Model::OfFew(_, active, f) => Self::of_few(*active, *f, distribution),
            Model::Product(_, f) => {
                const NODES: usize = 20_000;
                let moments: Vec<[f64; 2]> = (0..factors)
                    .map(|factor| {
                        let values = distribution.nodes(factor, NODES).into_iter().map(|x| f(factor, x));
                        let [sum, squares] = values.fold([0.0; 2], |[sum, squares], y| [sum + y, squares + y * y]);
                        [(sum / NODES as f64).powi(2), squares / NODES as f64]
                    })
                    .collect();
                let mean: f64 = moments.iter().map(|[mean, _]| mean).product();
                let variance = moments.iter().map(|[_, square]| square).product::<f64>() - mean;
                let closed = |is_known: &dyn Fn(usize) -> bool| {
                    let each = moments.iter().enumerate();
                    let known = each.map(|(factor, [mean, square])| if is_known(factor) { square } else { mean });
                    (known.product::<f64>() - mean) / variance
                };
                Self::from_closed(factors, closed)
            }
        }
    }

    /// By the midpoint rule in probability.
    fn of_few(active: usize, f: fn(&[f64]) -> f64, distribution: &Distribution) -> Self {
        let count = [20_000, 1000, 160][active - 1];
        let nodes: Vec<Vec<f64>> = (0..active).map(|factor| distribution.nodes(factor, count)).collect();
        let all = 1 << active;
        // For each set of factors, as bits, the sums over the others.
        let mut sums: Vec<Vec<f64>> = (0..all).map(|set: usize| vec![0.0; count.pow(set.count_ones())]).collect();
        let points = count.pow(active as u32);
        for point in 0..points {
            let at: Vec<usize> = (0..active).map(|factor| point / count.pow(factor as u32) % count).collect();
            let x: Vec<f64> = nodes.iter().zip(&at).map(|(nodes, &at)| nodes[at]).collect();
            let y = f(&x);
            for (set, sums) in sums.iter_mut().enumerate() {
                let place = (0..active).rev().filter(|factor| set >> factor & 1 == 1);
                sums[place.fold(0, |place, factor| place * count + at[factor])] += y;
            }
        }
        let mean = sums[0][0] / points as f64;
        let variance = |set: usize| {
            let each = (points / sums[set].len()) as f64;
            sums[set].iter().map(|sum| (sum / each - mean).powi(2)).sum::<f64>() / sums[set].len() as f64
        };
        let closed = |is_known: &dyn Fn(usize) -> bool| {
            variance((0..active).filter(|&factor| is_known(factor)).map(|factor| 1 << factor).sum()) / variance(all - 1)
        };
        Self::from_closed(active, closed)
    }

    /// How many of the indices lie in their intervals, how many there are, and the mean width.
    fn count(&self, found: &SensitivityIndices) -> [f64; 3] {
        let single = self.first.iter().zip(&found.first).chain(self.total.iter().zip(&found.total));
        let pairs = found.second.iter().filter_map(|pair| Some((self.second.get(&pair.factors)?, &pair.index)));
        let holds = |exact: f64, index: &ConfidenceInterval| {
            index.low - QUADRATURE <= exact && exact <= index.high + QUADRATURE
        };
        single.chain(pairs).fold([0.0; 3], |[held, all, width], (exact, index)| {
            assert!(0.0 <= index.low && index.low <= index.value && index.value <= index.high && index.high <= 1.0);
            [held + f64::from(u8::from(holds(*exact, index))), all + 1.0, width + index.high - index.low]
        })
    }
}

/// Indices of some models from one ensemble.
fn indices(
    models: &[&Model],
    [members, factors]: [usize; 2],
    distribution: &Distribution,
    correlation: &Correlation,
    seed: u64,
) -> Vec<SensitivityIndices> {
    let factor = |factor| Factor {
        name: "f".to_owned(),
        group: "INS".to_owned(),
        property: Property::Conductivity,
        state: None,
        nominal: distribution.nominal(factor),
        small: (-1.0, 1.0),
        large: (-1.0, 1.0),
    };
    let drawn: Vec<Factor> = (0..factors).map(factor).collect();
    let sampling = Sampling { kind: distribution.kind, seed };
    let ensemble = Ensemble::sample(&drawn, Bounds::Small, &sampling, members).correlated(correlation);
    let marginals: Vec<Marginal> = (0..factors).map(|factor| distribution.marginal(factor)).collect();
    let mut accumulator = Accumulator::new(&vec![0.0; models.len()], &marginals);
    let rows: Vec<Vec<f64>> = (0..members).map(|member| ensemble.member(member)).collect();
    let outputs: Vec<f64> = rows.iter().flat_map(|row| models.iter().map(|model| SCALE * model.value(row))).collect();
    accumulator.add_block(&outputs, &rows.concat(), &vec![true; members]);
    accumulator.sensitivity_indices(correlation.is_empty(), 0..models.len())
}

/// The functions that have no more factors than these.
fn models(factors: usize) -> Vec<&'static Model> {
    MODELS.iter().filter(|model| model.active(factors) <= factors).collect()
}

/// The indices of each function from a sweep for each seed.
fn sweeps(size: [usize; 2], distribution: &Distribution) -> Vec<Vec<SensitivityIndices>> {
    let models = models(size[1]);
    let sweep = |seed| indices(&models, size, distribution, &Correlation::default(), seed);
    (0..SEEDS).into_par_iter().map(sweep).collect()
}

/// Coverage of the intervals of the Sobol indices of each function, and their mean width.
fn coverage(
    sweeps: &[Vec<SensitivityIndices>],
    factors: usize,
    distribution: &Distribution,
) -> Vec<(&'static Model, f64, f64)> {
    let each = models(factors).into_iter().enumerate();
    each.map(|(at, model)| {
        let exact = Exact::of(model, factors, distribution);
        let counts: Vec<[f64; 3]> = sweeps.iter().map(|found| exact.count(&found[at])).collect();
        let sum = |of: usize| counts.iter().map(|count| count[of]).sum::<f64>();
        (model, sum(0) / sum(1), sum(2) / sum(1))
    })
    .collect()
}

const FACTORS: usize = 3;
/// Members of a sweep.
const MEMBERS: [usize; 2] = [300, 1600];
const SOBOL_ALLOWED: (f64, &str) = (2.0, "the standard error of 100 sweeps, whose indices are missed together");

/// Coverage for normal factors: the function with the least.
pub(super) fn rows() -> Vec<VerificationRow> {
    let rows = |members: usize| {
        let sweeps = sweeps([members, FACTORS], &NORMAL);
        let found = coverage(&sweeps, FACTORS, &NORMAL);
        let each = found.iter().map(|(model, covered, _)| (*covered, model.name()));
        let sobol = least_row("Sobol indices", members, "all indices of a sweep", each, SOBOL_ALLOWED);
        let correlations = if members == MEMBERS[1] { correlation_rows(members, &sweeps) } else { Vec::new() };
        std::iter::once(sobol).chain(correlations)
    };
    MEMBERS.into_iter().flat_map(rows).chain([correlated_row(MEMBERS[0])]).collect()
}

/// Correlation of the first two factors of [`partial_rank_coverage`].
const CORRELATION: f64 = 0.7;
/// A nearly linear function: its partial correlations are near one.
const NEARLY_LINEAR: Model = Model::OfFew("unequal sum", 3, |x| x[0] + 0.3 * x[1] + 0.02 * x[2]);

/// Coverage of the partial rank correlations of each factor, of functions of three factors of which two are correlated.
fn partial_rank_coverage(members: usize, seeds: u64) -> Vec<(&'static str, Vec<f64>)> {
    let mut models = models(FACTORS);
    models.push(&NEARLY_LINEAR);
    let Ok(correlation) = Correlation::new(FACTORS, &[(0, 1, CORRELATION)]) else { return Vec::new() };
    let exact = indices(&models, [REFERENCE_MEMBERS, FACTORS], &NORMAL, &correlation, seeds);
    let sweep = |seed| indices(&models, [members, FACTORS], &NORMAL, &correlation, seed);
    let sweeps: Vec<Vec<SensitivityIndices>> = (0..seeds).into_par_iter().map(sweep).collect();
    let share = |at: usize, factor: usize| {
        let of = |found: &SensitivityIndices| found.partial_rank_correlations[factor];
        let truth = of(&exact[at]).value;
        let held = sweeps.iter().filter(|found| (of(&found[at]).low..=of(&found[at]).high).contains(&truth)).count();
        held as f64 / sweeps.len() as f64
    };
    let each = models.iter().enumerate();
    each.map(|(at, model)| (model.name(), (0..FACTORS).map(|factor| share(at, factor)).collect())).collect()
}

/// The row of the function and factor with the least coverage.
fn correlated_row(members: usize) -> VerificationRow {
    let covered = partial_rank_coverage(members, SEEDS);
    let each = covered.iter().map(|(name, shares)| (shares.iter().sum::<f64>() / shares.len() as f64, *name));
    let name = "partial rank correlations";
    let quantity = format!("two of three factors correlated by {CORRELATION}");
    least_row(name, members, &quantity, each, CORRELATIONS_ALLOWED)
}

/// The row of the function whose intervals contain the truth least often.
fn least_row(
    name: &str,
    members: usize,
    quantity: &str,
    each: impl Iterator<Item = (f64, &'static str)>,
    allowed: (f64, &str),
) -> VerificationRow {
    let each: Vec<(f64, &str)> = each.collect();
    let (covered, model) =
        each.iter().copied().min_by(|one, other| one.0.total_cmp(&other.0)).unwrap_or((0.0, "no function"));
    let counted = Counted { covered, total: SEEDS as usize, of: "sweeps" };
    covered_row(name, members, &format!("{quantity}; least of {} functions: {model}", each.len()), &counted, allowed)
}

/// Members of the sample whose correlations are taken as exact: their standard error is a tenth of that of a sweep.
const REFERENCE_MEMBERS: usize = 160_000;
const CORRELATIONS_ALLOWED: (f64, &str) =
    (4.4, "two standard errors of 100 sweeps, whose intervals are missed together");

/// Coverage of correlations for normal factors: the function with the least.
fn correlation_rows(members: usize, sweeps: &[Vec<SensitivityIndices>]) -> Vec<VerificationRow> {
    let models = models(FACTORS);
    let exact = indices(&models, [REFERENCE_MEMBERS, FACTORS], &NORMAL, &Correlation::default(), SEEDS);
    fn kinds(indices: &SensitivityIndices) -> [&Vec<ConfidenceInterval>; 3] {
        [&indices.correlations, &indices.rank_correlations, &indices.partial_rank_correlations]
    }
    let names = ["correlations", "rank correlations", "partial rank correlations"];
    let rows = names.into_iter().enumerate().map(|(kind, name)| {
        let each = models.iter().enumerate().map(|(at, model)| {
            let pairs = sweeps.iter().flat_map(|found| kinds(&found[at])[kind].iter().zip(kinds(&exact[at])[kind]));
            let held = pairs.filter(|(found, exact)| (found.low..=found.high).contains(&exact.value)).count();
            (held as f64 / (sweeps.len() * FACTORS) as f64, model.name())
        });
        least_row(name, members, "those of all factors", each, CORRELATIONS_ALLOWED)
    });
    rows.collect()
}

#[cfg(test)]
mod tests;
