//! A comparison as text for a person, and as tables for a paper.

use super::{Comparison, Difference, Differing, Estimate, Figure, Figures, GroupDifference, SideFigures};
use crate::tabular;
use offtrack::files::reader::printable;

/// Most rows of single routes and roundabouts, and most single episodes, in a text for a person.
const MOST_ROWS: usize = 20;

impl Figure {
    const ALL: [Figure; 5] =
        [Figure::Success, Figure::LaneDistance, Figure::Time, Figure::Clearance, Figure::LoadTransferRatio];

    /// Its name in CSV, with the unit.
    fn key(self) -> &'static str {
        match self {
            Figure::Success => "success",
            Figure::LaneDistance => "lane_distance_m",
            Figure::Time => "time_s",
            Figure::Clearance => "clearance_m",
            Figure::LoadTransferRatio => "load_transfer_ratio",
        }
    }

    /// Its heading.
    fn title(self) -> &'static str {
        match self {
            Figure::Success => "success (%)",
            Figure::LaneDistance => "lane distance (m)",
            Figure::Time => "time (s)",
            Figure::Clearance => "clearance (m)",
            Figure::LoadTransferRatio => "load transfer ratio",
        }
    }

    /// A value as people read it.
    fn shown(self, value: f64) -> String {
        let (value, decimals) = match self {
            Figure::Success => (100.0 * value, 1),
            Figure::LaneDistance | Figure::Clearance => (value, 3),
            Figure::Time => (value, 2),
            Figure::LoadTransferRatio => (value, 3),
        };
        let text = format!("{value:.decimals$}");
        // A difference that is rounded to 0 has no sign.
        if text.trim_start_matches('-').bytes().all(|byte| matches!(byte, b'0' | b'.')) {
            text.trim_start_matches('-').to_owned()
        } else {
            text
        }
    }

    /// The ends of an interval; none of one without width, which says nothing.
    fn interval(self, estimate: &Estimate) -> String {
        let ends = estimate.low.zip(estimate.high).filter(|(low, high)| low < high);
        ends.map_or_else(|| "-".to_owned(), |(low, high)| format!("{} to {}", self.shown(low), self.shown(high)))
    }

    fn mean(self, figures: &Figures) -> String {
        figures.get(self).map_or_else(|| "-".to_owned(), |estimate| self.shown(estimate.mean))
    }
}

/// A table with its heading.
struct Table {
    caption: String,
    rows: Vec<Vec<String>>,
}

impl Comparison {
    /// What a person reads: sides, differences, and where they differ, with the commonest alone of many.
    pub fn text(&self) -> String {
        let mut text = self.heading() + ".\n";
        for Table { caption, rows } in self.tables(MOST_ROWS) {
            text += &format!("\n{caption}\n\n{}", tabular::markdown(&rows));
        }
        for difference in &self.differences {
            text += &format!("\n{}", difference.episodes_text());
        }
        text
    }

    /// All tables in Markdown, each under its heading.
    pub fn markdown(&self) -> String {
        let mut text = self.heading() + ".\n";
        for Table { caption, rows } in self.tables(usize::MAX) {
            text += &format!("\n**{caption}**\n\n{}", tabular::markdown(&rows));
        }
        text
    }

    /// All tables for LaTeX, each as a `tabular` of the package `booktabs` below a comment.
    pub fn latex(&self) -> String {
        let mut text = format!("% {}.\n% \\usepackage{{booktabs}}\n", self.heading());
        for Table { caption, rows } in self.tables(usize::MAX) {
            text += &format!("\n% {caption}\n{}", tabular::latex(&rows));
        }
        text
    }

    /// All tables in HTML, each under its heading.
    pub(crate) fn html(&self) -> String {
        let table = |Table { caption, rows }: Table| {
            let caption = tabular::html_text(&caption);
            format!("<h3>{caption}</h3>\n<div class=\"scroll\" tabindex=\"0\">{}</div>\n", tabular::html(&rows))
        };
        self.tables(MOST_ROWS).into_iter().map(table).collect()
    }

    /// Every figure in full, a row each: of a side, of a side less the first one, and of both in groups.
    pub fn csv(&self) -> String {
        let head = ["side", "less", "kind", "name", "routes", "figure", "first", "own", "value", "low", "high"];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        let number = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
        let ends = |estimate: &Estimate| [Some(estimate.mean), estimate.low, estimate.high].map(number);
        let routes = self.routes.to_string();
        for SideFigures { name, figures, success_low, success_high, .. } in &self.sides {
            if let Some(Estimate { mean, .. }) = figures.success {
                let names = [name, "", "all", "", &routes, "success_over_episodes", "", ""].map(str::to_owned);
                rows.push(
                    names.into_iter().chain([mean, *success_low, *success_high].map(|end| end.to_string())).collect(),
                );
            }
            for figure in Figure::ALL {
                let Some(estimate) = figures.get(figure) else { continue };
                let names = [name, "", "all", "", &routes, figure.key(), "", ""].map(str::to_owned);
                rows.push(names.into_iter().chain(ends(&estimate)).collect());
            }
        }
        for Difference { name, to, first, own, difference, groups, .. } in &self.differences {
            for figure in Figure::ALL {
                let Some(estimate) = difference.get(figure) else { continue };
                let [first, own] = [first, own].map(|side| number(side.get(figure).map(|estimate| estimate.mean)));
                let names = [name, to, "all", "", &routes, figure.key(), &first, &own].map(str::to_owned);
                rows.push(names.into_iter().chain(ends(&estimate)).collect());
            }
            for group in groups {
                let [first, own] = [group.first, group.own].map(|value| value.to_string());
                let n = group.routes.to_string();
                let names = [name, to, group.kind, &group.name, &n, Figure::Success.key(), &first, &own];
                rows.push(names.map(str::to_owned).into_iter().chain(ends(&group.difference)).collect());
            }
        }
        tabular::csv(&rows)
    }

    pub(crate) fn heading(&self) -> String {
        let Comparison { benchmark, split, seed, routes, episodes, .. } = self;
        format!("{benchmark}, {} routes: {routes}, {episodes} episodes each, seed {seed} of the starts", split.name())
    }

    /// The tables, with at most `most` rows of single routes and roundabouts.
    fn tables(&self, most: usize) -> Vec<Table> {
        let mut tables = vec![self.of_sides()];
        for difference in &self.differences {
            tables.push(difference.of_figures());
            let differing = difference.of_groups(most);
            if 1 < differing.rows.len() {
                tables.push(differing);
            }
        }
        tables
    }

    fn of_sides(&self) -> Table {
        let several = self.sides.iter().any(|side| 1 < side.files.len());
        let mut head = vec!["".to_owned()];
        if several {
            head.push("training seeds".into());
        }
        head.extend(["arrived".into(), Figure::Success.title().into(), "95 %".into()]);
        if several {
            head.push("worst seed (%)".into());
        }
        head.extend(Figure::ALL[1..].iter().map(|figure| figure.title().to_owned()));
        let row = |side: &SideFigures| {
            let mut row = vec![side.name.clone()];
            if several {
                row.push(side.files.len().to_string());
            }
            row.push(format!("{}/{}", side.arrived, side.episodes));
            row.push(Figure::Success.mean(&side.figures));
            let shown = |value: f64| Figure::Success.shown(value);
            let ends = |success: Estimate| success.ends_or_wilson(side.arrived, side.episodes, shown);
            row.push(side.figures.success.map_or_else(|| "-".into(), ends));
            if several {
                row.push(Figure::Success.shown(side.worst));
            }
            row.extend(Figure::ALL[1..].iter().map(|figure| figure.mean(&side.figures)));
            row
        };
        let over = if several { "routes and training seeds" } else { "routes" };
        let caption =
            format!("Each side: success with its 95 % interval over {over}; the rest of episodes that arrived");
        Table { caption, rows: std::iter::once(head).chain(self.sides.iter().map(row)).collect() }
    }
}

impl Difference {
    fn of_figures(&self) -> Table {
        let Difference { name, to, common, first, own, difference, .. } = self;
        let head = ["", to, name, "difference", "95 %"].map(str::to_owned).to_vec();
        let row = |figure: &Figure| {
            let estimate = difference.get(*figure)?;
            let means = [first, own].map(|side| figure.mean(side));
            let cells = [figure.title().to_owned(), means[0].clone(), means[1].clone(), figure.shown(estimate.mean)];
            Some(cells.into_iter().chain([figure.interval(&estimate)]).collect())
        };
        let caption = format!(
            "{} less {}, in pairs: success, and the rest of the {common} episodes that arrive everywhere",
            printable(name),
            printable(to)
        );
        Table { caption, rows: std::iter::once(head).chain(Figure::ALL.iter().filter_map(row)).collect() }
    }

    /// Success in the groups in which it differs; of single routes and of roundabouts those that differ most.
    fn of_groups(&self, most: usize) -> Table {
        let head = ["", "", "routes", &self.to, &self.name, "difference (%)", "95 %"].map(str::to_owned).to_vec();
        let mut rows = vec![head];
        for kind in ["roundabout", "exit", "island_radius", "lane", "class", "route"] {
            let differs = |group: &&GroupDifference| group.kind == kind && group.difference.mean != 0.0;
            let mut groups: Vec<&GroupDifference> = self.groups.iter().filter(differs).collect();
            if most < groups.len() {
                groups.sort_by(|a, b| b.difference.mean.abs().total_cmp(&a.difference.mean.abs()));
                groups.truncate(most);
            }
            rows.extend(groups.into_iter().map(|group| {
                let [first, own, difference] =
                    [group.first, group.own, group.difference.mean].map(|value| Figure::Success.shown(value));
                let interval = Figure::Success.interval(&group.difference);
                vec![words(kind), group.name.clone(), group.routes.to_string(), first, own, difference, interval]
            }));
        }
        let caption = format!("Success where {} and {} differ", printable(&self.name), printable(&self.to));
        Table { caption, rows }
    }

    /// Which episodes arrive on one side alone.
    fn episodes_text(&self) -> String {
        let Difference { name, to, episodes, .. } = self;
        if episodes.is_empty() {
            return format!("{name} arrives in the same episodes as {to}.\n");
        }
        let more = episodes.iter().filter(|episode| episode.first < episode.own).count();
        let mut text = format!(
            "{name} arrives where {to} does not, or more often, in {more} episodes; the reverse in {}:\n",
            episodes.len() - more
        );
        let (gained, lost) = episodes.split_at(more);
        // Those that differ most stand at both ends.
        let shown = gained.iter().take(MOST_ROWS / 2).chain(lost.iter().rev().take(MOST_ROWS / 2));
        for Differing { route, episode, first, own, first_ended, own_ended, .. } in shown {
            let side = |name: &str, fraction: f64, ended: &str| match fraction {
                0.0 | 1.0 => format!("{name} {}", words(ended)),
                _ => format!("{name} arrived in {:.0} % of its files", 100.0 * fraction),
            };
            let sides = [side(to, *first, first_ended), side(name, *own, own_ended)];
            text += &format!("  {route}, episode {episode}: {}\n", sides.join(", "));
        }
        if MOST_ROWS / 2 < gained.len().max(lost.len()) {
            text += "  and more; --json has all\n";
        }
        text
    }
}

fn words(name: &str) -> String {
    match name {
        "class" => "vehicle, load".to_owned(),
        _ => name.replace('_', " "),
    }
}
