// Measures the ranges: from each sensor along its ray to the kerb.
//
// Over-relaxed sphere tracing of the field (B. Keinert et al., "Enhanced Sphere Tracing", 2014), a thread for each ray:
// a step is as long as the field's slope along the ray allows, and is taken back unless the free circles at both of its
// ends overlap.

@compute @workgroup_size(WORKGROUP)
fn sense(thread: Thread) {
    let ray = index_of(thread);
    let env = ray / N_RAYS;
    if !is_driving(env) { return; }
    ranges[ray] = range_of(env, ray % N_RAYS, truck[env].steps + 1u);
}

// The same for the trucks that began another episode.
@compute @workgroup_size(WORKGROUP)
fn sense_after_reset(thread: Thread) {
    let ray = index_of(thread);
    if !has_begun(ray / N_RAYS) { return; }
    ranges[ray] = range_of(ray / N_RAYS, ray % N_RAYS, 0u);
}

// Distance along a truck's ray to the kerb as its sensor reads it `steps` steps after the start of the episode (m).
fn range_of(env: u32, index: u32, steps: u32) -> f32 {
    if params.disturbances.of_observation == 0u { return exact_range(truck[env], index); }
    let range = exact_range(seen_truck(truck[env], poses[env * N_POSES]), index);
    let key = noise_key(streams[env], truck[env].episode);
    return reading(params.disturbances, key, steps, params.sensor_range, index, range);
}

// Distance along a truck's ray to the kerb: the sensors' range where none is met before, 0 from inside one (m).
fn exact_range(truck: Truck, index: u32) -> f32 {
    let ray = rays[rigs[truck.vehicle].chassis * N_RAYS + index];
    var position = truck.position;
    var heading = direction(truck.heading);
    if index < N_TRAILER_RAYS {
        position = trailer_position(rigs[truck.vehicle], truck);
        heading = direction(truck.trailer_heading);
    }
    let field = fields[routes[truck.route].roundabout];
    return traced(field, position + rotated(heading, ray.origin), rotated(heading, ray.direction), params.sensor_range);
}

// Within 2 cm of the exact distance, except for rays that come within 2 cm of a kerb at less than 5 deg to it.
fn traced(field: FieldRow, origin: vec2<f32>, ahead: vec2<f32>, reach: f32) -> f32 {
    // Distances along the ray of the next sample and of the start of the last accepted step, and the radius of the free
    // circle there (m).
    var along = 0.0;
    var base = 0.0;
    var free = 0.0;
    for (var n = 0u; n < SAMPLES_MAX; n++) {
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
        if met || beyond || inside { break; }
    }
    return along;
}
