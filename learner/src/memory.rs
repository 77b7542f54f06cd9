//! The memory that a run on the processor takes, and its policy's file, reckoned before it begins. Linux grants memory
//! that it does not have and ends the process that uses it, and an allocation that is refused ends the process too.

use offtrack::simulator::available_memory;
use offtrack_policy::FILE_LIMIT;

use super::config::{Config, Refinement};
use crate::error::Error;

/// Bytes of an f32.
const F32: u128 = 4;
/// Copies of the parameters of the learner's networks: parameters of three networks, target networks and EMA, Adam's
/// moments, gradients of two shards and their sum, and a checkpoint's copy of each.
const COPIES: u128 = 33;
/// Copies of the parameters of the refinement's two networks, counted as in [`COPIES`].
const REFINED_COPIES: u128 = 24;
/// Bytes of a truck beside its observations: its row of the batch, among other vehicles.
const TRUCK: u128 = 1_800;

/// A part of the memory, and the key that it grows with.
struct Part {
    key: &'static str,
    value: String,
    bytes: u128,
}

/// Transitions that the replay buffer ever holds: no more than there are steps.
pub fn transitions(config: &Config) -> usize {
    let slots = config.replay_buffer.slots(config.n_envs);
    let stepped = config
        .steps
        .map_or(usize::MAX, |steps| usize::try_from(steps.div_ceil(config.n_envs as u64)).unwrap_or(usize::MAX));
    // A refinement's last steps, and the one under way.
    slots.min(stepped.saturating_add(1)).saturating_mul(config.n_envs)
}

/// An error if a run of networks of so many values and actions does not fit into the memory that the machine has free.
/// It names the key that takes most.
pub fn check(config: &Config, n_values: usize, n_actions: usize) -> Result<(), Error> {
    check_within(config, n_values, n_actions, available_memory().map_or(u128::MAX, u128::from))
}

fn check_within(config: &Config, n_values: usize, n_actions: usize, available: u128) -> Result<(), Error> {
    let parts = parts(config, n_values as u128, n_actions as u128);
    let needed: u128 = parts.iter().map(|part| part.bytes).sum();
    let Some(Part { key, value, bytes }) =
        parts.into_iter().max_by_key(|part| part.bytes).filter(|_| available < needed)
    else {
        return Ok(());
    };
    let [needed, bytes, available] = [needed, bytes, available].map(gigabytes);
    let expected = format!(
        "the run would take about {needed} of memory, {bytes} of them for this, and {available} are free: less would do"
    );
    Err(Error::setting(key, value, expected))
}

fn parts(config: &Config, n_values: u128, n_actions: u128) -> [Part; 6] {
    let Config { replay_buffer, learning, refinement, .. } = config;
    let (n_envs, batch) = (config.n_envs as u128, learning.batch as u128);
    let observation = F32 * n_values;
    let hidden: Vec<u128> = learning.hidden.iter().map(|&size| size as u128).collect();
    let weights = |n_inputs: u128| n_weights(config, n_inputs, n_actions);
    let widest = hidden.iter().copied().max().unwrap_or_default();
    let rows = replay_buffer.capacity.div_ceil(config.n_envs) as u128 * n_envs;
    // A tree of sums over a power of two.
    let tree = if replay_buffer.priority.is_some() { 2 * rows.next_power_of_two() * 8 } else { 0 };
    // Found from a copy of all of them and, with a mirror, their images.
    let normalised = if learning.mirror_augmentation { 4 } else { 1 };
    let refined = refinement.as_ref().map_or(0, |Refinement { n_steps, .. }| *n_steps as u128 * n_envs);
    let n_frames = n_frames(config);
    let refined_copies = refinement.as_ref().map_or(0, |_| REFINED_COPIES);
    let copied = COPIES * weights(n_values) + refined_copies * weights(n_frames * n_values);
    let part = |key, value, bytes| Part { key, value, bytes };
    [
        part(
            "replay_buffer.capacity",
            replay_buffer.capacity.to_string(),
            transitions(config) as u128 * (observation + 9) + tree,
        ),
        part(
            "replay_buffer.warmup",
            replay_buffer.warmup.to_string(),
            replay_buffer.warmup as u128 * observation * normalised,
        ),
        part("learning.hidden", format!("{:?}", learning.hidden), copied * F32),
        // Three networks forward and backward, each layer's output kept.
        part(
            "learning.batch",
            learning.batch.to_string(),
            batch * (6 * observation + 9 * F32 * hidden.iter().sum::<u128>()),
        ),
        part("n_envs", config.n_envs.to_string(), n_envs * (TRUCK + (3 + n_frames) * observation + 2 * F32 * widest)),
        // Twice while a list of them grows.
        part(
            "refinement.n_steps",
            refinement.as_ref().map_or(0, |of| of.n_steps).to_string(),
            2 * refined * (n_frames * observation + 32),
        ),
    ]
}

/// Weights and biases of the policy's network with so many inputs.
fn n_weights(config: &Config, n_inputs: u128, n_actions: u128) -> u128 {
    let hidden = config.learning.hidden.iter().map(|&size| size as u128);
    let sizes: Vec<u128> = [n_inputs].into_iter().chain(hidden).chain([n_actions]).collect();
    sizes.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum()
}

/// Observations that the policy sees in the end.
fn n_frames(config: &Config) -> u128 {
    config.refinement.as_ref().map_or(1, |refinement| refinement.frames as u128)
}

/// An error if the policy's file would be larger than one that is read.
pub fn check_policy(config: &Config, n_values: usize, n_actions: usize) -> Result<(), Error> {
    let bytes = F32 * n_weights(config, n_frames(config) * n_values as u128, n_actions as u128);
    if bytes <= u128::from(FILE_LIMIT) {
        return Ok(());
    }
    let megabytes = |bytes: u128| format!("{:.1} MB", bytes as f64 / 1e6);
    let expected = format!(
        "the policy's file would have {}, and one of at most {} is read: smaller layers would do, or fewer \
         refinement.frames",
        megabytes(bytes),
        megabytes(FILE_LIMIT.into())
    );
    Err(Error::setting("learning.hidden", format!("{:?}", config.learning.hidden), expected))
}

fn gigabytes(bytes: u128) -> String {
    format!("{:.1} GB", bytes as f64 / 1e9)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use offtrack::layout::N_VALUES;

    use super::*;

    fn checked(file: &str, settings: &[&str], gigabytes: u128) -> Result<(), String> {
        let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
        let config = Config::read_with(Path::new(file), &settings).unwrap();
        check_within(&config, N_VALUES, 9, gigabytes * 1_000_000_000).map_err(|error| error.to_string())
    }

    #[test]
    fn a_run_that_does_not_fit_is_refused_by_the_key_that_takes_most_of_the_memory() {
        for (file, settings, expected) in [
            (
                "default",
                &["replay_buffer.capacity=100000000", "steps=1000000000000"][..],
                "replay_buffer.capacity: 100000000; the run",
            ),
            (
                "default",
                &["replay_buffer.capacity=100000000", "replay_buffer.warmup=100000000"],
                "replay_buffer.warmup: 100000000;",
            ),
            ("default", &["learning.hidden=[8192, 8192, 8192]"], "learning.hidden: [8192, 8192, 8192];"),
            ("default", &["learning.batch=1048576"], "learning.batch: 1048576;"),
            (
                "default",
                &["n_envs=1048576", "replay_buffer.capacity=100000000", "learning.hidden=[8192]"],
                "n_envs: 1048576;",
            ),
            (
                "lane",
                &["refinement.n_steps=10000", "n_envs=20000", "replay_buffer.capacity=1000000"],
                "refinement.n_steps: 10000;",
            ),
            (
                "lane",
                &["refinement.frames=64", "refinement.n_steps=8", "learning.hidden=[8192, 1024]", "n_envs=64"],
                "learning.hidden: [8192, 1024];",
            ),
            // One frame would fit.
            (
                "lane",
                &["refinement.frames=20", "n_envs=20000", "replay_buffer.capacity=1000000"],
                "refinement.n_steps: 64;",
            ),
        ] {
            let message = checked(file, settings, 4).unwrap_err();
            assert!(message.starts_with(expected) && message.contains("4.0 GB are free"), "{settings:?}: {message}");
        }
    }

    #[test]
    fn every_shipped_training_file_for_the_processor_fits_into_two_gigabytes() {
        let files =
            "default best lane attard as-run laden laden-50 transfer transfer-refined traffic traffic-refined paper";
        for file in files.split(' ') {
            assert_eq!(checked(file, &[], 2), Ok(()), "{file}");
        }
    }

    #[test]
    fn a_policy_that_no_command_would_read_is_refused_before_it_is_learned() {
        for (settings, fits) in [
            (&["learning.hidden=[2048, 2048, 2048]"][..], true),
            (&["learning.hidden=[8192, 8192]"], false),
            (&["learning.hidden=[4096]", "refinement.frames=40"], true),
            (&["learning.hidden=[4096]", "refinement.frames=64"], false),
        ] {
            let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
            let checked = check_policy(&Config::read_with(Path::new("lane"), &settings).unwrap(), N_VALUES, 9);
            assert_eq!(checked.is_ok(), fits, "{settings:?}");
            let expected = "MB, and one of at most 67.1 MB is read";
            assert!(checked.is_ok() || checked.unwrap_err().to_string().contains(expected), "{settings:?}");
        }
    }

    #[test]
    fn a_replay_buffer_takes_no_more_than_the_steps_of_the_run() {
        assert_eq!(
            checked("paper", &["replay_buffer.capacity=100000000", "replay_buffer.priority=", "steps=100000"], 2),
            Ok(())
        );
    }
}
