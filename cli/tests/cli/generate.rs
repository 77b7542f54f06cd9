//! `offtrack generate`, and random roads by name in other commands.

use std::path::Path;
use std::process::Output;

use offtrack::map::Road;
use offtrack::map::procedural::{Distribution, find};

use crate::place::{Place, offtrack, program, refusal, succeed};

/// The program with an empty cache, that of the place.
fn cached(place: &Place, arguments: &[&str]) -> Output {
    let mut command = program();
    command
        .current_dir(crate::place::repository())
        .env("OFFTRACK_CACHE", place.file("cache"))
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn generated_files_are_the_roads_of_the_library_and_a_second_run_writes_the_same_bytes() {
    let place = Place::new();
    let run = |folder: &str| {
        let output =
            cached(&place, &["generate", "--seed", "7", "--first", "10", "--count", "3", "-o", &place.text(folder)]);
        succeed(&output);
        String::from_utf8(output.stdout).unwrap()
    };
    let said = run("a");
    assert!(said.contains("3 roads of wide, seed 7: ") && said.contains("draws are valid; refused:"), "{said}");
    let distribution = Distribution::named("wide").unwrap();
    let mut refused = 0;
    for index in 10..13 {
        let road = distribution.road(7, index).unwrap();
        refused += road.refused.total();
        let path = place.file(&format!("a/wide-7-{index}.toml"));
        let text = std::fs::read_to_string(&path).unwrap();
        let attempt = road.attempt;
        assert!(
            text.starts_with(&format!(
                "# A random roundabout: distribution wide, seed 7, index {index}, attempt {attempt}.\n"
            )),
            "{text}"
        );
        assert!(text.ends_with(&road.text()));
        let read = Road::read(&path).unwrap();
        assert_eq!(read.name, format!("wide-7-{index}"));
        assert_eq!(format!("{:?}", read.lanes()), format!("{:?}", road.roundabout.lanes()));
    }
    let counted: u32 =
        said.lines().filter_map(|line| line.split_once(" %  ")?.0.split_whitespace().next()?.parse::<u32>().ok()).sum();
    assert_eq!(counted, refused, "{said}");
    let sheet = std::fs::read_to_string(place.file("a/contact-sheet.svg")).unwrap();
    assert!(sheet.contains("3 random roads: distribution wide, seed 7") && sheet.contains("wide/7/12"));
    assert!(std::fs::read(place.file("a/contact-sheet.png")).unwrap().starts_with(b"\x89PNG"));
    let own = place.text("own.toml");
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/distributions/wide.toml"), &own).unwrap();
    let of_own = ["generate", "--distribution", &own, "--count", "1", "-o", &place.text("own")];
    succeed(&cached(&place, &of_own));
    let text = std::fs::read_to_string(place.file("own/own-0-0.toml")).unwrap();
    assert!(text.contains(&format!("\n# Made by: offtrack generate --distribution {own} --seed 0 ")), "{text}");
    assert_eq!(run("b").replace("/b", "/a"), said);
    for file in ["wide-7-11.toml", "contact-sheet.svg", "contact-sheet.png"] {
        assert_eq!(
            std::fs::read(place.file("a").join(file)).unwrap(),
            std::fs::read(place.file("b").join(file)).unwrap(),
            "{file}"
        );
    }
}

#[test]
fn files_that_exist_are_not_written_over_unless_asked() {
    let place = Place::new();
    let folder = place.text("roads");
    let run = |more: &[&str]| cached(&place, &[&["generate", "--count", "2", "-o", &folder], more].concat());
    succeed(&run(&[]));
    let file = Path::new(&folder).join("wide-0-1.toml");
    std::fs::remove_file(Path::new(&folder).join("contact-sheet.svg")).unwrap();
    std::fs::remove_file(Path::new(&folder).join("contact-sheet.png")).unwrap();
    std::fs::write(&file, "mine").unwrap();
    std::fs::remove_file(Path::new(&folder).join("wide-0-0.toml")).unwrap();
    let said = refusal(&run(&[]), 2);
    assert!(
        said.contains("--output: ")
            && said.contains("wide-0-1.toml; exists and holds something else; another folder would do"),
        "{said}"
    );
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "mine");
    assert!(!Path::new(&folder).join("wide-0-0.toml").exists(), "nothing is written");
    succeed(&run(&["--overwrite"]));
    assert!(std::fs::read_to_string(&file).unwrap().contains("[ring]"));
}

#[test]
fn a_generation_that_failed_on_the_way_succeeds_when_it_is_tried_again() {
    let place = Place::new();
    let folder = place.file("roads");
    let run = || cached(&place, &["generate", "--count", "2", "-o", &place.text("roads")]);
    // A folder stands where the last file is to be written.
    std::fs::create_dir_all(folder.join("contact-sheet.png")).unwrap();
    refusal(&run(), 2);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "nothing is written");
    std::fs::remove_dir(folder.join("contact-sheet.png")).unwrap();
    succeed(&run());
    // As after a kill or on a full disk: some of the files are there.
    let [road, sheet] = ["wide-0-1.toml", "contact-sheet.svg"].map(|name| folder.join(name));
    let before = [&road, &sheet].map(|file| std::fs::read(file).unwrap());
    std::fs::remove_file(&road).unwrap();
    std::fs::remove_file(&sheet).unwrap();
    succeed(&run());
    assert_eq!([&road, &sheet].map(|file| std::fs::read(file).unwrap()), before);
}

#[test]
fn the_plot_marks_the_five_measured_roundabouts() {
    let place = Place::new();
    succeed(&cached(&place, &["generate", "--count", "5", "--plot", &place.text("plot.svg")]));
    let svg = std::fs::read_to_string(place.file("plot.svg")).unwrap();
    for words in ["16m", "20m", "32m", "40m", "50m", "island radius [m]", "least distance of a route from a kerb [m]"] {
        assert!(svg.contains(&format!("aria-label=\"{words}\"")), "{words}");
    }
}

#[test]
fn wrong_flags_are_refused_with_what_would_do() {
    let place = Place::new();
    let output = place.text("roads");
    for (arguments, expected) in [
        (vec!["generate"], "--output"),
        (vec!["generate", "--count", "0", "-o", &output], "--count: 0; must lie in 1..100000"),
        (vec!["generate", "--first", "4294967295", "-o", &output], "--first: 4294967295; must be at most 4294967276"),
        (
            vec!["generate", "--distribution", "narrow", "-o", &output],
            "distribution: narrow; must be a path ending in .toml or one of mixed, wide",
        ),
        (vec!["generate", "--plot", "plot.gif"], "--plot: plot.gif; must end in .svg or .png"),
        (vec!["draw", "wide/7", "-o", "x.svg"], "roundabout: wide/7; must be a path"),
        (
            vec!["evaluate", "--route", "wide/7/12/N-left-9"],
            "--route: wide/7/12/N-left-9; of wide/7/12 the benchmark attard2023 has wide/7/12/",
        ),
        (
            vec!["evaluate", "--route", "16m/N-left-3"],
            "--route: 16m/N-left-3; is not in the split asked for: give --split train",
        ),
        (
            vec!["evaluate", "--route", "nowhere"],
            "--route: nowhere; a route of the benchmark attard2023 is needed, such as",
        ),
        (vec!["record", "--route", "wide/7/12/N-left-9", "-o", "x.json"], "--route: wide/7/12/N-left-9; of wide/7/12"),
    ] {
        let said = refusal(&offtrack(&arguments), 2);
        assert!(said.contains(expected), "{arguments:?}: {said}");
    }
}

#[test]
fn a_random_road_is_drawn_evaluated_recorded_and_certified_by_name() {
    let place = Place::new();
    let road = find("wide/7/12").unwrap();
    let routes = road.routes(40.0, 35.0, 2.0).unwrap();
    let name = &routes[0].name;
    succeed(&offtrack(&["draw", "wide/7/12", "--route", name, "-o", &place.text("road.json")]));
    assert_eq!(place.json("road.json")["routes"][0]["name"], name.as_str());
    let evaluate = |more: &[&str]| {
        let arguments = ["evaluate", "--policy", "pursuit", "--episodes", "2", "--json", &place.text("report.json")];
        succeed(&offtrack(&[&arguments[..], more].concat()));
        place.json("report.json")
    };
    let whole = evaluate(&["--route", "wide/7/12"]);
    assert_eq!(whole["routes"].as_array().unwrap().len(), routes.len());
    assert_eq!(whole["split"], "test");
    let some = evaluate(&["--route", name, "--route", "20m/E-left-2", "--route", "wide/7/13"]);
    let names: Vec<&str> =
        some["routes"].as_array().unwrap().iter().map(|route| route["name"].as_str().unwrap()).collect();
    assert!(
        names[..2] == ["20m/E-left-2", name]
            && names[2..].iter().all(|name| name.starts_with("wide/7/13/"))
            && 10 < names.len(),
        "{names:?}"
    );
    let record =
        ["record", "--policy", "pursuit", "--episodes", "2", "--route", name, "-o", &place.text("episode.json")];
    succeed(&offtrack(&record));
    assert_eq!(place.json("episode.json")["route"], name.as_str());
    let easy = routes.iter().find(|route| route.name.ends_with("left-2")).unwrap_or(&routes[0]);
    let benchmark = place.text("short.toml");
    succeed(&offtrack(&[
        "certify",
        "--benchmark",
        &benchmark,
        "--route",
        &easy.name,
        "--widths",
        "64",
        "--json",
        &place.text("certificate.json"),
    ]));
    let certificate = place.json("certificate.json");
    assert_eq!(certificate["routes"].as_array().unwrap().len(), 1);
    assert_eq!(certificate["routes"][0]["name"], easy.name.as_str());
    succeed(&offtrack(&["certify", "--benchmark", &benchmark, "--verify", &place.text("certificate.json")]));
}
