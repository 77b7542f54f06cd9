//! A truck that drives among cars by a rule: the policy of attard2023 steers, as if it drove at 30 km/h, and the speed
//! is what the gap ahead and that at the entry allow.

use std::sync::Arc;

use offtrack::files::cache::Loading;
use offtrack::layout::{Ended, Progress, Truck};
use offtrack::physics::seen_by_vehicles;
use offtrack::scenario::Scenario;
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::traffic::car::Outline;
use offtrack::traffic::units::{length, metres, metres_per_second};
use offtrack::traffic::{Car, Kind, Network, Row, View, outlines};
use offtrack::world::World;
use offtrack_policy::Policy;

/// Target speeds (m/s), and those from which on the next of them is taken.
pub const SPEEDS: [f32; 4] = [0.0, 10.0 / 3.6, 20.0 / 3.6, 30.0 / 3.6];
const LEVELS: [f32; 3] = [1.0, 4.0, 7.0];
const N_STEER: u32 = 9;
/// Speed that is observed as 1 (m/s).
const SPEED_SCALE: f32 = 27.8;
/// The truck stops so far before the line of cars: it swings out (m).
const STOPS_BEFORE: f32 = 4.0;
/// Time that it leaves to what comes (s).
const LAG: f32 = 4.0;
/// Braking that it plans with (m/s²), and time in which its speed control reaches a speed (s).
const BRAKING: f32 = 0.8;
const RESPONSE: f32 = 1.2;
/// Steps after which an episode of this test ends in any case.
const MOST_STEPS: usize = 4000;

/// How the episodes of some routes ended.
#[derive(Debug, Default, Clone)]
pub struct Ends {
    pub arrived: usize,
    pub met_vehicle: usize,
    pub was_met: usize,
    pub touched_kerb: usize,
    pub other: usize,
    /// Pairs of cars that overlapped, summed over steps.
    pub overlaps: usize,
    /// Steps of cars that braked by more than 4 m/s² although they still moved.
    pub hard_brakings: usize,
    /// Names of the routes on which the truck was met.
    pub met_on: Vec<String>,
    /// Cars on the roads of trucks that had not ended, summed over steps, and how many such steps there were.
    pub cars: usize,
    pub steps: usize,
    /// What all trucks did, step by step.
    pub actions: Vec<Vec<u32>>,
}

/// The benchmark attard2023-full with speeds of its own and this table `[traffic]`.
pub fn world(traffic: &str) -> (Scenario, Arc<World>) {
    let text = Scenario::text_of("attard2023-full").unwrap();
    let (one_speed, speeds) = ("speeds_kmh = [30.0]", "speeds_kmh = [0.0, 10.0, 20.0, 30.0]");
    assert!(text.contains(one_speed));
    let text = text.replace(one_speed, speeds) + "\n[traffic]\n" + traffic;
    let scenario = Scenario::parse("among-cars", &text, None, &Loading::PLAIN).unwrap();
    let world = Arc::new(World::bake(&scenario).unwrap());
    (scenario, world)
}

/// A truck for each of the world's routes, so many times.
pub fn simulator(world: &Arc<World>, times: usize, seed: u32) -> Simulator {
    let routes: Vec<u32> = (0..world.routes.len() as u32).flat_map(|route| std::iter::repeat_n(route, times)).collect();
    Simulator::new(world.clone(), routes.len(), seed, RouteChoice::Fixed(routes)).unwrap()
}

/// Drives each of the world's routes so many times.
pub fn driven(world: &Arc<World>, times: usize, seed: u32) -> Ends {
    let policy = Policy::shipped("attard2023").unwrap();
    let mut simulator = simulator(world, times, seed);
    let n = simulator.n_envs();
    let mut ends = Ends::default();
    let mut running = vec![true; n];
    for _ in 0..MOST_STEPS {
        let batch = simulator.batch();
        let alive: Vec<usize> = (0..n).filter(|&env| running[env]).collect();
        if alive.is_empty() {
            break;
        }
        let observations: Vec<_> = alive
            .iter()
            .map(|&env| {
                let mut observation = batch.observation[env];
                observation[0] = SPEEDS[3] / SPEED_SCALE;
                observation
            })
            .collect();
        let mut actions = vec![0; n];
        for (&env, steer) in alive.iter().zip(policy.act(&observations)) {
            let row = Row::of(&batch.cars[env]);
            let speed = wanted(world, &batch.truck[env], &batch.progress[env], row);
            let level = LEVELS.iter().filter(|&&from| from <= speed).count() as u32;
            actions[env] = level * N_STEER + steer;
        }
        simulator.step(&actions).unwrap();
        ends.steps += alive.len();
        ends.actions.push(actions);
        let batch = simulator.batch();
        for &env in &alive {
            let network = network(world, &batch.truck[env]);
            let row = Row::of(&batch.cars[env]);
            ends.overlaps += overlaps(network, row);
            ends.cars += row.cars.iter().filter(|car| car.is_there()).count();
            let brakes_hard = |car: &&Car| car.is_there() && car.acceleration() < -4.0 && 1.0 < car.speed();
            ends.hard_brakings += row.cars.iter().filter(brakes_hard).count();
            let ended = Ended::from_code(batch.ended[env]).unwrap();
            running[env] = ended == Ended::Running;
            match ended {
                Ended::Arrived => ends.arrived += 1,
                Ended::MetVehicle => ends.met_vehicle += 1,
                Ended::WasMet => {
                    ends.was_met += 1;
                    ends.met_on.push(world.route_names[batch.truck[env].route as usize].clone());
                }
                Ended::TractorCollided | Ended::TrailerCollided => ends.touched_kerb += 1,
                Ended::Running => {}
                _ => ends.other += 1,
            }
        }
    }
    ends
}

fn network<'a>(world: &'a World, truck: &Truck) -> &'a Network {
    let roundabout = world.routes[truck.route as usize].roundabout;
    &world.traffic.as_ref().unwrap().roads[roundabout as usize].network
}

fn overlaps(network: &Network, row: &Row) -> usize {
    let there = row.cars.iter().filter(|car| car.is_there());
    let outlines: Vec<Outline> = there.map(|car| car.outline(network)).collect();
    let pairs = (0..outlines.len()).flat_map(|one| (0..one).map(move |other| (one, other)));
    pairs.filter(|&(one, other)| outlines[one].overlaps(&outlines[other])).count()
}

/// The speed that the rule asks for (m/s).
fn wanted(world: &World, truck: &Truck, progress: &Progress, row: &Row) -> f32 {
    let network = network(world, truck);
    let view = seen_by_vehicles(world, truck, progress).unwrap();
    let cars: Vec<&Car> = row.cars.iter().filter(|car| car.is_there()).collect();
    let mut speed = SPEEDS[3];
    let stop = metres(network.paths[view.path].line) - STOPS_BEFORE - metres(view.station);
    if row.entered == 0 && must_wait(network, &view, stop, &cars) {
        let distance = stop - RESPONSE * truck.speed;
        let least = if truck.speed < 1.0 { 1.1 } else { 0.0 };
        speed = speed.min(if distance < 0.3 { 0.0 } else { (2.0 * BRAKING * distance).sqrt().max(least) });
    }
    for car in cars {
        let outline = car.outline(network);
        speed = speed.min(behind(network, &view, truck.speed, car, &outline));
        speed = speed.min(beside(&view, &outlines(world.rig(truck), truck), &outline));
    }
    speed
}

/// Whether what has entered leaves no gap to a truck that has so far to go to where it stops (m).
fn must_wait(network: &Network, view: &View, stop: f32, cars: &[&Car]) -> bool {
    let line = network.paths[view.path].line;
    let to_line = stop.max(0.0) / metres_per_second(view.speed).max(3.0);
    cars.iter().any(|car| {
        let (station, its_line) = (length(car.station()), network.paths[car.path()].line);
        let other_arm = network.source_of(car.path()).entry != network.source_of(view.path).entry;
        station > its_line
            && other_arm
            && network.zones_of(view.path, car.path()).iter().map(|zone| zone.stretch()).any(|zone| {
                let is_of_entry = (line..=line + length(14.0)).contains(&zone.a_in);
                let rear = station - length(car.length());
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
    })
}

/// Speed at which the truck can stop behind a car in its corridor (m/s).
fn behind(network: &Network, view: &View, own: f32, car: &Car, outline: &Outline) -> f32 {
    let front = metres(view.station);
    let mut speed = f32::INFINITY;
    for k in 0..16 {
        let station = front + 2.0 * k as f32;
        let (point, direction) = network.pose(view.path, station);
        if outline.distance_squared(point) < 1.65 * 1.65 {
            let along = outline.along.dot(direction).max(0.0) * car.speed();
            let gap = station - front - 3.0 - 0.8 * (own - along).max(0.0);
            let stops = (along * along + 2.0 * BRAKING * (gap - 2.5).max(0.0)).sqrt();
            speed = speed.min(if gap < 2.5 { (0.7 * along).min(along - 1.0) } else { stops });
        }
    }
    speed
}

/// Speed at which it does not sweep over a car that is not behind it (m/s).
fn beside(view: &View, now: &[Outline; 2], outline: &Outline) -> f32 {
    let is_behind = now.iter().any(|unit| (outline.middle - unit.middle).dot(unit.along) < -unit.half_length - 1.0);
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
