// One thread marches a whole member: it has every cell, and nothing is exchanged. The functions are those of
// shaders/cooperative.wgsl, which documents them.

const thread = 0u;

fn member_of(group: u32, thread: u32) -> u32 {
    return group * WORKGROUP + thread;
}

fn assign_block(place: u32) {}

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

fn first_cell_of(ply: u32) -> u32 {
    return plan.plies[ply].first_cell;
}

fn end_cell_of(ply: u32) -> u32 {
    return plan.plies[ply].end_cell;
}

fn has_cell(cell: u32) -> bool {
    return true;
}

fn first_halo_cell() -> u32 {
    return 0u;
}

fn end_halo_cell() -> u32 {
    return run.cells;
}

fn first_halo_ply() -> u32 {
    return 0u;
}

fn end_halo_ply() -> u32 {
    return run.plies;
}

fn synchronize() {}

fn reduce_sum(part: real) -> real {
    return part;
}

fn reduce_max(part: real) -> real {
    return part;
}

fn reduce_sums() {}

fn unknown_below_block() -> real {
    return 0.0;
}

fn pressure_below_block() -> real {
    return 0.0;
}

fn gas_source_below(stage: u32) -> real {
    return 0.0;
}

fn first_block_outflow(upward_flux: real) -> real {
    return upward_flux;
}

fn mean_flux_into_block(inverse_step_1_s: real) -> real {
    return 0.0;
}

fn conversion_above() -> Conversion {
    return Conversion(0.0, 0.0, 0.0);
}
