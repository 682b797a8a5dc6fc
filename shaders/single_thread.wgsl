// Lanes of a member where one invocation carries it whole: there is one, which has every cell, so that there is nobody to meet and nothing to hand over.
// What these functions mean is said where they do something, in shaders/cooperative.wgsl, which has the same ones.

const lane = 0u;

fn member_of(group: u32, thread: u32) -> u32 {
    return group * WORKGROUP + thread;
}

fn stand(place: u32) {}

fn steps_done() -> u32 {
    return progress[member];
}

fn first_cell() -> u32 {
    return 0u;
}

fn end_cell() -> u32 {
    return run.cells;
}

fn first_ply() -> u32 {
    return 0u;
}

fn end_ply() -> u32 {
    return run.plies;
}

fn first_of(ply: u32) -> u32 {
    return plan.plies[ply].first_cell;
}

fn end_of(ply: u32) -> u32 {
    return plan.plies[ply].end_cell;
}

fn has(cell: u32) -> bool {
    return true;
}

fn first_link() -> u32 {
    return 0u;
}

fn end_linked() -> u32 {
    return run.cells;
}

fn first_linked_ply() -> u32 {
    return 0u;
}

fn end_linked_ply() -> u32 {
    return run.plies;
}

fn meet() {}

fn summed(part: real) -> real {
    return part;
}

fn largest(part: real) -> real {
    return part;
}

fn unite() {}

fn under_block() -> real {
    return 0.0;
}

fn pressed_under_block() -> real {
    return 0.0;
}

fn made_behind(stage: u32) -> real {
    return 0.0;
}

fn at_hot_face(risen: real) -> real {
    return risen;
}

fn driven_behind(per_length: real) -> real {
    return 0.0;
}

fn conversion_above() -> Conversion {
    return Conversion(0.0, 0.0, 0.0);
}
