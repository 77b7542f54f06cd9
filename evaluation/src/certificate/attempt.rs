//! Searches from one start, wider and wider until one arrives; and the same from many starts at once.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use offtrack::layout::{Ended, Start};
use offtrack::world::World;
use offtrack_policy::Policy;

use super::beam::{self, Outcome, Pass};
use super::file::{self, Found};
use crate::error::Error;

/// Steps that each chosen action is held for where nobody says how many.
pub const HOLD: usize = 3;
/// Widest beam.
const WIDEST: usize = 1 << 18;

/// The searches to make in turn: the widths as given, then the widest with a choice at every step. Fails on a width
/// that is 0 or that no memory holds, and on one that stands there twice.
pub fn passes(widths: &[usize], hold: usize) -> Result<Vec<Pass>, Error> {
    if let Some(width) = widths.iter().find(|width| !(1..=WIDEST).contains(*width)) {
        return Err(Error::Setting {
            name: "--widths",
            value: width.to_string(),
            expected: format!("must lie in 1..{WIDEST}"),
        });
    }
    if let Some((index, width)) = widths.iter().enumerate().find(|(index, width)| widths[..*index].contains(width)) {
        let expected = format!("stands there again as number {}: name each width once", index + 1);
        return Err(Error::Setting { name: "--widths", value: width.to_string(), expected });
    }
    let mut passes: Vec<Pass> = widths.iter().map(|&width| Pass { width, hold }).collect();
    if let Some(&width) = widths.iter().max()
        && 1 < hold
    {
        passes.push(Pass { width, hold: 1 });
    }
    Ok(passes)
}

/// Searches from one start until a pass arrives or all have been made. Without an arrival the result is the pass with
/// the most progress.
pub fn attempt(
    world: &Arc<World>,
    route: u32,
    start: &Start,
    passes: &[Pass],
    policy: Option<&Policy>,
) -> Result<Found, Error> {
    let mut env_steps = 0;
    let mut best: Option<(Pass, Outcome)> = None;
    for &pass in passes {
        let outcome = beam::search(world, route, start, pass, policy)?;
        env_steps += outcome.env_steps;
        let arrived = outcome.ended == Ended::Arrived;
        let further = |best: &Outcome| (best.progress, best.steps) < (outcome.progress, outcome.steps);
        if arrived || best.as_ref().is_none_or(|(_, best)| further(best)) {
            best = Some((pass, outcome));
        }
        if arrived {
            break;
        }
    }
    let (pass, outcome) = best.expect("there is a width, so there was a pass");
    Ok(Found {
        ended: outcome.ended.name().to_owned(),
        progress: (outcome.progress * 1e3).round() / 1e3,
        steps: outcome.steps,
        width: pass.width,
        hold: pass.hold,
        env_steps,
        actions: file::runs(&outcome.actions),
    })
}

/// The results of [`attempt`] from many starts, each on its route, in their order. `done` is given each as it is found,
/// with its index, from any thread.
pub fn attempts(
    world: &Arc<World>,
    starts: &[(u32, Start)],
    passes: &[Pass],
    done: &(dyn Fn(usize, &Found) + Sync),
) -> Result<Vec<Found>, Error> {
    each(starts.len(), &|index| {
        let (route, start) = &starts[index];
        let found = attempt(world, *route, start, passes, None)?;
        done(index, &found);
        Ok(found)
    })
}

/// The results of `n` searches in their order. Every core makes searches of its own: the batch of a narrow search is
/// too small to be divided among them.
pub(crate) fn each<T: Send>(n: usize, search: &(dyn Fn(usize) -> Result<T, Error> + Sync)) -> Result<Vec<T>, Error> {
    let next = AtomicUsize::new(0);
    let searches = || -> Result<Vec<(usize, T)>, Error> {
        // Steps run in the pool of the thread that asks for them.
        rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(|| {
            let mut found = Vec::new();
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if n <= index {
                    return Ok(found);
                }
                // After a failure nobody needs the others.
                let one = search(index).inspect_err(|_| next.store(n, Ordering::Relaxed))?;
                found.push((index, one));
            }
        })
    };
    let mut found = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..rayon::current_num_threads().min(n)).map(|_| scope.spawn(searches)).collect();
        let joined = threads.into_iter().map(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic)));
        let found = joined.collect::<Result<Vec<_>, Error>>()?;
        Ok::<Vec<(usize, T)>, Error>(found.into_iter().flatten().collect())
    })?;
    found.sort_unstable_by_key(|&(index, _)| index);
    Ok(found.into_iter().map(|(_, found)| found).collect())
}
