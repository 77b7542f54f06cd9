// Other vehicles: each decides from where all were after the last step, all move, some leave and some come.
//
// Integers of 32 bits alone, in the units of src/traffic/units.rs: every engine finds the same bits.

// A car whose turn it is decides its acceleration. It writes that word of its own, which nobody else reads.
@compute @workgroup_size(WORKGROUP)
fn traffic_decide(thread: Thread) {
    let index = index_of(thread);
    let env = index / N_TURNS;
    if !is_driving(env) { return; }
    let first = (DECIDES_EVERY - truck[env].steps % DECIDES_EVERY) % DECIDES_EVERY;
    let slot = first + DECIDES_EVERY * (index % N_TURNS);
    let me = car_at(env, slot);
    if is_there(me) { cars[env * N_CAR_WORDS + CAR_WORDS * slot + 3u] = decided(env, slot, me); }
}

// Whether the car in a slot decides in this step.
fn is_its_turn(env: u32, slot: u32) -> bool {
    return (slot + truck[env].steps) % DECIDES_EVERY == 0u;
}

fn write_car(env: u32, slot: u32, car: Car) {
    let at = env * N_CAR_WORDS + CAR_WORDS * slot;
    cars[at] = bitcast<u32>(car.station);
    cars[at + 1u] = bitcast<u32>(car.speed);
    cars[at + 2u] = car.what;
    cars[at + 3u] = bitcast<u32>(car.acceleration);
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

// Writes down which vehicle a truck touches.
@compute @workgroup_size(WORKGROUP)
fn meet(thread: Thread) {
    let env = index_of(thread);
    if is_driving(env) { cars[env * N_CAR_WORDS + MET_AT] = touched(env, network_of(truck[env].route)); }
}

// Puts the vehicles of a snapshot around the trucks that the caller named, but for those that are too near.
@compute @workgroup_size(WORKGROUP)
fn surround(thread: Thread) {
    let env = index_of(thread);
    if is_to_begin(env) { surround_truck(env); }
}

// The same around the trucks that have begun another episode.
@compute @workgroup_size(WORKGROUP)
fn surround_after_reset(thread: Thread) {
    let env = index_of(thread);
    if has_begun(env) { surround_truck(env); }
}

// Words of a demand: for each source, for each path, for vans, for rude drivers, and for large vehicles if there are
// some.
fn demand_words(network: Network) -> u32 {
    return network.n_sources + network.n_paths + 2u + select(0u, N_LARGE, network.large != 0u);
}

// The first word of a level's demand in the table of lanes.
fn demand_at(network: Network, level: u32) -> u32 {
    return network.levels + level * (demand_words(network) + N_SNAPSHOTS * N_CAR_WORDS);
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
    let view = view_of(env, network);
    let row = env * N_CAR_WORDS;
    if !view.waits && cars[row + ENTERED_AT] == 0u {
        let steps = truck[env].steps;
        cars[row + ENTERED_AT] = select(steps + 1u, ENTERED_BEFORE, steps == 0u);
    }
    let hindered_before = cars[row + HINDERED_AT];
    var hindered = 0u;
    for (var slot = 0u; slot < N_CARS; slot++) {
        let car = car_at(env, slot);
        if is_there(car) && front_of(car) < length_of_path(network, path_of(car)) && !is_stuck(network, car) {
            let slows = select((hindered_before >> slot) & 1u, marked_slow(car), is_its_turn(env, slot));
            hindered |= slows << slot;
            write_car(env, slot, unmarked(car));
        } else {
            write_car(env, slot, no_car());
        }
    }
    // One draw for all sources: their rates are exact, and at most one car comes in a step.
    let demand = demand_at(network, cars[row + LEVEL_AT]);
    let drawn = traffic_words(env, ARRIVAL + truck[env].steps).x;
    var source = 0u;
    while source < network.n_sources && !falls_below(drawn, lanes[demand + source]) { source++; }
    if source < network.n_sources && waiting_cars(env, source) < MOST_WAITING {
        cars[backlog_word(env, source)] += 1u << backlog_bit(source);
    }
    let drivers = drivers_of(env);
    for (source = 0u; source < network.n_sources; source++) {
        if waiting_cars(env, source) == 0u { continue; }
        var slot = 0u;
        while slot < N_CARS && is_there(car_at(env, slot)) { slot++; }
        if slot == N_CARS { break; }
        let car = entering(env, network, view, demand, source);
        if !is_there(car) { continue; }
        write_car(env, slot, driven_by(drivers, car, truck[env].steps + 1u, slot));
        cars[backlog_word(env, source)] -= 1u << backlog_bit(source);
    }
    // A car that came took a slot that none had.
    cars[row + HINDERED_AT] = hindered;
}

// Whether a car stands in a ring that is blocked.
fn is_stuck(network: Network, car: Car) -> bool {
    return network.large != 0u && STUCK <= car.what >> STANDING && line_of_car(network, car).x < front_of(car);
}

// Kind of a large vehicle that comes, in a style; 0 is a car.
fn large_that_comes(network: Network, kinds: u32, drawn: u32) -> u32 {
    if network.large == 0u || falls_below(drawn, lanes[kinds]) { return 0u; }
    for (var kind = 0u; kind < N_LARGE; kind++) {
        if falls_below(drawn, lanes[kinds + 2u + kind]) { return (kind + 1u) << LARGE; }
    }
    return 0u;
}

// The rear of a car on another lane that is in the way of one that enters, where one of them is large; beyond all roads
// if it is not.
fn rear_beside(network: Network, car: Car, other: Car) -> i32 {
    let classes = class_of(style_of(car)) + class_of(style_of(other));
    if network.large == 0u || !is_there(other) || classes == 0u { return BEYOND; }
    let pair = pair_of(network, car, other);
    let first = lanes[pair.x] & 0xffffu;
    let rear = front_of(other) - extent(style_of(other));
    var nearest = BEYOND;
    for (var z = first; z < first + extractBits(lanes[pair.x], 16u, 8u); z++) {
        let zone = zone_at(pair.y + ZONE_WORDS * z);
        if front_of(car) + ENTRY_ROOM < zone.a_in || front_of(other) < zone.b_in || zone.b_out < rear { continue; }
        nearest = min(nearest, select(zone.a_in, beside(zone, rear), zone.kind == FOLLOW));
    }
    return nearest;
}

// The next car of a source, or none if there is no room for it. `view` is the row's own truck.
fn entering(env: u32, network: Network, view: View, demand: u32, source: u32) -> Car {
    let random = traffic_words(env, ENTERING + 16u * truck[env].steps + source);
    let first = lanes[network.sources + SOURCE_WORDS * source + 2u];
    let end = first + lanes[network.sources + SOURCE_WORDS * source + 3u];
    let shares = demand + network.n_sources;
    var path = first;
    while path + 1u < end && !falls_below(random.x, lanes[shares + path]) { path++; }
    let kinds = shares + network.n_paths;
    var before = no_car();
    var slot_before = 0u;
    var rear_before = BEYOND;
    for (var slot = 0u; slot < N_CARS; slot++) {
        let other = car_at(env, slot);
        let other_rear = front_of(other) - extent(style_of(other));
        if is_there(other) && first <= path_of(other) && path_of(other) < end && other_rear < rear_before {
            before = other;
            slot_before = slot;
            rear_before = other_rear;
        }
    }
    // The same while it waits for room, so that none that takes more of it gives way to one that takes less.
    var drawn = random.y;
    if network.large != 0u && is_there(before) {
        let place = (source * SLOTS + slot_before) << STYLE_BITS;
        drawn = traffic_words(env, NEXT_KIND + place + style_of(before)).x;
    }
    let van = select(0u, VAN, falls_below(drawn, lanes[kinds]));
    let rude = select(0u, RUDE, falls_below(random.z, lanes[kinds + 1u]));
    let of_car = (random.y & (VAN - 1u)) | van | rude;
    let of_large = of_car | large_that_comes(network, kinds, drawn);
    let style = select(of_car, of_large, fits(network, path, of_large));
    let front = extent(style);
    let enters = Car(front << FINER_STATION, 0, path | (style << STYLE), 0);
    var rear = rear_before;
    var pace = pace_of(before);
    for (var slot = 0u; slot < N_CARS; slot++) {
        let other = car_at(env, slot);
        let other_rear = rear_beside(network, enters, other);
        if other_rear < rear {
            rear = other_rear;
            pace = pace_of(other);
        }
    }
    let station = front << FINER_STATION;
    let group = first_of_group(env);
    for (var mate = group; mate < group + batch.group; mate++) {
        if !is_driving(mate) { continue; }
        var seen = view;
        if mate != env { seen = view_of(mate, network); }
        let ahead = truck_ahead(network, seen, enters);
        if ahead.x < rear {
            rear = ahead.x;
            pace = ahead.y;
        }
    }
    if rear - front < ENTRY_ROOM { return no_car(); }
    let room = max(rear - front - rule(RULE_GAP), 0);
    let stops = min(square_of(pace) + STOPS_WITH * room, square_of(FASTEST));
    // The root is in 2^-10 m/s, of which 8/5 units of a pace; 2^-10 m in 8 steps are 2 units.
    let slow = min(i32(square_root(u32(stops) << 10u)) * 8 / 5, 2 * room);
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

// Puts the vehicles of a snapshot around a truck, but for those that are too near to it or to one of its group.
fn surround_truck(env: u32) {
    let network = network_of(truck[env].route);
    let random = traffic_words(env, DRAW_TRAFFIC);
    let level = index_below(random.x, lanes[LANES_LEVELS]);
    let snapshots = demand_at(network, level) + demand_words(network);
    let first = snapshots + index_below(random.y, N_SNAPSHOTS) * N_CAR_WORDS;
    for (var word = 0u; word < N_CAR_WORDS; word++) { cars[env * N_CAR_WORDS + word] = lanes[first + word]; }
    cars[env * N_CAR_WORDS + LEVEL_AT] = level;
    let drivers = drivers_of(env);
    for (var slot = 0u; slot < N_CARS; slot++) {
        let car = car_at(env, slot);
        if is_there(car) { write_car(env, slot, driven_by(drivers, car, 0u, slot)); }
    }
    let group = first_of_group(env);
    for (var mate = group; mate < group + batch.group; mate++) { clear_around(env, network, mate); }
}

// Takes the vehicles of a row away that are too near to a truck that begins.
fn clear_around(env: u32, network: Network, mate: u32) {
    let at = truck[mate];
    let tractor = grown_by(tractor_outline(at), ROOM_ALONG, ROOM_BESIDE);
    let trailer = grown_by(trailer_outline(at), ROOM_ALONG, ROOM_BESIDE);
    let source = path_word(network, path_of_route(at.route), 5u);
    let front = front_station(mate);
    for (var slot = 0u; slot < N_CARS; slot++) {
        let car = car_at(env, slot);
        if !is_there(car) { continue; }
        // A truck could not stop behind it.
        let room = station_of(car) - length_of(car) - front;
        let stops = max((at.speed * at.speed - speed_of(car) * speed_of(car)) / STOPS_BEHIND_WITH, 0.0);
        let comes_from_there = path_word(network, path_of(car), 5u) == source;
        let is_too_near_ahead = comes_from_there && 0.0 <= room && room < ROOM_ALONG + stops;
        if is_too_near_ahead || is_covering(network, car, tractor, trailer) {
            write_car(env, slot, no_car());
        }
    }
}

// Reward for the vehicles that drive and brake for a truck.
fn hindrance(env: u32) -> f32 {
    let hindered = cars[env * N_CAR_WORDS + HINDERED_AT];
    var brakes = 0.0;
    for (var slot = 0u; slot < N_CARS; slot++) {
        let car = car_at(env, slot);
        let acceleration = f32(car.acceleration) / STATE_ACCELERATION;
        // One that stands keeps its deceleration, and does not brake.
        if ((hindered >> slot) & 1u) == 1u && 0 < car.speed { brakes += max(-acceleration - GENTLE, 0.0); }
    }
    return bitcast<f32>(limits[arrayLength(&limits) - 1u]) * brakes;
}

// Who drives the vehicles of an episode.
struct Drivers {
    // Fraction of rude ones (2^-16).
    rude: u32,
    key: u32,
}

fn drivers_of(env: u32) -> Drivers {
    let drawn = traffic_words(env, DRAW_TRAFFIC);
    let least = lanes[LANES_RUDE];
    // Of 16 bits each: the product fits in a word.
    return Drivers(least + (((lanes[LANES_RUDE + 1u] - least) * (drawn.z >> 16u)) >> 16u), drawn.w);
}

// A car that entered a slot after so many steps of the episode, with a rude driver or not.
fn driven_by(drivers: Drivers, car: Car, step: u32, slot: u32) -> Car {
    let is_rude = words(drivers.key, step, slot, DRAW_TRAFFIC).x >> 16u < drivers.rude;
    let polite = car.what & ~(RUDE << STYLE);
    return Car(car.station, car.speed, polite | select(0u, RUDE << STYLE, is_rude), car.acceleration);
}

// Where a truck stands nearest on the first part of a car's path: station of its rear, and its speed there (2^-10 m,
// 2^-14 m a step); beyond all roads if it does not.
fn truck_ahead(network: Network, view: View, car: Car) -> vec2<i32> {
    let path = path_of(car);
    let two_seconds = 2 * ((10 * view.speed) >> 4u);
    let is_coming = path_word(network, view.path, 5u) == path_word(network, path, 5u)
        && view.station < 0 && -COMING - two_seconds <= view.station;
    if is_coming { return vec2<i32>(0, view.speed); }
    if is_far_from(view, sample_position(network, car, sample_behind(network, car))) { return vec2<i32>(BEYOND, 0); }
    for (var k = 0u; k < min(path_word(network, path, 1u), CORRIDOR_SAMPLES); k++) {
        let swept = corridor_at(network, car, k);
        let room = swept.half_width + CORRIDOR_ROOM;
        if squared_to_now(view, swept.point) < room * room {
            return vec2<i32>(in_lengths(f32(k) * SPACING - BEFORE_SAMPLE), speed_along(view, network, car, k));
        }
    }
    return vec2<i32>(BEYOND, 0);
}
