//! Faults of a driver, injected into its calls by a test.

use super::{Device, DriverCall};
use crate::march::MarchError;
use std::cell::Cell;
use std::sync::{Arc, Mutex};

/// How a call fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::march::gpu) enum Fault {
    /// This call fails and all after it, as the device is lost.
    Lost,
    /// The device is destroyed, and fails by itself.
    Destroyed,
    OutOfMemory,
    Validation,
    /// wgpu reports an error, as of earlier work, but the call succeeds.
    Uncaptured,
}

thread_local! {
    /// The fault of the next device that this thread opens.
    static PLANNED: Cell<Option<(usize, Fault)>> = const { Cell::new(None) };
}

/// Let a call, counted from zero, of the next device fail that this thread opens.
pub(in crate::march::gpu) fn plan(call: usize, fault: Fault) {
    PLANNED.set(Some((call, fault)));
}

/// The calls of a device, and the one that fails.
#[derive(Debug, Default)]
pub(in crate::march::gpu) struct Injection(Mutex<Calls>);

#[derive(Debug, Default)]
struct Calls {
    made: Vec<DriverCall>,
    planned: Option<(usize, Fault)>,
}

impl Injection {
    /// The injection of a new device.
    pub(in crate::march::gpu) fn planned() -> Arc<Self> {
        Arc::new(Self(Mutex::new(Calls { made: Vec::new(), planned: PLANNED.take() })))
    }

    /// Forget the calls, and plan another fault.
    pub(in crate::march::gpu) fn restart(&self, planned: Option<(usize, Fault)>) {
        *self.0.lock().expect("no test panics with it") = Calls { made: Vec::new(), planned };
    }

    /// The calls so far.
    pub(in crate::march::gpu) fn calls(&self) -> Vec<DriverCall> {
        self.0.lock().expect("no test panics with it").made.clone()
    }

    /// Whether the caller leaves out the effect of this call, or makes it with wrong arguments.
    pub(in crate::march::gpu) fn is_failing(&self, device: &Device, call: DriverCall) -> bool {
        let (number, planned) = {
            let mut calls = self.0.lock().expect("no test panics with it");
            calls.made.push(call);
            (calls.made.len() - 1, calls.planned)
        };
        let Some((first, fault)) = planned.filter(|(first, _)| *first <= number) else { return false };
        if first < number {
            return fault == Fault::Lost;
        }
        match fault {
            Fault::Lost => device.store(device.error("lost: by a test")),
            Fault::Destroyed => device.device.destroy(),
            Fault::OutOfMemory => device.store(MarchError::OutOfMemory { device: device.name.clone() }),
            Fault::Validation | Fault::Uncaptured => provoke_validation_error(device),
        }
        !matches!(fault, Fault::Destroyed | Fault::Uncaptured)
    }
}

/// Let wgpu report an error to the handler of uncaptured ones.
pub(in crate::march::gpu) fn provoke_validation_error(device: &Device) {
    let _buffer = device.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("too large"),
        size: device.limits.max_buffer_size + 8,
        usage: wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    });
}
