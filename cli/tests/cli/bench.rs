//! The learner's bench, for people and for a program that takes turns with it.

use std::io::Write;
use std::process::Stdio;

use serde_json::Value;

use crate::place::{Place, offtrack, program, succeed};

/// Small enough to be over in a moment.
const SMALL: [&str; 7] = ["bench", "--hidden", "4,3", "--batch", "2,6", "--seconds", "0.1"];

fn assert_measured(run: &Value, batch: usize) {
    assert_eq!((&run["hidden"], &run["batch"]), (&Value::from(vec![4, 3]), &Value::from(batch)));
    let time = |key: &str| run[key].as_f64().unwrap();
    assert!(0.0 < time("fastest") && time("fastest") <= time("update") && 0.0 < time("with_sampling"), "{run}");
}

#[test]
fn the_learners_bench_writes_a_run_for_each_batch() {
    let place = Place::new();
    succeed(&offtrack(&[&SMALL[..], &["--json", &place.text("learner.json")]].concat()));
    let bench = place.json("learner.json");
    assert_eq!(bench["runs"].as_array().unwrap().len(), 2);
    assert_measured(&bench["runs"][0], 2);
    assert_measured(&bench["runs"][1], 6);
}

#[test]
fn each_line_read_asks_for_a_round() {
    let mut command = program();
    let mut program = command.args(SMALL).arg("--lines").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    program.stdin.take().unwrap().write_all(b"\nagain\n").unwrap();
    let output = program.wait_with_output().unwrap();
    succeed(&output);
    let lines: Vec<Value> =
        String::from_utf8(output.stdout).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 4);
    for (line, batch) in lines.iter().zip([2, 6, 2, 6]) {
        assert_measured(line, batch);
    }
}
