// Begins the next episode of a truck whose last one ended, within the same step.
//
// Route and pose are functions of (seed, env, episode) alone. A truck on a fixed route drives it once and is then held.
// Other kernels then sense and observe the trucks that began another episode.

@compute @workgroup_size(WORKGROUP)
fn reset(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) || ended[env] == RUNNING { return; }
    if batch.fixed == 1u {
        truck[env].held = 1u;
    } else {
        begin(env, truck[env].episode + 1u);
    }
}

// Begins episode 0 of every truck at a drawn pose.
@compute @workgroup_size(WORKGROUP)
fn restart(thread: Thread) {
    let env = index_of(thread);
    if batch.n_envs <= env { return; }
    begin(env, 0u);
}

// Begins episode 0 of every truck at a stated pose.
@compute @workgroup_size(WORKGROUP)
fn restart_from(thread: Thread) {
    let env = index_of(thread);
    if batch.n_envs <= env { return; }
    begin_from(env, 0u, starts[env]);
}

// Puts the truck at the start of `episode`, at a pose drawn for it.
fn begin(env: u32, episode: u32) {
    let pose = words(batch.seed, env, episode, DRAW_POSE);
    begin_from(env, episode, Start(signed_unit(pose.x), signed_unit(pose.y)));
}

// The same at a stated pose.
fn begin_from(env: u32, episode: u32, start: Start) {
    var index = env;
    if batch.fixed == 0u {
        index = index_below(words(batch.seed, env, episode, DRAW_ROUTE).x, batch.n_routes);
    }
    let route = choice[index];
    let first = routes[route].first;
    var after = started(params, waypoints[first], previews[first].heading, start);
    after.route = route;
    after.episode = episode;
    control[env] = Control();
    truck[env] = after;
    progress[env] = followed(routes[route], reference_point(params.rig.wheelbase, after), 1u, params.stray_distance);
    progress[env].passed = 0u;
}

// A truck at `waypoint`, where the lane has this heading [rad]: trailer straight, offset and turned as `start` says.
fn started(params: Params, waypoint: WaypointRow, lane_heading: f32, start: Start) -> Truck {
    let heading = wrapped(lane_heading + start.heading * params.start_heading);
    let point = waypoint.position + start.offset * params.start_offset * perpendicular(waypoint.direction);
    var truck = Truck();
    truck.position = point - 0.5 * params.rig.wheelbase * direction(heading);
    truck.heading = heading;
    truck.trailer_heading = heading;
    truck.speed = params.start_speed;
    return truck;
}
