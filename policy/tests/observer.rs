//! The shipped policies drive through an observer as they do in the simulator.

use std::sync::Arc;

use offtrack::layout::{Ended, Truck};
use offtrack::observer::{Observer, Pose, Telemetry};
use offtrack::scenario::{Disturbances, Scenario, Split};
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::world::World;
use offtrack_policy::Policy;

/// Most steps of an episode.
const MOST_STEPS: usize = 2_000;

fn pose(observer: &Observer, truck: &Truck) -> Pose {
    Pose {
        position: observer.frame().to_map(truck.position.as_dvec2()),
        heading: truck.heading.into(),
        trailer_heading: truck.trailer_heading.into(),
        speed: truck.speed,
    }
}

#[test]
fn on_every_step_of_the_unseen_routes_an_observer_gives_a_shipped_policy_what_the_simulator_does_to_the_last_bit() {
    for name in Policy::shipped_names() {
        let policy = Policy::shipped(name).unwrap();
        if policy.reads_vehicles() {
            // An observer is told of no other vehicles.
            continue;
        }
        // That of attard2023-lane is attard2023.
        let mut scenario = Scenario::named(name.trim_end_matches("-lane")).unwrap();
        scenario.keep(&[Split::Test]);
        // An observer tells what is, of the pose that it is given.
        scenario.disturbances = Disturbances::default();
        let world = Arc::new(World::bake(&scenario).unwrap());
        policy.check(&world).unwrap();
        let n = world.routes.len();
        assert_eq!(n, 23, "{name}");
        let routes = RouteChoice::Fixed((0..n as u32).collect());
        let mut simulator = Simulator::new(world.clone(), n, 0, routes).unwrap();
        let mut observers: Vec<Observer> = Vec::new();
        for truck in &simulator.batch().truck {
            let mut observer = Observer::new(world.clone(), truck.route, truck.vehicle).unwrap();
            observer.begin(&pose(&observer, truck)).unwrap();
            observers.push(observer);
        }
        let (mut observations, mut arrived) = (0, 0);
        for _ in 0..MOST_STEPS {
            let batch = simulator.batch();
            let running: Vec<usize> = (0..n).filter(|&env| batch.truck[env].held == 0).collect();
            if running.is_empty() {
                break;
            }
            let actions = policy.act_beside(&batch.observation, &batch.extras);
            simulator.step(&actions).unwrap();
            let batch = simulator.batch();
            for env in running {
                let (truck, control) = (&batch.truck[env], &batch.control[env]);
                let (observer, place) = (&mut observers[env], format!("{name}, {}", world.route_names[env]));
                let telemetry = Telemetry {
                    steering: truck.steering,
                    target_speed: control.target_speed,
                    acceleration: truck.acceleration,
                    lateral_acceleration: truck.lateral_acceleration,
                    trailer_roll: truck.trailer_roll,
                    trailer_roll_rate: truck.trailer_roll_rate,
                    load_transfer_ratios: [truck.tractor_load_transfer_ratio, truck.trailer_load_transfer_ratio],
                };
                let at = pose(observer, truck);
                let seen = observer.observe(&at, &telemetry).unwrap();
                assert_eq!(seen.values.map(f32::to_bits), batch.next_observation[env].map(f32::to_bits), "{place}");
                assert_eq!(seen.extras.map(f32::to_bits), batch.next_extras[env].map(f32::to_bits), "{place}");
                assert_eq!((seen.clearance, seen.progress), (batch.clearance[env], batch.progress[env]), "{place}");
                assert_eq!(seen.ended as u32, batch.ended[env], "{place}");
                // Begun on the way, a truck has the waypoint before it that it had.
                let begun = observer.clone().begin(&at).unwrap();
                assert_eq!(begun.progress.waypoint, seen.progress.waypoint, "{place}");
                observations += 1;
                arrived += usize::from(seen.ended == Ended::Arrived);
            }
        }
        assert!(20 <= arrived && 2_000 < observations, "{name}: {arrived} arrived, {observations} observations");
    }
}
