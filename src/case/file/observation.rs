//! `[observations]` and `[estimate]`.

use super::references::ReferenceResolver;
use super::schedule::points;
use super::spanned_toml::{TableReader, ValueReader, collect_all};
use crate::case::error::ReadResult;
use crate::case::observation::checked_window_s;
use crate::case::suggestion::suggestion;
use crate::case::unit::Dimension;
use crate::case::{Bounds, EstimationSettings, Factor, LossFunction, Observation, Sensor};

/// Observations from a table file or under the names of the sensors, with `window` and `sigma` of single sensors.
/// Samples after the end of the exposure are dropped.
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
    let named = section.unread_keys();
    if file.is_none() && named.is_empty() {
        return Err(
            section.error("no observations: expected `file = \"measured.csv\"` or `TC1 = [[\"0 s\", \"300 K\"]]`")
        );
    }
    let own =
        collect_all(named.into_iter().map(|(name, written)| SensorEntry::read(name, written, sensors, duration_s)));
    let (sigma_k, own) = (sigma_k?, own?);
    let mut found =
        file.map_or(Ok(Vec::new()), |file| observations_from_file(file, references, sensors, sigma_k, &own))?;
    let more = collect_all(own.iter().filter_map(|own| {
        match (found.iter().any(|(name, _)| name == own.name), own.samples) {
            (true, None) => None,
            (true, Some(samples)) => {
                Some(Err(samples.error(format!("duplicate samples of {:?}: the file has its column", own.name))))
            }
            (false, _) => Some(
                own.samples_in_case_file(sigma_k, file.is_some()).map(|observation| (own.name.to_owned(), observation)),
            ),
        }
    }))?;
    found.extend(more);
    let has_own = |name: &str| own.iter().any(|own| own.name == name && own.sigma_k.is_some());
    if let Some(written) = of_all.filter(|_| found.iter().all(|(name, _)| has_own(name))) {
        return Err(written.error("`sigma` applies to no sensor: every observed sensor has its own"));
    }
    collect_all(found.into_iter().map(|(name, observation)| {
        let observation = truncate_to_duration(observation, duration_s.unwrap_or(f64::INFINITY), written)?;
        match own.iter().find(|own| own.name == name) {
            Some(own) => own.with_window(observation),
            None => Ok(observation),
        }
    }))
}

/// The value under the name of a sensor: samples `[["0 s", "300 K"]]`, or a table with `samples`, `window` and `sigma`.
struct SensorEntry<'a> {
    name: &'a str,
    written: ValueReader<'a>,
    sensor: usize,
    samples: Option<ValueReader<'a>>,
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
            return Ok(Self { name, written, sensor, samples: Some(written), window: None, sigma_k: None });
        }
        let section = written.section()?;
        let samples = section.optional("samples");
        let window = section.optional("window").map(|written| Ok((written, window(written, duration_s)?))).transpose();
        let sigma_k = section.optional("sigma").map(sigma).transpose();
        section.deny_unknown_keys();
        Ok(Self { name, written, sensor, samples, window: window?, sigma_k: sigma_k? })
    }

    /// The samples in the case file, with the standard deviation of the sensor or else the common one.
    fn samples_in_case_file(&self, sigma_k: Option<f64>, has_file: bool) -> ReadResult<Observation> {
        let Some(samples) = self.samples else {
            let name = self.name;
            let column = if has_file { format!("a column \"{name}_K\" in the file or ") } else { String::new() };
            let expected = format!("expected {column}`samples = [[\"0 s\", \"300 K\"]]`");
            return Err(self.written.error(format!("sensor {name:?} has no samples: {expected}")));
        };
        let sigma_k = self.sigma_k.or(sigma_k);
        let sigma_k = sigma_k.ok_or_else(|| samples.error("missing standard deviation: expected a key `sigma`"))?;
        let (times_s, temperatures_k) = points(samples, Dimension::Temperature, false)?;
        let sigma_k = vec![sigma_k; times_s.len()];
        Ok(Observation { sensor: self.sensor, times_s, temperatures_k, sigma_k, window_s: None })
    }

    /// The observation with the window of the sensor, which must contain a sample.
    fn with_window(&self, observation: Observation) -> ReadResult<Observation> {
        let Some((written, window_s)) = self.window else { return Ok(observation) };
        let window_s = written.require(observation.checked_window_with_samples_s(window_s, self.name))?;
        Ok(Observation { window_s: Some(window_s), ..observation })
    }
}

fn sigma(written: ValueReader<'_>) -> ReadResult<f64> {
    written.positive(Dimension::TemperatureDifference)
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

/// The columns of a table file: `TC1_K` and, without a `sigma` of the sensor or the case, `TC1_sigma_K`.
fn observations_from_file(
    file: ValueReader<'_>,
    references: &ReferenceResolver<'_>,
    sensors: Option<&[Sensor]>,
    sigma_k: Option<f64>,
    own: &[SensorEntry<'_>],
) -> ReadResult<Vec<(String, Observation)>> {
    let diagnostics = file.diagnostics();
    let sheet = references.table_file(file)?;
    let columns: Vec<(usize, &str)> = sheet.value_columns().collect();
    let traces = columns.iter().filter(|(_, stem)| !stem.ends_with("_sigma"));
    if traces.clone().next().is_none() {
        let names = sensors.unwrap_or_default().iter().map(|sensor| format!("{}_K", sensor.name));
        let names = names.collect::<Vec<_>>().join(", ");
        let message = format!("no sensor column after the time column: expected some of {names}");
        return Err(sheet.error(0, diagnostics, message));
    }
    let unmatched = columns.iter().filter_map(|&(column, stem)| Some((column, stem.strip_suffix("_sigma")?)));
    let unmatched = collect_all(unmatched.map(|(column, stem)| {
        let matched = columns.iter().any(|(_, other)| *other == stem);
        let message = format!("standard deviation without samples: expected a column \"{stem}_K\"");
        if matched { Ok(()) } else { Err(sheet.error(column, diagnostics, message)) }
    }));
    let read = collect_all(traces.map(|&(column, stem)| {
        if columns.iter().any(|&(other, name)| other < column && name == stem) {
            return Err(sheet.error(column, diagnostics, format!("duplicate column of sensor {stem:?}")));
        }
        let sensor = sensor(stem, sensors).map_err(|message| sheet.error(column, diagnostics, message))?;
        let (times_s, temperatures_k) = sheet.time_series(column, Dimension::Temperature, false, diagnostics)?;
        let spread = columns.iter().find(|(_, other)| other.strip_suffix("_sigma") == Some(stem));
        let own_k = own.iter().find(|own| own.name == stem).and_then(|own| own.sigma_k);
        let sigma_k = match (own_k.or(sigma_k), spread) {
            (Some(sigma_k), _) => vec![sigma_k; times_s.len()],
            (None, Some(&(spread, _))) => {
                let (at_s, sigmas_k) =
                    sheet.time_series(spread, Dimension::TemperatureDifference, false, diagnostics)?;
                let bad = at_s.iter().zip(&sigmas_k).find(|(_, sigma_k)| **sigma_k <= 0.0);
                if let Some((time_s, sigma_k)) = bad {
                    let message = format!("expected a standard deviation above 0 K, found {sigma_k} K at {time_s} s");
                    return Err(sheet.error(spread, diagnostics, message));
                }
                if at_s != times_s {
                    let message =
                        format!("expected a standard deviation of {stem:?} at each of its sample times and no other");
                    return Err(sheet.error(spread, diagnostics, message));
                }
                sigmas_k
            }
            (None, None) => {
                let message =
                    format!("missing standard deviation: expected a column \"{stem}_sigma_K\" or a key `sigma`");
                return Err(sheet.error(column, diagnostics, message));
            }
        };
        Ok((stem.to_owned(), Observation { sensor, times_s, temperatures_k, sigma_k, window_s: None }))
    }));
    unmatched.and(read)
}

fn truncate_to_duration(
    mut observation: Observation,
    duration_s: f64,
    written: ValueReader<'_>,
) -> ReadResult<Observation> {
    let first_s = written.require(Observation::checked_first_s(observation.times_s[0]))?;
    let count = observation.times_s.partition_point(|&time_s| time_s <= duration_s);
    if count == 0 {
        return Err(written.error(format!(
            "expected samples up to {duration_s} s, the end of the exposure, found the first at {first_s} s"
        )));
    }
    observation.times_s.truncate(count);
    observation.temperatures_k.truncate(count);
    observation.sigma_k.truncate(count);
    Ok(observation)
}

/// `[estimate]`; the default settings without it.
pub(super) fn estimate(
    case: &TableReader<'_>,
    factors: Option<&[Factor]>,
    sensors: Option<&[Sensor]>,
    duration_s: ReadResult<f64>,
) -> ReadResult<EstimationSettings> {
    let Some(written) = case.optional("estimate") else {
        return Ok(EstimationSettings::default());
    };
    let section = written.section()?;
    let names = |factors: &[Factor]| factors.iter().map(|factor| factor.name.clone()).collect();
    let chosen = indices_of_names(&section, "factors", factors.map(names));
    let names = |sensors: &[Sensor]| sensors.iter().map(|sensor| sensor.name.clone()).collect();
    let seen = indices_of_names(&section, "sensors", sensors.map(names));
    let window_s = section.optional("window").map(|written| window(written, duration_s)).transpose();
    let bounds = section.optional("bounds").map_or(Ok(Bounds::Small), bounds);
    let loss = section.optional("loss_function").map_or(Ok(LossFunction::default()), loss_function);
    let prior = section.optional("prior").map(self::bounds).transpose();
    let starts = section.optional("start").map(ValueReader::section).transpose();
    section.deny_unknown_keys();
    let start = match (&chosen, bounds, starts, factors) {
        (Ok(chosen), Ok(bounds), Ok(Some(starts)), Some(factors)) => start(&starts, chosen, factors, bounds),
        _ => Ok(Vec::new()),
    };
    Ok(EstimationSettings {
        factors: chosen?,
        sensors: seen?,
        window_s: window_s?,
        start: start?,
        bounds: bounds?,
        loss: loss?,
        prior: prior?,
    })
}

fn loss_function(written: ValueReader<'_>) -> ReadResult<LossFunction> {
    let text = written.text()?;
    written.require(LossFunction::parse(text).map_err(|message| format!("{message}, found {text:?}")))
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
