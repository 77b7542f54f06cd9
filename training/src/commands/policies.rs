//! The flags that choose a policy.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

use offtrack::reader::shown;
use offtrack::scenario::Scenario;
use offtrack::world::World;
use offtrack_training::error::Error;
use offtrack_training::evaluation::certificate::line;
use offtrack_training::evaluation::policies::{self, LOOK_AHEAD, Policy, PurePursuit};

/// Which policy drives.
#[derive(Debug, clap::Args)]
// A group of flags is named after its type, and a command may not have two of the same name.
#[group(skip)]
pub struct Choice {
    /// A policy file, `pursuit` (pure pursuit of the lane's centre), `random`, or the name of a shipped policy. Without
    /// it the policy shipped for the benchmark or, where there is none, the first shipped one with its actions and
    /// extras.
    #[arg(long)]
    policy: Option<String>,
    /// With `pursuit`: look-ahead distance [m].
    #[arg(long, default_value_t = LOOK_AHEAD.into(), allow_negative_numbers = true)]
    look_ahead: f64,
    /// With `pursuit`: a certificate of `offtrack certify`, whose paths it follows in place of the lane's centre.
    #[arg(long)]
    line: Option<PathBuf>,
}

impl Choice {
    /// Opens the policy for a benchmark; `seed` is that of random actions.
    pub fn open(&self, scenario: &Scenario, world: &Arc<World>, seed: u32) -> Result<Box<dyn Policy>, Error> {
        if !(1.0..=50.0).contains(&self.look_ahead) {
            let value = format!("{} m", shown(self.look_ahead));
            return Err(Error::Flag { flag: "--look-ahead", value, expected: "must lie in 1..50 m".into() });
        }
        let pursuit = self.pursuit(scenario, world)?;
        let policy = policies::find(self.policy.as_deref(), &scenario.name, pursuit, seed, world)?;
        if self.policy.is_none() && !offtrack_policy::Policy::shipped_names().contains(&scenario.name.as_str()) {
            let _ = writeln!(
                std::io::stderr(),
                "offtrack: no policy comes with the program for {}; {} drives; --policy chooses another",
                scenario.name,
                policy.name()
            );
        }
        Ok(policy)
    }

    /// Pure pursuit of the lane's centre or of a certificate's paths.
    fn pursuit(&self, scenario: &Scenario, world: &Arc<World>) -> Result<PurePursuit, Error> {
        let pursuit = PurePursuit::new(self.look_ahead as f32);
        let Some(file) = &self.line else { return Ok(pursuit) };
        if self.policy.as_deref() != Some("pursuit") {
            let expected = "is for pure pursuit: give --policy pursuit, too".to_owned();
            return Err(Error::Flag { flag: "--line", value: file.display().to_string(), expected });
        }
        let lines = line::lines(file, scenario, world)?;
        let without = world.route_names.len() - lines.len();
        if 0 < without {
            let _ = writeln!(
                std::io::stderr(),
                "offtrack: {} completes {} of {} routes; on the others pursuit follows the lane's centre",
                file.display(),
                lines.len(),
                world.route_names.len()
            );
        }
        Ok(pursuit.planned(lines, &file.display().to_string()))
    }
}
