//! Random roads as part of a benchmark: which are in which split, how trucks start on them, and what is refused.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use offtrack::files::cache::{Cache, Loading, Progress};
use offtrack::layout::Ended;
use offtrack::map::procedural::{Distribution, find};
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{Engine, RouteChoice};
use offtrack::world::World;

use crate::{batch_on, scenarios};

const HEAD: &str = r#"
load = "empty"
gutter = "drivable"
actions = { steer_levels = [-0.5, 0.0, 0.5], speeds_kmh = [30.0] }
sensors = { range = 20.0 }
reward = { waypoint = 100.0, lane_distance = -1.5, lane_distance_limit = 4.0, failure = -500.0 }
"#;

const ROADS: &str = "seed = 7\ncount = 20\ntrain = [0, 3]\nvalidation = [15, 16]\ntest = [10, 12]\n";

/// A benchmark with these keys of `[procedural]` and, after them, whatever else.
fn benchmark(folder: &Path, procedural: &str) -> PathBuf {
    let scenarios = scenarios();
    let vehicle = format!("vehicle = \"{}\"", scenarios.join("vehicles/daf_xf.toml").display());
    let distribution = format!("distribution = \"{}\"", scenarios.join("distributions/wide.toml").display());
    let path = folder.join("random.toml");
    std::fs::write(&path, format!("{vehicle}\n{HEAD}\n[procedural]\n{distribution}\n{procedural}")).unwrap();
    path
}

/// The roundabouts of a split, in their order.
fn roads(scenario: &Scenario, split: Split) -> Vec<String> {
    let mut roads: Vec<String> =
        scenario.split_names(split).iter().map(|name| name.rsplit_once('/').unwrap().0.to_owned()).collect();
    roads.dedup();
    roads
}

#[test]
fn each_range_of_roads_is_one_split_with_all_their_routes() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Scenario::read(&benchmark(folder.path(), ROADS)).unwrap();
    assert_eq!(roads(&scenario, Split::Train), ["wide/7/0", "wide/7/1", "wide/7/2"]);
    assert_eq!(roads(&scenario, Split::Validation), ["wide/7/15"]);
    assert_eq!(roads(&scenario, Split::Test), ["wide/7/10", "wide/7/11"]);
    for place in &scenario.places {
        let all = find(&place.roundabout.name).unwrap().routes(40.0, 35.0, 2.0).unwrap();
        assert_eq!(place.routes, all);
    }
    let listed: usize = Split::ALL.iter().map(|&split| scenario.split(split).len()).sum();
    assert_eq!(listed, scenario.routes().count());
}

#[test]
fn random_roads_stand_beside_roundabouts_from_files_that_have_a_validation_split_too() {
    let folder = tempfile::tempdir().unwrap();
    let file = scenarios().join("roundabouts/20m.toml");
    let listed = format!(
        "{ROADS}\n[[roundabout]]\nfile = \"{}\"\ntrain = [\"E-left-2\"]\nvalidation = [\"E-left-3\"]\n\
         test = [\"N-left-2\"]\n",
        file.display()
    );
    let scenario = Scenario::read(&benchmark(folder.path(), &listed)).unwrap();
    assert_eq!(scenario.split_names(Split::Validation)[0], "20m/E-left-3");
    assert_eq!(roads(&scenario, Split::Validation), ["20m", "wide/7/15"]);
    assert_eq!(roads(&scenario, Split::Train)[..2], ["20m", "wide/7/0"]);
    let twice = listed.replace("validation = [\"E-left-3\"]", "validation = [\"E-left-2\"]");
    let message = Scenario::read(&benchmark(folder.path(), &twice)).unwrap_err().to_string();
    assert!(message.contains("roundabout[0].validation: 20m/E-left-2; is listed under `train` too"), "{message}");
}

#[test]
fn every_wrong_key_of_procedural_is_named_with_what_would_do() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to, expected) in [
        ("seed = 7", "seed = -1", "procedural: invalid value: integer `-1`, expected a whole number in 0..4294967295"),
        ("seed = 7", "seed = 4294967296", "expected a whole number in 0..4294967295"),
        ("seed = 7", "", "missing field `seed`"),
        ("count = 20", "count = 0", "procedural.count: 0; must lie in 1..1000000"),
        ("count = 20", "count = 1000001", "procedural.count: 1000001; must lie in 1..1000000"),
        (
            "count = 20",
            "count = 15",
            "procedural.validation: [15, 16]; must be [first, last + 1] with first < last + 1 <= procedural.count, \
             which is 15",
        ),
        ("train = [0, 3]", "train = [3, 3]", "procedural.train: [3, 3]; must be [first, last + 1]"),
        (
            "train = [0, 3]",
            "train = [0, 11]",
            "procedural.test: [10, 12]; shares roads with procedural.train; a road is in one split",
        ),
        ("train = [0, 3]", "train = [0, 16]", "procedural.validation: [15, 16]; shares roads with procedural.train"),
        ("train = [0, 3]", "train = [0]", "invalid length 1"),
        (
            ROADS,
            "seed = 7\ncount = 20\n",
            "procedural: no roads; at least one of `train`, `validation` and `test` is needed",
        ),
        (
            ROADS,
            "seed = 7\ncount = 200000\ntrain = [0, 100001]\n",
            "procedural: 100001 roads; train, validation and test together may have 100000",
        ),
        ("count = 20", "count = 20\ncolour = 1", "colour"),
        (
            "[10, 12]\n",
            "[10, 12]\n[routes]\napproach = 60.0\n",
            "routes.approach: 60 m; the truck needs 13.02 m of the arm behind its start",
        ),
        ("[10, 12]\n", "[10, 12]\n[routes]\napproach = 90.0\n", "routes.approach: 90 m; approach of 90 m leaves arm"),
    ] {
        assert!(ROADS.contains(from), "{from}");
        let path = benchmark(folder.path(), &ROADS.replacen(from, to, 1));
        let message = Scenario::read(&path).map(|_| ()).unwrap_err().to_string();
        assert!(message.starts_with(&path.display().to_string()) && message.contains(expected), "{to}: {message}");
    }
    let path = benchmark(folder.path(), ROADS);
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("wide.toml", "narrow.toml")).unwrap();
    let message = Scenario::read(&path).unwrap_err().to_string();
    assert!(
        message.contains("random.toml: procedural.distribution: ") && message.contains("narrow.toml: cannot be read"),
        "{message}"
    );
}

#[test]
fn a_benchmark_without_any_roundabout_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = benchmark(folder.path(), ROADS);
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.split("[procedural]").next().unwrap()).unwrap();
    assert!(Scenario::read(&path).unwrap_err().to_string().contains("roundabout: 0 tables; must lie in 1..100000"));
}

#[test]
fn a_scenario_from_the_cache_is_the_same_and_progress_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = benchmark(folder.path(), ROADS);
    let plain = format!("{:?}", Scenario::read(&path).unwrap());
    let cache = Cache::new(&folder.path().join("cache"));
    let told = Arc::new(Mutex::new(Vec::new()));
    let telling = told.clone();
    let watcher = move |progress: Progress| telling.lock().unwrap().push(progress);
    for _ in 0..2 {
        let loading = Loading { cache: Some(&cache), watcher: &watcher, ..Loading::PLAIN };
        assert_eq!(format!("{:?}", Scenario::load(path.to_str().unwrap(), &loading).unwrap()), plain);
    }
    assert_eq!(cache.failure(), None);
    assert!(0 < std::fs::read_dir(folder.path().join("cache")).unwrap().count());
    let told = told.lock().unwrap();
    assert_eq!(told.len(), 12);
    assert!(
        told.iter().all(|progress| progress.what == "drawing roads" && progress.total == 6)
            && told.iter().any(|progress| progress.done == 6)
    );
}

#[test]
fn a_scenario_that_keeps_a_split_has_its_routes_alone_in_their_order() {
    let folder = tempfile::tempdir().unwrap();
    let whole = Scenario::read(&benchmark(folder.path(), ROADS)).unwrap();
    for splits in [&[Split::Test][..], &[Split::Validation, Split::Train], &Split::ALL, &[]] {
        let mut kept = whole.clone();
        kept.keep(splits);
        for split in Split::ALL {
            let expected = if splits.contains(&split) { whole.split_names(split) } else { Vec::new() };
            assert_eq!(kept.split_names(split), expected);
        }
        let listed: usize = splits.iter().map(|&split| whole.split(split).len()).sum();
        assert_eq!(kept.routes().count(), listed);
        assert!(kept.places.iter().all(|place| !place.routes.is_empty()));
    }
}

#[test]
fn a_benchmark_on_another_roundabout_has_all_its_routes_to_test_and_otherwise_the_same() {
    let mut whole = Scenario::named("attard2023").unwrap();
    let alone = whole.on(find("wide/7/12").unwrap()).unwrap();
    assert_eq!(roads(&alone, Split::Test), ["wide/7/12"]);
    assert_eq!(alone.routes().count(), alone.split(Split::Test).len());
    assert_eq!(
        (alone.steer_levels.clone(), alone.vehicle.clone()),
        (whole.steer_levels.clone(), whole.vehicle.clone())
    );
    whole.add(find("wide/7/12").unwrap(), Split::Validation).unwrap();
    assert_eq!(whole.split_names(Split::Validation), alone.split_names(Split::Test));
    assert_eq!(whole.split(Split::Test).len(), 23);
    whole.approach = 90.0;
    let message = whole.on(find("wide/7/12").unwrap()).unwrap_err().to_string();
    assert!(message.contains("wide/7/12: routes.approach: 90 m; "), "{message}");
}

#[test]
fn trucks_start_on_random_roads_without_touching_a_kerb() {
    for name in ["wide", "mixed"] {
        let mut scenario = Scenario::named("attard2023").unwrap();
        scenario.keep(&[]);
        for road in Distribution::named(name).unwrap().roads(21, &(0..20).collect::<Vec<_>>(), &Loading::PLAIN).unwrap()
        {
            scenario.add(road.roundabout, Split::Train).unwrap();
        }
        let world = Arc::new(World::bake(&scenario).unwrap());
        let n_routes = world.routes.len() as u32;
        let routes: Vec<u32> = (0..4 * n_routes).map(|env| env % n_routes).collect();
        let n_envs = routes.len();
        let mut simulator = batch_on(&Engine::Cpu, &world, n_envs, 3, RouteChoice::Fixed(routes));
        simulator.step(&vec![4; n_envs]).unwrap();
        assert!(simulator.batch().ended.iter().all(|&ended| ended == Ended::Running as u32), "{name}");
    }
}

#[test]
fn the_shipped_random_benchmark_trains_on_200_roads_and_reports_100_others() {
    let benchmark = Scenario::named("random2026").unwrap();
    assert_eq!(Split::ALL.map(|split| roads(&benchmark, split).len()), [200, 40, 100]);
    let training = Scenario::named("random2026-training").unwrap();
    assert_eq!(training.split_names(Split::Train), benchmark.split_names(Split::Train));
    assert_eq!(training.routes().count(), training.split(Split::Train).len());
}

#[test]
fn work_on_many_roads_that_is_stopped_ends_at_the_next_road() {
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

    let folder = tempfile::tempdir().unwrap();
    let path = benchmark(folder.path(), ROADS);
    let (stop, done) = (AtomicBool::new(false), AtomicUsize::new(0));
    let watcher = |_| {
        stop.store(true, Ordering::Relaxed);
        done.fetch_add(1, Ordering::Relaxed);
    };
    let loading = Loading { watcher: &watcher, stop: &stop, ..Loading::PLAIN };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let stopped = pool.install(|| Scenario::load(path.to_str().unwrap(), &loading)).unwrap_err();
    assert_eq!(stopped.to_string(), "stopped before all roads were read");
    // Each thread ends with the road that it is at.
    assert!((1..=2).contains(&done.load(Ordering::Relaxed)));
    let scenario = Scenario::read(&path).unwrap();
    stop.store(false, Ordering::Relaxed);
    done.store(0, Ordering::Relaxed);
    let stopped = pool.install(|| World::bake_with(&scenario, &loading)).unwrap_err();
    assert_eq!(stopped.to_string(), "stopped before all roads were done");
    assert!((1..=2).contains(&done.load(Ordering::Relaxed)) && 2 < scenario.places.len());
}

#[test]
fn a_scenario_equals_the_same_file_read_again_and_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = benchmark(folder.path(), ROADS);
    let read = || Scenario::read(&path).unwrap();
    let first = read();
    assert!(first == read());
    let mut changed = read();
    changed.time_limit += 1e-9;
    assert!(first != changed);
    let mut changed = read();
    changed.keep(&[Split::Train]);
    assert!(first != changed);
}
