use std::sync::Arc;

use offtrack::layout::random::{signed_unit, words};
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack_policy::{Cell, Frames, Gates, Layer, Normalisation, Padding, Recurrent, Selection};

use super::*;
use crate::certificate::attempt::attempt;
use crate::certificate::beam::Pass;
use crate::device::Device;
use crate::evaluation::{Driven, Evaluation};

fn trained() -> (Scenario, Arc<World>, Policy) {
    let mut scenario = Scenario::named("attard2023").unwrap();
    scenario.keep(&[Split::Test]);
    let world = Arc::new(World::bake(&scenario).unwrap());
    (scenario, world, Policy::shipped("attard2023").unwrap())
}

fn layer(n_inputs: usize, n_outputs: usize, of: u32) -> Layer {
    let number = |at: usize| signed_unit(words(9, at as u32, of, 0)[0]);
    Layer { weights: (0..n_inputs * n_outputs).map(number).collect(), biases: vec![0.0; n_outputs] }
}

/// A policy of the rays that remembers; its numbers are drawn.
fn remembering(like: &Policy) -> Policy {
    let names = ["trailer_range", "tractor_range"].map(str::to_owned);
    let cell = Cell { input: layer(58, 32, 0), hidden: layer(8, 32, 1) };
    Policy {
        values: Some(Selection::of(&names).unwrap()),
        frames: Frames { n: 2, padding: Padding::Reset },
        normalisation: Normalisation::none(29),
        layers: vec![layer(8, like.actions.len(), 2)],
        recurrent: Some(Recurrent { gates: Gates::Lstm, after: 0, cells: vec![cell] }),
        ..like.clone()
    }
}

/// The policy with frames of which it reads the last one alone.
pub(super) fn stacked(policy: &Policy, n: usize) -> Policy {
    let mut stacked = policy.clone();
    let n_unread = (n - 1) * N_VALUES * policy.layers[0].n_outputs();
    stacked.layers[0].weights = [vec![0.0; n_unread], policy.layers[0].weights.clone()].concat();
    Policy { frames: Frames { n, padding: Padding::Zero }, ..stacked }
}

#[test]
fn a_policy_that_sees_several_frames_and_heeds_the_last_is_evaluated_as_the_one_that_sees_it_alone() {
    let (scenario, world, mut policy) = trained();
    let device = Device::processor();
    let evaluation = Evaluation {
        scenario: &scenario,
        world: &world,
        split: Split::Test,
        episodes: 2,
        seed: 3,
        record: true,
        device: &device,
    };
    let drive = |policy: &mut dyn Controller| evaluation.drive(policy, &mut |_, _| {}).unwrap();
    let Driven { episodes, tracks, .. } = drive(&mut policy);
    let engine = &Device::processor().engine;
    let mut framed = placed(stacked(&policy, 3), engine, &world, Choice::Best).unwrap();
    // Twice: the second evaluation begins without what was seen in the first.
    for _ in 0..2 {
        let found = drive(framed.as_mut());
        assert!(found.episodes == episodes && found.tracks == tracks);
    }
    let mut other = placed(remembering(&policy), engine, &world, Choice::Best).unwrap();
    let (first, second) = (drive(other.as_mut()).episodes, drive(other.as_mut()).episodes);
    assert!(first == second && first != episodes);
}

#[test]
fn what_is_remembered_of_a_truck_ends_with_its_episode_wherever_it_stands_in_the_batch() {
    let (scenario, world, policy) = trained();
    let policy = remembering(&policy);
    let routes = RouteChoice::Drawn(scenario.split(Split::Test).to_vec());
    let mut simulator = Simulator::new(world.clone(), 40, 0, routes).unwrap();
    let mut controller = placed(policy.clone(), &Engine::Cpu, &world, Choice::Best).unwrap();
    // Each truck by itself, from the observations of its episode alone.
    let mut seen: Vec<(u32, Driver)> = vec![(u32::MAX, policy.clone().driver(1)); 40];
    let (mut n_begun, mut n_remembered) = (0, 0);
    for _ in 0..150 {
        let Actions::Indices(actions) = controller.choose(&world, simulator.batch()) else { panic!("commands") };
        let batch = simulator.batch();
        for (env, (episode, driver)) in seen.iter_mut().enumerate() {
            if *episode != batch.truck[env].episode {
                (*episode, *driver) = (batch.truck[env].episode, policy.clone().driver(1));
                n_begun += 1;
            }
            let (values, extras) = (&batch.observation[env..=env], &batch.extras[env..=env]);
            assert_eq!(driver.act(&[0], values, extras), actions[env..=env], "truck {env}");
            n_remembered += u32::from(policy.clone().driver(1).act(&[0], values, extras) != actions[env..=env]);
        }
        simulator.step(&actions).unwrap();
    }
    assert!(80 < n_begun && 100 < n_remembered, "{n_begun} episodes, {n_remembered} actions that show a memory");
}

#[test]
fn a_certificates_search_follows_a_policy_with_a_memory_to_its_arrival() {
    let (_, world, policy) = trained();
    let framed = stacked(&policy, 2);
    let passes = [Pass { width: 1, hold: 3 }];
    let found = |policy: &Policy| attempt(&world, 0, &Default::default(), &passes, Some(policy)).unwrap();
    let (alone, framed) = (found(&policy), found(&framed));
    assert!(alone.ended == "arrived" && framed == alone, "{alone:?} {framed:?}");
}
