// The picture: roads and trucks from above, drawn from the tables and columns that a step's kernels use. Nothing is
// copied.
//
// Above this stand the constants, structs, tables and columns of the step, read-only, and the functions of common/. A
// truck is drawn moved on by the time since its last step, so that it moves smoothly at any speed of time.

// What colours a truck.
const BY_STEERING: u32 = 0u;
const BY_LOAD_TRANSFER: u32 = 1u;
// Vertices of a rectangle of two triangles.
const SQUARE = array<vec2<f32>, 6>(
    vec2<f32>(-1.0, -1.0), vec2<f32>(1.0, -1.0), vec2<f32>(-1.0, 1.0),
    vec2<f32>(-1.0, 1.0), vec2<f32>(1.0, -1.0), vec2<f32>(1.0, 1.0),
);
// Length of the cab at the tractor's front, radius of a body's corners (m).
const CAB: f32 = 2.3;
const CORNER: f32 = 0.25;
// Over this much the road fades where its table ends (m).
const FADE: f32 = 8.0;
// Half of a cross's width (pixels).
const CROSS_RADIUS: f32 = 5.0;

struct View {
    // Middle of the picture (m).
    centre: vec2<f32>,
    // Half of the picture's extents (m).
    half: vec2<f32>,
    // Width of a pixel of the page (m).
    pixel: f32,
    // Time since the last step (s).
    since: f32,
    // Index of the truck that is followed; of none beyond the last.
    followed: u32,
    // What colours the other trucks, and how opaque they are.
    colouring: u32,
    crowd: f32,
    // Routes of the world: behind their sites are those of the places.
    n_routes: u32,
    // Points of the followed truck's paths.
    n_points: u32,
    // How opaque the vehicles around the other trucks are.
    others: f32,
}

// Colours of the page's theme.
struct Theme {
    solid: vec4<f32>,
    apron: vec4<f32>,
    car: vec4<f32>,
    van: vec4<f32>,
    brakes: vec4<f32>,
    rude: vec4<f32>,
    road: vec4<f32>,
    kerb: vec4<f32>,
    panel: vec4<f32>,
    ink: vec4<f32>,
    route: vec4<f32>,
    tractor: vec4<f32>,
    trailer: vec4<f32>,
    ray: vec4<f32>,
    right: vec4<f32>,
    straight: vec4<f32>,
    left: vec4<f32>,
    low: vec4<f32>,
    high: vec4<f32>,
    begun: vec4<f32>,
    done: vec4<f32>,
    // By end code.
    ends: array<vec4<f32>, 10>,
}

// Where a route's roundabout lies in the picture, or a place and one of its routes. `side` is -1 where the road is
// driven as its mirror image, which the picture mirrors back, and 1 elsewhere.
struct Site {
    offset: vec2<f32>,
    side: f32,
    route: u32,
}

@group(1) @binding(0) var<uniform> view: View;
@group(1) @binding(1) var<uniform> theme: Theme;
@group(1) @binding(2) var<storage, read> sites: array<Site>;
// Middles of the followed truck's drive axle and of its trailer's axles, a step each, from the roundabout's origin (m).
@group(1) @binding(3) var<storage, read> points: array<vec4<f32>>;

// The side of what is being drawn.
var<private> side: f32 = 1.0;

// What is added to points of a site's roundabout; `on_screen` mirrors the sum back.
fn offset_of(site: Site) -> vec2<f32> {
    side = site.side;
    return vec2<f32>(site.offset.x, side * site.offset.y);
}

struct Painted {
    @builtin(position) position: vec4<f32>,
    @location(0) colour: vec4<f32>,
    // Position in the shape, and half of its extents (m; of marks in pixels).
    @location(1) local: vec2<f32>,
    @location(2) @interpolate(flat) half: vec2<f32>,
}

// A truck and the middle of its trailer's axles, in the picture.
struct Seen {
    truck: Truck,
    position: vec2<f32>,
    trailer: vec2<f32>,
}

// A truck moved on by the time since its last step, as its wheels roll.
fn seen(env: u32) -> Seen {
    var now = truck[env];
    let offset = offset_of(sites[now.route]);
    if now.held == 0u {
        let way = now.speed * view.since;
        let turn = way * tan(now.steering) / vehicles[now.vehicle].rig.wheelbase;
        let articulation = now.heading - now.trailer_heading;
        now.position += way * direction(now.heading + 0.5 * turn);
        now.heading += turn;
        now.trailer_heading += way * sin(articulation) / vehicles[now.vehicle].rig.trailer_wheelbase;
    }
    let trailer = trailer_position(vehicles[now.vehicle].rig, now);
    return Seen(now, offset + now.position, offset + trailer);
}

fn on_screen(p: vec2<f32>) -> vec4<f32> {
    return vec4<f32>((vec2<f32>(p.x, side * p.y) - view.centre) / view.half, 0.0, 1.0);
}

fn painted(p: vec2<f32>, colour: vec4<f32>) -> Painted {
    return Painted(on_screen(p), colour, vec2<f32>(0.0), vec2<f32>(1e9));
}

// Nothing is seen of what lies there.
fn unseen() -> Painted {
    return Painted(vec4<f32>(2.0, 2.0, 2.0, 1.0), vec4<f32>(0.0), vec2<f32>(0.0), vec2<f32>(0.0));
}

struct Ground {
    @builtin(position) position: vec4<f32>,
    // From the roundabout's origin (m).
    @location(0) at: vec2<f32>,
    @location(1) @interpolate(flat) route: u32,
}

// The ground of a place: an instance for each.
@vertex
fn ground(@builtin(vertex_index) vertex: u32, @builtin(instance_index) place: u32) -> Ground {
    let site = sites[view.n_routes + place];
    let field = field_at(site.route);
    let extent = vec2<f32>(f32(field.columns), f32(field.rows)) / field.cells_per_metre;
    let at = field.origin + (0.5 + 0.5 * SQUARE[vertex]) * extent;
    return Ground(on_screen(offset_of(site) + at), at, site.route);
}

// The colour of the ground by its distance to the kerbs.
@fragment
fn ground_colour(in: Ground) -> @location(0) vec4<f32> {
    let field = field_at(in.route);
    let distance = field_sample(field, true, in.at).distance;
    let soft = max(0.5 * view.pixel, 0.015);
    // Asphalt is a little darker beside a kerb, and has faint lines of equal distance where one can see them.
    let shade = 0.05 * (1.0 - smoothstep(0.0, 1.6, distance));
    let fine = 1.0 - smoothstep(0.08, 0.2, view.pixel);
    let contour = 1.0 - smoothstep(0.0, 1.5 * view.pixel, abs(fract(distance + 0.5) - 0.5));
    let asphalt = mix(theme.road.rgb, theme.kerb.rgb, shade + 0.10 * fine * contour * step(0.5, distance));
    // The kerb is a line of 12 cm, or of a pixel and a half where that is more.
    let width = max(0.06, 0.75 * view.pixel);
    var colour = theme.solid.rgb;
    // What trailers keep to, where that is something else, has an apron within and a kerb of its own.
    let own = unit_field_at(in.route, 1u);
    if own.first_cell != field.first_cell {
        let behind = field_sample(own, true, in.at).distance;
        colour = mix(colour, theme.apron.rgb, smoothstep(-soft, soft, behind));
        colour = mix(colour, theme.kerb.rgb, 1.0 - smoothstep(width - soft, width + soft, abs(behind)));
    }
    colour = mix(colour, asphalt, smoothstep(-soft, soft, distance));
    let kerb = 1.0 - smoothstep(width - soft, width + soft, abs(distance));
    colour = mix(colour, theme.kerb.rgb, kerb);
    let extent = vec2<f32>(f32(field.columns), f32(field.rows)) / field.cells_per_metre;
    let inside = min(in.at - field.origin, field.origin + extent - in.at);
    return vec4<f32>(mix(theme.solid.rgb, colour, smoothstep(0.0, FADE, min(inside.x, inside.y))), 1.0);
}

// A rectangle on a unit: its middle ahead of the unit's origin, half of its extents, a pixel larger for its edge.
fn on_unit(vertex: u32, origin: vec2<f32>, heading: f32, ahead: f32, half: vec2<f32>, colour: vec4<f32>) -> Painted {
    let local = SQUARE[vertex] * (half + view.pixel);
    let p = origin + rotated(direction(heading), vec2<f32>(ahead, 0.0) + local);
    return Painted(on_screen(p), colour, local, half);
}

// A truck: chassis, trailer and cab, six vertices each. An instance for each truck.
@vertex
fn trucks(@builtin(vertex_index) vertex: u32, @builtin(instance_index) env: u32) -> Painted {
    if truck[env].held == 1u || env == view.followed { return unseen(); }
    return body(vertex, env, hue(env), view.crowd);
}

// The truck that is followed, in colours of its own.
@vertex
fn followed_truck(@builtin(vertex_index) vertex: u32) -> Painted {
    return body(vertex, view.followed, theme.tractor.rgb, 1.0);
}

fn body(vertex: u32, env: u32, colour: vec3<f32>, alpha: f32) -> Painted {
    let now = seen(env);
    let rig = vehicles[now.truck.vehicle].rig;
    let part = vertex / 6u;
    let corner = vertex % 6u;
    if part == 1u {
        let box = rig.trailer_body;
        let own = env == view.followed;
        let fill = select(mix(colour, theme.road.rgb, 0.3), theme.trailer.rgb, own);
        let half = vec2<f32>(0.5 * (box.front - box.rear), box.half_width);
        let heading = now.truck.trailer_heading;
        return on_unit(corner, now.trailer, heading, 0.5 * (box.front + box.rear), half, vec4<f32>(fill, alpha));
    }
    let box = rig.tractor_body;
    let rear = select(box.rear, box.front - CAB, part == 2u);
    let half = vec2<f32>(0.5 * (box.front - rear), select(0.75 * box.half_width, box.half_width, part == 2u));
    let fill = select(mix(colour, theme.ink.rgb, 0.35), colour, part == 2u);
    return on_unit(corner, now.position, now.truck.heading, 0.5 * (box.front + rear), half, vec4<f32>(fill, alpha));
}

fn hue(env: u32) -> vec3<f32> {
    let now = truck[env];
    if view.colouring == BY_STEERING {
        let asked = sites[now.route].side * actions[action[env]].steering / vehicles[now.vehicle].rig.steer_max;
        let turn = smoothstep(0.0, 0.8, abs(asked));
        return mix(theme.straight.rgb, select(theme.right.rgb, theme.left.rgb, 0.0 < asked), turn);
    } else if view.colouring == BY_LOAD_TRANSFER {
        let ratio = max(abs(now.tractor_load_transfer_ratio), abs(now.trailer_load_transfer_ratio));
        return mix(theme.low.rgb, theme.high.rgb, smoothstep(0.05, 0.9, ratio));
    }
    let fraction = f32(progress[env].waypoint) / f32(route_at(now.route).n_waypoints);
    return mix(theme.begun.rgb, theme.done.rgb, clamp(fraction, 0.0, 1.0));
}

// How far a point is outside a rectangle with rounded corners, of these half extents; negative inside (m).
fn outside(local: vec2<f32>, half: vec2<f32>) -> f32 {
    let radius = min(CORNER, 0.3 * half.y);
    let beyond = abs(local) - half + radius;
    return length(max(beyond, vec2<f32>(0.0))) + min(max(beyond.x, beyond.y), 0.0) - radius;
}

// A body with rounded corners and a thin edge.
@fragment
fn body_colour(in: Painted) -> @location(0) vec4<f32> {
    let distance = outside(in.local, in.half);
    let pixel = max(view.pixel, 1e-3);
    let inside = 1.0 - smoothstep(-0.5 * pixel, 0.5 * pixel, distance);
    // Edge and windscreen where there are pixels enough.
    let fine = 1.0 - smoothstep(0.1, 0.25, pixel);
    let edge = fine * smoothstep(-1.8 * pixel, -0.8 * pixel, distance);
    var colour = mix(in.colour.rgb, theme.panel.rgb, 0.8 * edge);
    let is_cab = in.half.x < 0.5 * CAB + 0.01;
    let glass = is_cab && abs(in.local.x - 0.55 * in.half.x) < 0.22 && abs(in.local.y) < in.half.y - 0.2;
    if glass { colour = mix(colour, theme.ink.rgb, 0.55 * fine); }
    return vec4<f32>(colour, 1.0) * (in.colour.a * inside);
}

// The wheels of the truck that is followed, an instance each: two steered, two driven, two of each trailer axle.
@vertex
fn wheels(@builtin(vertex_index) vertex: u32, @builtin(instance_index) wheel: u32) -> Painted {
    let now = seen(view.followed);
    let rig = vehicles[now.truck.vehicle].rig;
    let flank = select(-1.0, 1.0, wheel % 2u == 0u);
    let axle = wheel / 2u;
    var origin = now.trailer;
    var heading = now.truck.trailer_heading;
    var at = vec2<f32>(1.31 * (f32(axle) - 3.0), flank * (rig.trailer_body.half_width - 0.25));
    if axle < 2u {
        origin = now.position;
        heading = now.truck.heading;
        at = vec2<f32>(select(rig.wheelbase, 0.0, axle == 1u), flank * (rig.tractor_body.half_width - 0.22));
    }
    let hub = origin + rotated(direction(heading), at);
    let turned = heading + select(0.0, now.truck.steering, axle == 0u);
    return on_unit(vertex, hub, turned, 0.0, vec2<f32>(0.5, 0.17), vec4<f32>(theme.ink.rgb, 1.0));
}

// A vertex of a line from `a` to `b`, `width` pixels wide.
fn on_line(vertex: u32, a: vec2<f32>, b: vec2<f32>, width: f32, colour: vec3<f32>, alpha: f32) -> Painted {
    let square = SQUARE[vertex];
    let along = (b - a) / max(length(b - a), 1e-6);
    let p = mix(a, b, 0.5 + 0.5 * square.x) + 0.5 * width * view.pixel * square.y * perpendicular(along);
    return painted(p, vec4<f32>(colour, alpha));
}

// The followed truck's route, an instance for each waypoint but the last; what is passed is pale.
@vertex
fn route_line(@builtin(vertex_index) vertex: u32, @builtin(instance_index) index: u32) -> Painted {
    let now = truck[view.followed];
    let route = route_at(now.route);
    if route.n_waypoints <= index + 1u { return unseen(); }
    let offset = offset_of(sites[now.route]);
    let behind = offset + waypoint_at(route.first + index).position;
    let ahead = offset + waypoint_at(route.first + index + 1u).position;
    let alpha = select(0.85, 0.25, index + 1u < progress[view.followed].waypoint);
    return on_line(vertex, behind, ahead, 3.0, theme.route.rgb, alpha);
}

// The followed truck's distance sensors, an instance each: a line, and a dot where it meets a kerb.
@vertex
fn rays(@builtin(vertex_index) vertex: u32, @builtin(instance_index) index: u32) -> Painted {
    let now = seen(view.followed);
    let ray = vehicles[now.truck.vehicle].rays[index];
    let on_trailer = index < N_TRAILER_RAYS;
    let heading = direction(select(now.truck.heading, now.truck.trailer_heading, on_trailer));
    let mount = select(now.position, now.trailer, on_trailer) + rotated(heading, ray.origin);
    let range = ranges[view.followed * N_RAYS + index];
    let end = mount + range * rotated(heading, ray.direction);
    if vertex < 6u { return on_line(vertex, mount, end, 1.2, theme.ray.rgb, 0.75); }
    if 0.995 * params.sensor_range <= range { return unseen(); }
    return mark_at(vertex % 6u, end, 2.6, -1.0, theme.ray.rgb);
}

// A mark of `radius` pixels: -1 is a dot, -2 a cross.
fn mark_at(vertex: u32, p: vec2<f32>, radius: f32, kind: f32, colour: vec3<f32>) -> Painted {
    let local = SQUARE[vertex] * (radius + 1.0);
    return Painted(on_screen(p + view.pixel * local), vec4<f32>(colour, 1.0), local, vec2<f32>(radius, kind));
}

// The paths of the followed truck's axles in this episode: two instances for each step but the first.
@vertex
fn paths(@builtin(vertex_index) vertex: u32, @builtin(instance_index) index: u32) -> Painted {
    let step = index / 2u;
    if view.n_points <= step + 1u { return unseen(); }
    let offset = offset_of(sites[truck[view.followed].route]);
    let behind = points[step];
    let ahead = points[step + 1u];
    if index % 2u == 0u { return on_line(vertex, offset + behind.xy, offset + ahead.xy, 2.5, theme.tractor.rgb, 0.9); }
    return on_line(vertex, offset + behind.zw, offset + ahead.zw, 2.5, theme.trailer.rgb, 0.9);
}

// Where episodes failed, an instance for each that is kept: a cross in the colour of the end.
@vertex
fn crosses(@builtin(vertex_index) vertex: u32, @builtin(instance_index) index: u32) -> Painted {
    if journal.count <= index { return unseen(); }
    let failure = journal.failures[index];
    let p = offset_of(sites[failure.route]) + failure.position;
    return mark_at(vertex, p, CROSS_RADIUS, -2.0, theme.ends[failure.ended].rgb);
}

// Lines, dots and crosses. A second extent below 0 says which.
@fragment
fn mark_colour(in: Painted) -> @location(0) vec4<f32> {
    var alpha = 1.0;
    if in.half.y == -1.0 {
        alpha = 1.0 - smoothstep(in.half.x - 0.5, in.half.x + 0.5, length(in.local));
    } else if in.half.y == -2.0 {
        let across = min(abs(in.local.x - in.local.y), abs(in.local.x + in.local.y)) * 0.7071;
        let along = max(abs(in.local.x), abs(in.local.y));
        alpha = (1.0 - smoothstep(0.9, 1.7, across)) * (1.0 - smoothstep(in.half.x - 0.5, in.half.x + 0.5, along));
    }
    return vec4<f32>(in.colour.rgb, 1.0) * (in.colour.a * alpha);
}
