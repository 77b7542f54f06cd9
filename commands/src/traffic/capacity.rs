//! Capacities of entry lanes beside circulating flows, and their plot.

use std::collections::BTreeMap;

use glam::DVec2;
use offtrack::layout::Stream;
use offtrack::traffic::hcm::Lane;
use offtrack::traffic::survey::{Counts, Saturated};
use offtrack::traffic::{Mix, Rules, Survey};
use offtrack_drawing::chart::{Chart, Kind, LINES, Line, Panel, Scales};
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;
use rayon::prelude::*;
use serde::Serialize;

use super::{Args, LargeShare, Place, STEPS_A_MINUTE, bar, rounded, setting, table, taken_away, write_json};
use crate::plot;

/// Circulating flows (veh/h).
const FLOWS: [f64; 5] = [0.0, 300.0, 600.0, 900.0, 1200.0];
/// Width of a PNG (pixels).
const WIDTH: u32 = 1200;

/// What was found of an entry lane beside one flow; cars an hour.
#[derive(Serialize)]
struct Point {
    /// Index of its circulating flow among [`FLOWS`].
    #[serde(skip)]
    flow: usize,
    road: String,
    arm: String,
    lane: &'static str,
    /// Lanes of the entry and of the ring, in the manual's words.
    lanes: &'static str,
    circulating: f64,
    capacity: f64,
    hcm: f64,
    /// Of the vehicles of its arm, where large ones were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    large: Option<LargeShare>,
    /// Its cars meet those of the arm's other lane on their way, which the manual does not know: it counts for no mean.
    lanes_meet: bool,
    /// Vehicles of the arm that stood in a blocked ring for two minutes and were taken away.
    removed: u64,
}

/// A queue without end at one arm, beside one flow.
struct Case<'a> {
    place: &'a Place,
    survey: &'a Survey<'a>,
    flow: usize,
    saturated: Saturated,
}

/// Runs the command with --capacity.
pub(super) fn run(args: &Args, places: &[Place], mix: Mix) -> Result<(), Error> {
    if let Some(place) = places.iter().find(|place| !place.network.has_ring) {
        let expected = "has no ring, and the manual's capacities are those of roundabouts: leave it out";
        return Err(setting("--capacity", &place.road.name, expected));
    }
    let rules = Rules::FITTED;
    let surveys = places.iter().map(|place| place.survey(&rules)).collect::<Result<Vec<Survey>, Error>>()?;
    let mut cases = Vec::new();
    for (place, survey) in places.iter().zip(&surveys) {
        let n_before = cases.len();
        for arm in 0..place.network.n_arms {
            for (flow, circulating) in FLOWS.into_iter().enumerate() {
                let saturated = survey.saturated(arm, circulating, mix);
                let saturated = saturated.map_err(|error| setting("ROAD", &place.road.name, &error.to_string()))?;
                cases.extend(saturated.map(|saturated| Case { place, survey, flow, saturated }));
            }
        }
        if cases.len() == n_before {
            let expected = "no entry can be measured there: cars of other arms must pass it, and its own must have an \
                            exit before they come to these arms; leave the road or --capacity out";
            return Err(setting("ROAD", &place.road.name, expected));
        }
    }
    let bar = bar(cases.len() * args.runs as usize);
    let found = cases.par_iter().map(|case| {
        let counted = |run: u32| {
            let counts = case.survey.saturated_counts(
                &case.saturated,
                args.minutes * STEPS_A_MINUTE,
                Stream { seed: args.seed, env: run },
            );
            bar.advance();
            counts
        };
        let runs = (0..args.runs).into_par_iter().map(counted).collect::<Vec<Vec<Counts>>>();
        case.points(&runs, f64::from(args.runs) * f64::from(args.minutes) / 60.0, mix)
    });
    let points: Vec<(Lane, Point)> = found.collect::<Vec<_>>().into_iter().flatten().collect();
    drop(bar);
    files::print(&text(&points))?;
    if let Some(file) = &args.plot {
        plot::write(file, chart(args, &points).drawn(), WIDTH)?;
    }
    write_json(args, &points.iter().map(|(_, point)| point).collect::<Vec<_>>())
}

impl Case<'_> {
    /// The capacity of each lane of the arm.
    fn points(&self, runs: &[Vec<Counts>], hours: f64, mix: Mix) -> Vec<(Lane, Point)> {
        let mut all = Counts::default();
        runs.iter().flatten().for_each(|counts| all.add(counts));
        let large = LargeShare::of(mix, &all);
        let of = |(index, &source): (usize, &usize)| {
            let (arm, lane) = self.place.source_name(source);
            let kind = self.survey.lane(source);
            let sum = |count: fn(&Counts) -> u64| runs.iter().map(|counts| count(&counts[index])).sum::<u64>() as f64;
            let [capacity, circulating] =
                [sum(|counts| counts.served), sum(|counts| counts.circulating)].map(|n| n / hours);
            let point = Point {
                flow: self.flow,
                road: self.place.road.name.clone(),
                arm,
                lane,
                lanes: kind.name(self.place.road.is_mirrored()),
                circulating,
                capacity,
                hcm: kind.capacity(circulating, large.came),
                large: (0.0 < large.asked).then_some(large),
                lanes_meet: self.saturated.lanes_meet[index],
                removed: runs.iter().map(|counts| counts[index].removed).sum(),
            };
            (kind, point)
        };
        self.saturated.sources.iter().enumerate().map(of).collect()
    }
}

/// Means over all lanes of a kind that meet no other of their arm, flow by flow: of the flow, of the capacity with its
/// least and greatest, of the manual's.
struct Mean {
    circulating: f64,
    capacity: f64,
    least: f64,
    most: f64,
    hcm: f64,
}

/// The kinds of lanes and their means, flow by flow.
fn means(points: &[(Lane, Point)]) -> BTreeMap<Lane, (&'static str, Vec<Mean>)> {
    let mut kinds: BTreeMap<Lane, (&'static str, Vec<Vec<&Point>>)> = BTreeMap::new();
    for (kind, point) in points.iter().filter(|(_, point)| !point.lanes_meet) {
        let (_, flows) = kinds.entry(*kind).or_insert_with(|| (point.lanes, FLOWS.map(|_| Vec::new()).to_vec()));
        flows[point.flow].push(point);
    }
    let mean = |points: Vec<&Point>| {
        let of = |value: fn(&Point) -> f64| points.iter().map(|point| value(point)).sum::<f64>() / points.len() as f64;
        let capacities = || points.iter().map(|point| point.capacity);
        let (least, most) = (capacities().fold(f64::INFINITY, f64::min), capacities().fold(0.0, f64::max));
        let [circulating, capacity, hcm] =
            [of(|point| point.circulating), of(|point| point.capacity), of(|point| point.hcm)];
        Mean { circulating, capacity, least, most, hcm }
    };
    let of_kind = |(kind, (name, flows)): (Lane, (_, Vec<Vec<&Point>>))| {
        (kind, (name, flows.into_iter().filter(|points| !points.is_empty()).map(mean).collect()))
    };
    kinds.into_iter().map(of_kind).collect()
}

fn deviation(found: f64, hcm: f64) -> String {
    format!("{:+.0} %", 100.0 * (found / hcm - 1.0))
}

fn text(points: &[(Lane, Point)]) -> String {
    let mut rows = vec![
        ["road", "entry", "lane", "lanes", "circulating", "capacity", "HCM", "deviation", ""]
            .map(str::to_owned)
            .to_vec(),
    ];
    for (_, point) in points {
        let mut row = vec![point.road.clone(), point.arm.clone(), point.lane.to_owned(), point.lanes.to_owned()];
        row.extend([point.circulating, point.capacity, point.hcm].map(|flow| rounded(flow, 0)));
        row.push(deviation(point.capacity, point.hcm));
        row.push(if point.lanes_meet { "lanes meet" } else { "" }.to_owned());
        rows.push(row);
    }
    let mut sums = vec![
        ["lanes", "", "circulating", "capacity", "HCM", "deviation", "least", "greatest"].map(str::to_owned).to_vec(),
    ];
    for (name, means) in means(points).into_values() {
        for mean in means {
            let mut row = vec![name.to_owned(), String::new()];
            row.extend([mean.circulating, mean.capacity, mean.hcm].map(|flow| rounded(flow, 0)));
            row.push(deviation(mean.capacity, mean.hcm));
            row.extend([mean.least, mean.most].map(|flow| rounded(flow, 0)));
            sums.push(row);
        }
    }
    let note = if points.iter().any(|(_, point)| point.lanes_meet) {
        "lanes meet: its cars meet those of the arm's other lane on their way; such lanes count for no mean\n"
    } else {
        ""
    };
    let removed = taken_away(points.iter().map(|(_, point)| point.removed).sum());
    let fewer: BTreeMap<&str, String> =
        points.iter().filter_map(|(_, point)| Some((point.road.as_str(), point.large?.note()?))).collect();
    let fewer: String = fewer.into_iter().map(|(road, note)| format!("{road}: {note}")).collect();
    format!("{}{note}{removed}{fewer}\nmeans over all lanes of a kind\n{}", table(&rows), table(&sums))
}

/// The means with the least and greatest of each, and the manual's curves.
fn chart(args: &Args, points: &[(Lane, Point)]) -> Chart {
    let mut lines = Vec::new();
    let heavy = points.iter().filter_map(|(_, point)| point.large).map(|large| large.came).sum::<f64>()
        / points.len().max(1) as f64;
    for ((kind, (name, means)), colour) in means(points).into_iter().zip(LINES) {
        let curve =
            (0..=26).map(|step| f64::from(step) * 50.0).map(|flow| DVec2::new(flow, kind.capacity(flow, heavy)));
        lines.push(Line { name: None, colour, kind: Kind::Reference, points: curve.collect() });
        let spread = means.iter().map(|mean| (mean.least, mean.most)).collect();
        let points = means.iter().map(|mean| DVec2::new(mean.circulating, mean.capacity)).collect();
        lines.push(Line { name: Some(name), colour, kind: Kind::Measured(spread), points });
    }
    let roads = args.roads.len();
    let on = if roads == 1 { format!("on {}", args.roads[0]) } else { format!("on {roads} roads") };
    Chart {
        title: format!("Capacity of entry lanes {on}"),
        subtitles: vec![
            "Means over lanes of a kind that meet no other of their arm, with the least and the greatest.".to_owned(),
            "Dashed: Highway Capacity Manual, equations 22-1 to 22-5.".to_owned(),
        ],
        panels: vec![Panel {
            title: "Lanes of the entry into lanes of the ring",
            x: "Circulating flow [veh/h]",
            y: "Capacity [veh/h]",
            scales: Scales::Linear,
            lines,
        }],
    }
}
