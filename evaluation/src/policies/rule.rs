//! Baselines among other vehicles: a shipped policy steers, as if it drove at 30 km/h, and a rule sets the speed.
//!
//! `follows` keeps behind what is ahead and off what it would sweep over, and enters blind. `yields` also waits before
//! its line until what has entered leaves it a gap: that is what a learner must beat.

use offtrack::layout::{Action, N_VALUES};
use offtrack::physics::{SPEED_SCALE, seen_by_vehicles};
use offtrack::simulator::{Actions, Batch};
use offtrack::traffic::car::Outline;
use offtrack::traffic::units::{length, metres, metres_per_second};
use offtrack::traffic::{Car, Kind, Network, Row, View};
use offtrack::world::World;
use offtrack_policy::Policy;
use rayon::prelude::*;

use super::command_for;
use crate::controller::Controller;
use crate::error::Error;

/// Name of the rule that waits for a gap.
pub const YIELDS: &str = "yields";
/// Name of the rule that does not.
pub const FOLLOWS: &str = "follows";
/// The policy that steers: the one for an empty road at one speed.
const STEERS: &str = "attard2023";
/// The speed that it is shown (m/s).
const SHOWN: f32 = 30.0 / 3.6;
/// Time that is left to what comes (s).
const LAG: f32 = 4.0;
/// A truck swings out as it enters: it stops so far before the line of cars (m).
const STOPS_BEFORE: f32 = 4.0;
/// Braking that is planned with (m/s²), and the time that the speed control takes to reach a speed (s).
const BRAKING: f32 = 0.8;
const RESPONSE: f32 = 1.2;
/// Time for which it foresees how it comes nearer to something slower (s).
const CLOSING: f32 = 0.8;
/// Speed of a truck that closes up to where it stops (m/s).
const CREEPS: f32 = 1.5;
/// Zones that begin so far behind the line are those of the entry (m).
const ENTRY: f32 = 14.0;
/// Room behind a vehicle at which a truck stands, from the front (m).
const ROOM: f32 = 5.5;
/// Points ahead of the front, 2 m apart, at which something may be in the way.
const N_AHEAD: usize = 16;
/// Half the width of the way (m).
const HALF_WIDTH: f32 = 1.65;

/// The rule and the policy that it caps in `yields:POLICY` or `follows:POLICY`.
pub fn under(name: &str) -> Option<(&str, &str)> {
    name.split_once(':').filter(|(rule, _)| [YIELDS, FOLLOWS].contains(rule))
}

/// A truck among vehicles by a rule.
#[derive(Debug)]
pub struct Rule {
    steers: Policy,
    yields: bool,
}

impl Rule {
    /// The rule of this name, `follows` or `yields`.
    ///
    /// # Errors
    ///
    /// A world without other vehicles.
    pub fn new(name: &str, world: &World) -> Result<Rule, Error> {
        Rule::named(name, world, "--policy", name)
    }

    /// The rule of this name to cap target speeds with. `setting` and `value` are what an error names.
    ///
    /// # Errors
    ///
    /// A world without other vehicles, or one whose actions state no target speeds.
    pub fn over_policies(name: &str, world: &World, setting: &'static str, value: &str) -> Result<Rule, Error> {
        if world.is_continuous() || world.params.changes_speed == 1 {
            let expected = "caps target speeds: a benchmark with actions.speeds_kmh is needed".to_owned();
            return Err(Error::Setting { name: setting, value: value.to_owned(), expected });
        }
        Rule::named(name, world, setting, value)
    }

    fn named(name: &str, world: &World, setting: &'static str, value: &str) -> Result<Rule, Error> {
        if world.traffic.is_none() {
            let expected = "drives among other vehicles: a benchmark with [traffic] is needed, as traffic2026";
            return Err(Error::Setting { name: setting, value: value.to_owned(), expected: expected.to_owned() });
        }
        Ok(Rule { steers: Policy::shipped(STEERS)?, yields: name == YIELDS })
    }

    /// The actions that trucks make where these were chosen, `[n_envs]` each. Where one is faster than the rule allows,
    /// that of the speed nearest to what it allows takes its place: at most half a level faster.
    pub fn capped(&self, world: &World, batch: &Batch, chosen: &[u32]) -> Vec<u32> {
        let capped = |(env, &index): (usize, &u32)| {
            let Action { steering, speed } = world.actions[index as usize];
            if batch.truck[env].held == 1 {
                return index;
            }
            let most = self.speed(world, batch, env);
            if speed <= most { index } else { rounded(world, &Action { steering, speed: most }) }
        };
        chosen.par_iter().enumerate().map(capped).collect()
    }

    /// The speed that the rule asks for (m/s).
    fn speed(&self, world: &World, batch: &Batch, env: usize) -> f32 {
        let (truck, row) = (&batch.truck[env], Row::of(&batch.cars[env]));
        let fastest = world.params.target_speed_max;
        let (Some(shared), Some(view)) = (&world.traffic, seen_by_vehicles(world, truck, &batch.progress[env])) else {
            return fastest;
        };
        let network = &shared.road(world, truck.route).network;
        let mut speed = fastest.min(SHOWN);
        let cars = || row.cars.iter().filter(|car| car.is_there());
        let stop = metres(network.paths[view.path].line) - STOPS_BEFORE - metres(view.station);
        if self.yields && row.entered == 0 && cars().any(|car| leaves_no_gap(network, &view, stop, car)) {
            let distance = stop - RESPONSE * truck.speed;
            let least = if truck.speed < 1.0 { CREEPS } else { 0.0 };
            speed = speed.min(if distance < 0.3 { 0.0 } else { (2.0 * BRAKING * distance).sqrt().max(least) });
        }
        for car in cars() {
            for outline in car.outlines(network) {
                speed = speed.min(behind(network, &view, truck.speed, car, &outline)).min(beside(&view, &outline));
            }
        }
        speed.max(0.0)
    }
}

impl Controller for Rule {
    fn name(&self) -> &str {
        if self.yields { YIELDS } else { FOLLOWS }
    }

    fn choose(&mut self, world: &World, batch: &Batch) -> Actions {
        let shown = |values: &[f32; N_VALUES]| {
            let mut values = *values;
            values[0] = SHOWN / SPEED_SCALE;
            values
        };
        let observations: Vec<[f32; N_VALUES]> = batch.observation.iter().map(shown).collect();
        let steered = self.steers.act(&observations);
        let wanted: Vec<Action> = (0..batch.n_envs())
            .into_par_iter()
            .map(|env| {
                let steering = self.steers.actions[steered[env] as usize].steering;
                // A held truck needs no action.
                let speed = if batch.truck[env].held == 1 { 0.0 } else { self.speed(world, batch, env) };
                let before = if world.params.changes_speed == 1 { batch.control[env].target_speed } else { 0.0 };
                Action { steering, speed: speed - before }
            })
            .collect();
        if world.is_continuous() {
            Actions::Commands(wanted.into_iter().map(|wanted| command_for(world, wanted)).collect())
        } else {
            Actions::Indices(wanted.iter().map(|wanted| rounded(world, wanted)).collect())
        }
    }
}

/// A policy that drives no faster than a rule allows.
pub struct Capped {
    policy: Box<dyn Controller>,
    rule: Rule,
    name: String,
}

impl Capped {
    /// The policy under the rule of this name, `follows` or `yields`.
    ///
    /// # Errors
    ///
    /// A world without other vehicles, or one whose actions state no target speeds.
    pub fn new(rule: &str, policy: Box<dyn Controller>, world: &World) -> Result<Capped, Error> {
        let name = format!("{rule}:{}", policy.name());
        Ok(Capped { rule: Rule::over_policies(rule, world, "--policy", &name)?, policy, name })
    }
}

impl Controller for Capped {
    fn name(&self) -> &str {
        &self.name
    }

    fn choose(&mut self, world: &World, batch: &Batch) -> Actions {
        match self.policy.choose(world, batch) {
            Actions::Indices(chosen) => Actions::Indices(self.rule.capped(world, batch, &chosen)),
            // Commands drive no world of levels.
            commands => commands,
        }
    }
}

/// The action of the nearest speed, and of those with the nearest steer angle.
fn rounded(world: &World, wanted: &Action) -> u32 {
    let apart = |action: &Action| [(action.speed - wanted.speed).abs(), (action.steering - wanted.steering).abs()];
    let order = |a: &Action, b: &Action| {
        let ([speed_a, steering_a], [speed_b, steering_b]) = (apart(a), apart(b));
        speed_a.total_cmp(&speed_b).then(steering_a.total_cmp(&steering_b))
    };
    let nearest = world.actions.iter().enumerate().min_by(|(_, a), (_, b)| order(a, b));
    nearest.map_or(0, |(index, _)| index as u32)
}

/// Whether a car that has entered leaves no gap to a truck that has so far to go to where it stops (m).
fn leaves_no_gap(network: &Network, view: &View, stop: f32, car: &Car) -> bool {
    let (line, its_line) = (network.paths[view.path].line, network.paths[car.path()].line);
    let station = length(car.station());
    let is_of_own_arm = network.source_of(car.path()).entry == network.source_of(view.path).entry;
    if station <= its_line || is_of_own_arm {
        return false;
    }
    let to_line = stop.max(0.0) / metres_per_second(view.speed).max(3.0);
    let rear = station - length(car.length());
    network.zones_of(view.path, car.path()).iter().map(|zone| zone.stretch()).any(|zone| {
        let is_of_entry = (line..=line + length(ENTRY)).contains(&zone.a_in);
        if !is_of_entry || zone.b_out + length(0.5) < rear {
            return false;
        }
        if zone.kind == Kind::Follow && zone.b_in <= station {
            return rear - zone.delta < zone.a_in + length(1.0);
        }
        let comes = metres(zone.b_in - station) / car.speed().max(4.0);
        let gone = metres(zone.b_out - rear) / car.speed().max(1.0);
        comes < LAG + to_line && to_line - 0.5 < gone
    })
}

/// Speed at which the truck can stop behind a car in its way (m/s).
fn behind(network: &Network, view: &View, own: f32, car: &Car, outline: &Outline) -> f32 {
    let front = metres(view.station);
    let at = |k: usize| front + 2.0 * k as f32;
    if 2.0 * N_AHEAD as f32 + outline.half_length < network.position(view.path, front).distance(outline.middle) - 4.0 {
        return f32::INFINITY;
    }
    let is_there = |&k: &usize| outline.distance_squared(network.position(view.path, at(k))) < HALF_WIDTH * HALF_WIDTH;
    let Some(first) = (0..N_AHEAD).find(is_there) else { return f32::INFINITY };
    let along = outline.along.dot(network.pose(view.path, at(first)).1).max(0.0) * car.speed();
    let gap = at(first) - front - ROOM - CLOSING * (own - along).max(0.0);
    if gap < 0.0 { (0.7 * along).min(along - 1.0) } else { (along * along + 2.0 * BRAKING * gap).sqrt() }
}

/// Speed at which the truck does not sweep over a car that is not behind it (m/s).
fn beside(view: &View, outline: &Outline) -> f32 {
    let is_behind =
        view.now.iter().any(|unit| (outline.middle - unit.middle).dot(unit.along) < -unit.half_length - 1.0);
    let grown =
        |unit: &Outline| Outline { half_length: unit.half_length + 0.2, half_width: unit.half_width + 0.4, ..*unit };
    let touches = |units: &[Outline]| units.iter().any(|unit| grown(unit).overlaps(outline));
    match view.later.split_at(2) {
        _ if is_behind => f32::INFINITY,
        (soon, _) if touches(soon) => 0.0,
        (_, later) if touches(later) => 2.8,
        _ => f32::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use offtrack::files::cache::Loading;
    use offtrack::layout::Ended;
    use offtrack::scenario::{Scenario, Split};
    use offtrack::simulator::{RouteChoice, Simulator};

    use super::*;
    use crate::device::Device;
    use crate::evaluation::Evaluation;

    /// The routes of 20m from its northern arm, at these demands.
    fn of_one_arm(demand: &str) -> (Scenario, Arc<World>) {
        let text = Scenario::text_of("traffic2026").unwrap();
        let text = text.replace("demand = [300.0, 900.0, 1500.0, 2100.0]", &format!("demand = [{demand}]"));
        let mut scenario = Scenario::parse("among", &text, None, &Loading::PLAIN).unwrap();
        scenario.retain(|_, route| route.name.starts_with("20m/N"));
        let world = Arc::new(World::bake(&scenario).unwrap());
        (scenario, world)
    }

    /// Ends of ten episodes on each of them.
    fn ends(name: &str, demand: &str) -> Vec<Ended> {
        let (scenario, world) = of_one_arm(demand);
        let device = Device::processor();
        let evaluation = Evaluation {
            scenario: &scenario,
            world: &world,
            split: Split::Test,
            episodes: 10,
            seed: 1,
            record: false,
            device: &device,
        };
        let driven = evaluation.drive(&mut Rule::new(name, &world).unwrap(), &mut |_, _| {}).unwrap();
        driven.episodes.iter().map(|episode| episode.ended).collect()
    }

    #[test]
    fn both_rules_arrive_on_an_empty_road_and_the_one_that_yields_among_many_vehicles() {
        let arrived = |ends: &[Ended]| ends.iter().filter(|&&ended| ended == Ended::Arrived).count();
        for name in [YIELDS, FOLLOWS] {
            let ends = ends(name, "0.0");
            assert_eq!((ends.len(), arrived(&ends)), (40, 40), "{name}: {ends:?}");
        }
        let yields = ends(YIELDS, "1500.0");
        assert!(34 <= arrived(&yields), "{yields:?}");
    }

    /// Straight on, as fast as the actions allow.
    struct Fastest;

    impl Controller for Fastest {
        fn name(&self) -> &str {
            "fastest"
        }

        fn choose(&mut self, world: &World, batch: &Batch) -> Actions {
            let fastest = Action { steering: 0.0, speed: 100.0 };
            Actions::Indices(vec![rounded(world, &fastest); batch.n_envs()])
        }
    }

    #[test]
    fn a_capped_policy_steers_as_it_would_and_drives_no_faster_than_the_rule() {
        let (_, world) = of_one_arm("1500.0");
        let routes = RouteChoice::Fixed((0..64).map(|env| env % world.routes.len() as u32).collect());
        let mut simulator = Simulator::new(world.clone(), 64, 3, routes).unwrap();
        let rule = Rule::new(YIELDS, &world).unwrap();
        let mut capped = Capped::new(YIELDS, Box::new(Fastest), &world).unwrap();
        assert_eq!(capped.name(), "yields:fastest");
        let (mut free, mut slowed) = (0, 0);
        for _ in 0..100 {
            let Actions::Indices(chosen) = capped.choose(&world, simulator.batch()) else { panic!("levels") };
            let driving = |env: &usize| simulator.batch().truck[*env].held == 0;
            for env in (0..chosen.len()).filter(driving) {
                let Action { steering, speed } = world.actions[chosen[env] as usize];
                let most = rule.speed(&world, simulator.batch(), env);
                assert_eq!(steering, 0.0);
                // Half of the 10 km/h between two levels.
                assert!(speed <= most + 1.39, "{speed} m/s where {most} are allowed");
                *if 8.0 < speed { &mut free } else { &mut slowed } += 1;
            }
            simulator.step(&chosen).unwrap();
        }
        assert!(64 < free && 64 < slowed, "{free} {slowed}");
    }

    #[test]
    fn a_policy_is_capped_by_a_rule_before_a_colon_alone() {
        assert_eq!(under("yields:runs/a:b.safetensors"), Some(("yields", "runs/a:b.safetensors")));
        assert_eq!(under("follows:traffic2026"), Some(("follows", "traffic2026")));
        assert_eq!((under("yields"), under("pursuit:x"), under("C:/policy.safetensors")), (None, None, None));
        let (_, nothing) = under("yields:").unwrap();
        let message = crate::policies::learned(nothing).unwrap_err().to_string();
        assert!(message.contains("the program comes with attard2023"), "{message}");
    }

    #[test]
    fn a_benchmark_without_vehicles_is_refused() {
        let world = World::bake(&Scenario::named("attard2023").unwrap()).unwrap();
        let message = Rule::new(YIELDS, &world).unwrap_err().to_string();
        assert!(message.contains("--policy: yields; ") && message.contains("[traffic]"), "{message}");
    }
}
