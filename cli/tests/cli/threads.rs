//! Threads that the system may not give.
#![cfg(unix)]

use std::process::Command;

use crate::place::{program, succeed};

#[test]
fn more_threads_than_the_address_space_holds_are_fewer_and_no_panic() {
    let program = program();
    // Stacks of 60 GB would not fit into 4.
    let output = Command::new("bash")
        .args(["-c", "ulimit -v 4000000; exec \"$0\" evaluate --policy random --episodes 1"])
        .arg(program.get_program())
        .env("RAYON_NUM_THREADS", "30000")
        .output()
        .unwrap();
    succeed(&output);
}
