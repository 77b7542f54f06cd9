// Measures the clearances: from each unit's rectangle to the nearest solid edge. An apron is solid to a tractor alone.
//
// A rectangle is a capsule, all points within half its width of a stretch of its centre line, and four corners. Points
// of the stretch are sampled for the capsule, so that a solid that lies wholly under the unit is found too, and the
// corners themselves. The distance is 1-Lipschitz, so two samples bound it between them; the middle is sampled only
// where the bound is not tight enough.
//
// A thread samples the first points of its truck's units. Few units then have spans to halve: the workgroup's threads
// do that together, a team of LANES threads for each such unit, one sample a thread. They keep its spans each in its
// own memory, since workgroup memory would let few workgroups in.

// Teams of a workgroup.
const TEAMS: u32 = WORKGROUP / LANES;
// Spans that a round adds at most to a team's.
const N_ADDED: u32 = 2u * LANES;
// The place in the list of a unit that is decided.
const NO_TEAM: u32 = 0xffffffffu;

// Distances at the points of this thread's truck that are sampled first: the tractor's, then the trailer's.
var<private> own_firsts: array<f32, 2u * N_FIRST>;
// Every LANES-th of the undecided spans of this thread's team, last in first out.
var<private> own_spans: array<Span, N_SPANS / LANES>;

// Units of the workgroup's trucks that have undecided spans: places given so far, and how many they are.
var<workgroup> n_undecided: atomic<u32>;
var<workgroup> n_units: u32;
// For each team its unit: position and direction, which one, vehicle, route, the least clearance found, and distances
// at the points sampled first.
var<workgroup> bodies_at: array<vec4<f32>, TEAMS>;
var<workgroup> body_units: array<u32, TEAMS>;
var<workgroup> body_vehicles: array<u32, TEAMS>;
var<workgroup> body_routes: array<u32, TEAMS>;
var<workgroup> leasts: array<f32, TEAMS>;
var<workgroup> firsts: array<f32, TEAMS * N_FIRST>;
// What each team's threads found in a round, and how many spans they add, and these.
var<workgroup> round_leasts: array<f32, WORKGROUP>;
var<workgroup> round_adds: array<u32, WORKGROUP>;
var<workgroup> added: array<Span, TEAMS * N_ADDED>;
// Whether any team has spans left.
var<workgroup> has_spans: atomic<u32>;
var<workgroup> goes_on: u32;

@compute @workgroup_size(WORKGROUP)
fn collide(thread: Thread) {
    let env = index_of(thread);
    let driving = is_driving(env);
    if thread.local == 0u {
        atomicStore(&n_undecided, 0u);
        atomicStore(&has_spans, 0u);
    }
    workgroupBarrier();
    var tractor = FirstFound();
    var trailer = FirstFound();
    if driving {
        tractor = sample_first(env, 0u);
        trailer = sample_first(env, 1u);
    }
    var places = vec2<u32>(NO_TEAM);
    if tractor.is_undecided { places.x = atomicAdd(&n_undecided, 1u); }
    if trailer.is_undecided { places.y = atomicAdd(&n_undecided, 1u); }
    workgroupBarrier();
    if thread.local == 0u { n_units = atomicLoad(&n_undecided); }
    let n = workgroupUniformLoad(&n_units);
    for (var first = 0u; first < n; first += TEAMS) {
        let teams = places - first;
        if teams.x < TEAMS { hand_over(teams.x, env, 0u, tractor.least); }
        if teams.y < TEAMS { hand_over(teams.y, env, 1u, trailer.least); }
        workgroupBarrier();
        halve(thread.local, first + thread.local / LANES < n);
        workgroupBarrier();
        if teams.x < TEAMS { tractor.least = leasts[teams.x]; }
        if teams.y < TEAMS { trailer.least = leasts[teams.y]; }
        workgroupBarrier();
    }
    if driving { clearance[env] = Clearance(tractor.least, trailer.least); }
}

// What the first points of a unit tell.
struct FirstFound {
    // The least clearance.
    least: f32,
    is_undecided: bool,
}

// A stretch of a unit, in its frame.
struct Line {
    begin: vec2<f32>,
    end: vec2<f32>,
    // What is subtracted from distances: the radius of the capsule, or nothing on the outline itself (m).
    radius: f32,
}

// A part of a line that may cross a solid between its ends.
struct Span {
    // The line; and from bit PART_SHIFT on which part of it: 1 is all of the line, 2 and 3 are its halves, 4 to 7 its
    // quarters.
    line_and_part: u32,
    // Lower bounds of the distance to the kerb at both ends (m).
    at_begin: f32,
    at_end: f32,
}

const PART_SHIFT: u32 = 16u;
const LINE_MASK: u32 = 0xffffu;

// The capsule's ends on the centre line, rear and front; a unit wider than long has a point between them.
fn stretch(body: Body) -> vec2<f32> {
    let middle = 0.5 * (body.front + body.rear);
    return vec2<f32>(min(body.rear + body.half_width, middle), max(body.front - body.half_width, middle));
}

// One of a body's points sampled first: `n_points` on the centre line from the rear on, then the corners.
fn point_of(body: Body, n_points: u32, index: u32) -> vec2<f32> {
    if index < n_points {
        let ends = stretch(body);
        return vec2<f32>(ends.x + f32(index) * ((ends.y - ends.x) / f32(n_points - 1u)), 0.0);
    }
    let corner = index - n_points;
    return vec2<f32>(
        select(body.front, body.rear, corner < 2u),
        select(-body.half_width, body.half_width, corner % 2u == 0u),
    );
}

// One of a body's lines: the pieces of its centre line, then two from each corner. These run along the unit's end to
// its middle, and along its side to where the capsule takes over: both touch the capsule's end.
fn line_of(body: Body, n_points: u32, index: u32) -> Line {
    if index < n_points - 1u {
        return Line(point_of(body, n_points, index), point_of(body, n_points, index + 1u), body.half_width);
    }
    let corner_line = index - (n_points - 1u);
    let begin = point_of(body, n_points, n_points + corner_line / 2u);
    let capsule = point_of(body, n_points, capsule_end(n_points, corner_line / 2u));
    let end = select(vec2<f32>(capsule.x, begin.y), vec2<f32>(begin.x, 0.0), corner_line % 2u == 0u);
    return Line(begin, end, 0.0);
}

// The point of the centre line that is the capsule's end near a corner.
fn capsule_end(n_points: u32, corner: u32) -> u32 {
    return select(n_points - 1u, 0u, corner < 2u);
}

// Length of a part as a fraction of its line.
fn width(part: u32) -> f32 {
    return 1.0 / f32(1u << firstLeadingBit(part));
}

// Middle of a part of a line, in the unit's frame.
fn middle(line: Line, part: u32) -> vec2<f32> {
    let fraction = (f32(part) + 0.5) * width(part) - 1.0;
    return line.begin + fraction * (line.end - line.begin);
}

// Lower bound of the clearance on a span, as the distance is 1-Lipschitz (m).
fn bound(line: Line, span: Span) -> f32 {
    let length = width(span.line_and_part >> PART_SHIFT) * distance(line.begin, line.end);
    return 0.5 * (span.at_begin + span.at_end - length) - line.radius;
}

// Whether the clearance on a span may be much less than the least found.
fn is_undecided(least: f32, line: Line, span: Span) -> bool {
    return bound(line, span) < least - max(FRACTION * least, TOLERANCE);
}

// The outline of a vehicle's unit: 0 is the tractor.
fn body_of(vehicle: u32, unit: u32) -> Body {
    if unit == 0u { return vehicles[vehicle].rig.tractor_body; }
    return vehicles[vehicle].rig.trailer_body;
}

// Points of a unit's centre line that are sampled first, before its corners.
fn n_points_of(unit: u32) -> u32 {
    return select(N_TRAILER, N_TRACTOR, unit == 0u);
}

// Position and direction of a truck's unit.
fn place_of(truck: Truck, unit: u32) -> vec4<f32> {
    if unit == 0u { return vec4<f32>(truck.position, direction(truck.heading)); }
    let position = trailer_position(vehicles[truck.vehicle].rig, truck);
    return vec4<f32>(position, direction(truck.trailer_heading));
}

// Samples the first points of a truck's unit.
fn sample_first(env: u32, unit: u32) -> FirstFound {
    let truck = truck[env];
    let body = body_of(truck.vehicle, unit);
    let n_points = n_points_of(unit);
    let field = unit_field_at(truck.route, unit);
    let at = place_of(truck, unit);
    let own = unit * N_FIRST;
    var least = FAR;
    // Four at a time, so that a thread waits for all of them at once.
    for (var n = 0u; n < n_points + 4u; n += 4u) {
        let distances = vec4<f32>(
            sampled(field, at.xy, at.zw, point_of(body, n_points, n)),
            sampled(field, at.xy, at.zw, point_of(body, n_points, n + 1u)),
            sampled(field, at.xy, at.zw, point_of(body, n_points, n + 2u)),
            sampled(field, at.xy, at.zw, point_of(body, n_points, n + 3u)),
        );
        own_firsts[own + n] = distances.x;
        own_firsts[own + n + 1u] = distances.y;
        own_firsts[own + n + 2u] = distances.z;
        own_firsts[own + n + 3u] = distances.w;
        let bounds = distances - select(0.0, body.half_width, n < n_points);
        least = min(least, min(min(bounds.x, bounds.y), min(bounds.z, bounds.w)));
    }
    var any = false;
    for (var line = 0u; line < n_points + 7u; line++) {
        let ends = ends_of(n_points, line);
        let span = whole_line(body, n_points, line, own_firsts[own + ends.x], own_firsts[own + ends.y]);
        any = any || is_undecided(least, line_of(body, n_points, line), span);
    }
    // Contact is certain without them.
    return FirstFound(least, any && 0.0 < least);
}

// Gives a truck's unit to a team.
fn hand_over(team: u32, env: u32, unit: u32, least: f32) {
    let truck = truck[env];
    bodies_at[team] = place_of(truck, unit);
    body_units[team] = unit;
    body_vehicles[team] = truck.vehicle;
    body_routes[team] = truck.route;
    leasts[team] = least;
    for (var n = 0u; n < N_FIRST; n++) { firsts[team * N_FIRST + n] = own_firsts[unit * N_FIRST + n]; }
}

// The points sampled first at the ends of a line: of a corner's the corner and the capsule's end.
fn ends_of(n_points: u32, line: u32) -> vec2<u32> {
    if line < n_points - 1u { return vec2<u32>(line, line + 1u); }
    let corner = (line - (n_points - 1u)) / 2u;
    return vec2<u32>(n_points + corner, capsule_end(n_points, corner));
}

// All of a line between the points sampled first, with the distances there.
fn whole_line(body: Body, n_points: u32, line: u32, at_begin: f32, at_end: f32) -> Span {
    return Span(line | (1u << PART_SHIFT), at_begin, select(at_end - body.half_width, at_end, line < n_points - 1u));
}

// Halves the spans of each team's unit, if it has one, until the clearance on none can be much less than the least
// found. Stops at contact.
fn halve(local: u32, works: bool) {
    let lane = local % LANES;
    let team = local / LANES;
    let row = team * LANES;
    // What another team left where this one has no unit is a unit too, or nothing.
    let at = bodies_at[team];
    let unit = select(0u, body_units[team], works);
    let field = unit_field_at(select(0u, body_routes[team], works), unit);
    let body = body_of(select(0u, body_vehicles[team], works), unit);
    let n_points = n_points_of(unit);
    var least = leasts[team];
    var n_spans = 0u;
    for (var start = 0u; start < N_TRAILER + 7u; start += LANES) {
        let line = start + lane;
        var span = Span();
        var adds = false;
        if works && line < n_points + 7u {
            let ends = team * N_FIRST + ends_of(n_points, line);
            span = whole_line(body, n_points, line, firsts[ends.x], firsts[ends.y]);
            adds = is_undecided(least, line_of(body, n_points, line), span);
        }
        round_adds[local] = select(0u, 1u, adds);
        workgroupBarrier();
        let sums = sums_of(row, lane);
        if adds { added[team * N_ADDED + sums.x] = span; }
        workgroupBarrier();
        keep(team, lane, n_spans, sums.y);
        n_spans += sums.y;
    }
    loop {
        let taken = select(0u, min(n_spans, LANES), works && 0.0 < least);
        if lane == 0u && 0u < taken { atomicStore(&has_spans, 1u); }
        workgroupBarrier();
        if local == 0u { goes_on = atomicExchange(&has_spans, 0u); }
        if workgroupUniformLoad(&goes_on) == 0u { break; }

        n_spans -= taken;
        // Which of the spans taken this thread keeps.
        let rank = (lane - n_spans) % LANES;
        var whole = Span();
        var line = Line();
        var at_middle = 0.0;
        var found = FAR;
        if rank < taken {
            whole = own_spans[(n_spans + rank) / LANES];
            line = line_of(body, n_points, whole.line_and_part & LINE_MASK);
            at_middle = sampled(field, at.xy, at.zw, middle(line, whole.line_and_part >> PART_SHIFT));
            found = at_middle - line.radius;
        }
        round_leasts[local] = found;
        workgroupBarrier();
        for (var n = 0u; n < LANES; n++) { least = min(least, round_leasts[row + n]); }
        // A part's halves have twice its number, and one more.
        let twice = whole.line_and_part + (whole.line_and_part & ~LINE_MASK);
        let rear = Span(twice, whole.at_begin, at_middle);
        let front = Span(twice + (1u << PART_SHIFT), at_middle, whole.at_end);
        let adds_rear = rank < taken && is_undecided(least, line, rear);
        let adds_front = rank < taken && is_undecided(least, line, front);
        round_adds[row + rank] = select(0u, 1u, adds_rear) + select(0u, 1u, adds_front);
        workgroupBarrier();
        let sums = sums_of(row, rank);
        let place = team * N_ADDED + sums.x;
        if adds_rear { added[place] = rear; }
        if adds_front { added[place + select(0u, 1u, adds_rear)] = front; }
        workgroupBarrier();
        let n_kept = min(sums.y, N_SPANS - n_spans);
        keep(team, lane, n_spans, n_kept);
        n_spans += n_kept;
    }
    if works && lane == 0u { leasts[team] = least; }
}

// Keeps the thread's part of `n` spans that are added to a team's `n_spans`.
fn keep(team: u32, lane: u32, n_spans: u32, n: u32) {
    for (var added_at = (lane - n_spans) % LANES; added_at < n; added_at += LANES) {
        own_spans[(n_spans + added_at) / LANES] = added[team * N_ADDED + added_at];
    }
}

// How many spans the threads before one of a team's row add in a round, and how many all of them do.
fn sums_of(row: u32, index: u32) -> vec2<u32> {
    var sums = vec2<u32>(0u);
    for (var n = 0u; n < LANES; n++) {
        let adds = round_adds[row + n];
        sums += vec2<u32>(select(0u, adds, n < index), adds);
    }
    return sums;
}

// Signed distance at a point of a unit's frame (m).
fn sampled(field: FieldRow, position: vec2<f32>, heading: vec2<f32>, point: vec2<f32>) -> f32 {
    let p = vec2<f32>(
        position.x + point.x * heading.x - point.y * heading.y,
        position.y + point.x * heading.y + point.y * heading.x,
    );
    return field_sample(field, true, p).distance;
}
