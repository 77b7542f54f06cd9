// Counts what happened: steps by how they ended, and their rewards.
//
// Beside the stages of a step: integers alone, so that the order of counting changes nothing, whoever counts. A workgroup adds up its own
// trucks first, so that the whole device meets at the same few words as rarely as can be.

// Steps of the workgroup's trucks by end code, then their rewards in parts: the lower halves of the words and, behind them, the upper ones.
var<workgroup> counted: array<atomic<i32>, N_SUMS + 1u>;

@compute @workgroup_size(WORKGROUP)
fn count(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let env = thread_of(group, groups, local);
    if is_driving(env) {
        atomicAdd(&counted[ended[env]], 1);
        let parts = i32(round(reward[env] * REWARD_PARTS));
        atomicAdd(&counted[REWARD_SUM], parts & 0xffff);
        atomicAdd(&counted[N_SUMS], parts >> 16u);
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

// Adds a number of 64 bits to a sum, whose lower half carries over into its upper one.
fn add(sum: u32, low: u32, high: u32) {
    let before = atomicAdd(&tally[2u * sum], low);
    let carry = select(0u, 1u, before + low < before);
    atomicAdd(&tally[2u * sum + 1u], high + carry);
}
