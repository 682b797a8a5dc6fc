//! Marginal distributions of one and of two factors.

use crate::fit::ChainDiagnostics;

/// Marginal distribution of one factor.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct PosteriorMarginal {
    /// Convergence diagnostics of its chains.
    pub diagnostics: ChainDiagnostics,
    /// The median.
    pub median: f64,
    /// The central 95 % interval.
    pub interval: (f64, f64),
    /// Range of the histogram: the central 99.8 % of the draws.
    pub histogram_range: (f64, f64),
    /// Fraction of the draws in each bin.
    pub shares: Vec<f64>,
}

/// Difference of median and estimate, in widths of the 95 % interval, that is warned of: half a standard deviation of
/// a normal posterior.
const MEDIAN_DISTANCE: f64 = 0.125;

impl PosteriorMarginal {
    /// Whether an estimate is far from the median.
    pub(crate) fn is_far_from(&self, estimate: f64) -> bool {
        let (low, high) = self.interval;
        (self.median - estimate).abs() > MEDIAN_DISTANCE * (high - low)
    }
}

/// Marginal distribution of two factors.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct PairMarginal {
    /// Indices of the factors in the estimate, for the horizontal and the vertical axis.
    pub factors: (usize, usize),
    /// Correlation of the draws.
    pub correlation: f64,
    /// `enclosed[j][i]`: fraction of the draws in regions at least as dense as bin i (horizontal), j (vertical). Bins
    /// up to 0.95 form the 95 % highest-density region.
    pub enclosed_mass: Vec<Vec<f64>>,
}

/// Number of bins: as many as the draws fill in two dimensions, within the resolution of a panel.
fn bins(draws: usize) -> usize {
    ((draws as f64).powf(0.28) as usize).clamp(8, 48)
}

impl PosteriorMarginal {
    /// From a chain, iteration × walker, of a factor between bounds.
    pub(super) fn of(chain: &[f64], walkers: usize, (least, most): (f64, f64)) -> Self {
        let mut sorted = chain.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| sorted[((share * sorted.len() as f64) as usize).min(sorted.len() - 1)];
        let (low, high) = (at(0.001), at(0.999));
        // A constant chain has no range of its own.
        let range = if low < high { (low, high) } else { (least, most) };
        let mut counts = vec![0.0; bins(chain.len())];
        for &value in chain {
            if let Some(bin) = bin(value, range, counts.len()) {
                counts[bin] += 1.0;
            }
        }
        Self {
            diagnostics: ChainDiagnostics::from_chains(chain, walkers),
            median: at(0.5),
            interval: (at(0.025), at(0.975)),
            histogram_range: range,
            shares: counts.iter().map(|count| count / chain.len() as f64).collect(),
        }
    }

    /// Centre of each bin.
    pub fn bin_centres(&self) -> Vec<f64> {
        let ((low, high), bins) = (self.histogram_range, self.shares.len());
        (0..bins).map(|bin| low + (high - low) * (bin as f64 + 0.5) / bins as f64).collect()
    }
}

/// Index of the bin that contains a value; `None` outside the range.
fn bin(value: f64, (low, high): (f64, f64), bins: usize) -> Option<usize> {
    let place = (value - low) / (high - low) * bins as f64;
    (0.0..=bins as f64).contains(&place).then(|| (place as usize).min(bins - 1))
}

impl PairMarginal {
    pub(super) fn of(x: (usize, &[f64], &PosteriorMarginal), y: (usize, &[f64], &PosteriorMarginal)) -> Self {
        let bins = x.2.shares.len();
        let mut counts = vec![0.0f64; bins * bins];
        let mut all = 0.0;
        for (&across, &up) in x.1.iter().zip(y.1) {
            if let (Some(i), Some(j)) = (bin(across, x.2.histogram_range, bins), bin(up, y.2.histogram_range, bins)) {
                counts[j * bins + i] += 1.0;
                all += 1.0;
            }
        }
        let mut order: Vec<usize> = (0..counts.len()).collect();
        order.sort_by(|&a, &b| counts[b].total_cmp(&counts[a]));
        let mut enclosed = vec![1.0; counts.len()];
        let mut within = 0.0;
        for place in order.into_iter().filter(|&place| counts[place] > 0.0) {
            within += counts[place];
            enclosed[place] = within / all;
        }
        Self {
            factors: (x.0, y.0),
            correlation: correlation(x.1, y.1),
            enclosed_mass: enclosed.chunks(bins).map(<[f64]>::to_vec).collect(),
        }
    }
}

fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mx, my) = (mean(x), mean(y));
    let moment = |f: fn(f64, f64) -> f64| x.iter().zip(y).map(|(a, b)| f(a - mx, b - my)).sum::<f64>();
    let both = (moment(|a, _| a * a) * moment(|_, b| b * b)).sqrt();
    if both > 0.0 { moment(|a, b| a * b) / both } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::RandomStream;

    /// 95 % of a normal distribution lie within 1.96 standard deviations, and 1 − exp(−r²/2) of two independent ones
    /// within radius r. A bin's count has a standard error of 4 %, and the enclosed mass one of 0.02; the tolerance is
    /// four of these.
    #[test]
    fn intervals_and_regions_contain_their_nominal_probability() {
        let mut numbers = RandomStream::new(3, 0);
        let [x, y]: [Vec<f64>; 2] = std::array::from_fn(|_| (0..200_000).map(|_| numbers.normal()).collect());
        let [a, b] = [&x, &y].map(|chain| PosteriorMarginal::of(chain, 100, (-9.0, 9.0)));
        assert!((a.interval.0 + 1.96).abs() < 0.03 && (a.interval.1 - 1.96).abs() < 0.03 && a.median.abs() < 0.01);
        assert!((a.shares.iter().sum::<f64>() - 0.998).abs() < 1e-3);
        let pair = PairMarginal::of((0, &x, &a), (1, &y, &b));
        assert!(pair.correlation.abs() < 0.01);
        for (j, up) in b.bin_centres().into_iter().enumerate() {
            for (i, across) in a.bin_centres().into_iter().enumerate() {
                let radius = across.hypot(up);
                let exact = 1.0 - (-radius * radius / 2.0).exp();
                assert!(
                    (pair.enclosed_mass[j][i] - exact).abs() < 0.08,
                    "{radius}: {} for {exact}",
                    pair.enclosed_mass[j][i]
                );
            }
        }
    }
}
