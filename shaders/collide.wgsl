// Measures the clearances: from each unit's rectangle to the nearest solid edge.
//
// A rectangle is a capsule, all points within half its width of a stretch of its centre line, and four corners. Points
// of the stretch are sampled for the capsule, so that a solid that lies wholly under the unit is found too, and the
// corners themselves. The distance is 1-Lipschitz, so two samples bound it between them; the middle is sampled only
// where the bound is not tight enough.

@compute @workgroup_size(WORKGROUP)
fn collide(thread: Thread) {
    let env = index_of(thread);
    if !is_driving(env) { return; }
    let truck = truck[env];
    let rig = rigs[truck.vehicle];
    let field = fields[routes[truck.route].roundabout];
    // The first pass is the tractor's, the second the trailer's: one set of spans serves both.
    var spans: array<Span, N_SPANS>;
    var found: array<f32, 2>;
    for (var unit = 0u; unit < 2u; unit++) {
        var body = rig.tractor_body;
        var n_points = N_TRACTOR;
        var position = truck.position;
        var heading = direction(truck.heading);
        if unit == 1u {
            body = rig.trailer_body;
            n_points = N_TRAILER;
            position = trailer_position(rig, truck);
            heading = direction(truck.trailer_heading);
        }
        found[unit] = body_clearance(field, body, n_points, position, heading, &spans);
    }
    clearance[env] = Clearance(found[0], found[1]);
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
    line: u32,
    // Which part: 1 is all of the line, 2 and 3 are its halves, 4 to 7 its quarters.
    part: u32,
    // Lower bounds of the distance to the kerb at both ends (m).
    at_begin: f32,
    at_end: f32,
}

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
    return 0.5 * (span.at_begin + span.at_end - width(span.part) * distance(line.begin, line.end)) - line.radius;
}

// Whether the clearance on a span may be much less than the least found.
fn is_undecided(least: f32, line: Line, span: Span) -> bool {
    return bound(line, span) < least - max(FRACTION * least, TOLERANCE);
}

// Clearance of one rectangle whose frame has its origin at `position` and the unit vector `heading` as x axis.
// `n_points` of its centre line and its corners are sampled first. `spans` is working memory.
fn body_clearance(
    field: FieldRow,
    body: Body,
    n_points: u32,
    position: vec2<f32>,
    heading: vec2<f32>,
    spans: ptr<function, array<Span, N_SPANS>>,
) -> f32 {
    var distances: array<f32, N_FIRST>;
    var least = FAR;
    for (var n = 0u; n < n_points + 4u; n++) {
        distances[n] = sampled(field, position, heading, point_of(body, n_points, n));
        least = min(least, select(distances[n], distances[n] - body.half_width, n < n_points));
    }
    // The undecided spans, last in first out.
    var n_spans = 0u;
    for (var index = 0u; index < n_points + 7u; index++) {
        var span = Span(index, 1u, 0.0, 0.0);
        if index < n_points - 1u {
            span.at_begin = distances[index];
            span.at_end = distances[index + 1u];
        } else {
            let corner = (index - (n_points - 1u)) / 2u;
            span.at_begin = distances[n_points + corner];
            span.at_end = distances[capsule_end(n_points, corner)] - body.half_width;
        }
        if is_undecided(least, line_of(body, n_points, index), span) {
            (*spans)[n_spans] = span;
            n_spans++;
        }
    }
    // Halves spans until the clearance on none can be much less than the least found. Stops at contact.
    var undecided: array<Span, LANES>;
    var at_middle: array<f32, LANES>;
    while 0u < n_spans && 0.0 < least {
        let taken = min(n_spans, LANES);
        n_spans -= taken;
        for (var n = 0u; n < taken; n++) {
            undecided[n] = (*spans)[n_spans + n];
            let line = line_of(body, n_points, undecided[n].line);
            at_middle[n] = sampled(field, position, heading, middle(line, undecided[n].part));
            least = min(least, at_middle[n] - line.radius);
        }
        for (var n = 0u; n < taken; n++) {
            let whole = undecided[n];
            let line = line_of(body, n_points, whole.line);
            let rear = Span(whole.line, 2u * whole.part, whole.at_begin, at_middle[n]);
            if is_undecided(least, line, rear) && n_spans < N_SPANS {
                (*spans)[n_spans] = rear;
                n_spans++;
            }
            let front = Span(whole.line, 2u * whole.part + 1u, at_middle[n], whole.at_end);
            if is_undecided(least, line, front) && n_spans < N_SPANS {
                (*spans)[n_spans] = front;
                n_spans++;
            }
        }
    }
    return least;
}

// Signed distance at a point of a unit's frame (m).
fn sampled(field: FieldRow, position: vec2<f32>, heading: vec2<f32>, point: vec2<f32>) -> f32 {
    let p = vec2<f32>(
        position.x + point.x * heading.x - point.y * heading.y,
        position.y + point.x * heading.y + point.y * heading.x,
    );
    return field_sample(field, true, p).distance;
}
