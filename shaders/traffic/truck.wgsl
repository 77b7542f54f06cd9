// A truck as the cars around it see it, and what they do about it: see src/traffic/truck.rs.

// A truck as cars see it.
struct View {
    path: u32,
    // Station of its front on it, negative before its beginning (2^-10 m).
    station: i32,
    // Its speed (2^-14 m a step).
    speed: i32,
    // Its length, stretched (2^-10 m).
    length: i32,
    // Whether it can still stop before its line.
    waits: bool,
    // The tractor's velocity (m/s).
    velocity: vec2<f32>,
    // The ground that tractor and trailer cover.
    tractor: Outline,
    trailer: Outline,
    // The same in 1 s and then in 2 s; where it is now while it waits.
    later: array<Outline, 4>,
    // A circle around all of them: its middle, and its radius (m).
    middle: vec2<f32>,
    radius: f32,
}

// A truck as the vehicles around it see it.
fn view_of(env: u32, network: Network) -> View {
    let at = truck[env];
    let rig = vehicles[at.vehicle].rig;
    let station = in_lengths(front_station(env));
    let speed = clamp(in_speeds(at.speed), 0, FASTEST);
    let path = path_of_route(at.route);
    let waits = still_stops(station, square_of(speed), line_of_path(network, path) - SWINGS_OUT);
    let tractor = tractor_outline(at);
    let trailer = trailer_outline(at);
    var later = array<Outline, 4>(tractor, trailer, tractor, trailer);
    if !waits { later = foreseen(rig, at); }
    let middle = 0.25 * (tractor.middle + trailer.middle + later[2].middle + later[3].middle);
    var radius = max(reach_around(tractor, middle), reach_around(trailer, middle));
    for (var k = 0u; k < 4u; k++) { radius = max(radius, reach_around(later[k], middle)); }
    let velocity = at.speed * direction(at.heading);
    return View(path, station, speed, stretched(rig), waits, velocity, tractor, trailer, later, middle, radius);
}

// Station of a truck's front on its path; negative before the path's beginning (m).
fn front_station(env: u32) -> f32 {
    let at = truck[env];
    let rig = vehicles[at.vehicle].rig;
    let route = route_at(at.route);
    let point = reference_point(rig.wheelbase, at);
    // Whether this step's waypoints have been counted or not: passed ones stay so.
    let next = followed(route, point, progress[env].waypoint, params.stray_distance).waypoint;
    let last = clamp(next, 1u, route.n_waypoints - 1u) - 1u;
    let waypoint = waypoint_at(route.first + last);
    let behind_last = dot(point - waypoint.position, waypoint.direction);
    let ahead = rig.tractor_body.front - 0.5 * rig.wheelbase;
    let begins_at = bitcast<f32>(lanes[lanes_row(at.route) + 2u]);
    return begins_at + f32(last) * bitcast<f32>(lanes[LANES_SPACING]) + behind_last + ahead;
}

// Length of a tractor and its trailer, stretched (2^-10 m).
fn stretched(rig: Rig) -> i32 {
    return in_lengths(rig.tractor_body.front - rig.fifth_wheel + rig.trailer_wheelbase - rig.trailer_body.rear);
}

fn reach_around(unit: Outline, middle: vec2<f32>) -> f32 {
    return distance(unit.middle, middle) + unit.half_length + unit.half_width;
}

// A length and a speed in the units of decisions.
fn in_lengths(metres: f32) -> i32 {
    return i32(round(metres * METRE));
}

fn in_speeds(metres_per_second: f32) -> i32 {
    return i32(round(metres_per_second * PACE));
}

// Both units in 1 s and in 2 s at constant speed and steer angle: the tractor on a circle, the trailer behind it.
fn foreseen(rig: Rig, now: Truck) -> array<Outline, 4> {
    let yaw_rate = yaw_rate_of(rig, now);
    var ahead = now;
    var later = array<Outline, 4>();
    for (var k = 0u; k < 4u; k += 2u) {
        for (var n = 0u; n < STEPS_AHEAD; n++) {
            let turn = sin_cos(ahead.heading - ahead.trailer_heading);
            let trailer_yaw_rate = (now.speed * turn.x + rig.fifth_wheel * yaw_rate * turn.y) / rig.trailer_wheelbase;
            ahead.position += STEP_AHEAD * now.speed * direction(ahead.heading + 0.5 * STEP_AHEAD * yaw_rate);
            ahead.heading += STEP_AHEAD * yaw_rate;
            ahead.trailer_heading += STEP_AHEAD * trailer_yaw_rate;
        }
        later[k] = tractor_outline(ahead);
        later[k + 1u] = trailer_outline(ahead);
    }
    return later;
}

// Yaw rate of a tractor without slip (rad/s).
fn yaw_rate_of(rig: Rig, at: Truck) -> f32 {
    let turn = sin_cos(at.steering);
    return at.speed * turn.x / (turn.y * rig.wheelbase);
}

// Takes a truck's place on its path into account: a car at its line yields to one that has entered, longer than to a
// car, and does not enter beside it.
fn mind_at_line(driver: ptr<function, Driver>, view: View) {
    let me = (*driver).me;
    // A truck that can still wait is no more in the way than a car that does.
    if view.waits || !me.waits || me.is_rude { return; }
    let network = (*driver).network;
    let zones = all_zones_of(network, (*driver).path, view.path);
    for (var z = zones.x; z < zones.x + zones.y; z++) {
        if is_in_the_way(*driver, view, zone_at(network.zones + ZONE_WORDS * z)) { (*driver).stops = true; }
    }
}

// Whether a car at its line waits for a truck in a zone of their paths.
fn is_in_the_way(driver: Driver, view: View, zone: Zone) -> bool {
    let me = driver.me;
    let of_entry = zone.kind == WIDE || is_of_entry(me, zone);
    let out_of_sight = SIGHT < zone.a_in - me.station || SIGHT_OF_OTHERS < zone.b_in - view.station;
    let rear = view.station - view.length;
    if !of_entry || zone.a_in <= me.station || out_of_sight || zone.b_out + LEFT < rear { return false; }
    let to_line = time_to_line(me);
    if view.station < zone.b_in {
        let speed = max(view.speed, LEAST_SPEED);
        let comes = time_of(zone.b_in - view.station, speed);
        let gone = comes + time_of(zone.b_out - zone.b_in + view.length, speed);
        // Beside a truck a car needs as much time as where their paths meet.
        return comes < lag_of(driver, FOLLOW) + LAG_OF_TRUCK + to_line && to_line < gone;
    }
    // Beside: it may need the lanes beside its own.
    if zone.kind == SOFT || zone.kind == WIDE { return true; }
    if zone.kind == CROSS {
        return to_line + GONE_BEFORE < time_of(max(zone.b_out - rear, 0), max(view.speed, LEAST_CROSSING));
    }
    // Once its rear has passed, it is followed as what is in the corridor.
    return beside(zone, rear) < zone.a_in;
}

// Takes the ground that a truck covers into account: a car follows what is in its corridor, slows for what will be, and
// brakes for what it would touch. `rank` is the truck's in its group, from 1 on.
fn mind_in_corridor(driver: ptr<function, Driver>, view: View, car: Car, rank: i32) {
    let me = (*driver).me;
    let network = (*driver).network;
    let first = sample_behind(network, car);
    let at_front = sample_position(network, car, first);
    if is_far_from(view, at_front) { return; }
    let n = min(path_word(network, path_of(car), 1u) - first, CORRIDOR_SAMPLES);
    var leader = n;
    for (var k = 0u; k < n && leader == n; k++) {
        let is_beside_front = f32(first + k) * SPACING < station_of(car);
        let swept = corridor_at(network, car, first + k);
        let room = swept.half_width + select(CORRIDOR_ROOM, ROOM_AT_FRONT, is_beside_front);
        if squared_to_now(view, swept.point) < room * room { leader = k; }
    }
    if leader < n {
        let rear = in_lengths(f32(first + leader) * SPACING - BEFORE_SAMPLE);
        let speed = speed_along(view, network, car, first + leader);
        let gap = rear - me.station;
        if me.waits && me.line + BEHIND_LINE < rear {
            stop_or_follow(driver, me.line - me.station, gap, speed);
        } else {
            heed(driver, interaction_behind(*driver, gap, speed));
        }
        note_leader(driver, rear, rank, speed);
    }
    if !view.waits && !me.is_rude {
        for (var k = 0u; k < leader; k++) {
            let swept = corridor_at(network, car, first + k);
            let point = swept.point;
            let room = swept.half_width + ROOM_LATER;
            var squared = distance_squared_to(view.later[0], point);
            for (var unit = 1u; unit < 4u; unit++) {
                squared = min(squared, distance_squared_to(view.later[unit], point));
            }
            if squared < room * room {
                slow_for(driver, view, in_lengths(f32(first + k) * SPACING - BEFORE_SAMPLE));
                break;
            }
        }
    }
    if touches_soon(view, network, car, at_front) { heed(driver, BRAKES_HARDEST); }
}

// What a car needs of its corridor at a sample: a point in its middle, and half its width (m).
struct Swept {
    point: vec2<f32>,
    half_width: f32,
}

fn corridor_at(network: Network, car: Car, sample: u32) -> Swept {
    let point = sample_position(network, car, sample);
    if large_of(style_of(car)) == 0u { return Swept(point, half_width_of(car)); }
    let band = band_at(network, car, sample);
    let at = network.samples + SAMPLE_WORDS * (path_word(network, path_of(car), 0u) + sample);
    return Swept(point + band.x * perpendicular(lanes_vector(at + 2u)), band.y);
}

// Slows for a truck that will be at a station of the car's path, or waits (2^-10 m).
fn slow_for(driver: ptr<function, Driver>, view: View, rear: i32) {
    let me = (*driver).me;
    if me.waits && me.line < rear {
        (*driver).stops = true;
    } else {
        heed(driver, min(interaction_behind(*driver, rear - me.station, view.speed / 2), BRAKES_GENTLY));
    }
}

// Whether a car is about to touch a truck, with its front near a point.
fn touches_soon(view: View, network: Network, car: Car, front: vec2<f32>) -> bool {
    let near = NEAR_UNIT + select(0.0, LONGER_THAN_CAR, large_of(style_of(car)) != 0u);
    if near * near <= squared_to_now(view, front) { return false; }
    // A station's unit is half of a speed's way in a step.
    let ahead = Car(car.station + 2 * CAR_STEPS_AHEAD * car.speed + MORE_AHEAD, car.speed, car.what, 0);
    let tractor = grown_by(view.tractor, LEAST_ROOM, LEAST_ROOM);
    let trailer = grown_by(view.trailer, LEAST_ROOM, LEAST_ROOM);
    return is_covering(network, ahead, tractor, trailer);
}

// The ground that a unit covers, and the room before, behind and beside it.
fn grown_by(unit: Outline, along: f32, beside: f32) -> Outline {
    return Outline(unit.middle, unit.along, unit.half_length + along, unit.half_width + beside);
}

// Squared distance to the ground that a truck covers (m²).
fn squared_to_now(view: View, point: vec2<f32>) -> f32 {
    return min(distance_squared_to(view.tractor, point), distance_squared_to(view.trailer, point));
}

// Speed of a truck along a sample of a car's path (2^-14 m a step).
fn speed_along(view: View, network: Network, car: Car, sample: u32) -> i32 {
    let at = network.samples + SAMPLE_WORDS * (path_word(network, path_of(car), 0u) + sample);
    return clamp(in_speeds(dot(view.velocity, lanes_vector(at + 2u))), 0, FASTEST);
}

// Whether nothing of a truck's ground is in the corridor of a car with its front near a point.
fn is_far_from(view: View, front: vec2<f32>) -> bool {
    let reach = view.radius + f32(CORRIDOR_SAMPLES) * SPACING;
    let between = front - view.middle;
    return reach * reach < dot(between, between);
}

// The sample of its path behind a car's front, counted from the path's first.
fn sample_behind(network: Network, car: Car) -> u32 {
    return min(u32(max(station_of(car) / SPACING, 0.0)), path_word(network, path_of(car), 1u) - 1u);
}

fn sample_position(network: Network, car: Car, sample: u32) -> vec2<f32> {
    return lanes_vector(network.samples + SAMPLE_WORDS * (path_word(network, path_of(car), 0u) + sample));
}

// Squared distance of a point from a rectangle, 0 inside (m²).
fn distance_squared_to(outline: Outline, point: vec2<f32>) -> f32 {
    let away = point - outline.middle;
    let ahead = max(abs(dot(away, outline.along)) - outline.half_length, 0.0);
    let aside = max(abs(dot(away, perpendicular(outline.along))) - outline.half_width, 0.0);
    return ahead * ahead + aside * aside;
}
