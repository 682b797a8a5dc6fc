//! Check of the observations of a case before a fit: rate, gaps, noise, spikes, channels
//! that are stuck or open, drift before the start. It flags and changes nothing.
//!
//! The statistics are robust: a few wrong samples do not move them. Thresholds are those of the constants below.

use crate::case::{Case, Observation};
use crate::fit::noise_model::NoiseProcess;
use crate::numerics::robust_noise::{DEVIATION_PER_MAD, median, noise_deviation};
use nalgebra::{DMatrix, DVector};

/// A gap is longer than so many median intervals, and than twice the intervals beside it.
const GAP_INTERVALS: f64 = 3.0;
/// Samples before and after one with whose medians it is compared: the Hampel identifier (Davies and Gather, JASA 88,
/// 1993; Pearson, IEEE Trans. Control Syst. Technol. 10, 2002), on both sides so that ramps have no spikes.
const HAMPEL_NEIGHBOURS: usize = 5;
/// A spike is off the line through them by more than so many standard deviations. Of a million samples of white noise,
/// one is off by five.
const HAMPEL_DEVIATIONS: f64 = 6.0;
/// It is off by more than so many times what four of five of its neighbours are off by, too: a corner of the signal
/// moves them all. Of normal noise that is again six standard deviations.
const HAMPEL_NEIGHBOUR_RATIO: f64 = 4.7;
/// A channel is stuck if it repeats a value at least so often,
const STUCK_SAMPLES: usize = 20;
/// and so many times as often as it repeats the values next to it. A slow signal of a coarse logger repeats those too.
const STUCK_RATIO: usize = 10;
/// Values of a rail lie so many standard deviations from all others,
const RAIL_DEVIATIONS: f64 = 50.0;
/// and so far in shares of their range. At least so many samples have it.
const RAIL_RANGE: f64 = 0.2;
const RAIL_SAMPLES: usize = 3;
/// A channel without a value in more than this share of the rows is open.
const OPEN_SHARE: f64 = 0.5;
/// So is one that ends by more than this share of the time before the table does.
const OPEN_END: f64 = 0.1;
/// A channel is noisy if its noise is so many times the median of the channels.
const NOISY_RATIO: f64 = 10.0;
/// Fewest channels for such a median.
const NOISY_CHANNELS: usize = 3;
/// Fewest samples for a drift. Intervals of 30 samples hold 93 to 97 % where noise decorrelates over up to ten samples,
/// those of 20 samples 85 to 97 %.
const DRIFT_SAMPLES: usize = 30;

/// Result of the check of every observed sensor.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct ObservationCheck {
    /// One per observation of the case, in its order.
    pub channels: Vec<Channel>,
}

/// One observed sensor.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Channel {
    /// Index of the sensor.
    pub sensor: usize,
    /// The heading of its column; `None` for samples in the case file.
    pub heading: Option<String>,
    /// Samples that a study uses: within the exposure.
    pub samples: usize,
    /// Samples before the start of the exposure, which are kept out.
    pub earlier: usize,
    /// Samples after its end, which are kept out.
    pub later: usize,
    /// Rows of the file without a value.
    pub missing: usize,
    /// Times of the first and of the last sample used, s.
    pub span_s: (f64, f64),
    /// Lowest and highest temperature used, K.
    pub range_k: (f64, f64),
    /// Intervals between samples: 5 %, 50 % and 95 % quantile, s; `None` of a single sample.
    pub interval_s: Option<[f64; 3]>,
    /// Standard deviation of the noise, K; `None` of fewer than three samples.
    pub noise_k: Option<f64>,
    /// Smallest step between two samples, K; `None` if all are equal.
    pub resolution_k: Option<f64>,
    /// The drift before the start of the exposure; `None` of few samples.
    pub drift: Option<Drift>,
    /// Features of the data that an analyst should inspect, by time.
    pub flags: Vec<Flag>,
}

/// A straight line through the samples before the start of the exposure.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Drift {
    /// Slope, K/min.
    pub slope_k_min: f64,
    /// Half the width of its 95 % interval, K/min; it allows for residuals correlated from sample to sample.
    pub half_width_k_min: f64,
    /// Standard deviation of the residuals, K.
    pub noise_k: f64,
    /// Mean temperature, K.
    pub mean_k: f64,
}

/// The reason of a flag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub enum FlagKind {
    /// No sample for longer than usual.
    Gap,
    /// Samples off their neighbours.
    Spike,
    /// One value, repeated.
    Stuck,
    /// Samples at a rail of the logger, far from all others; or hardly any values.
    Open,
    /// Much more noise than the other channels.
    Noisy,
    /// A slope before the start that exceeds the stated standard deviation by the end of the exposure, even at the
    /// lower end of its interval.
    Drift,
}

impl FlagKind {
    /// All kinds.
    pub const ALL: [Self; 6] = [Self::Gap, Self::Spike, Self::Stuck, Self::Open, Self::Noisy, Self::Drift];

    /// `spike`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gap => "gap",
            Self::Spike => "spike",
            Self::Stuck => "stuck",
            Self::Open => "open",
            Self::Noisy => "noisy",
            Self::Drift => "drift",
        }
    }
}

/// A part of a channel to look at.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Flag {
    /// The reason.
    pub kind: FlagKind,
    /// First time, s.
    pub from_s: f64,
    /// Last time, s.
    pub to_s: f64,
    /// Samples, or rows without a value.
    pub samples: usize,
    /// The temperature: of the spike, the repeated value, the rail; the drift over the exposure; the noise. K.
    pub value_k: f64,
}

/// The recorded samples of a channel, those before the start among them.
struct Series<'a> {
    times_s: &'a [f64],
    temperatures_k: &'a [f64],
}

/// Check the observations of a case.
pub fn check_observations(case: &Case) -> ObservationCheck {
    let mut channels: Vec<Channel> = case.observations.iter().map(|seen| channel(case, seen)).collect();
    flag_noisy(&mut channels);
    channels.iter_mut().for_each(|channel| channel.flags.sort_by(|a, b| a.from_s.total_cmp(&b.from_s)));
    ObservationCheck { channels }
}

fn channel(case: &Case, seen: &Observation) -> Channel {
    let recorded = case.recorded_channels().iter().find(|recorded| recorded.sensor == seen.sensor);
    let (earlier_s, earlier_k) =
        recorded.map_or((&[][..], &[][..]), |recorded| (&recorded.earlier_times_s, &recorded.earlier_temperatures_k));
    let times_s = [earlier_s, &seen.times_s].concat();
    let temperatures_k = [earlier_k, &seen.temperatures_k].concat();
    let series = Series { times_s: &times_s, temperatures_k: &temperatures_k };
    let noise_k = noise_deviation(&times_s, &temperatures_k);
    let resolution_k = series.resolution_k();
    let mut flags = series.gaps();
    let rails = series.rails(noise_k.unwrap_or(0.0));
    let stuck = series.stuck();
    let is_on_rail = |time_s: f64| rails.iter().any(|rail| (rail.from_s..=rail.to_s).contains(&time_s));
    let spikes = series.spikes(resolution_k.unwrap_or(0.0));
    flags.extend(spikes.into_iter().filter(|spike| !is_on_rail(spike.from_s)));
    flags.extend(stuck.into_iter().filter(|stuck| !is_on_rail(stuck.from_s)));
    flags.extend(rails);
    let (missing, rows) = recorded.map_or((0, seen.times_s.len()), |recorded| (recorded.missing, recorded.rows));
    let (first_s, last_s) = (seen.times_s[0], seen.times_s[seen.times_s.len() - 1]);
    let table_s = recorded.map_or((first_s, last_s), |recorded| recorded.span_s);
    let end_s = recorded.map_or(last_s, |recorded| recorded.last_s);
    let ends_early = table_s.1 - end_s > OPEN_END * (table_s.1 - table_s.0);
    if missing as f64 > OPEN_SHARE * rows as f64 || ends_early {
        let (from_s, to_s) = if ends_early { (end_s, table_s.1) } else { table_s };
        let value_k = temperatures_k[temperatures_k.len() - 1];
        flags.push(Flag { kind: FlagKind::Open, from_s, to_s, samples: missing, value_k });
    }
    let drift = Series { times_s: earlier_s, temperatures_k: earlier_k }.drift();
    let sigma_k = seen.sigma_k.iter().copied().fold(0.0, f64::max);
    if let Some(drift) = drift {
        let minutes = case.exposure.duration_s / 60.0;
        let value_k = drift.slope_k_min * minutes;
        if value_k.abs() - drift.half_width_k_min * minutes > sigma_k {
            let (from_s, to_s) = (earlier_s[0], earlier_s[earlier_s.len() - 1]);
            flags.push(Flag { kind: FlagKind::Drift, from_s, to_s, samples: earlier_s.len(), value_k });
        }
    }
    let extremes = |values: &[f64]| {
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| (low.min(value), high.max(value)))
    };
    Channel {
        sensor: seen.sensor,
        heading: recorded.and_then(|recorded| recorded.heading.clone()),
        samples: seen.times_s.len(),
        earlier: earlier_s.len(),
        later: recorded.map_or(0, |recorded| recorded.later),
        missing,
        span_s: (first_s, last_s),
        range_k: extremes(&seen.temperatures_k),
        interval_s: series.interval_quantiles_s(),
        noise_k,
        resolution_k,
        drift,
        flags,
    }
}

/// Flag the channels with much more noise than the median channel.
fn flag_noisy(channels: &mut [Channel]) {
    let noises_k: Vec<f64> = channels.iter().filter_map(|channel| channel.noise_k).collect();
    if noises_k.len() < NOISY_CHANNELS {
        return;
    }
    let usual_k = median(noises_k);
    for channel in channels {
        if let Some(value_k) = channel.noise_k.filter(|noise_k| usual_k > 0.0 && *noise_k > NOISY_RATIO * usual_k) {
            let (from_s, to_s) = channel.span_s;
            channel.flags.push(Flag { kind: FlagKind::Noisy, from_s, to_s, samples: channel.samples, value_k });
        }
    }
}

impl Series<'_> {
    fn intervals_s(&self) -> Vec<f64> {
        self.times_s.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }

    fn interval_quantiles_s(&self) -> Option<[f64; 3]> {
        let mut intervals_s = self.intervals_s();
        intervals_s.sort_by(f64::total_cmp);
        let last = intervals_s.len().checked_sub(1)?;
        Some([0.05, 0.5, 0.95].map(|share| intervals_s[(share * last as f64).round() as usize]))
    }

    fn gaps(&self) -> Vec<Flag> {
        let intervals_s = self.intervals_s();
        let Some([_, usual_s, _]) = self.interval_quantiles_s() else { return Vec::new() };
        let beside_s = |index: usize| {
            let neighbours = [index.checked_sub(1), Some(index + 1)];
            neighbours.into_iter().flatten().filter_map(|index| intervals_s.get(index)).fold(0.0, |a: f64, b| a.max(*b))
        };
        let is_gap = |index: &usize| {
            let length_s = intervals_s[*index];
            length_s > GAP_INTERVALS * usual_s && length_s > 2.0 * beside_s(*index)
        };
        let flag = |index: usize| {
            let missed = (intervals_s[index] / usual_s).round() as usize - 1;
            let value_k = self.temperatures_k[index];
            Flag {
                kind: FlagKind::Gap,
                from_s: self.times_s[index],
                to_s: self.times_s[index + 1],
                samples: missed,
                value_k,
            }
        };
        (0..intervals_s.len()).filter(is_gap).map(flag).collect()
    }

    fn resolution_k(&self) -> Option<f64> {
        let steps = self.temperatures_k.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        steps.filter(|step_k| *step_k > 0.0).reduce(f64::min)
    }

    fn spikes(&self, resolution_k: f64) -> Vec<Flag> {
        let count = self.temperatures_k.len();
        if count <= 2 * HAMPEL_NEIGHBOURS {
            return Vec::new();
        }
        let offsets_k: Vec<f64> = (0..count).map(|index| self.offset_k(index)).collect();
        let usual_k = DEVIATION_PER_MAD * median(offsets_k.iter().map(|off_k| off_k.abs()).collect());
        // With the line in place of the sample, which moves the medians of its neighbours on a ramp.
        let neighbours_k = |index: usize| {
            let start = index.saturating_sub(2 * HAMPEL_NEIGHBOURS);
            let part = start..(index + 2 * HAMPEL_NEIGHBOURS + 1).min(count);
            let mut temperatures_k = self.temperatures_k[part.clone()].to_vec();
            temperatures_k[index - start] -= offsets_k[index];
            let without = Series { times_s: &self.times_s[part], temperatures_k: &temperatures_k };
            let around = index.saturating_sub(HAMPEL_NEIGHBOURS)..(index + HAMPEL_NEIGHBOURS + 1).min(count);
            let others = around.filter(|other| *other != index);
            let mut others_k: Vec<f64> = others.map(|other| without.offset_k(other - start).abs()).collect();
            others_k.sort_by(f64::total_cmp);
            others_k[others_k.len() * 4 / 5]
        };
        let is_spike = |index: &usize| {
            let off_k = offsets_k[*index].abs();
            off_k > HAMPEL_DEVIATIONS * usual_k.max(resolution_k)
                && off_k > HAMPEL_NEIGHBOUR_RATIO * neighbours_k(*index)
        };
        let flag = |index: usize| {
            let (time_s, value_k) = (self.times_s[index], self.temperatures_k[index]);
            Flag { kind: FlagKind::Spike, from_s: time_s, to_s: time_s, samples: 1, value_k }
        };
        (0..count).filter(is_spike).map(flag).collect()
    }

    /// A sample less the line through the medians of the samples before and after it, so that a ramp has none. Zero for
    /// the first and the last three.
    fn offset_k(&self, index: usize) -> f64 {
        let most = index.min(self.temperatures_k.len() - 1 - index);
        let count = match most {
            HAMPEL_NEIGHBOURS.. => HAMPEL_NEIGHBOURS,
            3.. => 3,
            _ => return 0.0,
        };
        let (before, after) = (index - count..index, index + 1..index + 1 + count);
        let middle = count.div_ceil(2);
        let (from_s, to_s) = (self.times_s[index - middle], self.times_s[index + middle]);
        let [from_k, to_k] = [before, after].map(|part| median(self.temperatures_k[part].to_vec()));
        let share = (self.times_s[index] - from_s) / (to_s - from_s);
        self.temperatures_k[index] - (from_k + share * (to_k - from_k))
    }

    /// First sample and length of each run of equal values.
    fn runs(&self) -> Vec<(usize, usize)> {
        let mut runs: Vec<(usize, usize)> = Vec::new();
        for (index, value_k) in self.temperatures_k.iter().enumerate() {
            match runs.last_mut() {
                Some((first, length)) if self.temperatures_k[*first] == *value_k => *length += 1,
                _ => runs.push((index, 1)),
            }
        }
        runs
    }

    /// Runs of equal values that the neighbouring values do not explain. The first run is at rest before the test,
    /// unless there is no other.
    fn stuck(&self) -> Vec<Flag> {
        let runs = self.runs();
        let usual = |at: usize| {
            let beside = runs[at.saturating_sub(3)..at].iter().chain(runs.iter().skip(at + 1).take(3));
            beside.map(|(_, length)| *length).max().unwrap_or(1)
        };
        let is_stuck = |at: &usize| {
            let length = runs[*at].1;
            length >= STUCK_SAMPLES && (runs.len() == 1 || *at > 0) && length > STUCK_RATIO * usual(*at)
        };
        let flag = |at: usize| self.flag_of_run(FlagKind::Stuck, runs[at]);
        (0..runs.len()).filter(is_stuck).map(flag).collect()
    }

    fn flag_of_run(&self, kind: FlagKind, (first, length): (usize, usize)) -> Flag {
        let (from_s, to_s) = (self.times_s[first], self.times_s[first + length - 1]);
        Flag { kind, from_s, to_s, samples: length, value_k: self.temperatures_k[first] }
    }

    /// Runs at the highest or at the lowest value, if that is far from all others.
    fn rails(&self, noise_k: f64) -> Vec<Flag> {
        let mut levels = self.temperatures_k.to_vec();
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        let [lowest, second, .., last_but_one, highest] = levels[..] else { return Vec::new() };
        let rest_k = last_but_one - second;
        let is_far = |off_k: f64| off_k > RAIL_DEVIATIONS * noise_k && off_k > RAIL_RANGE * rest_k;
        let values = [(highest, highest - last_but_one), (lowest, second - lowest)];
        let rails = values.into_iter().filter(|(_, off_k)| is_far(*off_k)).filter_map(|(rail_k, _)| {
            let runs: Vec<_> =
                self.runs().into_iter().filter(|(first, _)| self.temperatures_k[*first] == rail_k).collect();
            let samples: usize = runs.iter().map(|(_, length)| length).sum();
            (samples >= RAIL_SAMPLES).then_some(runs)
        });
        rails.flatten().map(|run| self.flag_of_run(FlagKind::Open, run)).collect()
    }

    /// Least squares. The interval is widened by the correlation of neighbouring residuals, as of an autoregressive
    /// process of first order.
    fn drift(&self) -> Option<Drift> {
        let count = self.times_s.len();
        if count < DRIFT_SAMPLES {
            return None;
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / count as f64;
        let (mean_s, mean_k) = (mean(self.times_s), mean(self.temperatures_k));
        let sum_squares: f64 = self.times_s.iter().map(|time_s| (time_s - mean_s).powi(2)).sum();
        let pairs = || self.times_s.iter().zip(self.temperatures_k);
        let slope = pairs().map(|(time_s, value_k)| (time_s - mean_s) * (value_k - mean_k)).sum::<f64>() / sum_squares;
        let residuals: Vec<f64> =
            pairs().map(|(time_s, value_k)| value_k - mean_k - slope * (time_s - mean_s)).collect();
        let squares: f64 = residuals.iter().map(|off_k| off_k * off_k).sum();
        let noise_k = (squares / (count - 2) as f64).sqrt();
        // Columns of unit length, so that the slope is the score along the second over the root of the sum.
        let lines = DMatrix::from_fn(count, 2, |row, column| match column {
            0 => 1.0 / (count as f64).sqrt(),
            _ => (self.times_s[row] - mean_s) / sum_squares.sqrt(),
        });
        let noise = NoiseProcess::estimate(&DVector::from_vec(residuals), &lines, &[self.times_s.to_vec()]);
        let along_slope = DVector::from_vec(vec![0.0, 1.0]);
        let half_width = noise.half_width(&noise.score_covariances(&lines), &along_slope, 0.0) / sum_squares.sqrt();
        Some(Drift { slope_k_min: 60.0 * slope, half_width_k_min: 60.0 * half_width, noise_k, mean_k })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::RandomStream;

    /// Flags of samples every 0.1 s.
    fn flags(values_k: &[f64]) -> Vec<Flag> {
        let times_s: Vec<f64> = (0..values_k.len()).map(|index| 0.1 * index as f64).collect();
        let series = Series { times_s: &times_s, temperatures_k: values_k };
        let noise_k = noise_deviation(&times_s, values_k).unwrap_or(0.0);
        let spikes = series.spikes(series.resolution_k().unwrap_or(0.0));
        [series.gaps(), spikes, series.stuck(), series.rails(noise_k)].concat()
    }

    fn noise(channel: u64, signal: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut random = RandomStream::new(7, channel);
        (0..1000).map(|index| signal(0.1 * f64::from(index)) + 0.5 * random.normal()).collect()
    }

    #[test]
    fn at_most_one_in_a_thousand_channels_of_clean_noise_is_flagged() {
        let signals: [fn(f64) -> f64; 3] =
            [|_| 300.0, |time_s| 300.0 + 8.0 * time_s, |time_s| 300.0 + 900.0 * (1.0 - (-time_s / 8.0).exp())];
        for (place, signal) in signals.into_iter().enumerate() {
            let flagged = (0..1000).filter(|channel| !flags(&noise(1000 * place as u64 + channel, signal)).is_empty());
            let flagged = flagged.count();
            assert!(flagged <= 1, "{flagged} of 1000 channels of signal {place}");
        }
    }

    #[test]
    fn spikes_stuck_and_railing_samples_are_found_where_they_are() {
        for channel in 0..200 {
            let clean = noise(channel, |time_s| 300.0 + 900.0 * (1.0 - (-time_s / 8.0).exp()));
            let at = 50 + 4 * channel as usize;
            let mut spiked = clean.clone();
            spiked[at] += 12.0;
            let found = flags(&spiked);
            assert!(
                matches!(found[..], [Flag { kind: FlagKind::Spike, value_k, .. }] if value_k == spiked[at]),
                "{found:?}"
            );
            let mut stuck = clean.clone();
            let value_k = stuck[at];
            stuck[at..at + 40].fill(value_k);
            assert!(flags(&stuck).iter().any(|flag| flag.kind == FlagKind::Stuck && flag.samples == 40), "{channel}");
            let mut open = clean.clone();
            open[at..at + 4].fill(1645.15);
            let found = flags(&open);
            assert!(found.iter().any(|flag| flag.kind == FlagKind::Open && flag.samples == 4), "{found:?}");
        }
    }

    #[test]
    fn coarse_slow_smooth_and_cornered_signals_are_no_faults() {
        let round = |value: f64| (10.0 * value).round() / 10.0;
        let at = |index: i32| 0.1 * f64::from(index);
        let plateau: Vec<f64> = (0..1000).map(|index| round(400.0 - 0.01 * (at(index) - 50.0).powi(2))).collect();
        let rest: Vec<f64> = (0..1000).map(|index| round(300.0 + 5.0 * (at(index) - 30.0).max(0.0))).collect();
        let corner: Vec<f64> = (0..1000).map(|index| 900.0 - 20.0 * (at(index) - 50.0).abs()).collect();
        let quench: Vec<f64> =
            (0..1000).map(|index| if index < 500 { 900.0 } else { 500.0 } + 1e-3 * at(index)).collect();
        for signal in [plateau, rest, corner, quench] {
            assert_eq!(flags(&signal), []);
        }
        assert_eq!(flags(&[300.0; 100]).len(), 1, "a channel of one value is stuck");
    }

    #[test]
    fn a_gap_is_longer_than_the_intervals_around_it_and_a_change_of_the_rate_is_none() {
        let gaps = |times_s: &[f64]| {
            let temperatures_k: Vec<f64> = times_s.iter().map(|time_s| 300.0 + time_s).collect();
            Series { times_s, temperatures_k: &temperatures_k }.gaps().len()
        };
        let mut times_s: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(gaps(&times_s), 0);
        times_s.extend((1..40).map(|index| 99.0 + 10.0 * f64::from(index)));
        assert_eq!(gaps(&times_s), 0);
        times_s.drain(20..30);
        assert_eq!(gaps(&times_s), 1);
    }

    #[test]
    fn the_interval_of_a_drift_holds_the_true_slope() {
        let covers = |slope_k_min: f64| {
            let covered = (0..400).filter(|channel| {
                let mut random = RandomStream::new(3, *channel);
                let times_s: Vec<f64> = (-170..0).map(|index| 0.1 * f64::from(index)).collect();
                let values_k: Vec<f64> =
                    times_s.iter().map(|time_s| 300.0 + slope_k_min * time_s / 60.0 + random.normal()).collect();
                let drift = Series { times_s: &times_s, temperatures_k: &values_k }.drift().expect("many samples");
                (drift.slope_k_min - slope_k_min).abs() < drift.half_width_k_min
            });
            covered.count()
        };
        // Of 400 intervals 380 are expected; the standard error is 4.4.
        assert!((365..=400).contains(&covers(0.0)) && (365..=400).contains(&covers(12.0)));
    }
}
