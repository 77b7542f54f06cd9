// Cars as the column of cars has them, the tables of the roads that they drive on, and the ground that they and trucks
// cover. Nothing is written here: pictures read it too.
//
// Integers of 32 bits in the units of src/traffic/units.rs; outlines alone are floats.

// A car, or a slot without one.
struct Car {
    // Station of its front (2^-20 m).
    station: i32,
    // Its speed (2^-19 m a step).
    speed: i32,
    // Path in 10 bits, style in 10, steps for which it has been standing in 12.
    what: u32,
    // The acceleration that it decided last (2^-19 m a step²); between deciding and arriving with a mark.
    acceleration: i32,
}

// A slot without a car.
fn no_car() -> Car {
    return Car(0, 0, NO_PATH, 0);
}

fn car_at(env: u32, slot: u32) -> Car {
    let at = env * N_CAR_WORDS + CAR_WORDS * slot;
    return Car(bitcast<i32>(cars[at]), bitcast<i32>(cars[at + 1u]), cars[at + 2u], bitcast<i32>(cars[at + 3u]));
}

// Bit of an acceleration at which the mark stands that its car slows for a truck more than for cars: threads of cars
// share no word to write that to. Accelerations take fewer bits; the highest two are equal but for the mark.
const MARK: u32 = 30u;

// What a car decided, as a word with the mark.
fn marked(acceleration: i32, slows_for_truck: bool) -> u32 {
    return bitcast<u32>(acceleration) ^ (u32(slows_for_truck) << MARK);
}

// Whether what a car decided has the mark: 0 or 1.
fn marked_slow(car: Car) -> u32 {
    return u32(unmarked(car).acceleration != car.acceleration);
}

// The car without the mark.
fn unmarked(car: Car) -> Car {
    return Car(car.station, car.speed, car.what, extractBits(car.acceleration, 0u, MARK));
}

// The car in a slot as others decide by it, while its own thread may write what it decides.
fn undecided_at(env: u32, slot: u32) -> Car {
    let at = env * N_CAR_WORDS + CAR_WORDS * slot;
    return Car(bitcast<i32>(cars[at]), bitcast<i32>(cars[at + 1u]), cars[at + 2u], 0);
}

fn is_there(car: Car) -> bool {
    return path_of(car) != NO_PATH;
}

fn path_of(car: Car) -> u32 {
    return car.what & NO_PATH;
}

fn style_of(car: Car) -> u32 {
    return (car.what >> STYLE) & NO_PATH;
}

// Station of its front, as decisions read it (2^-10 m).
fn front_of(car: Car) -> i32 {
    return car.station >> FINER_STATION;
}

// Its speed, as decisions read it (2^-14 m a step).
fn pace_of(car: Car) -> i32 {
    return car.speed >> FINER_SPEED;
}

// A length of decisions in metres.
fn in_metres(length: i32) -> f32 {
    return f32(length) * (1.0 / METRE);
}

// Which large vehicle has a style: 0 is a car or a van, 1 a bus, 2 a rigid truck, 3 a tractor-trailer.
fn large_of(style: u32) -> u32 {
    return (style >> LARGE) & N_LARGE;
}

// The class of a style by the room that its vehicle needs.
fn class_of(style: u32) -> u32 {
    return (large_of(style) + 1u) / 2u;
}

// Length of path that a vehicle of a style takes (2^-10 m).
fn extent(style: u32) -> i32 {
    switch large_of(style) {
        case 1u: { return BUS_LENGTH; }
        case 2u: { return RIGID_LENGTH; }
        case 3u: { return COMBINATION_LENGTH; }
        default: {}
    }
    return select(SHORTEST + LONGER * i32((style >> LENGTH) & 3u), VAN_LENGTH, (style & VAN) == VAN);
}

// Length of a car (m).
fn length_of(car: Car) -> f32 {
    return in_metres(extent(style_of(car)));
}

// Station of its front (m).
fn station_of(car: Car) -> f32 {
    return f32(car.station) * (1.0 / STATE_METRE);
}

// Its speed (m/s).
fn speed_of(car: Car) -> f32 {
    return f32(car.speed) / STATE_SPEED;
}

// Half the width of a car (m).
fn half_width_of(car: Car) -> f32 {
    let large = large_of(style_of(car));
    if large != 0u { return select(LARGE_HALF_WIDTH, COMBINATION_HALF_WIDTH, large == 3u); }
    return select(HALF_WIDTH, VAN_HALF_WIDTH, is_van(car));
}

fn is_van(car: Car) -> bool {
    return (style_of(car) & VAN) == VAN;
}

// From -15, who drives slowly and keeps his distance, to 15, in steps of 2.
fn temperament_of(car: Car) -> i32 {
    return 2 * i32(style_of(car) & TEMPERAMENT) - i32(TEMPERAMENT);
}

// A car after a step with its acceleration, which it held; it stops where its speed reaches 0.
fn car_moved(car: Car) -> Car {
    let acceleration = unmarked(car).acceleration;
    let speed = car.speed + acceleration;
    var way = car.speed + speed;
    // What stops within the step is slower than its braking in a step: the square fits.
    if speed < 0 { way = car.speed * car.speed / -acceleration; }
    let standing = select(0u, min((car.what >> STANDING) + 1u, MOST_STANDING), speed < STANDS);
    let what = (car.what & ((1u << STANDING) - 1u)) | (standing << STANDING);
    return Car(car.station + way, max(speed, 0), what, car.acceleration);
}

// Where the parts of a road's tables begin.
struct Network {
    n_paths: u32,
    n_sources: u32,
    paths: u32,
    samples: u32,
    pairs: u32,
    zones: u32,
    sources: u32,
    // 0 where there are no tables of large vehicles.
    large: u32,
    levels: u32,
}

// First word of a route in the table of lanes: where its road begins, its path there, and the station of its beginning.
fn lanes_row(route: u32) -> u32 {
    return LANES_ROUTES + LANES_ROUTE_WORDS * route;
}

// Index of the path that a route runs on.
fn path_of_route(route: u32) -> u32 {
    return lanes[lanes_row(route) + 1u];
}

// The network of a route's road.
fn network_of(route: u32) -> Network {
    let at = lanes[lanes_row(route)];
    let n_paths = lanes[at + 1u];
    let n_sources = lanes[at + 4u];
    let paths = at + NETWORK_HEAD;
    let samples = paths + PATH_WORDS * n_paths;
    let pairs = samples + SAMPLE_WORDS * lanes[at + 2u];
    let zones = pairs + PAIR_WORDS * n_paths * n_paths;
    let sources = zones + ZONE_WORDS * lanes[at + 3u];
    let end = sources + SOURCE_WORDS * n_sources;
    let has_large = (lanes[at] & HAS_LARGE) == HAS_LARGE;
    let large = select(0u, end + LARGE_HEAD, has_large);
    var levels = end;
    if has_large {
        let of_samples = (TRAIL_WORDS + BAND_WORDS) * lanes[at + 2u];
        let of_paths = (LINE_WORDS + 1u) * N_CLASSES * n_paths + LARGE_PAIRS * PAIR_WORDS * n_paths * n_paths;
        levels = large + of_paths + of_samples + ZONE_WORDS * lanes[end];
    }
    return Network(n_paths, n_sources, paths, samples, pairs, zones, sources, large, levels);
}

// Samples of all paths.
fn samples_of(network: Network) -> u32 {
    return (network.pairs - network.samples) / SAMPLE_WORDS;
}

// Station of the line of a car, and where it is clear of the lanes that it crosses on its way in (2^-10 m).
fn line_of_car(network: Network, car: Car) -> vec2<i32> {
    let path = path_of(car);
    var at = network.paths + PATH_WORDS * path + 3u;
    if network.large != 0u { at = network.large + LINE_WORDS * (class_of(style_of(car)) * network.n_paths + path); }
    return vec2<i32>(bitcast<i32>(lanes[at]), bitcast<i32>(lanes[at + 1u]));
}

// Whether a vehicle can take a path without the lanes of those who come the other way.
fn fits(network: Network, path: u32, style: u32) -> bool {
    if network.large == 0u { return true; }
    let flags = network.large + LINE_WORDS * N_CLASSES * network.n_paths;
    return lanes[flags + class_of(style) * network.n_paths + path] == 1u;
}

// First words of the ordered pair of paths that two cars drive, and of the table of its zones.
fn pair_of(network: Network, one: Car, other: Car) -> vec2<u32> {
    let n = network.n_paths;
    let pair = PAIR_WORDS * (path_of(one) * n + path_of(other));
    let classes = class_of(style_of(one)) * N_CLASSES + class_of(style_of(other));
    if network.large == 0u || classes == 0u { return vec2<u32>(network.pairs + pair, network.zones); }
    let pairs = bands_of(network) + BAND_WORDS * samples_of(network);
    let zones = pairs + LARGE_PAIRS * PAIR_WORDS * n * n;
    return vec2<u32>(pairs + PAIR_WORDS * (classes - 1u) * n * n + pair, zones);
}

// Words of a path's row.
fn path_word(network: Network, path: u32, word: u32) -> u32 {
    return lanes[network.paths + PATH_WORDS * path + word];
}

fn length_of_path(network: Network, path: u32) -> i32 {
    return bitcast<i32>(path_word(network, path, 2u));
}

fn line_of_path(network: Network, path: u32) -> i32 {
    return bitcast<i32>(path_word(network, path, 3u));
}

// Speed of a car that nothing hinders: linear between samples (2^-14 m a step, 2^-20 m).
fn limit_at(network: Network, path: u32, station: i32) -> i32 {
    let k = clamp(station >> SPACING_BITS, 0, i32(path_word(network, path, 1u)) - 2);
    let whole = 1i << CELL_BITS;
    let t = clamp((station - (k << SPACING_BITS)) >> FINER_STATION, 0, whole);
    let at = network.samples + SAMPLE_WORDS * (path_word(network, path, 0u) + u32(k)) + 4u;
    let from_limit = bitcast<i32>(lanes[at]);
    let to_limit = bitcast<i32>(lanes[at + SAMPLE_WORDS]);
    return (from_limit * (whole - t) + to_limit * t) >> CELL_BITS;
}

// The zone of two paths in the units of decisions (2^-10 m).
struct Zone {
    a_in: i32,
    a_out: i32,
    b_in: i32,
    b_out: i32,
    delta: i32,
    // How far a station on a goes less than a metre for each metre on b, within the zone (2^-12).
    slower: i32,
    kind: u32,
}

fn zone_at(at: u32) -> Zone {
    let a = lanes[at];
    let b = lanes[at + 1u];
    let rest = lanes[at + 2u];
    return Zone(
        i32((a & 0xffffu) << UNIT_BITS),
        i32((a >> 16u) << UNIT_BITS),
        i32((b & 0xffffu) << UNIT_BITS),
        i32((b >> 16u) << UNIT_BITS),
        extractBits(bitcast<i32>(rest), 0u, 16u) << UNIT_BITS,
        bitcast<i32>(rest) >> (16u + ZONE_RATIO),
        (rest >> 16u) & 3u,
    );
}

// The station on a that is beside one on b (2^-10 m).
fn beside(zone: Zone, station: i32) -> i32 {
    let within = clamp(station, zone.b_in, zone.b_out) - zone.b_in;
    return station - zone.delta - (((within >> 2u) * zone.slower) >> (ZONE_RATIO_BITS - 2u));
}

// The zones of an ordered pair of paths, those for a truck alone among them: the first, and how many.
fn all_zones_of(network: Network, a: u32, b: u32) -> vec2<u32> {
    let pair = lanes[network.pairs + PAIR_WORDS * (a * network.n_paths + b)];
    return vec2<u32>(pair & 0xffffu, pair >> 24u);
}

// The cell of a pair's ends that a station lies in, or the first or last one (2^-10 m).
fn pair_cell(station: i32) -> u32 {
    return u32(clamp(station >> CELL_BITS, 0, 255));
}

// Whether a random word falls below a probability in units of 2^-24.
fn falls_below(word: u32, probability: u32) -> bool {
    return word >> 8u < probability;
}

// The trucks of a group draw alike, so that each finds the same of their vehicles.
fn traffic_words(env: u32, draw: u32) -> vec4<u32> {
    let stream = streams[first_of_group(env)];
    return words(stream.seed, stream.env, truck[env].episode, draw);
}

// A rectangle on the ground: its middle, a unit vector along it, half its length and half its width (m).
struct Outline {
    middle: vec2<f32>,
    along: vec2<f32>,
    half_length: f32,
    half_width: f32,
}

// The ground that a car covers, whose axles are both on the path, or a bus, a rigid truck or a tractor.
fn outline_of(network: Network, car: Car) -> Outline {
    if large_of(style_of(car)) != 0u { return first_of_large(network, car); }
    let length = length_of(car);
    let station = station_of(car);
    let front = point_at(network, path_of(car), station - OVERHANG * length);
    let rear = point_at(network, path_of(car), station - (1.0 - OVERHANG) * length);
    return Outline(0.5 * (front + rear), unit_or_zero(front - rear), 0.5 * length, half_width_of(car));
}

// A vector's direction; of none, as between two axles before the beginning of a path, zero.
fn unit_or_zero(vector: vec2<f32>) -> vec2<f32> {
    return select(vec2<f32>(), normalize(vector), any(vector != vec2<f32>()));
}

// Direction at a station of a path: linear between samples.
fn direction_at(network: Network, path: u32, station: f32) -> vec2<f32> {
    let along = clamp(station / SPACING, 0.0, f32(path_word(network, path, 1u)) - 1.001);
    let k = u32(along);
    let at = network.samples + SAMPLE_WORDS * (path_word(network, path, 0u) + k) + 2u;
    let before = lanes_vector(at);
    return normalize(before + (along - f32(k)) * (lanes_vector(at + SAMPLE_WORDS) - before));
}

// The ground that a unit covers.
fn unit_outline(body: Body, position: vec2<f32>, heading: f32) -> Outline {
    let along = direction(heading);
    let middle = position + 0.5 * (body.front + body.rear) * along;
    return Outline(middle, along, 0.5 * (body.front - body.rear), body.half_width);
}

// The ground that a truck's tractor covers.
fn tractor_outline(at: Truck) -> Outline {
    return unit_outline(vehicles[at.vehicle].rig.tractor_body, at.position, at.heading);
}

// The ground that its trailer covers.
fn trailer_outline(at: Truck) -> Outline {
    let rig = vehicles[at.vehicle].rig;
    return unit_outline(rig.trailer_body, trailer_position(rig, at), at.trailer_heading);
}

// Position at a station of a path: cubic between samples (m).
fn point_at(network: Network, path: u32, station: f32) -> vec2<f32> {
    let along = clamp(station / SPACING, 0.0, f32(path_word(network, path, 1u)) - 1.001);
    let k = u32(along);
    let t = along - f32(k);
    let at = network.samples + SAMPLE_WORDS * (path_word(network, path, 0u) + k);
    let to_at = at + SAMPLE_WORDS;
    let t2 = t * t;
    let t3 = t2 * t;
    return (2.0 * t3 - 3.0 * t2 + 1.0) * lanes_vector(at)
        + (t3 - 2.0 * t2 + t) * SPACING * lanes_vector(at + 2u)
        + (3.0 * t2 - 2.0 * t3) * lanes_vector(to_at)
        + (t3 - t2) * SPACING * lanes_vector(to_at + 2u);
}

fn lanes_vector(at: u32) -> vec2<f32> {
    return vec2<f32>(bitcast<f32>(lanes[at]), bitcast<f32>(lanes[at + 1u]));
}

// How far a rectangle reaches from its middle in a direction (m).
fn reach_of(outline: Outline, towards: vec2<f32>) -> f32 {
    return outline.half_length * abs(dot(outline.along, towards))
        + outline.half_width * abs(dot(perpendicular(outline.along), towards));
}

// Whether two rectangles overlap: none of their sides' directions separates them.
fn are_overlapping(one: Outline, other: Outline) -> bool {
    return reach_along(one, other, one.along) && reach_along(one, other, perpendicular(one.along))
        && reach_along(one, other, other.along) && reach_along(one, other, perpendicular(other.along));
}

fn reach_along(one: Outline, other: Outline, axis: vec2<f32>) -> bool {
    return abs(dot(other.middle - one.middle, axis)) < reach_of(one, axis) + reach_of(other, axis);
}
