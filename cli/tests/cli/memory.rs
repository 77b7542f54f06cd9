//! A run that would take more memory than is free.

use crate::place::{Place, refusal};

/// Linux has the limit; other systems do not say what is free.
#[cfg(target_os = "linux")]
#[test]
fn a_run_that_does_not_fit_into_memory_is_refused_before_a_folder_is_made() {
    let place = Place::new();
    for (setting, expected) in [
        ("replay_buffer.capacity=100000000", "replay_buffer.capacity: 100000000; the run would take about 28"),
        (
            "learning.hidden=[8192, 8192, 8192, 8192]",
            "learning.hidden: [8192, 8192, 8192, 8192]; the run would take about 2",
        ),
        ("learning.batch=1048576", "learning.batch: 1048576; the run would take about"),
    ] {
        let (program, training, runs) = (env!("CARGO_BIN_EXE_offtrack"), place.text("tiny.toml"), place.text("runs"));
        // Four gigabytes of address space; a batch of so many transitions takes a little less on its own.
        let hidden = if setting.starts_with("learning.batch") { "--set 'learning.hidden=[256, 256]'" } else { "" };
        let line = format!(
            "ulimit -v 4000000; \
             exec {program} train {training} --out {runs} --steps 1000000000 {hidden} --set '{setting}'"
        );
        let output = std::process::Command::new("sh")
            .env("OFFTRACK_CACHE", crate::place::CACHE)
            .args(["-c", &line])
            .output()
            .unwrap();
        let message = refusal(&output, 2);
        assert!(message.contains(expected) && message.contains("GB are free: less would do"), "{message}");
        assert!(!place.file("runs").exists());
    }
}
