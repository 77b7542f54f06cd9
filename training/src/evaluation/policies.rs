//! Who drives: a learned policy, pure pursuit of the centre line, or chance. The last two are what a learner must beat.

use std::path::PathBuf;

use offtrack::layout::{Action, Truck, WaypointRow};
use offtrack::random::{self, Draw};
use offtrack::simulator::Batch;
use offtrack::world::World;

use crate::error::Error;
use crate::files;
use crate::policy::Policy;

/// The best of 4, 5, 6, 7, 8, 9, 10 and 12 m on the training routes of attard2023 [m].
pub const PURSUIT_LOOK_AHEAD: f32 = 7.0;

/// Chooses an action for every truck of a batch.
pub trait Driver {
    /// Name for reports: the policy's file, `pursuit` or `random`.
    fn name(&self) -> &str;

    /// Writes one index into the action table a truck, `[n_envs]`.
    fn act(&mut self, world: &World, batch: &Batch, actions: &mut Vec<u32>);
}

/// The driver that a command's `--policy` names: `pursuit`, `random` or a policy's file, which must suit the world; none is the policy that
/// comes with the program for `benchmark`. `look_ahead` is pure pursuit's [m], `seed` that of chance.
pub fn named(policy: Option<&str>, benchmark: &str, look_ahead: f32, seed: u32, world: &World) -> Result<Box<dyn Driver>, Error> {
    if !(1.0..=50.0).contains(&look_ahead) {
        let value = format!("{look_ahead} m");
        return Err(Error::Flag { flag: "--look-ahead", value, expected: "must lie in 1..50 m".into() });
    }
    match policy {
        Some("pursuit") => Ok(Box::new(Pursuit { look_ahead })),
        Some("random") => Ok(Box::new(Chance { seed })),
        file => {
            let file = file.map_or_else(|| files::shipped_policy(benchmark), PathBuf::from);
            let policy = Policy::load(&file)?;
            policy.check(world, &file)?;
            Ok(Box::new(Learned { name: file.display().to_string(), policy }))
        }
    }
}

/// The action that a policy holds for best.
#[derive(Debug)]
pub struct Learned {
    /// Name for reports.
    pub name: String,
    /// The policy.
    pub policy: Policy,
}

impl Driver for Learned {
    fn name(&self) -> &str {
        &self.name
    }

    fn act(&mut self, _: &World, batch: &Batch, actions: &mut Vec<u32>) {
        *actions = self.policy.act(&batch.observation);
    }
}

/// Any action, each as likely as the next.
#[derive(Debug)]
pub struct Chance {
    /// What the actions are drawn from.
    pub seed: u32,
}

impl Driver for Chance {
    fn name(&self) -> &str {
        "random"
    }

    fn act(&mut self, world: &World, batch: &Batch, actions: &mut Vec<u32>) {
        actions.clear();
        actions.extend(batch.truck.iter().enumerate().map(|(env, truck)| {
            let [word, ..] = random::words(self.seed, env as u32, truck.episode, (Draw::Action as u32).wrapping_add(truck.steps));
            random::index_below(word, world.params.n_actions)
        }));
    }
}

/// Pure pursuit: the arc that leads the drive axle to a point of the centre line some way ahead, at the highest target speed.
///
/// R. Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm" (Carnegie Mellon, 1992). It follows the line well and knows
/// nothing of the trailer.
#[derive(Debug)]
pub struct Pursuit {
    /// Distance from the drive axle to the point pursued [m].
    pub look_ahead: f32,
}

impl Driver for Pursuit {
    fn name(&self) -> &str {
        "pursuit"
    }

    fn act(&mut self, world: &World, batch: &Batch, actions: &mut Vec<u32>) {
        actions.clear();
        actions.extend(batch.truck.iter().zip(&batch.progress).map(|(truck, progress)| {
            let waypoints = world.route_waypoints(truck.route);
            let steering = self.steering(world.params.rig.wheelbase, truck, waypoints, progress.waypoint as usize);
            nearest(&world.actions, steering, world.params.start_speed)
        }));
    }
}

impl Pursuit {
    /// Steer angle of the arc to the pursued point [rad].
    fn steering(&self, wheelbase: f32, truck: &Truck, waypoints: &[WaypointRow], next: usize) -> f32 {
        let pair = |index: usize| (waypoints[index - 1].position, waypoints[index].position);
        // The first stretch of the line that reaches far enough away; its beginning lies within the distance.
        let first = next.clamp(1, waypoints.len() - 1);
        let beyond = |&index: &usize| self.look_ahead <= truck.position.distance(waypoints[index].position);
        let index = (first..waypoints.len()).find(beyond).unwrap_or(waypoints.len() - 1);
        let (from, to) = pair(index);
        let (mut near, mut far) = (0.0f32, 1.0f32);
        // Halving finds the point at the distance on a stretch of a few metres to a millimetre.
        for _ in 0..12 {
            let middle = 0.5 * (near + far);
            if truck.position.distance(from.lerp(to, middle)) < self.look_ahead { near = middle } else { far = middle }
        }
        let ahead = from.lerp(to, far) - truck.position;
        let bearing = glam::Vec2::from_angle(-truck.heading).rotate(ahead);
        (2.0 * wheelbase * bearing.y / ahead.length_squared().max(1.0)).atan()
    }
}

/// The action that steers nearest to `steering` among those nearest to `speed`.
fn nearest(actions: &[Action], steering: f32, speed: f32) -> u32 {
    let cost = |action: &Action| (action.speed - speed).abs() * 1e3 + (action.steering - steering).abs();
    let best = actions.iter().enumerate().min_by(|(_, a), (_, b)| cost(a).total_cmp(&cost(b)));
    best.map_or(0, |(index, _)| index as u32)
}
