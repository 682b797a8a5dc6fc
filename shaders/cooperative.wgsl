// Lanes of a member where a workgroup carries it: each has a block of cells, columns lie in memory that all of them share, and this file is what
// crossing from block to block costs. Within a block all goes as in shaders/single_thread.wgsl. What is told of a member as a whole is kept in one of three ways:
// alike in every lane, as the schedules; in parts that `unite` adds up, as heat; and what belongs to a face by the lane that has its cell.
//
// Every thread reaches each barrier: control flow around a barrier depends on uniform buffers, on constants and on `steps_done` alone, as WGSL's
// uniformity analysis demands (section "Uniformity"). What one lane writes and another reads has a barrier between; memory that is written again has
// another one before that.

// Where a lane's cells lie among those of its member.
var<private> lane: u32;
var<private> block_first: u32;
var<private> block_end: u32;
var<private> ply_first: u32;
var<private> ply_end: u32;
var<private> linked_first: u32;
var<private> linked_end: u32;

// A block's unknowns by those around it: the first by the last of the block above and its own last, that one by the last of the block
// above and the first of the block below; and where its elimination has come to.
struct Joint {
    first: real,
    first_above: real,
    share: real,
    last: real,
    last_above: real,
    over: real,
    spike: real,
}

// A row of the system of the blocks' last unknowns, its own coefficient one.
struct Joined {
    lower: real,
    upper: real,
    side: real,
}

var<workgroup> parts: array<real, LANES>;
var<workgroup> pairs: array<Pair, LANES>;
var<workgroup> joints: array<Joined, LANES>;
var<workgroup> rows: array<array<Joined, LANES>, 2>;
var<workgroup> lasts: array<real, LANES>;

var<workgroup> done: u32;

// The member that a thread of a workgroup carries.
fn member_of(group: u32, thread: u32) -> u32 {
    return group;
}

// Blocks are alike but for the last, and those beyond the last cell, which are empty.
fn stand(place: u32) {
    let each = (run.cells + LANES - 1u) / LANES;
    lane = place;
    block_first = min(lane * each, run.cells);
    block_end = min(block_first + each, run.cells);
    for (var p = 0u; p < run.plies; p++) {
        ply_first += select(0u, 1u, plan.plies[p].end_cell <= block_first);
        ply_end += select(0u, 1u, plan.plies[p].first_cell < block_end);
        linked_first += select(0u, 1u, plan.plies[p].end_cell <= first_link());
        linked_end += select(0u, 1u, plan.plies[p].first_cell < end_linked());
    }
}

// Steps that the member has done, uniform over the workgroup.
fn steps_done() -> u32 {
    if lane == 0u {
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

// The plies that have a cell of the block: a lane that went over all would wait for those whose cells are in the others.
fn first_ply() -> u32 {
    return ply_first;
}

fn end_ply() -> u32 {
    return ply_end;
}

// The cells of a ply in the block.
fn first_of(ply: u32) -> u32 {
    return max(plan.plies[ply].first_cell, block_first);
}

fn end_of(ply: u32) -> u32 {
    return min(plan.plies[ply].end_cell, block_end);
}

fn has(cell: u32) -> bool {
    return block_first <= cell && cell < block_end;
}

// The link into the block, which its lane and that above both go through: to hand over what it tells would cost a barrier more.
fn first_link() -> u32 {
    return max(block_first, 1u) - 1u;
}

// The end of the cells that the block has links to, and the plies that have one of them.
fn end_linked() -> u32 {
    return min(block_end + 1u, run.cells);
}

fn first_linked_ply() -> u32 {
    return linked_first;
}

fn end_linked_ply() -> u32 {
    return linked_end;
}

// What lanes wrote before is read by others after.
fn meet() {
    workgroupBarrier();
}

// The sum of all lanes' parts, in their order and alike in each.
fn summed(part: real) -> real {
    parts[lane] = part;
    workgroupBarrier();
    var sum = real(0.0);
    for (var other = 0u; other < run.lanes; other++) {
        sum = sum + parts[other];
    }
    workgroupBarrier();
    return sum;
}

fn largest(part: real) -> real {
    parts[lane] = part;
    workgroupBarrier();
    var most = part;
    for (var other = 0u; other < run.lanes; other++) {
        most = max(most, parts[other]);
    }
    workgroupBarrier();
    return most;
}

fn summed_pair(part: Pair) -> Pair {
    pairs[lane] = part;
    workgroupBarrier();
    var sum = Pair(0.0, 0.0);
    for (var other = 0u; other < run.lanes; other++) {
        sum = advanced(sum, pairs[other].high);
        sum = advanced(sum, pairs[other].low);
    }
    workgroupBarrier();
    return sum;
}

// One of the sums that lanes have in parts: heat, what is stored, and where there is gas what that took along.
fn sum_of(which: u32) -> Pair {
    if which < HEATS {
        return heat[which];
    }
    switch which - HEATS {
        case 0u: { return Pair(stored_j_m2, 0.0); }
        case 1u: { return gas_in; }
        case 2u: { return gas_out; }
        case 3u: { return gas_heat; }
        case 4u: { return reaction_gain; }
        case 5u: { return Pair(lost_and_stored[0], 0.0); }
        default: { return Pair(lost_and_stored[1], 0.0); }
    }
}

fn keep_sum(which: u32, sum: Pair) {
    if which < HEATS {
        heat[which] = sum;
        return;
    }
    switch which - HEATS {
        case 0u: { stored_j_m2 = sum.high; }
        case 1u: { gas_in = sum; }
        case 2u: { gas_out = sum; }
        case 3u: { gas_heat = sum; }
        case 4u: { reaction_gain = sum; }
        case 5u: { lost_and_stored[0] = sum.high; }
        default: { lost_and_stored[1] = sum.high; }
    }
}

// What lanes have in parts, whole: at the end of a dispatch, so that it may cost what it likes, but compiling, which a loop for each would.
fn unite() {
    for (var which = 0u; which < run.sums; which++) {
        keep_sum(which, summed_pair(sum_of(which)));
    }
    for (var p = 0u; p < run.plies; p++) {
        coldest[p] = -largest(-coldest[p]);
        hottest[p] = largest(hottest[p]);
    }
    // The earliest, none being later than any.
    let never = real(run.steps + 2u);
    let earliest = -largest(-select(real(strayed), never, strayed == 0u));
    strayed = select(u32(earliest), 0u, earliest == never);
}

fn no_joint() -> Joint {
    return Joint(0.0, 0.0, 1.0, 0.0, 0.0, -1.0, -1.0);
}

// A joint with one row more of the block, on the way down. What elimination makes of the row above the first is left in `lower` there,
// as a block begins with a reciprocal of one and nothing above.
fn lengthened(joint: Joint, under: real, reciprocal: real, over: real, side: real) -> Joint {
    let spike = -(under * joint.spike);
    return Joint(
        joint.first + joint.share * joint.last,
        joint.first_above + joint.share * joint.last_above,
        -(joint.share * joint.over),
        side * reciprocal,
        spike * reciprocal,
        over,
        spike,
    );
}

// The unknowns beside a block, above and under it: the blocks' last unknowns by cyclic reduction, in which every row takes part on every turn
// (parallel cyclic reduction), so that as many turns as lanes have bits leave each row alone. Factors are not kept for the second system of a step:
// a division a turn, where keeping them takes memory of every lane.
fn beside(joint: Joint) -> array<real, 2> {
    joints[lane] = Joined(joint.first_above, joint.share, joint.first);
    workgroupBarrier();
    var next = Joined(0.0, 0.0, 0.0);
    if lane + 1u < LANES {
        next = joints[lane + 1u];
    }
    var row = Joined(0.0, 0.0, 0.0);
    if block_first < block_end {
        let scale = 1.0 / (1.0 - joint.over * next.lower);
        row = Joined(
            joint.last_above * scale,
            joint.over * next.upper * scale,
            (joint.last - joint.over * next.side) * scale,
        );
    }
    var turn = 0u;
    for (var reach = 1u; reach < run.lanes; reach = 2u * reach) {
        rows[turn][lane] = row;
        workgroupBarrier();
        var above = Joined(0.0, 0.0, 0.0);
        var under = Joined(0.0, 0.0, 0.0);
        if lane >= reach {
            above = rows[turn][lane - reach];
        }
        if lane + reach < LANES {
            under = rows[turn][lane + reach];
        }
        let scale = 1.0 / (1.0 - row.lower * above.upper - row.upper * under.lower);
        row = Joined(
            -(row.lower * above.lower) * scale,
            -(row.upper * under.upper) * scale,
            (row.side - row.lower * above.side - row.upper * under.side) * scale,
        );
        turn = 1u - turn;
    }
    lasts[lane] = row.side;
    workgroupBarrier();
    var around = array<real, 2>(0.0, 0.0);
    if lane > 0u {
        around[0] = lasts[lane - 1u];
    }
    if lane + 1u < LANES {
        around[1] = next.side - next.lower * row.side + next.upper * lasts[lane + 1u];
    }
    return around;
}

// The unknown under the block, of a system that is factored and on the way down within it; what the unknown above the block adds to
// the sides is in them afterwards.
fn under_block() -> real {
    var joint = no_joint();
    for (var i = block_first; i < block_end; i++) {
        joint = lengthened(joint, lower[i], diagonal[i], upper[i], second[i]);
    }
    let around = beside(joint);
    var carried = around[0];
    for (var i = block_first; i < block_end; i++) {
        carried = -(lower[i] * carried);
        second[i] = second[i] + carried;
    }
    return around[1];
}

// The same of the pressures.
fn pressed_under_block() -> real {
    var joint = no_joint();
    for (var i = block_first; i < block_end; i++) {
        joint = lengthened(joint, pressure_lower[i], pressure_diagonal[i], pressure_upper[i], pressed_second[i]);
    }
    let around = beside(joint);
    var carried = around[0];
    for (var i = block_first; i < block_end; i++) {
        carried = -(pressure_lower[i] * carried);
        pressed_second[i] = pressed_second[i] + carried;
    }
    return around[1];
}

// The gas made in all blocks behind.
fn made_behind(stage: u32) -> real {
    var own = real(0.0);
    for (var i = block_first; i < block_end; i++) {
        own = own + made_at(i, stage);
    }
    parts[lane] = own;
    workgroupBarrier();
    var behind = real(0.0);
    for (var other = run.lanes - 1u; other > lane; other--) {
        behind = behind + parts[other];
    }
    workgroupBarrier();
    return behind;
}

// What has risen through the first block.
fn at_hot_face(risen: real) -> real {
    parts[lane] = risen;
    workgroupBarrier();
    let out = parts[0];
    workgroupBarrier();
    return out;
}

// What passes into a block from behind: every block lets pass all of it or none, and adds its own.
fn driven_behind(per_length: real) -> real {
    var own = Pair(1.0, 0.0);
    for (var up = 0u; up < block_end - block_first; up++) {
        let i = block_end - 1u - up;
        own = Pair(own.high * passing(i), driven_into(i, own.low, per_length));
    }
    pairs[lane] = own;
    workgroupBarrier();
    var behind = real(0.0);
    for (var other = run.lanes - 1u; other > lane; other--) {
        behind = pairs[other].high * behind + pairs[other].low;
    }
    workgroupBarrier();
    return behind;
}

// What gauges see of the cell over the block.
fn conversion_above() -> Conversion {
    if block_first == 0u || block_first == block_end {
        return Conversion(0.0, 0.0, 0.0);
    }
    var end_m = real(0.0);
    for (var i = 0u; i < block_first; i++) {
        end_m = end_m + cells[i].width_m;
    }
    let i = block_first - 1u;
    let p = ply_first - select(0u, 1u, i < plan.plies[ply_first].first_cell);
    let at = converted(p, mass_left(p, phases_of(p, i)));
    return Conversion(at, end_m - cells[i].width_m + cells[i].above_m, end_m);
}
