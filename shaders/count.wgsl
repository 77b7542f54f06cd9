// Adds the step to the tally: its end code and its reward.
//
// A workgroup first sums over its own trucks, so that few threads of the device contend for the same words.

// Steps of the workgroup's trucks by end code, then the sum of the lower halves of their rewards, then that of the
// upper halves.
var<workgroup> counted: array<atomic<i32>, N_SUMS + 1u>;

@compute @workgroup_size(WORKGROUP)
fn count(thread: Thread) {
    count_step(thread.local, index_of(thread));
}

// Judges the step and counts it at once.
@compute @workgroup_size(WORKGROUP)
fn judge_and_count(thread: Thread) {
    let env = index_of(thread);
    if is_driving(env) { judge_step(env, 0u); }
    count_step(thread.local, env);
}

// Counts the step of the workgroup's truck `local`, which is truck `env`.
fn count_step(local: u32, env: u32) {
    if local <= N_SUMS { atomicStore(&counted[local], 0); }
    workgroupBarrier();
    if is_driving(env) {
        atomicAdd(&counted[ended[env]], 1);
        // Halves of a number that may be larger than an i32: both are exact.
        let units = round(reward[env] * REWARD_UNITS);
        let upper = floor(units * (1.0 / 65536.0));
        atomicAdd(&counted[REWARD_SUM], i32(units - 65536.0 * upper));
        atomicAdd(&counted[N_SUMS], i32(upper));
    }
    workgroupBarrier();
    if local < N_SUMS {
        let amount = atomicLoad(&counted[local]);
        add(local, u32(amount), u32(amount >> 31u));
    } else if local == N_SUMS {
        let amount = atomicLoad(&counted[N_SUMS]);
        add(REWARD_SUM, u32(amount) << 16u, u32(amount >> 16u));
    }
}

// Adds a number of 64 bits to a sum; the lower half carries over into the upper one.
fn add(sum: u32, low: u32, high: u32) {
    let before = atomicAdd(&tally[2u * sum], low);
    let carry = select(0u, 1u, before + low < before);
    atomicAdd(&tally[2u * sum + 1u], high + carry);
}
