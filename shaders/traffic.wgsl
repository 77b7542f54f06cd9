// Other vehicles: each decides from where all were after the last step, all move, some leave and some come.
//
// Integers of 32 bits alone, in the units of src/traffic/units.rs: every engine finds the same bits.

// A car whose turn it is decides its acceleration. It writes that word of its own, which nobody else reads.
@compute @workgroup_size(WORKGROUP)
fn traffic_decide(thread: Thread) {
    let index = index_of(thread);
    let env = index / N_CARS;
    if !is_driving(env) { return; }
    let slot = index % N_CARS;
    let me = car_at(env, slot);
    if !is_there(me) || (slot + truck[env].steps) % DECIDES_EVERY != 0u { return; }
    cars[env * N_CAR_WORDS + CAR_WORDS * slot + 3u] = bitcast<u32>(decided(env, slot, me));
}

// A car moves.
@compute @workgroup_size(WORKGROUP)
fn traffic_move(thread: Thread) {
    let index = index_of(thread);
    let env = index / N_CARS;
    if !is_driving(env) { return; }
    let car = car_at(env, index % N_CARS);
    if is_there(car) { write_car(env, index % N_CARS, car_moved(car)); }
}

// Cars at the ends of their paths leave, and those that come enter where there is room.
@compute @workgroup_size(WORKGROUP)
fn traffic_arrive(thread: Thread) {
    let env = index_of(thread);
    if is_driving(env) { arrive(env); }
}

// Puts the vehicles of a snapshot around the trucks that have begun an episode, but for those that are too near.
@compute @workgroup_size(WORKGROUP)
fn surround_after_reset(thread: Thread) {
    let env = index_of(thread);
    if has_begun(env) { surround(env); }
}

// Words of a demand: for each source, for each path, for vans and for rude drivers.
fn demand_words(network: Network) -> u32 {
    return network.n_sources + network.n_paths + 2u;
}

// The first word of a level's demand in the table of lanes.
fn demand_at(network: Network, level: u32) -> u32 {
    return network.levels + 1u + level * (demand_words(network) + N_SNAPSHOTS * N_CAR_WORDS);
}

// The word of the backlog that counts the cars outside at a source.
fn backlog_word(env: u32, source: u32) -> u32 {
    return env * N_CAR_WORDS + BACKLOG_AT + source / BACKLOG_SOURCES;
}

fn backlog_bit(source: u32) -> u32 {
    return BACKLOG_BITS * (source % BACKLOG_SOURCES);
}

fn waiting_cars(env: u32, source: u32) -> u32 {
    return (cars[backlog_word(env, source)] >> backlog_bit(source)) & MOST_WAITING;
}

// Cars at the ends of their paths leave, and those that come enter where there is room, in the order of the sources,
// into the first free slots.
fn arrive(env: u32) {
    let network = network_of(truck[env].route);
    for (var slot = 0u; slot < N_CARS; slot++) {
        let car = car_at(env, slot);
        if is_there(car) && length_of_path(network, path_of(car)) <= front_of(car) {
            write_car(env, slot, Car(0, 0, NO_PATH, 0));
        }
    }
    // One draw for all sources: their rates are exact, and at most one car comes in a step.
    let demand = demand_at(network, cars[env * N_CAR_WORDS + LEVEL_AT]);
    let drawn = traffic_words(env, ARRIVAL + truck[env].steps).x;
    var source = 0u;
    while source < network.n_sources && !falls_below(drawn, lanes[demand + source]) { source++; }
    if source < network.n_sources && waiting_cars(env, source) < MOST_WAITING {
        cars[backlog_word(env, source)] += 1u << backlog_bit(source);
    }
    for (source = 0u; source < network.n_sources; source++) {
        if waiting_cars(env, source) == 0u { continue; }
        var slot = 0u;
        while slot < N_CARS && is_there(car_at(env, slot)) { slot++; }
        if slot == N_CARS { return; }
        let car = entering(env, network, demand, source);
        if !is_there(car) { continue; }
        write_car(env, slot, car);
        cars[backlog_word(env, source)] -= 1u << backlog_bit(source);
    }
}

// The next car of a source, or none if there is no room for it.
fn entering(env: u32, network: Network, demand: u32, source: u32) -> Car {
    let random = traffic_words(env, ENTERING + 16u * truck[env].steps + source);
    let first = lanes[network.sources + SOURCE_WORDS * source + 2u];
    let end = first + lanes[network.sources + SOURCE_WORDS * source + 3u];
    let shares = demand + network.n_sources;
    var path = first;
    while path + 1u < end && !falls_below(random.x, lanes[shares + path]) { path++; }
    let kinds = shares + network.n_paths;
    let van = select(0u, VAN, falls_below(random.y, lanes[kinds]));
    let rude = select(0u, RUDE, falls_below(random.z, lanes[kinds + 1u]));
    let style = (random.y & (VAN - 1u)) | van | rude;
    let front = extent(style);
    var rear = BEYOND;
    var pace = 0;
    for (var slot = 0u; slot < N_CARS; slot++) {
        let other = car_at(env, slot);
        let other_rear = front_of(other) - extent(style_of(other));
        if is_there(other) && first <= path_of(other) && path_of(other) < end && other_rear < rear {
            rear = other_rear;
            pace = pace_of(other);
        }
    }
    if rear - front < ENTRY_ROOM { return Car(0, 0, NO_PATH, 0); }
    let room = max(rear - front - rule(RULE_GAP), 0);
    let stops = min(square_of(pace) + STOPS_WITH * room, square_of(FASTEST));
    // The root is in 2^-10 m/s, of which 8/5 units of a pace; 2^-10 m in 8 steps are 2 units.
    let slow = min(i32(square_root(u32(stops) << 10u)) * 8 / 5, 2 * room);
    let station = front << FINER_STATION;
    return Car(station, min(limit_at(network, path, station), slow) << FINER_SPEED, path | (style << STYLE), 0);
}

// The whole part of the square root, digit by digit.
fn square_root(value: u32) -> u32 {
    var rest = value;
    var root = 0u;
    for (var bit = 1u << 30u; 0u < bit; bit >>= 2u) {
        if root + bit <= rest {
            rest -= root + bit;
            root = (root >> 1u) + bit;
        } else {
            root >>= 1u;
        }
    }
    return root;
}

// Puts the vehicles of a snapshot around a truck, but for those that are too near.
fn surround(env: u32) {
    let network = network_of(truck[env].route);
    let random = traffic_words(env, DRAW_TRAFFIC);
    let level = index_below(random.x, lanes[network.levels]);
    let snapshots = demand_at(network, level) + demand_words(network);
    let first = snapshots + index_below(random.y, N_SNAPSHOTS) * N_CAR_WORDS;
    for (var word = 0u; word < N_CAR_WORDS; word++) { cars[env * N_CAR_WORDS + word] = lanes[first + word]; }
    cars[env * N_CAR_WORDS + LEVEL_AT] = level;
    let at = truck[env];
    let rig = vehicles[at.vehicle].rig;
    let tractor = grown_unit(rig.tractor_body, at.position, at.heading);
    let trailer = grown_unit(rig.trailer_body, trailer_position(rig, at), at.trailer_heading);
    for (var slot = 0u; slot < N_CARS; slot++) {
        let car = car_at(env, slot);
        if !is_there(car) { continue; }
        let outline = outline_of(network, car);
        if are_overlapping(tractor, outline) || are_overlapping(trailer, outline) {
            write_car(env, slot, Car(0, 0, NO_PATH, 0));
        }
    }
}

// The ground that a unit covers, and the room around it that it begins with.
fn grown_unit(body: Body, position: vec2<f32>, heading: f32) -> Outline {
    let along = direction(heading);
    let middle = position + 0.5 * (body.front + body.rear) * along;
    return Outline(middle, along, 0.5 * (body.front - body.rear) + ROOM_ALONG, body.half_width + ROOM_BESIDE);
}
