use super::*;
use offtrack::layout::N_VALUES;
use proptest::prelude::*;
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};

fn policy(hidden: &[usize], n_actions: usize) -> LearnedPolicy {
    let rng = &mut SmallRng::seed_from_u64(3);
    let sizes: Vec<usize> = [N_VALUES].into_iter().chain(hidden.iter().copied()).chain([n_actions]).collect();
    let observations: Vec<[f32; N_VALUES]> = (0..20).map(|_| std::array::from_fn(|_| rng.random())).collect();
    LearnedPolicy {
        name: "test".into(),
        benchmark: "attard2023".into(),
        actions: (0..n_actions).map(|index| Action { steering: 0.1 * index as f32 - 0.4, speed: 25.0 / 3.0 }).collect(),
        normalisation: Normalisation::of(&observations),
        actor: Mlp::new(&sizes, 1.0, rng, &Device::flex()),
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
    let message = LearnedPolicy::load(&file).map(|_| ()).unwrap_err().to_string();
    assert!(message.starts_with(file.to_str().unwrap()), "{message}");
    message
}

#[test]
fn a_policy_read_back_chooses_the_same_actions() {
    let policy = policy(&[16, 8], 9);
    let rng = &mut SmallRng::seed_from_u64(4);
    let observations: Vec<[f32; N_VALUES]> = (0..200).map(|_| std::array::from_fn(|_| rng.random())).collect();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("policy.safetensors");
    crate::files::write_whole(&file, &policy.to_bytes()).unwrap();
    let read = LearnedPolicy::load(&file).unwrap();
    assert_eq!(read.to_bytes(), policy.to_bytes());
    assert_eq!(read.act(&observations), policy.act(&observations));
    let mut chosen = read.act(&observations);
    chosen.sort_unstable();
    chosen.dedup();
    assert!(1 < chosen.len(), "a constant policy would pass whatever was read");
}

#[test]
fn a_missing_or_empty_file_and_one_of_another_format_are_refused_by_name() {
    let missing = LearnedPolicy::load(Path::new("no/such.safetensors")).map(|_| ()).unwrap_err().to_string();
    assert!(missing.starts_with("no/such.safetensors: cannot be read"), "{missing}");
    assert!(refusal(b"").contains("is not a policy file"));
    assert!(refusal(b"benchmark = \"attard2023\"\n").contains("is not a policy file"));
    let other = serialize_without_description();
    assert!(refusal(&other).contains("no entry `offtrack`"));
}

fn serialize_without_description() -> Vec<u8> {
    let numbers = [0u8; 8];
    let view = safetensors::tensor::TensorView::new(safetensors::Dtype::F32, vec![2], &numbers).unwrap();
    safetensors::serialize([("weight", view)], None).unwrap()
}

#[test]
fn a_policy_of_another_shape_is_refused() {
    let mut other = policy(&[8], 9);
    other.normalisation.mean.truncate(40);
    assert!(refusal(&other.to_bytes()).contains("another shape: 40 observation values"));
    let mut other = policy(&[8], 9);
    other.actions.pop();
    assert!(refusal(&other.to_bytes()).contains("8 actions are needed"));
    let mut other = policy(&[8, 8], 9);
    other.actor.layers.remove(1);
    assert_eq!(refusal_or_none(&other.to_bytes()), None, "8 values lead to 9 actions with one layer fewer as well");
    other.actor.layers.remove(0);
    assert!(refusal(&other.to_bytes()).contains("another shape"));
}

fn refusal_or_none(bytes: &[u8]) -> Option<String> {
    let (_folder, file) = written(bytes);
    LearnedPolicy::load(&file).err().map(|error| error.to_string())
}

#[test]
fn every_flipped_byte_and_every_truncation_is_refused_or_harmless() {
    let policy = policy(&[3], 2);
    let bytes = policy.to_bytes();
    let mut harmless = 0;
    for index in 0..bytes.len() {
        for flip in [1u8, 0x10, 0x80, 0xff] {
            let mut changed = bytes.clone();
            changed[index] ^= flip;
            match Contents::from_bytes(&changed) {
                Err(_) => {}
                // Blanks in the header, and the order of its keys, mean nothing.
                Ok(contents) => {
                    assert_eq!(contents.to_bytes(), bytes, "byte {index} ^ {flip}");
                    harmless += 1;
                }
            }
        }
        assert!(Contents::from_bytes(&bytes[..index]).is_err(), "cut to {index} bytes");
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
        if let Ok(contents) = Contents::from_bytes(&changed) {
            prop_assert_eq!(contents.to_bytes(), bytes.clone());
        }
        changed.truncate(cut.index(bytes.len()));
        prop_assert!(Contents::from_bytes(&changed).is_err());
    }

    #[test]
    fn random_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(Contents::from_bytes(&bytes).is_err());
    }
}

#[test]
fn the_best_action_is_the_first_of_the_highest() {
    assert_eq!(greedy(&[0.0, 2.0, 2.0, 5.0, -1.0, 4.0], 3), [1, 0]);
}

#[test]
fn actions_are_sampled_with_their_probabilities() {
    let probs = [0.1f32, 0.6, 0.05, 0.25];
    let logits: Vec<f32> = probs.map(|prob| prob.ln() + 30.0).repeat(40_000);
    let actions = sampled(&logits, 4, &mut SmallRng::seed_from_u64(9));
    for (action, prob) in probs.into_iter().enumerate() {
        let frequency = actions.iter().filter(|&&drawn| drawn as usize == action).count() as f32 / 40_000.0;
        // Four standard deviations of a frequency over 40,000 samples.
        assert!((frequency - prob).abs() < 4.0 * (prob * (1.0 - prob) / 40_000.0).sqrt(), "{action}: {frequency}");
    }
}

#[test]
fn a_policy_with_a_number_that_is_not_finite_is_refused_by_its_tensor() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut broken = policy(&[8], 9);
        broken.normalisation.mean[3] = value;
        assert!(refusal(&broken.to_bytes()).contains(&format!("observation.mean[3] is {value}")));
        let mut contents = Contents::from_bytes(&policy(&[8], 9).to_bytes()).unwrap();
        contents.layers[1].0[5] = value;
        assert!(refusal(&contents.to_bytes()).contains(&format!("actor.1.weight[5] is {value}")));
        contents.layers[1].0[5] = 0.0;
        contents.layers[0].1[2] = value;
        assert!(refusal(&contents.to_bytes()).contains(&format!("actor.0.bias[2] is {value}")));
    }
}

#[test]
fn shipped_policies_are_part_of_the_library_and_an_unknown_name_lists_them() {
    for name in LearnedPolicy::shipped_names() {
        let policy = LearnedPolicy::shipped(name).unwrap();
        assert_eq!((policy.benchmark.as_str(), policy.name), (name, format!("{name} (shipped)")));
    }
    let message = LearnedPolicy::shipped("mine").map(|_| ()).unwrap_err().to_string();
    assert_eq!(message, "policy: mine; policies come with the program for attard2023, attard2023-as-run");
    assert_eq!(LearnedPolicy::shipped_or_default("mine").unwrap().benchmark, "attard2023");
}

#[test]
fn a_folder_or_a_device_in_place_of_a_policy_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for file in [folder.path(), Path::new("/dev/zero")] {
        let message = LearnedPolicy::load(file).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains("is not a regular file"), "{message}");
    }
}
