// A workgroup marches a member: every thread has a block of cells, and columns lie in workgroup memory. This file
// exchanges data between blocks; within a block the functions do the same as those of shaders/single_thread.wgsl.
// Results of a whole member are kept in one of three ways: alike in every thread, as the schedules; as partial sums
// that `reduce_sums` adds up, as heat; by the thread that has the cell, as a face.
//
// Every thread reaches each barrier: control flow around a barrier depends only on uniform buffers, constants and
// `steps_done`, as WGSL's uniformity analysis demands (section "Uniformity"). A barrier lies between a write of one
// thread and a read of another, and another one before that memory is written again.

// The block of cells of a thread. `lane` is the thread's number within its member.
var<private> thread: u32;
var<private> block_first: u32;
var<private> block_end: u32;
var<private> ply_first: u32;
var<private> ply_end: u32;
var<private> halo_ply_first: u32;
var<private> halo_ply_end: u32;

// Relations between the unknowns at the ends of a block and those next to it: the first unknown from the last one of
// the block above and the block's last; the last from the last one of the block above and the first of the block below.
// Then the state of the elimination within the block.
struct BlockCoupling {
    first_unknown: real,
    first_above: real,
    share: real,
    last_unknown: real,
    last_above: real,
    upper_ratio: real,
    upper_coupling: real,
}

// A row of the reduced system of the blocks' last unknowns, with a unit diagonal.
struct ReducedRow {
    lower: real,
    upper: real,
    rhs: real,
}

var<workgroup> parts: array<real, THREADS_PER_MEMBER>;
var<workgroup> pairs: array<DoubleWord, THREADS_PER_MEMBER>;
var<workgroup> first_rows: array<ReducedRow, THREADS_PER_MEMBER>;
var<workgroup> reduced_rows: array<array<ReducedRow, THREADS_PER_MEMBER>, 2>;
var<workgroup> last_unknowns: array<real, THREADS_PER_MEMBER>;

var<workgroup> done: u32;

// The member of a workgroup.
fn member_of(group: u32, thread: u32) -> u32 {
    return group;
}

// All blocks have the same size, but for the last one and the empty ones beyond the last cell.
fn assign_block(place: u32) {
    let each = (run.cells + THREADS_PER_MEMBER - 1u) / THREADS_PER_MEMBER;
    thread = place;
    block_first = min(thread * each, run.cells);
    block_end = min(block_first + each, run.cells);
    for (var p = 0u; p < run.plies; p++) {
        ply_first += select(0u, 1u, plan.plies[p].end_cell <= block_first);
        ply_end += select(0u, 1u, plan.plies[p].first_cell < block_end);
        halo_ply_first += select(0u, 1u, plan.plies[p].end_cell <= first_halo_cell());
        halo_ply_end += select(0u, 1u, plan.plies[p].first_cell < end_halo_cell());
    }
}

// Steps done by the member, uniform over the workgroup.
fn steps_done() -> u32 {
    if thread == 0u {
        done = progress[member];
    }
    return workgroupUniformLoad(&done);
}

fn first_cell() -> u32 {
    return block_first;
}

fn end_cell() -> u32 {
    return block_end;
}

// The plies that have a cell in the block: looping over all plies would wait for the other threads' cells.
fn first_ply() -> u32 {
    return ply_first;
}

fn end_ply() -> u32 {
    return ply_end;
}

// The cells of a ply in the block.
fn first_cell_of(ply: u32) -> u32 {
    return max(plan.plies[ply].first_cell, block_first);
}

fn end_cell_of(ply: u32) -> u32 {
    return min(plan.plies[ply].end_cell, block_end);
}

fn has_cell(cell: u32) -> bool {
    return block_first <= cell && cell < block_end;
}

// The halo: the cell above the block. Both threads evaluate the fluxes between them, as handing them over would cost
// another barrier.
fn first_halo_cell() -> u32 {
    return max(block_first, 1u) - 1u;
}

// End of the cells whose fluxes the block evaluates, and the plies that have one of them.
fn end_halo_cell() -> u32 {
    return min(block_end + 1u, run.cells);
}

fn first_halo_ply() -> u32 {
    return halo_ply_first;
}

fn end_halo_ply() -> u32 {
    return halo_ply_end;
}

// Makes the writes of all threads visible to each other.
fn synchronize() {
    workgroupBarrier();
}

// Sum of the parts of all threads, added in the same order in each.
fn reduce_sum(part: real) -> real {
    parts[thread] = part;
    workgroupBarrier();
    var sum = real(0.0);
    for (var other = 0u; other < run.threads_per_member; other++) {
        sum = sum + parts[other];
    }
    workgroupBarrier();
    return sum;
}

fn reduce_max(part: real) -> real {
    parts[thread] = part;
    workgroupBarrier();
    var most = part;
    for (var other = 0u; other < run.threads_per_member; other++) {
        most = max(most, parts[other]);
    }
    workgroupBarrier();
    return most;
}

fn reduce_sum_pair(part: DoubleWord) -> DoubleWord {
    pairs[thread] = part;
    workgroupBarrier();
    var sum = DoubleWord(0.0, 0.0);
    for (var other = 0u; other < run.threads_per_member; other++) {
        sum = add_compensated(sum, pairs[other].high);
        sum = add_compensated(sum, pairs[other].low);
    }
    workgroupBarrier();
    return sum;
}

// One of the sums kept in parts: heat, stored heat, and the gas balance.
fn get_sum(which: u32) -> DoubleWord {
    if which < HEAT_TOTALS {
        return heat[which];
    }
    switch which - HEAT_TOTALS {
        case 0u: { return DoubleWord(stored_j_m2, 0.0); }
        case 1u: { return gas_in; }
        case 2u: { return gas_out; }
        case 3u: { return gas_heat; }
        case 4u: { return reaction_gain; }
        case 5u: { return DoubleWord(lost_and_stored[0], 0.0); }
        default: { return DoubleWord(lost_and_stored[1], 0.0); }
    }
}

fn set_sum(which: u32, sum: DoubleWord) {
    if which < HEAT_TOTALS {
        heat[which] = sum;
        return;
    }
    switch which - HEAT_TOTALS {
        case 0u: { stored_j_m2 = sum.high; }
        case 1u: { gas_in = sum; }
        case 2u: { gas_out = sum; }
        case 3u: { gas_heat = sum; }
        case 4u: { reaction_gain = sum; }
        case 5u: { lost_and_stored[0] = sum.high; }
        default: { lost_and_stored[1] = sum.high; }
    }
}

// Adds up all sums kept in parts. Runs once a dispatch, so its time matters little, but compiling a loop for each sum
// would take long.
fn reduce_sums() {
    for (var which = 0u; which < run.partial_sums; which++) {
        set_sum(which, reduce_sum_pair(get_sum(which)));
    }
    for (var p = 0u; p < run.plies; p++) {
        coldest[p] = -reduce_max(-coldest[p]);
        hottest[p] = reduce_max(hottest[p]);
    }
    // The earliest; zero if none diverged.
    let never = real(run.steps + 2u);
    let earliest = -reduce_max(-select(real(diverged), never, diverged == 0u));
    diverged = select(u32(earliest), 0u, earliest == never);
}

fn empty_block() -> BlockCoupling {
    return BlockCoupling(0.0, 0.0, 1.0, 0.0, 0.0, -1.0, -1.0);
}

// Appends a row of the block to the forward elimination. The first row of a block keeps its coupling to the unknown
// above the block in `lower_ratios`, as the block begins with a reciprocal pivot of one and nothing above.
fn append_row(
    block: BlockCoupling,
    lower_ratio: real,
    reciprocal: real,
    upper_ratio: real,
    rhs: real,
) -> BlockCoupling {
    let upper_coupling = -(lower_ratio * block.upper_coupling);
    return BlockCoupling(
        block.first_unknown + block.share * block.last_unknown,
        block.first_above + block.share * block.last_above,
        -(block.share * block.upper_ratio),
        rhs * reciprocal,
        upper_coupling * reciprocal,
        upper_ratio,
        upper_coupling,
    );
}

// The unknowns above and below a block: the reduced system of the blocks' last unknowns, by parallel cyclic reduction,
// which takes log2(threads) turns. Factors are not stored for the second system of a step: a division a turn is cheaper
// than the memory of every thread.
fn solve_reduced(block: BlockCoupling) -> array<real, 2> {
    first_rows[thread] = ReducedRow(block.first_above, block.share, block.first_unknown);
    workgroupBarrier();
    var next = ReducedRow(0.0, 0.0, 0.0);
    if thread + 1u < THREADS_PER_MEMBER {
        next = first_rows[thread + 1u];
    }
    var row = ReducedRow(0.0, 0.0, 0.0);
    if block_first < block_end {
        let scale = 1.0 / (1.0 - block.upper_ratio * next.lower);
        row = ReducedRow(
            block.last_above * scale,
            block.upper_ratio * next.upper * scale,
            (block.last_unknown - block.upper_ratio * next.rhs) * scale,
        );
    }
    var buffer = 0u;
    for (var distance = 1u; distance < run.threads_per_member; distance = 2u * distance) {
        reduced_rows[buffer][thread] = row;
        workgroupBarrier();
        var above = ReducedRow(0.0, 0.0, 0.0);
        var below = ReducedRow(0.0, 0.0, 0.0);
        if thread >= distance {
            above = reduced_rows[buffer][thread - distance];
        }
        if thread + distance < THREADS_PER_MEMBER {
            below = reduced_rows[buffer][thread + distance];
        }
        let scale = 1.0 / (1.0 - row.lower * above.upper - row.upper * below.lower);
        row = ReducedRow(
            -(row.lower * above.lower) * scale,
            -(row.upper * below.upper) * scale,
            (row.rhs - row.lower * above.rhs - row.upper * below.rhs) * scale,
        );
        buffer = 1u - buffer;
    }
    last_unknowns[thread] = row.rhs;
    workgroupBarrier();
    var around = array<real, 2>(0.0, 0.0);
    if thread > 0u {
        around[0] = last_unknowns[thread - 1u];
    }
    if thread + 1u < THREADS_PER_MEMBER {
        around[1] = next.rhs - next.lower * row.rhs + next.upper * last_unknowns[thread + 1u];
    }
    return around;
}

// The unknown below the block, of a factored system whose right-hand side is eliminated within the block. Adds the
// contribution of the unknown above the block to the right-hand side.
fn unknown_below_block() -> real {
    var block = empty_block();
    for (var i = block_first; i < block_end; i++) {
        block = append_row(block, lower_ratios[i], reciprocal_pivots[i], upper_ratios[i], rhs_or_increment[i]);
    }
    let around = solve_reduced(block);
    var coupling = around[0];
    for (var i = block_first; i < block_end; i++) {
        coupling = -(lower_ratios[i] * coupling);
        rhs_or_increment[i] = rhs_or_increment[i] + coupling;
    }
    return around[1];
}

// The same for pressures.
fn pressure_below_block() -> real {
    var block = empty_block();
    for (var i = block_first; i < block_end; i++) {
        block = append_row(block, pressure_lower[i], pressure_diagonal[i], pressure_upper[i], pressure_unknowns[i]);
    }
    let around = solve_reduced(block);
    var coupling = around[0];
    for (var i = block_first; i < block_end; i++) {
        coupling = -(pressure_lower[i] * coupling);
        pressure_unknowns[i] = pressure_unknowns[i] + coupling;
    }
    return around[1];
}

// Gas source of all blocks below.
fn gas_source_below(stage: u32) -> real {
    var own = real(0.0);
    for (var i = block_first; i < block_end; i++) {
        own = own + gas_source_at(i, stage);
    }
    parts[thread] = own;
    workgroupBarrier();
    var behind = real(0.0);
    for (var other = run.threads_per_member - 1u; other > thread; other--) {
        behind = behind + parts[other];
    }
    workgroupBarrier();
    return behind;
}

// Gas that leaves the first block upwards.
fn first_block_outflow(upward_flux: real) -> real {
    parts[thread] = upward_flux;
    workgroupBarrier();
    let out = parts[0];
    workgroupBarrier();
    return out;
}

// Mass flux into a block from below. A block passes all of it or none, and adds its own sources.
fn mean_flux_into_block(inverse_step_1_s: real) -> real {
    var own = DoubleWord(1.0, 0.0);
    for (var end = block_end; end > block_first; end--) {
        let i = end - 1u;
        own = DoubleWord(own.high * pass_mask(i), mean_flux_below(i, own.low, inverse_step_1_s));
    }
    pairs[thread] = own;
    workgroupBarrier();
    var behind = real(0.0);
    for (var other = run.threads_per_member - 1u; other > thread; other--) {
        behind = pairs[other].high * behind + pairs[other].low;
    }
    workgroupBarrier();
    return behind;
}

// Conversion of the cell above the block.
fn conversion_above() -> Conversion {
    if block_first == 0u || block_first == block_end {
        return Conversion(0.0, 0.0, 0.0);
    }
    var end_m = real(0.0);
    for (var i = 0u; i < block_first; i++) {
        end_m = end_m + cell_width_m(i);
    }
    let i = block_first - 1u;
    let p = ply_first - select(0u, 1u, i < plan.plies[ply_first].first_cell);
    let at = degree_of_conversion(p, mass_ratio(p, current_phases(p, i)));
    return Conversion(at, end_m - cell_width_m(i) + cells[i].above_m, end_m);
}
