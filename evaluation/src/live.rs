//! The live page: one HTML file in which thousands of trucks drive by the simulator's own shaders, in a browser.
//!
//! Shaders go in as text. What a host must know of them (kernels and their order, buffers, layouts, tables) is printed
//! here, so that no script repeats it. Tables and policies are gzipped; the page loads no other file.

pub mod bake;
mod code;
mod journal;
mod packed;
mod reported;
mod worlds;

use std::path::Path;
use std::sync::Arc;

use offtrack::engine::tables::Tables;
use offtrack::layout::buffers::Table;
use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use offtrack_policy::Policy;
use serde_json::{Value, json};

use crate::error::Error;
use crate::kept::Kept;
use crate::page::{filled, script_json};
use crate::tabular::html_text;
use crate::{files, provenance};
use packed::Packed;

const TEMPLATE: &str = concat!(include_str!("page/head.html"), include_str!("live/live.html"));
/// What the page shares with that of a report, and its own.
const STYLES: &[&str] = &[include_str!("page/theme.css"), include_str!("live/style.css")];
/// What the policy of a page's contents allows it beside its own script, if it bakes roads: WebAssembly, in a worker.
const BAKES: &str = " 'wasm-unsafe-eval'; worker-src blob:";
/// The worker.
const WORKER: &str = include_str!("live/worker.js");
/// The shaders of the picture.
const VIEW: &str = concat!(include_str!("live/view.wgsl"), "\n", include_str!("live/vehicles.wgsl"));
/// Scripts in the order of the page; the last one starts the others.
const SCRIPTS: &[&str] = &[
    include_str!("page/elements.js"),
    include_str!("page/packed.js"),
    include_str!("page/truck.js"),
    include_str!("live/data.js"),
    include_str!("live/device.js"),
    include_str!("live/world.js"),
    include_str!("live/batch.js"),
    include_str!("live/rows.js"),
    include_str!("live/safetensors.js"),
    include_str!("live/policy.js"),
    // What is seen.
    include_str!("live/picture.js"),
    include_str!("live/sites.js"),
    include_str!("live/camera.js"),
    include_str!("live/stage.js"),
    include_str!("live/charts.js"),
    include_str!("live/crowd.js"),
    include_str!("live/followed.js"),
    include_str!("live/driving.js"),
    include_str!("live/visit.js"),
    include_str!("live/results.js"),
    include_str!("live/controls.js"),
    include_str!("live/drop.js"),
    include_str!("live/baker.js"),
    include_str!("live/learned.js"),
    include_str!("live/address.js"),
    include_str!("live/scripted.js"),
    include_str!("live/app.js"),
    include_str!("live/main.js"),
];

/// Rows of a benchmark's table of vehicles on the page, where they take 69 kB; 4096 would take 1.1 MB.
pub const N_VEHICLES: usize = 256;

/// A benchmark to drive on.
#[derive(Debug)]
pub struct Ground {
    /// The benchmark.
    pub scenario: Scenario,
    /// The benchmark, baked.
    pub world: Arc<World>,
    /// The text of the benchmark's file; `None` of one that comes with the program.
    pub text: Option<String>,
    /// Whether it is the program's benchmark with all of its roads and routes, to which reported results belong.
    pub is_whole: bool,
}

/// A benchmark as pages have it: with [`N_VEHICLES`] at most, and each truck alone on its road.
pub fn shown(mut scenario: Scenario) -> Scenario {
    if let Some(traffic) = &mut scenario.traffic {
        traffic.group = 1;
    }
    if let Some(fleet) = &mut scenario.fleet {
        fleet.n_vehicles = fleet.n_vehicles.min(N_VEHICLES);
    }
    scenario
}

/// The contents of a page.
#[derive(Debug)]
pub struct Live {
    /// The benchmarks, the first one shown first.
    pub grounds: Vec<Ground>,
    /// The policies to choose from, in this order.
    pub policies: Vec<Policy>,
    /// A training run whose policies a slider goes through.
    pub run: Option<TrainingRun>,
    /// What bakes roads in the page: the simulator as WebAssembly.
    pub baker: Option<Vec<u8>>,
    /// The seed that the page begins with.
    pub seed: u32,
}

/// A training run as a page shows it.
#[derive(Debug)]
pub struct TrainingRun {
    /// The run's name.
    pub name: String,
    /// The policies that it kept, in their order.
    pub kept: Vec<(Kept, Policy)>,
    /// The policy that it left.
    pub left: Policy,
}

impl TrainingRun {
    /// Its policies from first to last: when each was kept, and nothing of the one that it left.
    pub fn policies(&self) -> impl Iterator<Item = (Option<Kept>, &Policy)> {
        let kept = self.kept.iter().map(|(kept, policy)| (Some(*kept), policy));
        kept.chain([(None, &self.left)])
    }
}

/// A part of a page and its length (bytes).
pub type Part = (&'static str, usize);

impl Live {
    /// Writes the page to `file`, and says what its parts weigh.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write(&self, file: &Path) -> Result<Vec<Part>, Error> {
        let mut packed = Packed::default();
        let code = code::printed(&mut packed);
        let of_run: Vec<(Option<Kept>, &Policy)> = self.run.iter().flat_map(TrainingRun::policies).collect();
        let others = self.policies.iter().map(|policy| ("policies", policy));
        let kinds: Vec<(&'static str, &Policy)> =
            others.chain(of_run.iter().map(|&(_, policy)| ("run", policy))).collect();
        let all: Vec<&Policy> = kinds.iter().map(|&(_, policy)| policy).collect();
        let worlds: Vec<_> = self.grounds.iter().map(|ground| worlds::printed(ground, &all, &mut packed)).collect();
        let mut described = |(kind, policy): &(&'static str, &Policy)| {
            json!({
                "name": policy.name,
                "benchmark": policy.benchmark,
                "section": packed.add(kind, &policy.to_bytes()),
                "reported": reported::of(&policy.name),
            })
        };
        let policies: Vec<_> = kinds.iter().map(&mut described).collect();
        let run = self.run.as_ref().map(|run| {
            let each = (self.policies.len()..).zip(&of_run);
            let policies = each.map(|(index, (kept, _))| json!({ "policy": index, "kept": kept }));
            json!({ "name": run.name, "policies": policies.collect::<Vec<_>>() })
        });
        let facts = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "commit": provenance::commit(),
            "seed": self.seed,
            "layout": code::fingerprint(),
            "baker": self.baker.as_ref().map(|baker| packed.add("baker", baker)),
            "world_file": WORLD_FILE,
            "code": code,
            "worlds": worlds,
            "policies": policies,
            "run": run,
            "sections": packed.sections(),
        });
        let (facts, script, style) = (script_json(&facts), SCRIPTS.concat(), STYLES.concat());
        let names: Vec<&str> = self.grounds.iter().map(|ground| ground.scenario.name.as_str()).collect();
        let (tables, mut parts) = packed.written().map_err(Error::write(file))?;
        let page = filled(
            TEMPLATE,
            &[
                ("title", &html_text(&format!("trucks on {}", names.join(", ")))),
                ("allowed", if self.baker.is_some() { BAKES } else { "" }),
                ("style", &style),
                ("facts", &facts),
                ("packed", &tables),
                ("view", VIEW),
                ("worker", if self.baker.is_some() { WORKER } else { "" }),
                ("script", &script),
            ],
        );
        files::write_whole(file, page.as_bytes())?;
        parts.extend([("facts", facts.len()), ("scripts and styles", script.len() + style.len() + VIEW.len())]);
        parts.push(("in all", page.len()));
        Ok(parts)
    }
}

/// First words of a world file. The number is that of its form: behind it the checksum of the line of facts, which
/// comes next; then the lines of sections, whose gzip has its own.
const WORLD_FILE: &str = "offtrack-world 2";

impl Ground {
    /// Writes the benchmark to `file`, to be dropped on a page, and says what its parts weigh.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write(&self, file: &Path) -> Result<Vec<Part>, Error> {
        let (facts, packed) = self.printed();
        let facts = facts.to_string();
        let facts = format!("{WORLD_FILE} {}\n{facts}\n", crc32fast::hash(facts.as_bytes()));
        let (tables, mut parts) = packed.written().map_err(Error::write(file))?;
        files::write_whole(file, [facts.as_bytes(), tables.as_bytes()].concat().as_slice())?;
        parts.extend([("facts", facts.len()), ("in all", facts.len() + tables.len())]);
        Ok(parts)
    }

    /// The first table with more than `most` bytes, by its name, and its bytes.
    pub fn table_above(&self, most: usize) -> Option<(&'static str, usize)> {
        let tables = Tables::new(&self.world);
        let sized = Table::ALL.iter().filter_map(|table| Some((table.name(), tables.bytes(*table)?.len())));
        sized.into_iter().find(|(_, n_bytes)| most < *n_bytes)
    }

    /// The facts of a file with this benchmark alone, and its sections.
    fn printed(&self) -> (Value, Packed) {
        let mut packed = Packed::default();
        let world = worlds::printed(self, &[], &mut packed);
        let (version, layout) = (env!("CARGO_PKG_VERSION"), code::fingerprint());
        let facts = json!({ "version": version, "layout": layout, "world": world, "sections": packed.sections() });
        (facts, packed)
    }
}

/// The splits that have routes, each with the indices of its routes.
fn splits(scenario: &Scenario) -> impl Iterator<Item = (Split, &[u32])> {
    Split::ALL.into_iter().map(|split| (split, scenario.split(split))).filter(|(_, routes)| !routes.is_empty())
}
