//! Benchmarks by their names, `offtrack train --benchmark` of one's own, and validation that must drive as it says.

use crate::place::{Place, offtrack, program, refusal, succeed};

#[test]
fn a_shipped_name_is_what_comes_with_the_program_whatever_lies_in_the_folder() {
    let place = Place::new();
    std::fs::write(place.file("attard2023"), "neither a benchmark nor a policy").unwrap();
    let named = ["evaluate", "--benchmark", "attard2023", "--policy", "attard2023", "--episodes", "1"];
    succeed(&program().current_dir(place.file("")).args(named).output().unwrap());
}

#[test]
fn validation_that_drives_another_vehicle_or_otherwise_is_refused_before_a_folder_is_made() {
    let place = Place::new();
    place.validate(2, 1);
    let validated = std::fs::read_to_string(place.file("validated.toml")).unwrap();
    for (from, to, expected) in [
        ("daf_xf.toml", "us_wb62.toml", "in actions and vehicle lock"),
        ("load = \"empty\"", "load = \"laden\"", "in vehicle and load (laden)"),
        ("-0.8, -0.4,", "-0.8, -0.6, -0.4,", "in actions and vehicle lock"),
        ("[30.0]", "[12.0]", "in actions and vehicle lock"),
        ("\"drivable\"", "\"solid\"", "in gutter (solid in place of drivable)"),
        ("actions =", "observation = { extras = \"mass\" }\nactions =", "in observation.extras"),
    ] {
        assert!(validated.contains(from), "{from}");
        std::fs::write(place.file("validated.toml"), validated.replacen(from, to, 1)).unwrap();
        let message = refusal(&place.train(&[]), 2);
        let whole = format!(
            "it differs from short, which is trained on, {expected}: with --set validation.benchmark= validation is \
             as short says"
        );
        assert!(message.contains("tiny.toml: validation.benchmark: ") && message.contains(&whole), "{message}");
        assert!(!place.file("runs").exists());
    }
}

/// A benchmark for another vehicle, with other actions, at 12 km/h, with these splits; and a training file whose every
/// other key is for another benchmark.
fn own_benchmark(place: &Place, splits: [&str; 2]) -> String {
    let benchmark = std::fs::read_to_string(place.file("short.toml")).unwrap();
    let changes = [
        ("daf_xf.toml", "us_wb62.toml"),
        ("[-0.8, -0.4, 0.0, 0.4, 0.8]", "[-1.0, -0.7, -0.5, -0.3, -0.1, 0.0, 0.2, 0.6, 0.9]"),
        ("[30.0]", "[12.0]"),
        ("train = [\"E-right-1\"]", splits[0]),
        ("test = [\"E-right-1\", \"W-left-3\"]", splits[1]),
    ];
    let own = changes.iter().fold(benchmark, |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    std::fs::write(place.file("own.toml"), own).unwrap();
    let others = "training_benchmark = \"random2026-training\"\nalso_evaluate = [\"random2026\"]\n\
                  reward = { clearance = -100.0 }\n\
                  validation = { benchmark = \"random2026\", times = 1, episodes = 1 }\n";
    let training = std::fs::read_to_string(place.file("tiny.toml")).unwrap();
    std::fs::write(place.file("tiny.toml"), format!("{others}{training}mirror_augmentation = true\n")).unwrap();
    place.text("own.toml")
}

#[test]
fn a_benchmark_of_ones_own_is_trained_on_validated_and_evaluated_by_one_command_whatever_its_vehicle_and_actions() {
    let place = Place::new();
    let own = own_benchmark(&place, ["train = [\"E-left-3\"]\nvalidation = [\"N-right-1\"]", "test = [\"W-left-3\"]"]);
    let output = place.train(&["--name", "run", "--benchmark", &own]);
    let said = refusal(&output, 0);
    assert!(
        said.contains("note: trains without mirror augmentation") && said.contains("its opposite is not"),
        "{said}"
    );
    let report = place.json("runs/run/report.json");
    assert_eq!((&report["validation"]["benchmark"], &report["validation"]["routes"]), (&"own".into(), &1.into()));
    assert_eq!(report["evaluation"]["routes"][0]["name"], "20m/W-left-3");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("training on 1 training routes of own, cpu"), "{said}");
    // The folder has all that it takes to begin again.
    let config = place.text("runs/run/config.toml");
    succeed(&offtrack(&["train", &config, "--name", "again", "--out", &place.text("runs")]));
    let read =
        |place: &Place, run: &str| std::fs::read(place.file("runs").join(run).join("policy.safetensors")).unwrap();
    assert!(read(&place, "again") == read(&place, "run"));
    // Single keys can be set on top.
    let message = refusal(&place.train(&["--benchmark", &own, "--set", "validation.benchmark=random2026"]), 2);
    assert!(
        message.contains("validation.benchmark: random2026; it differs from own, which is trained on, in actions"),
        "{message}"
    );
}

#[test]
fn a_benchmark_of_ones_own_without_training_or_validation_routes_is_driven_on_random_roads() {
    let place = Place::new();
    let own = own_benchmark(&place, ["test = [\"E-left-3\"]", "test = [\"W-left-3\"]"]);
    let output = place.train(&["--name", "run", "--benchmark", &own]);
    succeed(&output);
    let report = place.json("runs/run/report.json");
    assert_eq!(
        (&report["validation"]["benchmark"], &report["validation"]["routes"]),
        (&"own on roads of random2026".into(), &775.into())
    );
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("training on 3765 training routes of own on roads of random2026, cpu"), "{said}");
    assert_eq!(report["evaluation"]["routes"].as_array().unwrap().len(), 2);
}

#[test]
fn a_lane_that_the_lock_does_not_allow_is_not_said_to_suffice() {
    let place = Place::new();
    let own = |lock: &str| {
        let benchmark = std::fs::read_to_string(place.file("short.toml")).unwrap();
        let benchmark =
            benchmark.replace("20m.toml", "40m.toml").replace("\"E-right-1\", \"W-left-3\"", "\"SW-left-1\"");
        std::fs::write(place.file("locked.toml"), format!("steer_max_deg = {lock}\n{benchmark}")).unwrap();
        let (benchmark, report) = (place.text("locked.toml"), place.text("report.json"));
        succeed(&offtrack(&[
            "evaluate",
            "--benchmark",
            &benchmark,
            "--policy",
            "random",
            "--episodes",
            "1",
            "--json",
            &report,
        ]));
        place.json("report.json")["routes"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|route| route["own_lane_suffices"] == true)
            .count()
    };
    // The path needs 8.4 deg.
    assert_eq!([own("40.0"), own("9.0"), own("5.0")], [1, 1, 0]);
}

#[test]
fn a_benchmark_slower_than_3_6_kmh_is_evaluated_with_either_clock() {
    let place = Place::new();
    let benchmark =
        std::fs::read_to_string(place.file("short.toml")).unwrap().replace("speeds_kmh = [30.0]", "speeds_kmh = [3.5]");
    assert!(benchmark.contains("[3.5]"));
    for clock in ["highest_speed", "feasible"] {
        let ending = format!("ending = {{ time_limit = 1.5, clock = \"{clock}\" }}\n");
        std::fs::write(place.file("slow.toml"), format!("{ending}{benchmark}")).unwrap();
        succeed(&offtrack(&[
            "evaluate",
            "--benchmark",
            &place.text("slow.toml"),
            "--policy",
            "pursuit",
            "--episodes",
            "1",
        ]));
    }
}

#[test]
fn a_mirror_that_the_actions_do_not_have_is_refused_before_a_folder_is_made() {
    let place = Place::new();
    let benchmark = std::fs::read_to_string(place.file("short.toml")).unwrap();
    std::fs::write(place.file("short.toml"), benchmark.replacen("-0.8, -0.4,", "-0.8, -0.5,", 1)).unwrap();
    let arguments = ["--name", "run", "--set", "learning.mirror_augmentation=true"];
    let message = refusal(&place.train(&arguments), 2);
    assert!(
        message.contains("learning.mirror_augmentation: true; steering") && message.contains("its opposite is not"),
        "{message}"
    );
    assert!(!place.file("runs").exists());
    // So the corrected retry may have the same name.
    std::fs::write(place.file("short.toml"), benchmark).unwrap();
    succeed(&place.train(&arguments));
}
