// Turns an action into a steer angle to reach and an acceleration that holds the target speed, once a step.
//
// The speed control is a PI controller with anti-windup.

@compute @workgroup_size(WORKGROUP)
fn steer(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    let duration = f32(params.n_substeps) * params.substep;
    control[env] = controlled(rigs[truck[env].vehicle], duration, actions[action[env]], truck[env].speed, control[env]);
}

// The control for the next `duration` seconds of a truck at `speed` [m/s] that was controlled by `before`.
//
// PI controller with anti-windup: the integral is reset to 0 while the error is large, and kept while the acceleration
// asked for is out of reach. Otherwise a long approach to the target speed would overshoot it.
fn controlled(rig: Rig, duration: f32, action: Action, speed: f32, before: Control) -> Control {
    let error = action.speed - speed;
    let near = abs(error) <= rig.speed_integral_band;
    let held = select(0.0, before.speed_error_integral, near);
    let integrated = select(0.0, held + error * duration, near);
    let asked = rig.speed_gain * error + rig.speed_integral_gain * integrated;
    let most = drive_max(rig, speed);
    let reachable = rig.speed_braking <= asked && asked <= most;
    let speed_error_integral = select(held, integrated, reachable);
    let acceleration = rig.speed_gain * error + rig.speed_integral_gain * speed_error_integral;
    return Control(
        action.steering,
        min(max(acceleration, rig.speed_braking), most),
        speed_error_integral,
        before.steering,
        before.steering_before,
    );
}
