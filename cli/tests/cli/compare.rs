//! `offtrack compare`: evaluations of the same starts in pairs, as tables for a paper and as a page.

use serde_json::{Value, json};

use crate::page::{block, read};
use crate::place::{Place, offtrack, refusal, succeed};

/// Evaluates a policy of the short benchmark into `file`.
fn evaluate(place: &Place, policy: &str, file: &str, extra: &[&str]) {
    let json = place.text(file);
    succeed(&place.evaluate(&[&["--policy", policy, "--episodes", "4", "--json", &json], extra].concat()));
}

#[test]
fn an_evaluation_keeps_each_episode_as_the_report_counts_it() {
    let place = Place::new();
    evaluate(&place, "pursuit", "a.json", &["--look-ahead", "6"]);
    let report = place.json("a.json");
    let outcomes = &report["outcomes"];
    assert_eq!((&outcomes["episodes"], &report["asked"]["look_ahead"]), (&json!(4), &json!(6.0)));
    let routes = outcomes["routes"].as_array().unwrap();
    assert_eq!(routes.len(), 2);
    for (own, reported) in routes.iter().zip(report["routes"].as_array().unwrap()) {
        assert_eq!(own["name"], reported["name"]);
        let arrived = own["ended"].as_str().unwrap().matches('.').count();
        assert_eq!(json!(arrived), reported["arrived"]);
        let values = |key: &str| -> Vec<f64> {
            own[key].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
        };
        let mean = values("lane_distance").iter().sum::<f64>() / 4.0;
        assert!((mean - reported["lane_distance_mean"].as_f64().unwrap()).abs() < 1e-3);
        let seconds = values("steps").iter().sum::<f64>() / 40.0;
        assert!((seconds - reported["time_mean"].as_f64().unwrap()).abs() < 1e-9);
        let peak = values("load_transfer_ratio").into_iter().fold(0.0, f64::max);
        assert!((peak - reported["load_transfer_ratio_peak"].as_f64().unwrap()).abs() < 1e-3);
    }
}

#[test]
fn a_page_shows_both_sides_of_the_episodes_that_differ() {
    let place = Place::new();
    let named = |name: &str| place.text(name);
    let (a, b, page, json) = (named("a.json"), named("b.json"), named("page.html"), named("c.json"));
    for (policy, file) in [("attard2023", &a), ("pursuit", &b)] {
        succeed(&offtrack(&[
            "evaluate",
            "--policy",
            policy,
            "--route",
            "20m/N-left-2",
            "--episodes",
            "3",
            "--json",
            file,
        ]));
    }
    let (csv, tex, markdown) = (named("c.csv"), named("c.tex"), named("c.md"));
    let files = ["--json", &json, "--csv", &csv, "--latex", &tex, "--markdown", &markdown, "--html", &page];
    let output = offtrack(&[&["compare", &a, &b][..], &files].concat());
    succeed(&output);
    let comparison = place.json("c.json");
    let [arrived, others] = [0, 1].map(|side| comparison["sides"][side]["arrived"].as_u64().unwrap());
    let differing = comparison["differences"][0]["episodes"].as_array().unwrap().len();
    assert!(arrived == 3 && 0 < differing && others as usize + differing == 3, "{comparison}");
    let pairs: Value = serde_json::from_str(block(&read(page.as_ref()), "pairs")).unwrap();
    assert_eq!((&pairs["first"], pairs["names"].as_array().unwrap().len()), (&json!("a"), differing));
    assert!(read(csv.as_ref()).starts_with("side,less,") && read(tex.as_ref()).contains("\\toprule"));
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(printed.contains("| b ") && read(markdown.as_ref()).contains("| b "), "{printed}");
    // Another policy ends other episodes: the page would not show what was counted.
    let said =
        refusal(&offtrack(&["compare", &a, &b, "--html", &page, "--policy", "attard2023", "--policy", "random"]), 2);
    assert!(said.contains("b.json: episodes end otherwise when random drives again"), "{said}");
    let said = refusal(&offtrack(&["compare", &a, &b, "--json", &a]), 2);
    assert!(said.contains("is the file of SIDE too"), "{said}");
    let policy = place.text("policy.safetensors");
    std::fs::write(&policy, "a policy").unwrap();
    let said =
        refusal(&offtrack(&["compare", &a, &b, "--html", &policy, "--policy", &policy, "--policy", "random"]), 2);
    assert!(said.contains("is the file of --policy too") && read(policy.as_ref()) == "a policy", "{said}");
}

#[test]
fn evaluations_of_other_starts_and_reports_without_outcomes_are_refused_by_file_and_key() {
    let place = Place::new();
    evaluate(&place, "random", "a.json", &[]);
    evaluate(&place, "random", "b.json", &["--seed", "7"]);
    let [a, b] = ["a.json", "b.json"].map(|name| place.text(name));
    let said = refusal(&offtrack(&["compare", &a, &b]), 2);
    assert!(said.contains("b.json: seed: 7; ") && said.contains("has 0: starts are paired"), "{said}");
    let shipped = "policy/shipped/attard2023/report.json";
    let said = refusal(&offtrack(&["compare", &a, shipped]), 2);
    assert!(said.contains(shipped) && said.contains("is the report of a training run"), "{said}");
    let mut misspelt = place.json("a.json");
    misspelt["split"] = json!("tset");
    std::fs::write(&b, misspelt.to_string()).unwrap();
    let said = refusal(&offtrack(&["compare", &b, &b]), 2);
    assert!(said.contains("b.json: unknown variant `tset`, expected one of `train`, `validation`, `test`"), "{said}");
    let mut before = place.json("a.json");
    before.as_object_mut().unwrap().remove("outcomes");
    std::fs::write(&b, before.to_string()).unwrap();
    let said = refusal(&offtrack(&["compare", &a, &b]), 2);
    assert!(said.contains("b.json: outcomes: is missing, as in reports of earlier versions; write it with"), "{said}");
    refusal(&offtrack(&["compare"]), 2);
    assert!(refusal(&offtrack(&["compare", &a]), 2).contains("two or more are compared"));
}

#[test]
fn a_folder_is_one_side_of_several_training_seeds() {
    let place = Place::new();
    std::fs::create_dir(place.file("several")).unwrap();
    evaluate(&place, "random", "a.json", &[]);
    evaluate(&place, "pursuit", "several/1.json", &[]);
    evaluate(&place, "pursuit", "several/2.json", &["--look-ahead", "5"]);
    let output = offtrack(&["compare", &place.text("a.json"), &place.text("several"), "--json", &place.text("c.json")]);
    succeed(&output);
    let comparison = place.json("c.json");
    let side = &comparison["sides"][1];
    assert_eq!((&side["name"], side["files"].as_array().unwrap().len()), (&json!("several"), 2));
    assert_eq!(side["episodes"], 16);
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(printed.contains("worst seed (%)") && printed.contains("over routes and training seeds"), "{printed}");
}
