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
fn a_policy_that_observes_vehicles_reads_them_last_and_its_file_says_so() {
    let mut policy = with_extras(5);
    policy.vehicles = true;
    policy.normalisation = Normalisation::none(N_VALUES + 5 + N_AROUND);
    policy.layers[0].weights = (0..(N_VALUES + 5 + N_AROUND) * 16).map(|at| 0.2 * number(at as u32, 77)).collect();
    let read = Policy::from_bytes("policy", &policy.to_bytes()).unwrap();
    assert!(read.vehicles && read.reads_vehicles() && read.is_plain());
    assert!(!Policy::from_bytes("policy", &with_extras(5).to_bytes()).unwrap().reads_vehicles());
    let rows = observations(3);
    let extras: Vec<[f32; N_EXTRAS]> =
        (0..3).map(|row| std::array::from_fn(|index| number(row, 500 + index as u32))).collect();
    let around: Vec<[f32; N_AROUND]> =
        (0..3).map(|row| std::array::from_fn(|index| number(row, 600 + index as u32))).collect();
    let logits = read.logits_among(&rows, &extras, &around);
    assert_eq!(read.clone().driver(3).outputs_among(&[0, 1, 2], &rows, &extras, &around), logits);
    // The same values by their names.
    let mut named = policy.clone();
    let groups = |groups: &'static [Values]| groups.iter().map(|group| group.name.to_owned());
    let extras_names = EXTRAS[..5].iter().map(|extra| extra.name.to_owned());
    let names: Vec<String> = groups(&OBSERVATION).chain(extras_names).chain(groups(&VEHICLE_VALUES)).collect();
    (named.extras, named.vehicles) = (Vec::new(), false);
    named.values = Some(offtrack_policy::Selection::of(&names).unwrap());
    assert!(named.reads_vehicles());
    assert_eq!(named.logits_among(&rows, &extras, &around), logits);
    for index in [0, N_AROUND - 1] {
        let mut around = around.clone();
        around[1][index] += 0.5;
        assert_ne!(read.logits_among(&rows, &extras, &around), logits, "{index}");
    }
}

#[test]
fn a_policy_that_observes_vehicles_is_refused_where_a_benchmark_does_not_and_others_drive_among_them() {
    let text = Scenario::text_of("attard2023").unwrap() + "\n[traffic]\ndemand = [300]\n";
    let world = |vehicles: bool| {
        let text = format!("{text}[observation]\nvehicles = {vehicles}\n");
        let mut scenario = Scenario::parse("among", &text, None, &Loading::PLAIN).unwrap();
        scenario.retain(|_, route| route.name.starts_with("16m"));
        World::bake(&scenario).unwrap()
    };
    let check = |policy: &Policy, world: &World| {
        let policy = Policy { actions: world.actions.clone(), ..policy.clone() };
        policy.check(world).map_err(|error| error.to_string())
    };
    let (seen, unseen) = (world(true), world(false));
    let blind = policy(&[16], 9);
    let seeing = Policy { vehicles: true, ..blind.clone() };
    assert_eq!((check(&blind, &seen), check(&blind, &unseen), check(&seeing, &seen)), (Ok(()), Ok(()), Ok(())));
    let message = check(&seeing, &unseen).unwrap_err();
    assert!(message.contains("other vehicles") && message.contains("observation.vehicles = true"), "{message}");
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
