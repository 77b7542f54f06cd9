//! `offtrack evaluate`: every episode is counted, equal seeds give equal reports, and wrong policy files are refused.

use std::process::Stdio;

use offtrack::layout::N_VALUES;
use offtrack::scenario::Scenario;
use offtrack::world::World;
use offtrack_policy::{Activation, Frames, Head, Layer, Normalisation, Policy};
use serde_json::Value;

use crate::place::{Place, offtrack, program, refusal, repository, succeed};

#[test]
fn every_episode_is_counted_once_by_its_end_and_once_by_its_route() {
    let place = Place::new();
    for policy in ["random", "pursuit"] {
        succeed(&place.evaluate(&["--policy", policy, "--episodes", "3", "--json", &place.text("report.json")]));
        let report = place.json("report.json");
        assert_eq!(
            (&report["benchmark"], &report["split"], &report["policy"], &report["seed"]),
            (&Value::from("short"), &Value::from("test"), &Value::from(policy), &Value::from(0))
        );
        assert_eq!((report["engine"].as_str(), report["device"].as_str()), (Some("cpu"), Some("cpu")));
        assert!(
            ["machine", "commit"].iter().all(|key| report[key].as_str().is_some_and(|text| !text.is_empty())),
            "{report}"
        );
        let count = |value: &Value| value.as_u64().unwrap();
        let ends = |value: &Value| value["ends"].as_object().unwrap().values().map(count).sum::<u64>();
        let routes = report["routes"].as_array().unwrap();
        assert_eq!((routes.len(), count(&report["episodes"]), ends(&report)), (2, 6, 6));
        for route in routes {
            assert_eq!((count(&route["episodes"]), ends(route), &route["ends"]["arrived"]), (3, 3, &route["arrived"]));
            assert!(
                route["name"].is_string()
                    && route["own_lane_suffices"].is_boolean()
                    && route["lane_distance_mean"].is_f64()
            );
        }
        let arrived: u64 = routes.iter().map(|route| count(&route["arrived"])).sum();
        assert_eq!(arrived, count(&report["arrived"]));
        let [low, success, high] = ["success_low", "success", "success_high"].map(|key| report[key].as_f64().unwrap());
        assert!(
            low <= success && success <= high && (success - arrived as f64 / 6.0).abs() < 1e-9,
            "{low} {success} {high}"
        );
    }
}

#[test]
fn a_rule_among_vehicles_is_evaluated_by_demand_and_shown_with_them() {
    let place = Place::new();
    let (report, page) = (place.text("report.json"), place.text("page.html"));
    let flags = ["--benchmark", "traffic2026", "--route", "20m/N-right-2", "--episodes", "12", "--policy", "yields"];
    let output = offtrack(&[&["evaluate"][..], &flags, &["--avoidable", "--json", &report, "--html", &page]].concat());
    succeed(&output);
    let table = String::from_utf8(output.stdout).unwrap();
    let report = place.json("report.json");
    assert_eq!(report["policy"], "yields");
    let from = report["avoidable"]["from"].as_array().unwrap();
    assert_eq!(from.iter().map(|from| from["seconds"].as_f64().unwrap()).collect::<Vec<_>>(), [3.0, 1.0]);
    assert!(table.contains("contacts a search avoided"), "{table}");
    let groups = report["groups"]["demand"].as_array().unwrap();
    let names: Vec<&str> = groups.iter().map(|group| group["name"].as_str().unwrap()).collect();
    assert!(2 <= names.len() && names.iter().all(|name| name.ends_with("00 veh/h")), "{names:?}");
    assert!(names.iter().all(|name| table.contains(name)), "{table}");
    let counted: u64 = groups.iter().map(|group| group["episodes"].as_u64().unwrap()).sum();
    assert_eq!(counted, 12);
    assert!(std::fs::read_to_string(page).unwrap().contains("drawOthers"));
    let message = refusal(&offtrack(&["evaluate", "--policy", "follows", "--episodes", "1"]), 2);
    assert!(message.contains("--policy: follows; drives among other vehicles"), "{message}");
    let message = refusal(&offtrack(&["evaluate", "--policy", "pursuit", "--avoidable"]), 2);
    assert!(message.contains("--avoidable: attard2023; asks about contacts with other vehicles"), "{message}");
    let message = refusal(&offtrack(&["certify", "--benchmark", "traffic2026"]), 2);
    assert!(message.contains("`evaluate --avoidable` searches from before each contact"), "{message}");
}

#[test]
fn an_empty_split_is_named_with_its_file_and_those_that_have_routes() {
    let place = Place::new();
    let message = refusal(&place.evaluate(&["--policy", "pursuit", "--split", "validation"]), 2);
    let expected = format!(
        "--split: validation; {} has routes under train, test alone; list some under `validation`",
        place.text("short.toml")
    );
    assert!(message.contains(&expected), "{message}");
}

#[test]
fn equal_seeds_give_equal_reports_and_another_seed_gives_another() {
    let place = Place::new();
    let report = |seed: &str| {
        succeed(&place.evaluate(&[
            "--policy",
            "random",
            "--episodes",
            "2",
            "--seed",
            seed,
            "--json",
            &place.text("report.json"),
        ]));
        std::fs::read_to_string(place.file("report.json")).unwrap()
    };
    assert_eq!(report("4"), report("4"));
    assert_ne!(
        report("4").replace("\"seed\": 4", ""),
        report("5").replace("\"seed\": 5", ""),
        "not only the line of the seed differs"
    );
}

#[test]
fn starts_where_the_policy_failed_are_searched_and_told_apart() {
    let place = Place::new();
    let evaluate = |extra: &[&str]| {
        let report = place.text("report.json");
        let output = place.evaluate(&[&["--policy", "random", "--episodes", "2", "--json", &report], extra].concat());
        succeed(&output);
        (place.json("report.json"), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let (plain, _) = evaluate(&[]);
    let (report, printed) = evaluate(&["--certify", "--widths", "16"]);
    let count = |value: &Value| value.as_u64().unwrap();
    let possible = &report["possible"];
    assert!(plain.get("possible").is_none() && plain["failures"][0].get("possible").is_none());
    assert_eq!(count(&report["arrived"]), 0, "random actions arrive nowhere");
    // The narrow search completes every route from the corners of the start errors.
    assert_eq!(["searched", "found", "episodes", "arrived"].map(|key| count(&possible[key])), [4, 4, 4, 0]);
    assert_eq!(possible["passes"].as_array().unwrap().len(), 2);
    assert_eq!(possible["lane"].as_array().unwrap().iter().map(|group| count(&group["episodes"])).sum::<u64>(), 4);
    let causes = report["failures"].as_array().unwrap();
    assert_eq!(causes.iter().map(|cause| count(&cause["episodes"])).sum::<u64>(), 4);
    assert!(causes.iter().all(|cause| cause["possible"] == cause["episodes"]), "{causes:?}");
    assert!(
        printed.lines().any(|line| line.starts_with("possible ")) && printed.contains("Not arrived, by cause: "),
        "{printed}"
    );
    assert!(
        refusal(&place.evaluate(&["--certify", "--widths", "0"]), 2).contains("--widths: 0; must lie in 1..262144")
    );
    refusal(&place.evaluate(&["--widths", "16"]), 2);
    let said = refusal(&place.evaluate(&["--certify", "--widths", "64,16,64"]), 2);
    assert!(said.contains("--widths: 64; stands there again as number 3: name each width once"), "{said}");
    let said = refusal(&place.evaluate(&["--episodes", "-1"]), 2);
    assert!(said.contains("--episodes"), "{said}");
}

#[test]
fn a_film_of_each_cause_shows_the_episode_that_its_example_names() {
    let place = Place::new();
    let films = place.text("films");
    let flags = ["--policy", "random", "--episodes", "3", "--seed", "7"];
    let evaluate =
        || place.evaluate(&[&flags[..], &["--films", &films, "--json", &place.text("report.json")]].concat());
    succeed(&evaluate());
    let said = refusal(&evaluate(), 2);
    assert!(said.contains("--films: ") && said.contains(".gif is in it: name another folder"), "{said}");
    let report = place.json("report.json");
    let causes = report["failures"].as_array().unwrap();
    assert_eq!(std::fs::read_dir(place.file("films")).unwrap().count(), causes.len().min(5));
    for (n, cause) in causes.iter().take(5).enumerate() {
        let (example, episode) = (&cause["example"], cause["example"]["episode"].to_string());
        let (benchmark, output) = (place.text("short.toml"), place.text("episode.json"));
        let route = example["route"].as_str().unwrap();
        let named = ["record", "--benchmark", &benchmark, "--route", route, "--episode", &episode, "-o", &output];
        succeed(&offtrack(&[&named[..], &flags[..]].concat()));
        let recording = place.json("episode.json");
        let frames = recording["frames"].as_array().unwrap();
        assert_eq!(recording["ended"], example["ended"]);
        assert_eq!(frames.len() as u64, example["steps"].as_u64().unwrap() + 1);
        for axis in 0..2 {
            let [film, named] =
                [&frames[frames.len() - 1], example].map(|state| state["position"][axis].as_f64().unwrap());
            assert!((film - named).abs() < 1e-3, "a recording is rounded to 1 mm: {film} {named}");
        }
        let name = format!("{}-{}.gif", n + 1, cause["cause"].as_str().unwrap().replace(' ', "-"));
        let mut film =
            gif::DecodeOptions::new().read_info(std::fs::File::open(place.file("films").join(name)).unwrap()).unwrap();
        let mut pages = 0;
        while film.read_next_frame().unwrap().is_some() {
            pages += 1;
        }
        assert_eq!(pages, (frames.len() - 1).div_ceil(2) + 1, "every second frame and the last");
    }
}

#[test]
fn a_damaged_policy_file_is_refused_by_its_name() {
    let place = Place::new();
    succeed(&place.train(&["--name", "run", "--steps", "600"]));
    let policy = place.text("runs/run/policy.safetensors");
    succeed(&place.evaluate(&["--policy", &policy, "--episodes", "1"]));
    let bytes = std::fs::read(&policy).unwrap();
    std::fs::write(place.file("cut"), &bytes[..bytes.len() / 2]).unwrap();
    std::fs::write(place.file("changed"), bytes.iter().rev().copied().collect::<Vec<u8>>()).unwrap();
    for (name, expected) in [
        ("cut", "is not a policy file"),
        ("cut", "; download it or train it again"),
        ("changed", "is not a policy file"),
        ("tiny.toml", "is not a policy file"),
        ("missing", "cannot be read"),
    ] {
        let said = refusal(&place.evaluate(&["--policy", &place.text(name), "--episodes", "1"]), 2);
        assert!(said.contains(&place.text(name)) && said.contains(expected), "{said}");
    }
    // The benchmark of the repository has nine actions where this policy learned five.
    let said = refusal(&offtrack(&["evaluate", "--policy", &policy, "--episodes", "1"]), 2);
    assert!(said.contains(&policy) && said.contains("another action table: 5 actions"), "{said}");
}

#[test]
fn a_network_of_tanh_layers_that_was_trained_elsewhere_is_evaluated_with_the_same_report() {
    let place = Place::new();
    let report = |activation: Activation| {
        let layer = |inputs: usize, outputs: usize| Layer {
            weights: (0..inputs * outputs).map(|index| ((index * 37 % 101) as f32 - 50.0) / 100.0).collect(),
            biases: vec![0.0; outputs],
        };
        let policy = Policy {
            name: String::new(),
            benchmark: "elsewhere".into(),
            // The table of the short benchmark: fractions of the vehicle's lock, 30 km/h.
            actions: World::bake(&Scenario::read(&place.file("short.toml")).unwrap()).unwrap().actions,
            extras: Vec::new(),
            vehicles: false,
            normalisation: Normalisation::none(N_VALUES),
            layers: vec![layer(N_VALUES, 64), layer(64, 64), layer(64, 5)],
            activation,
            head: Head::Levels,
            values: None,
            frames: Frames::default(),
            recurrent: None,
        };
        std::fs::write(place.file("elsewhere.safetensors"), policy.to_bytes()).unwrap();
        let file = place.text("elsewhere.safetensors");
        succeed(&place.evaluate(&["--policy", &file, "--episodes", "2", "--json", &place.text("report.json")]));
        let report = place.json("report.json");
        assert_eq!((&report["policy"], &report["episodes"]), (&Value::from(file), &Value::from(4)));
        assert_eq!(report["routes"].as_array().unwrap().len(), 2);
        report["routes"].clone()
    };
    assert_ne!(report(Activation::Tanh), report(Activation::Relu), "the activation of the file must matter");
}

#[test]
fn a_closed_standard_output_costs_the_table_and_not_the_report() {
    let place = Place::new();
    let mut evaluation = program()
        .args(["evaluate", "--benchmark", &place.text("short.toml"), "--policy", "random", "--episodes", "1"])
        .args(["--json", &place.text("report.json")])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(evaluation.stdout.take());
    let said = refusal(&evaluation.wait_with_output().unwrap(), 1);
    assert!(said.contains("standard output: cannot be written"), "{said}");
    assert_eq!(place.json("report.json")["episodes"], 2);
}

#[test]
fn without_a_policy_the_shipped_one_drives_as_its_report_says() {
    let place = Place::new();
    for benchmark in ["attard2023", "attard2023-as-run", "laden2026", "laden2026-50", "transfer2026"] {
        let shipped = repository().join("policy/shipped").join(benchmark);
        let reported: Value = serde_json::from_slice(&std::fs::read(shipped.join("report.json")).unwrap()).unwrap();
        let reported = &reported["evaluation"];
        succeed(&offtrack(&[
            "evaluate",
            "--benchmark",
            benchmark,
            "--episodes",
            "10",
            "--seed",
            "1",
            "--json",
            &place.text("report.json"),
        ]));
        let report = place.json("report.json");
        assert_eq!(report["policy"], format!("{benchmark} (shipped)"));
        let [found, expected] = [&report, reported].map(|report| report["success"].as_f64().unwrap());
        // 230 episodes with other starts than the report's 690: two standard errors of a fraction of 0.9 are 0.04.
        assert!((found - expected).abs() < 0.05, "{benchmark}: {found} {expected}");
    }
}

#[test]
fn the_shipped_policy_near_its_lane_keeps_half_the_distance_and_arrives() {
    let place = Place::new();
    let [usual, near] = ["attard2023", "attard2023-lane"].map(|policy| {
        succeed(&offtrack(&["evaluate", "--policy", policy, "--episodes", "4", "--json", &place.text("report.json")]));
        let report = place.json("report.json");
        assert_eq!(report["policy"], format!("{policy} (shipped)"));
        assert!(report["success"].as_f64().unwrap() > 0.95, "{policy}: {}", report["success"]);
        report["lane_distance_mean_arrived"].as_f64().unwrap()
    });
    assert!(near < 0.65 && near < 0.6 * usual, "{near} {usual}");
}

#[test]
fn the_shipped_policy_and_benchmark_are_found_wherever_the_program_runs_and_by_name() {
    let elsewhere = tempfile::tempdir().unwrap();
    for arguments in [&["evaluate", "--episodes", "1"][..], &["evaluate", "--episodes", "1", "--policy", "attard2023"]]
    {
        let output = program().current_dir(elsewhere.path()).args(arguments).output().unwrap();
        succeed(&output);
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            printed.starts_with(
                "policy attard2023 (shipped); benchmark attard2023, test routes; 1 episode a route, seed 0\n"
            ),
            "{printed}"
        );
    }
}

#[test]
fn a_policys_name_that_is_written_wrongly_is_refused_with_those_that_there_are() {
    let said = refusal(&offtrack(&["evaluate", "--episodes", "1", "--policy", "attard2023-lan"]), 2);
    assert!(said.contains("policy: attard2023-lan; the program comes with attard2023, attard2023-lane, "), "{said}");
    let said = refusal(&offtrack(&["evaluate", "--episodes", "1", "--policy", "attard2023-lan.safetensors"]), 2);
    assert!(said.contains("attard2023-lan.safetensors: cannot be read"), "{said}");
}

#[test]
fn a_benchmark_without_a_policy_of_its_own_is_driven_by_a_shipped_one_that_can_and_says_so() {
    for (benchmark, policy) in [("attard2023-full", "attard2023"), ("attard2023-maps-as-run", "attard2023-as-run")] {
        let output = offtrack(&["evaluate", "--benchmark", benchmark, "--episodes", "1"]);
        let said = refusal(&output, 0);
        assert!(
            said.contains(&format!("no policy comes with the program for {benchmark}; {policy} (shipped) drives")),
            "{said}"
        );
        assert!(
            String::from_utf8_lossy(&output.stdout)
                .starts_with(&format!("policy {policy} (shipped); benchmark {benchmark}"))
        );
    }
    // None has these actions.
    let said = refusal(&Place::new().evaluate(&["--episodes", "1"]), 2);
    assert!(said.contains("attard2023 (shipped): learned with another action table"), "{said}");
}

#[test]
fn a_policy_that_is_not_finite_is_refused_by_file_and_tensor() {
    let place = Place::new();
    let mut policy = Policy::shipped("attard2023").unwrap();
    policy.normalisation.mean[7] = f32::NAN;
    std::fs::write(place.file("nan.safetensors"), policy.to_bytes()).unwrap();
    let said = refusal(&offtrack(&["evaluate", "--episodes", "1", "--policy", &place.text("nan.safetensors")]), 2);
    assert!(said.contains("nan.safetensors: is a policy that cannot drive: observation.mean[7] is NaN"), "{said}");
}

#[test]
fn the_table_fits_the_terminal() {
    let place = Place::new();
    for (columns, limit) in [(None, 100), (Some("60"), 60), (Some("120"), 120)] {
        let mut evaluation = program();
        evaluation.args([
            "evaluate",
            "--benchmark",
            &place.text("short.toml"),
            "--policy",
            "random",
            "--episodes",
            "30",
        ]);
        match columns {
            Some(columns) => evaluation.env("COLUMNS", columns),
            None => evaluation.env_remove("COLUMNS"),
        };
        let output = evaluation.output().unwrap();
        succeed(&output);
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        let table = printed.split_once("\n\n").unwrap().1;
        assert!(table.lines().all(|line| line.chars().count() <= limit), "{limit}: {printed}");
        assert!(table.contains("load transfer ratio"), "{printed}");
    }
}

#[test]
fn the_curves_of_another_policys_run_are_refused_and_those_of_a_copys_are_shown() {
    let place = Place::new();
    for (run, seed) in [("one", "5"), ("two", "6")] {
        succeed(&place.train(&["--name", run, "--seed", seed, "--steps", "800"]));
    }
    let (page, run) = (place.text("page.html"), place.text("runs/one"));
    let evaluated =
        |policy: &str| place.evaluate(&["--policy", policy, "--episodes", "1", "--html", &page, "--run", &run]);
    for other in [place.text("runs/two/policy.safetensors"), "pursuit".to_owned(), "random".to_owned()] {
        let said = refusal(&evaluated(&other), 2);
        assert!(said.contains(&format!("--run: {run}; another policy is evaluated: give the run's own")), "{said}");
        assert!(!place.file("page.html").exists());
    }
    std::fs::copy(place.file("runs/one/policy.safetensors"), place.file("copy.safetensors")).unwrap();
    succeed(&evaluated(&place.text("copy.safetensors")));
}
