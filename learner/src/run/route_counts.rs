//! Success on each training route while the policy learns, and `routes.csv`, the file of it.
//!
//! A device counts them with level replay alone. Without a counted episode there is no file.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use offtrack::layout::Ended;
use offtrack::scenario::{Scenario, Split};
use serde::Serialize;

use super::progress::ROW_EVERY;
use crate::checkpoint::{Columns, Stored};
use crate::error::Error;
use crate::rollout::RouteEnd;
use offtrack_evaluation::files;
use offtrack_evaluation::tabular::quoted;

/// Latest episodes of each route that recent success is a fraction of: as many as a number has bits.
const WINDOW: u32 = u32::BITS;
/// Routes in a run's report.
const N_WORST: usize = 20;
/// Names of the file's columns.
const HEAD: &str =
    "route,roundabout,island_radius,lane,exit,episodes,arrived,failed,timed_out,success,recent_success\n";

/// Episodes on one route.
#[derive(Debug, Clone, Copy, Default)]
struct Counts {
    episodes: u64,
    arrived: u64,
    timed_out: u64,
    /// A bit for each of the latest episodes, the latest lowest, set if it arrived.
    recent: u32,
}

/// What stays the same of a route.
#[derive(Debug)]
struct Name {
    route: String,
    roundabout: String,
    island_radius: Option<f64>,
    lane: &'static str,
    exit: u32,
}

/// Episodes on one route, as in the file and in a run's report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RouteCount {
    /// `16m/N-left-3`.
    pub route: String,
    /// The part of it before the last `/`.
    pub roundabout: String,
    /// Radius of the island (m); `None`, and nothing in the file, on a crossing.
    pub island_radius: Option<f64>,
    /// `left` or `right`.
    pub lane: &'static str,
    /// Number of the exit.
    pub exit: u32,
    /// Training episodes that ended.
    pub episodes: u64,
    /// Training episodes that arrived.
    pub arrived: u64,
    /// Training episodes that failed.
    pub failed: u64,
    /// Training episodes that ran out of time.
    pub timed_out: u64,
    /// Fraction of the training episodes that arrived.
    pub success: f64,
    /// Fraction of the latest training episodes that arrived.
    pub recent_success: f64,
}

/// The training routes on which the policy fails most.
#[derive(Debug, Serialize)]
pub struct WorstRoutes {
    /// Training routes.
    pub routes: usize,
    /// Latest episodes of each that `recent_success` is a fraction of, at most.
    pub window: u32,
    /// The routes with the least recent success, if it is below 1.
    pub worst: Vec<RouteCount>,
}

/// Episodes on every training route.
#[derive(Debug)]
pub struct RouteCounts {
    file: PathBuf,
    written: Option<Instant>,
    names: Vec<Name>,
    counts: Vec<Counts>,
    /// Index of each of the world's routes in `names`.
    indices: Vec<Option<usize>>,
}

impl RouteCounts {
    /// None yet; they will be written to `file`.
    pub fn new(scenario: &Scenario, file: PathBuf) -> RouteCounts {
        let all: Vec<_> = scenario.routes().collect();
        let mut indices = vec![None; all.len()];
        let name = |(index, &world_route): (usize, &u32)| {
            indices[world_route as usize] = Some(index);
            let (place, route) = all[world_route as usize];
            let roundabout = &scenario.places[place].roundabout;
            let (before, _) = route.name.rsplit_once('/').unwrap_or((&roundabout.name, ""));
            let (lane, exit) = (route.lane.seen(roundabout.is_mirrored()).name(), route.exit);
            Name {
                route: route.name.clone(),
                roundabout: before.to_owned(),
                island_radius: roundabout.has_ring().then(|| roundabout.island_radius()),
                lane,
                exit,
            }
        };
        let names: Vec<Name> = scenario.split(Split::Train).iter().enumerate().map(name).collect();
        RouteCounts { file, written: None, counts: vec![Counts::default(); names.len()], names, indices }
    }

    /// The file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Counts an episode.
    pub fn count(&mut self, RouteEnd { route, ended }: RouteEnd) {
        let Some(counts) = self.indices.get(route as usize).copied().flatten().map(|index| &mut self.counts[index])
        else {
            return;
        };
        let arrived = ended == Ended::Arrived;
        counts.episodes += 1;
        counts.arrived += u64::from(arrived);
        counts.timed_out += u64::from(ended == Ended::TimedOut);
        counts.recent = counts.recent << 1 | u32::from(arrived);
    }

    /// Whether it is time to write the file.
    pub fn is_due(&self) -> bool {
        self.written.is_none_or(|written| ROW_EVERY <= written.elapsed())
    }

    /// Writes the file, if there is an episode to count.
    pub fn write(&mut self) -> Result<(), Error> {
        self.written = Some(Instant::now());
        if !self.is_empty() {
            files::write_whole(&self.file, self.text().as_bytes())?;
        }
        Ok(())
    }

    fn is_empty(&self) -> bool {
        self.counts.iter().all(|counts| counts.episodes == 0)
    }

    fn text(&self) -> String {
        let mut text = HEAD.to_owned();
        for row in self.rows() {
            let RouteCount {
                route, roundabout, island_radius, lane, exit, episodes, arrived, failed, timed_out, ..
            } = &row;
            let fraction = |value: f64| if *episodes == 0 { String::new() } else { format!("{value:.4}") };
            let (success, recent) = (fraction(row.success), fraction(row.recent_success));
            let [route, roundabout] = [route, roundabout].map(|name| quoted(name));
            let radius = island_radius.map_or(String::new(), |radius| format!("{radius:.2}"));
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{route},{roundabout},{radius},{lane},{exit},\
                 {episodes},{arrived},{failed},{timed_out},{success},{recent}"
            );
        }
        text
    }

    fn rows(&self) -> impl Iterator<Item = RouteCount> {
        self.names.iter().zip(&self.counts).map(|(name, counts)| {
            let &Counts { episodes, arrived, timed_out, recent } = counts;
            RouteCount {
                route: name.route.clone(),
                roundabout: name.roundabout.clone(),
                island_radius: name.island_radius,
                lane: name.lane,
                exit: name.exit,
                episodes,
                arrived,
                failed: episodes - arrived - timed_out,
                timed_out,
                success: arrived as f64 / episodes.max(1) as f64,
                recent_success: f64::from(recent.count_ones()) / episodes.clamp(1, WINDOW.into()) as f64,
            }
        })
    }

    /// The routes on which the policy fails most; none before an episode was counted.
    pub fn worst(&self) -> Option<WorstRoutes> {
        let mut worst: Vec<RouteCount> =
            self.rows().filter(|row| 0 < row.episodes && row.recent_success < 1.0).collect();
        worst.sort_by(|a, b| a.recent_success.total_cmp(&b.recent_success).then(a.success.total_cmp(&b.success)));
        worst.truncate(N_WORST);
        (!self.is_empty()).then_some(WorstRoutes { routes: self.names.len(), window: WINDOW, worst })
    }

    /// Adds its columns to a checkpoint, if there is an episode to count.
    pub fn save(&self, columns: &mut Columns) {
        if self.is_empty() {
            return;
        }
        let counted = |value: fn(&Counts) -> u64| self.counts.iter().map(value).collect::<Vec<u64>>();
        columns.put(EPISODES, counted(|counts| counts.episodes));
        columns.put("routes, arrived", counted(|counts| counts.arrived));
        columns.put("routes, timed out", counted(|counts| counts.timed_out));
        columns.put("routes, recent", self.counts.iter().map(|counts| counts.recent).collect::<Vec<u32>>());
    }

    /// Continues counting where a checkpoint left off; from none where it has no such columns.
    pub fn restore(&mut self, stored: &Stored) -> Result<(), Error> {
        self.counts.fill(Counts::default());
        if stored.bytes(EPISODES).is_none() {
            return Ok(());
        }
        let n = self.names.len();
        let counted = |name: &str| stored.exactly::<u64>(name, n);
        let (episodes, arrived, timed_out) =
            (counted(EPISODES)?, counted("routes, arrived")?, counted("routes, timed out")?);
        let recent: Vec<u32> = stored.exactly("routes, recent", n)?;
        for (index, counts) in self.counts.iter_mut().enumerate() {
            *counts = Counts {
                episodes: episodes[index],
                arrived: arrived[index],
                timed_out: timed_out[index],
                recent: recent[index],
            };
            let Counts { episodes, arrived, timed_out, recent } = *counts;
            if arrived.checked_add(timed_out).is_none_or(|ended| episodes < ended)
                || arrived < recent.count_ones().into()
            {
                let name = &self.names[index].route;
                return Err(stored
                    .error(format!("has {arrived} arrivals of {episodes} episodes on {name}, {timed_out} timed out")));
            }
        }
        Ok(())
    }
}

/// A column of a checkpoint.
const EPISODES: &str = "routes, episodes";

#[cfg(test)]
mod tests {
    use offtrack::files::cache::Loading;

    use super::*;

    fn counted(file: PathBuf, ends: &[(u32, Ended)]) -> RouteCounts {
        let mut counts = RouteCounts::new(&Scenario::named("attard2023").unwrap(), file);
        ends.iter().for_each(|&(route, ended)| counts.count(RouteEnd { route, ended }));
        counts
    }

    #[test]
    fn each_episode_counts_for_its_route_by_its_end_and_the_latest_once_more() {
        let mut ends = vec![(1, Ended::TractorCollided); 20];
        ends.extend([(1, Ended::TimedOut), (0, Ended::Arrived), (1, Ended::Arrived)]);
        ends.extend([(1, Ended::Arrived); 23]);
        let counts = counted(PathBuf::new(), &ends);
        let text = counts.text();
        let lines: Vec<&str> = text.lines().collect();
        // Of the latest 32 episodes seven collided and one timed out.
        assert_eq!(lines[2].split_once("left,").unwrap().1, "3,45,24,20,1,0.5333,0.7500", "{text}");
        assert!(
            lines[1].ends_with(",left,2,1,1,0,0,1.0000,1.0000") && lines[3].ends_with(",left,4,0,0,0,0,,"),
            "{text}"
        );
        assert_eq!((lines.len(), lines[0].split(',').count()), (53, 11));
        let worst = counts.worst().unwrap();
        assert_eq!((worst.routes, worst.worst.len(), worst.worst[0].route.as_str()), (52, 1, "16m/E-left-3"));
    }

    #[test]
    fn without_an_episode_nothing_is_written_and_with_one_the_file_appears() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("routes.csv");
        let mut counts = counted(file.clone(), &[]);
        assert!(counts.worst().is_none() && counts.is_due());
        counts.write().unwrap();
        assert!(!file.exists() && !counts.is_due());
        counts.count(RouteEnd { route: 0, ended: Ended::Arrived });
        counts.write().unwrap();
        assert_eq!(std::fs::read_to_string(&file).unwrap(), counts.text());
    }

    #[test]
    fn a_name_with_a_comma_stays_one_cell_and_a_crossing_has_no_island() {
        let mut scenario = Scenario::named("attard2023").unwrap();
        scenario.places[0].routes.iter_mut().for_each(|route| route.name = "16m, old/E-left-2".to_owned());
        let text = RouteCounts::new(&scenario, PathBuf::new()).text();
        assert!(text.contains("\n\"16m, old/E-left-2\",\"16m, old\",7.85,left,2,0,"), "{text}");
        let keys = Scenario::text_of("maps2026-crossing").unwrap().replace("test = ", "train = ");
        let crossing = Scenario::parse("crossing", &keys, None, &Loading::PLAIN).unwrap();
        let text = RouteCounts::new(&crossing, PathBuf::new()).text();
        assert!(text.contains(",town03-crossing,,"), "{text}");
    }

    #[test]
    fn counts_go_through_a_checkpoint_and_wrong_ones_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let stored = |columns: &Columns| {
            let path = folder.path().join("checkpoint.safetensors");
            columns.write(&path, String::new(), 0).unwrap();
            Stored::read(&path).unwrap()
        };
        let counts = counted(PathBuf::new(), &[(3, Ended::Arrived), (3, Ended::RolledOver), (7, Ended::TimedOut)]);
        let mut columns = Columns::default();
        counts.save(&mut columns);
        let mut other = counted(PathBuf::new(), &[(5, Ended::Arrived)]);
        other.restore(&stored(&columns)).unwrap();
        assert_eq!(other.text(), counts.text());
        // From a checkpoint without counts they begin at 0.
        other.restore(&stored(&Columns::default())).unwrap();
        assert!(other.is_empty());
        let mut columns = Columns::default();
        let mut wrong = counted(PathBuf::new(), &[(3, Ended::Arrived)]);
        wrong.counts[3].episodes = 0;
        wrong.counts[4].episodes = 1;
        wrong.save(&mut columns);
        let message = other.restore(&stored(&columns)).unwrap_err().to_string();
        assert!(message.contains("1 arrivals of 0 episodes on 16m/"), "{message}");
    }
}
