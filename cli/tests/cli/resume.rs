//! `offtrack train --resume`: a run that was stopped, killed or hindered goes on as if nothing had been.
#![cfg(unix)]

use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::place::{Place, offtrack, program, refusal, succeed};

pub const ENDLESS: [&str; 2] = ["--steps", "1000000000"];
/// Columns of the metrics that depend on the clock.
const TIMES: [&str; 3] = ["seconds", "steps_per_second", "updates_per_second"];

/// A place whose runs write a checkpoint every few milliseconds, and use what needs most state.
pub fn place() -> Place {
    let place = Place::new();
    let training = std::fs::read_to_string(place.file("tiny.toml")).unwrap();
    let state = "exploration = { initial_fraction = 0.5, final_fraction = 0.1, steps = 1200, spread = 1.0 }\n";
    let replay = "level_replay = { fraction = 0.5, rate = 0.2 }\n";
    let buffer = "warmup = 400, priority = { exponent = 0.6, correction = 0.4 }";
    let changed = training.replace("warmup = 400", buffer).replace("layer_norm = false", "layer_norm = true");
    std::fs::write(place.file("tiny.toml"), format!("checkpoint_minutes = 0.0001\n{state}{replay}{changed}")).unwrap();
    place.validate(20, 2);
    place
}

/// Lets runs end with a refinement, from a quarter on.
pub fn refine(place: &Place) {
    let refinement = "[refinement]\nbegin = 0.25\nframes = 3\nn_steps = 8\nepochs = 2\nbatch = 32\ngamma = 0.97\n\
                      gae_lambda = 0.9\nclip = 0.2\nadvantage_limit = 4.0\nentropy_coefficient = 0.003\n\
                      actor_learning_rate = 3e-4\ncritic_learning_rate = 1e-3\nfinal_learning_rate_fraction = 0.1\n\
                      actor_ema_rate = 0.1\ncritic_iterations = 4\nclearance_power = 2.0\n\
                      reward = { waypoint = 0.0, clearance_limit = 0.5 }\n";
    let training = std::fs::read_to_string(place.file("tiny.toml")).unwrap();
    std::fs::write(place.file("tiny.toml"), format!("{training}\n{refinement}")).unwrap();
}

pub fn resumed(place: &Place, run: &str, arguments: &[&str]) -> Command {
    let mut command = program();
    command.args(["train", "--resume", &place.text(&format!("runs/{run}"))]).args(arguments);
    command
}

pub fn resume(place: &Place, run: &str, arguments: &[&str]) -> Output {
    resumed(place, run, arguments).output().unwrap()
}

pub fn begun(mut command: Command) -> Child {
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

pub fn interrupted(run: Child) -> Output {
    assert!(Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap().success());
    run.wait_with_output().unwrap()
}

pub fn bytes(place: &Place, file: &str) -> Vec<u8> {
    std::fs::read(place.file(file)).unwrap()
}

/// The rows of a run's metrics without the columns that depend on the clock.
fn metrics(place: &Place, run: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(place.file(&format!("runs/{run}/metrics.csv"))).unwrap();
    let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    assert!(TIMES.iter().all(|time| names.contains(time)), "{names:?}");
    let timeless = |row: &str| {
        row.split(',')
            .zip(&names)
            .filter(|(_, name)| !TIMES.contains(name))
            .map(|(value, _)| value.to_owned())
            .collect()
    };
    text.lines().map(timeless).collect()
}

/// Files and bytes of the policies that a run kept, and its list of them without the time.
fn kept(place: &Place, run: &str) -> (Vec<(String, Vec<u8>)>, Value) {
    let folder = place.file(&format!("runs/{run}/policies"));
    let names = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    let mut list = place.json(&format!("runs/{run}/policies/policies.json"));
    for kept in list.as_array_mut().unwrap() {
        assert!(kept.as_object_mut().unwrap().remove("seconds").is_some_and(|seconds| seconds.is_f64()), "{kept}");
    }
    let policies = names.iter().filter(|name| name.ends_with(".safetensors"));
    let files = policies.map(|name| (name.clone(), std::fs::read(folder.join(name)).unwrap())).collect();
    (files, list)
}

/// The env steps after which a run said it continues.
fn continued_after(output: &Output) -> u64 {
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let steps = said
        .split_once("continuing after ")
        .and_then(|(_, rest)| rest.split_once(" env steps"))
        .map(|(steps, _)| steps.parse());
    steps.unwrap_or_else(|| panic!("{said}{}", String::from_utf8_lossy(&output.stderr))).unwrap()
}

pub fn wait_until(what: &str, reached: impl Fn() -> bool) {
    // A minute is far more than a tiny run needs on a busy machine.
    for _ in 0..12_000 {
        if reached() {
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("{what} was not reached within a minute");
}

#[test]
fn a_refinement_stopped_on_the_way_equals_one_never_stopped_bit_for_bit_and_its_last_policy_is_kept() {
    let place = place();
    refine(&place);
    let steps = ["--steps", "60000"];
    succeed(&place.train(&[&["--name", "whole"], &steps[..]].concat()));
    let run = begun(place.training(&[&["--name", "parts"], &steps[..]].concat()));
    let refined = || {
        let checkpoint = std::fs::read(place.file("runs/parts/checkpoint.safetensors")).unwrap_or_default();
        checkpoint.windows(13).any(|word| word == b"refined actor")
    };
    wait_until("a checkpoint of the refinement", refined);
    succeed(&interrupted(run));
    let is_stopped = place.json("runs/parts/report.json")["interrupted"] == true;
    assert!(is_stopped, "60000 steps are over too soon for this test");
    let policy = bytes(&place, "runs/parts/policy.safetensors");
    assert!(policy.windows(6).any(|word| word == b"frames"), "the policy is that of the refinement");
    let output = resume(&place, "parts", &[]);
    succeed(&output);
    assert!(15_000 < continued_after(&output));
    assert!(bytes(&place, "runs/parts/policy.safetensors") == bytes(&place, "runs/whole/policy.safetensors"));
    assert_eq!(metrics(&place, "parts"), metrics(&place, "whole"));
    let validation = place.json("runs/whole/report.json")["validation"].clone();
    assert_eq!(validation, place.json("runs/parts/report.json")["validation"]);
    assert_eq!(validation["best"], validation["last"]);
}

#[test]
fn a_run_killed_and_stopped_on_the_way_equals_one_never_stopped_bit_for_bit() {
    let place = place();
    let steps = ["--steps", "40000"];
    succeed(&place.train(&[&["--name", "whole"], &steps[..]].concat()));
    // Stopped while chance drives, if it gets there in time, killed, stopped while it learns, then left to its end.
    let mut run = begun(place.training(&[&["--name", "parts"], &steps[..]].concat()));
    wait_until("a checkpoint", || place.file("runs/parts/checkpoint.safetensors").is_file());
    run.kill().unwrap();
    run.wait().unwrap();
    let mut stops = Vec::new();
    for _ in 0..2 {
        let before = bytes(&place, "runs/parts/checkpoint.safetensors");
        let run = begun(resumed(&place, "parts", &[]));
        wait_until("another checkpoint", || bytes(&place, "runs/parts/checkpoint.safetensors") != before);
        let output = interrupted(run);
        succeed(&output);
        stops.push(continued_after(&output));
        assert_eq!(
            place.json("runs/parts/report.json")["interrupted"],
            true,
            "40000 steps are over too soon for this test"
        );
    }
    let output = resume(&place, "parts", &[]);
    succeed(&output);
    stops.push(continued_after(&output));
    assert!(stops.is_sorted() && stops[0] < stops[2], "{stops:?}");
    assert!(
        bytes(&place, "runs/parts/policy.safetensors") == bytes(&place, "runs/whole/policy.safetensors"),
        "{stops:?}"
    );
    let (parts, whole) = (metrics(&place, "parts"), metrics(&place, "whole"));
    assert!(100 < whole.len(), "{}", whole.len());
    assert_eq!(parts, whole);
    let (policies, list) = kept(&place, "whole");
    let steps: Vec<u64> = list.as_array().unwrap().iter().map(|kept| kept["env_steps"].as_u64().unwrap()).collect();
    let names: Vec<String> = steps.iter().map(|steps| format!("{steps:012}.safetensors")).collect();
    assert_eq!(policies.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>(), names);
    assert!((8..=16).contains(&steps.len()) && steps[0] < 500 && 20_000 < *steps.last().unwrap(), "{steps:?}");
    // Of those after the first validation, at a twentieth of the run, success is known.
    assert!(
        list.as_array()
            .unwrap()
            .iter()
            .all(|kept| (kept["validation"].is_f64()) == (2000 <= kept["env_steps"].as_u64().unwrap())),
        "{list}"
    );
    assert!(kept(&place, "parts") == (policies, list), "{stops:?}");
    let validated = whole.iter().skip(1).filter(|row| row.last().is_some_and(|success| !success.is_empty())).count();
    assert_eq!(validated, 20);
    let validation = |run: &str| place.json(&format!("runs/{run}/report.json"))["validation"].clone();
    assert_eq!((&validation("whole")["times"], &validation("whole")["episodes"]), (&20.into(), &2.into()));
    assert_eq!(validation("parts"), validation("whole"));
    let routes = bytes(&place, "runs/whole/routes.csv");
    assert!(bytes(&place, "runs/parts/routes.csv") == routes);
    // Every training episode counts for its route; here there is one.
    let row = String::from_utf8(routes).unwrap().lines().nth(1).unwrap().to_owned();
    let episodes = place.json("runs/whole/report.json")["episodes"].to_string();
    assert!(row.starts_with("16m/E-right-1,16m,") && row.contains(&format!(",right,1,{episodes},")), "{row}");
    let evaluation = |run: &str| place.json(&format!("runs/{run}/report.json"))["evaluation"]["routes"].clone();
    assert!(evaluation("whole").is_array());
    assert_eq!(evaluation("parts"), evaluation("whole"));
}

#[test]
fn twenty_kills_while_checkpoints_are_written_each_leave_a_good_one() {
    let place = place();
    let part = place.file("runs/run/checkpoint.part");
    let mut run = begun(place.training(&[&["--name", "run"], &ENDLESS[..]].concat()));
    wait_until("a checkpoint", || place.file("runs/run/checkpoint.safetensors").is_file());
    let mut caught = 0;
    for kill in 0..20 {
        wait_until("a checkpoint being written", || part.is_file());
        // At another point of the writing each time.
        std::thread::sleep(Duration::from_micros(200 * kill));
        run.kill().unwrap();
        run.wait().unwrap();
        caught += u32::from(part.is_file());
        let before = bytes(&place, "runs/run/checkpoint.safetensors");
        run = begun(resumed(&place, "run", &[]));
        wait_until("another checkpoint", || bytes(&place, "runs/run/checkpoint.safetensors") != before);
    }
    let output = interrupted(run);
    succeed(&output);
    assert!(0 < continued_after(&output));
    assert!(0 < caught, "no kill met a checkpoint being written");
    let before = place.json("runs/run/report.json")["env_steps"].as_u64().unwrap();
    succeed(&resume(&place, "run", &["--steps", &(before + 80).to_string()]));
    assert_eq!(place.json("runs/run/report.json")["env_steps"], before + 80);
}

#[test]
fn a_finished_run_goes_on_only_with_a_larger_budget() {
    let place = place();
    succeed(&place.train(&["--name", "run", "--steps", "800"]));
    let message = refusal(&resume(&place, "run", &[]), 2);
    assert!(message.contains("it has finished") && message.contains("--steps"), "{message}");
    let message = refusal(&resume(&place, "run", &["--steps", "800"]), 2);
    assert!(message.contains("800 env steps: more are needed"), "{message}");
    // The budget that was asked for stays with the run; the evaluation of the earlier policy is gone.
    assert_eq!(place.json("runs/run/report.json")["interrupted"], false);
    let before = bytes(&place, "runs/run/checkpoint.safetensors");
    let run = begun(resumed(&place, "run", &ENDLESS));
    wait_until("another checkpoint", || bytes(&place, "runs/run/checkpoint.safetensors") != before);
    assert_eq!(place.json("runs/run/report.json")["interrupted"], true);
    assert!(!place.file("runs/run/report.html").exists());
    succeed(&interrupted(run));
    assert!(String::from_utf8(bytes(&place, "runs/run/config.toml")).unwrap().contains("steps = 1000000000"));
    let reached = place.json("runs/run/report.json")["env_steps"].as_u64().unwrap();
    succeed(&resume(&place, "run", &["--steps", &(reached + 80).to_string()]));
    assert_eq!(place.json("runs/run/report.json")["interrupted"], false);
    // A lost evaluation is made up for.
    std::fs::remove_file(place.file("runs/run/report.json")).unwrap();
    succeed(&resume(&place, "run", &[]));
    assert_eq!(place.json("runs/run/report.json")["evaluation"]["split"], "test");
}

#[test]
fn a_finished_run_that_goes_on_is_validated_again_and_keeps_further_policies() {
    let place = place();
    succeed(&place.train(&["--name", "run", "--steps", "800"]));
    let (earlier, _) = kept(&place, "run");
    succeed(&resume(&place, "run", &["--steps", "1600"]));
    let validation = place.json("runs/run/report.json")["validation"].clone();
    assert_eq!((&validation["times"], &validation["last"]["env_steps"]), (&20.into(), &1600.into()), "{validation}");
    let (later, list) = kept(&place, "run");
    assert!(earlier.len() < later.len() && later.starts_with(&earlier), "{list}");
}

#[test]
fn a_run_that_cannot_go_on_is_refused_with_the_file_and_what_would_do() {
    let place = place();
    succeed(&place.train(&["--name", "run", "--steps", "800"]));
    let whole = bytes(&place, "runs/run/checkpoint.safetensors");
    let refused = |file: &str, changed: &[u8], expected: &[&str]| {
        let kept = bytes(&place, file);
        std::fs::write(place.file(file), changed).unwrap();
        let message = refusal(&resume(&place, "run", &ENDLESS), 2);
        assert!(expected.iter().all(|expected| message.contains(expected)), "{message}");
        std::fs::write(place.file(file), kept).unwrap();
    };
    let checkpoint = "runs/run/checkpoint.safetensors";
    refused(checkpoint, &whole[..whole.len() / 2], &[checkpoint, "damaged", "put a copy of it back"]);
    let mut changed = whole.clone();
    changed[whole.len() - 9] ^= 4;
    refused(checkpoint, &changed, &[checkpoint, "checksum"]);
    refused(checkpoint, &bytes(&place, "runs/run/policy.safetensors"), &[checkpoint, "no checkpoint"]);
    let config = String::from_utf8(bytes(&place, "runs/run/config.toml")).unwrap();
    let other = config.replace("gamma = 0.97", "gamma = 0.9");
    assert_ne!(other, config);
    refused(
        "runs/run/config.toml",
        other.as_bytes(),
        &["runs/run/config.toml: learning.gamma: 0.9; the checkpoint was written with 0.97: put that back"],
    );
    let list = "runs/run/policies/policies.json";
    refused(list, b"[{", &[list, "is not the list of a run's policies", "put a copy of it back"]);
    refused("runs/run/metrics.csv", b"seconds,env_steps\n", &["runs/run/metrics.csv", "columns"]);
    let benchmark = String::from_utf8(bytes(&place, "short.toml")).unwrap();
    refused(
        "short.toml",
        benchmark.replace("waypoint = 100.0", "waypoint = 99.0").as_bytes(),
        &[checkpoint, "short.toml was different"],
    );
    // What only says when an episode ends is a part of what trucks drive by.
    refused(
        "short.toml",
        benchmark.replace("sensors", "ending = { time_limit = 2.5 }\nsensors").as_bytes(),
        &["short.toml was different"],
    );
    let validated = String::from_utf8(bytes(&place, "validated.toml")).unwrap();
    refused(
        "validated.toml",
        validated.replace("N-right-1", "N-left-2").as_bytes(),
        &[checkpoint, "validated was different"],
    );
    let message = refusal(&resume(&place, "elsewhere", &[]), 2);
    assert!(message.contains("--resume") && message.contains("the folder of a run is needed"), "{message}");
    let message = refusal(&offtrack(&["train", "--resume", &place.text("runs/run"), "--seed", "3"]), 2);
    assert!(message.contains("cannot be used with '--seed"), "{message}");
}

#[test]
fn a_run_killed_before_its_first_checkpoint_starts_from_the_beginning() {
    let place = place();
    succeed(&place.train(&["--name", "whole", "--steps", "1200"]));
    succeed(&place.train(&["--name", "run", "--steps", "1200"]));
    for file in ["checkpoint.safetensors", "policy.safetensors", "metrics.csv", "report.json", "report.html"] {
        std::fs::remove_file(place.file(&format!("runs/run/{file}"))).unwrap();
    }
    std::fs::write(place.file("runs/run/checkpoint.part"), b"half").unwrap();
    succeed(&resume(&place, "run", &[]));
    assert!(bytes(&place, "runs/run/policy.safetensors") == bytes(&place, "runs/whole/policy.safetensors"));
    assert_eq!(metrics(&place, "run"), metrics(&place, "whole"));
    let left: Vec<String> = std::fs::read_dir(place.file("runs/run"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    assert!(left.iter().all(|name| !name.ends_with(".part") && !name.contains(".tmp")), "{left:?}");
}

#[test]
fn two_runs_never_share_a_folder() {
    let place = place();
    let run = begun(place.training(&[&["--name", "run"], &ENDLESS[..]].concat()));
    wait_until("a checkpoint", || place.file("runs/run/checkpoint.safetensors").is_file());
    let message = refusal(&resume(&place, "run", &[]), 2);
    assert!(message.contains("metrics.csv: another run is writing it"), "{message}");
    succeed(&interrupted(run));
}

#[test]
fn a_learner_that_diverges_stops_with_the_step_the_parameter_and_the_last_good_checkpoint() {
    let place = place();
    let training = std::fs::read_to_string(place.file("tiny.toml")).unwrap();
    let wild = [
        ("reward_scale = 0.01", "reward_scale = 1e6"),
        ("actor_learning_rate = 3e-4", "actor_learning_rate = 1.0"),
        ("critic_learning_rate = 3e-4", "critic_learning_rate = 1.0"),
    ];
    let wild =
        wild.iter().fold(training, |text, (from, to)| text.replace(from, to)).replace("rate = 3e-4 }", "rate = 1.0 }");
    std::fs::write(place.file("tiny.toml"), wild).unwrap();
    let message = refusal(&place.train(&[&["--name", "run"], &ENDLESS[..]].concat()), 1);
    for expected in [
        "env steps",
        "training has diverged",
        "checkpoint.safetensors is the last good checkpoint",
        "lower learning rates",
    ] {
        assert!(message.contains(expected), "{message}");
    }
    assert!(
        ["critic 1, layer", "critic 2, layer", "actor, layer", "entropy coefficient"]
            .iter()
            .any(|name| message.contains(name)),
        "{message}"
    );
    // The last good checkpoint is good as far as it goes: it can be read, and training diverges again.
    assert!(refusal(&resume(&place, "run", &[]), 1).contains("diverged"));
}

#[test]
fn a_run_that_ended_without_its_checkpoint_keeps_its_policy_and_does_not_begin_anew() {
    let place = place();
    let run = begun(place.training(&[&["--name", "stopped"], &ENDLESS[..]].concat()));
    wait_until("a checkpoint", || place.file("runs/stopped/checkpoint.safetensors").is_file());
    succeed(&interrupted(run));
    std::fs::remove_file(place.file("runs/stopped/checkpoint.safetensors")).unwrap();
    assert!(refusal(&resume(&place, "stopped", &[]), 2).contains("it was stopped and its checkpoint is gone"));
    succeed(&place.train(&["--name", "run", "--steps", "800"]));
    std::fs::remove_file(place.file("runs/run/checkpoint.safetensors")).unwrap();
    let policy = bytes(&place, "runs/run/policy.safetensors");
    for flags in [&[][..], &ENDLESS] {
        let message = refusal(&resume(&place, "run", flags), 2);
        assert!(message.contains("it has finished and its checkpoint is gone: train --from "), "{message}");
    }
    assert!(bytes(&place, "runs/run/policy.safetensors") == policy);
}
