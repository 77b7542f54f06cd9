// Draws an action uniformly at random.
//
// Not a stage of a step, but a policy that needs no learner: for measuring speed and filling a replay buffer.

@compute @workgroup_size(WORKGROUP)
fn draw(thread: Thread) {
    let env = index_of(thread);
    if batch.n_envs <= env { return; }
    if is_continuous() {
        command[env] = drawn_command(streams[env], truck[env].episode, truck[env].steps);
    } else {
        action[env] = drawn(streams[env], truck[env].episode, truck[env].steps, params.n_actions);
    }
}

// An action as a function of (seed, env, episode, step).
fn drawn(stream: Stream, episode: u32, steps: u32, n_actions: u32) -> u32 {
    return index_below(words(stream.seed, stream.env, episode, DRAW_ACTION + steps).x, n_actions);
}

// A command as a function of the same.
fn drawn_command(stream: Stream, episode: u32, steps: u32) -> Command {
    let drawn = words(stream.seed, stream.env, episode, DRAW_ACTION + steps);
    return Command(signed_unit(drawn.x), signed_unit(drawn.y));
}
