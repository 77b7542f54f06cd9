// The replay buffer on a device: a ring of the latest steps of every truck, filled from the simulator's columns and
// sampled into the learner's buffers. Its twin on the host is learner/src/replay_buffer.rs. Structs and bindings are
// printed from learner/src/rollout/device/memory_kernels.rs.

// Normalises what the actor sees; a thread a value.
@compute @workgroup_size(WORKGROUP)
fn look(thread: Thread) {
    let element = index_of(thread);
    let env = element / facts.n_values;
    let value = element % facts.n_values;
    if facts.n_envs <= env { return; }
    let normal = (value_of(env, value) - values[value].mean) * values[value].factor;
    seen[element] = clamp(normal, -facts.clip, facts.clip);
}

// A value of a truck's observation, or of what stands behind it.
fn value_of(env: u32, value: u32) -> f32 {
    if value < N_VALUES { return observation[env * N_VALUES + value]; }
    let own = value - N_VALUES;
    if own < facts.n_extras { return extras[env * N_EXTRAS + own]; }
    return around[env * N_AROUND + own - facts.n_extras];
}

// Samples an action for every truck from the actor's output.
@compute @workgroup_size(WORKGROUP)
fn choose(thread: Thread) {
    let env = index_of(thread);
    if facts.n_envs <= env { return; }
    let first = env * facts.n_actions;
    var most = logits[first];
    for (var n = 1u; n < facts.n_actions; n++) {
        most = max(most, logits[first + n]);
    }
    var sum = 0.0;
    for (var n = 0u; n < facts.n_actions; n++) {
        sum += exp(logits[first + n] - most);
    }
    var left = sum * 0.5 * (signed_unit(words(facts.acting_seed, env, now.step, 0u).x) + 1.0);
    // Rounding can leave a little of the sum after the last action.
    var chosen = facts.n_actions - 1u;
    for (var n = 0u; n < facts.n_actions; n++) {
        left -= exp(logits[first + n] - most);
        if left < 0.0 {
            chosen = n;
            break;
        }
    }
    action[env] = chosen;
}

// Stores observations and actions before a step; a thread a value.
@compute @workgroup_size(WORKGROUP)
fn store_before(thread: Thread) {
    let element = index_of(thread);
    let env = element / facts.n_values;
    let value = element % facts.n_values;
    if facts.n_envs <= env { return; }
    let row = now.slot * facts.n_envs + env;
    held_observation[row * facts.n_values + value] = value_of(env, value);
    if value == 0u {
        held_action[row] = action[env];
        // A truck whose episode ends in the step is on another route after it.
        driven[env] = truck[env].route;
    }
}

// Stores what the step led to; a thread a value.
@compute @workgroup_size(WORKGROUP)
fn store_after(thread: Thread) {
    let element = index_of(thread);
    let env = element / facts.n_values;
    let value = element % facts.n_values;
    if facts.n_envs <= env { return; }
    let row = now.slot * facts.n_envs + env;
    if value < N_VALUES {
        held_next[row * facts.n_values + value] = next_observation[env * N_VALUES + value];
    } else {
        let own = value - N_VALUES;
        var seen = 0.0;
        if own < facts.n_extras {
            seen = next_extras[env * N_EXTRAS + own];
        } else {
            seen = next_around[env * N_AROUND + own - facts.n_extras];
        }
        held_next[row * facts.n_values + value] = seen;
    }
    if value == 0u {
        held_reward[row] = reward[env] + select(0.0, facts.arrival, ended[env] == ARRIVED);
        held_ended[row] = ended[env];
    }
}

// Counts the episodes that the step ended.
@compute @workgroup_size(WORKGROUP)
fn count_ends(thread: Thread) {
    let env = index_of(thread);
    if facts.n_envs <= env || ended[env] == RUNNING { return; }
    atomicAdd(&route_ends[driven[env] * N_ENDS + ended[env]], 1u);
}

// Draws the rows of a sample uniformly at random; a thread a row.
@compute @workgroup_size(WORKGROUP)
fn pick(thread: Thread) {
    let index = index_of(thread);
    if facts.n_rows <= index { return; }
    let drawn = words(facts.sampling_seed, index, now.sample, 0u);
    let slot = (now.oldest + index_below(drawn.x, now.n_ready)) % facts.n_slots;
    sampled_row[index] = slot * facts.n_envs + index_below(drawn.y, facts.n_envs);
}

// Samples the transitions at those rows: what was observed and done; a thread a value.
@compute @workgroup_size(WORKGROUP)
fn sample(thread: Thread) {
    let element = index_of(thread);
    let index = element / facts.n_values;
    let value = element % facts.n_values;
    if facts.n_rows <= index { return; }
    let drawn = drawn_at(index);
    let first = sampled_row[index];
    if value == 0u {
        var taken = held_action[first];
        if drawn.is_mirrored { taken = action_images[taken]; }
        sampled_action[index] = i32(taken);
    }
    let image = image_of(drawn, value);
    let held = held_observation[first * facts.n_values + image.index];
    sampled_observation[element] = normalised(image.factor * held, value) + noise_at(index, value);
}

// What they led to, over up to `n_steps` steps; a thread a value.
//
// The sum of rewards is R. Sutton's n-step return ("Learning to Predict by the Methods of Temporal Differences", 1988).
@compute @workgroup_size(WORKGROUP)
fn sample_next(thread: Thread) {
    let element = index_of(thread);
    let index = element / facts.n_values;
    let value = element % facts.n_values;
    if facts.n_rows <= index { return; }
    let drawn = drawn_at(index);
    var last = 0u;
    var sum = 0.0;
    var weight = 1.0;
    for (var n = 0u; n < facts.n_steps; n++) {
        last = ((drawn.slot + n) % facts.n_slots) * facts.n_envs + drawn.env;
        sum += weight * held_reward[last];
        weight *= facts.gamma;
        if held_ended[last] == TIMED_OUT { break; }
        if held_ended[last] != RUNNING {
            weight = 0.0;
            break;
        }
    }
    if value == 0u {
        sampled_reward[index] = sum * facts.reward_scale;
        sampled_discount[index] = weight;
    }
    let image = image_of(drawn, value);
    let held = held_next[last * facts.n_values + image.index];
    sampled_next[element] = normalised(image.factor * held, value) + noise_at(index, value);
}

// A transition of the sample.
struct Drawn {
    // Where it begins.
    slot: u32,
    env: u32,
    is_mirrored: bool,
}

fn drawn_at(index: u32) -> Drawn {
    let row = sampled_row[index];
    let is_mirrored = facts.mirrored == 1u && (words(facts.sampling_seed, index, now.sample, 0u).z & 1u) == 1u;
    return Drawn(row / facts.n_envs, row % facts.n_envs, is_mirrored);
}

// What a value is the mirror image of, and the factor of it.
struct Image {
    index: u32,
    factor: f32,
}

// Itself where the transition is not mirrored.
fn image_of(drawn: Drawn, value: u32) -> Image {
    if drawn.is_mirrored { return Image(values[value].image, values[value].image_factor); }
    return Image(value, 1.0);
}

// The noise of a value: the same on both observations, so that their difference stays what it is.
fn noise_at(index: u32, value: u32) -> f32 {
    return values[value].noise * signed_unit(words(facts.sampling_seed, index, now.sample, 1u + value).x);
}

// A value, normalised and clipped.
fn normalised(value: f32, index: u32) -> f32 {
    let normal = values[index];
    return clamp((value - normal.mean) * normal.factor, -facts.clip, facts.clip);
}
