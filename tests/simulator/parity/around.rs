//! What trucks observe of other vehicles on the device against the CPU: every value, but where one of two nearly equal
//! things comes first, or a front is nearly at a line.

use std::sync::Arc;

use offtrack::engine::stages::Stage;
use offtrack::layout::{Column, N_AROUND, N_NEAREST};
use offtrack::simulator::{Autoreset, Batch, Begin, Simulator};
use offtrack::traffic::{Car, Row};
use offtrack::world::World;

use super::states::put;
use super::vehicles::{
    N_ENVS, after, assert_untouched, batch_anywhere, large_world, of_networks, of_traffic, rows, simulators,
    wrong_device,
};
use crate::traffic::with_traffic;

/// Engines may differ by so much of a value's scale: positions of the middle of a crowd, in f32.
const SMALL: f32 = 1e-4;

/// Trucks that begin anywhere along their routes.
fn world() -> Arc<World> {
    let keys = "demand = [900, 2100]\nvans = 0.25\nrude = [0.0, 0.3]\n[observation]\nvehicles = true\n";
    let mut world = World::clone(&with_traffic(keys).1);
    world.params.start_along = 1.0;
    Arc::new(world)
}

type Values = [[f32; N_AROUND]];

/// Rows that differ by more than engines may.
fn n_unlike(here: &Values, there: &Values) -> usize {
    let differs = |(here, there): (&[f32; N_AROUND], &[f32; N_AROUND])| {
        here.iter().zip(there).any(|(here, there)| SMALL < (here - there).abs())
    };
    here.iter().zip(there).filter(|&pair| differs(pair)).count()
}

/// Asserts that all rows are alike but a few in a thousand.
fn assert_alike(what: &str, here: &Values, there: &Values) {
    let n = n_unlike(here, there);
    println!("{what}: {n} of {} rows", here.len());
    assert!(200 * n <= here.len(), "{what}: {n} of {} rows", here.len());
}

/// A number of the world, and a change of it.
type Off = (&'static str, fn(&mut World));

const OFF: [Off; 8] = [
    ("spacing", |world| of_traffic(world, |traffic| traffic.spacing *= 1.01)),
    ("begins", |world| of_traffic(world, |traffic| traffic.routes.iter_mut().for_each(|route| route.begins += 0.1))),
    ("line", |world| of_networks(world, |network| network.paths.iter_mut().for_each(|path| path.line += 100))),
    ("zone", |world| of_networks(world, |network| network.zones.iter_mut().for_each(|zone| zone.b[0] += 8))),
    ("shift", |world| of_networks(world, |network| network.zones.iter_mut().for_each(|zone| zone.delta += 8))),
    ("path", |world| {
        of_networks(world, |network| network.samples.iter_mut().for_each(|sample| sample.position.x += 0.1));
    }),
    ("width", |world| world.rigs.iter_mut().for_each(|rig| rig.trailer_body.half_width += 0.05)),
    ("length", |world| world.rigs.iter_mut().for_each(|rig| rig.trailer_wheelbase += 0.1)),
];

#[test]
fn what_is_observed_of_any_vehicles_is_alike_on_either_engine_and_every_number_of_it_counts() {
    let of_large = large_world();
    let [mut cpu, mut device] = simulators(&of_large);
    let before = batch_anywhere(&of_large, &cpu);
    let [here, there] = [&mut cpu, &mut device].map(|simulator| after(simulator, Stage::Observe, &before));
    assert_alike("observe large vehicles", &here.next_around, &there.next_around);
    let world = world();
    let [mut cpu, mut device] = simulators(&world);
    let before = batch_anywhere(&world, &cpu);
    let here = after(&mut cpu, Stage::Observe, &before);
    let there = after(&mut device, Stage::Observe, &before);
    assert_alike("observe", &here.next_around, &there.next_around);
    // In such crowds there is always a nearest vehicle, and a second one.
    let varies = |&index: &usize| here.next_around.iter().any(|values| values[index] != here.next_around[0][index]);
    assert!((0..N_AROUND).filter(varies).count() >= N_AROUND - N_NEAREST);
    let written = [Column::NextObservation, Column::NextExtras, Column::NextAround];
    [&here, &there].iter().for_each(|after| assert_untouched(&before, after, &written));
    for (name, change) in OFF {
        let wrong = after(&mut wrong_device(&world, change), Stage::Observe, &before);
        assert!(N_ENVS / 20 < n_unlike(&here.next_around, &wrong.next_around), "{name}");
    }
    let copied = after(&mut device, Stage::CopyObservation, &there);
    assert_eq!(copied.around, there.next_around);
}

/// What is observed after each of so many steps with random actions.
fn assert_steps_alike(world: &Arc<World>, autoreset: Autoreset) {
    let [mut cpu, mut device] = simulators(world);
    [&mut cpu, &mut device].into_iter().for_each(|simulator| simulator.set_autoreset(autoreset));
    let mut n_ended = 0;
    for step in 0..60 {
        // From the same states, so that what differs once does not differ again.
        put(&mut device, &cpu.batch().clone());
        cpu.step_at_random();
        device.step_at_random();
        let (here, there) = (cpu.batch(), device.batch());
        n_ended += here.around.iter().zip(&here.next_around).filter(|(now, next)| now != next).count();
        assert_alike(&format!("around, step {step}"), &here.around, &there.around);
        assert_alike(&format!("next_around, step {step}"), &here.next_around, &there.next_around);
    }
    assert_eq!(0 < n_ended, autoreset == Autoreset::SameStep, "{n_ended}");
}

#[test]
fn what_is_observed_of_vehicles_after_a_step_and_a_reset_is_alike_on_either_engine() {
    let world = world();
    assert_steps_alike(&world, Autoreset::SameStep);
    assert_steps_alike(&world, Autoreset::NextStep);
    let mut disturbed = World::clone(&world);
    disturbed.disturbances = super::states::disturbed_world().disturbances;
    assert_steps_alike(&Arc::new(disturbed), Autoreset::Disabled);
}

/// A batch of which some trucks have begun again.
fn begun(simulator: &mut Simulator, from: &Batch) -> Batch {
    put(simulator, from);
    let requests: Vec<Begin> = (0..N_ENVS).step_by(3).map(|env| Begin { env, ..Begin::default() }).collect();
    simulator.begin(&requests).unwrap();
    simulator.batch().clone()
}

#[test]
fn a_truck_that_the_caller_begins_has_no_last_step_and_those_beside_it_keep_their_vehicles() {
    let world = world();
    let [mut cpu, mut device] = simulators(&world);
    (0..30).for_each(|_| cpu.step_at_random());
    let mut before = cpu.batch().clone();
    // A caller may put other vehicles around a truck that has yet to make a step.
    for env in (1..N_ENVS).step_by(3) {
        before.truck[env].steps = 0;
        let row = Row::of_mut(&mut before.cars[env]);
        (row.entered, row.cars[0]) = (0, Car::NONE);
    }
    let observed = after(&mut cpu, Stage::Observe, &before);
    before = after(&mut cpu, Stage::CopyObservation, &observed);
    before.next_around.fill([0.5; N_AROUND]);
    let [here, there] = [&mut cpu, &mut device].map(|simulator| begun(simulator, &before));
    assert_alike("around", &here.around, &there.around);
    assert_alike("next_around", &here.next_around, &there.next_around);
    for env in 0..N_ENVS {
        let begins = env % 3 == 0;
        assert!(!begins || there.around[env] == there.next_around[env], "truck {env}");
        assert!(begins || there.cars[env] == before.cars[env], "truck {env}");
        assert!(begins || there.next_around[env] == before.next_around[env], "truck {env}");
    }
    let n_alike = rows(&here).zip(rows(&there)).filter(|(here, there)| here == there).count();
    assert!(200 * (N_ENVS - n_alike) <= N_ENVS, "{n_alike}");
}

#[test]
fn vehicles_that_are_not_observed_leave_zeros_on_a_device() {
    let (_, world) = with_traffic("demand = [900]\n");
    let [_, mut device] = simulators(&world);
    (0..5).for_each(|_| device.step_at_random());
    let batch = device.batch();
    assert!(batch.around.len() == N_ENVS && batch.around.iter().chain(&batch.next_around).flatten().all(|&v| v == 0.0));
}
