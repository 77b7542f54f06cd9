use std::sync::Arc;

use offtrack::gpu::{Columns, Slice};
use offtrack::layout::random::{signed_unit, words};
use offtrack::layout::{Column, N_AROUND, N_VALUES};
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{Engine, RouteChoice};
use offtrack::wgpu::{BufferDescriptor, BufferUsages};
use offtrack_policy::{Choice, Layer, Normalisation, Policy};

use crate::device::{self, Device};
use crate::error::Error;
use crate::evaluation::{Driven, Evaluation};
use crate::placed::placed;
use crate::placed::tests::stacked;

use super::*;

/// Episodes on each route of the split.
const EPISODES: usize = 2;

fn driven(
    scenario: &Scenario,
    world: &Arc<World>,
    policy: &mut dyn Controller,
    device: &Device,
) -> Result<Driven, Error> {
    let (episodes, split) = (EPISODES, Split::Test);
    let evaluation = Evaluation { scenario, world, split, episodes, seed: 3, record: false, device };
    evaluation.drive(policy, &mut |_, _| {})
}

#[test]
fn an_evaluation_on_a_device_counts_the_processors_episodes_and_copies_no_observation() {
    for name in ["attard2023", "laden2026", "transfer2026"] {
        let mut scenario = Scenario::named(name).unwrap();
        scenario.keep(&[Split::Test]);
        let world = Arc::new(World::bake(&scenario).unwrap());
        let mut policy = Policy::shipped(name).unwrap();
        let device = uncopied(scenario.split(Split::Test).len());
        let mut on_device = placed(policy.clone(), &device.engine, &world, Choice::Best).unwrap();
        let here = driven(&scenario, &world, &mut policy, &Device::processor()).unwrap();
        let there = driven(&scenario, &world, on_device.as_mut(), &device).unwrap();
        assert_eq!(here.episodes.len(), there.episodes.len());
        for (here, there) in here.episodes.iter().zip(&there.episodes) {
            assert_eq!((here.ended, here.steps), (there.ended, there.steps), "{name}");
            let apart = |figure: fn(&crate::report::Episode) -> f64| (figure(here) - figure(there)).abs();
            // Engines sum in different orders: see the tests of the simulator.
            assert!(apart(|episode| episode.reward) < 1e-2 && apart(|episode| episode.lane_distance_mean) < 1e-3);
        }
        assert!(driven(&scenario, &world, &mut policy, &device).is_err(), "observations for the processor are copied");
    }
}

/// A policy of numbers at random that observes vehicles.
fn that_observes_vehicles(world: &World) -> Policy {
    let mut policy = Policy::shipped("attard2023").unwrap();
    let (n_values, n_actions) = (N_VALUES + N_AROUND, world.actions.len());
    let number = |at: usize| signed_unit(words(3, at as u32, 0, 0)[0]);
    policy.vehicles = true;
    policy.actions.clone_from(&world.actions);
    policy.normalisation = Normalisation::none(n_values);
    let layer = Layer {
        weights: (0..n_values * n_actions).map(|at| 0.2 * number(at)).collect(),
        biases: (0..n_actions).map(|at| number(at + n_values * n_actions)).collect(),
    };
    policy.layers = vec![layer];
    policy
}

#[test]
fn an_evaluation_among_vehicles_on_a_device_counts_nearly_the_processors_episodes_and_copies_no_observation() {
    let mut scenario = Scenario::named("traffic2026").unwrap();
    scenario.keep(&[Split::Test]);
    let world = Arc::new(World::bake(&scenario).unwrap());
    let mut policy = that_observes_vehicles(&world);
    let device = uncopied(scenario.split(Split::Test).len());
    let mut on_device = placed(policy.clone(), &device.engine, &world, Choice::Best).unwrap();
    let here = driven(&scenario, &world, &mut policy, &Device::processor()).unwrap().episodes;
    let there = driven(&scenario, &world, on_device.as_mut(), &device).unwrap().episodes;
    let of = |episode: &crate::report::Episode| {
        (episode.ended, episode.steps, episode.among.map(|among| among.demand.to_bits()))
    };
    let alike = here.iter().zip(&there).filter(|(here, there)| of(here) == of(there)).count();
    println!("{alike} of {} episodes", here.len());
    // A vehicle that brakes for a last bit of a truck's ground, and not without, drives otherwise from then on.
    assert!(10 * (here.len() - alike) <= here.len(), "{alike} of {}", here.len());
    assert!(here.iter().all(|episode| episode.among.is_some()));
}

#[test]
fn a_policy_with_a_memory_drives_the_trucks_of_a_device_from_the_processor() {
    let mut scenario = Scenario::named("attard2023").unwrap();
    scenario.keep(&[Split::Test]);
    let world = Arc::new(World::bake(&scenario).unwrap());
    let mut policy = Policy::shipped("attard2023").unwrap();
    let device = device::open(None).unwrap();
    // It heeds the last of its frames: on the processor it drives as the policy that sees one.
    let mut framed = placed(stacked(&policy, 2), &device.engine, &world, Choice::Best).unwrap();
    let here = driven(&scenario, &world, &mut policy, &Device::processor()).unwrap();
    let there = driven(&scenario, &world, framed.as_mut(), &device).unwrap();
    for (here, there) in here.episodes.iter().zip(&there.episodes) {
        assert_eq!((here.ended, here.steps), (there.ended, there.steps));
    }
}

#[test]
fn actions_sampled_on_a_device_are_those_that_the_processor_samples() {
    let scenario = Scenario::named("attard2023").unwrap();
    let (world, routes) = (Arc::new(World::bake(&scenario).unwrap()), scenario.split(Split::Test).to_vec());
    let mut policy = Policy::shipped("attard2023").unwrap();
    let engine = device::open(None).unwrap().engine;
    let [mut here, mut there] = [&Engine::Cpu, &engine]
        .map(|engine| placed(policy.clone(), engine, &world, Choice::Sampled { seed: 5 }).unwrap());
    let mut simulator = Simulator::on(engine, world.clone(), 200, 0, RouteChoice::Drawn(routes)).unwrap();
    let indices = |actions: Actions| if let Actions::Indices(indices) = actions { indices } else { Vec::new() };
    let (mut n_others, mut n_sampled) = (0, 0);
    for _ in 0..30 {
        let expected = indices(here.choose(&world, simulator.batch()));
        assert_eq!(
            expected,
            indices(there.choose(&world, simulator.batch())),
            "asked for trucks on the processor it does as there"
        );
        let best = indices(policy.choose(&world, simulator.batch()));
        there.step(&mut simulator).unwrap();
        for ((action, expected), best) in simulator.batch().action.iter().zip(&expected).zip(&best) {
            n_others += u32::from(action != expected);
            n_sampled += u32::from(action != best);
        }
    }
    // A number drawn within rounding of a sum of probabilities may fall on either side.
    assert!(n_others <= 2 && 100 < n_sampled, "{n_others} others, {n_sampled} of 6,000 are not the best");
}

/// A device whose trucks observe into buffers that cannot be copied from.
fn uncopied(n_routes: usize) -> Device {
    let mut device = device::open(None).unwrap();
    let Engine::Gpu { device: opened, columns } = &mut device.engine else { panic!("{device:?}") };
    let observed = [
        Column::Observation,
        Column::NextObservation,
        Column::Extras,
        Column::NextExtras,
        Column::Ranges,
        Column::Around,
        Column::NextAround,
    ];
    *columns = Columns::from(observed.map(|column| {
        let size = (n_routes * EPISODES * column.width()) as u64;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let descriptor = BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
        (column, Slice { buffer: opened.device.create_buffer(&descriptor), offset: 0, size })
    }));
    device
}
