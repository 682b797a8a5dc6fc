//! How many invocations carry a member.
//!
//! One, where members are many: they fill a device by themselves, and nothing is handed over. Where they are few, as in a Jacobian, most of a
//! device would lie idle while each of them goes through its cells one by one; there a workgroup carries a member, a block of cells
//! a lane. Both kernels are one text but for what crosses from block to block: shaders/single_thread.wgsl and shaders/cooperative.wgsl.
//!
//! The choice is made for an ensemble and not for each run of its members: the kernels differ in the last bits, and members that are to be compared, or
//! counted alike however they are cut, go through the same one.

/// Lanes of a member: a subgroup of most hardware, so that barriers cost next to nothing, and three or four of a hundred cells to each.
pub const LANES: u32 = 32;

/// Members that are few. So many invocations are less than a hundredth of what a device for computing holds at once, and so many workgroups some eight for each of
/// its hundred and thirty multiprocessors, about what the memory holds that they share. Argued and not measured, for want of such a device.
const FEW: usize = 1024;

/// Lanes for each of so many members, or so many as are `asked` for, whatever is faster. One on a software device: its lanes are those of a vector,
/// which eight members fill, and columns that lanes share are picked up lane by lane (lavapipe took once to twice as long for one member, and six to fourteen
/// times as long for fifteen).
pub(super) fn wanted(asked: Option<u32>, is_software: bool, members: usize) -> u32 {
    asked.unwrap_or(if !is_software && members <= FEW { LANES } else { 1 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_members_on_hardware_have_a_workgroup_each_and_many_an_invocation() {
        assert_eq!([1, 15, FEW].map(|members| wanted(None, false, members)), [LANES; 3]);
        assert_eq!([FEW + 1, 5000].map(|members| wanted(None, false, members)), [1; 2]);
    }

    #[test]
    fn members_on_a_software_device_have_an_invocation_each_unless_more_are_asked_for() {
        assert_eq!(wanted(None, true, 1), 1);
        assert_eq!(wanted(Some(8), true, 5000), 8);
        assert_eq!(wanted(Some(1), false, 1), 1);
    }
}
