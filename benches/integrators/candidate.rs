//! A candidate: a time integrator, with or without a coarse march for extrapolation.

use crate::layup::Layup;
use crate::methods::{Method, Steps, march};
use bondline::plan::Plan;
use bondline_physics::layout::NO_INSTANT;

/// The coarse march for extrapolation, of which a third of the difference is subtracted.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum CoarseMarch {
    /// No extrapolation.
    None,
    /// Half the cells, the same steps: cancels errors in space.
    SameSteps,
    /// Half the cells and half the steps: also cancels second-order errors in time.
    HalfSteps,
}

/// Whether the coarse march has half the cells, or the same, which leaves the errors in time only.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum CoarseCells {
    Halved,
    Same,
}

pub(crate) struct Candidate {
    pub method: Method,
    pub coarse: CoarseMarch,
    /// Convergence order in time.
    pub order: f64,
}

impl Candidate {
    pub(crate) fn title(&self, space: CoarseCells) -> String {
        let name = self.method.name();
        match (self.coarse, space) {
            (CoarseMarch::None, _) | (CoarseMarch::SameSteps, CoarseCells::Same) => name,
            (CoarseMarch::HalfSteps, CoarseCells::Same) => format!("{name}, half the steps"),
            (CoarseMarch::SameSteps, CoarseCells::Halved) => format!("{name}, half the cells"),
            (CoarseMarch::HalfSteps, CoarseCells::Halved) => format!("{name}, half of both"),
        }
    }

    /// Whether the candidate differs from the same method without extrapolation.
    pub(crate) fn differs(&self, space: CoarseCells) -> bool {
        self.method != Method::Ros2 || self.coarse != CoarseMarch::SameSteps || space == CoarseCells::Halved
    }

    /// Readings of a member, sensor × instant, K.
    pub(crate) fn readings(&self, plan: &Plan, space: CoarseCells, columns: &[f64]) -> Vec<f64> {
        let fine = readings(self.method, plan, plan, columns);
        let Some((cells, steps)) = self.coarse_plans(plan, space) else { return fine };
        let coarse = readings(self.method, cells, steps, columns);
        fine.iter().zip(coarse).map(|(fine, coarse)| fine + (fine - coarse) / 3.0).collect()
    }

    /// Cell-steps per member.
    pub(crate) fn work(&self, plan: &Plan, space: CoarseCells) -> f64 {
        let second = self.coarse_plans(plan, space).map_or(0, |(cells, steps)| cells.cells() * steps.steps());
        (plan.cells() * plan.steps() + second) as f64
    }

    /// The plans that give the cells and the steps of the coarse march.
    fn coarse_plans<'a>(&self, plan: &'a Plan, space: CoarseCells) -> Option<(&'a Plan, &'a Plan)> {
        let coarse = plan.coarse().expect("a plan with a discretisation has a coarse one");
        let cells = if space == CoarseCells::Same { plan } else { coarse };
        match self.coarse {
            CoarseMarch::HalfSteps => Some((cells, coarse)),
            CoarseMarch::SameSteps if space == CoarseCells::Halved => Some((cells, plan)),
            _ => None,
        }
    }
}

/// Readings of a member, sensor × instant, K, on the cells of one plan with the steps of another.
pub(crate) fn readings(method: Method, cells: &Plan, steps: &Plan, columns: &[f64]) -> Vec<f64> {
    let layup = Layup::new(cells, |column| columns[column as usize]);
    let sensors = cells.rows().sensor_locations.len();
    let mut records = vec![Vec::with_capacity(steps.rows().records); sensors];
    march(method, &layup, &Steps::of(steps), |step, temperatures| {
        if steps.rows().record_at_step[step] != NO_INSTANT {
            records.iter_mut().enumerate().for_each(|(sensor, of)| of.push(layup.read(temperatures, sensor)));
        }
    });
    let readout = steps.interpolation();
    let read = |records: &Vec<f64>| {
        let mut readings = vec![0.0; readout.instant_count()];
        readout.interpolate(records, &mut readings);
        readings
    };
    records.iter().flat_map(read).collect()
}

/// The largest difference, K; infinite if one is NaN.
pub(crate) fn worst_k(one: &[f64], other: &[f64]) -> f64 {
    let off = one.iter().zip(other).map(|(a, b)| (a - b).abs());
    off.map(|off| if off.is_nan() { f64::INFINITY } else { off }).fold(0.0, f64::max)
}

/// Largest undershoot below the coldest initial temperature after any step, K. Nothing cools a layup below its
/// surroundings, so it is an error. Infinite for NaN.
pub(crate) fn below_k(method: Method, plan: &Plan, columns: &[f64]) -> f64 {
    let layup = Layup::new(plan, |column| columns[column as usize]);
    let start_k = plan.rows().data.cells.iter().map(|cell| cell.start_k).fold(f64::INFINITY, f64::min);
    let mut coldest_k = start_k;
    march(method, &layup, &Steps::of(plan), |_, temperatures: &[f64]| {
        let seen_k = temperatures.iter().map(|&k| if k.is_nan() { f64::NEG_INFINITY } else { k });
        coldest_k = seen_k.fold(coldest_k, f64::min);
    });
    start_k - coldest_k
}
