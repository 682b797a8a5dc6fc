//! Tests of the WGSL shaders against their Rust twins, on the software device.

mod cooperative;
mod differentiated;
mod every_call;
mod faults;
mod loop_turns;
mod mutants;
mod mutation;
mod probes;
mod short_marches;

use super::device::{Adapter, Device, adapters, find};
use super::spirv::Kernel;
use crate::march::Precision;
use crate::random::RandomStream;

/// The software rasteriser, whose results are the same on every machine; or the device whose name contains
/// `BONDLINE_TEST_DEVICE`.
fn adapter() -> Adapter {
    if let Ok(name) = std::env::var("BONDLINE_TEST_DEVICE") {
        return find(Some(&name)).expect("the device that BONDLINE_TEST_DEVICE names");
    }
    adapters().into_iter().find(Adapter::is_software).expect("the software Vulkan driver: scripts/test.sh installs it")
}

/// The device of the tests, with or without the runtime checks of bounds and loops.
pub(super) fn device(checks: bool) -> Device {
    let mut device = Device::open(adapter(), checks).expect("the device opens");
    if !device.is_software {
        let precisions: &[Precision] =
            if device.has_f64 { &[Precision::F32, Precision::F64] } else { &[Precision::F32] };
        for &precision in precisions {
            device.adopt_rounding(precision).expect("the test of rounding runs");
        }
    }
    device
}

/// Uniform random numbers between bounds.
struct Uniform(RandomStream);

impl Uniform {
    fn new(seed: u64) -> Self {
        Self(RandomStream::new(seed, 0))
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.uniform()
    }
}

/// Whether the results of a pipeline agree with the CPU, given the number of a mutant (0: none).
type Agrees = Box<dyn Fn(&wgpu::ComputePipeline, u32) -> bool + Send>;

/// A kernel and its comparison with the CPU.
struct Target {
    name: String,
    kernel: Kernel,
    entry: &'static str,
    agrees: Agrees,
}
