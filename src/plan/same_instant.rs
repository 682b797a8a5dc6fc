//! When two times are the same instant.

/// Two times are one instant when they lie no further apart than this, s.
///
/// Multiples of an interval and times converted from other units differ by rounding (3 × 0.1 s is not 0.3 s), which is some
/// 1e-16 of the duration; no step that a march takes is as short as 1e-9 of it. Whatever compares times of a march uses this.
pub(super) fn same_instant_s(duration_s: f64) -> f64 {
    1e-9 * duration_s
}
