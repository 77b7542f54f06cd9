//! Where a truck stands that begins along its route: as if its reference point had followed the route from the first
//! waypoint to this one.
//!
//! A trailer that stood straight behind in a bend would cut it, or hang out of it. How it stands depends on the way
//! there and on the vehicle, so both units' headings are integrated along the waypoints when an episode begins: a table
//! of them would be one a vehicle, and a caller who states an articulation would need to know it. Wheels, slip of the
//! tyres and lean are as a constant turn of that curvature asks for at that speed, since a truck that began with
//! straight wheels and upright in a bend would leave it and sway.

use glam::Vec2;

use crate::engine::cpu::drive::steered_wheelbase;
use crate::layout::angle::{TINY, arc_tangent};
use crate::layout::shared::constants;
use crate::layout::{Rig, Truck, WaypointRow};

constants! {
    /// Least 1 plus the cosine of an angle that is halved: keeps the quotient finite where a unit has turned round.
    const HALVED_MIN: f32 = 1e-6;
}

/// Index of the waypoint of a route with `n_waypoints` at which a truck begins that starts `along` it: the last but one
/// at most, since one is yet to pass.
#[inline]
pub fn first_waypoint(n_waypoints: u32, along: f32) -> u32 {
    ((along * (n_waypoints - 1) as f32).round_ties_even() as u32).min(n_waypoints - 2)
}

/// The truck, still upright, with the headings and the wheels with which it comes to the last of these waypoints, once
/// its reference point has followed them from the first at a speed (m/s). Both units begin along the first.
pub fn standing_at(rig: &Rig, speed: f32, waypoints: &[WaypointRow]) -> Truck {
    let lane = waypoints[waypoints.len() - 1].direction;
    let units = followed_by(rig, speed, waypoints);
    let tractor = slipping(rig, speed, units.tractor, lane);
    // The reference point is half a wheelbase ahead of the drive axle, which without slip moves along the tractor.
    let side = units.tractor.perp_dot(lane) * steered_wheelbase(rig, speed);
    let steering = arc_tangent(side, units.tractor.dot(lane) * 0.5 * rig.wheelbase);
    Truck {
        heading: arc_tangent(tractor.y, tractor.x),
        trailer_heading: arc_tangent(units.trailer.y, units.trailer.x),
        speed,
        steering: steering.clamp(-rig.steer_max, rig.steer_max),
        ..Truck::default()
    }
}

/// Headings of both units as unit vectors.
struct Headings {
    tractor: Vec2,
    trailer: Vec2,
}

/// Headings once the reference point has followed these waypoints at a speed (m/s); the tractor's is without slip.
///
/// The way between two waypoints is followed in straight pieces, two at least, none longer than the tractor's lever.
fn followed_by(rig: &Rig, speed: f32, waypoints: &[WaypointRow]) -> Headings {
    let (lever, hitch_behind) = (0.5 * rig.wheelbase, 0.5 * rig.wheelbase - rig.fifth_wheel);
    let trailer_lever = rig.trailer_wheelbase - slip_lever(rig, speed);
    let mut point = waypoints[0].position;
    let mut units = Headings { tractor: waypoints[0].direction, trailer: waypoints[0].direction };
    for pair in waypoints.windows(2) {
        let n_pieces = (pair[0].position.distance(pair[1].position) / lever).ceil().max(2.0);
        for piece in 1..=n_pieces as u32 {
            let next = between(&pair[0], &pair[1], piece as f32 / n_pieces);
            let turned = pulled(units.tractor, lever, next - point);
            let hitch_way = next - point - hitch_behind * (turned - units.tractor);
            units = Headings { tractor: turned, trailer: pulled(units.trailer, trailer_lever, hitch_way) };
            point = next;
        }
    }
    units
}

/// The heading, as a unit vector, of a tractor in a constant turn at a speed (m/s) whose reference point moves along
/// the lane, where it heads along `tractor` without slip. Slip moves the point that moves along the tractor ahead of
/// its axle.
fn slipping(rig: &Rig, speed: f32, tractor: Vec2, lane: Vec2) -> Vec2 {
    let lever = 0.5 * rig.wheelbase;
    let side = (lever - slip_lever(rig, speed)) / lever * tractor.perp_dot(lane);
    lane.rotate(Vec2::new((1.0 - side * side).max(0.0).sqrt(), -side))
}

/// Length by which slip moves a unit's turning point ahead at a speed (m/s), before its load moves (m).
fn slip_lever(rig: &Rig, speed: f32) -> f32 {
    (rig.slip * speed * speed).min(rig.slip_lever_max)
}

/// A point of the lane between two waypoints, of a cubic with their directions, by the fraction of the way to the
/// second.
fn between(behind: &WaypointRow, ahead: &WaypointRow, fraction: f32) -> Vec2 {
    let rest = 1.0 - fraction;
    let bulge = rest * behind.direction - fraction * ahead.direction;
    let shift = (behind.position.distance(ahead.position) * rest * fraction) * bulge;
    let share = fraction * fraction * (3.0 - 2.0 * fraction);
    behind.position + share * (ahead.position - behind.position) + shift
}

/// Heading of a unit of a length (m), from its front end to where it rolls, once its front end has gone this way (m),
/// which is a straight piece of a bend. On a line the unit lies on a tractrix: the tangent of half its angle to the
/// line falls exponentially with the way. Here it falls by the exponential's approximation of order (1, 1), with which
/// units on the chords of a circle come to the angle that they have on the circle.
fn pulled(heading: Vec2, unit_length: f32, way: Vec2) -> Vec2 {
    let gone = way.length();
    if gone < TINY {
        return heading;
    }
    let line = way / gone;
    let tangent = line.perp_dot(heading) / (1.0 + line.dot(heading)).max(HALVED_MIN);
    let half = tangent * ((2.0 * unit_length - gone) / (2.0 * unit_length + gone)).max(0.0);
    let turned = Vec2::new(1.0 - half * half, 2.0 * half) / (1.0 + half * half);
    line.rotate(turned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::cpu::drive::{driven, settled};
    use crate::engine::cpu::follow::reference_point;
    use crate::layout::Control;
    use crate::layout::angle::{direction, wrapped};
    use crate::scenario::Scenario;
    use crate::world::World;

    #[test]
    fn in_a_constant_turn_a_truck_stands_as_the_one_that_the_stages_bring_there() {
        let world = World::bake(&Scenario::named("attard2023").unwrap()).unwrap();
        for (slip_lever_max, slip, steering) in [(0.0, 0.0, 0.2), (1.5, 0.0136, -0.2), (4.0, 0.03, 0.15)] {
            let rig = Rig { slip, slip_lever_max, understeer: 5e-4, ..world.rigs[0] };
            let control = Control { steering, target_speed: 7.0, ..Control::default() };
            let turn = |n: u32| {
                let start = Truck { speed: 7.0, steering, ..Truck::default() };
                (0..n).fold(start, |truck, _| {
                    driven(&rig, world.params.substep, world.params.n_substeps, &control, &truck)
                })
            };
            let steady = turn(900);
            let points = [900, 905, 910].map(|n| reference_point(rig.wheelbase, &turn(n)));
            let centre = centre_of(points);
            let radius = centre.distance(points[0]);
            // The way that the reference point has come, for two rounds, by waypoints 2 m apart.
            let side = steering.signum();
            let at = |back: i32| {
                let out = direction(wrapped(
                    arc_tangent((points[0] - centre).y, (points[0] - centre).x) - side * 2.0 * back as f32 / radius,
                ));
                WaypointRow { position: centre + radius * out, direction: side * out.perp() }
            };
            let waypoints: Vec<WaypointRow> = (0..(12.0 * radius / 2.0) as i32).rev().map(at).collect();
            let found = settled(&rig, &standing_at(&rig, 7.0, &waypoints));
            let off = [
                wrapped(found.heading - steady.heading),
                wrapped(found.trailer_heading - steady.trailer_heading),
                found.steering - steady.steering,
                2.0 * (found.trailer_roll - steady.trailer_roll),
                found.trailer_load_transfer_ratio - steady.trailer_load_transfer_ratio,
            ];
            println!("{radius}: {off:?} of {steady:?}");
            // Half a degree, and a fiftieth of the load.
            assert!(off.iter().zip([9e-3, 9e-3, 9e-3, 2e-3, 0.02]).all(|(off, most)| off.abs() < most), "{off:?}");
        }
    }

    #[test]
    fn wheels_stand_as_a_turn_asks_for_whatever_the_distance_between_waypoints() {
        let world = World::bake(&Scenario::named("attard2023").unwrap()).unwrap();
        for (wheelbase, spacing) in [(2.0, 0.5), (2.0, 2.0), (2.0, 5.0), (3.6, 2.0), (3.6, 5.0), (6.0, 5.0)] {
            let rig = Rig { wheelbase, slip: 0.0, slip_lever_max: 0.0, ..world.rigs[0] };
            let radius = 20.0;
            let at = |index: i32| {
                let out = direction(wrapped(spacing * index as f32 / radius));
                WaypointRow { position: radius * out, direction: out.perp() }
            };
            let waypoints: Vec<WaypointRow> = (0..(6.0 * radius / spacing) as i32).map(at).collect();
            let found = standing_at(&rig, 3.0, &waypoints);
            // The reference point, half a wheelbase ahead of the drive axle, is on the circle.
            let expected = (wheelbase / (radius * radius - wheelbase * wheelbase / 4.0).sqrt()).atan();
            assert!((found.steering / expected - 1.0).abs() < 0.01, "{wheelbase} {spacing}: {found:?} {expected}");
        }
    }

    /// Centre of the circle through three points.
    fn centre_of([a, b, c]: [Vec2; 3]) -> Vec2 {
        let (to_b, to_c) = (b - a, c - a);
        let normal = (to_c * to_b.length_squared() - to_b * to_c.length_squared()).perp();
        a - normal / (2.0 * to_b.perp_dot(to_c))
    }
}
