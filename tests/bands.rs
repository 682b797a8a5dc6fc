//! Coverage of Monte Carlo bands, counted over independent members of another seed.

use crate::support::{BAND_COVERAGE_50, BAND_COVERAGE_95, STORED_COVERAGE, case};
use bondline::adapt::adapt;
use bondline::case::{Bounds, Case};
use bondline::ensemble::{Ensemble, Sampling, SamplingKind};
use bondline::march::{Precision, cpu::Cpu, march_all, richardson::RichardsonMarch};
use bondline::plan::Plan;
use bondline::study::nominal::nominal;
use bondline::study::uncertainty::{Sweep, Uncertainty, uncertainty};
use bondline::traces::MemberStatus;

const MEMBERS: usize = 3000;
const OTHERS: usize = 2000;

fn march() -> RichardsonMarch {
    RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)))
}

fn swept(case: &Case, plan: &Plan, bounds: Bounds, kind: SamplingKind) -> Uncertainty {
    let mut march = march();
    let centre = nominal(case, plan, &mut march).expect("the processor does not fail");
    let sweep = Sweep { members: MEMBERS, sampling: Sampling { kind, seed: 1 }, bounds };
    uncertainty(case, plan, &mut march, &centre, &sweep, &mut |_, _| {}).expect("the processor does not fail")
}

/// Fractions of independent members inside the bands of a sensor.
#[derive(Default)]
struct Shares {
    in_simultaneous: f64,
    in_pointwise: f64,
    /// Mean over the instants at which the sensor has responded.
    at_an_instant: f64,
    at_an_instant_in_half: f64,
    peak_in_95: f64,
    peak_in_half: f64,
}

/// Fractions of independent members inside the bands, sensor by sensor.
fn others(case: &Case, plan: &Plan, found: &Uncertainty, bounds: Bounds, kind: SamplingKind) -> Vec<Shares> {
    let ensemble = Ensemble::sample(case.factors(), bounds, &Sampling { kind, seed: 2 }, OTHERS);
    let mut shares: Vec<Shares> = case.sensors().iter().map(|_| Shares::default()).collect();
    let mut members = 0.0;
    march_all(&mut march(), plan, &ensemble, &mut |traces| {
        for member in (0..traces.members()).filter(|&member| traces.statuses[member] == MemberStatus::Completed) {
            members += 1.0;
            for (sensor, shares) in shares.iter_mut().enumerate() {
                let (spread, trace_k) = (&found.spreads[sensor], traces.trace(member, sensor));
                let [low_k, quarter_k, _, three_quarters_k, high_k] = &spread.percentiles_k;
                let inside = |low_k: &[f64], high_k: &[f64]| -> Vec<bool> {
                    let ends = low_k.iter().zip(high_k);
                    trace_k.iter().zip(ends).map(|(at_k, (low_k, high_k))| (low_k..=high_k).contains(&at_k)).collect()
                };
                // Before a sensor responds, its members differ by rounding alone.
                let has_response: Vec<bool> =
                    spread.deviation_k.iter().map(|deviation_k| *deviation_k > 0.01).collect();
                let throughout = |inside: &[bool]| {
                    f64::from(u8::from(inside.iter().zip(&has_response).all(|(i, responds)| *i || !responds)))
                };
                let on_average = |inside: &[bool]| {
                    let held =
                        inside.iter().zip(&has_response).filter(|(inside, responds)| **inside && **responds).count();
                    held as f64 / has_response.iter().filter(|responds| **responds).count() as f64
                };
                let (pointwise, half) = (inside(low_k, high_k), inside(quarter_k, three_quarters_k));
                shares.in_simultaneous += throughout(&inside(&spread.simultaneous.low_k, &spread.simultaneous.high_k));
                shares.in_pointwise += throughout(&pointwise);
                shares.at_an_instant += on_average(&pointwise);
                shares.at_an_instant_in_half += on_average(&half);
                let (peak_k, of_peak) =
                    (trace_k.iter().copied().fold(0.0, f64::max), &found.peaks[sensor].percentiles_k);
                shares.peak_in_95 += f64::from(u8::from((of_peak[0]..=of_peak[4]).contains(&peak_k)));
                shares.peak_in_half += f64::from(u8::from((of_peak[1]..=of_peak[3]).contains(&peak_k)));
            }
        }
    })
    .expect("the processor does not fail");
    assert!(members > 0.99 * OTHERS as f64, "{members} of {OTHERS} completed");
    for shares in &mut shares {
        let all = [
            &mut shares.in_simultaneous,
            &mut shares.in_pointwise,
            &mut shares.at_an_instant,
            &mut shares.at_an_instant_in_half,
            &mut shares.peak_in_95,
            &mut shares.peak_in_half,
        ];
        all.into_iter().for_each(|share| *share /= members);
    }
    shares
}

#[test]
fn bands_have_their_stated_coverage_for_independent_members() {
    for (id, bounds, kind) in [
        ("lcat-2259", Bounds::Small, SamplingKind::Normal),
        ("lcat-2330", Bounds::Large, SamplingKind::Uniform),
        ("lcat-2259-tc3", Bounds::Small, SamplingKind::Sobol),
    ] {
        let case = case(id);
        let plan = adapt(&case).expect("the processor does not fail");
        let found = swept(&case, &plan, bounds, kind);
        let shares = others(&case, &plan, &found, bounds, kind);
        let mut judged = 0;
        for ((sensor, spread), of) in case.sensors().iter().zip(&found.spreads).zip(&shares) {
            let name = format!("{} of {id}", sensor.name);
            if spread.deviation_k.iter().all(|deviation_k| *deviation_k < 0.01) {
                continue;
            }
            let near = |share: f64, said: f64, by: f64| (share - said).abs() <= by;
            assert!(
                near(of.in_simultaneous, 0.95, BAND_COVERAGE_95),
                "{name}: {} in the simultaneous band",
                of.in_simultaneous
            );
            assert!(near(of.at_an_instant, 0.95, BAND_COVERAGE_95), "{name}: {} at an instant", of.at_an_instant);
            assert!(
                near(of.at_an_instant_in_half, 0.5, BAND_COVERAGE_50),
                "{name}: {} in half",
                of.at_an_instant_in_half
            );
            assert!(near(of.peak_in_95, 0.95, BAND_COVERAGE_95), "{name}: {} of peaks", of.peak_in_95);
            assert!(near(of.peak_in_half, 0.5, BAND_COVERAGE_50), "{name}: {} of peaks in half", of.peak_in_half);
            // The pointwise band contains fewer than 95 % of whole traces, and the reported coverage is right.
            let whole = &spread.simultaneous;
            assert!(of.in_pointwise < 0.95 - BAND_COVERAGE_95, "{name}: {} of whole traces", of.in_pointwise);
            assert_eq!(whole.in_pointwise.total, 500, "{name}");
            assert!(near(whole.in_pointwise.fraction(), of.in_pointwise, STORED_COVERAGE), "{name}: {whole:?}");
            assert!(near(whole.in_simultaneous.fraction(), 0.95, STORED_COVERAGE), "{name}: {whole:?}");
            judged += 1;
        }
        assert!(judged >= 1, "{id}: no sensor responds");
    }
}
