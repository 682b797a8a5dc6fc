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

/// How steps follow one another, before they are cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Pace {
    /// The first step after each corner of a schedule, s.
    pub first_step_s: f64,
    /// A step is at most this share of the time since the last corner.
    pub growth: f64,
    /// No step is longer, s.
    pub largest_step_s: f64,
    /// From some times on, s and rising, steps are so many times shorter than all that says.
    pub haste: Vec<(f64, f64)>,
}

impl Pace {
    /// So many times as long steps as a case states.
    pub fn slowed(resolution: &Resolution, times: f64) -> Self {
        Self {
            first_step_s: resolution.first_step_s * times,
            growth: resolution.growth * times,
            largest_step_s: resolution.largest_step_s * times,
            haste: Vec::new(),
        }
    }

    fn step_s(&self, time_s: f64, corner_s: f64) -> f64 {
        let step_s = (self.growth * (time_s - corner_s)).clamp(self.first_step_s, self.largest_step_s);
        let haste = self.haste.iter().rfind(|(from_s, _)| *from_s <= time_s);
        step_s / haste.map_or(1.0, |(_, times)| *times)
    }
}

impl Clock {
    /// The steps of a pace, each cut into so many.
    pub fn new(case: &Case, pace: &Pace, cuts: usize) -> Self {
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
            fill(&mut times_s, leg[0], leg[1], corner_s, pace, cuts);
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

/// Append the steps from one landing to the next: as long as the pace has them, all stretched alike so that the last one lands,
/// and each cut into so many.
fn fill(times_s: &mut Vec<f64>, start_s: f64, end_s: f64, corner_s: f64, pace: &Pace, cuts: usize) {
    let begin = times_s.len();
    let mut time_s = start_s;
    while time_s < end_s {
        let step_s = pace.step_s(time_s, corner_s);
        times_s.extend((1..=cuts).map(|cut| time_s + step_s * cut as f64 / cuts as f64));
        time_s += step_s;
    }
    let stretch = (end_s - start_s) / (time_s - start_s);
    for time_s in &mut times_s[begin..] {
        *time_s = start_s + stretch * (*time_s - start_s);
    }
    if let Some(last) = times_s.last_mut() {
        *last = end_s;
    }
}
