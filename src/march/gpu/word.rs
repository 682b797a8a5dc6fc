//! The scalars that cross to a device and back.

use bytemuck::Pod;

/// A scalar of a kernel in either precision.
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
