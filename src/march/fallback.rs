//! A device with a reserve: when the device fails during a computation, the processor marches what is left, in the
//! precision of the device, and it differentiates where the device cannot. Its results are bit-identical where the two
//! are twins.

use super::{Backend, March, MarchError, PendingBatch};
use crate::ensemble::Ensemble;
use crate::plan::Plan;
use crate::traces::Traces;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A march on a device, and the one that takes over when the device fails.
pub struct FallbackMarch {
    backend: Backend,
    marches: Arc<Mutex<Marches>>,
}

struct Marches {
    /// `None` once it has failed.
    device: Option<Box<dyn March>>,
    reserve: Box<dyn March>,
    /// How the device failed, and what it remarked before.
    remarks: Vec<String>,
}

impl FallbackMarch {
    /// Marches on `device` until it fails, then on `reserve`.
    pub fn new(device: Box<dyn March>, reserve: Box<dyn March>) -> Self {
        let backend = device.backend();
        Self { backend, marches: Arc::new(Mutex::new(Marches { device: Some(device), reserve, remarks: Vec::new() })) }
    }

    fn marches(&self) -> MutexGuard<'_, Marches> {
        lock(&self.marches)
    }
}

fn lock(marches: &Mutex<Marches>) -> MutexGuard<'_, Marches> {
    marches.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Marches {
    /// Call `work` on the device, and on the reserve if the device fails or has failed.
    fn on_either<T>(&mut self, mut work: impl FnMut(&mut dyn March) -> Result<T, MarchError>) -> Result<T, MarchError> {
        if let Some(device) = &mut self.device {
            match work(&mut **device) {
                Err(error) if error.is_of_device() => self.give_up(&error),
                other => return other,
            }
        }
        work(&mut *self.reserve)
    }

    /// Use the reserve from now on. Batches that the device has begun may fail after this too.
    fn give_up(&mut self, error: &MarchError) {
        if let Some(device) = self.device.take() {
            let reserve = self.reserve.backend();
            self.remarks = device.remarks();
            self.remarks.push(format!(
                "The device failed ({error}); the members that were left were marched on the processor ({} {}, {}).",
                reserve.kind,
                reserve.precision.name(),
                reserve.name
            ));
        }
    }
}

impl March for FallbackMarch {
    fn backend(&self) -> Backend {
        self.backend.clone()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        let marches = self.marches();
        marches.device.as_ref().unwrap_or(&marches.reserve).capacity(plan)
    }

    fn remarks(&self) -> Vec<String> {
        let marches = self.marches();
        marches.device.as_ref().map_or_else(|| marches.remarks.clone(), |device| device.remarks())
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        self.marches().on_either(|march| march.march(plan, ensemble, members.clone()))
    }

    fn begin<'a>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<PendingBatch<'a>, MarchError> {
        let pending = self.marches().on_either(|march| march.begin(plan, ensemble, members.clone()))?;
        let (marches, ensemble) = (self.marches.clone(), ensemble.clone());
        Ok(Box::new(move || match pending() {
            Err(error) if error.is_of_device() => {
                let mut marches = lock(&marches);
                marches.give_up(&error);
                marches.reserve.march(plan, &ensemble, members)
            }
            other => other,
        }))
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        let mut marches = self.marches();
        match marches.on_either(|march| march.tangents(plan, points, factors))? {
            None => marches.reserve.tangents(plan, points, factors),
            tangents => Ok(tangents),
        }
    }

    fn march_plans(
        &mut self,
        plans: &[&Plan],
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Vec<Traces>, MarchError> {
        self.marches().on_either(|march| march.march_plans(plans, ensemble, members.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Bounds, Case, Resolution};
    use crate::ensemble::{Sampling, SamplingKind};
    use crate::march::cpu::Cpu;
    use crate::march::{Precision, march_all};

    /// A device whose call of this number fails, and every call after it: it is lost.
    struct LostAtCall {
        march: Cpu,
        calls_left: Arc<Mutex<usize>>,
    }

    impl LostAtCall {
        fn call(calls_left: &Mutex<usize>) -> Result<(), MarchError> {
            let mut left = calls_left.lock().expect("no test panics in a call");
            *left = left.checked_sub(1).ok_or_else(|| MarchError::Device {
                device: "lost".to_owned(),
                message: "the device was lost".to_owned(),
            })?;
            Ok(())
        }
    }

    impl March for LostAtCall {
        fn backend(&self) -> Backend {
            Backend { name: "lost".to_owned(), kind: "gpu", driver: None, precision: Precision::F64 }
        }

        fn capacity(&self, _plan: &Plan) -> usize {
            5
        }

        fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
            self.begin(plan, ensemble, members)?()
        }

        fn begin<'a>(
            &mut self,
            plan: &'a Plan,
            ensemble: &Ensemble,
            members: Range<usize>,
        ) -> Result<PendingBatch<'a>, MarchError> {
            Self::call(&self.calls_left)?;
            let traces = self.march.march(plan, ensemble, members)?;
            let calls_left = self.calls_left.clone();
            Ok(Box::new(move || Self::call(&calls_left).map(|()| traces)))
        }

        fn tangents(&mut self, plan: &Plan, points: &Ensemble, of: &[usize]) -> Result<Option<Traces>, MarchError> {
            Self::call(&self.calls_left)?;
            self.march.tangents(plan, points, of)
        }
    }

    fn case() -> Case {
        let mut case = Case::load("cases/slab".as_ref()).expect("a shipped case");
        case.resolution = Resolution { cells: 8, max_step_s: 20.0, step_growth: 1.0, ..Resolution::default() };
        case
    }

    #[test]
    fn a_device_that_is_lost_at_any_call_loses_no_member_and_changes_no_bit() {
        let case = case();
        let (plan, sampling) = (Plan::new(&case), Sampling { kind: SamplingKind::Uniform, seed: 1 });
        let ensemble = Ensemble::sample(&case.factors, Bounds::Small, &sampling, 23);
        let marched = |march: &mut dyn March| {
            let mut all = Traces::empty(0, plan.rows.sensors, plan.instants_s.len());
            march_all(march, &plan, &ensemble, &mut |batch| all.extend(&batch, 0..batch.members()))
                .expect("the reserve does not fail");
            let tangents = march.tangents(&plan, &ensemble, &[0]).expect("the reserve does not fail");
            let tangents = tangents.expect("both have derivatives");
            (all.temperatures_k, all.statuses, tangents.temperatures_k)
        };
        let expected = marched(&mut Cpu::new(Precision::F64));
        // Five batches are begun and finished; the last call is that of the derivatives.
        for call in 0..=11 {
            let device = LostAtCall { march: Cpu::new(Precision::F64), calls_left: Arc::new(Mutex::new(call)) };
            let mut march = FallbackMarch::new(Box::new(device), Box::new(Cpu::new(Precision::F64)));
            assert!(marched(&mut march) == expected, "lost at call {call}");
            let remarks = march.remarks();
            assert_eq!(remarks.len(), usize::from(call < 11), "lost at call {call}: {remarks:?}");
            assert!(remarks.iter().all(|remark| remark.contains("the device was lost") && remark.contains("cpu f64")));
        }
    }

    #[test]
    fn an_error_of_the_plan_or_a_cancellation_is_not_one_of_the_device() {
        assert!(!MarchError::Cancelled.is_of_device() && !MarchError::Stopped.is_of_device());
        let lost = MarchError::Device { device: "d".to_owned(), message: "lost".to_owned() };
        assert!(lost.is_of_device());
    }
}
