// Moves the truck: a single-track tractor pulling a trailer hitched near its drive axle.
//
// Tyre slip shifts each unit's no-slip point forward by `slip * speed²`; zero slip is pure kinematics. The midpoint
// rule integrates it. Steer angle and speed change linearly within a sub-step: constant ones would cost decimetres in a
// turn.

@compute @workgroup_size(WORKGROUP)
fn drive(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    truck[env] = driven(vehicles[truck[env].vehicle].rig, params.substep, params.n_substeps, control[env], truck[env]);
}

// The truck after `n_substeps` sub-steps of `substep` seconds, for which the rig's roll is discretised.
fn driven(rig: Rig, substep: f32, n_substeps: u32, control: Control, truck: Truck) -> Truck {
    var moving = Moving(truck, motion_of(rig, truck));
    var tractor_ratio = 0.0;
    var trailer_ratio = 0.0;
    for (var n = 0u; n < n_substeps; n++) {
        var asked = control;
        asked.steering = delayed(rig.steer_delay, n, n_substeps, control);
        moving = moved(rig, substep, asked, moving);
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
    // Curvature of the tractor's steer angle, without lag and limit of grip (1/m).
    steered_curvature: f32,
    // Of the tractor (rad/s).
    yaw_rate: f32,
    // Of the trailer (rad/s).
    trailer_yaw_rate: f32,
    // Speed of the drive axle to the left (m/s).
    side_speed: f32,
    // Of the tractor, to the left (m/s^2).
    lateral_acceleration: f32,
    // Of the trailer's axle group, to the left (m/s^2).
    trailer_lateral_acceleration: f32,
}

// The steer angle that was asked for `delay` sub-steps before sub-step `n` of the step, at most three steps ago (rad).
fn delayed(delay: u32, n: u32, n_substeps: u32, control: Control) -> f32 {
    if delay <= n {
        return control.steering;
    } else if delay <= n + n_substeps {
        return control.steering_before;
    } else if delay <= n + 2u * n_substeps {
        return control.steering_earlier;
    }
    return control.steering_earliest;
}

// Motion of a truck.
fn motion_of(rig: Rig, truck: Truck) -> Motion {
    let curvature = steered_curvature(rig, truck.steering, truck.speed);
    let articulation = truck.heading - truck.trailer_heading;
    return motion(rig, truck, truck.speed, curvature, truck.curvature_lag, truck.acceleration, articulation);
}

// Curvature of the path that the tractor's wheels lead to at a steer angle (rad) and a speed (m/s), without lag (1/m).
fn steered_curvature(rig: Rig, steering: f32, speed: f32) -> f32 {
    let steered = sin_cos(steering);
    return steered.x / (steered.y * steered_wheelbase(rig, speed));
}

// Wheelbase as which the tractor steers at a speed (m/s) (m).
fn steered_wheelbase(rig: Rig, speed: f32) -> f32 {
    // Oversteer ends in a spin, which is not modelled.
    return max(rig.wheelbase + rig.understeer * (speed * speed), WHEELBASE_MIN * rig.wheelbase);
}

// Strongest drive at a speed (m/s^2).
fn drive_max(rig: Rig, speed: f32) -> f32 {
    return min(rig.acceleration_max, rig.power / max(speed, POWER_SPEED_MIN));
}

// Motion of a truck with this speed (m/s), curvature of the steer angle and deviation from it (1/m), acceleration
// (m/s^2) and articulation (rad), where it leans as `leaning` does.
fn motion(
    rig: Rig,
    leaning: Truck,
    speed: f32,
    steered_curvature: f32,
    curvature_lag: f32,
    acceleration: f32,
    articulation: f32,
) -> Motion {
    // The tyres' grip bounds the curvature.
    let grip = rig.lateral_acceleration_max * sqrt(max(1.0 - rig.friction_ellipse * acceleration * acceleration, 0.0));
    let curvature = limited(steered_curvature + curvature_lag, grip / max(speed * speed, SPEED_SQUARED_MIN));
    let yaw_rate = speed * curvature;
    let lateral_acceleration = speed * yaw_rate;
    let slip = slips(rig, leaning, lateral_acceleration);
    let side_speed = -limited(slip.x * speed * abs(speed), rig.slip_lever_max) * yaw_rate;
    let hitch_side_speed = side_speed + rig.fifth_wheel * yaw_rate;
    let bent = sin_cos(articulation);
    let trailer_speed = speed * bent.y - hitch_side_speed * bent.x;
    let lever = rig.trailer_wheelbase - limited(slip.y * trailer_speed * abs(trailer_speed), rig.slip_lever_max);
    let trailer_yaw_rate = (speed * bent.x + hitch_side_speed * bent.y) / lever;
    return Motion(
        steered_curvature,
        yaw_rate,
        trailer_yaw_rate,
        side_speed,
        lateral_acceleration,
        trailer_speed * trailer_yaw_rate,
    );
}

// Slip of both units' tyres, which lose stiffness as load moves to the outer ones (rad/(m/s^2)), at a lateral
// acceleration of the tractor (m/s^2).
fn slips(rig: Rig, leaning: Truck, lateral_acceleration: f32) -> vec2<f32> {
    // The same numbers as below, sooner.
    if rig.slip_growth == 0.0 { return vec2<f32>(rig.slip); }
    let tractor = vec2<f32>(leaning.tractor_roll, leaning.tractor_roll_rate);
    let trailer = vec2<f32>(leaning.trailer_roll, leaning.trailer_roll_rate);
    let ratios = load_transfer_ratios(rig, tractor, trailer, lateral_acceleration, leaning.lateral_acceleration);
    return rig.slip * (1.0 + rig.slip_growth * abs(ratios));
}

// Load transfer ratios of tractor and trailer with these (roll, roll rate) and lateral accelerations (m/s^2). The
// trailer leans on the tractor by the fifth wheel.
fn load_transfer_ratios(
    rig: Rig,
    tractor: vec2<f32>,
    trailer: vec2<f32>,
    lateral_acceleration: f32,
    trailer_lateral_acceleration: f32,
) -> vec2<f32> {
    let own = load_transfer_ratio(rig.tractor_roll, tractor, lateral_acceleration + rig.crossfall);
    let trailers = load_transfer_ratio(rig.trailer_roll, trailer, trailer_lateral_acceleration + rig.crossfall);
    return vec2<f32>(own + rig.fifth_wheel_load * (trailers - own), trailers);
}

// The deviation of the path's curvature from the steer angle's, `duration` seconds after it was `lag`, where the steer
// angle's changes by `rise` in that time (1/m).
//
// The tractor's yaw follows its front wheels with the time constant `yaw_lag * speed`: tyres build up lateral force
// only as slip angles grow. The exponential is its Padé approximant, which is stable at any speed.
fn lagging(rig: Rig, speed: f32, lag: f32, rise: f32, duration: f32) -> f32 {
    let time = rig.yaw_lag * abs(speed);
    let left = time * time / (time * time + duration * time + 0.5 * duration * duration);
    let settled = -rise / duration * time;
    return settled + (lag - settled) * left;
}

// The truck one sub-step later, with its load transfer ratios there.
fn moved(rig: Rig, substep: f32, control: Control, start: Moving) -> Moving {
    let truck = start.truck;
    let turn = limited(limited(control.steering, rig.steer_max) - truck.steering, rig.steer_rate * substep);
    let steering = truck.steering + turn;
    let asked = min(max(control.acceleration, rig.acceleration_min), drive_max(rig, truck.speed));
    var response = rig.drive_lag;
    if asked < 0.0 { response = rig.brake_lag; }
    var acceleration = asked + response.left * (truck.acceleration - asked);
    var mean_acceleration = asked + response.mean * (truck.acceleration - asked);
    var speed = truck.speed + mean_acceleration * substep;
    // Brakes that act late stop a truck. They do not drive it backwards.
    let may_stop = control.holds == 1u || 0.0 < truck.speed;
    if may_stop && truck.speed * speed <= 0.0 {
        acceleration = 0.0;
        mean_acceleration = -truck.speed / substep;
        speed = 0.0;
    }

    let half_step = 0.5 * substep;
    let articulation = truck.heading - truck.trailer_heading;
    let middle_speed = truck.speed + mean_acceleration * half_step;
    let middle_articulation = articulation + half_step * (start.motion.yaw_rate - start.motion.trailer_yaw_rate);
    let middle_curvature = steered_curvature(rig, truck.steering + 0.5 * turn, middle_speed);
    let rise = middle_curvature - start.motion.steered_curvature;
    let middle_lag = lagging(rig, middle_speed, truck.curvature_lag, rise, half_step);
    let mean = motion(rig, truck, middle_speed, middle_curvature, middle_lag, mean_acceleration, middle_articulation);
    let ahead = direction(truck.heading + half_step * start.motion.yaw_rate);
    let velocity = vec2<f32>(
        middle_speed * ahead.x - mean.side_speed * ahead.y,
        middle_speed * ahead.y + mean.side_speed * ahead.x,
    );

    let heading = wrapped(truck.heading + substep * mean.yaw_rate);
    let trailer_heading = wrapped(truck.trailer_heading + substep * mean.trailer_yaw_rate);
    let curvature = steered_curvature(rig, steering, speed);
    let curvature_lag =
        lagging(rig, middle_speed, truck.curvature_lag, curvature - start.motion.steered_curvature, substep);
    let last = motion(rig, truck, speed, curvature, curvature_lag, acceleration, heading - trailer_heading);
    let tractor_state = vec2<f32>(truck.tractor_roll, truck.tractor_roll_rate);
    let tractor = rolled(rig.tractor_roll, tractor_state, mean.lateral_acceleration + rig.crossfall);
    let trailer_state = vec2<f32>(truck.trailer_roll, truck.trailer_roll_rate);
    let trailer = rolled(rig.trailer_roll, trailer_state, mean.trailer_lateral_acceleration + rig.crossfall);
    let ratios =
        load_transfer_ratios(rig, tractor, trailer, last.lateral_acceleration, last.trailer_lateral_acceleration);
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
    after.tractor_load_transfer_ratio = ratios.x;
    after.trailer_load_transfer_ratio = ratios.y;
    after.acceleration = acceleration;
    after.curvature_lag = curvature_lag;
    after.lateral_acceleration = last.trailer_lateral_acceleration;
    return Moving(after, last);
}

// The truck as it leans once it has turned for long with its steer angle and speed.
fn settled(rig: Rig, truck: Truck) -> Truck {
    let motion = motion_of(rig, truck);
    let tractor = vec2<f32>(settled_roll(rig.tractor_roll, motion.lateral_acceleration + rig.crossfall), 0.0);
    let trailer = vec2<f32>(settled_roll(rig.trailer_roll, motion.trailer_lateral_acceleration + rig.crossfall), 0.0);
    let ratios = load_transfer_ratios(
        rig,
        tractor,
        trailer,
        motion.lateral_acceleration,
        motion.trailer_lateral_acceleration,
    );
    var after = truck;
    after.tractor_roll = tractor.x;
    after.trailer_roll = trailer.x;
    after.tractor_load_transfer_ratio = ratios.x;
    after.trailer_load_transfer_ratio = ratios.y;
    after.lateral_acceleration = motion.trailer_lateral_acceleration;
    return after;
}

// The roll that a unit comes to rest at under a constant lateral acceleration (rad): one at which its rate stays 0.
fn settled_roll(roll: Roll, lateral_acceleration: f32) -> f32 {
    return -roll.input[1] * lateral_acceleration / roll.transition[2];
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
