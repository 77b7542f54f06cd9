//! What several seeds of one training file came to: each, their mean, the worst, and how well so few determine the
//! mean.

use serde::{Deserialize, Serialize};

use crate::tabular::markdown;

/// A seed's run, as far as its `report.json` is needed here.
#[derive(Debug, Clone, Deserialize)]
pub struct SeedReport {
    /// The run was stopped before its budget was spent.
    pub interrupted: bool,
    seed: u32,
    seconds: f64,
    env_steps: u64,
    updates: u64,
    machine: String,
    commit: String,
    evaluation: Option<Evaluated>,
    #[serde(default)]
    also: Vec<Evaluated>,
}

/// One of its evaluations.
#[derive(Debug, Clone, Deserialize)]
struct Evaluated {
    benchmark: String,
    split: String,
    /// The evaluation on `benchmark` has no such key: none of its routes may be trained on.
    #[serde(default)]
    trained_on: usize,
    episodes: usize,
    arrived: usize,
    success: f64,
    lane_distance_mean_arrived: Option<f64>,
}

/// Several seeds, as written to `seeds.json`.
#[derive(Debug, Clone, Serialize)]
pub struct Seeds {
    /// All seeds that were asked for.
    seeds: Vec<u32>,
    /// The runs that have finished.
    runs: Vec<SeedRun>,
    /// Evaluations of the finished runs, that on `benchmark` first.
    evaluations: Vec<SeedsEvaluation>,
}

/// How a seed was trained.
#[derive(Debug, Clone, Serialize)]
struct SeedRun {
    seed: u32,
    /// Training time (s).
    seconds: f64,
    env_steps: u64,
    updates: u64,
    machine: String,
    commit: String,
}

/// One evaluation of all seeds that have finished.
#[derive(Debug, Clone, Serialize)]
struct SeedsEvaluation {
    benchmark: String,
    split: String,
    /// Number of the evaluation's routes that were trained on: 0 is zero-shot.
    trained_on: usize,
    /// Mean of the seeds' success.
    success_mean: f64,
    /// Student's 95 % interval of the mean, cut at 0 and 1; of two seeds or more.
    success_mean_low: Option<f64>,
    success_mean_high: Option<f64>,
    success_worst: f64,
    /// The first seed with that success.
    worst_seed: u32,
    /// Mean of the seeds' mean distances to the lane centre in episodes that arrived (m).
    lane_distance_mean_arrived: Option<f64>,
    seeds: Vec<SeedFigures>,
}

/// A seed's figures in one evaluation.
#[derive(Debug, Clone, Serialize)]
struct SeedFigures {
    seed: u32,
    episodes: usize,
    arrived: usize,
    success: f64,
    /// Mean distance to the lane centre in episodes that arrived; none if none did (m).
    lane_distance_mean_arrived: Option<f64>,
}

impl Seeds {
    /// The figures of `finished`, which have the same evaluations; `seeds` are all that were asked for.
    pub fn of(seeds: &[u32], finished: &[SeedReport]) -> Seeds {
        let run = |report: &SeedReport| {
            let SeedReport { seed, seconds, env_steps, updates, ref machine, ref commit, .. } = *report;
            SeedRun { seed, seconds, env_steps, updates, machine: machine.clone(), commit: commit.clone() }
        };
        let evaluations: Vec<Vec<&Evaluated>> =
            finished.iter().map(|report| report.evaluation.iter().chain(&report.also).collect()).collect();
        let n = evaluations.iter().map(Vec::len).min().unwrap_or(0);
        let of = |index: usize| {
            let each: Vec<(u32, &Evaluated)> = finished
                .iter()
                .zip(&evaluations)
                .map(|(report, evaluations)| (report.seed, evaluations[index]))
                .collect();
            SeedsEvaluation::of(&each)
        };
        Seeds {
            seeds: seeds.to_vec(),
            runs: finished.iter().map(run).collect(),
            evaluations: (0..n).filter_map(of).collect(),
        }
    }

    /// A Markdown table: a row for each seed, then mean, worst and interval.
    pub fn table(&self) -> String {
        let mut rows = vec![vec!["seed".to_owned()]];
        rows.extend(self.runs.iter().map(|run| vec![run.seed.to_string()]));
        rows.extend(["mean", "worst", "95 % interval"].map(|name| vec![name.to_owned()]));
        for evaluation in &self.evaluations {
            for (row, cell) in rows.iter_mut().zip(evaluation.cells()) {
                row.push(cell);
            }
        }
        let times = self.runs.iter().map(|run| format!("{:.0} s", run.seconds));
        let cells = std::iter::once("training".to_owned()).chain(times).chain(std::iter::repeat(String::new()));
        for (row, cell) in rows.iter_mut().zip(cells) {
            row.push(cell);
        }
        markdown(&rows)
    }
}

impl SeedsEvaluation {
    /// The figures of `each` seed; none without a seed.
    fn of(each: &[(u32, &Evaluated)]) -> Option<SeedsEvaluation> {
        let (_, first) = each.first()?;
        let success: Vec<f64> = each.iter().map(|(_, evaluated)| evaluated.success).collect();
        let &(worst_seed, worst) = each.iter().min_by(|(_, a), (_, b)| a.success.total_cmp(&b.success))?;
        let lanes: Vec<f64> = each.iter().filter_map(|(_, evaluated)| evaluated.lane_distance_mean_arrived).collect();
        let interval = interval(&success);
        let figures = |&(seed, evaluated): &(u32, &Evaluated)| {
            let Evaluated { episodes, arrived, success, lane_distance_mean_arrived, .. } = *evaluated;
            SeedFigures { seed, episodes, arrived, success, lane_distance_mean_arrived }
        };
        Some(SeedsEvaluation {
            benchmark: first.benchmark.clone(),
            split: first.split.clone(),
            trained_on: first.trained_on,
            success_mean: mean(&success),
            success_mean_low: interval.map(|(low, _)| low),
            success_mean_high: interval.map(|(_, high)| high),
            success_worst: worst.success,
            worst_seed,
            lane_distance_mean_arrived: (!lanes.is_empty()).then(|| mean(&lanes)),
            seeds: each.iter().map(figures).collect(),
        })
    }

    /// The evaluation's column: head, seeds, mean, worst and interval.
    fn cells(&self) -> Vec<String> {
        let familiarity = match self.trained_on {
            0 => "zero-shot".to_owned(),
            n => format!("{n} routes trained on"),
        };
        let lane = |mean: Option<f64>| mean.map(|mean| format!(", {mean:.2} m")).unwrap_or_default();
        let mut cells = vec![format!("{} {}, {familiarity}", self.benchmark, self.split)];
        cells.extend(self.seeds.iter().map(|seed| {
            format!(
                "{:.1} % ({}/{}){}",
                100.0 * seed.success,
                seed.arrived,
                seed.episodes,
                lane(seed.lane_distance_mean_arrived)
            )
        }));
        cells.push(format!("{:.1} %{}", 100.0 * self.success_mean, lane(self.lane_distance_mean_arrived)));
        cells.push(format!("{:.1} %, seed {}", 100.0 * self.success_worst, self.worst_seed));
        // One without width, where all seeds are alike, says nothing.
        let ends = self.success_mean_low.zip(self.success_mean_high).filter(|(low, high)| low < high);
        cells.push(
            ends.map_or_else(|| "-".to_owned(), |(low, high)| format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high)),
        );
        cells
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Student's 95 % interval of the mean of fractions, cut at 0 and 1; none for a single one.
fn interval(values: &[f64]) -> Option<(f64, f64)> {
    let n = values.len();
    if n < 2 {
        return None;
    }
    let centre = mean(values);
    let variance = values.iter().map(|value| (value - centre).powi(2)).sum::<f64>() / (n - 1) as f64;
    let half = student_t(n - 1) * (variance / n as f64).sqrt();
    Some(((centre - half).max(0.0), (centre + half).min(1.0)))
}

/// Quantile 0.975 of Student's t distribution, by the degrees of freedom: exact to three decimals. Above 20 it is
/// formula 26.7.5 of M. Abramowitz and I. Stegun, "Handbook of Mathematical Functions" (1964).
pub(crate) fn student_t(freedom: usize) -> f64 {
    const TABLE: [f64; 20] = [
        12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131,
        2.120, 2.110, 2.101, 2.093, 2.086,
    ];
    const Z: f64 = 1.959_964;
    let n = freedom as f64;
    let terms = [
        (Z.powi(3) + Z) / 4.0,
        (5.0 * Z.powi(5) + 16.0 * Z.powi(3) + 3.0 * Z) / 96.0,
        (3.0 * Z.powi(7) + 19.0 * Z.powi(5) + 17.0 * Z.powi(3) - 15.0 * Z) / 384.0,
    ];
    let series = || Z + terms.iter().zip(1..).map(|(term, power)| term / n.powi(power)).sum::<f64>();
    freedom.checked_sub(1).and_then(|index| TABLE.get(index).copied()).unwrap_or_else(series)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(seed: u32, arrived: usize) -> SeedReport {
        let evaluation = |trained_on: usize, arrived: usize| {
            serde_json::json!({ "benchmark": "b", "split": "test", "trained_on": trained_on, "episodes": 100,
                "arrived": arrived, "success": arrived as f64 / 100.0, "lane_distance_mean_arrived": 0.5 })
        };
        let report = serde_json::json!({ "interrupted": false, "seed": seed, "seconds": 61.0, "env_steps": 5,
            "updates": 6, "machine": "m", "commit": "c", "evaluation": evaluation(0, arrived), "also": [evaluation(3, 100)] });
        serde_json::from_value(report).unwrap()
    }

    #[test]
    fn the_interval_of_a_mean_is_students() {
        // Fractions of ten seeds: 92.2 %, 87.0 to 97.4 %.
        let arrived = [642, 605, 681, 688, 662, 661, 619, 591, 531, 684].map(|arrived| f64::from(arrived) / 690.0);
        let (low, high) = interval(&arrived).unwrap();
        assert!(
            (mean(&arrived) - 0.9223).abs() < 5e-5 && (low - 0.870).abs() < 5e-4 && (high - 0.974).abs() < 5e-4,
            "{low} {high}"
        );
        assert_eq!(interval(&[0.5]), None);
        let (low, high) = interval(&[1.0, 0.9]).unwrap();
        // 0.95 - 12.706 * 0.05.
        assert!((low - 0.3147).abs() < 1e-6 && high == 1.0, "{low} {high}");
    }

    #[test]
    fn quantiles_beyond_the_table_are_the_published_ones() {
        // R's qt(0.975, n).
        for (freedom, quantile) in [(1, 12.706), (20, 2.086), (21, 2.080), (30, 2.042), (60, 2.000), (999, 1.962)] {
            assert!((student_t(freedom) - quantile).abs() < 5.1e-4, "{freedom}: {}", student_t(freedom));
        }
    }

    #[test]
    fn each_seed_has_a_row_and_the_worst_is_named() {
        let seeds = Seeds::of(&[3, 4, 5], &[report(3, 90), report(4, 70)]);
        let expected = "\
| seed          | b test, zero-shot       | b test, 3 routes trained on | training |
|---------------|-------------------------|-----------------------------|----------|
| 3             | 90.0 % (90/100), 0.50 m | 100.0 % (100/100), 0.50 m   | 61 s     |
| 4             | 70.0 % (70/100), 0.50 m | 100.0 % (100/100), 0.50 m   | 61 s     |
| mean          | 80.0 %, 0.50 m          | 100.0 %, 0.50 m             |          |
| worst         | 70.0 %, seed 4          | 100.0 %, seed 3             |          |
| 95 % interval | 0.0 to 100.0 %          | -                           |          |
";
        assert_eq!(seeds.table(), expected);
        let json = serde_json::to_value(&seeds).unwrap();
        assert_eq!(json["seeds"], serde_json::json!([3, 4, 5]));
        assert_eq!(
            (&json["evaluations"][0]["worst_seed"], &json["evaluations"][1]["trained_on"]),
            (&4.into(), &3.into())
        );
    }
}
