//! The latest episodes: what success and mean reward in the metrics are about, on every backend.

use std::collections::VecDeque;

use crate::checkpoint::{Columns, Stored};
use crate::error::Error;
use crate::rollout::Episodes;

/// Episodes that success and mean reward are means over, as many as in the study: the latest, or where a device counts
/// them in groups, the fewest latest groups that hold so many.
pub const WINDOW: u64 = 250;

/// The latest episodes, in groups: one each on the host, those of a row of metrics on a device.
#[derive(Debug, Default)]
pub struct Window {
    groups: VecDeque<Episodes>,
}

impl Window {
    /// Adds the latest group, and drops the oldest ones that are not needed any more.
    pub fn push(&mut self, episodes: Episodes) {
        self.groups.push_back(episodes);
        while self.groups.front().is_some_and(|oldest| WINDOW + oldest.count <= self.count()) {
            self.groups.pop_front();
        }
    }

    /// Episodes in it.
    pub fn count(&self) -> u64 {
        self.groups.iter().map(|group| group.count).sum()
    }

    /// Fraction of them that arrived; none before the first ended.
    pub fn success(&self) -> Option<f64> {
        let arrived: u64 = self.groups.iter().map(|group| group.arrived).sum();
        (0 < self.count()).then(|| arrived as f64 / self.count() as f64)
    }

    /// Mean sum of rewards; none before the first ended.
    pub fn reward(&self) -> Option<f64> {
        let reward: f64 = self.groups.iter().map(|group| group.reward).sum();
        (0 < self.count()).then(|| reward / self.count() as f64)
    }

    /// Adds its columns to a checkpoint.
    pub fn save(&self, columns: &mut Columns) {
        columns.put("window, episodes", self.groups.iter().map(|group| group.count).collect::<Vec<_>>());
        columns.put("window, arrived", self.groups.iter().map(|group| group.arrived).collect::<Vec<_>>());
        columns.put("window, rewards", self.groups.iter().map(|group| group.reward).collect::<Vec<_>>());
    }

    /// The window of a checkpoint.
    pub fn restored(stored: &Stored) -> Result<Window, Error> {
        let counts: Vec<u64> = stored.column("window, episodes")?;
        let arrived: Vec<u64> = stored.exactly("window, arrived", counts.len())?;
        let rewards: Vec<f64> = stored.exactly("window, rewards", counts.len())?;
        let groups = counts.into_iter().zip(arrived).zip(rewards);
        let groups: VecDeque<Episodes> =
            groups.map(|((count, arrived), reward)| Episodes { count, arrived, reward }).collect();
        match groups.iter().find(|group| group.count < group.arrived || 1 << 40 < group.count) {
            Some(group) => {
                Err(stored.error(format!("its window has {} arrivals of {} episodes", group.arrived, group.count)))
            }
            None => Ok(Window { groups }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_window_holds_the_latest_episodes_and_no_group_more_than_it_needs() {
        let mut window = Window::default();
        assert_eq!((window.success(), window.reward(), window.count()), (None, None, 0));
        for n in 0..400u64 {
            window.push(Episodes { count: 1, arrived: u64::from(n < 200), reward: n as f64 });
        }
        // Episodes 150 to 399.
        assert_eq!((window.count(), window.success()), (250, Some(50.0 / 250.0)));
        assert_eq!(window.reward(), Some((150..400).sum::<u64>() as f64 / 250.0));
        window.push(Episodes { count: 100, arrived: 100, reward: 0.0 });
        assert_eq!(window.count(), 250);
        window.push(Episodes { count: 200, arrived: 0, reward: 0.0 });
        // 100 and 200: without the 100 there would be too few.
        assert_eq!((window.count(), window.success()), (300, Some(1.0 / 3.0)));
        window.push(Episodes { count: 1000, arrived: 500, reward: -1000.0 });
        assert_eq!((window.count(), window.success(), window.reward()), (1000, Some(0.5), Some(-1.0)));
    }
}
