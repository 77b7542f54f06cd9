//! Flags that would have no effect, or cost a file: refused before any work, on every command.

use crate::place::{Place, offtrack, refusal, repository, succeed};

#[test]
fn a_flag_without_effect_is_refused() {
    let place = Place::new();
    for policy in ["random", "attard2023"] {
        let said = refusal(&offtrack(&["evaluate", "--policy", policy, "--episodes", "1", "--look-ahead", "9"]), 2);
        assert!(said.contains("--look-ahead: 9 m; is for pure pursuit: give --policy pursuit"), "{said}");
    }
    let said =
        refusal(&offtrack(&["scale", "--envs", "8", "--seconds", "0.1", "--config", &place.text("tiny.toml")]), 2);
    assert!(said.contains("tiny.toml; is for --mode training"), "{said}");
    let said = refusal(&offtrack(&["scale", "--envs", "8", "--seconds", "0.1", "--submission", "4"]), 2);
    assert!(said.contains("--submission: 4; is for --mode random on a device"), "{said}");
    for both in
        [&["--list", "--check"][..], &["--junctions", "-o", "a.outline.toml"], &["--check", "-o", "a.outline.toml"]]
    {
        let said = refusal(&offtrack(&[&["import", "scenarios/maps/sumo_ring22.xodr"], both].concat()), 2);
        assert!(said.contains("cannot be used with"), "{said}");
    }
    let said = refusal(&offtrack(&["import", "scenarios/maps/sumo_ring22.xodr"]), 2);
    assert!(said.contains("--output <OUTPUT>"), "{said}");
}

#[test]
fn a_file_to_be_written_that_is_another_of_the_commands_files_is_refused_before_any_work() {
    let place = Place::new();
    succeed(&place.train(&["--name", "run", "--steps", "800"]));
    let policy = place.text("runs/run/policy.safetensors");
    let before = std::fs::read(&policy).unwrap();
    std::fs::create_dir(place.file("folder")).unwrap();
    let (one, same) = (place.text("report"), place.text("folder/../report"));
    for (files, expected) in [
        (["--html", &one, "--json", &one], "is the file of --json too"),
        (["--html", &one, "--json", &same], "is the file of --json too"),
        (["--episodes", "1", "--json", &policy], "is the file of --policy too: name another one"),
    ] {
        let said = refusal(&place.evaluate(&[&["--policy", policy.as_str()], &files[..]].concat()), 2);
        assert!(said.contains(expected), "{said}");
        assert!(!place.file("report").exists() && std::fs::read(&policy).unwrap() == before);
    }
    let said = refusal(
        &offtrack(&["scale", "--envs", "8", "--json", &place.text("a.svg"), "--plot", &place.text("a.svg")]),
        2,
    );
    assert!(said.contains("--plot: ") && said.contains("is the file of --json too"), "{said}");
    let vectors = place.text("vectors.json");
    std::fs::copy(repository().join("tests/data/physics_vectors.json"), &vectors).unwrap();
    let said = refusal(&offtrack(&["trace", &vectors, "-o", &vectors]), 2);
    assert!(said.contains("--output: ") && said.contains("is the file of CASES too"), "{said}");
}

#[test]
fn no_output_replaces_what_the_command_reads_under_another_name() {
    let place = Place::new();
    let own = place.text("own.toml");
    std::fs::copy(repository().join("scenarios/roundabouts/16m.toml"), &own).unwrap();
    let policy = place.text("policy.safetensors");
    std::fs::write(&policy, "a policy").unwrap();
    std::fs::create_dir(place.file("run")).unwrap();
    let report = place.text("run/report.json");
    std::os::unix::fs::symlink(place.file("seen.json"), place.file("seen.html")).unwrap();
    let (to, link) = (place.text("seen.json"), place.text("seen.html"));
    let yields = format!("yields:{policy}");
    // Written over the vehicle of its benchmark.
    let benchmark = place.text("benchmark.toml");
    let text = std::fs::read_to_string(repository().join("scenarios/attard2023.toml")).unwrap();
    std::fs::write(&benchmark, text.replace("vehicles/daf_xf.toml", "truck.toml")).unwrap();
    // Whatever the benchmark's ending.
    let other = place.text("benchmark.bench");
    std::fs::copy(&benchmark, &other).unwrap();
    let truck = place.text("truck.toml");
    std::fs::copy(repository().join("scenarios/vehicles/daf_xf.toml"), &truck).unwrap();
    let cases: [(&[&str], &str); 12] = [
        (
            &["evaluate", "--benchmark", &benchmark, "--json", &truck],
            "--json: {}; is named in the file of --benchmark: ",
        ),
        (&["evaluate", "--benchmark", &other, "--json", &truck], "--json: {}; is named in the file of --benchmark: "),
        (&["traffic", &own, "--json", &own], "--json: {}; is the file of ROAD too"),
        (&["scale", "--benchmark", &own, "--envs", "8", "--json", &own], "--json: {}; is the file of --benchmark too"),
        (&["evaluate", "--policy", &yields, "--json", &policy], "--json: {}; is the file of --policy too"),
        (
            &["evaluate", "--run", &place.text("run"), "--json", &report, "--html", &place.text("page.html")],
            "--json: {}; is the file of --run too",
        ),
        (&["evaluate", "--json", &to, "--html", &link], "--html: {}; is the file of --json too"),
        (&["evaluate", "--route", &own, "--json", &own], "--json: {}; is the file of --route too"),
        (&["certify", "--route", &own, "--widths", "1", "--json", &own], "--json: {}; is the file of --route too"),
        (
            &["evaluate", "--run", &place.text("run"), "--html", &place.text("run/checkpoint.safetensors")],
            "--html: {}; is the file of --run too",
        ),
        (&["web", "--road", &own, "--output", &own], "--output: {}; is the file of --road too"),
        (
            &["generate", "--output", &place.text("g"), "--plot", &place.text("g/contact-sheet.svg"), "--count", "2"],
            "--plot: {}; is the file of --output too",
        ),
    ];
    std::fs::create_dir(place.file("g")).unwrap();
    for (arguments, expected) in cases {
        let said = refusal(&offtrack(arguments), 2);
        let (flag, rest) = expected.split_once("{}").unwrap();
        assert!(said.contains(flag) && said.contains(rest), "{arguments:?}: {said}");
    }
    assert_eq!(std::fs::read_to_string(&policy).unwrap(), "a policy");
}
