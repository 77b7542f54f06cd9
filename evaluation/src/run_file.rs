//! Names of the files of a training run in its folder: the learner writes them, commands read them without it.

use std::path::{Path, PathBuf};

offtrack::named! {
    /// A file of a run.
    pub enum RunFile {
        /// The training file as used.
        Config = "config.toml",
        /// A row of metrics every few seconds.
        Metrics = "metrics.csv",
        /// The report.
        Report = "report.json",
        /// The report as a page to look at.
        Page = "report.html",
        /// Success on each training route.
        Routes = "routes.csv",
        /// The policy.
        Policy = "policy.safetensors",
        /// All that it takes to continue.
        Checkpoint = "checkpoint.safetensors",
        /// The list of the [policies that it kept](crate::kept) on its way.
        Kept = "policies/policies.json",
    }
}

impl RunFile {
    /// The file of the run in this folder.
    pub fn of(self, folder: &Path) -> PathBuf {
        folder.join(self.name())
    }
}
