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
    if 1u < batch.group {
        if truck[env].held == TOGETHER { start(env, next()); }
    } else if truck[env].held == 1u {
        if batch.autoreset == NEXT_STEP { start(env, next()); }
    } else if ended[env] != RUNNING {
        if batch.autoreset == SAME_STEP {
            start(env, next());
        } else {
            truck[env].held = 1u;
        }
    }
}

// What `held` is between two kernels of a reset where a truck begins its next episode with all of its group.
const TOGETHER: u32 = 2u;

// Decides for each group, in the thread of its first truck, whether its next episodes begin: once all have ended. Until
// then trucks whose episodes have ended are held.
@compute @workgroup_size(WORKGROUP)
fn assemble(thread: Thread) {
    let env = index_of(thread);
    if batch.n_envs <= env || env != first_of_group(env) { return; }
    var all_are_held = true;
    var all_have_ended = true;
    for (var mate = env; mate < env + batch.group; mate++) {
        let is_held = truck[mate].held == 1u;
        all_are_held = all_are_held && is_held;
        all_have_ended = all_have_ended && (is_held || ended[mate] != RUNNING);
    }
    let begins_now = (batch.autoreset == SAME_STEP && all_have_ended) || (batch.autoreset == NEXT_STEP && all_are_held);
    for (var mate = env; mate < env + batch.group; mate++) {
        if begins_now {
            truck[mate].held = TOGETHER;
        } else if ended[mate] != RUNNING {
            truck[mate].held = 1u;
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
    let shares = shares_arms(env, route);
    var start = begin.start;
    if (begin.what & HAS_START) == 0u {
        let pose = words(stream.seed, stream.env, episode, DRAW_POSE);
        let kind = words(stream.seed, stream.env, episode, DRAW_VEHICLE);
        let vehicle = index_below(kind.x, params.n_vehicles);
        let along = params.start_along * (0.5 * (signed_unit(kind.z) + 1.0));
        start = Start(signed_unit(pose.x), signed_unit(pose.y), signed_unit(kind.y), along, vehicle);
        if shares || (begin.what & IS_CENTRED) != 0u {
            // Off their lanes' centres, trucks beside each other may stand in each other.
            start.offset = 0.0;
            start.heading = 0.0;
        }
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
    let leans = first != 0u || vehicles[start.vehicle].rig.crossfall != 0.0;
    if leans { standing = settled(vehicles[start.vehicle].rig, standing); }
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
    if batch.fixed != 0u { return choice[env]; }
    let group = first_of_group(env);
    let first = choice[drawn_below(group, episode, batch.n_routes)];
    // Those of the group's other trucks begin on another arm of its road than those before them, or in another lane.
    var route = first;
    var arms = 0u;
    var lanes_taken = 0u;
    for (var mate = group + 1u; mate <= env; mate++) {
        arms |= arm_bit(route);
        lanes_taken |= lane_bit(route);
        let n_on_other_arms = n_free(first, arms, 0u);
        if 0u < n_on_other_arms {
            route = free_route(first, arms, 0u, drawn_below(mate, episode, n_on_other_arms));
        } else {
            let n_in_other_lanes = n_free(first, 0u, lanes_taken);
            route = free_route(first, 0u, lanes_taken, drawn_below(mate, episode, n_in_other_lanes));
        }
    }
    return route;
}

// Whether some trucks of a truck's group, which begins on this route, begin on one arm: they are more than arms.
fn shares_arms(env: u32, route: u32) -> bool {
    if batch.group <= 1u { return false; }
    var arms = 0u;
    if batch.fixed != 0u {
        let group = first_of_group(env);
        for (var mate = group; mate < group + batch.group; mate++) { arms |= arm_bit(choice[mate]); }
    } else {
        for (var index = 0u; index < batch.n_routes; index++) {
            let other = choice[index];
            if road_of(other) == road_of(route) { arms |= arm_bit(other); }
        }
    }
    return countOneBits(arms) < batch.group;
}

// An index below `n` for the route of a truck's episode.
fn drawn_below(env: u32, episode: u32, n: u32) -> u32 {
    return index_below(words(streams[env].seed, streams[env].env, episode, DRAW_ROUTE).x, n);
}

// Whether a route is on the road of another one and begins on none of these arms and in none of these lanes.
fn is_free(first: u32, arms: u32, lanes_taken: u32, route: u32) -> bool {
    return road_of(route) == road_of(first) && (arms & arm_bit(route)) == 0u && (lanes_taken & lane_bit(route)) == 0u;
}

fn n_free(first: u32, arms: u32, lanes_taken: u32) -> u32 {
    var n = 0u;
    for (var index = 0u; index < batch.n_routes; index++) {
        if is_free(first, arms, lanes_taken, choice[index]) { n++; }
    }
    return n;
}

// The free route with this number; the first one where there is none.
fn free_route(first: u32, arms: u32, lanes_taken: u32, number: u32) -> u32 {
    var left = number;
    for (var index = 0u; index < batch.n_routes; index++) {
        if !is_free(first, arms, lanes_taken, choice[index]) { continue; }
        if left == 0u { return choice[index]; }
        left--;
    }
    return first;
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
