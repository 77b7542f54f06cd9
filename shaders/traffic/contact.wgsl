// Which vehicle a truck touches, and whose fault it is: see src/traffic/truck/contact.rs.

// The contact in a word: the car's slot plus 1, and more where the truck is at fault; 0 if there is none. Behind the
// slots stand the trucks of the group. Of several the first among those for which the truck is at fault, or else among
// all.
fn touched(env: u32, network: Network) -> u32 {
    let tractor = tractor_outline(truck[env]);
    let trailer = trailer_outline(truck[env]);
    let middle = 0.5 * (tractor.middle + trailer.middle);
    let half_lengths = max(tractor.half_length, trailer.half_length);
    let reach = 0.5 * distance(tractor.middle, trailer.middle) + half_lengths + NEAR_CAR;
    var found = 0u;
    for (var slot = 0u; slot < N_CARS; slot++) {
        let car = car_at(env, slot);
        if !is_there(car) { continue; }
        let between = sample_position(network, car, sample_behind(network, car)) - middle;
        let its_reach = reach + select(0.0, LONGER_THAN_CAR, large_of(style_of(car)) != 0u);
        if its_reach * its_reach <= dot(between, between) { continue; }
        if !is_covering(network, car, tractor, trailer) { continue; }
        if !is_cars_fault(env, network, tractor, trailer, car) { return slot + 1u + TRUCKS_FAULT; }
        if found == 0u { found = slot + 1u; }
    }
    let first = first_of_group(env);
    for (var mate = first; mate < first + batch.group; mate++) {
        if mate == env || !is_driving(mate) || !is_touching(tractor, trailer, mate) { continue; }
        let code = N_CARS + mate - first + 1u;
        if !is_mates_fault(env, network, tractor, trailer, mate) { return code + TRUCKS_FAULT; }
        if found == 0u { found = code; }
    }
    return found;
}

// Whether units that cover this ground touch another truck of the group.
fn is_touching(tractor: Outline, trailer: Outline, mate: u32) -> bool {
    let its_tractor = tractor_outline(truck[mate]);
    let its_trailer = trailer_outline(truck[mate]);
    return are_overlapping(tractor, its_tractor) || are_overlapping(tractor, its_trailer)
        || are_overlapping(trailer, its_tractor) || are_overlapping(trailer, its_trailer);
}

// Whether a truck of the group is at fault of a contact with one whose units cover this ground, judged as a car in its
// place would be.
fn is_mates_fault(env: u32, network: Network, tractor: Outline, trailer: Outline, mate: u32) -> bool {
    if in_speeds(truck[mate].speed) <= HITS_NOBODY || has_entered_lately(env, entered_in(env)) { return false; }
    let arm = arm_of(network, path_of_route(truck[env].route));
    let is_of_other_arm = arm_of(network, path_of_route(truck[mate].route)) != arm;
    let cuts_in = entered_in(env) != 0u && is_of_other_arm && has_entered_lately(env, entered_in(mate));
    let before = units_before(env, tractor, trailer);
    return cuts_in || is_touching(before.tractor, before.trailer, mate);
}

// The step of its episode in which a truck entered, plus 1; 0 before; ENTERED_BEFORE if it began beyond its line.
fn entered_in(env: u32) -> u32 {
    return cars[env * N_CAR_WORDS + ENTERED_AT];
}

// Whether a truck of a group entered a short time ago.
fn has_entered_lately(env: u32, entered: u32) -> bool {
    return entered != 0u && truck[env].steps + 1u - entered < LATELY;
}

// Whether the car is at fault of a contact with a truck whose units cover this ground.
fn is_cars_fault(env: u32, network: Network, tractor: Outline, trailer: Outline, car: Car) -> bool {
    let entered = entered_in(env);
    if pace_of(car) <= HITS_NOBODY || has_entered_lately(env, entered) { return false; }
    let arm = arm_of(network, path_of_route(truck[env].route));
    let behind_line = front_of(car) - line_of_car(network, car).x;
    // 2^-14 m a step for some steps.
    let lately = max(FROM_STANDING, (i32(LATELY) * pace_of(car)) >> 4u);
    let is_behind = 1 <= behind_line && behind_line <= lately;
    if entered != 0u && arm_of(network, path_of(car)) != arm && is_behind { return true; }
    let before = units_before(env, tractor, trailer);
    return is_covering(network, car, before.tractor, before.trailer);
}

// Index of the arm that a path comes from.
fn arm_of(network: Network, path: u32) -> u32 {
    return lanes[network.sources + SOURCE_WORDS * path_word(network, path, 5u)];
}

// The ground that both units of a truck covered.
struct Units {
    tractor: Outline,
    trailer: Outline,
}

// The ground that a truck's units covered a second ago: each driven back along its circle.
fn units_before(env: u32, tractor: Outline, trailer: Outline) -> Units {
    let at = truck[env];
    let rig = vehicles[at.vehicle].rig;
    // At constant acceleration; a truck that stood did not drive backwards.
    let way = BEFORE_CONTACT * max(at.speed - 0.5 * BEFORE_CONTACT * at.acceleration, 0.0);
    let articulation = sin_cos(at.heading - at.trailer_heading);
    var turn = 0.0;
    if at.speed != 0.0 { turn = way * yaw_rate_of(rig, at) / at.speed; }
    let trailer_turn = (way * articulation.x + rig.fifth_wheel * turn * articulation.y) / rig.trailer_wheelbase;
    let trailer_way = way * articulation.y;
    return Units(
        driven_back(tractor, at.position, at.heading, way, turn),
        driven_back(trailer, trailer_position(rig, at), at.trailer_heading, trailer_way, trailer_turn),
    );
}

// A unit before it drove this way and turned by this angle, its axle at a position (m, rad).
fn driven_back(unit: Outline, axle: vec2<f32>, heading: f32, way: f32, turn: f32) -> Outline {
    let along = direction(heading - turn);
    let ahead = dot(unit.middle - axle, unit.along);
    let middle = axle - way * direction(heading - 0.5 * turn) + ahead * along;
    return Outline(middle, along, unit.half_length, unit.half_width);
}
