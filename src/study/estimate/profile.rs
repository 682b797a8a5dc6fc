//! Profile likelihood: the minimum of the objective over all other factors, for fixed values of one.
//!
//! The rise Δ of the objective above its minimum is distributed as the square of Student's t under the noise model, so
//! the values with a rise below `t²` form the confidence interval (Bates & Watts, *Nonlinear Regression Analysis*,
//! 1988, section 6.1). It needs no derivative at the estimate: for a nearly linear problem it equals the linear
//! interval, and otherwise, or near a bound, it follows the shape of the objective. The objective is the one that the
//! estimate minimises, and the level is such that a linear problem has its linear interval.

use super::{Estimand, EstimateError};
use crate::fit::{Fit, LeastSquares, Options, minimize_within};
use nalgebra::DMatrix;

/// The profile of one factor.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Profile {
    /// Index of the factor among the estimated factors.
    pub factor: usize,
    /// All factors at the minimum for each fixed value, in rising order of that value and including the estimate.
    pub points: Vec<Vec<f64>>,
    /// Rise of the objective at each point, in squares of a standard error; NaN where the march failed.
    pub rises: Vec<f64>,
    /// Rise at the ends of the 95 % interval.
    pub level: f64,
    /// Lower and upper end of the interval; `None` where a bound comes first.
    pub interval: (Option<f64>, Option<f64>),
}

/// The linear approximation at the estimate.
pub(super) struct LinearApproximation<'a> {
    pub values: &'a [f64],
    pub bounds: &'a [(f64, f64)],
    /// Standard errors and correlation to first order, and the rise of the objective at the ends of the linear
    /// intervals.
    pub errors: &'a [f64],
    pub levels: &'a [f64],
    pub correlation: &'a [Vec<f64>],
}

/// Initial points per side, and their reach in half-widths of the linear interval.
const POINTS_PER_SIDE: usize = 8;
const INITIAL_REACH: f64 = 1.5;

/// One side of a profile, extended outwards from the estimate.
struct ProfileSide {
    factor: usize,
    /// Distance from the estimate covered so far; all distances are negative on the lower side.
    from: f64,
    /// Distance from the estimate to be covered next.
    to: f64,
    /// Distance from the estimate to the bound.
    end: f64,
    values: usize,
    /// Points and objectives, outwards.
    points: Vec<(Vec<f64>, f64)>,
}

/// Profiles of the selected factors. All points of all profiles are minimised as one batch. A side that has not reached
/// the level is extended to twice the distance, up to the bound.
pub(super) fn profiles<P: LeastSquares>(
    problem: &mut P,
    places: &[usize],
    about: &LinearApproximation,
    options: &Options,
) -> Result<Vec<Profile>, P::Error> {
    if places.is_empty() {
        return Ok(Vec::new());
    }
    let estimate = DMatrix::from_column_slice(about.values.len(), 1, about.values);
    let least = problem.residuals(&estimate)?.norm_squared();
    let mut flanks: Vec<ProfileSide> =
        places.iter().flat_map(|&place| [-1.0, 1.0].map(|side| about.side(place, side))).collect();
    loop {
        let mut going: Vec<&mut ProfileSide> = flanks.iter_mut().filter(|flank| !flank.is_done(least, about)).collect();
        let held: Vec<(usize, f64)> = going.iter().flat_map(|flank| flank.next_values(about)).collect();
        if held.is_empty() {
            break;
        }
        let starts: Vec<f64> = held.iter().flat_map(|&(place, value)| about.start(place, value)).collect();
        let starts = DMatrix::from_vec(about.values.len(), held.len(), starts);
        let bounds: Vec<Vec<(f64, f64)>> =
            held.iter().map(|&(place, value)| about.bounds_with_fixed(place, value)).collect();
        let mut fits = minimize_within(problem, &starts, &bounds, options)?.into_iter();
        for flank in &mut going {
            flank.extend(fits.by_ref().take(flank.values));
        }
    }
    Ok(flanks.chunks(2).map(|sides| profile(&sides[0], &sides[1], least, about)).collect())
}

impl LinearApproximation<'_> {
    fn side(&self, place: usize, side: f64) -> ProfileSide {
        let (low, high) = self.bounds[place];
        let end = if side < 0.0 { low } else { high } - self.values[place];
        let reach = INITIAL_REACH * self.levels[place].sqrt() * self.errors[place];
        // A reach of zero would never grow by doubling.
        let to = if reach > 0.0 && reach < end.abs() { side * reach } else { end };
        ProfileSide {
            factor: place,
            from: 0.0,
            to,
            end,
            values: if end == 0.0 { 0 } else { POINTS_PER_SIDE },
            points: Vec::new(),
        }
    }

    /// Start of a minimisation with one factor fixed: the minimum for a linear problem.
    fn start(&self, place: usize, value: f64) -> Vec<f64> {
        let along = |other: usize| {
            let share = self.correlation[other][place] * self.errors[other] / self.errors[place];
            let (low, high) = self.bounds[other];
            let there = self.values[other] + share * (value - self.values[place]);
            if there.is_finite() { there.max(low).min(high) } else { self.values[other] }
        };
        (0..self.values.len()).map(|other| if other == place { value } else { along(other) }).collect()
    }

    /// The bounds with one factor fixed.
    fn bounds_with_fixed(&self, place: usize, value: f64) -> Vec<(f64, f64)> {
        let mut bounds = self.bounds.to_vec();
        bounds[place] = (value, value);
        bounds
    }
}

impl ProfileSide {
    /// The next fixed values of the factor.
    fn next_values(&self, about: &LinearApproximation) -> Vec<(usize, f64)> {
        let at = |step: usize| self.from + (self.to - self.from) * step as f64 / self.values as f64;
        let (low, high) = about.bounds[self.factor];
        (1..=self.values).map(|step| (self.factor, (about.values[self.factor] + at(step)).max(low).min(high))).collect()
    }

    fn extend(&mut self, fits: impl Iterator<Item = Fit>) {
        self.points.extend(fits.map(|fit| (fit.point.iter().copied().collect(), fit.objective)));
        self.from = self.to;
        self.values = if self.to == self.end { 0 } else { POINTS_PER_SIDE / 2 };
        self.to = if (2.0 * self.to).abs() < self.end.abs() { 2.0 * self.to } else { self.end };
    }

    /// Whether the side has reached its bound or the level.
    fn is_done(&self, least: f64, about: &LinearApproximation) -> bool {
        let level = about.levels[self.factor];
        self.values == 0 || self.points.iter().any(|(_, objective)| objective - least >= level)
    }
}

/// A profile from its two sides. The estimate is a point of both, so neither end of the interval is on the wrong side
/// of it.
fn profile(below: &ProfileSide, above: &ProfileSide, least: f64, about: &LinearApproximation) -> Profile {
    let (place, level) = (below.factor, about.levels[below.factor]);
    let middle = (about.values.to_vec(), least);
    let end = |flank: &ProfileSide| {
        let way: Vec<(f64, f64)> = std::iter::once(&middle)
            .chain(&flank.points)
            .map(|(point, objective): &(Vec<f64>, f64)| (point[place], objective - least))
            .filter(|(_, rise)| rise.is_finite())
            .collect();
        crossing(&way, level)
    };
    let interval = (end(below), end(above));
    let met = below.points.iter().rev().chain(std::iter::once(&middle)).chain(&above.points);
    let (points, rises) = met.map(|(point, objective)| (point.clone(), objective - least)).unzip();
    Profile { factor: place, points, rises, level, interval }
}

/// Value at which the rise first reaches a level, by linear interpolation of the square root of the rise, which is
/// linear for a linear problem.
fn crossing(way: &[(f64, f64)], level: f64) -> Option<f64> {
    let pair = way.windows(2).find(|pair| pair[1].1 >= level)?;
    let [a, b] = [pair[0], pair[1]].map(|(value, rise)| (value, rise.max(0.0).sqrt()));
    Some(a.0 + (b.0 - a.0) * (level.sqrt() - a.1) / (b.1 - a.1))
}

/// Indices of the factors with these names; a name selects a factor in all cases, including its variants per case.
pub(super) fn profile_indices(factors: &[Estimand], names: &[String]) -> Result<Vec<usize>, EstimateError> {
    let mut places = Vec::new();
    for name in names {
        let is_meant = |factor: &Estimand| {
            let known = &factor.factor.name;
            known == name || known.split('@').next() == Some(name)
        };
        let meant: Vec<usize> = (0..factors.len()).filter(|&place| is_meant(&factors[place])).collect();
        if meant.is_empty() {
            let known: Vec<&str> = factors.iter().map(|factor| factor.factor.name.as_str()).collect();
            return Err(EstimateError::ProfileNotEstimated { name: name.clone(), known: known.join(", ") });
        }
        places.extend(meant);
    }
    places.sort_unstable();
    places.dedup();
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// Two variables with given residuals and bounds.
    struct Model<F> {
        bounds: [(f64, f64); 2],
        residuals: F,
    }

    impl<F: Fn(f64, f64) -> [f64; 3]> LeastSquares for Model<F> {
        type Error = Infallible;

        fn bounds(&self) -> &[(f64, f64)] {
            &self.bounds
        }

        fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Infallible> {
            let each: Vec<f64> = points.column_iter().flat_map(|point| (self.residuals)(point[0], point[1])).collect();
            Ok(DMatrix::from_vec(3, points.ncols(), each))
        }
    }

    const WIDE: (f64, f64) = (0.1, 9.0);

    fn profiled<F: Fn(f64, f64) -> [f64; 3]>(bounds: [(f64, f64); 2], errors: [f64; 2], residuals: F) -> Vec<Profile> {
        let correlation = [vec![1.0, 0.0], vec![0.0, 1.0]];
        let about = LinearApproximation {
            values: &[1.0, 2.0],
            bounds: &bounds,
            errors: &errors,
            levels: &[4.0; 2],
            correlation: &correlation,
        };
        let Ok(found) = profiles(&mut Model { bounds, residuals }, &[0, 1], &about, &Options::default());
        found
    }

    /// Residuals linear in both variables about (1, 2): the covariance is ((13, −5), (−5, 2)).
    fn straight(x: f64, y: f64) -> [f64; 3] {
        let (x, y) = (x - 1.0, y - 2.0);
        [x + 2.0 * y, x + 3.0 * y, 0.0]
    }

    #[test]
    fn a_profile_of_linear_residuals_is_the_parabola_of_the_linear_interval() {
        let errors = [13f64.sqrt(), 5f64.sqrt()];
        let wide = [(-99.0, 99.0); 2];
        // (JᵀJ)⁻¹ of J = ((1, 2), (1, 3)) is ((13, −5), (−5, 2)).
        for (found, variance) in profiled(wide, errors, straight).iter().zip([13.0, 2.0]) {
            let centre = [1.0, 2.0][found.factor];
            for (point, rise) in found.points.iter().zip(&found.rises) {
                let parabola = (point[found.factor] - centre).powi(2) / variance;
                assert!((rise - parabola).abs() < 1e-6 * (1.0 + parabola), "{rise} for {parabola}");
            }
            let half = 2.0 * f64::sqrt(variance);
            let (Some(low), Some(high)) = found.interval else { panic!("{found:?}") };
            assert!((low - (centre - half)).abs() < 1e-5 && (high - (centre + half)).abs() < 1e-5, "{low} {high}");
        }
    }

    #[test]
    fn a_profile_follows_the_nonlinear_objective() {
        // The logarithm of the first variable has standard error 1: its interval is from exp(−2) to exp(2), not 1 ± 2.
        let found = profiled([(0.01, 99.0); 2], [1.0, 1.0], |x, y| [x.ln(), y - 2.0, 0.0]);
        let (Some(low), Some(high)) = found[0].interval else { panic!("{:?}", found[0]) };
        assert!((low / (-2f64).exp() - 1.0).abs() < 0.02 && (high / 2f64.exp() - 1.0).abs() < 0.02, "{low} to {high}");
    }

    #[test]
    fn a_side_that_reaches_its_bound_first_has_no_end() {
        let found = profiled([(0.5, 9.0), WIDE], [3.0, 1.0], |x, y| [0.1 * (x - 1.0), y - 2.0, 0.0]);
        assert_eq!(found[0].interval, (None, None));
        assert_eq!((found[0].points[0][0], found[0].points.last().map(|point| point[0])), (0.5, Some(9.0)));
        // The interval is 2 ± 2: below, the bound of 0.1 comes first.
        let (None, Some(high)) = found[1].interval else { panic!("{:?}", found[1]) };
        assert!((high - 4.0).abs() < 1e-6, "{high}");
    }

    #[test]
    fn a_side_is_extended_where_the_linear_interval_is_far_too_short() {
        let found = profiled([(-99.0, 99.0); 2], [0.01, 0.01], |x, y| [x - 1.0, y - 2.0, 0.0]);
        let (Some(low), Some(high)) = found[0].interval else { panic!("{:?}", found[0]) };
        assert!((low + 1.0).abs() < 1e-6 && (high - 3.0).abs() < 1e-6, "{low} to {high}");
    }
}
