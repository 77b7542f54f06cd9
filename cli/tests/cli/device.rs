//! Devices from outside: which there are, what is said where one cannot be had, and the speed measured on either
//! engine.

use offtrack::engine::stages::STAGES;
use serde_json::Value;

use crate::place::{Place, offtrack, refusal, succeed};

/// Over in a moment.
const MOMENT: [&str; 2] = ["--seconds", "0.1"];

/// Modes with a network.
const NETWORKS: [&str; 3] = ["policy", "large-policy", "training"];

/// `scale` for a moment on a list of sizes, as JSON.
fn scaled(place: &Place, arguments: &[&str]) -> Value {
    succeed(&offtrack(&[&["scale", "--json", &place.text("scale.json")], &MOMENT[..], arguments].concat()));
    place.json("scale.json")
}

/// The modes with a network, in the order asked for: each counted where it was stepped, without times of stages.
fn assert_networks_acted(scale: &Value, envs: u64) {
    let runs = scale["runs"].as_array().unwrap();
    let modes: Vec<&str> = runs.iter().map(|run| run["mode"].as_str().unwrap()).collect();
    assert_eq!(modes, NETWORKS);
    for run in runs {
        let count = |key: &str| run[key].as_u64().unwrap_or_else(|| panic!("{key}: {run}"));
        assert!(0 < count("steps") && count("env_steps") == envs * count("steps") && count("envs") == envs, "{run}");
        assert!(
            0.0 < run["env_steps_per_second"].as_f64().unwrap() && run["stages"].as_object().unwrap().is_empty(),
            "{run}"
        );
    }
    // As the training file says.
    assert_eq!(
        (&scale["step"]["learning"]["updates_per_step"], &scale["step"]["learning"]["batch"]),
        (&1.into(), &32.into())
    );
}

/// A run that was measured: its counts agree with each other, and its speed lies between its windows.
fn assert_measured(run: &Value, envs: u64, rays: f64, on_device: bool) {
    assert_eq!((&run["envs"], &run["mode"]), (&Value::from(envs), &Value::from("random")), "{run}");
    let count = |key: &str| run[key].as_u64().unwrap_or_else(|| panic!("{key}: {run}"));
    let speed = |key: &str| run[key].as_f64().unwrap_or_else(|| panic!("{key}: {run}"));
    // Every truck was counted in every step where it was stepped.
    assert!(0 < count("steps") && count("env_steps") == envs * count("steps"), "{run}");
    let [slowest, median, fastest] = ["slowest_window", "env_steps_per_second", "fastest_window"].map(speed);
    assert!(0.0 < slowest && slowest <= median && median <= fastest, "{run}");
    let rays_a_step = rays * (1.0 + count("episodes") as f64 / count("env_steps") as f64);
    // Both speeds are whole numbers.
    assert!((speed("rays_per_second") / median - rays_a_step).abs() < 0.01, "{run}");
    assert_eq!(speed("bytes_per_truck"), 1044.0);
    let stages = run["stages"].as_object().unwrap();
    assert!(stages.len() == STAGES.len() && STAGES.iter().all(|stage| stages.contains_key(stage.name())), "{run}");
    assert!(
        stages.values().all(|time| 0.0 <= time.as_f64().unwrap()) && 0.0 < stages["sense"].as_f64().unwrap(),
        "{run}"
    );
    // A device is timed by the kernels of a step too.
    let kernels = run.get("kernels").map(|kernels| kernels.as_object().unwrap());
    assert_eq!(kernels.is_some(), on_device, "{run}");
    assert!(kernels.is_none_or(|kernels| kernels.len() == 9 && 0.0 < kernels["sense"].as_f64().unwrap()), "{run}");
}

#[test]
fn a_scale_on_the_processor_holds_every_size_and_draws_them_whole() {
    let place = Place::new();
    let scale = scaled(&place, &["--envs", "3,16..70", "--plot", &place.text("scale.svg")]);
    assert_eq!((&scale["engine"], &scale["device"]), (&Value::from("cpu"), &Value::from("cpu")));
    assert!(
        ["machine", "commit", "date"].iter().all(|key| scale[key].as_str().is_some_and(|text| !text.is_empty())),
        "{scale}"
    );
    let step = &scale["step"];
    assert_eq!(
        (&step["dt"], &step["substeps"], &step["rays"], &step["values"]),
        (&0.1.into(), &2.into(), &29.into(), &69.into())
    );
    // The fields of five roundabouts take some megabytes each.
    assert!((1 << 20..1 << 27).contains(&scale["world_bytes"].as_u64().unwrap()), "{scale}");
    let runs = scale["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 4);
    for (run, envs) in runs.iter().zip([3, 16, 64, 70]) {
        assert_measured(run, envs, 29.0, false);
    }
    let svg = std::fs::read_to_string(place.file("scale.svg")).unwrap();
    assert!(svg.trim_end().ends_with("</svg>"));
    for words in [
        "trucks",
        "env steps / s",
        "time a truck and step [ns]",
        "random actions",
        "time in proportion to the trucks",
        "sense",
    ] {
        assert!(svg.contains(&format!("aria-label=\"{words}\"")), "{words}");
    }
    assert!(svg.contains(scale["machine"].as_str().unwrap()) && svg.contains(scale["commit"].as_str().unwrap()));
}

#[test]
fn a_scale_is_drawn_as_a_png_too() {
    let place = Place::new();
    scaled(&place, &["--envs", "8", "--plot", &place.text("scale.png")]);
    let file = std::io::BufReader::new(std::fs::File::open(place.file("scale.png")).unwrap());
    let mut picture = png::Decoder::new(file).read_info().unwrap();
    let mut pixels = vec![0; picture.output_buffer_size().unwrap()];
    let info = picture.next_frame(&mut pixels).unwrap();
    assert_eq!(info.width, 1600);
    // Paper at all four corners, ink between.
    let row = 3 * info.width as usize;
    assert!([0, row - 3, pixels.len() - row, pixels.len() - 3].iter().all(|&at| pixels[at..at + 3] == [255; 3]));
    assert!(pixels.chunks_exact(3).any(|pixel| pixel.iter().all(|&channel| channel < 60)));
}

#[test]
fn networks_act_and_learn_on_the_processor() {
    let place = Place::new();
    let scale = scaled(&place, &["--envs", "16", "--mode", &NETWORKS.join(","), "--config", &place.text("tiny.toml")]);
    assert_networks_acted(&scale, 16);
    assert!(scale["step"]["learning"].is_object() && scaled(&place, &["--envs", "1"])["step"]["learning"].is_null());
    let said = refusal(&offtrack(&["scale", "--mode", "training", "--config", "no.toml"]), 2);
    assert!(said.contains("no.toml: cannot be read"), "{said}");
}

#[test]
fn an_adapter_for_a_training_run_on_the_processor_is_refused() {
    let place = Place::new();
    let said = refusal(
        &offtrack(&["train", &place.text("tiny.toml"), "--out", &place.text("runs"), "--adapter", "abacus"]),
        2,
    );
    assert!(said.contains("--adapter: abacus; the training file uses the processor"), "{said}");
}

#[cfg(not(feature = "gpu"))]
#[test]
fn a_training_file_for_a_device_is_refused_by_a_program_without_the_feature() {
    let place = Place::new();
    let said = refusal(
        &offtrack(&["train", &place.text("tiny.toml"), "--out", &place.text("runs"), "--set", "device=gpu"]),
        2,
    );
    assert!(said.contains("device: \"gpu\"; this program was built without the feature gpu"), "{said}");
    assert!(!std::path::Path::new(&place.text("runs")).exists());
}

#[cfg(not(feature = "gpu"))]
#[test]
fn a_program_without_the_feature_says_so_and_how_to_build_one_that_has_it() {
    let cases: [(&[&str], &str); 3] = [
        (&["devices"], "devices"),
        (&["scale", "--device", "gpu"], "--device: gpu"),
        (&["evaluate", "--device", "gpu", "--adapter", "llvmpipe"], "--device: gpu"),
    ];
    for (arguments, named) in cases {
        let said = refusal(&offtrack(arguments), 2);
        let expected = [named, "built without the feature gpu", "cargo build --release --features gpu"];
        assert!(expected.iter().all(|words| said.contains(words)), "{arguments:?}: {said}");
    }
}

#[cfg(feature = "gpu")]
mod on_a_device {
    use super::*;
    use crate::place::program;

    #[test]
    fn the_first_device_of_the_list_is_marked_and_is_the_one_a_result_names() {
        let output = offtrack(&["devices"]);
        succeed(&output);
        let listed = String::from_utf8(output.stdout).unwrap();
        let lines: Vec<&str> = listed.lines().collect();
        assert!(
            [
                "adapter",
                "interface",
                "driver",
                "kind",
                "largest buffer",
                "storage buffers (8 needed)",
                "workgroup memory (16 KiB needed)"
            ]
            .iter()
            .all(|head| lines[0].contains(head)),
            "{listed}"
        );
        assert!(lines[1].starts_with("*  ") && lines[1].contains("MiB"), "{listed}");
        assert!(lines[2..lines.len() - 1].iter().all(|line| line.starts_with("   ")), "{listed}");
        let place = Place::new();
        let scale = scaled(&place, &["--device", "gpu", "--envs", "16,50"]);
        let device = scale["device"].as_str().unwrap();
        let name = lines[1][3..].split("  ").next().unwrap();
        assert!(device.starts_with(name) && scale["engine"] == "gpu", "{device:?}, {name:?}");
        let runs = scale["runs"].as_array().unwrap();
        assert_eq!(runs.len(), 2);
        assert_measured(&runs[0], 16, 29.0, true);
        assert_measured(&runs[1], 50, 29.0, true);
        // Part of the name chooses it, whatever the case.
        let part: String = name.chars().take(4).collect::<String>().to_uppercase();
        assert_eq!(scaled(&place, &["--device", "gpu", "--adapter", &part, "--envs", "1"])["device"], scale["device"]);
    }

    #[test]
    fn an_unknown_adapter_is_refused_with_those_there_are() {
        let listed = String::from_utf8(offtrack(&["devices"]).stdout).unwrap();
        let name = listed.lines().nth(1).unwrap()[3..].split("  ").next().unwrap().to_owned();
        for command in ["scale", "evaluate"] {
            let said = refusal(&offtrack(&[command, "--device", "gpu", "--adapter", "abacus"]), 2);
            assert!(said.contains("--adapter: abacus; ") && said.contains(&name), "{said}");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn without_a_driver_a_failure_says_what_was_looked_for_and_how_to_get_one() {
        for arguments in [&["devices"][..], &["scale", "--device", "gpu"], &["evaluate", "--device", "gpu"]] {
            let mut command = program();
            // The second name is that of older loaders.
            let output = command
                .args(arguments)
                .env("VK_DRIVER_FILES", "/no.json")
                .env("VK_ICD_FILENAMES", "/no.json")
                .output()
                .unwrap();
            let said = refusal(&output, 1);
            assert!(
                ["no adapter", "VULKAN", "driver", "mesa-vulkan-drivers", "CPU"]
                    .iter()
                    .all(|words| said.contains(words)),
                "{said}"
            );
        }
    }

    #[test]
    fn a_size_beyond_the_adapter_is_a_result_and_the_others_go_on() {
        let place = Place::new();
        let scale = scaled(&place, &["--device", "gpu", "--envs", "4194304,16"]);
        let runs = scale["runs"].as_array().unwrap();
        assert_eq!((runs.len(), &runs[0]["envs"]), (2, &Value::from(4_194_304)));
        // A large graphics card holds them; a software adapter allows 128 MiB in a buffer.
        match runs[0]["error"].as_str() {
            Some(error) => assert!(error.contains("n_envs: 4194304") && error.contains("trucks fit"), "{error}"),
            None => assert_measured(&runs[0], 4_194_304, 29.0, true),
        }
        assert_measured(&runs[1], 16, 29.0, true);
    }

    #[test]
    fn a_training_run_on_an_adapter_that_is_not_there_leaves_no_folder_behind() {
        let place = Place::new();
        let arguments = ["train", &place.text("tiny.toml"), "--out", &place.text("runs"), "--set", "device=gpu"];
        let said = refusal(&offtrack(&[&arguments[..], &["--adapter", "abacus"]].concat()), 2);
        assert!(said.contains("adapter \"abacus\": not found; this machine has "), "{said}");
        assert!(!std::path::Path::new(&place.text("runs")).exists());
    }

    #[test]
    fn networks_act_and_learn_on_the_device() {
        let place = Place::new();
        // In the second one networks observe extras.
        for benchmark in ["attard2023", "laden2026"] {
            let arguments = [
                "--device",
                "gpu",
                "--envs",
                "16",
                "--mode",
                &NETWORKS.join(","),
                "--config",
                &place.text("tiny.toml"),
            ];
            assert_networks_acted(&scaled(&place, &[&["--benchmark", benchmark], &arguments[..]].concat()), 16);
        }
    }

    #[test]
    fn an_episode_recorded_on_the_device_is_that_of_the_processor() {
        let place = Place::new();
        let recorded = |arguments: &[&str]| {
            let fixed = ["record", "--route", "20m/E-left-3", "--episodes", "1", "-o", &place.text("episode.json")];
            succeed(&offtrack(&[&fixed, arguments].concat()));
            place.json("episode.json")
        };
        let (here, there) = (recorded(&[]), recorded(&["--device", "gpu"]));
        let frames = |recording: &Value| recording["frames"].as_array().unwrap().clone();
        assert_eq!((&here["ended"], frames(&here).len()), (&there["ended"], frames(&there).len()));
        for (here, there) in frames(&here).iter().zip(&frames(&there)) {
            let apart =
                |axis: usize| here["position"][axis].as_f64().unwrap() - there["position"][axis].as_f64().unwrap();
            // Lengths are rounded to 1 mm.
            assert!(apart(0).abs() < 2e-3 && apart(1).abs() < 2e-3, "{here} {there}");
            assert_eq!(here["action"], there["action"]);
        }
        // The device has driven: one that is not there is refused.
        let refused = ["record", "--route", "20m/E-left-3", "-o", "a.gif", "--device", "gpu", "--adapter", "abacus"];
        assert!(refusal(&offtrack(&refused), 2).contains("--adapter: abacus; "));
    }

    #[test]
    fn a_policy_is_trained_among_vehicles_on_the_device_and_drives_among_them_there() {
        let place = Place::new();
        let text = std::fs::read_to_string(place.file("short.toml")).unwrap();
        let among = "observation = { vehicles = true }\ntraffic = { demand = [900.0], hindrance = -1.0 }\n";
        std::fs::write(place.file("short.toml"), among.to_owned() + &text).unwrap();
        succeed(&place.train(&["--set", "device=gpu"]));
        let report = place.json("runs/tiny-1/report.json");
        assert_eq!(report["env_steps"], 1600, "{report}");
        // Its replay buffer would be full again after 400 more.
        let more = ["train", "--resume", &place.text("runs/tiny-1"), "--steps", "2000"];
        let said = refusal(&offtrack(&more), 2);
        assert!(said.contains("--steps: 2000; must be above 2000, or nothing is learned: a device fills"), "{said}");
        let policy = place.text("runs/tiny-1/policy.safetensors");
        let json = place.text("report.json");
        succeed(&place.evaluate(&["--policy", &policy, "--episodes", "2", "--device", "gpu", "--json", &json]));
        assert_eq!(place.json("report.json")["routes"].as_array().unwrap().len(), 2);
        let scale =
            ["scale", "--benchmark", &place.text("short.toml"), "--device", "gpu", "--envs", "16", "--json", &json];
        succeed(&offtrack(&[&scale[..], &MOMENT].concat()));
        let run = &place.json("report.json")["runs"][0];
        assert_eq!(run["bytes_per_truck"], 1788.0, "{run}");
        assert_eq!(run["kernels"].as_object().unwrap().len(), 17, "{run}");
    }

    #[test]
    fn an_episode_among_vehicles_is_recorded_with_them_and_evaluated_on_the_device() {
        let place = Place::new();
        let arguments = |device: &'static [&str]| {
            let among = ["--benchmark", "traffic2026", "--policy", "pursuit", "--episodes", "1"];
            [&among, device].concat()
        };
        let recorded = |device: &'static [&str]| {
            let fixed = ["record", "--route", "20m/E-left-3", "-o", &place.text("episode.json")];
            succeed(&offtrack(&[&fixed[..], &arguments(device)].concat()));
            place.json("episode.json")
        };
        let (here, there) = (recorded(&[]), recorded(&["--device", "gpu"]));
        let first = |recording: &Value| recording["vehicles"][0].as_array().unwrap().clone();
        assert!(!first(&there).is_empty() && first(&here) == first(&there), "{here} {there}");
        let evaluated = |device: &'static [&str]| {
            succeed(&offtrack(&[&["evaluate", "--json", &place.text("report.json")], &arguments(device)[..]].concat()));
            let report = place.json("report.json");
            let arrived = |route: &Value| route["arrived"].as_i64().unwrap();
            let routes = report["routes"].as_array().unwrap();
            (routes.len() as i64, routes.iter().map(arrived).sum::<i64>())
        };
        let (here, there) = (evaluated(&[]), evaluated(&["--device", "gpu"]));
        assert!(here.0 == there.0 && 10 * (here.1 - there.1).abs() <= here.0, "{here:?} {there:?}");
    }

    #[test]
    fn policies_arrive_as_often_on_every_route_as_on_the_processor() {
        let place = Place::new();
        let arrived = |arguments: &[&str]| {
            let fixed = ["evaluate", "--episodes", "3", "--json", &place.text("report.json")];
            succeed(&offtrack(&[&fixed, arguments].concat()));
            let report = place.json("report.json");
            let routes = report["routes"].as_array().unwrap().iter();
            let arrived: Vec<(String, u64)> = routes
                .map(|route| (route["name"].as_str().unwrap().to_owned(), route["arrived"].as_u64().unwrap()))
                .collect();
            (report["engine"].as_str().unwrap().to_owned(), arrived)
        };
        let (processor, device) = (arrived(&[]), arrived(&["--device", "gpu"]));
        assert_eq!(processor.0, "cpu");
        assert!(device.0.contains('(') && !device.0.contains("cpu"), "{}", device.0);
        assert_eq!((processor.1.len(), &processor.1), (23, &device.1));
        // A policy that fails on two routes of three, and other starts: equal counts are no accident of one that always
        // arrives.
        let pursuit = ["--policy", "pursuit", "--device", "gpu"];
        let device = arrived(&pursuit).1;
        assert_eq!(arrived(&pursuit[..2]).1, device);
        assert_ne!(arrived(&[&pursuit[..], &["--seed", "1"]].concat()).1, device);
    }
}
