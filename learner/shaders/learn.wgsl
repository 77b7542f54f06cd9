// An update of soft actor-critic on a device, but for its products of matrices. Its twin on the processor is
// learner/src/sac/gradients.rs. Structs, bindings and constants are printed from learner/src/sac/device/kernels.rs.

// What the threads of a workgroup add up.
var<workgroup> parts: array<vec4<f32>, WORKGROUP>;

// Copies a sample's observations to the passes' inputs; a thread a value.
@compute @workgroup_size(WORKGROUP)
fn gather(thread: Thread) {
    let element = index_of(thread);
    let n = facts.n_rows * facts.n_values;
    if n <= element { return; }
    memory[facts.observations + element] = observation[element];
    memory[facts.observations + n + element] = next_observation[element];
}

// Normalises a hidden layer's sums to mean 0 and variance 1 along each row, and rectifies them; a workgroup a row.
@compute @workgroup_size(WORKGROUP)
fn normalise(thread: Thread) {
    let index = thread.group.y * thread.groups.x + thread.group.x;
    let norm = norms[min(index / norms[0].n_rows, N_NORMS - 1u)];
    let row = index % norm.n_rows;
    let first = row * norm.width;
    // Groups beyond the last one do its work again, and write nothing.
    let is_last = N_NORMS * norm.n_rows <= index;
    var sum = 0.0;
    for (var n = thread.local; n < norm.width; n += WORKGROUP) {
        sum += memory[norm.values + first + n];
    }
    let mean = added(thread.local, vec4<f32>(sum, 0.0, 0.0, 0.0)).x / f32(norm.width);
    var squares = 0.0;
    for (var n = thread.local; n < norm.width; n += WORKGROUP) {
        let value = memory[norm.values + first + n] - mean;
        squares += value * value;
    }
    let variance = added(thread.local, vec4<f32>(squares, 0.0, 0.0, 0.0)).x / f32(norm.width);
    let factor = 1.0 / sqrt(variance + NORM_EPSILON);
    if is_last { return; }
    for (var n = thread.local; n < norm.width; n += WORKGROUP) {
        let value = (memory[norm.values + first + n] - mean) * factor;
        memory[norm.values + first + n] = value;
        memory[norm.activations + first + n] = max(value * memory[norm.scale + n] + memory[norm.shift + n], 0.0);
    }
    if thread.local == 0u { memory[norm.factors + row] = factor; }
}

// Gradients by a normalisation's scale and shift: sums over the rows. A workgroup has BESIDE columns, and a thread
// every so many rows of one.
@compute @workgroup_size(WORKGROUP)
fn sum_norms(thread: Thread) {
    let index = thread.group.y * thread.groups.x + thread.group.x;
    let n_groups = (norms[0].width + BESIDE - 1u) / BESIDE;
    let norm = norms[min(index / n_groups, N_CRITICS - 1u)];
    let column = index % n_groups * BESIDE + thread.local % BESIDE;
    let is_inside = column < norm.width && index < N_CRITICS * n_groups;
    var by_scale = 0.0;
    var by_shift = 0.0;
    if is_inside {
        for (var row = thread.local / BESIDE; row < norm.n_rows; row += WORKGROUP / BESIDE) {
            let at = row * norm.width + column;
            if 0.0 < memory[norm.activations + at] {
                by_scale += memory[norm.errors + at] * memory[norm.values + at];
                by_shift += memory[norm.errors + at];
            }
        }
    }
    parts[thread.local] = vec4<f32>(by_scale, by_shift, 0.0, 0.0);
    workgroupBarrier();
    if is_inside && thread.local < BESIDE {
        var sums = parts[thread.local];
        for (var n = thread.local + BESIDE; n < WORKGROUP; n += BESIDE) {
            sums += parts[n];
        }
        memory[norm.by_scale + column] = sums.x;
        memory[norm.by_shift + column] = sums.y;
    }
}

// From the gradients by what a rectifier left to those by the sums before its normalisation; a workgroup a row.
@compute @workgroup_size(WORKGROUP)
fn normalise_back(thread: Thread) {
    let index = thread.group.y * thread.groups.x + thread.group.x;
    let norm = norms[min(index / norms[0].n_rows, N_CRITICS - 1u)];
    let row = index % norm.n_rows;
    let first = row * norm.width;
    let is_last = N_CRITICS * norm.n_rows <= index;
    var sums = vec4<f32>();
    for (var n = thread.local; n < norm.width; n += WORKGROUP) {
        if 0.0 < memory[norm.activations + first + n] {
            let gradient = memory[norm.errors + first + n] * memory[norm.scale + n];
            sums.x += gradient;
            sums.y += gradient * memory[norm.values + first + n];
        }
    }
    let means = added(thread.local, sums) / f32(norm.width);
    if is_last { return; }
    let factor = memory[norm.factors + row];
    for (var n = thread.local; n < norm.width; n += WORKGROUP) {
        let at = first + n;
        var gradient = 0.0;
        if 0.0 < memory[norm.activations + at] { gradient = memory[norm.errors + at] * memory[norm.scale + n]; }
        memory[norm.errors + at] = factor * (gradient - means.x - memory[norm.values + at] * means.y);
    }
}

// Losses of a transition and their gradients by the networks' outputs; a thread a transition.
@compute @workgroup_size(WORKGROUP)
fn find_errors(thread: Thread) {
    let row = index_of(thread);
    if facts.n_rows <= row { return; }
    let alpha = exp(memory[facts.entropy]);

    // TD target: the soft value of the next observation is an expectation over the policy's actions.
    let next = softmax_of(ACTOR_NEXT, row);
    let target_alpha = select(0.0, alpha, facts.entropy_in_target == 1u);
    var next_value = 0.0;
    for (var n = 0u; n < facts.n_actions; n++) {
        let log_prob = memory[output(ACTOR_NEXT, row) + n] - next;
        let q = combined(memory[output(TARGET_1, row) + n], memory[output(TARGET_2, row) + n]);
        next_value += exp(log_prob) * (q - target_alpha * log_prob);
    }
    let target_value = reward[row] + discount[row] * next_value;

    // Critics: squared TD error of the action taken.
    let scale = 1.0 / f32(facts.n_rows);
    let taken = u32(action[row]);
    let first = memory[output(CRITIC_1, row) + taken];
    let second = memory[output(CRITIC_2, row) + taken];
    let errors = vec2<f32>(first, second) - target_value;
    let value = 0.5 * (first + second);
    td_error[row] = abs(value - target_value);

    // Actor: the critics' values and some entropy. The values are constants here.
    let current = softmax_of(ACTOR, row);
    var mean = 0.0;
    var entropy = 0.0;
    for (var n = 0u; n < facts.n_actions; n++) {
        let log_prob = memory[output(ACTOR, row) + n] - current;
        let prob = exp(log_prob);
        mean += prob * cost_of(row, n, alpha, log_prob);
        entropy -= prob * log_prob;
    }
    for (var n = 0u; n < facts.n_actions; n++) {
        let log_prob = memory[output(ACTOR, row) + n] - current;
        // The derivative of the entropy coefficient's term by the logarithms sums to 0.
        let gradient = scale * exp(log_prob) * (cost_of(row, n, alpha, log_prob) - mean);
        let of_critics = select(vec2<f32>(), 2.0 * scale * weight[row] * errors, n == taken);
        memory[output_error(ACTOR, row) + n] = gradient;
        memory[output_error(CRITIC_1, row) + n] = of_critics.x;
        memory[output_error(CRITIC_2, row) + n] = of_critics.y;
    }
    let figures = facts.figures + 4u * row;
    memory[figures] = scale * weight[row] * dot(errors, errors);
    memory[figures + 1u] = scale * mean;
    memory[figures + 2u] = scale * entropy;
    memory[figures + 3u] = scale * value;
}

// Where a pass's outputs of a row are, and the gradients by them.
fn output(of_pass: u32, row: u32) -> u32 {
    return facts.outputs + (of_pass * facts.n_rows + row) * facts.n_actions;
}

fn output_error(of_pass: u32, row: u32) -> u32 {
    return facts.output_errors + (of_pass * facts.n_rows + row) * facts.n_actions;
}

// What the logarithms of a pass's probabilities in a row are below its outputs.
fn softmax_of(of_pass: u32, row: u32) -> f32 {
    let first = output(of_pass, row);
    var most = memory[first];
    for (var n = 1u; n < facts.n_actions; n++) {
        most = max(most, memory[first + n]);
    }
    var sum = 0.0;
    for (var n = 0u; n < facts.n_actions; n++) {
        sum += exp(memory[first + n] - most);
    }
    return most + log(sum);
}

// What the actor pays for an action of a row.
fn cost_of(row: u32, action: u32, alpha: f32, log_prob: f32) -> f32 {
    let q = combined(memory[output(CRITIC_1, row) + action], memory[output(CRITIC_2, row) + action]);
    return alpha * log_prob - q;
}

// The two critics' values as one.
fn combined(first: f32, second: f32) -> f32 {
    return select(0.5 * (first + second), min(first, second), facts.takes_minimum == 1u);
}

// Adds up the figures of the transitions, and adapts the entropy coefficient; one workgroup.
@compute @workgroup_size(WORKGROUP)
fn add_figures(thread: Thread) {
    var sums = vec4<f32>();
    for (var row = thread.local; row < facts.n_rows; row += WORKGROUP) {
        let at = facts.figures + 4u * row;
        sums += vec4<f32>(memory[at], memory[at + 1u], memory[at + 2u], memory[at + 3u]);
    }
    let figures = added(thread.local, sums);
    if thread.local != 0u || thread.group.x != 0u { return; }
    for (var n = 0u; n < 4u; n++) {
        memory[facts.sums + n] += figures[n];
    }
    if now.adapts == 0u { return; }
    let at = facts.entropy;
    let gradient = exp(memory[at]) * (figures.z - now.entropy_target);
    let first = memory[at + 1u] * DECAY_1 + gradient * (1.0 - DECAY_1);
    let second = memory[at + 2u] * DECAY_2 + gradient * gradient * (1.0 - DECAY_2);
    memory[at + 1u] = first;
    memory[at + 2u] = second;
    memory[at] -= now.entropy_rate * first / now.entropy_corrections.x
        / (sqrt(second / now.entropy_corrections.y) + ENTROPY_EPSILON);
}

// Moves a parameter against its gradient by Adam, and the one that follows it; a thread a parameter.
@compute @workgroup_size(WORKGROUP)
fn move_parameters(thread: Thread) {
    let element = index_of(thread);
    let n = N_LEARNING * facts.n_parameters;
    if n <= element { return; }
    let is_actor = element < facts.n_parameters;
    let gradient = memory[facts.gradients + element];
    let first = memory[facts.moments + element] * DECAY_1 + gradient * (1.0 - DECAY_1);
    let second = memory[facts.moments + n + element] * DECAY_2 + gradient * gradient * (1.0 - DECAY_2);
    memory[facts.moments + element] = first;
    memory[facts.moments + n + element] = second;
    let rate = select(now.rates.y, now.rates.x, is_actor);
    let epsilon = select(now.epsilons.y, now.epsilons.x, is_actor);
    let value = memory[element] - first * rate / (sqrt(second) + epsilon);
    memory[element] = value;
    let follows = select(now.follow.y, now.follow.x, is_actor);
    if follows != 0.0 { memory[n + element] = memory[n + element] * (1.0 - follows) + value * follows; }
}

// The sum of what each thread of a workgroup gives.
fn added(local: u32, own: vec4<f32>) -> vec4<f32> {
    parts[local] = own;
    for (var half = WORKGROUP / 2u; 0u < half; half /= 2u) {
        workgroupBarrier();
        if local < half { parts[local] += parts[local + half]; }
    }
    workgroupBarrier();
    let sum = parts[0];
    workgroupBarrier();
    return sum;
}
