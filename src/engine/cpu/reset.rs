//! Begins episodes: within the step that ended the last one, in the step after it, or when the caller says so.
//!
//! Route and pose are functions of (seed, env, episode) alone, where the caller states none.

use crate::engine::cpu::drive::settled;
use crate::engine::cpu::follow::{followed, reference_point};
use crate::engine::cpu::traffic::surround;
use crate::engine::cpu::{along, around, observe, perceive, sense};
use crate::engine::{Autoreset, RouteChoice, Row, group};
use crate::layout::angle::{direction, wrapped};
use crate::layout::random::{self, Draw};
use crate::layout::{
    BEGINS, BeginRow, Control, Ended, HAS_ROUTE, HAS_START, IS_CENTRED, IS_FIRST, Params, RewardTerms, Rig, Start,
    Stream, Truck, WaypointRow,
};
use crate::world::World;

/// The next episode, as drawn.
pub(in crate::engine) const NEXT: BeginRow =
    BeginRow { start: Start { offset: 0.0, heading: 0.0, speed: 0.0, along: 0.0, vehicle: 0 }, route: 0, what: BEGINS };

/// Begins and observes another episode where one ended, or holds the truck. A truck that was held when the step began
/// begins its next episode with [`Autoreset::NextStep`]. Trucks of a group begin together: [`crate::engine::group`].
pub fn reset(world: &World, row: &mut Row) {
    if row.truck.held == 1 {
        if row.autoreset == Autoreset::NextStep {
            begin(world, row, &NEXT);
        }
    } else if *row.ended != Ended::Running as u32 {
        if row.autoreset == Autoreset::SameStep {
            start(world, row, &NEXT);
        } else {
            row.truck.held = 1;
        }
    }
}

/// Begins and observes an episode where the caller says so. It has no last step.
pub fn begin(world: &World, row: &mut Row, begin: &BeginRow) {
    if begin.what & BEGINS == 0 {
        return;
    }
    start(world, row, begin);
    forget(row);
}

/// Takes back what describes the last step: there is none.
pub(in crate::engine) fn forget(row: &mut Row) {
    *row.next_observation = *row.observation;
    *row.next_extras = *row.extras;
    if let (Some(next), Some(around)) = (&mut row.next_around, &row.around) {
        **next = **around;
    }
    *row.ended = Ended::Running as u32;
    *row.terms = RewardTerms::default();
    *row.reward = 0.0;
}

/// The start that is drawn for an episode of truck `env` in a world with these `params`.
pub fn drawn_start(params: &Params, seed: u32, env: u32, episode: u32) -> Start {
    let [offset, heading, ..] = random::words(seed, env, episode, Draw::Pose as u32).map(random::signed_unit);
    let [vehicle, speed, along, _] = random::words(seed, env, episode, Draw::Vehicle as u32);
    Start {
        offset,
        heading,
        speed: random::signed_unit(speed),
        along: params.start_along * (0.5 * (random::signed_unit(along) + 1.0)),
        vehicle: random::index_below(vehicle, params.n_vehicles),
    }
}

/// Puts the truck at the start of an episode and observes it there.
fn start(world: &World, row: &mut Row, begin: &BeginRow) {
    put(world, row, begin);
    look(world, row);
}

/// Puts the truck at the start of an episode.
pub(in crate::engine) fn put(world: &World, row: &mut Row, begin: &BeginRow) {
    let Stream { seed, env } = row.stream;
    let episode = if begin.what & IS_FIRST == 0 { row.truck.episode + 1 } else { 0 };
    let route = if begin.what & HAS_ROUTE == 0 { route_of(world, row, episode) } else { begin.route };
    let start = if begin.what & HAS_START == 0 {
        let drawn = drawn_start(&world.params, seed, env, episode);
        // Off their lanes' centres, trucks beside each other may stand in each other.
        if begin.what & IS_CENTRED != 0 || group::shares_arms(world, row, route) {
            Start { offset: 0.0, heading: 0.0, ..drawn }
        } else {
            drawn
        }
    } else {
        begin.start
    };
    let waypoints = world.route_waypoints(route);
    let rig = &world.rigs[start.vehicle as usize];
    let first = along::first_waypoint(waypoints.len() as u32, start.along) as usize;
    let speed = world.params.start_speed + start.speed * world.params.start_speed_range;
    let standing = if first == 0 {
        let heading = world.route_previews(route)[0].heading;
        Truck { heading, trailer_heading: heading, speed, ..Truck::default() }
    } else {
        along::standing_at(rig, speed, &waypoints[..=first])
    };
    let leans = first != 0 || rig.crossfall != 0.0;
    let standing = if leans { settled(rig, &standing) } else { standing };
    let at_start = started(&world.params, rig, &waypoints[first], &standing, &start);
    *row.truck = Truck { route, episode, ..at_start };
    let steering = at_start.steering;
    *row.control = Control {
        steering,
        steering_before: steering,
        steering_earlier: steering,
        steering_earliest: steering,
        target_speed: at_start.speed,
        ..Control::default()
    };
    let point = reference_point(rig.wheelbase, row.truck);
    *row.progress = followed(waypoints, point, first as u32 + 1, world.params.stray_distance);
    row.progress.passed = 0;
}

/// Puts vehicles around a truck that begins an episode, and observes them and the road.
pub(in crate::engine) fn look(world: &World, row: &mut Row) {
    surround(world, row);
    if world.disturbances.of_observation == 1 {
        perceive::perceive(world, row, 0);
    }
    sense::sense_at(world, row, 0);
    *row.observation = observe::observation_of(world, row);
    if 0 < world.params.n_extras {
        *row.extras = observe::extras(world, row.truck, row.control);
    }
    if let Some(seen) = around::around(world, row) {
        row.around.iter_mut().for_each(|around| **around = seen);
    }
}

/// The route of an episode as the batch chooses it.
fn route_of(world: &World, row: &Row, episode: u32) -> u32 {
    match row.choice {
        RouteChoice::Fixed(routes) => routes[row.env as usize],
        RouteChoice::Drawn(routes) if !row.mates.is_empty() => group::route_of(world, routes, row, episode),
        RouteChoice::Drawn(routes) => routes[drawn_below(row.stream, episode, routes.len())],
    }
}

/// An index below `n` for the route of a truck's episode.
pub(in crate::engine) fn drawn_below(Stream { seed, env }: Stream, episode: u32, n: usize) -> usize {
    let [word, ..] = random::words(seed, env, episode, Draw::Route as u32);
    random::index_below(word, n as u32) as usize
}

/// A truck that stands at `waypoint` with these headings, offset and turned as a whole as `start` says.
fn started(params: &Params, rig: &Rig, waypoint: &WaypointRow, standing: &Truck, start: &Start) -> Truck {
    let turned = |heading: f32| wrapped(heading + start.heading * params.start_heading);
    let heading = turned(standing.heading);
    let point = waypoint.position + start.offset * params.start_offset * waypoint.direction.perp();
    Truck {
        position: point - 0.5 * rig.wheelbase * direction(heading),
        heading,
        trailer_heading: turned(standing.trailer_heading),
        vehicle: start.vehicle,
        ..*standing
    }
}
