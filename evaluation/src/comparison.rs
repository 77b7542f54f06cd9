//! Evaluations compared: episodes of different policies from the same starts, in pairs.
//!
//! A [`Side`] is the evaluation of a policy, or those of several training seeds of one. Figures other than success are
//! those of episodes that arrived; in a difference, of those that arrived in every file of both sides. Intervals are
//! [over routes](crate::interval), and over seeds where a side has several.

mod side;
mod tables;

use offtrack::layout::Ended;
use offtrack::scenario::Split;
use serde::Serialize;

use crate::episode::wilson;
use crate::interval::Cells;
use crate::outcomes::{Outcomes, RouteOutcomes};
pub use side::{Asked, Evaluated, Side};

/// A figure of an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Figure {
    Success,
    LaneDistance,
    Time,
    Clearance,
    LoadTransferRatio,
}

/// A mean with its 95 % interval, which a mean over one route does not have.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Lower end of the interval.
    pub low: Option<f64>,
    /// Upper end of the interval.
    pub high: Option<f64>,
}

impl Estimate {
    fn new(mean: f64, interval: Option<(f64, f64)>) -> Estimate {
        Estimate { mean, low: interval.map(|(low, _)| low), high: interval.map(|(_, high)| high) }
    }

    /// The ends of the interval of a fraction as text. One without width, where all routes end alike, says nothing:
    /// then those of Wilson's.
    pub(crate) fn ends_or_wilson(&self, arrived: usize, episodes: usize, shown: impl Fn(f64) -> String) -> String {
        match self.low.zip(self.high) {
            Some((low, high)) if low < high => format!("{} to {}", shown(low), shown(high)),
            _ => {
                let (low, high) = wilson(arrived, episodes);
                format!("{} to {} (Wilson)", shown(low), shown(high))
            }
        }
    }

    /// Of the mean of these episodes; `None` without one.
    pub(crate) fn of(cells: &Cells) -> Option<Estimate> {
        Some(Estimate::new(cells.mean()?, cells.interval()))
    }
}

/// An estimate of each figure; `None` without an episode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figures {
    /// Fraction of all episodes that arrived.
    pub success: Option<Estimate>,
    /// Mean distance to the lane centre (m).
    pub lane_distance: Option<Estimate>,
    /// Time of an episode (s).
    pub time: Option<Estimate>,
    /// Smallest distance of either unit to a kerb in an episode (m).
    pub clearance: Option<Estimate>,
    /// Largest load transfer ratio of an episode.
    pub load_transfer_ratio: Option<Estimate>,
}

impl Figures {
    fn each(mut estimate: impl FnMut(Figure) -> Option<Estimate>) -> Figures {
        Figures {
            success: estimate(Figure::Success),
            lane_distance: estimate(Figure::LaneDistance),
            time: estimate(Figure::Time),
            clearance: estimate(Figure::Clearance),
            load_transfer_ratio: estimate(Figure::LoadTransferRatio),
        }
    }

    fn get(&self, figure: Figure) -> Option<Estimate> {
        match figure {
            Figure::Success => self.success,
            Figure::LaneDistance => self.lane_distance,
            Figure::Time => self.time,
            Figure::Clearance => self.clearance,
            Figure::LoadTransferRatio => self.load_transfer_ratio,
        }
    }
}

/// The figures of one side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SideFigures {
    /// The side's name.
    pub name: String,
    /// Its files, one for each training seed.
    pub files: Vec<String>,
    /// The policy of each file.
    pub policies: Vec<String>,
    /// Episodes of all files.
    pub episodes: usize,
    /// Those that arrived.
    pub arrived: usize,
    /// Lower end of Wilson's 95 % interval of success, over episodes.
    pub success_low: f64,
    /// Upper end of it.
    pub success_high: f64,
    /// Lowest success of a file.
    pub worst: f64,
    /// Success of all episodes, and the other figures of those that arrived.
    pub figures: Figures,
}

/// A side less the first one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// The side's name.
    pub name: String,
    /// The first side's name.
    pub to: String,
    /// Episodes that arrived in every file of both sides: those of the figures other than success.
    pub common: usize,
    /// The first side's figures, of these episodes.
    pub first: Figures,
    /// This side's.
    pub own: Figures,
    /// This side's less the first side's, each episode paired with that from the same start.
    pub difference: Figures,
    /// Success by groups: of routes one by one, by roundabout, exit, radius of the island, lane, vehicle and load.
    pub groups: Vec<GroupDifference>,
    /// Episodes that arrive in more files of one side: those of this side first, each by route and number.
    pub episodes: Vec<Differing>,
}

/// Success in a group of episodes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupDifference {
    /// `route`, `roundabout`, `exit`, `island_radius`, `lane` or `class`.
    pub kind: &'static str,
    /// Name of the group.
    pub name: String,
    /// Its routes.
    pub routes: usize,
    /// Its starts, of each of which every file has an episode.
    pub starts: usize,
    /// Success of the first side.
    pub first: f64,
    /// Success of this side.
    pub own: f64,
    /// This side's less the first side's.
    pub difference: Estimate,
}

/// An episode that arrives in more files of one side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Differing {
    /// Name of the route.
    pub route: String,
    /// Index of the route in the evaluation.
    #[serde(skip)]
    pub route_index: usize,
    /// Number of the episode on the route.
    pub episode: usize,
    /// Fraction of the first side's files in which it arrives.
    pub first: f64,
    /// Fraction of this side's.
    pub own: f64,
    /// How it ends in the first file of the first side.
    pub first_ended: &'static str,
    /// How it ends in the first file of this side.
    pub own_ended: &'static str,
}

impl Differing {
    /// Whether it arrives in the first file of one side alone.
    pub fn is_pair(&self) -> bool {
        let arrived = Ended::Arrived.name();
        (self.first_ended == arrived) != (self.own_ended == arrived)
    }
}

/// Several sides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The benchmark's name.
    pub benchmark: String,
    /// The routes that are driven.
    pub split: Split,
    /// Seed of the starts.
    pub seed: u32,
    /// Number of routes.
    pub routes: usize,
    /// Episodes on each.
    pub episodes: usize,
    /// Each side, the first of which is that which the others are compared with.
    pub sides: Vec<SideFigures>,
    /// Each other side less the first one.
    pub differences: Vec<Difference>,
}

impl Comparison {
    /// Compares sides of one benchmark, as [`Side::read_all`] gives them: two or more.
    pub fn of(sides: &[Side]) -> Comparison {
        let (first, others) = sides.split_first().expect("there are two sides: that was checked");
        let (evaluated, outcomes) = (&first.files[0].1, first.outcomes(0));
        Comparison {
            benchmark: evaluated.benchmark.clone(),
            split: evaluated.split,
            seed: evaluated.seed,
            routes: outcomes.routes.len(),
            episodes: outcomes.episodes,
            sides: sides.iter().map(alone).collect(),
            differences: others.iter().map(|other| difference(first, other)).collect(),
        }
    }
}

/// The figures of one side.
fn alone(side: &Side) -> SideFigures {
    let all: Vec<usize> = (0..side.outcomes(0).routes.len()).collect();
    let figures = Figures::each(|figure| {
        let cells = side.cells(figure, &all, |file, start| figure == Figure::Success || side.arrived[file][start]);
        Estimate::of(&cells)
    });
    let arrived = |file: &Vec<bool>| file.iter().filter(|&&arrived| arrived).count();
    let (episodes, n_arrived) = (side.arrived.iter().map(Vec::len).sum(), side.arrived.iter().map(arrived).sum());
    let (success_low, success_high) = wilson(n_arrived, episodes);
    SideFigures {
        name: side.name.clone(),
        files: side.files.iter().map(|(path, _)| path.display().to_string()).collect(),
        policies: side.files.iter().map(|(_, evaluated)| evaluated.policy.clone()).collect(),
        episodes,
        arrived: n_arrived,
        success_low,
        success_high,
        worst: side.arrived.iter().map(|file| arrived(file) as f64 / file.len() as f64).fold(1.0, f64::min),
        figures,
    }
}

fn difference(first: &Side, own: &Side) -> Difference {
    let outcomes = first.outcomes(0);
    let all: Vec<usize> = (0..outcomes.routes.len()).collect();
    let n_starts = all.len() * outcomes.episodes;
    let everywhere = |start: usize| first.arrived.iter().chain(&own.arrived).all(|file| file[start]);
    let common: Vec<bool> = (0..n_starts).map(everywhere).collect();
    let cells = |side: &Side, figure| side.cells(figure, &all, |_, start| figure == Figure::Success || common[start]);
    let alone = |side: &Side| Figures::each(|figure| Estimate::of(&cells(side, figure)));
    let difference = Figures::each(|figure| subtracted(&cells(own, figure), &cells(first, figure)));
    let fraction = |side: &Side, start: usize| {
        side.arrived.iter().filter(|file| file[start]).count() as f64 / side.arrived.len() as f64
    };
    let differing = |start: usize| {
        let (of_first, of_own) = (fraction(first, start), fraction(own, start));
        let (route, episode) = (start / outcomes.episodes, start % outcomes.episodes);
        let ended = |side: &Side| side.outcomes(0).routes[route].end(episode).name();
        (of_first != of_own).then(|| Differing {
            route: outcomes.routes[route].name.clone(),
            route_index: route,
            episode,
            first: of_first,
            own: of_own,
            first_ended: ended(first),
            own_ended: ended(own),
        })
    };
    let mut episodes: Vec<Differing> = (0..n_starts).filter_map(differing).collect();
    episodes.sort_by(|a, b| (b.own - b.first).total_cmp(&(a.own - a.first)));
    Difference {
        name: own.name.clone(),
        to: first.name.clone(),
        common: common.iter().filter(|&&common| common).count(),
        first: alone(first),
        own: alone(own),
        difference,
        groups: groups(outcomes).iter().filter_map(|group| group.difference(first, own)).collect(),
        episodes,
    }
}

fn subtracted(own: &Cells, first: &Cells) -> Option<Estimate> {
    Some(Estimate::new(own.mean()? - first.mean()?, own.interval_of_difference(first)))
}

/// Episodes that have something in common.
struct Group {
    kind: &'static str,
    name: String,
    routes: Vec<usize>,
    /// Vehicle and load, where they are what is common.
    class: Option<usize>,
}

impl Group {
    fn difference(&self, first: &Side, own: &Side) -> Option<GroupDifference> {
        let outcomes = first.outcomes(0);
        let is_in = |start: usize| {
            let route = &outcomes.routes[start / outcomes.episodes];
            self.class.is_none_or(|class| route.class[start % outcomes.episodes] == class)
        };
        let [of_first, of_own] =
            [first, own].map(|side| side.cells(Figure::Success, &self.routes, |_, start| is_in(start)));
        Some(GroupDifference {
            kind: self.kind,
            name: self.name.clone(),
            routes: of_first.n_routes(),
            starts: of_first.episodes() / first.files.len(),
            first: of_first.mean()?,
            own: of_own.mean()?,
            difference: subtracted(&of_own, &of_first)?,
        })
    }
}

/// All groups, in the order of their first routes.
fn groups(outcomes: &Outcomes) -> Vec<Group> {
    type Key = fn(&RouteOutcomes) -> &String;
    const KINDS: [(&str, Key); 5] = [
        ("route", |route| &route.name),
        ("roundabout", |route| &route.roundabout),
        ("exit", |route| &route.exit),
        ("island_radius", |route| &route.island_radius),
        ("lane", |route| &route.lane),
    ];
    let mut groups: Vec<Group> = Vec::new();
    for (kind, key) in KINDS {
        let mut indices = std::collections::HashMap::new();
        for (index, route) in outcomes.routes.iter().enumerate() {
            let group = *indices.entry(key(route)).or_insert_with(|| {
                groups.push(Group { kind, name: key(route).clone(), routes: Vec::new(), class: None });
                groups.len() - 1
            });
            groups[group].routes.push(index);
        }
    }
    // Exits by their number; what has none keeps its order.
    groups
        .sort_by_key(|group| (KINDS.iter().position(|(kind, _)| *kind == group.kind), group.name.parse::<u32>().ok()));
    let of_class = |(class, name): (usize, &crate::recording::Class)| Group {
        kind: "class",
        name: name.to_string(),
        routes: (0..outcomes.routes.len()).collect(),
        class: Some(class),
    };
    groups.extend(outcomes.classes.iter().enumerate().map(of_class));
    groups
}

#[cfg(test)]
mod tests;
