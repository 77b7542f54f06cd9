use super::*;

fn default_file() -> String {
    std::fs::read_to_string(crate::repository().join("learner/configs/default.toml")).unwrap()
}

/// What reading `text` as a training file gives.
pub(super) fn read(text: &str) -> Result<Config, String> {
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
        ("capacity", "capacity = 10", "replay_buffer.capacity: 10; must lie in 1000.."),
        ("warmup", "warmup = 0", "replay_buffer.warmup: 0; must lie in 1.."),
        ("warmup", "warmup = 90000000", "replay_buffer.warmup: 90000000; must lie in 1.."),
        ("hidden", "hidden = []", "learning.hidden: 0 layers; must lie in 1..8"),
        ("hidden", "hidden = [64, 0]", "learning.hidden[1]: 0; must lie in 1..8192"),
        ("batch", "batch = 1", "learning.batch: 1; must lie in 2.."),
        ("updates_per_step", "updates_per_step = 0", "learning.updates_per_step: 0; must lie in 1.."),
        ("n_steps", "n_steps = 0", "learning.n_steps: 0; must lie in 1..100"),
        ("gamma", "gamma = 1.01", "learning.gamma: 1.01; must lie in 0..1"),
        ("gamma", "gamma = -0.1", "learning.gamma: -0.1; must lie in 0..1"),
        ("reward_scale", "reward_scale = 0.0", "learning.reward_scale: 0; must lie in"),
        (
            "reward_scale",
            "reward_scale = 1.0\narrival = 2e6",
            "learning.arrival: 2000000; must lie in -1000000..1000000",
        ),
        ("actor_learning_rate", "actor_learning_rate = 0.0", "learning.actor_learning_rate: 0; must lie in"),
        ("critic_learning_rate", "critic_learning_rate = inf", "learning.critic_learning_rate: inf; must lie in"),
        ("tau", "tau = 1.5", "learning.tau: 1.5; must lie in"),
        ("target_interval", "target_interval = 0", "learning.target_interval: 0; must lie in"),
        ("actor_ema_rate", "actor_ema_rate = 0.0", "learning.actor_ema_rate: 0; must lie in"),
        ("target_fraction", "target_fraction = 1.1", "learning.entropy.target_fraction: 1.1; must lie in 0..1"),
        ("coefficient", "coefficient = 0.0", "learning.entropy.coefficient: 0; must lie in"),
        ("learning_rate", "learning_rate = -1.0", "learning.entropy.learning_rate: -1; must lie in"),
    ];
    for (key, line, expected) in out_of_range {
        let message = with(key, line).unwrap_err();
        assert!(message.contains(expected), "{line}: {message}");
    }
}

#[test]
fn a_refinements_value_out_of_its_range_is_refused_with_its_key() {
    for (setting, expected) in [
        ("refinement.begin=1.0", "refinement.begin: 1; must lie in 0..0.99"),
        ("refinement.logit_factor=0.0", "refinement.logit_factor: 0; must lie in 0.01..100"),
        ("refinement.frames=0", "refinement.frames: 0; must lie in 1..64"),
        ("refinement.n_steps=0", "refinement.n_steps: 0; must lie in 1.."),
        ("refinement.epochs=0", "refinement.epochs: 0; must lie in 1.."),
        ("refinement.batch=1", "refinement.batch: 1; must lie in 2.."),
        ("refinement.gamma=1.5", "refinement.gamma: 1.5; must lie in 0..1"),
        ("refinement.gae_lambda=-0.1", "refinement.gae_lambda: -0.1; must lie in 0..1"),
        ("refinement.clip=0.0", "refinement.clip: 0; must lie in"),
        ("refinement.advantage_limit=0.0", "refinement.advantage_limit: 0 standard deviations; must lie in"),
        ("refinement.actor_learning_rate=0.0", "refinement.actor_learning_rate: 0; must lie in"),
        ("refinement.critic_learning_rate=2.0", "refinement.critic_learning_rate: 2; must lie in"),
        ("refinement.actor_ema_rate=0.0", "refinement.actor_ema_rate: 0; must lie in"),
        ("refinement.clearance_power=0.0", "refinement.clearance_power: 0; must lie in"),
        ("refinement.reward.clearance_limit=0.0", "refinement.reward.clearance_limit: 0 m; must lie in 0.01..10 m"),
        ("refinement.reward.lane=1.0", "unknown field `lane`"),
        ("refinement.reward.apron=-1.0", "refinement.reward.apron: -1; an apron weighs what it does in the run"),
    ] {
        let message = Config::read_with(Path::new("lane"), &[setting.to_owned()]).unwrap_err().to_string();
        assert!(message.contains(expected), "{setting}: {message}");
    }
}

#[test]
fn a_key_that_is_unknown_missing_or_of_another_type_is_refused_by_its_name() {
    for (key, line, expected) in [
        ("batch", "bacth = 512", "unknown field `bacth`"),
        ("batch", "", "missing field `batch`"),
        ("batch", "batch = -4", "invalid value"),
        ("seed", "seed = 4294967296", "invalid value"),
        ("critics", "critics = \"median\"", "unknown variant `median`"),
        ("hidden", "hidden = 256", "invalid type: integer `256`, expected an array"),
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
fn a_replay_buffer_too_small_for_its_trucks_is_refused() {
    let text =
        default_file().replace("n_envs = 512", "n_envs = 65536").replace("capacity = 600000", "capacity = 655360");
    let message = read(&text).unwrap_err();
    // Of ten slots none is followed by ten others.
    assert!(message.contains("replay_buffer.capacity: 655360; must hold more than learning.n_steps = 10"), "{message}");
}

#[test]
fn the_command_line_replaces_keys_and_a_budget_there_replaces_both() {
    let mut config = with("steps", "minutes = 5.0\nsteps = 70000").unwrap();
    config.override_with(&Flags { seed: Some(3), steps: Some(1000), envs: Some(16), ..Flags::default() }).unwrap();
    assert_eq!((config.seed, config.n_envs, config.minutes, config.steps), (3, 16, None, Some(1000)));
    let none = Flags { envs: Some(0), ..Flags::default() };
    let message = config.override_with(&none).unwrap_err().to_string();
    assert_eq!(message, "--envs 0: n_envs: 0; must lie in 1..1048576");
    // What they replace need not go together with the rest of the file.
    let settings = ["replay_buffer.capacity=5000", "replay_buffer.warmup=4000"].map(str::to_owned);
    let read = |envs: Option<usize>| {
        Config::read_for(Path::new("default"), None, &settings, &Flags { envs, ..Flags::default() })
    };
    assert_eq!(read(Some(64)).unwrap().n_envs, 64);
    let message = read(Some(512)).unwrap_err().to_string();
    assert!(message.starts_with("default with --set replay_buffer.capacity=5000 --set "), "{message}");
    assert!(message.contains("--envs 512: replay_buffer.capacity: 5000; must hold more than"), "{message}");
}

#[test]
fn a_key_that_works_on_the_processor_alone_is_refused_for_a_device() {
    let plain = default_file();
    let on_device = format!("device = \"gpu\"\n{plain}");
    assert_eq!(read(&on_device).unwrap().device, Device::Gpu);
    let exploration = "[exploration]\ninitial_fraction = 1.0\nfinal_fraction = 0.1\nsteps = 1000\n";
    let lane = std::fs::read_to_string(crate::repository().join("learner/configs/lane.toml")).unwrap();
    let refinement = &lane[lane.find("\n[refinement]").unwrap()..];
    let tables = [("exploration", exploration), ("refinement", refinement)];
    let with_tables = tables.map(|(key, table)| (key, format!("{plain}\n{table}")));
    for (key, text) in with_tables {
        assert!(read(&text).is_ok(), "{key}");
        let message = read(&format!("device = \"gpu\"\n{text}")).unwrap_err().to_string();
        assert!(message.contains(&format!("{key}: given; works with device = \"cpu\" alone")), "{message}");
    }
}

#[test]
fn the_training_file_for_a_device_has_what_the_default_one_has_but_for_its_sizes() {
    let gpu = Config::read(Path::new("gpu")).unwrap();
    let default = Config::read(Path::new("default")).unwrap();
    let mut expected = Config { device: Device::Gpu, n_envs: gpu.n_envs, ..default };
    expected.replay_buffer.capacity = gpu.replay_buffer.capacity;
    expected.replay_buffer.warmup = gpu.replay_buffer.warmup;
    expected.learning.updates_per_step = gpu.learning.updates_per_step;
    assert_eq!(gpu, expected);
}

#[test]
fn any_value_of_any_key_is_taken_or_refused_by_its_key() {
    let text = default_file();
    let lines: Vec<&str> = text.lines().collect();
    // Tables may have keys of the same name, so a key is its line.
    let key =
        |line: &str| if line.starts_with('#') { None } else { line.split_once(" = ").map(|(key, _)| key.to_owned()) };
    let keys: Vec<(usize, String)> =
        lines.iter().enumerate().filter_map(|(index, line)| Some((index, key(line)?))).collect();
    assert_eq!(keys.len(), 38, "{keys:?}");
    let mut taken = 0;
    for (index, key) in &keys {
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
            let changed = format!("{key} = {value}");
            let text: Vec<&str> =
                lines.iter().enumerate().map(|(other, &line)| if other == *index { &changed } else { line }).collect();
            match read(&text.join("\n")) {
                Ok(config) => {
                    taken += 1;
                    assert_eq!(read(&config.to_toml()).as_ref(), Ok(&config), "{key} = {value}");
                }
                Err(message) => assert!(message.contains(key.as_str()), "{key} = {value}: {message}"),
            }
        }
    }
    // Zeros where they mean something, and any text for a benchmark's name.
    assert!((4..40).contains(&taken), "{taken}");
}

/// What reading the default file with some keys set gives.
pub(super) fn with_set(settings: &[&str]) -> Result<Config, String> {
    let file = crate::repository().join("learner/configs/default.toml");
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    Config::read_with(&file, &settings).map_err(|error| error.to_string())
}

#[test]
fn a_benchmark_of_ones_own_takes_the_place_of_all_that_a_training_file_says_of_others() {
    let config =
        Config::read_for(Path::new("default"), Some("mine.toml"), &["reward.failure=-9".to_owned()], &Flags::default())
            .unwrap();
    let usual = with_set(&[]).unwrap();
    assert_eq!(
        (config.benchmark.as_str(), &config.training_benchmark, &config.also_evaluate),
        ("mine.toml", &None, &Vec::new())
    );
    assert_eq!(config.changed_rewards(), "reward.failure = -9.0");
    assert_eq!(config.validation, Some(Validation { benchmark: None, ..usual.validation.unwrap() }));
    assert_eq!(config.learning, usual.learning);
    assert_eq!(read(&config.to_toml()), Ok(config));
}

#[test]
fn every_training_file_reads_by_path_and_by_name() {
    let folder = crate::repository().join("learner/configs");
    let files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(files.len(), 14);
    for file in files {
        let by_path = Config::read(&file).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(Config::read(Path::new(file.file_stem().unwrap())).unwrap(), by_path);
    }
    // A copy finds its base by name where none lies beside it.
    let copies = tempfile::tempdir().unwrap();
    for name in ["best", "traffic-refined"] {
        let copy = copies.path().join("mine.toml");
        std::fs::copy(crate::repository().join(format!("learner/configs/{name}.toml")), &copy).unwrap();
        assert_eq!(Config::read(&copy).map_err(|error| error.to_string()), Ok(Config::read(Path::new(name)).unwrap()));
    }
    let message = Config::read(Path::new("papre")).unwrap_err().to_string();
    assert!(
        message.contains(
            "papre: is no training file: the program comes with default, best, lane, attard, gpu, as-run, laden, \
            laden-50, transfer, transfer-refined, traffic, traffic-refined, laden-gpu, paper"
        ),
        "{message}"
    );
}

#[test]
fn a_file_gives_only_what_differs_from_its_base() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let read = |name: &str| Config::read(&folder.path().join(name)).map_err(|error| error.to_string());
    write("own.toml", &default_file());
    write(
        "longer.toml",
        "base = \"own.toml\"\nsteps = 40000\n[learning]\ngamma = 0.5\n[learning.entropy]\ncoefficient = 0.1\n",
    );
    write("longest.toml", "base = \"longer.toml\"\nsteps = 50000\n");
    let (own, longest) = (read("own.toml").unwrap(), read("longest.toml").unwrap());
    assert_eq!((longest.steps, longest.learning.gamma, longest.learning.entropy.coefficient), (Some(50_000), 0.5, 0.1));
    assert_eq!(
        (&longest.learning.hidden, longest.learning.entropy.learning_rate),
        (&own.learning.hidden, own.learning.entropy.learning_rate)
    );
    // By name too, wherever the file is.
    write("named.toml", "base = \"default\"\nseed = 9\n");
    assert_eq!(read("named.toml").unwrap(), Config { seed: 9, ..own });
    write("circle.toml", "base = \"circle.toml\"\n");
    write("wrong.toml", "base = 3\n");
    write("missing.toml", "base = \"no.toml\"\n");
    for (file, expected) in [
        ("circle.toml", "base: \"circle.toml\"; at most 8 files may follow each other"),
        ("wrong.toml", "base: 3; must be the name or the path"),
        ("missing.toml", "missing.toml: base: \"no.toml\"; "),
        ("missing.toml", "must be a path ending in .toml, relative to this file, or one of default, best"),
    ] {
        let message = read(file).unwrap_err();
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn further_evaluations_are_benchmarks_with_or_without_a_split() {
    let with_also = |list: &str| with("also_evaluate", &format!("also_evaluate = {list}"));
    let config =
        with_also(r#"["attard2023-full", "attard2023-full/train", "own/a.toml/validation", "b.toml"]"#).unwrap();
    let named: Vec<String> = config.also_evaluated().iter().map(AlsoEvaluate::name).collect();
    assert_eq!(named, ["attard2023-full/test", "attard2023-full/train", "own/a.toml/validation", "b.toml/test"]);
    assert_eq!(read(&config.to_toml()).unwrap(), config);
    for (list, expected) in [
        (r#"["attard2023/all"]"#, "also_evaluate[0]: \"attard2023/all\"; must be a benchmark's name"),
        (r#"["random2026", ""]"#, "also_evaluate[1]: \"\"; must be"),
        (r#"["/train"]"#, "also_evaluate[0]: \"/train\"; must be"),
        (r#"["attard2023"]"#, "also_evaluate[0]: \"attard2023\"; is evaluated already, as `benchmark`"),
        (r#"["random2026/test", "random2026"]"#, "also_evaluate[1]: \"random2026\"; is evaluated already"),
        (r#""random2026""#, "expected an array"),
    ] {
        let message = with_also(list).unwrap_err();
        assert!(message.contains(expected), "{list}: {message}");
    }
}

#[test]
fn a_file_does_without_keys_of_its_base() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("base.toml", &default_file());
    let read = |text: &str| {
        write("mine.toml", text);
        Config::read(&folder.path().join("mine.toml")).map_err(|error| error.to_string())
    };
    let whole = read("base = \"base.toml\"").unwrap();
    assert!(whole.validation.is_some() && whole.replay_buffer.priority.is_some());
    let mine = read("base = \"base.toml\"\nwithout = [\"validation\", \"replay_buffer.priority\"]").unwrap();
    assert_eq!((&mine.validation, &mine.replay_buffer.priority), (&None, &None));
    assert_eq!(mine.learning, whole.learning);
    for (text, expected) in [
        ("base = \"base.toml\"\nwithout = [\"validatoin\"]", "without: \"validatoin\"; "),
        ("base = \"base.toml\"\nwithout = \"validation\"", "must be a list of keys of the base"),
        ("base = \"base.toml\"\nwithout = [\"seed.x\"]", "has no such key"),
        ("without = [\"validation\"]", "stands beside `base` alone"),
    ] {
        let message = read(text).unwrap_err();
        assert!(message.contains("mine.toml") && message.contains(expected), "{message}");
    }
}

#[test]
fn a_rule_is_one_of_two_on_the_processor_alone_and_part_of_what_makes_a_run() {
    let read = |settings: &[&str]| {
        let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
        Config::read_with(Path::new("traffic"), &settings).map_err(|error| error.to_string())
    };
    let unknown = read(&["rule=\"waits\""]).unwrap_err();
    assert!(unknown.contains("unknown variant `waits`, expected `yields` or `follows`"), "{unknown}");
    let on_device = read(&["rule=\"yields\"", "device=\"gpu\""]).unwrap_err();
    assert!(on_device.contains("rule: given; works with device = \"cpu\" alone"), "{on_device}");
    let (with, without) = (read(&["rule=\"yields\""]).unwrap(), read(&[]).unwrap());
    assert_eq!((with.rule, without.rule), (Some(Rule::Yields), None));
    assert_eq!(with.hindrance(&without).unwrap().0, "rule");
}
