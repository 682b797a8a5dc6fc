//! A fault in every call of the driver in turn. Whatever fails, a sweep ends with every member once, and says so.

use super::super::device::injection::{Fault, plan};
use super::super::device::{Adapter, Device, DriverCall};
use super::{adapter, device};
use crate::case::{Bounds, Case, EstimationSettings};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::march::backend_selection::BackendKind;
use crate::march::cpu::Cpu;
use crate::march::fallback::FallbackMarch;
use crate::march::gpu::Gpu;
use crate::march::{Backend, March, MarchError, PendingBatch, Precision, march_all};
use crate::plan::Plan;
use crate::question::Uncertainty;
use crate::session::{Options, Session, SessionError};
use crate::support::runs_all;
use crate::traces::Traces;
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard};

/// Members of a sweep, and of each of its batches: three batches, two at a time.
const MEMBERS: usize = 5;
const BATCH: usize = 2;

/// The faults that leave the device fit for another test.
const FAULTS: [Fault; 4] = [Fault::Lost, Fault::OutOfMemory, Fault::Validation, Fault::Uncaptured];

/// A device that a test keeps while a reserve gives it up.
#[derive(Clone)]
struct Kept(Arc<Mutex<Gpu>>);

impl Kept {
    fn gpu(&self) -> MutexGuard<'_, Gpu> {
        self.0.lock().expect("no test panics with it")
    }

    /// Forget all but the compiled kernels, and let another call fail. The number of dispatches after a timed one
    /// differs between runs.
    fn restart(&self, planned: Option<(usize, Fault)>, is_timed: bool) {
        let mut gpu = self.gpu();
        (gpu.max_batch_members, gpu.is_memory_exhausted) = (BATCH, false);
        let measured = (!is_timed).then_some((BATCH as u32, u32::MAX));
        gpu.pipelines.iter_mut().for_each(|pipeline| pipeline.measured = measured);
        // An error that nobody waits for any more.
        let _ = gpu.device.check();
        gpu.device.injection.restart(planned);
    }
}

impl March for Kept {
    fn backend(&self) -> Backend {
        self.gpu().backend()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        self.gpu().capacity(plan)
    }

    fn remarks(&self) -> Vec<String> {
        self.gpu().remarks()
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        self.gpu().march(plan, ensemble, members)
    }

    fn begin<'a>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<PendingBatch<'a>, MarchError> {
        self.gpu().begin(plan, ensemble, members)
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        self.gpu().tangents(plan, points, factors)
    }
}

/// A kernel and the work for it.
struct Work {
    adapter: Adapter,
    plan: Plan,
    ensemble: Ensemble,
    kernel: Kernel,
}

#[derive(Clone, Copy, PartialEq)]
enum Kernel {
    /// One thread per member, on a software device.
    Plain,
    /// One workgroup per member, on hardware, of which the first dispatch is timed.
    Cooperative,
    Differentiated,
}

/// A case of two factors whose kernels compile in a second.
pub(super) fn case() -> Case {
    let mut builder = Case::load("cases/slab".as_ref()).expect("a shipped case").to_builder();
    (builder.observations, builder.estimate) = (Vec::new(), EstimationSettings::default());
    builder.resolution.cells = 8;
    (builder.resolution.max_step_s, builder.resolution.output_interval_s) = (20.0, 20.0);
    builder.resolution.step_growth = 1.0;
    builder.build().expect("a valid case")
}

impl Work {
    fn new(kernel: Kernel) -> Self {
        let (case, sampling) = (case(), Sampling { kind: SamplingKind::Uniform, seed: 1 });
        let ensemble = Ensemble::sample(case.factors(), Bounds::Small, &sampling, MEMBERS);
        Self { adapter: adapter(), plan: Plan::new(&case), ensemble, kernel }
    }

    /// A new handle of the device, with no kernel compiled.
    fn opened(&self) -> Kept {
        let mut device = Device::open_with(self.adapter.clone(), false, None).expect("the device opens");
        device.is_software = self.kernel != Kernel::Cooperative;
        Kept(Arc::new(Mutex::new(Gpu::untested(device, Precision::F32, BATCH))))
    }

    /// All numbers of each member, none of which is lost or repeated.
    fn marched(&self, march: &mut dyn March) -> Result<Vec<String>, MarchError> {
        let mut all = Traces::empty(0, self.plan.rows.sensor_locations.len(), self.plan.instants_s.len());
        if self.kernel == Kernel::Differentiated {
            all = march.tangents(&self.plan, &self.ensemble, &[0])?.expect("devices have derivatives");
            assert_eq!(all.members(), 2 * MEMBERS);
        } else {
            march_all(march, &self.plan, &self.ensemble, &mut |batch| {
                assert_eq!(batch.first, all.members(), "members are lost or repeated");
                all.extend(&batch, 0..batch.members());
            })?;
            assert_eq!(all.members(), MEMBERS);
        }
        let part = |values: &[f64], member: usize| {
            let size = values.len() / all.members();
            format!("{:?}", &values[member * size..][..size])
        };
        let plies = self.plan.rows.plies.len();
        let row = |member: usize| {
            let (balance, extremes_k) = (all.balances[member], &all.extremes_k[member * plies..][..plies]);
            let numbers = part(&all.temperatures_k, member) + &part(&all.gauges, member);
            format!("{numbers} {balance:?} {extremes_k:?} {:?}", all.statuses[member])
        };
        Ok((0..all.members()).map(row).collect())
    }

    /// The members and the remarks of a march on a device with a reserve.
    fn with_reserve(&self, device: &Kept) -> (Vec<String>, Vec<String>) {
        let mut march = FallbackMarch::new(Box::new(device.clone()), Box::new(Cpu::new(Precision::F32)));
        let found = self.marched(&mut march).expect("the reserve does not fail");
        (found, march.remarks())
    }

    /// A device with the kernel.
    fn warm(&self) -> Kept {
        let device = self.opened();
        self.marched(&mut device.clone()).expect("nothing fails");
        device
    }

    /// The faults to try at a call: all of them for the plain kernel, or with `BONDLINE_ALL`; for other kernels, whose
    /// calls are the same, one after the other in turn.
    fn faults(&self, call: usize) -> &'static [Fault] {
        let is_whole = runs_all() || self.kernel == Kernel::Plain;
        if is_whole { &FAULTS } else { &FAULTS[call % FAULTS.len()..][..1] }
    }

    /// Let every call fail in turn.
    fn fails_at_every_call(&self) {
        let expected = self.marched(&mut Cpu::new(Precision::F32)).expect("the processor does not fail");
        let device = self.warm();
        let first_calls = device.gpu().device.injection.calls();
        device.restart(None, false);
        let (on_device, remarks) = self.with_reserve(&device);
        assert_eq!(remarks, Vec::<String>::new());
        // Parallel cyclic reduction is no twin.
        assert!(self.kernel == Kernel::Cooperative || on_device == expected);
        let calls = device.gpu().device.injection.calls();
        let check = |device: &Kept, fault: Fault, call: usize, is_timed: bool| {
            device.restart(Some((call, fault)), is_timed);
            let (found, remarks) = self.with_reserve(device);
            let kind = device.gpu().device.injection.calls()[call];
            let context = format!("{fault:?} at call {call} of {}, {kind:?}: {remarks:?}", calls.len());
            let is_either = |(member, row)| row == &expected[member] || row == &on_device[member];
            assert!(found.len() == expected.len() && found.iter().enumerate().all(is_either), "{context}");
            // What a device has copied to the host is not lost with it.
            let is_needless = fault == Fault::Destroyed && kind == DriverCall::Read && remarks.is_empty();
            let is_said = |remark: &String| remark.starts_with("The device failed (") || remark.contains("exhausted: ");
            assert!(is_needless || remarks.len() == 1 && is_said(&remarks[0]), "{context}");
        };
        // The first call compiles the kernel, which takes long.
        assert_eq!((first_calls[0], calls.contains(&DriverCall::Pipeline)), (DriverCall::Pipeline, false));
        FAULTS.iter().for_each(|fault| check(&self.opened(), *fault, 0, false));
        check(&self.opened(), Fault::Destroyed, 0, false);

        let mut kinds = BTreeSet::from([DriverCall::Pipeline]);
        for (call, &kind) in calls.iter().enumerate() {
            self.faults(call).iter().for_each(|fault| check(&device, *fault, call, false));
            // A device that was destroyed cannot be used again.
            if kinds.insert(kind) || runs_all() {
                check(&self.warm(), Fault::Destroyed, call, false);
            }
        }
        // Only a software device reads tables from a texture.
        let expected_kinds = DriverCall::ALL
            .into_iter()
            .filter(|call| self.kernel != Kernel::Cooperative || *call != DriverCall::Texture);
        assert!(kinds.iter().copied().eq(expected_kinds), "{kinds:?}");
        if self.kernel == Kernel::Cooperative {
            // The first dispatch is timed between two polls.
            let polls = first_calls.iter().enumerate().filter(|(_, call)| **call == DriverCall::Poll);
            let (timed, _) = polls.take(2).last().expect("the device is polled");
            for call in 0..timed {
                self.faults(call).iter().for_each(|fault| check(&device, *fault, call, true));
            }
        }

        // Without a reserve, they are errors of the device.
        for call in 0..calls.len() {
            for fault in self.faults(call).iter().filter(|fault| **fault != Fault::OutOfMemory) {
                device.restart(Some((call, *fault)), false);
                let found = self.marched(&mut device.clone());
                assert!(matches!(found, Err(MarchError::Device { .. })), "{fault:?} at call {call}: {found:?}");
            }
        }
    }
}

#[test]
fn a_fault_in_any_call_of_a_sweep_loses_no_member() {
    Work::new(Kernel::Plain).fails_at_every_call();
}

#[test]
fn a_fault_in_any_call_of_a_sweep_with_cooperating_threads_loses_no_member() {
    Work::new(Kernel::Cooperative).fails_at_every_call();
}

#[test]
fn a_fault_in_any_call_of_a_march_with_derivatives_loses_none() {
    Work::new(Kernel::Differentiated).fails_at_every_call();
}

/// wgpu panics in a poll when the device is lost meanwhile.
#[test]
fn a_panic_in_a_poll_is_an_error_of_the_device() {
    let device = device(false);
    device.injection.restart(Some((0, Fault::Lost)));
    assert!(matches!(device.wait(), Err(MarchError::Device { .. })));
}

/// A device that fails in its self-tests is an error of the command, as nothing is computed yet; later the processor
/// takes over.
#[test]
fn a_session_whose_device_fails_says_so_and_answers_as_without_the_fault() {
    const STRIDE: usize = 29;
    let options = Uncertainty { members: 6, ..Uncertainty::default() };
    let run = |planned: Option<(usize, Fault)>| -> Result<(String, String), SessionError> {
        if let Some((call, fault)) = planned {
            plan(call, fault);
        }
        let device = Options::default().backend(BackendKind::Gpu).device("llvmpipe");
        let mut session = Session::open(case(), &device)?;
        let found = session.uncertainty(&options)?;
        Ok((format!("{found:?}"), session.summary()?))
    };
    let (expected, plain) = run(None).expect("the device does not fail");
    assert!(!plain.contains("The device failed"), "{plain}");
    let (mut refused, mut taken_over) = (0, 0);
    for call in (0..).step_by(STRIDE) {
        match run(Some((call, Fault::Validation))) {
            Err(error) => {
                assert!(matches!(error, SessionError::March(MarchError::Device { .. })), "call {call}: {error}");
                refused += 1;
            }
            Ok((found, summary)) => {
                assert_eq!(found, expected, "call {call}");
                if !summary.contains("The device failed") {
                    break;
                }
                assert!(summary.contains("were marched on the processor (cpu f32"), "{summary}");
                taken_over += 1;
            }
        }
    }
    assert!(refused >= 1 && taken_over >= 3, "{refused} refused, {taken_over} taken over");
}
