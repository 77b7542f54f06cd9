//! What a run says at once, before its roads are read: what it will do, and about how long.

use std::path::Path;

use offtrack::files::reader::{printable, shown_path};
use offtrack_learner::config::Config;

/// Time of the default run, as docs/results.md has it.
const DEFAULT_TIME: &str = "four to nine minutes of a core";

/// A line about `n_runs` runs of a training file.
pub fn line(config: &Config, file: &Path, n_runs: usize) -> String {
    let steps = config.steps.map(|steps| format!("{steps} env steps of {} trucks", config.n_envs));
    let minutes = config.minutes.map(|minutes| format!("{minutes} min"));
    let budget: Vec<String> = steps.into_iter().chain(minutes).collect();
    let known =
        Config::read(Path::new("default")).is_ok_and(|default| Config { seed: config.seed, ..default } == *config);
    let time = match (known, config.minutes) {
        (true, _) => format!(": {DEFAULT_TIME}"),
        (false, Some(_)) => String::new(),
        (false, None) => "; while it trains a line says how long is left".to_owned(),
    };
    // Roads are read after this, and a benchmark of one's own may have none to be tested on.
    let condition = if Path::new(&config.benchmark).extension().is_some() { ", if it has test routes" } else { "" };
    let seeds = if n_runs == 1 { String::new() } else { format!("{n_runs} seeds, each ") };
    format!(
        "{}: {seeds}trains for {}{time}; then evaluates on {}{condition}. Ctrl-C stops it; offtrack --help lists all \
         commands\n",
        shown_path(file),
        budget.join(" or "),
        printable(&config.benchmark)
    )
}

#[cfg(test)]
mod tests {
    use super::line;
    use offtrack_learner::config::Config;
    use std::path::Path;

    #[test]
    fn a_time_is_stated_for_the_default_run_alone_whatever_its_seed() {
        let default = Path::new("default");
        let said = |settings: &[&str], n_runs: usize| {
            let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
            line(&Config::read_with(default, &settings).unwrap(), default, n_runs)
        };
        let usual = "default: trains for 4800000 env steps of 512 trucks: four to nine minutes of a core; then";
        assert!(said(&[], 1).starts_with(usual) && said(&["seed=3"], 1).starts_with(usual), "{}", said(&[], 1));
        assert!(
            said(&["steps=9600000"], 1).contains("of 512 trucks; while it trains a line says how long is left; then")
        );
        assert!(
            said(&["benchmark=mine.toml"], 1).contains("then evaluates on mine.toml, if it has test routes. Ctrl-C")
        );
        let timed = said(&["steps=", "minutes=2"], 5);
        assert!(timed.starts_with("default: 5 seeds, each trains for 2 min; then evaluates on attard2023."), "{timed}");
    }
}
