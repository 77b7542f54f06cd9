// Begins episodes: within the step that ended the last one, in the step after it, or when the caller says so.
//
// Route and pose are functions of (seed, env, episode) alone, where the caller states none. Other kernels then
// perceive, sense and observe the trucks that have begun.

// Begins another episode where one ended, or holds the truck. A truck that was held when the step began begins its next
// episode with NEXT_STEP.
@compute @workgroup_size(WORKGROUP)
fn reset(thread: Thread) {
    let env = index_of(thread);
    if batch.n_envs <= env { return; }
    if truck[env].held == 1u {
        if batch.autoreset == NEXT_STEP { start(env, next()); }
    } else if ended[env] != RUNNING {
        if batch.autoreset == SAME_STEP {
            start(env, next());
        } else {
            truck[env].held = 1u;
        }
    }
}

// Begins an episode where the caller says so.
@compute @workgroup_size(WORKGROUP)
fn begin(thread: Thread) {
    let env = index_of(thread);
    if !is_to_begin(env) { return; }
    start(env, begins[env]);
}

// Takes back what describes the last step of the trucks that the caller named: they have none.
@compute @workgroup_size(WORKGROUP)
fn forget(thread: Thread) {
    let env = index_of(thread);
    if !is_to_begin(env) { return; }
    forget_last_step(env);
}

// The same for the trucks that began another episode, with NEXT_STEP.
@compute @workgroup_size(WORKGROUP)
fn forget_after_reset(thread: Thread) {
    let env = index_of(thread);
    if !has_begun(env) { return; }
    forget_last_step(env);
}

// The first observation of the episode is the one after the last action too.
fn forget_last_step(env: u32) {
    ended[env] = RUNNING;
    terms[env] = RewardTerms();
    reward[env] = 0.0;
    for (var n = 0u; n < N_VALUES; n++) {
        next_observation[env * N_VALUES + n] = observation[env * N_VALUES + n];
    }
    for (var n = 0u; n < N_EXTRAS; n++) {
        next_extras[env * N_EXTRAS + n] = extras[env * N_EXTRAS + n];
    }
}

// The next episode, as drawn.
fn next() -> BeginRow {
    var begin = BeginRow();
    begin.what = BEGINS;
    return begin;
}

// Puts the truck at the start of an episode.
fn start(env: u32, begin: BeginRow) {
    let stream = streams[env];
    var episode = 0u;
    if (begin.what & IS_FIRST) == 0u { episode = truck[env].episode + 1u; }
    var route = begin.route;
    if (begin.what & HAS_ROUTE) == 0u { route = route_of(env, episode); }
    var start = begin.start;
    if (begin.what & HAS_START) == 0u {
        let pose = words(stream.seed, stream.env, episode, DRAW_POSE);
        let kind = words(stream.seed, stream.env, episode, DRAW_VEHICLE);
        let vehicle = index_below(kind.x, params.n_vehicles);
        let along = params.start_along * (0.5 * (signed_unit(kind.z) + 1.0));
        start = Start(signed_unit(pose.x), signed_unit(pose.y), signed_unit(kind.y), along, vehicle);
    }
    let lane = route_at(route);
    let wheelbase = vehicles[start.vehicle].rig.wheelbase;
    let first = first_waypoint(lane.n_waypoints, start.along);
    let speed = params.start_speed + start.speed * params.start_speed_range;
    var standing = Truck();
    if first == 0u {
        standing.heading = lane_heading(lane, 0u);
        standing.trailer_heading = standing.heading;
        standing.speed = speed;
    } else {
        standing = standing_at(vehicles[start.vehicle].rig, speed, lane, first);
    }
    var after = started(params, wheelbase, waypoint_at(lane.first + first), standing, start);
    after.route = route;
    after.episode = episode;
    control[env] = Control();
    control[env].steering = after.steering;
    control[env].steering_before = after.steering;
    control[env].steering_earlier = after.steering;
    control[env].steering_earliest = after.steering;
    control[env].target_speed = after.speed;
    truck[env] = after;
    progress[env] = followed(lane, reference_point(wheelbase, after), first + 1u, params.stray_distance);
    progress[env].passed = 0u;
}

// The route of an episode as the batch chooses it.
fn route_of(env: u32, episode: u32) -> u32 {
    var index = env;
    if batch.fixed == 0u {
        index = index_below(words(streams[env].seed, streams[env].env, episode, DRAW_ROUTE).x, batch.n_routes);
    }
    return choice[index];
}

// A truck that stands at `waypoint` with these headings, offset and turned as a whole as `start` says.
fn started(params: Params, wheelbase: f32, waypoint: WaypointRow, standing: Truck, start: Start) -> Truck {
    let error = start.heading * params.start_heading;
    let point = waypoint.position + start.offset * params.start_offset * perpendicular(waypoint.direction);
    var truck = standing;
    truck.heading = wrapped(standing.heading + error);
    truck.trailer_heading = wrapped(standing.trailer_heading + error);
    truck.position = point - 0.5 * wheelbase * direction(truck.heading);
    truck.vehicle = start.vehicle;
    return truck;
}
