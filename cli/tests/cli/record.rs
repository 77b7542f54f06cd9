//! `offtrack record`: the episode that an evaluation counts, as data, film and picture.

use std::io::Cursor;

use offtrack::scenario::Scenario;
use offtrack::world::World;
use offtrack_policy::{Cell, Frames, Gates, Layer, Normalisation, Padding, Policy, Recurrent, Selection};
use serde_json::Value;

use crate::place::{Place, offtrack, refusal, succeed};

const ROUTE: &str = "20m/E-right-1";

fn record(place: &Place, output: &str, arguments: &[&str]) {
    succeed(&offtrack(&recording(place, output, arguments).iter().map(String::as_str).collect::<Vec<_>>()));
}

/// The arguments for an episode of the short benchmark.
fn recording(place: &Place, output: &str, arguments: &[&str]) -> Vec<String> {
    let mut all = ["record", "--benchmark", &place.text("short.toml"), "--route", ROUTE, "-o", &place.text(output)]
        .map(str::to_owned)
        .to_vec();
    if !arguments.contains(&"--policy") {
        all.extend(["--policy", "pursuit"].map(str::to_owned));
    }
    all.extend(arguments.iter().map(|&argument| argument.to_owned()));
    all
}

/// A file of a policy that remembers: recurrent layers behind two frames of the tractor's rays.
fn remembering(place: &Place) -> String {
    let layer = |inputs: usize, outputs: usize| Layer {
        weights: (0..inputs * outputs).map(|index| ((index * 37 % 101) as f32 - 50.0) / 25.0).collect(),
        biases: vec![0.0; outputs],
    };
    let policy = Policy {
        actions: World::bake(&Scenario::read(&place.file("short.toml")).unwrap()).unwrap().actions,
        values: Some(Selection::of(&["tractor_range".to_owned()]).unwrap()),
        frames: Frames { n: 2, padding: Padding::Zero },
        normalisation: Normalisation::none(13),
        layers: vec![layer(8, 5)],
        recurrent: Some(Recurrent {
            gates: Gates::Gru,
            after: 0,
            cells: vec![Cell { input: layer(26, 24), hidden: layer(8, 24) }],
        }),
        ..Policy::shipped("attard2023").unwrap()
    };
    std::fs::write(place.file("remembering.safetensors"), policy.to_bytes()).unwrap();
    place.text("remembering.safetensors")
}

#[test]
fn the_episodes_recorded_are_those_that_the_evaluation_counts_by_a_policy_with_a_memory_too() {
    let place = Place::new();
    for policy in ["random", &remembering(&place)] {
        let of_all = ["--policy", policy, "--seed", "7", "--episodes", "3"];
        succeed(&place.evaluate(&[&of_all[..], &["--json", &place.text("report.json")]].concat()));
        let report = place.json("report.json");
        let counted = report["routes"].as_array().unwrap().iter().find(|route| route["name"] == ROUTE).unwrap();
        let mut reward = 0.0;
        let mut steps = 0;
        for episode in ["0", "1", "2"] {
            record(&place, "episode.json", &[&of_all[..], &["--episode", episode]].concat());
            let recording = place.json("episode.json");
            let frames = recording["frames"].as_array().unwrap();
            assert_eq!(
                (&recording["route"], &recording["episode"]),
                (&Value::from(ROUTE), &Value::from(episode.parse::<u32>().unwrap()))
            );
            assert!(0 < counted["ends"][recording["ended"].as_str().unwrap()].as_u64().unwrap());
            assert!(frames[0]["action"].is_null() && frames[1..].iter().all(|frame| frame["action"].is_u64()));
            assert!(frames.iter().all(|frame| frame["ranges"].as_array().unwrap().len() == 29));
            steps += frames.len() - 1;
            reward += frames.iter().map(|frame| frame["reward"].as_f64().unwrap()).sum::<f64>();
        }
        assert!(
            (0.1 * steps as f64 / 3.0 - counted["time_mean"].as_f64().unwrap()).abs() < 1e-9,
            "a frame a step, and the start"
        );
        // Rewards are written to a thousandth; an episode has fewer than a thousand steps.
        assert!((reward / 3.0 - counted["reward_mean"].as_f64().unwrap()).abs() < 1.0);
    }
}

#[test]
fn the_same_flags_give_the_same_bytes_in_every_format_and_another_start_gives_others() {
    let place = Place::new();
    for name in ["a.json", "a.svg", "a.png", "a.gif"] {
        let bytes = |episode: &str| {
            record(&place, name, &["--episode", episode, "--episodes", "2", "--policy", "random"]);
            std::fs::read(place.file(name)).unwrap()
        };
        let first = bytes("0");
        assert_eq!(first, bytes("0"), "{name}");
        assert_ne!(first, bytes("1"), "{name}");
    }
}

#[test]
fn a_film_has_every_second_frame_and_the_last_in_the_size_asked_for() {
    let place = Place::new();
    record(&place, "a.json", &[]);
    record(&place, "a.gif", &["--size", "240"]);
    let frames = place.json("a.json")["frames"].as_array().unwrap().len();
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::Indexed);
    let mut decoder = options.read_info(Cursor::new(std::fs::read(place.file("a.gif")).unwrap())).unwrap();
    assert_eq!(decoder.width(), 240);
    let height = decoder.height();
    assert!((240..360).contains(&height), "{height}");
    let mut pages = Vec::new();
    while let Some(page) = decoder.read_next_frame().unwrap() {
        pages.push((page.width, page.height, page.delay));
    }
    assert_eq!(pages.len(), (frames - 1).div_ceil(2) + 1);
    assert_eq!((pages[0], pages[pages.len() - 1].2), ((240, height, 10), 250));
    assert!(pages[1..].iter().all(|&(width, high, _)| width < 240 || high < height), "later pages hold what changed");
}

#[test]
fn a_film_of_several_routes_shows_them_one_after_another_and_other_files_hold_one() {
    let place = Place::new();
    let pages = |name: &str| {
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::Indexed);
        let mut decoder = options.read_info(Cursor::new(std::fs::read(place.file(name)).unwrap())).unwrap();
        let mut delays = Vec::new();
        while let Some(page) = decoder.read_next_frame().unwrap() {
            delays.push(page.delay);
        }
        delays
    };
    record(&place, "one.gif", &["--size", "200"]);
    // A random road, which the benchmark does not have.
    record(&place, "two.gif", &["--size", "200", "--route", "wide/7/12/S-left-1"]);
    let (one, two) = (pages("one.gif"), pages("two.gif"));
    assert!(one.len() < two.len() && two.starts_with(&one), "{one:?} {two:?}");
    assert_eq!(two.iter().filter(|&&delay| delay == 250).count(), 2, "each ends with a rest");
    let all = recording(&place, "two.png", &["--route", "wide/7/12/S-left-1"]);
    let said = refusal(&offtrack(&all.iter().map(String::as_str).collect::<Vec<_>>()), 2);
    assert!(said.contains("must end in .gif: other files hold one episode, one --route"), "{said}");
}

#[test]
fn a_still_has_the_size_asked_for_and_says_how_the_episode_ended() {
    let place = Place::new();
    record(&place, "a.png", &["--size", "300"]);
    let bytes = std::fs::read(place.file("a.png")).unwrap();
    let mut decoder = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
    assert_eq!(decoder.info().width, 300);
    let mut pixels = vec![0; decoder.output_buffer_size().unwrap()];
    decoder.next_frame(&mut pixels).unwrap();
    record(&place, "a.json", &[]);
    record(&place, "a.svg", &[]);
    let ended = place.json("a.json")["ended"].as_str().unwrap().replace('_', " ");
    let still = std::fs::read_to_string(place.file("a.svg")).unwrap();
    assert!(still.contains(&format!("{ROUTE}, pure pursuit: {ended} after ")), "{ended}");
    assert!(!still.contains("<text"), "letters are outlines, so that a picture needs no font");
}

#[test]
fn wrong_input_is_refused_with_exit_code_2_and_leaves_nothing_behind() {
    let place = Place::new();
    succeed(&place.train(&["--name", "run", "--steps", "600"]));
    let (policy, short) = (place.text("runs/run/policy.safetensors"), place.text("short.toml"));
    let refused = |output: &str, arguments: &[&str]| {
        let all = recording(&place, output, arguments);
        let said = refusal(&offtrack(&all.iter().map(String::as_str).collect::<Vec<_>>()), 2);
        assert!(!place.file(output).exists());
        said
    };
    for (output, flags, expected) in [
        ("a.mp4", &[][..], "--output: "),
        ("a", &[], "must end in .gif, .png, .svg or .json"),
        ("a.png", &["--size", "199"], "--size: 199; must lie in 200..4000 pixels"),
        ("a.svg", &["--size", "400"], "--size: 400; is for .gif and .png"),
        ("a.json", &["--size", "400"], "--size: 400; is for .gif and .png"),
        ("a.json", &["--episode", "30"], "--episode: 30; must lie in 0..29: --episodes says how many there are"),
        ("a.json", &["--episodes", "0"], "--episodes: 0; must lie in 1..100000"),
        ("a.json", &["--policy", "missing"], "policy: missing; the program comes with attard2023, "),
    ] {
        let said = refused(output, flags);
        assert!(said.contains(expected), "{said}");
    }
    let said = |route: &str, benchmark: &str| {
        let output = place.text("a.json");
        refusal(
            &offtrack(&["record", "--policy", &policy, "--benchmark", benchmark, "--route", route, "-o", &output]),
            2,
        )
    };
    let near = said("20m/E-right-9", &short);
    assert!(
        near.contains("--route: 20m/E-right-9; of 20m the benchmark short has 20m/E-right-1, 20m/W-left-3"),
        "{near}"
    );
    let far = said("E-right-1", &short);
    assert!(far.contains("a route of the benchmark short is needed, such as 16m/E-right-1, 20m/E-right-1"), "{far}");
    // The benchmark of the repository has nine actions where this policy learned five.
    let other = said(ROUTE, "attard2023");
    assert!(other.contains(&policy) && other.contains("another action table: 5 actions"), "{other}");
}

#[test]
fn a_recording_that_cannot_be_written_is_a_failure() {
    let place = Place::new();
    for (name, flags) in [("missing/a.json", &[][..]), ("missing/a.gif", &["--size", "200"])] {
        let all = recording(&place, name, flags);
        let said = refusal(&offtrack(&all.iter().map(String::as_str).collect::<Vec<_>>()), 1);
        assert!(said.contains(&place.text(name)) && said.contains("cannot be written"), "{said}");
    }
}

#[test]
fn a_recording_of_a_fleet_has_the_truck_of_its_episode_by_name_and_dimensions() {
    let place = Place::new();
    let recorded = |episode: &str| {
        let flags = [
            "--benchmark",
            "laden2026",
            "--route",
            ROUTE,
            "--policy",
            "pursuit",
            "--episode",
            episode,
            "--episodes",
            "6",
        ];
        succeed(&offtrack(&[&["record", "-o", &place.text("a.json")], &flags[..]].concat()));
        let recording = place.json("a.json");
        let class = ["vehicle", "load"].map(|key| recording["class"][key].as_str().unwrap().to_owned());
        (class, recording["vehicle"]["trailer_wheelbase"].to_string())
    };
    let all: Vec<_> = ["0", "1", "2", "3", "4", "5"].map(recorded).into();
    assert!(all.iter().all(|([vehicle, _], _)| ["daf_xf", "eu_4x2_13m6"].contains(&vehicle.as_str())), "{all:?}");
    // Loads and lengths are drawn.
    assert!(
        all.iter().any(|(class, _)| class[1] != all[0].0[1]) && all.iter().any(|(_, length)| *length != all[0].1),
        "{all:?}"
    );
    record(&place, "a.json", &[]);
    assert!(place.json("a.json").get("class").is_none(), "one vehicle has no name");
}

#[test]
fn loads_named_are_driven_by_the_same_truck_and_shown_beside_each_other_or_in_turn() {
    let place = Place::new();
    let record = |output: &str, loads: &[&str]| {
        let mut arguments = vec!["record", "--benchmark", "laden2026", "--route", ROUTE, "--policy", "pursuit"];
        if output.ends_with(".gif") {
            arguments.extend(["--size", "200"]);
        }
        let output = place.text(output);
        arguments.extend(loads.iter().flat_map(|load| ["--load", load]).chain(["-o", &output]));
        offtrack(&arguments)
    };
    let data = ["empty", "laden_high"].map(|load| {
        succeed(&record("a.json", &[load]));
        place.json("a.json")
    });
    let loads = data.each_ref().map(|recording| recording["class"]["load"].as_str().unwrap());
    assert_eq!((loads, &data[0]["vehicle"]), (["empty", "laden_high"], &data[1]["vehicle"]));
    assert_eq!(data[0]["frames"][0]["position"], data[1]["frames"][0]["position"]);
    assert_ne!(data[0]["frames"], data[1]["frames"], "a load changes how it drives");

    succeed(&record("both.svg", &["empty", "laden_high"]));
    let svg = std::fs::read_to_string(place.file("both.svg")).unwrap();
    assert!(svg.contains("empty and laden_high") && svg.contains("Speed [km/h]"));
    let size = |name: &str, loads: &[&str]| {
        succeed(&record(name, loads));
        std::fs::metadata(place.file(name)).unwrap().len()
    };
    assert!(size("one.gif", &["empty"]) < size("both.gif", &["empty", "laden_high"]));

    let said = refusal(&record("both.json", &["empty", "laden_high"]), 2);
    assert!(said.contains("data are of one episode, one --load"), "{said}");
    let said = refusal(&record("a.svg", &["empty", "empty"]), 2);
    assert!(said.contains("--load: empty; is given twice"), "{said}");
    let said = refusal(&record("a.svg", &["nothing"]), 2);
    assert!(said.contains("--load: nothing; laden2026 has empty, half, laden, laden_high"), "{said}");
}
