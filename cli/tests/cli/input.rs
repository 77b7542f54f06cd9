//! Wrong input of every command: exit code 2, and an error with name, value and what would do.

use crate::place::{Place, offtrack, refusal, repository, succeed};

#[test]
fn a_wrong_argument_is_reported_with_its_value_and_what_would_do() {
    let cases: [(&[&str], &[&str]); 31] = [
        (&["evaluate", "--policy", "random", "--episodes", "0"], &["--episodes: 0; must lie in 1..100000"]),
        (&["evaluate", "--policy", "random", "--episodes", "many"], &["'many'", "--episodes"]),
        (
            &["evaluate", "--policy", "random", "--benchmark", "nowhere"],
            &["benchmark: nowhere; must be a path ending in .toml or one of attard2023,"],
        ),
        (&["evaluate", "--policy", "random", "--benchmark", "nowhere.toml"], &["nowhere.toml: cannot be read"]),
        (&["evaluate", "--policy", "random", "--split", "all"], &["'all'", "--split", "test, validation, train"]),
        (&["evaluate", "--policy", "random", "--seed", "-1"], &["-1"]),
        (&["evaluate", "--policy", "pursuit", "--look-ahead", "nan"], &["--look-ahead: NaN m; must lie in 1..50 m"]),
        (&["evaluate", "--policy", "pursuit", "--look-ahead", "-3"], &["--look-ahead: -3 m; must lie in 1..50 m"]),
        (&["evaluate", "--policy", "no.safetensors"], &["no.safetensors: cannot be read"]),
        (&["certify", "--widths", "64,0"], &["--widths: 0; must lie in 1..262144"]),
        (&["certify", "--hold", "0"], &["--hold: 0; must lie in 1..50"]),
        (&["certify", "--verify", "no.json"], &["no.json: cannot be read"]),
        (&["scale", "--envs", "0"], &["--envs: 0; must lie in 1..4194304"]),
        (&["scale", "--envs", "64..16"], &["--envs: 64..16; must lie in 1..4194304"]),
        (&["scale", "--seconds", "-1"], &["--seconds: -1 s; must lie in 0.1..3600 s"]),
        (&["scale", "--plot", "speed.pdf"], &["--plot: speed.pdf; must end in .svg or .png"]),
        (&["scale", "--mode", "blind"], &["'blind'", "random"]),
        (&["scale", "--device", "tpu"], &["'tpu'", "cpu, gpu"]),
        (&["scale", "--adapter", "H200"], &["--adapter: H200; the processor has no adapter: add --device gpu"]),
        (&["evaluate", "--adapter", "H200"], &["--adapter: H200; the processor has no adapter: add --device gpu"]),
        (&["bench", "--seconds", "-1"], &["--seconds: -1 s; must lie in 0.1..3600 s"]),
        (&["bench", "--hidden", "256,0"], &["--hidden: 0; sizes must lie in 1..8192"]),
        (&["bench", "--batch", "1"], &["--batch: 1; must lie in 2..1048576"]),
        (&["train", "no.toml"], &["no.toml: cannot be read"]),
        (&["train", "--minutes", "nan"], &["minutes: NaN min; must lie in 0.01..100000 min"]),
        (&["train", "--wings", "2"], &["'--wings'"]),
        (&["trace", "no.json"], &["no.json: cannot be read"]),
        (&["deviations", "no.toml", "no.json"], &["no.toml: cannot be read"]),
        (&["deviations", "17m", "no.json"], &["roundabout: 17m; must be a path ending in .toml or one of 16m,"]),
        (&["deviations", "16m", "no.json"], &["no.json: cannot be read"]),
        (&["fly"], &["'fly'"]),
    ];
    for (arguments, expected) in cases {
        let said = refusal(&offtrack(arguments), 2);
        assert!(expected.iter().all(|words| said.contains(words)), "{arguments:?}: {said}");
    }
}

#[test]
fn runs_below_a_file_are_a_failure_that_names_the_folder() {
    let place = Place::new();
    let below_a_file = place.text("short.toml/runs");
    let said = refusal(&offtrack(&["train", &place.text("tiny.toml"), "--out", &below_a_file]), 1);
    assert!(said.contains(&below_a_file) && said.contains("cannot be written"), "{said}");
}

#[test]
fn trajectories_are_printed_and_cases_of_another_kind_are_named() {
    let output = offtrack(&["trace", "tests/data/physics_vectors.json"]);
    let said = refusal(&output, 0);
    assert_eq!(said.lines().filter(|line| line.contains("is skipped: its kind is")).count(), 8, "{said}");
    let printed: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(printed["cases"].as_array().map(Vec::len), Some(22));
}

#[test]
fn a_wrong_trajectory_case_is_refused_by_its_file_case_and_key() {
    let place = Place::new();
    let vectors = std::fs::read_to_string(crate::place::repository().join("tests/data/physics_vectors.json")).unwrap();
    for (from, to, expected) in [
        ("\"dt\": 0.05", "\"dt\": -1", "case \"straight_30\": dt: -1 s"),
        ("\"L1\"", "\"l1\"", "case \"straight_30\": missing field `L1`"),
        ("{", "[", "is not JSON"),
    ] {
        let changed = vectors.replacen(from, to, 1);
        assert_ne!(changed, vectors);
        std::fs::write(place.file("cases.json"), changed).unwrap();
        let said = refusal(&offtrack(&["trace", &place.text("cases.json")]), 2);
        assert!(said.contains(&place.text("cases.json")) && said.contains(expected), "{said}");
    }
}

/// The commands that read a file which is not TOML, with `file` as that file.
fn readers(file: &str) -> [Vec<&str>; 5] {
    [
        vec!["evaluate", "--episodes", "1", "--policy", file],
        vec!["evaluate", "--episodes", "1", "--policy", "random", "--certified", file],
        vec!["certify", "--verify", file],
        vec!["trace", file],
        vec!["deviations", "16m", file],
    ]
}

#[test]
#[cfg(unix)]
fn a_pipe_a_device_and_a_folder_are_refused_at_once_by_every_command_that_reads_a_file() {
    let place = Place::new();
    let pipe = place.text("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for file in [pipe.as_str(), "/dev/zero", &place.text("")] {
        for arguments in readers(file) {
            let said = refusal(&offtrack(&arguments), 2);
            assert!(said.contains("is not a regular file"), "{arguments:?}: {said}");
        }
    }
    // A run's report and figures.
    std::fs::create_dir_all(place.file("run/report.json")).unwrap();
    let page = place.text("page.html");
    let arguments = ["--policy", "random", "--episodes", "1", "--html", &page, "--run"];
    let said = refusal(&place.evaluate(&[&arguments[..], &[&place.text("run")]].concat()), 2);
    assert!(said.contains("report.json: is not a regular file"), "{said}");
}

#[test]
fn a_file_larger_than_any_of_its_kind_is_refused_before_it_is_read() {
    let place = Place::new();
    // Sparse: it takes no room on the disk.
    std::fs::File::create(place.file("large")).unwrap().set_len(1 << 36).unwrap();
    for arguments in readers(&place.text("large")) {
        let said = refusal(&offtrack(&arguments), 2);
        assert!(said.contains("is larger than"), "{arguments:?}: {said}");
    }
}

#[test]
fn deeply_nested_json_is_an_error_and_no_abort() {
    let place = Place::new();
    std::fs::write(place.file("deep.json"), "[".repeat(10_000_000)).unwrap();
    for arguments in &readers(&place.text("deep.json"))[1..] {
        let said = refusal(&offtrack(arguments), 2);
        assert!(said.len() < 500, "{arguments:?}: {said}");
    }
}

#[test]
fn a_long_value_is_not_repeated_whole() {
    let place = Place::new();
    let long = "x".repeat(1_000_000);
    std::fs::write(place.file("cases.json"), format!(r#"{{"cases": [{{"id": ["{long}"]}}]}}"#)).unwrap();
    let said = refusal(&offtrack(&["trace", &place.text("cases.json")]), 2);
    assert!(said.contains("cases[0].id") && said.contains("must be text") && said.len() < 1000, "{}", said.len());
    std::fs::write(place.file("measured.json"), format!(r#"{{"{long}": 1}}"#)).unwrap();
    let said = refusal(&offtrack(&["deviations", "16m", &place.text("measured.json")]), 2);
    assert!(said.contains("unknown field") && said.len() < 1000, "{}", said.len());
}

/// Escape sequences of a terminal, a bell, a line end, and marks that turn and hide text.
const ODD: &str = "\u{1b}]0;owned\u{7}\u{1b}[2J\u{9b}31m\u{202e}\u{200b}x\nforged";

/// What a command has said on either stream, which must be short and hold nothing that a terminal obeys but line ends.
fn harmless(arguments: &[&str], output: &std::process::Output) -> String {
    assert!([0, 1, 2].contains(&output.status.code().unwrap()), "{arguments:?}");
    let said = [&output.stdout, &output.stderr].map(|said| String::from_utf8(said.clone()).unwrap()).concat();
    let obeyed = |c: &char| (c.is_control() && *c != '\n') || ['\u{202e}', '\u{200b}'].contains(c);
    assert!(!said.contains(|c| obeyed(&c)), "{arguments:?}: {said:?}");
    assert!(!said.lines().any(|line| line.starts_with("forged")), "{arguments:?}: {said}");
    assert!(said.lines().all(|line| line.chars().count() < 2500), "{arguments:?}: {said}");
    said
}

#[test]
fn names_in_files_and_arguments_do_nothing_to_a_terminal_and_are_not_repeated_whole() {
    let place = Place::new();
    let long = "x".repeat(5000);
    std::fs::write(place.file("escape.toml"), format!("vehicle = \"{ODD}\"\n").replace("x\nforged", "x")).unwrap();
    std::fs::write(place.file("table.toml"), "vehicle = \"daf_xf\"\nload = \"\\u001b[2J\\u202e\\nforged\"\n").unwrap();
    std::fs::write(place.file("key.toml"), "\"\\u001b[2J\\u202e\\nforged\" = 1\n").unwrap();
    std::fs::write(place.file("text.json"), format!("{{\"{ODD}\": 1}}")).unwrap();
    std::fs::write(place.file("cases.json"), serde_json::json!({"cases": [{"id": ODD, "kind": ODD}]}).to_string())
        .unwrap();
    let [tiny, tables, text, cases, svg] =
        ["tiny.toml", "table.toml", "text.json", "cases.json", "x.svg"].map(|name| place.text(name));
    let mut n_commands = 0;
    for file in [ODD, &long, &place.text("escape.toml"), &tables, &place.text("key.toml"), &text, &cases] {
        let set = format!("{file}=1");
        for arguments in [
            vec!["evaluate", "--policy", "random", "--episodes", "1", "--benchmark", file],
            vec!["evaluate", "--policy", file],
            vec!["evaluate", "--policy", "random", "--route", file],
            vec!["evaluate", "--policy", "random", "--load", file],
            vec!["evaluate", "--policy", "random", "--certified", file],
            vec!["evaluate", "--policy", "random", "--html", &svg, "--run", file],
            vec!["evaluate", "--split", file],
            vec!["certify", "--verify", file],
            vec!["certify", "--widths", file],
            vec!["record", "--route", file, "-o", &svg],
            vec!["record", "--route", "20m/N-left-3", "-o", file],
            vec!["draw", file, "-o", &svg],
            vec!["draw", "16m", "--vehicle", file, "--route", "N-left-3", "-o", &svg],
            vec!["draw", "16m", "--route", file, "-o", &svg],
            vec!["generate", "--distribution", file, "-o", &text],
            vec!["generate", "--plot", file],
            vec!["import", file, "--list"],
            vec!["trace", file],
            vec!["deviations", "16m", file],
            vec!["deviations", file, file],
            vec!["scale", "--envs", file],
            vec!["scale", "--benchmark", file, "--seconds", "0.1", "--envs", "1"],
            vec!["train", file],
            vec!["train", "--set", file],
            vec!["train", "--set", &set],
            vec!["train", &tiny, "--from", file],
            vec!["train", &tiny, "--name", file],
            vec!["train", "--seeds", file],
            vec!["train", "--resume", file],
            vec![file],
            vec!["train", "tiny", file],
        ] {
            harmless(&arguments, &offtrack(&arguments));
            n_commands += 1;
        }
    }
    assert_eq!(n_commands, 7 * 31);
    let said = harmless(&[], &offtrack(&["evaluate", "--benchmark", &place.text("escape.toml")]));
    assert!(said.contains("vehicle = \"\\u{1b}]0;owned\\u{7}"), "{said}");
    let said = harmless(&[], &offtrack(&["train", "--set", &format!("{long}=1")]));
    assert!(said.len() < 1500, "{}", said.len());
    let said = harmless(&[], &offtrack(&["fly", &format!("--{ODD}")]));
    assert!(said.contains("unrecognized subcommand 'fly'"), "{said}");
    let said = harmless(&[], &offtrack(&["evaluate", ODD]));
    assert!(said.contains("unexpected argument '\\u{1b}]0;owned\\u{7}") && said.contains("x\\nforged'"), "{said}");
    let printed = offtrack(&["trace", &cases]).stdout;
    assert_eq!(serde_json::from_slice::<serde_json::Value>(&printed).unwrap()["skipped"][0]["id"], ODD);
}

#[test]
fn a_name_of_a_file_that_a_table_shows_does_nothing_to_a_terminal() {
    let place = Place::new();
    // Slashes and zeros alone cannot stand in a name.
    let name = format!("{ODD}.toml");
    for file in ["short.toml", "tiny.toml"] {
        std::fs::copy(place.file(file), place.file(&format!("{file}{name}"))).unwrap();
    }
    let road = place.text(&name);
    std::fs::copy(crate::place::repository().join("scenarios/roundabouts/16m.toml"), &road).unwrap();
    let benchmark = place.text(&format!("short.toml{name}"));
    for arguments in [
        vec!["evaluate", "--policy", "random", "--episodes", "1", "--benchmark", &benchmark],
        vec!["evaluate", "--policy", "random", "--episodes", "1", "--route", &road],
        vec!["certify", "--widths", "1", "--hold", "50", "--split", "test", "--benchmark", &benchmark],
        vec!["deviations", &road, "tests/data/measured/16m.json"],
        vec!["train", &place.text(&format!("tiny.toml{name}")), "--out", &place.text(&format!("runs{ODD}"))],
    ] {
        let output = offtrack(&arguments);
        succeed(&output);
        let said = harmless(&arguments, &output);
        assert!(said.contains("\\u{1b}]0;owned"), "{arguments:?}: {said}");
    }
}

#[test]
fn a_roundabout_is_found_by_its_name_or_its_path() {
    for roundabout in ["16m", "scenarios/roundabouts/16m.toml"] {
        let output = offtrack(&["deviations", roundabout, "tests/data/measured/16m.json"]);
        succeed(&output);
        assert!(String::from_utf8_lossy(&output.stdout).contains("splitters"));
    }
}

#[test]
fn the_help_says_what_happens_without_a_command_and_lists_the_exit_codes() {
    let printed = |arguments: &[&str]| String::from_utf8_lossy(&offtrack(arguments).stdout).into_owned();
    assert_eq!(printed(&["--version"]), format!("offtrack {}\n", env!("CARGO_PKG_VERSION")));
    let help = printed(&["--help"]);
    assert!(help.contains("Without a command `offtrack` trains"), "{help}");
    assert!(["  0 ", "  1 ", "  2 ", "  130 "].iter().all(|code| help.contains(code)), "{help}");
    let help = printed(&["evaluate", "--help"]);
    assert!(
        ["lane: own", "off-track: largest", "LTR: largest load transfer ratio"]
            .iter()
            .all(|words| help.contains(words)),
        "{help}"
    );
}

#[test]
fn a_road_of_a_name_that_the_benchmark_has_is_refused() {
    let place = Place::new();
    let copy = place.text("20m.toml");
    std::fs::copy(repository().join("scenarios/roundabouts/40m.toml"), &copy).unwrap();
    for routes in [&["--route", &copy][..], &["--route", "wide/7/12", "--route", "wide/07/12"]] {
        let said = refusal(&offtrack(&[&["evaluate", "--policy", "random", "--episodes", "1"], routes].concat()), 2);
        assert!(said.contains("--route: ") && said.contains("another road of the benchmark is"), "{said}");
    }
}

#[test]
fn a_hand_is_for_a_map_alone() {
    let place = Place::new();
    let text = std::fs::read_to_string(repository().join("scenarios/attard2023.toml")).unwrap();
    let (head, roads) = text.split_once("[[roundabout]]").unwrap();
    let head = head.replace("\"vehicles/", &format!("\"{}/vehicles/", repository().join("scenarios").display()));
    let changed = format!("{head}[[roundabout]]\nhand = \"left\"{roads}");
    std::fs::write(place.file("left.toml"), changed).unwrap();
    let said = refusal(
        &offtrack(&["evaluate", "--policy", "random", "--episodes", "1", "--benchmark", &place.text("left.toml")]),
        2,
    );
    assert!(said.contains("roundabout[0].hand: given; is for a map"), "{said}");
}
