// Writes the observation after the action: 69 values, see src/layout/observation.rs; and the values beside it.
//
// The first threads of a workgroup compute what is a truck's alone, one truck a thread. Then all threads write the rows
// of its trucks together, neighbouring values by neighbouring threads: ranges and previews come straight from where
// they are. Values that depend on the next waypoint alone are looked up: src/world.rs bakes them.

// Values that a thread computes: the first ones.
const N_COMPUTED: u32 = CURVATURES_AT;
// From one truck's computed values to the next one's: an odd number, so that they lie in different banks of the memory.
const COMPUTED_STRIDE: u32 = N_COMPUTED | 1u;

// The computed values of the workgroup's trucks, and the row of each one's preview in the table of roads.
var<workgroup> computed: array<f32, WORKGROUP * COMPUTED_STRIDE>;
var<workgroup> previewed: array<u32, WORKGROUP>;
// The trucks that are observed, by their index in the workgroup.
var<workgroup> listed: array<u32, WORKGROUP>;
var<workgroup> n_listed: atomic<u32>;

@compute @workgroup_size(WRITERS)
fn observe(thread: Thread) {
    let env = index_of(thread);
    clear_list(thread.local);
    if thread.local < WORKGROUP && is_driving(env) { compute(thread.local, env, as_seen(env)); }
    let n_values = n_listed_values();
    for (var n = thread.local; n < n_values; n += WRITERS) {
        let local = listed[n / N_VALUES];
        let whose = env - thread.local + local;
        next_observation[whose * N_VALUES + n % N_VALUES] = observed(local, whose, n % N_VALUES);
    }
}

// The first observation of the trucks that began another episode.
@compute @workgroup_size(WRITERS)
fn observe_after_reset(thread: Thread) {
    let env = index_of(thread);
    clear_list(thread.local);
    if thread.local < WORKGROUP && has_begun(env) { compute(thread.local, env, as_seen(env)); }
    let n_values = n_listed_values();
    for (var n = thread.local; n < n_values; n += WRITERS) {
        let local = listed[n / N_VALUES];
        let whose = env - thread.local + local;
        observation[whose * N_VALUES + n % N_VALUES] = observed(local, whose, n % N_VALUES);
    }
}

// The observation after the action, and the same as the one before the next action, where what is observed is what is.
@compute @workgroup_size(WRITERS)
fn observe_both(thread: Thread) {
    let env = index_of(thread);
    clear_list(thread.local);
    if thread.local < WORKGROUP && is_driving(env) { compute(thread.local, env, Seen(truck[env], progress[env])); }
    let n_values = n_listed_values();
    for (var n = thread.local; n < n_values; n += WRITERS) {
        let local = listed[n / N_VALUES];
        let whose = env - thread.local + local;
        let value = observed(local, whose, n % N_VALUES);
        next_observation[whose * N_VALUES + n % N_VALUES] = value;
        observation[whose * N_VALUES + n % N_VALUES] = value;
    }
}

// What is observed beside it: the extras.
@compute @workgroup_size(WORKGROUP)
fn observe_extras(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    for (var n = 0u; n < N_EXTRAS; n++) {
        next_extras[env * N_EXTRAS + n] = extra(env, n);
    }
}

// The first extras of the trucks that began another episode.
@compute @workgroup_size(WORKGROUP)
fn extras_after_reset(thread: Thread) {
    let env = index_of(thread);
    if !has_begun(env) { return; }
    for (var n = 0u; n < N_EXTRAS; n++) {
        extras[env * N_EXTRAS + n] = extra(env, n);
    }
}

// The extras after the action, and before the next one.
@compute @workgroup_size(WORKGROUP)
fn extras_both(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    for (var n = 0u; n < N_EXTRAS; n++) {
        let value = extra(env, n);
        next_extras[env * N_EXTRAS + n] = value;
        extras[env * N_EXTRAS + n] = value;
    }
}

// Lists none of the workgroup's trucks.
fn clear_list(local: u32) {
    if local == 0u { atomicStore(&n_listed, 0u); }
    workgroupBarrier();
}

// Values of all trucks that are listed, once every thread has listed its own.
fn n_listed_values() -> u32 {
    workgroupBarrier();
    return atomicLoad(&n_listed) * N_VALUES;
}

// Value `n` of the observation of the truck with index `local` in the workgroup.
fn observed(local: u32, env: u32, n: u32) -> f32 {
    if n < N_COMPUTED { return computed[local * COMPUTED_STRIDE + n]; }
    if RANGES_AT <= n && n < RADII_AT { return ranges[env * N_RAYS + n - RANGES_AT] / params.sensor_range; }
    return preview_value(previewed[local], select(n - CURVATURES_AT, n - RADII_AT + N_CURVATURES, RADII_AT <= n));
}

// Computes the first N_COMPUTED values of a truck, and lists it.
fn compute(local: u32, env: u32, as_seen: Seen) {
    listed[atomicAdd(&n_listed, 1u)] = local;
    let at = local * COMPUTED_STRIDE;
    let truck = as_seen.truck;
    let route = route_at(truck.route);
    let last = route.n_waypoints - 1u;
    let next = min(as_seen.progress.waypoint, last);
    let point = reference_point(vehicles[truck.vehicle].rig.wheelbase, truck);
    computed[at] = clamp(truck.speed / SPEED_SCALE, 0.0, 1.0);
    for (var n = 0u; n < 2u; n++) {
        let waypoint = waypoint_at(route.first + min(next + n, last));
        let normal = perpendicular(waypoint.direction);
        let left = waypoint.position + route.crossing_left * normal;
        let right = waypoint.position - route.crossing_right * normal;
        computed[at + DISTANCES_AT + n] = min(distance(point, waypoint.position) / WAYPOINT_SCALE, 1.0);
        computed[at + CROSSINGS_AT + n] = min(distance_to_segment(point, left, right) / WAYPOINT_SCALE, 1.0);
    }
    computed[at + LANE_AT] = min(as_seen.progress.lane_distance / LANE_SCALE, 1.0);
    let behind = waypoint_at(route.first + max(next, 1u) - 1u).position;
    for (var n = 0u; n < N_LOOK_AHEAD; n++) {
        let index = min(next + LOOK_AHEAD[n], last);
        let ahead = waypoint_at(route.first + index).position;
        let heading = lane_heading(route, index);
        computed[at + BEARINGS_AT + n] = angle_between(ahead - behind, point - behind) / PI;
        computed[at + HEADINGS_AT + n] = wrapped(truck.heading - heading) / PI;
        computed[at + TRAILER_HEADINGS_AT + n] = wrapped(truck.trailer_heading - heading) / PI;
    }
    computed[at + ARTICULATION_AT] = wrapped(truck.heading - truck.trailer_heading) / PI;
    previewed[local] = preview_row(route, next);
}

// One of the values beside the observation, as src/layout/extras.rs defines them: 0 where the benchmark observes fewer.
fn extra(env: u32, n: u32) -> f32 {
    let truck = truck[env];
    let rig = vehicles[truck.vehicle].rig;
    var value = 0.0;
    switch n {
        case 0u: { value = truck.steering / rig.steer_max; }
        case 1u: { value = control[env].target_speed / SPEED_SCALE; }
        case 2u: { value = truck.acceleration / ACCELERATION_SCALE; }
        case 3u: { value = truck.lateral_acceleration / G; }
        case 4u: { value = rig.trailer_wheelbase / WHEELBASE_SCALE; }
        case 5u: { value = truck.trailer_roll / ROLL_SCALE; }
        case 6u: { value = truck.trailer_roll_rate / ROLL_RATE_SCALE; }
        case 7u: { value = rig.trailer_mass / MASS_SCALE; }
        case 8u: { value = rig.rollover_threshold; }
        case 9u: { value = rig.lateral_acceleration_max / G; }
        case 10u: { value = truck.tractor_load_transfer_ratio; }
        case 11u: { value = truck.trailer_load_transfer_ratio; }
        default: {}
    }
    return select(0.0, clamp(value, -1.0, 1.0), n < params.n_extras);
}

// Signed angle from `a` to `b`, left positive (rad).
fn angle_between(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return arc_tangent(a.x * b.y - a.y * b.x, dot(a, b));
}
