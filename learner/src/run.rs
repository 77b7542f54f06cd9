//! A training run in its folder: the loop, its rows of metrics, its checkpoints, and its end.
//!
//! With a budget of steps alone, a run depends on its state and on nothing else: one that continues from a checkpoint
//! equals one that was never stopped, bit for bit. With minutes the learning rates follow the clock.

pub mod checkpointer;
pub mod events_file;
pub mod folder;
pub mod kept_policies;
#[cfg(test)]
mod lost_device_tests;
pub mod metrics_file;
pub mod progress;
pub mod resume;
pub mod route_counts;
pub mod validation;
mod window;

use offtrack::world::World;
use offtrack_evaluation::kept::Kept;
use offtrack_policy::Policy;

use crate::backend::Backend;
use crate::checkpoint::{Columns, Stored};
use crate::config::Config;
use crate::error::Error;
use crate::sac::not_finite;
use crate::session::Session;
use checkpointer::{Checkpointer, Written};
use folder::Folder;
use kept_policies::KeptPolicies;
use metrics_file::MetricsFile;
use progress::Progress;
use route_counts::RouteCounts;
use validation::Validation;

/// A run under way.
pub struct Run<'a> {
    config: Config,
    backend: Backend,
    /// CRC-32 of the world.
    fingerprint: u32,
    training: Session,
    /// How far the run is.
    pub progress: Progress<'a>,
    /// Success on each training route.
    pub routes: RouteCounts,
    /// None without validation.
    pub validation: Option<Validation>,
    checkpointer: Checkpointer,
    kept: KeptPolicies,
    /// What it continues from, until a later policy is written.
    continued: Option<Continued<'a>>,
}

/// Has what was reported of an earlier policy of a run no longer hold.
pub type Outdate<'a> = Box<dyn Fn(&Run) -> Result<(), Error> + 'a>;

/// The checkpoint that a run continues from.
struct Continued<'a> {
    env_steps: u64,
    outdate: Outdate<'a>,
}

impl<'a> Run<'a> {
    /// A run at its beginning. Its first checkpoint is written at once.
    pub fn new(
        backend: Backend,
        config: &Config,
        world: &World,
        training: Session,
        folder: &Folder,
        progress: Progress<'a>,
        routes: RouteCounts,
    ) -> Run<'a> {
        Run {
            routes,
            validation: None,
            fingerprint: world.fingerprint(),
            training,
            progress,
            checkpointer: Checkpointer::new(folder, config.checkpoint_minutes),
            kept: KeptPolicies::new(folder),
            continued: None,
            config: config.clone(),
            backend,
        }
    }

    /// Name of the device that the run uses, as in results.
    pub fn device(&self) -> String {
        self.backend.name()
    }

    /// Trains until the budget is spent or `stopped` says so. A diverged learner and a failed device are errors; a file
    /// that cannot be written is reported and tried again.
    pub fn learn(&mut self, stopped: impl Fn() -> bool) -> Result<(), Error> {
        let backend = self.backend.clone();
        match backend.guarded(|| self.learn_until(&stopped)) {
            Err(error) if error.is_device_failure() => {
                let message = match error {
                    Error::Device(message) => message,
                    error => error.to_string(),
                };
                Err(Error::Device(format!("{message}; {}", self.last_checkpoint())))
            }
            result => result,
        }
    }

    fn learn_until(&mut self, stopped: &impl Fn() -> bool) -> Result<(), Error> {
        while self.progress.fraction() < 1.0 && !stopped() {
            if self.is_refinement_due() {
                self.refine()?;
                self.checkpoint_if_due()?;
                continue;
            }
            let is_warm = self.training.is_warm()?;
            self.training.act(self.progress.env_steps())?;
            self.progress.stepped(self.config.n_envs as u64);
            self.count_episodes(false)?;
            if is_warm {
                self.training.learn(self.rate_factor())?;
                self.progress.updated(self.config.learning.updates_per_step as u64);
                if let Some((what, value)) = self.training.sac().diverged() {
                    return Err(self.diverged(what, value));
                }
                let validated = self.validate_if_due()?;
                self.keep_if_due(validated)?;
                if validated || self.progress.is_row_due() {
                    self.write_row()?;
                }
                self.progress.show_if_due();
            }
            self.checkpoint_if_due()?;
        }
        // With a budget of time the clock may have ended the loop just before the last one. A run that was stopped is
        // due for none that it would not have had otherwise.
        if 1.0 <= self.progress.fraction() && self.validate_if_due()? {
            self.keep_if_due(true)?;
            self.write_row()?;
        }
        self.count_episodes(true)
    }

    /// Whether the run has come to its refinement, which lasts until its end: with a larger budget too.
    fn is_refinement_due(&self) -> bool {
        let begin = self.config.refinement.as_ref().map(|refinement| refinement.begin);
        let is_time = begin.is_some_and(|begin| begin <= self.progress.fraction());
        self.training.is_refining() || (is_time && self.training.is_acting())
    }

    /// An iteration of the refinement, which begins with the best policy so far.
    fn refine(&mut self) -> Result<(), Error> {
        let Some(settings) = self.config.refinement.clone() else { return Ok(()) };
        if !self.training.is_refining() {
            self.training.begin_refinement(&self.policy()?)?;
        }
        let done = ((self.progress.fraction() - settings.begin) / (1.0 - settings.begin)).max(0.0);
        let n_updates = self.training.refine(1.0 - (1.0 - settings.final_learning_rate_fraction) * done)?;
        self.progress.stepped((self.config.n_envs * settings.n_steps) as u64);
        self.progress.updated(n_updates);
        self.count_episodes(false)?;
        let validated = self.validate_if_due()?;
        self.keep_if_due(validated)?;
        if validated || self.progress.is_row_due() {
            self.write_row()?;
        }
        self.progress.show_if_due();
        Ok(())
    }

    /// Lets the policy drive on the validation routes when it is time to; true if it did.
    fn validate_if_due(&mut self) -> Result<bool, Error> {
        let fraction = self.progress.fraction();
        let Some(validation) = self.validation.as_mut().filter(|validation| validation.is_due(fraction)) else {
            return Ok(false);
        };
        let validated = validation.validate(
            self.training.policy()?,
            self.progress.env_steps(),
            fraction,
            self.training.is_refining(),
        )?;
        self.progress.validated(validated.success, validation.best().map_or(validated.success, |best| best.success));
        Ok(true)
    }

    /// Keeps the policy as it is when it is time to. From the first validation on, only one that has just been
    /// `validated` is kept: its success is known.
    fn keep_if_due(&mut self, validated: bool) -> Result<(), Error> {
        let (env_steps, last) = (self.progress.env_steps(), self.validation.as_ref().and_then(Validation::last));
        if (last.is_some() && !validated) || !self.kept.is_due(env_steps) {
            return Ok(());
        }
        let validation = last.map(|validated| validated.success);
        let kept = Kept { env_steps, seconds: self.progress.seconds(), validation };
        let written = self.kept.keep(kept, &self.training.policy()?.to_bytes());
        self.progress.note(&self.kept.file(), written);
        Ok(())
    }

    /// The linear learning-rate schedule.
    fn rate_factor(&self) -> f64 {
        let end = self.config.refinement.as_ref().map_or(1.0, |refinement| refinement.begin.max(f64::MIN_POSITIVE));
        1.0 - (1.0 - self.config.learning.final_learning_rate_fraction) * (self.progress.fraction() / end).min(1.0)
    }

    fn count_episodes(&mut self, wait: bool) -> Result<(), Error> {
        for episodes in self.training.rollout_mut().take_episodes(wait)? {
            self.progress.ended(episodes);
        }
        for ended in self.training.rollout_mut().take_route_ends() {
            self.routes.count(ended);
        }
        Ok(())
    }

    /// Writes a row of metrics, once its figures have been checked.
    fn write_row(&mut self) -> Result<(), Error> {
        self.add_sums()?;
        let entropy_coefficient = self.training.entropy_coefficient();
        self.progress.write_row(entropy_coefficient);
        if self.routes.is_due() {
            let written = self.routes.write();
            self.progress.note(self.routes.file(), written);
        }
        Ok(())
    }

    /// Takes the figures of the updates since the last row from the learner.
    fn add_sums(&mut self) -> Result<(), Error> {
        self.training.rollout().check()?;
        self.count_episodes(true)?;
        let (sums, n_updates) = self.training.take_sums();
        self.progress.add_sums(&sums);
        match not_finite(&sums).filter(|_| 0 < n_updates) {
            Some((what, value)) => Err(self.diverged(what, value)),
            None => Ok(()),
        }
    }

    /// The best policy by validation or, without one and in a refinement, the policy as it is; waits for a device.
    pub fn policy(&self) -> Result<Policy, Error> {
        let chooses = self.validation.as_ref().filter(|_| !self.training.is_refining());
        let best = chooses.and_then(Validation::best_policy);
        let read =
            |bytes| Policy::from_bytes("best policy", bytes).expect("the bytes were made from a policy that drove");
        best.map_or_else(|| self.training.policy(), |bytes| Ok(read(bytes)))
    }

    /// Ends the run but for its lock: no other run continues it while the file is held.
    pub fn into_metrics(self) -> MetricsFile {
        self.progress.into_metrics()
    }

    /// Writes the last checkpoint, policy and row. Everything is tried before the first failure is returned.
    pub fn close(&mut self) -> Result<(), Error> {
        self.check()?;
        self.begin_checkpoint()?;
        let written = self.checkpointer.wait();
        // The last row is not in the checkpoint: a run that continues takes it back.
        self.add_sums()?;
        let row = self.progress.finish(self.training.entropy_coefficient());
        let routes = self.routes.write();
        written.map_or(Ok(()), |Written { checkpoint, policy }| checkpoint.and(policy)).and(row).and(routes)
    }

    fn checkpoint_if_due(&mut self) -> Result<(), Error> {
        if let Some(Written { checkpoint, policy }) = self.checkpointer.finished() {
            self.progress.note(self.checkpointer.file(), checkpoint);
            self.progress.note(self.checkpointer.policy(), policy);
        }
        if self.checkpointer.is_due() {
            self.check()?;
            self.begin_checkpoint()?;
        }
        Ok(())
    }

    /// Begins to write a checkpoint and the policy.
    fn begin_checkpoint(&mut self) -> Result<(), Error> {
        let env_steps = self.progress.env_steps();
        if let Some(continued) = self.continued.take_if(|continued| continued.env_steps < env_steps) {
            (continued.outdate)(self)?;
        }
        let policy = self.policy()?.to_bytes();
        let mut columns = Columns::default();
        self.progress.save(&mut columns);
        self.routes.save(&mut columns);
        self.validation.iter().for_each(|validation| validation.save(&mut columns));
        self.training.save(&mut columns);
        self.checkpointer.begin(&columns, self.config.to_toml(), self.fingerprint, policy);
        Ok(())
    }

    /// Continues from a checkpoint of this run. `outdate` is called before the first policy after it is written.
    pub fn restore(&mut self, stored: &Stored, outdate: Outdate<'a>) -> Result<(), Error> {
        if stored.world() != self.fingerprint {
            let what = self.config.training_benchmark.as_ref().unwrap_or(&self.config.benchmark);
            return Err(stored.error(changed(what)));
        }
        self.checkpointer.continue_from();
        self.progress.restore(stored)?;
        self.routes.restore(stored)?;
        if let Some(validation) = &mut self.validation {
            validation.restore(stored, self.progress.fraction())?;
            if let (Some(last), Some(best)) = (validation.last(), validation.best()) {
                self.progress.show_validation(last.success, best.success);
            }
        }
        self.continued = Some(Continued { env_steps: self.progress.env_steps(), outdate });
        self.training.restore(stored, self.progress.updates())
    }

    /// Whether it continued, and has made no step since.
    pub fn has_learned_nothing(&self) -> bool {
        self.continued.as_ref().is_some_and(|continued| continued.env_steps == self.progress.env_steps())
    }

    /// Lets go of policies that were kept after the point from which the run goes on.
    pub fn continue_kept(&mut self) -> Result<(), Error> {
        self.kept.continue_from(self.progress.env_steps())
    }

    /// Fails where a number of the learner is not finite. A checkpoint holds only finite numbers.
    fn check(&mut self) -> Result<(), Error> {
        self.training.rollout().check()?;
        match self.training.broken() {
            Some((what, value)) => Err(self.diverged(&what, value)),
            None => Ok(()),
        }
    }

    /// The error of a learner that diverged: where it shows, and what there is to go back to.
    fn diverged(&mut self, what: &str, value: f32) -> Error {
        let also = self.training.broken().filter(|(name, _)| name != what).map(|(name, _)| format!(", so is {name}"));
        let (also, kept) = (also.unwrap_or_default(), self.last_checkpoint());
        Error::Diverged { what: what.to_owned(), value, also, env_steps: self.progress.env_steps(), kept }
    }

    /// What there is to go back to, in words.
    fn last_checkpoint(&mut self) -> String {
        // One that is being written was sound when it was begun. Whether it could be written shows in the folder.
        let _ = self.checkpointer.wait();
        self.checkpointer.last_good()
    }
}

/// The error text for a benchmark that is no longer what it was when a checkpoint was written.
fn changed(benchmark: &str) -> String {
    format!("was written when {benchmark} was different: put its scenario, vehicle and roundabout files back")
}
