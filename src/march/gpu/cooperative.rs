//! Threads per member: one, or a workgroup (cooperative kernel).
//!
//! Many members fill a device with one thread each and need no communication. With few members, as in a Jacobian, most
//! of the device would idle; there a workgroup marches a member, one block of cells a thread. Both kernels share one
//! source except for the communication between blocks: shaders/single_thread.wgsl and shaders/cooperative.wgsl.
//!
//! The choice is made for a whole ensemble, not for each batch: the kernels differ in the last bits, and members that
//! are compared must use the same one.

use crate::march::Precision;

/// Threads per member of the cooperative kernel: a subgroup of most hardware, so that barriers are cheap, with three or
/// four of a hundred cells a thread.
pub const COOPERATIVE_THREADS: u32 = 32;

/// Largest ensemble for the cooperative kernel. On an H200, `lcat-2259` on 162 cells took 0.108 s by it and 0.178 s by
/// the other for 2,000 members in f32, and 0.239 s and 0.200 s for 5,000; in f64 0.154 s and 0.230 s for 1,000, and
/// 0.296 s and 0.238 s for 2,000 (benches/README.md).
const fn max_cooperative_members(precision: Precision) -> usize {
    match precision {
        Precision::F32 => 4000,
        Precision::F64 => 1500,
    }
}

/// Threads per member for an ensemble. One on a software device: its SIMD lanes are filled by eight members, and
/// workgroup memory is gathered lane by lane (lavapipe took one to two times as long for one member, six to fourteen
/// times for fifteen).
pub(super) const fn threads_per_member(precision: Precision, is_software: bool, members: usize) -> u32 {
    if !is_software && members <= max_cooperative_members(precision) { COOPERATIVE_THREADS } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_ensembles_on_hardware_use_a_workgroup_per_member_and_large_ones_a_thread() {
        for precision in [Precision::F32, Precision::F64] {
            let most = max_cooperative_members(precision);
            assert_eq!([1, 15, most].map(|members| threads_per_member(precision, false, members)), [32; 3]);
            assert_eq!([most + 1, 5000].map(|members| threads_per_member(precision, false, members)), [1; 2]);
            assert_eq!(threads_per_member(precision, true, 1), 1, "on a software device");
        }
    }
}
