use super::super::metrics::Figures;
use super::*;
use offtrack::scenario::{Scenario, Split};
use std::cell::Cell;
use std::path::Path;

use crate::files;

/// A small run in `folder`.
fn run(folder: &Path, settings: &[&str]) -> (DeviceRun, Folder) {
    let file = files::repository().join("training/configs/gpu.toml");
    let small = ["n_envs=64", "memory.capacity=4000", "memory.warmup=800", "learning.hidden=[16]", "learning.batch=32"];
    let settings: Vec<String> = small.iter().chain(settings).map(|setting| (*setting).to_owned()).collect();
    let config = Config::read_with(&file, &settings).unwrap();
    let folder = Folder::create(folder, Some("run"), &file, &config).unwrap();
    let scenario = Scenario::read(&files::benchmark("attard2023").unwrap()).unwrap();
    let (world, routes) = (Arc::new(World::bake(&scenario).unwrap()), scenario.split(Split::Train).to_vec());
    let progress = Progress::new(&config, Figures::create(folder.metrics()).unwrap());
    let run = DeviceRun::new(Shared::open(None).unwrap(), &config, routes, world, &folder, progress).unwrap();
    (run, folder)
}

#[test]
fn a_device_lost_on_the_way_ends_the_run_with_its_last_checkpoint_intact() {
    let place = tempfile::tempdir().unwrap();
    let (mut run, folder) = run(place.path(), &["steps=1000000", "checkpoint_minutes=0.0001"]);
    let device = run.shared.gpu.device.clone();
    let asked = Cell::new(0);
    let error = run
        .learn(|| {
            asked.set(asked.get() + 1);
            // By then a checkpoint has been written: they are due every 6 ms.
            if asked.get() == 60 {
                device.destroy();
            }
            false
        })
        .unwrap_err();
    let text = error.to_string();
    assert!(text.contains("checkpoint.safetensors is the last good checkpoint"), "{text}");
    assert!(asked.get() < 10_000, "the run went on without its device");
    let stored = Stored::read(&folder.checkpoint()).unwrap();
    let mut host = Sac::new(&run.config.learning, N_VALUES, run.world.actions.len(), 9).unwrap();
    host.restore(&stored).unwrap();
    assert!(host.broken().is_none());
}

#[test]
fn the_critics_loss_goes_down() {
    let place = tempfile::tempdir().unwrap();
    let (mut run, folder) = run(place.path(), &["steps=20000", "learning.updates_per_step=2", "learning.critic_rate=0.003"]);
    run.learn(|| false).unwrap();
    run.close().unwrap();
    let metrics = std::fs::read_to_string(folder.metrics()).unwrap();
    let losses: Vec<f32> = metrics.lines().skip(1).filter_map(|row| row.split(',').nth(6)?.parse().ok()).collect();
    assert!(40 < losses.len(), "{metrics}");
    let mean = |rows: &[f32]| rows.iter().sum::<f32>() / rows.len() as f32;
    let (first, last) = (mean(&losses[..10]), mean(&losses[losses.len() - 10..]));
    // A critic that begins at 0 is off by the rewards themselves; one that has learned their mean is off by their spread.
    assert!(last < 0.9 * first, "{first} {last}");
}
