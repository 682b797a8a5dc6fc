//! Coverage of the 95 % intervals of Sobol indices, counted over seeds, for functions whose indices are known from
//! quadrature.

use super::{Accumulator, ConfidenceInterval, SensitivityIndices};
use crate::case::{Bounds, Correlation, Factor, Property};
use crate::ensemble::{Ensemble, Marginal, Sampling, SamplingKind};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Smallest coverage over all indices of a function: 95 % less two standard errors of a hundred seeds, as the indices
/// of a function are missed together.
const COVERED: f64 = 0.93;
/// Error of the exact indices by the midpoint rule, largest for jumps.
const QUADRATURE: f64 = 5e-4;
/// A jump of an output in K or s, in which quanta are negligible.
const SCALE: f64 = 1000.0;
const SEEDS: u64 = 100;

/// A function of factors between −1 and 1.
enum Model {
    /// Of the first few factors.
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
const NORMAL: Distribution = Distribution { kind: SamplingKind::Normal, nominal: CENTRED };
const UNIFORM: Distribution = Distribution { kind: SamplingKind::Uniform, nominal: CENTRED };
const OFF_CENTRE: Distribution = Distribution { kind: SamplingKind::Normal, nominal: [-0.6, 0.5, 0.8, -0.3] };

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
    /// From `Var(E[f | factors]) / Var(f)` for the factors of a predicate.
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

/// Coverage of the intervals of each model, and their mean width.
fn coverage(size: [usize; 2], distribution: &Distribution) -> Vec<(&'static Model, f64, f64)> {
    let [_, factors] = size;
    let models: Vec<&Model> = MODELS.iter().filter(|model| model.active(factors) <= factors).collect();
    let exact: Vec<Exact> = models.iter().map(|model| Exact::of(model, factors, distribution)).collect();
    let counts = (0..SEEDS).into_par_iter().map(|seed| {
        let found = indices(&models, size, distribution, &Correlation::default(), seed);
        exact.iter().zip(&found).map(|(exact, found)| exact.count(found)).collect::<Vec<_>>()
    });
    let counts: Vec<Vec<[f64; 3]>> = counts.collect();
    let sum = |model: usize, of: usize| counts.iter().map(|counts| counts[model][of]).sum::<f64>();
    let each = models.iter().enumerate();
    each.map(|(at, &model)| {
        let (covered, width) = (sum(at, 0) / sum(at, 1), sum(at, 2) / sum(at, 1));
        (model, covered, width)
    })
    .collect()
}

#[track_caller]
fn assert_covered(distribution: &Distribution, sizes: &[[usize; 2]]) {
    for &size in sizes {
        for (model, covered, _) in coverage(size, distribution) {
            assert!(covered >= COVERED, "{size:?}, {distribution:?}: {}: {covered}", model.name());
        }
    }
}

/// Some numbers of members and factors, or with `BONDLINE_ALL` 300 to 5,000 members and one to twelve factors.
fn sizes(few: &[[usize; 2]]) -> Vec<[usize; 2]> {
    if std::env::var_os("BONDLINE_ALL").is_none() {
        return few.to_vec();
    }
    [1, 2, 3, 6, 12].into_iter().flat_map(|factors| [300, 700, 1600, 5000].map(|members| [members, factors])).collect()
}

#[test]
fn intervals_contain_the_indices_of_products_kinks_and_jumps_for_normal_factors() {
    assert_covered(&NORMAL, &sizes(&[[300, 3], [1600, 3]]));
}

#[test]
fn intervals_contain_the_indices_of_products_kinks_and_jumps_for_off_centre_normal_factors() {
    assert_covered(&OFF_CENTRE, &sizes(&[[700, 3]]));
}

#[test]
fn intervals_contain_the_indices_of_products_kinks_and_jumps_for_uniform_factors() {
    assert_covered(&UNIFORM, &sizes(&[[700, 3]]));
}

/// Of members that scatter less than independent ones.
#[test]
fn intervals_contain_the_indices_of_products_kinks_and_jumps_for_stratified_members() {
    for kind in [SamplingKind::LatinHypercube, SamplingKind::Sobol] {
        assert_covered(&Distribution { kind, nominal: CENTRED }, &[[300, 3]]);
    }
}

#[test]
fn the_intervals_of_one_factor_do_not_contain_the_indices_of_another() {
    let model = &MODELS[7];
    let mut swapped = Exact::of(model, 3, &NORMAL);
    swapped.first.swap(0, 2);
    swapped.total.swap(0, 2);
    let counts = (0..20).map(|seed| {
        let found = indices(&[model], [1600, 3], &NORMAL, &Correlation::default(), seed);
        swapped.count(&found[0])
    });
    let [held, all] = counts.fold([0.0; 2], |[held, all], count| [held + count[0], all + count[1]]);
    // Four of nine indices are those of another factor.
    assert!(held / all < 0.7, "{}", held / all);
}

/// Intervals that hold everything would be covered too.
#[test]
fn intervals_are_as_narrow_as_the_unexplained_variance_permits() {
    let widths: BTreeMap<&str, f64> =
        coverage([300, 3], &NORMAL).into_iter().map(|(model, _, width)| (model.name(), width)).collect();
    for (name, most) in [("smooth", 0.01), ("product of two", 1e-3), ("peak with a kink", 0.1)] {
        assert!(widths[name] < most, "{name}: {}", widths[name]);
    }
}

/// For correlated factors too, here with the indices of the sum of two of three grades; see the formulas in
/// `polynomial_chaos.rs`.
#[test]
fn intervals_contain_the_indices_of_correlated_factors() {
    const SUM: Model = Model::OfFew("sum", 2, |x| x[0] + x[1]);
    for (r, members) in [(-0.7, 300), (0.3, 1600), (0.8, 300), (0.8, 1600)] {
        let correlation = Correlation::new(3, &[(0, 1, r)]).expect("positive definite");
        let (shared, followed) = ((r / 2.0f64).asin() / (2.0 * PI), (r * r / 2.0).asin() / (2.0 * PI));
        let all = 1.0 / 6.0 + 2.0 * shared;
        let (first, total) = ((1.0 / 12.0 + 2.0 * shared + followed) / all, (1.0 / 12.0 - followed) / all);
        let exact = Exact { first: vec![first; 2], total: vec![total; 2], second: BTreeMap::new() };
        let counts: Vec<[f64; 3]> = (0..SEEDS)
            .into_par_iter()
            .map(|seed| exact.count(&indices(&[&SUM], [members, 3], &UNIFORM, &correlation, seed)[0]))
            .collect();
        let sum = |of: usize| counts.iter().map(|count| count[of]).sum::<f64>();
        assert!(sum(0) / sum(1) >= COVERED, "{r}, {members} members: {}", sum(0) / sum(1));
    }
}
