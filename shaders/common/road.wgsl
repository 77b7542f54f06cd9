// Routes, their waypoints and what is observed there, from the table of roads: rows of four words. See
// src/engine/tables.rs.

// A route.
struct Route {
    // Row of its first waypoint.
    first: u32,
    n_waypoints: u32,
    // Row of the first one's preview.
    first_preview: u32,
    // Reach of a waypoint's crossing line to the left and to the right (m).
    crossing_left: f32,
    crossing_right: f32,
}

fn route_at(index: u32) -> Route {
    let row = roads[index * ROUTE_ROWS];
    let first_preview = roads[index * ROUTE_ROWS + 1u].x;
    return Route(row.x, row.y, first_preview, bitcast<f32>(row.z), bitcast<f32>(row.w));
}

// Index of a route's road.
fn road_of(index: u32) -> u32 {
    return roads[index * ROUTE_ROWS + 1u].z;
}

// A bit for the arm on which a route begins.
fn arm_bit(index: u32) -> u32 {
    return 1u << (roads[index * ROUTE_ROWS + 1u].w & 0xffffu);
}

// A bit for the lane in which it does, among all of the road.
fn lane_bit(index: u32) -> u32 {
    return 1u << (roads[index * ROUTE_ROWS + 1u].w >> 16u);
}

// The field of a route's roundabout: of the kerbs that tractors keep to and distance sensors see.
fn field_at(index: u32) -> FieldRow {
    return field_in(index * ROUTE_ROWS + 2u);
}

// The field of what a unit keeps to on a route: 0 is the tractor. Where there is an apron, trailers have their own.
fn unit_field_at(index: u32, unit: u32) -> FieldRow {
    let own = roads[index * ROUTE_ROWS + 1u].y;
    return field_in(select(index * ROUTE_ROWS + 2u, own, unit == 1u && own != 0u));
}

// Whether a route's roundabout has an apron.
fn has_apron(index: u32) -> bool {
    return roads[index * ROUTE_ROWS + 1u].y != 0u;
}

// The field in a row and the next.
fn field_in(row: u32) -> FieldRow {
    let floats = bitcast<vec4<f32>>(roads[row]);
    let words = roads[row + 1u];
    return FieldRow(floats.xy, floats.z, floats.w, words.x, words.y, words.z, words.w);
}

// The waypoint in a row.
fn waypoint_at(row: u32) -> WaypointRow {
    let floats = bitcast<vec4<f32>>(roads[row]);
    return WaypointRow(floats.xy, floats.zw);
}

// Row of what is observed at waypoint `index` of a route.
fn preview_row(route: Route, index: u32) -> u32 {
    return route.first_preview + index * PREVIEW_ROWS;
}

// Heading of the lane at waypoint `index` of a route (rad).
fn lane_heading(route: Route, index: u32) -> f32 {
    return bitcast<f32>(roads[preview_row(route, index)].x);
}

// Value `n` of a preview that begins at `row`. Its first word is the heading.
fn preview_value(row: u32, n: u32) -> f32 {
    return bitcast<f32>(roads[row + (n + 1u) / 4u][(n + 1u) % 4u]);
}
