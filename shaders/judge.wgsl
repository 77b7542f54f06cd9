// Judges the step: whether and why the episode ended, and the reward.
//
// Failure wins over a vehicle that drove into the truck, that over arrival, everything over the time limit.

@compute @workgroup_size(WORKGROUP)
fn judge(thread: Thread) {
    let env = index_of(thread);
    if is_driving(env) { judge_step(env, 0u); }
}

// The same where there are other vehicles: what the truck's hindrance of them weighs is added to the weighted sum.
@compute @workgroup_size(WORKGROUP)
fn judge_among(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    judge_step(env, cars[env * N_CAR_WORDS + MET_AT]);
    reward[env] += hindrance(env);
}

// Adds what the trailer's way over an apron weighs.
@compute @workgroup_size(WORKGROUP)
fn weigh_apron(thread: Thread) {
    let env = index_of(thread);
    if is_driving(env) { reward[env] += weights.apron * depth_on_apron(truck[env]); }
}

// How far a trailer is on an apron (m): the wheel that is furthest, of those at both ends of its axle group.
fn depth_on_apron(truck: Truck) -> f32 {
    if !has_apron(truck.route) { return 0.0; }
    let rig = vehicles[truck.vehicle].rig;
    let middle = trailer_position(rig, truck);
    let heading = direction(truck.trailer_heading);
    let across = rig.trailer_body.half_width * vec2<f32>(-heading.y, heading.x);
    return max(max(wheel_on_apron(truck.route, middle + across), wheel_on_apron(truck.route, middle - across)), 0.0);
}

// How far a wheel is on an apron (m). What the tractor keeps to ends where an apron begins; what both keep to is none.
fn wheel_on_apron(route: u32, wheel: vec2<f32>) -> f32 {
    let tractor = field_sample(unit_field_at(route, 0u), true, wheel).distance;
    let trailer = field_sample(unit_field_at(route, 1u), true, wheel).distance;
    return min(trailer, 0.0) - tractor;
}

// Judges a truck's step, with the contact that it had.
fn judge_step(env: u32, met: u32) {
    truck[env].steps += 1u;
    // The route's waypoints, and behind them the steps of each class.
    let row = params.n_vehicles + truck[env].route * (1u + params.n_classes);
    let step_limit = limits[row + 1u + limits[truck[env].vehicle]];
    let code = ending(params, limits[row], step_limit, truck[env], clearance[env], progress[env], met);
    let amounts = reward_terms(weights, clearance[env], progress[env], code);
    ended[env] = code;
    terms[env] = amounts;
    reward[env] = rewarded(weights, amounts);
}

// Why the episode ended, RUNNING when it did not.
fn ending(
    params: Params,
    n_waypoints: u32,
    step_limit: u32,
    truck: Truck,
    clearance: Clearance,
    progress: Progress,
    met: u32,
) -> u32 {
    let articulation = wrapped(truck.heading - truck.trailer_heading);
    let load_transfer_ratio = max(abs(truck.tractor_load_transfer_ratio), abs(truck.trailer_load_transfer_ratio));
    let arrived = n_waypoints <= progress.waypoint;
    if clearance.tractor <= 0.0 {
        return TRACTOR_COLLIDED;
    } else if clearance.trailer <= 0.0 {
        return TRAILER_COLLIDED;
    } else if params.rollover_ratio <= load_transfer_ratio {
        return ROLLED_OVER;
    } else if params.jackknife_angle < abs(articulation) {
        return JACKKNIFED;
    } else if TRUCKS_FAULT <= met {
        return MET_VEHICLE;
    } else if !arrived && params.stray_distance < progress.waypoint_distance {
        return STRAYED;
    } else if met != 0u {
        return WAS_MET;
    } else if arrived {
        return ARRIVED;
    } else if step_limit < truck.steps {
        return TIMED_OUT;
    }
    return RUNNING;
}

// The physical amounts that the reward weighs.
fn reward_terms(weights: Reward, clearance: Clearance, progress: Progress, code: u32) -> RewardTerms {
    let failed = code != RUNNING && code != ARRIVED && code != TIMED_OUT && code != WAS_MET;
    return RewardTerms(
        f32(progress.passed),
        min(progress.lane_distance / weights.lane_distance_limit, 1.0),
        clamp(1.0 - min(clearance.tractor, clearance.trailer) / weights.clearance_limit, 0.0, 1.0),
        select(0.0, 1.0, failed),
    );
}

// The weighted sum.
fn rewarded(weights: Reward, terms: RewardTerms) -> f32 {
    return weights.waypoint * terms.waypoints
        + weights.lane_distance * terms.lane_distance
        + weights.clearance * terms.clearance
        + weights.failure * terms.failure;
}
