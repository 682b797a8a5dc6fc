//! `[observations]` and `[estimate]`.

use super::column_choice::{TimeChoice, stated_conversion};
use super::references::ReferenceResolver;
use super::schedule::points;
use super::spanned_toml::{TableReader, ValueReader, collect_all};
use super::table_file::{ChosenColumn, Headings, TableChoice, TableFile, TimeColumn};
use crate::case::error::{ReadResult, SourceLocation};
use crate::case::observation::checked_window_s;
use crate::case::suggestion::suggestion;
use crate::case::unit::Dimension;
use crate::case::{Bounds, EstimationSettings, Factor, LossFunction, Observation, RecordedChannel, Sensor};

/// Observations from a table file or under the names of the sensors, with `window` and `sigma` of single sensors.
/// Samples after the end of the exposure are dropped, and with a key `time` those before its start.
pub(super) fn observations(
    case: &TableReader<'_>,
    references: &ReferenceResolver<'_>,
    sensors: Option<&[Sensor]>,
    duration_s: ReadResult<f64>,
) -> ReadResult<Vec<Observation>> {
    let Some(written) = case.optional("observations") else {
        return Ok(Vec::new());
    };
    let section = written.section()?;
    let of_all = section.optional("sigma");
    let sigma_k = of_all.map(sigma).transpose();
    let file = section.optional("file");
    let time = section.optional("time");
    let sheet = TableChoice::of(&section);
    let chosen_time = time.map(TimeChoice::read).transpose();
    let named = section.unread_keys();
    if file.is_none() && named.is_empty() {
        return Err(
            section.error("no observations: expected `file = \"measured.csv\"` or `TC1 = [[\"0 s\", \"300 K\"]]`")
        );
    }
    let own =
        collect_all(named.into_iter().map(|(name, written)| SensorEntry::read(name, written, sensors, duration_s)));
    let (sigma_k, own, chosen_time) = (sigma_k?, own?, chosen_time?);
    let of_file = own.iter().find_map(|own| own.column).map(|column| ("column", column));
    let of_file = time.map(|time| ("time", time)).or(of_file).or(sheet.key());
    if let (None, Some((key, written))) = (file, of_file) {
        return Err(written.error(format!("`{key}` needs a `file`: found none")));
    }
    let columns = ColumnsToRead { sensors, sigma_k, own: &own, time: chosen_time, sheet };
    let mut found = file.map_or(Ok(Vec::new()), |file| columns.read(file, references))?;
    let more = collect_all(own.iter().filter_map(|own| {
        match (found.iter().any(|(name, _)| name == own.name), own.samples) {
            (true, None) => None,
            (true, Some(samples)) => {
                Some(Err(samples.error(format!("duplicate samples of {:?}: the file has its column", own.name))))
            }
            (false, _) => {
                Some(own.samples_in_case_file(sigma_k, file.is_some()).map(|recorded| (own.name.to_owned(), recorded)))
            }
        }
    }))?;
    found.extend(more);
    let has_own = |name: &str| own.iter().any(|own| own.name == name && own.sigma_k.is_some());
    if let Some(written) = of_all.filter(|_| found.iter().all(|(name, _)| has_own(name))) {
        return Err(written.error("`sigma` applies to no sensor: every observed sensor has its own"));
    }
    if let Ok(duration_s) = duration_s {
        found.iter_mut().for_each(|(_, (observation, _))| undo_rounding(&mut observation.times_s, duration_s));
    }
    if let Some(file) = file {
        note_unread_samples(&found, file, references, duration_s.unwrap_or(f64::INFINITY), chosen_time.is_some());
    }
    collect_all(found.into_iter().map(|(name, observation)| {
        let end_s = duration_s.unwrap_or(f64::INFINITY);
        let (observation, channel) = observation;
        let (observation, channel) = within_exposure(observation, channel, end_s, chosen_time.is_some(), written)?;
        written.diagnostics().record_channel(channel);
        match own.iter().find(|own| own.name == name) {
            Some(own) => own.with_window(observation),
            None => Ok(observation),
        }
    }))
}

/// The value under the name of a sensor: samples `[["0 s", "300 K"]]`, or a table with `samples` or with the `column`
/// of the file and its `unit`, and with `window` and `sigma`.
struct SensorEntry<'a> {
    name: &'a str,
    written: ValueReader<'a>,
    sensor: usize,
    samples: Option<ValueReader<'a>>,
    column: Option<ValueReader<'a>>,
    conversion: Option<(f64, f64)>,
    window: Option<(ValueReader<'a>, (f64, f64))>,
    sigma_k: Option<f64>,
}

impl<'a> SensorEntry<'a> {
    fn read(
        name: &'a str,
        written: ValueReader<'a>,
        sensors: Option<&[Sensor]>,
        duration_s: ReadResult<f64>,
    ) -> ReadResult<Self> {
        let sensor = sensor(name, sensors).map_err(|message| written.error(message))?;
        if !written.is_table() {
            let samples = Some(written);
            return Ok(Self {
                name,
                written,
                sensor,
                samples,
                column: None,
                conversion: None,
                window: None,
                sigma_k: None,
            });
        }
        let section = written.section()?;
        let (samples, column) = (section.optional("samples"), section.optional("column"));
        let column = column.map(|column| column.text().map(|_| column)).transpose();
        let unit = section.optional("unit");
        let conversion = stated_conversion(&section, Dimension::Temperature);
        let window = section.optional("window").map(|written| Ok((written, window(written, duration_s)?))).transpose();
        let sigma_k = section.optional("sigma").map(sigma).transpose();
        section.deny_unknown_keys();
        let (column, conversion) = (column?, conversion?);
        match (samples, column, unit) {
            (Some(_), Some(column), _) => return Err(column.error("expected `samples` or a `column`, not both")),
            (_, None, Some(unit)) => return Err(unit.error("`unit` needs a `column`: found none")),
            _ => {}
        }
        Ok(Self { name, written, sensor, samples, column, conversion, window: window?, sigma_k: sigma_k? })
    }

    /// The samples in the case file, with the standard deviation of the sensor or else the common one.
    fn samples_in_case_file(&self, sigma_k: Option<f64>, has_file: bool) -> ReadResult<Recorded> {
        let Some(samples) = self.samples else {
            let name = self.name;
            let column = if has_file { format!("a column \"{name}_K\" in the file or ") } else { String::new() };
            let expected = format!("expected {column}`samples = [[\"0 s\", \"300 K\"]]`");
            return Err(self.written.error(format!("sensor {name:?} has no samples: {expected}")));
        };
        let sigma_k = self.sigma_k.or(sigma_k);
        let sigma_k = sigma_k.ok_or_else(|| samples.error("missing standard deviation: expected a key `sigma`"))?;
        let (times_s, temperatures_k) = points(samples, Dimension::LayupTemperature, false)?;
        let sigma_k = vec![sigma_k; times_s.len()];
        let (rows, span_s) = (times_s.len(), (times_s[0], times_s[times_s.len() - 1]));
        let observation = Observation { sensor: self.sensor, times_s, temperatures_k, sigma_k, window_s: None };
        Ok((observation, recorded_channel(self.sensor, None, rows, rows, span_s, span_s.1)))
    }

    /// The observation with the window of the sensor, which must contain a sample.
    fn with_window(&self, observation: Observation) -> ReadResult<Observation> {
        let Some((written, window_s)) = self.window else { return Ok(observation) };
        let window_s = written.require(observation.checked_window_with_samples_s(window_s, self.name))?;
        Ok(Observation { window_s: Some(window_s), ..observation })
    }
}

fn sigma(written: ValueReader<'_>) -> ReadResult<f64> {
    written.require(Observation::checked_sigma_k(written.quantity(Dimension::TemperatureDifference)?))
}

/// The index of the sensor of a name; 0 without valid sensors.
fn sensor(name: &str, sensors: Option<&[Sensor]>) -> Result<usize, String> {
    let Some(sensors) = sensors else {
        return Ok(0);
    };
    let known = sensors.iter().map(|sensor| sensor.name.as_str());
    let found = sensors.iter().position(|sensor| sensor.name == name);
    found.ok_or_else(|| format!("unknown sensor {name:?}{}", suggestion(name, known)))
}

/// The columns to read from a table file: those of the sensors, `TC1_K`, and of their standard deviations,
/// `TC1_sigma_K`, where neither the sensor nor the case has a `sigma`.
struct ColumnsToRead<'a, 's> {
    sensors: Option<&'s [Sensor]>,
    sigma_k: Option<f64>,
    own: &'s [SensorEntry<'a>],
    time: Option<TimeChoice<'a>>,
    sheet: TableChoice<'a>,
}

/// A column of a sensor.
struct SensorColumn<'t> {
    column: ChosenColumn,
    name: &'t str,
    sensor: usize,
}

impl ColumnsToRead<'_, '_> {
    fn read(&self, file: ValueReader<'_>, references: &ReferenceResolver<'_>) -> ReadResult<Vec<(String, Recorded)>> {
        let headings = match self.time {
            Some(time) => Headings::Chosen(time.heading()?),
            None if self.chooses() => Headings::Chosen(None),
            None => Headings::All,
        };
        let table = references.table_file(file, self.sheet, headings)?;
        let time = self.time.map_or(Ok(TimeColumn::default()), |time| time.find(&table))?;
        let columns = if self.chooses() { self.chosen(&table, time, file) } else { self.all(&table, time, file) }?;
        if columns.is_empty() {
            let names = self.sensors.unwrap_or_default().iter().map(|sensor| format!("{}_K", sensor.name));
            let names = names.collect::<Vec<_>>().join(", ");
            let message = format!("no sensor column after the time column: expected some of {names}");
            return Err(table.error(time.column.index, file.diagnostics(), message));
        }
        table.note_clock(time, file.diagnostics());
        if self.chooses() {
            self.note_ignored(&table, time, &columns, file);
        }
        let of_sensor =
            |sensor: &SensorColumn<'_>| Ok((sensor.name.to_owned(), self.observation(&table, time, sensor, file)?));
        collect_all(columns.iter().map(of_sensor))
    }

    /// Whether the case chooses columns; else every column is a sensor or a standard deviation.
    fn chooses(&self) -> bool {
        self.time.is_some() || self.own.iter().any(|own| own.column.is_some())
    }

    /// The columns that the case names, and those with the name of another sensor.
    fn chosen<'t>(
        &'t self,
        table: &'t TableFile,
        time: TimeColumn,
        file: ValueReader<'_>,
    ) -> ReadResult<Vec<SensorColumn<'t>>> {
        let named = self.own.iter().filter_map(|own| Some((own, own.column?)));
        let mut columns = collect_all(named.map(|(own, written)| {
            let index = written.require(table.find_column(written.text()?, Some(time)))?;
            if index == time.column.index {
                return Err(written.error(format!("{:?} is the column of times", table.heading(index))));
            }
            let column = ChosenColumn { index, conversion: own.conversion };
            Ok(SensorColumn { column, name: own.name, sensor: own.sensor })
        }))?;
        for (sensor, Sensor { name, .. }) in self.sensors.unwrap_or_default().iter().enumerate() {
            let mut same = table.value_columns(time).filter(|(_, column)| column == name).map(|(index, _)| index);
            let (Some(index), false) = (same.next(), columns.iter().any(|column| column.name == name)) else {
                continue;
            };
            if same.next().is_some() {
                return Err(file.error(format!("several columns {name:?}: choose one with a key `column`")));
            }
            columns.push(SensorColumn { column: ChosenColumn { index, conversion: None }, name, sensor });
        }
        Ok(columns)
    }

    /// All columns; each must be a sensor or the standard deviation of one.
    fn all<'t>(
        &self,
        table: &'t TableFile,
        time: TimeColumn,
        file: ValueReader<'_>,
    ) -> ReadResult<Vec<SensorColumn<'t>>> {
        let diagnostics = file.diagnostics();
        let columns: Vec<(usize, &str)> = table.value_columns(time).collect();
        let unmatched = columns.iter().filter_map(|&(column, name)| Some((column, name.strip_suffix("_sigma")?)));
        let unmatched = collect_all(unmatched.map(|(column, name)| {
            let matched = columns.iter().any(|(_, other)| *other == name);
            let message = format!("standard deviation without samples: expected a column \"{name}_K\"");
            if matched { Ok(()) } else { Err(table.error(column, diagnostics, message)) }
        }));
        let sensors = columns.iter().filter(|(_, name)| !name.ends_with("_sigma")).map(|&(index, name)| {
            if columns.iter().any(|&(other, same)| other < index && same == name) {
                return Err(table.error(index, diagnostics, format!("duplicate column of sensor {name:?}")));
            }
            let sensor = sensor(name, self.sensors).map_err(|message| table.error(index, diagnostics, message))?;
            Ok(SensorColumn { column: ChosenColumn { index, conversion: None }, name, sensor })
        });
        let sensors = collect_all(sensors);
        unmatched.and(sensors)
    }

    /// Note the columns that are not read.
    fn note_ignored(&self, table: &TableFile, time: TimeColumn, read: &[SensorColumn<'_>], file: ValueReader<'_>) {
        let is_read = |index: usize, name: &str| {
            read.iter().any(|sensor| sensor.column.index == index || name.strip_suffix("_sigma") == Some(sensor.name))
        };
        let ignored = table.value_columns(time).filter(|&(index, name)| !is_read(index, name));
        let ignored: Vec<&str> =
            ignored.map(|(index, _)| table.heading(index)).filter(|name| !name.is_empty()).collect();
        if let Some((first, others)) = ignored.split_first() {
            let more = if others.is_empty() { String::new() } else { format!(" and {} more", others.len()) };
            let message = format!("column {first:?}{more} not read: no sensor of the case");
            file.diagnostics().record_note(&SourceLocation::without_line(table.file()), message);
        }
    }

    fn observation(
        &self,
        table: &TableFile,
        time: TimeColumn,
        &SensorColumn { column, name, sensor }: &SensorColumn<'_>,
        file: ValueReader<'_>,
    ) -> ReadResult<Recorded> {
        let diagnostics = file.diagnostics();
        let (times_s, temperatures_k) =
            table.time_series(time, column, Dimension::LayupTemperature, false, diagnostics)?;
        let mut others = table.value_columns(time);
        let spread = others.find(|(_, other)| other.strip_suffix("_sigma") == Some(name)).map(|(index, _)| index);
        let own_k = self.own.iter().find(|own| own.name == name).and_then(|own| own.sigma_k);
        let sigma_k = match (own_k.or(self.sigma_k), spread) {
            (Some(sigma_k), _) => vec![sigma_k; times_s.len()],
            (None, Some(index)) => {
                let spread = ChosenColumn { index, conversion: None };
                let difference = Dimension::TemperatureDifference;
                let (at_s, sigmas_k) = table.time_series(time, spread, difference, false, diagnostics)?;
                let rule = |(time_s, sigma_k): (&f64, &f64)| {
                    Observation::checked_sigma_k(*sigma_k).map_err(|message| format!("{message} at {time_s} s"))
                };
                if let Some(message) = at_s.iter().zip(&sigmas_k).find_map(|sample| rule(sample).err()) {
                    return Err(table.error(index, diagnostics, message));
                }
                if at_s != times_s {
                    let message =
                        format!("expected a standard deviation of {name:?} at each of its sample times and no other");
                    return Err(table.error(index, diagnostics, message));
                }
                sigmas_k
            }
            (None, None) => {
                let message =
                    format!("missing standard deviation: expected a column \"{name}_sigma_K\" or a key `sigma`");
                return Err(table.error(column.index, diagnostics, message));
            }
        };
        let (rows, span_s) = table.span(time, diagnostics)?;
        let (samples, last_s) = (times_s.len(), times_s[times_s.len() - 1]);
        let heading = Some(table.heading(column.index).to_owned());
        let observation = Observation { sensor, times_s, temperatures_k, sigma_k, window_s: None };
        Ok((observation, recorded_channel(sensor, heading, rows, samples, span_s, last_s)))
    }
}

/// An observation before samples are kept out, and what else was recorded.
type Recorded = (Observation, RecordedChannel);

fn recorded_channel(
    sensor: usize,
    heading: Option<String>,
    rows: usize,
    samples: usize,
    span_s: (f64, f64),
    last_s: f64,
) -> RecordedChannel {
    let (earlier_times_s, earlier_temperatures_k) = (Vec::new(), Vec::new());
    let missing = rows - samples;
    RecordedChannel {
        sensor,
        heading,
        rows,
        missing,
        span_s,
        last_s,
        earlier_times_s,
        earlier_temperatures_k,
        later: 0,
    }
}

/// A sample that misses the start or the end of the exposure by less than this share of the duration is at it: times
/// in minutes or hours are rounded.
const TIME_ROUNDING: f64 = 1e-6;

/// Move samples that miss the start or the end of the exposure by rounding onto it.
fn undo_rounding(times_s: &mut [f64], duration_s: f64) {
    let close_s = TIME_ROUNDING * duration_s;
    for limit_s in [0.0, duration_s] {
        let beside = times_s.partition_point(|&time_s| time_s < limit_s - close_s)
            ..times_s.partition_point(|&time_s| time_s <= limit_s + close_s);
        if let [time_s] = &mut times_s[beside] {
            *time_s = limit_s;
        }
    }
}

/// Note the samples that are not read: those after the end of the exposure, and with `drops_earlier` those before its
/// start, which are an error without it.
fn note_unread_samples(
    found: &[(String, Recorded)],
    file: ValueReader<'_>,
    references: &ReferenceResolver<'_>,
    duration_s: f64,
    drops_earlier: bool,
) {
    let Ok(path) = file.text() else { return };
    let note = |most: Option<usize>, beyond: String| {
        if let Some(most @ 1..) = most {
            let samples = if most == 1 { "sample" } else { "samples" };
            let message = format!("{most} {samples} of a sensor {beyond} not read");
            file.diagnostics().record_note(&SourceLocation::without_line(references.label(path)), message);
        }
    };
    let times_s = || found.iter().map(|(_, (observation, _))| &observation.times_s);
    if drops_earlier {
        note(times_s().map(|times_s| times_s.partition_point(|&at_s| at_s < 0.0)).max(), "before 0 s".to_owned());
    }
    let later = times_s().map(|times_s| times_s.len() - times_s.partition_point(|&time_s| time_s <= duration_s));
    note(later.max(), format!("after {duration_s} s, the end of the exposure,"));
}

/// The samples up to the end of the exposure, and with `drops_earlier` from its start. The channel takes the others.
fn within_exposure(
    mut observation: Observation,
    mut channel: RecordedChannel,
    duration_s: f64,
    drops_earlier: bool,
    written: ValueReader<'_>,
) -> ReadResult<Recorded> {
    let earlier = observation.times_s.partition_point(|&time_s| time_s < 0.0);
    if drops_earlier {
        if earlier == observation.times_s.len() {
            let last_s = observation.times_s[earlier - 1];
            return Err(written.error(format!("expected samples from 0 s on, found the last at {last_s} s")));
        }
        channel.earlier_times_s = observation.times_s.drain(..earlier).collect();
        channel.earlier_temperatures_k = observation.temperatures_k.drain(..earlier).collect();
        observation.sigma_k.drain(..earlier);
    }
    let first_s = written.require(Observation::checked_first_s(observation.times_s[0]))?;
    let count = observation.times_s.partition_point(|&time_s| time_s <= duration_s);
    if count == 0 {
        return Err(written.error(format!(
            "expected samples up to {duration_s} s, the end of the exposure, found the first at {first_s} s"
        )));
    }
    channel.later = observation.times_s.len() - count;
    observation.times_s.truncate(count);
    observation.temperatures_k.truncate(count);
    observation.sigma_k.truncate(count);
    Ok((observation, channel))
}

/// `[estimate]`; the default settings without it.
pub(super) fn estimate(
    case: &TableReader<'_>,
    factors: Option<&[Factor]>,
    sensors: Option<&[Sensor]>,
    observations: Option<&[Observation]>,
    duration_s: ReadResult<f64>,
) -> ReadResult<EstimationSettings> {
    let Some(written) = case.optional("estimate") else {
        return Ok(EstimationSettings::default());
    };
    let section = written.section()?;
    let names = |factors: &[Factor]| factors.iter().map(|factor| factor.name.clone()).collect();
    let chosen = indices_of_names(&section, "factors", factors.map(names));
    let names = |sensors: &[Sensor]| sensors.iter().map(|sensor| sensor.name.clone()).collect();
    let used = indices_of_names(&section, "sensors", sensors.map(names));
    let seen = observations.unwrap_or_default();
    let all_have_own = !seen.is_empty() && seen.iter().all(|seen| seen.window_s.is_some());
    let window_s = section.optional("window").map(|written| {
        if all_have_own {
            return Err(written.error("`window` applies to no sensor: every observed sensor has its own"));
        }
        window(written, duration_s)
    });
    let window_s = window_s.transpose();
    let bounds = section.optional("bounds").map_or(Ok(Bounds::Small), bounds);
    let loss_function = section.optional("loss_function").map_or(Ok(LossFunction::default()), read_loss_function);
    let prior = section.optional("prior").map(self::bounds).transpose();
    let starts = section.optional("start").map(ValueReader::section).transpose();
    section.deny_unknown_keys();
    let start = match (&chosen, bounds, starts, factors) {
        (Ok(chosen), Ok(bounds), Ok(Some(starts)), Some(factors)) => start(&starts, chosen, factors, bounds),
        _ => Ok(Vec::new()),
    };
    Ok(EstimationSettings {
        factors: chosen?,
        sensors: used?,
        window_s: window_s?,
        start: start?,
        bounds: bounds?,
        loss_function: loss_function?,
        prior: prior?,
    })
}

fn read_loss_function(written: ValueReader<'_>) -> ReadResult<LossFunction> {
    let text = written.text()?;
    written.require(text.parse::<LossFunction>().map_err(|message| format!("{message}, found {text:?}")))
}

/// The indices of a list of names; empty if the known names are not valid.
fn indices_of_names(
    section: &TableReader<'_>,
    key: &'static str,
    known: Option<Vec<String>>,
) -> ReadResult<Vec<usize>> {
    let (Some(written), Some(known)) = (section.optional(key), known) else {
        return Ok(Vec::new());
    };
    let noun = key.trim_end_matches('s');
    let mut met = Vec::new();
    collect_all(written.list()?.into_iter().map(|written| {
        let name = written.text()?;
        let hint = || suggestion(name, known.iter().map(String::as_str));
        let index = known.iter().position(|other| other == name);
        let index = index.ok_or_else(|| written.error(format!("unknown {noun} {name:?}{}", hint())))?;
        if met.contains(&index) {
            return Err(written.error(format!("{noun} {name:?} is listed twice")));
        }
        met.push(index);
        Ok(index)
    }))
}

fn window(written: ValueReader<'_>, duration_s: ReadResult<f64>) -> ReadResult<(f64, f64)> {
    let [start, end] = written.pair()?;
    let (start_s, end_s) = (start.not_negative(Dimension::Time), end.not_negative(Dimension::Time));
    written.require(checked_window_s((start_s?, end_s?), duration_s.unwrap_or(f64::INFINITY)))
}

fn bounds(written: ValueReader<'_>) -> ReadResult<Bounds> {
    let text = written.text()?;
    written.require(Bounds::named(text).ok_or_else(|| format!("expected \"small\" or \"large\", found {text:?}")))
}

/// Start values of the chosen factors; the nominal value by default.
fn start(section: &TableReader<'_>, chosen: &[usize], factors: &[Factor], bounds: Bounds) -> ReadResult<Vec<f64>> {
    let mut start: Vec<f64> = chosen.iter().map(|&index| factors[index].nominal).collect();
    collect_all(section.unread_keys().into_iter().map(|(name, written)| {
        let position = chosen.iter().position(|&index| factors[index].name == name).ok_or_else(|| {
            let known = chosen.iter().map(|&index| factors[index].name.as_str());
            written.error(format!("{name:?} is not a factor to estimate{}", suggestion(name, known)))
        })?;
        let value = EstimationSettings::checked_start(written.number()?, &factors[chosen[position]], bounds);
        start[position] = written.require(value)?;
        Ok(())
    }))?;
    Ok(start)
}
