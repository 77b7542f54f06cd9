//! A benchmark: what to drive, with which actions and for which reward.
//!
//! A benchmark file and the files it refers to are checked completely when they are read. Every error names file, key,
//! value and what would do.

mod benchmark_keys; // the file as written
mod referred; // files that it refers to
mod read; // the file as checked
mod roads; // its roundabouts and routes
mod part; // a part of a scenario, or another roundabout in it
mod check; // a scenario changed in memory
mod fleet; // vehicles by shares, drawn from ranges
mod reward; // the keys of its reward
mod disturbances; // what the world does to a policy
mod traffic; // other vehicles on its roads

use std::collections::HashSet;
use std::path::Path;

use crate::files::cache::Loading;
use crate::files::reader::Error;
use crate::files::shipped::{Kind, Source};
use crate::layout::{Action, ObservedExtras};
use crate::map::route::Route;
use crate::map::{Gutter, Road};
use crate::vehicle::Vehicle;
pub use check::Invalid;
pub use disturbances::Disturbances;
pub use fleet::{Class, Drawn, Entry, Fleet, Member, N_VEHICLES, Ranges};
pub use reward::{REWARD_KEYS, Reward, RewardChanges, RewardKey};
pub use traffic::Traffic;

/// Default length of a route before the ring (m).
pub const APPROACH: f64 = 40.0;
/// Default length of a route after the ring (m).
pub const DEPARTURE: f64 = 35.0;
/// Default distance between waypoints (m).
pub const WAYPOINT_SPACING: f64 = 2.0;
/// Default width of the distance field's cells (m).
pub const FIELD_CELL: f64 = 1.0;

/// What the time limit is a multiple of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Clock {
    /// The time that the route takes at the highest target speed.
    #[default]
    HighestSpeed,
    /// The time of the feasible speed profile of the vehicle and load on the route: see [`crate::vehicle::profile`].
    Feasible,
}

/// What an action is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ActionKind {
    /// An index into a table of steer levels and speeds.
    #[default]
    Levels,
    /// A steer angle and a speed: a [`Command`](crate::layout::Command).
    Continuous,
}

crate::named! {
    /// The three disjoint sets of a benchmark's routes, by their keys in a benchmark file.
    #[derive(serde::Serialize, serde::Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Split {
        /// Routes for training.
        Train = "train",
        /// Routes for choosing among policies: neither trained on nor reported.
        Validation = "validation",
        /// Routes for evaluation only.
        Test = "test",
    }
}

/// A roundabout of a benchmark, with the routes that the benchmark uses.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// The roundabout.
    pub roundabout: Road,
    /// Routes of all splits, each once, in the roundabout's order.
    pub routes: Vec<Route>,
}

/// A benchmark: roundabouts, routes and their split, vehicle, actions, reward. SI units and radians.
///
/// Equal scenarios give equal worlds.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The file's stem.
    pub name: String,
    /// The vehicle; of several the first as its file has it, for pictures and for the lock that actions are fractions
    /// of.
    pub vehicle: Vehicle,
    /// Name of one of the vehicle's loads.
    pub load: String,
    /// The vehicles that episodes draw from, where there are several.
    pub fleet: Option<Fleet>,
    /// Lock of the front wheels in place of the vehicle's own (rad).
    pub steer_max: Option<f64>,
    /// The lock that steer levels are fractions of where it is not that of the first vehicle: part of a benchmark has
    /// the actions of the whole (rad).
    pub(crate) lock_of_levels: Option<f64>,
    /// Whether a gutter may be driven on.
    pub gutter: Gutter,
    /// Duration of a step (s).
    pub step: f64,
    /// Physics sub-steps in a step.
    pub n_substeps: u32,
    /// Width of the distance field's cells (m).
    pub cell: f64,
    /// What an action is.
    pub action_kind: ActionKind,
    /// Steer levels as fractions of the lock, left positive; empty where actions are continuous.
    pub steer_levels: Vec<f64>,
    /// Target speeds; where actions are continuous, and with `speed_changes`, the lowest and highest of them bound the
    /// target (m/s).
    pub speeds: Vec<f64>,
    /// By how much an action may change the target speed; empty where an action states the target itself (m/s).
    pub speed_changes: Vec<f64>,
    /// Range of the distance sensors (m).
    pub sensor_range: f64,
    /// What is observed beside the observation.
    pub extras: ObservedExtras,
    /// Whether other vehicles are observed.
    pub observes_vehicles: bool,
    /// What the world does to a policy.
    pub disturbances: Disturbances,
    /// Other vehicles on its roads.
    pub traffic: Option<Traffic>,
    /// Largest lateral offset at the start (m).
    pub start_offset: f64,
    /// Largest heading error at the start (rad).
    pub start_heading: f64,
    /// Least and greatest speed at the start; the highest target speed where there is none (m/s).
    pub start_speed: Option<[f64; 2]>,
    /// Largest fraction of the route that lies behind at the start.
    pub start_along: f64,
    /// Distance to the next waypoint beyond which the truck has strayed (m).
    pub stray_distance: f64,
    /// Articulation beyond which the truck is jackknifed (rad).
    pub jackknife_angle: f64,
    /// Load transfer ratio from which the truck has rolled over.
    pub rollover_ratio: f64,
    /// An episode's time limit, as a multiple of the time that the clock gives for the route.
    pub time_limit: f64,
    /// What the time limit is a multiple of.
    pub clock: Clock,
    /// The weights and limits of its reward.
    pub reward: Reward,
    /// Length of a route before the ring (m).
    pub approach: f64,
    /// Length of a route after the ring (m).
    pub departure: f64,
    /// Distance between waypoints (m).
    pub spacing: f64,
    /// The roundabouts.
    pub places: Vec<Place>,
    /// Routes of each split, in the order of [`Split::ALL`].
    splits: [Vec<u32>; 3],
}

impl Scenario {
    /// Reads a benchmark file and every file that it refers to. Their paths are relative to it.
    ///
    /// # Errors
    ///
    /// The file and, for a value that makes no sense, its key, the value and what would do.
    pub fn read(path: &Path) -> Result<Scenario, Error> {
        Scenario::from_source(&Source::Disk(path.to_owned()), &Loading::PLAIN)
    }

    /// A benchmark that comes with the library.
    ///
    /// ```
    /// use offtrack::scenario::{Scenario, Split};
    ///
    /// let scenario = Scenario::named("attard2023")?;
    /// assert_eq!(scenario.split(Split::Train).len(), 52);
    /// assert_eq!(scenario.split(Split::Test).len(), 23);
    /// # Ok::<(), offtrack::files::reader::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`], which lists the known names.
    pub fn named(name: &str) -> Result<Scenario, Error> {
        Scenario::from_source(&Source::named(Kind::Benchmark, name)?, &Loading::PLAIN)
    }

    /// Reads a file where `name_or_path` ends in `.toml` or is the path of a file; else the same as
    /// [`Scenario::named`].
    ///
    /// # Errors
    ///
    /// The errors of [`Scenario::read`] and [`Scenario::named`].
    pub fn find(name_or_path: &str) -> Result<Scenario, Error> {
        Scenario::load(name_or_path, &Loading::PLAIN)
    }

    /// Finds a benchmark as [`Scenario::find`], telling of progress, and with a cache of what is known of random roads.
    ///
    /// # Errors
    ///
    /// The errors of [`Scenario::find`], and [`Error::Stopped`].
    pub fn load(name_or_path: &str, loading: &Loading) -> Result<Scenario, Error> {
        Scenario::from_source(&Source::find(Kind::Benchmark, name_or_path)?, loading)
    }

    /// Reads the text of a benchmark that is in no file. What it refers to lies relative to `folder`; without one it is
    /// a file that comes with the library, `vehicles/daf_xf.toml`, or lies relative to the process's folder.
    ///
    /// ```
    /// use offtrack::files::cache::Loading;
    /// use offtrack::scenario::Scenario;
    ///
    /// let slow = Scenario::text_of("attard2023")?.replace("speeds_kmh = [30.0]", "speeds_kmh = [20.0]");
    /// let scenario = Scenario::parse("slow", &slow, None, &Loading::PLAIN)?;
    /// assert_eq!(scenario.cruising_speed(), 20.0 / 3.6);
    /// # Ok::<(), offtrack::files::reader::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// Those of [`Scenario::load`], which name the text `slow (a text)`.
    pub fn parse(name: &str, text: &str, folder: Option<&Path>, loading: &Loading) -> Result<Scenario, Error> {
        let source = Source::Text { name: name.to_owned(), text: text.to_owned(), folder: folder.map(Path::to_owned) };
        Scenario::from_source(&source, loading)
    }

    /// A benchmark's text without its roads, which are neither read nor drawn: [`Scenario::add`] gives it others. What
    /// else it refers to is a file that comes with the library, or lies relative to the process's folder.
    ///
    /// # Errors
    ///
    /// Those of [`Scenario::parse`].
    pub fn without_roads(name: &str, text: &str) -> Result<Scenario, Error> {
        let source = Source::Text { name: name.to_owned(), text: text.to_owned(), folder: None };
        Ok(Scenario::before_roads(&source)?.0)
    }

    /// The text of a benchmark's file, found as by [`Scenario::find`].
    ///
    /// # Errors
    ///
    /// A name that is not known, and a file that cannot be read.
    pub fn text_of(name_or_path: &str) -> Result<String, Error> {
        Source::find(Kind::Benchmark, name_or_path)?.text()
    }

    /// Indices of a split's routes in the world's table.
    pub fn split(&self, split: Split) -> &[u32] {
        &self.splits[split as usize]
    }

    /// Names of a split's routes.
    pub fn split_names(&self, split: Split) -> Vec<&str> {
        let names: Vec<&str> = self.routes().map(|(_, route)| route.name.as_str()).collect();
        self.split(split).iter().map(|&route| names[route as usize]).collect()
    }

    /// Names of a split's routes that another scenario has in its split `of`.
    pub fn shared_names(&self, split: Split, other: &Scenario, of: Split) -> Vec<&str> {
        let others: HashSet<&str> = other.split_names(of).into_iter().collect();
        self.split_names(split).into_iter().filter(|name| others.contains(name)).collect()
    }

    /// Every route in the order of the world's table, with its roundabout's index in `places`.
    pub fn routes(&self) -> impl Iterator<Item = (usize, &Route)> {
        self.places.iter().enumerate().flat_map(|(index, place)| place.routes.iter().map(move |route| (index, route)))
    }

    /// The action table: pairs of a steer angle and a target speed or a change of it, the speed varying slowest. Where
    /// actions are continuous it is what commands of -1 and of 1 ask for.
    pub fn actions(&self) -> Vec<Action> {
        let lock = self.lock_of_levels() as f32;
        let pair = |speed: f64, level: f64| Action { steering: level as f32 * lock, speed: speed as f32 };
        let speeds = if self.speed_changes.is_empty() { &self.speeds } else { &self.speed_changes };
        if self.action_kind == ActionKind::Continuous {
            let [lowest, highest] = ends(speeds);
            return vec![pair(lowest, -1.0), pair(highest, 1.0)];
        }
        speeds.iter().flat_map(|&speed| self.steer_levels.iter().map(move |&level| pair(speed, level))).collect()
    }

    /// The lowest and the highest target speed (m/s).
    pub fn speed_range(&self) -> [f64; 2] {
        ends(&self.speeds)
    }

    /// The highest target speed: trucks start with it, and time limits are computed with it, where the benchmark does
    /// not say otherwise (m/s).
    pub fn cruising_speed(&self) -> f64 {
        self.speeds.iter().copied().fold(0.0, f64::max)
    }
}

/// The lowest and the highest of some numbers.
fn ends(values: &[f64]) -> [f64; 2] {
    let values = || values.iter().copied();
    [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
}
