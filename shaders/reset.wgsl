// Begins the next episode of a truck whose last one ended, within the same step.
//
// Route and pose are functions of (seed, env, episode) alone. A truck on a fixed route drives it once and is then held. Before this stage
// the next observations are copied to the observations; after it the trucks that began are sensed and observed once more.

@compute @workgroup_size(WORKGROUP)
fn reset(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let env = thread_of(group, groups, local);
    if !is_driving(env) || ended[env] == RUNNING { return; }
    if batch.fixed == 1u {
        truck[env].held = 1u;
    } else {
        begin(env, truck[env].episode + 1u);
    }
}

// Begins episode 0 of every truck, whatever it did before.
@compute @workgroup_size(WORKGROUP)
fn restart(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let env = thread_of(group, groups, local);
    if batch.n_envs <= env { return; }
    begin(env, 0u);
}

// Puts the truck at the start of `episode`, at a pose drawn for it.
fn begin(env: u32, episode: u32) {
    let pose = words(batch.seed, env, episode, DRAW_POSE);
    begin_from(env, episode, Start(signed_unit(pose.x), signed_unit(pose.y)));
}

// The same at a stated pose.
fn begin_from(env: u32, episode: u32, start: Start) {
    var place = env;
    if batch.fixed == 0u {
        place = index_below(words(batch.seed, env, episode, DRAW_ROUTE).x, batch.n_routes);
    }
    let route = choice[place];
    let first = routes[route].first;
    var begun = started(params, waypoints[first], previews[first].heading, start);
    begun.route = route;
    begun.episode = episode;
    control[env] = Control();
    truck[env] = begun;
    progress[env] = followed(routes[route], reference_point(params.rig.wheelbase, begun), 1u, params.stray_distance);
    progress[env].passed = 0u;
}

// A truck at `waypoint`, where the lane has this heading [rad]: trailer straight, moved aside and turned as `start` says.
fn started(params: Params, waypoint: WaypointRow, lane_heading: f32, start: Start) -> Truck {
    let heading = wrapped(lane_heading + start.heading * params.start_heading);
    let place = waypoint.position + start.offset * params.start_offset * perpendicular(waypoint.direction);
    var truck = Truck();
    truck.position = place - 0.5 * params.rig.wheelbase * direction(heading);
    truck.heading = heading;
    truck.trailer_heading = heading;
    truck.speed = params.start_speed;
    return truck;
}
