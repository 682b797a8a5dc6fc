//! `summary.json`. Unbounded and unknown numbers are `null`.

use super::json::{JsonObject, OrderedMap};
use crate::case::{Case, Observation};
use crate::kept_work::checksum::Checksum;
use crate::report::reportable::MemberCounts;
use crate::report::{ReportError, observations};
use crate::study::answers::Answers;
use crate::study::nominal::{ErrorEstimate, GaugeTrace, Peak};
use crate::traces::MemberStatus;
use serde::Serialize;
use std::collections::BTreeMap;

/// Estimated discretisation errors of temperatures, and of gauges by their keys.
#[derive(Serialize)]
struct DiscretisationError {
    tolerance_k: f64,
    nominal_k: f64,
    bounds: &'static str,
    corners_k: Option<f64>,
    corners: usize,
    failed_corners: usize,
    /// Contribution of rounding in f32 to the nominal error, K; absent in f64.
    #[serde(skip_serializing_if = "Option::is_none")]
    rounding_k: Option<f64>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    gauges: BTreeMap<&'static str, GaugeError>,
}

/// Error of a gauge: of a front in m, for 95 % of the instants; of another gauge as a share of its peak.
#[derive(Serialize)]
struct GaugeError {
    error: f64,
    tolerance: f64,
}

impl DiscretisationError {
    fn of(reached: &ErrorEstimate) -> Self {
        let gauges = reached
            .gauges
            .iter()
            .map(|gauge| (gauge.gauge.name(), GaugeError { error: gauge.error, tolerance: gauge.tolerance }));
        Self {
            tolerance_k: reached.tolerance_k,
            nominal_k: reached.nominal_k,
            bounds: reached.bounds.name(),
            corners_k: reached.corners_k,
            corners: reached.corners,
            failed_corners: reached.failed_corners,
            rounding_k: reached.rounding.as_ref().map(|rounding| rounding.nominal_k),
            gauges: gauges.collect(),
        }
    }
}

#[derive(Serialize)]
struct Backend<'a> {
    name: &'a str,
    kind: &'a str,
    precision: &'a str,
}

#[derive(Serialize)]
struct MembersRecord {
    requested: usize,
    ok: usize,
    failed: usize,
}

#[derive(Serialize)]
struct Seconds {
    plan: f64,
    march: f64,
    reduce: f64,
    report: f64,
    total: f64,
}

#[derive(Serialize)]
struct PeakRecord {
    peak_k: f64,
    peak_time_s: f64,
}

/// Peak and final value of a gauge, in the unit at the end of its name.
#[derive(Serialize)]
struct GaugeRecord {
    /// Value of largest magnitude.
    peak: f64,
    peak_time_s: f64,
    r#final: f64,
}

/// Relative residuals; of mass where gas moves.
#[derive(Serialize)]
struct Balance {
    energy: Option<f64>,
    mass: Option<f64>,
}

/// The text of `summary.json`: common keys, then those of every result. `report_s` is the time that the report took,
/// `files` are the names of its files.
///
/// # Errors
/// When JSON cannot be written.
pub(in crate::report) fn summary(answers: &Answers, report_s: f64, files: &[String]) -> Result<String, ReportError> {
    let march = answers.nominal_march();
    let readings = march.filter(|outcome| !outcome.gauge_traces.is_empty());
    let text = JsonObject::to_json(|record| {
        record.put("command", answers.question)?;
        record.put("case", &answers.id())?;
        record.put("version", env!("CARGO_PKG_VERSION"))?;
        record.put("seed", &answers.seed)?;
        let backend = Backend {
            name: &answers.backend.name,
            kind: answers.backend.kind,
            precision: answers.backend.precision.name(),
        };
        record.put("backend", &backend)?;
        record.put("members", &members(answers))?;
        record.put("steps", &march.map(|outcome| outcome.steps))?;
        record.put("cells", &march.map(|outcome| outcome.cells))?;
        if let Some(reached) = march.and_then(|outcome| outcome.error_estimate.as_ref()) {
            record.put("discretisation_error", &DiscretisationError::of(reached))?;
        }
        let seconds = Seconds {
            plan: answers.timing.plan_s,
            march: answers.timing.march_s,
            reduce: answers.timing.other_s,
            report: report_s,
            total: answers.timing.start.elapsed().as_secs_f64(),
        };
        record.put("seconds", &seconds)?;
        record.put("sensors", &sensors(answers))?;
        record.put("observed", &observations(answers))?;
        if let Some(outcome) = readings {
            record.put("gauges", &gauges(&outcome.gauge_traces))?;
        }
        let balance = Balance {
            energy: march.map(|outcome| outcome.balance.residual()),
            mass: readings.map(|outcome| outcome.balance.mass_residual()),
        };
        record.put("balance", &balance)?;
        for answer in answers.results() {
            answer.write_summary(answers, record)?;
        }
        record.put("provenance", &answers.run)?;
        // The next report of the case removes these files.
        record.put("files", files)?;
        Ok(())
    })?;
    Ok(with_checksum(&text))
}

/// The text of an object with a last key, the checksum of the lines before it.
fn with_checksum(text: &str) -> String {
    let lines = text.trim_end().trim_end_matches('}').trim_end().to_owned() + ",\n";
    let checksum = Checksum::of(lines.as_bytes());
    format!("{lines}  \"checksum\": \"{checksum}\"\n}}\n")
}

/// Numbers of sampled members; without any, the nominal march counts as one.
fn members(answers: &Answers) -> MembersRecord {
    let drawn = answers.results().into_iter().find_map(|answer| answer.members());
    let one = answers.nominal_march().map(|march| {
        let completed = usize::from(march.status == MemberStatus::Completed);
        MemberCounts { requested: 1, completed, failed: 1 - completed }
    });
    let MemberCounts { requested, completed, failed } = drawn.or(one).unwrap_or_default();
    MembersRecord { requested, ok: completed, failed }
}

/// Peaks of the nominal march.
fn sensors(answers: &Answers) -> OrderedMap<'_, PeakRecord> {
    let peaks = answers.nominal_march().into_iter().flat_map(|march| &march.peaks);
    let record = |peak: &Peak| PeakRecord { peak_k: peak.temperature_k, peak_time_s: peak.time_s };
    let named = answers.case.sensors.iter().zip(peaks);
    OrderedMap(named.map(|(sensor, peak)| (sensor.name.as_str(), record(peak))).collect())
}

/// The data window, the samples within it, and the minimum and maximum standard deviation of all samples.
#[derive(Serialize)]
struct ObservationRecord {
    window_s: (f64, f64),
    samples: usize,
    sigma_k: (f64, f64),
}

/// Case → sensor → window, samples and standard deviations.
fn observations(answers: &Answers) -> OrderedMap<'_, OrderedMap<'_, ObservationRecord>> {
    OrderedMap(answers.cases().map(|case| (case.id.as_str(), case_observations(case))).collect())
}

fn case_observations(case: &Case) -> OrderedMap<'_, ObservationRecord> {
    let record = |seen: &Observation| {
        let window_s = case.window_s(seen.sensor);
        let is_used = |time_s: &&f64| (window_s.0..=window_s.1).contains(*time_s);
        let samples = seen.times_s.iter().filter(is_used).count();
        ObservationRecord { window_s, samples, sigma_k: observations::sigma_range_k(seen) }
    };
    OrderedMap(case.observations.iter().map(|seen| (case.sensors[seen.sensor].name.as_str(), record(seen))).collect())
}

fn gauges(readings: &[GaugeTrace]) -> OrderedMap<'static, GaugeRecord> {
    let record = |of: &GaugeTrace| GaugeRecord { peak: of.peak, peak_time_s: of.peak_time_s, r#final: of.end };
    OrderedMap(readings.iter().map(|reading| (reading.gauge.name(), record(reading))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::marched;
    use crate::traces::Gauge;
    use serde_json::Value;

    #[test]
    fn the_summary_of_an_estimate_has_every_documented_key() {
        let mut outcomes = marched::study().with_long_chains();
        outcomes.estimated.values[0] = 0.97;
        let combination = &mut outcomes.estimated.combinations[0];
        (combination.is_ratio, combination.value, combination.relative_error) = (true, 0.97 / 1.02, 0.003);
        let posterior = &mut outcomes.posterior;
        (posterior.marginals[1].median, posterior.pairs[0].correlation) = (1.018, 0.98);
        posterior.discrepancy.amplitude_k = 4.2;
        posterior.predicted[0].sensors[3].coverage = Some((0.71, 0.96));
        let text = summary(&outcomes.answers("estimate"), 0.4, &[]).expect("it serialises");
        let read: Value = serde_json::from_str(&text).expect("it is JSON");
        for key in ["command", "case", "version", "steps", "cells", "iterations", "marches", "termination"] {
            assert!(!read[key].is_null(), "no {key}");
        }
        assert_eq!(read["factors"]["f_k_INS"]["value"], 0.97);
        let determined = &read["identifiable_combinations"][0];
        assert_eq!((&determined["combination"], &determined["factors"][1]), (&"ratio".into(), &"f_cp_INS".into()));
        assert!(determined["value"].as_f64().is_some_and(|value| (value - 0.951).abs() < 1e-3));
        assert_eq!(determined["relative_standard_error"], 0.003);
        let drawn = &read["posterior"];
        assert_eq!((&drawn["converged"], &drawn["factors"]["f_cp_INS"]["median"]), (&true.into(), &1.018.into()));
        assert_eq!((&drawn["correlation"][0][1], &drawn["discrepancy"]["amplitude_k"]), (&0.98.into(), &4.2.into()));
        assert_eq!(drawn["predicted"][outcomes.case.id.as_str()]["TC4"]["with_discrepancy"]["coverage"], 0.96);
        assert_eq!(read["members"]["failed"], 0);
        assert_eq!(read["backend"]["precision"], "f64");
        assert!(read["sensors"]["TC4"]["peak_k"].as_f64().is_some_and(|peak| peak > 300.0));
        assert!(read["balance"]["mass"].is_null() && read["seconds"]["total"].is_number());
        assert!(text.find("\"command\"") < text.find("\"case\"") && text.find("\"TC1\"") < text.find("\"TC4\""));
    }

    #[test]
    fn the_checksum_of_a_summary_is_that_of_the_lines_before_it() {
        let text = summary(&marched::study().answers("predict"), 0.4, &[]).expect("it serialises");
        let (lines, last) = text.split_at(text.find("  \"checksum\"").expect("a checksum"));
        assert_eq!(last, format!("  \"checksum\": \"{}\"\n}}\n", Checksum::of(lines.as_bytes())));
        serde_json::from_str::<Value>(&text).expect("it is JSON");
    }

    #[test]
    fn the_provenance_of_a_summary_has_the_command_with_every_change_of_the_case() {
        let text = summary(&marched::study().answers("predict"), 0.4, &[]).expect("it serialises");
        let read: Value = serde_json::from_str(&text).expect("it is JSON");
        let run = &read["provenance"];
        assert_eq!(run["command_line"][4], "resolution.tolerance=5 K");
        assert!(run["date"].as_str().is_some_and(|date| date.ends_with('Z')) && run["threads"] == 2);
        assert_eq!((&run["version"], &run["driver"]), (&env!("CARGO_PKG_VERSION").into(), &Value::Null));
    }

    #[test]
    fn the_standard_error_of_an_undetermined_factor_is_null() {
        let mut outcomes = marched::study();
        outcomes.estimated.standard_errors[1] = f64::INFINITY;
        let text = summary(&outcomes.answers("estimate"), 0.4, &[]).expect("it serialises");
        let read: Value = serde_json::from_str(&text).expect("it is JSON");
        assert!(read["factors"]["f_cp_INS"]["standard_error"].is_null());
        assert!(read["factors"]["f_k_INS"]["standard_error"].is_number());
    }

    #[test]
    fn gauges_and_the_mass_balance_are_in_the_summary_only_where_gas_moves() {
        let read = |outcomes: &marched::Study, command: &'static str| -> Value {
            let text = summary(&outcomes.answers(command), 0.4, &[]).expect("it serialises");
            serde_json::from_str(&text).expect("it is JSON")
        };
        let still = read(&marched::study(), "predict");
        assert!(still.get("gauges").is_none() && still["balance"]["mass"].is_null());
        let mut charring = marched::charring();
        let balance = charring.nominal.balance;
        for march in [&mut charring.nominal, &mut charring.estimated.fitted[0].before] {
            let gauges = &mut march.gauge_traces;
            let flux = &mut gauges[Gauge::GasFlux as usize];
            (flux.peak, flux.peak_time_s, flux.end) = (0.009, 40.0, 1e-7);
            (gauges[Gauge::MassLost as usize].end, gauges[Gauge::CharFront as usize].end) = (0.36, 2.5e-3);
        }
        for command in ["predict", "study", "estimate"] {
            let charring = read(&charring, command);
            let flux = &charring["gauges"]["gas_flux_kg_m2_s"];
            assert_eq!((&flux["peak"], &flux["peak_time_s"]), (&0.009.into(), &40.0.into()), "{command}");
            assert!(flux["final"].as_f64().is_some_and(|last| last < 1e-6), "{command}");
            let last = |gauge: &str| charring["gauges"][gauge]["final"].as_f64().expect("a final value");
            assert!((last("mass_lost_kg_m2") - 0.36).abs() < 1e-6 && (last("char_front_m") - 2.5e-3).abs() < 1e-6);
            for gauge in ["virgin_front_m", "peak_pressure_pa", "back_pressure_pa"] {
                assert!(last(gauge) > 0.0, "{command}: {gauge}");
            }
            assert!(
                charring["balance"]["mass"].as_f64().is_some_and(|off| (off - balance.mass_residual()).abs() < 1e-12),
                "{command}"
            );
        }
    }

    #[test]
    fn the_variance_shares_of_a_sensor_sum_to_one() {
        let outcomes = marched::study();
        let text = summary(&outcomes.answers("uncertainty"), 0.4, &[]).expect("it serialises");
        let read: Value = serde_json::from_str(&text).expect("it is JSON");
        let shares = read["variance_shares"]["TC4"].as_object().expect("shares of TC4");
        let total: f64 = shares.values().filter_map(Value::as_f64).sum();
        assert!((total - 1.0).abs() < 1e-9, "{total}");
    }
}
