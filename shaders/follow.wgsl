// Follows the route: which waypoints were passed, and the distance to the lane centre.
//
// The reference point is the middle of the tractor's wheelbase.

@compute @workgroup_size(WORKGROUP)
fn follow(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    let point = reference_point(vehicles[truck[env].vehicle].rig.wheelbase, truck[env]);
    progress[env] = followed(route_at(truck[env].route), point, progress[env].waypoint, params.stray_distance);
    if disturbances.of_observation == 1u { perceive(env, truck[env].steps + 1u); }
}

// Middle of the wheelbase (m).
fn reference_point(wheelbase: f32, truck: Truck) -> vec2<f32> {
    return truck.position + 0.5 * wheelbase * direction(truck.heading);
}

// Progress of a truck at `point` that had `next` as its next waypoint.
fn followed(route: Route, point: vec2<f32>, next: u32, reach: f32) -> Progress {
    var waypoint = next;
    while waypoint < route.n_waypoints && is_passed(waypoint_at(route.first + waypoint), point, reach) {
        waypoint++;
    }
    let ahead = route.first + min(waypoint, route.n_waypoints - 1u);
    let behind = max(ahead, route.first + 1u) - 1u;
    return Progress(
        distance_to_segment(point, waypoint_at(behind).position, waypoint_at(ahead).position),
        distance(point, waypoint_at(ahead).position),
        waypoint,
        waypoint - next,
    );
}

// Whether the point is beyond the line through the waypoint at right angles to its heading, and within reach of it.
fn is_passed(waypoint: WaypointRow, point: vec2<f32>, reach: f32) -> bool {
    let offset = point - waypoint.position;
    return 0.0 <= dot(offset, waypoint.direction) && dot(offset, offset) <= reach * reach;
}

// Distance of `point` from the segment `begin`..`end` (m).
fn distance_to_segment(point: vec2<f32>, begin: vec2<f32>, end: vec2<f32>) -> f32 {
    let along = end - begin;
    let fraction = dot(point - begin, along) / max(dot(along, along), TINY);
    return distance(point, begin + clamp(fraction, 0.0, 1.0) * along);
}
