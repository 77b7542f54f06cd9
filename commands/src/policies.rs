//! The flags that choose a policy.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use offtrack::files::reader::{shown, shown_path};
use offtrack::scenario::Scenario;
use offtrack::simulator::Engine;
use offtrack::world::World;
use offtrack_evaluation::certificate::line;
use offtrack_evaluation::comparison::Asked;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;
use offtrack_evaluation::policies::rule::{self, FOLLOWS, YIELDS};
use offtrack_evaluation::policies::{self, Controller, LOOK_AHEAD, PurePursuit};
use offtrack_evaluation::run_file::RunFile;

use crate::outputs;

/// Names of what drives without a file.
const WITHOUT_FILE: [&str; 4] = ["pursuit", "random", YIELDS, FOLLOWS];

/// The file of a policy that is named so, if it has one and no shipped policy has that name.
pub fn file_of(name: &str) -> Option<&Path> {
    let name = Some(name).filter(|name| !WITHOUT_FILE.contains(name))?;
    Some(Path::new(rule::under(name).map_or(name, |(_, policy)| policy)))
}

/// Which policy drives.
#[derive(Debug, Clone, Default, clap::Args)]
// A group of flags is named after its type, and a command may not have two of the same name.
#[group(skip)]
pub struct Choice {
    /// A policy file, `pursuit` (pure pursuit of the lane's centre), `random`, `follows` or `yields` (rules among other
    /// vehicles), or the name of a shipped policy; `yields:POLICY` is a file or a shipped one that waits by the rule.
    /// Without it the policy shipped for the benchmark or, where there is none, the first shipped one with its actions
    /// and extras.
    #[arg(long)]
    policy: Option<String>,
    /// With `pursuit`: look-ahead distance (m) [default: 7].
    #[arg(long)]
    look_ahead: Option<f64>,
    /// With `pursuit`: a certificate of `offtrack certify`, whose paths it follows in place of the lane's centre.
    #[arg(long)]
    line: Option<PathBuf>,
}

impl Choice {
    /// Opens the policy for a benchmark and for trucks on `engine`; `seed` is that of random actions.
    pub fn open(
        &self,
        scenario: &Scenario,
        world: &Arc<World>,
        engine: &Engine,
        seed: u32,
    ) -> Result<Box<dyn Controller>, Error> {
        let pursuit = self.pursuit(scenario, world)?;
        let policy = policies::find(self.policy.as_deref(), &scenario.name, pursuit, seed, world, engine)?;
        if self.policy.is_none() && !offtrack_policy::Policy::shipped_names().contains(&scenario.name.as_str()) {
            let (benchmark, drives) = (&scenario.name, policy.name());
            files::say(&format!(
                "no policy comes with the program for {benchmark}; {drives} drives; --policy chooses another"
            ));
        }
        Ok(policy)
    }

    /// The policy of an evaluation that was asked this.
    pub fn of(asked: &Asked) -> Choice {
        let Asked { policy, look_ahead, line, .. } = asked.clone();
        Choice { policy, look_ahead, line }
    }

    /// What is asked of `benchmark`, whose split is narrowed to a load and to routes.
    pub fn asked(&self, benchmark: &str, load: Option<&str>, route: &[String]) -> Asked {
        let Choice { policy, look_ahead, line } = self.clone();
        let (benchmark, load, route) = (benchmark.to_owned(), load.map(str::to_owned), route.to_vec());
        Asked { benchmark, policy, look_ahead, line, load, route }
    }

    /// The files that these flags name, if they are files.
    pub fn files(&self) -> [outputs::Named<'_>; 2] {
        [("--policy", self.policy.as_deref().and_then(file_of)), ("--line", self.line.as_deref())]
    }

    /// An error unless the policy is the one that the training run in `folder` has left.
    pub fn check_is_of(&self, folder: &Path, scenario: &Scenario, world: &World) -> Result<(), Error> {
        let of_run = RunFile::Policy.of(folder);
        let learned = match self.policy.as_deref() {
            Some(name) if WITHOUT_FILE.contains(&name) || rule::under(name).is_some() => None,
            Some(name) => Some(policies::learned(name)?),
            None => Some(offtrack_policy::Policy::shipped_for(&scenario.name, world)?),
        };
        let expected = offtrack_policy::Policy::load(&of_run)?.to_bytes();
        if learned.is_some_and(|policy| policy.to_bytes() == expected) {
            return Ok(());
        }
        let expected = format!(
            "another policy is evaluated: give the run's own, --policy {}, or leave --run out",
            of_run.display()
        );
        Err(Error::Setting { name: "--run", value: folder.display().to_string(), expected })
    }

    /// Pure pursuit of the lane's centre or of a certificate's paths.
    fn pursuit(&self, scenario: &Scenario, world: &Arc<World>) -> Result<PurePursuit, Error> {
        let distance = self.look_ahead.unwrap_or(LOOK_AHEAD.into());
        let given = self.look_ahead.map(|distance| ("--look-ahead", format!("{} m", shown(distance))));
        let given = given.or_else(|| Some(("--line", self.line.as_ref()?.display().to_string())));
        if let (Some((flag, value)), true) = (given, self.policy.as_deref() != Some("pursuit")) {
            return Err(Error::Setting {
                name: flag,
                value,
                expected: "is for pure pursuit: give --policy pursuit, too".into(),
            });
        }
        if !(1.0..=50.0).contains(&distance) {
            let value = format!("{} m", shown(distance));
            return Err(Error::Setting { name: "--look-ahead", value, expected: "must lie in 1..50 m".into() });
        }
        let pursuit = PurePursuit::new(distance as f32);
        let Some(file) = &self.line else { return Ok(pursuit) };
        let lines = line::lines(file, scenario, world)?;
        let without = world.route_names.len() - lines.len();
        if 0 < without {
            let (n, all) = (lines.len(), world.route_names.len());
            files::say(&format!(
                "{} completes {n} of {all} routes; on the others pursuit follows the lane's centre",
                shown_path(file)
            ));
        }
        Ok(pursuit.planned(lines, &shown_path(file)))
    }
}
