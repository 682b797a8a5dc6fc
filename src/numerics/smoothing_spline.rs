//! Cubic smoothing spline (Reinsch, Numer. Math. 10, 1967): of all curves whose mean square deviation from the data is
//! that of the noise, the one of least curvature.
//!
//! With `Q` the second differences and `R` the mass matrix of hat functions, the second derivatives γ solve the banded
//! system `(R + α QᵀQ) γ = Qᵀ y`, and the curve is `y − α Q γ` at the data. α is the root of `α² |Q γ|² = n σ²`. Time
//! and memory are linear in the number of data.

/// A step of the data is found if the mean of so many residuals
const WINDOW: usize = 7;
/// is off by so many of its standard deviations.
const CORNER_DEVIATIONS: f64 = 6.0;
/// Further corners are no steps but a noise that is larger than stated.
const MAX_CORNERS: usize = 20;
/// Relative accuracy of the sum of squares.
const TOLERANCE: f64 = 1e-4;
const MAX_ITERATIONS: usize = 60;
/// Largest α in cubes of the mean interval: an average over some 500 data. With a larger one the system is too
/// ill-conditioned.
const MAX_ALPHA: f64 = 1e11;

/// A smoothing spline at its data.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SmoothingSpline {
    /// One value per datum.
    pub(crate) values: Vec<f64>,
    /// Root mean square of data minus values.
    pub(crate) residual: f64,
    /// Indices of the data at which the slope may jump, ascending.
    pub(crate) corners: Vec<usize>,
}

/// The curve of least curvature whose root mean square distance from the data is `sigma`. At steps of the data, which
/// no smooth curve follows within the noise, its slope may jump. Times increase strictly.
pub(crate) fn smoothing_spline(times: &[f64], data: &[f64], sigma: f64) -> SmoothingSpline {
    let mut corners = Vec::new();
    let mut values = fit(times, data, sigma, &corners);
    while corners.len() < MAX_CORNERS
        && let Some(corner) = worst_corner(times, data, &values, sigma, &corners)
    {
        corners.push(corner);
        corners.sort_unstable();
        values = fit(times, data, sigma, &corners);
    }
    let squares: f64 = data.iter().zip(&values).map(|(datum, value)| (datum - value).powi(2)).sum();
    SmoothingSpline { residual: (squares / data.len().max(1) as f64).sqrt(), values, corners }
}

/// The datum of largest change of slope near the residuals of most significant mean; `None` if none is significant.
fn worst_corner(times: &[f64], data: &[f64], values: &[f64], sigma: f64, corners: &[usize]) -> Option<usize> {
    let count = data.len();
    if count < 2 * WINDOW {
        return None;
    }
    let residuals: Vec<f64> = data.iter().zip(values).map(|(datum, value)| (datum - value) / sigma).collect();
    let deviation = |window: &[f64]| window.iter().sum::<f64>().abs() / (window.len() as f64).sqrt();
    let significant = residuals.windows(WINDOW).enumerate().map(|(start, window)| (start, deviation(window)));
    let (start, _) = significant.filter(|(_, off)| *off > CORNER_DEVIATIONS).max_by(|a, b| a.1.total_cmp(&b.1))?;
    // The mean of the data over a window on each side of a datum, against its own value, shows its corner.
    let bend = |index: usize| {
        let [before, after] = [index - WINDOW / 2, index + WINDOW / 2];
        let line = |from: usize, to: usize| (data[to] - data[from]) / (times[to] - times[from]);
        (line(index, after) - line(before, index)).abs()
    };
    let near = start.saturating_sub(WINDOW).max(WINDOW / 2)..(start + 2 * WINDOW).min(count - WINDOW / 2);
    near.filter(|index| !corners.contains(index)).max_by(|a, b| bend(*a).total_cmp(&bend(*b)))
}

/// The spline with these corners, for the α whose sum of squares is that of the noise.
fn fit(times: &[f64], data: &[f64], sigma: f64, corners: &[usize]) -> Vec<f64> {
    let count = data.len();
    if count < 3 {
        return data.to_vec();
    }
    let system = System::new(times, data, corners);
    let target = count as f64 * sigma * sigma;
    // The sum of squares rises with α: as α² of little smoothing, to that of straight lines.
    let length = (times[count - 1] - times[0]) / (count - 1) as f64;
    let mut alpha = length.powi(3);
    // Logarithm of α and of the ratio of the sums, below and above the root.
    let (mut low, mut high) = (None, None);
    let mut offsets = system.offsets(alpha);
    for _ in 0..MAX_ITERATIONS {
        let ratio = (offsets.iter().map(|off| off * off).sum::<f64>() / target).ln();
        if !ratio.is_finite() || ratio.abs() < TOLERANCE {
            break;
        }
        let at = (alpha.ln(), ratio);
        let end = if ratio < 0.0 { &mut low } else { &mut high };
        *end = Some(at);
        let next = match (low, high) {
            // Where the root is not enclosed: a factor of ten, or what a square of α asks for.
            (Some((log, ratio)), None) => log + (-0.5 * ratio).max(10f64.ln()),
            (None, Some((log, ratio))) => log - (0.5 * ratio).max(10f64.ln()),
            (Some((a, from)), Some((b, to))) => {
                let share = (-from / (to - from)).clamp(0.1, 0.9);
                a + (b - a) * share
            }
            (None, None) => break,
        };
        if next > (MAX_ALPHA * length.powi(3)).ln() {
            break;
        }
        alpha = next.exp();
        offsets = system.offsets(alpha);
    }
    data.iter().zip(offsets).map(|(datum, off)| datum - off).collect()
}

/// The banded matrices of the interior data.
struct System {
    /// Reciprocal intervals.
    rates: Vec<f64>,
    /// Diagonal and first side diagonal of `R`; diagonal and two side diagonals of `QᵀQ`.
    mass: [Vec<f64>; 2],
    stiffness: [Vec<f64>; 3],
    /// `Qᵀ y`.
    bends: Vec<f64>,
    /// Whether the slope may jump at the datum: its second derivative is zero.
    is_corner: Vec<bool>,
}

impl System {
    fn new(times: &[f64], data: &[f64], corners: &[usize]) -> Self {
        let intervals: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let rates: Vec<f64> = intervals.iter().map(|interval| 1.0 / interval).collect();
        let interior = data.len() - 2;
        let is_corner: Vec<bool> = (0..interior).map(|row| corners.binary_search(&(row + 1)).is_ok()).collect();
        let couples = |row: usize, other: usize| other < interior && !is_corner[row] && !is_corner[other];
        let off = |row: usize, other: usize, value: f64| if couples(row, other) { value } else { 0.0 };
        let rows = || 0..interior;
        let mass = [
            rows().map(|row| (intervals[row] + intervals[row + 1]) / 3.0).collect(),
            rows().map(|row| off(row, row + 1, intervals[row + 1] / 6.0)).collect(),
        ];
        let sum = |row: usize| rates[row] + rates[row + 1];
        let stiffness = [
            rows().map(|row| rates[row].powi(2) + sum(row).powi(2) + rates[row + 1].powi(2)).collect(),
            rows()
                .map(|row| if couples(row, row + 1) { -rates[row + 1] * (sum(row) + sum(row + 1)) } else { 0.0 })
                .collect(),
            rows().map(|row| if couples(row, row + 2) { rates[row + 1] * rates[row + 2] } else { 0.0 }).collect(),
        ];
        let slope = |interval: usize| (data[interval + 1] - data[interval]) * rates[interval];
        let bends = rows().map(|row| if is_corner[row] { 0.0 } else { slope(row + 1) - slope(row) }).collect();
        Self { rates, mass, stiffness, bends, is_corner }
    }

    /// Data minus curve, `α Q γ`.
    fn offsets(&self, alpha: f64) -> Vec<f64> {
        let second = self.second_derivatives(alpha);
        let at = |row: usize| second.get(row).copied().unwrap_or(0.0);
        let before = |row: usize| if row > 0 { at(row - 1) } else { 0.0 };
        // Row `i` of `Q γ`, for γ of the data i−1, i and i+1, which are rows i−2, i−1 and i of the system.
        (0..self.bends.len() + 2)
            .map(|datum| {
                let (left, middle, right) = (
                    if datum >= 2 { at(datum - 2) } else { 0.0 },
                    before(datum),
                    if datum < self.bends.len() { at(datum) } else { 0.0 },
                );
                let rate_before = if datum > 0 { self.rates[datum - 1] } else { 0.0 };
                let rate_after = self.rates.get(datum).copied().unwrap_or(0.0);
                let own = if datum > 0 && datum <= self.bends.len() { rate_before + rate_after } else { 0.0 };
                alpha * (left * rate_before - middle * own + right * rate_after)
            })
            .collect()
    }

    /// Solve `(R + α QᵀQ) γ = Qᵀ y` by `L D Lᵀ` with two side diagonals.
    fn second_derivatives(&self, alpha: f64) -> Vec<f64> {
        let count = self.bends.len();
        let entry = |diagonal: usize, row: usize| {
            let mass = if diagonal < 2 { self.mass[diagonal][row] } else { 0.0 };
            mass + alpha * self.stiffness[diagonal][row]
        };
        let (mut pivots, mut first, mut second) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
        let mut solution = self.bends.clone();
        for row in 0..count {
            let mut pivot = entry(0, row);
            let mut beside = entry(1, row);
            if row > 0 {
                pivot -= first[row - 1] * first[row - 1] * pivots[row - 1];
                beside -= first[row - 1] * second[row - 1] * pivots[row - 1];
                solution[row] -= first[row - 1] * solution[row - 1];
            }
            if row > 1 {
                pivot -= second[row - 2] * second[row - 2] * pivots[row - 2];
                solution[row] -= second[row - 2] * solution[row - 2];
            }
            pivots[row] = pivot;
            first[row] = beside / pivot;
            second[row] = entry(2, row) / pivot;
        }
        for row in (0..count).rev() {
            solution[row] /= pivots[row];
            if row + 1 < count {
                solution[row] -= first[row] * solution[row + 1];
            }
            if row + 2 < count {
                solution[row] -= second[row] * solution[row + 2];
            }
        }
        solution.iter_mut().zip(&self.is_corner).for_each(|(value, is_corner)| {
            if *is_corner {
                *value = 0.0;
            }
        });
        solution
    }
}

/// The fewest corners of a polygon through some of the points that is within a tolerance of all of them: each corner
/// is the last to which a straight line from the one before passes all points between (Sklansky and Gonzalez, Pattern
/// Recognition 12, 1980). Returns their indices.
pub(crate) fn polygon(times: &[f64], values: &[f64], tolerance: f64) -> Vec<usize> {
    let mut corners = vec![0];
    let mut from = 0;
    while from + 1 < times.len() {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut end = from + 1;
        for index in from + 1..times.len() {
            let span = times[index] - times[from];
            let slope = |value: f64| (value - values[from]) / span;
            if low <= slope(values[index]) && slope(values[index]) <= high {
                end = index;
            }
            (low, high) = (low.max(slope(values[index] - tolerance)), high.min(slope(values[index] + tolerance)));
            if low > high {
                break;
            }
        }
        corners.push(end);
        from = end;
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::RandomStream;

    const SIGMA: f64 = 2.0;

    /// Data of a signal every 10 ms, with noise.
    fn noisy(signal: impl Fn(f64) -> f64, sigma: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let mut random = RandomStream::new(5, 0);
        let times: Vec<f64> = (0..6000).map(|index| 0.01 * f64::from(index)).collect();
        let truth: Vec<f64> = times.iter().map(|time| signal(*time)).collect();
        let data = truth.iter().map(|value| value + sigma * random.normal()).collect();
        (times, truth, data)
    }

    fn rms(a: &[f64], b: &[f64]) -> f64 {
        (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
    }

    fn smooth(time: f64) -> f64 {
        300.0 + 800.0 * (1.0 - (-time / 12.0).exp()) + 20.0 * (time / 3.0).sin()
    }

    #[test]
    fn a_smooth_truth_is_recovered_four_times_better_than_by_the_data() {
        let (times, truth, data) = noisy(smooth, SIGMA);
        let spline = smoothing_spline(&times, &data, SIGMA);
        assert!(rms(&spline.values, &truth) < 0.25 * rms(&data, &truth), "{}", rms(&spline.values, &truth));
        assert!((spline.residual / SIGMA - 1.0).abs() < 1e-4 && spline.corners.is_empty(), "{:?}", spline.corners);
        // Half the noise is stated: the rest stays in the curve.
        let timid = smoothing_spline(&times, &data, 0.5 * SIGMA);
        assert!(rms(&timid.values, &truth) > 0.3 * SIGMA);
    }

    #[test]
    fn without_noise_the_spline_passes_through_the_data() {
        let (times, _, data) = noisy(smooth, SIGMA);
        let spline = smoothing_spline(&times, &data, 1e-9);
        assert!(spline.values.iter().zip(&data).all(|(value, datum)| (value - datum).abs() < 1e-7));
        assert_eq!(polygon(&times, &spline.values, 1e-10).len(), times.len());
        assert_eq!(smoothing_spline(&[0.0, 1.0], &[1.0, 3.0], 1.0).values, [1.0, 3.0]);
    }

    #[test]
    fn data_on_a_line_within_their_noise_become_that_line() {
        let (times, truth, data) = noisy(|time| 300.0 + 5.0 * time, SIGMA);
        let spline = smoothing_spline(&times, &data, 1.1 * SIGMA);
        assert!(rms(&spline.values, &truth) < 0.1 * SIGMA, "{}", rms(&spline.values, &truth));
        assert!(spline.residual < 1.05 * SIGMA);
        assert!(polygon(&times, &spline.values, 0.1 * SIGMA).len() < 60);
    }

    #[test]
    fn a_step_stays_a_step() {
        let step = |time: f64| 300.0 + if time < 20.0 { 0.0 } else { 600.0 } + 3.0 * time;
        let (times, truth, data) = noisy(step, SIGMA);
        let spline = smoothing_spline(&times, &data, SIGMA);
        let worst = spline.values.iter().zip(&truth).map(|(value, truth)| (value - truth).abs()).fold(0.0, f64::max);
        assert!(worst < 3.0 * SIGMA, "{worst} with corners {:?}", spline.corners);
        assert!(spline.corners.iter().all(|corner| (times[*corner] - 20.0).abs() < 0.2), "{:?}", spline.corners);
        // Without corners the curve of the same residual is off by tens of kelvins there.
        let round = fit(&times, &data, SIGMA, &[]);
        let worst = round.iter().zip(&truth).map(|(value, truth)| (value - truth).abs()).fold(0.0, f64::max);
        assert!(worst > 10.0 * SIGMA, "{worst}");
    }

    #[test]
    fn a_polygon_has_few_corners_and_is_within_its_tolerance_of_all_points() {
        let (times, truth, _) = noisy(smooth, SIGMA);
        let corners = polygon(&times, &truth, 0.2);
        assert!(corners.len() < 100, "{}", corners.len());
        for pair in corners.windows(2) {
            for index in pair[0]..=pair[1] {
                let share = (times[index] - times[pair[0]]) / (times[pair[1]] - times[pair[0]]);
                let value = truth[pair[0]] + share * (truth[pair[1]] - truth[pair[0]]);
                assert!((value - truth[index]).abs() <= 0.2 + 1e-9);
            }
        }
    }
}
