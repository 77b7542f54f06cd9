//! The figures of an episode, and of several.

use std::collections::BTreeMap;

use offtrack::layout::{Ended, RewardTerms, Truck};
use serde::Serialize;

use super::among::{Among, AmongSummary};
use super::driving::Driving;
use super::interval::Cells;

/// Sums over an episode's steps of the physical amounts that the reward weighs, as [`RewardTerms`] describes them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Terms {
    /// Waypoints passed.
    pub waypoints: f64,
    /// Scaled distances to the lane centre.
    pub lane_distance: f64,
    /// Depths in the margin kept from kerbs.
    pub clearance: f64,
    /// 1 for an episode that failed.
    pub failure: f64,
}

impl Terms {
    /// Adds those of a step.
    pub(super) fn add(&mut self, terms: &RewardTerms) {
        self.waypoints += f64::from(terms.waypoints);
        self.lane_distance += f64::from(terms.lane_distance);
        self.clearance += f64::from(terms.clearance);
        self.failure += f64::from(terms.failure);
    }
}

/// The figures of one episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Episode {
    /// Why the episode ended.
    pub ended: Ended,
    /// Steps that the episode took.
    pub steps: u32,
    /// Sum of the rewards.
    pub reward: f64,
    /// Sums of what the reward weighs.
    pub terms: Terms,
    /// Mean distance to the lane centre (m).
    pub lane_distance_mean: f64,
    /// Largest distance to the lane centre (m).
    pub lane_distance_max: f64,
    /// Fraction of the steps after which the tractor's middle was outside of the route's own lane.
    pub outside_lane: f64,
    /// Smallest distance of the tractor to a kerb (m).
    pub tractor_clearance_min: f64,
    /// Smallest distance of the trailer to a kerb (m).
    pub trailer_clearance_min: f64,
    /// Largest load transfer ratio of either unit.
    pub load_transfer_ratio_peak: f64,
    /// Largest articulation (rad).
    pub articulation_peak: f64,
    /// Largest distance of the trailer axle from the path of the front axle (m).
    pub off_tracking_peak: f64,
    /// Furthest that a wheel of the trailer was on an apron (m); `None` where the road has none.
    pub on_apron: Option<f64>,
    /// How the truck drove, where classes of vehicles are reported.
    pub driving: Option<Driving>,
    /// How it drove among other vehicles, where there are any.
    pub among: Option<Among>,
    /// The truck after its last step.
    pub last: Truck,
}

/// The figures of several episodes: means over the episodes, and extremes of all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Episodes run.
    pub episodes: usize,
    /// Episodes that arrived.
    pub arrived: usize,
    /// Fraction of the episodes that arrived.
    pub success: f64,
    /// Lower end of the 95 % Wilson interval of `success`.
    pub success_low: f64,
    /// Upper end of the 95 % Wilson interval of `success`.
    pub success_high: f64,
    /// Lower end of the 95 % [interval over routes](crate::interval) of `success`; `None` on one route alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub success_low_over_routes: Option<f64>,
    /// Upper end of the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub success_high_over_routes: Option<f64>,
    /// Episodes by end code.
    pub ends: BTreeMap<&'static str, usize>,
    /// Episodes that failed in their first step: the truck starts on or against a kerb, and no action helps.
    pub lost_at_start: usize,
    /// Mean distance to the lane centre, all episodes (m).
    pub lane_distance_mean: f64,
    /// Mean distance to the lane centre, episodes that arrived; `None` if none did (m).
    pub lane_distance_mean_arrived: Option<f64>,
    /// Largest distance to the lane centre, all episodes (m).
    pub lane_distance_max: f64,
    /// Largest distance to the lane centre, episodes that arrived; `None` if none did (m).
    pub lane_distance_max_arrived: Option<f64>,
    /// Mean fraction of an episode's steps outside of its own lane, of those that arrived; `None` if none did.
    pub outside_lane_mean: Option<f64>,
    /// Smallest distance of the tractor to a kerb (m).
    pub tractor_clearance_min: f64,
    /// Smallest distance of the trailer to a kerb (m).
    pub trailer_clearance_min: f64,
    /// Largest load transfer ratio.
    pub load_transfer_ratio_peak: f64,
    /// Largest articulation (deg).
    pub articulation_peak_deg: f64,
    /// Largest off-tracking (m).
    pub off_tracking_peak: f64,
    /// Fraction of the episodes in which wheels of the trailer were on an apron, of those on roads with one; `None` of
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on_apron: Option<f64>,
    /// Furthest that a wheel was on one (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on_apron_max: Option<f64>,
    /// Mean time of an episode (s).
    pub time_mean: f64,
    /// Mean sum of rewards.
    pub reward_mean: f64,
    /// How they drove among other vehicles; `None` where there were none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub among_vehicles: Option<AmongSummary>,
}

impl Episode {
    /// Whether the episode failed in its first step: the truck starts on or against a kerb, and no action helps.
    pub fn lost_at_start(&self) -> bool {
        self.ended.failed() && self.steps == 1
    }
}

impl Summary {
    /// The figures of `episodes`, `None` without an episode. A step takes `step` seconds.
    pub fn of<'a>(episodes: impl Iterator<Item = &'a Episode> + Clone, step: f64) -> Option<Summary> {
        let count = episodes.clone().count();
        if count == 0 {
            return None;
        }
        let arrived = episodes.clone().filter(|episode| episode.ended == Ended::Arrived);
        let n_arrived = arrived.clone().count();
        let (success_low, success_high) = wilson(n_arrived, count);
        let over_routes = success_over_routes(episodes.clone());
        let most = |value: fn(&Episode) -> f64| episodes.clone().map(value).fold(f64::NEG_INFINITY, f64::max);
        let least = |value: fn(&Episode) -> f64| episodes.clone().map(value).fold(f64::INFINITY, f64::min);
        let mean = |value: fn(&Episode) -> f64| episodes.clone().map(value).sum::<f64>() / count as f64;
        let mean_arrived = |value: fn(&Episode) -> f64| {
            (0 < n_arrived).then(|| arrived.clone().map(value).sum::<f64>() / n_arrived as f64)
        };
        let on_aprons: Vec<f64> = episodes.clone().filter_map(|episode| episode.on_apron).collect();
        let n_on_apron = on_aprons.iter().filter(|&&depth| 0.0 < depth).count();
        let mut ends: BTreeMap<&'static str, usize> = Ended::WITHOUT_VEHICLES
            .into_iter()
            .filter(|&ended| ended != Ended::Running)
            .map(|ended| (ended.name(), 0))
            .collect();
        for episode in episodes.clone() {
            *ends.entry(episode.ended.name()).or_default() += 1;
        }
        Some(Summary {
            episodes: count,
            arrived: n_arrived,
            success: n_arrived as f64 / count as f64,
            success_low,
            success_high,
            success_low_over_routes: over_routes.map(|(low, _)| low),
            success_high_over_routes: over_routes.map(|(_, high)| high),
            ends,
            lost_at_start: episodes.clone().filter(|episode| episode.lost_at_start()).count(),
            lane_distance_mean: mean(|episode| episode.lane_distance_mean),
            lane_distance_mean_arrived: mean_arrived(|episode| episode.lane_distance_mean),
            lane_distance_max: most(|episode| episode.lane_distance_max),
            lane_distance_max_arrived: arrived.clone().map(|episode| episode.lane_distance_max).reduce(f64::max),
            outside_lane_mean: mean_arrived(|episode| episode.outside_lane),
            tractor_clearance_min: least(|episode| episode.tractor_clearance_min),
            trailer_clearance_min: least(|episode| episode.trailer_clearance_min),
            load_transfer_ratio_peak: most(|episode| episode.load_transfer_ratio_peak),
            articulation_peak_deg: most(|episode| episode.articulation_peak).to_degrees(),
            off_tracking_peak: most(|episode| episode.off_tracking_peak),
            on_apron: (!on_aprons.is_empty()).then(|| n_on_apron as f64 / on_aprons.len() as f64),
            on_apron_max: on_aprons.iter().copied().reduce(f64::max),
            time_mean: step * mean(|episode| f64::from(episode.steps)),
            reward_mean: mean(|episode| episode.reward),
            among_vehicles: AmongSummary::of(episodes),
        })
    }
}

/// The 95 % [interval over routes](crate::interval) of the fraction that arrived; `None` on one route alone.
pub(super) fn success_over_routes<'a>(episodes: impl Iterator<Item = &'a Episode>) -> Option<(f64, f64)> {
    let arrived = |episode: &Episode| f64::from(u8::from(episode.ended == Ended::Arrived));
    Cells::of_routes(episodes.map(|episode| (episode.last.route, arrived(episode)))).interval()
}

/// The 95 % Wilson interval of the fraction `successes / trials` (E. Wilson, "Probable Inference, the Law of
/// Succession, and Statistical Inference", 1927); without trials all fractions, 0 to 1.
///
/// # Panics
///
/// If there are more successes than trials.
pub fn wilson(successes: usize, trials: usize) -> (f64, f64) {
    const Z: f64 = 1.959_964;
    assert!(successes <= trials, "{successes} successes in {trials} trials");
    if trials == 0 {
        return (0.0, 1.0);
    }
    let (n, p) = (trials as f64, successes as f64 / trials as f64);
    let centre = (p + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let half = Z / (1.0 + Z * Z / n) * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    // Rounding must not exclude the fraction itself.
    ((centre - half).clamp(0.0, p), (centre + half).clamp(p, 1.0))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// An episode with the widest figures that an evaluation gives.
    pub(in super::super) fn episode(ended: Ended) -> Episode {
        Episode {
            ended,
            steps: 999,
            reward: -500.0,
            terms: Terms::default(),
            lane_distance_mean: 10.25,
            lane_distance_max: 19.25,
            outside_lane: 0.25,
            tractor_clearance_min: -10.25,
            trailer_clearance_min: -10.25,
            load_transfer_ratio_peak: 1.5,
            articulation_peak: 1.9,
            off_tracking_peak: 10.25,
            on_apron: None,
            driving: Some(Driving::new(&Truck::default(), 0.0)),
            among: None,
            last: Truck::default(),
        }
    }

    #[test]
    fn the_interval_over_routes_is_of_the_routes_that_episodes_were_driven_on() {
        let on = |route: u32, ended: Ended| {
            let one = episode(ended);
            Episode { last: Truck { route, ..one.last }, ..one }
        };
        // Of ten routes two fail whole.
        let ends = |route: u32| if route < 2 { Ended::TimedOut } else { Ended::Arrived };
        let episodes: Vec<Episode> = (0..300).map(|index| on(index / 30, ends(index / 30))).collect();
        let summary = Summary::of(episodes.iter(), 0.1).unwrap();
        let (low, high) = (summary.success_low_over_routes.unwrap(), summary.success_high_over_routes.unwrap());
        assert!(low < 0.6 && 0.95 < high && low < summary.success_low && summary.success_high < high, "{low} {high}");
        let one_route = Summary::of(episodes[..30].iter(), 0.1).unwrap();
        assert_eq!((one_route.success_low_over_routes, one_route.success_high_over_routes), (None, None));
    }

    #[test]
    fn the_use_of_aprons_is_that_of_the_episodes_on_roads_that_have_one() {
        let on = |on_apron| Episode { on_apron, ..episode(Ended::Arrived) };
        let of = |episodes: &[Episode]| {
            let summary = Summary::of(episodes.iter(), 0.1).unwrap();
            (summary.on_apron, summary.on_apron_max)
        };
        assert_eq!(
            of(&[on(None), on(Some(0.0)), on(Some(0.25)), on(Some(0.0)), on(Some(1.5))]),
            (Some(0.5), Some(1.5))
        );
        assert_eq!(of(&[on(None), on(None)]), (None, None));
    }

    #[test]
    fn the_wilson_interval_has_the_published_values() {
        // The study's own result, 506 of 690, and the two ends of the scale.
        let (low, high) = wilson(506, 690);
        assert!((low - 0.6991).abs() < 5e-4 && (high - 0.7650).abs() < 5e-4, "{low} {high}");
        assert_eq!(wilson(0, 10).0, 0.0);
        assert_eq!(wilson(10, 10).1, 1.0);
        assert_eq!(wilson(0, 0), (0.0, 1.0));
        // Agresti and Coull's example for 0 of 10: 0.2775.
        assert!((wilson(0, 10).1 - 0.2775).abs() < 1e-4);
    }
}
