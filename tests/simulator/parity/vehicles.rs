//! The vehicles around trucks on the device against those on the CPU: to the last bit, but for those that slow for a
//! truck, whose ground is in floats.

use std::sync::Arc;

use offtrack::engine::stages::Stage;
use offtrack::layout::random::{index_below, words};
use offtrack::layout::{Column, Ended, N_CARS};
use offtrack::simulator::{Batch, Engine, RouteChoice, Simulator};
use offtrack::traffic::units::{length, speed};
use offtrack::traffic::{Car, LargeTables, Network, Row};
use offtrack::world::{Traffic, World};

use super::states::put;
use crate::batch_on;
use crate::on_device::engine;
use crate::traffic::with_traffic;

pub const N_ENVS: usize = 512;
/// Steps from each state: cars come and leave.
const STEPS: usize = 40;

/// Trucks begin anywhere along their routes.
fn world() -> Arc<World> {
    let keys = "demand = [900, 2100]\nvans = 0.25\nrude = [0.0, 0.3]\ncourtesy = 0.3\nhindrance = -2.0\n";
    let mut world = World::clone(&with_traffic(&format!("{keys}drivers = \"distracted\"\n")).1);
    world.params.start_along = 1.0;
    Arc::new(world)
}

/// The same with buses, rigid trucks and tractor-trailers among them.
pub fn large_world() -> Arc<World> {
    let keys = "vans = 0.2\nrude = 0.1\nbuses = 0.1\nrigid_trucks = 0.1\ntractor_trailers = 0.2\n[observation]\n";
    let mut world = World::clone(&with_traffic(&format!("demand = [900, 2100]\n{keys}vehicles = true\n")).1);
    world.params.start_along = 1.0;
    Arc::new(world)
}

fn on(engine: &Engine, world: &Arc<World>) -> Simulator {
    batch_on(engine, world, N_ENVS, 11, RouteChoice::Drawn((0..world.routes.len() as u32).collect()))
}

pub fn simulators(world: &Arc<World>) -> [Simulator; 2] {
    [Engine::Cpu, engine()].map(|engine| on(&engine, world))
}

/// A device that computes with a world that is wrong in one number.
pub fn wrong_device(world: &World, change: fn(&mut World)) -> Simulator {
    let mut wrong = world.clone();
    change(&mut wrong);
    on(&engine(), &Arc::new(wrong))
}

pub fn rows(batch: &Batch) -> impl Iterator<Item = &Row> {
    batch.cars.iter().map(Row::of)
}

/// Rows that two batches have in common.
fn n_alike(here: &Batch, there: &Batch) -> usize {
    rows(here).zip(rows(there)).filter(|(here, there)| here == there).count()
}

/// Cars of all kinds anywhere, standing for any time, over one another too: what no run comes to is decided alike too.
fn anywhere(world: &World, batch: &mut Batch) {
    let traffic = world.traffic.as_ref().unwrap();
    for (env, words_of_row) in batch.cars.iter_mut().enumerate() {
        let truck = &mut batch.truck[env];
        let network = &traffic.road(world, truck.route).network;
        let (paths, styles) = (&network.paths, if network.large.is_some() { 1023 } else { 255 });
        let row = Row::of_mut(words_of_row);
        let drawn = |draw: u32| words(3, env as u32, 0, draw);
        let [level, first, second, steps] = drawn(0);
        row.level = level & 1;
        row.backlog = [first, second];
        truck.steps = 1 + (steps & 1023);
        row.entered = if level & 2 == 0 { 0 } else { truck.steps - steps % truck.steps.min(60) };
        row.hindered = 0;
        for (slot, car) in row.cars.iter_mut().enumerate() {
            let [path, at, fast, style] = drawn(slot as u32 + 1);
            if style & 7 == 0 {
                *car = Car::NONE;
                continue;
            }
            row.hindered |= (style >> 3 & 1) << slot;
            let path = index_below(path, paths.len() as u32);
            // Most are near the ring, and many stand.
            let line = paths[path as usize].line;
            let station = line + length(45.0) * (at & 0xffff).cast_signed() / 0xffff - length(20.0);
            let is_standing = fast >> 30 == 0;
            *car = Car {
                station: (station.clamp(length(20.0), paths[path as usize].length - 1) << 10)
                    + (fast & 1023).cast_signed(),
                speed: if is_standing { 0 } else { index_below(fast << 2, speed(11.0) as u32).cast_signed() << 5 },
                what: path | (style >> 8 & styles) << 10 | if is_standing { (style >> 18 & 127) << 20 } else { 0 },
                acceleration: (at >> 16).cast_signed() % 40_000 - 30_000,
            };
        }
    }
}

pub fn batch_anywhere(world: &World, simulator: &Simulator) -> Batch {
    let mut batch = simulator.batch().clone();
    anywhere(world, &mut batch);
    batch
}

/// The batch after a stage.
pub fn after(simulator: &mut Simulator, stage: Stage, from: &Batch) -> Batch {
    put(simulator, from);
    simulator.run_stage(stage);
    simulator.batch().clone()
}

/// The batch after so many steps of the vehicles alone.
fn driven(simulator: &mut Simulator, from: &Batch, steps: usize) -> Batch {
    let mut batch = from.clone();
    for _ in 0..steps {
        batch = after(simulator, Stage::Traffic, &batch);
        batch.truck.iter_mut().for_each(|truck| truck.steps += 1);
    }
    batch
}

/// Columns but these are as they were.
pub fn assert_untouched(before: &Batch, after: &Batch, written: &[Column]) {
    let untouched = before.columns().into_iter().filter(|(column, _)| !written.contains(column));
    untouched.for_each(|(column, bytes)| assert!(bytes == after.column(column), "{column:?}"));
}

#[test]
fn vehicles_without_a_truck_near_them_drive_alike_on_either_engine_to_the_last_bit_from_any_state() {
    [world(), large_world()].iter().for_each(assert_alike_without_trucks);
}

fn assert_alike_without_trucks(world: &Arc<World>) {
    let [mut cpu, mut device] = simulators(world);
    let mut before = batch_anywhere(world, &cpu);
    for (truck, progress) in before.truck.iter_mut().zip(&mut before.progress) {
        let waypoints = world.route_waypoints(truck.route);
        (truck.position, truck.speed) = (waypoints[0].position - 2000.0 * waypoints[0].direction, 0.0);
        progress.waypoint = 1;
    }
    let [here, there] = [&mut cpu, &mut device].map(|simulator| driven(simulator, &before, STEPS));
    assert_eq!(n_alike(&here, &there), N_ENVS);
    assert_eq!(n_alike(&before, &here), 0);
    assert!(rows(&here).all(|row| row.hindered == 0));
}

#[test]
fn vehicles_beside_a_truck_drive_alike_on_either_engine_but_where_its_ground_is_a_last_bit_off() {
    [world(), large_world()].iter().for_each(assert_alike_beside_trucks);
}

fn assert_alike_beside_trucks(world: &Arc<World>) {
    let [mut cpu, mut device] = simulators(world);
    let before = batch_anywhere(world, &cpu);
    let [here, there] = [&mut cpu, &mut device].map(|simulator| driven(simulator, &before, 2));
    let (mut alone, mut slowing, mut unlike, mut far, mut otherwise) = (0, 0, 0, 0, 0);
    for (here, there) in rows(&here).zip(rows(&there)) {
        assert_eq!((here.backlog, here.level, here.entered), (there.backlog, there.level, there.entered));
        for (slot, (one, other)) in here.cars.iter().zip(&there.cars).enumerate() {
            let hindered = [here, there].map(|row| row.hindered >> slot & 1);
            if hindered == [0, 0] {
                alone += 1;
                unlike += usize::from(one != other);
            } else {
                slowing += 1;
                otherwise += usize::from(hindered[0] != hindered[1]);
                // 0.01 m/s².
                far += usize::from(0.01 < (one.acceleration() - other.acceleration()).abs());
            }
        }
    }
    println!("{unlike} of {alone}; {far} and {otherwise} of {slowing}");
    assert!(10 * N_ENVS < alone && N_ENVS / 8 < slowing, "{alone} {slowing}");
    // A truck's ground differs in its last bits: seldom on which side of a limit a car is.
    assert!(1000 * unlike <= alone && 100 * far <= slowing && 100 * otherwise <= slowing);
    assert_eq!(n_alike(&before, &here), 0);
    [&here, &there].iter().for_each(|after| assert_untouched(&before, after, &[Column::Cars, Column::Truck]));
}

/// A number of the world, and a change of it.
type Off = (&'static str, fn(&mut World));

/// Numbers that are off by a unit, or by as much as something comes of it.
const OFF: [Off; 16] = [
    ("headway", |world| of_traffic(world, |traffic| traffic.rules.headway += 1)),
    ("gap", |world| of_traffic(world, |traffic| traffic.rules.gap += 1)),
    ("lag to join", |world| of_traffic(world, |traffic| traffic.rules.lags[0] += 64)),
    ("lag to cross", |world| of_traffic(world, |traffic| traffic.rules.lags[1] += 64)),
    ("lag beside", |world| of_traffic(world, |traffic| traffic.rules.soft_lags[0] += 64)),
    ("courtesy", |world| of_traffic(world, |traffic| traffic.rules.courtesy += 1 << 18)),
    ("lapses", |world| of_traffic(world, |traffic| traffic.rules.lapses += 1 << 20)),
    ("rude", |world| of_traffic(world, |traffic| traffic.rude[1] += 1 << 13)),
    ("spacing", |world| of_traffic(world, |traffic| traffic.spacing *= 1.01)),
    ("begins", |world| of_traffic(world, |traffic| traffic.routes.iter_mut().for_each(|route| route.begins += 0.5))),
    ("limit", |world| of_networks(world, |network| network.samples.iter_mut().for_each(|sample| sample.limit += 1))),
    ("line", |world| of_networks(world, |network| network.paths.iter_mut().for_each(|path| path.line += 1))),
    ("zone", |world| of_networks(world, |network| network.zones.iter_mut().for_each(|zone| zone.b[0] += 1))),
    ("shift", |world| of_networks(world, |network| network.zones.iter_mut().for_each(|zone| zone.delta += 1))),
    ("demand", |world| {
        of_traffic(world, |traffic| traffic.roads.iter_mut().for_each(|road| road.levels[1] = road.levels[0].clone()));
    }),
    ("ground of a truck", |world| world.rigs.iter_mut().for_each(|rig| rig.trailer_body.half_width += 0.05)),
];

/// The same of large vehicles.
const OFF_LARGE: [Off; 6] = [
    ("line of a large vehicle", |world| of_large(world, |large| large.lines.iter_mut().for_each(|line| line[0] += 64))),
    ("clear", |world| of_large(world, |large| large.lines.iter_mut().for_each(|line| line[1] += 4096))),
    ("fits", |world| of_large(world, |large| large.fits.fill(0))),
    ("band", |world| {
        of_large(world, |large| large.bands.iter_mut().flatten().for_each(|band| band.left += 512));
    }),
    ("trail", |world| {
        of_large(world, |large| large.trails.iter_mut().flatten().for_each(|trail| trail.offset += 512));
    }),
    ("zone of a large vehicle", |world| {
        of_large(world, |large| large.zones.iter_mut().for_each(|zone| zone.b[0] += 1))
    }),
];

fn of_large(world: &mut World, change: fn(&mut LargeTables)) {
    let roads = &mut world.traffic.as_mut().unwrap().roads;
    roads.iter_mut().for_each(|road| change(road.network.large.as_mut().unwrap()));
}

pub fn of_traffic(world: &mut World, change: fn(&mut Traffic)) {
    change(world.traffic.as_mut().unwrap());
}

pub fn of_networks(world: &mut World, change: fn(&mut Network)) {
    world.traffic.as_mut().unwrap().roads.iter_mut().for_each(|road| change(&mut road.network));
}

#[test]
fn every_number_of_the_vehicles_counts_on_the_device() {
    for (world, off) in [(world(), &OFF[..]), (large_world(), &OFF_LARGE)] {
        let mut device = on(&engine(), &world);
        let before = batch_anywhere(&world, &device);
        let right = driven(&mut device, &before, STEPS);
        for (name, change) in off {
            let wrong = driven(&mut wrong_device(&world, *change), &before, STEPS);
            assert!(n_alike(&wrong, &right) < N_ENVS, "{name}");
        }
    }
}

#[test]
fn a_truck_touches_the_same_vehicles_on_either_engine_by_the_same_fault() {
    [world(), large_world()].iter().for_each(assert_touches_alike);
}

fn assert_touches_alike(world: &Arc<World>) {
    let [mut cpu, mut device] = simulators(world);
    let before = batch_anywhere(world, &cpu);
    let here = after(&mut cpu, Stage::Collide, &before);
    let there = after(&mut device, Stage::Collide, &before);
    let n = |is: fn(u32) -> bool| rows(&here).filter(|row| is(row.met)).count();
    let (by_car, by_truck) = (n(|met| 0 < met && met < 64), n(|met| 64 < met));
    let alike = n_alike(&here, &there);
    println!("{by_car} {by_truck}, {alike} alike");
    assert!(20 < by_car && 50 < by_truck && 500 * (N_ENVS - alike) <= N_ENVS, "{by_car} {by_truck}, {alike} alike");
    [&here, &there].iter().for_each(|after| assert_untouched(&before, after, &[Column::Cars, Column::Clearance]));
    let mut wrong = wrong_device(world, |world| world.rigs[0].fifth_wheel += 1.0);
    assert!(n_alike(&here, &after(&mut wrong, Stage::Collide, &before)) < alike - 5);
}

#[test]
fn a_contact_ends_an_episode_and_hindrance_is_rewarded_alike_on_either_engine() {
    let world = world();
    let [mut cpu, mut device] = simulators(&world);
    let mut before = batch_anywhere(&world, &cpu);
    for (env, row) in before.cars.iter_mut().enumerate() {
        let [kind, slot, ..] = words(5, env as u32, 0, 0);
        Row::of_mut(row).met = match kind % 4 {
            0 => 1 + index_below(slot, N_CARS as u32),
            1 => 65 + index_below(slot, N_CARS as u32),
            _ => 0,
        };
    }
    before.clearance.iter_mut().for_each(|clearance| (clearance.tractor, clearance.trailer) = (1.0, 1.0));
    let here = after(&mut cpu, Stage::Judge, &before);
    let there = after(&mut device, Stage::Judge, &before);
    assert_eq!(here.ended, there.ended);
    assert_eq!(here.terms, there.terms);
    for ended in [Ended::MetVehicle, Ended::WasMet] {
        assert!(80 < here.ended.iter().filter(|&&code| code == ended as u32).count(), "{ended:?}");
    }
    let unlike = |there: &Batch| {
        let pairs = here.reward.iter().zip(&there.reward);
        pairs.filter(|&(here, there)| 1e-5 * here.abs().max(1.0) < (here - there).abs()).count()
    };
    assert_eq!(unlike(&there), 0);
    let written = [Column::Truck, Column::Ended, Column::Terms, Column::Reward];
    [&here, &there].iter().for_each(|after| assert_untouched(&before, after, &written));
    let mut wrong = wrong_device(&world, |world| of_traffic(world, |traffic| traffic.hindrance *= 1.001));
    assert!(N_ENVS / 2 < unlike(&after(&mut wrong, Stage::Judge, &before)));
}

#[test]
fn episodes_begin_among_the_same_vehicles_on_either_engine_and_most_go_on_so() {
    let world = world();
    let [mut cpu, mut device] = simulators(&world);
    let alike = n_alike(cpu.batch(), device.batch());
    assert!(500 * (N_ENVS - alike) <= N_ENVS, "{alike}");
    let n_cars =
        |batch: &Batch| -> usize { rows(batch).map(|row| row.cars.iter().filter(|car| car.is_there()).count()).sum() };
    assert!(3 * N_ENVS < n_cars(cpu.batch()));
    // Trucks that begin faster have fewer vehicles before them.
    let faster = wrong_device(&world, |world| world.params.start_speed += 3.0);
    assert!(n_alike(faster.batch(), device.batch()) < N_ENVS && n_cars(faster.batch()) < n_cars(device.batch()));
    for _ in 0..100 {
        cpu.step_at_random();
        device.step_at_random();
    }
    let alike = n_alike(cpu.batch(), device.batch());
    println!("{alike} of {N_ENVS} rows are alike after 100 steps");
    assert!(8 * N_ENVS < 10 * alike, "{alike}");
    let [here, there] = [&cpu, &device].map(|simulator| simulator.tally().unwrap());
    for ended in [Ended::MetVehicle, Ended::Arrived] {
        let [here, there] = [&here, &there].map(|tally| tally.sums[ended as usize]);
        assert!(0 < here && (here - there).abs() * 20 <= here + 20, "{ended:?}: {here} {there}");
    }
    assert!((here.reward() - there.reward()).abs() < 0.05 * here.reward().abs());
}
