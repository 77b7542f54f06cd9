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

// The field of a route's roundabout.
fn field_at(index: u32) -> FieldRow {
    let floats = bitcast<vec4<f32>>(roads[index * ROUTE_ROWS + 2u]);
    let words = roads[index * ROUTE_ROWS + 3u];
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
