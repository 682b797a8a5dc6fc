//! Margins of a case to its temperature limits: of one prediction, and of the members of a sweep.

use crate::ensemble::SamplingKind;
use crate::fit::proportion::{Proportion, quantile_ranks_95, upper_bound_rank};
use crate::plan::Plan;
use crate::traces::{Peak, Traces};

/// The hottest temperature of a part over time, against its limit.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Margin {
    /// The peak over the whole march; of a ply at a held face at least the prescribed temperature.
    pub peak: Peak,
    /// Limit minus peak, K.
    pub margin_k: f64,
    /// Time above the limit, s.
    pub time_above_s: f64,
    /// Whether the part is still warming at the end of the run, so that its true peak may be later and higher.
    pub still_warming: bool,
}

impl Margin {
    /// The margin of a member that failed.
    pub(super) fn without_values() -> Self {
        let peak = Peak { temperature_k: f64::NAN, time_s: f64::NAN };
        Self { peak, margin_k: f64::NAN, time_above_s: f64::NAN, still_warming: false }
    }
}

/// The margins of a member, one for each limit of the case of a plan, in their order.
pub(crate) fn margins_of(plan: &Plan, traces: &Traces, member: usize) -> Vec<Margin> {
    let of_limit = |(index, limit_k): (usize, f64)| {
        let (peak, trace_k) = (traces.limited_peak(member, index), traces.limited(member, index));
        Margin {
            peak,
            margin_k: limit_k - peak.temperature_k,
            time_above_s: if peak.temperature_k > limit_k { traces.time_above_s(member, index) } else { 0.0 },
            still_warming: peak.time_s >= plan.end_s() && peak.temperature_k > trace_k[0],
        }
    };
    plan.limits.iter().map(|limit| limit.limit_k).enumerate().map(of_limit).collect()
}

/// Probabilities of the percentiles of a peak: 95, 99 and 99.87, the last one near three standard deviations of a
/// normal distribution.
pub const PEAK_PROBABILITIES: [f64; 3] = [0.95, 0.99, 0.9987];
/// Content and confidence of the one-sided tolerance bound.
pub const TOLERANCE_CONTENT: f64 = 0.99;
/// Confidence of the one-sided tolerance bound.
pub const TOLERANCE_CONFIDENCE: f64 = 0.95;

/// Margins of the members of a sweep.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct MarginStatistics {
    /// One for each limit of the case, in their order.
    pub limits: Vec<MarginSpread>,
    /// Heat into the layup through the hot face.
    pub heat_load: HeatLoad,
}

/// The peak of a part over the members of a sweep, against its limit. A member that failed counts as above every limit
/// and above every peak, as it may have been the hottest; moments, maximum and times are those of completed members.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct MarginSpread {
    /// Members whose peak is above the limit or that failed, of all members.
    pub exceeding: Proportion,
    /// 95 % confidence interval of the probability of exceeding the limit (Clopper and Pearson); `None` for members
    /// that are not drawn independently.
    pub exceeding_interval: Option<(f64, f64)>,
    /// Mean of the peak, K.
    pub mean_k: f64,
    /// Standard deviation of the peak, K.
    pub deviation_k: f64,
    /// The highest peak, K.
    pub max_k: f64,
    /// The percentiles of [`PEAK_PROBABILITIES`].
    pub percentiles: [PeakPercentile; 3],
    /// Upper one-sided tolerance bound: with 95 % confidence at least 99 % of all peaks are below it, K; `None` with
    /// fewer than 299 members, where so many failed that it has no bound, and for members that are not drawn
    /// independently.
    pub tolerance_bound_k: Option<f64>,
    /// 95th percentile of the time above the limit, s.
    pub time_above_p95_s: f64,
    /// Longest time above the limit, s.
    pub time_above_max_s: f64,
}

/// A percentile of a peak, with a distribution-free 95 % confidence interval from the order of the members.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PeakPercentile {
    /// The probability.
    pub probability: f64,
    /// The percentile, K; infinite where that many members failed.
    pub value_k: f64,
    /// Lower end of the interval, K; `None` with too few members or too many that failed, and for members that are not
    /// drawn independently.
    pub low_k: Option<f64>,
    /// Upper end of the interval, K; `None` in the same cases.
    pub high_k: Option<f64>,
}

/// Heat into the hot face over the run, net of what it radiates while heat flows in, over the members of a sweep, J/m².
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct HeatLoad {
    /// Mean.
    pub mean_j_m2: f64,
    /// Standard deviation.
    pub deviation_j_m2: f64,
    /// The largest of all members.
    pub max_j_m2: f64,
}

/// Peaks, times above the limits and heat loads of the members of a sweep: order statistics need every one.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarginSamples {
    /// Limit × member, K.
    peaks_k: Vec<Vec<f64>>,
    /// Limit × member, s.
    times_above_s: Vec<Vec<f64>>,
    /// J/m².
    heat_loads_j_m2: Vec<f64>,
}

/// Bytes of the samples of a member, in memory and as text of a piece.
pub(crate) fn bytes_per_member(limits: usize) -> f64 {
    const BYTES_PER_NUMBER: usize = 8 + 20;
    if limits == 0 { 0.0 } else { ((2 * limits + 1) * BYTES_PER_NUMBER) as f64 }
}

impl MarginSamples {
    pub(crate) fn new(limits: usize) -> Self {
        Self { peaks_k: vec![Vec::new(); limits], times_above_s: vec![Vec::new(); limits], heat_loads_j_m2: Vec::new() }
    }

    /// Whether there are no limits.
    pub fn is_empty(&self) -> bool {
        self.peaks_k.is_empty()
    }

    /// Add a member.
    pub(crate) fn add(&mut self, margins: &[Margin], heat_load_j_m2: f64) {
        for ((margin, peaks_k), times_s) in margins.iter().zip(&mut self.peaks_k).zip(&mut self.times_above_s) {
            peaks_k.push(margin.peak.temperature_k);
            times_s.push(margin.time_above_s);
        }
        self.heat_loads_j_m2.push(heat_load_j_m2);
    }

    /// Add the members of other samples.
    pub(crate) fn merge(&mut self, other: &Self) {
        let columns = other.columns().map(<[f64]>::to_vec).collect::<Vec<_>>();
        self.columns_mut().zip(columns).for_each(|(mine, theirs)| mine.extend(theirs));
        self.sort();
    }

    /// Bring each column into ascending order, in which the order of the members does not matter.
    pub(crate) fn sort(&mut self) {
        self.columns_mut().for_each(|column| column.sort_by(f64::total_cmp));
    }

    /// Whether these are finite samples of so many limits and members.
    pub(crate) fn fits(&self, limits: usize, members: usize) -> bool {
        (self.peaks_k.len(), self.times_above_s.len()) == (limits, limits)
            && (limits == 0 && self.heat_loads_j_m2.is_empty()
                || self.columns().all(|column| column.len() == members && column.iter().all(|x| x.is_finite())))
    }

    fn columns(&self) -> impl Iterator<Item = &[f64]> {
        self.peaks_k.iter().chain(&self.times_above_s).map(Vec::as_slice).chain([self.heat_loads_j_m2.as_slice()])
    }

    fn columns_mut(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        self.peaks_k.iter_mut().chain(&mut self.times_above_s).chain([&mut self.heat_loads_j_m2])
    }

    /// The statistics for the limits of a case, with `failed` members beside those of the samples; `None` without
    /// limits or samples. The samples are sorted.
    pub(crate) fn statistics(
        &self,
        case_limits_k: &[f64],
        failed: usize,
        sampling: SamplingKind,
    ) -> Option<MarginStatistics> {
        if self.is_empty() || self.heat_loads_j_m2.is_empty() {
            return None;
        }
        let of_limit = |((peaks_k, times_s), &limit_k): ((&Vec<f64>, &Vec<f64>), &f64)| {
            MarginSpread::of(peaks_k, times_s, limit_k, failed, sampling)
        };
        let limits = self.peaks_k.iter().zip(&self.times_above_s).zip(case_limits_k).map(of_limit).collect();
        let (mean_j_m2, deviation_j_m2) = mean_and_deviation(&self.heat_loads_j_m2);
        let max_j_m2 = self.heat_loads_j_m2[self.heat_loads_j_m2.len() - 1];
        Some(MarginStatistics { limits, heat_load: HeatLoad { mean_j_m2, deviation_j_m2, max_j_m2 } })
    }
}

impl MarginSpread {
    /// From the peaks and the times above the limit of the completed members, each in ascending order, and the number
    /// of failed ones.
    pub(crate) fn of(
        peaks_k: &[f64],
        times_above_s: &[f64],
        limit_k: f64,
        failed: usize,
        sampling: SamplingKind,
    ) -> Self {
        let (completed, members) = (peaks_k.len(), peaks_k.len() + failed);
        let is_independent = sampling.has_independent_members();
        let at_rank = |rank: usize| peaks_k.get(rank - 1).copied();
        let end = |rank: Option<usize>| rank.filter(|_| is_independent).and_then(at_rank);
        let percentile = |probability: f64| {
            let (low, high) = quantile_ranks_95(members, probability);
            PeakPercentile {
                probability,
                value_k: at_rank(quantile_rank(members, probability)).unwrap_or(f64::INFINITY),
                low_k: end(low),
                high_k: end(high),
            }
        };
        let (mean_k, deviation_k) = mean_and_deviation(peaks_k);
        let count = members - peaks_k.partition_point(|&peak_k| peak_k <= limit_k);
        let exceeding = Proportion { count, total: members };
        Self {
            exceeding,
            exceeding_interval: is_independent.then(|| exceeding.interval_95()),
            mean_k,
            deviation_k,
            max_k: peaks_k[completed - 1],
            percentiles: PEAK_PROBABILITIES.map(percentile),
            tolerance_bound_k: end(upper_bound_rank(members, TOLERANCE_CONTENT, TOLERANCE_CONFIDENCE)),
            time_above_p95_s: times_above_s[quantile_rank(completed, 0.95) - 1],
            time_above_max_s: times_above_s[completed - 1],
        }
    }
}

/// Rank of a quantile among ordered draws, counted from one: the smallest of which at least this share is not above.
pub(crate) fn quantile_rank(draws: usize, probability: f64) -> usize {
    ((probability * draws as f64 - 1e-9).ceil() as usize).clamp(1, draws)
}

/// Mean and standard deviation (divisor: members minus one); zero deviation for a single member.
fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let members = values.len() as f64;
    // Deviations from one of them lose no digits.
    let reference = values[0];
    let mean = values.iter().map(|value| value - reference).sum::<f64>() / members;
    let squares: f64 = values.iter().map(|value| (value - reference - mean).powi(2)).sum();
    (reference + mean, if values.len() < 2 { 0.0 } else { (squares / (members - 1.0)).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::proportion::min_draws_for_upper_bound;
    use statrs::distribution::{ContinuousCDF, Normal};

    /// Even draws from 0 to 1.
    struct Even(u64);

    impl Even {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        }
    }

    /// Peaks of independent members in ascending order, with some that failed.
    fn independent(peaks_k: &[f64], limit_k: f64, failed: usize) -> MarginSpread {
        MarginSpread::of(peaks_k, &vec![0.0; peaks_k.len()], limit_k, failed, SamplingKind::Normal)
    }

    /// Counts among 1,000 samples of a distribution: those whose intervals hold the percentiles, whose tolerance bound
    /// holds its content, and whose interval of the probability of exceeding a limit holds it.
    fn coverage(quantile: impl Fn(f64) -> f64, members: usize) -> [usize; 5] {
        const EXCEEDING: f64 = 0.03;
        let mut even = Even(2026);
        let mut held = [0; 5];
        for _ in 0..1000 {
            let mut peaks_k: Vec<f64> = (0..members).map(|_| quantile(even.next())).collect();
            peaks_k.sort_by(f64::total_cmp);
            let spread = independent(&peaks_k, quantile(1.0 - EXCEEDING), 0);
            for (held, percentile) in held.iter_mut().zip(&spread.percentiles) {
                let truth_k = quantile(percentile.probability);
                let (low_k, high_k) = (percentile.low_k.unwrap_or(f64::MIN), percentile.high_k.unwrap_or(f64::MAX));
                *held += usize::from((low_k..=high_k).contains(&truth_k));
            }
            held[3] +=
                usize::from(spread.tolerance_bound_k.is_some_and(|bound_k| bound_k >= quantile(TOLERANCE_CONTENT)));
            let (low, high) = spread.exceeding_interval.expect("members are independent");
            held[4] += usize::from((low..=high).contains(&EXCEEDING));
        }
        held
    }

    #[test]
    fn intervals_and_the_tolerance_bound_hold_at_their_stated_rate_for_any_distribution() {
        let normal = Normal::standard();
        let distributions: [&dyn Fn(f64) -> f64; 2] = [&|share| 600.0 + 20.0 * normal.inverse_cdf(share), &|share| {
            600.0 + 20.0 * normal.inverse_cdf(share).exp()
        }];
        for quantile in distributions {
            // Three standard errors of a share of 95 % of 1,000 are 21.
            let [p95, p99, p99_87, bound, exceeding] = coverage(quantile, 3000);
            assert!([p95, p99, p99_87, exceeding].iter().all(|held| *held >= 930), "{p95} {p99} {p99_87} {exceeding}");
            assert!((930..=980).contains(&bound), "{bound}");
            assert!(p95 <= 975, "{p95}: the interval is wider than it needs to be");
            let [.., bound, _] = coverage(quantile, 299);
            assert!((930..=970).contains(&bound), "{bound} of 1,000 samples of 299");
        }
        // Negative control: with one member fewer there is no bound.
        let [.., none, _] = coverage(|share| share, 298);
        assert_eq!(none, 0);
    }

    #[test]
    fn too_few_members_leave_the_upper_end_of_a_percentile_open() {
        let enough = min_draws_for_upper_bound(PEAK_PROBABILITIES[2]);
        assert_eq!(enough, 2836);
        let peaks_k: Vec<f64> = (0..enough).map(|n| n as f64).collect();
        let high = |members: usize| independent(&peaks_k[..members], 0.0, 0).percentiles[2].high_k;
        assert!(high(enough).is_some() && high(enough - 1).is_none());
    }

    /// The statistics of ranks are those of peaks above all others, of which neither mean nor maximum know.
    #[test]
    fn a_failed_member_is_above_every_limit_and_every_peak() {
        let peaks_k: Vec<f64> = (0..1000).map(f64::from).collect();
        let (some_failed, all_completed) = (independent(&peaks_k[..990], 899.5, 10), independent(&peaks_k, 899.5, 0));
        assert_eq!(some_failed.exceeding, Proportion { count: 100, total: 1000 });
        assert_eq!(some_failed.exceeding_interval, all_completed.exceeding_interval);
        assert_eq!(some_failed.percentiles[0], all_completed.percentiles[0]);
        assert_eq!((some_failed.percentiles[1].value_k, some_failed.percentiles[1].high_k), (989.0, None));
        assert_eq!((some_failed.percentiles[2].value_k, some_failed.tolerance_bound_k), (f64::INFINITY, None));
        assert_eq!((some_failed.max_k, some_failed.mean_k), (989.0, 494.5));
        // Negative control: without the failed members the probability is lower and the bound is stated.
        let without = independent(&peaks_k[..990], 899.5, 0);
        assert!(without.exceeding.fraction() < 0.1 && without.tolerance_bound_k.is_some());
    }

    #[test]
    fn members_that_are_not_independent_have_estimates_without_intervals_and_bounds() {
        let peaks_k: Vec<f64> = (0..5000).map(f64::from).collect();
        let of = |sampling| MarginSpread::of(&peaks_k, &peaks_k, 4499.5, 0, sampling);
        let independent = of(SamplingKind::Uniform);
        assert!(independent.exceeding_interval.is_some() && independent.tolerance_bound_k.is_some());
        for sampling in [SamplingKind::LatinHypercube, SamplingKind::Sobol] {
            let found = of(sampling);
            assert_eq!(found.exceeding, independent.exceeding);
            assert_eq!((found.exceeding_interval, found.tolerance_bound_k), (None, None));
            for (found, independent) in found.percentiles.iter().zip(&independent.percentiles) {
                assert_eq!((found.value_k, found.low_k, found.high_k), (independent.value_k, None, None));
                assert!(independent.low_k.is_some() && independent.high_k.is_some());
            }
        }
    }

    #[test]
    fn samples_of_parts_merge_to_those_of_the_whole_in_any_order() {
        let margin = |peak_k: f64| Margin {
            peak: Peak { temperature_k: peak_k, time_s: 1.0 },
            margin_k: 0.0,
            time_above_s: peak_k / 100.0,
            still_warming: false,
        };
        let part = |peaks_k: &[f64]| {
            let mut samples = MarginSamples::new(1);
            peaks_k.iter().for_each(|&peak_k| samples.add(&[margin(peak_k)], 1e6 * peak_k));
            samples.sort();
            samples
        };
        let (whole, mut one, other) =
            (part(&[400.0, 300.0, 500.0, 350.0]), part(&[500.0, 400.0]), part(&[350.0, 300.0]));
        let mut turned = other.clone();
        turned.merge(&one);
        one.merge(&other);
        assert_eq!((&one, &turned), (&whole, &whole));
        assert!(whole.fits(1, 4) && !whole.fits(1, 3) && !whole.fits(2, 4) && !part(&[f64::NAN]).fits(1, 1));
        let statistics = whole.statistics(&[400.0], 0, SamplingKind::Normal).expect("members");
        assert_eq!(statistics.limits[0].exceeding, Proportion { count: 1, total: 4 });
        assert_eq!((statistics.limits[0].mean_k, statistics.limits[0].max_k), (387.5, 500.0));
        assert_eq!(MarginSamples::new(0).statistics(&[], 0, SamplingKind::Normal), None);
    }

    #[test]
    fn the_rank_of_a_quantile_is_the_smallest_that_covers_the_fraction() {
        assert_eq!([(100, 0.99), (100, 0.991), (3, 0.5), (5, 1e-9)].map(|(n, p)| quantile_rank(n, p)), [99, 100, 2, 1]);
    }
}
