// Other vehicles from above, drawn from the cars in the rows of trucks by the tables that they drive by.

// Of another vehicle's length and width: the part that a brake light takes at its rear, and from where to where it
// reaches across from the middle. Its windscreen, ahead of the middle.
const LIGHT: f32 = 0.08;
const LIGHT_INNER: f32 = 0.22;
const LIGHT_OUTER: f32 = 0.46;
const SCREEN_REAR: f32 = 0.14;
const SCREEN_FRONT: f32 = 0.26;
// Width of its edge, and of that of who is rude (pixels), and most of half its width.
const EDGE: f32 = 1.0;
const RUDE_EDGE: f32 = 2.5;
const MOST_EDGE: f32 = 0.35;

// Another vehicle.
struct Vehicle {
    @builtin(position) position: vec4<f32>,
    // Position ahead of its middle and to the left, and half of its extents (m).
    @location(0) local: vec2<f32>,
    @location(1) @interpolate(flat) half: vec2<f32>,
    @location(2) @interpolate(flat) colour: vec4<f32>,
    // Colour and width (pixels) of its edge.
    @location(3) @interpolate(flat) edge: vec4<f32>,
    // Whether its brake lights are lit.
    @location(4) @interpolate(flat) brakes: u32,
}

// The vehicles around the trucks of the crowd: an instance a slot.
@vertex
fn others(@builtin(vertex_index) vertex: u32, @builtin(instance_index) index: u32) -> Vehicle {
    return vehicle(vertex, index / N_CARS, index % N_CARS, view.others, false);
}

// Those around the truck that is followed.
@vertex
fn around_followed(@builtin(vertex_index) vertex: u32, @builtin(instance_index) slot: u32) -> Vehicle {
    return vehicle(vertex, view.followed, slot, 1.0, false);
}

// The trailers of both.
@vertex
fn trailers(@builtin(vertex_index) vertex: u32, @builtin(instance_index) index: u32) -> Vehicle {
    return vehicle(vertex, index / N_CARS, index % N_CARS, view.others, true);
}

@vertex
fn trailers_around_followed(@builtin(vertex_index) vertex: u32, @builtin(instance_index) slot: u32) -> Vehicle {
    return vehicle(vertex, view.followed, slot, 1.0, true);
}

// The vehicle in a slot of a truck's row, or its trailer, moved on by the time since the last step.
fn vehicle(vertex: u32, env: u32, slot: u32, alpha: f32, is_trailer: bool) -> Vehicle {
    var car = car_at(env, slot);
    if !is_there(car) || truck[env].held == 1u || (is_trailer && !has_trailer(car)) {
        return Vehicle(unseen().position, vec2<f32>(0.0), vec2<f32>(0.0), vec4<f32>(0.0), vec4<f32>(0.0), 0u);
    }
    car.station += i32(speed_of(car) * view.since * STATE_METRE);
    let network = network_of(truck[env].route);
    var outline = outline_of(network, car);
    if is_trailer { outline = trailer_of(network, car); }
    let half = vec2<f32>(outline.half_length, outline.half_width);
    let local = SQUARE[vertex] * (half + view.pixel);
    let p = offset_of(sites[truck[env].route]) + outline.middle + rotated(outline.along, local);
    let is_rude = (style_of(car) & RUDE) == RUDE;
    let brakes = f32(car.acceleration) / STATE_ACCELERATION < BRAKES;
    return Vehicle(
        on_screen(p),
        local,
        half,
        vec4<f32>(select(theme.car.rgb, theme.van.rgb, is_van(car) || large_of(style_of(car)) != 0u), alpha),
        vec4<f32>(select(theme.panel.rgb, theme.rude.rgb, is_rude), select(EDGE, RUDE_EDGE, is_rude)),
        u32(brakes),
    );
}

// A body with rounded corners, its windscreen, its lit brake lights and its edge.
@fragment
fn vehicle_colour(in: Vehicle) -> @location(0) vec4<f32> {
    let pixel = max(view.pixel, 1e-3);
    let distance = outside(in.local, in.half);
    let inside = 1.0 - smoothstep(-0.5 * pixel, 0.5 * pixel, distance);
    let fine = 1.0 - smoothstep(0.1, 0.25, pixel);
    let part = in.local / (2.0 * in.half);
    var colour = in.colour.rgb;
    let is_screen = SCREEN_REAR < part.x && part.x < SCREEN_FRONT && abs(part.y) < 0.4;
    if is_screen { colour = mix(colour, theme.panel.rgb, 0.7 * fine); }
    let width = min(in.edge.w * pixel, MOST_EDGE * in.half.y);
    let edge = smoothstep(-width - 0.5 * pixel, -width + 0.5 * pixel, distance);
    // Of who is rude it is seen from afar too.
    colour = mix(colour, in.edge.rgb, edge * select(fine, 1.0, EDGE < in.edge.w));
    // Never less than two pixels long.
    let is_at_rear = in.local.x < max((2.0 * LIGHT - 1.0) * in.half.x, -in.half.x + 2.0 * pixel);
    let is_light = is_at_rear && LIGHT_INNER < abs(part.y) && abs(part.y) < LIGHT_OUTER;
    if is_light && in.brakes == 1u { colour = theme.brakes.rgb; }
    return vec4<f32>(colour, 1.0) * (in.colour.a * inside);
}
