//! A march at two resolutions, and what both say of a third that is infinitely fine.
//!
//! Errors fall with the square of cells and steps (`verify --group orders`). So a plan and the same with half of both differ by three times
//! what the finer one is off, and taking that off leaves terms of the third and fourth order (Richardson, Phil. Trans. A 210, 1911). On the
//! paper's layup that costs a quarter more and leaves a fifth of the error on 160 cells, a tenth on 320. The road not taken, a scheme of fourth order through interfaces, contacts and faces that
//! radiate, would have to be written twice and would give no measure of its error.

use super::{Backend, Begun, March, MarchError};
use crate::ensemble::Ensemble;
use crate::plan::Plan;
use crate::traces::{Arrival, Balance, Gauge, Traces};
use std::ops::Range;

/// Any march, at both resolutions of a plan.
pub struct Extrapolated {
    march: Box<dyn March>,
}

impl Extrapolated {
    /// Extrapolate what a march finds at two resolutions.
    pub fn new(march: Box<dyn March>) -> Self {
        Self { march }
    }
}

impl March for Extrapolated {
    fn backend(&self) -> Backend {
        self.march.backend()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        self.march.capacity(plan)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        march_both(&mut *self.march, plan, ensemble, members)
    }

    fn begin<'a>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Begun<'a>, MarchError> {
        begin_both(&mut *self.march, plan, ensemble, members)
    }

    /// What is said of the third resolution is straight in what is said of both, and so are its derivatives.
    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        let Some(fine) = self.march.tangents(plan, points, factors)? else { return Ok(None) };
        let Some(coarse) = &plan.coarse else { return Ok(Some(fine)) };
        Ok(self.march.tangents(coarse, points, factors)?.map(|coarse| combined(fine, &coarse, straight)))
    }

    fn march_plans(
        &mut self,
        plans: &[&Plan],
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Vec<Traces>, MarchError> {
        let coarse: Vec<&Plan> = plans.iter().filter_map(|plan| plan.coarse.as_deref()).collect();
        let both: Vec<&Plan> = plans.iter().copied().chain(coarse).collect();
        let mut marched = self.march.march_plans(&both, ensemble, members)?;
        let mut coarse = marched.split_off(plans.len()).into_iter();
        let read = |(fine, plan): (Traces, &&Plan)| match plan.coarse.as_ref().and_then(|_| coarse.next()) {
            Some(coarser) => extrapolated(fine, &coarser),
            None => fine,
        };
        Ok(marched.into_iter().zip(plans).map(read).collect())
    }
}

/// March members at both resolutions of a plan, and take what both say of the third.
///
/// # Errors
/// As [`March::march`].
pub fn march_both(
    march: &mut dyn March,
    plan: &Plan,
    ensemble: &Ensemble,
    members: Range<usize>,
) -> Result<Traces, MarchError> {
    begin_both(march, plan, ensemble, members)?()
}

fn begin_both<'a>(
    march: &mut dyn March,
    plan: &'a Plan,
    ensemble: &Ensemble,
    members: Range<usize>,
) -> Result<Begun<'a>, MarchError> {
    let fine = march.begin(plan, ensemble, members.clone())?;
    let Some(coarse) = &plan.coarse else { return Ok(fine) };
    let coarse = march.begin(coarse, ensemble, members)?;
    Ok(Box::new(|| Ok(extrapolated(fine()?, &coarse()?))))
}

/// What readings that are off by a quarter of what others are off say of the truth. A member that failed at either resolution failed; where its
/// plies have been is taken from the finer march.
fn extrapolated(fine: Traces, coarse: &Traces) -> Traces {
    combined(fine, coarse, beyond)
}

/// Fronts of two resolutions further apart, m, are not of one error: where a ply is converted as a whole, a front jumps to the next, and may do so at
/// one resolution an instant before it does at the other.
const FRONT_APART_M: f64 = 0.3e-3;

fn combined(mut fine: Traces, coarse: &Traces, beyond: fn(f64, f64) -> f64) -> Traces {
    let all = |fine: &mut [f64], coarse: &[f64]| {
        fine.iter_mut().zip(coarse).for_each(|(fine, &coarse)| *fine = beyond(*fine, coarse));
    };
    all(&mut fine.temperatures_k, &coarse.temperatures_k);
    // Across a jump two resolutions have no error in proportion.
    let front =
        |fine: f64, coarse: f64| if (fine - coarse).abs() > FRONT_APART_M { fine } else { beyond(fine, coarse) };
    let instants = fine.instants.max(1);
    let gauges = fine.gauges.chunks_exact_mut(instants).zip(coarse.gauges.chunks_exact(instants));
    for ((fine, coarse), gauge) in gauges.zip(Gauge::ALL.iter().cycle()) {
        for (fine, &coarse) in fine.iter_mut().zip(coarse) {
            *fine = if gauge.is_front() { front(*fine, coarse) } else { beyond(*fine, coarse) };
        }
    }
    for (arrival, other) in fine.arrivals.iter_mut().zip(&coarse.arrivals) {
        if *arrival == Arrival::Done {
            arrival.clone_from(other);
        }
    }
    for (balance, other) in fine.balances.iter_mut().zip(&coarse.balances) {
        *balance = Balance::combined(*balance, *other, beyond);
    }
    fine
}

/// As far again beyond the finer reading as a third of its way from the coarser one.
fn straight(fine: f64, coarse: f64) -> f64 {
    fine + (fine - coarse) / 3.0
}

/// The same of what is no derivative. What is not below zero in either stays so: there are no
/// fronts above the face, and no gas flows in because less of it flowed out.
fn beyond(fine: f64, coarse: f64) -> f64 {
    let beyond = straight(fine, coarse);
    if fine >= 0.0 && coarse >= 0.0 { beyond.max(0.0) } else { beyond }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_of_an_error_of_second_order_is_nothing() {
        let truth = 412.0;
        assert_eq!(beyond(truth + 0.5, truth + 2.0), truth);
        assert_eq!(beyond(0.0, 3.0), 0.0, "a front does not lie above the face");
        assert_eq!(beyond(-1.0, -4.0), 0.0);
    }

    #[test]
    fn a_member_fails_where_it_fails_at_either_resolution() {
        let traces = |arrivals: Vec<Arrival>, temperatures_k: Vec<f64>| Traces {
            first: 0,
            sensors: 1,
            instants: 1,
            temperatures_k,
            gauges: Vec::new(),
            balances: vec![Balance::default(); arrivals.len()],
            extremes_k: Vec::new(),
            arrivals,
        };
        let strayed = Arrival::Strayed { time_s: 3.0 };
        let fine = traces(vec![Arrival::Done, Arrival::Done, strayed.clone()], vec![301.0, 302.0, 303.0]);
        let coarse = traces(vec![Arrival::Done, strayed.clone(), Arrival::Done], vec![304.0, 302.0, 303.0]);
        let both = extrapolated(fine, &coarse);
        assert_eq!(both.arrivals, [Arrival::Done, strayed.clone(), strayed]);
        assert_eq!(both.temperatures_k, [300.0, 302.0, 303.0]);
    }
}
