//! Checkpoints whose checksum is right and whose contents are not: refused by their column, or blamed for what follows.
#![cfg(unix)]

use serde_json::Value;

use crate::place::{refusal, succeed};
use crate::resume::{ENDLESS, begun, bytes, interrupted, place, refine, resume, resumed, wait_until};

/// A checkpoint with its column `name` changed, and the checksum that goes with it: as a program with a fault would
/// have written it.
fn with_column(whole: &[u8], name: &str, change: impl FnOnce(&mut [u8])) -> Vec<u8> {
    let n = u64::from_le_bytes(whole[..8].try_into().unwrap()) as usize;
    let mut header: Value = serde_json::from_slice(&whole[8..8 + n]).unwrap();
    let mut body = whole[8 + n..].to_vec();
    let range = |header: &Value, name: &str| {
        let offsets = &header[name]["data_offsets"];
        offsets[0].as_u64().unwrap() as usize..offsets[1].as_u64().unwrap() as usize
    };
    change(&mut body[range(&header, name)]);
    let mut description: serde_json::Map<String, Value> =
        serde_json::from_str(header["__metadata__"]["offtrack-checkpoint"].as_str().unwrap()).unwrap();
    // CRC-32 of the description with a 0 for it, then each column's name and bytes in the order of names.
    let text = |checksum: u64, description: &serde_json::Map<String, Value>| {
        let config = serde_json::to_string(&description["config"]).unwrap();
        format!(
            r#"{{"version":{},"config":{config},"world":{},"checksum":{checksum}}}"#,
            description["version"], description["world"]
        )
    };
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(text(0, &description).as_bytes());
    let mut names: Vec<String> =
        header.as_object().unwrap().keys().filter(|name| *name != "__metadata__").cloned().collect();
    names.sort();
    for name in names {
        hasher.update(name.as_bytes());
        hasher.update(&body[range(&header, &name)]);
    }
    description["checksum"] = hasher.finalize().into();
    header["__metadata__"]["offtrack-checkpoint"] =
        text(description["checksum"].as_u64().unwrap(), &description).into();
    let mut header = serde_json::to_vec(&header).unwrap();
    header.resize(header.len().next_multiple_of(8), b' ');
    [&(header.len() as u64).to_le_bytes()[..], &header, &body].concat()
}

#[test]
fn a_checkpoint_with_a_right_checksum_and_wrong_contents_is_refused_by_its_column() {
    let place = place();
    succeed(&place.train(&["--name", "run", "--steps", "1200"]));
    let file = "runs/run/checkpoint.safetensors";
    let whole = bytes(&place, file);
    let cases: [(&str, &[u8], &str); 17] = [
        ("actor, layer 1, weight", &f32::NAN.to_le_bytes(), "`actor, layer 1, weight` has NaN at 0"),
        ("entropy coefficient", &f32::INFINITY.to_le_bytes(), "`entropy coefficient` has inf at 0"),
        ("normalisation, mean", &f32::NAN.to_le_bytes(), "`normalisation, mean` has NaN"),
        ("replay buffer, action", &77u32.to_le_bytes(), "`replay buffer, action` has action 77; the table has 0..4"),
        ("replay buffer, reward", &f32::NAN.to_le_bytes(), "`replay buffer, reward` has NaN"),
        ("replay buffer, reward", &1e38f32.to_le_bytes(), "`replay buffer, reward` has 1e38, which no run makes"),
        (
            "replay buffer, observation",
            &1e38f32.to_le_bytes(),
            "`replay buffer, observation` has 1e38, which no run makes",
        ),
        ("batch, observation", &f32::NAN.to_le_bytes(), "observation"),
        ("replay buffer, after", &[9], "`replay buffer, after` has an unknown code"),
        ("replay buffer, after", &[2], "`replay buffer, truncated rows` does not list the rows"),
        ("replay buffer, priorities", &f64::NAN.to_le_bytes(), "`replay buffer, priorities` has NaN"),
        ("replay buffer, priorities", &(-1.0f64).to_le_bytes(), "`replay buffer, priorities` has one that is negative"),
        (
            "replay buffer, priorities",
            &0f64.to_le_bytes(),
            "`replay buffer, priorities` has one where none may be, or lacks one",
        ),
        ("rollout, acting", &[0; 32], "`rollout, acting` is all zeros"),
        ("batch, action", &77u32.to_le_bytes(), "action[0]: 77"),
        ("batch, truck", &f32::NAN.to_le_bytes(), "truck[0].position[0]: NaN; must lie in "),
        ("batch, reward", &f32::INFINITY.to_le_bytes(), "reward[0]: inf; must lie in "),
    ];
    for (column, value, expected) in cases {
        std::fs::write(
            place.file(file),
            with_column(&whole, column, |bytes| bytes[..value.len()].copy_from_slice(value)),
        )
        .unwrap();
        let message = refusal(&resume(&place, "run", &ENDLESS), 2);
        assert!(message.contains(file) && message.contains(expected), "{column}: {message}");
    }
    // The change itself is sound: with the same bytes the run continues.
    std::fs::write(place.file(file), with_column(&whole, "rollout, acting", |_| ())).unwrap();
    succeed(&resume(&place, "run", &["--steps", "1300"]));
}

#[test]
fn a_checkpoint_that_a_run_fails_by_is_not_called_the_last_good_one() {
    let place = place();
    succeed(&place.train(&["--name", "run", "--steps", "1200"]));
    let file = "runs/run/checkpoint.safetensors";
    let whole = bytes(&place, file);
    // Finite, and beyond all that can be computed with.
    let damaged = with_column(&whole, "critic 1, layer 1, weight", |bytes| {
        bytes.chunks_exact_mut(4).for_each(|number| number.copy_from_slice(&3e38f32.to_le_bytes()));
    });
    std::fs::write(place.file(file), &damaged).unwrap();
    let message = refusal(&resume(&place, "run", &ENDLESS), 1);
    assert!(
        message.contains("training has diverged; it continued from ")
            && message.contains("so that one may be at fault"),
        "{message}"
    );
    assert!(!message.contains("last good"), "{message}");
    assert!(bytes(&place, file) == damaged);
}

#[test]
fn a_refined_run_that_goes_on_is_refined_from_the_first_step_on() {
    let place = place();
    refine(&place);
    succeed(&place.train(&["--name", "run", "--steps", "12000"]));
    let newest = || {
        let files = std::fs::read_dir(place.file("runs/run/policies")).unwrap();
        let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name.ends_with(".safetensors")).max().unwrap()
    };
    let policy = |name: &str| bytes(&place, &format!("runs/run/policies/{name}"));
    let (before, known) = (newest(), policy(&newest()));
    // The next policy is kept at a twentieth of the new budget, long before a refinement would begin.
    let run = begun(resumed(&place, "run", &["--steps", "600000"]));
    wait_until("a later policy", || before < newest());
    succeed(&interrupted(run));
    assert!(newest().as_str() < "000000150000" && policy(&newest()) != known, "{before} {}", newest());
    let message = refusal(&resume(&place, "run", &["--steps", "10"]), 2);
    assert!(message.contains("--steps 10: steps: 10; must be "), "{message}");
}
