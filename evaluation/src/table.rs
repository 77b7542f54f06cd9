//! A report as text: a line a route, then the sums, within a given width, and what each column means. Of many routes
//! there are the groups and the worst routes alone.

use std::fmt::Write;

use offtrack::layout::Ended;

use super::among;
use super::classes;
use super::failures::Cause;
use super::groups::Group;
use super::report::{Report, RouteReport, Summary};

/// Lines of the worst roundabouts, and of the worst routes, where there are many routes.
const WORST: usize = 20;

/// Causes of failures that are told.
const CAUSES: usize = 8;

/// What each column of the table says.
const COLUMNS: [(&str, &str); 11] = [
    ("arrived", "episodes that arrived, of all"),
    ("success", "the same as a percentage"),
    ("95 % interval", "Wilson interval of the success, which takes all episodes as independent"),
    (
        "95 % over routes",
        "interval of the success by bootstrap, whole routes drawn with replacement: episodes of one route end alike",
    ),
    (
        "lane",
        "own: a truck whose front axle follows the lane's centre touches no kerb, and its lock allows that; wide: it \
         has to swing out of its lane",
    ),
    ("lane m", "distance of the tractor's middle, half way between its axles, to the lane's centre: mean and largest"),
    ("tractor m, trailer m", "smallest distance of the unit's outline to a kerb; negative: it overlaps the kerb"),
    ("LTR", "largest load transfer ratio of either unit: 0 on even wheels, 1 when a wheel lifts off"),
    ("artic deg", "largest articulation, the angle between tractor and trailer"),
    ("off-track", "largest off-tracking: distance of the trailer's axles to the path of the tractor's front axle [m]"),
    ("time s", "mean duration of an episode"),
];

/// Spaces between two columns.
const GAP: usize = 1;

/// One column: two lines of heading, and its text for a line of the table.
struct Column {
    head: [&'static str; 2],
    /// Columns with the highest rank are left out first where the table is too wide. Rank 0 always stays.
    rank: u32,
    text: fn(&Line) -> String,
}

/// One line of the table.
struct Line<'a> {
    name: String,
    lane: &'static str,
    summary: &'a Summary,
}

const ALL: [Column; 13] = [
    Column { head: ["", "route"], rank: 0, text: |line| line.name.clone() },
    Column {
        head: ["", "arrived"],
        rank: 0,
        text: |line| format!("{}/{}", line.summary.arrived, line.summary.episodes),
    },
    Column { head: ["success", "%"], rank: 0, text: |line| format!("{:.1}", 100.0 * line.summary.success) },
    Column {
        head: ["95 %", "interval"],
        rank: 1,
        text: |line| format!("{:.1}..{:.1}", 100.0 * line.summary.success_low, 100.0 * line.summary.success_high),
    },
    Column { head: ["", "lane"], rank: 2, text: |line| line.lane.to_owned() },
    Column { head: ["lane m", "mean"], rank: 3, text: |line| format!("{:.2}", line.summary.lane_distance_mean) },
    Column { head: ["lane m", "max"], rank: 4, text: |line| format!("{:.2}", line.summary.lane_distance_max) },
    Column { head: ["tractor", "m"], rank: 5, text: |line| format!("{:.2}", line.summary.tractor_clearance_min) },
    Column { head: ["trailer", "m"], rank: 6, text: |line| format!("{:.2}", line.summary.trailer_clearance_min) },
    Column { head: ["", "LTR"], rank: 7, text: |line| format!("{:.2}", line.summary.load_transfer_ratio_peak) },
    Column { head: ["artic", "deg"], rank: 8, text: |line| format!("{:.0}", line.summary.articulation_peak_deg) },
    Column { head: ["off-", "track"], rank: 9, text: |line| format!("{:.2}", line.summary.off_tracking_peak) },
    Column { head: ["time", "s"], rank: 10, text: |line| format!("{:.1}", line.summary.time_mean) },
];

/// Lines between two rules, and what they leave out.
struct Section<'a> {
    lines: Vec<Line<'a>>,
    note: Option<String>,
}

impl Report {
    /// The table that a person reads, at most `width` characters wide where that leaves room for the route and its
    /// success: a line a route, or where there are many a line for each group and the worst routes; then the sums, then
    /// what the columns mean.
    pub fn table(&self, width: usize) -> String {
        let mut sections = if self.has_many_routes() {
            self.groups_and_worst()
        } else {
            vec![whole(self.routes.iter().map(of_route))]
        };
        if !self.groups.demand.is_empty() {
            sections.push(whole(self.groups.demand.iter().map(|group| of_group(group, ""))));
        }
        let sums = [
            ("lane own", lane(true), self.own_lane_suffices.as_ref()),
            ("lane wide", lane(false), self.needs_deviation.as_ref()),
            ("certified", "", self.certified.as_ref()),
            ("possible", "", self.possible.as_ref().and_then(|possible| possible.summary.as_ref())),
            ("all", "", Some(&self.summary)),
        ];
        sections.push(whole(
            sums.into_iter()
                .filter_map(|(name, lane, summary)| Some(Line { name: name.into(), lane, summary: summary? })),
        ));
        let (columns, left_out) = fitting(width, &sections);
        let mut text = String::new();
        for row in 0..2 {
            push(&mut text, &columns, |column| column.head[row].to_owned());
        }
        let rule = "-".repeat(text.lines().map(str::len).max().unwrap_or(0));
        for Section { lines, note } in &sections {
            let _ = writeln!(text, "{rule}");
            for line in lines {
                push(&mut text, &columns, |column| (column.text)(line));
                push_interval(&mut text, line.summary, width);
                push_failures(&mut text, line.summary, width);
            }
            if let Some(note) = note {
                push_wrapped(&mut text, note, width);
            }
        }
        if let Some(outside) = self.summary.outside_lane_mean {
            let own = self.own_lane_suffices.as_ref().and_then(|summary| summary.outside_lane_mean);
            let own = own.map(|own| format!(", where the own lane suffices {:.1} %", 100.0 * own)).unwrap_or_default();
            push_wrapped(
                &mut text,
                &format!("Outside its own lane for {:.1} % of an episode that arrived{own}.", 100.0 * outside),
                width,
            );
        }
        if let Some((fraction, most)) = self.summary.on_apron.zip(self.summary.on_apron_max) {
            let percent = 100.0 * fraction;
            let line = format!(
                "On an apron with a wheel of the trailer in {percent:.1} % of the episodes, up to {most:.2} m."
            );
            push_wrapped(&mut text, &line, width);
        }
        let among = self.groups.demand.iter();
        let among = among.filter_map(|group| Some((&group.name, group.summary.among_vehicles.as_ref()?)));
        let lines = among.map(|(name, among)| (among.line(name), among.line_of_lanes(name)));
        let (among, of_lanes): (Vec<String>, Vec<String>) = lines.unzip();
        if !among.is_empty() {
            let _ = writeln!(text, "{}\n{}", among::HEADING, among.join("\n"));
            push_wrapped(&mut text, among::NOTE, width);
            let _ = writeln!(text, "{}\n{}", among::HEADING_OF_LANES, of_lanes.join("\n"));
            push_wrapped(&mut text, among::NOTE_OF_LANES, width);
        }
        for line in classes::lines(&self.classes) {
            let _ = writeln!(text, "{line}");
        }
        self.push_causes(&mut text, width);
        if let Some(possible) = &self.possible {
            push_wrapped(&mut text, &possible.note(), width);
        }
        if let Some(avoidable) = &self.avoidable {
            push_wrapped(&mut text, &avoidable.note(), width);
        }
        if !left_out.is_empty() {
            let names: Vec<String> =
                left_out.iter().map(|column| column.head.join(" ").trim().replace("- ", "-")).collect();
            push_wrapped(
                &mut text,
                &format!("Left out for want of width: {}. A wider terminal and --json have them.", names.join(", ")),
                width,
            );
        }
        text + "\n" + &legend(width)
    }

    /// The commonest causes of failures, and how many more there are.
    fn push_causes(&self, text: &mut String, width: usize) {
        let cause = |cause: &Cause| {
            let possible =
                cause.possible.map(|possible| format!(" ({possible} from a possible start)")).unwrap_or_default();
            format!("{} {}{possible}", cause.episodes, cause.cause)
        };
        let mut words: Vec<String> = self.failures.iter().take(CAUSES).map(cause).collect();
        if CAUSES < self.failures.len() {
            let rest = &self.failures[CAUSES..];
            words.push(format!(
                "{} for {} other causes",
                rest.iter().map(|cause| cause.episodes).sum::<usize>(),
                rest.len()
            ));
        }
        if !words.is_empty() {
            push_wrapped(text, &format!("Not arrived, by cause: {}.", words.join(", ")), width);
        }
    }

    /// Groups of routes, then the worst roundabouts and the worst routes.
    fn groups_and_worst(&self) -> Vec<Section<'_>> {
        let mut roundabouts: Vec<&Group> =
            self.groups.roundabout.iter().filter(|group| group.summary.arrived < group.summary.episodes).collect();
        roundabouts.sort_by(|a, b| a.summary.success.total_cmp(&b.summary.success));
        let roundabouts = roundabouts.into_iter().map(|group| of_group(group, ""));
        vec![
            whole(self.groups.island_radius.iter().map(|group| of_group(group, "island "))),
            whole(self.groups.lane.iter().map(|group| of_group(group, "lane "))),
            whole(self.groups.exit.iter().map(|group| of_group(group, "exit "))),
            worst(roundabouts, "roundabouts", self.groups.roundabout.len()),
            worst(self.failing_routes().into_iter().map(of_route), "routes", self.routes.len()),
        ]
    }
}

/// What the columns mean, a line each, wrapped to `width` characters.
pub fn legend(width: usize) -> String {
    let mut text = String::new();
    for (name, meaning) in COLUMNS {
        push_wrapped(&mut text, &format!("{name}: {meaning}"), width);
    }
    text
}

fn lane(own_suffices: bool) -> &'static str {
    if own_suffices { "own" } else { "wide" }
}

fn of_route(route: &RouteReport) -> Line<'_> {
    Line { name: route.name.clone(), lane: lane(route.own_lane_suffices), summary: &route.summary }
}

fn of_group<'a>(group: &'a Group, kind: &str) -> Line<'a> {
    Line { name: format!("{kind}{}", group.name), lane: "", summary: &group.summary }
}

fn whole<'a>(lines: impl Iterator<Item = Line<'a>>) -> Section<'a> {
    Section { lines: lines.collect(), note: None }
}

/// The first of the lines, which are those of things that failed, worst first, and a note of how many of `n` there are.
fn worst<'a>(failing: impl ExactSizeIterator<Item = Line<'a>>, things: &str, n: usize) -> Section<'a> {
    let n_failing = failing.len();
    let note = match n_failing {
        0 => format!("All {n} {things}: every episode arrived."),
        _ if n_failing <= WORST => format!("On the other {} of {n} {things} every episode arrived.", n - n_failing),
        _ => format!("The worst {WORST} of {n_failing} {things} with a failure, of {n}; --json and --html have all."),
    };
    Section { lines: failing.take(WORST).collect(), note: Some(note) }
}

/// The columns that fit, each with its width, and those left out.
fn fitting(width: usize, sections: &[Section]) -> (Vec<(&'static Column, usize)>, Vec<&'static Column>) {
    let widest = |column: &Column| {
        let cells = sections.iter().flat_map(|section| &section.lines).map(|line| (column.text)(line).chars().count());
        cells.chain(column.head.map(str::len)).max().unwrap_or(0)
    };
    let mut columns: Vec<(&Column, usize)> = ALL.iter().map(|column| (column, widest(column))).collect();
    let mut left_out = Vec::new();
    let total = |columns: &[(&Column, usize)]| columns.iter().map(|(_, width)| width + GAP).sum::<usize>() - GAP;
    while width < total(&columns) {
        let last =
            (0..columns.len()).max_by_key(|&index| columns[index].0.rank).filter(|&index| 0 < columns[index].0.rank);
        let Some(last) = last else { break };
        left_out.insert(0, columns.remove(last).0);
    }
    (columns, left_out)
}

/// Appends a line of cells: the first column to the left, the others to the right.
fn push(text: &mut String, columns: &[(&Column, usize)], cell: impl Fn(&Column) -> String) {
    let mut line = String::new();
    for (index, (column, width)) in columns.iter().enumerate() {
        let cell = cell(column);
        // Writing to a string cannot fail.
        let _ = if index == 0 { write!(line, "{cell:<width$}") } else { write!(line, "{:GAP$}{cell:>width$}", "") };
    }
    text.push_str(line.trim_end());
    text.push('\n');
}

/// Appends the interval over routes, on a line of its own; nothing of one route, or where every route is alike.
fn push_interval(text: &mut String, summary: &Summary, width: usize) {
    let ends = summary.success_low_over_routes.zip(summary.success_high_over_routes);
    if let Some((low, high)) = ends.filter(|(low, high)| low < high) {
        push_wrapped(text, &format!("  95 % over routes: {:.1}..{:.1}", 100.0 * low, 100.0 * high), width);
    }
}

/// Appends how the episodes that did not arrive ended, on a line of its own; nothing where all arrived.
fn push_failures(text: &mut String, summary: &Summary, width: usize) {
    let failures = summary.ends.iter().filter(|&(&name, &count)| name != Ended::Arrived.name() && 0 < count);
    let words: Vec<String> = failures.map(|(name, count)| format!("{count} {}", name.replace('_', " "))).collect();
    if !words.is_empty() {
        push_wrapped(text, &format!("  not arrived: {}", words.join(", ")), width);
    }
}

/// Appends `words` in lines of at most `width` characters; those after the first are indented.
fn push_wrapped(text: &mut String, words: &str, width: usize) {
    let indent = words.len() - words.trim_start().len();
    let mut line = " ".repeat(indent);
    let mut empty = true;
    for word in words.split_whitespace() {
        if !empty && width < line.chars().count() + 1 + word.chars().count() {
            text.push_str(&line);
            text.push('\n');
            line = " ".repeat(indent + 4);
            empty = true;
        }
        if !empty {
            line.push(' ');
        }
        line.push_str(word);
        empty = false;
    }
    text.push_str(&line);
    text.push('\n');
}

#[cfg(test)]
mod tests;
