//! Sums of an evaluation over routes that have something in common.

use std::collections::{BTreeMap, HashSet};

use offtrack::map::route::Route;
use offtrack::scenario::Place;
use serde::Serialize;

use super::episode::{Episode, Summary};

/// Island radii from which on a route is in the next band (m).
const BANDS: [f64; 4] = [9.0, 12.0, 16.0, 22.0];
/// Names of the bands of [`BANDS`], and behind them that of the routes of a crossing, which has no island.
const BAND_NAMES: [&str; BANDS.len() + 2] =
    ["below 9 m", "9 to 12 m", "12 to 16 m", "16 to 22 m", "22 m and more", "none"];

/// A route that is evaluated: the index of its place in the benchmark, the place, the route.
pub type Evaluated<'a> = (usize, &'a Place, &'a Route);

/// Episodes on some of the routes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// What the routes have in common: `16m`, `left`, `2`, `9 to 12 m`.
    pub name: String,
    /// Number of the routes.
    pub routes: usize,
    /// Figures of the episodes on the routes.
    #[serde(flatten)]
    pub summary: Summary,
}

/// Every episode once in each partition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Groups {
    /// Episodes by band of the island's radius, smallest first; `none` for the routes of crossings.
    pub island_radius: Vec<Group>,
    /// Episodes by the lane of approach.
    pub lane: Vec<Group>,
    /// Episodes by number of the exit; as many as the roundabout has arms is a U-turn.
    pub exit: Vec<Group>,
    /// Episodes by roundabout, in the benchmark's order.
    pub roundabout: Vec<Group>,
    /// Episodes by the demand of other vehicles that they drew, in rising order; empty where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub demand: Vec<Group>,
}

impl Groups {
    /// The groups of `routes`; `finished` has as many episodes for each of them, in the same order. A step takes `step`
    /// seconds.
    pub fn of(routes: &[Evaluated], finished: &[Episode], step: f64) -> Groups {
        let per_route = (finished.len() / routes.len().max(1)).max(1);
        let episodes: Vec<Vec<&Episode>> = finished.chunks(per_route).map(|chunk| chunk.iter().collect()).collect();
        let by = |key| by(routes, &episodes, key, step);
        Groups {
            island_radius: by(island_radius),
            lane: by(lane),
            exit: by(exit),
            roundabout: by(roundabout),
            demand: by_demand(&finished.iter().collect::<Vec<_>>(), step),
        }
    }
}

/// What a route has in common with others: its group's position among the groups, and the group's name.
type Key = fn(&Evaluated) -> (usize, String);

/// The groups of `routes` by `key`, with the given episodes of each route. A group without an episode is left out.
pub(super) fn by(routes: &[Evaluated], episodes: &[Vec<&Episode>], key: Key, step: f64) -> Vec<Group> {
    let mut members: BTreeMap<(usize, String), Vec<usize>> = BTreeMap::new();
    for (index, route) in routes.iter().enumerate().take(episodes.len()) {
        members.entry(key(route)).or_default().push(index);
    }
    let group = |((_, name), members): ((usize, String), Vec<usize>)| {
        let summary = Summary::of(members.iter().flat_map(|&index| &episodes[index]).copied(), step)?;
        Some(Group { name, routes: members.len(), summary })
    };
    members.into_iter().filter_map(group).collect()
}

/// The groups of episodes by demand.
pub(super) fn by_demand(finished: &[&Episode], step: f64) -> Vec<Group> {
    let mut demands: Vec<f64> = finished.iter().filter_map(|episode| demand_of(episode)).collect();
    demands.sort_by(f64::total_cmp);
    demands.dedup();
    let group = |demand: f64| {
        let episodes = || finished.iter().copied().filter(move |episode| demand_of(episode) == Some(demand));
        let routes: HashSet<u32> = episodes().map(|episode| episode.last.route).collect();
        Some(Group { name: format!("{demand} veh/h"), routes: routes.len(), summary: Summary::of(episodes(), step)? })
    };
    demands.into_iter().filter_map(group).collect()
}

fn demand_of(episode: &Episode) -> Option<f64> {
    episode.among.map(|among| among.demand)
}

pub(super) fn island_radius((_, place, _): &Evaluated) -> (usize, String) {
    let band = if place.roundabout.has_ring() { band(place.roundabout.island_radius()) } else { BAND_NAMES.len() - 1 };
    (band, BAND_NAMES[band].to_owned())
}

pub(super) fn lane((_, place, route): &Evaluated) -> (usize, String) {
    (0, route.lane.seen(place.roundabout.is_mirrored()).name().to_owned())
}

pub(super) fn exit((_, _, route): &Evaluated) -> (usize, String) {
    (route.exit as usize, route.exit.to_string())
}

pub(super) fn roundabout(&(index, place, _): &Evaluated) -> (usize, String) {
    (index, place.roundabout.name.clone())
}

/// Index of an island's band by its radius (m).
fn band(island_radius: f64) -> usize {
    BANDS.iter().filter(|&&from| from <= island_radius).count()
}

#[cfg(test)]
mod tests {
    use offtrack::layout::Ended;
    use offtrack::scenario::{Scenario, Split};

    use super::super::among::Among;
    use super::super::episode::tests::episode;
    use super::*;

    #[test]
    fn every_episode_is_in_one_group_of_each_kind() {
        let scenario = Scenario::named("attard2023-full").unwrap();
        let all: Vec<_> = scenario.routes().map(|(index, route)| (index, &scenario.places[index], route)).collect();
        let routes: Vec<_> = scenario.split(Split::Test).iter().map(|&route| all[route as usize]).collect();
        // Two episodes a route; the second fails on right lanes.
        let ends = |right| [Ended::Arrived, if right { Ended::TrailerCollided } else { Ended::Arrived }];
        let finished: Vec<Episode> =
            routes.iter().flat_map(|(_, _, route)| ends(route.lane.name() == "right")).map(episode).collect();
        let groups = Groups::of(&routes, &finished, scenario.step);
        for kind in [&groups.island_radius, &groups.lane, &groups.exit, &groups.roundabout] {
            assert_eq!(kind.iter().map(|group| group.routes).sum::<usize>(), routes.len());
            assert_eq!(kind.iter().map(|group| group.summary.episodes).sum::<usize>(), finished.len());
            assert!(kind.iter().all(|group| group.summary.episodes == 2 * group.routes));
        }
        let names = |kind: &[Group]| kind.iter().map(|group| group.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&groups.lane), ["left", "right"]);
        assert_eq!(names(&groups.roundabout), ["20m", "40m"]);
        assert_eq!(names(&groups.exit), ["1", "2", "3", "4"]);
        let [left, right] = [0, 1].map(|lane: usize| &groups.lane[lane].summary);
        assert_eq!((left.success, right.success, right.ends["trailer_collided"]), (1.0, 0.5, right.episodes / 2));
    }

    #[test]
    fn episodes_among_vehicles_are_grouped_by_demand_from_the_least_on() {
        let scenario = Scenario::named("attard2023").unwrap();
        let routes: Vec<_> = scenario.routes().map(|(index, route)| (index, &scenario.places[index], route)).collect();
        let at = |demand: f64, ended: Ended| Episode { among: Some(Among::new(demand)), ..episode(ended) };
        let finished = [
            at(900.0, Ended::TimedOut),
            at(300.0, Ended::Arrived),
            at(900.0, Ended::Arrived),
            at(300.0, Ended::Arrived),
        ];
        let groups = Groups::of(&routes[..2], &finished, scenario.step);
        let found: Vec<_> = groups
            .demand
            .iter()
            .map(|group| (group.name.as_str(), group.summary.episodes, group.summary.success))
            .collect();
        assert_eq!(found, [("300 veh/h", 2, 1.0), ("900 veh/h", 2, 0.5)]);
        assert!(Groups::of(&routes[..2], &[Ended::Arrived; 2].map(episode), scenario.step).demand.is_empty());
    }

    #[test]
    fn a_band_begins_at_its_lower_radius() {
        let names = [7.3, 8.99, 9.0, 11.9, 12.0, 16.0, 21.9, 22.0, 40.0].map(|radius| BAND_NAMES[band(radius)]);
        let expected = [0, 0, 1, 1, 2, 3, 3, 4, 4].map(|index: usize| BAND_NAMES[index]);
        assert_eq!(names, expected);
    }
}
