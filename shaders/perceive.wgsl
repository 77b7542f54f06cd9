// What a policy is told of a truck where that differs from what is: its pose late and off, its sensors noisy, its route
// misplaced.
//
// Collisions, progress and reward go by what is. Every number is a function of (seed, env, episode, step).

// What the trucks that began another episode are first seen as.
@compute @workgroup_size(WORKGROUP)
fn perceive_after_reset(thread: Thread) {
    let env = index_of(thread);
    if disturbances.of_observation == 0u || !has_begun(env) { return; }
    perceive(env, 0u);
}

// Keeps the pose that the truck has `steps` steps after the start of its episode, and says which one is observed.
fn perceive(env: u32, steps: u32) {
    let now = pose_of(truck[env], progress[env]);
    let first = env * N_POSES;
    var listed = array<Pose, N_POSES>(now, now, now, now);
    if steps != 0u {
        for (var n = 1u; n < N_POSES; n++) {
            listed[n] = poses[first + n];
        }
    }
    let delay = observation_delay(disturbances, streams[env], truck[env].episode);
    poses[first] = misplaced(disturbances, streams[env], truck[env].episode, steps, listed[delay]);
    for (var n = 1u; n < N_POSES; n++) {
        poses[first + n] = listed[n - 1u];
    }
}

fn pose_of(truck: Truck, progress: Progress) -> Pose {
    return Pose(truck.position, truck.heading, truck.trailer_heading, truck.speed, progress.waypoint);
}

// Age of what is observed in an episode (steps).
fn observation_delay(disturbances: Disturbances, stream: Stream, episode: u32) -> u32 {
    let word = words(stream.seed, stream.env, episode, DRAW_DELAYS).x;
    return disturbances.observation_delay + index_below(word, disturbances.n_observation_delays);
}

// By how many steps actions come late in an episode.
fn action_delay(disturbances: Disturbances, stream: Stream, episode: u32) -> u32 {
    let word = words(stream.seed, stream.env, episode, DRAW_DELAYS).y;
    return disturbances.action_delay + index_below(word, disturbances.n_action_delays);
}

// A pose with the errors that it has in an episode, and in a step of it.
fn misplaced(disturbances: Disturbances, stream: Stream, episode: u32, steps: u32, pose: Pose) -> Pose {
    let place = words(stream.seed, stream.env, episode, DRAW_DELAYS);
    let others = words(stream.seed, stream.env, episode, DRAW_OFFSETS);
    let key = noise_key(stream, episode);
    let offset = disturbances.position_offset * vec2<f32>(signed_unit(place.z), signed_unit(place.w));
    let shaken = vec2<f32>(noise(key, steps, POSITION_NOISE), noise(key, steps, POSITION_NOISE + 1u));
    let shake = disturbances.position_noise * shaken;
    let turn = disturbances.heading_offset * signed_unit(others.x);
    var after = pose;
    after.position = pose.position + offset + shake;
    after.heading = wrapped(pose.heading + turn + disturbances.heading_noise * noise(key, steps, HEADING_NOISE));
    after.trailer_heading =
        wrapped(pose.trailer_heading + turn + disturbances.heading_noise * noise(key, steps, HEADING_NOISE + 1u));
    return after;
}

// The truck at the pose that is observed.
fn seen_truck(truck: Truck, pose: Pose) -> Truck {
    var after = truck;
    after.position = pose.position;
    after.heading = pose.heading;
    after.trailer_heading = pose.trailer_heading;
    after.speed = pose.speed;
    return after;
}

// A truck and its progress.
struct Seen {
    truck: Truck,
    progress: Progress,
}

// The truck and its progress as they are observed.
fn as_seen(env: u32) -> Seen {
    if disturbances.of_observation == 0u { return Seen(truck[env], progress[env]); }
    return seen(env);
}

// The same where they differ from what they are: on a route that lies where the policy takes it to lie.
fn seen(env: u32) -> Seen {
    let others = words(streams[env].seed, streams[env].env, truck[env].episode, DRAW_OFFSETS);
    let pose = poses[env * N_POSES];
    var misled = seen_truck(truck[env], pose);
    misled.position =
        misled.position - disturbances.map_offset * vec2<f32>(signed_unit(others.y), signed_unit(others.z));
    let point = reference_point(vehicles[misled.vehicle].rig.wheelbase, misled);
    // An error may put it before the waypoint that it has passed last.
    let next = max(pose.waypoint, 2u) - 1u;
    return Seen(misled, followed(route_at(misled.route), point, next, params.stray_distance));
}

// A ray's range as its sensor reads it `steps` steps after the start of an episode (m).
fn reading(disturbances: Disturbances, key: vec4<u32>, steps: u32, reach: f32, ray: u32, range: f32) -> f32 {
    let noisy = range + disturbances.range_noise * noise(key, steps, ray);
    let word = words(key.z, key.w, steps, ray).x;
    let is_dropped = signed_unit(word) < 2.0 * disturbances.dropped_rays - 1.0;
    return select(min(max(noisy, 0.0), reach), reach, is_dropped);
}

// The key of an episode's noise.
fn noise_key(stream: Stream, episode: u32) -> vec4<u32> {
    return words(stream.seed, stream.env, episode, DRAW_NOISE);
}

// A number of an episode's and step's noise.
fn noise(key: vec4<u32>, steps: u32, index: u32) -> f32 {
    return normal(words(key.x, key.y, steps, index));
}
