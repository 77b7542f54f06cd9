//! The policy on validation routes while it learns. The best one is kept: a policy is chosen without a look at the
//! routes that it is reported on.

use std::sync::Arc;

use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use offtrack_policy::Policy;
use serde::Serialize;

use crate::checkpoint::{Columns, Stored};
use crate::config;
use crate::error::Error;
use crate::run::changed;
use offtrack_evaluation::Evaluation;
use offtrack_evaluation::device::Device;
use offtrack_evaluation::report::{Summary, wilson};

/// Seed of the start poses, the same in every validation.
const SEED: u32 = 0;

/// Names of its columns in a checkpoint.
const COUNTS: &str = "validation, counts";
const WORLD: &str = "validation, world";
const DISTANCES: &str = "validation, lane distances";
const BEST: &str = "validation, best policy";

/// One validation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Validated {
    /// Env steps that the policy had learned from.
    pub env_steps: u64,
    /// Episodes that arrived.
    pub arrived: u64,
    /// Fraction that arrived.
    pub success: f64,
    /// Mean distance to the lane centre of those that arrived, `None` if none did (m).
    pub lane_distance_mean_arrived: Option<f64>,
}

/// The validations of a run, as its report has them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Validations {
    /// The benchmark with the validation routes.
    pub benchmark: String,
    /// Number of the validation routes.
    pub routes: usize,
    /// Episodes in each validation.
    pub episodes: u64,
    /// Validations that came due; of several at once one was made.
    pub times: u64,
    /// The best validation, whose policy is kept; of equal ones the last, and of a refinement the last. A refinement
    /// that was stopped keeps its latest policy, which no validation has seen.
    pub best: Validated,
    /// Lower end of the 95 % Wilson interval of the best validation's success.
    pub best_success_low: f64,
    /// Upper end of the 95 % Wilson interval of the best validation's success.
    pub best_success_high: f64,
    /// The last validation.
    pub last: Validated,
}

/// Validation routes, and the best policy so far.
pub struct Validation {
    settings: config::Validation,
    rule: Option<config::Rule>,
    scenario: Arc<Scenario>,
    world: Arc<World>,
    /// CRC-32 of the world.
    fingerprint: u32,
    /// Validations that came due and are over.
    n_made: u64,
    last: Option<Validated>,
    best: Option<(Validated, Vec<u8>)>,
}

impl Validation {
    /// Validation on the validation routes of `scenario`, which has at least one and whose world is `world`, under the
    /// rule.
    pub fn new(
        settings: config::Validation,
        rule: Option<config::Rule>,
        scenario: Arc<Scenario>,
        world: Arc<World>,
    ) -> Validation {
        let fingerprint = world.fingerprint();
        Validation { fingerprint, settings, rule, scenario, world, n_made: 0, last: None, best: None }
    }

    /// Whether it is time for the next one, with this fraction of the budget spent.
    pub fn is_due(&self, fraction: f64) -> bool {
        self.n_made < self.n_due(fraction)
    }

    /// Validations that a run makes until this fraction of its budget is spent.
    fn n_due(&self, fraction: f64) -> u64 {
        (fraction.min(1.0) * self.settings.times as f64 + 1e-9) as u64
    }

    /// Lets the policy drive. It becomes the best one unless an earlier one arrived more often. A refined one
    /// always becomes it: it learns by other rewards, and its learning rates fall. Where a run was too slow for several
    /// validations, they become one.
    pub fn validate(
        &mut self,
        policy: Policy,
        env_steps: u64,
        fraction: f64,
        is_refined: bool,
    ) -> Result<Validated, Error> {
        let bytes = policy.to_bytes();
        let device = Device::processor();
        let evaluation = Evaluation {
            scenario: &self.scenario,
            world: &self.world,
            split: Split::Validation,
            episodes: self.settings.episodes,
            seed: SEED,
            record: false,
            device: &device,
        };
        let mut policy = config::driven(policy, self.rule, &self.world)?;
        let driven = evaluation.drive(policy.as_mut(), &mut |_, _| {})?;
        let summary = Summary::of(driven.episodes.iter(), self.scenario.step)
            .expect("there is a validation route, and an episode on it");
        let Summary { arrived, success, lane_distance_mean_arrived, .. } = summary;
        let arrived = arrived as u64;
        let validated = Validated { env_steps, arrived, success, lane_distance_mean_arrived };
        self.n_made = self.n_due(fraction);
        self.last = Some(validated);
        if is_refined || self.best.as_ref().is_none_or(|(best, _)| best.arrived <= arrived) {
            self.best = Some((validated, bytes));
        }
        Ok(validated)
    }

    /// The last one.
    pub fn last(&self) -> Option<Validated> {
        self.last
    }

    /// The best one.
    pub fn best(&self) -> Option<Validated> {
        self.best.as_ref().map(|(best, _)| *best)
    }

    /// The best policy's bytes; none before the first validation.
    pub fn best_policy(&self) -> Option<&[u8]> {
        self.best.as_ref().map(|(_, policy)| policy.as_slice())
    }

    /// The validations for a run's report; none before the first one.
    pub fn report(&self) -> Option<Validations> {
        let (best, last, routes) = (self.best()?, self.last?, self.scenario.split(Split::Validation).len());
        let episodes = (routes * self.settings.episodes) as u64;
        let (best_success_low, best_success_high) = wilson(best.arrived as usize, episodes as usize);
        let benchmark = self.scenario.name.clone();
        Some(Validations {
            benchmark,
            routes,
            episodes,
            times: self.n_made,
            best,
            best_success_low,
            best_success_high,
            last,
        })
    }

    /// Adds its columns to a checkpoint, if one was made.
    pub fn save<'a>(&'a self, columns: &mut Columns<'a>) {
        let (Some(last), Some((best, policy))) = (self.last, &self.best) else { return };
        columns.put(WORLD, vec![self.fingerprint]);
        columns.put(COUNTS, vec![self.n_made, last.env_steps, last.arrived, best.env_steps, best.arrived]);
        let distance = |validated: Validated| validated.lane_distance_mean_arrived.unwrap_or_default();
        columns.put(DISTANCES, vec![distance(last), distance(*best)]);
        columns.put(BEST, &policy[..]);
    }

    /// Continues from what [`Validation::save`] added, with this fraction of the budget spent.
    pub fn restore(&mut self, stored: &Stored, fraction: f64) -> Result<(), Error> {
        if stored.bytes(COUNTS).is_none() {
            return Ok(());
        }
        // A best policy of other roads or another vehicle cannot be compared with later ones.
        if stored.array::<u32, 1>(WORLD)? != [self.fingerprint] {
            return Err(stored.error(changed(&self.scenario.name)));
        }
        let [n_made, last_steps, last_arrived, best_steps, best_arrived] = stored.array::<u64, 5>(COUNTS)?;
        let episodes = (self.scenario.split(Split::Validation).len() * self.settings.episodes) as u64;
        if episodes < last_arrived.max(best_arrived) {
            let most = last_arrived.max(best_arrived);
            return Err(stored.error(format!(
                "its column `{COUNTS}` has {most} arrivals of {episodes} episodes: put a sound copy back"
            )));
        }
        let [last_distance, best_distance] = stored.array(DISTANCES)?;
        let validated = |env_steps, arrived: u64, distance: f64| Validated {
            env_steps,
            arrived,
            success: arrived as f64 / episodes as f64,
            lane_distance_mean_arrived: (0 < arrived).then_some(distance),
        };
        let policy: Vec<u8> = stored.column(BEST)?;
        Policy::from_bytes(&format!("its column `{BEST}`"), &policy)
            .map_err(|error| stored.error(error.to_string()))?;
        // Of a larger budget than before a smaller part is spent: more are to come.
        self.n_made = n_made.min(self.n_due(fraction));
        self.last = Some(validated(last_steps, last_arrived, last_distance));
        self.best = Some((validated(best_steps, best_arrived, best_distance), policy));
        Ok(())
    }
}
