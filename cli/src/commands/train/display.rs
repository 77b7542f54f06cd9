//! What a terminal shows of a run: a bar or lines while it goes on, and what it came to.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use offtrack::files::cache::Progress;
use offtrack::files::reader::shown_path;
use offtrack_commands::progress::Bar;
use offtrack_commands::roads::FEW;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;
use offtrack_learner::train::{Begun, Event};

use super::bar::TrainingDisplay;
use super::summary;

/// What a first signal is answered with.
const STOPPING: &str =
    "stopping once what is in hand is finished and written, an evaluation whole; a second signal ends the process";

/// Shows events as they come. Training goes on when nobody reads its lines; a result that cannot be printed is an error
/// at the end.
pub(super) struct Display {
    state: Arc<Mutex<State>>,
    /// Set to stop the run.
    stop: Arc<AtomicBool>,
    is_one_of_several: bool,
}

#[derive(Default)]
struct State {
    /// Which of several seeds it is, as lines begin with; empty where it is the only one.
    label: String,
    /// The bar of roads or episodes, and what it counts.
    bar: Option<(String, Bar)>,
    training: Option<TrainingDisplay>,
    /// Why a result could not be printed.
    failure: Option<Error>,
}

impl Display {
    /// Of one run, or of several seeds.
    pub(super) fn new(is_one_of_several: bool) -> Display {
        Display { state: Arc::default(), stop: Arc::default(), is_one_of_several }
    }

    /// Set to stop the run.
    pub(super) fn stop(&self) -> &Arc<AtomicBool> {
        &self.stop
    }

    /// What says that the run stops, and stops it.
    pub(super) fn stopper(&self) -> impl FnOnce() + Send + 'static {
        let (state, stop) = (self.state.clone(), self.stop.clone());
        move || {
            locked(&state).say(STOPPING);
            stop.store(true, Ordering::Relaxed);
        }
    }

    /// Shows an event.
    pub(super) fn tell(&self, event: Event) {
        let mut state = self.state();
        match event {
            Event::Seed { seed, index, n_seeds } => state.label = format!("seed {seed}, {} of {n_seeds}: ", index + 1),
            Event::Roads(Progress { what, done, total }) if FEW < total => {
                state.count(what.trim_end_matches(" roads"), "roads", done, total);
            }
            Event::Begun(begun) => state.begin(&begun),
            Event::Training(status) => {
                if let Some(training) = &mut state.training {
                    training.show(status);
                }
            }
            Event::Trained => {
                if let Some(training) = state.training.take() {
                    training.close();
                }
            }
            Event::Evaluating { benchmark, done, total } => {
                state.count(&format!("evaluating on {benchmark}"), "episodes", done, total);
            }
            Event::Warning(line) => state.say(line),
            Event::Finished { folder, outcome } => {
                state.bar = None;
                if let Err(error) = files::print(&summary::text(folder, outcome, self.is_one_of_several)) {
                    state.failure.get_or_insert(error);
                    // No further seed is trained for nobody.
                    self.stop.store(true, Ordering::Relaxed);
                }
            }
            _ => {}
        }
    }

    /// Removes a bar, so that a line can be printed.
    pub(super) fn clear(&self) {
        self.state().bar = None;
    }

    /// Clears the terminal. A result that could not be printed is the error.
    pub(super) fn close(self) -> Result<(), Error> {
        let State { failure, .. } = std::mem::take(&mut *self.state());
        failure.map_or(Ok(()), Err)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        locked(&self.state)
    }
}

fn locked(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

impl State {
    /// Prints a line beside the bar.
    fn say(&mut self, line: &str) {
        match &self.training {
            Some(training) => training.warn(line),
            None => {
                self.bar = None;
                files::say(line);
            }
        }
    }

    /// Shows the bar of what is being done, in place of another one.
    fn count(&mut self, action: &str, unit: &str, done: usize, total: usize) {
        if self.bar.as_ref().is_none_or(|(shown, _)| shown != action) {
            // The earlier bar is removed before the next one is drawn.
            self.bar = None;
            self.bar = Some((action.to_owned(), Bar::new(action, unit, 0)));
        }
        if let Some((_, bar)) = &self.bar {
            bar.set(done, total);
        }
    }

    fn begin(&mut self, begun: &Begun) {
        self.bar = None;
        let Begun { folder, resumed, benchmark, n_routes, rewards, device } = *begun;
        let doing = match resumed {
            Some((env_steps, seconds)) => {
                format!("continuing after {env_steps} env steps and {:.2} min", seconds / 60.0)
            }
            None => "training".to_owned(),
        };
        let with = if rewards.is_empty() { String::new() } else { format!(" with {rewards}") };
        let on = format!("{n_routes} training routes of {benchmark}{with}, {device}");
        let _ = files::print(&format!("{}{}: {doing} on {on}\n", self.label, shown_path(folder)));
        self.training = Some(TrainingDisplay::new(&self.label));
    }
}
