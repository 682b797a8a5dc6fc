//! How many invocations carry a member.
//!
//! One, where members are many: they fill a device by themselves, and nothing is handed over. Where they are few, as in a Jacobian, most of a
//! device would lie idle while each of them goes through its cells one by one; there a workgroup carries a member, a block of cells
//! a lane. Both kernels are one text but for what crosses from block to block: shaders/alone.wgsl and shaders/shared.wgsl.
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
/// times as long for fifteen). One where a workgroup has no room for what its lanes share.
pub(super) fn lanes(
    asked: Option<u32>,
    is_software: bool,
    members: usize,
    shared_bytes: impl Fn(u32) -> usize,
    room_bytes: u32,
) -> u32 {
    let wanted = asked.unwrap_or(if !is_software && members <= FEW { LANES } else { 1 });
    if wanted > 1 && shared_bytes(wanted) > room_bytes as usize { 1 } else { wanted }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: u32 = 32 << 10;

    #[test]
    fn few_members_on_hardware_have_a_workgroup_each_and_many_an_invocation() {
        let on_hardware = |members| lanes(None, false, members, |_| 10_000, ROOM);
        assert_eq!([1, 15, FEW].map(on_hardware), [LANES; 3]);
        assert_eq!([FEW + 1, 5000].map(on_hardware), [1; 2]);
    }

    #[test]
    fn members_on_a_software_device_have_an_invocation_each_unless_more_are_asked_for() {
        assert_eq!(lanes(None, true, 1, |_| 10_000, ROOM), 1);
        assert_eq!(lanes(Some(8), true, 5000, |_| 10_000, ROOM), 8);
        assert_eq!(lanes(Some(1), false, 1, |_| 10_000, ROOM), 1);
    }

    #[test]
    fn a_plan_too_large_for_a_workgroup_has_an_invocation_a_member_even_where_more_are_asked_for() {
        let needed = |lanes| 1000 * lanes as usize;
        assert_eq!(lanes(None, false, 1, needed, ROOM), LANES);
        assert_eq!(lanes(Some(33), false, 1, needed, ROOM), 1);
    }
}
