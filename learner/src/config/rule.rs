//! The rule that a run drives under: part of what its policy learns in, and of how it is chosen and evaluated.

use offtrack::files::reader::Reader;
use offtrack::scenario::Scenario;
use offtrack::simulator::Engine;
use offtrack::world::World;
use offtrack_evaluation::placed::placed;
use offtrack_evaluation::policies::Controller;
use offtrack_evaluation::policies::rule::{self, Capped, FOLLOWS, YIELDS};
use offtrack_policy::{Choice, Policy};
use serde::{Deserialize, Serialize};

use super::Config;
use crate::error::Error;

/// A rule among other vehicles that caps target speeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// Waits for a gap before its line, and keeps behind what is ahead.
    Yields,
    /// Keeps behind what is ahead.
    Follows,
}

impl Rule {
    /// Its name in training files, reports and `--policy`.
    pub fn name(self) -> &'static str {
        match self {
            Rule::Yields => YIELDS,
            Rule::Follows => FOLLOWS,
        }
    }
}

impl Config {
    /// The run's rule in a world, if it has one. A world without vehicles or target speeds is an error.
    pub(crate) fn rule_in(&self, world: &World) -> Result<Option<rule::Rule>, Error> {
        let of = |rule: Rule| rule::Rule::over_policies(rule.name(), world, "rule", rule.name());
        Ok(self.rule.map(of).transpose()?)
    }

    /// An error if the run's rule cannot drive in a benchmark, which the key of `reader`'s file named.
    pub(crate) fn check_rule(&self, reader: &Reader, key: &str, scenario: &Scenario) -> Result<(), Error> {
        let Some(rule) = self.rule else { return Ok(()) };
        let lacks = match scenario {
            Scenario { traffic: None, .. } => "has no [traffic]",
            Scenario { speed_changes, .. } if !speed_changes.is_empty() => "has actions that change the speed",
            _ => return Ok(()),
        };
        let expected = format!(
            "it {lacks}, and rule = \"{}\" caps target speeds among other vehicles: another benchmark is needed, or no \
             rule",
            rule.name()
        );
        Err(reader.invalid(key, &scenario.name, expected).into())
    }
}

/// Drives as the policy does, under a rule if there is one.
pub(crate) fn driven(policy: Policy, rule: Option<Rule>, world: &World) -> Result<Box<dyn Controller>, Error> {
    let policy = placed(policy, &Engine::Cpu, world, Choice::Best)?;
    Ok(match rule {
        Some(rule) => Box::new(Capped::new(rule.name(), policy, world)?),
        None => policy,
    })
}
