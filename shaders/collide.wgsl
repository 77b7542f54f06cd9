// Measures the clearances: from each unit's rectangle to the nearest solid edge. An apron is solid to a tractor alone.
//
// A rectangle is a capsule, all points within half its width of a stretch of its centre line, and four corners. Points
// of the stretch are sampled for the capsule, so that a solid that lies wholly under the unit is found too, and the
// corners themselves. The distance is 1-Lipschitz, so two samples bound it between them; the middle is sampled only
// where the bound is not tight enough.
//
// A thread samples the first points of its truck's unit. Few units then have spans to halve: the workgroup's threads do
// that together, a team of LANES threads for each such unit, one sample a thread.

// Teams of a workgroup.
const TEAMS: u32 = WORKGROUP / LANES;

// For each truck of the workgroup its unit at hand: position and direction, vehicle, route, and the least clearance
// found.
var<workgroup> bodies_at: array<vec4<f32>, WORKGROUP>;
var<workgroup> body_vehicles: array<u32, WORKGROUP>;
var<workgroup> body_routes: array<u32, WORKGROUP>;
var<workgroup> leasts: array<f32, WORKGROUP>;
// Distances at the points sampled first: a row of all trucks for each point.
var<workgroup> firsts: array<f32, N_FIRST * WORKGROUP>;
// The trucks whose unit has undecided spans, and how many they are.
var<workgroup> undecided: array<u32, WORKGROUP>;
var<workgroup> n_undecided: atomic<u32>;
var<workgroup> n_units: u32;
// The undecided spans of each team's unit, last in first out.
var<workgroup> spans: array<Span, TEAMS * N_SPANS>;
// What each thread found in a round, and how many spans it adds.
var<workgroup> round_leasts: array<f32, WORKGROUP>;
var<workgroup> round_adds: array<u32, WORKGROUP>;
// Whether any team has spans left.
var<workgroup> has_spans: atomic<u32>;
var<workgroup> goes_on: u32;

@compute @workgroup_size(WORKGROUP)
fn collide(thread: Thread) {
    let env = index_of(thread);
    let driving = is_driving(env);
    var found = vec2<f32>(0.0);
    for (var unit = 0u; unit < 2u; unit++) {
        if thread.local == 0u {
            atomicStore(&n_undecided, 0u);
            atomicStore(&has_spans, 0u);
        }
        workgroupBarrier();
        if driving { sample_first(thread.local, env, unit); }
        workgroupBarrier();
        if thread.local == 0u { n_units = atomicLoad(&n_undecided); }
        let n = workgroupUniformLoad(&n_units);
        for (var first = 0u; first < n; first += TEAMS) {
            halve(thread.local, unit, first, n);
        }
        workgroupBarrier();
        if unit == 0u { found.x = leasts[thread.local]; } else { found.y = leasts[thread.local]; }
    }
    if driving { clearance[env] = Clearance(found.x, found.y); }
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

// Samples the first points of a truck's unit, and lists the truck if spans between them are undecided.
fn sample_first(local: u32, env: u32, unit: u32) {
    let truck = truck[env];
    let body = body_of(truck.vehicle, unit);
    let n_points = n_points_of(unit);
    let field = unit_field_at(truck.route, unit);
    var position = truck.position;
    var heading = direction(truck.heading);
    if unit == 1u {
        position = trailer_position(vehicles[truck.vehicle].rig, truck);
        heading = direction(truck.trailer_heading);
    }
    bodies_at[local] = vec4<f32>(position, heading);
    body_vehicles[local] = truck.vehicle;
    body_routes[local] = truck.route;
    var least = FAR;
    for (var n = 0u; n < n_points + 4u; n++) {
        let distance = sampled(field, position, heading, point_of(body, n_points, n));
        firsts[n * WORKGROUP + local] = distance;
        least = min(least, select(distance, distance - body.half_width, n < n_points));
    }
    leasts[local] = least;
    var any = false;
    for (var line = 0u; line < n_points + 7u; line++) {
        any = any || is_undecided(least, line_of(body, n_points, line), whole_line(local, body, n_points, line));
    }
    // Contact is certain without them.
    if any && 0.0 < least { undecided[atomicAdd(&n_undecided, 1u)] = local; }
}

// All of a line of a truck's unit, between the points sampled first.
fn whole_line(local: u32, body: Body, n_points: u32, line: u32) -> Span {
    let whole = line | (1u << PART_SHIFT);
    if line < n_points - 1u {
        return Span(whole, firsts[line * WORKGROUP + local], firsts[(line + 1u) * WORKGROUP + local]);
    }
    let corner = (line - (n_points - 1u)) / 2u;
    let at_capsule = firsts[capsule_end(n_points, corner) * WORKGROUP + local];
    return Span(whole, firsts[(n_points + corner) * WORKGROUP + local], at_capsule - body.half_width);
}

// Halves the spans of up to TEAMS listed units, from the one at `first` of `n` on, until the clearance on none can be
// much less than the least found. Stops at contact.
fn halve(local: u32, unit: u32, first: u32, n: u32) {
    let lane = local % LANES;
    let team = local / LANES;
    let works = first + team < n;
    let member = undecided[min(first + team, n - 1u)];
    let at = bodies_at[member];
    let field = unit_field_at(body_routes[member], unit);
    let body = body_of(body_vehicles[member], unit);
    let n_points = n_points_of(unit);
    let stack = team * N_SPANS;
    var least = leasts[member];
    var n_spans = 0u;
    for (var start = 0u; start < n_points + 7u; start += LANES) {
        let line = start + lane;
        var span = Span();
        var adds = false;
        if works && line < n_points + 7u {
            span = whole_line(member, body, n_points, line);
            adds = is_undecided(least, line_of(body, n_points, line), span);
        }
        round_adds[local] = select(0u, 1u, adds);
        workgroupBarrier();
        let sums = sums_of(team, lane);
        if adds { spans[stack + n_spans + sums.x] = span; }
        n_spans += sums.y;
        workgroupBarrier();
    }
    loop {
        let taken = select(0u, min(n_spans, LANES), 0.0 < least);
        if lane == 0u && 0u < taken { atomicStore(&has_spans, 1u); }
        workgroupBarrier();
        if local == 0u { goes_on = atomicExchange(&has_spans, 0u); }
        if workgroupUniformLoad(&goes_on) == 0u { break; }

        n_spans -= taken;
        var whole = Span();
        var line = Line();
        var at_middle = 0.0;
        round_leasts[local] = FAR;
        if lane < taken {
            whole = spans[stack + n_spans + lane];
            line = line_of(body, n_points, whole.line_and_part & LINE_MASK);
            at_middle = sampled(field, at.xy, at.zw, middle(line, whole.line_and_part >> PART_SHIFT));
            round_leasts[local] = at_middle - line.radius;
        }
        workgroupBarrier();
        for (var n = 0u; n < LANES; n++) { least = min(least, round_leasts[team * LANES + n]); }
        // A part's halves have twice its number, and one more.
        let twice = whole.line_and_part + (whole.line_and_part & ~LINE_MASK);
        let rear = Span(twice, whole.at_begin, at_middle);
        let front = Span(twice + (1u << PART_SHIFT), at_middle, whole.at_end);
        let adds_rear = lane < taken && is_undecided(least, line, rear);
        let adds_front = lane < taken && is_undecided(least, line, front);
        round_adds[local] = select(0u, 1u, adds_rear) + select(0u, 1u, adds_front);
        workgroupBarrier();
        let sums = sums_of(team, lane);
        let place = n_spans + sums.x;
        if adds_rear && place < N_SPANS { spans[stack + place] = rear; }
        let next = place + select(0u, 1u, adds_rear);
        if adds_front && next < N_SPANS { spans[stack + next] = front; }
        n_spans = min(n_spans + sums.y, N_SPANS);
    }
    if works && lane == 0u { leasts[member] = least; }
    workgroupBarrier();
}

// How many spans the team's threads before this one add in a round, and how many all of them do.
fn sums_of(team: u32, lane: u32) -> vec2<u32> {
    var sums = vec2<u32>(0u);
    for (var n = 0u; n < LANES; n++) {
        let adds = round_adds[team * LANES + n];
        sums += vec2<u32>(select(0u, adds, n < lane), adds);
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
