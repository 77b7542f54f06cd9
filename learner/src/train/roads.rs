//! Benchmarks by name, and their worlds, with the user's cache.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use offtrack::files::cache::{Cache, Loading, Progress};
use offtrack::files::reader::Error as InputError;
use offtrack::scenario::Scenario;
use offtrack::world::{self, World};

use super::event::{Caller, Event, Watcher};

/// Reads benchmarks and bakes worlds. What is known of random roads and baked fields is kept in the user's cache.
#[derive(Clone, Copy)]
pub(super) struct Roads<'a> {
    watcher: &'a Watcher<'a>,
    /// Set to end the work with an error.
    stop: &'a AtomicBool,
}

impl<'a> Roads<'a> {
    /// Work that the caller may stop.
    pub(super) fn stoppable(caller: Caller<'a>) -> Roads<'a> {
        Roads { watcher: caller.watcher, stop: caller.stop }
    }

    /// Work after training, which a stopped caller waits for: its report would be lost.
    pub(super) fn unstoppable(caller: Caller<'a>) -> Roads<'a> {
        Roads { watcher: caller.watcher, stop: Loading::PLAIN.stop }
    }

    /// A benchmark by its name or path.
    pub(super) fn benchmark(self, name: &str) -> Result<Scenario, InputError> {
        self.loading(|loading| Scenario::load(name, loading))
    }

    /// The benchmark's world.
    pub(super) fn world(self, scenario: &Scenario) -> Result<Arc<World>, world::Error> {
        self.loading(|loading| World::bake_with(scenario, loading)).map(Arc::new)
    }

    fn loading<T>(self, work: impl FnOnce(&Loading) -> T) -> T {
        let cache = Cache::of_user();
        let watcher = |progress: Progress| (self.watcher)(Event::Roads(progress));
        let done = work(&Loading { cache: cache.as_ref(), watcher: &watcher, stop: self.stop });
        if let Some(failure) = cache.as_ref().and_then(Cache::failure) {
            (self.watcher)(Event::Warning(&format!("note: {failure}; the next command computes them again")));
        }
        done
    }
}
