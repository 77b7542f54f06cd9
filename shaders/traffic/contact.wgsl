// Which car a truck touches, and whose fault it is: see src/traffic/truck/contact.rs.

// The contact in a word: the car's slot plus 1, and more where the truck is at fault; 0 if there is none. Of several
// the one of the lowest slot among those for which the truck is at fault, or else among all.
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
        if reach * reach <= dot(between, between) { continue; }
        let outline = outline_of(network, car);
        if !are_overlapping(tractor, outline) && !are_overlapping(trailer, outline) { continue; }
        if !is_cars_fault(env, network, tractor, trailer, car, outline) { return slot + 1u + TRUCKS_FAULT; }
        if found == 0u { found = slot + 1u; }
    }
    return found;
}

// Whether the car is at fault of a contact with a truck whose units cover this ground.
fn is_cars_fault(env: u32, network: Network, tractor: Outline, trailer: Outline, car: Car, outline: Outline) -> bool {
    let entered = cars[env * N_CAR_WORDS + ENTERED_AT];
    let has_entered_lately = entered != 0u && truck[env].steps + 1u - entered < LATELY;
    if pace_of(car) <= HITS_NOBODY || has_entered_lately { return false; }
    let arm = arm_of(network, path_of_route(truck[env].route));
    let behind_line = front_of(car) - line_of_path(network, path_of(car));
    // 2^-14 m a step for some steps.
    let lately = max(FROM_STANDING, (i32(LATELY) * pace_of(car)) >> 4u);
    let is_behind = 1 <= behind_line && behind_line <= lately;
    if entered != 0u && arm_of(network, path_of(car)) != arm && is_behind { return true; }
    return was_there(env, tractor, trailer, outline);
}

// Index of the arm that a path comes from.
fn arm_of(network: Network, path: u32) -> u32 {
    return lanes[network.sources + SOURCE_WORDS * path_word(network, path, 5u)];
}

// Whether a truck was on a car's ground a second ago: each unit driven back along its circle.
fn was_there(env: u32, tractor: Outline, trailer: Outline, outline: Outline) -> bool {
    let at = truck[env];
    let rig = vehicles[at.vehicle].rig;
    // At constant acceleration; a truck that stood did not drive backwards.
    let way = BEFORE_CONTACT * max(at.speed - 0.5 * BEFORE_CONTACT * at.acceleration, 0.0);
    let articulation = sin_cos(at.heading - at.trailer_heading);
    var turn = 0.0;
    if at.speed != 0.0 { turn = way * yaw_rate_of(rig, at) / at.speed; }
    let trailer_turn = (way * articulation.x + rig.fifth_wheel * turn * articulation.y) / rig.trailer_wheelbase;
    let before = driven_back(tractor, at.position, at.heading, way, turn);
    if are_overlapping(before, outline) { return true; }
    let trailer_way = way * articulation.y;
    let behind = driven_back(trailer, trailer_position(rig, at), at.trailer_heading, trailer_way, trailer_turn);
    return are_overlapping(behind, outline);
}

// A unit before it drove this way and turned by this angle, its axle at a position (m, rad).
fn driven_back(unit: Outline, axle: vec2<f32>, heading: f32, way: f32, turn: f32) -> Outline {
    let along = direction(heading - turn);
    let ahead = dot(unit.middle - axle, unit.along);
    let middle = axle - way * direction(heading - 0.5 * turn) + ahead * along;
    return Outline(middle, along, unit.half_length, unit.half_width);
}
