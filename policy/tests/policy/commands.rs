//! Policies whose outputs are commands.

use super::*;
use offtrack_policy::Squash;

/// Steers and chooses a speed, by the means of the first two values of an observation.
fn commanding(squash: Squash) -> Policy {
    let mut policy = policy(&[], 2);
    policy.layers[0].weights = vec![0.0; 2 * N_VALUES];
    (policy.layers[0].weights[0], policy.layers[0].weights[3]) = (1.0, 1.0);
    policy.layers[0].biases = vec![0.0; 2];
    policy.normalisation = Normalisation::none(N_VALUES);
    policy.actions = vec![Action { steering: -0.5, speed: 4.0 }, Action { steering: 0.5, speed: 9.0 }];
    Policy { head: Head::Continuous { squash }, ..policy }
}

#[test]
fn means_are_squashed_or_clipped_to_commands_between_minus_1_and_1() {
    let mut observation = [0.0; N_VALUES];
    (observation[0], observation[1]) = (0.5, -3.0);
    let (_folder, file) = written(&commanding(Squash::Clip).to_bytes());
    let clipping = Policy::load(&file).unwrap();
    assert_eq!(clipping.head, Head::Continuous { squash: Squash::Clip });
    assert_eq!(clipping.commands(&[observation]), [0.5, -1.0]);
    let squashing = Policy::from_bytes("test", &commanding(Squash::Tanh).to_bytes()).unwrap();
    assert_eq!(squashing.commands(&[observation, observation]), [0.5f32.tanh(), (-3.0f32).tanh()].repeat(2));
    assert_eq!(squashing.logits(&[observation]), [0.5, -3.0]);
    assert_eq!(squashing.commands_beside(&[observation], &[[0.0; N_EXTRAS]]), squashing.commands(&[observation]));
}

#[test]
fn a_policy_of_commands_has_one_for_the_steer_angle_and_one_for_the_speed_where_its_range_has_a_width() {
    let mut steering = commanding(Squash::Tanh);
    steering.actions[1].speed = 4.0;
    let message = refusal(&steering.to_bytes());
    assert!(message.ends_with("its last layer has 2 outputs, and its actions ask for 1 commands"), "{message}");
    steering.layers[0] = Layer { weights: vec![0.1; N_VALUES], biases: vec![0.0] };
    let read = Policy::from_bytes("test", &steering.to_bytes()).unwrap();
    assert_eq!((read.n_outputs(), read.commands(&observations(3)).len()), (1, 3));
    steering.actions.truncate(1);
    assert!(refusal(&steering.to_bytes()).contains("commands with 1 actions; two are needed: what -1 and what 1 asks"));
}

#[test]
fn an_unknown_head_or_squash_is_refused_by_its_word() {
    let refused = |policy: &Policy, from: &str, to: &str, expected: &str| {
        let message = refusal(&described(policy, |text| {
            assert!(text.contains(from), "{text}");
            text.replace(from, to)
        }));
        assert!(message.contains(expected), "{message}");
    };
    let commanding = commanding(Squash::Tanh);
    let both = "\"head\":\"continuous\",\"squash\":\"tanh\"";
    refused(
        &commanding,
        both,
        "\"head\":\"other\"",
        "is a policy with the head \"other\"; must be levels or continuous",
    );
    refused(&commanding, both, "\"head\":\"continuous\"", "without a squash; \"tanh\" or \"clip\" is needed");
    refused(&commanding, "\"squash\":\"tanh\"", "\"squash\":\"relu\"", "the squash \"relu\"; must be tanh or clip");
    refused(&commanding, both, "\"squash\":\"tanh\"", "and its outputs are values of actions; leave it out");
    refused(&commanding, "\"version\":2", "\"version\":1", "version 1 with the key `head`; its version must be 2");
}

#[test]
fn a_policy_of_commands_is_refused_by_a_benchmark_with_a_table_of_actions() {
    let world = World::bake(&Scenario::named("attard2023").unwrap()).unwrap();
    let message = commanding(Squash::Tanh).check(&world).unwrap_err().to_string();
    assert!(
        message.contains(
            "between -1 and 1, and the benchmark has a table of 9 actions; a policy with the head \"levels\""
        ),
        "{message}"
    );
}
