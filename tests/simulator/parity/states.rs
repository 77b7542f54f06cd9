//! Trucks in all kinds of states on every route of every roundabout, from which engines are compared.

use std::sync::{Arc, OnceLock};

use offtrack::field::Field;
use offtrack::layout::angle::wrapped;
use offtrack::layout::random::{index_below, signed_unit, words};
use offtrack::layout::{Action, Command, ObservedExtras, Truck};
use offtrack::map::Gutter;
use offtrack::scenario::{Disturbances, Scenario};
use offtrack::simulator::{Batch, RouteChoice, Simulator};
use offtrack::world::World;

use crate::benchmark;

/// Trucks: with routes drawn uniformly at random every roundabout has more than [`ENOUGH`].
pub const N_ENVS: usize = 28_672;
/// States that each roundabout must have.
pub const ENOUGH: usize = 4000;

/// Every route of every roundabout, with their gutters drivable or solid.
pub fn world(gutter: Gutter) -> Arc<World> {
    static WORLDS: OnceLock<[Arc<World>; 2]> = OnceLock::new();
    let worlds = WORLDS.get_or_init(|| {
        let (scenario, drivable) = benchmark("attard2023-full");
        let solid = scenario
            .places
            .iter()
            .map(|place| Field::bake(&place.roundabout.kerbs(Gutter::Solid), scenario.cell))
            .collect();
        let mut with_solid = drivable.clone();
        with_solid.fields = solid;
        [drivable, with_solid].map(Arc::new)
    });
    worlds[usize::from(gutter == Gutter::Solid)].clone()
}

/// Every route of every roundabout for trucks of many kinds, with every lag and limit.
pub fn fleet_world() -> Arc<World> {
    let mut scenario = benchmark("attard2023-full").0;
    scenario.fleet = Some(crate::fleet::all_drawn());
    scenario.extras = ObservedExtras::Oracle;
    let mut fleet = World::bake(&scenario).unwrap();
    fleet.fields = world(Gutter::Drivable).fields.clone();
    assert!(fleet.rigs.len() == 512 && fleet.rays.len() == 512);
    Arc::new(fleet)
}

/// The same where actions are commands of steer angle and speed.
pub fn continuous_world() -> Arc<World> {
    let mut world = World::clone(&fleet_world());
    world.params.n_actions = 0;
    let lock = world.rigs[0].steer_max;
    world.actions = vec![Action { steering: -lock, speed: 2.0 }, Action { steering: lock, speed: 15.0 }];
    Arc::new(world)
}

/// That where commands come late.
pub fn late_continuous_world() -> Arc<World> {
    let mut world = World::clone(&continuous_world());
    world.disturbances = disturbed_world().disturbances;
    Arc::new(world)
}

/// The same where noise, errors and delays come between a policy and the truck.
pub fn disturbed_world() -> Arc<World> {
    let disturbances = Disturbances {
        observation_delay: [0, 3],
        action_delay: [0, 3],
        // Beyond the difference that engines may have in a sample of a field.
        range_noise: 1.0,
        dropped_rays: 0.05,
        ..Scenario::named("transfer2026").unwrap().disturbances
    };
    let mut world = World::clone(&fleet_world());
    world.disturbances = (&disturbances).into();
    Arc::new(world)
}

/// Makes a simulator's columns those of `batch`.
pub fn put(simulator: &mut Simulator, batch: &Batch) {
    simulator.restore(|column| Some(batch.column(column))).unwrap();
}

/// Seed of the states.
const SEED: u32 = 23;

/// Numbers in [-1, 1) for a truck.
fn drawn(env: usize, draw: u32) -> [f32; 4] {
    words(SEED, env as u32, 0, draw).map(signed_unit)
}

/// An index below `n` for a truck.
fn picked(env: usize, draw: u32, n: usize) -> usize {
    index_below(words(SEED, env as u32, 1, draw)[0], n as u32) as usize
}

/// Before a step: a quarter of the trucks where 40 random steps have brought them, the others anywhere near their
/// routes, slow and fast, bent and leaning. On fixed routes one in sixteen is held.
pub fn varied(world: &Arc<World>, fixed: bool) -> (RouteChoice, Batch) {
    let all: Vec<u32> = (0..world.routes.len() as u32).collect();
    let mut simulator = Simulator::new(world.clone(), N_ENVS, SEED, RouteChoice::Drawn(all.clone())).unwrap();
    (0..40).for_each(|_| simulator.step_at_random());
    let mut batch = simulator.batch().clone();
    for env in 0..N_ENVS {
        if world.is_continuous() {
            let [steering, speed, ..] = drawn(env, 8);
            batch.command[env] = Command { steering, speed };
        } else {
            batch.action[env] = picked(env, 0, world.params.n_actions as usize) as u32;
        }
        if env % 4 != 0 {
            put_anywhere(world, &mut batch, env);
        }
        if fixed && env % 16 == 5 {
            batch.truck[env].held = 1;
            batch.observation[env] = batch.next_observation[env];
        }
    }
    let routes = batch.truck.iter().map(|truck| truck.route).collect();
    (if fixed { RouteChoice::Fixed(routes) } else { RouteChoice::Drawn(all) }, batch)
}

/// Puts a truck somewhere near its route.
fn put_anywhere(world: &World, batch: &mut Batch, env: usize) {
    let route = batch.truck[env].route;
    let (waypoints, previews) = (world.route_waypoints(route), world.route_previews(route));
    let last = waypoints.len() - 1;
    let kind = picked(env, 1, 16);
    let near = if kind < 2 { last } else { picked(env, 2, waypoints.len()) };
    let [aside, along, turned, bent] = drawn(env, 0);
    let [speed, steering, lean, ratio] = drawn(env, 1);
    let [roll, roll_rate, trailer_roll, trailer_roll_rate] = drawn(env, 2);
    let waypoint = &waypoints[near];
    let vehicle = picked(env, 4, world.rigs.len());
    let heading = wrapped(previews[near].heading + 0.3 * turned);
    let behind = previews[near.saturating_sub(4)].heading;
    let lean = if lean < -0.8 { 0.3 } else { 0.05 };
    batch.truck[env] = Truck {
        position: waypoint.position + 1.5 * aside * waypoint.direction.perp() + (along - 1.5) * waypoint.direction,
        heading,
        trailer_heading: wrapped(behind + if kind == 2 || kind == 5 { 2.5 * bent } else { 0.3 * bent }),
        speed: 8.0 + 8.0 * speed,
        steering: steering * world.rigs[vehicle].steer_max,
        tractor_roll: lean * roll,
        tractor_roll_rate: lean * roll_rate,
        trailer_roll: lean * trailer_roll,
        trailer_roll_rate: lean * trailer_roll_rate,
        tractor_load_transfer_ratio: ratio,
        trailer_load_transfer_ratio: -ratio,
        route,
        episode: words(SEED, env as u32, 2, 0)[0],
        steps: if kind == 3 {
            world.step_limits[(route * world.params.n_classes + world.rigs[vehicle].class_index) as usize]
        } else {
            picked(env, 3, 200) as u32
        },
        held: 0,
        acceleration: lean * ratio,
        curvature_lag: if world.rigs[vehicle].yaw_lag == 0.0 { 0.0 } else { 0.02 * bent },
        lateral_acceleration: lean,
        vehicle: vehicle as u32,
    };
    // Up to the last waypoint; one truck in sixteen has a next waypoint that is too far away.
    let far = if kind == 4 { 10 } else { 0 };
    batch.progress[env].waypoint = (near + far).clamp(1, last) as u32;
    let [integral, ..] = drawn(env, 3);
    batch.control[env].speed_error_integral = integral;
    (batch.control[env].steering_before, batch.control[env].steering_earlier) = (0.4 * speed, 0.4 * lean);
    batch.control[env].steering_earliest = 0.4 * bent;
    if world.disturbances.of_action == 1 {
        // An action's index plus 1 or a command's halves, or none yet.
        let action = |draw: u32| match picked(env, draw, world.params.n_actions as usize + 1) as u32 {
            0 if world.is_continuous() && env % 8 != 1 => 0x0001_0001 | words(SEED, env as u32, 1, draw)[1],
            action => action,
        };
        let control = &mut batch.control[env];
        (control.action_before, control.action_earlier, control.action_earliest) = (action(5), action(6), action(7));
    }
    batch.control[env].target_speed = 8.0 + 4.0 * speed;
    batch.control[env].holds = u32::from(kind == 6);
    if kind == 6 {
        // About to stand, or standing.
        batch.truck[env].speed = if steering < 0.0 { 0.0 } else { 0.02 * steering };
    }
}

/// Trucks on each roundabout.
pub fn on_each_roundabout(world: &World, batch: &Batch) -> Vec<usize> {
    let mut counts = vec![0; world.fields.len()];
    batch.truck.iter().for_each(|truck| counts[world.routes[truck.route as usize].roundabout as usize] += 1);
    counts
}
