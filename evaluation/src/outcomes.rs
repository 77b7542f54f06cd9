//! How each episode of an evaluation ended, in some 30 bytes: what `evaluate --json` keeps, so that evaluations are
//! compared episode by episode and repeated to the last bit.

use offtrack::layout::Ended;
use serde::{Deserialize, Serialize};

use crate::Evaluation;
use crate::episode::Episode;
use crate::groups;
use crate::recording::Class;

/// Version of the format.
pub const VERSION: u32 = 1;

/// A letter for each end, in the order of [`Ended::ALL`]: trailer and timed out have their third and fifth.
const LETTERS: [char; Ended::ALL.len()] = ['-', '.', 't', 'a', 'r', 'j', 's', 'd', 'm', 'w'];

/// The outcomes of an evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outcomes {
    /// Version of the format.
    pub version: u32,
    /// [`offtrack::world::World::fingerprint`] of what was driven.
    pub world: String,
    /// CRC-32 of the last state and of the figures of every episode: equal where they are equal to the last bit.
    pub digest: String,
    /// Episodes on each route. Start poses follow from the seed, this number and the order of the routes.
    pub episodes: usize,
    /// Time of a step (s).
    pub step: f64,
    /// The letter of each end, and its name.
    pub ends: Vec<(char, String)>,
    /// Vehicles and loads; empty where the benchmark has one vehicle.
    pub classes: Vec<Class>,
    /// Each route, in the order of the evaluation.
    pub routes: Vec<RouteOutcomes>,
}

/// The outcomes of a route's episodes, by their number. Its groups are named as in the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RouteOutcomes {
    /// `20m/N-left-3` and the like.
    pub name: String,
    /// Name of its roundabout.
    pub roundabout: String,
    /// Band of the island's radius.
    pub island_radius: String,
    /// The lane of approach.
    pub lane: String,
    /// Number of the exit.
    pub exit: String,
    /// The letter of each episode's end.
    pub ended: String,
    /// Steps.
    pub steps: Vec<u32>,
    /// Mean distance to the lane centre (m).
    pub lane_distance: Vec<f64>,
    /// Smallest distance of either unit to a kerb (m).
    pub clearance: Vec<f64>,
    /// Largest load transfer ratio of either unit.
    pub load_transfer_ratio: Vec<f64>,
    /// Sum of the rewards.
    pub reward: Vec<f64>,
    /// Index of vehicle and load among the classes; empty where the benchmark has one vehicle.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub class: Vec<usize>,
}

impl Outcomes {
    /// Episodes that arrived.
    pub fn arrived(&self) -> usize {
        self.routes.iter().flat_map(RouteOutcomes::each_end).filter(|&ended| ended == Ended::Arrived).count()
    }

    /// As JSON: a line for each route.
    pub fn json(&self) -> serde_json::Result<String> {
        let head = serde_json::to_string(&Outcomes { routes: Vec::new(), ..self.clone() })?;
        crate::files::json_lines(&head, &self.routes)
    }

    /// What is wrong with outcomes that were read: key, value and what would do.
    pub fn fault(&self) -> Option<String> {
        if self.version != VERSION {
            return Some(format!("version: {}; this program reads {VERSION}", self.version));
        }
        if self.ends != ends() {
            return Some("ends: are other letters than this program writes; evaluate again".to_owned());
        }
        if self.episodes == 0 || self.routes.is_empty() {
            return Some("routes: have no episode; evaluate again".to_owned());
        }
        self.routes.iter().find_map(|route| {
            let n = self.episodes;
            let n_classes = if self.classes.is_empty() { 0 } else { n };
            let lengths = [
                ("ended", route.ended.chars().count(), n),
                ("steps", route.steps.len(), n),
                ("lane_distance", route.lane_distance.len(), n),
                ("clearance", route.clearance.len(), n),
                ("load_transfer_ratio", route.load_transfer_ratio.len(), n),
                ("reward", route.reward.len(), n),
                ("class", route.class.len(), n_classes),
            ];
            let wrong = lengths.into_iter().find(|(_, found, expected)| found != expected);
            let wrong = wrong.map(|(key, found, expected)| format!("{key}: {found} values; {expected} are needed"));
            let letter = || {
                let unknown = route.ended.chars().find(|letter| !LETTERS.contains(letter))?;
                Some(format!("ended: {unknown:?}; a letter of `ends` is needed"))
            };
            let class = || {
                let beyond = route.class.iter().find(|&&class| self.classes.len() <= class)?;
                Some(format!("class: {beyond}; must be below the number of classes, {}", self.classes.len()))
            };
            Some(format!("routes, {}: {}", route.name, wrong.or_else(letter).or_else(class)?))
        })
    }
}

impl RouteOutcomes {
    /// How an episode ended.
    pub fn end(&self, episode: usize) -> Ended {
        self.ended.chars().nth(episode).and_then(end_of).unwrap_or(Ended::Running)
    }

    /// How each episode ended.
    pub fn each_end(&self) -> impl Iterator<Item = Ended> {
        self.ended.chars().map(|letter| end_of(letter).unwrap_or(Ended::Running))
    }
}

/// The end that a letter stands for.
pub fn end_of(letter: char) -> Option<Ended> {
    LETTERS.iter().position(|&known| known == letter).map(|index| Ended::ALL[index])
}

fn ends() -> Vec<(char, String)> {
    LETTERS.into_iter().zip(Ended::ALL.map(|ended| ended.name().to_owned())).collect()
}

impl Evaluation<'_> {
    /// The outcomes of episodes that stand as [`Evaluation::drive`] gives them.
    pub fn outcomes(&self, finished: &[Episode]) -> Outcomes {
        let mut classes: Vec<Class> = Vec::new();
        let mut class = |episode: &Episode| {
            let class = Class::of(self.world, episode.last.vehicle)?;
            Some(classes.iter().position(|known| *known == class).unwrap_or_else(|| {
                classes.push(class);
                classes.len() - 1
            }))
        };
        let routes = self.routes();
        let route = |(route, episodes): (&groups::Evaluated, &[Episode])| {
            let each = |value: fn(&Episode) -> f64, parts: f64| {
                episodes.iter().map(|episode| (value(episode) * parts).round() / parts + 0.0).collect()
            };
            RouteOutcomes {
                name: route.2.name.clone(),
                roundabout: groups::roundabout(route).1,
                island_radius: groups::island_radius(route).1,
                lane: groups::lane(route).1,
                exit: groups::exit(route).1,
                ended: episodes.iter().map(|episode| LETTERS[episode.ended as usize]).collect(),
                steps: episodes.iter().map(|episode| episode.steps).collect(),
                lane_distance: each(|episode| episode.lane_distance_mean, 1e3),
                clearance: each(|episode| episode.tractor_clearance_min.min(episode.trailer_clearance_min), 1e3),
                load_transfer_ratio: each(|episode| episode.load_transfer_ratio_peak, 1e3),
                reward: each(|episode| episode.reward, 1e2),
                class: episodes.iter().filter_map(&mut class).collect(),
            }
        };
        let routes = routes.iter().zip(finished.chunks(self.episodes)).map(route).collect();
        Outcomes {
            version: VERSION,
            world: format!("{:08x}", self.world.fingerprint()),
            digest: digest(finished),
            episodes: self.episodes,
            step: self.scenario.step,
            ends: ends(),
            classes,
            routes,
        }
    }
}

/// CRC-32 of the ends, the steps, the last states and the sums of all episodes.
fn digest(finished: &[Episode]) -> String {
    let mut hasher = crc32fast::Hasher::new();
    for Episode { ended, steps, reward, lane_distance_mean, last, .. } in finished {
        for word in [*ended as u32, *steps] {
            hasher.update(&word.to_le_bytes());
        }
        for value in [last.position.x, last.position.y, last.heading, last.trailer_heading, last.speed] {
            hasher.update(&value.to_le_bytes());
        }
        for value in [reward, lane_distance_mean] {
            hasher.update(&value.to_le_bytes());
        }
    }
    format!("{:08x}", hasher.finalize())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::episode::tests::episode;

    /// Outcomes of routes `N-left-1` and so on, of which each has these letters.
    pub(crate) fn outcomes(routes: &[&str]) -> Outcomes {
        let n = routes[0].len();
        let route = |(index, ended): (usize, &&str)| RouteOutcomes {
            name: format!("{}/N-left-{}", 16 + index / 2, index + 1),
            roundabout: (16 + index / 2).to_string(),
            island_radius: "12 to 16 m".into(),
            lane: "left".into(),
            exit: (index + 1).to_string(),
            ended: (*ended).to_owned(),
            steps: vec![100; n],
            lane_distance: vec![0.5; n],
            clearance: vec![0.25; n],
            load_transfer_ratio: vec![0.75; n],
            reward: vec![10.5; n],
            class: Vec::new(),
        };
        Outcomes {
            version: VERSION,
            world: "0badcafe".into(),
            digest: "01234567".into(),
            episodes: n,
            step: 0.1,
            ends: ends(),
            classes: Vec::new(),
            routes: routes.iter().enumerate().map(route).collect(),
        }
    }

    #[test]
    fn outcomes_are_read_back_and_have_a_line_for_each_route() {
        let outcomes = outcomes(&["..ta", "rjsd", "...."]);
        let text = outcomes.json().unwrap();
        assert_eq!(serde_json::from_str::<Outcomes>(&text).unwrap(), outcomes);
        assert_eq!((text.lines().count(), outcomes.fault()), (5, None));
        let ends: Vec<Ended> = outcomes.routes[1].each_end().collect();
        assert_eq!(ends, [Ended::RolledOver, Ended::Jackknifed, Ended::Strayed, Ended::TimedOut]);
        assert_eq!(outcomes.routes[0].end(3), Ended::TrailerCollided);
    }

    #[test]
    fn what_is_wrong_with_outcomes_is_named_by_route_and_key() {
        let fault = |change: fn(&mut Outcomes)| {
            let mut outcomes = outcomes(&["..", ".."]);
            change(&mut outcomes);
            outcomes.fault().unwrap()
        };
        assert_eq!(fault(|outcomes| outcomes.version = 2), "version: 2; this program reads 1");
        assert_eq!(
            fault(|outcomes| outcomes.routes[1].steps.truncate(1)),
            "routes, 16/N-left-2: steps: 1 values; 2 are needed"
        );
        assert!(fault(|outcomes| outcomes.routes[0].ended = ".x".into()).contains("N-left-1: ended: 'x'; a letter"));
        assert!(fault(|outcomes| outcomes.routes.clear()).contains("have no episode"));
        assert!(fault(|outcomes| outcomes.routes[0].class = vec![0; 2]).contains("class: 2 values; 0 are needed"));
    }

    #[test]
    fn the_last_bit_of_a_state_or_a_sum_is_another_digest() {
        let one = [episode(Ended::Arrived), episode(Ended::Strayed)];
        let mut other = one.clone();
        other[1].last.heading = f32::from_bits(other[1].last.heading.to_bits() + 1);
        let mut third = one.clone();
        third[0].reward = f64::from_bits(third[0].reward.to_bits() + 1);
        assert_eq!(digest(&one), digest(&one.clone()));
        assert!(digest(&one) != digest(&other) && digest(&one) != digest(&third));
    }
}
