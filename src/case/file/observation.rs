//! `[observations]` and `[estimate]`.

use super::Folder;
use super::exposure::corners;
use super::nearest::suggestion;
use super::written::{Section, Written, all};
use crate::case::error::Read;
use crate::case::unit::Dimension;
use crate::case::{Bounds, Estimate, Factor, Observation, Sensor};
use crate::fit::Loss;

/// Observations from a CSV, or written out under the names of their sensors. Samples after the duration are left out.
pub(super) fn observations(
    case: &Section<'_>,
    folder: &Folder<'_>,
    sensors: Option<&[Sensor]>,
    duration_s: Read<f64>,
) -> Read<Vec<Observation>> {
    let duration_s = duration_s.unwrap_or(f64::INFINITY);
    let Some(written) = case.optional("observations") else {
        return Ok(Vec::new());
    };
    let section = written.section()?;
    let sigma_k = section.optional("sigma").map(|sigma| sigma.positive(Dimension::TemperatureDifference)).transpose();
    let file = section.optional("file");
    let inline = section.others();
    let sigma_k = sigma_k?;
    let mut found = match file {
        Some(file) => measured(file, folder, sensors, sigma_k)?,
        None if inline.is_empty() => {
            return Err(
                section.fault("no observations: expected `file = \"measured.csv\"` or `TC1 = [[\"0 s\", \"300 K\"]]`")
            );
        }
        None => Vec::new(),
    };
    found.extend(all(inline.into_iter().map(|(name, written)| {
        let sensor = sensor(name, sensors).map_err(|message| written.fault(message))?;
        if file.is_some() && found.iter().any(|other: &Observation| other.sensor == sensor) {
            return Err(written.fault(format!("sensor {name:?} is observed in the file already")));
        }
        let sigma_k = sigma_k.ok_or_else(|| written.fault("observations written out need a `sigma`"))?;
        let (times_s, temperatures_k): (Vec<f64>, _) =
            corners(written, Dimension::Temperature, false)?.into_iter().unzip();
        Ok(Observation { sensor, sigma_k: vec![sigma_k; times_s.len()], times_s, temperatures_k })
    }))?);
    all(found.into_iter().map(|observation| within(observation, duration_s, written)))
}

/// The sensor of a name; the first one stands in where the sensors themselves are at fault.
fn sensor(name: &str, sensors: Option<&[Sensor]>) -> Result<usize, String> {
    let Some(sensors) = sensors else {
        return Ok(0);
    };
    let known = sensors.iter().map(|sensor| sensor.name.as_str());
    let found = sensors.iter().position(|sensor| sensor.name == name);
    found.ok_or_else(|| format!("no sensor {name:?} to observe{}", suggestion(name, known)))
}

/// The columns of a CSV: `TC1_K` and, where the case gives no sigma of its own, `TC1_sigma_K`.
fn measured(
    file: Written<'_>,
    folder: &Folder<'_>,
    sensors: Option<&[Sensor]>,
    sigma_k: Option<f64>,
) -> Read<Vec<Observation>> {
    let faults = file.faults();
    let sheet = folder.sheet(file)?;
    let columns: Vec<(usize, &str)> = sheet.stems().collect();
    let traces = columns.iter().filter(|(_, stem)| !stem.ends_with("_sigma"));
    let unmatched = columns.iter().filter_map(|&(column, stem)| Some((column, stem.strip_suffix("_sigma")?)));
    let unmatched = all(unmatched.map(|(column, stem)| {
        let matched = columns.iter().any(|(_, other)| *other == stem);
        let message = format!("standard deviation of {stem:?}, which has no column of its own");
        if matched { Ok(()) } else { Err(sheet.fault(column, faults, message)) }
    }));
    let read = all(traces.map(|&(column, stem)| {
        let sensor = sensor(stem, sensors).map_err(|message| sheet.fault(column, faults, message))?;
        let series = sheet.series(column, Dimension::Temperature, false, faults)?;
        let spread = columns.iter().find(|(_, other)| other.strip_suffix("_sigma") == Some(stem));
        let sigma_k = match (sigma_k, spread) {
            (Some(sigma_k), _) => vec![sigma_k; series.len()],
            (None, Some(&(spread, _))) => {
                let sigmas = sheet.series(spread, Dimension::TemperatureDifference, false, faults)?;
                let bad = sigmas.iter().find(|(_, sigma_k)| *sigma_k <= 0.0);
                if let Some((time_s, sigma_k)) = bad {
                    let message = format!("standard deviation {sigma_k} K at {time_s} s is not positive");
                    return Err(sheet.fault(spread, faults, message));
                }
                if !sigmas.iter().map(|row| row.0).eq(series.iter().map(|row| row.0)) {
                    let message = format!("standard deviations of {stem:?} do not stand at the times of its samples");
                    return Err(sheet.fault(spread, faults, message));
                }
                sigmas.into_iter().map(|(_, sigma_k)| sigma_k).collect()
            }
            (None, None) => {
                let message =
                    format!("missing standard deviation: expected a column \"{stem}_sigma_K\" or a key `sigma`");
                return Err(sheet.fault(column, faults, message));
            }
        };
        let (times_s, temperatures_k) = series.into_iter().unzip();
        Ok(Observation { sensor, times_s, temperatures_k, sigma_k })
    }));
    unmatched.and(read)
}

fn within(mut observation: Observation, duration_s: f64, written: Written<'_>) -> Read<Observation> {
    let first_s = observation.times_s[0];
    if first_s < 0.0 {
        return Err(written.fault(format!("observed at {first_s} s, before the start")));
    }
    let count = observation.times_s.partition_point(|&time_s| time_s <= duration_s);
    if count == 0 {
        return Err(written.fault(format!("observed from {first_s} s on, after the duration of {duration_s} s")));
    }
    observation.times_s.truncate(count);
    observation.temperatures_k.truncate(count);
    observation.sigma_k.truncate(count);
    Ok(observation)
}

/// What the case proposes to estimate; nothing where it is silent.
pub(super) fn estimate(
    case: &Section<'_>,
    factors: Option<&[Factor]>,
    sensors: Option<&[Sensor]>,
    duration_s: Read<f64>,
) -> Read<Estimate> {
    let Some(written) = case.optional("estimate") else {
        return Ok(Estimate::default());
    };
    let section = written.section()?;
    let names = |factors: &[Factor]| factors.iter().map(|factor| factor.name.clone()).collect();
    let chosen = indices(&section, "factors", factors.map(names));
    let names = |sensors: &[Sensor]| sensors.iter().map(|sensor| sensor.name.clone()).collect();
    let seen = indices(&section, "sensors", sensors.map(names));
    let window_s = section.optional("window").map(|written| window(written, duration_s)).transpose();
    let bounds = section.optional("bounds").map_or(Ok(Bounds::Small), bounds);
    let loss = section.optional("loss").map_or(Ok(Loss::default()), loss);
    let prior = section.optional("prior").map(self::bounds).transpose();
    let starts = section.optional("start").map(Written::section).transpose();
    section.close();
    let start = match (&chosen, bounds, starts, factors) {
        (Ok(chosen), Ok(bounds), Ok(Some(starts)), Some(factors)) => start(&starts, chosen, factors, bounds),
        _ => Ok(Vec::new()),
    };
    Ok(Estimate {
        factors: chosen?,
        sensors: seen?,
        window_s: window_s?,
        start: start?,
        bounds: bounds?,
        loss: loss?,
        prior: prior?,
    })
}

fn loss(written: Written<'_>) -> Read<Loss> {
    let text = written.text()?;
    Loss::named(text).map_err(|message| written.fault(format!("{message}, found {text:?}")))
}

/// Names of a list, as indices into those that there are; as none where those are at fault.
fn indices(section: &Section<'_>, key: &'static str, known: Option<Vec<String>>) -> Read<Vec<usize>> {
    let (Some(written), Some(known)) = (section.optional(key), known) else {
        return Ok(Vec::new());
    };
    let mut met = Vec::new();
    all(written.list()?.into_iter().map(|written| {
        let name = written.text()?;
        let hint = || suggestion(name, known.iter().map(String::as_str));
        let index = known.iter().position(|other| other == name);
        let index =
            index.ok_or_else(|| written.fault(format!("{name:?} is none of the {key} of this case{}", hint())))?;
        if met.contains(&index) {
            return Err(written.fault(format!("{name:?} stands twice")));
        }
        met.push(index);
        Ok(index)
    }))
}

fn window(written: Written<'_>, duration_s: Read<f64>) -> Read<(f64, f64)> {
    let [start, end] = written.pair()?;
    let (start_s, end_s) = (start.not_negative(Dimension::Time), end.not_negative(Dimension::Time));
    let (start_s, end_s) = (start_s?, end_s?);
    if start_s >= end_s {
        return Err(written.fault(format!("window reversed: {start_s} s is not before {end_s} s")));
    }
    match duration_s {
        Ok(duration_s) if start_s >= duration_s => {
            Err(written.fault(format!("window begins at {start_s} s, not before the end at {duration_s} s")))
        }
        _ => Ok((start_s, end_s)),
    }
}

fn bounds(written: Written<'_>) -> Read<Bounds> {
    match written.text()? {
        "small" => Ok(Bounds::Small),
        "large" => Ok(Bounds::Large),
        other => Err(written.fault(format!("expected \"small\" or \"large\", found {other:?}"))),
    }
}

/// Starts by the names of the factors chosen; the nominal value of one that is not named.
fn start(section: &Section<'_>, chosen: &[usize], factors: &[Factor], bounds: Bounds) -> Read<Vec<f64>> {
    let mut start: Vec<f64> = chosen.iter().map(|&index| factors[index].nominal).collect();
    all(section.others().into_iter().map(|(name, written)| {
        let place = chosen.iter().position(|&index| factors[index].name == name).ok_or_else(|| {
            let known = chosen.iter().map(|&index| factors[index].name.as_str());
            written.fault(format!("{name:?} is none of the factors to estimate{}", suggestion(name, known)))
        })?;
        let value = written.number()?;
        let (low, high) = factors[chosen[place]].bounds(bounds);
        if !(low..=high).contains(&value) {
            return Err(written.fault(format!("start {value} lies outside the bounds {low} to {high}")));
        }
        start[place] = value;
        Ok(())
    }))?;
    Ok(start)
}
