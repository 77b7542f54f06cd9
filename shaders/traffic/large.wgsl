// Buses, rigid trucks and tractor-trailers: the ground that they cover, and the room that they sweep: see
// src/traffic/large.rs.

// Whether a trailer is behind a car's first unit.
fn has_trailer(car: Car) -> bool {
    return large_of(style_of(car)) == 3u;
}

// The ground that the trailer of a tractor-trailer covers.
fn trailer_of(network: Network, car: Car) -> Outline {
    return last_unit(network, car);
}

// That of the first unit of a large vehicle.
fn first_of_large(network: Network, car: Car) -> Outline {
    if !has_trailer(car) { return last_unit(network, car); }
    // Both axles of a tractor follow the same line.
    let front = trail_at(network, car, TRACTOR_FRONT_AXLE).point;
    let rear = trail_at(network, car, TRACTOR_DRIVE_AXLE).point;
    let along = unit_or_zero(front - rear);
    let half_length = 0.5 * TRACTOR_LENGTH;
    return Outline(front + (TRACTOR_FRONT_AXLE - half_length) * along, along, half_length, half_width_of(car));
}

// The unit whose rear axle follows as a tractrix.
fn last_unit(network: Network, car: Car) -> Outline {
    // What follows the path behind the front, the unit's front ahead of that, and the unit's length (m).
    var shape = vec3<f32>(COMBINATION_HINGE, TRAILER_AHEAD, TRAILER_LENGTH);
    if large_of(style_of(car)) == 1u { shape = vec3<f32>(BUS_HINGE, BUS_HINGE, BUS_BODY); }
    if large_of(style_of(car)) == 2u { shape = vec3<f32>(RIGID_HINGE, RIGID_HINGE, RIGID_BODY); }
    let trail = trail_at(network, car, shape.x);
    let half_length = 0.5 * shape.z;
    return Outline(trail.point + (shape.y - half_length) * trail.along, trail.along, half_length, half_width_of(car));
}

// A point of the line that a large vehicle follows, and the direction of its last unit once that has come there.
struct TrailPoint {
    point: vec2<f32>,
    along: vec2<f32>,
}

// That so far behind the front of a vehicle: linear between samples (m).
fn trail_at(network: Network, car: Car, behind: f32) -> TrailPoint {
    let path = path_of(car);
    let station = station_of(car) - behind;
    let along = clamp(station / SPACING, 0.0, f32(path_word(network, path, 1u)) - 1.001);
    let k = u32(along);
    let t = along - f32(k);
    let sample = path_word(network, path, 0u) + k;
    let at = trails_of(network) + TRAIL_WORDS * sample + 2u * (large_of(style_of(car)) - 1u);
    let from_direction = trail_direction(lanes[at]);
    let from_offset = in_metres(bitcast<i32>(lanes[at + 1u]));
    let to_direction = trail_direction(lanes[at + TRAIL_WORDS]);
    let to_offset = in_metres(bitcast<i32>(lanes[at + TRAIL_WORDS + 1u]));
    let offset = from_offset + t * (to_offset - from_offset);
    let left = perpendicular(direction_at(network, path, station));
    let point = point_at(network, path, station) + offset * left;
    return TrailPoint(point, normalize(from_direction + t * (to_direction - from_direction)));
}

// The direction of a trail, not quite of length 1.
fn trail_direction(word: u32) -> vec2<f32> {
    let x = extractBits(bitcast<i32>(word), 0u, 16u);
    let y = bitcast<i32>(word) >> 16u;
    return vec2<f32>(f32(x), f32(y)) / TRAIL_UNITS;
}

// The room that a large vehicle sweeps beside a sample of its path: how far its middle is to the left, and half its
// width (m).
fn band_at(network: Network, car: Car, sample: u32) -> vec2<f32> {
    let of_path = path_word(network, path_of(car), 0u) + sample;
    let sides = lanes[bands_of(network) + BAND_WORDS * of_path + large_of(style_of(car)) - 1u];
    let left = f32(sides & 0xffffu) / BAND_UNITS;
    let right = f32(sides >> 16u) / BAND_UNITS;
    return vec2<f32>(0.5 * (left - right), 0.5 * (left + right));
}

// Whether a unit of a car covers ground of one of two others.
fn is_covering(network: Network, car: Car, tractor: Outline, trailer: Outline) -> bool {
    let first = outline_of(network, car);
    if are_overlapping(first, tractor) || are_overlapping(first, trailer) { return true; }
    if !has_trailer(car) { return false; }
    let last = trailer_of(network, car);
    return are_overlapping(last, tractor) || are_overlapping(last, trailer);
}

// The first word of the trails of large vehicles, and of their bands.
fn trails_of(network: Network) -> u32 {
    return network.large + (LINE_WORDS + 1u) * N_CLASSES * network.n_paths;
}

fn bands_of(network: Network) -> u32 {
    return trails_of(network) + TRAIL_WORDS * samples_of(network);
}
