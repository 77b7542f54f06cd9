//! The command writes what it prints, and refuses what no road can have.

use std::path::Path;

use clap::Parser;
use offtrack::traffic::Mix;
use serde_json::Value;

use super::{Args, Counts, LargeShare, mix, run, table};

#[derive(Parser)]
struct Program {
    #[command(flatten)]
    args: Args,
}

fn args(words: &[&str]) -> Args {
    Program::try_parse_from([&["traffic"], words].concat()).unwrap().args
}

/// A roundabout of so many arms with a ring of one lane, as a file.
fn even(folder: &Path, n_arms: usize, island_radius: f64, ring_radius: f64, [ring, arm]: [f64; 2]) -> String {
    let file = folder.join("even.toml");
    let mut text = format!("[ring]\nisland_radius = {island_radius}\nlanes = 1\nlane_width = {ring}\ngutter = 0.5\n");
    for index in 0..n_arms {
        let (bearing, beside) = (360.0 * index as f64 / n_arms as f64, 0.5 + arm);
        text += &format!(
            "[[arm]]\nname = \"A{index}\"\nbearing_deg = {bearing}\nlength = 90.0\nlane_width = {arm}\n\
             entry.kerb = {{ points = [{{ along = 30.0, offset = {beside} }}], ring_radius = {ring_radius} }}\n\
             exit.kerb = {{ points = [{{ along = 30.0, offset = -{beside} }}], ring_radius = {ring_radius} }}\n"
        );
    }
    std::fs::write(&file, text).unwrap();
    file.to_str().unwrap().to_owned()
}

/// What the command writes as JSON.
fn json(words: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("found.json");
    run(&args(&[words, &["--json", file.to_str().unwrap()]].concat())).unwrap();
    serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap()
}

#[test]
fn every_entry_lane_has_its_flows_its_delay_and_the_manuals() {
    let found = json(&["16m", "--demand", "1200", "--minutes", "10", "--runs", "2", "--share", "vans=0.2"]);
    let entries = found[0]["entries"].as_array().unwrap();
    assert_eq!(entries.len(), 8);
    let sum = |key: &str| entries.iter().map(|entry| entry[key].as_f64().unwrap()).sum::<f64>();
    assert!((sum("demand") - 1200.0).abs() < 1e-6);
    // 400 cars in two runs, within five deviations of the count.
    assert!((sum("served") - 1200.0).abs() < 5.0 * 3.0 * 20.0, "{}", sum("served"));
    for entry in entries {
        let (delay, hcm) = (entry["delay"].as_f64().unwrap(), &entry["hcm"]);
        let capacity = hcm["capacity"].as_f64().unwrap();
        assert!((0.0..60.0).contains(&delay) && (800.0..1420.0).contains(&capacity), "{entry}");
        assert!(hcm["lanes"].as_str().unwrap().starts_with("2 into 2"), "{entry}");
    }
    assert_eq!(found[0]["removed"], 0, "without large vehicles");
    // The same again: nothing depends on threads.
    assert_eq!(found, json(&["16m", "--demand", "1200", "--minutes", "10", "--runs", "2", "--share", "vans=0.2"]));
}

#[test]
fn a_lane_to_which_more_come_than_it_serves_is_at_level_f_and_one_to_which_nobody_comes_at_none() {
    let words = |demand| ["20m", "--minutes", "20", "--runs", "1", "--demand", demand];
    let full = json(&words("N-E=1800,W-E=600"));
    let of = |arm: &str| {
        let entries = full[0]["entries"].as_array().unwrap().iter();
        entries.filter(|entry| entry["arm"] == arm).cloned().collect::<Vec<_>>()
    };
    let served = of("N").iter().map(|entry| entry["served"].as_f64().unwrap()).sum::<f64>();
    assert!(served < 1600.0 && of("N").iter().any(|entry| entry["level"] == "F"), "{:?}", of("N"));
    assert!(of("W").iter().all(|entry| entry["level"] != "F"), "{:?}", of("W"));
    // Who stays away is in no delay, so these alone would flatter.
    assert!(0.03 < full[0]["stayed"].as_f64().unwrap() && full[0]["level"] == "F", "{}", full[0]["stayed"]);
    for entry in of("S") {
        assert!(entry["delay"].is_null() && entry["level"].is_null() && entry["served"] == 0.0, "{entry}");
    }
    assert_ne!(json(&words("100"))[0]["level"], "F");
}

#[test]
fn a_lane_that_stands_is_at_level_f_before_anybody_stays_away() {
    let jammed = ["--demand", "3000", "--share", "tractor_trailers=0.3", "--share", "buses=0.3"];
    let found = json(&[&["20m", "--minutes", "2", "--runs", "1", "--seed", "0"], &jammed[..]].concat());
    let entries = found[0]["entries"].as_array().unwrap();
    let stands = |entry: &&Value| entry["served"] == 0.0 && 10 < entry["queue_95"].as_u64().unwrap();
    let standing: Vec<&Value> = entries.iter().filter(stands).collect();
    assert!(standing.iter().any(|entry| entry["delay"].is_null()), "{entries:?}");
    assert!(standing.iter().all(|entry| entry["level"] == "F") && found[0]["level"] == "F", "{found}");
}

#[test]
fn the_manuals_capacity_is_less_where_heavy_vehicles_are() {
    let of = |shares: &[&str]| {
        let words = [&["20m", "--capacity", "--minutes", "3", "--runs", "2"], shares].concat();
        json(&words)[0].clone()
    };
    // Nothing circulates in the first row; a heavy vehicle that came counts for two cars, a van for one.
    let found = of(&["--share", "buses=0.1", "--share", "rigid_trucks=0.15", "--share", "vans=0.3"]);
    let [asked, came] = ["asked", "came"].map(|key| found["large"][key].as_f64().unwrap());
    let alone = of(&[]);
    let expected = alone["hcm"].as_f64().unwrap() / (1.0 + came);
    assert!((found["hcm"].as_f64().unwrap() - expected).abs() < 1e-3, "{found}");
    assert!((asked - 0.25).abs() < 1e-6 && 0.05 < came && came < 0.35 && alone["large"].is_null(), "{found} {alone}");
}

#[test]
fn large_vehicles_that_a_road_has_no_room_for_are_told_and_do_not_count_for_the_manual() {
    let shares = ["--share", "tractor_trailers=0.5", "--share", "buses=0.5"];
    let map = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/maps/zala8.outline.toml");
    let words = [&[map, "--demand", "900", "--minutes", "20", "--runs", "2"], &shares[..]].concat();
    let found = json(&words)[0].clone();
    let [asked, came] = ["asked", "came"].map(|key| found["large"][key].as_f64().unwrap());
    assert!(asked == 1.0 && came < 0.9, "{found}");
    let counts = Counts { entered: 1_000, large: 100, ..Counts::default() };
    let share = |buses| LargeShare::of(Mix { large: [buses, 0.0, 0.0], ..Mix::default() }, &counts);
    assert_eq!((share(0.125).note(), share(0.1).note()), (None, None), "by chance");
    assert!(share(0.2).note().is_some_and(|note| note.starts_with("10 % were large, not 20: ")));
}

#[test]
fn who_stands_in_a_ring_that_large_vehicles_block_is_counted() {
    let shares = ["--share", "tractor_trailers=0.3", "--share", "buses=0.1"];
    let found = json(&[&["20m", "--demand", "2100", "--minutes", "20", "--runs", "2"], &shares[..]].concat());
    let (removed, served) = (found[0]["removed"].as_u64().unwrap(), found[0]["served"].as_f64().unwrap());
    // Two runs of 20 min.
    assert!(0 < removed && (removed as f64) < 0.1 * served * 2.0 / 3.0, "{removed} of {served} an hour");
}

#[test]
fn a_small_ring_that_cars_alone_block_is_cleared() {
    let folder = tempfile::tempdir().unwrap();
    let road = even(folder.path(), 3, 1.5, 10.0, [9.0, 4.0]);
    let found = |minutes| json(&[&road, "--demand", "1800", "--minutes", minutes, "--runs", "1"])[0].clone();
    let [short, long] = ["20", "60"].map(found);
    let [served, later] = [&short, &long].map(|found| found["served"].as_f64().unwrap());
    assert!(long["removed"].as_u64().unwrap() > 0 && 0.5 * served < later, "{served} and {later} an hour");
}

#[test]
fn a_road_where_no_capacity_can_be_measured_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let road = even(folder.path(), 2, 12.0, 12.0, [6.0, 6.0]);
    let message = run(&args(&["16m", &road, "--capacity", "--minutes", "1"])).unwrap_err().to_string();
    assert!(message.starts_with("ROAD: even; no entry can be measured there"), "{message}");
    let large = even(folder.path(), 4, 200.0, 30.0, [4.0, 4.0]);
    let text = std::fs::read_to_string(&large).unwrap().replace("length = 90.0", "length = 300.0");
    std::fs::write(&large, text).unwrap();
    let message = run(&args(&[&large])).unwrap_err().to_string();
    assert!(message.starts_with("ROAD: even; ") && message.ends_with(": a smaller road would do"), "{message}");
}

#[test]
fn capacities_fall_with_the_circulating_flow_and_are_plotted_beside_the_manuals() {
    let folder = tempfile::tempdir().unwrap();
    let plot = folder.path().join("plot.svg");
    let words = ["20m", "--capacity", "--minutes", "5", "--runs", "1", "--plot", plot.to_str().unwrap()];
    let found = json(&words);
    let points = found.as_array().unwrap();
    // Five flows beside each of the two lanes of four arms.
    assert_eq!(points.len(), 40);
    let of = |key: &str, index: usize| points[index][key].as_f64().unwrap();
    for index in (0..40).step_by(10) {
        assert!(of("circulating", index) == 0.0 && 1_100.0 < of("capacity", index), "{}", points[index]);
        assert!(of("capacity", index + 8) < 0.7 * of("capacity", index), "{}", points[index + 8]);
    }
    let drawn = std::fs::read_to_string(plot).unwrap();
    assert!(drawn.starts_with("<svg ") && drawn.contains("Capacity of entry lanes on 20m"));
}

#[test]
fn a_setting_that_no_run_can_have_is_refused_by_flag_and_value() {
    let crossing = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/maps/town03-crossing.outline.toml");
    let cases: [(&[&str], &str); 7] = [
        (&["16m", "--minutes", "0"], "--minutes: 0; must lie in 1..1440"),
        (&["16m", "--runs", "2000"], "--runs: 2000; must lie in 1..1000"),
        (&["16m", "--demand", "0"], "--demand: 0; nobody drives"),
        (&["16m", "--capacity", "--plot", "a.pdf"], "--plot: a.pdf; must end in .svg or .png"),
        (&[crossing, "--demand", "1500"], "--demand: 1500; town03-crossing: 1500 veh/h on a road without a ring"),
        (&[crossing, "--capacity"], "--capacity: town03-crossing; has no ring"),
        (&["16m", "--json", "a.png", "--capacity", "--plot", "a.png"], "--plot: a.png; is the file of --json too"),
    ];
    for (words, expected) in cases {
        let message = run(&args(words)).unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message}");
    }
}

#[test]
fn kinds_of_cars_are_fractions_of_known_kinds() {
    let of = |shares: &[&str]| mix(&shares.iter().map(|&share| share.to_owned()).collect::<Vec<_>>());
    assert_eq!(of(&["vans=0.25", "rude=0.1"]).unwrap(), Mix { vans: 0.25, rude: 0.1, ..Mix::default() });
    let large = of(&["buses=0.1", "rigid_trucks=0.2", "tractor_trailers=0.3"]).unwrap();
    assert_eq!(large, Mix { large: [0.1, 0.2, 0.3], ..Mix::default() });
    let message = of(&["vans=0.6", "buses=0.5"]).unwrap_err().to_string();
    assert_eq!(message, "--share: vans=0.6 buses=0.5; vans, buses and trucks must be at most 1 together");
    // Decimals that are 1 together, though their binary sum is a little more.
    assert!(of(&["vans=0.1", "buses=0.2", "rigid_trucks=0.4", "tractor_trailers=0.3"]).is_ok());
    let message = of(&["rude=0.9", "rude=0.0"]).unwrap_err().to_string();
    assert_eq!(message, "--share: rude=0.0; its kind is given twice: leave one out");
    for wrong in ["vans", "vans=", "vans=1.5", "vans=-0.1", "vans=NaN", "trams=0.1"] {
        let message = of(&[wrong]).unwrap_err().to_string();
        assert_eq!(
            message,
            format!(
                "--share: {wrong}; must be vans=F, buses=F, rigid_trucks=F, tractor_trailers=F or rude=F with F in 0..1"
            )
        );
    }
}

#[test]
fn columns_are_as_wide_as_their_widest_cell() {
    let rows = [
        vec!["N".to_owned(), "left".to_owned(), "1".to_owned()],
        vec!["E".to_owned(), "x".to_owned(), "200".to_owned()],
    ];
    assert_eq!(table(&rows), "N  left    1\nE  x     200\n");
}

#[test]
fn two_roads_of_one_name_are_measured_as_two() {
    let words = ["16m", "16m", "--capacity", "--runs", "1", "--minutes", "1"];
    let points = json(&words);
    assert_eq!(
        points.as_array().unwrap().len(),
        2 * json(&[&words[..1], &words[2..]].concat()).as_array().unwrap().len()
    );
}
