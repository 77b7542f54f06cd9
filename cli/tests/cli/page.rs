//! `report.html` and what it holds; `browser.rs` opens it.

use std::path::Path;

use serde_json::Value;

use crate::place::{Place, offtrack, refusal, succeed};

/// A data block of the page.
pub fn block<'a>(page: &'a str, id: &str) -> &'a str {
    let (_, text) = page.split_once(&format!("id=\"{id}\">")).unwrap();
    text.split_once("</script>").unwrap().0
}

pub fn read(file: &Path) -> String {
    std::fs::read_to_string(file).unwrap()
}

#[test]
fn a_page_takes_its_curves_from_the_folder_of_a_run() {
    let place = Place::new();
    succeed(&place.train(&["--name", "run", "--steps", "800"]));
    let page = place.text("page.html");
    let policy = place.text("runs/run/policy.safetensors");
    let arguments = ["--policy", &policy, "--episodes", "1", "--html", &page, "--run"];
    let with_run = |run: &str| place.evaluate(&[&arguments[..], &[&place.text(run)]].concat());
    succeed(&with_run("runs/run"));
    let text = read(Path::new(&page));
    let report: Value = serde_json::from_str(block(&text, "report")).unwrap();
    assert_eq!(
        (&report["env_steps"], &report["evaluation"]["policy"]),
        (&Value::from(800), &Value::from(policy.as_str()))
    );
    assert_eq!(
        serde_json::from_str::<Value>(block(&text, "metrics")).unwrap(),
        read(&place.file("runs/run/metrics.csv"))
    );

    let said = refusal(&with_run("runs/none"), 2);
    assert!(said.contains("runs/none/report.json") && said.contains("cannot be read"), "{said}");
    std::fs::write(place.file("runs/run/report.json"), "{}").unwrap();
    let said = refusal(&with_run("runs/run"), 2);
    assert!(said.contains("report.json: has no env_steps"), "{said}");
}

#[test]
fn a_page_that_cannot_be_written_is_refused() {
    let place = Place::new();
    let said = refusal(&offtrack(&["evaluate", "--policy", "random", "--run", "runs/run"]), 2);
    assert!(said.contains("--html"), "{said}");
    let below_a_file = place.text("tiny.toml/page.html");
    let said = refusal(&place.evaluate(&["--policy", "random", "--episodes", "1", "--html", &below_a_file]), 1);
    assert!(said.contains(&below_a_file) && said.contains("cannot be written"), "{said}");
}
