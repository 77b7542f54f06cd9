//! A run whose device fails, and one that learns on a device.

#![cfg(feature = "gpu")]

use std::cell::Cell;
use std::path::Path;
use std::sync::Arc;

use offtrack::gpu;
use offtrack::layout::N_VALUES;
use offtrack::scenario::{Scenario, Split};

use super::metrics_file::MetricsFile;
use super::*;
use crate::device;
use crate::sac::{Learner as _, Sac};

/// A small run in `folder` on a device, and the device.
fn run(folder: &Path, settings: &[&str]) -> (Run<'static>, Folder, gpu::Device) {
    let small = [
        "n_envs=64",
        "replay_buffer.capacity=4000",
        "replay_buffer.warmup=800",
        "learning.hidden=[16]",
        "learning.batch=32",
    ];
    let settings: Vec<String> = small.iter().chain(settings).map(|setting| (*setting).to_owned()).collect();
    let config = Config::read_with(Path::new("gpu"), &settings).unwrap();
    let folder = Folder::create(folder, Some("run"), Path::new("gpu"), &config).unwrap();
    let scenario = Scenario::named("attard2023").unwrap();
    let (world, routes) = (Arc::new(World::bake(&scenario).unwrap()), scenario.split(Split::Train).to_vec());
    let progress = Progress::new(&config, MetricsFile::create(folder.metrics()).unwrap(), Box::new(()));
    let device = device::least();
    let backend = Backend::Device(Box::new(device.clone()));
    let training = Session::new(&backend, &config, world.clone(), routes).unwrap();
    let routes = RouteCounts::new(&scenario, folder.routes());
    (Run::new(backend, &config, &world, training, &folder, progress, routes), folder, device)
}

#[test]
fn a_device_that_fails_ends_the_run_with_its_last_checkpoint_intact() {
    let place = tempfile::tempdir().unwrap();
    let (mut run, folder, device) = run(place.path(), &["steps=1000000", "checkpoint_minutes=0.0001"]);
    let device = device.device.clone();
    let asked = Cell::new(0);
    let error = run
        .learn(|| {
            asked.set(asked.get() + 1);
            // By then a checkpoint has been written: they are due every 6 ms.
            if asked.get() == 20 {
                device.destroy();
            }
            false
        })
        .unwrap_err();
    let text = error.to_string();
    assert!(text.contains("checkpoint.safetensors is the last good checkpoint"), "{text}");
    assert!(asked.get() < 10_000, "the run went on without its device");
    let stored = Stored::read(&folder.checkpoint()).unwrap();
    let mut host = Sac::new(&run.config.learning, N_VALUES, 9, 9).unwrap();
    host.restore(&stored).unwrap();
    assert!(host.broken().is_none());
}

#[test]
fn the_critics_loss_goes_down() {
    let place = tempfile::tempdir().unwrap();
    let (mut run, folder, _) =
        run(place.path(), &["steps=20000", "learning.updates_per_step=2", "learning.critic_learning_rate=0.003"]);
    run.learn(|| false).unwrap();
    run.close().unwrap();
    let metrics = std::fs::read_to_string(folder.metrics()).unwrap();
    let losses: Vec<f32> = metrics.lines().skip(1).filter_map(|row| row.split(',').nth(6)?.parse().ok()).collect();
    assert!(40 < losses.len(), "{metrics}");
    let mean = |rows: &[f32]| rows.iter().sum::<f32>() / rows.len() as f32;
    let (first, last) = (mean(&losses[..10]), mean(&losses[losses.len() - 10..]));
    // A critic that begins at 0 is off by the rewards; one that has learned their mean is off by their standard
    // deviation.
    assert!(last < 0.9 * first, "{first} {last}");
}
