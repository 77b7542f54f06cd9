// Writes the observation after the action: 69 values, see src/layout/observation.rs.
//
// Values that depend on the next waypoint alone are looked up in a table that src/world.rs bakes.

@compute @workgroup_size(WORKGROUP)
fn observe(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    observed(env, false);
}

// The first observation of the trucks that began another episode.
@compute @workgroup_size(WORKGROUP)
fn observe_after_reset(thread: Thread) {
    let env = index_of(thread);
    if !has_begun(env) { return; }
    observed(env, true);
    // With the other modes it describes the step that ended the last episode.
    if batch.autoreset == NEXT_STEP { copy_first(env); }
}

// The first observation of the trucks that the caller named.
@compute @workgroup_size(WORKGROUP)
fn observe_begun(thread: Thread) {
    let env = index_of(thread);
    if !is_to_begin(env) { return; }
    observed(env, true);
    copy_first(env);
}

// Makes the first observation of an episode the one after the last action too: there was none.
fn copy_first(env: u32) {
    for (var n = 0u; n < N_VALUES; n++) {
        next_observation[env * N_VALUES + n] = observation[env * N_VALUES + n];
    }
    for (var n = 0u; n < N_EXTRAS; n++) {
        next_extras[env * N_EXTRAS + n] = extras[env * N_EXTRAS + n];
    }
}

// Writes a value of a truck's observation: to the one before the next action after a reset, otherwise to the one after
// the last action.
fn put(env: u32, after_reset: bool, index: u32, value: f32) {
    if after_reset {
        observation[env * N_VALUES + index] = value;
    } else {
        next_observation[env * N_VALUES + index] = value;
    }
}

// The values beside the observation, as src/layout/extras.rs defines them: those that the benchmark observes.
fn observe_extras(env: u32, after_reset: bool) {
    if params.n_extras == 0u { return; }
    let truck = truck[env];
    let rig = rigs[truck.vehicle];
    let values = array<f32, N_EXTRAS>(
        truck.steering / rig.steer_max,
        control[env].target_speed / SPEED_SCALE,
        truck.acceleration / ACCELERATION_SCALE,
        truck.lateral_acceleration / G,
        rig.trailer_wheelbase / WHEELBASE_SCALE,
        truck.trailer_roll / ROLL_SCALE,
        truck.trailer_roll_rate / ROLL_RATE_SCALE,
        rig.trailer_mass / MASS_SCALE,
        rig.rollover_threshold,
        rig.lateral_acceleration_max / G,
        truck.tractor_load_transfer_ratio,
        truck.trailer_load_transfer_ratio,
    );
    var listed = values;
    for (var n = 0u; n < N_EXTRAS; n++) {
        let value = select(0.0, clamp(listed[n], -1.0, 1.0), n < params.n_extras);
        if after_reset {
            extras[env * N_EXTRAS + n] = value;
        } else {
            next_extras[env * N_EXTRAS + n] = value;
        }
    }
}

// The 69 values, and those beside them.
fn observed(env: u32, after_reset: bool) {
    observe_extras(env, after_reset);
    var as_seen = Seen(truck[env], progress[env]);
    if params.disturbances.of_observation == 1u { as_seen = seen(env); }
    let truck = as_seen.truck;
    let route = routes[truck.route];
    let last = route.n_waypoints - 1u;
    let next = min(as_seen.progress.waypoint, last);
    let point = reference_point(rigs[truck.vehicle].wheelbase, truck);
    put(env, after_reset, 0u, clamp(truck.speed / SPEED_SCALE, 0.0, 1.0));
    for (var n = 0u; n < 2u; n++) {
        let waypoint = waypoints[route.first + min(next + n, last)];
        let normal = perpendicular(waypoint.direction);
        let left = waypoint.position + route.crossing_left * normal;
        let right = waypoint.position - route.crossing_right * normal;
        put(env, after_reset, DISTANCES_AT + n, min(distance(point, waypoint.position) / WAYPOINT_SCALE, 1.0));
        put(env, after_reset, CROSSINGS_AT + n, min(distance_to_segment(point, left, right) / WAYPOINT_SCALE, 1.0));
    }
    put(env, after_reset, LANE_AT, min(as_seen.progress.lane_distance / LANE_SCALE, 1.0));
    let behind = waypoints[route.first + max(next, 1u) - 1u].position;
    for (var n = 0u; n < N_LOOK_AHEAD; n++) {
        let index = route.first + min(next + LOOK_AHEAD[n], last);
        let heading = previews[index].heading;
        put(env, after_reset, BEARINGS_AT + n, angle_between(waypoints[index].position - behind, point - behind) / PI);
        put(env, after_reset, HEADINGS_AT + n, wrapped(truck.heading - heading) / PI);
        put(env, after_reset, TRAILER_HEADINGS_AT + n, wrapped(truck.trailer_heading - heading) / PI);
    }
    put(env, after_reset, ARTICULATION_AT, wrapped(truck.heading - truck.trailer_heading) / PI);
    let preview = route.first + next;
    for (var n = 0u; n < N_CURVATURES; n++) {
        put(env, after_reset, CURVATURES_AT + n, previews[preview].values[n]);
    }
    for (var n = 0u; n < N_RAYS; n++) {
        put(env, after_reset, RANGES_AT + n, ranges[env * N_RAYS + n] / params.sensor_range);
    }
    for (var n = N_CURVATURES; n < N_PREVIEW; n++) {
        put(env, after_reset, RADII_AT + n - N_CURVATURES, previews[preview].values[n]);
    }
}

// Signed angle from `a` to `b`, left positive (rad).
fn angle_between(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return arc_tangent(a.x * b.y - a.y * b.x, dot(a, b));
}
