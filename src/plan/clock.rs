//! Steps and sampling instants through time.
//!
//! A step ends on every corner of every schedule and on every instant, so nothing is ever interpolated
//! between steps and no kink falls inside one. Every member of an ensemble shares the clock, which keeps
//! differences between members free of the noise of choosing steps.

use crate::case::{Case, Face, Resolution};

/// Steps through time.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// End of each step, s, after a first entry of zero.
    pub times_s: Vec<f64>,
    /// Times at which the sensors are read, s; the first is zero.
    pub instants_s: Vec<f64>,
}

impl Clock {
    pub fn new(case: &Case) -> Self {
        let duration_s = case.exposure.duration_s;
        let corners_s = corners(case);
        let mut instants_s: Vec<f64> =
            (0..).map(|i| f64::from(i) * case.resolution.every_s).take_while(|&t| t < duration_s).collect();
        instants_s.extend(case.observations.iter().flat_map(|seen| seen.times_s.iter().copied()));
        instants_s.push(duration_s);
        let instants_s = settle(instants_s, duration_s);

        let mut landings_s = instants_s.clone();
        landings_s.extend(&corners_s);
        let landings_s = settle(landings_s, duration_s);

        let mut times_s = vec![0.0];
        let mut corner_s = 0.0;
        for leg in landings_s.windows(2) {
            if let Some(&last) = corners_s.iter().rfind(|&&corner| corner <= leg[0]) {
                corner_s = last;
            }
            fill(&mut times_s, leg[0], leg[1], corner_s, &case.resolution);
        }
        Self { times_s, instants_s }
    }
}

/// Times in order, within the march, once each. Two closer than a billionth of the march are one.
fn settle(mut times_s: Vec<f64>, duration_s: f64) -> Vec<f64> {
    times_s.retain(|&t| (0.0..=duration_s).contains(&t));
    times_s.sort_by(f64::total_cmp);
    times_s.dedup_by(|later, earlier| *later - *earlier <= 1e-9 * duration_s);
    times_s
}

/// Where the exposure has a kink or a jump.
fn corners(case: &Case) -> Vec<f64> {
    let mut corners_s = vec![0.0];
    corners_s.extend(&case.exposure.pressure_pa.times_s);
    corners_s.extend(case.exposure.back_pressure_pa.iter().flat_map(|pressure_pa| &pressure_pa.times_s));
    corners_s.extend(case.exposure.holder.iter().flat_map(|holder| &holder.temperature_k.times_s));
    for face in [&case.exposure.hot_face, &case.exposure.back_face] {
        match face {
            Face::Held(temperature_k) => corners_s.extend(&temperature_k.times_s),
            Face::Open(open) => {
                for schedule in [&open.flux_w_m2, &open.radiant_w_m2, &open.gas_k, &open.surroundings_k] {
                    corners_s.extend(&schedule.times_s);
                }
            }
        }
    }
    settle(corners_s, case.exposure.duration_s)
}

/// Append the steps from one landing to the next: each at most `growth` of the time since the corner,
/// between the first step and the largest, and all stretched alike so that the last one lands.
fn fill(times_s: &mut Vec<f64>, start_s: f64, end_s: f64, corner_s: f64, resolution: &Resolution) {
    let begin = times_s.len();
    let mut time_s = start_s;
    while time_s < end_s {
        let since_s = time_s - corner_s;
        time_s += (resolution.growth * since_s).clamp(resolution.first_step_s, resolution.largest_step_s);
        times_s.push(time_s);
    }
    let stretch = (end_s - start_s) / (time_s - start_s);
    for time_s in &mut times_s[begin..] {
        *time_s = start_s + stretch * (*time_s - start_s);
    }
    if let Some(last) = times_s.last_mut() {
        *last = end_s;
    }
}
