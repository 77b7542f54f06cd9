//! Budgets of `offtrack train`: those in which nothing would be learned, and flags beside keys of the training file.

use crate::place::{Place, offtrack, refusal};

#[test]
fn a_budget_too_small_for_any_update_of_the_actor_is_refused() {
    let place = Place::new();
    let runs = place.text("runs");
    let message = refusal(&place.train(&["--steps", "400"]), 2);
    assert!(message.contains("--steps 400: steps: 400; must be above 400, or nothing is learned"), "{message}");
    let message = refusal(&place.train(&["--set", "learning.actor_delay=150"]), 2);
    assert!(message.contains("steps: 1600; must be above 1600, or nothing is learned: updates begin"), "{message}");
    let refined = ["train", "lane", "--from", "attard2023", "--steps", "65536", "--out", &runs];
    let message = refusal(&offtrack(&refined), 2);
    assert!(message.contains("--steps 65536: steps: 65536; must be above 1048576, or nothing is learned"), "{message}");
    assert!(message.contains("refinement.critic_iterations = 16 iterations"), "{message}");
    assert!(!place.file("runs").exists());
}

#[test]
fn a_flag_that_replaces_the_whole_budget_is_refused_beside_the_other_key_of_it() {
    let place = Place::new();
    for (flag, set) in [(["--steps", "5000"], "minutes=1"), (["--minutes", "5"], "steps=1000")] {
        let message = refusal(&place.train(&[&flag[..], &["--set", set]].concat()), 2);
        let expected = format!("--set: {set}; {} replaces the whole budget: leave it out, or give", flag[0]);
        assert!(message.contains(&expected), "{message}");
    }
    assert!(!place.file("runs").exists());
}
