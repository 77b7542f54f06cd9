//! Priorities on a device beside those that the host would have.

use super::*;

/// Trucks whose transitions are sampled by priority, after some steps.
fn rollout(exponent: f64, n_steps: usize, settings: &[&str]) -> DeviceRollout<N_VALUES> {
    let (world, routes) = training();
    let exponent = format!("replay_buffer.priority.exponent={exponent}");
    let settings = [&[exponent.as_str(), "replay_buffer.priority.correction=0.4"], settings].concat();
    let gpu = least();
    let config = config(&settings);
    let mut rollout = DeviceRollout::with_seeds(&gpu, &config, &world, routes, None, seeds(&config)).unwrap();
    (0..n_steps).for_each(|_| rollout.step_at_random().unwrap());
    rollout
}

/// The rows of a new sample.
fn sampled(rollout: &mut DeviceRollout<N_VALUES>) -> Vec<usize> {
    rollout.sample().unwrap();
    held::<u32, N_VALUES>(rollout, Binding::sampled_row).into_iter().map(|row| row as usize).collect()
}

/// Sets the TD errors of the latest sample.
fn set_errors(rollout: &mut DeviceRollout<N_VALUES>, errors: &[f32]) {
    let errors = rollout.gpu.filled("errors", cast_slice(errors));
    rollout.set_td_errors(TdErrors::Device(errors)).unwrap();
}

/// TD errors of 0 to 50, most of them small.
fn errors(n_rows: usize, step: usize) -> Vec<f32> {
    let unit = |row| 0.5 + 0.5 * signed_unit(words(9, row as u32, step as u32, 0)[0]);
    (0..n_rows).map(|row| 50.0 * unit(row).powi(4)).collect()
}

#[test]
fn priorities_and_weights_are_those_of_the_host_round_the_ring() {
    let (exponent, correction) = (0.6, 0.4);
    let mut rollout = rollout(exponent, 0, &[]);
    let [n_envs, n_slots, n_steps] =
        [rollout.facts.n_envs, rollout.facts.n_slots, rollout.facts.n_steps].map(|number| number as usize);
    let mut expected = vec![0.0f64; n_slots * n_envs];
    let mut largest = 1.0f64;
    // Three times round the ring of 32 steps.
    for step in 0..100 {
        rollout.step_at_random().unwrap();
        let rows = |step: usize| step % n_slots * n_envs..(step % n_slots + 1) * n_envs;
        expected[rows(step)].fill(0.0);
        if n_steps <= step {
            expected[rows(step - n_steps)].fill(largest);
        }
        if !rollout.can_sample() {
            continue;
        }
        let drawn = sampled(&mut rollout);
        let least = drawn.iter().map(|&row| expected[row]).fold(f64::MAX, f64::min);
        assert!(0.0 < least, "step {step}: what cannot be sampled was");
        // The device's power has a few of the 24 bits of an f32 less than the host's.
        for (&row, weight) in drawn.iter().zip(host(&rollout, &rollout.sample.weight)) {
            let expected = (least / expected[row]).powf(correction);
            assert!((f64::from(weight) - expected).abs() < 1e-4, "step {step}: {weight} {expected}");
        }
        let errors = errors(drawn.len(), step);
        set_errors(&mut rollout, &errors);
        // Of a row drawn twice the last error counts.
        let last: std::collections::BTreeMap<usize, f32> = drawn.into_iter().zip(errors).collect();
        for (row, error) in last {
            expected[row] = (f64::from(error) + 1e-6).powf(exponent);
            largest = largest.max(expected[row]);
        }
        let found = held::<f32, N_VALUES>(&rollout, Binding::priority);
        for (row, (&found, expected)) in found.iter().zip(&mut expected).enumerate() {
            assert!((f64::from(found) - *expected).abs() <= 1e-4 * *expected, "step {step}, {row}: {found} {expected}");
        }
        assert!((f64::from(held::<f32, N_VALUES>(&rollout, Binding::largest)[0]) - largest).abs() < 1e-4 * largest);
    }
}

/// How far the counts of rows in many samples are from their expectation, in standard deviations of what chi squared
/// says of them; and the draws of rows that cannot be sampled, or hardly.
fn departure(rollout: &mut DeviceRollout<N_VALUES>, priorities: &[f32]) -> (f64, f64) {
    let mut counts = vec![0.0f64; priorities.len()];
    for _ in 0..100 {
        sampled(rollout).into_iter().for_each(|row| counts[row] += 1.0);
    }
    let n_draws: f64 = counts.iter().sum();
    let sum: f64 = priorities.iter().map(|&priority| f64::from(priority)).sum();
    let (mut squares, mut freedom, mut rare) = (0.0, -1.0, 0.0);
    for (count, &priority) in counts.iter().zip(priorities) {
        let expected = n_draws * f64::from(priority) / sum;
        if 5.0 < expected {
            squares += (count - expected).powi(2) / expected;
            freedom += 1.0;
        } else {
            rare += count;
        }
    }
    ((squares - freedom) / f64::sqrt(2.0 * freedom), rare)
}

#[test]
fn transitions_are_sampled_in_proportion_to_their_priorities_which_uniform_sampling_would_not_pass() {
    // More blocks than a workgroup has threads, and the last of them not whole.
    let sizes = ["n_envs=510", "replay_buffer.capacity=16000", "learning.batch=4000"];
    let mut rollout = rollout(0.5, 40, &sizes);
    assert!(64 < rollout.facts.n_blocks && !(rollout.facts.n_slots * rollout.facts.n_envs).is_multiple_of(BLOCK));
    for _ in 0..20 {
        let errors: Vec<f32> = sampled(&mut rollout).iter().map(|row| [0.0, 1.0, 4.0, 9.0, 16.0][row % 5]).collect();
        set_errors(&mut rollout, &errors);
    }
    let priorities = held::<f32, N_VALUES>(&rollout, Binding::priority);
    let n_rare = priorities.iter().filter(|&&priority| 0.0 < priority && priority < 0.01).count();
    assert!(1000 < n_rare, "{n_rare}");
    let (departs, rare) = departure(&mut rollout, &priorities);
    // 400,000 draws; the rows of error 0 have the root of 1e-6 as their priority, all together 1e-4 of the sum.
    assert!(departs < 5.0 && rare < 100.0, "{departs} {rare}");
    let (world, routes) = training();
    let config = config(&sizes);
    let mut uniform = DeviceRollout::with_seeds(&rollout.gpu, &config, &world, routes, None, seeds(&config)).unwrap();
    (0..40).for_each(|_| uniform.step_at_random().unwrap());
    let (departs, rare) = departure(&mut uniform, &priorities);
    assert!(100.0 < departs && 1000.0 < rare, "{departs} {rare}");
}

#[test]
fn the_same_seed_gives_the_same_samples_and_priorities_to_the_bit() {
    let run = || {
        let mut rollout = rollout(0.6, 20, &[]);
        let samples: Vec<_> = (0..20)
            .map(|step| {
                let drawn = sampled(&mut rollout);
                set_errors(&mut rollout, &errors(drawn.len(), step));
                (drawn, host(&rollout, &rollout.sample.weight))
            })
            .collect();
        (samples, held::<u32, N_VALUES>(&rollout, Binding::priority))
    };
    assert!(run() == run());
}

#[test]
fn a_td_error_that_is_not_finite_changes_no_priority() {
    let mut rollout = rollout(0.6, 20, &[]);
    let before = held::<u32, N_VALUES>(&rollout, Binding::priority);
    let n_rows = sampled(&mut rollout).len();
    set_errors(&mut rollout, &vec![f32::INFINITY; n_rows]);
    set_errors(&mut rollout, &vec![f32::NAN; n_rows]);
    assert!(held::<u32, N_VALUES>(&rollout, Binding::priority) == before);
}
