use offtrack::scenario::Scenario;

use super::*;

/// A simulator of a benchmark whose trucks begin at 30 km/h, after a step with these actions: steered alike, with these
/// target speeds [km/h]. Returns the rewards with -7 for a change, less those without.
fn added(benchmark: &str, speeds_kmh: &[f32]) -> Vec<f32> {
    let world = Arc::new(World::bake(&Scenario::named(benchmark).unwrap()).unwrap());
    let mut simulator = Simulator::new(world.clone(), speeds_kmh.len(), 3, RouteChoice::Drawn(vec![0])).unwrap();
    let before = simulator.batch().control.clone();
    let action = |&speed: &f32| world.actions.iter().position(|action| (3.6 * action.speed - speed).abs() < 1e-3).unwrap() as u32;
    simulator.step(&speeds_kmh.iter().map(action).collect::<Vec<_>>()).unwrap();
    let batch = simulator.batch();
    let rewards = with_speed_changes(&world, batch, &before, -7.0);
    rewards.iter().zip(&batch.reward).map(|(with, without)| with - without).collect()
}

#[test]
fn a_step_that_changes_the_target_speed_has_another_reward_and_no_other_step_has() {
    for (found, expected) in added("laden2026", &[30.0, 25.0, 10.0, 30.0]).iter().zip([0.0, -7.0, -7.0, 0.0]) {
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    }
}

#[test]
fn a_reward_for_changes_of_the_only_target_speed_is_refused() {
    let mut config = Config::read(&crate::files::repository().join("training/configs/default.toml")).unwrap();
    config.learning.speed_change = Some(-5.0);
    let world = Arc::new(World::bake(&Scenario::named("attard2023").unwrap()).unwrap());
    let refused = HostRollout::<N_VALUES>::new(&config, &world, vec![0], None).err().unwrap().to_string();
    assert!(refused.contains("learning.speed_change: -5") || refused.contains("learning.speed_change -5"), "{refused}");
}
