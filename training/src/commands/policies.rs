//! The flags that choose a policy.

use std::io::Write;

use offtrack::reader::shown;
use offtrack::scenario::Scenario;
use offtrack::world::World;
use offtrack_training::error::Error;
use offtrack_training::evaluation::policies::{self, LOOK_AHEAD, Policy};

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
}

impl Choice {
    /// Opens the policy for a benchmark; `seed` is that of random actions.
    pub fn open(&self, scenario: &Scenario, world: &World, seed: u32) -> Result<Box<dyn Policy>, Error> {
        if !(1.0..=50.0).contains(&self.look_ahead) {
            let value = format!("{} m", shown(self.look_ahead));
            return Err(Error::Flag { flag: "--look-ahead", value, expected: "must lie in 1..50 m".into() });
        }
        let policy = policies::find(self.policy.as_deref(), &scenario.name, self.look_ahead as f32, seed, world)?;
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
}
