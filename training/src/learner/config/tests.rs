use super::*;
use crate::files;

fn default_file() -> String {
    std::fs::read_to_string(files::repository().join("training/configs/default.toml")).unwrap()
}

/// What reading `text` as a training file gives.
fn read(text: &str) -> Result<Config, String> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("fast.toml");
    std::fs::write(&file, text).unwrap();
    Config::read(&file).map_err(|error| {
        let message = error.to_string();
        assert!(message.starts_with(file.to_str().unwrap()), "{message}");
        assert!(error.is_wrong_input());
        message
    })
}

/// The default file with the line of `key` changed; an empty line takes it out.
fn with(key: &str, line: &str) -> Result<Config, String> {
    let mut changed = 0;
    let text = default_file();
    let lines: Vec<&str> = text
        .lines()
        .map(|old| {
            let found = old.strip_prefix(key).is_some_and(|rest| rest.starts_with(" ="));
            changed += usize::from(found);
            if found { line } else { old }
        })
        .collect();
    assert_eq!(changed, 1, "{key}");
    read(&lines.join("\n"))
}

#[test]
fn the_default_file_reads_and_is_written_back_the_same() {
    let config = read(&default_file()).unwrap();
    assert_eq!(read(&config.to_toml()).unwrap(), config);
}

#[test]
fn every_value_out_of_its_range_is_refused_with_its_key_and_what_would_do() {
    let out_of_range = [
        ("n_envs", "n_envs = 0", "n_envs: 0; must lie in 1..1048576"),
        ("steps", "minutes = 0.0", "minutes: 0 min; must lie in 0.01..100000 min"),
        ("steps", "minutes = nan", "minutes: NaN min"),
        ("steps", "minutes = 1.0\nsteps = 0", "steps: 0; must lie in"),
        ("checkpoint_minutes", "checkpoint_minutes = 0.0", "checkpoint_minutes: 0 min; must lie in 0.0001..100000 min"),
        ("capacity", "capacity = 10", "memory.capacity: 10; must lie in 1000.."),
        ("warmup", "warmup = 0", "memory.warmup: 0; must lie in 1.."),
        ("warmup", "warmup = 90000000", "memory.warmup: 90000000; must lie in 1.."),
        ("hidden", "hidden = []", "learning.hidden: 0; must lie in 1..8"),
        ("hidden", "hidden = [64, 0]", "learning.hidden[1]: 0; must lie in 1..8192"),
        ("batch", "batch = 1", "learning.batch: 1; must lie in 2.."),
        ("updates_per_step", "updates_per_step = 0", "learning.updates_per_step: 0; must lie in 1.."),
        ("n_steps", "n_steps = 0", "learning.n_steps: 0; must lie in 1..100"),
        ("discount", "discount = 1.01", "learning.discount: 1.01; must lie in 0..1"),
        ("discount", "discount = -0.1", "learning.discount: -0.1; must lie in 0..1"),
        ("reward_scale", "reward_scale = 0.0", "learning.reward_scale: 0; must lie in"),
        ("actor_rate", "actor_rate = 0.0", "learning.actor_rate: 0; must lie in"),
        ("critic_rate", "critic_rate = inf", "learning.critic_rate: inf; must lie in"),
        ("target_rate", "target_rate = 1.5", "learning.target_rate: 1.5; must lie in"),
        ("target_every", "target_every = 0", "learning.target_every: 0; must lie in"),
        ("average_rate", "average_rate = 0.0", "learning.average_rate: 0; must lie in"),
        ("share", "share = 1.1", "learning.entropy.share: 1.1; must lie in 0..1"),
        ("weight", "weight = 0.0", "learning.entropy.weight: 0; must lie in"),
        ("rate", "rate = -1.0", "learning.entropy.rate: -1; must lie in"),
    ];
    for (key, line, expected) in out_of_range {
        let message = with(key, line).unwrap_err();
        assert!(message.contains(expected), "{line}: {message}");
    }
}

#[test]
fn a_key_that_is_unknown_missing_or_of_another_type_is_refused_by_its_name() {
    for (key, line, expected) in [
        ("batch", "bacth = 512", "unknown field `bacth`"),
        ("batch", "", "missing field `batch`"),
        ("batch", "batch = -4", "invalid value"),
        ("seed", "seed = 4294967296", "invalid value"),
        ("critics", "critics = \"mean\"", "unknown variant `mean`"),
        ("hidden", "hidden = 256", "invalid type"),
    ] {
        let message = with(key, line).unwrap_err();
        assert!(message.contains(expected), "{line}: {message}");
    }
}

#[test]
fn a_run_that_nothing_would_end_is_refused() {
    let message = with("steps", "").unwrap_err();
    assert!(message.contains("`minutes`, `steps` or both"), "{message}");
    assert!(with("steps", "minutes = 1000.0").is_ok());
}

#[test]
fn a_memory_too_short_for_its_trucks_is_refused() {
    let text = default_file().replace("n_envs = 512", "n_envs = 65536").replace("capacity = 600000", "capacity = 655360");
    let message = read(&text).unwrap_err();
    // Ten slots can hold no step that ten others follow.
    assert!(message.contains("memory.capacity: 655360; must hold more than learning.n_steps = 10"), "{message}");
}

#[test]
fn what_the_command_line_says_wins_and_a_budget_there_replaces_both() {
    let mut config = with("steps", "minutes = 5.0\nsteps = 7").unwrap();
    config.override_with(Some(3), None, Some(1000), Some(16)).unwrap();
    assert_eq!((config.seed, config.n_envs, config.minutes, config.steps), (3, 16, None, Some(1000)));
    let message = config.override_with(None, None, None, Some(0)).unwrap_err().to_string();
    assert_eq!(message, "--envs 0: n_envs: 0; must lie in 1..1048576");
}

#[test]
fn what_a_device_does_not_have_is_refused_with_its_key() {
    let on_device = format!("device = \"gpu\"\n{}", default_file());
    assert_eq!(read(&on_device).unwrap().device, Device::Gpu);
    let exploration = "[exploration]\nfirst = 1.0\nlast = 0.1\nsteps = 1000\n";
    let priority = "[memory.priority]\nexponent = 0.6\ncorrection = 0.4\n";
    let categories = "[learning.categories]\ncount = 51\nlow = -15.0\nhigh = 15.0\n";
    for (key, table) in [("exploration", exploration), ("memory.priority", priority), ("learning.categories", categories)] {
        assert!(read(&format!("{}\n{table}", default_file())).is_ok(), "{key}");
        let message = read(&format!("{on_device}\n{table}")).unwrap_err().to_string();
        assert!(message.contains(&format!("{key}: given; is not there with device = \"gpu\"")), "{message}");
    }
}

#[test]
fn the_lower_of_two_histograms_is_refused() {
    let categories = ["learning.categories.count=31", "learning.categories.low=-3.0", "learning.categories.high=3.0"];
    assert!(with_set(&categories).is_ok());
    let message = with_set(&[&categories[..], &["learning.critics=lowest"]].concat()).unwrap_err();
    assert!(message.contains("learning.critics: \"lowest\"; is for single values"), "{message}");
}

#[test]
fn whatever_stands_for_a_value_is_taken_or_refused_by_its_key() {
    let text = default_file();
    let keys: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).filter_map(|line| Some(line.split_once(" = ")?.0)).collect();
    assert_eq!(keys.len(), 29, "{keys:?}");
    let mut taken = 0;
    for key in keys {
        for value in [
            "0",
            "-1",
            "0.0",
            "-0.5",
            "nan",
            "inf",
            "-inf",
            "1e300",
            "9223372036854775807",
            "\"\"",
            "\"text\"",
            "[]",
            "[[]]",
            "{}",
            "true",
            "1979-05-27",
        ] {
            match with(key, &format!("{key} = {value}")) {
                Ok(config) => {
                    taken += 1;
                    assert_eq!(read(&config.to_toml()).as_ref(), Ok(&config), "{key} = {value}");
                }
                Err(message) => assert!(message.contains(key), "{key} = {value}: {message}"),
            }
        }
    }
    // Zeros where they mean something, and any text for a benchmark's name.
    assert!((4..20).contains(&taken), "{taken}");
}

/// What reading the default file with some keys set gives.
fn with_set(settings: &[&str]) -> Result<Config, String> {
    let file = files::repository().join("training/configs/default.toml");
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    Config::read_with(&file, &settings).map_err(|error| error.to_string())
}

#[test]
fn single_keys_can_be_set_added_and_taken_out() {
    let config =
        with_set(&["learning.n_steps=7", "memory.priority.exponent=0.6", "memory.priority.correction = 0.4", "practice="]).unwrap();
    assert_eq!(config.learning.n_steps, 7);
    assert_eq!(config.memory.priority, Some(Priority { exponent: 0.6, correction: 0.4 }));
    assert_eq!(config.practice, None);
    let words = with_set(&["learning.critics=lowest", "practice=elsewhere", "learning.hidden=[8, 8]"]).unwrap();
    assert_eq!(
        (words.learning.critics, words.practice.as_deref(), words.learning.hidden),
        (Critics::Lowest, Some("elsewhere"), vec![8, 8])
    );
}

#[test]
fn a_key_set_wrongly_is_refused_with_what_would_do() {
    for (setting, expected) in [
        ("learning.n_steps", "--set: learning.n_steps; KEY=VALUE is needed"),
        ("=5", "--set: =5; a key is needed before"),
        ("learning..n_steps=5", "joined by single points"),
        ("seed.low=5", "seed is a value and has no keys below it"),
        ("learning.n_steps=0", "--set learning.n_steps=0: learning.n_steps: 0; must lie in 1..100"),
        ("learning.n_step=1", "unknown field `n_step`"),
        ("learning.hidden=wide", "--set learning.hidden=wide: invalid type: string"),
    ] {
        let message = with_set(&[setting]).unwrap_err();
        assert!(message.contains(expected), "{setting}: {message}");
    }
}

#[test]
fn every_training_file_reads() {
    let folder = files::repository().join("training/configs");
    let files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(2 <= files.len());
    for file in files {
        Config::read(&file).unwrap_or_else(|error| panic!("{error}"));
    }
}
