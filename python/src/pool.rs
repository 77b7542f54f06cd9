//! Threads of a batch. A forked child has none of its parent's: it makes its own.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// A pool of threads, made at its first use in a process.
#[derive(Debug)]
pub struct Pool {
    /// Threads; 0 for one a core.
    n_threads: usize,
    made: Option<(u32, ThreadPool)>,
}

impl Pool {
    /// With so many threads; 0 for one a core.
    pub fn new(n_threads: usize) -> Pool {
        Pool { n_threads, made: None }
    }

    /// Does `work` on the pool's threads while other Python threads run.
    pub fn run<T: Send>(&mut self, py: Python, work: impl FnOnce() -> T + Send) -> PyResult<T> {
        let pool = self.here()?;
        Ok(py.detach(|| pool.install(work)))
    }

    /// Whether the threads were made by another process, of which this one is a fork.
    pub fn is_forked(&self) -> bool {
        self.made.as_ref().is_some_and(|(process, _)| *process != std::process::id())
    }

    fn here(&mut self) -> PyResult<&ThreadPool> {
        if self.is_forked()
            && let Some((_, pool)) = self.made.take()
        {
            // Its threads are the parent's: there is nothing to stop here.
            std::mem::forget(pool);
        }
        let (_, pool) = match self.made.take() {
            Some(made) => self.made.insert(made),
            None => {
                let pool = ThreadPoolBuilder::new().num_threads(self.n_threads).build();
                let pool = pool.map_err(|error| PyRuntimeError::new_err(format!("num_threads: {}; {error}", self.n_threads)))?;
                self.made.insert((std::process::id(), pool))
            }
        };
        Ok(pool)
    }
}
