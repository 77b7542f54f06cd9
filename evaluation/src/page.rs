//! The page of an evaluation and of the training run behind it: one HTML file that loads no other file.
//!
//! It holds the whole report, so that every figure can be checked, and the episodes that it shows as gzipped columns of
//! differences. Roundabouts and routes without such an episode are left out.

pub mod comparison;
mod ground;
mod tracks;
mod vehicles;

use std::path::Path;

use offtrack::scenario::Scenario;
use offtrack::world::World;
use serde_json::{Value, json};

use crate::error::Error;
use crate::files;
use crate::recording::Track;
use crate::report::Report;
use crate::tabular::html_text;
use ground::{Ground, Shown};
pub(crate) use tracks::packed;

const TEMPLATE: &str = concat!(include_str!("page/head.html"), include_str!("page/report.html"));
const STYLE: &str = concat!(include_str!("page/theme.css"), include_str!("page/style.css"));
/// Scripts in the order of the page; the last one starts the others.
const SCRIPTS: [&str; 17] = [
    include_str!("page/elements.js"),
    include_str!("page/packed.js"),
    include_str!("page/truck.js"),
    include_str!("page/data.js"),
    include_str!("page/headline.js"),
    include_str!("page/routes.js"),
    include_str!("page/groups.js"),
    include_str!("page/chart.js"),
    include_str!("page/curves.js"),
    include_str!("page/training.js"),
    include_str!("page/scene.js"),
    include_str!("page/clock.js"),
    include_str!("page/replay.js"),
    include_str!("page/profiles.js"),
    include_str!("page/classes.js"),
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
    /// The episodes that it shows, in order. `env` is the index of an episode among all, of which each of the report's
    /// routes has the same number.
    pub tracks: &'a [Track],
    /// The training run as in its `report.json`; `Null` without one.
    pub run: Value,
    /// The text of the run's `metrics.csv`.
    pub metrics: Option<String>,
}

impl Page<'_> {
    /// Writes the page to `file`.
    pub fn write(mut self, file: &Path) -> Result<(), Error> {
        let columns = tracks::columns(self.world.params.sensor_range);
        let routes: Vec<&str> = self.evaluation.routes.iter().map(|route| route.name.as_str()).collect();
        let per_route = (self.evaluation.summary.episodes / routes.len().max(1)).max(1);
        let Page { scenario, world, tracks, .. } = self;
        let shown = Shown { scenario, world, routes, per_route, tracks };
        let (others, vehicles) = vehicles::packed(tracks).unzip();
        let mut ground = Ground::of(&shown, &columns, others);
        let mut evaluation = json!(self.evaluation);
        if self.evaluation.has_many_routes() {
            // Gzipped with the ground: of thousands of routes this is most of the report.
            ground.route_reports = Some(rounded(evaluation["routes"].take()));
        }
        // A row of the page for each further evaluation; their routes are in the report's own file.
        for also in self
            .run
            .get_mut("also")
            .and_then(Value::as_array_mut)
            .into_iter()
            .flatten()
            .filter_map(Value::as_object_mut)
        {
            also.retain(|name, _| name != "routes" && name != "groups");
        }
        let ground = json!(ground).to_string();
        match self.run.as_object_mut() {
            Some(run) => drop(run.insert("evaluation".to_owned(), evaluation)),
            None => self.run = json!({ "evaluation": evaluation }),
        }
        let columns = [tracks::differences(self.tracks, &columns), vehicles.unwrap_or_default()].concat();
        let [ground, tracks] = [ground.into_bytes(), columns].map(|bytes| tracks::packed(&bytes));
        let (ground, tracks) = (ground.map_err(Error::write(file))?, tracks.map_err(Error::write(file))?);
        let summary = &self.evaluation.summary;
        let (benchmark, split) = (&self.evaluation.benchmark, self.evaluation.split);
        let title = html_text(&format!(
            "{:.1} % of {} episodes arrived, {benchmark} {split} routes",
            100.0 * summary.success,
            summary.episodes
        ));
        let values = [
            ("title", title.as_str()),
            ("heading", &html_text(&format!("Evaluation on {benchmark}, {split} routes"))),
            ("style", STYLE),
            ("report", &script_json(&self.run)),
            ("ground", &ground),
            ("metrics", &script_json(&json!(self.metrics))),
            ("tracks", &tracks),
            ("script", &SCRIPTS.concat()),
        ];
        let page = filled(TEMPLATE, &values);
        files::write_whole(file, page.as_bytes())
    }
}

/// A JSON value with its floating-point numbers rounded to four decimals.
fn rounded(value: Value) -> Value {
    match value {
        Value::Array(values) => values.into_iter().map(rounded).collect(),
        Value::Object(values) => values.into_iter().map(|(name, value)| (name, rounded(value))).collect(),
        Value::Number(number) if number.is_f64() => {
            number.as_f64().map_or(Value::Null, |value| json!((1e4 * value).round() / 1e4))
        }
        other => other,
    }
}

/// A template with each `{{name}}` replaced by its value. Values are not searched for names.
pub(crate) fn filled(template: &str, values: &[(&str, &str)]) -> String {
    let mut page = String::new();
    let mut rest = template;
    while let Some((before, (name, after))) =
        rest.split_once("{{").and_then(|(before, tail)| Some((before, tail.split_once("}}")?)))
    {
        page.push_str(before);
        page.push_str(values.iter().find(|&&(known, _)| known == name).map_or("", |&(_, value)| value));
        rest = after;
    }
    page + rest
}

/// JSON that can stand in a script element: no `<`, so that no text in it ends the element.
pub(crate) fn script_json(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_of_the_template_is_replaced_and_values_stay_as_they_are() {
        let names = ["title", "heading", "style", "report", "ground", "metrics", "tracks", "script"];
        let page = filled(TEMPLATE, &names.map(|name| (name, "{{title}}<kept>")));
        assert_eq!(page.matches("{{title}}<kept>").count(), names.len());
        assert_eq!(page.matches("{{").count(), page.matches("<kept>").count());
    }

    #[test]
    fn a_name_in_a_report_cannot_end_its_script_element() {
        let text = script_json(&json!({ "policy": "</script><script>alert(1)" }));
        assert!(!text.contains('<'), "{text}");
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap()["policy"], "</script><script>alert(1)");
    }

    #[test]
    fn of_a_rounded_report_only_fractions_lose_digits() {
        let report = |mean: f64, least: f64| {
            json!({ "routes": [
                { "mean": mean, "least": least, "episodes": 123_456_789, "none": null, "name": "a" },
            ] })
        };
        assert_eq!(rounded(report(0.123_456_78, -2.000_04)), report(0.1235, -2.0));
    }
}
