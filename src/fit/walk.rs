//! Points drawn as often as they are likely: an ensemble of walkers.
//!
//! A sum of squares `S(P)` between bounds is the density `exp(−S/2)` there, and none beyond: that of normal residuals in
//! standard deviations, of a loss, and of priors that are residuals themselves. A walker at X moves by the difference of two
//! others, to `X + γ (Y − Z)`, and stays where it is but for a chance of `exp((S(X) − S)/2)`. No step has to be chosen, and a
//! valley however narrow and oblique is walked like a round bowl, as the moves do not know one from the other: they are affine
//! invariant, like the stretch moves of Goodman & Weare (Commun. Appl. Math. Comput. Sci. 5, 2010), which came first. γ is
//! 2.38/√(2n), and one in a tenth of the moves, which leads from one minimum into another where there are several (ter Braak, Stat.
//! Comput. 16, 2006).
//!
//! Stretch moves, along the line through one other walker, were tried: in 1, 2, 3, 5 and 8 variables a draw took them 27, 31, 40, 57
//! and 87 moves, and these 4, 8, 10, 17 and 27. Walks that follow derivatives (Hamiltonian ones) take fewer points in many variables; here there are a few, and points come by the
//! thousand while derivatives come dear.
//!
//! Half of the walkers move at a time, each by two of the other half, which stands: so all proposals of a half are one
//! ensemble, and the moves are still a Markov chain of the right density (Foreman-Mackey et al., Publ. Astron. Soc. Pac.
//! 125, 2013). What lies beyond a bound is turned down unasked.

use super::LeastSquares;
use crate::chance::Numbers;
use nalgebra::DMatrix;

/// The step that mixes a normal density soonest, in its deviations and for one variable (Roberts, Gelman & Gilks, Ann. Appl.
/// Probab. 7, 1997).
const STEP: f64 = 2.38;
/// The share of moves with a γ of one.
const JUMPS: f64 = 0.1;

/// Where walkers went.
#[derive(Clone, Debug, PartialEq)]
pub struct Walk {
    /// Chains side by side.
    pub walkers: usize,
    /// Iterations of each chain.
    pub moves: usize,
    /// Of each variable its values, move × walker, the starts left out.
    pub trails: Vec<Vec<f64>>,
    /// The share of proposals that was taken.
    pub acceptance: f64,
    /// Points at which residuals were asked for.
    pub evaluations: usize,
    /// The lowest point met and its S.
    pub lowest: (Vec<f64>, f64),
}

/// Walk from starts, one a column, so many moves. The walk depends on the seed, the starts and the residuals alone: each
/// move of each walker has numbers of its own.
///
/// # Errors
/// Those of the problem.
///
/// # Panics
/// When there are fewer than four walkers.
pub fn walk<P: LeastSquares>(
    problem: &mut P,
    starts: &DMatrix<f64>,
    moves: usize,
    seed: u64,
) -> Result<Walk, P::Error> {
    let (variables, walkers) = starts.shape();
    assert!(walkers >= 4, "a walker moves by two of the other half, and there are {walkers} in all");
    let bounds = problem.bounds().to_vec();
    let mut points = starts.clone();
    let mut objectives = objectives(problem, &points)?;
    let mut trails = vec![Vec::with_capacity(moves * walkers); variables];
    let (mut taken, mut evaluations, mut lowest) = (0, walkers, (Vec::new(), f64::INFINITY));
    let halves = [0..walkers / 2, walkers / 2..walkers];
    let step = STEP / (2.0 * variables as f64).sqrt();
    let mut proposed = Vec::new();
    for turn in 0..moves {
        for (moving, standing) in [(&halves[0], &halves[1]), (&halves[1], &halves[0])] {
            proposed.clear();
            let mut proposals = Vec::with_capacity(moving.len());
            for walker in moving.clone() {
                let mut numbers = Numbers::of(seed, (turn as u64) << 32 | walker as u64);
                let one = numbers.below(standing.len());
                let other = (one + 1 + numbers.below(standing.len() - 1)) % standing.len();
                let (one, other) = (standing.start + one, standing.start + other);
                let reach = if numbers.unit() < JUMPS { 1.0 } else { step };
                let to = |j: usize| points[(j, walker)] + reach * (points[(j, one)] - points[(j, other)]);
                if (0..variables).all(|j| (bounds[j].0..=bounds[j].1).contains(&to(j))) {
                    proposed.extend((0..variables).map(to));
                    let favour = -numbers.unit().ln();
                    proposals.push(Proposal { walker, favour });
                }
            }
            if proposals.is_empty() {
                continue;
            }
            let asked = DMatrix::from_column_slice(variables, proposals.len(), &proposed);
            let found = self::objectives(problem, &asked)?;
            evaluations += proposals.len();
            for (place, Proposal { walker, favour }) in proposals.into_iter().enumerate() {
                if favour + (objectives[walker] - found[place]) / 2.0 > 0.0 {
                    points.set_column(walker, &asked.column(place));
                    objectives[walker] = found[place];
                    taken += 1;
                    if found[place] < lowest.1 {
                        lowest = (asked.column(place).iter().copied().collect(), found[place]);
                    }
                }
            }
        }
        for (trail, row) in trails.iter_mut().zip(points.row_iter()) {
            trail.extend(row.iter());
        }
    }
    let acceptance = taken as f64 / (moves * walkers).max(1) as f64;
    Ok(Walk { walkers, moves, trails, acceptance, evaluations, lowest })
}

/// A walker that may move, and by how much chance lets the logarithm of its density fall.
struct Proposal {
    walker: usize,
    favour: f64,
}

/// S at points; infinite where nothing can be computed, so that no walker goes there and one that begins there leaves.
fn objectives<P: LeastSquares>(problem: &mut P, points: &DMatrix<f64>) -> Result<Vec<f64>, P::Error> {
    let residuals = problem.residuals(points)?;
    let finite = |s: f64| if s.is_finite() { s } else { f64::INFINITY };
    Ok(residuals.column_iter().map(|column| finite(column.norm_squared())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::mixing::Mixing;
    use std::convert::Infallible;

    /// Residuals of any function between bounds.
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

    fn walked<F: Fn(&[f64]) -> Vec<f64>>(bounds: &[(f64, f64)], residuals: F, from: &[(f64, f64)]) -> Walk {
        const WALKERS: usize = 400;
        let starts = DMatrix::from_fn(bounds.len(), WALKERS, |j, walker| {
            let mut numbers = Numbers::of(99, walker as u64);
            let unit = (0..=j).map(|_| numbers.unit()).last().expect("one at least");
            from[j].0 + (from[j].1 - from[j].0) * unit
        });
        let mut problem = Problem { bounds: bounds.to_vec(), residuals };
        let Ok(walk) = walk(&mut problem, &starts, 600, 7);
        walk
    }

    /// The values of a variable after the first third of the moves.
    fn kept(walk: &Walk, variable: usize) -> &[f64] {
        &walk.trails[variable][walk.moves / 3 * walk.walkers..]
    }

    fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
        values.clone().sum::<f64>() / values.count() as f64
    }

    const WIDE: (f64, f64) = (-1e3, 1e3);

    /// A valley fifty times as long as it is wide, that lies obliquely: variances 1 and 1, correlation 0.9996. 160,000
    /// draws are worth some 20,000, whose variances are known to 1 %; four of that.
    #[test]
    fn a_normal_density_of_known_covariance_is_recovered_however_narrow() {
        let r = 0.9996f64;
        let residuals = |p: &[f64]| vec![p[0] - 3.0, ((p[1] + 2.0) - r * (p[0] - 3.0)) / (1.0 - r * r).sqrt()];
        let found = walked(&[WIDE, WIDE], residuals, &[(1.0, 5.0), (-4.0, 0.0)]);
        let (x, y) = (kept(&found, 0), kept(&found, 1));
        let (mx, my) = (mean(x.iter().copied()), mean(y.iter().copied()));
        assert!((mx - 3.0).abs() < 0.04 && (my + 2.0).abs() < 0.04, "means {mx} and {my}");
        let moment = |f: &dyn Fn(f64, f64) -> f64| mean(x.iter().zip(y).map(|(a, b)| f(a - mx, b - my)));
        let (xx, yy) = (moment(&|a, _| a * a), moment(&|_, b| b * b));
        let across = moment(&|a, b| (b - r * a).powi(2)) / (1.0 - r * r);
        for (what, variance) in [("x", xx), ("y", yy), ("across the valley", across)] {
            assert!((variance - 1.0).abs() < 0.04, "variance {what}: {variance}");
        }
        assert!((0.25..0.5).contains(&found.acceptance), "{}", found.acceptance);
        assert!(found.lowest.1 < 0.01 && (found.lowest.0[0] - 3.0).abs() < 0.1, "{:?}", found.lowest);
    }

    /// Half of a normal about the bound: mean √(2/π), and a share of erf(1/√2) below one. Beside it a logarithm that is
    /// normal (S is of the logarithm, so the density by the variable is the normal one times nothing else): its median
    /// lies above e⁰, at exp(σ²) for σ = 0.5.
    #[test]
    fn a_density_that_a_bound_cuts_off_and_one_that_is_skewed_are_recovered() {
        let residuals = |p: &[f64]| vec![p[0], p[1].max(1e-9).ln() / 0.5];
        let found = walked(&[(0.0, 50.0), (1e-6, 50.0)], residuals, &[(0.0, 3.0), (0.2, 3.0)]);
        let half = kept(&found, 0);
        assert!((mean(half.iter().copied()) - 0.797_88).abs() < 0.02);
        let below = mean(half.iter().map(|&x| f64::from(u8::from(x < 1.0))));
        assert!((below - 0.682_69).abs() < 0.015, "{below} below one");
        let mut skewed = kept(&found, 1).to_vec();
        skewed.sort_by(f64::total_cmp);
        let at = |share: f64| skewed[(share * skewed.len() as f64) as usize];
        // exp(−(ln x)²/(2σ²)) dx is, by u = ln x, normal of mean σ².
        for (share, deviations) in [(0.5, 0.0), (0.025, -1.959_96), (0.975, 1.959_96)] {
            let exact = (0.25f64 + 0.5 * deviations).exp();
            assert!((at(share) / exact - 1.0).abs() < 0.04, "{share}: {} for {exact}", at(share));
        }
    }

    #[test]
    fn the_same_seed_walks_the_same_way_and_another_another() {
        let starts = DMatrix::from_fn(2, 10, |j, walker| 0.1 * (walker as f64) + j as f64);
        let walked = |seed| {
            let mut problem = Problem { bounds: vec![WIDE; 2], residuals: |p: &[f64]| p.to_vec() };
            let Ok(walk) = walk(&mut problem, &starts, 20, seed);
            walk
        };
        assert_eq!(walked(1), walked(1));
        assert_ne!(walked(1).trails, walked(2).trails);
    }

    /// One well as deep as the other and twice as wide: it holds two thirds, though walkers begin half and half.
    #[test]
    fn wells_are_drawn_by_what_they_hold_and_not_by_where_walkers_begin() {
        let wells = |p: &[f64]| vec![if p[0] < 0.0 { p[0] + 10.0 } else { (p[0] - 10.0) / 2.0 }];
        let found = walked(&[WIDE], wells, &[(-11.0, 11.0)]);
        let share = mean(kept(&found, 0).iter().map(|&x| f64::from(u8::from(x > 0.0))));
        assert!((share - 2.0 / 3.0).abs() < 0.03, "{share}");
    }

    /// Each well is narrow where the other is wide, so that hardly a difference of walkers leads from one into the other.
    #[test]
    fn walkers_in_two_wells_that_none_leaves_are_told_and_those_in_one_are_not() {
        let well = |p: &[f64]| {
            let (wide, narrow) = (p[0].abs() - 10.0, 100.0);
            if p[0] < 0.0 { vec![wide * narrow, p[1]] } else { vec![wide, p[1] * narrow] }
        };
        let both = walked(&[WIDE, WIDE], well, &[(-11.0, 11.0), (-1.0, 1.0)]);
        let one = walked(&[(0.0, 1e3), WIDE], well, &[(9.0, 11.0), (-1.0, 1.0)]);
        let (both, one) = (Mixing::of(kept(&both, 0), both.walkers), Mixing::of(kept(&one, 0), one.walkers));
        assert!(both.r_hat > 1.5, "{both:?}");
        assert!(one.r_hat < Mixing::R_HAT && one.autocorrelation_moves < 15.0, "{one:?}");
    }

    #[test]
    fn a_start_where_nothing_can_be_computed_is_left_and_none_goes_there() {
        let residuals = |p: &[f64]| vec![if p[0] < 0.0 { f64::NAN } else { p[0] - 1.0 }];
        let found = walked(&[WIDE], residuals, &[(-1.0, 3.0)]);
        assert!(kept(&found, 0).iter().all(|&x| x >= 0.0));
    }
}
