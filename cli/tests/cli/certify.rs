//! `offtrack certify`: sequences found arrive again, changed ones do not, and files for other conditions are refused.

use std::process::Command;

use serde_json::Value;

use crate::place::{Place, offtrack, program, refusal, succeed};

/// A certificate of the short benchmark, from the narrowest search that completes it.
fn certified() -> Place {
    let place = Place::new();
    let benchmark = place.text("short.toml");
    succeed(&offtrack(&[
        "certify",
        "--benchmark",
        &benchmark,
        "--widths",
        "16",
        "--json",
        &place.text("certificate.json"),
    ]));
    place
}

fn verify(place: &Place, benchmark: &str) -> std::process::Output {
    offtrack(&["certify", "--benchmark", benchmark, "--verify", &place.text("certificate.json")])
}

/// Rewrites the certificate with a change.
fn change(place: &Place, change: impl Fn(&mut Value)) {
    let mut certificate = place.json("certificate.json");
    let before = certificate.clone();
    change(&mut certificate);
    assert_ne!(before, certificate);
    std::fs::write(place.file("certificate.json"), certificate.to_string()).unwrap();
}

#[test]
fn every_route_of_the_short_benchmark_is_completed_and_arrives_again() {
    let place = certified();
    let certificate = place.json("certificate.json");
    let routes = certificate["routes"].as_array().unwrap();
    let names: Vec<&str> = routes.iter().map(|route| route["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["16m/E-right-1", "20m/E-right-1", "20m/W-left-3"]);
    let found: Vec<&Value> = routes.iter().flat_map(|route| route["found"].as_array().unwrap()).collect();
    let count = |value: &Value| value["env_steps"].as_u64().unwrap();
    assert_eq!(found.len(), 15);
    assert!(found.iter().all(|found| found["ended"] == "arrived"), "{certificate}");
    assert_eq!(count(&certificate), found.iter().map(|found| count(found)).sum::<u64>());
    let output = verify(&place, &place.text("short.toml"));
    succeed(&output);
    assert!(String::from_utf8_lossy(&output.stdout).contains("15 sequences driven again: all arrived"));
}

#[test]
fn the_same_search_finds_the_same_sequences() {
    let (one, two) = (certified(), certified());
    assert_eq!(one.json("certificate.json")["routes"], two.json("certificate.json")["routes"]);
}

#[test]
fn a_changed_or_shortened_sequence_is_a_failure_that_names_its_route_and_start() {
    let place = certified();
    let whole = std::fs::read(place.file("certificate.json")).unwrap();
    for (actions, ended) in [("2x400", "collided"), ("2x5", "running"), ("", "running")] {
        std::fs::write(place.file("certificate.json"), &whole).unwrap();
        change(&place, |certificate| certificate["routes"][2]["found"][1]["actions"] = actions.into());
        let said = refusal(&verify(&place, &place.text("short.toml")), 1);
        assert!(said.contains("20m/W-left-3 from (+1, +1)") && said.contains(ended), "{said}");
    }
}

#[test]
fn a_damaged_certificate_is_refused_by_its_name() {
    let place = certified();
    let whole = std::fs::read(place.file("certificate.json")).unwrap();
    let refused = |expected: &str| {
        let said = refusal(&verify(&place, &place.text("short.toml")), 2);
        assert!(said.contains(&place.text("certificate.json")) && said.contains(expected), "{expected}: {said}");
        std::fs::write(place.file("certificate.json"), &whole).unwrap();
    };
    std::fs::write(place.file("certificate.json"), &whole[..whole.len() / 2]).unwrap();
    refused("is not a certificate, or is damaged");
    std::fs::write(place.file("certificate.json"), "{}").unwrap();
    refused("is not a certificate, or is damaged");
    change(&place, |certificate| certificate["version"] = 2.into());
    refused("version 2");
    change(&place, |certificate| certificate["routes"][0]["found"][0]["actions"] = "5x20".into());
    refused("actions: \"5x20\"");
    change(&place, |certificate| certificate["starts"][0][0] = 2.into());
    refused("must lie in -1..1");
    change(&place, |certificate| certificate["starts"] = Value::Array(Vec::new()));
    refused("starts: empty");
    change(&place, |certificate| certificate["routes"][1] = certificate["routes"][0].clone());
    refused("16m/E-right-1: is there twice");
    change(&place, |certificate| drop(certificate["routes"][0]["found"].as_array_mut().unwrap().pop()));
    refused("4 entries");
    change(&place, |certificate| certificate["routes"][0]["name"] = "20m/N-left-9".into());
    refused("has a route 20m/N-left-9 that the benchmark does not have");
    std::fs::remove_file(place.file("certificate.json")).unwrap();
    refused("cannot be read");
}

#[test]
fn a_certificate_made_under_other_conditions_is_refused_by_the_condition_that_differs() {
    let place = certified();
    let short = std::fs::read_to_string(place.file("short.toml")).unwrap();
    for (from, to, expected) in [
        ("-0.4, 0.0", "-0.5, 0.0", "another action table"),
        ("[30.0]", "[20.0]", "another action table"),
        ("drivable", "solid", "another gutter: drivable there, solid"),
        ("empty", "laden", "another vehicle"),
    ] {
        std::fs::write(place.file("other.toml"), short.replacen(from, to, 1)).unwrap();
        assert_ne!(std::fs::read_to_string(place.file("other.toml")).unwrap(), short);
        let said = refusal(&verify(&place, &place.text("other.toml")), 2);
        assert!(said.contains(&place.text("certificate.json")) && said.contains(expected), "{said}");
    }
}

#[test]
fn an_evaluation_reports_the_success_on_certified_routes() {
    let place = certified();
    let (certificate, report) = (place.text("certificate.json"), place.text("report.json"));
    let evaluate =
        || place.evaluate(&["--policy", "pursuit", "--episodes", "2", "--certified", &certificate, "--json", &report]);
    succeed(&evaluate());
    assert_eq!(place.json("report.json")["certified"]["episodes"], 4);
    // A route that was not completed from one of the starts is left out.
    change(&place, |certificate| certificate["routes"][2]["found"][4]["ended"] = "strayed".into());
    let output = evaluate();
    succeed(&output);
    let report = place.json("report.json");
    assert_eq!(report["certified"]["episodes"], 2);
    assert_eq!(report["certified"]["arrived"], report["routes"][0]["arrived"]);
    assert!(String::from_utf8_lossy(&output.stdout).lines().any(|line| line.starts_with("certified ")));
    // The sequences of the file are driven again first.
    change(&place, |certificate| certificate["routes"][1]["found"][0]["actions"] = "2x5".into());
    assert!(refusal(&evaluate(), 1).contains("20m/E-right-1"));
    change(&place, |certificate| drop(certificate["routes"].as_array_mut().unwrap().remove(1)));
    assert!(refusal(&evaluate(), 2).contains("has no route 20m/E-right-1"));
}

#[test]
fn a_certificate_holds_among_vehicles_and_not_where_trucks_answer_by_different_delays() {
    let place = certified();
    let certificate = place.text("certificate.json");
    let short = std::fs::read_to_string(place.file("short.toml")).unwrap();
    let with = |table: &str| {
        std::fs::write(place.file("other.toml"), format!("{short}\n{table}\n")).unwrap();
        ["--certified", "--line"].map(|flag| {
            let asked = ["--benchmark", &place.text("other.toml"), "--policy", "pursuit", "--episodes", "2"];
            offtrack(&[&["evaluate"], &asked[..], &[flag, &certificate]].concat())
        })
    };
    with("[traffic]\ndemand = [900.0]").iter().for_each(succeed);
    for output in with("[disturbances]\naction_delay = [0, 3]") {
        let said = refusal(&output, 2);
        assert!(said.contains("disturbances.action_delay: [0, 3]; a search needs"), "{said}");
    }
}

#[test]
fn pursuit_follows_the_paths_of_a_certificate_and_the_lanes_centre_where_it_has_none() {
    let place = Place::new();
    let (certificate, report) = (place.text("certificate.json"), place.text("report.json"));
    let routes = ["--benchmark", "attard2023", "--route", "20m/E-right-1", "--route", "40m/E-left-2"];
    succeed(&offtrack(&[&["certify"], &routes[..], &["--widths", "64", "--json", &certificate]].concat()));
    let drive = |flags: &[&str]| {
        offtrack(&[&["evaluate"], &routes[..], &["--episodes", "4", "--json", &report], flags].concat())
    };
    let evaluate = || drive(&["--policy", "pursuit", "--line", &certificate]);
    succeed(&drive(&["--policy", "pursuit"]));
    let centre = place.json("report.json");
    succeed(&evaluate());
    let planned = place.json("report.json");
    assert_eq!(
        (&centre["policy"], &planned["policy"]),
        (&Value::from("pursuit"), &Value::from(format!("pursuit of {certificate}")))
    );
    // Along the lane's centre the trailer does not come round the first of them.
    assert_eq!((&centre["arrived"], &planned["arrived"]), (&Value::from(4), &Value::from(8)));
    // Without a sequence a route is followed along its lane's centre.
    change(&place, |certificate| {
        for found in certificate["routes"]
            .as_array_mut()
            .unwrap()
            .iter_mut()
            .flat_map(|route| route["found"].as_array_mut().unwrap())
        {
            found["ended"] = "strayed".into();
        }
    });
    let output = evaluate();
    succeed(&output);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("completes 0 of 2 routes; on the others pursuit follows the lane's centre"), "{said}");
    assert_eq!(place.json("report.json")["routes"], centre["routes"]);
    change(&place, |certificate| drop(certificate["routes"].as_array_mut().unwrap().remove(1)));
    assert!(refusal(&evaluate(), 2).contains("has no route 40m/E-left-2"));
    let said = refusal(&drive(&["--policy", "random", "--line", &certificate]), 2);
    assert!(
        said.contains(&format!("--line: {certificate}; is for pure pursuit: give --policy pursuit, too")),
        "{said}"
    );
}

#[test]
fn a_policy_may_be_among_the_candidates_and_must_fit_the_benchmark() {
    let place = Place::new();
    succeed(&place.train(&["--name", "run", "--steps", "600"]));
    let (policy, benchmark) = (place.text("runs/run/policy.safetensors"), place.text("short.toml"));
    let certify = |benchmark: &str| {
        offtrack(&[
            "certify",
            "--benchmark",
            benchmark,
            "--split",
            "train",
            "--widths",
            "16",
            "--policy",
            &policy,
            "--json",
            &place.text("c.json"),
        ])
    };
    succeed(&certify(&benchmark));
    let certificate = place.json("c.json");
    assert_eq!((&certificate["policy"], &certificate["split"]), (&Value::from(policy.as_str()), &Value::from("train")));
    assert_eq!(certificate["routes"].as_array().map(Vec::len), Some(1));
    // It says where its benchmark is, a file of one's own.
    succeed(&offtrack(&["certify", "--verify", &place.text("c.json")]));
    let moved = place.text("moved.toml");
    std::fs::rename(&benchmark, &moved).unwrap();
    let said = refusal(&offtrack(&["certify", "--verify", &place.text("c.json")]), 2);
    assert!(said.contains("c.json: benchmark: ") && said.contains("--benchmark says where it is now"), "{said}");
    succeed(&offtrack(&["certify", "--verify", &place.text("c.json"), "--benchmark", &moved]));
    assert!(refusal(&certify("attard2023"), 2).contains("another action table"));
}

#[test]
fn a_certificate_of_roads_of_an_own_distribution_draws_them_again_from_its_file() {
    let place = Place::new();
    let shipped = std::fs::read_to_string("../scenarios/distributions/wide.toml").unwrap();
    // Of the name of a shipped one, and of other roads.
    let own = shipped.replace("island_radius = [7.3, 28.0]", "island_radius = [16.0, 16.5]");
    assert_ne!(own, shipped);
    std::fs::write(place.text("wide.toml"), own).unwrap();
    let (json, route) = (place.text("c.json"), place.text("wide.toml/7/12/S-left-4"));
    succeed(&offtrack(&["certify", "--route", &route, "--widths", "16", "--hold", "5", "--json", &json]));
    assert_eq!(place.json("c.json")["asked"], Value::from(vec![route]));
    succeed(&offtrack(&["certify", "--verify", &json]));
    let moved = place.text("other/wide.toml");
    std::fs::create_dir(place.file("other")).unwrap();
    std::fs::rename(place.file("wide.toml"), &moved).unwrap();
    let said = refusal(&offtrack(&["certify", "--verify", &json]), 2);
    assert!(said.contains("c.json: ") && said.contains("--route says where it is now"), "{said}");
    let there = format!("{moved}/7/12/S-left-4");
    succeed(&offtrack(&["certify", "--verify", &json, "--route", &there]));
}

#[test]
fn a_result_states_the_commit_of_the_build_and_not_that_of_the_sources_when_it_runs() {
    let place = certified();
    // A git that says something else when the program runs.
    let fake = place.file("git");
    std::fs::write(&fake, "#!/bin/sh\necho 0123456789ab\n").unwrap();
    assert!(Command::new("chmod").args(["+x", fake.to_str().unwrap()]).status().unwrap().success());
    let path = format!("{}:{}", fake.parent().unwrap().display(), std::env::var("PATH").unwrap());
    let output = program()
        .env("PATH", path)
        .args([
            "certify",
            "--benchmark",
            &place.text("short.toml"),
            "--widths",
            "16",
            "--split",
            "train",
            "--json",
            &place.text("again.json"),
        ])
        .output()
        .unwrap();
    succeed(&output);
    assert_eq!(place.json("again.json")["commit"], place.json("certificate.json")["commit"]);
    assert_ne!(place.json("again.json")["commit"], "0123456789ab");
}

#[test]
#[cfg(unix)]
fn an_interrupted_search_exits_with_130_and_leaves_no_temporary_file() {
    let place = Place::new();
    let arguments = ["certify", "--benchmark", "attard2023", "--json", &place.text("certificate.json")];
    let search = program()
        .args(arguments)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    // The first write shows that the search has begun.
    while !place.file("certificate.json").is_file() {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert!(Command::new("kill").args(["-INT", &search.id().to_string()]).status().unwrap().success());
    assert_eq!(search.wait_with_output().unwrap().status.code(), Some(130));
    let names: Vec<String> = std::fs::read_dir(place.file(""))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    assert!(names.iter().all(|name| !name.ends_with(".tmp")), "{names:?}");
}
