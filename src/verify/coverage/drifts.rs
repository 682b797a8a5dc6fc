//! Coverage of the interval of a thermocouple's drift before the start of the exposure.

use super::{Counted, covered_row};
use crate::case::{Observation, RecordedChannel};
use crate::fit::proportion::Proportion;
use crate::study::observation_check::check_observations;
use crate::study::twin::Noise;
use crate::verify::problem::{Problem, ProblemSetup, constant_properties, held_face, insulated_face};
use crate::verify::{Group, VerificationRow};
use rayon::prelude::*;

const CHANNELS: usize = 400;
const ALLOWED: (f64, &str) = (3.3, "three standard errors of 400 channels");
/// Samples before the start, one a second: the fewest for a drift, and more.
const SAMPLES: [usize; 2] = [30, 60];
/// Correlation times of the noise, s.
const CORRELATIONS_S: [f64; 3] = [0.0, 2.0, 10.0];
const NOISE_K: f64 = 0.3;
const SLOPE_K_MIN: f64 = 0.2;

/// How many of the channels have an interval that contains their drift.
fn covered(samples: usize, correlation_s: f64) -> Proportion {
    let setting = ProblemSetup {
        plies: vec![(constant_properties(0.1, 1e5), 0.02)],
        start_k: 300.0,
        hot_face: held_face(400.0),
        back_face: insulated_face(),
        cells: 8,
        first_step_s: 0.1,
        step_growth: 0.1,
    };
    let mut case = Problem::new(Group::Coverage, "readings before the start", setting, Vec::new()).case;
    case.exposure.duration_s = 60.0;
    case.observations = vec![Observation {
        sensor: 0,
        times_s: vec![0.0, 1.0],
        temperatures_k: vec![300.0; 2],
        sigma_k: vec![1.0; 2],
        window_s: None,
    }];
    let times_s: Vec<f64> = (0..samples).map(|sample| sample as f64 - samples as f64).collect();
    let is_held = |channel: &usize| {
        let noise = Noise { correlation_s, seed: 1 }.sample(&times_s, *channel, 0);
        let readings = times_s.iter().zip(noise);
        let mut case = case.clone();
        case.reading_notes.recorded = vec![RecordedChannel {
            sensor: 0,
            heading: None,
            rows: samples + 2,
            missing: 0,
            span_s: (times_s[0], 1.0),
            last_s: 1.0,
            earlier_temperatures_k: readings
                .map(|(time_s, noise)| 300.0 + SLOPE_K_MIN / 60.0 * time_s + NOISE_K * noise)
                .collect(),
            earlier_times_s: times_s.clone(),
            later: 0,
        }];
        let drift = check_observations(&case).channels[0].drift;
        drift.is_some_and(|drift| (drift.slope_k_min - SLOPE_K_MIN).abs() <= drift.half_width_k_min)
    };
    Proportion { count: (0..CHANNELS).into_par_iter().filter(is_held).count(), total: CHANNELS }
}

pub(super) fn rows() -> Vec<VerificationRow> {
    let row = |(samples, correlation_s): (usize, f64)| {
        let noise = match correlation_s {
            0.0 => "white noise".to_owned(),
            _ => format!("noise that decorrelates over {correlation_s:.0} samples"),
        };
        let counted = Counted::intervals(covered(samples, correlation_s));
        covered_row("drift", samples, &noise, &counted, ALLOWED)
    };
    SAMPLES
        .into_iter()
        .flat_map(|samples| CORRELATIONS_S.map(|correlation_s| (samples, correlation_s)))
        .map(row)
        .collect()
}
