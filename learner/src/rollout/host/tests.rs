use std::path::Path;

use offtrack::scenario::{Scenario, Split};
use offtrack_policy::Policy;
use rand::rngs::SmallRng;

use super::*;

const ARRIVAL: f32 = 1500.0;
const N_ENVS: usize = 16;
/// Long enough for every truck to arrive more than once.
const N_STEPS: usize = 400;

/// Trucks of the shipped policy, and its network. `settings` change the file `lane`.
fn rollout(settings: &[String]) -> (HostRollout<N_VALUES>, Mlp) {
    let sizes = [
        format!("n_envs={N_ENVS}"),
        "learning.n_steps=1".into(),
        format!("replay_buffer.capacity={}", N_ENVS * (N_STEPS + 2)),
    ];
    let settings: Vec<String> =
        sizes.into_iter().chain(["replay_buffer.warmup=16".into()]).chain(settings.to_vec()).collect();
    let config = Config::read_with(Path::new("lane"), &settings).unwrap();
    let scenario = Scenario::named("attard2023").unwrap();
    let world = Arc::new(World::bake(&scenario).unwrap());
    let mut rollout = HostRollout::new(&config, &world, scenario.split(Split::Train).to_vec(), None).unwrap();
    let policy = Policy::shipped("attard2023").unwrap();
    rollout.set_normalisation(&policy.normalisation);
    (rollout, Mlp::of(&policy.layers, &Device::flex()))
}

#[test]
fn the_replay_buffer_has_the_simulators_rewards_and_more_for_an_arrival_where_that_is_asked_for() {
    for (settings, arrival) in [(vec![], 0.0), (vec![format!("learning.arrival={ARRIVAL}")], ARRIVAL)] {
        let (mut rollout, actor) = rollout(&settings);
        let mut expected = Vec::new();
        for _ in 0..N_STEPS {
            rollout.step(&actor, 0).unwrap();
            let batch = rollout.simulator().batch();
            expected.extend(batch.reward.iter().zip(&batch.ended).map(|(&reward, &code)| {
                let arrived = code == Ended::Arrived as u32;
                (arrived, if arrived { reward + arrival } else { reward })
            }));
        }
        let sample = rollout.replay_buffer.sample(4000, 0.99, &mut SmallRng::seed_from_u64(1));
        let found = sample.row.iter().zip(&sample.reward);
        found.for_each(|(&row, &reward)| assert_eq!(reward, expected[row].1, "{arrival}, row {row}"));
        assert!(sample.row.iter().any(|&row| expected[row].0), "no arrival is among the sample");
    }
}

#[test]
fn a_refinement_has_the_reward_for_arriving_too() {
    let collected = |settings: &[String]| {
        let settings: Vec<String> = settings.iter().cloned().chain([format!("refinement.n_steps={N_STEPS}")]).collect();
        let (mut rollout, actor) = rollout(&settings);
        let settings = rollout.config.refinement.clone().unwrap();
        rollout.collect(&actor, &settings).unwrap()
    };
    let (without, with) = (collected(&[]), collected(&[format!("learning.arrival={ARRIVAL}")]));
    assert_eq!(with.ended, without.ended);
    assert!(with.ended.contains(&Ended::Arrived));
    // Both are scaled by reward_scale = 0.01.
    for ((with, without), ended) in with.reward.iter().zip(&without.reward).zip(&with.ended) {
        let expected = if *ended == Ended::Arrived { 0.01 * ARRIVAL } else { 0.0 };
        assert!((with - without - expected).abs() < 1e-4, "{ended:?}: {with} after {without}");
    }
}

#[test]
fn networks_observe_the_values_the_first_extras_and_then_the_vehicles() {
    const BOTH: usize = N_VALUES + 5 + N_AROUND;
    let (values, extras) = ([[1.0; N_VALUES]; 2], [std::array::from_fn(|index| 2.0 + index as f32); 2]);
    let around = [std::array::from_fn(|index| 100.0 + index as f32); 2];
    let seen = observed::<BOTH>(&values, &extras, &around);
    assert_eq!((seen.len(), seen[1][68], seen[1][69], seen[1][73]), (2, 1.0, 2.0, 6.0));
    assert_eq!((seen[1][74], seen[1][BOTH - 1]), (100.0, 141.0));
    // Without vehicles there is nothing to join.
    assert_eq!(observed::<{ N_VALUES + 5 }>(&values, &extras, &[])[0][69..], [2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(observed::<N_VALUES>(&values, &extras, &[]).len(), 2);
}
