//! Coverage of the simultaneous and pointwise bands of a sweep, counted over members of another seed.

use super::{Counted, covered_row};
use crate::adapt::adapt;
use crate::case::{Bounds, Case};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::march::cpu::Cpu;
use crate::march::richardson::RichardsonMarch;
use crate::march::{MarchError, Precision, march_all};
use crate::study::nominal::nominal;
use crate::study::uncertainty::{Sweep, Uncertainty, uncertainty};
use crate::traces::Traces;
use crate::verify::VerificationRow;

const SWEEPS: u64 = 10;
const MEMBERS: usize = 3000;
const OTHERS: usize = 1000;
const ALLOWED: (f64, &str) = (1.0, "three standard errors of ten shares, which scatter by 1 %");
/// Before a thermocouple responds, members differ by rounding alone, K.
const NO_RESPONSE_K: f64 = 0.01;

/// Shares of members that are held: whole traces, instants and peaks, of every sensor.
fn shares(found: &Uncertainty, traces: &Traces, member: usize) -> [f64; 3] {
    let sensors = found.spreads.len();
    let mut all = [0.0; 3];
    for sensor in 0..sensors {
        let (spread, trace_k) = (&found.spreads[sensor], traces.trace(member, sensor));
        let responds: Vec<usize> =
            (0..trace_k.len()).filter(|&instant| spread.deviation_k[instant] > NO_RESPONSE_K).collect();
        let inside = |low_k: &[f64], high_k: &[f64]| {
            let is_inside = |&&at: &&usize| (low_k[at]..=high_k[at]).contains(&trace_k[at]);
            responds.iter().filter(is_inside).count()
        };
        let whole = inside(&spread.simultaneous.low_k, &spread.simultaneous.high_k) == responds.len();
        let [low_k, _, _, _, high_k] = &spread.percentiles_k;
        let peaks_k = &found.peaks[sensor].percentiles_k;
        let has_peak = (peaks_k[0]..=peaks_k[4]).contains(&traces.peak(member, sensor).temperature_k);
        let each = [
            f64::from(u8::from(whole)),
            inside(low_k, high_k) as f64 / responds.len().max(1) as f64,
            f64::from(u8::from(has_peak)),
        ];
        all.iter_mut().zip(each).for_each(|(sum, share)| *sum += share / sensors as f64);
    }
    all
}

/// # Errors
/// As [`March::march`](crate::march::March::march); the processor does not fail.
pub(super) fn rows(case: &Case) -> Result<Vec<VerificationRow>, MarchError> {
    let plan = adapt(case)?;
    let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
    let centre = nominal(case, &plan, &mut march)?;
    let mut sums = [0.0; 3];
    for seed in 1..=SWEEPS {
        let sampling = Sampling { kind: SamplingKind::Normal, seed };
        let sweep = Sweep { members: MEMBERS, sampling, bounds: Bounds::Small };
        let found = uncertainty(case, &plan, &mut march, &centre, &sweep, &mut |_, _| {})?;
        let sampling = Sampling { seed: SWEEPS + seed, ..sampling };
        let others = Ensemble::sample(&case.factors, Bounds::Small, &sampling, OTHERS);
        march_all(&mut march, &plan, &others, &mut |traces| {
            for member in 0..traces.members() {
                sums.iter_mut().zip(shares(&found, &traces, member)).for_each(|(sum, share)| *sum += share);
            }
        })?;
    }
    let total = SWEEPS as usize * OTHERS;
    let row = |name: &str, quantity: &str, sum: f64| {
        let counted = Counted { covered: sum / total as f64, total, of: "members" };
        covered_row(name, MEMBERS, quantity, &counted, ALLOWED)
    };
    Ok(vec![
        row("simultaneous band", "whole traces", sums[0]),
        row("pointwise band", "mean over the instants", sums[1]),
        row("band of a peak", "two thermocouples", sums[2]),
    ])
}
