//! Trains briefly on random roads, far too briefly to drive well, then evaluates on the study's roundabouts.
//!
//! `cargo run --release -p offtrack-learner --example train`

use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use offtrack_learner::config::Config;
use offtrack_learner::train::{Event, train};

fn main() -> Result<(), Box<dyn Error>> {
    // The default run with other values of some keys: a minute in place of several.
    let settings =
        ["steps=20000", "n_envs=64", "replay_buffer={capacity=20000, warmup=4000}", "validation=", "also_evaluate="];
    let config = Config::read_with(Path::new("default"), &settings.map(str::to_owned))?;
    let place = tempfile::tempdir()?;
    let watcher = |event: Event| match event {
        Event::Begun(begun) => println!("{} routes of {}", begun.n_routes, begun.benchmark),
        Event::Training(status) => println!("{:3.0} % {status}", 100.0 * status.fraction),
        Event::Warning(line) => eprintln!("{line}"),
        _ => {}
    };
    // Another thread may set it: training then ends, and `resume` continues.
    let stop = AtomicBool::new(false);
    let outcome = train(&config, &place.path().join("run"), &watcher, &stop)?;
    if let Some(report) = outcome.evaluation {
        let summary = report.summary;
        println!("{} of {} episodes on the test routes arrived", summary.arrived, summary.episodes);
    }
    Ok(())
}
