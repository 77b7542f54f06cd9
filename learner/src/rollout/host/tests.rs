use std::path::Path;

use burn::tensor::Device;
use offtrack::scenario::{Scenario, Split};
use offtrack_policy::Policy;
use rand::rngs::SmallRng;

use super::*;
use crate::config;

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
            rollout.step(&Actor::Host(actor.clone()), 0).unwrap();
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

#[test]
fn a_refinement_sees_the_last_frames_of_an_episode_as_its_policy_will() {
    const N_FRAMES: usize = 3;
    let settings = ["refinement.n_steps=1", "refinement.late_fails=false"].map(str::to_owned);
    let (mut alone, actor) = rollout(&settings);
    let (mut several, _) = rollout(&[&settings[..], &[format!("refinement.frames={N_FRAMES}")]].concat());
    let [one, three] = [&alone, &several].map(|rollout| rollout.config.refinement.clone().unwrap());
    // It sees what it saw before.
    let over_frames = actor.over_frames(N_FRAMES, &Device::flex());
    // And one for which the older frames count.
    let mut parameters: Vec<Vec<f32>> = over_frames.parameters().into_iter().map(|(_, values)| values).collect();
    let older = parameters[0].len() / N_FRAMES * (N_FRAMES - 1);
    parameters[0][..older].iter_mut().zip(0..).for_each(|(weight, index)| *weight = 0.01 * (index as f32).sin());
    let mixed = over_frames.with_parameters(parameters, &Device::flex());
    let policy =
        Policy { frames: three.seen(), layers: mixed.plain_layers(), ..Policy::shipped("attard2023").unwrap() };
    let (mut driver, envs) = (policy.driver(N_ENVS), Vec::from_iter(0..N_ENVS));
    let mut seen = vec![Vec::new(); N_ENVS];
    let mut n_begun = 0;
    for step in 0..N_STEPS {
        let batch = several.simulator.batch();
        let begun: Vec<usize> = envs.iter().copied().filter(|&env| batch.truck[env].steps == 0).collect();
        assert!(0 < step || begun == envs, "all begin");
        n_begun += begun.len();
        begun.into_iter().for_each(|env| driver.begin(env));
        let outputs = driver.outputs(&envs, &batch.observation, &batch.extras);
        let expected = alone.collect(&actor, &one).unwrap();
        let steps = several.collect(&over_frames, &three).unwrap();
        assert_eq!((&steps.action, &steps.ended), (&expected.action, &expected.ended));
        assert_eq!(steps.n_values, N_FRAMES * N_VALUES);
        for (env, stack) in steps.observation.chunks_exact(steps.n_values).enumerate() {
            let newest = &expected.observation[env * N_VALUES..][..N_VALUES];
            if seen[env].is_empty() {
                seen[env] = vec![newest.to_vec(); N_FRAMES - 1];
            }
            seen[env].push(newest.to_vec());
            assert_eq!(stack, seen[env][seen[env].len() - N_FRAMES..].concat(), "step {step}, truck {env}");
        }
        let logits = logits_of_normalised(&mixed, steps.observation.clone(), steps.n_values);
        let largest = logits.iter().fold(0.0f32, |most, logit| most.max(logit.abs()));
        let are_close = |(a, b): (&f32, &f32)| (a - b).abs() < 1e-5 * largest;
        assert!(outputs.iter().zip(&logits).all(are_close), "step {step}");
        // What comes next is one frame more, of trucks that go on.
        let mut next = steps.next_observation.chunks_exact(steps.n_values);
        let mut alone = expected.next_observation.chunks_exact(N_VALUES);
        for env in envs.iter().copied().filter(|&env| steps.needs_next(env, N_ENVS)) {
            let newest = alone.next().unwrap();
            let older = &seen[env][seen[env].len() + 1 - N_FRAMES..];
            assert_eq!(next.next().unwrap(), [&older.concat(), newest].concat());
        }
        assert!(next.next().is_none() && alone.next().is_none());
        for (env, ended) in steps.ended.iter().enumerate() {
            if *ended != Ended::Running {
                seen[env].clear();
            }
        }
    }
    assert!(2 * N_ENVS < n_begun, "{n_begun} episodes");
}

/// A truck's values among other vehicles.
const AMONG: usize = N_VALUES + N_AROUND;

/// A table of steps, one at a time.
const REFINEMENT: &str = "refinement={begin=0.0, n_steps=1, epochs=1, batch=64, gamma=0.99, gae_lambda=0.98, clip=0.2, \
                          advantage_limit=4.0, entropy_coefficient=0.0, actor_learning_rate=1e-4, \
                          critic_learning_rate=1e-3, final_learning_rate_fraction=1.0, actor_ema_rate=0.1, \
                          critic_iterations=0, clearance_power=1.0}";

/// Trucks of `traffic2026` among many vehicles, under the rule that yields, and the network of its shipped policy.
fn under_a_rule(settings: &[&str]) -> (HostRollout<AMONG>, Mlp) {
    let mut scenario = Scenario::named("traffic2026").unwrap();
    scenario.retain(|_, route| route.name.starts_with("20m/N"));
    in_scenario(&scenario, settings)
}

fn in_scenario(scenario: &Scenario, settings: &[&str]) -> (HostRollout<AMONG>, Mlp) {
    let settings: Vec<String> =
        ["n_envs=64", "rule=\"yields\""].iter().chain(settings).map(|&setting| setting.to_owned()).collect();
    let config = Config::read_with(Path::new("traffic"), &settings).unwrap();
    let world = Arc::new(World::bake(scenario).unwrap());
    let mut rollout = HostRollout::new(&config, &world, scenario.split(Split::Test).to_vec(), None).unwrap();
    let policy = Policy::shipped("traffic2026").unwrap();
    rollout.set_normalisation(&policy.normalisation);
    (rollout, Mlp::of(&policy.layers, &Device::flex()))
}

/// The speed that each truck may drive at as the rule has it, for which the fastest action makes way.
fn allowed(rollout: &HostRollout<AMONG>) -> Vec<f32> {
    let (world, batch) = (rollout.simulator.world(), rollout.simulator.batch());
    let speeds = || world.actions.iter().map(|action| action.speed);
    let fastest = speeds().enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b)).unwrap().0 as u32;
    let capped = rollout.rule.as_ref().unwrap().capped(world, batch, &[fastest; 64]);
    capped.iter().map(|&action| world.actions[action as usize].speed).collect()
}

#[test]
fn under_a_rule_no_truck_drives_faster_than_it_allows_and_a_refinement_remembers_what_was_chosen() {
    let (mut rollout, actor) = under_a_rule(&[REFINEMENT]);
    let settings = rollout.config.refinement.clone().unwrap();
    let mut n_slowed = 0;
    for _ in 0..150 {
        let allowed = allowed(&rollout);
        let steps = rollout.collect(&actor, &settings).unwrap();
        let logits = logits_of_normalised(&actor, steps.observation, AMONG);
        let world = rollout.simulator.world();
        for (env, (&chosen, row)) in steps.action.iter().zip(logits.chunks_exact(world.actions.len())).enumerate() {
            let made = rollout.simulator.batch().action[env];
            let [wanted, driven] = [chosen, made].map(|action| world.actions[action as usize].speed);
            assert!(driven <= allowed[env], "{driven} m/s where {} are allowed", allowed[env]);
            assert!((wanted <= allowed[env]) == (made == chosen), "{chosen} became {made}");
            assert_eq!(steps.log_prob[env], softmax(row).1[chosen as usize]);
            n_slowed += usize::from(made != chosen);
        }
    }
    // A truck that wants to go while it must wait.
    assert!(64 < n_slowed, "{n_slowed}");
}

#[test]
fn in_a_refinement_where_who_is_late_fails_the_end_of_time_is_rewarded_as_a_failure_and_has_no_value_after_it() {
    let mut scenario = Scenario::named("traffic2026").unwrap();
    scenario.retain(|_, route| route.name.starts_with("20m/N"));
    // No time to wait for anybody.
    scenario.time_limit = 1.0;
    scenario.traffic.as_mut().unwrap().waiting = 0.0;
    let late = REFINEMENT.replace("n_steps=1", "n_steps=300").replace("clear", "late_fails=true, clear");
    let usual = late.replace("true", "false");
    let [(late, n_late), (usual, n_usual)] = [late, usual].map(|settings| {
        let (mut rollout, actor) = in_scenario(&scenario, &[&settings]);
        let settings = rollout.config.refinement.clone().unwrap();
        let steps = rollout.collect(&actor, &settings).unwrap();
        let n_rows = steps.reward.len();
        let n_next = (0..n_rows).filter(|&row| steps.needs_next(row, n_rows)).count();
        assert_eq!(n_next * AMONG, steps.next_observation.len());
        (steps, n_next)
    });
    let mut n_ended = 0;
    for (row, ended) in late.ended.iter().enumerate() {
        assert_eq!(*ended, usual.ended[row]);
        let more = if *ended == Ended::TimedOut { -500.0 * 0.003 } else { 0.0 };
        assert!((late.reward[row] - usual.reward[row] - more).abs() < 1e-4, "row {row}, {ended:?}");
        n_ended += usize::from(*ended == Ended::TimedOut);
    }
    assert!(16 < n_ended, "{n_ended}");
    assert_eq!(n_usual - n_late, n_ended);
}

#[test]
fn under_a_rule_the_replay_buffer_has_the_actions_that_were_made_by_chance_too() {
    let sizes = ["replay_buffer={capacity=12800, warmup=64}", "learning.n_steps=1"];
    let (mut rollout, actor) = under_a_rule(&sizes);
    let (mut made, mut n_slow) = (Vec::new(), 0);
    for step in 0..100 {
        let allowed = allowed(&rollout);
        if step < 50 { rollout.step_at_random() } else { rollout.step(&Actor::Host(actor.clone()), 0) }.unwrap();
        let batch = rollout.simulator.batch();
        for (&action, allowed) in batch.action.iter().zip(allowed) {
            assert!(rollout.simulator.world().actions[action as usize].speed <= allowed);
            n_slow += usize::from(allowed < 8.0);
        }
        made.extend_from_slice(&batch.action);
    }
    assert!(64 < n_slow, "{n_slow}");
    let sample = rollout.replay_buffer.sample(4000, 0.99, &mut SmallRng::seed_from_u64(1));
    sample.row.iter().zip(&sample.action).for_each(|(&row, &action)| assert_eq!(action, made[row], "row {row}"));
}

#[test]
fn a_rule_is_refused_where_there_are_no_vehicles() {
    let config = Config::read_with(Path::new("lane"), &["rule=\"follows\"".to_owned()]).unwrap();
    assert_eq!(config.rule, Some(config::Rule::Follows));
    let scenario = Scenario::named("attard2023").unwrap();
    let world = Arc::new(World::bake(&scenario).unwrap());
    let error = HostRollout::<N_VALUES>::new(&config, &world, vec![0], None).map(drop).unwrap_err();
    assert!(error.to_string().starts_with("rule: follows; drives among other vehicles: "), "{error}");
}
