// Follows the route: which waypoints were passed, how far off the lane centre the truck is.
//
// The point that is followed is the middle of the tractor's wheelbase.

@compute @workgroup_size(WORKGROUP)
fn follow(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let env = thread_of(group, groups, local);
    if !is_driving(env) { return; }
    let place = reference_point(params.rig.wheelbase, truck[env]);
    progress[env] = followed(routes[truck[env].route], place, progress[env].waypoint, params.stray_distance);
}

// Middle of the wheelbase [m].
fn reference_point(wheelbase: f32, truck: Truck) -> vec2<f32> {
    return truck.position + 0.5 * wheelbase * direction(truck.heading);
}

// Progress of a truck at `place` that had `next` as its next waypoint.
fn followed(route: RouteRow, place: vec2<f32>, next: u32, reach: f32) -> Progress {
    var waypoint = next;
    while waypoint < route.n_waypoints && is_passed(waypoints[route.first + waypoint], place, reach) {
        waypoint++;
    }
    let ahead = route.first + min(waypoint, route.n_waypoints - 1u);
    let behind = max(ahead, route.first + 1u) - 1u;
    return Progress(
        distance_to_segment(place, waypoints[behind].position, waypoints[ahead].position),
        distance(place, waypoints[ahead].position),
        waypoint,
        waypoint - next,
    );
}

// The place is beyond the line through the waypoint at right angles to its heading, and within reach of it.
fn is_passed(waypoint: WaypointRow, place: vec2<f32>, reach: f32) -> bool {
    let offset = place - waypoint.position;
    return 0.0 <= dot(offset, waypoint.direction) && dot(offset, offset) <= reach * reach;
}

// Distance of `place` from the segment `begin`..`end` [m].
fn distance_to_segment(place: vec2<f32>, begin: vec2<f32>, end: vec2<f32>) -> f32 {
    let along = end - begin;
    let share = dot(place - begin, along) / max(dot(along, along), TINY);
    return distance(place, begin + clamp(share, 0.0, 1.0) * along);
}
