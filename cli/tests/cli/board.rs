//! `offtrack board`: entries are simulated again to the last bit, and one that is not as it claims is named.

use std::path::PathBuf;

use serde_json::{Value, json};

use crate::place::{Place, offtrack, refusal, repository, said, succeed};

/// An entry of the short benchmark.
const ENTRY: &str = "name = \"a\"\nDRIVER\n\n[home]\nbenchmark = \"short.toml\"\nepisodes = 2\nseed = 3\n";

fn entry(place: &Place, name: &str, driver: &str) -> String {
    std::fs::write(place.file(name), ENTRY.replace("DRIVER", driver)).unwrap();
    place.text(name)
}

#[test]
fn every_entry_of_the_board_comes_to_what_it_claims_to_the_last_bit() {
    let place = Place::new();
    let files = std::fs::read_dir(repository().join("board")).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> =
        files.filter(|file| file.extension().is_some_and(|ending| ending == "toml")).collect();
    files.sort();
    let names: Vec<&str> = files.iter().map(|file| file.to_str().unwrap()).collect();
    let json = place.text("board.json");
    let output = offtrack(&[&["board", "--check", "--json", &json], &names[..]].concat());
    succeed(&output);
    let board = place.json("board.json");
    let rows = board["rows"].as_array().unwrap();
    assert_eq!((rows.len(), files.len()), (17, 17));
    assert!(rows.iter().all(|row| row["differs"] == json!([])), "{board}");
    let of = |name: &str| rows.iter().find(|row| row["name"] == name).unwrap();
    // Published: docs/results/baselines.json.
    assert_eq!(of("pure pursuit")["home"]["success"]["mean"].as_f64().unwrap(), 202.0 / 690.0);
    assert_eq!(of("random actions")["home"]["success"]["mean"], 0.0);
    assert!(of("planned pursuit")["bytes"].is_u64() && of("pure pursuit")["bytes"].is_null());
    let listed = std::fs::read_to_string(repository().join("board/README.md")).unwrap();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(listed.contains(&printed), "print the tables of board/README.md again: {printed}");
}

#[test]
fn an_entry_claims_what_was_simulated_and_is_named_where_it_differs() {
    let place = Place::new();
    let file = entry(&place, "entry.toml", "policy = \"pursuit\"");
    let unclaimed = refusal(&offtrack(&["board", "--check", &file]), 1);
    assert!(unclaimed.contains("entry.toml: home: claims nothing yet; --claim adds"), "{unclaimed}");
    succeed(&offtrack(&["board", "--claim", &file]));
    succeed(&offtrack(&["board", "--check", &file]));
    let claimed = std::fs::read_to_string(&file).unwrap();
    assert!(claimed.starts_with(&ENTRY.replace("DRIVER", "policy = \"pursuit\"")), "{claimed}");
    // Another claim, and what is said of it.
    let digest = claimed.split("digest = \"").nth(1).unwrap()[..8].to_owned();
    let ends = claimed.lines().find(|line| line.starts_with("\"20m/W-left-3\"")).unwrap();
    let (route, letters) = ends.split_once(" = ").unwrap();
    let turned: String = letters.chars().map(|letter| if letter == '"' { '"' } else { 's' }).collect();
    let changes = [
        (digest.clone(), "00000000".to_owned(), format!("digest: 00000000 claimed, {digest} simulated")),
        (ends.to_owned(), format!("{route} = {turned}"), "ends, 20m/W-left-3, episode 0: strayed claimed".to_owned()),
        ("seed = 3".to_owned(), "seed = 4".to_owned(), "home: ".to_owned()),
    ];
    for (from, to, expected) in changes {
        assert!(claimed.contains(&from));
        std::fs::write(&file, claimed.replace(&from, &to)).unwrap();
        let told = refusal(&offtrack(&["board", "--check", &file]), 1);
        assert!(told.contains("entry.toml: ") && told.contains(&expected), "{told}");
        let output = offtrack(&["board", &file]);
        succeed(&output);
        assert!(said(&output).contains(&expected) && String::from_utf8_lossy(&output.stdout).contains("| NO "));
    }
}

#[test]
fn recorded_actions_are_an_entry_without_a_policy_and_a_policy_drives_on_roads_that_nobody_knew() {
    let place = Place::new();
    let actions = place.text("random.json");
    succeed(&place.evaluate(&["--policy", "random", "--episodes", "2", "--seed", "3", "--actions", &actions]));
    let recorded = entry(&place, "recorded.toml", "actions = \"random.json\"");
    let random = entry(&place, "random.toml", "policy = \"random\"");
    let [json, csv, markdown] = ["board.json", "board.csv", "board.md"].map(|name| place.text(name));
    succeed(&offtrack(&["board", "--claim", &recorded, &random]));
    let claim = |file: &str| std::fs::read_to_string(file).unwrap().split_once("[home.claim]").unwrap().1.to_owned();
    assert_eq!(claim(&recorded), claim(&random), "the same actions, to the last bit");
    let files = ["--json", &json, "--csv", &csv, "--markdown", &markdown];
    let fresh = ["board", "--roads-seed", "77", "--roads", "2", &recorded, &random];
    succeed(&offtrack(&[&fresh[..], &files].concat()));
    let rows = place.json("board.json")["rows"].clone();
    let of = |file: &str| {
        rows.as_array().unwrap().iter().find(|row| row["file"].as_str().unwrap().ends_with(file)).unwrap().clone()
    };
    assert_eq!(of("recorded.toml")["fresh"], Value::Null);
    assert_eq!(of("random.toml")["fresh"]["success"]["mean"], 0.0);
    let on = of("random.toml")["fresh"]["benchmark"].as_str().unwrap().to_owned();
    assert!(on.ends_with(" on 2 roads of wide/77"), "{on}");
    let rows = std::fs::read_to_string(&csv).unwrap();
    assert!(rows.lines().count() == 3 && rows.contains(&on), "{rows}");
    assert!(std::fs::read_to_string(&markdown).unwrap().contains("fresh roads"));
    let told = refusal(&offtrack(&["board", "--roads-seed", "1", "--roads", "0", &random]), 2);
    assert!(told.contains("--roads: 0; must lie in 1..10000"), "{told}");
    std::fs::write(place.file("random.json"), "{}").unwrap();
    let told = refusal(&offtrack(&["board", &recorded]), 2);
    assert!(told.contains("random.json: ") && told.contains("`evaluate --actions` writes such files"), "{told}");
    let named = std::fs::read_to_string(&random).unwrap().replacen("name = \"", "name = \"a\\nb", 1);
    std::fs::write(place.file("named.toml"), named).unwrap();
    let told = refusal(&offtrack(&["board", &place.text("named.toml")]), 2);
    assert!(told.contains("named.toml: name: ") && told.contains("it is a table's cell"), "{told}");
    let gone = entry(&place, "gone.toml", "policy = \"gone.safetensors\"");
    let told = refusal(&offtrack(&["board", &gone]), 2);
    assert!(told.contains("gone.toml: ") && told.contains("gone.safetensors"), "{told}");
}

#[test]
fn dev10_is_ten_validation_roads_of_random2026_with_a_route_each_that_a_shipped_policy_completes() {
    let place = Place::new();
    let benchmark = repository().join("board/dev10/dev10.toml");
    let command = ["evaluate", "--benchmark", benchmark.to_str().unwrap(), "--policy", "attard2023", "--episodes", "5"];
    succeed(&offtrack(&[&command[..], &["--json", &place.text("report.json")]].concat()));
    let report = place.json("report.json");
    assert_eq!(report["arrived"], 50);
    let index = |route: &Value| -> u32 {
        let road = route["name"].as_str().unwrap().split('/').next().unwrap();
        road.strip_prefix("wide-2026-").unwrap().parse().unwrap()
    };
    let mut roads: Vec<u32> = report["routes"].as_array().unwrap().iter().map(index).collect();
    roads.dedup();
    // `procedural.validation` of random2026.
    assert!(roads.len() == 10 && roads.iter().all(|index| (200..240).contains(index)), "{roads:?}");
}
