//! `offtrack train`: trains a policy, then evaluates it on the test routes, as [`offtrack_learner::train`] does: here
//! are its flags, what it shows, and the signals that stop it.

mod args;
mod bar;
mod beginning;
mod display;
mod seeds;
mod summary;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use offtrack_commands::signals::on_signals;
use offtrack_evaluation::files;
use offtrack_learner::config::{self, Config, Flags};
use offtrack_learner::error::Error;
use offtrack_learner::run::folder::Folder;
use offtrack_learner::run::resume::Resumed;
use offtrack_learner::train::{Caller, Event, Training};

pub use args::Args;
use display::Display;

/// Signals within this time of the first are one.
const TOGETHER: Duration = Duration::from_millis(500);

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let default = if cfg!(feature = "gpu") { "gpu" } else { "default" };
    let file = args.config.clone().unwrap_or_else(|| PathBuf::from(default));
    if let Some(seeds) = &args.seeds {
        return seeds::run(args, &file, seeds);
    }
    let display = Display::new(false);
    let watcher = |event: Event| display.tell(event);
    let caller = Caller { watcher: &watcher, stop: display.stop() };
    let trained = match &args.resume {
        Some(folder) => {
            let resumed = Resumed::open(folder, args.minutes, args.steps)?;
            let mut training = Training::read(resumed.config.clone(), &resumed.folder.config(), caller)?;
            training.tensorboard = args.tensorboard;
            stop_on_signals(&display);
            training.resume(resumed, caller)
        }
        None => {
            let training = read(args, &file, 1, &display, caller)?;
            stop_on_signals(&display);
            training.begin(|config| Folder::create(&runs(args), args.name.as_deref(), &file, config), caller)
        }
    };
    // What ended the run comes before a display that cannot be closed.
    let closed = display.close();
    trained?;
    Ok(closed?)
}

/// The folder of runs.
fn runs(args: &Args) -> PathBuf {
    args.out.clone().unwrap_or_else(|| PathBuf::from("runs"))
}

/// The training file of so many runs with what the command line changes, and its benchmarks. Says at once what the runs
/// will do.
fn read(args: &Args, file: &Path, n_runs: usize, display: &Display, caller: Caller) -> Result<Training, Error> {
    let config = config(args, file)?;
    let _ = files::print(&beginning::line(&config, file, n_runs));
    let origin = Config::origin(file, args.benchmark.as_deref(), &args.settings, &Flags::default());
    let mut training = Training::read(config, &origin, caller)?;
    training.tensorboard = args.tensorboard;
    display.clear();
    // A benchmark of one's own may have any actions and sensors.
    if args.benchmark.is_some()
        && let Some(error) = training.fit_mirror()
    {
        let _ = writeln!(std::io::stderr(), "note: trains without mirror augmentation: {error}");
    }
    Ok(training)
}

/// The training file with what the command line changes.
fn config(args: &Args, file: &Path) -> Result<Config, Error> {
    check_settings(args)?;
    let flags = Flags { seed: args.seed, minutes: args.minutes, steps: args.steps, envs: args.envs };
    let mut config = Config::read_for(file, args.benchmark.as_deref(), &args.settings, &flags)?;
    config.from = args.from.clone().or(config.from);
    config.check_budget(&match (args.steps, args.envs) {
        (Some(steps), _) => PathBuf::from(format!("--steps {steps}")),
        (None, Some(envs)) => PathBuf::from(format!("{} with --envs {envs}", file.display())),
        (None, None) => Config::origin(file, args.benchmark.as_deref(), &args.settings, &flags),
    })?;
    if let Some(adapter) = &args.adapter {
        if config.device == config::Device::Cpu {
            let expected = "the training file uses the processor: leave it out, or add --set device=gpu".to_owned();
            return Err(Error::setting("--adapter", adapter, expected));
        }
        config.adapter = Some(adapter.clone());
    }
    Ok(config)
}

/// An error if `--set` gives a value that a flag gives, too, or replaces, or gives one twice.
fn check_settings(args: &Args) -> Result<(), Error> {
    let flags = [
        ("--benchmark", args.benchmark.is_some(), "benchmark"),
        ("--seed", args.seed.is_some(), "seed"),
        ("--seeds", args.seeds.is_some(), "seed"),
        ("--minutes", args.minutes.is_some(), "minutes"),
        ("--steps", args.steps.is_some(), "steps"),
        ("--envs", args.envs.is_some(), "n_envs"),
        ("--from", args.from.is_some(), "from"),
        ("--adapter", args.adapter.is_some(), "adapter"),
    ];
    let budgets = [("--steps", args.steps.is_some(), "minutes"), ("--minutes", args.minutes.is_some(), "steps")];
    fn key_of(setting: &str) -> Option<&str> {
        setting.split_once('=').map(|(key, _)| key.trim())
    }
    for (index, setting) in args.settings.iter().enumerate() {
        let key = key_of(setting);
        if let Some(other) = args.settings[..index].iter().find(|other| key.is_some() && key_of(other) == key) {
            return Err(Error::setting("--set", setting, format!("{other} is given, too: leave one of them out")));
        }
        if let Some((flag, ..)) = budgets.iter().find(|(_, is_given, other)| *is_given && Some(*other) == key) {
            let expected =
                format!("{flag} replaces the whole budget: leave it out, or give steps and minutes by --set");
            return Err(Error::setting("--set", setting, expected));
        }
        if let Some((flag, ..)) = flags.iter().find(|(_, is_given, own)| *is_given && Some(*own) == key) {
            return Err(Error::setting("--set", setting, format!("{flag} is given, too: leave one of them out")));
        }
    }
    Ok(())
}

/// Lets Ctrl-C, SIGTERM and SIGHUP stop the run: the first lets the step in hand finish and everything be written, one
/// that is not of the same moment ends the process.
fn stop_on_signals(display: &Display) {
    let mut stop = Some(display.stopper());
    let mut stopped = Instant::now();
    // Without it a signal ends the process at once; the last policy and checkpoint are whole all the same.
    on_signals(move || match stop.take() {
        // On a thread of its own: a line may wait for its reader, and a second signal must not.
        Some(stop) => {
            stopped = Instant::now();
            drop(std::thread::Builder::new().spawn(stop));
        }
        // The same one again: `timeout` sends it to the process and to its group.
        None if stopped.elapsed() < TOGETHER => {}
        None => {
            files::remove_temporaries();
            std::process::exit(130);
        }
    });
}
