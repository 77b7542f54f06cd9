//! `offtrack train` ended from outside: what it has written by then is whole.
#![cfg(unix)]

use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use crate::place::{Place, succeed};
use crate::resume::{resume, wait_until};

/// The command of a run far too long to end by itself.
fn endless(place: &Place) -> Command {
    place.training(&["--name", "run", "--steps", "1000000000"])
}

/// A run, once it writes figures.
fn begun(place: &Place, mut run: Command) -> Child {
    let run = run.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until("figures", || place.file("runs/run/metrics.csv").is_file());
    run
}

fn send(run: &Child, signal: &str) {
    assert!(Command::new("kill").args([signal, &run.id().to_string()]).status().unwrap().success());
}

fn ended(run: Child, signal: &str) -> Output {
    send(&run, signal);
    run.wait_with_output().unwrap()
}

/// Every row that ends with a line break has as many columns as the first.
fn assert_whole_rows(place: &Place) {
    let metrics = std::fs::read_to_string(place.file("runs/run/metrics.csv")).unwrap();
    let rows: Vec<usize> =
        metrics.split_inclusive('\n').filter(|row| row.ends_with('\n')).map(|row| row.split(',').count()).collect();
    assert!(rows.iter().all(|&columns| columns == rows[0]), "{metrics}");
}

#[test]
fn a_stopped_run_leaves_a_policy_and_says_that_it_was_interrupted() {
    let place = Place::new();
    let patient = std::fs::read_to_string(place.file("tiny.toml")).unwrap();
    // Stopped while it learns or soon before, and while its actions are certainly still random.
    let random = patient.replace("capacity = 2000, warmup = 400", "capacity = 5000000, warmup = 5000000");
    assert_ne!(random, patient);
    for (training, signal) in [(&patient, "-INT"), (&patient, "-TERM"), (&patient, "-HUP"), (&random, "-INT")] {
        // Where these tests were begun by nohup, so is the run.
        if signal == "-HUP" && ignores_hangup() {
            continue;
        }
        std::fs::write(place.file("tiny.toml"), training).unwrap();
        let run = begun(&place, endless(&place));
        std::thread::sleep(Duration::from_millis(500));
        let output = ended(run, signal);
        succeed(&output);
        assert!(String::from_utf8_lossy(&output.stdout).contains("stopped: "));
        assert!(String::from_utf8_lossy(&output.stderr).contains("stopping once"));
        let report = place.json("runs/run/report.json");
        assert_eq!((report["interrupted"].as_bool(), report["evaluation"].is_null()), (Some(true), true));
        assert!(0 < report["env_steps"].as_u64().unwrap());
        assert_whole_rows(&place);
        succeed(&place.evaluate(&["--policy", &place.text("runs/run/policy.safetensors"), "--episodes", "1"]));
        std::fs::remove_dir_all(place.file("runs")).unwrap();
    }
}

/// Whether SIGHUP is ignored here, and so by what is begun here.
fn ignores_hangup() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    ignored.and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok()).is_some_and(|bits| bits & 1 == 1)
}

#[test]
fn two_signals_at_once_are_one_as_timeout_sends_them_to_a_process_and_to_its_group() {
    let place = Place::new();
    for signal in ["-TERM", "-INT"] {
        let run = begun(&place, endless(&place));
        send(&run, signal);
        std::thread::sleep(Duration::from_millis(20));
        succeed(&ended(run, signal));
        assert_eq!(place.json("runs/run/report.json")["interrupted"], true);
        std::fs::remove_dir_all(place.file("runs")).unwrap();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_run_goes_on_when_its_terminal_closes_where_nohup_began_it() {
    let place = Place::new();
    // Which writes a row every few seconds.
    let training = place.training(&["--name", "run", "--minutes", "1000"]);
    let mut ignoring = Command::new("sh");
    ignoring.args(["-c", r#"trap "" HUP; exec "$@""#, "sh"]).arg(training.get_program()).args(training.get_args());
    ignoring.envs(training.get_envs().filter_map(|(name, value)| Some((name, value?))));
    let run = begun(&place, ignoring);
    send(&run, "-HUP");
    // A run that stops writes one row more at most.
    let n_rows = || std::fs::read_to_string(place.file("runs/run/metrics.csv")).unwrap().lines().count();
    let before = n_rows();
    wait_until("figures", || before + 1 < n_rows());
    succeed(&ended(run, "-TERM"));
    assert_eq!(place.json("runs/run/report.json")["interrupted"], true);
}

#[test]
fn a_run_killed_in_its_first_seconds_leaves_a_policy_and_a_checkpoint_to_continue_from() {
    let place = Place::new();
    // With the default interval of two minutes: the first checkpoint is written at once.
    let run = begun(&place, endless(&place));
    let checkpoint = place.file("runs/run/checkpoint.safetensors");
    let policy = place.file("runs/run/policy.safetensors");
    wait_until("policy and checkpoint", || checkpoint.is_file() && policy.is_file());
    assert_eq!(ended(run, "-KILL").status.code(), None);
    assert_whole_rows(&place);
    succeed(&place.evaluate(&["--policy", policy.to_str().unwrap(), "--episodes", "1"]));
    succeed(&resume(&place, "run", &["--steps", "2000"]));
    assert_eq!(place.json("runs/run/report.json")["env_steps"], 2000);
}

#[test]
fn a_run_that_begins_again_for_want_of_a_checkpoint_has_no_rows_of_before() {
    let place = Place::new();
    let run = begun(&place, endless(&place));
    wait_until("a checkpoint", || place.file("runs/run/checkpoint.safetensors").is_file());
    ended(run, "-KILL");
    // As if it had been killed while it wrote its first checkpoint, after a row: the policy comes after it.
    std::fs::remove_file(place.file("runs/run/checkpoint.safetensors")).unwrap();
    let _ = std::fs::remove_file(place.file("runs/run/policy.safetensors"));
    let file = place.file("runs/run/metrics.csv");
    let metrics = std::fs::read_to_string(&file).unwrap();
    let row = format!("5.0,999999{}", ",".repeat(metrics.lines().next().unwrap().matches(',').count() - 1));
    std::fs::write(&file, format!("{metrics}{row}\n")).unwrap();
    succeed(&resume(&place, "run", &["--steps", "800"]));
    let metrics = std::fs::read_to_string(file).unwrap();
    let steps: Vec<&str> = metrics.lines().skip(1).map(|row| row.split(',').nth(1).unwrap()).collect();
    assert_eq!(steps.last(), Some(&"800"), "{metrics}");
    assert!(!steps.contains(&"999999"), "{metrics}");
}
