//! Standardised residuals of thermocouple data as a least-squares problem, for one case or several.
//!
//! With `r = (T − Y)/σ`, predicted minus measured over the standard deviation, the sum of squares is the paper's S (Eqs
//! 3, 4) for σ of one kelvin, and the Jacobian of the residuals is its sensitivity matrix (Eq. 5).

use super::nominal::samples_in_window;
use crate::case::Case;
use crate::ensemble::Ensemble;
use crate::fit::{LeastSquares, Tangent};
use crate::march::cpu::Cpu;
use crate::march::{March, MarchError, Precision, march_all};
use crate::plan::Plan;
use crate::traces::{MemberStatus, Traces};
use nalgebra::{DMatrix, DVector};

/// One measured sample.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Index into the sensors of the case.
    pub sensor: usize,
    /// Index into the instants of the plan.
    pub instant: usize,
    /// The reading, K.
    pub measured_k: f64,
    /// Standard deviation of the sample, K.
    pub sigma_k: f64,
}

/// Residuals of several cases as a function of the estimated factors, with the others at their nominal values.
pub struct ThermocoupleResiduals<'a> {
    march: &'a mut dyn March,
    cases: Vec<CaseResiduals<'a>>,
    bounds: Vec<(f64, f64)>,
    /// Whether tangents computed by the march are used, where available.
    uses_tangents: bool,
    /// Members marched so far; one with its derivatives counts once.
    pub marches: usize,
}

/// The part of one case.
pub struct CaseResiduals<'a> {
    plan: &'a Plan,
    nominal: Vec<f64>,
    /// Index of each variable among the factors of the case; `None` where the case lacks it.
    factor_indices: Vec<Option<usize>>,
    samples: Vec<Sample>,
}

impl<'a> CaseResiduals<'a> {
    /// A case with its plan and samples; `places` maps each variable to a factor of the case, if any.
    pub fn new(case: &Case, plan: &'a Plan, places: Vec<Option<usize>>, samples: Vec<Sample>) -> Self {
        Self {
            plan,
            nominal: case.factors.iter().map(|factor| factor.nominal).collect(),
            factor_indices: places,
            samples,
        }
    }

    /// An ensemble with these values of the variables, one member per point.
    pub fn ensemble<'p>(&self, points: impl Iterator<Item = &'p [f64]>) -> Ensemble {
        let row = |point: &[f64]| {
            let mut row = self.nominal.clone();
            for (place, &value) in self.factor_indices.iter().zip(point) {
                if let Some(place) = place {
                    row[*place] = value;
                }
            }
            row
        };
        Ensemble::from_values(self.nominal.len(), points.flat_map(row).collect())
    }
}

impl<'a> ThermocoupleResiduals<'a> {
    /// Several cases as one problem, with bounds on its variables.
    pub fn new(march: &'a mut dyn March, parts: Vec<CaseResiduals<'a>>, bounds: Vec<(f64, f64)>) -> Self {
        Self { march, cases: parts, bounds, uses_tangents: true, marches: 0 }
    }

    /// The same problem with finite differences instead of tangents, as in the paper.
    #[must_use]
    pub fn with_finite_differences(self) -> Self {
        Self { uses_tangents: false, ..self }
    }

    /// The march of each case at its nominal factors.
    ///
    /// # Errors
    /// When the device fails.
    pub fn march_nominal(&mut self) -> Result<Vec<Traces>, MarchError> {
        self.marches += self.cases.len();
        let march = &mut *self.march;
        let at = |part: &CaseResiduals| {
            march.march(part.plan, &Ensemble::from_values(part.nominal.len(), part.nominal.clone()), 0..1)
        };
        self.cases.iter().map(at).collect()
    }

    /// Discretisation error of each residual at a point. Its shape in time is a third of the difference between the
    /// plan's two resolutions, the error of the finer one. Extrapolation removes that error, and the remainder is at
    /// most the tolerance of the adaptation, so the largest error is scaled to the adapted estimate. Zero for a plan
    /// with one resolution, and for failed members. The CPU marches in double precision, because the error does not
    /// depend on the backend.
    ///
    /// # Errors
    /// When the march fails.
    pub fn discretisation_errors(&self, point: &[f64]) -> Result<DVector<f64>, MarchError> {
        let mut march = Cpu::new(Precision::F64);
        let mut errors = Vec::new();
        for part in &self.cases {
            let ensemble = part.ensemble(std::iter::once(point));
            let Some(coarse) = &part.plan.coarse else {
                errors.extend(part.samples.iter().map(|_| 0.0));
                continue;
            };
            let fine = march.march(part.plan, &ensemble, 0..1)?;
            let coarse = march.march(coarse, &ensemble, 0..1)?;
            let is_done = fine.statuses[0] == MemberStatus::Completed && coarse.statuses[0] == MemberStatus::Completed;
            let pairs = fine.temperatures_k.iter().zip(&coarse.temperatures_k);
            let worst_k = pairs.map(|(fine_k, coarse_k)| (fine_k - coarse_k).abs() / 3.0).fold(0.0, f64::max);
            let left_k = part
                .plan
                .error_estimate
                .as_ref()
                .map(|reached| reached.nominal_k.max(reached.corners_k.unwrap_or(0.0)));
            let share = left_k.filter(|left_k| *left_k < worst_k).map_or(1.0, |left_k| left_k / worst_k);
            errors.extend(part.samples.iter().map(|sample| {
                let [fine_k, coarse_k] = [&fine, &coarse].map(|traces| traces.trace(0, sample.sensor)[sample.instant]);
                if is_done { share * (fine_k - coarse_k) / (3.0 * sample.sigma_k) } else { 0.0 }
            }));
        }
        Ok(DVector::from_vec(errors))
    }

    /// The march of each case at a point.
    ///
    /// # Errors
    /// When the device fails.
    pub fn march_at(&mut self, point: &[f64]) -> Result<Vec<Traces>, MarchError> {
        self.marches += self.cases.len();
        let march = &mut *self.march;
        let at = |part: &CaseResiduals| march.march(part.plan, &part.ensemble(std::iter::once(point)), 0..1);
        self.cases.iter().map(at).collect()
    }
}

impl LeastSquares for ThermocoupleResiduals<'_> {
    type Error = MarchError;

    fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, MarchError> {
        let rows = self.cases.iter().map(|part| part.samples.len()).sum();
        let mut residuals = DMatrix::from_element(rows, points.ncols(), f64::NAN);
        let mut first = 0;
        let columns: Vec<Vec<f64>> = points.column_iter().map(|point| point.iter().copied().collect()).collect();
        for part in &self.cases {
            march_all(self.march, part.plan, &part.ensemble(columns.iter().map(Vec::as_slice)), &mut |traces| {
                for member in (0..traces.members()).filter(|&member| traces.statuses[member] == MemberStatus::Completed)
                {
                    for (i, sample) in part.samples.iter().enumerate() {
                        let predicted_k = traces.trace(member, sample.sensor)[sample.instant];
                        residuals[(first + i, traces.first + member)] =
                            (predicted_k - sample.measured_k) / sample.sigma_k;
                    }
                }
            })?;
            first += part.samples.len();
            self.marches += points.ncols();
        }
        Ok(residuals)
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, MarchError> {
        if !self.uses_tangents {
            return Ok(None);
        }
        let (rows, variables) = (self.cases.iter().map(|part| part.samples.len()).sum(), self.bounds.len());
        let none =
            Tangent { residuals: DVector::from_element(rows, f64::NAN), jacobian: DMatrix::zeros(rows, variables) };
        let mut tangents = vec![none; points.ncols()];
        let columns: Vec<Vec<f64>> = points.column_iter().map(|point| point.iter().copied().collect()).collect();
        let mut first = 0;
        for part in &self.cases {
            let scaled: Vec<(usize, usize)> = part
                .factor_indices
                .iter()
                .enumerate()
                .filter_map(|(variable, place)| Some((variable, (*place)?)))
                .collect();
            let factors: Vec<usize> = scaled.iter().map(|&(_, place)| place).collect();
            let ensemble = part.ensemble(columns.iter().map(Vec::as_slice));
            let Some(traces) = self.march.tangents(part.plan, &ensemble, &factors)? else { return Ok(None) };
            for (point, tangent) in tangents.iter_mut().enumerate() {
                let member = point * (1 + factors.len());
                if traces.statuses[member] != MemberStatus::Completed {
                    continue;
                }
                for (i, sample) in part.samples.iter().enumerate() {
                    let at = |member: usize| traces.trace(member, sample.sensor)[sample.instant];
                    tangent.residuals[first + i] = (at(member) - sample.measured_k) / sample.sigma_k;
                    for (which, &(variable, _)) in scaled.iter().enumerate() {
                        tangent.jacobian[(first + i, variable)] = at(member + 1 + which) / sample.sigma_k;
                    }
                }
            }
            first += part.samples.len();
            self.marches += points.ncols();
        }
        Ok(Some(tangents))
    }
}

/// The samples of the fitted observations within their windows, one vector per observation.
pub fn samples(case: &Case, plan: &Plan) -> Vec<Vec<Sample>> {
    case.fitted_observations()
        .map(|seen| {
            let pairs = samples_in_window(case, seen, &plan.instants_s).into_iter();
            pairs
                .map(|(sample, instant)| Sample {
                    sensor: seen.sensor,
                    instant,
                    measured_k: seen.temperatures_k[sample],
                    sigma_k: seen.sigma_k[sample],
                })
                .collect()
        })
        .collect()
}
