//! How well a policy drives tractor-trailers through roundabouts. The crate `offtrack_policy` is its file.
//!
//! A policy that comes with the project, one truck on each route that it never saw in training, until every episode has
//! ended:
//!
//! ```
//! use std::sync::Arc;
//!
//! use offtrack::prelude::*;
//! use offtrack_policy::Policy;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scenario = Scenario::named("attard2023")?;
//! let world = Arc::new(World::bake(&scenario)?);
//! let policy = Policy::shipped("attard2023")?;
//! let routes = scenario.split(Split::Test).to_vec();
//! let mut simulator = Simulator::new(world, routes.len(), 0, RouteChoice::Fixed(routes))?;
//! while simulator.batch().ended.contains(&(Ended::Running as u32)) {
//!     simulator.step(&policy.act(&simulator.batch().observation))?;
//! }
//! let arrived = simulator.batch().ended.iter().filter(|&&ended| ended == Ended::Arrived as u32).count();
//! println!("{arrived} of {} trucks arrived", simulator.n_envs());
//! # assert!(20 <= arrived && simulator.n_envs() == 23, "{arrived}");
//! # Ok(())
//! # }
//! ```
//!
//! An [`Evaluation`] drives every route of a split from drawn starts, and makes a [`report::Report`] of every episode.

pub mod error; // what can go wrong
pub mod files; // results, written whole
pub mod provenance; // machine and commit of a result
pub mod device; // what steps the trucks
mod controller; // what chooses the actions
pub mod placed; // a learned policy where the trucks are
pub mod policies; // a policy by its name, and the baselines: pure pursuit, random
mod seen; // what is looked at after a step
pub mod episodes; // one a truck, until every one has ended
mod sequences; // the actions of episodes
mod evaluation; // every route, every start, every episode counted
mod part; // entry, ring and exit of a route
mod running; // an episode under way
pub mod tabular; // rows as Markdown, LaTeX, CSV
pub mod seeds; // figures of several seeds
mod rank; // percentiles
pub mod interval; // intervals over routes, by bootstrap
pub mod figures; // the figures of several, to their ends
pub mod driving; // how a truck drives through an episode
pub mod among; // how it drives among other vehicles
pub mod episode; // the figures of an episode, and of several
pub mod classes; // how trucks drive, by vehicle and load
pub mod failures; // why episodes did not arrive
pub mod certificate; // routes shown to be possible
pub mod actions; // an evaluation's, in a file
pub mod fits; // whether a truck fits through a road
pub mod possible; // success over the starts that are shown to be possible
pub mod avoidable; // contacts that could have been avoided
pub mod groups; // routes that have something in common
pub mod report; // figures of an evaluation
mod table; // a report as text
pub mod polygons; // curves as points
pub mod recording; // the states of an episode
pub mod outcomes; // how each episode ended
pub mod comparison; // evaluations in pairs
pub mod board; // entries that are simulated again
pub mod kept; // the policies that a training run keeps on its way
pub mod run_file; // names of a training run's files
pub mod shown; // which episodes a page shows
pub mod page; // a report as an HTML page
pub mod live; // trucks that drive in a browser, as an HTML page

pub use evaluation::*;
pub use sequences::Sequences;
pub use table::legend;

/// The library's examples, compiled and run as tests.
#[cfg(doctest)]
#[doc = include_str!("../../docs/library.md")]
struct Library;
