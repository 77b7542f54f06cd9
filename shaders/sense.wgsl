// Measures the ranges: from each sensor along its ray to the kerb.
//
// Sphere tracing over the field, a thread a ray. A step goes as far as the slope along the ray lets hope, and is taken back unless the free
// circles at both of its ends meet.

@compute @workgroup_size(WORKGROUP)
fn sense(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let thread = thread_of(group, groups, local);
    if !is_driving(thread / N_RAYS) { return; }
    ranges[thread] = range_of(thread / N_RAYS, thread % N_RAYS);
}

// The same for the trucks that began another episode.
@compute @workgroup_size(WORKGROUP)
fn sense_begun(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let thread = thread_of(group, groups, local);
    if !has_begun(thread / N_RAYS) { return; }
    ranges[thread] = range_of(thread / N_RAYS, thread % N_RAYS);
}

// Distance along a truck's ray to the kerb: the sensors' range where none is met before, 0 from inside one [m].
fn range_of(env: u32, index: u32) -> f32 {
    let truck = truck[env];
    let ray = rays[index];
    var place = truck.position;
    var heading = direction(truck.heading);
    if index < N_TRAILER_RAYS {
        place = trailer_position(params.rig, truck);
        heading = direction(truck.trailer_heading);
    }
    let field = fields[routes[truck.route].roundabout];
    return traced(field, place + rotated(heading, ray.origin), rotated(heading, ray.direction), params.sensor_range);
}

// Within 2 cm of the exact distance, except for rays that come within 2 cm of a kerb at less than 5 deg to it.
fn traced(field: FieldRow, origin: vec2<f32>, ahead: vec2<f32>, reach: f32) -> f32 {
    // How far along the ray the next sample lies, where the last step that held began, and the radius of the free circle there [m].
    var along = 0.0;
    var base = 0.0;
    var free = 0.0;
    for (var n = 0u; n < SAMPLES_MAX; n++) {
        let sample = field_sample(field, field.first_march_cell, origin + along * ahead);
        let distance = sample.distance;
        let radius = abs(distance);
        let closing = -(ahead.x * sample.slope.x + ahead.y * sample.slope.y);

        let bridged = max(free + radius + GAP, SHORT);
        // Deep in a solid the slope may be that of its far side.
        let holds = along - base <= bridged && -CLOSE < distance;
        let near = radius <= max(MET_HEAD_ON * closing * closing, MET);
        let met = holds && near && (0.0 < closing || distance < 0.0);
        let beyond = holds && reach <= along + distance;
        let inside = along <= 0.0 && distance <= 0.0;

        // A straight kerb lies this far ahead; two circles that touch each other and the same straight kerb are that far apart.
        let to_kerb = max(min(distance / max(closing, GRAZING), SHORT), -SHORT);
        let to_circle = 2.0 * CAUTION * distance / (1.0 + max(closing, 0.0));
        let step = select(to_circle, to_kerb, met || distance < CLOSE);
        var next = select(base + free, along + step, holds);
        next = select(max(min(next, reach), 0.0), reach, beyond);
        next = select(next, 0.0, inside);

        base = select(base, along, holds);
        free = select(free, radius, holds);
        along = next;
        if met || beyond || inside { break; }
    }
    return along;
}
