//! What runs and evaluations do where they cannot write.
#![cfg(unix)]

use std::process::Command;

use crate::place::{CACHE, Place, refusal, succeed};
use crate::resume::{ENDLESS, begun, bytes, interrupted, place, resume, resumed, wait_until};

#[test]
fn what_cannot_be_written_is_reported_once_and_written_once_it_can_be() {
    let place = place();
    // Without validation, which would keep the policy that it has.
    succeed(&place.train(&["--name", "run", "--steps", "800", "--set", "validation="]));
    // A folder where the next checkpoint is to be written.
    let (part, checkpoint) = (place.file("runs/run/checkpoint.part"), "runs/run/checkpoint.safetensors");
    std::fs::create_dir(&part).unwrap();
    // A file where the folder of kept policies was.
    let policies = place.file("runs/run/policies");
    std::fs::remove_dir_all(&policies).unwrap();
    std::fs::write(&policies, "").unwrap();
    let before = bytes(&place, checkpoint);
    let run = begun(resumed(&place, "run", &ENDLESS));
    let policy = bytes(&place, "runs/run/policy.safetensors");
    wait_until("another policy", || bytes(&place, "runs/run/policy.safetensors") != policy);
    assert!(bytes(&place, checkpoint) == before);
    std::fs::remove_dir(&part).unwrap();
    wait_until("another checkpoint", || bytes(&place, checkpoint) != before);
    std::fs::remove_file(&policies).unwrap();
    wait_until("a kept policy", || policies.join("policies.json").is_file());
    let output = interrupted(run);
    succeed(&output);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(said.matches("checkpoint.safetensors: cannot be written").count(), 1, "{said}");
    assert_eq!(said.matches("policies: cannot be written").count(), 1, "{said}");
}

#[test]
fn a_full_disk_fails_a_run_only_at_its_end_after_the_evaluation() {
    let place = place();
    // Files of at most 500 blocks of 512 bytes: all fit but the checkpoint.
    let program = env!("CARGO_BIN_EXE_offtrack");
    let (training, runs) = (place.text("tiny.toml"), place.text("runs"));
    let line = format!("trap '' XFSZ; ulimit -f 500; exec {program} train {training} --out {runs} --name run");
    let output = Command::new("sh").env("OFFTRACK_CACHE", CACHE).args(["-c", &line]).output().unwrap();
    let message = refusal(&output, 1);
    // So short a run may meet the full disk at its end alone.
    assert!(message.matches("training goes on").count() <= 1, "{message}");
    assert!(
        message.lines().last().unwrap().contains("checkpoint.safetensors: cannot be written: File too large"),
        "{message}"
    );
    assert!(!place.file("runs/run/checkpoint.part").exists());
    // One from the beginning, when the replay buffer was small, may have fitted: it is whole, and with room the run
    // continues from it.
    if place.file("runs/run/checkpoint.safetensors").exists() {
        succeed(&resume(&place, "run", &[]));
    }
    succeed(&place.evaluate(&["--policy", &place.text("runs/run/policy.safetensors"), "--episodes", "1"]));
    assert_eq!(place.json("runs/run/report.json")["evaluation"]["split"], "test");
}

#[test]
fn a_report_that_cannot_be_written_is_a_failure() {
    let place = Place::new();
    let below_a_file = place.text("tiny.toml/report.json");
    let said = refusal(&place.evaluate(&["--policy", "random", "--episodes", "1", "--json", &below_a_file]), 1);
    assert!(said.contains(&below_a_file) && said.contains("cannot be written"), "{said}");
    for flag in ["--json", "--html", "--actions"] {
        let said = refusal(&place.evaluate(&["--policy", "random", flag, &place.text("")]), 2);
        assert!(said.contains(flag) && said.contains("is a folder; a file is needed"), "{said}");
    }
    let said = refusal(&place.evaluate(&["--policy", "random", "--films", &place.text("tiny.toml")]), 2);
    assert!(said.contains("tiny.toml: is a file; a folder is needed"), "{said}");
}

#[cfg(target_os = "linux")]
#[test]
fn the_table_and_the_other_files_are_there_where_one_cannot_be_written() {
    let place = Place::new();
    let actions = place.text("actions.json");
    let evaluated =
        place.evaluate(&["--policy", "random", "--episodes", "1", "--json", "/dev/full", "--actions", &actions]);
    assert!(refusal(&evaluated, 1).contains("/dev/full"));
    assert!(String::from_utf8_lossy(&evaluated.stdout).contains("20m/W-left-3"), "{evaluated:?}");
    assert_eq!(place.json("actions.json")["episodes"].as_array().unwrap().len(), 2);
}
