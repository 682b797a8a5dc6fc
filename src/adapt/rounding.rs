//! Rounding in single precision, measured: the difference of a march in f32 from one in f64 of the same members on the
//! same plan. A plan that is adapted anew, or checked at other members, has it measured anew.
//!
//! Rounding depends on the layup more than on its size: metal foils, slow reactions and small losses of mass are
//! sensitive to it. No bound that is tight enough is known beforehand, and the measurement takes two marches.

use super::DEFAULT_TOLERANCE_K;
use super::corners::corners;
use super::error_estimate::{OutputErrors, largest_difference_k};
use crate::case::{Bounds, Case};
use crate::ensemble::Ensemble;
use crate::march::cpu::Cpu;
use crate::march::richardson::march_extrapolated;
use crate::march::{MarchError, Precision};
use crate::plan::{ErrorEstimate, Plan, RoundingError};
use crate::traces::{Balance, MemberStatus};

/// Members, nominal and at corners: one SIMD group in f64.
const MEMBERS: usize = 8;
/// Largest share of a tolerance for which f32 is taken unasked.
const ACCEPTED_SHARE: f64 = 0.2;
/// Tolerance of rounding in a residual of a balance: the largest residual without a warning.
const BALANCE_TOLERANCE: f64 = 1e-3;

impl RoundingError {
    /// Measured at nominal factors and at corners of the factors' small bounds. `None` where the nominal march does not
    /// complete in f64.
    ///
    /// # Errors
    /// As [`March::march`](crate::march::March::march); the CPU does not fail.
    pub(crate) fn measure(case: &Case, plan: &Plan) -> Result<Option<Self>, MarchError> {
        Self::measure_at(case, plan, &Ensemble::nominal(&case.factors))
    }

    /// [`measure`](Self::measure) with the largest of some members in place of the nominal one. `None` where one of
    /// them does not complete in f64.
    pub(super) fn measure_at(case: &Case, plan: &Plan, at: &Ensemble) -> Result<Option<Self>, MarchError> {
        let mut values: Vec<f64> = (0..at.len()).flat_map(|member| at.member(member)).collect();
        if !case.factors.is_empty() {
            let corners = corners(case, Bounds::Small);
            values.extend((0..MEMBERS - 1).flat_map(|corner| corners.member(corner)));
        }
        let members = Ensemble::from_values(case.factors.len(), values);
        let march = |precision| march_extrapolated(&mut Cpu::new(precision), plan, &members, 0..members.len());
        let (single, double) = (march(Precision::F32)?, march(Precision::F64)?);
        if double.statuses[..at.len()].iter().any(|status| *status != MemberStatus::Completed) {
            return Ok(None);
        }
        let tolerance_k = tolerance_k(plan);
        let of_members =
            (0..at.len()).map(|member| OutputErrors::member_difference(&single, &double, member, tolerance_k));
        let nominal = of_members.reduce(|largest, other| largest.max(&other)).unwrap_or_default();
        let completed = (at.len()..members.len()).filter(|&corner| double.statuses[corner] == MemberStatus::Completed);
        let residual = |of: fn(&Balance) -> f64| {
            let pairs = single.balances[..at.len()].iter().zip(&double.balances);
            pairs.map(|(single, double)| (of(single) - of(double)).abs()).fold(0.0, f64::max)
        };
        Ok(Some(Self {
            nominal_k: nominal.temperature_k,
            corners_k: completed.map(|corner| largest_difference_k(&single, &double, corner)).reduce(f64::max),
            gauges: nominal.gauges,
            energy_balance: residual(Balance::residual),
            mass_balance: residual(Balance::mass_residual),
        }))
    }

    /// The larger of two, output by output.
    pub(super) fn max(mut self, other: &Self) -> Self {
        self.nominal_k = self.nominal_k.max(other.nominal_k);
        self.corners_k = self.corners_k.into_iter().chain(other.corners_k).reduce(f64::max);
        for (gauge, other) in self.gauges.iter_mut().zip(&other.gauges) {
            gauge.error = gauge.error.max(other.error);
        }
        self.energy_balance = self.energy_balance.max(other.energy_balance);
        self.mass_balance = self.mass_balance.max(other.mass_balance);
        self
    }

    /// The output that rounding changes most beside its tolerance, and the share of the tolerance, where f32 is not
    /// taken unasked.
    pub(crate) fn too_large(&self, plan: &Plan) -> Option<(&'static str, f64)> {
        let temperature_k = self.nominal_k.max(self.corners_k.unwrap_or(0.0));
        let gauges = self.gauges.iter().map(|gauge| (gauge.gauge.name(), gauge.error / gauge.tolerance));
        let balances =
            [("the energy balance", self.energy_balance), ("the mass balance", self.mass_balance)].into_iter();
        let others = balances.map(|(name, residual)| (name, residual / BALANCE_TOLERANCE)).chain(gauges);
        let temperature = ("temperatures", temperature_k / tolerance_k(plan));
        let largest = others.fold(temperature, |largest, each| if each.1 > largest.1 { each } else { largest });
        Some(largest).filter(|(_, share)| *share > ACCEPTED_SHARE)
    }
}

/// The tolerance beside which errors are stated, K.
fn tolerance_k(plan: &Plan) -> f64 {
    plan.error_estimate.as_ref().map_or(DEFAULT_TOLERANCE_K, |reached| reached.tolerance_k)
}

/// A plan whose error includes the rounding of a precision at some members: without change in f64, and where a member
/// does not complete.
///
/// # Errors
/// As [`March::march`](crate::march::March::march); the CPU does not fail.
pub(super) fn with_rounding_of(
    case: &Case,
    mut plan: Plan,
    precision: Precision,
    at: &Ensemble,
) -> Result<Plan, MarchError> {
    if precision == Precision::F32
        && let Some(reached) = &plan.error_estimate
        && let Some(rounding) = RoundingError::measure_at(case, &plan, at)?
    {
        plan.error_estimate = Some(reached.clone().with_rounding(rounding));
    }
    Ok(plan)
}

impl ErrorEstimate {
    /// The estimate of a march in f32.
    pub(crate) fn with_rounding(mut self, rounding: RoundingError) -> Self {
        self.nominal_k += rounding.nominal_k;
        self.corners_k = self.corners_k.map(|error_k| error_k + rounding.corners_k.unwrap_or(0.0));
        for (gauge, rounding) in self.gauges.iter_mut().zip(&rounding.gauges) {
            gauge.error += rounding.error;
        }
        self.rounding = Some(rounding);
        self
    }
}
