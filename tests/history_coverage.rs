//! Coverage of the bands of heating histories: how often the 95 % intervals hold the truth, over random histories.

use crate::support::{Uniform, modified, runs_all, schedule};
use bondline::adapt::adapt;
use bondline::case::{Case, Face, Observation, Schedule};
use bondline::march::Precision;
use bondline::march::cpu::Cpu;
use bondline::march::richardson::RichardsonMarch;
use bondline::question;
use bondline::study::flux_inversion::{FluxInversion, HeatingQuantity, invert_flux};
use bondline::study::nominal::nominal;
use bondline::study::twin::Noise;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// Heating between two ramps, as the cases state it.
const START_S: f64 = 0.5;
const END_S: f64 = 41.0;
const RETRACTED_S: f64 = 41.2;

/// A random heating over time, relative to that of the case; one of a plateau is one.
type History = Box<dyn Fn(f64) -> f64>;

fn normal(random: &mut Uniform) -> f64 {
    (-2.0 * random.between(f64::MIN_POSITIVE, 1.0).ln()).sqrt() * (TAU * random.next()).cos()
}

fn lump(time_s: f64, at_s: f64, width_s: f64) -> f64 {
    (-((time_s - at_s) / width_s).powi(2)).exp()
}

/// Smooth histories, steps, ramps and pulses, in turn.
fn laboratory(kind: usize, random: &mut Uniform) -> History {
    let level = random.between(0.5, 1.5);
    let levels = |random: &mut Uniform, count: usize| -> Vec<f64> {
        (0..count).map(|_| level * random.between(0.4, 1.3)).collect()
    };
    let times = |random: &mut Uniform, count: usize| -> Vec<f64> {
        let mut times_s: Vec<f64> = (0..count).map(|_| random.between(2.0, 39.0)).collect();
        times_s.sort_by(f64::total_cmp);
        times_s
    };
    let count = 1 + (4.0 * random.next()) as usize;
    match kind % 4 {
        // A stationary Gaussian process of a correlation length of 3 to 12 s.
        0 => {
            let (length_s, amplitude) = (random.between(3.0, 12.0), level * random.between(0.1, 0.4));
            let waves: Vec<(f64, f64)> =
                (0..40).map(|_| (normal(random) / length_s, random.between(0.0, TAU))).collect();
            Box::new(move |time_s| {
                let sum: f64 = waves.iter().map(|(rate, phase)| (rate * time_s + phase).cos()).sum();
                level + amplitude * (2.0 / waves.len() as f64).sqrt() * sum
            })
        }
        1 => {
            let (times_s, levels) = (times(random, count), levels(random, count + 1));
            Box::new(move |time_s| levels[times_s.partition_point(|&at_s| at_s <= time_s)])
        }
        2 => {
            let times_s = [vec![0.0], times(random, count), vec![RETRACTED_S]].concat();
            let ramps = schedule(&times_s, &levels(random, count + 2));
            Box::new(move |time_s| ramps.after(time_s.min(RETRACTED_S - 1e-9)))
        }
        _ => {
            let pulses: Vec<(f64, f64, f64, bool)> = (0..count)
                .map(|_| {
                    let sign = if random.next() < 0.33 { -0.5 } else { 1.0 };
                    let size = level * sign * random.between(0.2, 1.0);
                    (random.between(3.0, 38.0), random.between(1.5, 6.0), size, random.next() < 0.4)
                })
                .collect();
            Box::new(move |time_s| {
                let pulse = |&(at_s, width_s, size, is_square): &(f64, f64, f64, bool)| {
                    let square = f64::from(u8::from((time_s - at_s).abs() < width_s));
                    size * if is_square { square } else { lump(time_s, at_s, width_s) }
                };
                level + pulses.iter().map(pulse).sum::<f64>()
            })
        }
    }
}

/// Histories of another kind: a lamp whose controller overshoots at new set points, and the passage of an entry.
fn flight(kind: usize, random: &mut Uniform) -> History {
    if kind.is_multiple_of(2) {
        let (period_s, damping_s) = (random.between(3.0, 9.0), random.between(2.0, 6.0));
        let steps: Vec<(f64, f64)> = (0..3)
            .map(|step| (14.0 * f64::from(step) + random.between(-1.0, 9.0), random.between(-0.4, 0.6)))
            .collect();
        let level = random.between(0.5, 1.0);
        Box::new(move |time_s| {
            let response = |(from_s, size): &(f64, f64)| {
                let since_s = time_s - from_s;
                if since_s < 0.0 {
                    0.0
                } else {
                    size * (1.0 - (-since_s / damping_s).exp() * (TAU * since_s / period_s).cos())
                }
            };
            level + steps.iter().map(response).sum::<f64>()
        })
    } else {
        let (peak_s, rise_s, fall_s) =
            (random.between(10.0, 30.0), random.between(4.0, 9.0), random.between(5.0, 14.0));
        let (size, flutter, period_s) = (random.between(0.6, 1.6), random.between(0.0, 0.15), random.between(2.5, 8.0));
        Box::new(move |time_s| {
            let width_s = if time_s < peak_s { rise_s } else { fall_s };
            size * lump(time_s, peak_s, width_s) * (1.0 + flutter * (2.0 * PI * time_s / period_s).sin())
        })
    }
}

/// A slab with a thermocouple at 1 and at 4 mm, heated by one quantity.
fn slab(quantity: HeatingQuantity) -> Case {
    let points = |rest: &str, plateau: &str| {
        format!(
            "{{ points = [[\"0 s\", \"{rest}\"], [\"{START_S} s\", \"{plateau}\"], [\"{END_S} s\", \"{plateau}\"], \
             [\"{RETRACTED_S} s\", \"{rest}\"]], outside = \"hold\" }}"
        )
    };
    let face = match quantity {
        HeatingQuantity::Flux => format!("kind = \"heated\"\nflux = {}", points("0 W/cm^2", "20 W/cm^2")),
        HeatingQuantity::RadiantFlux => {
            format!("kind = \"heated\"\nradiant_flux = {}", points("0 W/cm^2", "25 W/cm^2"))
        }
        _ => format!(
            "kind = \"convective\"\nheat_transfer_coefficient = \"200 W/m^2/K\"\ngas = {}",
            points("300 K", "1500 K")
        ),
    };
    let toml = format!(
        "initial_temperature = \"300 K\"\nduration = \"80 s\"\n\
         ply = [{{ name = \"S\", material = \"m\", thickness = \"8 mm\" }}]\n\
         sensor = [{{ name = \"N\", depth = \"1 mm\" }}, {{ name = \"D\", depth = \"4 mm\" }}]\n\
         [hot_face]\n{face}\n"
    );
    let material = "name = \"M\"\n[density]\nvalue = \"1000 kg/m^3\"\n[heat_capacity]\nvalue = \"1000 J/kg/K\"\n\
                    [conductivity]\nvalue = \"0.5 W/m/K\"\n[emissivity]\nvalue = 0.8\n";
    let files = BTreeMap::from([("materials/m.toml".to_owned(), material.to_owned())]);
    let case = Case::from_toml(&toml, "slab", &files).unwrap_or_else(|error| panic!("{error}"));
    modified(&case, |case| {
        // Truth and estimate share the cells and steps: this counts the effect of noise and regularisation.
        case.resolution.tolerance_k = None;
        case.resolution.cells = 24;
        case.resolution.first_step_s = 0.1;
        case.resolution.step_growth = 0.3;
        case.resolution.max_step_s = 0.5;
    })
}

fn stated(case: &Case, quantity: HeatingQuantity) -> Schedule {
    let Face::Open(open) = &case.exposure().hot_face else { panic!("it is heated") };
    match quantity {
        HeatingQuantity::Flux => open.flux_w_m2.clone(),
        HeatingQuantity::RadiantFlux => open.radiant_w_m2.clone(),
        _ => open.gas_k.clone(),
    }
}

fn with_heating(case: &Case, quantity: HeatingQuantity, heating: Schedule) -> Case {
    modified(case, |case| {
        let Face::Open(open) = &mut case.exposure.hot_face else { panic!("it is heated") };
        match quantity {
            HeatingQuantity::Flux => open.flux_w_m2 = heating,
            HeatingQuantity::RadiantFlux => open.radiant_w_m2 = heating,
            _ => open.gas_k = heating,
        }
    })
}

/// The heating of the case with its plateau replaced by a history, at corners every quarter of a second.
fn truth(case: &Case, quantity: HeatingQuantity, history: &History) -> Schedule {
    let own = stated(case, quantity);
    let (rest, plateau) = (own.values()[0], own.values()[1]);
    let mut times_s = vec![0.0];
    times_s.extend((0..=162).map(|step| START_S + 0.25 * f64::from(step)));
    times_s.push(RETRACTED_S);
    let value = |&time_s: &f64| {
        if (START_S..=END_S).contains(&time_s) { rest + (plateau - rest) * history(time_s).max(0.0) } else { rest }
    };
    let values: Vec<f64> = times_s.iter().map(value).collect();
    schedule(&times_s, &values)
}

/// Shares of the knots held, by the intervals and by a third of their widths, and whether the integral is, of one
/// history each.
#[derive(Default)]
struct Counted {
    shares: Vec<f64>,
    shares_of_third: Vec<f64>,
    integrals: Vec<f64>,
}

impl Counted {
    fn add(&mut self, found: &FluxInversion, truth: &Schedule) {
        let knots: Vec<usize> = (0..found.times_s.len()).filter(|&knot| !found.undetermined[knot]).collect();
        let share_held = |width: f64| {
            let is_held = |knot: &&usize| {
                let (value, half, time_s) =
                    (found.values[**knot], width * found.half_widths[**knot], found.times_s[**knot]);
                let low = (value - half).max(found.least_value);
                (low - 1e-9..=value + half).contains(&truth.before(time_s))
            };
            knots.iter().filter(is_held).count() as f64 / knots.len() as f64
        };
        self.shares.push(share_held(1.0));
        self.shares_of_third.push(share_held(1.0 / 3.0));
        let middles = (0..16_000).map(|step| 0.005 * (f64::from(step) + 0.5));
        let integral: f64 = middles.map(|time_s| 0.005 * truth.after(time_s)).sum();
        self.integrals.push(f64::from(u8::from((found.integral - integral).abs() <= found.integral_half_width)));
    }

    fn mean(values: &[f64]) -> f64 {
        values.iter().sum::<f64>() / values.len() as f64
    }

    fn tenth(&self) -> f64 {
        let mut sorted = self.shares.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 10]
    }
}

/// Estimates of random histories of a generator, with white and correlated noise and a shallow and a deep sensor in
/// turn: over all of them, and by kind.
fn counted(
    quantity: HeatingQuantity,
    kinds: usize,
    draw: fn(usize, &mut Uniform) -> History,
    histories: usize,
) -> Counted {
    let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
    let case = slab(quantity);
    let seed = HeatingQuantity::ALL.iter().position(|one| *one == quantity).expect("one of them");
    let mut random = Uniform(0x5eed + seed as u64);
    let (mut all, mut by_kind) = (Counted::default(), BTreeMap::<(usize, usize, usize), Counted>::new());
    for number in 0..histories {
        let (kind, correlated, sensor) = (number % kinds, number / kinds % 2, number / kinds / 2 % 2);
        let heating = truth(&case, quantity, &draw(kind, &mut random));
        let made = with_heating(&case, quantity, heating.clone());
        let made = nominal(&made, &adapt(&made).expect("a plan"), &mut march).expect("a march");
        let noise_k = random.between(0.5, 2.0);
        let noise = Noise { correlation_s: 3.0 * correlated as f64, seed: number as u64 + 1 };
        let is_second = |time_s: f64| (time_s - time_s.round()).abs() < 1e-6;
        let readings =
            made.instants_s.iter().zip(&made.temperatures_k[sensor]).filter(|(time_s, _)| is_second(**time_s));
        let (times_s, exact_k): (Vec<f64>, Vec<f64>) = readings.map(|(time_s, at_k)| (*time_s, *at_k)).unzip();
        let noise = noise.sample(&times_s, 0, sensor);
        let temperatures_k = exact_k.iter().zip(noise).map(|(at_k, noise)| at_k + noise_k * noise).collect();
        let sigma_k = vec![1.0; times_s.len()];
        let observed = modified(&case, |case| {
            case.observations = vec![Observation { sensor, times_s, temperatures_k, sigma_k, window_s: None }];
        });
        let options = question::History::default();
        let found = invert_flux(&observed, &mut march, &options).expect("a history");
        all.add(&found, &heating);
        by_kind.entry((kind, correlated, sensor)).or_default().add(&found, &heating);
    }
    for ((kind, correlated, sensor), counted) in &by_kind {
        println!(
            "{quantity:?} kind {kind} correlated {correlated} sensor {sensor}: {:.3}, integral {:.3}",
            Counted::mean(&counted.shares),
            Counted::mean(&counted.integrals)
        );
    }
    println!(
        "{quantity:?}: {histories} histories, knots {:.3}, by a third {:.3}, tenth percentile {:.3}, integral {:.3}",
        Counted::mean(&all.shares),
        Counted::mean(&all.shares_of_third),
        all.tenth(),
        Counted::mean(&all.integrals)
    );
    all
}

/// Check the coverage over histories of which `few` run by default: 95 to 98 % of the knots, with three standard errors
/// of the mean, of which the standard deviation of a history is 0.06; and of integrals, of which each is held or not.
#[track_caller]
fn is_covered(quantity: HeatingQuantity, kinds: usize, draw: fn(usize, &mut Uniform) -> History, few: usize) {
    let histories = if runs_all() { 200 } else { few };
    let found = counted(quantity, kinds, draw, histories);
    let error = 0.06 / (histories as f64).sqrt();
    let share = Counted::mean(&found.shares);
    assert!((0.95 - 3.0 * error..0.98 + 3.0 * error).contains(&share), "{quantity:?}: {share} of the knots");
    // Negative control: bands that are much too wide would hold the truth by a third of their widths too.
    let of_third = Counted::mean(&found.shares_of_third);
    assert!(of_third < 0.85, "{quantity:?}: {of_third} of the knots by a third of the widths");
    let integrals = Counted::mean(&found.integrals);
    let error = (0.95 * 0.05 / histories as f64).sqrt();
    assert!(integrals >= 0.95 - 3.0 * error, "{quantity:?}: {integrals} of the integrals");
}

#[test]
fn bands_of_a_flux_hold_the_truth_at_95_percent_of_the_knots_on_average() {
    is_covered(HeatingQuantity::Flux, 4, laboratory, 8);
}

#[test]
fn bands_of_a_radiant_flux_hold_the_truth_at_95_percent_of_the_knots_on_average() {
    is_covered(HeatingQuantity::RadiantFlux, 4, laboratory, 8);
}

#[test]
fn bands_of_a_gas_temperature_hold_the_truth_at_95_percent_of_the_knots_on_average() {
    is_covered(HeatingQuantity::Gas, 4, laboratory, 8);
}

#[test]
fn bands_hold_histories_of_overshooting_lamps_and_entries_too() {
    for quantity in HeatingQuantity::ALL {
        is_covered(quantity, 2, flight, 4);
    }
}
