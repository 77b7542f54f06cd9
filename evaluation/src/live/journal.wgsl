// Notes the episodes that failed in this step, between the stages count and reset: then a truck is still where its
// episode ended.

@compute @workgroup_size(WORKGROUP)
fn note(thread: Thread) {
    let env = index_of(thread);
    if is_failed(env) { keep(env, 0u, 0u); }
}

// The same among other vehicles, with the one that the truck met.
@compute @workgroup_size(WORKGROUP)
fn note_among(thread: Thread) {
    let env = index_of(thread);
    if !is_failed(env) { return; }
    let met = cars[env * N_CAR_WORDS + MET_AT] % TRUCKS_FAULT;
    if met == 0u {
        keep(env, 0u, 0u);
        return;
    }
    let network = network_of(truck[env].route);
    let car = car_at(env, met - 1u);
    let tractor = tractor_outline(truck[env]);
    let by_tractor = is_covering(network, car, tractor, tractor);
    let has_entered = line_of_path(network, path_of(car)) < front_of(car);
    let kind = select(select(1u, 2u, is_van(car)), 3u, large_of(style_of(car)) != 0u);
    keep(env, kind, select(0u, 1u, by_tractor) + select(0u, 2u, has_entered));
}

// Whether an episode failed in this step. One of a truck that is held has ended in an earlier step.
fn is_failed(env: u32) -> bool {
    return is_driving(env) && ended[env] != RUNNING && ended[env] != ARRIVED;
}

fn keep(env: u32, met: u32, contact: u32) {
    let seen = truck[env];
    let place = atomicAdd(&journal.count, 1u) % arrayLength(&journal.failures);
    journal.failures[place] = Failure(
        seen.position, env, seen.episode, ended[env], seen.route, seen.vehicle, seen.steps, met, contact,
    );
}
