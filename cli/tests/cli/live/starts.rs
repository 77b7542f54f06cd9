//! The page while it starts, where its device fails, and by the part of its address behind #.

use std::collections::HashMap;

use offtrack_evaluation::live::{Ground, Live};
use offtrack_policy::Policy;
use serde_json::json;

use super::page::{ground, written};
use super::visitor::visited;
use crate::page::read;
use crate::place::Place;

/// What is said where nothing can drive.
const NO_DEVICE: &str = "No trucks can drive here: no graphics device is open.";

#[test]
fn what_is_asked_for_while_a_page_starts_waits_and_without_a_device_it_is_refused_in_words() {
    let place = Place::new();
    let policies = vec![Policy::shipped("attard2023").unwrap()];
    let page = written(vec![ground("attard2023")], policies, &place.file("trucks.html"));
    let found = visited(&page, &json!({ "visit": "starts" }), HashMap::new(), false);
    let state = |name: &str| {
        let of = &found[name];
        (of["kind"].as_str().map(str::to_owned), of["n"].as_u64().unwrap(), of["seed"].as_u64().unwrap())
    };
    assert_eq!(state("without").0.as_deref(), Some("adapter"), "{found}");
    assert_eq!((&found["without"]["words"], &found["without"]["isBad"]), (&json!(NO_DEVICE), &json!(true)), "{found}");
    assert_eq!(found["script"], NO_DEVICE, "{found}");
    // The choices of the start that failed; a restart while shaders compile keeps them.
    assert_eq!((state("begun"), &found["begun"]["batch"]), ((None, 128, 5), &json!(128)), "{found}");
    assert_eq!(found["begun"]["said"], "No episode has failed yet.", "{found}");
    // Fewer trucks do not help where the device is lost, and few are no more after an error.
    assert_eq!(state("lost"), (Some("lost".to_owned()), 128, 5), "{found}");
    assert_eq!(state("failed"), (Some("failed".to_owned()), 8, 5), "{found}");
    assert_eq!(found["uncaught"], json!([]), "{found}");
}

#[test]
fn a_page_follows_its_address_says_what_it_does_not_understand_and_keeps_what_was_chosen_last() {
    let place = Place::new();
    let file = place.file("trucks.html");
    let grounds =
        vec![ground("attard2023"), ground("attard2023-as-run"), Ground { is_whole: false, ..ground("attard2023") }];
    let policies = vec![Policy::shipped("attard2023").unwrap()];
    Live { grounds, policies, run: None, baker: Some(b"wasm".to_vec()), seed: 0 }.write(&file).unwrap();
    let found = visited(&read(&file), &json!({ "visit": "address" }), HashMap::new(), false);
    let (said, wrong) = (found["wrong"]["words"].as_str().unwrap(), &found["wrong"]["isBad"]);
    for words in ["n=1e2 is no whole number", "seed=4294967296", "benchmark=nope", "wide/7/12 needs", "m=3 is none"] {
        assert!(said.contains(words) && wrong == true, "{words}: {found}");
    }
    assert_eq!(found["changed"], json!({ "n": 16, "seed": 3, "road": "20m" }), "{found}");
    assert!(found["unknown"]["words"].as_str().unwrap().contains("road=nope is none of 16m, 32m"), "{found}");
    let [whole, narrowed] = ["whole", "narrowed"].map(|name| found[name].as_str().unwrap());
    assert!(whole.starts_with("reported: 690 of 690") && narrowed.is_empty(), "{found}");
    assert_eq!(found["listed"], json!(["attard2023", "attard2023-as-run", "attard2023 (2)"]), "{found}");
    // Random actions stay only where they were asked for.
    assert_eq!((&found["policies"], &found["random"]), (&json!([-1, 0]), &json!([-1, -1])), "{found}");
    let baking = json!({ "words": "Baking wide/7/12.", "isBad": false, "isHidden": false });
    assert_eq!((&found["baking"], &found["after"]), (&baking, &json!({ "world": 2, "isHidden": true })), "{found}");
    let large = found["large"]["words"].as_str().unwrap();
    assert!(large.contains("attard2023 is too large") && large.contains("at most 100,000 fit"), "{found}");
    assert_eq!(found["uncaught"], json!([]), "{found}");
}
