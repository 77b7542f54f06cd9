//! Runs whose files were lost or edited since they were stopped.

use crate::place::{Place, offtrack, refusal, said, succeed};
use crate::resume::{begun, bytes, place, resume, wait_until};

/// A finished run of 1,200 env steps.
fn finished() -> Place {
    let place = place();
    succeed(&place.train(&["--name", "run", "--steps", "1200"]));
    place
}

#[test]
fn a_refused_attempt_leaves_a_run_without_metrics_as_it_was() {
    let place = finished();
    let file = place.file("runs/run/metrics.csv");
    std::fs::remove_file(&file).unwrap();
    let message = refusal(&resume(&place, "run", &[]), 2);
    assert!(message.contains("it has finished"), "{message}");
    let output = resume(&place, "run", &["--steps", "1600"]);
    succeed(&output);
    assert!(said(&output).contains("metrics.csv: was missing: its rows begin again here"), "{output:?}");
    let rows = std::fs::read_to_string(file).unwrap();
    assert!(rows.starts_with("seconds,") && 2 <= rows.lines().count(), "{rows}");
}

#[test]
fn a_run_that_has_a_policy_and_no_checkpoint_is_not_begun_again_over_it() {
    let place = finished();
    for file in ["checkpoint.safetensors", "report.json"] {
        std::fs::remove_file(place.file(&format!("runs/run/{file}"))).unwrap();
    }
    let files = ["policy.safetensors", "metrics.csv"].map(|file| format!("runs/run/{file}"));
    let before = files.clone().map(|file| bytes(&place, &file));
    let message = refusal(&resume(&place, "run", &[]), 2);
    assert!(message.contains("its checkpoint is gone: train --from "), "{message}");
    assert!(files.map(|file| bytes(&place, &file)) == before);
}

#[test]
fn metrics_in_which_no_row_ends_where_the_checkpoint_was_are_refused() {
    let place = finished();
    let file = "runs/run/metrics.csv";
    let rows = String::from_utf8(bytes(&place, file)).unwrap();
    let edited = rows.trim_end().to_owned() + "999999\n";
    std::fs::write(place.file(file), &edited).unwrap();
    let message = refusal(&resume(&place, "run", &["--steps", "1600"]), 2);
    let expected = format!("metrics.csv: has no end of a row at byte {}, where its checkpoint", rows.len());
    assert!(message.contains(&expected), "{message}");
    assert!(bytes(&place, file) == edited.as_bytes());
}

#[test]
fn an_evaluation_is_printed_where_its_report_cannot_be_written() {
    let place = place();
    let run = begun(place.training(&["--name", "run", "--steps", "4000"]));
    wait_until("metrics", || place.file("runs/run/metrics.csv").is_file());
    std::fs::create_dir(place.file("runs/run/report.json")).unwrap();
    let output = run.wait_with_output().unwrap();
    assert!(refusal(&output, 1).contains("report.json: cannot be written"), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("20m/W-left-3"), "{output:?}");
}

#[test]
fn seeds_of_a_training_file_of_any_name_can_be_continued_under_the_name_that_the_program_chose() {
    let place = Place::new();
    std::fs::copy(place.file("tiny.toml"), place.file("vår run.toml")).unwrap();
    let train = |arguments: &[&str]| {
        let file = place.text("vår run.toml");
        offtrack(&[&["train", &file, "--out", &place.text("runs"), "--seeds"], arguments].concat())
    };
    succeed(&train(&["5"]));
    assert!(place.file("runs/v-r-run-1/seed-5").is_dir());
    succeed(&train(&["5..6", "--name", "v-r-run-1"]));
    assert!(place.file("runs/v-r-run-1/seed-6").is_dir());
}
