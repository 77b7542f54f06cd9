//! Groups of trucks that share a road and its vehicles.

use std::sync::Arc;

use offtrack::files::cache::Loading;
use offtrack::layout::{Ended, N_CARS, Truck, VEHICLE_VALUES};
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{Autoreset, Begin, Engine, Error, RouteChoice, Simulator};
use offtrack::traffic::{Car, Contact, Row};
use offtrack::world::World;

use crate::{batch_on, engines};

/// The study's routes with this many trucks on each road, and vehicles.
pub fn world(group: usize) -> (Scenario, Arc<World>) {
    let text =
        Scenario::text_of("traffic2026").unwrap().replace("vans = 0.25", &format!("vans = 0.25\ngroup = {group}"));
    let scenario = Scenario::parse("groups", &text, None, &Loading::PLAIN).unwrap();
    let world = Arc::new(World::bake(&scenario).unwrap());
    (scenario, world)
}

fn drawn(scenario: &Scenario) -> RouteChoice {
    RouteChoice::Drawn(scenario.split(Split::Train).to_vec())
}

fn row(simulator: &Simulator, env: usize) -> &Row {
    Row::of(&simulator.batch().cars[env])
}

/// Cars and those that wait outside: what the trucks of a group have in common.
fn shared(simulator: &Simulator, env: usize) -> ([Car; N_CARS], [u32; 2], u32) {
    let row = row(simulator, env);
    (row.cars, row.backlog, row.level)
}

/// Why a truck's episode ended.
fn ended(simulator: &Simulator, env: usize) -> Ended {
    Ended::from_code(simulator.batch().ended[env]).unwrap()
}

#[test]
fn trucks_of_a_group_share_road_vehicles_and_episode_and_begin_in_lanes_of_their_own() {
    for (group, n_steps) in [(2, 1500), (4, 1500), (6, 600)] {
        let (scenario, world) = world(group);
        for (name, engine) in engines() {
            let n_envs = 8 * group;
            let mut simulator = batch_on(&engine, &world, n_envs, 3, drawn(&scenario));
            let (mut n_begun, mut n_waiting) = (0, 0);
            let n_steps = if name == "CPU" { n_steps } else { 200 };
            for step in 0..n_steps {
                simulator.step_at_random();
                let batch = simulator.batch().clone();
                for first in (0..n_envs).step_by(group) {
                    let trucks = &batch.truck[first..first + group];
                    let of = |truck: usize| world.routes[trucks[truck].route as usize].roundabout;
                    let running: Vec<usize> = (0..group).filter(|&truck| trucks[truck].held == 0).collect();
                    n_waiting += group - running.len();
                    assert!(!running.is_empty(), "{name}, step {step}: all wait");
                    for &truck in &running {
                        assert_eq!(of(truck), of(0));
                        assert_eq!(trucks[truck].steps, trucks[running[0]].steps);
                        assert_eq!(shared(&simulator, first + truck), shared(&simulator, first + running[0]));
                    }
                    assert!(trucks.iter().all(|truck| truck.episode == trucks[0].episode));
                    if trucks[0].steps == 0 && trucks[0].held == 0 {
                        n_begun += 1;
                        assert_eq!(running.len(), group);
                        let apart = |one: usize, other: usize| trucks[one].position.distance(trucks[other].position);
                        let least = (0..group).flat_map(|one| (0..one).map(move |other| apart(one, other)));
                        let least = least.fold(f32::INFINITY, f32::min);
                        // Four arms have a truck each before one has two.
                        assert!(if group <= 3 { 10.0 } else { 2.5 } < least, "{name}: {least} m");
                    }
                }
            }
            assert!(4 < n_begun && 100 < n_waiting, "{name}: {n_begun} {n_waiting}");
        }
    }
}

#[test]
fn trucks_that_begin_on_one_arm_do_not_stand_in_each_other() {
    let (scenario, world) = world(8);
    let place = scenario.places.iter().position(|place| place.roundabout.name == "50m").unwrap();
    let is_there = |route: &u32| world.routes[*route as usize].roundabout as usize == place;
    let routes: Vec<u32> = scenario.split(Split::Train).iter().copied().filter(is_there).collect();
    for (name, engine) in engines() {
        let n_envs = 8 * if name == "CPU" { 100 } else { 20 };
        let mut simulator = batch_on(&engine, &world, n_envs, 3, RouteChoice::Drawn(routes.clone()));
        simulator.step(&vec![4; n_envs]).unwrap();
        let ended: Vec<Ended> = (0..n_envs).map(|env| ended(&simulator, env)).collect();
        assert!(ended.iter().all(|&ended| ended == Ended::Running), "{name}: {ended:?}");
    }
}

#[test]
fn neither_threads_nor_the_size_of_the_batch_change_what_a_group_does() {
    let (scenario, world) = world(4);
    let stepped = |n_envs: usize, n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| {
            let mut simulator = Simulator::new(world.clone(), n_envs, 7, drawn(&scenario)).unwrap();
            simulator.steps_at_random(500);
            simulator
        })
    };
    let (few, many) = (stepped(8, 1), stepped(256, 2));
    for ((column, few), (_, many)) in few.batch().columns().into_iter().zip(many.batch().columns()) {
        assert!(few == &many[..few.len()], "{column:?}");
    }
}

#[test]
fn a_batch_that_is_restored_goes_on_and_states_that_no_group_can_have_are_refused() {
    let (scenario, world) = world(4);
    let mut simulator = Simulator::new(world.clone(), 16, 7, drawn(&scenario)).unwrap();
    simulator.steps_at_random(150);
    let kept = simulator.batch().clone();
    simulator.steps_at_random(200);
    let mut again = Simulator::new(world.clone(), 16, 7, drawn(&scenario)).unwrap();
    again.restore(|column| Some(kept.column(column))).unwrap();
    again.steps_at_random(200);
    assert!(again.batch().columns() == simulator.batch().columns());
    let mut apart = kept.clone();
    let other =
        world.routes.iter().position(|route| route.roundabout != world.routes[kept.truck[4].route as usize].roundabout);
    apart.truck[5].route = other.unwrap() as u32;
    let message = again.restore(|column| Some(apart.column(column))).unwrap_err().to_string();
    assert!(message.contains("truck") && message.contains("routes of one road in trucks 4..7"), "{message}");
    // Two of a group that are on their way from the same step on.
    let pairs = (0..16).flat_map(|env| (env + 1..(env / 4 + 1) * 4).map(move |mate| (env, mate)));
    let is_running = |env: usize| kept.truck[env].held == 0;
    let (env, mate) = pairs.into_iter().find(|&(env, mate)| is_running(env) && is_running(mate)).unwrap();
    let mut apart = kept.clone();
    apart.truck[mate].steps += 1;
    let message = again.restore(|column| Some(apart.column(column))).unwrap_err().to_string();
    let steps = kept.truck[env].steps;
    let expected = format!("truck[{mate}].steps: {}; must lie in {steps}..{steps}", steps + 1);
    assert!(message.contains(&expected), "{message}");
}

/// Two trucks of a group on the 20m roundabout, on routes of these names.
fn pair(routes: [&str; 2]) -> (Arc<World>, Simulator) {
    let (_, world) = world(2);
    let of = |name: &str| world.route_names.iter().position(|route| route == name).unwrap() as u32;
    let choice = RouteChoice::Fixed(routes.map(of).to_vec());
    let simulator = Simulator::new(world.clone(), 2, 1, choice).unwrap();
    (world, simulator)
}

/// Has both trucks on the arm of the first, which is straight, with so many waypoints of 2 m between them and no car
/// around.
fn put_behind(simulator: &mut Simulator, n_waypoints: usize) {
    let mut batch = simulator.batch().clone();
    let waypoints = simulator.world().route_waypoints(batch.truck[0].route);
    let route = batch.truck[0].route;
    for (env, waypoint) in [(0, n_waypoints), (1, 0)] {
        let (truck, at) = (&mut batch.truck[env], waypoints[waypoint]);
        let heading = at.direction.to_angle();
        (truck.position, truck.heading, truck.trailer_heading) = (at.position, heading, heading);
        (truck.speed, truck.route, truck.held) = (0.0, route, 0);
        batch.progress[env].waypoint = waypoint as u32 + 1;
        batch.ended[env] = Ended::Running as u32;
    }
    for cars in &mut batch.cars {
        let row = Row::of_mut(cars);
        (row.cars, row.backlog) = ([Car::NONE; N_CARS], [0; 2]);
    }
    simulator.restore(|column| Some(batch.column(column))).unwrap();
}

#[test]
fn trucks_of_a_group_observe_and_touch_each_other_until_one_has_ended() {
    let (world, mut simulator) = pair(["20m/N-left-2", "20m/E-left-3"]);
    let first_of = |name: &str| -> usize {
        VEHICLE_VALUES.iter().take_while(|values| values.name != name).map(|values| values.n).sum()
    };
    let stands = world.actions.iter().position(|action| action.speed == 0.0 && action.steering == 0.0).unwrap() as u32;
    put_behind(&mut simulator, 10);
    simulator.step(&[stands; 2]).unwrap();
    let (ahead, left) = (first_of("vehicle_ahead"), first_of("vehicle_left"));
    let behind = simulator.batch().around[1];
    // The trailer of the one ahead is nearest, then its tractor; no car is as long.
    assert_eq!(behind[first_of("vehicle")..][..3], [1.0, 1.0, 0.0]);
    let [trailer, tractor] = [60.0 * behind[ahead], 60.0 * behind[ahead + 1]];
    assert!((10.0..17.0).contains(&trailer) && (19.0..24.0).contains(&tractor), "{trailer} {tractor} m");
    assert!(behind[left].abs() < 0.02 && (0.0..0.5).contains(&behind[first_of("gap")]), "{behind:?}");
    let room = 20.0 * behind[first_of("tractor_room")];
    assert!((1.0..6.0).contains(&room), "{room} m");
    assert_eq!([0, 1].map(|env| ended(&simulator, env)), [Ended::Running; 2]);

    // It drives into the trailer ahead, which stands.
    let drives = world.actions.iter().position(|action| 8.0 < action.speed && action.steering == 0.0).unwrap() as u32;
    let contact = (0..60).find_map(|_| {
        simulator.step(&[stands, drives]).unwrap();
        (row(&simulator, 1).met != 0).then(|| [0, 1].map(|env| Contact::from_code(row(&simulator, env).met).unwrap()))
    });
    let [ahead, behind] = contact.expect("it drives into it");
    assert_eq!(
        (ahead, behind),
        (Contact { slot: N_CARS + 1, is_trucks_fault: false }, Contact { slot: N_CARS, is_trucks_fault: true },)
    );
    assert_eq!([0, 1].map(|env| ended(&simulator, env)), [Ended::WasMet, Ended::MetVehicle]);

    // A truck whose episode has ended is in nobody's way.
    put_behind(&mut simulator, 10);
    let mut batch = simulator.batch().clone();
    batch.truck[0].held = 1;
    simulator.restore(|column| Some(batch.column(column))).unwrap();
    simulator.step(&[stands; 2]).unwrap();
    let alone = simulator.batch().around[1];
    assert!(alone[first_of("vehicle")] == 0.0 && alone[first_of("gap")] == 1.0, "{alone:?}");
}

#[test]
fn cars_give_way_to_every_truck_of_a_group() {
    // The second truck alone is where cars come from the west; in rows of the first they mind it all the same.
    let (scenario, world) = world(2);
    let mut simulator = Simulator::new(world, 64, 9, drawn(&scenario)).unwrap();
    let mut by_the_other = 0;
    for _ in 0..600 {
        simulator.step_at_random();
        for first in (0..64).step_by(2) {
            let trucks = &simulator.batch().truck[first..first + 2];
            if trucks.iter().all(|truck| truck.held == 0) {
                let [own, other] = [row(&simulator, first).hindered, row(&simulator, first + 1).hindered];
                // A car slows for one of them.
                assert!(own & other == 0 || trucks[0].position.distance(trucks[1].position) < 60.0);
                by_the_other += usize::from(own == 0 && other != 0);
            }
        }
    }
    assert!(50 < by_the_other, "{by_the_other}");
}

#[test]
fn cars_that_come_to_two_trucks_at_the_same_place_decide_alike_in_the_rows_of_both() {
    let (scenario, world) = world(2);
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 128, 9, drawn(&scenario));
        simulator.set_autoreset(Autoreset::Disabled);
        for step in 0..60 {
            // One stands and one drives where the route of the first leads, each pair elsewhere on it.
            let mut batch = simulator.batch().clone();
            for first in (0..128).step_by(2) {
                let waypoints = world.route_waypoints(batch.truck[first].route);
                let place = (first / 2 * waypoints.len() / 64).min(waypoints.len() - 2);
                let at = waypoints[place];
                for (env, speed) in [(first, 0.0), (first + 1, 4.0)] {
                    let heading = at.direction.to_angle();
                    batch.truck[env] = Truck {
                        position: at.position,
                        heading,
                        trailer_heading: heading,
                        speed,
                        held: 0,
                        ..batch.truck[first]
                    };
                    batch.progress[env].waypoint = place as u32 + 1;
                    batch.ended[env] = Ended::Running as u32;
                    Row::of_mut(&mut batch.cars[env]).met = 0;
                }
            }
            simulator.restore(|column| Some(batch.column(column))).unwrap();
            simulator.step_at_random();
            for first in (0..128).step_by(2) {
                assert_eq!(shared(&simulator, first), shared(&simulator, first + 1), "{name}, step {step}, {first}");
            }
        }
    }
}

#[test]
fn episodes_of_a_group_begin_when_all_have_ended_as_the_autoreset_says() {
    let (scenario, world) = world(2);
    for (name, engine) in engines() {
        for autoreset in [Autoreset::SameStep, Autoreset::NextStep, Autoreset::Disabled] {
            let mut simulator = batch_on(&engine, &world, 16, 5, drawn(&scenario));
            simulator.set_autoreset(autoreset);
            let (mut n_begun, mut before) = (0, simulator.batch().truck.clone());
            for _ in 0..400 {
                simulator.step_at_random();
                let now = simulator.batch().truck.clone();
                for first in (0..16).step_by(2) {
                    let held = |trucks: &[offtrack::layout::Truck]| [trucks[first].held, trucks[first + 1].held];
                    let begins = now[first].episode != before[first].episode;
                    n_begun += usize::from(begins);
                    match autoreset {
                        Autoreset::SameStep => assert!(held(&now) != [1, 1]),
                        Autoreset::NextStep => assert_eq!(begins, held(&before) == [1, 1]),
                        Autoreset::Disabled => assert!(!begins),
                    }
                    // With NextStep the step in which an episode begins is none.
                    assert!(!begins || autoreset != Autoreset::NextStep || simulator.batch().reward[first] == 0.0);
                }
                before = now;
            }
            assert_eq!(0 < n_begun, autoreset != Autoreset::Disabled, "{name}, {autoreset:?}: {n_begun}");
        }
    }
}

#[test]
fn trucks_of_a_group_are_begun_together_and_on_routes_that_go_together() {
    let (world, mut simulator) = pair(["20m/N-left-2", "20m/E-left-3"]);
    let of = |name: &str| world.route_names.iter().position(|route| route == name).map(|route| route as u32);
    let begin = |env: usize, route: Option<u32>| Begin { env, route, ..Begin::default() };
    let error = simulator.begin(&[begin(1, None)]).unwrap_err();
    assert_eq!(error, Error::PartOfGroup { env: 0, group: 2 });
    let error = simulator.begin(&[begin(0, of("20m/N-left-2")), begin(1, of("20m/N-left-4"))]).unwrap_err();
    assert_eq!(error, Error::SharedLane { first: 0, other: 1 });
    let error = simulator.begin(&[begin(0, of("20m/N-left-2")), begin(1, of("40m/E-left-1"))]).unwrap_err();
    assert_eq!(error, Error::SplitRoads { first: 0, other: 1, roads: ["20m", "40m"].map(str::to_owned) });
    simulator.begin(&[begin(0, of("20m/N-right-2")), begin(1, of("20m/N-left-4"))]).unwrap();
    assert_eq!(simulator.batch().truck[1].route, of("20m/N-left-4").unwrap());
}

#[test]
fn trucks_of_a_group_that_are_begun_on_one_arm_stand_on_their_lanes_centres_beside_each_other() {
    let (_, world) = world(2);
    let of = |name: &str| world.route_names.iter().position(|route| route == name).map(|route| route as u32);
    let all = RouteChoice::Drawn((0..world.routes.len() as u32).collect());
    let off_lane = |simulator: &Simulator| {
        let distances = simulator.batch().progress.iter().map(|progress| progress.lane_distance);
        distances.fold(0.0f32, f32::max)
    };
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 128, 3, all.clone());
        for (routes, are_beside) in
            [(["16m/N-left-2", "16m/N-right-1"], true), (["16m/N-left-2", "16m/E-right-1"], false)]
        {
            let begin = |env: usize| Begin { env, route: of(routes[env % 2]), ..Begin::default() };
            simulator.begin(&(0..128).map(begin).collect::<Vec<_>>()).unwrap();
            assert_eq!(off_lane(&simulator) < 0.05, are_beside, "{name}: {} m", off_lane(&simulator));
            simulator.step(&[4; 128]).unwrap();
            let ended = (0..128).filter(|&env| ended(&simulator, env) != Ended::Running).count();
            assert_eq!(ended, 0, "{name}: {routes:?}");
        }
    }
}

#[test]
fn what_groups_cannot_do_is_refused_by_what_would_do() {
    let (scenario, world) = world(4);
    let new = |n_envs, choice| Simulator::new(world.clone(), n_envs, 1, choice).map(|_| ()).unwrap_err();
    assert_eq!(new(6, drawn(&scenario)), Error::SplitGroup { n_envs: 6, group: 4 });
    let of_one_arm = world.route_names.iter().enumerate().filter(|(_, name)| name.starts_with("20m/N"));
    let message = new(4, RouteChoice::Drawn(of_one_arm.map(|(route, _)| route as u32).collect())).to_string();
    assert!(
        message.contains("begin in 2 of the lanes of 20m;") && message.contains("a group of 4 trucks"),
        "{message}"
    );
    let mut simulator = Simulator::new(world.clone(), 4, 1, drawn(&scenario)).unwrap();
    assert_eq!(simulator.gather(&[0, 0]).unwrap_err(), Error::NotInGroups { what: "gather", group: 4 });
    let parsed = |old: &str, new: &str| {
        let text = Scenario::text_of("traffic2026").unwrap().replace(old, new);
        Scenario::parse("groups", &text, None, &Loading::PLAIN).map(|_| ()).unwrap_err().to_string()
    };
    for group in ["0", "9"] {
        let message = parsed("vans = 0.25", &format!("vans = 0.25\ngroup = {group}"));
        assert!(message.contains(&format!("traffic.group: {group}; must lie in 1..8")), "{message}");
    }
    let message = parsed("vans = 0.25", "vans = 0.25\ngroup = 2\n\n[start]\nalong = 0.5");
    assert!(message.contains("start.along: 0.5") && message.contains("traffic.group"), "{message}");
}

/// What decides whether a batch on a device is where that on the CPU is.
fn moments(simulator: &Simulator) -> Vec<[u32; 4]> {
    simulator.batch().truck.iter().map(|truck| [truck.route, truck.episode, truck.steps, truck.held]).collect()
}

#[test]
fn groups_begin_alike_on_either_engine_and_most_are_in_the_same_step_of_their_episodes_after_a_hundred() {
    let (scenario, world) = world(4);
    let mut cpu = batch_on(&Engine::Cpu, &world, 256, 11, drawn(&scenario));
    for (name, engine) in engines() {
        let mut device = batch_on(&engine, &world, 256, 11, drawn(&scenario));
        assert_eq!(moments(&cpu), moments(&device), "{name}");
        let alike = |here: &Simulator, there: &Simulator| {
            (0..256).filter(|&env| shared(here, env) == shared(there, env)).count()
        };
        assert!(254 <= alike(&cpu, &device), "{name}: {}", alike(&cpu, &device));
        let largest = |here: &Simulator, there: &Simulator| {
            let values = here.batch().around.iter().flatten().zip(there.batch().around.iter().flatten());
            values.filter(|(here, there)| 1e-3 < (*here - *there).abs()).count()
        };
        assert!(largest(&cpu, &device) < 256 * 42 / 500, "{name}");
        if name != "CPU" {
            for _ in 0..100 {
                cpu.step_at_random();
                device.step_at_random();
            }
            let (here, there) = (moments(&cpu), moments(&device));
            let same = here.iter().zip(&there).filter(|(here, there)| here == there).count();
            println!("{same} of 256 trucks in the same step of the same episode");
            assert!(256 * 8 < 10 * same, "{name}: {same}");
        }
    }
}
