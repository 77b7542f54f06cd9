//! Measures env steps per second: medians over windows, since other work on a machine disturbs some windows, not most.
//!
//! Steps are queued on a device in runs and waited for once a run: waiting for each would measure the wait, and never
//! waiting would queue without bound.

use std::time::{Duration, Instant};

use offtrack::engine::stages::STAGES;
use offtrack::layout::N_RAYS;
use offtrack::simulator::Tally;
use serde::Serialize;

use offtrack_learner::error::Error;

use super::mode::Driven;

/// A window lasts this long, or a fifth of the time for a size where that is shorter (s).
const WINDOW: f64 = 0.25;
/// A run of steps lasts about this long, then it is waited for (s).
const RUN: f64 = 0.02;
/// Most steps in a run.
const RUN_MOST: u64 = 1024;
/// Stages are timed this often at most.
const STAGE_SAMPLES: usize = 100;

/// The stages' names in their order.
pub(super) const STAGE_NAMES: [&str; STAGES.len()] = {
    let (mut names, mut stage) = ([""; STAGES.len()], 0);
    while stage < STAGES.len() {
        names[stage] = STAGES[stage].name();
        stage += 1;
    }
    names
};

/// What was measured.
#[derive(Debug, Serialize)]
pub(super) struct Measured {
    /// Median over the windows.
    pub env_steps_per_second: f64,
    pub windows: usize,
    pub slowest_window: f64,
    pub fastest_window: f64,
    /// The median speed in rays.
    pub rays_per_second: f64,
    /// Steps of the whole batch before the first window, in which the episodes, all started at once, spread out.
    pub steps_before: u64,
    /// Steps of the whole batch in all windows.
    pub steps: u64,
    /// Env steps in all windows, as the trucks were counted where they were stepped.
    pub env_steps: u64,
    /// Episodes that ended in the windows; each truck was reset in the same step.
    pub episodes: u64,
    /// Steps queued before they are waited for.
    pub steps_a_wait: u64,
    /// Memory of the columns.
    pub bytes_per_truck: f64,
    /// Median time of each stage when the batch is stepped a stage at a time [ns a truck]; empty where a step is more
    /// than the stages.
    #[serde(serialize_with = "as_map")]
    pub stages: Vec<(&'static str, f64)>,
    /// The same of each kernel of a step on a device, some of which do several stages.
    #[serde(serialize_with = "as_map", skip_serializing_if = "Vec::is_empty")]
    pub kernels: Vec<(&'static str, f64)>,
}

/// Pairs as a map in their own order.
fn as_map<S: serde::Serializer>(pairs: &[(&'static str, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().copied())
}

/// Steps the trucks for about so many seconds: a fifth for the trucks to spread out, three fifths for whole steps, the
/// rest a stage at a time.
pub(super) fn measured(driven: &mut Driven, seconds: f64) -> Result<Measured, Error> {
    let envs = driven.simulator().n_envs();
    let (steps_before, steps_a_wait) = spread_out(driven, 0.2 * seconds)?;
    let window = WINDOW.min(0.2 * seconds);
    let before = driven.simulator().tally()?;
    let (mut speeds, mut steps) = (Vec::new(), 0);
    let begun = Instant::now();
    while begun.elapsed().as_secs_f64() < 0.6 * seconds {
        let (mut done, begun) = (0, Instant::now());
        while begun.elapsed().as_secs_f64() < window {
            step_and_wait(driven, steps_a_wait)?;
            done += steps_a_wait;
        }
        speeds.push((done * envs as u64) as f64 / begun.elapsed().as_secs_f64());
        steps += done;
    }
    let after = driven.simulator().tally()?;
    let stages = stage_times(driven, 0.1 * seconds)?;
    let kernels = kernel_times(driven, 0.1 * seconds)?;
    let since = |count: fn(&Tally) -> u64| count(&after) - count(&before);
    let (env_steps, episodes) = (since(Tally::env_steps), since(Tally::episodes));
    let speed = median(&mut speeds);
    Ok(Measured {
        env_steps_per_second: speed.round(),
        windows: speeds.len(),
        // The median sorts.
        slowest_window: speeds[0].round(),
        fastest_window: speeds[speeds.len() - 1].round(),
        rays_per_second: (speed * N_RAYS as f64 * (env_steps + episodes) as f64 / env_steps.max(1) as f64).round(),
        steps_before,
        steps,
        env_steps,
        episodes,
        steps_a_wait,
        bytes_per_truck: driven.simulator().bytes() as f64 / envs as f64,
        stages,
        kernels,
    })
}

/// Steps for so many seconds: how many, and how many make a run.
fn spread_out(driven: &mut Driven, seconds: f64) -> Result<(u64, u64), Error> {
    // The first step may compile what it needs.
    step_and_wait(driven, 1)?;
    let (mut steps, mut run) = (1, 1);
    let begun = Instant::now();
    while begun.elapsed().as_secs_f64() < seconds {
        let begun = Instant::now();
        step_and_wait(driven, run)?;
        steps += run;
        if begun.elapsed().as_secs_f64() < 0.5 * RUN && run < RUN_MOST {
            run *= 2;
        }
    }
    Ok((steps, run))
}

/// A run of steps, done when it returns.
fn step_and_wait(driven: &mut Driven, steps: u64) -> Result<(), Error> {
    driven.steps(steps)?;
    driven.wait()
}

/// Median times of the stages, timed for so many seconds, once at least [ns a truck].
fn stage_times(driven: &mut Driven, seconds: f64) -> Result<Vec<(&'static str, f64)>, Error> {
    let envs = driven.simulator().n_envs() as f64;
    let mut times: [Vec<f64>; STAGES.len()] = Default::default();
    let begun = Instant::now();
    while times[0].is_empty() || begun.elapsed().as_secs_f64() < seconds && times[0].len() < STAGE_SAMPLES {
        let Some(lasted) = driven.step_by_stage()? else { return Ok(Vec::new()) };
        for (times, time) in times.iter_mut().zip(lasted) {
            times.push(Duration::as_secs_f64(&time) * 1e9 / envs);
        }
    }
    Ok(STAGE_NAMES.into_iter().zip(&mut times).map(|(name, times)| (name, rounded(median(times)))).collect())
}

/// Median times of the kernels of a step, timed for so many seconds, once at least [ns a truck].
fn kernel_times(driven: &mut Driven, seconds: f64) -> Result<Vec<(&'static str, f64)>, Error> {
    let envs = driven.simulator().n_envs() as f64;
    let mut times: Vec<(&'static str, Vec<f64>)> = Vec::new();
    let (begun, mut n_samples) = (Instant::now(), 0);
    while n_samples == 0 || begun.elapsed().as_secs_f64() < seconds && n_samples < STAGE_SAMPLES {
        let lasted = driven.step_by_kernel()?;
        if times.is_empty() {
            times = lasted.iter().map(|&(name, _)| (name, Vec::new())).collect();
        }
        for ((_, times), (_, time)) in times.iter_mut().zip(lasted) {
            times.push(time.as_secs_f64() * 1e9 / envs);
        }
        n_samples += 1;
    }
    Ok(times.into_iter().map(|(name, mut times)| (name, rounded(median(&mut times)))).collect())
}

/// The middle value; sorts on the way.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Rounded to a thousandth: on a large device a stage takes less than a tenth of a nanosecond a truck.
pub(crate) fn rounded(value: f64) -> f64 {
    (1000.0 * value).round() / 1000.0
}
