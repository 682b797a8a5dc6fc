//! Tests on the software device that need the physics of the crate: WGSL against its twins.

mod cooperative;
mod differentiated;
mod mutants;
mod mutation;
mod probes;
mod short_marches;

use super::device::{Adapter, Device, adapters};
use super::spirv::Kernel;
use crate::chance::Numbers;

/// The software rasteriser, which computes alike on every machine.
fn adapter() -> Adapter {
    adapters().into_iter().find(Adapter::is_software).expect("the software Vulkan driver: scripts/test.sh installs it")
}

/// The software rasteriser, with the runtime's checks of bounds and loops or without.
fn device(checks: bool) -> Device {
    Device::open(adapter(), checks).expect("the device opens")
}

/// Random numbers between bounds.
struct Uniform(Numbers);

impl Uniform {
    fn new(seed: u64) -> Self {
        Self(Numbers::of(seed, 0))
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.unit()
    }
}

/// Whether what a pipeline computes under a mutant agrees with the processor.
type Agrees = Box<dyn Fn(&wgpu::ComputePipeline, u32) -> bool + Send>;

/// A kernel, and how it is held against the processor.
struct Target {
    name: String,
    kernel: Kernel,
    entry: &'static str,
    agrees: Agrees,
}
