//! The page of an evaluation and of the training run behind it: one HTML file that loads no other file.
//!
//! It holds the whole report, so that every figure can be checked, and every episode as gzipped columns of differences.

mod tracks;

use std::path::Path;

use offtrack::scenario::Scenario;
use offtrack::world::World;
use serde::Serialize;
use serde_json::{Value, json};

use crate::error::Error;
use crate::evaluation::report::Report;
use crate::files;
use crate::provenance;
use offtrack_drawing::recording::{self, Map, Measures, Track};

/// Most episodes that a page holds: about 15 MB.
pub const MOST_EPISODES: usize = 4000;

const TEMPLATE: &str = include_str!("page/report.html");
const STYLE: &str = include_str!("page/style.css");
/// In the order of the page; the last one starts the others.
const SCRIPTS: [&str; 9] = [
    include_str!("page/elements.js"),
    include_str!("page/data.js"),
    include_str!("page/headline.js"),
    include_str!("page/routes.js"),
    include_str!("page/curves.js"),
    include_str!("page/scene.js"),
    include_str!("page/replay.js"),
    include_str!("page/selftest.js"),
    include_str!("page/main.js"),
];

/// The contents of a page.
#[derive(Debug)]
pub struct Page<'a> {
    /// The benchmark.
    pub scenario: &'a Scenario,
    /// The benchmark, baked.
    pub world: &'a World,
    /// The report of the evaluation.
    pub evaluation: &'a Report,
    /// Its episodes, the same number for each route, in the order of the report's routes.
    pub tracks: &'a [Track],
    /// The training run as in its `report.json`; `Null` without one.
    pub run: Value,
    /// The text of the run's `metrics.csv`.
    pub metrics: Option<String>,
}

/// Roundabouts, routes, truck and episodes, as the page's scripts read them.
#[derive(Serialize)]
struct Ground<'a> {
    /// Time between two frames \[s].
    step: f64,
    vehicle: Measures,
    n_rays: usize,
    maps: Vec<Map>,
    routes: Vec<Route<'a>>,
    /// Name and unit of each column of the recorded episodes, in the order of the data.
    columns: Vec<(String, f64)>,
    episodes: Vec<Episode>,
    machine: String,
    commit: String,
}

#[derive(Serialize)]
struct Route<'a> {
    name: &'a str,
    /// Index into `maps`.
    roundabout: usize,
    centre_line: Vec<[f64; 2]>,
}

#[derive(Serialize)]
struct Episode {
    /// Index into `routes`.
    route: usize,
    /// Which of the route's episodes, from 0.
    number: usize,
    ended: &'static str,
    /// One for the start and one for each step.
    n_frames: usize,
}

impl Page<'_> {
    /// Writes the page to `file`.
    pub fn write(mut self, file: &Path) -> Result<(), Error> {
        let evaluation = json!(self.evaluation);
        match self.run.as_object_mut() {
            Some(run) => drop(run.insert("evaluation".to_owned(), evaluation)),
            None => self.run = json!({ "evaluation": evaluation }),
        }
        let columns = tracks::columns(self.world.params.sensor_range);
        let packed = tracks::packed(self.tracks, &columns).map_err(Error::write(file))?;
        let ground = self.ground(columns.iter().map(|column| (column.name.clone(), column.unit)).collect());
        let summary = &self.evaluation.summary;
        let (benchmark, split) = (&self.evaluation.benchmark, self.evaluation.split);
        let title =
            escaped(&format!("{:.1} % of {} episodes arrived, {benchmark} {split} routes", 100.0 * summary.success, summary.episodes));
        let page = filled(&[
            ("title", &title),
            ("heading", &escaped(&format!("Evaluation on {benchmark}, {split} routes"))),
            ("style", STYLE),
            ("report", &script_json(&self.run)),
            ("ground", &script_json(&json!(ground))),
            ("metrics", &script_json(&json!(self.metrics))),
            ("tracks", &packed),
            ("script", &SCRIPTS.concat()),
        ]);
        files::write_whole(file, page.as_bytes())
    }

    fn ground(&self, columns: Vec<(String, f64)>) -> Ground<'_> {
        let evaluated = &self.evaluation.routes;
        let found: Vec<_> =
            evaluated.iter().filter_map(|route| self.scenario.routes().find(|(_, known)| known.name == route.name)).collect();
        let mut roundabouts: Vec<usize> = found.iter().map(|&(roundabout, _)| roundabout).collect();
        roundabouts.dedup();
        let per_route = (self.tracks.len() / evaluated.len().max(1)).max(1);
        Ground {
            step: self.scenario.step,
            vehicle: Measures::of(self.world),
            n_rays: self.world.rays.len(),
            maps: roundabouts.iter().map(|&index| Map::of(&self.scenario.places[index].roundabout, self.scenario.gutter)).collect(),
            routes: found
                .iter()
                .map(|&(index, route)| Route {
                    name: &route.name,
                    roundabout: roundabouts.iter().position(|&other| other == index).unwrap_or(0),
                    centre_line: recording::centre_line(route),
                })
                .collect(),
            columns,
            episodes: self
                .tracks
                .iter()
                .enumerate()
                .map(|(index, track)| Episode {
                    route: index / per_route,
                    number: index % per_route,
                    ended: track.ended.name(),
                    n_frames: track.frames.len(),
                })
                .collect(),
            machine: provenance::machine(),
            commit: provenance::commit(),
        }
    }
}

/// The template with each `{{name}}` replaced by its value. Values are not searched for names.
fn filled(values: &[(&str, &str)]) -> String {
    let mut page = String::new();
    let mut rest = TEMPLATE;
    while let Some((before, (name, after))) = rest.split_once("{{").and_then(|(before, tail)| Some((before, tail.split_once("}}")?))) {
        page.push_str(before);
        page.push_str(values.iter().find(|&&(known, _)| known == name).map_or("", |&(_, value)| value));
        rest = after;
    }
    page + rest
}

/// JSON that can stand in a script element: no `<`, so that no text in it ends the element.
fn script_json(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// Text that can stand in HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_of_the_template_is_replaced_and_values_stay_as_they_are() {
        let names = ["title", "heading", "style", "report", "ground", "metrics", "tracks", "script"];
        let page = filled(&names.map(|name| (name, "{{title}}<kept>")));
        assert_eq!(page.matches("{{title}}<kept>").count(), names.len());
        assert_eq!(page.matches("{{").count(), page.matches("<kept>").count());
    }

    #[test]
    fn a_name_in_a_report_cannot_end_its_script_element() {
        let text = script_json(&json!({ "policy": "</script><script>alert(1)" }));
        assert!(!text.contains('<'), "{text}");
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap()["policy"], "</script><script>alert(1)");
    }
}
