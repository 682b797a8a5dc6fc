//! Tolerance within which two times are the same instant.

/// Largest difference between two times that are the same instant, s.
///
/// Multiples of an interval and times converted from other units differ by rounding (3 × 0.1 s is not 0.3 s), about
/// 1e-16 of the duration; no step is as short as 1e-9 of it. Every comparison of times uses this tolerance.
pub(super) fn time_tolerance_s(duration_s: f64) -> f64 {
    1e-9 * duration_s
}
