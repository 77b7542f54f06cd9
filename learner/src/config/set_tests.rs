use offtrack::scenario::Scenario;

use super::tests::{read, with_set};
use super::*;

#[test]
fn single_keys_can_be_set_added_and_taken_out() {
    let config = with_set(&[
        "learning.n_steps=7",
        "replay_buffer.priority.exponent=0.6",
        "replay_buffer.priority.correction = 0.4",
        "training_benchmark=",
    ])
    .unwrap();
    assert_eq!(config.learning.n_steps, 7);
    assert_eq!(config.replay_buffer.priority, Some(Priority { exponent: 0.6, correction: 0.4 }));
    assert_eq!(config.training_benchmark, None);
    let words =
        with_set(&["learning.critics=minimum", "training_benchmark=elsewhere", "learning.hidden=[8, 8]"]).unwrap();
    assert_eq!(
        (words.learning.critics, words.training_benchmark.as_deref(), words.learning.hidden),
        (Critics::Minimum, Some("elsewhere"), vec![8, 8])
    );
}

#[test]
fn a_key_that_is_not_there_can_be_taken_out() {
    let paper = |settings: &[&str]| {
        let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
        Config::read_with(Path::new("paper"), &settings).map_err(|error| error.to_string())
    };
    assert_eq!(paper(&["validation.benchmark=", "refinement.reward.clearance="]), paper(&[]));
}

#[test]
fn weights_of_the_reward_can_be_changed_one_by_one() {
    let mut scenario = Scenario::named("attard2023-training").unwrap();
    let before = scenario.clone();
    let unchanged = with_set(&["reward="]).unwrap();
    assert_eq!(unchanged.changed_rewards(), "");
    unchanged.reward.apply(&mut scenario.reward);
    assert_eq!(scenario.reward.clearance, before.reward.clearance);
    let changed = with_set(&["reward.clearance=-70", "reward.failure=-3"]).unwrap();
    assert_eq!(read(&changed.to_toml()).as_ref(), Ok(&changed));
    assert_eq!(changed.changed_rewards(), "reward.clearance = -70.0, reward.failure = -3.0");
    changed.reward.apply(&mut scenario.reward);
    assert_eq!((scenario.reward.clearance, scenario.reward.failure), (-70.0, -3.0));
    let others = |of: &Scenario| {
        (of.reward.waypoint, of.reward.lane_distance, of.reward.lane_distance_limit, of.reward.clearance_limit)
    };
    assert_eq!(others(&scenario), others(&before));
}

#[test]
fn a_key_set_wrongly_is_refused_with_what_would_do() {
    for (setting, expected) in [
        ("learning.n_steps", "--set: learning.n_steps; KEY=VALUE is needed"),
        ("=5", "--set: =5; a key is needed before"),
        ("learning..n_steps=5", "joined by single points"),
        ("seed.low=5", "seed is a value and has no keys below it"),
        ("learning.n_steps=0", "--set learning.n_steps=0: learning.n_steps: 0; must lie in 1..100"),
        ("learning.n_step=1", "unknown field `n_step`"),
        ("learning.hidden=wide", "--set learning.hidden=wide: invalid type: string"),
        ("device=3", "--set device=3: invalid type, expected a string, in `device`"),
        ("learning.n_steps=5\nlearning.gamma=0.5", "invalid type: string"),
        ("reward.clearance_limit=0", "reward.clearance_limit: 0 m; must lie in 0.01..10 m"),
        ("reward.lane_distance_limit=51", "reward.lane_distance_limit: 51 m; must lie in 0.1..50 m"),
        ("reward.waypoint=nan", "reward.waypoint: NaN; must lie in"),
        ("reward.kerb=-1", "unknown field `kerb`"),
        ("base=best", "--set: base=best; base stands in a training file alone: write one with it, and give"),
        ("without=[\"validation\"]", "--set: without=[\"validation\"]; without stands in a training file alone"),
        ("base=", "--set: base=; base stands in a training file alone"),
        ("adapter=llvmpipe", "adapter: given; works with device = \"gpu\" alone"),
    ] {
        let message = with_set(&[setting]).unwrap_err();
        assert!(message.contains(expected), "{setting}: {message}");
    }
}

#[test]
fn a_key_that_no_training_file_has_cannot_be_taken_out() {
    for (setting, expected) in [
        ("lerning.gamma=", "--set: lerning.gamma=; unknown field `lerning`"),
        ("learning.gama=", "--set: learning.gama=; unknown field `gama`"),
        ("learning.gamma.foo=", "--set: learning.gamma.foo=; has no keys below it; no training file has it"),
    ] {
        let message = with_set(&[setting]).unwrap_err();
        assert!(message.starts_with(expected) && message.contains("learning"), "{message}");
    }
    // Known ones may be absent.
    with_set(&["validation.benchmark=", "level_replay=", "refinement.begin="]).unwrap();
}
