//! Delay, queue and level of service of each entry lane at a demand.

use offtrack::layout::Stream;
use offtrack::traffic::hcm::{control_delay, level_of_lane, queue_95};
use offtrack::traffic::survey::Counts;
use offtrack::traffic::{Mix, Rules};
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;
use rayon::prelude::*;
use serde::Serialize;

use super::{Args, LargeShare, Place, STEPS_A_MINUTE, bar, rounded, setting, table, taken_away, write_json};
use crate::progress::Bar;

/// Period of the manual's delays and queues (h).
const PERIOD: f64 = 0.25;

/// What was found on a road.
#[derive(Serialize)]
struct Found {
    road: String,
    runs: u32,
    minutes: u32,
    entries: Vec<Entry>,
    /// Mean control delay of all (s), and its level, F where more came than could be served; none where no car got
    /// through.
    delay: Option<f64>,
    level: Option<char>,
    /// Cars an hour, asked for and through.
    demand: f64,
    served: f64,
    /// Part of those who came that found 15 waiting, and stayed away.
    stayed: f64,
    /// How many stood in a blocked ring for two minutes, and were taken away.
    removed: u64,
    /// Part of the time in which cars waited outside since as many as can be were on the road.
    crowded: f64,
    /// Where large vehicles were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    large: Option<LargeShare>,
}

/// What was found of an entry lane; flows in cars an hour, delays in seconds, queues in cars.
#[derive(Serialize)]
struct Entry {
    arm: String,
    lane: &'static str,
    demand: f64,
    served: f64,
    circulating: f64,
    delay: Option<f64>,
    /// F where more came than the lane could serve.
    level: Option<char>,
    queue_95: usize,
    /// The manual's, on a ring.
    #[serde(skip_serializing_if = "Option::is_none")]
    hcm: Option<Manual>,
}

/// What the manual gives for the lane, its demand and the flow that circulated.
#[derive(Serialize)]
struct Manual {
    lanes: &'static str,
    capacity: f64,
    delay: f64,
    level: char,
    queue_95: f64,
}

/// Runs the command at a demand.
pub(super) fn run(args: &Args, places: &[Place], mix: Mix) -> Result<(), Error> {
    let bar = bar(places.len() * args.runs as usize);
    let found = places.iter().map(|place| found(args, place, mix, &bar)).collect::<Result<Vec<Found>, Error>>()?;
    drop(bar);
    files::print(&found.iter().map(|one| one.text()).collect::<Vec<_>>().join("\n"))?;
    write_json(args, &found)
}

fn found(args: &Args, place: &Place, mix: Mix, bar: &Bar) -> Result<Found, Error> {
    let rules = Rules::FITTED;
    let survey = place.survey(&rules)?;
    let (demand, flows) = place.demand(&args.demand, mix)?;
    let total: f64 = flows.iter().sum();
    if total == 0.0 {
        return Err(setting("--demand", &args.demand, "nobody drives: give more than 0 cars an hour"));
    }
    let runs = (0..args.runs).into_par_iter().map(|run| {
        let counts = survey.counted(&demand, args.minutes * STEPS_A_MINUTE, Stream { seed: args.seed, env: run }, &[]);
        bar.advance();
        counts
    });
    let mut sums = vec![Counts::default(); place.network.sources.len()];
    for counts in runs.collect::<Vec<_>>() {
        sums.iter_mut().zip(&counts).for_each(|(sum, counts)| sum.add(counts));
    }
    let hours = f64::from(args.runs) * f64::from(args.minutes) / 60.0;
    let mut all = Counts::default();
    sums.iter().for_each(|counts| all.add(counts));
    let entry = |(source, counts): (usize, &Counts)| {
        let (arm, lane) = place.source_name(source);
        let demand: f64 = flows[place.network.paths_of(source)].iter().sum();
        let [served, circulating] = [counts.served, counts.circulating].map(|count| count as f64 / hours);
        let hcm = place.network.has_ring.then(|| {
            let kind = survey.lane(source);
            let capacity = kind.capacity(circulating, all.heavy());
            let delay = control_delay(demand, capacity, PERIOD);
            let queue_95 = queue_95(demand, capacity, PERIOD);
            let level = level_of_lane(delay, capacity < demand);
            Manual { lanes: kind.name(place.road.is_mirrored()), capacity, delay, level, queue_95 }
        });
        let (delay, queue_95) = (counts.mean_delay(), counts.queue_95());
        // Who still stands at the end has no delay yet, but has waited.
        let level = counts.least_mean_delay().map(|delay| level_of_lane(delay, counts.is_over_capacity()));
        Entry { arm, lane, demand, served, circulating, delay, level, queue_95, hcm }
    };
    let most_crowded = sums.iter().map(|counts| counts.crowded).max().unwrap_or(0);
    let steps = f64::from(args.runs) * f64::from(args.minutes * STEPS_A_MINUTE);
    Ok(Found {
        road: place.road.name.clone(),
        runs: args.runs,
        minutes: args.minutes,
        entries: sums.iter().enumerate().map(entry).collect(),
        delay: all.mean_delay(),
        level: all.least_mean_delay().map(|delay| level_of_lane(delay, all.is_over_capacity())),
        demand: total,
        served: all.served as f64 / hours,
        stayed: all.stayed as f64 / all.came.max(1) as f64,
        removed: all.removed,
        large: (0.0 < mix.heavy()).then(|| LargeShare::of(mix, &all)),
        crowded: most_crowded as f64 / steps,
    })
}

/// In place of what nobody was there to count for.
const NOBODY: &str = "-";
const HEAD: [&str; 12] = [
    "entry",
    "lane",
    "demand",
    "served",
    "circulating",
    "delay s",
    "level",
    "queue 95 %",
    "HCM: capacity",
    "delay s",
    "level",
    "queue 95 %",
];

fn seconds(delay: Option<f64>) -> String {
    delay.map_or_else(|| NOBODY.to_owned(), |delay| rounded(delay, 1))
}

fn letter(level: Option<char>) -> String {
    level.map_or_else(|| NOBODY.to_owned(), String::from)
}

impl Found {
    fn text(&self) -> String {
        let mut rows = vec![HEAD.map(str::to_owned).to_vec()];
        if self.entries.iter().all(|entry| entry.hcm.is_none()) {
            rows[0].truncate(8);
        }
        for entry in &self.entries {
            let mut row = vec![entry.arm.clone(), entry.lane.to_owned()];
            row.extend([entry.demand, entry.served, entry.circulating].map(|flow| rounded(flow, 0)));
            row.extend([seconds(entry.delay), letter(entry.level), entry.queue_95.to_string()]);
            if let Some(hcm) = &entry.hcm {
                row.extend([rounded(hcm.capacity, 0), rounded(hcm.delay, 1)]);
                row.extend([hcm.level.to_string(), rounded(hcm.queue_95, 1)]);
            }
            rows.push(row);
        }
        let mut all = vec!["all".to_owned(), String::new()];
        all.extend([rounded(self.demand, 0), rounded(self.served, 0), String::new()]);
        all.extend([seconds(self.delay), letter(self.level)]);
        rows.push(all);
        let away = if 0.0 < self.stayed {
            format!(
                "{} % found 15 cars waiting and stayed away: their delay is not counted.\n",
                rounded(100.0 * self.stayed, 1)
            )
        } else {
            String::new()
        };
        let removed = taken_away(self.removed);
        let crowded = if 0.0 < self.crowded {
            let part = rounded(100.0 * self.crowded, 1);
            format!("{part} % of the time as many were on the road as can be, and others waited for that alone.\n")
        } else {
            String::new()
        };
        let length = if self.runs == 1 { "1 run".to_owned() } else { format!("{} runs", self.runs) };
        format!(
            "{}: cars an hour over {length} of {} min\n{}{away}{removed}{crowded}{}",
            self.road,
            self.minutes,
            table(&rows),
            self.large.as_ref().and_then(LargeShare::note).unwrap_or_default()
        )
    }
}
