//! Policies that read some values, several frames, or remember.

use super::*;
use offtrack_policy::{Cell, Driver, Gates, Padding, Recurrent, Selection};

fn selection(names: &[&str]) -> Selection {
    Selection::of(&names.iter().map(|&name| name.to_owned()).collect::<Vec<String>>()).unwrap()
}

fn layer(n_inputs: usize, n_outputs: usize, of: u32) -> Layer {
    Layer {
        weights: (0..n_inputs * n_outputs).map(|at| 0.5 * number(at as u32, 3000 + of)).collect(),
        biases: (0..n_outputs).map(|at| 0.2 * number(at as u32, 4000 + of)).collect(),
    }
}

/// Two recurrent layers of 7 and 5 units behind one of 8 outputs, of the two ranges and one extra in three frames.
fn remembering(gates: Gates, padding: Padding) -> Policy {
    let cell = |n_inputs, n_units, of| Cell {
        input: layer(n_inputs, gates.n() * n_units, of),
        hidden: layer(n_units, gates.n() * n_units, of + 1),
    };
    let n_values = 16 + 13 + 1;
    Policy {
        values: Some(selection(&["tractor_range", "target_speed", "trailer_range"])),
        frames: Frames { n: 3, padding },
        normalisation: Normalisation {
            mean: (0..n_values).map(|at| 0.1 * number(at, 60)).collect(),
            factor: (0..n_values).map(|at| 1.5 + number(at, 61)).collect(),
        },
        layers: vec![layer(3 * n_values as usize, 8, 0), layer(5, 6, 1), layer(6, 4, 2)],
        activation: Activation::Tanh,
        recurrent: Some(Recurrent { gates, after: 1, cells: vec![cell(8, 7, 10), cell(7, 5, 20)] }),
        ..policy(&[], 4)
    }
}

/// What trucks observe at a step, and the extras beside it.
type Observed = (Vec<[f32; N_VALUES]>, Vec<[f32; N_EXTRAS]>);

/// What `n` trucks observe at each of 6 steps.
fn observed(n: u32) -> Vec<Observed> {
    let at = |step: u32, row: u32, index: usize| number(100 * row + step, index as u32);
    let step = |step: u32| {
        let values = (0..n).map(|row| std::array::from_fn(|index| at(step, row, index)));
        let extras = (0..n).map(|row| std::array::from_fn(|index| at(step, row, 200 + index)));
        (values.collect(), extras.collect())
    };
    (0..6).map(step).collect()
}

/// The outputs of a truck whose episode begins with the first of these steps, one number at a time.
fn by_definition(policy: &Policy, steps: &[(&[f32; N_VALUES], &[f32; N_EXTRAS])]) -> Vec<Vec<f32>> {
    let linear = |layer: &Layer, values: &[f32]| -> Vec<f32> {
        let terms = |output: usize| layer.weights.iter().skip(output).step_by(layer.biases.len());
        let sum = |output| terms(output).zip(values).fold(0.0f32, |sum, (weight, value)| value.mul_add(*weight, sum));
        (0..layer.biases.len()).map(|output| sum(output) + layer.biases[output]).collect()
    };
    let sigmoid = |value: f32| 1.0 / (1.0 + (-value).exp());
    let recurrent = policy.recurrent.as_ref().unwrap();
    let zeros = || recurrent.cells.iter().map(|cell| vec![0.0; cell.n_units()]).collect::<Vec<Vec<f32>>>();
    let (mut hidden, mut cells, mut frames) = (zeros(), zeros(), Vec::<Vec<f32>>::new());
    let outputs = |&(values, extras): &(&[f32; N_VALUES], &[f32; N_EXTRAS])| {
        let read = [&values[46..59], &extras[1..2], &values[30..46]].concat();
        let Normalisation { mean, factor } = &policy.normalisation;
        let normal: Vec<f32> =
            (0..read.len()).map(|at| ((read[at] - mean[at]) * factor[at]).clamp(-10.0, 10.0)).collect();
        let before = match (frames.is_empty(), policy.frames.padding) {
            (true, Padding::Reset) => vec![normal.clone(), normal.clone(), normal],
            _ => vec![normal],
        };
        frames.extend(before);
        let zeros = vec![vec![0.0; read.len()]; 3];
        let stack = [zeros.concat(), frames.concat()].concat();
        let first = linear(&policy.layers[0], &stack[stack.len() - 3 * read.len()..]);
        let mut values: Vec<f32> = first.into_iter().map(f32::tanh).collect();
        for (index, cell) in recurrent.cells.iter().enumerate() {
            let (inputs, kept) = (linear(&cell.input, &values), linear(&cell.hidden, &hidden[index]));
            let n = cell.n_units();
            let gate = |which: usize, unit: usize| (inputs[which * n + unit], kept[which * n + unit]);
            for unit in 0..n {
                let opened = |which| sigmoid(gate(which, unit).0 + gate(which, unit).1);
                hidden[index][unit] = match recurrent.gates {
                    Gates::Gru => {
                        let new = (gate(2, unit).0 + opened(0) * gate(2, unit).1).tanh();
                        (1.0 - opened(1)) * new + opened(1) * hidden[index][unit]
                    }
                    Gates::Lstm => {
                        let new = (gate(2, unit).0 + gate(2, unit).1).tanh();
                        cells[index][unit] = opened(1) * cells[index][unit] + opened(0) * new;
                        opened(3) * cells[index][unit].tanh()
                    }
                };
            }
            values.clone_from(&hidden[index]);
        }
        let second = linear(&policy.layers[1], &values).into_iter().map(f32::tanh).collect::<Vec<f32>>();
        linear(&policy.layers[2], &second)
    };
    steps.iter().map(outputs).collect()
}

#[test]
fn a_policy_with_frames_and_recurrent_layers_gives_what_its_definition_says_to_the_last_bit() {
    for (gates, padding) in [(Gates::Gru, Padding::Zero), (Gates::Lstm, Padding::Reset)] {
        let policy = remembering(gates, padding);
        let (_folder, file) = written(&policy.to_bytes());
        let read = Policy::load(&file).unwrap();
        assert_eq!(read, Policy { name: file.display().to_string(), ..policy.clone() });
        assert_eq!(read.to_bytes(), policy.to_bytes());
        let observed = observed(3);
        let mut driver = read.driver(3);
        let mut found = vec![Vec::new(); 3];
        for (values, extras) in &observed {
            let outputs = driver.outputs(&[0, 1, 2], values, extras);
            for (truck, outputs) in outputs.chunks_exact(4).enumerate() {
                found[truck].push(outputs.to_vec());
            }
        }
        for (truck, found) in found.iter().enumerate() {
            let steps: Vec<_> = observed.iter().map(|(values, extras)| (&values[truck], &extras[truck])).collect();
            assert_eq!(*found, by_definition(&policy, &steps), "{gates:?}");
            assert_ne!(found[1..], by_definition(&policy, &steps[1..])[..], "what came before shows");
        }
    }
}

#[test]
fn a_truck_that_begins_an_episode_remembers_nothing_of_the_last_one() {
    for (gates, padding) in [(Gates::Gru, Padding::Reset), (Gates::Lstm, Padding::Zero)] {
        let policy = remembering(gates, padding);
        let observed = observed(2);
        let mut driver = policy.clone().driver(2);
        observed[..2].iter().for_each(|(values, extras)| drop(driver.outputs(&[0, 1], values, extras)));
        driver.begin(1);
        let mut other = policy.driver(1);
        for (values, extras) in &observed[2..] {
            let both = driver.outputs(&[0, 1], values, extras);
            assert_eq!(both[4..], other.outputs(&[0], &values[1..], &extras[1..]));
        }
    }
}

#[test]
fn what_a_policy_with_a_memory_gives_depends_on_neither_the_other_trucks_nor_their_order_nor_the_threads() {
    let n = 130;
    let observed = observed(n as u32);
    for gates in Gates::ALL {
        let policy = remembering(gates, Padding::Zero);
        let alone: Vec<Vec<f32>> = (0..n)
            .map(|truck| {
                let mut driver = policy.clone().driver(1);
                observed
                    .iter()
                    .flat_map(|(values, extras)| driver.outputs(&[0], &values[truck..=truck], &extras[truck..=truck]))
                    .collect()
            })
            .collect();
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut driver = policy.clone().driver(n);
            for (step, (values, extras)) in observed.iter().enumerate() {
                // Another order at each step.
                let envs: Vec<usize> = (0..n).map(|row| (row * 7 + 11 * step) % n).collect();
                let values: Vec<_> = envs.iter().map(|&env| values[env]).collect();
                let extras: Vec<_> = envs.iter().map(|&env| extras[env]).collect();
                let together = pool.install(|| driver.outputs(&envs, &values, &extras));
                for (outputs, &env) in together.chunks_exact(4).zip(&envs) {
                    assert_eq!(*outputs, alone[env][4 * step..4 * step + 4], "truck {env} on {threads} threads");
                }
            }
        }
    }
}

#[test]
fn a_driver_of_a_policy_without_a_memory_gives_what_the_policy_gives() {
    let all = policy(&[16], 9);
    let mut some = Policy { values: Some(selection(&["speed", "friction", "bearing[2]"])), ..policy(&[], 9) };
    (some.layers, some.normalisation) = (vec![layer(3, 9, 0)], Normalisation::none(3));
    for policy in [all, some] {
        assert!(!policy.has_memory());
        let mut driver = Driver::new(policy.clone(), 4);
        for (values, extras) in observed(4) {
            assert_eq!(driver.act(&[3, 1], &values[..2], &extras[..2]), policy.act_beside(&values[..2], &extras[..2]));
        }
    }
}

#[test]
fn statistics_of_all_frames_normalise_the_stack_with_its_zeros_and_those_of_one_each_frame() {
    let mut policy = Policy { frames: Frames { n: 2, padding: Padding::Zero }, ..policy(&[], 1) };
    policy.values = Some(selection(&["speed"]));
    policy.layers = vec![Layer { weights: vec![1.0, 100.0], biases: vec![0.0] }];
    policy.normalisation = Normalisation { mean: vec![0.5], factor: vec![1.0] };
    let [mut observation, extras] = [[0.0; N_VALUES], [0.0; N_VALUES]];
    observation[0] = 0.75;
    let extras = [std::array::from_fn(|at| extras[at])];
    let first = |policy: &Policy| {
        let read = Policy::from_bytes("test", &policy.to_bytes()).unwrap();
        read.driver(1).outputs(&[0], &[observation], &extras)
    };
    assert_eq!(first(&policy), [0.0 + 100.0 * 0.25]);
    policy.normalisation = Normalisation { mean: vec![0.5; 2], factor: vec![1.0; 2] };
    assert_eq!(first(&policy), [-0.5 + 100.0 * 0.25]);
}

#[test]
fn what_a_policy_reads_and_remembers_is_refused_by_its_key_where_it_cannot_be() {
    let policy = remembering(Gates::Gru, Padding::Reset);
    let refused = |from: &str, to: &str, expected: &str| {
        let message = refusal(&described(&policy, |text| {
            assert!(text.contains(from), "{text}");
            text.replace(from, to)
        }));
        assert!(message.contains(expected), "{expected}: {message}");
    };
    let values = "\"values\":[\"tractor_range\",\"target_speed\",\"trailer_range\"]";
    refused(
        "\"target_speed\"",
        "\"target_sped\"",
        "is a policy with the values \"target_sped\"; must be one of speed, ",
    );
    refused(values, "\"values\":[]", "is a policy with the values none; at least one is needed");
    refused(values, &format!("{values},\"extras\":[\"steering\"]"), "the keys `values` and `extras`");
    refused("\"frames\":3", "\"frames\":0", "is a policy with 0 frames; must lie in 1..1024");
    refused("\"frames\":3", "\"frames\":1025", "is a policy with 1025 frames; must lie in 1..1024");
    refused("\"frames\":3", "\"frames\":4", "actor.0.weight is [90, 8]; [120, 8] is needed");
    refused("\"frames\":3,", "", "with the padding \"reset\" and one frame; leave it out, or give `frames`");
    refused("\"reset\"", "\"ones\"", "is a policy with the padding \"ones\"; must be zero or reset");
    refused("\"gru\"", "\"rnn\"", "is a policy with the gates \"rnn\"; must be gru or lstm");
    refused("\"gru\"", "\"lstm\"", "recurrent.0.weight_ih is [21, 8]; [28, 8] is needed, 4 gates of 7 units");
    refused("\"after\":1", "\"after\":3", "recurrent layers after 3 of 3 layers; one at least must follow");
    refused("\"after\":1", "\"after\":0", "recurrent.0.weight_ih is [21, 8]; [21, 90] is needed");
    refused("\"layers\":2,\"after\"", "\"layers\":0,\"after\"", "it has no layers, far too many, or no actions");
    refused("\"layers\":2,\"after\"", "\"layers\":3,\"after\"", "recurrent.2.weight_ih");
    refused("\"version\":2", "\"version\":1", "version 1 with the key `values`; its version must be 2");
    let mut broken = policy.clone();
    broken.recurrent.as_mut().unwrap().cells[1].hidden.weights[0] = f32::NAN;
    assert!(refusal(&broken.to_bytes()).contains("recurrent.1.weight_hh[0] is NaN; every number must be finite"));
    let mut large = policy;
    large.recurrent.as_mut().unwrap().cells[0].input.weights[0] = 3e38;
    assert!(refusal(&large.to_bytes()).contains("the outputs of recurrent.0 may reach"));
}

#[test]
fn a_changed_bit_of_a_recurrent_layer_is_refused_by_the_checksum() {
    let bytes = remembering(Gates::Lstm, Padding::Zero).to_bytes();
    let mut changed = bytes.clone();
    let last = changed.len() - 1;
    changed[last] ^= 1;
    assert!(refusal(&changed).contains("is damaged: its checksum is"));
}

#[test]
fn a_policy_that_reads_some_values_drives_wherever_these_are_observed() {
    let mut scenario = Scenario::named("attard2023").unwrap();
    let mut check = |track: ObservedExtras, names: &[&str]| {
        scenario.extras = track;
        let world = World::bake(&scenario).unwrap();
        let policy = Policy { actions: world.actions.clone(), values: Some(selection(names)), ..policy(&[], 9) };
        policy.check(&world).map_err(|error| error.to_string())
    };
    for track in [ObservedExtras::None, ObservedExtras::Blind, ObservedExtras::Oracle] {
        assert_eq!(check(track, &["tractor_range", "speed"]), Ok(()));
    }
    assert_eq!(check(ObservedExtras::Mass, &["trailer_roll", "speed"]), Ok(()));
    let message = check(ObservedExtras::Blind, &["steering", "trailer_roll", "trailer_mass"]).unwrap_err();
    let expected =
        "reads trailer_roll, trailer_mass, which the benchmark does not observe: it has the extras steering, ";
    assert!(message.contains(expected), "{message}");
    assert!(message.ends_with("one with the key observation.extras = \"mass\" is needed"), "{message}");
    let message = check(ObservedExtras::None, &["friction"]).unwrap_err();
    assert!(message.contains("it has the extras none; one with the key observation.extras = \"oracle\""), "{message}");
}
