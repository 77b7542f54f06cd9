//! Pictures of figures in the documents show the figures of the results that they stand for.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::place::repository;

fn json(file: &str) -> Value {
    serde_json::from_slice(&fs::read(repository().join(file)).unwrap()).unwrap()
}

/// The text that `benches/pictures.py` has written into a PNG: what the page in it says.
fn description(file: &Path) -> String {
    let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(file).unwrap()));
    let reader = decoder.read_info().unwrap();
    let texts = &reader.info().utf8_text;
    let found = texts.iter().find(|text| text.keyword == "Description");
    found.expect("benches/pictures.py makes it").get_text().unwrap()
}

#[test]
fn the_picture_of_the_page_shows_the_result_of_the_shipped_policy() {
    let said = description(&repository().join("docs/images/report.png"));
    let report = &json("policy/shipped/attard2023/report.json")["evaluation"];
    let number = |key: &str| report[key].as_f64().unwrap();
    let n_routes = report["routes"].as_array().unwrap().len();
    let words =
        format!("of all episodes on {n_routes} unseen routes arrived {} of {};", report["arrived"], report["episodes"]);
    let percent = |key: &str| format!("{:.1}", 100.0 * number(key));
    let figures = [percent("success"), words, percent("success_low"), percent("success_high")];
    assert!(
        figures.iter().all(|figure| said.contains(figure)),
        "{said} does not have {figures:?}: run benches/pictures.py"
    );
}

#[test]
fn the_chart_of_what_learns_from_python_names_each_row_of_its_measurement() {
    let consumers = json("docs/results/python-consumers.json");
    let chart = fs::read_to_string(repository().join("docs/results/python-consumers.svg")).unwrap();
    let names: Vec<&str> =
        consumers["consumers"].as_array().unwrap().iter().map(|consumer| consumer["name"].as_str().unwrap()).collect();
    assert!(names.len() == 5 && names.iter().all(|name| chart.contains(&format!(">{name}<"))), "{names:?}");
}
