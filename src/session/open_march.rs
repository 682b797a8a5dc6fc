//! Marches of a session: opened when first needed, and called with stated values of the factors.

use super::{InputError, Session, SessionError};
use crate::ensemble::Ensemble;
use crate::march::backend_selection::{self, BackendOptions};
use crate::march::monitor::MonitoredMarch;
use crate::march::{March, Precision, march_all};
use crate::plan::{Plan, RoundingError};
use crate::study::validity::two_digits;
use crate::traces::Traces;
use rayon::ThreadPool;

/// A march, with the choices that it was opened for.
pub(super) struct OpenMarch {
    precision: Option<Precision>,
    seeks_hardware: bool,
    march: MonitoredMarch,
    /// Rounding error of the march in f32.
    rounding: Option<RoundingError>,
}

impl Session {
    /// Temperatures, K, in order of member, sensor and instant, for stated values of the factors, and the status of
    /// each member.
    ///
    /// # Errors
    /// When the rows do not have one value per factor, the device fails or the march is cancelled.
    pub fn march(&mut self, points: &Ensemble) -> Result<Traces, SessionError> {
        let mut traces = Traces::empty(0, self.plan.rows.sensors, self.plan.instants_s.len());
        traces.temperatures_k.reserve_exact(points.len() * traces.sensors * traces.instants);
        self.march_batches(points, true, &mut |batch| traces.extend(batch, 0..batch.members()))?;
        Ok(traces)
    }

    /// [`march`](Self::march), with a function that is called with every batch of members, in place of the traces of
    /// all. As in a sweep, gauges are not recorded.
    ///
    /// # Errors
    /// As [`march`](Self::march).
    pub fn march_with(
        &mut self,
        points: &Ensemble,
        take: &mut (dyn FnMut(&Traces) + Send),
    ) -> Result<(), SessionError> {
        self.march_batches(points, false, take)
    }

    fn march_batches(
        &mut self,
        points: &Ensemble,
        has_gauges: bool,
        take: &mut (dyn FnMut(&Traces) + Send),
    ) -> Result<(), SessionError> {
        self.check_points(points, &[])?;
        self.with_march(points.len(), self.options.march.precision, |plan, march| {
            march.begin_sweep(points.len());
            let without_gauges;
            let plan = if has_gauges {
                plan
            } else {
                without_gauges = plan.clone().without_gauges();
                &without_gauges
            };
            Ok(march_all(march, plan, points, &mut |batch| take(&batch))?)
        })
    }

    /// [`march`](Self::march) with exact derivatives: each member is followed by its derivatives with respect to each
    /// of `factors` (indices), stored as further members. `None` if the backend has no derivatives.
    ///
    /// # Errors
    /// As [`march`](Self::march), and when there is no such factor.
    pub fn tangents(&mut self, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, SessionError> {
        self.check_points(points, factors)?;
        self.with_march(points.len() * (1 + factors.len()), self.options.march.precision, |plan, march| {
            Ok(march.tangents(plan, points, factors)?)
        })
    }

    fn check_points(&self, points: &Ensemble, factors: &[usize]) -> Result<(), SessionError> {
        let count = self.case.factors.len();
        if points.factors() != count {
            let message = format!(": rows of {} values, expected one for each of {count} factors", points.factors());
            return Err(InputError::for_option("points", message).into());
        }
        match factors.iter().find(|&&factor| factor >= count) {
            None => Ok(()),
            Some(factor) => {
                let message = format!(": no factor {factor}, expected an index below {count}");
                Err(InputError::for_option("factors", message).into())
            }
        }
    }

    /// Call `work` with the march for a number of members, on the threads of the session.
    pub(super) fn with_march<T: Send>(
        &mut self,
        members: usize,
        precision: Option<Precision>,
        work: impl FnOnce(&Plan, &mut MonitoredMarch) -> Result<T, SessionError> + Send,
    ) -> Result<T, SessionError> {
        self.options.cancel.check()?;
        let index = self.open_march(members, precision)?;
        let OpenMarch { march, rounding, .. } = &mut self.marches[index];
        self.plan.error_estimate = self.discretisation_error.clone().map(|error| match rounding {
            Some(rounding) => error.with_rounding(rounding.clone()),
            None => error,
        });
        let plan = &self.plan;
        march.restart();
        in_pool(self.pool.as_ref(), || work(plan, march))
    }

    /// The index of the march for a number of members and a precision, which is opened if it is not yet.
    pub(super) fn open_march(&mut self, members: usize, precision: Option<Precision>) -> Result<usize, SessionError> {
        let choice = BackendOptions { precision, ..self.options.march.clone() };
        let seeks_hardware = backend_selection::considers_gpu(&choice, &self.plan, members);
        let is_open = |open: &OpenMarch| (open.precision, open.seeks_hardware) == (precision, seeks_hardware);
        if let Some(index) = self.marches.iter().position(is_open) {
            return Ok(index);
        }
        let (case, plan, pool) = (&self.case, &self.plan, self.pool.as_ref());
        let open =
            |choice: &BackendOptions| in_pool(pool, || backend_selection::open_extrapolated(choice, plan, members));
        let (mut march, mut rounding, mut remark) = (open(&choice)?, None, None);
        if march.backend().precision == Precision::F32 {
            rounding = match self.marches.iter().find_map(|open| open.rounding.clone()) {
                Some(known) => Some(known),
                None => in_pool(pool, || RoundingError::measure(case, plan))?,
            };
            let too_large = rounding.as_ref().filter(|_| precision.is_none()).and_then(|found| found.too_large(plan));
            let double = BackendOptions { precision: Some(Precision::F64), ..choice.clone() };
            // A device without f64 marches in f32, and the error is reported.
            if let Some((output, share)) = too_large
                && let Ok(opened) = open(&double)
            {
                let share = two_digits(share);
                remark = Some(format!(
                    "Marched in f64: rounding in f32 would change {output} by up to {share} of the tolerance."
                ));
                (march, rounding) = (opened, None);
            }
        }
        let march = MonitoredMarch::new(march, self.options.monitor()).with_remark(remark);
        self.marches.push(OpenMarch { precision, seeks_hardware, march, rounding });
        Ok(self.marches.len() - 1)
    }
}

pub(super) fn in_pool<T: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> T + Send) -> T {
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}
