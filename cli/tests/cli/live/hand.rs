//! A road with left-hand traffic is driven as its mirror image, and mirrored back where the page shows and steers it.

use std::collections::HashMap;
use std::fs;
use std::sync::Arc;

use offtrack::scenario::Scenario;
use offtrack::world::World;
use offtrack_evaluation::live::Ground;
use serde_json::{Value, json};

use super::left_hand::left_hand;
use super::page::written;
use super::visitor::{between, visited};
use crate::place::{Place, repository};

/// A page of one roundabout, of this text.
fn page(place: &Place, roundabout: &str) -> String {
    let text = Scenario::text_of("attard2023").unwrap();
    let (before, _) = text.split_once("[[roundabout]]").unwrap();
    let vehicles = repository().join("scenarios/vehicles");
    let before = before.replace("vehicles/", &format!("{}/", vehicles.display()));
    fs::write(place.file("road.toml"), roundabout).unwrap();
    let file = place.file("own.toml");
    fs::write(&file, before + "[[roundabout]]\nfile = \"road.toml\"\ntrain = \"all\"\n").unwrap();
    let scenario = Scenario::read(&file).unwrap();
    let world = Arc::new(World::bake(&scenario).unwrap());
    written(vec![Ground { scenario, world, text: None, is_whole: false }], Vec::new(), &place.file("trucks.html"))
}

#[test]
fn a_left_hand_road_is_seen_and_steered_as_it_lies() {
    let place = Place::new();
    let text = fs::read_to_string(repository().join("scenarios/roundabouts/16m.toml")).unwrap();
    let [right, left] = [text.clone(), left_hand(&text)].map(|text| {
        // Above and below the middle, as the world has it.
        let plan = json!({ "visit": "hand", "points": [[0.0, 40.0], [0.0, -40.0]] });
        visited(&page(&place, &text), &plan, HashMap::new(), false)
    });
    let number = |value: &Value| value.as_f64().unwrap();
    for (found, side) in [(&right, 1.0), (&left, -1.0)] {
        assert!((number(&found["side"]) - side).abs() < 1e-4, "{found}");
        assert_eq!(found["found"], 1, "{found}");
        for (index, name) in ["road", "tractor"].iter().enumerate() {
            assert!(between(&found["colours"][index], &found["theme"][name]) < 8, "{name}: {found}");
        }
        let height = |index: usize| number(&found["pixels"][index][1]);
        assert!(70.0 < side * (height(1) - height(0)), "{found}");
        // The world's left is to the left, or mirrored to the right.
        assert!(0.0 < side * number(&found["byKey"]) && number(&found["mark"]) < 50.0, "{found}");
        let [to_left, to_right] = [0, 1].map(|index| side * number(&found["towards"][index]));
        assert!(0.1 < to_left && to_right < -0.1, "{found}");
    }
}
