// Notes the episodes that failed in this step, between the stages count and reset: then a truck is still where its
// episode ended.

@compute @workgroup_size(WORKGROUP)
fn note(thread: Thread) {
    let env = index_of(thread);
    // One that is held has ended in an earlier step.
    if !is_driving(env) || ended[env] == RUNNING || ended[env] == ARRIVED { return; }
    let seen = truck[env];
    let place = atomicAdd(&journal.count, 1u) % arrayLength(&journal.failures);
    journal.failures[place] =
        Failure(seen.position, env, seen.episode, ended[env], seen.route, seen.vehicle, seen.steps);
}
