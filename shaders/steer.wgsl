// Turns an action into what drives the truck: a steer angle to reach and an acceleration that holds the target speed.
//
// Once a step, in simulation time.

@compute @workgroup_size(WORKGROUP)
fn steer(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let env = thread_of(group, groups, local);
    if !is_driving(env) { return; }
    let duration = f32(params.n_substeps) * params.substep;
    control[env] = controlled(params.rig, duration, actions[action[env]], truck[env].speed, control[env]);
}

// The control for the next `duration` seconds of a truck at `speed` [m/s] that was controlled by `before`.
//
// Proportional-integral control of the speed. The integral is that of a small error alone, and of an answer the truck can give: whatever
// a long approach had piled up would have to be paid back by driving past the target for as long.
fn controlled(rig: Rig, duration: f32, action: Action, speed: f32, before: Control) -> Control {
    let error = action.speed - speed;
    let near = abs(error) <= rig.speed_integral_band;
    let held = select(0.0, before.speed_error_integral, near);
    let grown = select(0.0, held + error * duration, near);
    let asked = rig.speed_gain * error + rig.speed_integral_gain * grown;
    let answerable = rig.speed_braking <= asked && asked <= rig.acceleration_max;
    let speed_error_integral = select(held, grown, answerable);
    let acceleration = rig.speed_gain * error + rig.speed_integral_gain * speed_error_integral;
    return Control(action.steering, min(max(acceleration, rig.speed_braking), rig.acceleration_max), speed_error_integral);
}
