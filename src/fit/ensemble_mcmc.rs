//! Ensemble Markov chain Monte Carlo for the density `exp(−S/2)` between bounds.
//!
//! `S(P)` is a sum of squares: of normal residuals in standard deviations, of a loss, and of priors, which are
//! residuals themselves. The density is zero outside the bounds. A walker at X proposes `X + γ (Y − Z)`, where Y and Z
//! are two other walkers (differential evolution), and accepts with probability `min(1, exp((S(X) − S(X′))/2))`. No
//! step size has to be chosen, and narrow oblique densities are sampled as efficiently as round ones, because the
//! proposals are affine invariant like the stretch moves of Goodman & Weare (Commun. Appl. Math. Comput. Sci. 5, 2010).
//! γ is 2.38/√(2n), but 1 in a tenth of the proposals, which lead from one mode to another (ter Braak, Stat. Comput.
//! 16, 2006).
//!
//! Stretch moves, along the line through one other walker, were tried: in 1, 2, 3, 5 and 8 variables their
//! autocorrelation times are 27, 31, 40, 57 and 87 iterations, against 4, 8, 10, 17 and 27 here. Hamiltonian Monte
//! Carlo needs fewer points in many variables; here variables are few, points are cheap in batches, and derivatives are
//! expensive.
//!
//! One half of the walkers moves at a time, with Y and Z from the other half, which is fixed meanwhile. All proposals
//! of a half are thus one ensemble, and the Markov chain keeps the right density (Foreman-Mackey et al., Publ. Astron.
//! Soc. Pac. 125, 2013). Proposals outside the bounds are rejected without evaluation.
//!
//! **Annealing.** Walkers start anywhere between the bounds, and first follow `exp(−βS/2)` with β rising from zero to
//! one (transitional MCMC: Ching & Chen, J. Eng. Mech. 133, 2007; sequential Monte Carlo: Del Moral, Doucet & Jasra, J.
//! R. Stat. Soc. B 68, 2006). At each rise walkers are resampled by their weights. Every mode is thus found that some
//! walkers start near, with its probability, and none is left in a local minimum: without annealing, a walker far from
//! the others is stuck there, because its proposals are as short as their differences.
//!
//! **Ensembles.** After annealing the walkers form [`ENSEMBLES`] that move independently, as the walkers of one
//! ensemble do not: [R-hat](super::chain_diagnostics) compares ensembles.

use super::LeastSquares;
use crate::random::RandomStream;
use nalgebra::DMatrix;
use std::ops::Range;

/// Optimal random-walk step for a normal density of one variable, in standard deviations (Roberts, Gelman & Gilks, Ann.
/// Appl. Probab. 7, 1997).
const OPTIMAL_STEP: f64 = 2.38;
/// Fraction of proposals with γ = 1.
const UNIT_STEP_FRACTION: f64 = 0.1;
/// Independent ensembles after annealing: as many as Vehtari et al. (Bayesian Anal. 16, 2021) recommend chains.
pub const ENSEMBLES: usize = 4;
/// Effective sample size of the weights of each rise of β, over that of the walkers before. With 0.8 or 0.6 fewer
/// walkers are left after some rises than the moves need: ensembles of 60 in 5 variables collapse.
const ANNEALING_SAMPLE: f64 = 0.9;
/// Low word of the random stream of resampling; lower ones are those of the walkers.
const RESAMPLING_STREAM: u64 = 0xffff_ffff;
/// Bisections of the logarithm of a rise of β, over `e⁻⁶⁰` to one: to a relative 10⁻⁴.
const RISE_BISECTIONS: usize = 20;
const SMALLEST_LOG_RISE: f64 = -60.0;

/// Walkers of each of the independent ensembles.
pub fn ensembles(walkers: usize) -> [Range<usize>; ENSEMBLES] {
    std::array::from_fn(|ensemble| ensemble * walkers / ENSEMBLES..(ensemble + 1) * walkers / ENSEMBLES)
}

/// Starts drawn uniformly between bounds, one per column.
pub fn uniform_starts(bounds: &[(f64, f64)], walkers: usize, seed: u64) -> DMatrix<f64> {
    let start = |walker: usize| {
        let mut numbers = RandomStream::new(seed, START_STREAM | walker as u64);
        bounds.iter().map(move |(low, high)| low + (high - low) * numbers.uniform()).collect::<Vec<_>>()
    };
    DMatrix::from_iterator(bounds.len(), walkers, (0..walkers).flat_map(start))
}

/// First random stream of the starts; the streams of the moves are below.
const START_STREAM: u64 = 1 << 63;

/// The chains of an ensemble of walkers.
#[derive(Clone, Debug, PartialEq)]
pub struct EnsembleChains {
    /// Number of walkers, each with one chain.
    pub walkers: usize,
    /// Number of iterations of each chain.
    pub iterations: usize,
    /// Chains of each variable, iteration × walker, without the starts.
    pub chains: Vec<Vec<f64>>,
    /// Fraction of proposals accepted.
    pub acceptance: f64,
    /// Number of points at which residuals were evaluated.
    pub evaluations: usize,
    /// The point with the lowest S, and that S.
    pub lowest: (Vec<f64>, f64),
    /// Iterations of annealing, the first of the chains; all of them where they ended before.
    pub annealing: usize,
}

/// Runs the chains from starts, one per column, such as [`uniform_starts`]: a mode that no walker starts near is not
/// found. The result depends only on the seed, the starts and the residuals: each proposal of each walker has its own
/// random stream.
///
/// # Errors
/// Errors of the problem.
///
/// # Panics
/// When there are fewer than four walkers per ensemble.
pub fn ensemble_mcmc<P: LeastSquares>(
    problem: &mut P,
    starts: &DMatrix<f64>,
    iterations: usize,
    seed: u64,
) -> Result<EnsembleChains, P::Error> {
    ensemble_mcmc_from(problem, starts, iterations, seed, Vec::new(), &mut |_| {})
}

/// [`ensemble_mcmc`], going on from the states of an earlier run after each of its iterations. `on_iteration` receives
/// the states after the other iterations.
///
/// # Errors
/// Errors of the problem.
pub(crate) fn ensemble_mcmc_from<P: LeastSquares>(
    problem: &mut P,
    starts: &DMatrix<f64>,
    iterations: usize,
    seed: u64,
    earlier: Vec<ChainState>,
    on_iteration: &mut dyn FnMut(&ChainState),
) -> Result<EnsembleChains, P::Error> {
    let (variables, walkers) = starts.shape();
    assert!(
        walkers >= 4 * ENSEMBLES,
        "expected at least {} walkers, as each moves by two of the other half of its ensemble, found {walkers}",
        4 * ENSEMBLES
    );
    let bounds = problem.bounds().to_vec();
    let mut chains = vec![Vec::with_capacity(iterations * walkers); variables];
    let mut append = |points: &DMatrix<f64>| {
        for (chain, row) in chains.iter_mut().zip(points.row_iter()) {
            chain.extend(row.iter());
        }
    };
    earlier.iter().for_each(|state| append(&state.points));
    let finished = earlier.len();
    let mut state = match earlier.into_iter().last() {
        Some(state) => state,
        None => {
            let objectives = objectives(problem, starts)?;
            let lowest = (Vec::new(), f64::INFINITY);
            let points = starts.clone();
            ChainState {
                points,
                objectives,
                accepted: 0,
                evaluations: walkers,
                inverse_temperature: 0.0,
                annealing: 0,
                lowest,
            }
        }
    };
    let (whole, separate) = (0..walkers, ensembles(walkers));
    let step = OPTIMAL_STEP / (2.0 * variables as f64).sqrt();
    let mut proposed = Vec::new();
    for iteration in finished..iterations {
        let is_annealing = state.inverse_temperature < 1.0;
        if is_annealing {
            state.anneal(&mut RandomStream::new(seed, (iteration as u64) << 32 | RESAMPLING_STREAM));
        }
        let groups: &[Range<usize>] = if is_annealing { std::slice::from_ref(&whole) } else { &separate };
        let ChainState { points, objectives, accepted, evaluations, inverse_temperature, lowest, .. } = &mut state;
        for second_moves in [false, true] {
            proposed.clear();
            let mut proposals = Vec::with_capacity(walkers.div_ceil(2));
            let moving = groups.iter().flat_map(|ensemble| {
                let middle = ensemble.start.midpoint(ensemble.end);
                let (first, second) = (ensemble.start..middle, middle..ensemble.end);
                let (moving, standing) = if second_moves { (second, first) } else { (first, second) };
                moving.map(move |walker| (walker, standing.clone()))
            });
            for (walker, standing) in moving {
                let mut numbers = RandomStream::new(seed, (iteration as u64) << 32 | walker as u64);
                let one = numbers.uniform_index(standing.len());
                let other = (one + 1 + numbers.uniform_index(standing.len() - 1)) % standing.len();
                let (one, other) = (standing.start + one, standing.start + other);
                let gamma = if numbers.uniform() < UNIT_STEP_FRACTION { 1.0 } else { step };
                let proposal = |j: usize| points[(j, walker)] + gamma * (points[(j, one)] - points[(j, other)]);
                if (0..variables).all(|j| (bounds[j].0..=bounds[j].1).contains(&proposal(j))) {
                    proposed.extend((0..variables).map(proposal));
                    let favour = -numbers.uniform().ln();
                    proposals.push(Proposal { walker, max_increase: favour });
                }
            }
            if proposals.is_empty() {
                continue;
            }
            let trial_points = DMatrix::from_column_slice(variables, proposals.len(), &proposed);
            let trial_objectives = self::objectives(problem, &trial_points)?;
            *evaluations += proposals.len();
            for (index, Proposal { walker, max_increase: favour }) in proposals.into_iter().enumerate() {
                let increase = (trial_objectives[index] - objectives[walker]) / 2.0;
                if *inverse_temperature * increase < favour {
                    points.set_column(walker, &trial_points.column(index));
                    objectives[walker] = trial_objectives[index];
                    *accepted += 1;
                    if trial_objectives[index] < lowest.1 {
                        *lowest = (trial_points.column(index).iter().copied().collect(), trial_objectives[index]);
                    }
                }
            }
        }
        append(&state.points);
        on_iteration(&state);
    }
    let ChainState { accepted, evaluations, lowest, annealing, .. } = state;
    let acceptance = accepted as f64 / (iterations * walkers).max(1) as f64;
    Ok(EnsembleChains { walkers, iterations, chains, acceptance, evaluations, lowest, annealing })
}

/// The state after an iteration, from which the next one starts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ChainState {
    /// Variable × walker.
    points: DMatrix<f64>,
    /// S of each walker.
    objectives: Vec<f64>,
    /// Proposals accepted, and points evaluated, since the start.
    accepted: usize,
    evaluations: usize,
    /// β of the last moves, and the iterations that began below one.
    inverse_temperature: f64,
    annealing: usize,
    /// The point with the lowest S so far, and that S; no point before the first is accepted.
    lowest: (Vec<f64>, f64),
}

impl ChainState {
    /// Length of a state as numbers.
    pub(crate) fn length(variables: usize, walkers: usize) -> usize {
        (variables + 1) * (walkers + 1) + 4
    }

    /// Raises β as far as the weights `exp(−ΔβS/2)` keep their effective sample size, and resamples the walkers by
    /// them: systematically, which adds the least noise, and in random order, as halves and ensembles are by number.
    fn anneal(&mut self, numbers: &mut RandomStream) {
        self.annealing += 1;
        let least = self.objectives.iter().copied().fold(f64::INFINITY, f64::min);
        let weights = |rise: f64| -> Vec<f64> {
            // A walker whose S is infinite has no weight; where none is finite, all stay.
            let weight = |s: &f64| if *s == least { 1.0 } else { (-rise * (s - least) / 2.0).exp() };
            self.objectives.iter().map(weight).collect()
        };
        let effective = |rise: f64| {
            let (sum, squares) = weights(rise).iter().fold((0.0, 0.0), |(sum, squares), w| (sum + w, squares + w * w));
            sum * sum / squares
        };
        let finite = self.objectives.iter().filter(|s| s.is_finite()).count();
        let target = ANNEALING_SAMPLE * finite as f64;
        let left = 1.0 - self.inverse_temperature;
        let rise = if finite == 0 || effective(left) >= target {
            self.inverse_temperature = 1.0;
            left
        } else {
            let (mut low, mut high) = (SMALLEST_LOG_RISE, 0.0);
            for _ in 0..RISE_BISECTIONS {
                let middle = f64::midpoint(low, high);
                if effective(left * middle.exp()) >= target { low = middle } else { high = middle }
            }
            self.inverse_temperature += left * low.exp();
            left * low.exp()
        };
        let weights = weights(rise);
        let spacing = weights.iter().sum::<f64>() / weights.len() as f64;
        let mut position = spacing * numbers.uniform();
        let mut chosen = Vec::with_capacity(weights.len());
        let mut passed = 0.0;
        for (walker, weight) in weights.iter().enumerate() {
            passed += weight;
            while position < passed && chosen.len() < weights.len() {
                chosen.push(walker);
                position += spacing;
            }
        }
        // Rounding of the cumulative sum can leave the last place empty: the last walker takes it.
        chosen.resize(weights.len(), weights.len() - 1);
        for place in (1..chosen.len()).rev() {
            chosen.swap(place, numbers.uniform_index(place + 1));
        }
        self.points = self.points.select_columns(&chosen);
        self.objectives = chosen.iter().map(|&walker| self.objectives[walker]).collect();
    }

    /// As numbers: points, objectives, counts, lowest S and its point.
    pub(crate) fn to_numbers(&self) -> Vec<f64> {
        let counts = [
            self.accepted as f64,
            self.evaluations as f64,
            self.inverse_temperature,
            self.annealing as f64,
            self.lowest.1,
        ];
        let mut numbers = [self.points.as_slice(), &self.objectives, &counts, &self.lowest.0].concat();
        numbers.resize(Self::length(self.points.nrows(), self.points.ncols()), 0.0);
        numbers
    }

    /// From the numbers of a state of as many variables and walkers.
    pub(crate) fn from_numbers(numbers: &[f64], variables: usize, walkers: usize) -> Self {
        let (points, rest) = numbers.split_at(variables * walkers);
        let (objectives, rest) = rest.split_at(walkers);
        let (counts, lowest) = rest.split_at(5);
        Self {
            points: DMatrix::from_column_slice(variables, walkers, points),
            objectives: objectives.to_vec(),
            accepted: counts[0] as usize,
            evaluations: counts[1] as usize,
            inverse_temperature: counts[2],
            annealing: counts[3] as usize,
            lowest: (if counts[4] < f64::INFINITY { lowest.to_vec() } else { Vec::new() }, counts[4]),
        }
    }
}

/// A proposal, and the largest accepted increase of S/2, `−ln u` of a uniform random u.
struct Proposal {
    walker: usize,
    max_increase: f64,
}

/// S at points; infinite where it cannot be computed, so that no walker accepts such a point and one that starts there
/// leaves it.
fn objectives<P: LeastSquares>(problem: &mut P, points: &DMatrix<f64>) -> Result<Vec<f64>, P::Error> {
    let residuals = problem.residuals(points)?;
    let finite = |s: f64| if s.is_finite() { s } else { f64::INFINITY };
    Ok(residuals.column_iter().map(|column| finite(column.norm_squared())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::chain_diagnostics::ChainDiagnostics;
    use std::convert::Infallible;

    /// Residuals of a function between bounds.
    struct Problem<F> {
        bounds: Vec<(f64, f64)>,
        residuals: F,
    }

    impl<F: Fn(&[f64]) -> Vec<f64>> LeastSquares for Problem<F> {
        type Error = Infallible;

        fn bounds(&self) -> &[(f64, f64)] {
            &self.bounds
        }

        fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Infallible> {
            let columns = points.column_iter().map(|point| (self.residuals)(point.clone_owned().as_slice()).into());
            Ok(DMatrix::from_columns(&columns.collect::<Vec<nalgebra::DVector<f64>>>()))
        }
    }

    fn walked<F: Fn(&[f64]) -> Vec<f64>>(bounds: &[(f64, f64)], residuals: F, from: &[(f64, f64)]) -> EnsembleChains {
        let mut problem = Problem { bounds: bounds.to_vec(), residuals };
        let Ok(sampled) = ensemble_mcmc(&mut problem, &uniform_starts(from, 400, 99), 600, 7);
        sampled
    }

    /// The chains of a variable without the first third.
    fn kept(sampled: &EnsembleChains, variable: usize) -> &[f64] {
        &sampled.chains[variable][sampled.iterations / 3 * sampled.walkers..]
    }

    fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
        values.clone().sum::<f64>() / values.count() as f64
    }

    const WIDE: (f64, f64) = (-1e3, 1e3);

    /// A valley fifty times as long as wide, and oblique: variances 1 and 1, correlation 0.9996. 160,000 draws are
    /// worth some 20,000 independent ones, so variances have a standard error of 1 %; the tolerance is four of these.
    #[test]
    fn the_covariance_of_a_narrow_normal_density_is_recovered() {
        let r = 0.9996f64;
        let residuals = |p: &[f64]| vec![p[0] - 3.0, ((p[1] + 2.0) - r * (p[0] - 3.0)) / (1.0 - r * r).sqrt()];
        let found = walked(&[WIDE, WIDE], residuals, &[(1.0, 5.0), (-4.0, 0.0)]);
        let (x, y) = (kept(&found, 0), kept(&found, 1));
        let (mx, my) = (mean(x.iter().copied()), mean(y.iter().copied()));
        assert!((mx - 3.0).abs() < 0.04 && (my + 2.0).abs() < 0.04, "means {mx} and {my}");
        let moment = |f: &dyn Fn(f64, f64) -> f64| mean(x.iter().zip(y).map(|(a, b)| f(a - mx, b - my)));
        let (xx, yy) = (moment(&|a, _| a * a), moment(&|_, b| b * b));
        let across = moment(&|a, b| (b - r * a).powi(2)) / (1.0 - r * r);
        for (direction, variance) in [("x", xx), ("y", yy), ("across the valley", across)] {
            assert!((variance - 1.0).abs() < 0.04, "variance {direction}: {variance}");
        }
        assert!((0.25..0.5).contains(&found.acceptance), "{}", found.acceptance);
        assert!(found.lowest.1 < 0.01 && (found.lowest.0[0] - 3.0).abs() < 0.1, "{:?}", found.lowest);
    }

    /// First variable: half of a normal density, cut at its centre by the bound, with mean √(2/π) and probability
    /// erf(1/√2) below one. Second: S is quadratic in the logarithm with σ = 0.5, which makes the logarithm normal with
    /// mean and variance σ².
    #[test]
    fn a_truncated_density_and_a_skewed_density_are_recovered() {
        let residuals = |p: &[f64]| vec![p[0], p[1].max(1e-9).ln() / 0.5];
        let found = walked(&[(0.0, 50.0), (1e-6, 50.0)], residuals, &[(0.0, 3.0), (0.2, 3.0)]);
        let half = kept(&found, 0);
        assert!((mean(half.iter().copied()) - 0.797_88).abs() < 0.02);
        let below = mean(half.iter().map(|&x| f64::from(u8::from(x < 1.0))));
        assert!((below - 0.682_69).abs() < 0.015, "{below} below one");
        let mut skewed = kept(&found, 1).to_vec();
        skewed.sort_by(f64::total_cmp);
        let at = |share: f64| skewed[(share * skewed.len() as f64) as usize];
        // exp(−(ln x)²/(2σ²)) dx is normal in u = ln x with mean σ².
        for (share, deviations) in [(0.5, 0.0), (0.025, -1.959_96), (0.975, 1.959_96)] {
            let exact = (0.25f64 + 0.5 * deviations).exp();
            assert!((at(share) / exact - 1.0).abs() < 0.04, "{share}: {} for {exact}", at(share));
        }
    }

    #[test]
    fn the_seed_determines_the_chains() {
        let starts = DMatrix::from_fn(2, 16, |j, walker| 0.1 * (walker as f64) + j as f64);
        let walked = |seed| {
            let mut problem = Problem { bounds: vec![WIDE; 2], residuals: |p: &[f64]| p.to_vec() };
            let Ok(sampled) = ensemble_mcmc(&mut problem, &starts, 20, seed);
            sampled
        };
        assert_eq!(walked(1), walked(1));
        assert_ne!(walked(1).chains, walked(2).chains);
    }

    #[test]
    fn chains_go_on_from_any_iteration_to_the_same_bits() {
        let starts = DMatrix::from_fn(2, 16, |j, walker| 0.1 * (walker as f64) + j as f64);
        let mut problem = Problem { bounds: vec![WIDE; 2], residuals: |p: &[f64]| p.to_vec() };
        let mut states = Vec::new();
        let mut on_iteration = |state: &ChainState| states.push(state.to_numbers());
        let Ok(whole) = ensemble_mcmc_from(&mut problem, &starts, 20, 1, Vec::new(), &mut on_iteration);
        assert_eq!((states.len(), states[0].len()), (20, ChainState::length(2, 16)));
        for kept in [0, 1, 13, 20] {
            let earlier = states[..kept].iter().map(|numbers| ChainState::from_numbers(numbers, 2, 16)).collect();
            let mut others = Vec::new();
            let mut on_iteration = |state: &ChainState| others.push(state.to_numbers());
            let Ok(resumed) = ensemble_mcmc_from(&mut problem, &starts, 20, 1, earlier, &mut on_iteration);
            assert_eq!(resumed, whole);
            assert_eq!(others, states[kept..]);
        }
        // Another state is noticed in the chains.
        let other = [&states[0], &states[2]].map(|numbers| ChainState::from_numbers(numbers, 2, 16)).to_vec();
        let Ok(other) = ensemble_mcmc_from(&mut problem, &starts, 20, 1, other, &mut |_| {});
        assert_ne!(other, whole);
    }

    /// Two modes of equal density, one twice as wide: it holds two thirds of the probability, though the walkers start
    /// half in each.
    #[test]
    fn modes_are_sampled_by_their_probability_whatever_the_starts() {
        let wells = |p: &[f64]| vec![if p[0] < 0.0 { p[0] + 10.0 } else { (p[0] - 10.0) / 2.0 }];
        let found = walked(&[WIDE], wells, &[(-11.0, 11.0)]);
        let share = mean(kept(&found, 0).iter().map(|&x| f64::from(u8::from(x > 0.0))));
        assert!((share - 2.0 / 3.0).abs() < 0.03, "{share}");
    }

    /// Two modes, one twice as wide as the other, 16 to 200 standard deviations apart within bounds six times as far:
    /// the wide one holds two thirds of the probability.
    #[test]
    fn a_second_mode_is_found_with_its_probability_however_far_it_is_from_the_first() {
        for distance in [16.0, 40.0, 200.0] {
            let wells = move |p: &[f64]| {
                let from_mode = if p[0] < 0.0 { p[0] + distance / 2.0 } else { (p[0] - distance / 2.0) / 2.0 };
                vec![from_mode, p[1]]
            };
            let bounds = [(-3.0 * distance, 3.0 * distance), (-50.0, 50.0)];
            let found = walked(&bounds, wells, &bounds);
            let share = mean(kept(&found, 0).iter().map(|&x| f64::from(u8::from(x > 0.0))));
            let diagnostics = ChainDiagnostics::from_chains(kept(&found, 0), found.walkers);
            assert!((share - 2.0 / 3.0).abs() < 0.05, "{distance}: {share}, {diagnostics:?}");
            assert!(found.annealing < 40, "{distance}: {} iterations of annealing", found.annealing);
        }
    }

    /// A local minimum with S = 200 has a probability of e⁻¹⁰⁰, and is a thousand standard deviations wide: proposals
    /// as short as the differences of walkers in the minimum do not lead out of it.
    #[test]
    fn no_walker_is_left_in_a_local_minimum() {
        let wells = |p: &[f64]| vec![if p[0] < 0.0 { p[0] + 500.0 } else { (200.0 + (p[0] - 500.0).powi(2)).sqrt() }];
        let found = walked(&[WIDE], wells, &[WIDE]);
        assert!(kept(&found, 0).iter().all(|&x| x < 0.0));
    }

    /// Each mode is narrow where the other is wide, so that hardly any proposal leads from one to the other. The
    /// ensembles agree, as each has walkers in both; the autocorrelation time says that no walker moves.
    #[test]
    fn walkers_stuck_in_two_modes_have_an_autocorrelation_time_as_long_as_their_chains() {
        let well = |p: &[f64]| {
            let (wide, narrow) = (p[0].abs() - 10.0, 100.0);
            if p[0] < 0.0 { vec![wide * narrow, p[1]] } else { vec![wide, p[1] * narrow] }
        };
        let both = walked(&[WIDE, WIDE], well, &[(-11.0, 11.0), (-1.0, 1.0)]);
        let one = walked(&[(0.0, 1e3), WIDE], well, &[(9.0, 11.0), (-1.0, 1.0)]);
        let (both, one) = (
            ChainDiagnostics::from_chains(kept(&both, 0), both.walkers),
            ChainDiagnostics::from_chains(kept(&one, 0), one.walkers),
        );
        assert!(both.autocorrelation_time > 100.0, "{both:?}");
        assert!(one.r_hat < ChainDiagnostics::R_HAT_LIMIT && one.autocorrelation_time < 15.0, "{one:?}");
    }

    #[test]
    fn walkers_leave_a_start_that_cannot_be_computed_and_do_not_return() {
        let residuals = |p: &[f64]| vec![if p[0] < 0.0 { f64::NAN } else { p[0] - 1.0 }];
        let found = walked(&[WIDE], residuals, &[(-1.0, 3.0)]);
        assert!(kept(&found, 0).iter().all(|&x| x >= 0.0));
    }
}
