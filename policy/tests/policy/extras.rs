//! Policies that observe extras.

use super::*;

/// A policy that observes the first `n` extras.
fn with_extras(n: usize) -> Policy {
    let mut policy = policy(&[16], 9);
    policy.extras = EXTRAS[..n].iter().map(|extra| extra.name.to_owned()).collect();
    policy.normalisation = Normalisation::none(N_VALUES + n);
    policy.layers[0].weights = (0..(N_VALUES + n) * 16).map(|at| 0.2 * number(at as u32, 77)).collect();
    policy
}

#[test]
fn a_policy_with_extras_drives_by_them_and_its_file_names_them() {
    let policy = with_extras(8);
    let (_folder, file) = written(&policy.to_bytes());
    let read = Policy::load(&file).unwrap();
    assert_eq!((&read.extras, &read.layers), (&policy.extras, &policy.layers));
    let rows = observations(9);
    let extras: Vec<[f32; N_EXTRAS]> =
        (0..9).map(|row| std::array::from_fn(|index| number(row, 500 + index as u32))).collect();
    let logits = read.logits_beside(&rows, &extras);
    // By the definition: 69 values, then the first 8 extras.
    let layer = &read.layers[0];
    let inputs: Vec<f32> = rows[3].iter().chain(&extras[3][..8]).copied().collect();
    let hidden = |output: usize| {
        let sum = inputs
            .iter()
            .enumerate()
            .fold(0.0f32, |sum, (input, value)| value.mul_add(layer.weights[input * 16 + output], sum));
        (sum + layer.biases[output]).max(0.0)
    };
    let hidden: Vec<f32> = (0..16).map(hidden).collect();
    let last = &read.layers[1];
    for action in 0..9 {
        let expected = (0..16).fold(0.0f32, |sum, input| hidden[input].mul_add(last.weights[input * 9 + action], sum))
            + last.biases[action];
        assert!((logits[3 * 9 + action] - expected).abs() < 1e-5, "{action}: {} {expected}", logits[3 * 9 + action]);
    }
    // An extra that it observes changes what it says, one beyond does not.
    let changed = |index: usize| {
        let mut extras = extras.clone();
        extras[3][index] += 0.5;
        read.logits_beside(&rows, &extras) != logits
    };
    assert!((0..8).all(changed) && !(8..N_EXTRAS).any(changed));
}

#[test]
fn a_policy_is_refused_where_a_benchmark_observes_other_extras() {
    let mut scenario = Scenario::named("attard2023").unwrap();
    let mut check = |track: ObservedExtras, policy: &Policy| {
        scenario.extras = track;
        let world = World::bake(&scenario).unwrap();
        let policy = Policy { actions: world.actions.clone(), ..policy.clone() };
        policy.check(&world).map_err(|error| error.to_string())
    };
    assert_eq!(check(ObservedExtras::Mass, &with_extras(8)), Ok(()));
    assert_eq!(check(ObservedExtras::None, &with_extras(0)), Ok(()));
    let message = check(ObservedExtras::Blind, &with_extras(8)).unwrap_err();
    assert!(
        message.contains("trailer_mass here") && message.contains("trailer_wheelbase in the benchmark"),
        "{message}"
    );
    assert!(check(ObservedExtras::None, &with_extras(8)).unwrap_err().contains("none in the benchmark"));
    assert!(check(ObservedExtras::Oracle, &with_extras(0)).unwrap_err().contains("none here"));
    // Extras are the first of their list.
    let wrong = Policy { extras: vec!["trailer_mass".to_owned()], ..with_extras(1) };
    assert!(
        refusal(&wrong.to_bytes())
            .contains("is a policy with the extras [\"trailer_mass\"]; must be the first of steering,")
    );
}
