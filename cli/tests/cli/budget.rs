//! Budgets of `offtrack train`: those in which nothing would be learned.

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
