//! Scalars of the data exchanged with a device.

use bytemuck::Pod;

/// A scalar of a kernel, f32 or f64.
pub(super) trait DeviceScalar: Pod + Sync {
    fn from_f64(value: f64) -> Self;
    fn to_f64(self) -> f64;
}

impl DeviceScalar for f32 {
    fn from_f64(value: f64) -> Self {
        value as Self
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl DeviceScalar for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
    fn to_f64(self) -> f64 {
        self
    }
}
