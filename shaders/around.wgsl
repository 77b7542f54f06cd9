// Writes what is observed of other vehicles: 42 values, see src/layout/vehicles.rs.
//
// What comes to the own entry, and what is ahead, follow from the zones in which the truck's path meets those of the
// others. Every value is a least one or one in the order of distances.

// Farther than everything that is observed (m, s).
const NOWHERE: f32 = 1e9;

// Where an entry point has values written: as those after the action, and as those before the next one.
var<private> writes_next: bool;
var<private> writes_first: bool;

// What is observed after the action.
@compute @workgroup_size(WORKGROUP)
fn observe_around(thread: Thread) {
    writes_next = true;
    writes_first = false;
    let env = index_of(thread);
    if is_driving(env) { look(env); }
}

// The same as what is observed before the next action.
@compute @workgroup_size(WORKGROUP)
fn copy_around(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    for (var n = 0u; n < N_AROUND; n++) { around[env * N_AROUND + n] = next_around[env * N_AROUND + n]; }
}

// Both at once.
@compute @workgroup_size(WORKGROUP)
fn around_both(thread: Thread) {
    writes_next = true;
    writes_first = true;
    let env = index_of(thread);
    if is_driving(env) { look(env); }
}

// What the trucks observe first that began another episode. With NEXT_STEP they have no last step.
@compute @workgroup_size(WORKGROUP)
fn around_after_reset(thread: Thread) {
    writes_next = batch.autoreset == NEXT_STEP;
    writes_first = true;
    let env = index_of(thread);
    if has_begun(env) { look(env); }
}

// Takes back what describes the last step of the trucks that the caller named: they have none.
@compute @workgroup_size(WORKGROUP)
fn forget_around(thread: Thread) {
    let env = index_of(thread);
    if !is_to_begin(env) { return; }
    for (var n = 0u; n < N_AROUND; n++) { next_around[env * N_AROUND + n] = around[env * N_AROUND + n]; }
}

// Writes a value of a truck.
fn write_seen(env: u32, value: u32, seen: f32) {
    if writes_next { next_around[env * N_AROUND + value] = seen; }
    if writes_first { around[env * N_AROUND + value] = seen; }
}

// A truck that looks around: where it is on its path, and on the ground.
struct Looking {
    network: Network,
    path: u32,
    // Station of the line before the ring (m).
    line: f32,
    // Station of its front, as vehicles see it (m).
    front: f32,
    // Length of both units (m).
    length: f32,
    tractor: Outline,
    trailer: Outline,
    // Middle of the drive axle (m).
    origin: vec2<f32>,
    // Unit vector along the tractor.
    along: vec2<f32>,
}

fn looking_of(env: u32) -> Looking {
    let at = truck[env];
    let rig = vehicles[at.vehicle].rig;
    let network = network_of(at.route);
    let path = path_of_route(at.route);
    return Looking(
        network,
        path,
        in_metres(line_of_path(network, path)),
        in_metres(in_lengths(front_station(env))),
        in_metres(stretched(rig)),
        tractor_outline(at),
        trailer_outline(at),
        at.position,
        direction(at.heading),
    );
}

// Another vehicle: a car, or a truck of the same group behind the slots of cars.
struct Other {
    // NO_PATH where there is none.
    path: u32,
    // Station of its front (m).
    station: f32,
    // Its speed (m/s).
    speed: f32,
    // Its length (m).
    length: f32,
}

// Trucks of a group behind the slots of cars, the one that looks around among them: none where it is alone.
fn n_mates() -> u32 {
    return select(batch.group, 0u, batch.group == 1u);
}

// Others that there may be.
fn n_others() -> u32 {
    return N_CARS + n_mates();
}

// Index in the batch of the truck that is an other.
fn mate_at(env: u32, index: u32) -> u32 {
    return first_of_group(env) + index - N_CARS;
}

fn has_other(env: u32, index: u32) -> bool {
    if index < N_CARS { return is_there(car_at(env, index)); }
    let mate = mate_at(env, index);
    return mate != env && is_driving(mate);
}

fn other_at(env: u32, index: u32) -> Other {
    if index < N_CARS {
        let car = car_at(env, index);
        return Other(path_of(car), station_of(car), speed_of(car), length_of(car));
    }
    if !has_other(env, index) { return Other(NO_PATH, 0.0, 0.0, 0.0); }
    let mate = mate_at(env, index);
    let at = truck[mate];
    let station = in_metres(in_lengths(front_station(mate)));
    return Other(path_of_route(at.route), station, at.speed, in_metres(stretched(vehicles[at.vehicle].rig)));
}

fn speed_of_other(env: u32, index: u32) -> f32 {
    if index < N_CARS { return speed_of(car_at(env, index)); }
    return truck[mate_at(env, index)].speed;
}

// Units that there may be: one of each car, then two of each truck, then the trailers of cars.
fn n_units_around(network: Network) -> u32 {
    return n_first_units() + select(0u, N_CARS, network.large != 0u);
}

fn n_first_units() -> u32 {
    return N_CARS + 2u * n_mates();
}

// Whether a car has the trailer that a unit is, or a unit is no such.
fn has_unit(env: u32, unit: u32) -> bool {
    return has_other(env, whose(unit)) && (unit < n_first_units() || has_trailer(car_at(env, whose(unit))));
}

// Index of the other that has a unit.
fn whose(unit: u32) -> u32 {
    if unit < N_CARS { return unit; }
    if n_first_units() <= unit { return unit - n_first_units(); }
    return N_CARS + (unit - N_CARS) / 2u;
}

// The first unit of an other.
fn first_unit(index: u32) -> u32 {
    if index < N_CARS { return index; }
    return N_CARS + 2u * (index - N_CARS);
}

// The ground that a unit covers.
fn outline_of_unit(env: u32, network: Network, unit: u32) -> Outline {
    if unit < N_CARS { return outline_of(network, car_at(env, unit)); }
    if n_first_units() <= unit { return trailer_of(network, car_at(env, whose(unit))); }
    let at = truck[mate_at(env, whose(unit))];
    if (unit - N_CARS) % 2u == 0u { return tractor_outline(at); }
    return trailer_outline(at);
}

// Writes what a truck observes of the vehicles around it.
fn look(env: u32) {
    let looking = looking_of(env);
    look_at_entry(env, looking);
    write_seen(env, LINE_AT, clamp((looking.line - looking.front) / GAP_SCALE, 0.0, 1.0));
    write_seen(env, HAS_ENTERED_AT, select(0.0, 1.0, looking.line < looking.front));
    look_ahead(env, looking);
    look_beside(env, looking);
}

// A zone of the truck's path with that of a car, in metres.
struct Meeting {
    // Where it begins and ends on the truck's path.
    own_in: f32,
    own_out: f32,
    // Where it begins and ends on the car's.
    its_in: f32,
    its_out: f32,
    // Station on the car's path less that on the truck's.
    delta: f32,
    kind: u32,
}

fn meeting_at(network: Network, index: u32) -> Meeting {
    let zone = zone_at(network.zones + ZONE_WORDS * index);
    return Meeting(
        in_metres(zone.a_in),
        in_metres(zone.a_out),
        in_metres(zone.b_in),
        in_metres(zone.b_out),
        in_metres(zone.delta),
        zone.kind,
    );
}

// A vehicle that comes to the entry.
struct Coming {
    // Time until it is there (s).
    arrival: f32,
    // Distance that it has to go (m).
    distance: f32,
    // Time until it has left (s).
    gone: f32,
}

// The one of two that is there first; of two that are there together, the one that takes longer to leave.
fn first_of(one: Coming, other: Coming) -> Coming {
    if one.arrival != other.arrival {
        if one.arrival < other.arrival { return one; }
        return other;
    }
    if one.gone != other.gone {
        if other.gone < one.gone { return one; }
        return other;
    }
    if one.distance <= other.distance { return one; }
    return other;
}

fn is_beside(kind: u32) -> bool {
    return kind == SOFT || kind == WIDE;
}

fn is_of_own_entry(looking: Looking, meeting: Meeting) -> bool {
    return meeting.own_in <= looking.line + ENTRY_REACH && (is_beside(meeting.kind) || looking.line < meeting.own_in);
}

// Writes the first vehicle that comes to the entry, by lane.
fn look_at_entry(env: u32, looking: Looking) {
    var near = Coming(NOWHERE, NOWHERE, NOWHERE);
    var beyond = Coming(NOWHERE, NOWHERE, NOWHERE);
    for (var index = 0u; index < n_others(); index++) {
        let other = other_at(env, index);
        if other.path == NO_PATH { continue; }
        let station = other.station;
        let its_line = in_metres(line_of_path(looking.network, other.path));
        let waits = station + other.speed * other.speed / STILL_STOPS_WITH <= its_line;
        let zones = all_zones_of(looking.network, looking.path, other.path);
        var touches = false;
        for (var z = 0u; z < zones.y; z++) {
            let meeting = meeting_at(looking.network, zones.x + z);
            touches = touches || (is_of_own_entry(looking, meeting) && meeting.kind != WIDE);
        }
        for (var z = 0u; z < zones.y; z++) {
            let meeting = meeting_at(looking.network, zones.x + z);
            if !is_of_own_entry(looking, meeting) { continue; }
            // A car that runs together with the truck leads it once it is through.
            let end = select(meeting.its_out, meeting.its_in, meeting.kind == FOLLOW);
            let has_left = meeting.own_out < looking.front - looking.length || end < station - other.length;
            if has_left || (waits && its_line < meeting.its_in) || (touches && meeting.kind == WIDE) { continue; }
            let speed = max(other.speed, LEAST_COMING_SPEED);
            let distance = max(meeting.its_in - station, 0.0);
            let coming = Coming(distance / speed, distance, (end + other.length - station) / speed);
            if is_beside(meeting.kind) || looking.line + NEAREST_LANE < meeting.own_in {
                beyond = first_of(beyond, coming);
            } else {
                near = first_of(near, coming);
            }
        }
    }
    write_coming(env, 0u, near);
    write_coming(env, 1u, beyond);
}

fn write_coming(env: u32, lane: u32, coming: Coming) {
    write_seen(env, ARRIVAL_AT + lane, min(coming.arrival / TIME_SCALE, 1.0));
    write_seen(env, DISTANCE_AT + lane, min(coming.distance / GAP_SCALE, 1.0));
    write_seen(env, GONE_AT + lane, min(coming.gone / TIME_SCALE, 1.0));
}

// Writes the distance to what is next on the truck's path, and its speed.
fn look_ahead(env: u32, looking: Looking) {
    var least = NOWHERE;
    var next = 0u;
    for (var index = 0u; index < n_others(); index++) {
        let other = other_at(env, index);
        if other.path == NO_PATH { continue; }
        let station = other.station;
        let rear = station - other.length;
        let zones = all_zones_of(looking.network, looking.path, other.path);
        for (var z = 0u; z < zones.y; z++) {
            let meeting = meeting_at(looking.network, zones.x + z);
            if meeting.its_out <= rear || station <= meeting.its_in { continue; }
            var gap = NOWHERE;
            if meeting.kind == FOLLOW && looking.front < station - meeting.delta {
                gap = max(max(rear - meeting.delta, meeting.own_in) - looking.front, 0.0);
            } else if meeting.kind == CROSS && looking.front < meeting.own_out {
                gap = max(meeting.own_in - looking.front, 0.0);
            }
            if gap < least {
                least = gap;
                next = index;
            }
        }
    }
    var speed_along = 1.0;
    if least < NOWHERE {
        let along = outline_of_unit(env, looking.network, first_unit(next)).along;
        let ahead = direction_at(looking.network, looking.path, looking.front + least);
        speed_along = speed_of_other(env, next) * dot(along, ahead) / VEHICLE_SPEED_SCALE;
    }
    write_seen(env, GAP_AT, min(least / GAP_SCALE, 1.0));
    write_seen(env, GAP_SPEED_AT, clamp(speed_along, -1.0, 1.0));
}

// Writes the room of both units, and the vehicles nearest to either.
fn look_beside(env: u32, looking: Looking) {
    var tractor_room = ROOM_SCALE;
    var trailer_room = ROOM_SCALE;
    // The nearest units and their distances, by distance and then by number.
    var distances = array<f32, N_NEAREST>();
    var units = array<u32, N_NEAREST>();
    for (var rank = 0u; rank < N_NEAREST; rank++) { distances[rank] = NOWHERE; }
    for (var unit = 0u; unit < n_units_around(looking.network); unit++) {
        if !has_unit(env, unit) { continue; }
        let outline = outline_of_unit(env, looking.network, unit);
        tractor_room = min(tractor_room, room_between(looking.tractor, outline));
        trailer_room = min(trailer_room, room_between(looking.trailer, outline));
        let to_tractor = distance_squared_to(looking.tractor, outline.middle);
        var distance = sqrt(min(to_tractor, distance_squared_to(looking.trailer, outline.middle)));
        var placed = unit;
        for (var rank = 0u; rank < N_NEAREST; rank++) {
            let known = distances[rank];
            let known_unit = units[rank];
            if distance < known || (distance == known && placed < known_unit) {
                distances[rank] = distance;
                units[rank] = placed;
                distance = known;
                placed = known_unit;
            }
        }
    }
    write_seen(env, ROOM_AT, tractor_room / ROOM_SCALE);
    write_seen(env, ROOM_AT + 1u, trailer_room / ROOM_SCALE);
    for (var rank = 0u; rank < N_NEAREST; rank++) {
        var seen = array<f32, 5>();
        if distances[rank] < NEAR_SCALE {
            let outline = outline_of_unit(env, looking.network, units[rank]);
            seen = seen_nearest(looking, outline, speed_of_other(env, whose(units[rank])));
        }
        for (var group = 0u; group < 5u; group++) {
            write_seen(env, NEAREST_AT + group * N_NEAREST + rank, clamp(seen[group], -1.0, 1.0));
        }
    }
}

// What is observed of one of the nearest vehicles.
fn seen_nearest(looking: Looking, outline: Outline, speed: f32) -> array<f32, 5> {
    let to = (outline.middle - looking.origin) / NEAR_SCALE;
    let velocity = speed / VEHICLE_SPEED_SCALE * outline.along;
    let left = perpendicular(looking.along);
    return array<f32, 5>(1.0, dot(to, looking.along), dot(to, left), dot(velocity, looking.along), dot(velocity, left));
}

// Distance between two rectangles, at most ROOM_SCALE: that of the corners of each from the other (m).
fn room_between(one: Outline, other: Outline) -> f32 {
    let reach = one.half_length + one.half_width + other.half_length + other.half_width;
    if ROOM_SCALE + reach < distance(one.middle, other.middle) { return ROOM_SCALE; }
    if are_overlapping(one, other) { return 0.0; }
    return min(min(to_corners(one, other), to_corners(other, one)), ROOM_SCALE);
}

// Distance of the nearest corner of a rectangle from another (m).
fn to_corners(outline: Outline, other: Outline) -> f32 {
    let along = outline.half_length * outline.along;
    let across = outline.half_width * perpendicular(outline.along);
    let ahead = min(
        distance_squared_to(other, outline.middle + along + across),
        distance_squared_to(other, outline.middle + along - across),
    );
    let behind = min(
        distance_squared_to(other, outline.middle - along + across),
        distance_squared_to(other, outline.middle - along - across),
    );
    return sqrt(min(ahead, behind));
}
