//! What chooses the actions: a learned policy, pure pursuit of the centre line, actions drawn uniformly at random, or a
//! rule among other vehicles. All but the first are baselines that a learner must beat.

pub mod rule;

use std::collections::HashMap;
use std::path::Path;

use offtrack::layout::{Action, Command, Stream, Truck, WaypointRow};
use offtrack::physics::{drawn_action, drawn_command};
use offtrack::simulator::{Actions, Batch, Engine};
use offtrack::vehicle::profile::Profile;
use offtrack::world::World;
use offtrack_policy::Choice;

use crate::certificate::line::Lines;
pub use crate::controller::Controller;
use crate::error::Error;
use crate::placed::placed;

/// Pure pursuit's default look-ahead distance: the best of 4, 5, 6, 7, 8, 9, 10 and 12 m on the training routes of
/// attard2023 (m).
pub const LOOK_AHEAD: f32 = 7.0;

/// How far ahead pure pursuit looks for a lower speed: the time that the speed control takes to reach it (s).
const RESPONSE: f64 = 1.5;

/// The policy that a command's `--policy` names: `pursuit`, `random`, `yields`, `follows`, a policy file, or a shipped
/// policy by its name. Its action table must be the world's. With `None` it is the policy shipped for `benchmark` or,
/// where there is none, the first that can drive there. `pursuit` is what pure pursuit would be, `seed` that of random
/// actions. It drives trucks on `engine`: a learned policy acts there.
pub fn find(
    policy: Option<&str>,
    benchmark: &str,
    pursuit: PurePursuit,
    seed: u32,
    world: &World,
    engine: &Engine,
) -> Result<Box<dyn Controller>, Error> {
    let learned = match policy {
        Some("pursuit") => return Ok(Box::new(pursuit)),
        Some("random") => return Ok(Box::new(UniformRandom { seed })),
        Some(name @ (rule::YIELDS | rule::FOLLOWS)) => return Ok(Box::new(rule::Rule::new(name, world)?)),
        Some(name) => match rule::under(name) {
            Some((rule, policy)) => {
                // The rule decides on the processor, and so does what it caps.
                let policy = placed(learned(policy)?, &Engine::Cpu, world, Choice::Best)?;
                return Ok(Box::new(rule::Capped::new(rule, policy, world)?));
            }
            None => learned(name)?,
        },
        None => offtrack_policy::Policy::shipped_for(benchmark, world)?,
    };
    placed(learned, engine, world, Choice::Best)
}

/// A shipped policy by its name, or a learned one by the path of its file. A name comes first.
pub fn learned(name: &str) -> Result<offtrack_policy::Policy, Error> {
    let file = Path::new(name);
    let is_shipped = offtrack_policy::Policy::shipped_names().contains(&name);
    // A word without an extension that is no file is taken for a wrong name: the error lists the right ones.
    let is_name = !file.exists() && file.extension().is_none() && file.components().count() <= 1;
    if is_shipped || is_name {
        return Ok(offtrack_policy::Policy::shipped(name)?);
    }
    Ok(offtrack_policy::Policy::load(file)?)
}

/// Actions drawn uniformly at random.
#[derive(Debug)]
pub struct UniformRandom {
    /// Seed of the draws.
    pub seed: u32,
}

impl Controller for UniformRandom {
    fn name(&self) -> &str {
        "random"
    }

    fn choose(&mut self, world: &World, batch: &Batch) -> Actions {
        let trucks = (0..).zip(&batch.truck);
        let drawn = trucks.map(|(env, truck)| (Stream { seed: self.seed, env }, truck.episode, truck.steps));
        if world.is_continuous() {
            Actions::Commands(drawn.map(|(stream, episode, steps)| drawn_command(stream, episode, steps)).collect())
        } else {
            let n_actions = world.params.n_actions;
            let index = |(stream, episode, steps)| drawn_action(stream, episode, steps, n_actions);
            Actions::Indices(drawn.map(index).collect())
        }
    }
}

/// Pure pursuit: steers the drive axle along the arc to a point of the centre line at the look-ahead distance, at the
/// speed of the feasible profile of its vehicle. It follows the line well and ignores the room that the trailer needs;
/// [planned](PurePursuit::planned) lines have it.
///
/// R. Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm" (Carnegie Mellon, 1992).
#[derive(Debug)]
pub struct PurePursuit {
    /// Look-ahead distance: from the drive axle to the target point (m).
    look_ahead: f32,
    /// The feasible speeds of a vehicle on a route, by both indices.
    profiles: HashMap<(u32, u32), Profile>,
    /// Lines to follow in place of the lane's centre.
    lines: Lines,
    name: String,
}

impl Controller for PurePursuit {
    fn name(&self) -> &str {
        &self.name
    }

    fn choose(&mut self, world: &World, batch: &Batch) -> Actions {
        let wanted = batch.truck.iter().zip(&batch.progress).zip(&batch.control).map(|((truck, progress), control)| {
            let (waypoints, next) = (line(&self.lines, world, truck.route), progress.waypoint as usize);
            let steering = self.steering(world.rig(truck).wheelbase, truck, waypoints, next);
            let speed = self.speed(world, truck, next);
            let speed = if world.params.changes_speed == 1 { speed - control.target_speed } else { speed };
            Action { steering, speed }
        });
        if world.is_continuous() {
            Actions::Commands(wanted.map(|wanted| command_for(world, wanted)).collect())
        } else {
            Actions::Indices(wanted.map(|wanted| nearest(world, wanted.steering, wanted.speed)).collect())
        }
    }
}

impl PurePursuit {
    /// Pure pursuit with this look-ahead distance (m).
    pub fn new(look_ahead: f32) -> PurePursuit {
        PurePursuit { look_ahead, profiles: HashMap::new(), lines: Lines::new(), name: "pursuit".to_owned() }
    }

    /// Follows these lines, and the lane's centre on routes that have none; `origin` tells where they are from in its
    /// name.
    pub fn planned(self, lines: Lines, origin: &str) -> PurePursuit {
        PurePursuit { lines, name: format!("pursuit of {origin}"), ..self }
    }

    /// The speed to drive at: the lowest of the profile within the time that the speed control takes to follow (m/s).
    fn speed(&mut self, world: &World, truck: &Truck, next: usize) -> f32 {
        let waypoints = line(&self.lines, world, truck.route);
        let fastest = world.params.target_speed_max.into();
        let profile = self.profiles.entry((truck.route, truck.vehicle));
        let profile = profile.or_insert_with(|| Profile::of(world.rig(truck), waypoints, fastest));
        let spacing = waypoints[0].position.distance(waypoints[1].position);
        profile.lowest_ahead(next.saturating_sub(1), f64::from(truck.speed) * RESPONSE, spacing.into()) as f32
    }

    /// Steer angle of the arc to the target point (rad).
    fn steering(&self, wheelbase: f32, truck: &Truck, waypoints: &[WaypointRow], next: usize) -> f32 {
        let pair = |index: usize| (waypoints[index - 1].position, waypoints[index].position);
        // The first segment that ends beyond the look-ahead distance; it starts within it.
        let first = next.clamp(1, waypoints.len() - 1);
        let beyond = |&index: &usize| self.look_ahead <= truck.position.distance(waypoints[index].position);
        let index = (first..waypoints.len()).find(beyond).unwrap_or(waypoints.len() - 1);
        let (from, to) = pair(index);
        let (mut near, mut far) = (0.0f32, 1.0f32);
        // Bisection finds the target point to a millimetre on a segment of a few metres.
        for _ in 0..12 {
            let middle = 0.5 * (near + far);
            if truck.position.distance(from.lerp(to, middle)) < self.look_ahead { near = middle } else { far = middle }
        }
        let ahead = from.lerp(to, far) - truck.position;
        let bearing = glam::Vec2::from_angle(-truck.heading).rotate(ahead);
        (2.0 * wheelbase * bearing.y / ahead.length_squared().max(1.0)).atan()
    }
}

/// The line that pure pursuit follows on a route: a row for each waypoint.
fn line<'a>(lines: &'a Lines, world: &'a World, route: u32) -> &'a [WaypointRow] {
    lines.get(&route).map_or_else(|| world.route_waypoints(route), Vec::as_slice)
}

/// The command that asks for this, or for what is nearest to it within the ranges of commands.
fn command_for(world: &World, wanted: Action) -> Command {
    let [lowest, highest] = [&world.actions[0], &world.actions[1]];
    let half = 0.5 * (highest.speed - lowest.speed);
    let speed = if half == 0.0 { 0.0 } else { (wanted.speed - lowest.speed) / half - 1.0 };
    let within = |value: f32| value.clamp(-1.0, 1.0);
    Command { steering: within(wanted.steering / highest.steering), speed: within(speed) }
}

/// The action with the highest speed or change that is at most `speed`, the lowest if there is none; among those the
/// nearest to `steering`.
fn nearest(world: &World, steering: f32, speed: f32) -> u32 {
    // A target that is above the profile by a hundredth is taken for it.
    let above = |action: &Action| speed + 0.01 < action.speed;
    let apart = |action: &Action| [(action.speed - speed).abs(), (action.steering - steering).abs()];
    let order = |a: &Action, b: &Action| {
        let [(speed_a, steering_a), (speed_b, steering_b)] = [apart(a).into(), apart(b).into()];
        above(a).cmp(&above(b)).then(f32::total_cmp(&speed_a, &speed_b)).then(f32::total_cmp(&steering_a, &steering_b))
    };
    let best = world.actions.iter().enumerate().min_by(|(_, a), (_, b)| order(a, b));
    best.map_or(0, |(index, _)| index as u32)
}
