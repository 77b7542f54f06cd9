// Draws an action uniformly at random.
//
// Not a stage of a step, but a policy that needs no learner: for measuring speed and filling a replay buffer.

@compute @workgroup_size(WORKGROUP)
fn draw(thread: Thread) {
    let env = index_of(thread);
    if batch.n_envs <= env { return; }
    action[env] = drawn(batch.seed, env, truck[env].episode, truck[env].steps, params.n_actions);
}

// An action as a function of (seed, env, episode, step).
fn drawn(seed: u32, env: u32, episode: u32, steps: u32, n_actions: u32) -> u32 {
    return index_below(words(seed, env, episode, DRAW_ACTION + steps).x, n_actions);
}
