//! Threads per member: one, or a workgroup (cooperative kernel).
//!
//! Many members fill a device with one thread each and need no communication. With few members, as in a Jacobian, most
//! of the device would idle; there a workgroup marches a member, one block of cells a thread. Both kernels share one
//! source except for the communication between blocks: shaders/single_thread.wgsl and shaders/cooperative.wgsl.
//!
//! The choice is made for a whole ensemble, not for each batch: the kernels differ in the last bits, and members that
//! are compared must use the same one.

/// Threads per member of the cooperative kernel: a subgroup of most hardware, so that barriers are cheap, with three or
/// four of a hundred cells a thread.
pub const COOPERATIVE_THREADS: u32 = 32;

/// Largest ensemble for the cooperative kernel. With one thread each, so many members use less than a hundredth of the
/// threads of a compute GPU; as workgroups they are about eight for each of its 130 multiprocessors, about as many as
/// fit its shared memory. An estimate, not a measurement.
const MAX_COOPERATIVE_MEMBERS: usize = 1024;

/// Threads per member for an ensemble, or as `requested`. One on a software device: its SIMD lanes are filled by eight
/// members, and workgroup memory is gathered lane by lane (lavapipe took one to two times as long for one member, six
/// to fourteen times for fifteen).
pub(super) fn threads_per_member(requested: Option<u32>, is_software: bool, members: usize) -> u32 {
    requested.unwrap_or(if !is_software && members <= MAX_COOPERATIVE_MEMBERS { COOPERATIVE_THREADS } else { 1 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_ensembles_on_hardware_use_a_workgroup_per_member() {
        assert_eq!(
            [1, 15, MAX_COOPERATIVE_MEMBERS].map(|members| threads_per_member(None, false, members)),
            [COOPERATIVE_THREADS; 3]
        );
        assert_eq!([MAX_COOPERATIVE_MEMBERS + 1, 5000].map(|members| threads_per_member(None, false, members)), [1; 2]);
    }

    #[test]
    fn software_devices_use_one_thread_per_member_unless_more_are_requested() {
        assert_eq!(threads_per_member(None, true, 1), 1);
        assert_eq!(threads_per_member(Some(8), true, 5000), 8);
        assert_eq!(threads_per_member(Some(1), false, 1), 1);
    }
}
