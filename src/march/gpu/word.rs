//! Scalars of the data exchanged with a device.

use bytemuck::Pod;

/// A scalar of a kernel, f32 or f64.
pub(super) trait Word: Pod {
    fn word(value: f64) -> Self;
    fn real(self) -> f64;
}

impl Word for f32 {
    fn word(value: f64) -> Self {
        value as Self
    }
    fn real(self) -> f64 {
        f64::from(self)
    }
}

impl Word for f64 {
    fn word(value: f64) -> Self {
        value
    }
    fn real(self) -> f64 {
        self
    }
}
