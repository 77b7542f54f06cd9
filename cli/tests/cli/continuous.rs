//! Benchmarks with continuous actions: what drives them, and what refuses them by key.

use crate::place::{offtrack, refusal, succeed};

const BENCHMARK: [&str; 2] = ["--benchmark", "attard2023-continuous"];

#[test]
fn baselines_are_evaluated_and_recorded_on_a_continuous_benchmark() {
    let folder = tempfile::tempdir().unwrap();
    for policy in ["pursuit", "random"] {
        let arguments = ["evaluate", "--policy", policy, "--route", "40m/E-left-1", "--episodes", "3"];
        let output = offtrack(&[&arguments[..], &BENCHMARK].concat());
        succeed(&output);
        let printed = String::from_utf8_lossy(&output.stdout);
        assert!(printed.contains("benchmark attard2023-continuous, test routes; 3 episodes a route"), "{printed}");
        let file = folder.path().join(format!("{policy}.json"));
        let arguments = ["record", "--policy", policy, "--route", "40m/E-left-1", "-o", file.to_str().unwrap()];
        succeed(&offtrack(&[&arguments[..], &BENCHMARK].concat()));
        let recording: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
        let frames = recording["frames"].as_array().unwrap();
        assert!(frames[0].get("command").is_none() && frames[0]["action"].is_null());
        for frame in &frames[1..] {
            let command: Vec<f64> =
                frame["command"].as_array().unwrap().iter().flat_map(|value| value.as_f64()).collect();
            assert!(command.len() == 2 && command.iter().all(|value| value.abs() <= 1.0) && frame["action"].is_null());
        }
    }
}

#[test]
fn a_policy_with_levels_and_a_search_are_refused_with_what_would_do() {
    let message = refusal(&offtrack(&[&["evaluate"][..], &BENCHMARK].concat()), 2);
    assert!(
        message.contains("the benchmark takes commands (actions.kind = \"continuous\"); a policy whose head"),
        "{message}"
    );
    for arguments in [&["certify"][..], &["evaluate", "--policy", "random", "--certify"]] {
        let message = refusal(&offtrack(&[arguments, &BENCHMARK].concat()), 2);
        let expected = "actions.kind: continuous; a search tries levels: the same benchmark with actions.steer_levels";
        assert!(message.contains(expected), "{message}");
    }
}
