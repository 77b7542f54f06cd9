//! `offtrack train --seeds`: several seeds, compared, stopped and gone on with.
#![cfg(unix)]

use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::json;

use crate::place::{CACHE, Place, offtrack, refusal, succeed};

const NAME: [&str; 2] = ["--name", "many"];

fn bytes(place: &Place, file: &str) -> Vec<u8> {
    std::fs::read(place.file("runs").join(file)).unwrap()
}

#[test]
fn each_seed_has_its_folder_and_all_are_compared() {
    let place = Place::new();
    let also = format!("also_evaluate=[\"{}/train\"]", place.text("short.toml"));
    let output = place.train(&[&NAME[..], &["--seeds", "5..6", "--set", &also]].concat());
    succeed(&output);
    succeed(&place.train(&["--name", "one", "--seed", "6", "--set", &also]));
    assert!(bytes(&place, "many/seed-6/policy.safetensors") == bytes(&place, "one/policy.safetensors"));
    assert!(bytes(&place, "many/seed-5/policy.safetensors") != bytes(&place, "one/policy.safetensors"));
    let seeds = place.json("runs/many/seeds.json");
    assert_eq!(seeds["seeds"], json!([5, 6]));
    let evaluations = seeds["evaluations"].as_array().unwrap();
    assert_eq!(evaluations.len(), 2);
    for (evaluation, (name, trained_on, pointer)) in evaluations.iter().zip([
        ("test", 0, "/evaluation/lane_distance_mean_arrived"),
        ("train", 1, "/also/0/lane_distance_mean_arrived"),
    ]) {
        assert_eq!(
            (&evaluation["benchmark"], &evaluation["split"], &evaluation["trained_on"]),
            (&json!("short"), &json!(name), &json!(trained_on))
        );
        let each: Vec<f64> = [0, 1].map(|index| evaluation["seeds"][index]["success"].as_f64().unwrap()).to_vec();
        assert_eq!(evaluation["success_mean"].as_f64().unwrap(), (each[0] + each[1]) / 2.0);
        assert_eq!(evaluation["success_worst"].as_f64().unwrap(), each[0].min(each[1]));
        let of_run = place.json("runs/many/seed-6/report.json").pointer(pointer).unwrap().clone();
        assert_eq!(evaluation["seeds"][1]["lane_distance_mean_arrived"], of_run);
    }
    assert!(0.0 < seeds["runs"][0]["seconds"].as_f64().unwrap());
    let said = String::from_utf8(output.stdout).unwrap();
    for begin in
        ["seed 5, 1 of 2: ", "seed 6, 2 of 2: ", "| seed ", "| 5 ", "| 6 ", "| mean ", "| worst ", "| 95 % interval "]
    {
        assert_eq!(said.lines().filter(|line| line.starts_with(begin)).count(), 1, "{begin}: {said}");
    }
    assert!(
        String::from_utf8(output.stderr).unwrap().contains("% seed 6, 2 of 2: "),
        "the progress says which seed it is"
    );
}

#[test]
fn a_stopped_command_goes_on_with_the_seed_in_hand() {
    let place = Place::new();
    let training = std::fs::read_to_string(place.file("tiny.toml")).unwrap();
    std::fs::write(place.file("tiny.toml"), format!("checkpoint_minutes = 0.0001\n{training}")).unwrap();
    let arguments = [&NAME[..], &["--seeds", "5,6", "--steps", "40000"]].concat();
    let run = place.training(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let metrics = place.file("runs/many/seed-6/metrics.csv");
    // A minute is far more than a tiny run needs on a busy machine.
    for _ in 0..12_000 {
        if std::fs::read_to_string(&metrics).is_ok_and(|rows| 2 < rows.lines().count()) {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap().success());
    let output = run.wait_with_output().unwrap();
    succeed(&output);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("stopped: 1 of 2 seeds have finished; the same command with --name many continues"),
        "{said}"
    );
    assert_eq!(place.json("runs/many/seeds.json")["runs"].as_array().unwrap().len(), 1);
    assert_eq!(place.json("runs/many/seed-6/report.json")["interrupted"], true);
    let finished = bytes(&place, "many/seed-5/checkpoint.safetensors");
    let output = place.train(&arguments);
    succeed(&output);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("seed 6, 2 of 2: ") && said.contains("continuing after ") && !said.contains("seed 5, 1 of 2: "),
        "{said}"
    );
    assert!(bytes(&place, "many/seed-5/checkpoint.safetensors") == finished);
    assert_eq!(place.json("runs/many/seed-6/report.json")["env_steps"], 40_000);
    assert_eq!(place.json("runs/many/seeds.json")["runs"].as_array().unwrap().len(), 2);
}

#[test]
fn seeds_that_cannot_be_compared_are_refused_and_more_can_be_added() {
    let place = Place::new();
    let train = |arguments: &[&str]| place.train(&[&NAME[..], arguments].concat());
    for (arguments, expected) in [
        (&["--seeds", "6..5"][..], "--seeds: 6..5; a range as in 20..24"),
        (&["--seeds", "5..6", "--envs", "0"][..], "n_envs: 0; must lie in"),
        (&["--seeds", "5..6", "--seed", "3"][..], "cannot be used with '--seed"),
    ] {
        let message = refusal(&train(arguments), 2);
        assert!(message.contains(expected), "{message}");
        assert!(!place.file("runs").exists());
    }
    succeed(&train(&["--seeds", "5"]));
    for (arguments, expected) in [
        (
            &["--seeds", "5,7", "--set", "learning.gamma=0.9"][..],
            "seed-5/config.toml: learning.gamma: 0.97; now it would be 0.9",
        ),
        (&["--seeds", "5,7", "--minutes", "1"][..], "seed-5/config.toml: minutes: nothing; now it would be 1"),
        (&["--seeds", "6..7"][..], "--seeds: 6..7; "),
        (&["--seed", "5"][..], "exists and is never overwritten"),
    ] {
        let message = refusal(&train(arguments), 2);
        assert!(message.contains(expected), "{message}");
    }
    succeed(&train(&["--seeds", "5,7"]));
    assert_eq!(place.json("runs/many/seeds.json")["runs"].as_array().unwrap().len(), 2);
    succeed(&place.train(&["--name", "alone"]));
    let message = refusal(&place.train(&["--name", "alone", "--seeds", "5"]), 2);
    assert!(message.contains("exists and is never overwritten"), "{message}");
    let message = refusal(&offtrack(&["train", "--resume", &place.text("runs/alone"), "--seeds", "5"]), 2);
    assert!(message.contains("cannot be used with '--seeds"), "{message}");
}

#[test]
fn a_folder_whose_list_of_seeds_was_lost_or_could_not_be_written_is_gone_on_with() {
    let place = Place::new();
    // No file may have a byte: as on a full disk nothing is left that would be in the way.
    let (program, training, runs) = (env!("CARGO_BIN_EXE_offtrack"), place.text("tiny.toml"), place.text("runs"));
    let full = format!("trap '' XFSZ; ulimit -f 0; exec {program} train {training} --out {runs} --name many --seeds 5");
    let output = Command::new("sh").env("OFFTRACK_CACHE", CACHE).args(["-c", &full]).output().unwrap();
    let message = refusal(&output, 1);
    assert!(message.contains("seeds.json: cannot be written"), "{message}");
    assert!(!place.file("runs/many").exists());
    // An empty one, of a command that was killed.
    std::fs::create_dir_all(place.file("runs/many")).unwrap();
    let train = |seeds: &str| place.train(&[&NAME[..], &["--seeds", seeds]].concat());
    succeed(&train("5"));
    std::fs::remove_file(place.file("runs/many/seeds.json")).unwrap();
    let message = refusal(&train("6"), 2);
    assert!(message.contains("--seeds: 6; ") && message.contains("many has seed 5 too: name it as well"), "{message}");
    let finished = bytes(&place, "many/seed-5/checkpoint.safetensors");
    succeed(&train("5,6"));
    assert!(bytes(&place, "many/seed-5/checkpoint.safetensors") == finished);
    assert_eq!(place.json("runs/many/seeds.json")["runs"].as_array().unwrap().len(), 2);
    // What has anything else in it is no such folder.
    std::fs::remove_file(place.file("runs/many/seeds.json")).unwrap();
    std::fs::write(place.file("runs/many/notes.txt"), "").unwrap();
    let message = refusal(&train("5,6"), 2);
    assert!(message.contains("exists and is never overwritten"), "{message}");
}
