//! Threads of a batch. A forked child has none of its parent's: it makes its own.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// How often long work looks whether Ctrl-C was pressed.
const POLL: Duration = Duration::from_millis(50);

/// A pool of threads, made at its first use in a process.
#[derive(Debug)]
pub struct Pool {
    /// Threads; 0 for one a core.
    n_threads: usize,
    made: Option<(u32, ThreadPool)>,
}

impl Pool {
    /// A pool of so many threads; 0 for one a core.
    pub fn new(n_threads: usize) -> Pool {
        Pool { n_threads, made: None }
    }

    /// Does `work` on the pool's threads while other Python threads run.
    pub fn run<T: Send>(&mut self, py: Python, work: impl FnOnce() -> T + Send) -> PyResult<T> {
        let pool = self.here()?;
        Ok(py.detach(|| pool.install(work)))
    }

    /// Does `work` that may take long in the same way. Where a signal's handler raises meanwhile, as that of Ctrl-C
    /// does, `work` finds its argument set and should end soon; then the handler's exception is raised.
    pub fn run_until_signal<T: Send>(&mut self, py: Python, work: impl FnOnce(&AtomicBool) -> T + Send) -> PyResult<T> {
        let pool = self.here()?;
        let stop = AtomicBool::new(false);
        let (sender, receiver) = mpsc::channel();
        let receiver = Mutex::new(receiver);
        let wait = || receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(POLL);
        pool.in_place_scope(|scope| {
            let stop = &stop;
            scope.spawn(move |_| {
                // The receiver lives as long as the scope.
                let _ = sender.send(work(stop));
            });
            let mut handled = Ok(());
            loop {
                match py.detach(wait) {
                    Ok(done) => return handled.map(|()| done),
                    Err(RecvTimeoutError::Timeout) if handled.is_err() => {}
                    Err(RecvTimeoutError::Timeout) => {
                        handled = py.check_signals();
                        stop.store(handled.is_err(), Ordering::Relaxed);
                    }
                    // `work` has panicked, and so does the scope.
                    Err(RecvTimeoutError::Disconnected) => return Err(PyRuntimeError::new_err("the work has failed")),
                }
            }
        })
    }

    /// Whether the threads were made by another process, of which this one is a fork.
    pub fn is_forked(&self) -> bool {
        self.made.as_ref().is_some_and(|(process, _)| *process != std::process::id())
    }

    fn here(&mut self) -> PyResult<&ThreadPool> {
        if self.is_forked()
            && let Some((_, pool)) = self.made.take()
        {
            // The pool's threads are the parent's: there is nothing to stop here.
            std::mem::forget(pool);
        }
        let (_, pool) = match self.made.take() {
            Some(made) => self.made.insert(made),
            None => {
                let n_threads = if self.n_threads == 0 { offtrack::files::cache::n_threads() } else { self.n_threads };
                let pool = ThreadPoolBuilder::new().num_threads(n_threads).build();
                let pool = pool.map_err(|error| {
                    PyRuntimeError::new_err(format!("num_threads: {n_threads}; {error}; ask for fewer"))
                })?;
                self.made.insert((std::process::id(), pool))
            }
        };
        Ok(pool)
    }
}
