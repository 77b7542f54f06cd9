//! Level replay: routes on which the policy fails are drawn more often.
//!
//! After M. Jiang and others, "Prioritized Level Replay" (2021). A route is a level. Its score is the fraction of its
//! latest episodes that failed. So a route that has not been driven for long is drawn again as one that failed then,
//! and one on which a policy always fails most often of all. Few of the random roads' routes cannot be completed.

use offtrack::layout::Ended;

use crate::checkpoint::{Columns, Stored};
use crate::config;
use crate::error::Error;
use crate::rollout::RouteEnd;

/// Steps of all trucks between two new lists of routes.
const INTERVAL: u64 = 100;
/// Failure rate of a route before its first episode.
const UNKNOWN: f32 = 0.5;
/// Least score of a route, so that there is one that can be drawn.
const LEAST_SCORE: f64 = 1e-4;

/// Names of its columns in a checkpoint.
const FAILURES: &str = "level replay, failures";
const LIST: &str = "level replay, routes";

/// Scores of the routes, and the list that episodes draw from.
#[derive(Debug)]
pub struct LevelReplay {
    settings: config::LevelReplay,
    /// Every route once.
    routes: Vec<u32>,
    /// Failure rate of each route.
    failures: Vec<f32>,
    /// Index of each of the world's routes in `routes`.
    indices: Vec<Option<usize>>,
    /// Every route once, then routes by their scores.
    list: Vec<u32>,
    n_steps: u64,
}

impl LevelReplay {
    /// Level replay with all of `routes` unknown.
    pub fn new(settings: config::LevelReplay, routes: Vec<u32>) -> LevelReplay {
        let mut indices = vec![None; routes.iter().max().map_or(0, |&most| most as usize + 1)];
        for (index, &route) in routes.iter().enumerate() {
            indices[route as usize] = Some(index);
        }
        let mut replay = LevelReplay {
            settings,
            failures: vec![UNKNOWN; routes.len()],
            routes,
            indices,
            list: Vec::new(),
            n_steps: 0,
        };
        replay.renew();
        replay
    }

    /// Routes to draw from uniformly: of always the same number.
    pub fn list(&self) -> &[u32] {
        &self.list
    }

    /// Counts an episode.
    pub fn count(&mut self, RouteEnd { route, ended }: RouteEnd) {
        let Some(index) = self.indices.get(route as usize).copied().flatten() else { return };
        let failed = if ended == Ended::Arrived { 0.0 } else { 1.0 };
        let failures = &mut self.failures[index];
        *failures += self.settings.rate as f32 * (failed - *failures);
    }

    /// Counts episodes on one route whose order is not known: as they count on average over all orders.
    #[cfg(feature = "gpu")]
    pub fn count_unordered(&mut self, route: u32, ends: &[RouteEnd]) {
        let Some(index) = self.indices.get(route as usize).copied().flatten().filter(|_| !ends.is_empty()) else {
            return;
        };
        let n_failed = ends.iter().filter(|end| end.ended != Ended::Arrived).count();
        let kept = (1.0 - self.settings.rate as f32).powi(ends.len() as i32);
        let failures = &mut self.failures[index];
        *failures = kept * *failures + (1.0 - kept) * n_failed as f32 / ends.len() as f32;
    }

    /// Counts a step of all trucks; true when it is time for a new list.
    pub fn stepped(&mut self) -> bool {
        self.n_steps += 1;
        self.n_steps.is_multiple_of(INTERVAL)
    }

    /// Makes the list anew. Its second part is systematic: a route stands in it as often as its score says, rounded up
    /// or down.
    pub fn renew(&mut self) {
        let fraction = self.settings.fraction;
        let n_replayed = (self.routes.len() as f64 * fraction / (1.0 - fraction)).round() as usize;
        let score = |failures: f32| LEAST_SCORE + f64::from(failures);
        let sum: f64 = self.failures.iter().map(|&failures| score(failures)).sum();
        self.list.clone_from(&self.routes);
        let mut reached = 0.0;
        for (&route, &failures) in self.routes.iter().zip(&self.failures) {
            reached += score(failures) / sum * n_replayed as f64;
            while ((self.list.len() - self.routes.len()) as f64) + 0.5 < reached
                && self.list.len() - self.routes.len() < n_replayed
            {
                self.list.push(route);
            }
        }
        // Rounding may leave the last place empty.
        while let Some(&last) = self.routes.last()
            && self.list.len() - self.routes.len() < n_replayed
        {
            self.list.push(last);
        }
    }

    /// Adds its columns to a checkpoint.
    pub fn save<'a>(&'a self, columns: &mut Columns<'a>) {
        columns.put(FAILURES, &self.failures[..]);
        columns.put(LIST, &self.list[..]);
        columns.put("level replay, steps", vec![self.n_steps]);
    }

    /// Continues from what [`LevelReplay::save`] added.
    pub fn restore(&mut self, stored: &Stored) -> Result<(), Error> {
        let failures: Vec<f32> = stored.exactly(FAILURES, self.failures.len())?;
        if let Some(wrong) = failures.iter().find(|failures| !(0.0..=1.0).contains(*failures)) {
            return Err(
                stored.error(format!("its column `{FAILURES}` has {wrong}: must lie in 0..1; put a sound copy back"))
            );
        }
        let list: Vec<u32> = stored.exactly(LIST, self.list.len())?;
        if let Some(wrong) = list.iter().find(|&&route| self.indices.get(route as usize).copied().flatten().is_none()) {
            return Err(stored
                .error(format!("its column `{LIST}` has {wrong}, which is no training route: put a sound copy back")));
        }
        [self.n_steps] = stored.array("level replay, steps")?;
        (self.failures, self.list) = (failures, list);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn replay(fraction: f64) -> LevelReplay {
        LevelReplay::new(config::LevelReplay { fraction, rate: 0.25 }, vec![2, 3, 5, 7])
    }

    fn times(replay: &LevelReplay, route: u32) -> usize {
        replay.list().iter().filter(|&&listed| listed == route).count()
    }

    #[test]
    fn routes_that_fail_are_listed_more_often_and_no_route_is_left_out() {
        let mut replay = replay(0.75);
        assert_eq!([2, 3, 5, 7].map(|route| times(&replay, route)), [4, 4, 4, 4]);
        for episode in 0..40 {
            for (route, arrives) in [(2, true), (3, false), (5, episode % 2 == 0), (7, true)] {
                replay.count(RouteEnd { route, ended: if arrives { Ended::Arrived } else { Ended::TrailerCollided } });
            }
        }
        let renewed: Vec<bool> = (0..INTERVAL).map(|_| replay.stepped()).collect();
        assert_eq!(renewed.iter().position(|&new| new), Some(INTERVAL as usize - 1));
        replay.renew();
        // Of the 12 further places one that always fails has about twice as many as one that fails half of the time.
        assert_eq!([2, 3, 5, 7].map(|route| times(&replay, route)), [1, 9, 5, 1]);
    }

    #[test]
    fn the_list_keeps_its_length_whatever_the_scores() {
        let mut replay = replay(0.3);
        let length = replay.list().len();
        assert_eq!(length, 6);
        for (n, route) in [2, 3, 5, 7, 11].into_iter().cycle().take(997).enumerate() {
            replay.count(RouteEnd { route, ended: if n % 3 == 0 { Ended::Arrived } else { Ended::Strayed } });
            replay.renew();
            assert_eq!(replay.list().len(), length);
        }
    }
    #[cfg(feature = "gpu")]
    #[test]
    fn episodes_of_unknown_order_count_as_they_do_on_average_over_all_orders() {
        let end = |ended: Ended| RouteEnd { route: 5, ended };
        let (arrived, failed) = (end(Ended::Arrived), end(Ended::Strayed));
        let orders = [[failed, arrived, arrived], [arrived, failed, arrived], [arrived, arrived, failed]];
        let counted = orders.map(|order| {
            let mut replay = replay(0.5);
            order.into_iter().for_each(|end| replay.count(end));
            replay.failures[2]
        });
        let mut unordered = replay(0.5);
        unordered.count_unordered(5, &orders[0]);
        unordered.count_unordered(3, &[]);
        // A route that is not trained on.
        unordered.count_unordered(4, &[failed]);
        assert!((unordered.failures[2] - counted.iter().sum::<f32>() / 3.0).abs() < 1e-6, "{counted:?}");
        assert_eq!(unordered.failures[1], UNKNOWN);
    }
}
