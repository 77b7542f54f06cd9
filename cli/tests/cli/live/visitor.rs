//! What a visitor of the page sees and does: the road's colours, a truck taken over, files dropped, a failure driven
//! again, and what is said where there is no device.

use std::collections::HashMap;

use offtrack_policy::Policy;
use serde_json::{Value, json};

use super::page::{ground, written};
use super::served::given_by;
use crate::browser::widths;
use crate::page::read;
use crate::place::{Place, repository};

/// A page of `attard2023` and its policy.
fn page(place: &Place) -> String {
    written(vec![ground("attard2023")], vec![shipped("attard2023")], &place.file("trucks.html"))
}

fn shipped(name: &str) -> Policy {
    Policy::shipped(name).unwrap()
}

/// What a visit of a page gives, with files by their names.
pub fn visited(page: &str, plan: &Value, mut files: HashMap<String, Vec<u8>>, without_gpu: bool) -> Value {
    files.insert("plan".to_owned(), plan.to_string().into_bytes());
    let main = read(&repository().join("evaluation/src/live/main.js"));
    assert!(!main.is_empty() && page.contains(&main), "the page has another last script");
    let script = concat!(include_str!("starts.js"), include_str!("visitor.js"));
    let given = given_by(&page.replace(&main, script), files, without_gpu);
    serde_json::from_slice(&given[plan["visit"].as_str().unwrap()]).unwrap()
}

/// Largest difference of two colours' parts (of 255).
pub fn between(a: &Value, b: &Value) -> i64 {
    let parts = |colour: &Value| -> Vec<i64> {
        let parts: Vec<i64> = colour.as_array().unwrap().iter().map(|part| part.as_i64().unwrap()).collect();
        assert_eq!(parts.len(), 3);
        parts
    };
    parts(a).iter().zip(parts(b)).map(|(a, b)| (a - b).abs()).max().unwrap()
}

#[test]
fn road_island_kerb_and_truck_have_their_colours_on_the_page() {
    let place = Place::new();
    let found = visited(&page(&place), &json!({ "visit": "pixels" }), HashMap::new(), false);
    let colours = &found["colours"];
    for (one, another) in [("road", "kerb"), ("solid", "kerb"), ("trailer", "road"), ("trailer", "solid")] {
        assert!(100 < between(&colours[one], &colours[another]), "{one} looks like {another}: {colours}");
    }
    let seen = found["seen"].as_array().unwrap();
    assert_eq!(seen.len(), 5);
    assert!(20 < between(&colours["road"], &colours["solid"]), "{colours}");
    for pixels in seen {
        assert!(between(&pixels["road"], &colours["road"]) < 8, "{pixels}: {colours}");
        assert!(between(&pixels["island"], &colours["solid"]) < 8, "{pixels}: {colours}");
    }
    // The line of a kerb is a pixel and a half wide, and its edges are blended.
    assert!(between(&found["kerb"], &colours["kerb"]) < 40, "{found}");
    assert!(between(&found["trailer"], &colours["trailer"]) < 8, "{found}");
}

#[test]
fn an_apron_has_its_colour_on_the_page_and_a_kerb_behind_it() {
    let place = Place::new();
    let road = std::fs::read_to_string(repository().join("scenarios/roundabouts/16m.toml")).unwrap();
    assert_eq!(road.matches("[ring]\n").count(), 1);
    std::fs::write(place.file("apron.toml"), road.replace("[ring]\n", "[ring]\napron = 2.5\n")).unwrap();
    let benchmark = read(&place.file("short.toml"));
    let own = format!("{}/roundabouts/16m.toml", repository().join("scenarios").display());
    assert!(benchmark.contains(&own));
    std::fs::write(place.file("short.toml"), benchmark.replace(&own, "apron.toml")).unwrap();
    let ground = ground(&place.text("short.toml"));
    let radius = ground.scenario.places[0].roundabout.island_radius();
    // Across the edge of the island, the apron, its inner edge, and what is behind it.
    let points = [radius + 2.0, radius, radius - 1.25, radius - 2.5, radius - 4.0]
        .map(|y| json!({ "road": 0, "point": [0.0, y], "width": 60 }));
    let plan = json!({
        "visit": "colouring", "n": 8, "steps": 0, "followed": null, "points": points,
        "names": ["road", "kerb", "apron", "kerb", "solid"],
    });
    let page = written(vec![ground], Vec::new(), &place.file("trucks.html"));
    let found = visited(&page, &plan, HashMap::new(), false);
    let colours = &found["colours"];
    assert!(20 < between(&colours["apron"], &colours["solid"]) && 20 < between(&colours["apron"], &colours["road"]));
    let expected = [("road", 16), ("kerb", 40), ("apron", 8), ("kerb", 40), ("solid", 8)];
    for ((name, most), seen) in expected.iter().zip(found["seen"].as_array().unwrap()) {
        assert!(between(seen, &colours[name]) < *most, "{name}: {found}");
    }
    assert!(found["legend"].as_str().unwrap().contains("apron, for trailers alone"), "{found}");
}

#[test]
fn a_truck_that_is_taken_over_steers_as_asked_within_its_lock_and_rate_until_it_is_given_back() {
    let place = Place::new();
    let found = visited(&page(&place), &json!({ "visit": "wheel" }), HashMap::new(), false);
    let number = |name: &str| found[name].as_f64().unwrap();
    let angles: Vec<f64> = found["angles"].as_array().unwrap().iter().map(|angle| angle.as_f64().unwrap()).collect();
    let mut before = number("before");
    for &angle in &angles {
        assert!(before <= angle && angle <= before + number("most") + 1e-5, "{found}");
        before = angle;
    }
    assert!((before - number("lock")).abs() < 1e-5, "asked for 3 rad, it steers to its lock: {found}");
    let actions = found["actions"].as_array().unwrap();
    assert!(actions.iter().all(|action| action == &found["nActions"]), "none of the table's: {found}");
    assert!(found["state"].as_str().unwrap().starts_with("You drive"), "{found}");
    assert!(number("speed") < 0.01, "it stands as asked: {found}");
    assert!(found["after"]["action"].as_f64().unwrap() < number("nActions"), "{found}");
    assert!(found["after"]["state"].as_str().unwrap().starts_with("Driven by attard2023"), "{found}");
}

#[test]
fn every_key_of_the_page_does_what_its_list_says() {
    let place = Place::new();
    let found = visited(&page(&place), &json!({ "visit": "keys" }), HashMap::new(), false);
    let number = |name: &str| found[name].as_f64().unwrap();
    assert_eq!((&found["plays"], &found["playsAgain"]), (&json!(true), &json!(false)), "{found}");
    assert_eq!((&found["followed"], &found["driving"]), (&json!(1), &json!(true)), "{found}");
    assert!(0.1 < number("left") && number("right") < number("left") - 0.1, "{found}");
    assert_eq!(found["held"], json!(["left"]), "a slider keeps arrows alone: {found}");
    assert!(0.5 < number("slower"), "{found}");
    assert_eq!((&found["drivingAfter"], &found["focusAfter"]), (&json!(false), &Value::Null), "{found}");
    assert_eq!((&found["colouring"], &found["help"]), (&json!(1), &json!(true)), "{found}");
    assert!(1.2 < number("nearer"), "{found}");
}

#[test]
fn one_finger_moves_the_picture_two_zoom_it_and_a_tap_beside_a_truck_follows_it_while_the_page_stays_where_it_is() {
    let place = Place::new();
    let found = visited(&page(&place), &json!({ "visit": "touch" }), HashMap::new(), false);
    let number = |name: &str| found[name].as_f64().unwrap();
    let moved = |axis: usize| found["moved"][axis].as_f64().unwrap();
    // Up by 100 pixels, less what tells a drag from a tap.
    assert!(moved(0).abs() < 1.0 && -101.0 < moved(1) && moved(1) < -70.0, "{found}");
    assert!(100.0 < number("canScroll"), "{found}");
    assert_eq!((&found["scrolled"], &found["pageZoom"]), (&json!(0), &json!(1)), "{found}");
    assert!(2.0 < number("nearer") && number("nearer") < 3.1, "{found}");
    for followed in ["followedAfterDrag", "followedAfterPinch"] {
        assert_eq!(found[followed], Value::Null, "{found}");
    }
    assert_eq!(found["followed"], 3, "{found}");
    assert!(0.05 < number("steering"), "{found}");
}

#[test]
fn the_live_page_is_as_wide_as_its_window_on_a_telephone_and_on_a_desk() {
    let place = Place::new();
    page(&place);
    for window in [400, 1200] {
        let (width, contents) = widths(&place.file("trucks.html"), window);
        assert!(contents <= width && (window - 20..=window).contains(&width), "{contents} of {width}");
    }
}

#[test]
fn a_file_that_is_dropped_drives_or_the_page_says_in_words_why_not() {
    let place = Place::new();
    let good = shipped("attard2023-lane").to_bytes();
    let mut flipped = good.clone();
    let last = flipped.len() - 1;
    flipped[last] ^= 1;
    let other = place.file("other.world");
    ground("attard2023").write(&other).unwrap();
    let world = read(&other);
    let renamed = world.replacen("\"splits\":{", "\"split_\":{", 1).into_bytes();
    assert_ne!(renamed, world.as_bytes());
    let dropped: [(&str, Vec<u8>, Option<&str>); 10] = [
        ("good.safetensors", good.clone(), None),
        ("short.safetensors", good[..good.len() / 2].to_vec(), Some("damaged")),
        ("flipped.safetensors", flipped, Some("checksum")),
        ("empty.safetensors", Vec::new(), Some("is empty")),
        ("laden.safetensors", shipped("laden2026").to_bytes(), Some("other extras")),
        ("slow.safetensors", shipped("attard2023-as-run").to_bytes(), Some("another action table")),
        ("roads.toml", b"[ring]".to_vec(), Some("--world")),
        ("renamed.world", renamed, Some("is a damaged world file")),
        ("old.world", world.replacen("world 2", "world 1", 1).into_bytes(), Some("no world file of this page's form")),
        ("other.world", world.into_bytes(), None),
    ];
    let plan = json!({ "visit": "files", "names": dropped.iter().map(|(name, ..)| *name).collect::<Vec<_>>() });
    let files = dropped.iter().map(|(name, bytes, _)| ((*name).to_owned(), bytes.clone())).collect();
    let found = visited(&page(&place), &plan, files, false);
    let found = found.as_array().unwrap();
    assert_eq!(found.len(), dropped.len());
    for ((name, _, refusal), given) in dropped.iter().zip(found) {
        let words = given["words"].as_str().unwrap();
        assert!(words.contains(name), "{given}");
        assert_eq!(given["isBad"], refusal.is_some(), "{given}");
        assert!(words.contains(refusal.unwrap_or("now")), "{given}");
        // What cannot drive leaves those that drive as they are.
        assert_eq!(given["policy"], "good.safetensors", "{given}");
        assert!(0 < given["begun"].as_u64().unwrap(), "{given}");
    }
}

#[test]
fn a_page_begins_with_four_thousand_trucks_on_a_card_and_with_few_on_a_processor() {
    let place = Place::new();
    let found = visited(&page(&place), &json!({ "visit": "counts" }), HashMap::new(), false);
    assert_eq!((&found["software"]["n"], &found["card"]["n"]), (&json!(256), &json!(4096)), "{found}");
    assert!(found["card"]["heading"].as_str().unwrap().starts_with("4,096 tractor-trailers"), "{found}");
}

#[test]
fn a_failure_that_is_driven_again_ends_as_it_did() {
    let place = Place::new();
    let found = visited(&page(&place), &json!({ "visit": "again" }), HashMap::new(), false);
    let failure = &found["failure"];
    assert!(0 < failure["episode"].as_u64().unwrap(), "{found}");
    assert_eq!((&found["steps"], &found["position"]), (&failure["steps"], &failure["position"]), "{found}");
    assert!(found["state"].as_str().unwrap().ends_with("as before"), "{found}");
    // With another load than was drawn, from the start that it had then.
    let (ground, policy) = (ground("laden2026"), shipped("laden2026"));
    let laden = written(vec![ground], vec![policy], &place.file("laden.html"));
    let found = visited(&laden, &json!({ "visit": "again" }), HashMap::new(), false);
    let failure = &found["failure"];
    assert_eq!((&found["steps"], &found["position"]), (&failure["steps"], &failure["position"]), "{found}");
    assert!(found["state"].as_str().unwrap().ends_with("as before"), "{found}");
}

#[test]
fn the_page_says_that_its_device_is_lost_and_begins_again() {
    let place = Place::new();
    let found = visited(&page(&place), &json!({ "visit": "lost" }), HashMap::new(), false);
    assert_eq!(found["before"]["kind"], Value::Null, "{found}");
    assert_eq!(found["during"]["kind"], "lost", "{found}");
    assert!(found["during"]["words"].as_str().unwrap().contains("lost"), "{found}");
    assert_eq!(found["after"]["kind"], Value::Null, "{found}");
    assert!(2 <= found["steps"].as_u64().unwrap(), "{found}");
}

#[test]
fn without_webgpu_or_an_adapter_the_page_says_what_would_do() {
    let place = Place::new();
    let page = page(&place);
    let without =
        |has_api: bool| visited(&page, &json!({ "visit": "without", "hasApi": has_api }), HashMap::new(), true);
    let none = without(false);
    assert_eq!(none["kind"], "webgpu", "{none}");
    for browser in ["Chrome", "Edge", "Safari", "Firefox"] {
        assert!(none["words"].as_str().unwrap().contains(browser), "{none}");
    }
    let blind = without(true);
    assert_eq!(blind["kind"], "adapter", "{blind}");
    assert!(blind["words"].as_str().unwrap().contains("graphics driver"), "{blind}");
}
