// Positions on a truck, and which trucks a kernel works on.

// Middle of the trailer's axle group (m).
fn trailer_position(rig: Rig, truck: Truck) -> vec2<f32> {
    return truck.position + rig.fifth_wheel * direction(truck.heading)
        - rig.trailer_wheelbase * direction(truck.trailer_heading);
}

// Whether there is such a truck and it is not held.
fn is_driving(env: u32) -> bool {
    return env < batch.n_envs && truck[env].held == 0u;
}

// Whether there is such a truck and it has begun an episode and made no step of it.
fn has_begun(env: u32) -> bool {
    return env < batch.n_envs && truck[env].steps == 0u && truck[env].held == 0u;
}

// The first truck of a truck's group: neighbours that share a road and its vehicles.
fn first_of_group(env: u32) -> u32 {
    return env - env % batch.group;
}

// Whether there is such a truck and the caller says that it begins an episode.
fn is_to_begin(env: u32) -> bool {
    return env < batch.n_envs && (begins[env].what & BEGINS) != 0u;
}
