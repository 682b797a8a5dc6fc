//! What the tests share: every tolerance with its reason, and the device.

use bondline::march::gpu::device::{self, Device};

/// A Vulkan device with the runtime's checks on. There is always one: its absence fails.
pub(crate) fn device() -> Device {
    let adapter = device::find(None).expect("tests need a Vulkan driver: scripts/test.sh installs one");
    Device::open(adapter, true).expect("the device opens")
}

/// Uniform numbers in 0..1 from a seed: the same on every machine.
pub(crate) struct Uniform(pub u64);

impl Uniform {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}
