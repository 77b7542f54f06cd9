//! The embedded scenario files against the folder they come from, and how names and paths find them.

use std::collections::BTreeMap;
use std::path::Path;

use offtrack::files::shipped::{FILES, Kind, Source};
use offtrack::map::procedural::Distribution;
use offtrack::map::{Gutter, Road};
use offtrack::scenario::Scenario;
use offtrack::vehicle::Vehicle;

use crate::scenarios;

/// Path below `folder` and text of every TOML file in it, at any depth.
fn on_disk(folder: &Path, below: &Path, files: &mut BTreeMap<String, String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let below = below.join(path.file_name().unwrap());
        if path.is_dir() {
            on_disk(&path, &below, files);
        } else if path.extension().is_some_and(|extension| extension == "toml") {
            files.insert(below.to_str().unwrap().to_owned(), std::fs::read_to_string(path).unwrap());
        }
    }
}

#[test]
fn every_scenario_file_of_the_repository_is_embedded_as_it_is() {
    let mut files = BTreeMap::new();
    on_disk(&scenarios(), Path::new(""), &mut files);
    let embedded: BTreeMap<String, String> =
        FILES.iter().map(|&(path, text)| (path.to_owned(), text.to_owned())).collect();
    assert_eq!(
        (files.len(), FILES.len()),
        (77, 77),
        "50 benchmarks, ten roundabouts, five outlines, ten vehicles, two distributions"
    );
    assert!(files == embedded, "on disk {:?}, embedded {:?}", files.keys(), embedded.keys());
    let kinds = [Kind::Benchmark, Kind::Roundabout, Kind::Vehicle, Kind::Distribution];
    assert_eq!(kinds.map(|kind| kind.names().count()), [50, 10, 10, 2]);
}

/// A shipped benchmark's file as it is read as TOML.
fn table(name: &str) -> toml::Table {
    Source::named(Kind::Benchmark, name).unwrap().text().unwrap().parse().unwrap()
}

/// Benchmarks of so many roads that they are not drawn here.
const LARGE: [&str; 2] = ["random2026-1000", "random2026-10000"];

#[test]
fn the_large_benchmarks_are_random2026_with_other_test_roads_that_no_split_shares() {
    let range = |table: &toml::Table, split: &str| -> Option<(i64, i64)> {
        let range = table["procedural"].get(split)?.as_array()?;
        Some((range[0].as_integer()?, range[1].as_integer()?))
    };
    let small = table("random2026");
    let mut ranges: Vec<(i64, i64)> =
        ["train", "validation", "test"].iter().filter_map(|split| range(&small, split)).collect();
    for (name, n_roads) in LARGE.into_iter().zip([1000, 10_000]) {
        let mut large = table(name);
        let (from, to) = range(&large, "test").unwrap();
        assert_eq!(to - from, n_roads);
        assert!(ranges.iter().all(|&(first, end)| end <= from || to <= first), "{name}: {ranges:?}");
        ranges.push((from, to));
        // Without the roads the files are the same.
        let procedural = large["procedural"].as_table_mut().unwrap();
        assert_eq!(procedural.len(), 4);
        procedural.remove("test");
        for key in ["train", "validation", "test", "count"] {
            procedural.insert(key.to_owned(), small["procedural"][key].clone());
        }
        assert_eq!(large, small);
    }
}

#[test]
fn the_laden_benchmarks_of_random_roads_differ_from_laden2026_in_roads_and_training_alone() {
    for (laden, empty) in [("laden2026-random", "random2026"), ("laden2026-training", "random2026-training")] {
        let (mut laden, empty, mut expected) = (table(laden), table(empty), table("laden2026"));
        assert_eq!(laden.remove("procedural").as_ref(), Some(&empty["procedural"]));
        assert_eq!(laden["reward"], empty["reward"]);
        let start = laden.remove("start").unwrap();
        assert_eq!(start["speed_kmh"], expected["start"]["speed_kmh"]);
        assert_eq!(start.get("offset"), empty.get("start").and_then(|start| start.get("offset")));
        let ending = laden["ending"].as_table_mut().unwrap();
        let is_training = empty["reward"].get("clearance").is_some();
        assert_eq!(ending.remove("rollover_ratio").is_some(), is_training);
        // Training has less grip than is evaluated, from below the least of it.
        let friction = |table: &mut toml::Table| table["draw"].as_table_mut().unwrap().remove("friction").unwrap();
        let (drawn, evaluated) = (friction(&mut laden), friction(&mut expected));
        assert_eq!(drawn[0].as_float() < evaluated[0].as_float(), is_training);
        assert!(is_training || drawn == evaluated);
        for key in ["reward", "start", "roundabout"] {
            laden.remove(key);
            expected.remove(key);
        }
        assert_eq!(laden, expected);
    }
}

#[test]
fn the_random_roads_of_laden2026_50_differ_from_it_in_roads_and_the_room_before_them_alone() {
    let (mut random, mut expected) = (table("laden2026-50-random"), table("laden2026-50"));
    assert_eq!(random.remove("procedural").as_ref(), Some(&table("random2026")["procedural"]));
    for (table, keys) in [(&mut random, &["routes"][..]), (&mut expected, &["routes", "roundabout"])] {
        assert!(keys.iter().all(|&key| table.remove(key).is_some()), "{table}");
    }
    assert_eq!(random, expected);
}

#[test]
fn the_random_roads_of_laden2026_odd_differ_from_those_of_laden2026_in_its_vehicles_alone() {
    let (mut odd_random, mut random, odd) =
        (table("laden2026-odd-random"), table("laden2026-random"), table("laden2026-odd"));
    assert_eq!(odd_random.remove("draw").as_ref(), Some(&odd["draw"]));
    assert_ne!(random.remove("draw").as_ref(), Some(&odd["draw"]));
    assert_eq!(odd_random, random);
}

#[test]
fn the_held_out_benchmarks_of_traffic2026_differ_from_it_in_what_they_are_named_for_alone() {
    let traffic = table("traffic2026");
    let without = |mut table: toml::Table, keys: &[&str]| {
        keys.iter().for_each(|&key| drop(table.remove(key).unwrap()));
        table
    };
    let among = |name: &str| table(name)["traffic"].clone();
    for drivers in ["aggressive", "timid", "distracted"] {
        let name = format!("traffic2026-{drivers}");
        assert_eq!(without(table(&name), &["traffic"]), without(traffic.clone(), &["traffic"]), "{name}");
        let expected = format!("demand = [1500.0]\ndrivers = \"{drivers}\"\nvans = 0.25");
        assert_eq!(among(&name), toml::Value::Table(expected.parse().unwrap()), "{name}");
    }
    let rude = "traffic2026-rude";
    assert_eq!(without(table(rude), &["traffic"]), without(traffic.clone(), &["traffic"]));
    let mut expected = traffic["traffic"].clone();
    expected.as_table_mut().unwrap().insert("rude".to_owned(), 0.3.into());
    assert_eq!(among(rude), expected);
    let large = "traffic2026-large";
    assert_eq!(without(table(large), &["traffic"]), without(traffic.clone(), &["traffic"]));
    let mut expected = traffic["traffic"].as_table().unwrap().clone();
    expected.insert("vans".to_owned(), 0.2.into());
    expected.extend(["buses", "rigid_trucks", "tractor_trailers"].map(|kind| (kind.to_owned(), 0.05.into())));
    assert_eq!(among(large), toml::Value::Table(expected));
    for key in ["vehicle", "draw", "ending", "start"] {
        assert_eq!(table("traffic2026-laden")[key], table("laden2026")[key], "{key}");
    }
    let found = without(table("traffic2026-laden"), &["vehicle", "draw", "ending", "start"]);
    assert_eq!(found, without(traffic.clone(), &["vehicle", "load"]));
    let maps = without(table("traffic2026-maps"), &["traffic"]);
    assert_eq!(maps["roundabout"], table("maps2026")["roundabout"]);
    assert_eq!(without(maps, &["roundabout"]), without(traffic, &["traffic", "roundabout"]));
}

#[test]
fn the_benchmarks_of_traffic2026_differ_from_those_without_in_vehicles_speeds_and_training_alone() {
    let traffic = table("traffic2026");
    for (name, other) in [
        ("traffic2026", "attard2023"),
        ("traffic2026-random", "random2026"),
        ("traffic2026-training", "random2026-training"),
    ] {
        let (mut among, mut other) = (table(name), table(other));
        assert_eq!((&among["actions"], &among["observation"]), (&traffic["actions"], &traffic["observation"]));
        assert_eq!(among["actions"]["steer_levels"], other["actions"]["steer_levels"]);
        let is_training = other.contains_key("start");
        let keys = if is_training { &["rude", "demand"][..] } else { &[] };
        assert_eq!(among["traffic"] == traffic["traffic"], !is_training, "{name}");
        let mut vehicles = [among.remove("traffic").unwrap(), traffic["traffic"].clone()];
        for table in &mut vehicles {
            keys.iter().for_each(|&key| drop(table.as_table_mut().unwrap().remove(key)));
        }
        assert_eq!(vehicles[0], vehicles[1], "{name}");
        if is_training {
            let speeds = among["start"].as_table_mut().unwrap().remove("speed_kmh").unwrap();
            assert_eq!((speeds[0].as_float(), speeds[1].as_float()), (Some(0.0), Some(30.0)));
        }
        for table in [&mut among, &mut other] {
            ["actions", "observation"].iter().for_each(|&key| drop(table.remove(key)));
        }
        assert_eq!(among, other, "{name}");
    }
    // What is held out is never trained with.
    let demand = |name: &str| -> Vec<f64> {
        let table = table(name);
        table["traffic"]["demand"].as_array().unwrap().iter().filter_map(toml::Value::as_float).collect()
    };
    for name in ["traffic2026-training", "traffic2026-refinement"] {
        assert!(demand(name).iter().all(|&trained| trained < 2100.0), "{name}");
        let traffic = &table(name)["traffic"];
        assert!(traffic.get("drivers").is_none() && traffic["rude"][1].as_float().unwrap() < 0.3, "{name}");
    }
    assert_eq!(demand("traffic2026"), [300.0, 900.0, 1500.0, 2100.0]);
    // A refinement has other roads, and loads beside the truck of traffic2026.
    let (refinement, training) = (table("traffic2026-refinement"), table("traffic2026-training"));
    assert_ne!(refinement["procedural"]["seed"], training["procedural"]["seed"]);
    let vehicles = refinement["vehicle"].as_array().unwrap();
    assert_eq!(vehicles[..2], table("laden2026")["vehicle"].as_array().unwrap()[..]);
    assert_eq!((vehicles.len(), &vehicles[2]["file"], vehicles[2].get("model")), (3, &traffic["vehicle"], None));
    for key in ["actions", "sensors", "observation", "start", "reward"] {
        assert_eq!(refinement[key], training[key], "{key}");
    }
}

#[test]
fn the_benchmarks_of_transfer2026_differ_in_roads_training_and_disturbances_alone() {
    let (transfer, laden) = (table("transfer2026"), table("laden2026"));
    assert_eq!(transfer["roundabout"], laden["roundabout"]);
    assert_eq!((&transfer["actions"], &transfer["observation"]), (&laden["actions"], &laden["observation"]));
    let (mut random, mut expected) = (table("transfer2026-random"), transfer.clone());
    assert_eq!(random.remove("procedural"), table("laden2026-random").remove("procedural"));
    expected.remove("roundabout");
    assert_eq!(random, expected);
    // Without slip all else is the same.
    for name in ["transfer2026", "transfer2026-random"] {
        let mut without = table(&name.replace("transfer2026", "transfer2026-no-slip"));
        let slip =
            without["draw"].as_table_mut().unwrap().insert("slip".to_owned(), table(name)["draw"]["slip"].clone());
        assert_eq!((without, slip), (table(name), Some(vec![0.0, 0.0].into())), "{name}");
    }
    // A refinement has other roads, one more vehicle, and lags and slip down to less; its seed is no other benchmark's.
    let (mut refinement, mut training) = (table("transfer2026-refinement"), table("transfer2026-training"));
    assert_ne!(refinement["procedural"]["seed"], training["procedural"]["seed"]);
    let vehicles = refinement["vehicle"].as_array().unwrap();
    assert_eq!(vehicles[..2], training["vehicle"].as_array().unwrap()[..]);
    assert_eq!((vehicles.len(), vehicles[2].get("model")), (3, None));
    for key in ["slip", "drive_lag", "brake_lag"] {
        let [least, trained] = [&refinement, &training].map(|table| table["draw"][key][0].as_float().unwrap());
        assert!(least < trained, "{key}");
    }
    // One more has the truck of attard2023 beside, which is not drawn, and another trucks without slip, too.
    let mut any_slip = table("transfer2026-refinement-any-slip");
    let kinematic = any_slip["vehicle"].as_array_mut().unwrap().pop().unwrap();
    assert_eq!(kinematic["model"]["slip_lever"].as_float(), Some(0.0));
    let slip = any_slip["draw"].as_table_mut().unwrap().insert("slip".to_owned(), refinement["draw"]["slip"].clone());
    assert_eq!(slip.unwrap()[0].as_float(), Some(0.0));
    assert_eq!(any_slip, table("transfer2026-refinement-home"));
    let (mut at_home, attard) = (table("transfer2026-refinement-home"), table("transfer2026-attard2023"));
    let own = at_home["vehicle"].as_array_mut().unwrap().pop().unwrap();
    assert_eq!((own["drawn"].as_bool(), own.get("model")), (Some(false), None));
    assert_eq!(own["file"], attard["vehicle"]);
    assert!(own["loads"].as_table().unwrap().keys().eq([attard["load"].as_str().unwrap()]));
    assert_eq!(at_home, refinement);
    for table in [&mut refinement, &mut training] {
        for key in ["procedural", "vehicle", "draw"] {
            table.remove(key);
        }
    }
    assert_eq!(refinement, training);
    let (mut training, laden) = (table("transfer2026-training"), table("laden2026-training"));
    for key in ["procedural", "reward", "start", "ending", "actions", "observation"] {
        assert_eq!(training.remove(key), laden.get(key).cloned(), "{key}");
    }
    // Training reaches beyond what is evaluated, and the held-out benchmark lies beyond training or at its worst end.
    let range = |table: &toml::Table, key: &str| [0, 1].map(|end| table["draw"][key][end].as_float().unwrap());
    let held_out = table("transfer2026-held-out");
    for key in ["slip", "slip_growth", "understeer_deg", "yaw_lag"] {
        let [most, trained, beyond] = [range(&transfer, key)[1], range(&training, key)[1], range(&held_out, key)[0]];
        assert!(most < trained && trained <= beyond, "{key}");
    }
    assert!(range(&held_out, "friction")[1] <= range(&training, "friction")[0]);
    let disturbance = |table: &toml::Table, key: &str| table["disturbances"][key].as_float().unwrap();
    for key in transfer["disturbances"].as_table().unwrap().keys() {
        let [one, two, three] = [&transfer, &training, &held_out].map(|table| disturbance(table, key));
        assert!(one < two && two < three, "{key}");
    }
    // For the actions of another benchmark all but these is that one's; trucks and disturbances are the same.
    for (name, other) in [
        ("transfer2026-8kmh", "attard2023-as-run"),
        ("transfer2026-30kmh", "attard2023"),
        ("transfer2026-50kmh", "laden2026-50"),
    ] {
        let (mut elsewhere, mut other) = (table(name), table(other));
        for key in ["draw", "disturbances"] {
            assert_eq!(elsewhere.remove(key).as_ref(), Some(&transfer[key]), "{name}: {key}");
        }
        for key in ["vehicle", "load", "draw"] {
            elsewhere.remove(key);
            other.remove(key);
        }
        assert_eq!(elsewhere, other, "{name}");
    }
    // At home it is attard2023 but for the actions, the observation and the clock that go with them.
    let (mut home, mut attard) = (table("transfer2026-attard2023"), table("attard2023"));
    for key in ["actions", "observation", "start", "ending"] {
        assert_eq!(home.remove(key).as_ref(), Some(&transfer[key]), "{key}");
        attard.remove(key);
    }
    assert_eq!(home, attard);
}

#[test]
fn the_continuous_benchmarks_differ_from_those_with_levels_in_their_actions_alone() {
    for (name, levels) in [("attard2023-continuous", "attard2023"), ("laden2026-continuous", "laden2026")] {
        let (mut continuous, mut levels) = (table(name), table(levels));
        let [actions, listed] = [&mut continuous, &mut levels].map(|table| table.remove("actions").unwrap());
        assert_eq!(continuous, levels, "{name}");
        assert_eq!(actions["kind"].as_str(), Some("continuous"));
        let ends = |actions: &toml::Value| {
            let speeds = actions["speeds_kmh"].as_array().unwrap().clone();
            (speeds.first().cloned(), speeds.last().cloned())
        };
        assert_eq!(ends(&actions), ends(&listed), "{name}");
    }
}

#[test]
fn every_name_gives_what_its_file_gives() {
    // The largest take minutes; the test of the large benchmarks reads them as text.
    let benchmarks: Vec<&str> = Kind::Benchmark.names().filter(|name| !LARGE.contains(name)).collect();
    assert_eq!(benchmarks.len(), 48);
    for name in benchmarks {
        let named = Scenario::named(name).unwrap();
        let read = Scenario::read(&scenarios().join(name).with_extension("toml")).unwrap();
        assert_eq!(format!("{named:?}"), format!("{read:?}"));
        assert_eq!(named.name, name);
    }
    for name in Kind::Roundabout.names() {
        assert_eq!(Road::named(name).unwrap().name, name);
    }
    for name in Kind::Vehicle.names() {
        Vehicle::named(name).unwrap();
    }
    for name in Kind::Distribution.names() {
        assert_eq!(Distribution::named(name).unwrap().name, name);
    }
}

#[test]
fn an_unknown_name_is_refused_with_the_names_there_are() {
    let benchmark = Scenario::find("nowhere").unwrap_err().to_string();
    assert!(
        benchmark.starts_with("benchmark: nowhere; must be a path ending in .toml or one of attard2023, "),
        "{benchmark}"
    );
    assert_eq!(
        Road::find("17m").unwrap_err().to_string(),
        "roundabout: 17m; must be a path ending in .toml or one of 16m, 20m, 32m, 40m, 50m, \
         16m-maps, 20m-maps, 32m-maps, 40m-maps, 50m-maps"
    );
    assert_eq!(
        Vehicle::named("bus").unwrap_err().to_string(),
        "vehicle: bus; must be a path ending in .toml or one of cn_18m1, daf_xf, eu_4x2_13m6, eu_4x2_13m6_steered, \
         eu_6x4_13m6, uk_15m5, uk_16m5, us_wb40, us_wb62, us_wb67"
    );
    // A name is not a path below the folder, nor one kind's name another's.
    for name in ["roundabouts/16m", "../scenarios/attard2023", "16m", ""] {
        Scenario::named(name).unwrap_err();
    }
}

#[test]
fn a_path_is_read_from_disk_whatever_the_embedded_files_are_called() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = folder.path().join("attard2023.toml");
    assert!(
        Scenario::find(wrong.to_str().unwrap()).unwrap_err().to_string().contains("attard2023.toml: cannot be read")
    );
    std::fs::write(&wrong, "no_such_key = 1").unwrap();
    assert!(Scenario::find(wrong.to_str().unwrap()).unwrap_err().to_string().contains("no_such_key"));
    // An existing file needs no extension.
    let bare = folder.path().join("truck");
    std::fs::copy(scenarios().join("vehicles/us_wb62.toml"), &bare).unwrap();
    assert_eq!(Vehicle::find(bare.to_str().unwrap()).unwrap(), Vehicle::named("us_wb62").unwrap());
}

#[test]
fn a_roundabout_can_be_made_from_text() {
    let text = std::fs::read_to_string(scenarios().join("roundabouts/16m.toml")).unwrap();
    let made = Road::from_toml("copy", &text).unwrap();
    assert_eq!(made.name, "copy");
    let kerbs = |roundabout: &Road| format!("{:?}", roundabout.kerbs(Gutter::Solid));
    assert_eq!(kerbs(&made), kerbs(&Road::named("16m").unwrap()));
    assert!(made.routes(40.0, 35.0, 2.0).unwrap()[0].name.starts_with("copy/E-left-"));
    let message = Road::from_toml("random 7", &text.replace("gutter = 0.5", "gutter = -1")).unwrap_err().to_string();
    assert_eq!(message, "random 7: ring.gutter: -1 m; must lie in 0..3 m");
}

#[test]
fn a_file_of_the_users_own_refers_to_shipped_ones_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("own.toml");
    let text = "vehicle = \"daf_xf\"\nload = \"empty\"\ngutter = \"drivable\"\n\n[actions]\n\
                steer_levels = [-0.5, 0.0, 0.5]\nspeeds_kmh = [30.0]\n\n\
                [sensors]\nrange = 20.0\n\n[reward]\nwaypoint = 100.0\nlane_distance = -1.5\n\
                lane_distance_limit = 4.0\nfailure = -500.0\n\n\
                [[roundabout]]\nfile = \"20m\"\ntest = \"all\"\n\n[procedural]\ndistribution = \"wide\"\nseed = 1\n\
                count = 2\ntrain = [0, 2]\n";
    std::fs::write(&file, text).unwrap();
    let scenario = Scenario::read(&file).unwrap();
    assert_eq!((scenario.places.len(), scenario.places[0].roundabout.name.as_str()), (3, "20m"));
    std::fs::write(&file, text.replace("\"20m\"", "\"21m\"")).unwrap();
    let message = Scenario::read(&file).unwrap_err().to_string();
    let expected = "own.toml: roundabout[0].file: \"21m\"; roundabout: 21m; must be a path ending in .toml or one of 16m, 20m, 32m, 40m, \
                    50m, \
         16m-maps, 20m-maps, 32m-maps, 40m-maps, 50m-maps";
    assert!(message.ends_with(expected), "{message}");
}
