// Measures the ranges: from each sensor along its ray to the kerb.
//
// Over-relaxed sphere tracing of the field (B. Keinert et al., "Enhanced Sphere Tracing", 2014): a step is as long as
// the field's slope along the ray allows, and is taken back unless the free circles at both of its ends overlap.
//
// A ray takes 2 to 40 samples, and threads that step together wait for the longest one. So a workgroup shares the rays
// of a team of trucks: a thread whose ray has ended takes the next one that waits.

// The trucks of the team that are sensed, and how many they are.
var<workgroup> sensed_trucks: array<u32, TEAM_MAX>;
var<workgroup> n_sensed: atomic<u32>;
// Position and direction of each of their units, as they are observed: trailer, tractor; vehicles and fields.
var<workgroup> unit_poses: array<vec4<f32>, 2u * TEAM_MAX>;
var<workgroup> team_vehicles: array<u32, TEAM_MAX>;
var<workgroup> team_fields: array<FieldRow, TEAM_MAX>;
// Rays that have been taken.
var<workgroup> n_taken: atomic<u32>;

@compute @workgroup_size(WORKGROUP)
fn sense(thread: Thread) {
    let env = first_of_team(thread) + thread.local;
    place(thread.local, thread.local < batch.team && is_driving(env), env);
    trace_all(1u);
}

// The same for the trucks that began another episode.
@compute @workgroup_size(WORKGROUP)
fn sense_after_reset(thread: Thread) {
    let env = first_of_team(thread) + thread.local;
    place(thread.local, thread.local < batch.team && has_begun(env), env);
    trace_all(0u);
}

// The first truck of the workgroup's team.
fn first_of_team(thread: Thread) -> u32 {
    return (thread.group.y * thread.groups.x + thread.group.x) * batch.team;
}

// Lists the trucks that are sensed and places their units, one truck a thread.
fn place(local: u32, sensed: bool, env: u32) {
    if local == 0u {
        atomicStore(&n_sensed, 0u);
        atomicStore(&n_taken, 0u);
    }
    workgroupBarrier();
    if sensed {
        let at = atomicAdd(&n_sensed, 1u);
        var truck = truck[env];
        if disturbances.of_observation == 1u { truck = seen_truck(truck, poses[env * N_POSES]); }
        let trailer = trailer_position(vehicles[truck.vehicle].rig, truck);
        sensed_trucks[at] = env;
        unit_poses[2u * at] = vec4<f32>(trailer, direction(truck.trailer_heading));
        unit_poses[2u * at + 1u] = vec4<f32>(truck.position, direction(truck.heading));
        team_vehicles[at] = truck.vehicle;
        team_fields[at] = field_at(truck.route);
    }
    workgroupBarrier();
}

// What the sensor of ray `n` of truck `env` reads at a distance to the kerb (m), `ahead_by` steps after those that the
// truck has counted.
fn read_off(env: u32, n: u32, distance: f32, ahead_by: u32) -> f32 {
    if disturbances.of_observation == 0u { return distance; }
    let key = noise_key(streams[env], truck[env].episode);
    return reading(disturbances, key, truck[env].steps + ahead_by, params.sensor_range, n, distance);
}

// Distance along every ray of the team to the kerb: the sensors' range where none is met before, 0 from inside one (m).
// Within 2 cm of the exact distance, except for rays that come within 2 cm of a kerb at less than 5 deg to it.
fn trace_all(ahead_by: u32) {
    let n_rays = atomicLoad(&n_sensed) * N_RAYS;
    let reach = params.sensor_range;
    var ray = n_rays;
    var field = FieldRow();
    var origin = vec2<f32>(0.0);
    var ahead = vec2<f32>(0.0);
    // Distances along the ray of the next sample and of the start of the last accepted step, the radius of the free
    // circle there (m), and samples taken.
    var along = 0.0;
    var base = 0.0;
    var free = 0.0;
    var n_samples = 0u;
    loop {
        if ray == n_rays {
            ray = atomicAdd(&n_taken, 1u);
            if n_rays <= ray { break; }
            let whose = ray / N_RAYS;
            let mount = vehicles[team_vehicles[whose]].rays[ray % N_RAYS];
            let pose = unit_poses[2u * whose + select(1u, 0u, ray % N_RAYS < N_TRAILER_RAYS)];
            field = team_fields[whose];
            origin = pose.xy + rotated(pose.zw, mount.origin);
            ahead = rotated(pose.zw, mount.direction);
            along = 0.0;
            base = 0.0;
            free = 0.0;
            n_samples = 0u;
        }
        let sample = field_sample(field, false, origin + along * ahead);
        let distance = sample.distance;
        let radius = abs(distance);
        let closing = -(ahead.x * sample.slope.x + ahead.y * sample.slope.y);

        let bridged = max(free + radius + RAY_GAP, RAY_SHORT);
        // Deep in a solid the slope may be that of its far side.
        let accepted = along - base <= bridged && -RAY_CLOSE < distance;
        let near = radius <= max(RAY_MET_HEAD_ON * closing * closing, RAY_MET);
        let met = accepted && near && (0.0 < closing || distance < 0.0);
        let beyond = accepted && reach <= along + distance;
        let inside = along <= 0.0 && distance <= 0.0;

        // Distance to a straight kerb; and between two circles that touch each other and the same straight kerb.
        let to_kerb = max(min(distance / max(closing, RAY_GRAZING), RAY_SHORT), -RAY_SHORT);
        let to_circle = 2.0 * CAUTION * distance / (1.0 + max(closing, 0.0));
        let step = select(to_circle, to_kerb, met || distance < RAY_CLOSE);
        var next = select(base + free, along + step, accepted);
        next = select(max(min(next, reach), 0.0), reach, beyond);
        next = select(next, 0.0, inside);

        base = select(base, along, accepted);
        free = select(free, radius, accepted);
        along = next;
        n_samples++;
        if met || beyond || inside || n_samples == SAMPLES_MAX {
            let env = sensed_trucks[ray / N_RAYS];
            ranges[env * N_RAYS + ray % N_RAYS] = read_off(env, ray % N_RAYS, along, ahead_by);
            ray = n_rays;
        }
    }
}
