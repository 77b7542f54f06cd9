//! What whoever asked for a run is told of it, and how they stop it. The library itself prints nothing.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use offtrack::files::cache;

use super::Outcome;
use crate::run::folder::Folder;
use crate::run::progress::{Display, Status};

/// Something that happened in a run, in the order in which it happens.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Event<'a> {
    /// One of several seeds is next.
    Seed {
        /// The seed.
        seed: u32,
        /// The seed's index among all that were asked for.
        index: usize,
        /// How many were asked for.
        n_seeds: usize,
    },
    /// A road was drawn or baked; on many threads these events may come out of order.
    Roads(cache::Progress),
    /// The input is good, the folder is there, and training begins.
    Begun(Begun<'a>),
    /// How far training is: every few seconds, and at its end.
    Training(&'a Status),
    /// Training is over; no step is made any more.
    Trained,
    /// Episodes of an evaluation ended.
    Evaluating {
        /// The benchmark whose routes are driven.
        benchmark: &'a str,
        /// Episodes that ended.
        done: usize,
        /// Episodes in all.
        total: usize,
    },
    /// A line about something that went wrong and does not end the run.
    Warning(&'a str),
    /// The report is written. Where something else could not be written, that error follows.
    Finished {
        /// Where everything is.
        folder: &'a Folder,
        /// What the report says.
        outcome: &'a Outcome,
    },
}

/// A run at its beginning, or where it goes on.
#[derive(Debug, Clone, Copy)]
pub struct Begun<'a> {
    /// The run's folder.
    pub folder: &'a Path,
    /// Env steps and training time (s) of the checkpoint that it goes on from; none at the beginning.
    pub resumed: Option<(u64, f64)>,
    /// The benchmark that is trained on.
    pub benchmark: &'a str,
    /// Number of the benchmark's training routes.
    pub n_routes: usize,
    /// What differs from the benchmark's reward, `reward.clearance = -100.0`; empty where nothing does.
    pub rewards: &'a str,
    /// Where trucks and learner are.
    pub device: &'a str,
}

/// Is told of events, from any thread.
pub type Watcher<'a> = dyn Fn(Event) + Sync + 'a;

/// Who asked for a run.
#[derive(Clone, Copy)]
pub struct Caller<'a> {
    /// Is told how the run goes.
    pub watcher: &'a Watcher<'a>,
    /// Set to stop the run: the step in hand finishes, and everything is written.
    pub stop: &'a AtomicBool,
}

impl Caller<'_> {
    /// Tells of an event.
    pub(super) fn tell(&self, event: Event) {
        (self.watcher)(event);
    }

    /// Whether the run is to stop.
    pub(super) fn stops(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// A run's progress is told as events.
impl Display for Caller<'_> {
    fn show(&mut self, status: &Status) {
        self.tell(Event::Training(status));
    }

    fn warn(&mut self, line: String) {
        self.tell(Event::Warning(&line));
    }

    fn close(&mut self) {
        self.tell(Event::Trained);
    }
}
