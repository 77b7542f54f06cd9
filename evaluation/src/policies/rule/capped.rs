//! A policy under a rule: of the actions that the rule allows it takes the one that the policy values most.
//!
//! Where a truck and a vehicle wait for each other, or a policy would rather stand until its time is up, the rule lets
//! go after a while: drivers take shorter gaps the longer they wait.

use glam::Vec2;
use offtrack::layout::{Action, Truck};
use offtrack::simulator::{Actions, Batch};
use offtrack::world::World;
use offtrack_policy::{Choice, Policy};
use rayon::prelude::*;

use super::{Manner, Rule};
use crate::controller::Controller;
use crate::error::Error;
use crate::placed::OnHost;

/// Time after which a truck that got no farther is impatient: the best of 5, 10 and 20 s on the validation roads of
/// traffic2026-random (s).
const PATIENCE: f32 = 10.0;
/// Whoever gets no farther than this stands (m).
const STAYS: f32 = 3.0;

/// A policy that drives no faster than a rule allows.
pub struct Capped {
    policy: OnHost,
    rule: Rule,
    name: String,
    /// Of each truck.
    stops: Vec<Stop>,
}

/// Where a truck is about to stand, and since when.
#[derive(Debug, Clone, Copy)]
struct Stop {
    episode: u32,
    step: u32,
    position: Vec2,
}

impl Stop {
    /// Before the first step of any episode.
    const NONE: Stop = Stop { episode: u32::MAX, step: 0, position: Vec2::ZERO };

    /// The stop of a truck that was about to stand here before.
    fn after(self, truck: &Truck) -> Stop {
        let position = Vec2::from(truck.position);
        if self.episode == truck.episode && self.position.distance(position) <= STAYS {
            return self;
        }
        Stop { episode: truck.episode, step: truck.steps, position }
    }
}

impl Capped {
    /// The policy under the rule of this name, `follows` or `yields`.
    ///
    /// # Errors
    ///
    /// A world without other vehicles, or one whose actions state no target speeds; a policy that cannot drive there.
    pub fn new(rule: &str, policy: Policy, world: &World) -> Result<Capped, Error> {
        let name = format!("{rule}:{}", policy.name);
        if world.is_continuous() || world.params.changes_speed == 1 {
            let expected = "caps target speeds: a benchmark with actions.speeds_kmh is needed".to_owned();
            return Err(Error::Setting { name: "--policy", value: name, expected });
        }
        policy.check(world)?;
        Ok(Capped { rule: Rule::new(rule, world)?, policy: OnHost::new(policy, Choice::Best), name, stops: Vec::new() })
    }

    /// The best action of a truck by the policy's value of each.
    fn best(&self, world: &World, batch: &Batch, env: usize, values: &[f32]) -> u32 {
        let waited = (batch.truck[env].steps - self.stops[env].step) as f32 * world.step();
        let manner = if waited < PATIENCE { Manner::Usual } else { Manner::Impatient };
        let most = self.rule.speed(world, batch, env, manner);
        let speeds = || world.actions.iter().map(|action| action.speed);
        let nearest = speeds().min_by(|a, b| (a - most).abs().total_cmp(&(b - most).abs()));
        let most = nearest.unwrap_or(0.0).max(most);
        let sets_out = manner == Manner::Impatient && speeds().any(|speed| 0.0 < speed && speed <= most);
        let is_allowed = |action: &Action| action.speed <= most && (0.0 < action.speed || !sets_out);
        let allowed = world.actions.iter().zip(values).enumerate().filter(|(_, (action, _))| is_allowed(action));
        // Of equals the first.
        let best = allowed.rev().max_by(|(_, (_, a)), (_, (_, b))| a.total_cmp(b));
        best.map_or(0, |(index, _)| index as u32)
    }
}

impl Controller for Capped {
    fn name(&self) -> &str {
        &self.name
    }

    fn choose(&mut self, world: &World, batch: &Batch) -> Actions {
        self.stops.resize(batch.n_envs(), Stop::NONE);
        self.stops.iter_mut().zip(&batch.truck).for_each(|(stop, truck)| *stop = stop.after(truck));
        let (driving, values) = self.policy.outputs(batch);
        let best = |(&env, values): (&usize, &[f32])| self.best(world, batch, env, values);
        let chosen = driving.par_iter().zip(values.par_chunks_exact(world.actions.len())).map(best).collect();
        Actions::Indices(chosen).spread(&driving, batch.n_envs())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use offtrack::simulator::{RouteChoice, Simulator};
    use offtrack_policy::{Layer, Normalisation};

    use super::super::YIELDS;
    use super::super::tests::of_one_arm;
    use super::*;

    /// The trucks of the northern arm, with so many vehicles an hour.
    fn trucks(demand: &str) -> (Arc<World>, Simulator) {
        let (_, world) = of_one_arm(demand);
        let routes = RouteChoice::Fixed((0..64).map(|env| env % world.routes.len() as u32).collect());
        let simulator = Simulator::new(world.clone(), 64, 3, routes).unwrap();
        (world, simulator)
    }

    /// A policy that values an action alike whatever it observes.
    fn valuing(world: &World, value: fn(&Action) -> f32) -> Policy {
        let n_values = offtrack::layout::N_VALUES;
        let biases: Vec<f32> = world.actions.iter().map(value).collect();
        Policy {
            name: "of a test".to_owned(),
            actions: world.actions.clone(),
            normalisation: Normalisation::none(n_values),
            layers: vec![Layer { weights: vec![0.0; n_values * biases.len()], biases }],
            ..Policy::shipped("attard2023").unwrap()
        }
    }

    fn chosen(capped: &mut Capped, world: &World, batch: &Batch) -> Vec<u32> {
        let Actions::Indices(chosen) = capped.choose(world, batch) else { panic!("levels") };
        chosen
    }

    #[test]
    fn a_capped_policy_takes_the_best_action_that_the_rule_allows() {
        let (world, mut simulator) = trucks("1500.0");
        let rule = Rule::new(YIELDS, &world).unwrap();
        let fast_and_straight = valuing(&world, |action| action.speed - action.steering.abs());
        let mut capped = Capped::new(YIELDS, fast_and_straight, &world).unwrap();
        assert_eq!(capped.name(), "yields:of a test");
        let (mut free, mut slowed) = (0, 0);
        for _ in 0..100 {
            let chosen = chosen(&mut capped, &world, simulator.batch());
            let driving = |env: &usize| simulator.batch().truck[*env].held == 0;
            for env in (0..chosen.len()).filter(driving) {
                let Action { steering, speed } = world.actions[chosen[env] as usize];
                let most = rule.speed(&world, simulator.batch(), env, Manner::Usual);
                assert_eq!(steering, 0.0);
                // Half of the 10 km/h between two levels.
                assert!((speed - most.min(25.0 / 3.6)).abs() <= 1.39, "{speed} m/s where {most} are allowed");
                *if 8.0 < speed { &mut free } else { &mut slowed } += 1;
            }
            simulator.step(&chosen).unwrap();
        }
        assert!(64 < free && 64 < slowed, "{free} {slowed}");
    }

    #[test]
    fn a_policy_that_would_rather_stand_sets_out_after_ten_seconds_where_the_rule_lets_it() {
        let (world, mut simulator) = trucks("0.0");
        let mut capped =
            Capped::new(YIELDS, valuing(&world, |action| -action.speed - action.steering.abs()), &world).unwrap();
        let mut moved = 0;
        for step in 0..160 {
            let chosen = chosen(&mut capped, &world, simulator.batch());
            let batch = simulator.batch();
            for env in (0..chosen.len()).filter(|&env| batch.truck[env].held == 0) {
                let speed = world.actions[chosen[env] as usize].speed;
                assert!(100 <= step || speed == 0.0, "step {step}: {speed}");
                moved += u32::from(0.0 < speed);
            }
            simulator.step(&chosen).unwrap();
        }
        assert!(64 <= moved, "{moved}");
    }

    #[test]
    fn an_impatient_truck_drives_where_a_patient_one_does_not_and_stands_nowhere_else() {
        let (world, mut simulator) = trucks("2100.0");
        let rule = Rule::new(YIELDS, &world).unwrap();
        let fast_and_straight = valuing(&world, |action| action.speed - action.steering.abs());
        let mut capped = Capped::new(YIELDS, fast_and_straight, &world).unwrap();
        let mut more = 0;
        for _ in 0..200 {
            for env in 0..simulator.n_envs() {
                let speed = |manner| rule.speed(&world, simulator.batch(), env, manner);
                let [usual, impatient] = [Manner::Usual, Manner::Impatient].map(speed);
                assert!(usual <= impatient, "{usual} {impatient}");
                more += u32::from(usual < impatient);
            }
            let chosen = chosen(&mut capped, &world, simulator.batch());
            simulator.step(&chosen).unwrap();
        }
        assert!(100 < more, "{more}");
    }
}
