//! Other vehicles around the trucks of a batch.

use std::fs;
use std::sync::Arc;

use offtrack::files::cache::Loading;
use offtrack::layout::shared::Named;
use offtrack::layout::{Column, Ended, N_AROUND, N_VALUES, VEHICLE_VALUES};
use offtrack::physics::seen_by_vehicles;
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::traffic::units::metres;
use offtrack::traffic::{Car, Contact, ENTERED_BEFORE, Row};
use offtrack::world::World;

use crate::left_hand;

/// The world of `attard2023` with a table `[traffic]`.
pub fn with_traffic(keys: &str) -> (Scenario, Arc<World>) {
    let text = Scenario::text_of("attard2023").unwrap() + "\n[traffic]\n" + keys;
    let scenario = Scenario::parse("traffic", &text, None, &Loading::PLAIN).unwrap();
    let world = Arc::new(World::bake(&scenario).unwrap());
    (scenario, world)
}

fn rows(simulator: &Simulator) -> Vec<Row> {
    simulator.batch().cars.iter().map(|words| *Row::of(words)).collect()
}

#[test]
fn a_batch_without_vehicles_has_no_rows_of_them() {
    let (scenario, world) = super::benchmark("attard2023");
    let choice = RouteChoice::Drawn(scenario.split(Split::Train).to_vec());
    let simulator = Simulator::new(Arc::new(world), 8, 1, choice).unwrap();
    assert!(simulator.batch().column(Column::Cars).is_empty());
    assert_eq!(simulator.bytes(), 8 * 1044);
}

#[test]
fn vehicles_drive_alike_whatever_the_batch_and_the_threads_and_restored_ones_go_on() {
    let keys = "demand = [900, 1500]\nvans = 0.25\nrude = [0.0, 0.3]\n";
    for more in ["", "buses = 0.05\nrigid_trucks = 0.1\ntractor_trailers = 0.1\n"] {
        assert_drive_alike(&format!("{keys}{more}"));
    }
}

fn assert_drive_alike(keys: &str) {
    let (scenario, world) = with_traffic(keys);
    let routes = scenario.split(Split::Train).to_vec();
    let stepped = |n_envs: usize, n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| {
            let choice = RouteChoice::Drawn(routes.clone());
            let mut simulator = Simulator::new(world.clone(), n_envs, 3, choice).unwrap();
            simulator.steps_at_random(300);
            simulator
        })
    };
    let (few, mut many) = (stepped(5, 1), stepped(64, 2));
    assert_eq!(rows(&few), rows(&many)[..5]);
    assert!(rows(&many).iter().map(|row| row.cars.iter().filter(|car| car.is_there()).count()).sum::<usize>() > 200);
    let kept = many.batch().clone();
    many.steps_at_random(50);
    let mut again = stepped(64, 1);
    again.steps_at_random(10);
    let of = |column: Column| Some(kept.column(column));
    again.restore(of).unwrap();
    again.steps_at_random(50);
    assert_eq!(rows(&again), rows(&many));
}

#[test]
fn in_a_million_steps_at_random_every_number_stays_finite_and_who_is_at_fault_decides_the_end() {
    let (scenario, world) = with_traffic("demand = [1500, 2100]\nvans = 0.25\nrude = [0.0, 0.3]\n");
    let routes = scenario.split(Split::Train).to_vec();
    let mut simulator = Simulator::new(world.clone(), 512, 5, RouteChoice::Drawn(routes)).unwrap();
    let (mut met, mut was_met) = (0, 0);
    for step in 0..2000 {
        simulator.steps_at_random(1);
        let batch = simulator.batch();
        for env in 0..512 {
            let ended = Ended::from_code(batch.ended[env]).unwrap();
            let failure = batch.terms[env].failure;
            match ended {
                Ended::MetVehicle => (met, _) = (met + 1, assert_eq!(failure, 1.0)),
                Ended::WasMet => (was_met, _) = (was_met + 1, assert_eq!(failure, 0.0)),
                _ => {}
            }
            let row = Row::of(&batch.cars[env]);
            let entered = row.entered <= batch.truck[env].steps;
            assert!(entered && row.hindered >> row.cars.len() == 0, "truck {env}, step {step}");
            // A contact that ended nothing would go on.
            assert!(ended != Ended::Running || row.met == 0, "truck {env}, step {step}");
        }
        if step % 100 == 0 {
            let is_finite = batch.observation.iter().flatten().chain(&batch.reward).all(|value| value.is_finite());
            assert!(is_finite, "step {step}");
        }
    }
    assert!(20 < met && 2 < was_met, "{met} {was_met}");
}

#[test]
fn an_episode_has_rude_drivers_by_its_own_fraction_among_those_who_are_there_and_those_who_come() {
    let fractions = |keys: &str| {
        let (scenario, world) = with_traffic(keys);
        let choice = RouteChoice::Fixed(scenario.split(Split::Train).repeat(12));
        let n = choice.routes().len();
        let mut simulator = Simulator::new(world, n, 3, choice).unwrap();
        let of = |simulator: &Simulator| -> Vec<f64> {
            let fraction = |row: &Row| {
                let there = row.cars.iter().filter(|car| car.is_there());
                let n_rude = there.clone().filter(|car| car.is_rude()).count();
                (3 < there.clone().count()).then(|| n_rude as f64 / there.count() as f64)
            };
            rows(simulator).iter().filter_map(fraction).collect()
        };
        let first = of(&simulator);
        simulator.steps_at_random(200);
        [first, of(&simulator)]
    };
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    for [first, later] in
        [fractions("demand = [1500]\nrude = 0.3\n"), fractions("demand = [1500]\nrude = [0.0, 0.6]\n")]
    {
        assert!(
            (mean(&first) - 0.3).abs() < 0.04 && (mean(&later) - 0.3).abs() < 0.05,
            "{} {}",
            mean(&first),
            mean(&later)
        );
    }
    let [none, nor_later] = fractions("demand = [1500]\n");
    assert_eq!((mean(&none), mean(&nor_later)), (0.0, 0.0));
    let [all, also_later] = fractions("demand = [1500]\nrude = 1.0\n");
    assert_eq!((mean(&all), mean(&also_later)), (1.0, 1.0));
}

#[test]
fn no_episode_begins_behind_a_vehicle_that_the_truck_could_not_stop_for() {
    let (scenario, world) = with_traffic("demand = [2100]\n");
    let choice = RouteChoice::Fixed(scenario.split(Split::Train).repeat(12));
    let simulator = Simulator::new(world.clone(), choice.routes().len(), 3, choice).unwrap();
    let traffic = world.traffic.as_ref().unwrap();
    let mut n_on_lane = 0;
    for (env, row) in rows(&simulator).iter().enumerate() {
        let (truck, progress) = (&simulator.batch().truck[env], &simulator.batch().progress[env]);
        let network = &traffic.road(&world, truck.route).network;
        let view = seen_by_vehicles(&world, truck, progress).unwrap();
        let source = network.paths[view.path].source;
        let of_lane = row.cars.iter().filter(|car| car.is_there() && network.paths[car.path()].source == source);
        for car in of_lane {
            let room = car.station() - car.length() - metres(view.station);
            // From 30 km/h at 1.5 m/s² it takes 23 m to stop.
            let stops = (truck.speed * truck.speed - car.speed() * car.speed()).max(0.0) / 3.0;
            assert!(6.99 + stops <= room || room < -16.0, "{room} m, {stops} m to stop");
            n_on_lane += 1;
        }
    }
    assert!(200 < n_on_lane, "{n_on_lane}");
}

#[test]
fn hindrance_is_rewarded_by_how_hard_vehicles_brake_for_the_truck_and_by_nothing_else() {
    let [(scenario, without), (_, with)] =
        ["", "hindrance = -2.0\n"].map(|key| with_traffic(&format!("demand = [1500]\n{key}")));
    let choice = RouteChoice::Drawn(scenario.split(Split::Train).to_vec());
    let [mut one, mut other] = [without, with].map(|world| Simulator::new(world, 128, 3, choice.clone()).unwrap());
    let (mut n_hindered, mut n_standing) = (0, 0);
    for _ in 0..150 {
        one.steps_at_random(1);
        other.steps_at_random(1);
        for env in 0..128 {
            // Where an episode has ended the cars are those of the next.
            if one.batch().ended[env] != Ended::Running as u32 {
                continue;
            }
            let row = Row::of(&one.batch().cars[env]);
            assert_eq!(row, Row::of(&other.batch().cars[env]));
            let hindered = row.cars.iter().enumerate().filter(|(slot, _)| row.hindered >> slot & 1 == 1);
            let hard = hindered.filter(|(_, car)| car.acceleration() < -2.0);
            let (driving, standing): (Vec<_>, Vec<_>) = hard.partition(|(_, car)| 0.0 < car.speed());
            let beyond: f32 = driving.iter().map(|(_, car)| -car.acceleration() - 2.0).sum();
            n_standing += standing.len();
            let expected = one.batch().reward[env] - 2.0 * beyond;
            assert!((other.batch().reward[env] - expected).abs() < 1e-3, "{expected}");
            n_hindered += usize::from(0.0 < beyond);
        }
    }
    // What stands before the truck costs nothing.
    assert!(20 < n_hindered && 20 < n_standing, "{n_hindered} {n_standing}");
}

#[test]
fn vehicles_around_a_truck_on_a_left_hand_road_are_those_of_its_mirror_image_to_the_last_bit() {
    let folder = tempfile::tempdir().unwrap();
    let driven = [left_hand::text("16m-maps"), left_hand::left_hand(&left_hand::text("16m-maps"))].map(|text| {
        left_hand::world(folder.path(), &text, "drivable");
        let file = folder.path().join("benchmark.toml");
        let benchmark = fs::read_to_string(&file).unwrap() + "[traffic]\ndemand = [1200]\nrude = [0.0, 0.3]\n";
        fs::write(&file, benchmark).unwrap();
        let scenario = Scenario::read(&file).unwrap();
        let world = Arc::new(World::bake(&scenario).unwrap());
        let choice = RouteChoice::Drawn(scenario.split(Split::Train).to_vec());
        let mut simulator = Simulator::new(world, 128, 7, choice).unwrap();
        simulator.steps_at_random(200);
        simulator.batch().columns().map(|(_, column)| column.to_vec())
    });
    assert!(driven[0] == driven[1]);
}

#[test]
fn a_truck_that_drives_into_the_car_before_it_ends_by_its_fault_and_one_behind_a_faster_car_drives_on() {
    let (scenario, world) = with_traffic("demand = [0]\n");
    let choice = RouteChoice::Fixed(vec![scenario.split(Split::Train)[0]]);
    let traffic = world.traffic.as_ref().unwrap();
    // The truck drives straight on at 30 km/h on its approach; a car stands before it, or drives away from it.
    let ended = |station: f32, speed: f32, steps: usize| {
        let mut simulator = Simulator::new(world.clone(), 1, 1, choice.clone()).unwrap();
        let row = *Row::of(&simulator.batch().cars[0]);
        assert!(row.cars.iter().all(|car| !car.is_there()));
        let path = traffic.routes[simulator.batch().truck[0].route as usize].path;
        let car = Car {
            station: (station * 1_048_576.0) as i32,
            speed: (speed * 52_428.8) as i32,
            what: path,
            acceleration: 0,
        };
        let mut cars = row;
        cars.cars[4] = car;
        let kept = simulator.batch().clone();
        let words: Vec<u8> = bytemuck::bytes_of(&cars).to_vec();
        simulator.restore(|column| Some(if column == Column::Cars { &words } else { kept.column(column) })).unwrap();
        for _ in 0..steps {
            simulator.step(&[4]).unwrap();
            if simulator.batch().ended[0] != Ended::Running as u32 {
                break;
            }
        }
        let met = Row::of(&simulator.batch().cars[0]).met;
        (Ended::from_code(simulator.batch().ended[0]).unwrap(), Contact::from_code(met).map(|contact| contact.slot))
    };
    assert_eq!(ended(30.0, 0.0, 40), (Ended::MetVehicle, Some(4)));
    assert_eq!(ended(45.0, 9.0, 5), (Ended::Running, None));
}

#[test]
fn a_benchmark_with_a_bad_key_of_traffic_is_refused_by_key_and_value() {
    let text = Scenario::text_of("attard2023").unwrap();
    for (keys, expected) in [
        ("demand = [-1]", "traffic.demand[0]: -1 veh/h"),
        ("demand = []", "traffic.demand: 0"),
        ("demand = [300]\nvans = 2.0", "traffic.vans: 2"),
        ("demand = [300]\nbuses = -0.1", "traffic.buses: -0.1"),
        ("demand = [300]\ntractor_trailers = 1.5", "traffic.tractor_trailers: 1.5"),
        ("demand = [300]\nvans = 0.6\nbuses = 0.5", "traffic.vans and larger vehicles together: 1.1"),
        ("demand = [300]\ndrivers = \"drunk\"", "unknown variant `drunk`"),
        ("demand = [300]\nrude = [0.3, 0.1]", "traffic.rude: [0.3, 0.1]"),
        ("demand = [300]\nrude = \"x\"", "must be a number or [least, greatest]"),
        ("demand = [300]\nwaiting = -5", "traffic.waiting: -5 s"),
        ("demand = [300]\nhindrance = 1e7", "traffic.hindrance: 1"),
        ("demand = [300]\n[time]\nstep = 0.05", "time.step: 0.05 s"),
        ("demand = [300]\nlorries = 1", "lorries"),
    ] {
        let text = format!("{text}\n[traffic]\n{keys}\n");
        let error = Scenario::parse("traffic", &text, None, &Loading::PLAIN).unwrap_err().to_string();
        assert!(error.contains(expected), "{keys}: {error}");
    }
}

#[test]
fn what_is_observed_of_vehicles_is_a_column_of_values_in_their_ranges_that_a_reset_replaces() {
    let (scenario, world) = with_traffic("demand = [1500]\n[observation]\nvehicles = true\n");
    assert!(world.observes_vehicles() && world.observation_layout().n_values() == N_VALUES + N_AROUND);
    let choice = RouteChoice::Drawn(scenario.split(Split::Train).to_vec());
    let mut simulator = Simulator::new(world, 64, 5, choice).unwrap();
    let lows: Vec<f32> = VEHICLE_VALUES.iter().flat_map(|group| std::iter::repeat_n(group.low, group.n)).collect();
    let (mut ended, mut varied) = (0, [false; N_AROUND]);
    let first = simulator.batch().around[0];
    assert_eq!(simulator.batch().around, simulator.batch().next_around);
    for _ in 0..150 {
        simulator.steps_at_random(1);
        let batch = simulator.batch();
        for env in 0..64 {
            let ends = batch.ended[env] != 0;
            assert_eq!(batch.around[env] != batch.next_around[env], ends, "truck {env}");
            ended += usize::from(ends);
            for (index, value) in batch.around[env].into_iter().chain(batch.next_around[env]).enumerate() {
                let index = index % N_AROUND;
                assert!((lows[index]..=1.0).contains(&value), "value {index}: {value}");
                varied[index] |= value != first[index];
            }
        }
    }
    assert!(100 < ended && varied.iter().all(|&varied| varied), "{ended} {varied:?}");
}

#[test]
fn vehicles_that_are_not_observed_leave_zeros_and_change_nothing_else() {
    let worlds =
        [false, true].map(|observed| with_traffic(&format!("demand = [900]\n[observation]\nvehicles = {observed}\n")));
    let [unseen, seen] = worlds.map(|(scenario, world)| {
        let choice = RouteChoice::Drawn(scenario.split(Split::Train).to_vec());
        let mut simulator = Simulator::new(world, 16, 5, choice).unwrap();
        simulator.steps_at_random(100);
        simulator
    });
    assert!(unseen.batch().around.iter().flatten().all(|&value| value == 0.0) && unseen.batch().around.len() == 16);
    for column in Column::ALL.iter().filter(|column| !matches!(column, Column::Around | Column::NextAround)) {
        assert!(unseen.batch().column(*column) == seen.batch().column(*column), "{column:?}");
    }
}

#[test]
fn vehicles_can_only_be_observed_where_there_are_some() {
    let text = Scenario::text_of("attard2023").unwrap() + "\n[observation]\nvehicles = true\n";
    let error = Scenario::parse("empty", &text, None, &Loading::PLAIN).unwrap_err().to_string();
    assert!(error.contains("observation.vehicles: true; with the table [traffic]"), "{error}");
    let mut scenario = Scenario::named("attard2023").unwrap();
    scenario.observes_vehicles = true;
    assert!(World::bake(&scenario).unwrap_err().to_string().starts_with("observes_vehicles: true; with traffic"));
}

#[test]
fn a_truck_that_begins_beyond_its_line_has_not_just_entered_and_goes_on_from_there() {
    let text = Scenario::text_of("attard2023").unwrap() + "\n[start]\nalong = 0.9\n\n[traffic]\ndemand = [900]\n";
    let scenario = Scenario::parse("along", &text, None, &Loading::PLAIN).unwrap();
    let world = Arc::new(World::bake(&scenario).unwrap());
    let choice = RouteChoice::Drawn(scenario.split(Split::Train).to_vec());
    let mut simulator = Simulator::new(world, 256, 3, choice).unwrap();
    simulator.steps_at_random(1);
    let entered = |simulator: &Simulator| rows(simulator).iter().map(|row| row.entered).collect::<Vec<u32>>();
    let first = entered(&simulator);
    let n_before = first.iter().filter(|&&entered| entered == ENTERED_BEFORE).count();
    assert!(50 < n_before && first.iter().all(|&entered| [0, ENTERED_BEFORE].contains(&entered)), "{n_before}");
    // In its second step it is a long time ago, and a state with it is one.
    assert!(30 <= 2u32.wrapping_sub(ENTERED_BEFORE));
    let kept = simulator.batch().clone();
    simulator.restore(|column| Some(kept.column(column))).unwrap();
    assert_eq!(entered(&simulator), first);
}

#[test]
fn a_large_vehicle_in_the_state_of_a_world_that_has_none_is_refused() {
    let (scenario, world) = with_traffic("demand = [1500]\n");
    let choice = RouteChoice::Drawn(scenario.split(Split::Train).to_vec());
    let mut simulator = Simulator::new(world, 8, 3, choice).unwrap();
    let kept = simulator.batch().clone();
    let mut cars = kept.cars.clone();
    let slot = Row::of(&cars[2]).cars.iter().position(Car::is_there).unwrap();
    // A bus, by the upper bits of its style.
    Row::of_mut(&mut cars[2]).cars[slot].what |= 1 << 18;
    let changed = |column| Some(if column == Column::Cars { bytemuck::cast_slice(&cars) } else { kept.column(column) });
    let message = simulator.restore(changed).unwrap_err().to_string();
    assert!(message.starts_with(&format!("cars[2][{slot}].large: 1; must lie in 0..0")), "{message}");
}
