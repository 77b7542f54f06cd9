// Writes the observation: the 69 values that a driver sees.
//
// What depends on the waypoint alone was worked out when the world was baked (see src/world.rs).

@compute @workgroup_size(WORKGROUP)
fn observe(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let env = thread_of(group, groups, local);
    if !is_driving(env) { return; }
    observed(env, false);
}

// What the trucks that began another episode see there.
@compute @workgroup_size(WORKGROUP)
fn observe_begun(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let env = thread_of(group, groups, local);
    if !has_begun(env) { return; }
    observed(env, true);
}

// Writes one of a truck's values: to what the next action sees if its episode has just begun, else to what the last one led to.
fn put(env: u32, begun: bool, index: u32, value: f32) {
    if begun {
        observation[env * N_VALUES + index] = value;
    } else {
        next_observation[env * N_VALUES + index] = value;
    }
}

// The 69 values.
fn observed(env: u32, begun: bool) {
    let truck = truck[env];
    let route = routes[truck.route];
    let last = route.n_waypoints - 1u;
    let next = min(progress[env].waypoint, last);
    let place = reference_point(params.rig.wheelbase, truck);
    put(env, begun, 0u, clamp(truck.speed / SPEED_SCALE, 0.0, 1.0));
    for (var n = 0u; n < 2u; n++) {
        let waypoint = waypoints[route.first + min(next + n, last)];
        let normal = perpendicular(waypoint.direction);
        let left = waypoint.position + route.crossing_left * normal;
        let right = waypoint.position - route.crossing_right * normal;
        put(env, begun, DISTANCES_AT + n, min(distance(place, waypoint.position) / WAYPOINT_SCALE, 1.0));
        put(env, begun, CROSSINGS_AT + n, min(distance_to_segment(place, left, right) / WAYPOINT_SCALE, 1.0));
    }
    put(env, begun, LANE_AT, min(progress[env].lane_distance / LANE_SCALE, 1.0));
    let behind = waypoints[route.first + max(next, 1u) - 1u].position;
    for (var n = 0u; n < N_LOOK_AHEAD; n++) {
        let index = route.first + min(next + LOOK_AHEAD[n], last);
        let heading = previews[index].heading;
        put(env, begun, BEARINGS_AT + n, angle_between(waypoints[index].position - behind, place - behind) / PI);
        put(env, begun, HEADINGS_AT + n, wrapped(truck.heading - heading) / PI);
        put(env, begun, TRAILER_HEADINGS_AT + n, wrapped(truck.trailer_heading - heading) / PI);
    }
    put(env, begun, ARTICULATION_AT, wrapped(truck.heading - truck.trailer_heading) / PI);
    let preview = route.first + next;
    for (var n = 0u; n < N_CURVATURES; n++) {
        put(env, begun, CURVATURES_AT + n, previews[preview].values[n]);
    }
    for (var n = 0u; n < N_RAYS; n++) {
        put(env, begun, RANGES_AT + n, ranges[env * N_RAYS + n] / params.sensor_range);
    }
    for (var n = N_CURVATURES; n < N_PREVIEW; n++) {
        put(env, begun, RADII_AT + n - N_CURVATURES, previews[preview].values[n]);
    }
}

// Signed angle from `a` to `b`, left positive [rad].
fn angle_between(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return arc_tangent(a.x * b.y - a.y * b.x, dot(a, b));
}
