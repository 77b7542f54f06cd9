// A policy acts: an observation is normalised and taken through all layers, and an action is chosen. Its twin on the
// processor is policy/src/network.rs.
//
// A workgroup takes a tile of TILE trucks through all layers; what lies between two layers stays in its memory. TEAMS
// of COLUMNS threads share the tile. A thread makes four neighbouring outputs, a column, for all trucks of its team,
// twice TRUCKS, so that a read of four weights serves them all; the teams read them at about the same time. A sum over
// inputs is a chain of fused multiply-adds in their order, for each truck by itself, so it does not depend on the tile.
// Inputs are padded with zeros to a multiple of four. Constants, structs and bindings are printed from
// policy/src/kernel.rs.

// The inputs of a layer, in their place then its outputs: for each team and value twice TRUCKS trucks.
var<workgroup> values: array<Trucks, 2u * TEAMS * WIDTH>;

@compute @workgroup_size(TEAMS * COLUMNS)
fn act(
    // Not in a struct: barriers may follow a condition on the workgroup alone.
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let first = (group.y * groups.x + group.x) * TILE;
    if !drives(first) { return; }
    let team = local / COLUMNS;
    let own_column = local % COLUMNS;
    let own = 2u * WIDTH * team;
    for (var n = own_column; n < 2u * layers[0].n_inputs; n += COLUMNS) {
        values[own + n] = observed(first + TRUCKS * (2u * team + n % 2u), n / 2u);
    }
    workgroupBarrier();
    for (var index = 0u; index < facts.n_layers; index++) {
        let layer = layers[index];
        // Where a layer has columns for half of the threads at most, two share one: each has half of the trucks.
        let is_shared = 2u * layer.n_columns <= COLUMNS;
        let column = select(own_column, own_column / 2u, is_shared);
        let half = select(0u, own_column % 2u, is_shared);
        let is_needed = column < layer.n_columns;
        var sums = Sums();
        if is_needed {
            var at = layer.weights + column;
            if is_shared {
                for (var n = 0u; n < layer.n_inputs; n += 4u) {
                    let value = own + 2u * n + half;
                    add_first(&sums, value, weights[at]);
                    add_first(&sums, value + 2u, weights[at + layer.n_columns]);
                    add_first(&sums, value + 4u, weights[at + 2u * layer.n_columns]);
                    add_first(&sums, value + 6u, weights[at + 3u * layer.n_columns]);
                    at += 4u * layer.n_columns;
                }
            } else {
                for (var n = 0u; n < layer.n_inputs; n += 4u) {
                    let value = own + 2u * n;
                    add_both(&sums, value, weights[at]);
                    add_both(&sums, value + 2u, weights[at + layer.n_columns]);
                    add_both(&sums, value + 4u, weights[at + 2u * layer.n_columns]);
                    add_both(&sums, value + 6u, weights[at + 3u * layer.n_columns]);
                    at += 4u * layer.n_columns;
                }
            }
        }
        // No thread reads the inputs any more.
        workgroupBarrier();
        if is_needed {
            let bias = weights[layer.biases + column];
            let is_last = index + 1u == facts.n_layers;
            let output = own + 8u * column + half;
            values[output] = activated(sums.a0 + bias.x, is_last);
            values[output + 2u] = activated(sums.a1 + bias.y, is_last);
            values[output + 4u] = activated(sums.a2 + bias.z, is_last);
            values[output + 6u] = activated(sums.a3 + bias.w, is_last);
            if !is_shared {
                values[output + 1u] = activated(sums.b0 + bias.x, is_last);
                values[output + 3u] = activated(sums.b1 + bias.y, is_last);
                values[output + 5u] = activated(sums.b2 + bias.z, is_last);
                values[output + 7u] = activated(sums.b3 + bias.w, is_last);
            }
        }
        workgroupBarrier();
    }
    let env = first + local;
    if local < TILE && env < arrayLength(&action) {
        if facts.is_sampled == 1u {
            action[env] = sampled(local, env);
        } else {
            action[env] = best(local);
        }
    }
}

// Sums of four outputs, for the first trucks of a team, or the half that a thread has, and for the others.
struct Sums {
    a0: Trucks,
    a1: Trucks,
    a2: Trucks,
    a3: Trucks,
    b0: Trucks,
    b1: Trucks,
    b2: Trucks,
    b3: Trucks,
}

// Adds the products of an input, for the first trucks from `value` on, and its weights.
fn add_first(sums: ptr<function, Sums>, value: u32, weight: vec4<f32>) {
    let a = values[value];
    (*sums).a0 = fma(a, Trucks(weight.x), (*sums).a0);
    (*sums).a1 = fma(a, Trucks(weight.y), (*sums).a1);
    (*sums).a2 = fma(a, Trucks(weight.z), (*sums).a2);
    (*sums).a3 = fma(a, Trucks(weight.w), (*sums).a3);
}

// The same for all trucks of a team.
fn add_both(sums: ptr<function, Sums>, value: u32, weight: vec4<f32>) {
    add_first(sums, value, weight);
    let b = values[value + 1u];
    (*sums).b0 = fma(b, Trucks(weight.x), (*sums).b0);
    (*sums).b1 = fma(b, Trucks(weight.y), (*sums).b1);
    (*sums).b2 = fma(b, Trucks(weight.z), (*sums).b2);
    (*sums).b3 = fma(b, Trucks(weight.w), (*sums).b3);
}

// Whether any truck of a tile drives: a held one needs no action.
fn drives(first: u32) -> bool {
    let last = arrayLength(&action) - 1u;
    var driving = false;
    for (var n = 0u; n < TILE; n++) {
        driving = driving || truck[min(first + n, last)].held == 0u;
    }
    return driving;
}

// A value of a truck's observation or of what stands behind it, normalised; 0 behind that. Beyond the last truck those
// of the last.
fn normalised(truck: u32, value: u32) -> f32 {
    if facts.n_values <= value { return 0.0; }
    let env = min(truck, arrayLength(&action) - 1u);
    var seen = 0.0;
    if value < N_VALUES {
        seen = observation[env * N_VALUES + value];
    } else {
        seen = beside(env, value - N_VALUES);
    }
    let normal = normalisation[value];
    return clamp((seen - normal.x) * normal.y, -LIMIT, LIMIT);
}

// What stands after a layer: nothing after the last one.
fn activated(sums: Trucks, is_last: bool) -> Trucks {
    if is_last { return sums; }
    // Beyond the limit the tangent is 1 to the last bit, and on some devices its exponentials are infinite.
    if facts.is_tanh == 1u { return tanh(clamp(sums, Trucks(-LIMIT), Trucks(LIMIT))); }
    return max(sums, Trucks(0.0));
}

// An output of the last layer for a truck of the tile.
fn output(tile_truck: u32, index: u32) -> f32 {
    let half = tile_truck / TRUCKS;
    return values[2u * (WIDTH * (half / 2u) + index) + half % 2u][tile_truck % TRUCKS];
}

// The action with the largest output, of equals the first.
fn best(tile_truck: u32) -> u32 {
    var chosen = 0u;
    for (var n = 1u; n < facts.n_actions; n++) {
        if output(tile_truck, chosen) < output(tile_truck, n) { chosen = n; }
    }
    return chosen;
}

// An action sampled from the softmax of the outputs, as a function of (seed, env, episode, step).
fn sampled(tile_truck: u32, env: u32) -> u32 {
    let most = output(tile_truck, best(tile_truck));
    var sum = 0.0;
    for (var n = 0u; n < facts.n_actions; n++) {
        sum += exp(output(tile_truck, n) - most);
    }
    let word = words(facts.seed, env, truck[env].episode, DRAW_ACTION + truck[env].steps).x;
    var left = sum * 0.5 * (signed_unit(word) + 1.0);
    // Rounding can leave a little of the sum after the last action.
    var chosen = facts.n_actions - 1u;
    for (var n = 0u; n < facts.n_actions; n++) {
        left -= exp(output(tile_truck, n) - most);
        if left < 0.0 {
            chosen = n;
            break;
        }
    }
    return chosen;
}
