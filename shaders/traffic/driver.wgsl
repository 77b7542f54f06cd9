// How each car decides its acceleration, from the state of the step before alone: see src/traffic/decide.rs.
//
// Integers of 32 bits alone, whose products fit: every engine finds the same bits.

// The square of a speed (2^-10 m²/s²).
fn square_of(speed: i32) -> i32 {
    return (((speed * speed) >> 8u) * 25) >> 8u;
}

// Whether what has a squared speed can still stop before a line: what cannot any more has entered.
fn still_stops(station: i32, square: i32, line: i32) -> bool {
    return station + (square >> STOPS_WITHIN) <= line;
}

// Time to drive a distance of at least 0 at a speed above 0 (1/256 step).
fn time_of(distance: i32, speed: i32) -> i32 {
    return i32((u32(distance) << 12u) / u32(speed));
}

// Interaction of a wished gap and a gap.
fn interaction_of(wished: i32, gap: i32) -> i32 {
    let ratio = min((u32(wished) << RATIO_BITS) / u32(gap), MOST_RATIO);
    return i32((ratio * ratio) >> (2u * RATIO_BITS - 16u));
}

// Interaction that stops a car with a squared speed before a line, never later than kinematics needs.
fn stopping(distance: i32, square: i32) -> i32 {
    let wished = interaction_of(STANDS_BEFORE + ((square * PER_SQUARE) >> 10u), max(distance, LEAST_DISTANCE));
    let left = max(distance - STANDS_BEFORE / 2, LEAST_LEFT);
    if TWICE_BRAKING * left < square { return max(wished, ONE + i32((u32(square) << 14u) / u32(left))); }
    return wished;
}

// The acceleration of a car with a speed, a wished speed and an interaction (2^-19 m a step²).
fn acceleration_of(speed: i32, wished: i32, interaction: i32) -> i32 {
    let part = min((u32(speed) << 15u) / u32(wished), MOST_PART);
    let squared = (part * part) >> 16u;
    let free = max(ONE - i32((squared * squared) >> 12u), -SLOWING);
    return (4 * clamp(free - interaction, -HARDEST, ONE) + 4 * HARDEST + 12) / 25 - HARDEST_OF_STATE;
}

// A car as another one weighs it, in the units of decisions.
struct SeenCar {
    slot: u32,
    station: i32,
    speed: i32,
    square: i32,
    length: i32,
    line: i32,
    standing: u32,
    // Whether it can still stop before its line.
    waits: bool,
    is_rude: bool,
}

fn seen_car(network: Network, slot: u32, car: Car) -> SeenCar {
    let line = line_of_car(network, car).x;
    let station = front_of(car);
    let square = square_of(pace_of(car));
    return SeenCar(
        slot,
        station,
        pace_of(car),
        square,
        extent(style_of(car)),
        line,
        car.what >> STANDING,
        still_stops(station, square, line),
        (style_of(car) & RUDE) == RUDE,
    );
}

// A car that decides.
struct Driver {
    env: u32,
    network: Network,
    me: SeenCar,
    path: u32,
    // Its state, of which the path and the style stay.
    car: Car,
    temperament: i32,
    // Its time headway (1/256 step).
    headway: i32,
    // The largest interaction.
    interaction: i32,
    // Whether it stops before its line.
    stops: bool,
    // What it follows nearest: the station of its rear (2^-10 m) with its rank in the lower RANK_BITS, 0 of a car and
    // that of a truck in its group from 1 on; and its speed (2^-14 m a step).
    leader: i32,
    leader_speed: i32,
}

// Bits of the rank of what is followed: of equally near ones the lowest, in every row of a group, on either engine.
const RANK_BITS: u32 = 4u;

// A number of the driver model: see `Rules`.
fn rule(index: u32) -> i32 {
    return bitcast<i32>(lanes[index]);
}

// What a car decides: its acceleration (2^-19 m a step²), with a mark if it slows for the row's truck more than for
// anything else.
fn decided(env: u32, slot: u32, car: Car) -> u32 {
    let network = network_of(truck[env].route);
    let temperament = temperament_of(car);
    let path = path_of(car);
    let me = seen_car(network, slot, car);
    let headway = rule(RULE_HEADWAY) * (TIME_PARTS - temperament) / TIME_PARTS;
    let is_large = large_of(style_of(car)) != 0u;
    var driver = Driver(env, network, me, path, car, temperament, headway, 0, false, BEYOND << RANK_BITS, 0);
    let ahead = pair_cell(me.station + SIGHT);
    let behind = pair_cell(me.station - me.length - BEHIND);
    for (var k = 0u; k < N_CARS; k++) {
        let other = undecided_at(env, k);
        if k == slot || !is_there(other) { continue; }
        let pair = pair_of(network, car, other);
        let at = pair.x;
        let ends = lanes[at + 1u];
        let front = pair_cell(front_of(other) + SIGHT_OF_OTHERS);
        let rear = pair_cell(front_of(other) - extent(style_of(other)) - BEHIND);
        let is_near = extractBits(ends, 0u, 8u) <= ahead && behind <= extractBits(ends, 8u, 8u)
            && extractBits(ends, 16u, 8u) <= front && rear <= extractBits(ends, 24u, 8u);
        if !is_near { continue; }
        let weighed = seen_car(network, k, other);
        let first = lanes[at] & 0xffffu;
        let n = extractBits(lanes[at], 16u, 8u);
        for (var z = 0u; z < n; z++) {
            consider(&driver, zone_at(pair.y + ZONE_WORDS * (first + z)), weighed);
        }
    }
    // The row's own truck is the last: what is minded before is minded without it too.
    var without = 0;
    let first = first_of_group(env);
    for (var n = 1u; n <= batch.group; n++) {
        let mate = first + (env - first + n) % batch.group;
        if mate == env { without = driver.interaction; }
        if !is_driving(mate) { continue; }
        let view = view_of(mate, network);
        mind_at_line(&driver, view);
        mind_in_corridor(&driver, view, car, i32(mate - first) + 1);
    }
    let slows_for_truck = without < driver.interaction;
    keep_crossed_lanes_clear(&driver);
    if me.waits && driver.stops { stop_before(&driver, me.line - me.station); }
    // Half a step ahead: a speed's unit is the way of half a step.
    let at_car = limit_at(network, path, car.station + car.speed);
    let limit = select(at_car, (at_car * PACE_OF_LARGE) >> 4u, is_large);
    let wished = max(limit, LEAST_WISHED) * (SPEED_PARTS + temperament) / SPEED_PARTS;
    let wanted = acceleration_of(me.speed, wished, driver.interaction);
    let acceleration = select(wanted, min(wanted, MOST_OF_LARGE), is_large);
    let holds = LOOKS_UP <= acceleration && looks_away(env, slot);
    return marked(select(acceleration, min(car.acceleration, 0), holds), slows_for_truck);
}

// Whether the driver in a slot looks away.
fn looks_away(env: u32, slot: u32) -> bool {
    let lapses = lanes[LANES_LAPSES];
    if lapses == 0u { return false; }
    let period = (truck[env].steps + slot) / LAPSE_PERIOD;
    return falls_below(traffic_words(env, LAPSE + period * SLOTS + slot).x, lapses);
}

// Takes another car in a zone of both paths into account.
fn consider(driver: ptr<function, Driver>, zone: Zone, other: SeenCar) {
    let me = (*driver).me;
    let out_of_sight = SIGHT < zone.a_in - me.station || SIGHT_OF_OTHERS < zone.b_in - other.station;
    let left = zone.a_out + LEFT < me.station - me.length || zone.b_out + LEFT < other.station - other.length;
    if out_of_sight || left { return; }
    let i_am_inside = zone.a_in <= me.station;
    let it_is_inside = zone.b_in <= other.station;
    if me.waits && !i_am_inside && is_of_entry(me, zone) {
        consider_at_line(driver, zone, other);
        return;
    }
    if zone.kind == SOFT || zone.kind == WIDE || (i_am_inside && !it_is_inside) { return; }
    if i_am_inside {
        if zone.kind == FOLLOW {
            follow_inside(driver, zone, other);
        } else {
            // Who has less to go is first.
            let mine = zone.a_out - me.station;
            let its = zone.b_out - other.station;
            if its < mine || (its == mine && other.slot < me.slot) { heed(driver, LETS_OUT); }
        }
    } else if it_is_inside {
        if zone.kind == FOLLOW {
            let gap = beside(zone, other.station - other.length) - me.station;
            stop_or_follow(driver, zone.a_in - me.station, gap, other.speed);
        } else {
            stop_before(driver, zone.a_in - me.station);
        }
    } else {
        consider_before_both(driver, zone, other);
    }
}

// Both are where paths run together: who is ahead leads.
fn follow_inside(driver: ptr<function, Driver>, zone: Zone, other: SeenCar) {
    let me = (*driver).me;
    if is_ahead(zone, me.station, other.station, other.slot < me.slot) {
        let rear = beside(zone, other.station - other.length);
        heed(driver, interaction_behind(*driver, rear - me.station, other.speed));
        note_leader(driver, rear, 0, other.speed);
    }
}

// Whether a vehicle on b, with its front at a station, is ahead of one on a; both find the same (2^-10 m).
fn is_ahead(zone: Zone, own: i32, its: i32, its_slot_is_lower: bool) -> bool {
    var mine = own;
    var other = its - zone.delta;
    if zone.slower != 0 {
        // By the parts of the zone that they have driven: what both find is alike to the last bit.
        mine = ((own - zone.a_in) >> COARSER) * ((zone.b_out - zone.b_in) >> COARSER);
        other = ((its - zone.b_in) >> COARSER) * ((zone.a_out - zone.a_in) >> COARSER);
    }
    return mine < other || (mine == other && its_slot_is_lower);
}

// Both have the zone before them, and it is not that of this car's entry.
fn consider_before_both(driver: ptr<function, Driver>, zone: Zone, other: SeenCar) {
    let me = (*driver).me;
    let mine = zone.a_in - me.station;
    let its = zone.b_in - other.station;
    let enters_there = other.waits && other.line < zone.b_in;
    if !me.waits && enters_there && lets_in((*driver).env, me, mine, other) {
        stop_before(driver, mine);
        return;
    }
    // What waits before its line, or before that of both, hinders nobody yet.
    if (!me.waits && other.waits) || (me.waits && enters_there) || AGREED < max(mine, its) { return; }
    if goes_first((*driver).env, me, zone, other) {
        let length = select(0, zone.b_out - zone.b_in, zone.kind == CROSS);
        stop_or_follow(driver, mine, mine - its - other.length - length, other.speed);
    }
}

// Whether the other goes first through a zone that both have before them. Both find the same: what cannot stop any more
// is first, then who is there sooner; of two that have been standing, a coin decides.
fn goes_first(env: u32, me: SeenCar, zone: Zone, other: SeenCar) -> bool {
    let other_is_lower = other.slot < me.slot;
    if PATIENT < me.standing && PATIENT < other.standing {
        return lower_goes_first(env, me.slot, other.slot) == other_is_lower;
    }
    let mine = rank(zone.a_in - me.station, me);
    let its = rank(zone.b_in - other.station, other);
    return its < mine || (its == mine && other_is_lower);
}

// The order of who goes first through a zone at this distance: the smaller.
fn rank(distance: i32, car: SeenCar) -> i32 {
    if GOES_ABOVE * distance < car.square { return distance - BEYOND; }
    return time_of(distance, max(car.speed, LEAST_SPEED));
}

fn heed(driver: ptr<function, Driver>, interaction: i32) {
    (*driver).interaction = max((*driver).interaction, interaction);
}

// The interaction with something that has a speed behind a gap (2^-10 m, 2^-14 m a step).
fn interaction_behind(driver: Driver, gap: i32, speed: i32) -> i32 {
    let own = driver.me.speed;
    let approaching = (((own * (own - speed)) >> 10u) * PER_PRODUCT) >> 14u;
    let wished = rule(RULE_GAP) + max(((own * driver.headway) >> 12u) + approaching, 0);
    return interaction_of(wished, max(gap, LEAST_GAP));
}

fn stop_before(driver: ptr<function, Driver>, distance: i32) {
    heed(driver, stopping(distance, (*driver).me.square));
}

// Stops at a distance, or follows something with a speed behind a gap, whichever is milder.
fn stop_or_follow(driver: ptr<function, Driver>, distance: i32, gap: i32, speed: i32) {
    heed(driver, min(interaction_behind(*driver, gap, speed), stopping(distance, (*driver).me.square)));
}

fn note_leader(driver: ptr<function, Driver>, rear: i32, rank: i32, speed: i32) {
    let leader = (rear << RANK_BITS) + rank;
    if leader < (*driver).leader {
        (*driver).leader = leader;
        (*driver).leader_speed = speed;
    }
}

// Whether a zone is one of this car's entry.
fn is_of_entry(me: SeenCar, zone: Zone) -> bool {
    return zone.a_in <= me.line + OF_ENTRY && (zone.kind == SOFT || me.line < zone.a_in);
}

// Time to its line, of a car that waits (1/256 step).
fn time_to_line(me: SeenCar) -> i32 {
    return time_of(max(me.line - me.station, 0), max(me.speed, LEAST_APPROACH));
}

// This car can still wait, and the zone is one of its entry.
fn consider_at_line(driver: ptr<function, Driver>, zone: Zone, other: SeenCar) {
    let me = (*driver).me;
    if other.waits {
        // Both wait, or arrive: only where paths cross must one be first.
        let both_enter = zone.kind == CROSS && other.line < zone.b_in;
        if !both_enter || !goes_first((*driver).env, me, zone, other) { return; }
    }
    let to_line = time_to_line(me);
    if other.station < zone.b_in {
        let distance = zone.b_in - other.station;
        let is_let_in = zone.kind != SOFT && lets_in((*driver).env, other, distance, me);
        let speed = max(other.speed, LEAST_SPEED);
        let comes = time_of(distance, speed);
        let gone = comes + time_of(zone.b_out - zone.b_in + other.length, speed);
        if !is_let_in && comes < lag_of(*driver, zone.kind) + to_line && to_line < gone { (*driver).stops = true; }
        return;
    }
    // What passes beside is in nobody's way.
    if zone.kind == CROSS {
        let left = max(zone.b_out + other.length - other.station, 0);
        if to_line + GONE_BEFORE < time_of(left, max(other.speed, LEAST_CROSSING)) { (*driver).stops = true; }
    } else if zone.kind == FOLLOW {
        let rear = beside(zone, other.station - other.length);
        // It foresees how far one that passes moves away in a second.
        let soon = rear - me.station + ((10 * max(other.speed - me.speed, 0)) >> 4u);
        stop_or_follow(driver, me.line - me.station, soon, other.speed);
        note_leader(driver, rear, 0, other.speed);
    }
}

// Time that this car leaves between itself and ring traffic that comes (1/256 step).
fn lag_of(driver: Driver, kind: u32) -> i32 {
    let network = driver.network;
    let crosses = 0 < line_of_car(network, driver.car).y;
    let source = path_word(network, driver.path, 5u);
    let lane = min(lanes[network.sources + SOURCE_WORDS * source + 1u], 1u);
    let of_cars = rule(select(RULE_LAGS + u32(crosses), RULE_SOFT_LAGS + lane, kind == SOFT));
    let lag = of_cars + select(0, LAG_OF_LARGE, large_of(style_of(driver.car)) != 0u);
    let patience = max(IMPATIENCE - i32(driver.me.standing), LEAST_PATIENCE);
    return lag * (TIME_PARTS - driver.temperament) * patience / (TIME_PARTS * IMPATIENCE);
}

// Whether the car `inside` the ring, at this distance before the zone, lets in the one that waits. Both find the same.
fn lets_in(env: u32, inside: SeenCar, distance: i32, waiting: SeenCar) -> bool {
    let is_at_line = waiting.line - waiting.station <= LET_IN_WITHIN && waiting.speed <= LET_IN_BELOW;
    let brakes_gently = inside.square <= LETS_IN_WITH * (distance - LETS_IN_BEFORE);
    if !is_at_line || !brakes_gently || inside.is_rude { return false; }
    return falls_below(courtesy(env, inside.slot, waiting.slot), lanes[RULE_COURTESY]);
}

// Stops before the line where there is no room behind the lanes that this car crosses.
fn keep_crossed_lanes_clear(driver: ptr<function, Driver>) {
    let me = (*driver).me;
    let rear = (*driver).leader >> RANK_BITS;
    let clear = line_of_car((*driver).network, (*driver).car).y;
    let would_block = rear - rule(RULE_GAP) - me.length < clear && me.line < rear;
    if me.waits && would_block && (*driver).leader_speed < SLOW { (*driver).stops = true; }
}

// Whether of two cars that stand the one in the lower slot goes first. Both see the same.
fn lower_goes_first(env: u32, one: u32, other: u32) -> bool {
    let pair = SLOTS * min(one, other) + max(one, other);
    return (traffic_words(env, COIN + (truck[env].steps / COIN_PERIOD) * SLOTS * SLOTS + pair).x & 1u) == 1u;
}

// How courteous the car in slot `inside` is to the one in slot `waiting`. Both see the same.
fn courtesy(env: u32, inside: u32, waiting: u32) -> u32 {
    let pair = SLOTS * inside + waiting;
    return traffic_words(env, COURTESY + (truck[env].steps / COURTESY_PERIOD) * SLOTS * SLOTS + pair).x;
}
