// Counts what happened: steps by how they ended, and their rewards.
//
// Beside the stages of a step: integers alone, so that the order of counting changes nothing, whoever counts. A workgroup adds up its own
// trucks first, so that the whole device meets at the same few words as rarely as can be.

// Steps of the workgroup's trucks by end code, and their rewards in parts.
var<workgroup> counted: array<atomic<i32>, N_SUMS>;

@compute @workgroup_size(WORKGROUP)
fn count(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let env = thread_of(group, groups, local);
    if is_driving(env) {
        atomicAdd(&counted[ended[env]], 1);
        atomicAdd(&counted[REWARD_SUM], i32(round(reward[env] * REWARD_PARTS)));
    }
    workgroupBarrier();
    if local < N_SUMS {
        add(local, atomicLoad(&counted[local]));
    }
}

// Adds to a sum of 64 bits, whose lower half carries over into its upper one.
fn add(sum: u32, amount: i32) {
    let low = u32(amount);
    let before = atomicAdd(&tally[2u * sum], low);
    let carry = select(0u, 1u, before + low < before);
    atomicAdd(&tally[2u * sum + 1u], carry + u32(amount >> 31u));
}
