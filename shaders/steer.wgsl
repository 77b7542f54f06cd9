// Turns an action into a steer angle to reach and an acceleration that holds the target speed, once a step.
//
// The speed control is a PI controller with anti-windup.

@compute @workgroup_size(WORKGROUP)
fn steer(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    let before = control[env];
    var next = asked(env);
    if disturbances.of_action == 1u {
        next = late_action(streams[env], truck[env].episode, asked_word(env), before);
    }
    next = targeted(params, next, before);
    control[env] = controlled(vehicles[truck[env].vehicle].rig, step_duration(), next, truck[env].speed, before);
    if disturbances.of_action == 1u {
        control[env].action_before = asked_word(env);
        control[env].action_earlier = before.action_before;
        control[env].action_earliest = before.action_earlier;
    }
}

// Duration of a step (s).
fn step_duration() -> f32 {
    return f32(params.n_substeps) * params.substep;
}

// Whether an action is a command, and no index.
fn is_continuous() -> bool {
    return params.n_actions == 0u;
}

// What is asked of a truck.
fn asked(env: u32) -> Action {
    if is_continuous() { return commanded(actions[0], actions[1], command[env]); }
    return actions[action[env]];
}

// What a command asks for, between what -1 and 1 do.
fn commanded(lowest: Action, highest: Action, command: Command) -> Action {
    let speed = lowest.speed + 0.5 * (command.speed + 1.0) * (highest.speed - lowest.speed);
    return Action(command.steering * highest.steering, min(speed, highest.speed));
}

// What is asked of a truck, in a word that is not 0.
fn asked_word(env: u32) -> u32 {
    if is_continuous() { return command_word(command[env]); }
    return action[env] + 1u;
}

// A command in a word: 16 bits each, rounded to a part in 32767. None of them is 0.
fn command_word(command: Command) -> u32 {
    let steering = u32(round(command.steering * HALF_RANGE) + MIDDLE);
    let speed = u32(round(command.speed * HALF_RANGE) + MIDDLE);
    return steering | (speed << 16u);
}

// The command in a word.
fn command_of(word: u32) -> Command {
    let steering = f32(word & 0xffffu) - MIDDLE;
    let speed = f32(word >> 16u) - MIDDLE;
    return Command(steering * RANGE_PART, speed * RANGE_PART);
}

// What takes effect in this step of what is asked, in a word, where actions come late: before the first one arrives the
// truck is to go straight on at the speed that it began with.
fn late_action(stream: Stream, episode: u32, asked: u32, before: Control) -> Action {
    var listed = array<u32, 4>(asked, before.action_before, before.action_earlier, before.action_earliest);
    let late = listed[action_delay(disturbances, stream, episode)];
    if late == 0u { return Action(0.0, select(before.target_speed, 0.0, params.changes_speed == 1u)); }
    if is_continuous() { return commanded(actions[0], actions[1], command_of(late)); }
    return actions[late - 1u];
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
