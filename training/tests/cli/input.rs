//! Wrong input of every command: exit code 2, what was wrong by its name and value, and what would do.

use crate::place::{Place, offtrack, refusal};

#[test]
fn a_wrong_argument_is_named_with_its_value_and_what_would_do() {
    let cases: [(&[&str], &[&str]); 29] = [
        (&["evaluate", "--policy", "random", "--episodes", "0"], &["--episodes: 0; must lie in 1..100000"]),
        (&["evaluate", "--policy", "random", "--episodes", "many"], &["'many'", "--episodes"]),
        (&["evaluate", "--policy", "random", "--benchmark", "nowhere"], &["benchmark: nowhere", "scenarios/"]),
        (&["evaluate", "--policy", "random", "--benchmark", "nowhere.toml"], &["nowhere.toml: cannot be read"]),
        (&["evaluate", "--policy", "random", "--split", "all"], &["'all'", "--split", "test, train"]),
        (&["evaluate", "--policy", "random", "--seed", "-1"], &["-1"]),
        (&["evaluate", "--policy", "pursuit", "--look-ahead", "nan"], &["--look-ahead: NaN m; must lie in 1..50 m"]),
        (&["evaluate", "--policy", "pursuit", "--look-ahead", "-3"], &["--look-ahead: -3 m; must lie in 1..50 m"]),
        (&["evaluate", "--policy", "no.safetensors"], &["no.safetensors: cannot be read"]),
        (&["certify", "--widths", "64,0"], &["--widths: 0; must lie in 1..262144"]),
        (&["certify", "--hold", "0"], &["--hold: 0; must lie in 1..50"]),
        (&["certify", "--verify", "no.json"], &["no.json: cannot be read"]),
        (&["scale", "--envs", "0"], &["--envs: 0; must lie in 1..4194304"]),
        (&["scale", "--envs", "64..16"], &["--envs: 64..16; must lie in 1..4194304"]),
        (&["scale", "--seconds", "-1"], &["--seconds: -1 s; must lie in 0.1..3600 s"]),
        (&["scale", "--plot", "speed.pdf"], &["--plot: speed.pdf; must end in .svg or .png"]),
        (&["scale", "--mode", "blind"], &["'blind'", "random"]),
        (&["scale", "--device", "tpu"], &["'tpu'", "cpu, gpu"]),
        (&["scale", "--adapter", "H200"], &["--adapter: H200; the processor is none: add --device gpu"]),
        (&["evaluate", "--adapter", "H200"], &["--adapter: H200; the processor is none: add --device gpu"]),
        (&["bench", "--seconds", "-1"], &["--seconds: -1 s; must lie in 0.1..3600 s"]),
        (&["bench", "--hidden", "256,0"], &["--hidden: 0; sizes must lie in 1..8192"]),
        (&["bench", "--batch", "1"], &["--batch: 1; must lie in 2..1048576"]),
        (&["train", "no.toml"], &["no.toml: cannot be read"]),
        (&["train", "--minutes", "nan"], &["minutes: NaN min; must lie in 0.01..100000 min"]),
        (&["train", "--wings", "2"], &["'--wings'"]),
        (&["trace", "no.json"], &["no.json: cannot be read"]),
        (&["deviations", "no.toml", "no.json"], &["no.toml: cannot be read"]),
        (&["fly"], &["'fly'"]),
    ];
    for (arguments, expected) in cases {
        let said = refusal(&offtrack(arguments), 2);
        assert!(expected.iter().all(|words| said.contains(words)), "{arguments:?}: {said}");
    }
}

#[test]
fn runs_below_a_file_are_a_failure_that_names_the_folder() {
    let place = Place::new();
    let below_a_file = place.text("short.toml/runs");
    let said = refusal(&offtrack(&["train", &place.text("tiny.toml"), "--out", &below_a_file]), 1);
    assert!(said.contains(&below_a_file) && said.contains("cannot be written"), "{said}");
}

#[test]
fn trajectories_are_printed_and_cases_of_another_kind_are_named() {
    let output = offtrack(&["trace", "tests/data/physics_vectors.json"]);
    let said = refusal(&output, 0);
    assert_eq!(said.lines().filter(|line| line.contains("is not taken: its kind is")).count(), 8, "{said}");
    let printed: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(printed["cases"].as_array().map(Vec::len), Some(22));
}

#[test]
fn a_trajectory_that_cannot_be_is_refused_by_its_file_case_and_key() {
    let place = Place::new();
    let vectors = std::fs::read_to_string(crate::place::repository().join("tests/data/physics_vectors.json")).unwrap();
    for (from, to, expected) in [
        ("\"dt\": 0.05", "\"dt\": -1", "case \"straight_30\": dt: -1 s"),
        ("\"L1\"", "\"l1\"", "case \"straight_30\": missing field `L1`"),
        ("{", "[", "no JSON"),
    ] {
        let changed = vectors.replacen(from, to, 1);
        assert_ne!(changed, vectors);
        std::fs::write(place.file("cases.json"), changed).unwrap();
        let said = refusal(&offtrack(&["trace", &place.text("cases.json")]), 2);
        assert!(said.contains(&place.text("cases.json")) && said.contains(expected), "{said}");
    }
}
