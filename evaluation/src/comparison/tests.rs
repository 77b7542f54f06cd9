use std::path::PathBuf;

use super::*;
use crate::outcomes::tests::outcomes;

/// The file of an evaluation with these letters on each route.
fn evaluated(routes: &[&str]) -> Evaluated {
    let asked =
        Asked { benchmark: "b".into(), policy: None, look_ahead: None, line: None, load: None, route: Vec::new() };
    let policy = "p".to_owned();
    Evaluated { benchmark: "b".into(), split: Split::Test, policy, seed: 0, asked, outcomes: outcomes(routes) }
}

fn side(name: &str, files: &[&[&str]]) -> Side {
    let file = |routes: &&[&str]| (PathBuf::from(name), evaluated(routes));
    Side::new(name.into(), files.iter().map(file).collect())
}

#[test]
fn episodes_are_paired_by_route_and_number_and_those_that_differ_are_listed_gained_ones_first() {
    let first = side("first", &[&["..ta", "....", "a..."]]);
    let mut own = side("own", &[&["...a", "...t", "a..."]]);
    own.files[0].1.outcomes.routes[0].lane_distance = vec![0.25, 0.75, 9.0, 9.0];
    let comparison = Comparison::of(&[first, own]);
    assert_eq!((comparison.sides[0].arrived, comparison.sides[1].arrived, comparison.sides[0].episodes), (9, 9, 12));
    let difference = &comparison.differences[0];
    let listed: Vec<_> = difference
        .episodes
        .iter()
        .map(|one| (one.route.as_str(), one.episode, one.first_ended, one.own_ended))
        .collect();
    let expected =
        [("16/N-left-1", 2, "tractor_collided", "arrived"), ("16/N-left-2", 3, "arrived", "tractor_collided")];
    assert_eq!(listed, expected);
    // Two of the first route, three of the second, three of the third arrive on both sides.
    assert_eq!(difference.common, 8);
    let [first, own] = [&difference.first, &difference.own].map(|side| side.lane_distance.unwrap().mean);
    assert_eq!((first, own, difference.difference.lane_distance.unwrap().mean), (0.5, 0.5, 0.0));
    assert_eq!(difference.difference.success.unwrap().mean, 0.0);
    // Of 12 episodes that all arrive Wilson's interval is 75.8 to 100 %; that over routes has no width.
    let all = || side("all", &[&["....", "....", "...."]]);
    assert!(Comparison::of(&[all(), all()]).text().contains("| 75.8 to 100.0 (Wilson) |"));
    let of = |kind: &str, name: &str| {
        difference.groups.iter().find(|group| group.kind == kind && group.name == name).unwrap().clone()
    };
    assert_eq!((of("route", "16/N-left-1").difference.mean, of("route", "16/N-left-1").difference.low), (0.25, None));
    assert_eq!((of("roundabout", "16").starts, of("roundabout", "16").difference.mean), (8, 0.0));
    assert_eq!((of("exit", "2").first, of("exit", "2").own), (1.0, 0.75));
}

#[test]
fn of_several_training_seeds_the_mean_and_the_worst_count_and_an_episode_differs_by_fractions() {
    let first = side("first", &[&["....", "...."]]);
    let own = side("own", &[&["....", "...."], &["tt..", "...."], &["t...", "...."]]);
    let comparison = Comparison::of(&[first, own]);
    let figures = &comparison.sides[1];
    assert_eq!((figures.episodes, figures.arrived, figures.worst), (24, 21, 0.75));
    let success = figures.figures.success.unwrap();
    assert!(
        (success.mean - 0.875).abs() < 1e-12 && success.low.unwrap() < 0.8 && success.high == Some(1.0),
        "{success:?}"
    );
    let fractions: Vec<f64> = comparison.differences[0].episodes.iter().map(|episode| episode.own).collect();
    assert_eq!(fractions, [2.0 / 3.0, 1.0 / 3.0]);
    assert_eq!(comparison.differences[0].common, 6);
    assert!(comparison.text().contains("own arrived in 33 % of its files"), "{}", comparison.text());
}

#[test]
fn success_is_compared_by_vehicle_and_load_where_there_are_several() {
    let with_classes = |routes: &[&str]| {
        let mut side = side("s", &[routes]);
        let outcomes = &mut side.files[0].1.outcomes;
        let class = |load: &str| crate::recording::Class { vehicle: "daf".into(), load: load.into() };
        outcomes.classes = vec![class("empty"), class("laden")];
        outcomes.routes.iter_mut().for_each(|route| route.class = vec![0, 1, 0, 1]);
        side
    };
    let comparison = Comparison::of(&[with_classes(&["....", "...."]), with_classes(&[".r.r", "...."])]);
    let classes: Vec<_> = comparison.differences[0]
        .groups
        .iter()
        .filter(|group| group.kind == "class")
        .map(|group| (group.name.as_str(), group.starts, group.own))
        .collect();
    assert_eq!(classes, [("daf, empty", 4, 1.0), ("daf, laden", 4, 0.5)]);
    assert!(comparison.text().contains("| vehicle, load | daf, laden "), "{}", comparison.text());
    // Laden trucks on one route alone say nothing of others.
    let on_one = |routes: &[&str]| {
        let mut side = with_classes(routes);
        side.files[0].1.outcomes.routes[1].class = vec![0; 4];
        side
    };
    let comparison = Comparison::of(&[on_one(&["....", "...."]), on_one(&[".r..", "...."])]);
    let of = |name: &str| {
        let mut groups = comparison.differences[0].groups.iter();
        groups.find(|group| group.kind == "class" && group.name == name).unwrap().clone()
    };
    let (empty, laden) = (of("daf, empty"), of("daf, laden"));
    assert_eq!((empty.routes, empty.difference.low, empty.difference.high), (2, Some(0.0), Some(0.0)));
    assert_eq!((laden.routes, laden.starts, laden.difference.mean, laden.difference.low), (1, 2, -0.5, None));
}

#[test]
fn exits_stand_by_their_number_whatever_the_order_of_routes() {
    let turned = |letters: &str| {
        let mut side = side("s", &[&[letters, "..", ".."]]);
        for (route, exit) in side.files[0].1.outcomes.routes.iter_mut().zip(["3", "1", "2"]) {
            route.exit = exit.into();
        }
        side
    };
    let difference = Comparison::of(&[turned(".."), turned(".t")]).differences.remove(0);
    let of_kind = |kind: &str| -> Vec<String> {
        difference.groups.iter().filter(|group| group.kind == kind).map(|group| group.name.clone()).collect()
    };
    assert_eq!(of_kind("exit"), ["1", "2", "3"]);
    assert_eq!(of_kind("route"), ["16/N-left-1", "16/N-left-2", "17/N-left-3"]);
}

#[test]
fn sides_of_other_starts_are_refused_by_file_key_and_both_values() {
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str, change: &dyn Fn(&mut serde_json::Value)| {
        let Evaluated { benchmark, split, policy, seed, asked, outcomes } = evaluated(&["..", ".t"]);
        let mut value = serde_json::json!({ "benchmark": benchmark, "split": split, "policy": policy, "seed": seed,
            "asked": asked, "outcomes": outcomes, "of_a_later_version": 1 });
        change(&mut value);
        let file = folder.path().join(name);
        std::fs::write(&file, value.to_string()).unwrap();
        file
    };
    let whole = written("a.json", &|_| ());
    assert_eq!(Side::read_all(&[whole.clone(), whole.clone()]).unwrap().len(), 2);
    let refused = |change: &dyn Fn(&mut serde_json::Value), expected: &str| {
        let other = written("b.json", change);
        let said = Side::read_all(&[whole.clone(), other.clone()]).unwrap_err().to_string();
        assert!(said.starts_with(other.to_str().unwrap()) && said.contains(expected), "{said}");
    };
    refused(&|value| value["benchmark"] = "c".into(), "benchmark: c; ");
    refused(&|value| value["split"] = "train".into(), "split: train; ");
    refused(&|value| value["seed"] = 7.into(), "seed: 7; ");
    refused(&|value| value["outcomes"]["routes"][1]["name"] = "16/S-left-1".into(), "routes: 16/S-left-1; ");
    refused(&|value| value["outcomes"]["world"] = "00000000".into(), "world (roads, vehicles, actions, reward): 0000");
    refused(&|value| drop(value["outcomes"]["routes"].as_array_mut().unwrap().pop()), "routes: 1; ");
    refused(&|value| drop(value.as_object_mut().unwrap().remove("outcomes")), "outcomes: is missing, as in reports of");
    refused(&|value| *value = serde_json::json!({ "evaluation": {} }), "is the report of a training run");
    refused(&|value| value["outcomes"]["routes"][0]["steps"] = serde_json::json!([1]), "steps: 1 values; 2 are needed");
    refused(&|value| *value = 3.into(), "outcomes: is missing");
    let said = Side::read_all(&[whole]).unwrap_err().to_string();
    assert!(said.contains("two or more are compared"), "{said}");
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).unwrap();
    let said = Side::read_all(&[empty.clone(), empty]).unwrap_err().to_string();
    assert!(said.contains("has no file *.json"), "{said}");
}

#[test]
fn csv_is_read_back_and_tables_have_the_same_cells_in_markdown_and_latex() {
    let comparison =
        Comparison::of(&[side("a_b, c", &[&["..ta", "....", "a..."]]), side("own", &[&["....", "...t", "a..."]])]);
    let csv = comparison.csv();
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("side,less,kind,name,routes,figure,first,own,value,low,high"));
    let rows: Vec<Vec<&str>> =
        lines.map(|line| line.strip_prefix("\"a_b, c\"").unwrap_or(line).split(',').collect()).collect();
    // Two sides and a difference of five figures, three routes, two roundabouts, three exits, a radius and a lane; and
    // the interval of each side over episodes.
    assert_eq!(rows.len(), 15 + 10 + 2);
    let wilson = wilson(10, 12);
    assert!(csv.contains(&format!("success_over_episodes,,,{},{},{}", 10.0 / 12.0, wilson.0, wilson.1)), "{csv}");
    let find = |kind: &str, figure: &str| {
        csv.lines()
            .find(|line| {
                line.starts_with("own,\"a_b, c\"") && line.contains(&format!(",{kind},")) && line.contains(figure)
            })
            .unwrap()
    };
    let cells: Vec<&str> = find("all", "success").rsplit(',').collect();
    let numbers: Vec<f64> = cells[..5].iter().rev().map(|cell| cell.parse().unwrap()).collect();
    let success = comparison.differences[0].difference.success.unwrap();
    assert_eq!(numbers, [9.0 / 12.0, 10.0 / 12.0, success.mean, success.low.unwrap(), success.high.unwrap()]);
    assert!(find("exit,2", "success").ends_with(",1,0.75,-0.25,,"), "{csv}");
    let (markdown, latex) = (comparison.markdown(), comparison.latex());
    assert!(markdown.contains("| a_b, c | 9/12 ") && latex.contains("a\\_b, c & 9/12 & 75.0 &"), "{markdown}{latex}");
    assert!(latex.contains("$-$25.0") && latex.matches("\\toprule").count() == 3, "{latex}");
}
