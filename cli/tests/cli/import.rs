//! `offtrack import`: what it finds in maps, and the files that it writes.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::place::program;

fn map(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/maps").join(name)
}

fn offtrack(arguments: &[&str]) -> Output {
    program().args(arguments).output().unwrap()
}

#[test]
fn a_ring_of_a_map_is_listed_written_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let sumo = map("sumo_ring22.xodr");
    let sumo = sumo.to_str().unwrap();
    let listed = offtrack(&["import", sumo, "--list"]);
    let text = String::from_utf8(listed.stdout).unwrap();
    assert!(listed.status.success() && text.starts_with("ring 140.0,140.0: island 22.0"), "{text}");
    assert!(text.contains("arms E N W S; 16 routes") && text.contains("4 other islands and blocks are none"), "{text}");
    let outline = folder.path().join("sumo.outline.toml");
    let (outline, svg) = (outline.to_str().unwrap(), folder.path().join("sumo.svg"));
    assert!(offtrack(&["import", sumo, "--ring", "140,140", "-o", outline]).status.success());
    assert!(offtrack(&["draw", outline, "-o", svg.to_str().unwrap()]).status.success());
    assert!(std::fs::read_to_string(&svg).unwrap().contains("Roundabout sumo: 4 arms, 16 routes"));
    assert!(offtrack(&["draw", sumo, "--ring", "140,140", "-o", svg.to_str().unwrap()]).status.success());
    assert!(std::fs::read_to_string(&svg).unwrap().contains("Roundabout sumo_ring22: 4 arms, 16 routes"));
    let checked = offtrack(&["import", sumo, "--check"]);
    assert!(checked.status.success() && String::from_utf8(checked.stdout).unwrap().contains(" jumps by 0.74 m; "));
}

#[test]
fn a_map_without_a_roundabout_is_wrong_input() {
    let listed = offtrack(&["import", map("maliput_Roundabout.xodr").to_str().unwrap(), "--list"]);
    let (text, error) = (String::from_utf8(listed.stdout).unwrap(), String::from_utf8(listed.stderr).unwrap());
    assert_eq!(listed.status.code(), Some(2));
    assert!(error.contains("no roundabout here: 1 roads around 1 islands and blocks"), "{error}");
    assert!(text.contains("1 other islands and blocks are none"), "{text}");
    assert_eq!(offtrack(&["import", "missing.xodr", "--list"]).status.code(), Some(2));
    assert_eq!(
        offtrack(&["import", map("sumo_ring22.xodr").to_str().unwrap(), "-o", "ring.toml"]).status.code(),
        Some(2)
    );
}

#[test]
fn a_map_whose_rings_cannot_be_driven_is_wrong_input() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ring.xodr");
    let text =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/maps/plain_ring.xodr"))
            .unwrap();
    let arms =
        |line: &str| if line.contains("length=\"70\"") { line.replace("driving", "shared") } else { line.to_owned() };
    std::fs::write(&file, text.lines().map(arms).collect::<Vec<_>>().join("\n")).unwrap();
    let listed = offtrack(&["import", file.to_str().unwrap(), "--list"]);
    let (text, error) = (String::from_utf8(listed.stdout).unwrap(), String::from_utf8(listed.stderr).unwrap());
    assert!(listed.status.code() == Some(2) && text.contains("cannot be driven: "), "{text}");
    assert!(error.contains("lane types that are not known: \"shared\" (8 lanes)"), "{error}");
}

#[test]
fn an_outline_of_a_map_whose_name_has_a_line_break_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ring\nname.xodr");
    std::fs::copy(map("sumo_ring22.xodr"), &file).unwrap();
    let (outline, svg) = (folder.path().join("ring.outline.toml"), folder.path().join("ring.svg"));
    assert!(offtrack(&["import", file.to_str().unwrap(), "-o", outline.to_str().unwrap()]).status.success());
    assert!(offtrack(&["draw", outline.to_str().unwrap(), "-o", svg.to_str().unwrap()]).status.success());
}

#[test]
fn flags_that_would_do_nothing_are_refused() {
    let (sumo, folder) = (map("sumo_ring22.xodr"), tempfile::tempdir().unwrap());
    let (sumo, svg) = (sumo.to_str().unwrap(), folder.path().join("ring.svg"));
    let refused = |arguments: &[&str], flag: &str| {
        let output = offtrack(arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && error.contains(flag), "{arguments:?}: {error}");
    };
    refused(&["import", sumo, "--list", "--ring", "140,140"], "--ring");
    refused(&["import", sumo, "--junctions", "--arms", "E,N,W,S"], "--arms");
    let outline = folder.path().join("ring.outline.toml");
    let outline = outline.to_str().unwrap();
    let said = "arms: [\"outer\", \"N\", \"W\", \"S\"]; names must differ";
    refused(&["import", sumo, "--arms", "outer,N,W,S", "-o", outline], said);
    refused(&["import", sumo, "--list", "--unit", "us-ft"], "--unit: us-ft; is for a drawing");
    let svg = svg.to_str().unwrap();
    refused(&["draw", "16m", "--ring", "1,2", "-o", svg], "--ring: 1,2");
    refused(&["draw", "16m", "--hand", "left", "-o", svg], "--hand: left");
    refused(&["draw", "16m", "--way", "1:-1,2:-1", "-o", svg], "--way: 1:-1,2:-1");
}

#[test]
fn json_of_an_import_says_where_the_road_lies_in_the_map_and_its_hand() {
    let folder = tempfile::tempdir().unwrap();
    let (outline, json) = (folder.path().join("ring.outline.toml"), folder.path().join("ring.json"));
    let (outline, json) = (outline.to_str().unwrap(), json.to_str().unwrap());
    let town = map("Town03.xodr");
    assert!(offtrack(&["import", town.to_str().unwrap(), "-o", outline, "--json", json]).status.success());
    let said: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let origin = [0, 1].map(|axis| said["origin"][axis].as_f64().unwrap());
    assert!((origin[0] + 0.4817).abs() < 1e-4 && (origin[1] + 0.2650).abs() < 1e-4, "{said}");
    assert!(said["hand"] == "right" && said["arms"][0] == "E" && said["routes"][0] == "E-left-1", "{said}");
    let text = std::fs::read_to_string(outline).unwrap();
    assert!(text.contains("\norigin = [-0.48"), "{text:.400}");
    let refused = offtrack(&["import", town.to_str().unwrap(), "--list", "--json", json]);
    assert_eq!(refused.status.code(), Some(2));
}
