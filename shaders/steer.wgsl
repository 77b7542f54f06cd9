// Turns an action into a steer angle to reach and an acceleration that holds the target speed, once a step.
//
// The speed control is a PI controller with anti-windup.

@compute @workgroup_size(WORKGROUP)
fn steer(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    let before = control[env];
    var asked = actions[action[env]];
    if disturbances.of_action == 1u {
        asked = late_action(streams[env], truck[env].episode, action[env], before);
    }
    let next = targeted(params, asked, before);
    control[env] = controlled(vehicles[truck[env].vehicle].rig, step_duration(), next, truck[env].speed, before);
    if disturbances.of_action == 1u {
        control[env].action_before = action[env] + 1u;
        control[env].action_earlier = before.action_before;
        control[env].action_earliest = before.action_earlier;
    }
}

// Duration of a step (s).
fn step_duration() -> f32 {
    return f32(params.n_substeps) * params.substep;
}

// The action that takes effect in this step, where actions come late: before the first one arrives the truck is to go
// straight on at the speed that it began with.
fn late_action(stream: Stream, episode: u32, action: u32, before: Control) -> Action {
    var listed = array<u32, 4>(action + 1u, before.action_before, before.action_earlier, before.action_earliest);
    let index = listed[action_delay(disturbances, stream, episode)];
    if index == 0u { return Action(0.0, select(before.target_speed, 0.0, params.changes_speed == 1u)); }
    return actions[index - 1u];
}

// The action with the target speed that it leads to, from that of the control before.
fn targeted(params: Params, action: Action, before: Control) -> Action {
    let changed = min(max(before.target_speed + action.speed, params.target_speed_min), params.target_speed_max);
    return Action(action.steering, select(action.speed, changed, params.changes_speed == 1u));
}

// The control for the next `duration` seconds of a truck at `speed` (m/s) that was controlled by `before`.
//
// PI controller with anti-windup: the integral is reset to 0 while the error is large, and kept while the acceleration
// asked for is out of reach. Otherwise a long approach to the target speed would overshoot it. A target of 0 is reached
// with constant braking at last: the controller alone would never stand.
fn controlled(rig: Rig, duration: f32, action: Action, speed: f32, before: Control) -> Control {
    let error = action.speed - speed;
    let near = abs(error) <= rig.speed_integral_band;
    let held = select(0.0, before.speed_error_integral, near);
    let integrated = select(0.0, held + error * duration, near);
    let asked = rig.speed_gain * error + rig.speed_integral_gain * integrated;
    let most = drive_max(rig, speed);
    let reachable = rig.speed_braking <= asked && asked <= most;
    let speed_error_integral = select(held, integrated, reachable);
    let holds = action.speed == 0.0;
    let steady = rig.speed_gain * error + rig.speed_integral_gain * speed_error_integral;
    let acceleration = select(steady, min(steady, -HOLD_BRAKING), holds);
    return Control(
        action.steering,
        min(max(acceleration, rig.speed_braking), most),
        select(speed_error_integral, 0.0, holds),
        before.steering,
        before.steering_before,
        action.speed,
        select(0u, 1u, holds),
        before.steering_earlier,
        before.action_before,
        before.action_earlier,
        before.action_earliest,
    );
}
