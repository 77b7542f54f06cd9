//! The board's table, for people and for programs.

use offtrack::layout::Ended;
use offtrack::scenario::Split;
use serde::Serialize;

use super::entry::{Drive, Entry, Training};
use crate::comparison::Estimate;
use crate::episode::wilson;
use crate::interval::Cells;
use crate::outcomes::Outcomes;
use crate::rank::nearest_rank;
use crate::tabular;

/// What an entry's policy came to on one set of routes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stretch {
    /// The benchmark's name.
    pub benchmark: String,
    /// The routes that are driven.
    pub split: Split,
    /// Episodes on each route.
    pub episodes: usize,
    /// Seed of the starts.
    pub seed: u32,
    /// Episodes of all routes.
    pub starts: usize,
    /// Episodes that arrived.
    pub arrived: usize,
    /// Success with its interval over routes.
    pub success: Estimate,
    /// Lower end of Wilson's 95 % interval of success, over episodes.
    pub success_low: f64,
    /// Upper end of it.
    pub success_high: f64,
    /// Mean distance to the lane centre in episodes that arrived; `None` if none did (m).
    pub lane_distance: Option<f64>,
    /// Mean time of the episodes that arrived (s).
    pub time: Option<f64>,
    /// Largest load transfer ratio of an episode: 99 in 100 of all episodes have at most this.
    pub load_transfer_ratio_p99: f64,
}

impl Stretch {
    /// Of the outcomes of an evaluation, which have an episode.
    pub fn of(drive: &Drive, outcomes: &Outcomes) -> Stretch {
        let mut success = Cells::new(1, outcomes.routes.len());
        let (mut lane, mut steps, mut peaks) = (0.0, 0.0, Vec::new());
        for (index, route) in outcomes.routes.iter().enumerate() {
            for (episode, end) in route.each_end().enumerate() {
                let has_arrived = end == Ended::Arrived;
                success.add(0, index, f64::from(u8::from(has_arrived)));
                if has_arrived {
                    lane += route.lane_distance[episode];
                    steps += f64::from(route.steps[episode]);
                }
            }
            peaks.extend_from_slice(&route.load_transfer_ratio);
        }
        let arrived = outcomes.arrived();
        let mean = |sum: f64| (0 < arrived).then(|| sum / arrived as f64);
        let (success_low, success_high) = wilson(arrived, success.episodes());
        Stretch {
            benchmark: drive.benchmark.clone(),
            split: drive.split,
            episodes: drive.episodes,
            seed: drive.seed,
            starts: success.episodes(),
            arrived,
            success: Estimate::of(&success).unwrap_or(Estimate { mean: 0.0, low: None, high: None }),
            success_low,
            success_high,
            lane_distance: mean(lane),
            time: mean(outcomes.step * steps),
            load_transfer_ratio_p99: nearest_rank(&mut peaks, 0.99).unwrap_or(0.0),
        }
    }
}

/// A row of the board.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The entry's file.
    pub file: String,
    /// The entry's name.
    pub name: String,
    /// Where it is reported.
    pub home: Stretch,
    /// Where it was not trained for; `None` where the entry does not say.
    pub elsewhere: Option<Stretch>,
    /// On roads drawn from a seed that nobody knew; `None` where nobody asked, and of recorded actions.
    pub fresh: Option<Stretch>,
    /// Env steps of training.
    pub env_steps: Option<u64>,
    /// Time of training (min).
    pub minutes: Option<f64>,
    /// Cores of training.
    pub cores: Option<u32>,
    /// Size of the policy's file, or of that of its actions (bytes).
    pub bytes: Option<u64>,
    /// Where code, or a description, is.
    pub link: Option<String>,
    /// Commit of the program with which it was trained or driven.
    pub commit: Option<String>,
    /// What is not as the entry claims; empty where it is, to the last bit.
    pub differs: Vec<String>,
}

impl Row {
    /// Of an entry, without what has not been driven yet.
    pub fn of(file: &std::path::Path, entry: &Entry, home: Stretch) -> Row {
        let Entry { name, link, commit, training, .. } = entry.clone();
        let size = |file: std::path::PathBuf| file.metadata().ok().map(|data| data.len());
        Row {
            file: file.display().to_string(),
            name,
            home,
            elsewhere: None,
            fresh: None,
            env_steps: training.map(|Training { env_steps, .. }| env_steps),
            minutes: training.map(|Training { minutes, .. }| minutes),
            cores: training.map(|Training { cores, .. }| cores),
            bytes: entry.driving_file(file).and_then(size),
            link,
            commit,
            differs: Vec::new(),
        }
    }
}

/// All rows, those of one evaluation together, the highest success first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Board {
    /// The rows.
    pub rows: Vec<Row>,
}

impl Board {
    /// Sorts the rows.
    pub fn new(mut rows: Vec<Row>) -> Board {
        let firsts: Vec<Stretch> = rows.iter().map(|row| row.home.clone()).collect();
        let place = |row: &Row| firsts.iter().position(|first| is_same(first, &row.home));
        rows.sort_by(|a, b| {
            let success = |row: &Row| row.home.success.mean;
            let lane = |row: &Row| row.home.lane_distance.unwrap_or(f64::INFINITY);
            let better = success(b).total_cmp(&success(a)).then(lane(a).total_cmp(&lane(b)));
            place(a).cmp(&place(b)).then(better)
        });
        Board { rows }
    }

    /// A table in Markdown for each evaluation.
    pub fn markdown(&self) -> String {
        let tables = self.rows.chunk_by(|a, b| is_same(&a.home, &b.home)).map(|rows| {
            let Stretch { benchmark, split, episodes, seed, .. } = &rows[0].home;
            let heading =
                format!("{benchmark}, {} routes, {episodes} episodes each, seed {seed} of the starts", split.name());
            format!("{heading}\n\n{}", tabular::markdown(&cells(rows)))
        });
        tables.collect::<Vec<_>>().join("\n")
    }

    /// All rows as CSV, in full.
    pub fn csv(&self) -> String {
        let head = [
            "name",
            "file",
            "benchmark",
            "split",
            "episodes_per_route",
            "success",
            "success_low",
            "success_high",
            "success_low_over_routes",
            "success_high_over_routes",
            "success_elsewhere",
            "success_fresh",
            "fresh",
            "lane_distance_m",
            "load_transfer_ratio_p99",
            "time_s",
            "env_steps",
            "minutes",
            "cores",
            "bytes",
            "as_claimed",
            "link",
            "commit",
        ];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        rows.extend(self.rows.iter().map(|row| {
            let Row { file, name, home, elsewhere, fresh, .. } = row.clone();
            let success = |stretch: Option<Stretch>| text(stretch.map(|stretch| stretch.success.mean));
            [
                name,
                file,
                home.benchmark,
                home.split.name().to_owned(),
                home.episodes.to_string(),
                home.success.mean.to_string(),
                home.success_low.to_string(),
                home.success_high.to_string(),
                text(home.success.low),
                text(home.success.high),
                success(elsewhere),
                success(fresh.clone()),
                fresh.map(|fresh| fresh.benchmark).unwrap_or_default(),
                text(home.lane_distance),
                home.load_transfer_ratio_p99.to_string(),
                text(home.time),
                text(row.env_steps),
                text(row.minutes),
                text(row.cores),
                text(row.bytes),
                row.differs.is_empty().to_string(),
                text(row.link.clone()),
                text(row.commit.clone()),
            ]
            .to_vec()
        }));
        tabular::csv(&rows)
    }
}

/// Whether two rows stand in one table.
fn is_same(a: &Stretch, b: &Stretch) -> bool {
    (&a.benchmark, &a.split, a.episodes, a.seed) == (&b.benchmark, &b.split, b.episodes, b.seed)
}

fn text(value: Option<impl ToString>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

/// The cells of some rows, with their head.
fn cells(rows: &[Row]) -> Vec<Vec<String>> {
    let has_fresh = rows.iter().any(|row| row.fresh.is_some());
    let mut head = vec!["".to_owned(), "success, 95 % over routes".into(), "elsewhere".into()];
    if has_fresh {
        head.push("fresh roads".into());
    }
    let rest = ["lane m", "LTR p99", "time s", "env steps", "minutes (cores)", "kB", "as claimed"];
    head.extend(rest.map(str::to_owned));
    let dash = || "-".to_owned();
    let success = |stretch: &Option<Stretch>| {
        stretch.as_ref().map_or_else(dash, |stretch| format!("{:.1} %", 100.0 * stretch.success.mean))
    };
    let row = |row: &Row| {
        let Stretch { success: home, starts, arrived, lane_distance, time, load_transfer_ratio_p99, .. } = &row.home;
        let interval = home.ends_or_wilson(*arrived, *starts, |value| format!("{:.1}", 100.0 * value));
        let mut cells = vec![row.name.clone(), format!("{:.1} %, {interval}", 100.0 * home.mean)];
        cells.push(success(&row.elsewhere));
        if has_fresh {
            cells.push(success(&row.fresh));
        }
        cells.push(lane_distance.map_or_else(dash, |metres| format!("{metres:.2}")));
        cells.push(format!("{load_transfer_ratio_p99:.2}"));
        cells.push(time.map_or_else(dash, |seconds| format!("{seconds:.1}")));
        cells.push(row.env_steps.map_or_else(dash, |steps| format!("{:.1} M", steps as f64 / 1e6)));
        let minutes = row.minutes.zip(row.cores).map(|(minutes, cores)| format!("{minutes:.1} ({cores})"));
        cells.push(minutes.unwrap_or_else(dash));
        cells.push(row.bytes.map_or_else(dash, |bytes| (bytes / 1000).to_string()));
        cells.push(if row.differs.is_empty() { "yes".into() } else { "NO".into() });
        cells
    };
    std::iter::once(head).chain(rows.iter().map(row)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::entry::tests::ENTRY;
    use super::*;
    use crate::outcomes::tests::outcomes;

    fn row(name: &str, routes: &[&str]) -> Row {
        let entry: Entry = toml::from_str(&ENTRY.replace("\"a\"", &format!("\"{name}\""))).unwrap();
        Row::of(std::path::Path::new("e.toml"), &entry, Stretch::of(&entry.home, &outcomes(routes)))
    }

    #[test]
    fn rows_of_one_evaluation_stand_together_the_best_first() {
        let mut other = row("other", &["..", ".."]);
        other.home.benchmark = "c".into();
        let mut nearer = row("nearer", &[".t", ".."]);
        nearer.home.lane_distance = Some(0.25);
        let board = Board::new(vec![row("worse", &["tt", ".."]), other, row("far", &[".t", ".."]), nearer]);
        let names: Vec<&str> = board.rows.iter().map(|row| row.name.as_str()).collect();
        assert_eq!(names, ["nearer", "far", "worse", "other"]);
        let text = board.markdown();
        assert!(
            text.starts_with("b, test routes, 2 episodes each") && text.matches("success, 95 %").count() == 2,
            "{text}"
        );
        assert!(text.contains("| nearer | 75.0 %, ") && text.contains("| yes "), "{text}");
    }

    #[test]
    fn figures_are_those_of_the_outcomes_and_csv_has_a_cell_for_each_name() {
        let mut of = outcomes(&[".t", ".."]);
        of.routes[0].lane_distance = vec![2.0, 9.0];
        of.routes[1].load_transfer_ratio = vec![0.1, 0.9];
        let entry: Entry = toml::from_str(ENTRY).unwrap();
        let stretch = Stretch::of(&entry.home, &of);
        assert_eq!((stretch.success.mean, stretch.lane_distance, stretch.time), (0.75, Some(1.0), Some(10.0)));
        assert_eq!(stretch.load_transfer_ratio_p99, 0.9);
        let mut row = row("a, b", &[".t", ".."]);
        row.differs.push("x".into());
        let csv = Board::new(vec![row]).csv();
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines[0].split(',').count() + 1, lines[1].split(',').count(), "the name has a comma");
        assert!(lines[1].starts_with("\"a, b\",e.toml,b,test,2,0.75,") && lines[1].contains(",false,"), "{csv}");
    }
}
