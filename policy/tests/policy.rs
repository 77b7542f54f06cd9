//! Policy files and the network that drives, through the crate's public door.

#![expect(clippy::unwrap_used, reason = "a failure of a test's helper fails the test")]

#[path = "policy/commands.rs"]
mod commands;
#[path = "policy/extras.rs"]
mod extras;
#[path = "policy/memory.rs"]
mod memory;

use std::path::Path;

use offtrack::files::cache::Loading;
use offtrack::layout::random;
use offtrack::layout::{
    Action, EXTRAS, N_AROUND, N_EXTRAS, N_VALUES, OBSERVATION, ObservedExtras, VEHICLE_VALUES, Values,
};
use offtrack::scenario::Scenario;
use offtrack::world::World;
use offtrack_policy::{Activation, Frames, Head, Layer, Normalisation, Policy, greedy};
use proptest::prelude::*;

/// A number in -1..1 of two counters.
fn number(a: u32, b: u32) -> f32 {
    random::words(7, a, b, 0)[0] as f32 / u32::MAX as f32 * 2.0 - 1.0
}

/// Observations that all differ, values in -1..1.
fn observations(n: usize) -> Vec<[f32; N_VALUES]> {
    (0..n).map(|row| std::array::from_fn(|index| number(row as u32, index as u32))).collect()
}

fn policy(hidden: &[usize], n_actions: usize) -> Policy {
    let sizes = [&[N_VALUES], hidden, &[n_actions]].concat();
    let layer = |(index, ends): (usize, &[usize])| Layer {
        weights: (0..ends[0] * ends[1])
            .map(|at| number(at as u32, 1000 + index as u32) * (3.0 / ends[0] as f32).sqrt())
            .collect(),
        biases: (0..ends[1]).map(|at| 0.1 * number(at as u32, 2000 + index as u32)).collect(),
    };
    Policy {
        name: "test".into(),
        benchmark: "attard2023".into(),
        actions: (0..n_actions).map(|index| Action { steering: 0.1 * index as f32 - 0.4, speed: 25.0 / 3.0 }).collect(),
        normalisation: Normalisation::of(&observations(20)),
        layers: sizes.windows(2).enumerate().map(layer).collect(),
        extras: Vec::new(),
        vehicles: false,
        activation: Activation::Relu,
        head: Head::Levels,
        values: None,
        frames: Frames::default(),
        recurrent: None,
    }
}

fn written(bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("policy.safetensors");
    std::fs::write(&file, bytes).unwrap();
    (folder, file)
}

fn refusal(bytes: &[u8]) -> String {
    let (_folder, file) = written(bytes);
    let message = Policy::load(&file).map(|_| ()).unwrap_err().to_string();
    assert!(message.starts_with(file.to_str().unwrap()), "{message}");
    message
}

/// A file of the same tensors with another description. `change` gets the description with `@` in place of the
/// checksum, which is then made right.
fn described(policy: &Policy, change: impl Fn(&str) -> String) -> Vec<u8> {
    let bytes = policy.to_bytes();
    let (_, header) = safetensors::SafeTensors::read_metadata(&bytes).unwrap();
    let tensors = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    let (before, _) = header.metadata().as_ref().unwrap()["offtrack"].split_once("\"checksum\":").unwrap();
    let text = change(&format!("{before}\"checksum\":@}}"));
    let layers =
        (0..policy.layers.len()).flat_map(|layer| ["weight", "bias"].map(|part| format!("actor.{layer}.{part}")));
    let n_cells = policy.recurrent.as_ref().map_or(0, |recurrent| recurrent.cells.len());
    let parts = ["weight_ih", "bias_ih", "weight_hh", "bias_hh"];
    let cells = (0..n_cells).flat_map(|cell| parts.map(|part| format!("recurrent.{cell}.{part}")));
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(text.replace('@', "0").as_bytes());
    for name in ["observation.mean", "observation.factor"].map(str::to_owned).into_iter().chain(layers).chain(cells) {
        hasher.update(tensors.tensor(&name).unwrap().data());
    }
    let text = text.replace('@', &hasher.finalize().to_string());
    safetensors::serialize(tensors.tensors(), Some([("offtrack".to_owned(), text)].into())).unwrap()
}

#[test]
fn the_shipped_policies_are_written_as_they_were_read_byte_for_byte() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("policy/shipped");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), Policy::shipped_names().len());
    for name in Policy::shipped_names() {
        let policy = Policy::shipped(name).unwrap();
        assert_eq!(policy.name, format!("{name} (shipped)"));
        // Two learned by imitation, on roads of an example of the Python package.
        let learned_on = match name {
            "attard2023-lane" => "distil_roads",
            "traffic2026" => "distil_traffic",
            // Refined for any load, and evaluated without one first.
            "traffic2026-laden" => "traffic2026",
            _ => name,
        };
        assert_eq!(policy.benchmark, learned_on);
        assert_eq!(policy.activation, Activation::Relu);
        assert!(policy.to_bytes() == std::fs::read(folder.join(name).join("policy.safetensors")).unwrap(), "{name}");
    }
    let message = Policy::shipped("mine").unwrap_err().to_string();
    let names = "attard2023, attard2023-lane, attard2023-as-run, laden2026, laden2026-50, transfer2026, traffic2026, \
                 traffic2026-laden";
    assert_eq!(message, format!("policy: mine; the program comes with {names}; or give a path"));
    let world = |benchmark: &str| World::bake(&Scenario::named(benchmark).unwrap()).unwrap();
    for (benchmark, expected) in [
        ("attard2023-full", "attard2023"),
        ("attard2023-maps-as-run", "attard2023-as-run"),
        ("laden2026-odd", "laden2026"),
        ("laden2026-50", "laden2026-50"),
        ("transfer2026", "transfer2026"),
        ("traffic2026-random", "traffic2026"),
        ("traffic2026-laden", "traffic2026-laden"),
    ] {
        assert_eq!(Policy::shipped_for(benchmark, &world(benchmark)).unwrap().name, format!("{expected} (shipped)"));
    }
}

#[test]
fn a_policy_read_back_is_the_same_and_chooses_the_same_actions() {
    for activation in Activation::ALL {
        let policy = Policy { activation, ..policy(&[16, 8], 9) };
        let (_folder, file) = written(&policy.to_bytes());
        let read = Policy::load(&file).unwrap();
        assert_eq!(read, Policy { name: file.display().to_string(), ..policy.clone() });
        assert_eq!(read.to_bytes(), policy.to_bytes());
        let mut chosen = read.act(&observations(200));
        assert_eq!(chosen, policy.act(&observations(200)));
        chosen.sort_unstable();
        chosen.dedup();
        assert!(1 < chosen.len(), "a constant policy would pass whatever was read");
    }
}

#[test]
fn a_small_network_gives_the_values_computed_by_hand() {
    // Only the first two values of an observation matter: (0.5 - 0.25) * 2 = 0.5, and 40 is clipped to 10.
    let mut weights = vec![0.0; N_VALUES * 2];
    weights[..4].copy_from_slice(&[1.0, -2.0, 0.1, 0.2]);
    let mut normalisation = Normalisation::none(N_VALUES);
    (normalisation.mean[0], normalisation.factor[0]) = (0.25, 2.0);
    let mut observation = [0.0; N_VALUES];
    (observation[0], observation[1]) = (0.5, 40.0);
    let layers = vec![
        // 0.5 * 1 + 10 * 0.1 - 1 = 0.5; 0.5 * -2 + 10 * 0.2 - 2 = -1.
        Layer { weights, biases: vec![-1.0, -2.0] },
        Layer { weights: vec![2.0, 0.0, 1.0, 1.0, -1.0, 4.0], biases: vec![0.0, 0.25, 0.5] },
    ];
    let (a, b) = (0.462_117_16f32, -0.761_594_2f32); // tanh(0.5), tanh(-1)
    for (activation, expected) in
        [(Activation::Relu, [1.0, 0.25, 1.0]), (Activation::Tanh, [2.0 * a + b, 0.25 - b, a + 4.0 * b + 0.5])]
    {
        let policy =
            Policy { layers: layers.clone(), normalisation: normalisation.clone(), activation, ..policy(&[], 3) };
        let logits = policy.logits(&[observation]);
        assert!(
            logits.iter().zip(expected).all(|(logit, expected)| (logit - expected).abs() < 1e-6),
            "{activation:?}: {logits:?}"
        );
    }
}

/// What the crate says that it computes, one number at a time.
fn chained(policy: &Policy, observation: &[f32; N_VALUES]) -> Vec<f32> {
    let Normalisation { mean, factor } = &policy.normalisation;
    let mut values: Vec<f32> =
        (0..N_VALUES).map(|at| ((observation[at] - mean[at]) * factor[at]).clamp(-10.0, 10.0)).collect();
    for (index, Layer { weights, biases }) in policy.layers.iter().enumerate() {
        let last = index + 1 == policy.layers.len();
        let sum = |output: usize| {
            let terms = values.iter().enumerate();
            terms.fold(0.0f32, |sum, (input, value)| value.mul_add(weights[input * biases.len() + output], sum))
                + biases[output]
        };
        values = (0..biases.len()).map(|output| if last { sum(output) } else { sum(output).max(0.0) }).collect();
    }
    values
}

#[test]
fn the_forward_pass_is_a_chain_of_fused_multiply_adds_to_the_last_bit() {
    let (policy, observations) = (policy(&[33, 16, 7], 9), observations(100));
    let expected: Vec<f32> = observations.iter().flat_map(|observation| chained(&policy, observation)).collect();
    assert_eq!(policy.logits(&observations), expected);
    let mut other = policy;
    other.layers[1].weights[20] = f32::from_bits(other.layers[1].weights[20].to_bits() + 1);
    assert_ne!(other.logits(&observations), expected, "the last bit of a weight shows");
}

#[test]
fn a_rows_result_depends_on_neither_its_neighbours_nor_its_place_nor_the_threads() {
    // Widths around the blocks of the forward pass, which are 16 outputs and 6 rows.
    let policy = Policy { activation: Activation::Tanh, ..policy(&[33, 16, 7], 9) };
    let observations = observations(500);
    let bits = |logits: Vec<f32>| logits.into_iter().map(f32::to_bits).collect::<Vec<u32>>();
    let alone: Vec<u32> = observations.iter().flat_map(|row| bits(policy.logits(&[*row]))).collect();
    assert!(alone.chunks(9).skip(1).all(|row| row != &alone[..9]), "rows differ");
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        for rows in [0..500, 0..5, 3..10, 7..103, 1..49, 250..500, 9..9] {
            let together = pool.install(|| policy.logits(&observations[rows.clone()]));
            assert_eq!(bits(together), alone[rows.start * 9..rows.end * 9], "{rows:?} on {threads} threads");
        }
    }
}

#[test]
fn the_best_action_is_the_first_of_the_highest() {
    assert_eq!(greedy(&[0.0, 2.0, 2.0, 5.0, -1.0, 4.0], 3), [1, 0]);
}

#[test]
fn a_policy_of_another_action_table_is_refused_by_the_world() {
    let world = World::bake(&Scenario::named("attard2023").unwrap()).unwrap();
    let mut policy = Policy::shipped("attard2023").unwrap();
    policy.check(&world).unwrap();
    policy.actions[3].steering += 0.01;
    let message = policy.check(&world).unwrap_err().to_string();
    assert!(message.starts_with("attard2023 (shipped): learned with another action table: action 3 is "), "{message}");
    policy.actions.truncate(8);
    let message = policy.check(&world).unwrap_err().to_string();
    assert!(message.contains("another action table: 8 actions, -32.0..24.0 deg"), "{message}");
}

#[test]
fn a_missing_or_empty_file_and_one_of_another_format_are_refused_by_name() {
    let missing = Policy::load(Path::new("no/such.safetensors")).map(|_| ()).unwrap_err().to_string();
    assert!(missing.starts_with("no/such.safetensors: cannot be read"), "{missing}");
    assert!(refusal(b"").contains("is not a policy file"));
    assert!(refusal(b"benchmark = \"attard2023\"\n").contains("is not a policy file"));
    let numbers = [0u8; 8];
    let view = safetensors::tensor::TensorView::new(safetensors::Dtype::F32, vec![2], &numbers).unwrap();
    assert!(refusal(&safetensors::serialize([("weight", view)], None).unwrap()).contains("no entry `offtrack`"));
}

#[test]
fn a_folder_or_a_device_in_place_of_a_policy_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for file in [folder.path(), Path::new("/dev/zero")] {
        let message = Policy::load(file).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains("is not a regular file"), "{message}");
    }
}

#[test]
fn a_policy_of_another_shape_is_refused_with_the_tensor_and_what_is_needed() {
    let refused = |change: &dyn Fn(&mut Policy), expected: &str| {
        let mut other = policy(&[8, 7], 9);
        change(&mut other);
        let message = refusal(&other.to_bytes());
        assert!(message.contains("is a policy of another shape: ") && message.ends_with(expected), "{message}");
    };
    refused(&|policy| policy.normalisation.mean.truncate(40), "observation.mean is [40]; an observation has 69 values");
    refused(&|policy| policy.normalisation.factor.clear(), "observation.factor is [0]; an observation has 69 values");
    refused(&|policy| policy.actions.truncate(8), "its last layer has 9 outputs, and its action table 8 actions");
    refused(
        &|policy| policy.layers.rotate_left(1),
        "actor.0.weight is [8, 7]; [69, 7] is needed, inputs before outputs",
    );
    // The order in which PyTorch keeps weights.
    let swapped = policy(&[8], 8).layers.remove(0);
    let outputs_first = Layer { weights: swapped.weights, biases: vec![0.0; N_VALUES] };
    refused(
        &|policy| policy.layers[0] = outputs_first.clone(),
        "actor.0.weight is [8, 69]; [69, 69] is needed, inputs before outputs",
    );
    // Seven values lead to nine actions with one layer fewer as well.
    let mut fewer = policy(&[8, 8], 9);
    fewer.layers.remove(1);
    assert_eq!(Policy::from_bytes("fewer", &fewer.to_bytes()).unwrap().layers.len(), 2);
}

#[test]
fn a_policy_with_a_number_that_is_not_finite_is_refused_by_its_tensor() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let refused = |change: &dyn Fn(&mut Policy), expected: &str| {
            let mut broken = policy(&[8], 9);
            change(&mut broken);
            let message = refusal(&broken.to_bytes());
            assert!(message.contains(&format!("is a policy that cannot drive: {expected} is {value}")), "{message}");
        };
        refused(&|policy| policy.normalisation.mean[3] = value, "observation.mean[3]");
        refused(&|policy| policy.layers[1].weights[5] = value, "actor.1.weight[5]");
        refused(&|policy| policy.layers[0].biases[2] = value, "actor.0.bias[2]");
    }
}

#[test]
fn a_description_may_be_written_in_any_order_and_with_other_numbers_as_long_as_its_checksum_is_of_its_text() {
    let policy = Policy { benchmark: "\"checksum\": 5, \\".into(), ..policy(&[8], 1) };
    let whole = described(&policy, str::to_owned);
    assert!(whole == policy.to_bytes());
    // As a Python program would write it: blanks, another order, numbers in double precision.
    let other = described(&policy, |_| {
        r#"{"checksum" : @, "activation": "relu", "actions": [[-0.4000000059604645, 8.333333015441895]], "layers": 2, "version": 1,
            "benchmark": "\"checksum\": 5, \\"}"#
            .to_owned()
    });
    assert_eq!(Policy::from_bytes("test", &other).unwrap(), policy);
    // A digit of the text that the checksum covers.
    let at = other.windows(6).position(|window| window == b"0.4000").unwrap();
    let mut changed = other.clone();
    changed[at + 2] = b'5';
    let message = refusal(&changed);
    assert!(message.contains("is damaged: its checksum is"), "{message}");
}

#[test]
fn an_unknown_activation_key_or_version_is_refused_by_its_word() {
    let policy = policy(&[8], 9);
    let refused = |from: &str, to: &str, expected: &str| {
        let message = refusal(&described(&policy, |text| {
            assert!(text.contains(from));
            text.replace(from, to)
        }));
        assert!(message.contains(expected), "{message}");
    };
    let layers = "\"layers\":2";
    refused(
        layers,
        "\"layers\":2,\"activation\":\"gelu\"",
        "is a policy with the activation \"gelu\"; must be relu or tanh",
    );
    refused(layers, "\"layers\":2,\"activaton\":\"tanh\"", "unknown field `activaton`");
    refused("\"version\":1", "\"version\":3", "is a policy file of version 3; this program reads versions 1 and 2");
    refused(layers, "\"layers\":0", "it has no layers, far too many, or no actions");
    refused(layers, "\"layers\":3", "actor.2.weight");
}

#[test]
fn every_flipped_byte_and_every_truncation_is_refused_or_harmless() {
    let bytes = Policy { activation: Activation::Tanh, ..policy(&[3], 2) }.to_bytes();
    let mut harmless = 0;
    for index in 0..bytes.len() {
        for flip in [1u8, 0x10, 0x80, 0xff] {
            let mut changed = bytes.clone();
            changed[index] ^= flip;
            match Policy::from_bytes("changed", &changed) {
                Err(_) => {}
                // Blanks in the header, and the order of its keys, mean nothing.
                Ok(policy) => {
                    assert_eq!(policy.to_bytes(), bytes, "byte {index} ^ {flip}");
                    harmless += 1;
                }
            }
        }
        assert!(Policy::from_bytes("cut", &bytes[..index]).is_err(), "cut to {index} bytes");
    }
    assert!(harmless < 40, "{harmless}");
}

proptest! {
    #[test]
    fn bytes_changed_at_random_never_panic_and_never_give_another_policy(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
    ) {
        let bytes = policy(&[3], 2).to_bytes();
        let mut changed = bytes.clone();
        for (index, value) in &changes {
            changed[index.index(bytes.len())] = *value;
        }
        if let Ok(policy) = Policy::from_bytes("changed", &changed) {
            prop_assert_eq!(policy.to_bytes(), bytes.clone());
        }
        changed.truncate(cut.index(bytes.len()));
        prop_assert!(Policy::from_bytes("cut", &changed).is_err());
    }

    #[test]
    fn random_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(Policy::from_bytes("random", &bytes).is_err());
    }
}
