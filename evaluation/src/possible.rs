//! Success over the episodes whose own start is shown to be possible: a policy cannot be blamed for a start from which
//! nobody arrives.
//!
//! An episode that arrived shows it itself. The start of one that did not is searched for actions that complete it;
//! what no search completes may be possible all the same, and is left out. Among other vehicles the search drives on
//! the empty road, so that what only vehicles make impossible counts as possible.

use offtrack::layout::{Ended, Truck};
use serde::Serialize;

use super::Evaluation;
use super::certificate::attempt::attempts;
use super::certificate::beam::Pass;
use super::certificate::verify::{Sequence, driven};
use super::certificate::{emptied, file};
use super::episode::{Episode, Summary};
use super::groups::{self, Group};
use crate::error::Error;

/// The episodes whose own start is shown to be possible.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Possible {
    /// Figures of the episodes with a possible start; `None` without such an episode.
    #[serde(flatten)]
    pub summary: Option<Summary>,
    /// Starts searched: those of the episodes that did not arrive, without those lost in their first step.
    pub searched: usize,
    /// Starts of these that a search completed.
    pub found: usize,
    /// Env steps of all searches.
    pub env_steps: u64,
    /// Searches made in turn from each start until one arrived.
    pub passes: Vec<Pass>,
    /// The episodes with a possible start by band of the island's radius, smallest first.
    pub island_radius: Vec<Group>,
    /// The episodes with a possible start by the lane of approach.
    pub lane: Vec<Group>,
    /// The episodes with a possible start by the demand of other vehicles, without which it was searched; empty where
    /// there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub demand: Vec<Group>,
}

impl Possible {
    /// How it was found out, in words.
    pub(super) fn note(&self) -> String {
        let passes: Vec<String> =
            self.passes.iter().map(|pass| format!("{} (held {})", pass.width, pass.hold)).collect();
        format!(
            "possible: the episodes that arrived and those whose own start a search completed{}, {} of the {} searched \
             with {} candidates, {} env steps.",
            if self.demand.is_empty() { "" } else { " on the empty road" },
            self.found,
            self.searched,
            passes.join(", then "),
            self.env_steps
        )
    }
}

/// Indices of the episodes whose start needs a search. From one that is lost in the first step no action helps.
pub fn to_search(finished: &[Episode]) -> impl Iterator<Item = usize> {
    (0..finished.len()).filter(|&index| finished[index].ended != Ended::Arrived && !finished[index].lost_at_start())
}

impl Evaluation<'_> {
    /// Searches the starts of the episodes that did not arrive; the episodes stand as [`Evaluation::drive`] gives them.
    /// Every sequence found is driven again. `done` is called after each search, from any thread. Given beside the
    /// figures is whether each episode's start is shown to be possible.
    pub fn possible(
        &self,
        finished: &[Episode],
        passes: &[Pass],
        done: &(dyn Fn() + Sync),
    ) -> Result<(Possible, Vec<bool>), Error> {
        let world = emptied(self.world);
        let searched: Vec<usize> = to_search(finished).collect();
        let starts: Vec<_> = searched.iter().map(|&index| self.start(index)).collect();
        let searches = attempts(&world, &starts, passes, &|_, _| done())?;
        let sequences = searches.iter().zip(&starts).map(|(found, &(route, start))| {
            let limit = world.most_steps(&Truck { route, vehicle: start.vehicle, ..Truck::default() });
            let actions = file::actions(&found.actions, world.params.n_actions, limit).unwrap_or_default();
            Sequence { route, start, actions }
        });
        let ended = driven(&world, &sequences.collect::<Vec<_>>())?;
        let mut is_possible: Vec<bool> = finished.iter().map(|episode| episode.ended == Ended::Arrived).collect();
        for (&index, &ended) in searched.iter().zip(&ended) {
            is_possible[index] = ended == Ended::Arrived;
        }
        let routes = self.routes();
        let chunks = finished.chunks(self.episodes).zip(is_possible.chunks(self.episodes));
        let kept = |(episode, &possible)| if possible { Some(episode) } else { None };
        let possible: Vec<Vec<&Episode>> =
            chunks.map(|(chunk, possible)| chunk.iter().zip(possible).filter_map(kept).collect()).collect();
        let step = self.scenario.step;
        let figures = Possible {
            summary: Summary::of(possible.iter().flatten().copied(), step),
            searched: searched.len(),
            found: ended.iter().filter(|&&ended| ended == Ended::Arrived).count(),
            env_steps: searches.iter().map(|found| found.env_steps).sum(),
            passes: passes.to_vec(),
            island_radius: groups::by(&routes, &possible, groups::island_radius, step),
            lane: groups::by(&routes, &possible, groups::lane, step),
            demand: groups::by_demand(&possible.concat(), step),
        };
        Ok((figures, is_possible))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use offtrack::scenario::{Scenario, Split};
    use offtrack::world::World;

    use super::super::Driven;
    use super::super::policies::{Controller, PurePursuit, UniformRandom};
    use super::*;
    use crate::device::Device;

    /// A route that a narrow search completes, with the largest start offset given (m), and what is found of `policy`.
    fn possible(start_offset: f64, policy: &mut dyn Controller, pass: Pass) -> (Vec<Episode>, Possible) {
        let mut scenario = Scenario::named("attard2023").unwrap();
        scenario.start_offset = start_offset;
        possible_in(scenario, policy, pass)
    }

    /// The same of a benchmark.
    fn possible_in(mut scenario: Scenario, policy: &mut dyn Controller, pass: Pass) -> (Vec<Episode>, Possible) {
        scenario.retain(|_, route| route.name == "20m/E-right-1");
        let world = Arc::new(World::bake(&scenario).unwrap());
        let device = Device::processor();
        let evaluation = Evaluation {
            scenario: &scenario,
            world: &world,
            split: Split::Test,
            episodes: 6,
            seed: 3,
            record: false,
            device: &device,
        };
        let Driven { episodes, .. } = evaluation.drive(policy, &mut |_, _| {}).unwrap();
        let (possible, _) = evaluation.possible(&episodes, &[pass], &|| {}).unwrap();
        (episodes, possible)
    }

    #[test]
    fn starts_where_a_bad_policy_failed_are_shown_to_be_possible() {
        let (episodes, possible) = possible(0.3, &mut UniformRandom { seed: 1 }, Pass { width: 32, hold: 3 });
        assert!(episodes.iter().all(|episode| episode.ended.failed()), "{episodes:?}");
        assert_eq!((possible.searched, possible.found), (6, 6));
        let summary = possible.summary.unwrap();
        assert_eq!((summary.episodes, summary.arrived), (6, 0));
        assert_eq!(
            possible.lane.iter().map(|group| (group.name.as_str(), group.summary.episodes)).collect::<Vec<_>>(),
            [("right", 6)]
        );
    }

    #[test]
    fn impossible_starts_are_not_counted_and_those_lost_in_the_first_step_are_not_searched() {
        let (episodes, possible) = possible(9.0, &mut PurePursuit::new(7.0), Pass { width: 1, hold: 1 });
        let lost = episodes.iter().filter(|episode| episode.lost_at_start()).count();
        let arrived = episodes.iter().filter(|episode| episode.ended == Ended::Arrived).count();
        assert!(0 < lost, "{episodes:?}");
        assert_eq!(possible.searched, 6 - arrived - lost);
        assert_eq!(possible.summary.map_or(0, |summary| summary.episodes), arrived + possible.found);
    }

    #[test]
    fn a_start_that_no_search_completes_is_left_out() {
        // A beam of one candidate that holds each action for a second runs into a kerb.
        let (_, possible) = possible(0.3, &mut UniformRandom { seed: 1 }, Pass { width: 1, hold: 10 });
        assert_eq!((possible.searched, possible.found, possible.summary), (6, 0, None));
        assert!(0 < possible.env_steps);
    }

    #[test]
    fn among_vehicles_starts_are_searched_on_the_empty_road_and_counted_by_demand() {
        let scenario = Scenario::named("traffic2026").unwrap();
        let (episodes, possible) = possible_in(scenario, &mut UniformRandom { seed: 1 }, Pass { width: 32, hold: 3 });
        assert!(episodes.iter().all(|episode| episode.ended.failed() && episode.among.is_some()), "{episodes:?}");
        assert_eq!((possible.searched, possible.found), (6, 6));
        assert!(1 < possible.demand.len(), "{:?}", possible.demand);
        assert_eq!(possible.demand.iter().map(|group| group.summary.episodes).sum::<usize>(), 6);
        assert!(possible.note().contains("on the empty road"), "{}", possible.note());
    }

    #[test]
    fn searches_give_the_same_whatever_the_number_of_threads() {
        let found = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| possible(0.3, &mut UniformRandom { seed: 1 }, Pass { width: 8, hold: 3 }).1)
        };
        assert_eq!(found(1), found(3));
    }
}
