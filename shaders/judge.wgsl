// Judges the step: whether and why the episode ended, and the reward.
//
// Failure wins over arrival, everything wins over the time limit.

@compute @workgroup_size(WORKGROUP)
fn judge(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    truck[env].steps += 1u;
    let step_limit = step_limits[truck[env].route * params.n_classes + rigs[truck[env].vehicle].class_index];
    let code = ending(params, routes[truck[env].route], step_limit, truck[env], clearance[env], progress[env]);
    let amounts = reward_terms(params, clearance[env], progress[env], code);
    ended[env] = code;
    terms[env] = amounts;
    reward[env] = rewarded(params, amounts);
}

// Why the episode ended, RUNNING when it did not.
fn ending(
    params: Params,
    route: RouteRow,
    step_limit: u32,
    truck: Truck,
    clearance: Clearance,
    progress: Progress,
) -> u32 {
    let articulation = wrapped(truck.heading - truck.trailer_heading);
    let load_transfer_ratio = max(abs(truck.tractor_load_transfer_ratio), abs(truck.trailer_load_transfer_ratio));
    let arrived = route.n_waypoints <= progress.waypoint;
    if clearance.tractor <= 0.0 {
        return TRACTOR_COLLIDED;
    } else if clearance.trailer <= 0.0 {
        return TRAILER_COLLIDED;
    } else if params.rollover_ratio <= load_transfer_ratio {
        return ROLLED_OVER;
    } else if params.jackknife_angle < abs(articulation) {
        return JACKKNIFED;
    } else if !arrived && params.stray_distance < progress.waypoint_distance {
        return STRAYED;
    } else if arrived {
        return ARRIVED;
    } else if step_limit < truck.steps {
        return TIMED_OUT;
    }
    return RUNNING;
}

// The physical amounts that the reward weighs.
fn reward_terms(params: Params, clearance: Clearance, progress: Progress, code: u32) -> RewardTerms {
    let failed = code != RUNNING && code != ARRIVED && code != TIMED_OUT;
    return RewardTerms(
        f32(progress.passed),
        min(progress.lane_distance / params.reward.lane_distance_limit, 1.0),
        clamp(1.0 - min(clearance.tractor, clearance.trailer) / params.reward.clearance_limit, 0.0, 1.0),
        select(0.0, 1.0, failed),
    );
}

// The weighted sum.
fn rewarded(params: Params, terms: RewardTerms) -> f32 {
    return params.reward.waypoint * terms.waypoints
        + params.reward.lane_distance * terms.lane_distance
        + params.reward.clearance * terms.clearance
        + params.reward.failure * terms.failure;
}
