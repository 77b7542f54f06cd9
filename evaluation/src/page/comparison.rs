//! The page of a comparison: its tables, and both sides of the episodes in which they differ, played side by side. One
//! HTML file that loads no other file.

use std::path::Path;

use offtrack::scenario::Scenario;
use offtrack::world::World;
use serde_json::json;

use super::ground::{Ground, Shown};
use super::{filled, script_json, tracks, vehicles};
use crate::comparison::Comparison;
use crate::error::Error;
use crate::files;
use crate::recording::Track;
use crate::tabular::html_text;

const TEMPLATE: &str = concat!(include_str!("head.html"), include_str!("comparison.html"));
const STYLE: &str = concat!(include_str!("theme.css"), include_str!("style.css"), include_str!("comparison.css"));
const SCRIPTS: [&str; 7] = [
    include_str!("elements.js"),
    include_str!("packed.js"),
    include_str!("truck.js"),
    include_str!("data.js"),
    include_str!("scene.js"),
    include_str!("clock.js"),
    include_str!("comparison.js"),
];

/// Most pairs of episodes that a page shows: about 2 MB.
pub const MOST_PAIRS: usize = 200;

/// Two episodes from the same start.
#[derive(Debug)]
pub struct Pair {
    /// Name of the side that is compared with the first one.
    pub name: String,
    /// The first side's episode; `env` is its index among all of the evaluation.
    pub first: Track,
    /// This side's.
    pub own: Track,
}

/// The contents of a page.
#[derive(Debug)]
pub struct ComparisonPage<'a> {
    /// The benchmark.
    pub scenario: &'a Scenario,
    /// The benchmark, baked.
    pub world: &'a World,
    /// The comparison.
    pub comparison: &'a Comparison,
    /// Names of the routes of the evaluations, in their order.
    pub routes: Vec<&'a str>,
    /// Pairs that are shown.
    pub pairs: Vec<Pair>,
}

impl ComparisonPage<'_> {
    /// Writes the page to `file`.
    pub fn write(mut self, file: &Path) -> Result<(), Error> {
        let ComparisonPage { scenario, world, comparison, .. } = self;
        // One after another, so that each road is there once.
        self.pairs.sort_by_key(|pair| pair.first.env);
        let names: Vec<String> = self.pairs.iter().map(|pair| pair.name.clone()).collect();
        let pairs: Vec<Track> = self.pairs.into_iter().flat_map(|pair| [pair.first, pair.own]).collect();
        let columns = tracks::columns(world.params.sensor_range);
        let (routes, per_route) = (self.routes, comparison.episodes);
        let shown = Shown { scenario, world, routes, per_route, tracks: &pairs };
        let (others, vehicles) = vehicles::packed(&pairs).unzip();
        let ground = json!(Ground::of(&shown, &columns, others)).to_string();
        let columns = [tracks::differences(&pairs, &columns), vehicles.unwrap_or_default()].concat();
        let packed = |bytes: &[u8]| tracks::packed(bytes).map_err(Error::write(file));
        let differing = comparison.differences.iter().flat_map(|difference| &difference.episodes);
        let differing = differing.filter(|episode| episode.is_pair()).count();
        let first = comparison.sides.first().map(|side| side.name.as_str());
        let heading = html_text(&comparison.heading());
        let page = filled(
            TEMPLATE,
            &[
                ("title", &heading),
                ("heading", &heading),
                ("style", STYLE),
                ("tables", &comparison.html()),
                ("pairs", &script_json(&json!({ "first": first, "names": names, "differing": differing }))),
                ("comparison", &script_json(&json!(comparison))),
                ("ground", &packed(ground.as_bytes())?),
                ("tracks", &packed(&columns)?),
                ("script", &SCRIPTS.concat()),
            ],
        );
        files::write_whole(file, page.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_of_the_template_is_replaced() {
        let names = ["title", "heading", "style", "tables", "pairs", "comparison", "ground", "tracks", "script"];
        let page = filled(TEMPLATE, &names.map(|name| (name, "<kept>")));
        assert_eq!(page.matches("<kept>").count(), names.len());
        assert!(!page.contains("{{"));
    }
}
