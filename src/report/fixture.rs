//! Artificial results of every study, for the tests of the report.

use crate::case::OpenFace;
use crate::case::*;
use crate::case::{Provenance, SourceKind};
use crate::fit::proportion::Proportion;
use crate::fit::{DropReason, Dropped};
use crate::march::{Backend, Precision};
use crate::statistics::{ConfidenceInterval, PairIndex, SensitivityIndices};
use crate::study::answers::Answers;
use crate::study::depth_profiles::{DepthProfiles, ProfileBands, ProfileDepth};
use crate::study::estimate::ParameterEstimates;
use crate::study::nominal::{ErrorEstimate, Misfit, Peak, Prediction};
use crate::study::posterior::Posterior;
use crate::study::run_record::RunRecord;
use crate::study::sensitivity::{Identifiability, Sensitivity};
use crate::study::simultaneous_band::SimultaneousBand;
use crate::study::timing::Timing;
use crate::study::uncertainty::{Failure, MembersError, PeakSpread, Spread, SweepError, Uncertainty};
use crate::traces::{Balance, MemberStatus};
use std::sync::Arc;
use std::time::Instant;

mod charring;
mod estimated;
mod posterior;

use estimated::estimated;
use posterior::posterior;

/// A case with a result of every study.
pub(super) struct StudyFixture {
    pub case: Case,
    pub backend: Backend,
    pub nominal: Prediction,
    pub uncertainty: Uncertainty,
    pub sensitivity: Sensitivity,
    pub estimated: ParameterEstimates,
    pub posterior: Posterior,
}

impl StudyFixture {
    pub(super) fn answers(&self, question: &'static str) -> Answers {
        let is = |questions: &[&str]| question == "study" || questions.contains(&question);
        let seconds = Timing { plan_s: 0.002, march_s: 3.4, other_s: 0.21, start: Instant::now() };
        let command_line = ["bondline", question, "lcat-2259", "--set", "pressure=3 kPa"].map(str::to_owned).to_vec();
        let run = RunRecord::new(Some(command_line), &self.backend, 2);
        let mut answers = Answers::new(question, self.case.clone(), self.backend.clone(), seconds, run);
        answers.seed = is(&["uncertainty"]).then_some(1);
        answers.nominal = is(&["predict", "uncertainty", "sensitivity"]).then(|| self.nominal.clone());
        answers.uncertainty = is(&["uncertainty"]).then(|| self.uncertainty.clone());
        answers.depth_profiles = is(&[]).then(|| depth_profiles(&self.case));
        answers.sensitivity = is(&["sensitivity"]).then(|| self.sensitivity.clone());
        answers.estimated = is(&["estimate"]).then(|| self.estimated.clone());
        answers.posterior = is(&["estimate"]).then(|| self.posterior.clone());
        answers
    }
}

const INSTANTS: usize = 401;
/// Temperature rise, K, delay and time constant, s, of each sensor.
const SENSORS: [(f64, f64, f64); 4] = [(1250.0, 0.5, 6.0), (1050.0, 1.5, 9.0), (640.0, 6.0, 18.0), (330.0, 14.0, 34.0)];

fn instants() -> Vec<f64> {
    (0..INSTANTS).map(|n| 0.5 * n as f64).collect()
}

/// First-order response to 41 s of heating, with a delay.
fn rise(sensor: usize, time_s: f64, strength: f64) -> f64 {
    let (height, delay, constant) = SENSORS[sensor];
    let (on, off) = ((time_s - delay).max(0.0), (time_s - 41.0 - delay).max(0.0));
    let heat = (1.0 - (-on / constant).exp()) - (1.0 - (-off / (1.6 * constant)).exp());
    300.0 + strength * height * heat
}

/// A deterministic pseudo-random number in -1..1.
fn pseudo_random(n: usize) -> f64 {
    let value = (n as f64 * 12.9898).sin() * 43_758.545;
    2.0 * (value - value.floor()) - 1.0
}

fn peak(trace: &[f64]) -> Peak {
    let at = (0..trace.len()).max_by(|&a, &b| trace[a].total_cmp(&trace[b])).expect("a trace has instants");
    Peak { temperature_k: trace[at], time_s: 0.5 * at as f64 }
}

fn nominal(strength: f64) -> Prediction {
    let temperatures_k: Vec<Vec<f64>> =
        (0..4).map(|sensor| instants().iter().map(|&t| rise(sensor, t, strength)).collect()).collect();
    Prediction {
        instants_s: instants(),
        peaks: temperatures_k.iter().map(|trace| peak(trace)).collect(),
        temperatures_k,
        limited_k: Vec::new(),
        margins: Vec::new(),
        gauge_traces: Vec::new(),
        status: MemberStatus::Completed,
        balance: Balance {
            hot_in_j_m2: 9.1e6,
            hot_out_j_m2: 6.0e6,
            back_in_j_m2: 0.0,
            back_out_j_m2: 0.6e6,
            stored_j_m2: 2.5e6,
            ..Balance::default()
        },
        extremes_k: vec![(300.0, 1690.0), (300.0, 1550.0), (300.0, 1320.0), (300.0, 900.0), (300.0, 630.0)],
        misfits: (0..4).map(|n| misfit(f64::from(n) * 6.0 + 8.0)).collect(),
        steps: 912,
        cells: 64,
        error_estimate: Some(ErrorEstimate {
            corners_k: Some(0.044),
            corners: 16,
            ..ErrorEstimate::of_temperature(0.031, 0.05)
        }),
    }
}

fn misfit(rms_k: f64) -> Misfit {
    Misfit { rms_k, bias_k: 0.8 * rms_k, worst_k: 2.1 * rms_k, worst_time_s: 52.5, samples: 160 }
}

fn material(id: &str, name: &str, note: &str, hottest_k: f64) -> Arc<Material> {
    let provenance = |mark, source: &str| Provenance {
        source_kind: mark,
        source: source.to_owned(),
        relative_uncertainty: Some(0.1),
    };
    let table = |a: f64, b: f64| Table {
        temperatures_k: vec![300.0, hottest_k],
        values: vec![a, b],
        outside: OutOfRange::Extrapolate,
    };
    Arc::new(Material {
        id: id.to_owned(),
        name: name.to_owned(),
        note: note.to_owned(),
        density_kg_m3: 180.0,
        density_provenance: provenance(SourceKind::ReadInSource, "maker's data sheet"),
        heat_capacity: table(900.0, 1250.0),
        heat_capacity_provenance: provenance(SourceKind::Estimated, "silica, by mass fraction"),
        conductivity: Conductivity::Tables(vec![(8010.0, table(0.02, 0.11))]),
        conductivity_provenance: provenance(SourceKind::Remembered, "a paper on aerogel blankets"),
        emissivity: table(0.9, 0.7),
        emissivity_provenance: provenance(SourceKind::Paper, "stated in the paper"),
        pores: Pores::IMPERMEABLE,
        pores_provenance: None,
        decomposition: None,
    })
}

fn case() -> Case {
    let fabric = material("nextel440-bf20", "Nextel 440 BF-20", "Ceramic cloth.", 1800.0);
    let felt = material("pyrogel3350", "Pyrogel 3350", "A surrogate: the tables are not public.", 1200.0);
    let barrier = material("akk", "Aluminised Kapton on Kevlar", "A surrogate.", 700.0);
    let ply = |name: &str, group: &str, material: &Arc<Material>, thickness_m| Ply {
        name: name.to_owned(),
        group: group.to_owned(),
        material: Arc::clone(material),
        thickness_m,
    };
    let plies = vec![
        ply("OF1", "OF", &fabric, 0.51e-3),
        ply("OF2", "OF", &fabric, 0.51e-3),
        ply("INS1", "INS", &felt, 3.0e-3),
        ply("INS2", "INS", &felt, 3.0e-3),
        ply("GB", "GB", &barrier, 0.28e-3),
    ];
    let layup = Layup { plies, contacts_w_m2_k: vec![Some(500.0), Some(500.0), None, Some(500.0)], origin_m: 0.0 };
    let sensors = layup.faces_m()[..4]
        .iter()
        .enumerate()
        .map(|(n, &depth_m)| Sensor {
            name: format!("TC{}", n + 1),
            depth_m,
            side: Side::Both,
            time_constant_s: 0.0,
            pyrometer: None,
        })
        .collect();
    let factor = |name: &str, group: &str, property, small: f64| Factor {
        name: name.to_owned(),
        group: group.to_owned(),
        property,
        state: None,
        nominal: 1.0,
        small: (1.0 - small, 1.0 + small),
        large: (1.0 - 2.0 * small, 1.0 + 2.0 * small),
    };
    let observations = (0..4).map(|sensor| {
        let times_s: Vec<f64> = instants().into_iter().step_by(2).collect();
        Observation {
            sensor,
            temperatures_k: times_s
                .iter()
                .enumerate()
                .map(|(n, &t)| rise(sensor, t, 0.92) + 2.0 * pseudo_random(n + 997 * sensor) + 0.05 * t)
                .collect(),
            sigma_k: vec![2.0; times_s.len()],
            window_s: None,
            times_s,
        }
    });
    Case {
        id: "lcat-2259".to_owned(),
        name: "LCAT 2259, layup 1".to_owned(),
        note: "Observations are synthetic: the thermocouple traces of run 2259 are not public. Heat flux and pressure \
               are those of the paper."
            .to_owned(),
        layup,
        sensors,
        limits: Vec::new(),
        gas: None,
        exposure: Exposure {
            duration_s: 200.0,
            initial_k: vec![(0.0, 300.0)],
            pressure_pa: Schedule::constant(8010.0),
            back_pressure_pa: None,
            holder: None,
            hot_face: Face::Open(OpenFace {
                flux_w_m2: Schedule { times_s: vec![0.0, 0.5, 41.0, 41.0], values: vec![0.0, 2.67e5, 2.67e5, 0.0] },
                recovery_enthalpy_j_kg: Some(Schedule::constant(12e6)),
                emissivity: Emissivity::Material,
                ..OpenFace::insulated()
            }),
            back_face: Face::Open(OpenFace { film_w_m2_k: Schedule::constant(15.0), ..OpenFace::insulated() }),
        },
        correlation: Default::default(),
        factors: vec![
            factor("f_eps_OF", "OF", Property::Emissivity, 0.05),
            factor("f_k_OF", "OF", Property::Conductivity, 0.25),
            factor("f_cp_OF", "OF", Property::HeatCapacity, 0.1),
            factor("f_k_INS", "INS", Property::Conductivity, 0.25),
            factor("f_cp_INS", "INS", Property::HeatCapacity, 0.1),
            factor("f_rho_INS", "INS", Property::Density, 0.1),
            factor("f_cp_GB", "GB", Property::HeatCapacity, 0.1),
        ],
        observations: observations.collect(),
        estimate: EstimationSettings {
            factors: vec![3, 4],
            sensors: vec![3],
            window_s: Some((0.0, 80.0)),
            start: vec![1.1, 0.9],
            bounds: Bounds::Small,
            ..EstimationSettings::default()
        },
        reading_notes: Default::default(),
        resolution: Resolution {
            tolerance_k: None,
            cells: 64,
            first_step_s: 0.01,
            step_growth: 0.05,
            max_step_s: 0.5,
            output_interval_s: 0.5,
        },
        input_files: Default::default(),
    }
}

/// Sensitivity, K per unit of a factor: a weight per factor and sensor times the temperature rise.
fn sensitivity_k(factor: usize, sensor: usize, time_s: f64) -> f64 {
    const WEIGHTS: [[f64; 4]; 7] = [
        [-0.25, -0.22, -0.15, -0.10],
        [0.02, 0.08, 0.12, 0.10],
        [-0.06, -0.06, -0.04, -0.03],
        [-0.05, -0.05, 0.15, 0.32],
        [-0.01, -0.02, -0.12, -0.22],
        [-0.01, -0.02, -0.12, -0.22],
        [0.0, 0.0, -0.02, -0.08],
    ];
    let late = 1.0 + 0.4 * ((time_s - 60.0 - 8.0 * factor as f64) / 40.0).tanh();
    WEIGHTS[factor][sensor] * (rise(sensor, time_s, 1.0) - 300.0) * late
}

fn uncertainty(case: &Case, nominal: &Prediction) -> Uncertainty {
    let deviations: Vec<f64> = case.factors.iter().map(|f| (f.small.1 - f.small.0) / 4.0).collect();
    let spread = |sensor: usize| {
        let trace = &nominal.temperatures_k[sensor];
        let effects: Vec<Vec<f64>> = (0..deviations.len())
            .map(|f| instants().iter().map(|&t| deviations[f] * sensitivity_k(f, sensor, t)).collect())
            .collect();
        let deviation_k: Vec<f64> =
            (0..INSTANTS).map(|n| effects.iter().map(|effect| effect[n] * effect[n]).sum::<f64>().sqrt()).collect();
        let at = |z: f64| -> Vec<f64> { trace.iter().zip(&deviation_k).map(|(t, d)| t + z * d).collect() };
        let correlations: Vec<Vec<f64>> = effects
            .iter()
            .map(|effect| effect.iter().zip(&deviation_k).map(|(e, d)| if *d > 0.0 { e / d } else { 0.0 }).collect())
            .collect();
        Spread {
            mean_k: trace.clone(),
            low_k: at(-3.5),
            high_k: at(3.5),
            percentiles_k: [at(-1.96), at(-0.674), at(0.0), at(0.674), at(1.96)],
            indices: (0..INSTANTS)
                .map(|n| causes(&correlations.iter().map(|row| row[n]).collect::<Vec<f64>>()))
                .collect(),
            members_k: vec![at(-1.2), at(0.3)],
            simultaneous: SimultaneousBand {
                low_k: at(-2.7),
                high_k: at(2.7),
                envelope_ratio: 1.0,
                in_pointwise: Proportion { count: 405, total: 500 },
                in_simultaneous: Proportion { count: 476, total: 500 },
            },
            deviation_k,
        }
    };
    let spreads: Vec<Spread> = (0..4).map(spread).collect();
    let peaks = (0..4).map(|sensor| {
        let (nominal, at) = (nominal.peaks[sensor], (2.0 * nominal.peaks[sensor].time_s) as usize);
        let around = |value: f64, d: f64| [-1.96, -0.674, 0.0, 0.674, 1.96].map(|z| value + z * d);
        PeakSpread {
            nominal,
            mean_k: nominal.temperature_k + 1.0,
            deviation_k: spreads[sensor].deviation_k[at],
            percentiles_k: around(nominal.temperature_k, spreads[sensor].deviation_k[at]),
            percentiles_s: around(nominal.time_s, 1.5),
            temperature_indices: spreads[sensor].indices[at].clone(),
            time_indices: spreads[sensor].indices[at].clone(),
        }
    });
    Uncertainty {
        is_independent: true,
        bounds: Bounds::Small,
        seed: 1,
        sampling: "normal",
        has_independent_members: true,
        requested: 5000,
        members: 5000,
        completed: 4997,
        failures: vec![Failure {
            reason: "a temperature left the range of a table".to_owned(),
            members: 3,
            first: 1204,
        }],
        instants_s: instants(),
        peaks: peaks.collect(),
        margins: None,
        discretisation_error: Some(SweepError {
            extreme: MembersError { members: 50, failed: 1, temperature_k: Some(0.061) },
            others: MembersError { members: 16, failed: 0, temperature_k: Some(0.035) },
        }),
        spreads,
    }
}

/// Indices of nearly additive factors: a thousandth of the variance is unexplained.
fn causes(correlations: &[f64]) -> SensitivityIndices {
    let likely = |value: f64| ConfidenceInterval { value, low: value - 0.01, high: value + 0.01 };
    let each =
        |of: fn(f64) -> f64| -> Vec<ConfidenceInterval> { correlations.iter().map(|&r| likely(of(r))).collect() };
    SensitivityIndices {
        correlations: each(|r| r),
        rank_correlations: each(|r| 0.98 * r),
        partial_rank_correlations: each(|r| 0.99 * r.signum() * r.abs().sqrt()),
        shares: correlations.iter().map(|r| r * r).collect(),
        first: each(|r| 0.999 * r * r),
        total: each(|r| 1.001 * r * r),
        second: vec![
            PairIndex { factors: (0, 1), index: likely(0.0001) },
            PairIndex { factors: (3, 4), index: likely(0.0007) },
        ],
        unexplained: 0.001,
    }
}

/// Five profiles that fall exponentially with depth.
fn depth_profiles(case: &Case) -> DepthProfiles {
    let (faces_m, back_m) = (case.layup.faces_m(), case.layup.back_m());
    let tops_m = std::iter::once(case.layup.origin_m).chain(faces_m.iter().copied());
    let of_ply = |(ply, (top_m, bottom_m)): (usize, (f64, f64))| {
        (0..=4).map(move |n| ProfileDepth { depth_m: top_m + (bottom_m - top_m) * f64::from(n) / 4.0, ply })
    };
    let depths: Vec<ProfileDepth> = tops_m.zip(faces_m.iter().copied()).enumerate().flat_map(of_ply).collect();
    let at = |time_s: f64, factor: f64| -> Vec<f64> {
        let heat = factor * 1200.0 * (time_s / 40.0) * (1.0 - time_s / 40.0).exp();
        depths.iter().map(|depth| 300.0 + heat * (-4.0 * depth.depth_m / back_m).exp()).collect()
    };
    let instants_s = vec![0.0, 20.0, 40.0, 80.0, 160.0];
    let profiles = |factor| instants_s.iter().map(|&time_s| at(time_s, factor)).collect();
    DepthProfiles {
        nominal_k: profiles(1.0),
        nominal_maximum_k: at(40.0, 1.0),
        bands: Some(ProfileBands {
            members: 1000,
            percentiles_k: [0.9, 1.0, 1.1].map(profiles),
            maximum_percentiles_k: [0.9, 1.0, 1.1].map(|factor| at(40.0, factor)),
        }),
        cell_states: None,
        instants_s,
        depths,
    }
}

fn identifiability(factors: Vec<usize>, correlation: Vec<Vec<f64>>, condition_number: f64) -> Identifiability {
    let n = factors.len();
    Identifiability {
        factors,
        magnitude_k: (0..n).map(|i| 31.0 / (1.0 + i as f64)).collect(),
        standard_errors: (0..n)
            .map(|i| if n > 5 && i == 5 { f64::INFINITY } else { 0.004 * (1.0 + i as f64) })
            .collect(),
        alignment: correlation.clone(),
        correlation,
        condition_number,
        rank: n.min(6),
        weakest_direction: "the product f_cp_INS · f_rho_INS alone acts".to_owned(),
    }
}

fn sensitivity() -> Sensitivity {
    let wide = (0..7).map(|i| {
        (0..7)
            .map(|j| match (i, j) {
                _ if i == j => 1.0,
                (4, 5) | (5, 4) => 1.0,
                _ => 0.93 * pseudo_random(i.min(j) * 7 + i.max(j)),
            })
            .collect()
    });
    Sensitivity {
        step: Some(0.01),
        instants_s: instants(),
        derivatives_k: (0..7)
            .map(|f| (0..4).map(|s| instants().iter().map(|&t| sensitivity_k(f, s, t)).collect()).collect())
            .collect(),
        all: identifiability((0..7).collect(), wide.collect(), 2160.0),
        recommended: identifiability(vec![0, 3], vec![vec![1.0, -0.41], vec![-0.41, 1.0]], 3.2),
        shares: vec![0.21, 0.13, 0.002, 0.37, 0.16, 0.12, 0.008],
        reduction: vec![
            Dropped { variable: 2, reason: DropReason::SmallEffect { share: 0.002 } },
            Dropped { variable: 6, reason: DropReason::SmallEffect { share: 0.008 } },
            Dropped { variable: 5, reason: DropReason::Correlation { with: 4, correlation: -1.0 } },
            Dropped { variable: 4, reason: DropReason::Condition { with: 3, condition_number: 71.0 } },
            Dropped { variable: 1, reason: DropReason::Correlation { with: 3, correlation: -0.97 } },
        ],
        stated: Some(identifiability(vec![3, 4], vec![vec![1.0, 0.993], vec![0.993, 1.0]], 20.1)),
        marches: 1,
    }
}

pub(super) fn outcomes() -> StudyFixture {
    let (case, nominal) = (case(), nominal(1.0));
    StudyFixture {
        uncertainty: uncertainty(&case, &nominal),
        sensitivity: sensitivity(),
        estimated: estimated(&case, nominal.clone()),
        posterior: posterior(),
        backend: Backend {
            name: "AMD EPYC, 2 threads".to_owned(),
            kind: "cpu",
            driver: None,
            precision: Precision::F64,
        },
        nominal,
        case,
    }
}
