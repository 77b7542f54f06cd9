use offtrack::scenario::Scenario;

use super::*;
use crate::files;

fn baked(benchmark: &str) -> Arc<World> {
    Arc::new(World::bake(&Scenario::named(benchmark).unwrap()).unwrap())
}

#[test]
fn a_step_that_changes_the_target_speed_adds_to_the_reward_and_no_other_step_does() {
    // Its trucks begin at 30 km/h.
    let (world, kmh) = (baked("laden2026"), [30.0f32, 25.0, 10.0, 30.0]);
    let mut simulator = Simulator::new(world.clone(), kmh.len(), 3, RouteChoice::Drawn(vec![0])).unwrap();
    let before = simulator.batch().control.clone();
    let action = |kmh: f32| world.actions.iter().position(|action| (3.6 * action.speed - kmh).abs() < 1e-3).unwrap() as u32;
    simulator.step(&kmh.map(action)).unwrap();
    assert_eq!(speed_changes(&world, simulator.batch(), &before, -7.0), [0.0, -7.0, -7.0, 0.0]);
}

#[test]
fn a_reward_for_changes_of_the_only_target_speed_is_refused() {
    let mut config = Config::read(&files::repository().join("training/configs/default.toml")).unwrap();
    config.learning.speed_change = Some(-5.0);
    let refused = HostRollout::<N_VALUES>::new(&config, &baked("attard2023"), vec![0], None).err().unwrap().to_string();
    assert!(refused.contains("learning.speed_change: -5") && refused.contains("has one target speed"), "{refused}");
}
