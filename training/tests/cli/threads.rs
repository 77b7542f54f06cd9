//! Threads that the system does not give.
#![cfg(unix)]

use std::process::Command;

use crate::place::{program, refusal};

#[test]
fn threads_that_the_system_does_not_give_are_an_error_and_no_panic() {
    let program = program();
    // Stacks of 60 GB in an address space of 4.
    let output = Command::new("bash")
        .args(["-c", "ulimit -v 4000000; exec \"$0\" evaluate --policy random --episodes 1"])
        .arg(program.get_program())
        .env("RAYON_NUM_THREADS", "30000")
        .output()
        .unwrap();
    let message = refusal(&output, 1);
    assert!(message.contains("threads cannot be started: ") && message.contains("; set RAYON_NUM_THREADS to fewer"), "{message}");
}
