// Moves the truck: a single-track tractor pulling a trailer hitched near its drive axle.
//
// Tyre slip shifts each unit's no-slip point forward by `slip * speed²`; zero slip is pure kinematics. The midpoint
// rule integrates it. Steer angle and speed change linearly within a sub-step: constant ones would cost decimetres in a
// turn.

@compute @workgroup_size(WORKGROUP)
fn drive(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    truck[env] = driven(params.rig, params.substep, params.n_substeps, control[env], truck[env]);
}

// The truck after `n_substeps` sub-steps of `substep` seconds, for which the rig's roll is discretised.
fn driven(rig: Rig, substep: f32, n_substeps: u32, control: Control, truck: Truck) -> Truck {
    var moving = Moving(truck, motion(rig, truck.speed, truck.steering, truck.heading - truck.trailer_heading));
    var tractor_ratio = 0.0;
    var trailer_ratio = 0.0;
    for (var n = 0u; n < n_substeps; n++) {
        moving = moved(rig, substep, control, moving);
        tractor_ratio = larger_in_magnitude(tractor_ratio, moving.truck.tractor_load_transfer_ratio);
        trailer_ratio = larger_in_magnitude(trailer_ratio, moving.truck.trailer_load_transfer_ratio);
    }
    var after = moving.truck;
    after.tractor_load_transfer_ratio = tractor_ratio;
    after.trailer_load_transfer_ratio = trailer_ratio;
    return after;
}

// A truck and its motion there: the end of one sub-step is the start of the next.
struct Moving {
    truck: Truck,
    motion: Motion,
}

// Motion of both units at one instant.
struct Motion {
    // Of the tractor [rad/s].
    yaw_rate: f32,
    // Of the trailer [rad/s].
    trailer_yaw_rate: f32,
    // Speed of the drive axle to the left [m/s].
    side_speed: f32,
    // Of the tractor, to the left [m/s^2].
    lateral_acceleration: f32,
    // Of the trailer's axle group, to the left [m/s^2].
    trailer_lateral_acceleration: f32,
}

// Motion of a truck with this speed [m/s], steer angle and articulation [rad].
fn motion(rig: Rig, speed: f32, steering: f32, articulation: f32) -> Motion {
    // The tyres' grip bounds the curvature.
    let curvature_max = rig.lateral_acceleration_max / max(speed * speed, SPEED_SQUARED_MIN);
    let steered = sin_cos(steering);
    let curvature = limited(steered.x / (steered.y * rig.wheelbase), curvature_max);
    let yaw_rate = speed * curvature;
    let side_speed = -limited(rig.slip * speed * abs(speed), SLIP_LEVER_MAX) * yaw_rate;
    let hitch_side_speed = side_speed + rig.fifth_wheel * yaw_rate;
    let bent = sin_cos(articulation);
    let trailer_speed = speed * bent.y - hitch_side_speed * bent.x;
    let lever = rig.trailer_wheelbase - limited(rig.slip * trailer_speed * abs(trailer_speed), SLIP_LEVER_MAX);
    let trailer_yaw_rate = (speed * bent.x + hitch_side_speed * bent.y) / lever;
    return Motion(yaw_rate, trailer_yaw_rate, side_speed, speed * yaw_rate, trailer_speed * trailer_yaw_rate);
}

// The truck one sub-step later, with its load transfer ratios there.
fn moved(rig: Rig, substep: f32, control: Control, start: Moving) -> Moving {
    let truck = start.truck;
    let turn = limited(limited(control.steering, rig.steer_max) - truck.steering, rig.steer_rate * substep);
    let steering = truck.steering + turn;
    let acceleration = min(max(control.acceleration, rig.acceleration_min), rig.acceleration_max);
    let speed = truck.speed + acceleration * substep;

    let half_step = 0.5 * substep;
    let articulation = truck.heading - truck.trailer_heading;
    let middle_speed = truck.speed + acceleration * half_step;
    let middle_articulation = articulation + half_step * (start.motion.yaw_rate - start.motion.trailer_yaw_rate);
    let mean = motion(rig, middle_speed, truck.steering + 0.5 * turn, middle_articulation);
    let ahead = direction(truck.heading + half_step * start.motion.yaw_rate);
    let velocity = vec2<f32>(middle_speed * ahead.x - mean.side_speed * ahead.y, middle_speed * ahead.y + mean.side_speed * ahead.x);

    let heading = wrapped(truck.heading + substep * mean.yaw_rate);
    let trailer_heading = wrapped(truck.trailer_heading + substep * mean.trailer_yaw_rate);
    let last = motion(rig, speed, steering, heading - trailer_heading);
    let tractor = rolled(rig.tractor_roll, vec2<f32>(truck.tractor_roll, truck.tractor_roll_rate), mean.lateral_acceleration);
    let trailer = rolled(rig.trailer_roll, vec2<f32>(truck.trailer_roll, truck.trailer_roll_rate), mean.trailer_lateral_acceleration);
    var after = truck;
    after.position = truck.position + substep * velocity;
    after.heading = heading;
    after.trailer_heading = trailer_heading;
    after.speed = speed;
    after.steering = steering;
    after.tractor_roll = tractor.x;
    after.tractor_roll_rate = tractor.y;
    after.trailer_roll = trailer.x;
    after.trailer_roll_rate = trailer.y;
    after.tractor_load_transfer_ratio = load_transfer_ratio(rig.tractor_roll, tractor, last.lateral_acceleration);
    after.trailer_load_transfer_ratio = load_transfer_ratio(rig.trailer_roll, trailer, last.trailer_lateral_acceleration);
    return Moving(after, last);
}

// A unit's (roll, roll rate) one sub-step later. The lateral acceleration of the sub-step's middle stands for its mean.
fn rolled(roll: Roll, state: vec2<f32>, lateral_acceleration: f32) -> vec2<f32> {
    let t = roll.transition;
    return vec2<f32>(
        t[0] * state.x + t[1] * state.y + roll.input[0] * lateral_acceleration,
        t[2] * state.x + t[3] * state.y + roll.input[1] * lateral_acceleration,
    );
}

// Fraction of a unit's weight that has moved to its right wheels, for its (roll, roll rate): at 1 the left ones lift.
fn load_transfer_ratio(roll: Roll, state: vec2<f32>, lateral_acceleration: f32) -> f32 {
    return roll.per_acceleration * lateral_acceleration + roll.per_roll * state.x + roll.per_roll_rate * state.y;
}

// `value` kept within `limit` of 0.
fn limited(value: f32, limit: f32) -> f32 {
    return select(select(value, limit, limit < value), -limit, value < -limit);
}

// Whichever is larger in magnitude.
fn larger_in_magnitude(a: f32, b: f32) -> f32 {
    return select(a, b, abs(a) < abs(b));
}
