//! Numerical methods that know neither cases nor marches: splines, noise of a series, radiation and reaction rates.

pub(crate) mod planck;
pub(crate) mod robust_noise;
pub(crate) mod smoothing_spline;
pub(crate) mod thermogravimetry;
