// Prioritised sampling on a device: transitions are sampled in proportion to their priorities, by sums of blocks. Its
// twin on the host, by a tree of sums, is learner/src/replay_buffer/priorities.rs.
//
// A sample is stratified as there, but among blocks alone: in its block a transition is drawn by a number of its own.
// The sum of all is so large that f32 has few numbers within a transition's share of it, and many within its block's.

var<workgroup> parts: array<f32, WORKGROUP>;

// The rows of the step in hand are new and cannot be sampled; those that enough steps follow from now on have the
// largest priority that there ever was.
@compute @workgroup_size(WORKGROUP)
fn admit(thread: Thread) {
    let env = index_of(thread);
    if facts.n_envs <= env { return; }
    priority[now.slot * facts.n_envs + env] = 0.0;
    if now.has_ready == 1u {
        let ready = (now.slot + facts.n_slots - facts.n_steps) % facts.n_slots;
        priority[ready * facts.n_envs + env] = bitcast<f32>(atomicLoad(&largest));
    }
}

// The sum of a block; a thread a block.
@compute @workgroup_size(WORKGROUP)
fn sum_blocks(thread: Thread) {
    let block = index_of(thread);
    if facts.n_blocks <= block { return; }
    let end = min((block + 1u) * BLOCK, facts.n_slots * facts.n_envs);
    var sum = 0.0;
    for (var row = block * BLOCK; row < end; row++) {
        sum += priority[row];
    }
    block_sum[block] = sum;
}

// What the sum of all has reached at each block's end, by one workgroup. No value is below the one before it: what a
// thread begins with is exactly what the thread before it ends with.
@compute @workgroup_size(WORKGROUP)
fn add_up(thread: Thread) {
    let share = (facts.n_blocks + WORKGROUP - 1u) / WORKGROUP;
    let first = thread.local * share;
    let end = min(first + share, facts.n_blocks);
    var sum = 0.0;
    for (var block = first; block < end; block++) {
        sum += block_sum[block];
    }
    parts[thread.local] = sum;
    workgroupBarrier();
    var before = 0.0;
    for (var other = 0u; other < thread.local; other++) {
        before += parts[other];
    }
    sum = 0.0;
    for (var block = first; block < end; block++) {
        sum += block_sum[block];
        reached[block] = before + sum;
    }
}

// Draws the rows of a sample by priority, one from each of equal strata of the sum; a thread a row.
@compute @workgroup_size(WORKGROUP)
fn pick_by_priority(thread: Thread) {
    let index = index_of(thread);
    if facts.n_rows <= index { return; }
    let drawn = words(facts.sampling_seed, index, now.sample, 0u);
    // Below the sum, whatever is rounded: the last blocks may be empty.
    let place = min((f32(index) + fraction(drawn.x)) * facts.stratum, 1.0 - 0.5 * UNIT);
    let sought = reached[facts.n_blocks - 1u] * place;
    var block = 0u;
    var last = facts.n_blocks - 1u;
    while block < last {
        let middle = (block + last) / 2u;
        if sought < reached[middle] {
            last = middle;
        } else {
            block = middle + 1u;
        }
    }
    let left = block_sum[block] * fraction(drawn.y);
    let end = min((block + 1u) * BLOCK, facts.n_slots * facts.n_envs);
    var picked = block * BLOCK;
    var sum = 0.0;
    for (var row = picked; row < end; row++) {
        // Rounding must not lead to one that cannot be sampled.
        if 0.0 < priority[row] { picked = row; }
        sum += priority[row];
        if left < sum { break; }
    }
    sampled_row[index] = picked;
}

// Importance-sampling weights, the inverse of the priority to the power of the correction, over the largest of them; by
// one workgroup.
@compute @workgroup_size(WORKGROUP)
fn weigh(thread: Thread) {
    var least = priority[sampled_row[0]];
    for (var index = thread.local; index < facts.n_rows; index += WORKGROUP) {
        least = min(least, priority[sampled_row[index]]);
    }
    parts[thread.local] = least;
    workgroupBarrier();
    for (var other = 0u; other < WORKGROUP; other++) {
        least = min(least, parts[other]);
    }
    for (var index = thread.local; index < facts.n_rows; index += WORKGROUP) {
        sampled_weight[index] = pow(least / priority[sampled_row[index]], facts.correction);
    }
}

// Priorities of the latest sample's rows from their absolute TD errors; a thread a row. Of a row that was drawn twice
// the last error counts, whichever thread comes first: such rows lie near each other, since strata go by blocks.
@compute @workgroup_size(WORKGROUP)
fn set_priorities(thread: Thread) {
    let index = index_of(thread);
    if facts.n_rows <= index { return; }
    let row = sampled_row[index];
    for (var later = index + 1u; later < facts.n_rows; later++) {
        let other = sampled_row[later];
        if other == row { return; }
        if other / BLOCK != row / BLOCK { break; }
    }
    // A row that was replaced since stays out. An error that is not finite has all bits of its exponent set; a shader
    // may take any comparison of it for either.
    if 0.0 < priority[row] && (bitcast<u32>(td_error[index]) & INFINITE) != INFINITE {
        let value = pow(td_error[index] + LEAST_ERROR, facts.exponent);
        priority[row] = value;
        // Positive numbers are in the order of their bits.
        atomicMax(&largest, bitcast<u32>(value));
    }
}

// A word as a number in [0, 1).
fn fraction(word: u32) -> f32 {
    return 0.5 * (signed_unit(word) + 1.0);
}
