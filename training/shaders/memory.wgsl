// The learner's memory on the device: a ring of the latest steps of every truck, filled from the simulator's columns and drawn from into
// the learner's tensors. See src/memory.rs, whose twin it is, and src/bridge/device.rs, which declares the same buffers.

@group(0) @binding(0) var<storage, read_write> facts: Facts;
@group(0) @binding(1) var<storage, read_write> now: Now;
@group(0) @binding(2) var<storage, read_write> scaling: array<Scale>;
@group(0) @binding(3) var<storage, read_write> images: array<Image>;
@group(0) @binding(4) var<storage, read_write> action_images: array<u32>;
// The simulator's columns.
@group(0) @binding(5) var<storage, read_write> action: array<u32>;
@group(0) @binding(6) var<storage, read_write> observation: array<f32>;
@group(0) @binding(7) var<storage, read_write> next_observation: array<f32>;
@group(0) @binding(8) var<storage, read_write> ended: array<u32>;
@group(0) @binding(9) var<storage, read_write> reward: array<f32>;
// The ring, [n_slots, n_envs] of each.
@group(0) @binding(10) var<storage, read_write> held_observation: array<f32>;
@group(0) @binding(11) var<storage, read_write> held_next: array<f32>;
@group(0) @binding(12) var<storage, read_write> held_action: array<u32>;
@group(0) @binding(13) var<storage, read_write> held_reward: array<f32>;
@group(0) @binding(14) var<storage, read_write> held_ended: array<u32>;
// The actor's output, [n_envs, n_actions].
@group(0) @binding(15) var<storage, read_write> logits: array<f32>;
// A sample, [n_rows] of each.
@group(0) @binding(16) var<storage, read_write> drawn_observation: array<f32>;
@group(0) @binding(17) var<storage, read_write> drawn_action: array<i32>;
@group(0) @binding(18) var<storage, read_write> drawn_reward: array<f32>;
@group(0) @binding(19) var<storage, read_write> drawn_discount: array<f32>;
@group(0) @binding(20) var<storage, read_write> drawn_next: array<f32>;

// Draws an action for every truck from the actor's output.
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

// Keeps what the trucks see and do, before the step; a thread a value.
@compute @workgroup_size(WORKGROUP)
fn keep(thread: Thread) {
    let element = index_of(thread);
    let env = element / N_VALUES;
    if facts.n_envs <= env { return; }
    let row = now.slot * facts.n_envs + env;
    held_observation[row * N_VALUES + element % N_VALUES] = observation[element];
    if element % N_VALUES == 0u {
        held_action[row] = action[env];
    }
}

// Keeps what the step led to, after it; a thread a value.
@compute @workgroup_size(WORKGROUP)
fn remember(thread: Thread) {
    let element = index_of(thread);
    let env = element / N_VALUES;
    if facts.n_envs <= env { return; }
    let row = now.slot * facts.n_envs + env;
    held_next[row * N_VALUES + element % N_VALUES] = next_observation[element];
    if element % N_VALUES == 0u {
        held_reward[row] = reward[env];
        held_ended[row] = ended[env];
    }
}

// Draws transitions over up to `n_steps` steps, each held one as likely as the next; a thread a value.
//
// The sum of rewards is R. Sutton's n-step return ("Learning to Predict by the Methods of Temporal Differences", 1988).
@compute @workgroup_size(WORKGROUP)
fn sample(thread: Thread) {
    let element = index_of(thread);
    let index = element / N_VALUES;
    let value = element % N_VALUES;
    if facts.n_rows <= index { return; }
    let drawn = words(facts.sampling_seed, index, now.sample, 0u);
    let slot = now.oldest + index_below(drawn.x, now.n_drawable);
    let env = index_below(drawn.y, facts.n_envs);
    let first = (slot % facts.n_slots) * facts.n_envs + env;
    var last = first;
    var sum = 0.0;
    var weight = 1.0;
    for (var n = 0u; n < facts.n_steps; n++) {
        last = ((slot + n) % facts.n_slots) * facts.n_envs + env;
        sum += weight * held_reward[last];
        weight *= facts.discount;
        if held_ended[last] == TIMED_OUT { break; }
        if held_ended[last] != RUNNING {
            weight = 0.0;
            break;
        }
    }
    let in_mirror = facts.mirrored == 1u && (drawn.z & 1u) == 1u;
    if value == 0u {
        var taken = held_action[first];
        if in_mirror { taken = action_images[taken]; }
        drawn_action[index] = i32(taken);
        drawn_reward[index] = sum * facts.reward_scale;
        drawn_discount[index] = weight;
    }
    var image = Image(value, 1.0);
    if in_mirror { image = images[value]; }
    // The same noise on both, so that what changes between them stays what it is.
    let noise = scaling[value].noise * signed_unit(words(facts.sampling_seed, index, now.sample, 1u + value).x);
    drawn_observation[element] = scaled(image.factor * held_observation[first * N_VALUES + image.place], value) + noise;
    drawn_next[element] = scaled(image.factor * held_next[last * N_VALUES + image.place], value) + noise;
}

// An observed value as networks like it.
fn scaled(value: f32, index: u32) -> f32 {
    let scale = scaling[index];
    return clamp((value - scale.mean) * scale.factor, -facts.scaled_limit, facts.scaled_limit);
}
