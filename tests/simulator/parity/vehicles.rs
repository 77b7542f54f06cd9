//! The vehicles around trucks on the device against those on the CPU: to the last bit.

use std::sync::Arc;

use offtrack::engine::stages::Stage;
use offtrack::layout::random::{index_below, words};
use offtrack::simulator::{Batch, RouteChoice, Simulator};
use offtrack::traffic::units::{length, speed};
use offtrack::traffic::{Car, Row};
use offtrack::world::World;

use super::states::put;
use crate::batch_on;
use crate::on_device::engine;
use crate::traffic::with_traffic;

const N_ENVS: usize = 512;
/// Steps from each state: cars come and leave.
const STEPS: usize = 40;

fn world() -> Arc<World> {
    with_traffic("demand = [900, 2100]\nvans = 0.25\ncourtesy = 0.3\n").1
}

fn simulators(world: &Arc<World>) -> [Simulator; 2] {
    let choice = RouteChoice::Drawn((0..world.routes.len() as u32).collect());
    [offtrack::simulator::Engine::Cpu, engine()].map(|engine| batch_on(&engine, world, N_ENVS, 11, choice.clone()))
}

/// The words of all rows.
fn rows(batch: &Batch) -> &[[u32; size_of::<Row>() / 4]] {
    &batch.cars
}

/// Cars of all kinds anywhere, standing for any time, over one another too: what no run comes to is decided alike too.
fn anywhere(world: &World, batch: &mut Batch) {
    let traffic = world.traffic.as_ref().unwrap();
    for (env, words_of_row) in batch.cars.iter_mut().enumerate() {
        let route = batch.truck[env].route as usize;
        let road = &traffic.roads[world.routes[route].roundabout as usize];
        let paths = &road.network.paths;
        let row = Row::of_mut(words_of_row);
        let drawn = |draw: u32| words(3, env as u32, 0, draw);
        row.level = drawn(0)[0] & 1;
        row.backlog = [drawn(0)[1], drawn(0)[2]];
        batch.truck[env].steps = drawn(0)[3] & 1023;
        for (slot, car) in (1..).zip(&mut row.cars) {
            let [path, at, fast, style] = drawn(slot);
            if style & 7 == 0 {
                *car = Car::NONE;
                continue;
            }
            let path = index_below(path, paths.len() as u32);
            // Most are near the ring, and many stand.
            let line = paths[path as usize].line;
            let station = line + length(45.0) * (at & 0xffff).cast_signed() / 0xffff - length(20.0);
            let is_standing = fast >> 30 == 0;
            *car = Car {
                station: (station.clamp(length(7.0), paths[path as usize].length - 1) << 10)
                    + (fast & 1023).cast_signed(),
                speed: if is_standing { 0 } else { index_below(fast << 2, speed(11.0) as u32).cast_signed() << 5 },
                what: path | (style >> 8 & 1023) << 10 | if is_standing { (style >> 18 & 127) << 20 } else { 0 },
                acceleration: (at >> 16).cast_signed() % 40_000 - 30_000,
            };
        }
    }
}

/// The rows after so many steps of the vehicles alone.
fn driven(simulator: &mut Simulator, from: &Batch, steps: usize) -> Batch {
    put(simulator, from);
    let mut batch = from.clone();
    for _ in 0..steps {
        put(simulator, &batch);
        simulator.run_stage(Stage::Traffic);
        batch = simulator.batch().clone();
        batch.truck.iter_mut().for_each(|truck| truck.steps += 1);
    }
    batch
}

#[test]
fn vehicles_drive_alike_on_either_engine_to_the_last_bit_from_any_state() {
    let world = world();
    let [mut cpu, mut device] = simulators(&world);
    let mut before = cpu.batch().clone();
    anywhere(&world, &mut before);
    let (here, there) = (driven(&mut cpu, &before, STEPS), driven(&mut device, &before, STEPS));
    assert_eq!(rows(&here), rows(&there));
    // Most of them did something, and several left and came.
    let changed = rows(&before).iter().zip(rows(&here)).filter(|(before, here)| before != here).count();
    assert_eq!(changed, N_ENVS);
}

/// Numbers of the world that are off by a unit, or by as much as something comes of it.
type Off = (&'static str, fn(&mut World));

const OFF: [Off; 10] = [
    ("headway", |world| world.traffic.as_mut().unwrap().rules.headway += 1),
    ("gap", |world| world.traffic.as_mut().unwrap().rules.gap += 1),
    ("lag to join", |world| world.traffic.as_mut().unwrap().rules.lags[0] += 16),
    ("lag to cross", |world| world.traffic.as_mut().unwrap().rules.lags[1] += 16),
    ("lag beside", |world| world.traffic.as_mut().unwrap().rules.soft_lags[0] += 16),
    ("courtesy", |world| world.traffic.as_mut().unwrap().rules.courtesy += 1 << 18),
    ("limit", |world| of_network(world, |network| network.samples.iter_mut().for_each(|sample| sample.limit += 1))),
    ("line", |world| of_network(world, |network| network.paths.iter_mut().for_each(|path| path.line += 1))),
    ("zone", |world| of_network(world, |network| network.zones.iter_mut().for_each(|zone| zone.b[0] += 1))),
    ("shift", |world| of_network(world, |network| network.zones.iter_mut().for_each(|zone| zone.delta += 1))),
];

fn of_network(world: &mut World, change: fn(&mut offtrack::traffic::Network)) {
    world.traffic.as_mut().unwrap().roads.iter_mut().for_each(|road| change(&mut road.network));
}

#[test]
fn every_number_of_the_vehicles_counts_on_the_device() {
    let world = world();
    let [mut cpu, _] = simulators(&world);
    let mut before = cpu.batch().clone();
    anywhere(&world, &mut before);
    let here = driven(&mut cpu, &before, STEPS);
    for (name, change) in OFF {
        let mut wrong = World::clone(&world);
        change(&mut wrong);
        let [_, mut device] = simulators(&Arc::new(wrong));
        assert_ne!(rows(&driven(&mut device, &before, STEPS)), rows(&here), "{name}");
    }
}

#[test]
fn episodes_begin_among_the_same_vehicles_on_either_engine_and_go_on_so_for_400_steps() {
    let world = world();
    let [mut cpu, mut device] = simulators(&world);
    assert_eq!(rows(cpu.batch()), rows(device.batch()));
    let cars = |batch: &Batch| -> usize {
        batch.cars.iter().map(|row| Row::of(row).cars.iter().filter(|car| car.is_there()).count()).sum()
    };
    assert!(3 * N_ENVS < cars(cpu.batch()));
    for _ in 0..400 {
        cpu.step_at_random();
        device.step_at_random();
    }
    assert!(5 * (N_ENVS as u64) < cpu.tally().unwrap().episodes());
    assert_eq!(rows(cpu.batch()), rows(device.batch()));
}
