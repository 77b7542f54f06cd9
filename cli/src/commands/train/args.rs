//! The flags of `offtrack train`.

use std::path::PathBuf;

/// Train a policy, then evaluate it on the test routes.
#[derive(Debug, Default, clap::Args)]
pub struct Args {
    /// A training file: its path, or one of `default`, `best`, `lane`, `attard`, `as-run`, `laden`, `laden-50`,
    /// `transfer`, `transfer-refined`, `traffic`, `traffic-refined`, `gpu`, `laden-gpu` and `paper`, which come with
    /// the program. Without it `default`, in a program built for graphics devices `gpu`.
    pub(super) config: Option<PathBuf>,
    /// A benchmark of your own, a path or a name: train on its training routes, with its own reward, and evaluate on
    /// its test routes. The policy is chosen on its validation routes. Where it has no training or no validation
    /// routes, its vehicle and actions drive on those of random2026.
    #[arg(long)]
    pub(super) benchmark: Option<String>,
    /// Name of the run's folder; must be new. Without it the training file's name, numbered.
    #[arg(long)]
    pub(super) name: Option<String>,
    /// Folder of runs.
    #[arg(long, default_value = "runs")]
    pub(super) out: Option<PathBuf>,
    /// Seed in place of the training file's.
    #[arg(long)]
    pub(super) seed: Option<u32>,
    /// Begin with a policy instead of random weights: its file, or a shipped one's name.
    #[arg(long, value_name = "POLICY")]
    pub(super) from: Option<String>,
    /// Train several seeds one after another and compare them: a range as in 20..24, both included, or a list as in
    /// 3,7,9. Each has its own folder seed-N in the run's folder. The same command with the same --name continues.
    #[arg(long, conflicts_with = "seed")]
    pub(super) seeds: Option<String>,
    /// Training time in place of the training file's whole budget, its steps too (min).
    #[arg(long)]
    pub(super) minutes: Option<f64>,
    /// Number of env steps in place of the training file's whole budget, its minutes too.
    #[arg(long)]
    pub(super) steps: Option<u64>,
    /// Number of trucks in place of the training file's.
    #[arg(long)]
    pub(super) envs: Option<usize>,
    /// Part of the name of a graphics adapter in place of the training file's, see `offtrack devices`.
    #[arg(long)]
    pub(super) adapter: Option<String>,
    /// Value of one of the training file's keys, as in `learning.n_steps=5`, in place of the file's; nothing after the
    /// `=` removes the key. May be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) settings: Vec<String>,
    /// Write the rows of metrics.csv to a TensorBoard event file in the run's folder too.
    #[arg(long)]
    pub(super) tensorboard: bool,
    /// Continue a run that was stopped or killed, from the last checkpoint in its folder, by its own config.toml.
    /// --minutes or --steps give another budget, counted from the run's beginning; a finished run continues too. The
    /// learning-rate schedule ends with the budget, so with a larger one the rates are higher from here on. With a
    /// budget of steps alone the result is that of a run never stopped, bit for bit on the same machine and program.
    #[arg(
        long,
        value_name = "FOLDER",
        conflicts_with_all = [
            "config", "benchmark", "name", "out", "seed", "seeds", "from", "envs", "adapter", "settings",
        ]
    )]
    pub(super) resume: Option<PathBuf>,
}
