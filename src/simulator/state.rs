//! The rows that a batch goes on from, checked: every number is one that a truck of this world can have, so that
//! whatever is computed from it is finite.

use std::f32::consts::TAU;
use std::fmt::Debug;
use std::ops::RangeInclusive;

use glam::Vec2;

use crate::engine::cpu::perceive::pose_of;
use crate::engine::limits::{self, FAR, FASTEST, MOST, STEEPEST};
use crate::engine::{Autoreset, Batch, Error};
use crate::layout::{Column, Control, Ended, N_CARS, N_POSES, Pose, Progress, Reward, RewardTerms, Truck};
use crate::traffic::{Car, ENTERED_BEFORE, Row};
use crate::world::World;

/// No vehicle brakes harder (m/s²).
const MOST_BRAKING: f32 = 8.0;
/// An observed value's largest magnitude: 1, with room for the rounding of either engine.
const OBSERVED: f32 = 1.001;

/// An error for the first value that no truck of this world can have.
pub(super) fn check_state(world: &World, batch: &Batch) -> Result<(), Error> {
    check_indices(world, batch)?;
    check_groups(world, batch)?;
    for env in 0..batch.n_envs() {
        let (truck, progress) = (&batch.truck[env], &batch.progress[env]);
        let n_waypoints = world.routes[truck.route as usize].n_waypoints;
        check_control(world, env, &batch.control[env])?;
        check_truck(world, env, truck, progress)?;
        if truck.held == 1 && batch.autoreset() == Autoreset::SameStep && world.group() == 1 {
            return Err(Error::HeldInSameStep { env });
        }
        let clearance = &batch.clearance[env];
        within(Column::Clearance, env, ".tractor", clearance.tractor, -MOST..=MOST)?;
        within(Column::Clearance, env, ".trailer", clearance.trailer, -MOST..=MOST)?;
        within(Column::Progress, env, ".lane_distance", progress.lane_distance, 0.0..=MOST)?;
        within(Column::Progress, env, ".waypoint_distance", progress.waypoint_distance, 0.0..=MOST)?;
        within(Column::Progress, env, ".passed", progress.passed, 0..=n_waypoints)?;
        all_within(Column::Ranges, env, &batch.ranges[env], 0.0..=world.params.sensor_range)?;
        let observed = [
            (Column::Observation, &batch.observation[env][..]),
            (Column::NextObservation, &batch.next_observation[env]),
            (Column::Extras, &batch.extras[env]),
            (Column::NextExtras, &batch.next_extras[env]),
        ];
        observed.into_iter().try_for_each(|(column, values)| all_within(column, env, values, -OBSERVED..=OBSERVED))?;
        check_poses(env, &batch.poses[env], next_waypoint(world, truck, progress), n_waypoints)?;
        within(Column::Ended, env, "", batch.ended[env], 0..=Ended::ALL.len() as u32 - 1)?;
        check_terms(env, &batch.terms[env], n_waypoints)?;
        let most = largest_reward(&world.reward, n_waypoints) + largest_hindrance(world);
        within(Column::Reward, env, "", batch.reward[env], -most..=most)?;
        within(Column::Command, env, ".steering", batch.command[env].steering, -1.0..=1.0)?;
        within(Column::Command, env, ".speed", batch.command[env].speed, -1.0..=1.0)?;
        batch.cars.get(env).map_or(Ok(()), |words| check_cars(world, env, truck, Row::of(words)))?;
        for (column, rows) in [(Column::Around, &batch.around), (Column::NextAround, &batch.next_around)] {
            rows.get(env).map_or(Ok(()), |values| all_within(column, env, values, -OBSERVED..=OBSERVED))?;
        }
    }
    Ok(())
}

fn check_control(world: &World, env: usize, control: &Control) -> Result<(), Error> {
    let Control {
        steering,
        acceleration,
        speed_error_integral,
        steering_before,
        steering_earlier,
        target_speed,
        holds,
        steering_earliest,
        action_before,
        action_earlier,
        action_earliest,
    } = *control;
    for (field, value, most) in [
        (".steering", steering, STEEPEST),
        (".acceleration", acceleration, MOST),
        (".speed_error_integral", speed_error_integral, MOST),
        (".steering_before", steering_before, STEEPEST),
        (".steering_earlier", steering_earlier, STEEPEST),
        (".steering_earliest", steering_earliest, STEEPEST),
        (".target_speed", target_speed, FASTEST),
    ] {
        within(Column::Control, env, field, value, -most..=most)?;
    }
    for (field, action) in
        [(".action_before", action_before), (".action_earlier", action_earlier), (".action_earliest", action_earliest)]
    {
        if !world.is_continuous() {
            // An action's index plus 1.
            within(Column::Control, env, field, action, 0..=world.params.n_actions)?;
        } else if action != 0 {
            // A command's halves, none of which is 0.
            within(Column::Control, env, field, action & 0xffff, 1..=0xffff)?;
            within(Column::Control, env, field, action >> 16, 1..=0xffff)?;
        }
    }
    within(Column::Control, env, ".holds", holds, 0..=1)
}

/// The vehicles around a truck.
fn check_cars(world: &World, env: usize, truck: &Truck, row: &Row) -> Result<(), Error> {
    let Some(traffic) = &world.traffic else { return Ok(()) };
    let road = traffic.road(world, truck.route);
    within(Column::Cars, env, ".level", row.level as usize, 0..=road.levels.len() - 1)?;
    if row.entered != ENTERED_BEFORE {
        within(Column::Cars, env, ".entered", row.entered, 0..=truck.steps)?;
    }
    within(Column::Cars, env, ".met", row.met % 64, 0..=(N_CARS + world.group()) as u32)?;
    within(Column::Cars, env, ".hindered", row.hindered, 0..=(1 << N_CARS) - 1)?;
    for (slot, car) in row.cars.iter().enumerate().filter(|(_, car)| car.is_there()) {
        let field = |name: &str| format!("[{slot}].{name}");
        within(Column::Cars, env, &field("path"), car.path(), 0..=road.network.paths.len() - 1)?;
        // Of large vehicles there are tables where a benchmark has some.
        let is_large = u32::from(car.large().is_some());
        within(Column::Cars, env, &field("large"), is_large, 0..=u32::from(road.network.large.is_some()))?;
        let length = road.network.paths[car.path()].length();
        within(Column::Cars, env, &field("station"), car.station(), 0.0..=length)?;
        within(Column::Cars, env, &field("speed"), car.speed(), 0.0..=Car::FASTEST)?;
        within(Column::Cars, env, &field("acceleration"), car.acceleration(), -Car::HARDEST..=Car::HARDEST)?;
    }
    Ok(())
}

/// The poses that are kept with disturbances; without, they are zeros.
fn check_poses(env: usize, poses: &[Pose; N_POSES], next: Vec2, n_waypoints: u32) -> Result<(), Error> {
    for (index, pose) in poses.iter().enumerate() {
        let place = |field: &str| format!("{}[{env}][{index}]{field}", Column::Poses.name());
        check_pose(place, pose, next)?;
        limits::within(|| place(".waypoint"), pose.waypoint, 0..=n_waypoints)?;
    }
    Ok(())
}

/// Where a truck is, and how fast, near the waypoint `next` that it is to pass (m). `place` names a field.
fn check_pose(place: impl Fn(&str) -> String, pose: &Pose, next: Vec2) -> Result<(), Error> {
    let Pose { position, heading, trailer_heading, speed, waypoint: _ } = *pose;
    for (field, value, range) in [
        (".position[0]", position.x, next.x - FAR..=next.x + FAR),
        (".position[1]", position.y, next.y - FAR..=next.y + FAR),
        (".heading", heading, -TAU..=TAU),
        (".trailer_heading", trailer_heading, -TAU..=TAU),
        (".speed", speed, -FASTEST..=FASTEST),
    ] {
        limits::within(|| place(field), value, range)?;
    }
    Ok(())
}

/// Position of the waypoint that the truck is to pass next (m).
fn next_waypoint(world: &World, truck: &Truck, progress: &Progress) -> Vec2 {
    let waypoints = world.route_waypoints(truck.route);
    waypoints[(progress.waypoint as usize).min(waypoints.len() - 1)].position
}

fn check_truck(world: &World, env: usize, truck: &Truck, progress: &Progress) -> Result<(), Error> {
    let place = |field: &str| format!("{}[{env}]{field}", Column::Truck.name());
    check_pose(place, &pose_of(truck, progress), next_waypoint(world, truck, progress))?;
    // A truck steers up to its lock, but for the rounding of a sum.
    let lock = world.rig(truck).steer_max * OBSERVED;
    for (field, value, range) in [
        (".steering", truck.steering, -lock..=lock),
        (".tractor_roll", truck.tractor_roll, -MOST..=MOST),
        (".tractor_roll_rate", truck.tractor_roll_rate, -MOST..=MOST),
        (".trailer_roll", truck.trailer_roll, -MOST..=MOST),
        (".trailer_roll_rate", truck.trailer_roll_rate, -MOST..=MOST),
        (".tractor_load_transfer_ratio", truck.tractor_load_transfer_ratio, -MOST..=MOST),
        (".trailer_load_transfer_ratio", truck.trailer_load_transfer_ratio, -MOST..=MOST),
        (".acceleration", truck.acceleration, -MOST..=MOST),
        (".curvature_lag", truck.curvature_lag, -MOST..=MOST),
        (".lateral_acceleration", truck.lateral_acceleration, -MOST..=MOST),
    ] {
        within(Column::Truck, env, field, value, range)?;
    }
    // The next one can be counted.
    within(Column::Truck, env, ".episode", truck.episode, 0..=u32::MAX - 1)?;
    within(Column::Truck, env, ".steps", truck.steps, 0..=u32::MAX - 1)?;
    within(Column::Truck, env, ".held", truck.held, 0..=1)
}

fn check_terms(env: usize, terms: &RewardTerms, n_waypoints: u32) -> Result<(), Error> {
    let RewardTerms { waypoints, lane_distance, clearance, failure } = *terms;
    within(Column::Terms, env, ".waypoints", waypoints, 0.0..=n_waypoints as f32)?;
    let fractions = [(".lane_distance", lane_distance), (".clearance", clearance), (".failure", failure)];
    fractions.into_iter().try_for_each(|(field, value)| within(Column::Terms, env, field, value, 0.0..=1.0))
}

/// Furthest that a wheel can be on an apron (m): a field tells no more.
const MOST_ON_APRON: f32 = 16.0;

/// Most that a step's reward can be, and its negative the least, on a route with so many waypoints.
fn largest_reward(weights: &Reward, n_waypoints: u32) -> f32 {
    let Reward { lane_distance, clearance, failure, apron, .. } = weights;
    let once = lane_distance.abs() + clearance.abs() + failure.abs() + MOST_ON_APRON * apron.abs();
    (weights.waypoint.abs() * n_waypoints as f32 + once) * OBSERVED
}

/// What hindrance adds to a reward at most: all vehicles brake as hard as they can.
fn largest_hindrance(world: &World) -> f32 {
    world.traffic.as_ref().map_or(0.0, |traffic| traffic.hindrance.abs() * MOST_BRAKING * N_CARS as f32)
}

fn all_within(column: Column, env: usize, values: &[f32], range: RangeInclusive<f32>) -> Result<(), Error> {
    match values.iter().position(|value| !range.contains(value)) {
        Some(index) => within(column, env, &format!("[{index}]"), values[index], range),
        None => Ok(()),
    }
}

fn within<T: PartialOrd + Debug>(
    column: Column,
    env: usize,
    field: &str,
    value: T,
    range: RangeInclusive<T>,
) -> Result<(), Error> {
    limits::within(|| format!("{}[{env}]{field}", column.name()), value, range)
}

/// An error if trucks of a group are on several roads, in other episodes, or not as long on their way.
fn check_groups(world: &World, batch: &Batch) -> Result<(), Error> {
    for (index, trucks) in batch.truck.chunks(world.group()).enumerate() {
        let road = |truck: &Truck| world.routes[truck.route as usize].roundabout;
        let running = trucks.iter().find(|truck| truck.held == 0);
        for (n, truck) in trucks.iter().enumerate() {
            let env = index * trucks.len() + n;
            if road(truck) != road(&trucks[0]) {
                let limit = format!("routes of one road in trucks {}..{}", env - n, env - n + trucks.len() - 1);
                return Err(Error::OutsideWorld { column: Column::Truck.name(), env, found: truck.route, limit });
            }
            within(Column::Truck, env, ".episode", truck.episode, trucks[0].episode..=trucks[0].episode)?;
            if let Some(first) = running.filter(|_| truck.held == 0) {
                within(Column::Truck, env, ".steps", truck.steps, first.steps..=first.steps)?;
            }
        }
    }
    Ok(())
}

/// An error if a truck's route, vehicle, waypoint or action is not in the world: stages use them as indices without a
/// check.
fn check_indices(world: &World, batch: &Batch) -> Result<(), Error> {
    // Where actions are continuous the column is not used: zeros.
    let n_actions = world.params.n_actions.max(1);
    if let Some((env, &found)) = batch.action.iter().enumerate().find(|&(_, &action)| n_actions <= action) {
        let limit = format!("actions 0..{}", n_actions - 1);
        return Err(Error::OutsideWorld { column: Column::Action.name(), env, found, limit });
    }
    for (env, (truck, progress)) in batch.truck.iter().zip(&batch.progress).enumerate() {
        let Some(route) = world.routes.get(truck.route as usize) else {
            let limit = format!("routes 0..{}", world.routes.len() - 1);
            return Err(Error::OutsideWorld { column: Column::Truck.name(), env, found: truck.route, limit });
        };
        if world.rigs.len() <= truck.vehicle as usize {
            let limit = format!("vehicles 0..{}", world.rigs.len() - 1);
            return Err(Error::OutsideWorld { column: Column::Truck.name(), env, found: truck.vehicle, limit });
        }
        if route.n_waypoints < progress.waypoint {
            let limit = format!("{} waypoints on its route", route.n_waypoints);
            return Err(Error::OutsideWorld { column: Column::Progress.name(), env, found: progress.waypoint, limit });
        }
    }
    Ok(())
}
