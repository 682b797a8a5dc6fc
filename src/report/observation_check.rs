//! The check of the observations: sampling rate, noise and flags for an analyst.

mod record;

use super::braille::{self, Curve};
use super::figure::{Axis, Figure, Ink, Layer, Stroke};
use super::figures::{line, temperature_axis};
use super::files::json::JsonObject;
use super::files::table::{NamedFile, Names, Table, TableDescription};
use super::html::table::{list, table};
use super::reportable::{Finding, Reportable, ScreenLimits, Section};
use super::terminal::{Column, aligned, head, more, with_needed, wrap};
use super::{ReportError, format};
use crate::case::Observation;
use crate::study::answers::Answers;
use crate::study::observation_check::{Channel, Drift, Flag, FlagKind, ObservationCheck};

/// Rows of the plot on the screen, and the fewest.
const PLOT_ROWS: usize = 8;
const MIN_PLOT_ROWS: usize = 4;
/// Points of a curve on page and screen.
const POINTS: usize = 1000;

impl Reportable for ObservationCheck {
    fn comes_first(&self) -> bool {
        true
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let text = [("Before the start", drift(answers, self)), ("Resampling", Some(resampling(answers, self)))];
        text.into_iter().filter_map(|(label, text)| text.map(|text| Finding { label, text })).collect()
    }

    fn warnings(&self, answers: &Answers) -> Vec<String> {
        self.channels.iter().filter_map(|channel| warning(answers, channel)).collect()
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        vec![("observations", figure(answers, self))]
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("observations", "Observations", page(answers, self))]
    }

    fn methods(&self, _: &Answers) -> Vec<String> {
        vec![
            "Noise is estimated from the residuals of each sample from the line between its neighbours (Gasser, \
             Sroka and Jennen-Steinmetz 1986), by their median absolute deviation. Spikes are samples off the line \
             through the medians of the five before and the five after by more than six standard deviations (Hampel \
             identifier), and by more than their neighbours. A channel is stuck where it repeats a value 20 times \
             and ten times as often as the values next to it; open where samples lie at a rail far from all others, \
             or values end or are missing; noisy with ten times the noise of the median channel. The interval of the \
             drift allows for residuals correlated from sample to sample. Flags change no sample."
                .to_owned(),
        ]
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![channels_table().description(), flags_table().description()]
    }

    fn tables(&self, answers: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        let names = Names::default();
        let channels = self.channels.iter().map(|channel| (name(answers, channel), channel));
        let flags = channels.clone().flat_map(|(sensor, channel)| channel.flags.iter().map(move |flag| (sensor, flag)));
        Ok(vec![channels_table().csv(&names, channels)?, flags_table().csv(&names, flags)?])
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        record.put("channels", &record::channels(&answers.case, self))
    }

    fn screen(&self, answers: &Answers, room: &ScreenLimits) -> Vec<String> {
        let mut rows = vec![head(["sensor", "samples", "gaps", "every", "noise", "first", "last", "range, K"])];
        let shown = with_needed(0..self.channels.len(), room.sensors, |&channel| {
            answers.case.has_limit(self.channels[channel].sensor)
        });
        rows.extend(shown.iter().map(|&channel| screen_row(answers, &self.channels[channel])));
        let [samples, gaps, every, noise, first, last, range] = [8, 5, 11, 9, 9, 9, 19].map(Column::Right);
        let name = Column::Left { gap: 0, width: 10 };
        let mut lines = aligned([name, samples, gaps, every, noise, first, last, range], &rows);
        lines.extend(more(self.channels.len() - shown.len(), "sensor"));
        lines.extend(wrap("", &resampling(answers, self)));
        lines.extend(plot(answers, self).lines().map(str::to_owned));
        lines
    }
}

fn name<'a>(answers: &'a Answers, channel: &Channel) -> &'a str {
    &answers.case.sensors[channel.sensor].name
}

fn gaps(channel: &Channel) -> usize {
    channel.flags.iter().filter(|flag| flag.kind == FlagKind::Gap).count()
}

/// `0.10 s`, or `-` of one sample.
fn interval(channel: &Channel) -> String {
    channel.interval_s.map_or("-".to_owned(), |[_, usual_s, _]| format!("{} s", format::significant(usual_s, 3)))
}

fn noise(channel: &Channel) -> String {
    channel.noise_k.map_or("-".to_owned(), |noise_k| format!("{} K", format::significant(noise_k, 2)))
}

fn range(channel: &Channel) -> String {
    let (low_k, high_k) = channel.range_k;
    format!("{} to {}", format::grouped(low_k, 1), format::grouped(high_k, 1))
}

fn screen_row(answers: &Answers, channel: &Channel) -> [String; 8] {
    [
        format::truncate(name(answers, channel), 10),
        format::count(channel.samples),
        gaps(channel).to_string(),
        interval(channel),
        noise(channel),
        format::seconds(channel.span_s.0),
        format::seconds(channel.span_s.1),
        range(channel),
    ]
}

/// The drift of every channel before the start.
fn drift(answers: &Answers, outcome: &ObservationCheck) -> Option<String> {
    let each = outcome.channels.iter().filter_map(|channel| {
        let drift = channel.drift?;
        let digits = |value: f64| format::significant(value, 2);
        let (slope, half) = (digits(drift.slope_k_min), digits(drift.half_width_k_min));
        Some(format!("{} {slope} ± {half} K/min, noise {} K", name(answers, channel), digits(drift.noise_k)))
    });
    let each: Vec<String> = each.collect();
    let samples = outcome.channels.iter().map(|channel| channel.earlier).max().unwrap_or(0);
    (!each.is_empty()).then(|| {
        format!("Drift in up to {} before 0 s, kept out: {}.", format::counted(samples, "sample"), each.join("; "))
    })
}

/// Whether samples are interpolated or thinned: nowhere in the computation, but in plots, and by windows.
fn resampling(answers: &Answers, outcome: &ObservationCheck) -> String {
    let case = &answers.case;
    let is_used = |seen: &Observation, time_s: f64| {
        let (from_s, to_s) = case.window_s(seen.sensor);
        (from_s..=to_s).contains(&time_s)
    };
    let used = |seen: &Observation| seen.times_s.iter().filter(|time_s| is_used(seen, **time_s)).count();
    let windowed = case.observations.iter().filter(|seen| used(seen) < seen.times_s.len()).map(|seen| {
        let (from_s, to_s) = case.window_s(seen.sensor);
        let name = &case.sensors[seen.sensor].name;
        format!(
            "{name} from {} to {}, {} of {}",
            format::seconds(from_s),
            format::seconds(to_s),
            format::count(used(seen)),
            format::counted(seen.times_s.len(), "sample")
        )
    });
    let windowed: Vec<String> = windowed.collect();
    let windowed = if windowed.is_empty() { String::new() } else { format!(" Windows: {}.", windowed.join("; ")) };
    let most = outcome.channels.iter().map(|channel| channel.samples + channel.earlier).max().unwrap_or(0);
    let thinned = match most.div_ceil(POINTS) {
        0 | 1 => String::new(),
        stride => format!(" Plots show one in {stride} of the longest channel."),
    };
    format!("Nothing is resampled: a study compares every sample at its own time.{windowed}{thinned}")
}

/// `TC1: 3 spikes (first at 12 s), stuck at 313 K from 30 s to 34 s (40 samples).`
fn warning(answers: &Answers, channel: &Channel) -> Option<String> {
    let of = |kind: FlagKind| -> Vec<&Flag> { channel.flags.iter().filter(|flag| flag.kind == kind).collect() };
    let texts = FlagKind::ALL.into_iter().filter_map(|kind| flags_text(kind, &of(kind)));
    let texts: Vec<String> = texts.collect();
    (!texts.is_empty()).then(|| format!("{}: {}.", name(answers, channel), texts.join("; ")))
}

/// `2 spikes`, `stuck`, `open 3 times`.
fn counted_flags(kind: FlagKind, number: usize) -> String {
    match kind {
        FlagKind::Gap | FlagKind::Spike => format::counted(number, kind.name()),
        _ if number == 1 => kind.name().to_owned(),
        _ => format!("{} {number} times", kind.name()),
    }
}

fn flags_text(kind: FlagKind, flags: &[&Flag]) -> Option<String> {
    let first = flags.first()?;
    let worst = flags.iter().max_by_key(|flag| flag.samples).unwrap_or(first);
    let span = format!("from {} to {}", format::seconds(worst.from_s), format::seconds(worst.to_s));
    let samples: usize = flags.iter().map(|flag| flag.samples).sum();
    Some(match kind {
        FlagKind::Gap => format!("{}, the longest {span}", format::counted(flags.len(), "gap")),
        FlagKind::Spike => {
            let at = format!("{} at {}", format::kelvin(first.value_k), format::seconds(first.from_s));
            format!("{}, the first {at}", format::counted(flags.len(), "spike"))
        }
        FlagKind::Stuck => {
            format!("stuck at {} {span} ({})", format::kelvin(worst.value_k), format::counted(samples, "sample"))
        }
        FlagKind::Open if worst.samples > 0 && worst.to_s > worst.from_s && flags.len() == 1 => {
            format!("open {span} ({})", format::counted(samples, "sample"))
        }
        FlagKind::Open => format!("open {span}, and in {} in all", format::counted(samples, "sample")),
        FlagKind::Noisy => format!(
            "noise of {} K, over ten times that of the others: loose or open?",
            format::significant(first.value_k, 2)
        ),
        FlagKind::Drift => format!(
            "drift before the start, {} over the exposure: more than its sigma",
            format::temperature_change(first.value_k)
        ),
    })
}

/// All recorded samples of a channel, those before the start among them.
fn recorded(answers: &Answers, channel: &Channel) -> (Vec<f64>, Vec<f64>) {
    let case = &answers.case;
    let earlier = case.recorded_channels().iter().find(|recorded| recorded.sensor == channel.sensor);
    let earlier =
        earlier.map_or((&[][..], &[][..]), |seen| (&seen.earlier_times_s[..], &seen.earlier_temperatures_k[..]));
    let seen = case.observations.iter().find(|seen| seen.sensor == channel.sensor);
    let seen = seen.map_or((&[][..], &[][..]), |seen| (&seen.times_s[..], &seen.temperatures_k[..]));
    ([earlier.0, seen.0].concat(), [earlier.1, seen.1].concat())
}

fn plot(answers: &Answers, outcome: &ObservationCheck) -> String {
    let curve = |channel: &Channel| {
        let (times_s, temperatures_k) = recorded(answers, channel);
        let stride = times_s.len().div_ceil(POINTS).max(1);
        let points = times_s.into_iter().zip(temperatures_k).step_by(stride).collect();
        Curve { name: format::truncate(name(answers, channel), 10), points }
    };
    let curves: Vec<Curve> = outcome.channels.iter().map(curve).collect();
    // Each flagged channel needs a line below.
    let flagged = outcome.channels.iter().filter(|channel| !channel.flags.is_empty()).count();
    let rows = PLOT_ROWS.saturating_sub(flagged).max(MIN_PLOT_ROWS);
    braille::chart(&curves, rows, false, "s", |value_k| format!("{} K", format::grouped(value_k, 0)))
}

fn figure(answers: &Answers, outcome: &ObservationCheck) -> Figure {
    let mut layers = Vec::new();
    let (mut flagged_s, mut flagged_k) = (Vec::new(), Vec::new());
    let (mut from_s, mut to_s) = (0.0f64, answers.case.exposure.duration_s);
    for (place, channel) in outcome.channels.iter().enumerate() {
        let (times_s, temperatures_k) = recorded(answers, channel);
        from_s = times_s.first().copied().unwrap_or(0.0).min(from_s);
        to_s = times_s.last().copied().unwrap_or(0.0).max(to_s);
        layers.push(line(
            name(answers, channel).to_owned(),
            Ink::Series(place),
            Stroke::Solid,
            &times_s,
            &temperatures_k,
        ));
        let of_samples = [FlagKind::Spike, FlagKind::Stuck, FlagKind::Open];
        for flag in channel.flags.iter().filter(|flag| of_samples.contains(&flag.kind)) {
            flagged_s.push(flag.from_s);
            flagged_k.push(flag.value_k);
        }
    }
    if !flagged_s.is_empty() {
        let name = "first sample of a flag".to_owned();
        layers.push(Layer::Points { name, ink: Ink::Measured, x: flagged_s, y: flagged_k, error: Vec::new() });
    }
    Figure {
        id: "observations".to_owned(),
        title: "Observations as read".to_owned(),
        caption: format!("{} Samples before 0 s are kept out.", resampling(answers, outcome)),
        x: Axis::linear("Time, s").with_range(from_s, to_s),
        y: temperature_axis(),
        layers,
    }
}

fn page(answers: &Answers, outcome: &ObservationCheck) -> String {
    let time = |time_s: f64| format::trim_zeros(format::grouped(time_s, 2));
    let channel = |channel: &Channel| {
        let count = |kind: FlagKind| channel.flags.iter().filter(|flag| flag.kind == kind).count();
        let flags = FlagKind::ALL.into_iter().filter(|kind| count(*kind) > 0);
        let flags: Vec<String> = flags.map(|kind| counted_flags(kind, count(kind))).collect();
        vec![
            name(answers, channel).to_owned(),
            channel.heading.clone().unwrap_or_else(|| "in the case file".to_owned()),
            format::count(channel.samples),
            format::count(channel.earlier),
            format::count(channel.later),
            format::count(channel.missing),
            time(channel.span_s.0),
            time(channel.span_s.1),
            range(channel),
            if flags.is_empty() { "none".to_owned() } else { flags.join(", ") },
        ]
    };
    let quality = |channel: &Channel| {
        let digits = |value: Option<f64>| value.map_or("–".to_owned(), |value| format::significant(value, 2));
        let intervals_s = channel.interval_s.map_or(["–"; 3].map(str::to_owned), |each_s| {
            each_s.map(|interval_s| format::significant(interval_s, 3))
        });
        let [short_s, usual_s, long_s] = intervals_s;
        let (noise, resolution) = (digits(channel.noise_k), digits(channel.resolution_k));
        let slope = digits(channel.drift.map(|drift| drift.slope_k_min));
        let half = digits(channel.drift.map(|drift| drift.half_width_k_min));
        let early = digits(channel.drift.map(|drift| drift.noise_k));
        vec![name(answers, channel).to_owned(), usual_s, short_s, long_s, noise, resolution, slope, half, early]
    };
    let channels: Vec<Vec<String>> = outcome.channels.iter().map(channel).collect();
    let qualities: Vec<Vec<String>> = outcome.channels.iter().map(quality).collect();
    let notes: Vec<String> = answers.case.unread_data().iter().map(ToString::to_string).collect();
    let head = [
        "Sensor",
        "Column",
        "Samples",
        "Before 0 s",
        "After the end",
        "Missing",
        "First, s",
        "Last, s",
        "Range, K",
        "Flags",
    ];
    let quality_head = [
        "Sensor",
        "Interval, s",
        "5 % of it",
        "95 % of it",
        "Noise, K",
        "Resolution, K",
        "Drift before 0 s, K/min",
        "± 95 %",
        "Noise then, K",
    ];
    table("Channels", &head, &channels) + &table("Sampling and noise", &quality_head, &qualities) + &list(&notes)
}

/// Name of the sensor, and its channel.
type ChannelRow<'a> = (&'a str, &'a Channel);

fn channels_table<'a>() -> Table<ChannelRow<'a>> {
    fn drift((_, channel): &ChannelRow<'_>, value: fn(&Drift) -> f64) -> f64 {
        channel.drift.as_ref().map_or(f64::NAN, value)
    }
    fn interval((_, channel): &ChannelRow<'_>, place: usize) -> f64 {
        channel.interval_s.map_or(f64::NAN, |interval_s| interval_s[place])
    }
    Table::<ChannelRow<'a>>::new(
        &["observations.csv"],
        "One row per observed sensor (`observations`). Empty cells are numbers that a channel of few samples does not \
         have.",
    )
    .text("sensor", "Sensor.", |row| row.0.to_owned())
    .number("samples", "–", "Samples within the exposure.", |row| row.1.samples as f64)
    .number("earlier", "–", "Samples before its start, which are kept out.", |row| row.1.earlier as f64)
    .number("later", "–", "Samples after its end, which are kept out.", |row| row.1.later as f64)
    .number("missing", "–", "Rows of the file without a value.", |row| row.1.missing as f64)
    .numbers("{first,last}_s", "s", "Times of the first and of the last sample.", |row| {
        vec![row.1.span_s.0, row.1.span_s.1]
    })
    .numbers("{lowest,highest}_k", "K", "Lowest and highest temperature.", |row| vec![row.1.range_k.0, row.1.range_k.1])
    .number("interval_s", "s", "Median interval between samples.", |row| interval(row, 1))
    .numbers("interval_{p5,p95}_s", "s", "Its 5 % and 95 % quantiles.", |row| vec![interval(row, 0), interval(row, 2)])
    .number("noise_k", "K", "Standard deviation of the noise.", |row| row.1.noise_k.unwrap_or(f64::NAN))
    .number("resolution_k", "K", "Smallest step between two samples.", |row| row.1.resolution_k.unwrap_or(f64::NAN))
    .number("drift_k_min", "K/min", "Slope of the samples before the start.", |row| drift(row, |of| of.slope_k_min))
    .number("drift_half_width_k_min", "K/min", "Half the width of its interval.", |row| {
        drift(row, |of| of.half_width_k_min)
    })
    .number("drift_noise_k", "K", "Standard deviation of the samples from that line.", |row| {
        drift(row, |of| of.noise_k)
    })
    .numbers(FLAGS, "–", "Flags of each kind.", |(_, channel)| {
        let count = |kind| channel.flags.iter().filter(|flag| flag.kind == kind).count();
        FlagKind::ALL.map(|kind| count(kind) as f64).to_vec()
    })
}

/// The kinds of flags, in their order.
const FLAGS: &str = "{gap,spike,stuck,open,noisy,drift}";

fn flags_table<'a>() -> Table<(&'a str, &'a Flag)> {
    Table::<(&'a str, &'a Flag)>::new(&["flags.csv"], "One row per flag (`observations`).")
        .text("sensor", "Sensor.", |row| row.0.to_owned())
        .text("flag", "Kind, as the last columns of `observations.csv`.", |row| row.1.kind.name().to_owned())
        .numbers("{from,to}_s", "s", "First and last time.", |row| vec![row.1.from_s, row.1.to_s])
        .number("samples", "–", "Samples, or rows without a value.", |row| row.1.samples as f64)
        .number(
            "value_k",
            "K",
            "The spike, the repeated value, the rail, the noise, or the drift over the exposure.",
            |row| row.1.value_k,
        )
}
