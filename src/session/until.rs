//! A sweep that ends when the interval of a percentile or of a probability is narrow enough.

use super::{InputError, MembersCallback, RunningStudy, Session, SessionError};
use crate::march::March;
use crate::question::{self, Goal};
use crate::study::sequential_sampling::{
    Drawing, PlainReason, PrecisionReached, PrecisionTarget, TargetQuantity, drawing, importance_sampling_until,
    sweep_until,
};
use crate::study::simultaneous_band::Envelope;
use crate::study::uncertainty::{Sweep, SweepStatistics, failure_reason};

impl Session {
    /// Sample until the 95 % confidence interval of a percentile or of a probability has its half-width, or all members
    /// of the question are drawn. The answers also have the sweep that was drawn; for a rare probability, which is
    /// computed by importance sampling, there is none.
    ///
    /// # Errors
    /// As [`uncertainty`](Self::uncertainty), and when the sampling is not of independent members, or there is no such
    /// sensor.
    pub fn uncertainty_until(
        &mut self,
        question: &question::Uncertainty,
        members: &mut MembersCallback<'_>,
    ) -> Result<PrecisionReached, SessionError> {
        question.check(&self.case)?;
        let Goal::Until(target) = &question.goal else {
            return Err(InputError::for_option("until", ": expected a percentile or a probability").into());
        };
        let (target, sweep) = (question.target(target, &self.case)?, question.sweep());
        self.run(&question.clone().into(), self.case.clone(), question.members, |study| {
            let found = study.uncertainty_until(&sweep, &target, members)?;
            study.answers.seed = Some(sweep.sampling.seed);
            study.answers.precision_reached = Some(found.clone());
            Ok(found)
        })
    }
}

impl RunningStudy<'_> {
    fn uncertainty_until(
        &mut self,
        sweep: &Sweep,
        target: &PrecisionTarget,
        members: &mut MembersCallback<'_>,
    ) -> Result<PrecisionReached, SessionError> {
        let nominal = self.predict(sweep.bounds)?;
        if let Some(reason) = failure_reason(&self.answers.case, &nominal.status) {
            return Err(InputError::general(format!("the nominal march failed: {reason}")).into());
        }
        let (case, plan) = (&self.answers.case, self.plan);
        let driver = self.answers.driver_emissivity.as_ref();
        let mut plain_reason = None;
        if let TargetQuantity::Exceedance { temperature_k } = target.quantity {
            let march = &mut *self.march;
            let how = match driver {
                // Design points are of the factors: they do not know the emissivity of a face that a pyrometer holds.
                Some(_) => Drawing::Plain(PlainReason::HeldEmissivity),
                None => drawing(case, plan, march, sweep, target.sensor, temperature_k)?,
            };
            match how {
                Drawing::Importance(design) => {
                    return Ok(importance_sampling_until(case, plan, march, sweep, target, temperature_k, design)?);
                }
                Drawing::Plain(reason) => plain_reason = Some(reason),
            }
        }
        let (bounds, kind) = (sweep.bounds, sweep.sampling.kind);
        let envelope = Envelope::of(case, plan, &nominal, bounds, kind, &self.march.monitor())?;
        let mut sweep_statistics = SweepStatistics::new(case, &nominal, &envelope, bounds, kind)
            .with_driver_emissivity(driver, sweep.sampling.seed);
        let found = sweep_until(case, plan, self.march, &mut sweep_statistics, sweep, target, members)?;
        let found = PrecisionReached { plain_reason, ..found };
        let drawn = Sweep { members: sweep_statistics.members(), ..*sweep };
        let mut of_drawn = sweep_statistics.results(&nominal, &sweep.sampling, drawn.members);
        of_drawn.discretisation_error = self.sweep_error(&drawn.ensemble(&self.answers.case))?;
        self.answers.uncertainty = Some(of_drawn);
        Ok(found)
    }
}
