//! `summary.json`: the outcome for a program. Numbers that are unbounded or unknown are `null`.

mod asked;
mod causes;
mod estimated;
mod history;
mod observed;
mod posterior;
mod whole;

use super::super::{ReportError, Story, findings, precision_words, reduction};
use crate::case::Case;
use crate::study::beside::{Beside, Left};
use crate::study::nominal::{Reached, Reading};
use crate::study::sensitivity::Sensitivity;
use crate::traces::Arrival;
use asked::{RecoveryRecord, SizingRecord};
use causes::Due;
use estimated::EstimatedRecord;
use history::HistoryRecord;
use observed::ObservedRecord;
use posterior::PosteriorRecord;
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};
use std::collections::BTreeMap;
use whole::WholeRecord;

/// Keys in the order written. Absent answers leave their keys out.
#[derive(Serialize)]
struct Record<'a> {
    command: &'a str,
    case: String,
    version: &'a str,
    seed: Option<u64>,
    backend: Backend<'a>,
    members: Members,
    steps: Option<usize>,
    cells: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    resolution: Option<Resolution>,
    /// s.
    seconds: Seconds,
    sensors: Named<'a, PeakRecord>,
    /// Case → sensor → what its observation counts for.
    observed: Named<'a, Named<'a, ObservedRecord>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gauges: Option<Named<'a, ReadingRecord>>,
    balance: Balance,
    #[serde(flatten)]
    estimated: Option<EstimatedRecord<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    posterior: Option<PosteriorRecord<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    beside: Option<BesideRecord<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sizing: Option<SizingRecord<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    history: Option<HistoryRecord<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    twins: Option<RecoveryRecord<'a>>,
    /// Sensor → factor → share of the spread at the sensor's nominal peak.
    #[serde(skip_serializing_if = "Option::is_none")]
    shares: Option<Named<'a, Named<'a, f64>>>,
    /// Sensor → what its peak and the time of that are due to.
    #[serde(skip_serializing_if = "Option::is_none")]
    causes: Option<Named<'a, Due<'a>>>,
    /// Sensor → how whole traces lie.
    #[serde(skip_serializing_if = "Option::is_none")]
    whole_traces: Option<Named<'a, WholeRecord>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    estimable: Option<Estimable<'a>>,
    /// The files of this report, so that the next one of the case can clear them.
    files: &'a [String],
}

/// Estimated discretisation errors: of temperatures in K; of gauges in the unit of their key.
#[derive(Serialize)]
struct Resolution {
    tolerance_k: f64,
    nominal_k: f64,
    corners_k: Option<f64>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    gauges: BTreeMap<&'static str, GaugeResolution>,
}

/// Of a front in m, at 95 % of the instants; of another gauge as a share of its peak.
#[derive(Serialize)]
struct GaugeResolution {
    error: f64,
    tolerance: f64,
}

impl Resolution {
    fn of(reached: &Reached) -> Self {
        let gauges = reached
            .gauges
            .iter()
            .map(|gauge| (gauge.gauge.name(), GaugeResolution { error: gauge.error, tolerance: gauge.tolerance }));
        Self {
            tolerance_k: reached.tolerance_k,
            nominal_k: reached.nominal_k,
            corners_k: reached.corners_k,
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
struct Members {
    asked: usize,
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

/// In the unit that ends the gauge's name.
#[derive(Serialize)]
struct ReadingRecord {
    /// Farthest from zero.
    peak: f64,
    peak_time_s: f64,
    end: f64,
}

/// Relative residuals; mass where gas moves.
#[derive(Serialize)]
struct Balance {
    energy: Option<f64>,
    mass: Option<f64>,
}

/// A second case fitted to the same observations: root mean squares of the first and of it, K.
#[derive(Serialize)]
struct BesideRecord<'a> {
    case: &'a str,
    cooling_s: f64,
    factors: Named<'a, f64>,
    sensors: Named<'a, LeftRecord>,
}

#[derive(Serialize)]
struct LeftRecord {
    heating_k: [f64; 2],
    cooling_k: [f64; 2],
    explained: f64,
}

#[derive(Serialize)]
struct Estimable<'a> {
    factors: Vec<&'a str>,
    /// Of those that matter they are the ones that the data tell apart.
    matter: Vec<&'a str>,
    /// Of the variance of the data.
    shares: Named<'a, f64>,
    /// Why each of the others was left out, in the order they went.
    left_out: Vec<String>,
    /// How the set that the case states differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    stated: Option<String>,
    standard_errors: &'a [f64],
    condition_number: f64,
    rank: usize,
    weakest: &'a str,
    all: Together<'a>,
}

/// What the data say of all factors at once.
#[derive(Serialize)]
struct Together<'a> {
    condition_number: f64,
    rank: usize,
    weakest: &'a str,
}

/// Values by name, in the order of the case and not of the alphabet.
struct Named<'a, T>(Vec<(&'a str, T)>);

impl<T: Serialize> Serialize for Named<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in &self.0 {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

fn beside<'a>(case: &'a Case, outcome: &'a Beside) -> BesideRecord<'a> {
    let estimates = outcome.factors.iter().map(String::as_str).zip(outcome.estimated.values.iter().copied());
    let left = outcome.left.iter().map(|left| {
        let Left { heating_k, cooling_k, .. } = *left;
        let record = LeftRecord { heating_k, cooling_k, explained: left.explained() };
        (case.sensors[left.sensor].name.as_str(), record)
    });
    BesideRecord {
        case: &outcome.id,
        cooling_s: outcome.cooling_s,
        factors: Named(estimates.collect()),
        sensors: Named(left.collect()),
    }
}

/// The text of `summary.json`; `report_s` is what the report took, `files` what it wrote.
///
/// # Errors
/// When JSON cannot be written.
pub fn summary(story: &Story, report_s: f64, files: &[String]) -> Result<String, ReportError> {
    let march = story.nominal_march();
    let readings = march.filter(|outcome| !outcome.readings.is_empty());
    let record = Record {
        command: story.command,
        case: story.id(),
        version: story.version,
        seed: story.seed,
        backend: Backend {
            name: &story.backend.name,
            kind: story.backend.kind,
            precision: precision_words(story.backend.precision),
        },
        members: members(story),
        steps: march.map(|outcome| outcome.steps),
        cells: march.map(|outcome| outcome.cells),
        resolution: march.and_then(|outcome| outcome.reached.as_ref()).map(Resolution::of),
        seconds: Seconds {
            plan: story.seconds.plan_s,
            march: story.seconds.march_s,
            reduce: story.seconds.reduce_s,
            report: report_s,
            total: story.seconds.began.elapsed().as_secs_f64(),
        },
        sensors: sensors(story),
        observed: observed::observed(story),
        gauges: readings.map(|outcome| gauges(&outcome.readings)),
        balance: Balance {
            energy: march.map(|outcome| outcome.balance.residual()),
            mass: readings.map(|outcome| outcome.balance.mass_residual()),
        },
        estimated: story.estimated.map(|outcome| EstimatedRecord::of(story, outcome)),
        posterior: story.posterior.map(|outcome| PosteriorRecord::of(story, outcome)),
        beside: story.beside.map(|outcome| beside(story.case, outcome)),
        sizing: story.sizing.map(|outcome| SizingRecord::of(story.case, outcome)),
        history: story.history.map(|outcome| HistoryRecord::of(story.case, outcome)),
        twins: story.recovery.map(RecoveryRecord::of),
        shares: story.uncertainty.map(|_| shares(story)),
        causes: story.uncertainty.map(|outcome| causes::causes(story.case, outcome)),
        whole_traces: story.uncertainty.map(|outcome| whole::whole(story.case, outcome)),
        estimable: story.sensitivity.map(|outcome| estimable(story.case, outcome)),
        files,
    };
    Ok(serde_json::to_string_pretty(&record)? + "\n")
}

fn members(story: &Story) -> Members {
    match (story.uncertainty, story.nominal_march()) {
        (Some(outcome), _) => {
            Members { asked: outcome.asked, ok: outcome.ok, failed: outcome.asked.saturating_sub(outcome.ok) }
        }
        (None, Some(nominal)) => {
            let ok = usize::from(nominal.arrival == Arrival::Done);
            Members { asked: 1, ok, failed: 1 - ok }
        }
        (None, None) => Members { asked: 0, ok: 0, failed: 0 },
    }
}

/// Peaks of the nominal march, whichever study made it.
fn sensors<'a>(story: &Story<'a>) -> Named<'a, PeakRecord> {
    let march = story.nominal_march().map(|outcome| outcome.peaks.clone());
    let drawn = || story.uncertainty.map(|outcome| outcome.peaks.iter().map(|peak| peak.nominal).collect());
    let peaks = march.or_else(drawn).unwrap_or_default();
    let record =
        |peak: crate::study::nominal::Peak| PeakRecord { peak_k: peak.temperature_k, peak_time_s: peak.time_s };
    let named = story.case.sensors.iter().zip(peaks);
    Named(named.map(|(sensor, peak)| (sensor.name.as_str(), record(peak))).collect())
}

fn gauges(readings: &[Reading]) -> Named<'static, ReadingRecord> {
    let record = |of: &Reading| ReadingRecord { peak: of.peak, peak_time_s: of.peak_time_s, end: of.end };
    Named(readings.iter().map(|reading| (reading.gauge.name(), record(reading))).collect())
}

fn shares<'a>(story: &Story<'a>) -> Named<'a, Named<'a, f64>> {
    let of = |sensor: usize| {
        let ranked = story.uncertainty.and_then(|outcome| findings::ranked(story.case, outcome, sensor));
        let named = ranked.into_iter().flatten();
        Named(named.map(|(factor, share)| (story.case.factors[factor].name.as_str(), share)).collect())
    };
    Named(story.case.sensors.iter().enumerate().map(|(index, sensor)| (sensor.name.as_str(), of(index))).collect())
}

fn estimable<'a>(case: &'a Case, outcome: &'a Sensitivity) -> Estimable<'a> {
    let (proposed, all) = (&outcome.proposed, &outcome.all);
    let name = |&factor: &usize| case.factors[factor].name.as_str();
    Estimable {
        factors: proposed.factors.iter().map(name).collect(),
        matter: outcome.matter().iter().map(name).collect(),
        shares: Named(all.factors.iter().map(|factor| (name(factor), outcome.shares[*factor])).collect()),
        left_out: outcome.reduction.iter().map(|dropped| reduction::left_out(case, dropped)).collect(),
        stated: reduction::stated(case, outcome),
        standard_errors: &proposed.standard_errors,
        condition_number: proposed.condition_number,
        rank: proposed.rank,
        weakest: &proposed.weakest,
        all: Together { condition_number: all.condition_number, rank: all.rank, weakest: &all.weakest },
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::fixture;
    use super::*;
    use serde_json::Value;

    #[test]
    fn the_summary_of_an_estimate_holds_every_promised_key() {
        let outcomes = fixture::outcomes();
        let text = summary(&outcomes.story("estimate"), 0.4, &[]).expect("it serialises");
        let read: Value = serde_json::from_str(&text).expect("it is JSON");
        for key in ["command", "case", "version", "steps", "cells", "iterations", "marches", "termination"] {
            assert!(!read[key].is_null(), "no {key}");
        }
        assert_eq!(read["factors"]["f_k_INS"]["value"], 0.97);
        let determined = &read["determined"][0];
        assert_eq!((&determined["combination"], &determined["factors"][1]), (&"ratio".into(), &"f_cp_INS".into()));
        assert!(determined["value"].as_f64().is_some_and(|value| (value - 0.951).abs() < 1e-3));
        assert_eq!(determined["relative_standard_error"], 0.003);
        let drawn = &read["posterior"];
        assert_eq!((&drawn["settled"], &drawn["factors"]["f_cp_INS"]["median"]), (&true.into(), &1.018.into()));
        assert_eq!((&drawn["correlation"][0][1], &drawn["discrepancy"]["amplitude_k"]), (&0.98.into(), &4.2.into()));
        assert_eq!(drawn["predicted"][outcomes.case.id.as_str()]["TC4"]["discrepancy"]["held"], 0.96);
        assert_eq!(read["members"]["failed"], 0);
        assert_eq!(read["backend"]["precision"], "f64");
        assert!(read["sensors"]["TC4"]["peak_k"].as_f64().is_some_and(|peak| peak > 300.0));
        assert!(read["balance"]["mass"].is_null() && read["seconds"]["total"].is_number());
        assert!(text.find("\"command\"") < text.find("\"case\"") && text.find("\"TC1\"") < text.find("\"TC4\""));
    }

    #[test]
    fn an_undetermined_factor_is_null_and_not_a_number_that_json_lacks() {
        let mut outcomes = fixture::outcomes();
        outcomes.estimated.standard_errors[1] = f64::INFINITY;
        let text = summary(&outcomes.story("estimate"), 0.4, &[]).expect("it serialises");
        let read: Value = serde_json::from_str(&text).expect("it is JSON");
        assert!(read["factors"]["f_cp_INS"]["standard_error"].is_null());
        assert!(read["factors"]["f_k_INS"]["standard_error"].is_number());
    }

    #[test]
    fn where_gas_moves_the_summary_says_how_much_when_and_whether_mass_is_kept_and_elsewhere_nothing() {
        let read = |outcomes: &fixture::Outcomes, command: &str| -> Value {
            let text = summary(&outcomes.story(command), 0.4, &[]).expect("it serialises");
            serde_json::from_str(&text).expect("it is JSON")
        };
        let still = read(&fixture::outcomes(), "predict");
        assert!(still.get("gauges").is_none() && still["balance"]["mass"].is_null());
        for command in ["predict", "study", "estimate"] {
            let charring = read(&fixture::outcomes().charring(), command);
            let flux = &charring["gauges"]["gas_flux_kg_m2_s"];
            assert_eq!((&flux["peak"], &flux["peak_time_s"]), (&0.009.into(), &40.0.into()), "{command}");
            assert!(flux["end"].as_f64().is_some_and(|end| end < 1e-6), "{command}");
            let ends = |gauge: &str| charring["gauges"][gauge]["end"].as_f64().expect("an end");
            assert!((ends("mass_lost_kg_m2") - 0.36).abs() < 1e-6 && (ends("char_front_m") - 2.5e-3).abs() < 1e-6);
            for gauge in ["virgin_front_m", "peak_pressure_pa", "back_pressure_pa"] {
                assert!(ends(gauge) > 0.0, "{command}: {gauge}");
            }
            assert!(charring["balance"]["mass"].as_f64().is_some_and(|off| off.abs() < 1e-12), "{command}");
        }
    }

    #[test]
    fn the_shares_of_a_sensor_at_its_peak_add_up_to_one() {
        let outcomes = fixture::outcomes();
        let text = summary(&outcomes.story("uncertainty"), 0.4, &[]).expect("it serialises");
        let read: Value = serde_json::from_str(&text).expect("it is JSON");
        let shares = read["shares"]["TC4"].as_object().expect("shares of TC4");
        let total: f64 = shares.values().filter_map(Value::as_f64).sum();
        assert!((total - 1.0).abs() < 1e-9, "{total}");
    }
}
