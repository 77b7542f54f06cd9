//! Trucks driven by the rule that follows and yields, and what the cars around them do.

use std::sync::Arc;

use offtrack::files::cache::Loading;
use offtrack::layout::Ended;
use offtrack::scenario::Scenario;
use offtrack::simulator::{Actions, RouteChoice, Simulator};
use offtrack::traffic::{Car, Row, overlaps};
use offtrack::world::World;
use offtrack_evaluation::policies::Controller;
use offtrack_evaluation::policies::rule::{Rule, YIELDS};

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
    let mut rule = Rule::new(YIELDS, world).unwrap();
    let mut simulator = simulator(world, times, seed);
    let n = simulator.n_envs();
    let mut ends = Ends::default();
    let mut running = vec![true; n];
    for _ in 0..MOST_STEPS {
        let alive: Vec<usize> = (0..n).filter(|&env| running[env]).collect();
        if alive.is_empty() {
            break;
        }
        let Actions::Indices(actions) = rule.choose(world, simulator.batch()) else {
            panic!("the benchmark's actions are indices");
        };
        simulator.step(&actions).unwrap();
        ends.steps += alive.len();
        ends.actions.push(actions);
        let batch = simulator.batch();
        for &env in &alive {
            let row = Row::of(&batch.cars[env]);
            let road = world.traffic.as_ref().unwrap().road(world, batch.truck[env].route);
            ends.overlaps += overlaps(&road.network, &row.cars);
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
