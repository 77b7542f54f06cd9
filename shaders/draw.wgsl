// Draws an action by chance, each as likely as the next.
//
// Beside the stages of a step: a driver that needs nothing, for measuring speed and filling a memory.

@compute @workgroup_size(WORKGROUP)
fn draw(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let env = thread_of(group, groups, local);
    if batch.n_envs <= env { return; }
    action[env] = drawn(batch.seed, env, truck[env].episode, truck[env].steps, params.n_actions);
}

// An action as a function of (seed, env, episode, step).
fn drawn(seed: u32, env: u32, episode: u32, steps: u32, n_actions: u32) -> u32 {
    return index_below(words(seed, env, episode, DRAW_ACTION + steps).x, n_actions);
}
