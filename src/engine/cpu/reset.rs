//! Begins the next episode of a truck whose last one ended, within the same step.
//!
//! Route and pose are functions of (seed, env, episode) alone. A truck on a fixed route drives it once and is then
//! held.

use crate::angle::{direction, wrapped};
use crate::engine::cpu::follow::{followed, reference_point};
use crate::engine::cpu::{observe, sense};
use crate::engine::{RouteChoice, Row};
use crate::layout::{Control, Ended, Params, Start, Truck, WaypointRow};
use crate::random::{self, Draw};
use crate::world::World;

/// Begins and observes another episode where one ended, or holds the truck.
pub fn reset(world: &World, row: &mut Row) {
    if *row.ended == Ended::Running as u32 {
        return;
    }
    match row.choice {
        RouteChoice::Fixed(_) => row.truck.held = 1,
        RouteChoice::Drawn(_) => {
            begin(world, row, row.truck.episode + 1);
            sense::sense(world, row);
            *row.observation = observe::observation_of(world, row);
        }
    }
}

/// Puts the truck at the start of `episode`, at a pose drawn for it.
pub fn begin(world: &World, row: &mut Row, episode: u32) {
    begin_from(world, row, episode, &drawn_start(row.seed, row.env, episode));
}

/// The start that is drawn for an episode of truck `env`.
pub fn drawn_start(seed: u32, env: u32, episode: u32) -> Start {
    let [offset, heading, ..] = random::words(seed, env, episode, Draw::Pose as u32).map(random::signed_unit);
    Start { offset, heading }
}

/// The same at a stated pose.
pub fn begin_from(world: &World, row: &mut Row, episode: u32, start: &Start) {
    let route = match row.choice {
        RouteChoice::Fixed(routes) => routes[row.env as usize],
        RouteChoice::Drawn(routes) => {
            let [word, ..] = random::words(row.seed, row.env, episode, Draw::Route as u32);
            routes[random::index_below(word, routes.len() as u32) as usize]
        }
    };
    let waypoints = world.route_waypoints(route);
    *row.control = Control::default();
    *row.truck = Truck { route, episode, ..started(&world.params, &waypoints[0], world.route_previews(route)[0].heading, start) };
    let point = reference_point(world.params.rig.wheelbase, row.truck);
    *row.progress = followed(waypoints, point, 1, world.params.stray_distance);
    row.progress.passed = 0;
}

/// A truck at `waypoint`, where the lane has this heading \[rad]: trailer straight, offset and turned as `start` says.
pub fn started(params: &Params, waypoint: &WaypointRow, lane_heading: f32, start: &Start) -> Truck {
    let heading = wrapped(lane_heading + start.heading * params.start_heading);
    let point = waypoint.position + start.offset * params.start_offset * waypoint.direction.perp();
    Truck {
        position: point - 0.5 * params.rig.wheelbase * direction(heading),
        heading,
        trailer_heading: heading,
        speed: params.start_speed,
        ..Truck::default()
    }
}
