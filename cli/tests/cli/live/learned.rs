//! The slider through the policies of a training run.

use std::collections::HashMap;

use offtrack::scenario::Scenario;
use offtrack::simulator::Autoreset;
use offtrack::world::World;
use offtrack_evaluation::kept;
use offtrack_policy::Policy;
use serde_json::{Value, json};

use super::page::done;
use super::runs::{N_ENVS, N_STEPS, Run, SEED};
use crate::page::read;
use crate::place::{Place, offtrack, succeed};

#[test]
fn a_slider_through_a_training_run_lets_the_crowd_drive_by_the_policy_that_it_points_at_and_says_when_that_was() {
    let place = Place::new();
    place.validate(4, 2);
    succeed(&place.train(&["--name", "mine", "--steps", "3200"]));
    succeed(&offtrack(&["web", "--run", &place.text("runs/mine"), "-o", &place.text("page.html")]));
    let folder = place.file("runs/mine");
    let kept = kept::read(&folder).unwrap();
    let files = kept.iter().map(|kept| kept.file(&folder)).chain([folder.join("policy.safetensors")]);
    let policies: Vec<Policy> = files.map(|file| Policy::load(&file).unwrap()).collect();
    let (last, autoreset) = (policies.len() - 1, Autoreset::SameStep);
    let places = [last - 1, 0, last];
    let runs = places.map(|place| Run { world: 0, policy: Some(place), autoreset, demand: None });
    let each: Vec<Value> = runs.iter().map(|run| json!({ "name": run.name(), "place": run.policy })).collect();
    let job = json!({ "kind": "slider", "name": "drag", "runs": each, "n": N_ENVS, "steps": N_STEPS, "seed": SEED });
    let given = done(&read(&place.file("page.html")), &[job], HashMap::new());
    let scenario = Scenario::read(&place.file("short.toml")).unwrap();
    let world = World::bake(&scenario).unwrap().into();
    for run in runs {
        run.difference(&world, &policies, &given).unwrap();
    }
    // What has just begun to learn drives otherwise than what the run left.
    let mut turned = policies.clone();
    turned.swap(0, last);
    assert!(runs[1].difference(&world, &turned, &given).unwrap_err().contains("step"));

    let seen: Value = serde_json::from_slice(&given["drag.seen"]).unwrap();
    let success = format!("{:.1}\u{202f}% in validation", 100.0 * kept[last - 1].validation.unwrap());
    let [end, beginning] = [last - 1, 0].map(|place| kept[place].env_steps.to_string());
    let words = [
        format!("{},{} steps, ", &end[..1], &end[1..]),
        format!("{beginning} steps, "),
        "the policy that the run left".to_owned(),
    ];
    for ((found, words), place) in seen.as_array().unwrap().iter().zip(&words).zip(places) {
        assert!(found["words"].as_str().unwrap().starts_with(words), "{found}: {words}");
        assert_eq!((&found["spoken"], &found["max"]), (&found["words"], &json!(last)), "{found}");
        assert_eq!(found["words"].as_str().unwrap().ends_with(&success), place == last - 1, "{found}");
        assert!(found["chosen"].as_str().unwrap().starts_with("mine"), "{found}");
        // The list has the policy that drives and random actions; all trucks begin again, and the view stays.
        assert_eq!(
            (&found["options"], &found["begun"], &found["zoomed"]),
            (&json!(2), &json!(0), &json!(1)),
            "{found}"
        );
        assert_eq!(found["isShown"], true, "{found}");
    }
    // Also where a truck is followed, beside another policy.
    let beside: Value = serde_json::from_slice(&given["drag.beside"]).unwrap();
    let first = format!("mine, {beginning} steps");
    assert_eq!(beside["before"], json!([2, 2]), "{beside}");
    assert_eq!((&beside["begun"], &beside["followed"]), (&json!([0, 0]), &json!([1, 1])), "{beside}");
    assert_eq!(beside["names"], json!([first, "random actions"]), "{beside}");
    assert_eq!(beside["state"], json!(format!("Driven by {first}")), "{beside}");
}
