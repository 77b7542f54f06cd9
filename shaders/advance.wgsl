// Steers, drives and follows at once, where what is observed is what is: no other truck and no other stage comes
// between.

@compute @workgroup_size(WORKGROUP)
fn advance(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    let before = control[env];
    let wanted = targeted(params, asked(env), before);
    let next = controlled(vehicles[truck[env].vehicle].rig, step_duration(), wanted, truck[env].speed, before);
    control[env] = next;
    let after = driven(vehicles[truck[env].vehicle].rig, params.substep, params.n_substeps, next, truck[env]);
    truck[env] = after;
    let point = reference_point(vehicles[after.vehicle].rig.wheelbase, after);
    progress[env] = followed(route_at(after.route), point, progress[env].waypoint, params.stray_distance);
}
