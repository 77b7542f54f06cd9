//! The result of an evaluation: every episode counted, per route and in all, as JSON and as a table.

use std::collections::BTreeMap;
use std::fmt::Write;

use offtrack::layout::Ended;
use serde::Serialize;

/// What one episode came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Episode {
    /// Why it ended.
    pub ended: Ended,
    /// Steps it took.
    pub steps: u32,
    /// Sum of the rewards.
    pub reward: f64,
    /// Mean distance to the lane centre [m].
    pub lane_distance_mean: f64,
    /// Largest distance to the lane centre [m].
    pub lane_distance_max: f64,
    /// Smallest distance of the tractor to a kerb [m].
    pub tractor_clearance_min: f64,
    /// Smallest distance of the trailer to a kerb [m].
    pub trailer_clearance_min: f64,
    /// Largest load transfer ratio of either unit.
    pub load_transfer_ratio_peak: f64,
    /// Largest articulation [rad].
    pub articulation_peak: f64,
    /// Largest distance of the trailer axle from the path of the front axle [m].
    pub off_tracking_peak: f64,
}

/// Episodes taken together. Means are over episodes; extremes over all of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Episodes run.
    pub episodes: usize,
    /// Episodes that arrived.
    pub arrived: usize,
    /// Share that arrived.
    pub success: f64,
    /// Lower end of its 95 % Wilson interval.
    pub success_low: f64,
    /// Upper end.
    pub success_high: f64,
    /// Episodes by end code.
    pub ends: BTreeMap<&'static str, usize>,
    /// Episodes that failed in their first step: the start pose stands on or against a kerb, and no action helps.
    pub lost_at_start: usize,
    /// Mean distance to the lane centre, all episodes [m].
    pub lane_distance_mean: f64,
    /// The same of those that arrived; none when none did [m].
    pub lane_distance_mean_arrived: Option<f64>,
    /// Largest distance to the lane centre [m].
    pub lane_distance_max: f64,
    /// The same of those that arrived [m].
    pub lane_distance_max_arrived: Option<f64>,
    /// Smallest distance of the tractor to a kerb [m].
    pub tractor_clearance_min: f64,
    /// Smallest distance of the trailer to a kerb [m].
    pub trailer_clearance_min: f64,
    /// Largest load transfer ratio.
    pub load_transfer_ratio_peak: f64,
    /// Largest articulation [deg].
    pub articulation_peak_deg: f64,
    /// Largest off-tracking [m].
    pub off_tracking_peak: f64,
    /// Mean time of an episode [s].
    pub time_mean: f64,
    /// Mean sum of rewards.
    pub reward_mean: f64,
}

impl Summary {
    /// `episodes` taken together, none when there are none; a step takes `step` seconds.
    pub fn of<'a>(episodes: impl Iterator<Item = &'a Episode> + Clone, step: f64) -> Option<Summary> {
        let count = episodes.clone().count();
        if count == 0 {
            return None;
        }
        let arrived = episodes.clone().filter(|episode| episode.ended == Ended::Arrived);
        let n_arrived = arrived.clone().count();
        let (success_low, success_high) = wilson(n_arrived, count);
        let most = |value: fn(&Episode) -> f64| episodes.clone().map(value).fold(f64::NEG_INFINITY, f64::max);
        let least = |value: fn(&Episode) -> f64| episodes.clone().map(value).fold(f64::INFINITY, f64::min);
        let mean = |value: fn(&Episode) -> f64| episodes.clone().map(value).sum::<f64>() / count as f64;
        let mut ends: BTreeMap<&'static str, usize> =
            Ended::ALL.into_iter().filter(|&ended| ended != Ended::Running).map(|ended| (ended.name(), 0)).collect();
        for episode in episodes.clone() {
            *ends.entry(episode.ended.name()).or_default() += 1;
        }
        Some(Summary {
            episodes: count,
            arrived: n_arrived,
            success: n_arrived as f64 / count as f64,
            success_low,
            success_high,
            ends,
            lost_at_start: episodes.clone().filter(|episode| episode.ended.failed() && episode.steps == 1).count(),
            lane_distance_mean: mean(|episode| episode.lane_distance_mean),
            lane_distance_mean_arrived: (0 < n_arrived)
                .then(|| arrived.clone().map(|episode| episode.lane_distance_mean).sum::<f64>() / n_arrived as f64),
            lane_distance_max: most(|episode| episode.lane_distance_max),
            lane_distance_max_arrived: arrived.map(|episode| episode.lane_distance_max).reduce(f64::max),
            tractor_clearance_min: least(|episode| episode.tractor_clearance_min),
            trailer_clearance_min: least(|episode| episode.trailer_clearance_min),
            load_transfer_ratio_peak: most(|episode| episode.load_transfer_ratio_peak),
            articulation_peak_deg: most(|episode| episode.articulation_peak).to_degrees(),
            off_tracking_peak: most(|episode| episode.off_tracking_peak),
            time_mean: step * mean(|episode| f64::from(episode.steps)),
            reward_mean: mean(|episode| episode.reward),
        })
    }
}

/// The 95 % interval of a share `successes / trials` (E. Wilson, "Probable Inference, the Law of Succession, and Statistical
/// Inference", 1927).
pub fn wilson(successes: usize, trials: usize) -> (f64, f64) {
    const Z: f64 = 1.959_964;
    let (n, p) = (trials as f64, successes as f64 / trials as f64);
    let centre = (p + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let half = Z / (1.0 + Z * Z / n) * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    // The interval holds the share itself, to the last bit too.
    ((centre - half).clamp(0.0, p), (centre + half).clamp(p, 1.0))
}

/// One route's episodes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RouteReport {
    /// `20m/N-left-3` and the like.
    pub name: String,
    /// A truck whose front axle follows the centre line touches no kerb.
    pub own_lane_suffices: bool,
    /// Its episodes taken together.
    #[serde(flatten)]
    pub summary: Summary,
}

/// The whole evaluation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The benchmark's name.
    pub benchmark: String,
    /// `train` or `test`.
    pub split: &'static str,
    /// Who drove.
    pub policy: String,
    /// What the start poses were drawn from.
    pub seed: u32,
    /// Where the simulator ran.
    pub engine: String,
    /// All episodes taken together.
    #[serde(flatten)]
    pub summary: Summary,
    /// Episodes on the routes whose own lane suffices.
    pub own_lane_suffices: Option<Summary>,
    /// Episodes on the routes that need deviation.
    pub needs_deviation: Option<Summary>,
    /// Episodes on the routes shown to be possible; none where no certificate was given or it certifies none of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certified: Option<Summary>,
    /// Each route.
    pub routes: Vec<RouteReport>,
}

impl Report {
    /// The table that a person reads: a line a route, then the sums.
    pub fn table(&self) -> String {
        let mut text = String::new();
        let head = format!(
            "{:<18} {:>9} {:>8} {:>15} {:>5} {:>6} {:>6} {:>8} {:>8} {:>5} {:>6} {:>7} {:>6}  ends",
            "route",
            "arrived",
            "success",
            "95 % interval",
            "lane",
            "mean m",
            "max m",
            "tractor",
            "trailer",
            "LTR",
            "artic",
            "offtrk",
            "time s"
        );
        let _ = writeln!(text, "{head}\n{}", "-".repeat(head.len() + 8));
        for route in &self.routes {
            let lane = if route.own_lane_suffices { "own" } else { "wide" };
            line(&mut text, &route.name, lane, &route.summary);
        }
        let _ = writeln!(text, "{}", "-".repeat(head.len() + 8));
        if let Some(summary) = &self.own_lane_suffices {
            line(&mut text, "own lane suffices", "own", summary);
        }
        if let Some(summary) = &self.needs_deviation {
            line(&mut text, "needs deviation", "wide", summary);
        }
        if let Some(summary) = &self.certified {
            line(&mut text, "certified", "", summary);
        }
        line(&mut text, "all", "", &self.summary);
        text
    }
}

fn line(text: &mut String, name: &str, lane: &str, summary: &Summary) {
    let ends: Vec<String> = summary
        .ends
        .iter()
        .filter(|&(&name, &count)| name != Ended::Arrived.name() && 0 < count)
        .map(|(name, count)| format!("{name} {count}"))
        .collect();
    let _ = writeln!(
        text,
        "{:<18} {:>9} {:>6.1} % {:>5.1} .. {:>5.1} % {:>5} {:>6.2} {:>6.2} {:>8.2} {:>8.2} {:>5.2} {:>4.0} d {:>7.2} {:>6.1}  {}",
        name,
        format!("{}/{}", summary.arrived, summary.episodes),
        100.0 * summary.success,
        100.0 * summary.success_low,
        100.0 * summary.success_high,
        lane,
        summary.lane_distance_mean,
        summary.lane_distance_max,
        summary.tractor_clearance_min,
        summary.trailer_clearance_min,
        summary.load_transfer_ratio_peak,
        summary.articulation_peak_deg,
        summary.off_tracking_peak,
        summary.time_mean,
        ends.join(", "),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wilson_interval_is_the_published_one() {
        // The study's own result, 506 of 690, and the two ends of the scale.
        let (low, high) = wilson(506, 690);
        assert!((low - 0.6991).abs() < 5e-4 && (high - 0.7650).abs() < 5e-4, "{low} {high}");
        assert_eq!(wilson(0, 10).0, 0.0);
        assert_eq!(wilson(10, 10).1, 1.0);
        // Agresti and Coull's example for 0 of 10: 0.2775.
        assert!((wilson(0, 10).1 - 0.2775).abs() < 1e-4);
    }
}
