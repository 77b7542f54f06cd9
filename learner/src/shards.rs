//! A batch in shards, each worked on by a thread of its own.
//!
//! The tensor library would otherwise spread single small products over the cores, which costs more than it gains.

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::error::Error;

/// Shards of a batch on the processor: two, for the cores of the smallest machines. Another number would round sums
/// differently.
pub const N_SHARDS: usize = 2;

/// One thread for each shard; none works on all shards in turn.
pub struct Shards(Vec<ThreadPool>);

impl Shards {
    /// Threads for `n` shards.
    pub fn new(n: usize) -> Result<Shards, Error> {
        let pools: Result<_, ThreadPoolBuildError> =
            (0..n).map(|_| ThreadPoolBuilder::new().num_threads(1).build()).collect();
        Ok(Shards(pools?))
    }

    /// The result of `work` for each shard, in their order. There are as many threads as shards, or none.
    pub fn map<I: Send, O: Send>(&self, shards: Vec<I>, work: impl Fn(I) -> O + Sync) -> Vec<O> {
        if self.0.len() < shards.len() {
            return shards.into_iter().map(work).collect();
        }
        let mut results: Vec<Option<O>> = shards.iter().map(|_| None).collect();
        let mut jobs: Vec<_> =
            self.0.iter().zip(shards).zip(&mut results).map(|((pool, shard), result)| (pool, shard, result)).collect();
        start(&mut jobs.drain(..), &work);
        results.into_iter().flatten().collect()
    }
}

/// Starts the first job, then all others, then waits.
fn start<'a, I: Send + 'a, O: Send + 'a>(
    jobs: &mut impl Iterator<Item = (&'a ThreadPool, I, &'a mut Option<O>)>,
    work: &(impl Fn(I) -> O + Sync),
) {
    let Some((pool, shard, result)) = jobs.next() else { return };
    pool.in_place_scope(|scope| {
        scope.spawn(|_| *result = Some(work(shard)));
        start(jobs, work);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_shards_with_and_without_threads() {
        for threads in [0, 1, 3] {
            let squares = Shards::new(threads).unwrap().map(vec![3, 1, 2], |n: i32| n * n);
            assert_eq!(squares, [9, 1, 4], "{threads} threads");
        }
    }
}
