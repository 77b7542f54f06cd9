//! A ring as an outline file, `NAME.outline.toml`: loops of arcs and segments, centre lines and arms, without the map.
//!
//! A path is a list of points. `[x, y]` ends a straight, `[x, y, bulge]` an arc; bulge is the tangent of a quarter of
//! the angle that the arc turns by, left positive. Coordinates are rounded to 0.01 mm.

mod read;
mod write;
