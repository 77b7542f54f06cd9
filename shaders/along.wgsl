// Where a truck stands that begins along its route: as if its reference point had followed the route from the first
// waypoint to this one.
//
// A trailer that stood straight behind in a bend would cut it, or hang out of it. How it stands depends on the way
// there and on the vehicle, so both units' headings are integrated along the waypoints when an episode begins. Wheels,
// slip of the tyres and lean are as a constant turn of that curvature asks for at that speed.

// Index of the waypoint of a route with `n_waypoints` at which a truck begins that starts `along` it: the last but one
// at most, since one is yet to pass.
fn first_waypoint(n_waypoints: u32, along: f32) -> u32 {
    return min(u32(round(along * f32(n_waypoints - 1u))), n_waypoints - 2u);
}

// The truck, still upright, with the headings and the wheels with which it comes to the waypoint of index `last` of a
// route, once its reference point has followed the route from its first waypoint at a speed (m/s). Both units begin
// along that.
fn standing_at(rig: Rig, speed: f32, route: Route, last: u32) -> Truck {
    let lane = waypoint_at(route.first + last).direction;
    let units = followed_by(rig, speed, route, last);
    let tractor = slipping(rig, speed, units.tractor, lane);
    // The reference point is half a wheelbase ahead of the drive axle, which without slip moves along the tractor.
    let side = dot(perpendicular(units.tractor), lane) * steered_wheelbase(rig, speed);
    let steering = arc_tangent(side, dot(units.tractor, lane) * 0.5 * rig.wheelbase);
    var truck = Truck();
    truck.heading = arc_tangent(tractor.y, tractor.x);
    truck.trailer_heading = arc_tangent(units.trailer.y, units.trailer.x);
    truck.speed = speed;
    truck.steering = clamp(steering, -rig.steer_max, rig.steer_max);
    return truck;
}

// Headings of both units as unit vectors.
struct Headings {
    tractor: vec2<f32>,
    trailer: vec2<f32>,
}

// Headings once the reference point has followed these waypoints at a speed (m/s); the tractor's is without slip.
//
// The way between two waypoints is followed in straight pieces, two at least, none longer than the tractor's lever.
fn followed_by(rig: Rig, speed: f32, route: Route, last: u32) -> Headings {
    let lever = 0.5 * rig.wheelbase;
    let hitch_behind = 0.5 * rig.wheelbase - rig.fifth_wheel;
    let trailer_lever = rig.trailer_wheelbase - slip_lever(rig, speed);
    var at = waypoint_at(route.first);
    var point = at.position;
    var units = Headings(at.direction, at.direction);
    for (var index = 1u; index <= last; index++) {
        let to = waypoint_at(route.first + index);
        let n_pieces = max(ceil(distance(at.position, to.position) / lever), 2.0);
        for (var piece = 1u; piece <= u32(n_pieces); piece++) {
            let next = between(at, to, f32(piece) / n_pieces);
            let turned = pulled(units.tractor, lever, next - point);
            let hitch_way = next - point - hitch_behind * (turned - units.tractor);
            units = Headings(turned, pulled(units.trailer, trailer_lever, hitch_way));
            point = next;
        }
        at = to;
    }
    return units;
}

// The heading, as a unit vector, of a tractor in a constant turn at a speed (m/s) whose reference point moves along the
// lane, where it heads along `tractor` without slip. Slip moves the point that moves along the tractor ahead of its
// axle.
fn slipping(rig: Rig, speed: f32, tractor: vec2<f32>, lane: vec2<f32>) -> vec2<f32> {
    let lever = 0.5 * rig.wheelbase;
    let side = (lever - slip_lever(rig, speed)) / lever * dot(perpendicular(tractor), lane);
    return rotated(lane, vec2<f32>(sqrt(max(1.0 - side * side, 0.0)), -side));
}

// Length by which slip moves a unit's turning point ahead at a speed (m/s), before its load moves (m).
fn slip_lever(rig: Rig, speed: f32) -> f32 {
    return min(rig.slip * speed * speed, rig.slip_lever_max);
}

// A point of the lane between two waypoints, of a cubic with their directions, by the fraction of the way to the
// second.
fn between(behind: WaypointRow, ahead: WaypointRow, fraction: f32) -> vec2<f32> {
    let rest = 1.0 - fraction;
    let bulge = rest * behind.direction - fraction * ahead.direction;
    let shift = (distance(behind.position, ahead.position) * rest * fraction) * bulge;
    let share = fraction * fraction * (3.0 - 2.0 * fraction);
    return behind.position + share * (ahead.position - behind.position) + shift;
}

// Heading of a unit of a length (m), from its front end to where it rolls, once its front end has gone this way (m),
// which is a straight piece of a bend. On a line the unit lies on a tractrix: the tangent of half its angle to the line
// falls exponentially with the way. Here it falls by the exponential's approximation of order (1, 1), with which units
// on the chords of a circle come to the angle that they have on the circle.
fn pulled(heading: vec2<f32>, unit_length: f32, way: vec2<f32>) -> vec2<f32> {
    let gone = length(way);
    if gone < TINY { return heading; }
    let line = way / gone;
    let tangent = dot(perpendicular(line), heading) / max(1.0 + dot(line, heading), HALVED_MIN);
    let half = tangent * max((2.0 * unit_length - gone) / (2.0 * unit_length + gone), 0.0);
    let turned = vec2<f32>(1.0 - half * half, 2.0 * half) / (1.0 + half * half);
    return rotated(line, turned);
}
