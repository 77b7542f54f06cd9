//! Which roads are drawn, that they are the same for ever, and that they keep the rules.

use std::collections::BTreeSet;
use std::path::Path;

use glam::DVec2;

use super::*;
use crate::files::cache::{Cache, Loading, fnv_1a};
use crate::map::parametric::written::WrittenArm;

fn shipped() -> [Distribution; 2] {
    ["wide", "mixed"].map(|name| Distribution::named(name).unwrap())
}

#[test]
fn roads_are_the_same_for_ever() {
    // Whoever changes these changes every random benchmark.
    let pinned = [
        ("wide", 7, 0, 0x72ad_11ab_79dd_5e19),
        ("wide", 7, 12, 0xd5d1_2c31_403d_dd83),
        ("wide", 2026, 339, 0x1296_662a_3ec6_369d),
        ("wide", u32::MAX, 999_999, 0xde20_e002_fdaf_0bc5),
        ("mixed", 7, 0, 0x72ad_11ab_79dd_5e19),
        ("mixed", 7, 12, 0x2ccd_184e_c1ed_0c05),
        ("mixed", 2026, 5, 0x8fa2_99db_b416_22c9),
    ];
    let found = pinned.map(|(name, seed, index, _): (&str, u32, u32, u64)| {
        let text = Distribution::named(name).unwrap().road(seed, index).unwrap().text();
        (name, seed, index, fnv_1a(text.as_bytes()))
    });
    assert_eq!(found, pinned, "{found:#x?}");
}

#[test]
fn a_road_is_the_same_alone_and_among_others_whatever_the_threads() {
    for distribution in shipped() {
        let texts = |threads: usize, indices: &[u32]| -> Vec<String> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| distribution.roads(3, indices, &Loading::PLAIN).unwrap())
                .iter()
                .map(RandomRoad::text)
                .collect()
        };
        let all: Vec<u32> = (0..20).collect();
        let one = texts(1, &all);
        assert_eq!(one, texts(3, &all));
        assert_eq!(texts(2, &[17, 4]), [one[17].clone(), one[4].clone()]);
        assert_eq!(distribution.road(3, 4).unwrap().text(), one[4]);
        assert_eq!(one.iter().collect::<BTreeSet<_>>().len(), 20);
    }
}

#[test]
fn roads_of_a_distribution_with_aprons_are_those_without_but_for_them() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wide.toml");
    let read = |text: String| {
        std::fs::write(&file, text).unwrap();
        Distribution::read(&file).unwrap()
    };
    let text = Distribution::named("wide").unwrap().text;
    let with = text.replacen("[ring]\n", "[ring]\napron = [1.0, 40.0]\n", 1);
    assert_ne!(text, with);
    let [without, with] = [text, with].map(read);
    let mut widths = Vec::new();
    for index in 0..10 {
        let [plain, road] = [&without, &with].map(|distribution| distribution.road(7, index).unwrap());
        let line = road.text().lines().find(|line| line.starts_with("apron = ")).unwrap().to_owned();
        assert_eq!(road.text().replacen(&format!("{line}\n"), "", 1), plain.text());
        let width: f64 = line["apron = ".len()..].parse().unwrap();
        assert!((1.0..=road.roundabout.island_radius() - 0.5).contains(&width), "{line}");
        widths.push(width);
    }
    assert!(widths.windows(2).all(|pair| pair[0] != pair[1]), "{widths:?}");
}

#[test]
fn a_road_written_as_a_file_reads_back_bit_for_bit() {
    for distribution in shipped() {
        for index in 0..30 {
            let road = distribution.road(11, index).unwrap();
            let read = Road::from_toml(&road.roundabout.name, &road.text()).unwrap();
            // Debug prints every number so that it reads back to the same bits.
            assert_eq!(format!("{read:?}"), format!("{:?}", road.roundabout), "{index}");
        }
    }
}

#[test]
fn start_poses_of_a_hundred_roads_keep_clear_of_kerbs_and_routes_keep_their_distance() {
    for distribution in shipped() {
        let rules = distribution.rules();
        for road in distribution.roads(5, &(0..100).collect::<Vec<_>>(), &Loading::PLAIN).unwrap() {
            let kerbs = road.roundabout.kerbs(Gutter::Drivable);
            // Kerbs as far away as the start poses must be: no rectangle may touch them.
            let moved = kerbs.offset(rules.start_clearance - 0.01);
            let routes = road.roundabout.routes(rules.approach, rules.departure, 2.0).unwrap();
            for route in &routes {
                for pose in rules.poses(route) {
                    let corners: [DVec2; 4] = std::array::from_fn(|n| pose.pieces[n].start());
                    assert!(!moved.intersects_rectangle(&corners), "{}", route.name);
                }
                let length = route.centre_line.length();
                let nearest = (0..(length * 20.0) as usize)
                    .map(|n| kerbs.signed_distance(route.centre_line.point_at(n as f64 / 20.0)));
                // Between the stations that the rule looks at a kerb may be nearer by half their distance.
                assert!(rules.lane_clearance - 0.13 < nearest.fold(f64::INFINITY, f64::min), "{}", route.name);
            }
        }
    }
}

#[test]
fn refused_draws_add_up_to_the_attempts_before_the_valid_one() {
    for distribution in shipped() {
        let roads = distribution.roads(9, &(0..60).collect::<Vec<_>>(), &Loading::PLAIN).unwrap();
        let mut all = Refused::default();
        for road in &roads {
            assert_eq!(road.refused.total(), road.attempt);
            assert_eq!(Reason::ALL.iter().map(|&reason| road.refused.count(reason)).sum::<u32>(), road.attempt);
            all.add(&road.refused);
        }
        assert_eq!(all.total(), roads.iter().map(|road| road.attempt).sum::<u32>());
        assert!(5 <= Reason::ALL.iter().filter(|&&reason| 0 < all.count(reason)).count(), "{all:?}");
        // No file could have passed the checks with any of the attempts before.
        for road in &roads[..10] {
            assert!((0..road.attempt).all(|attempt| distribution.attempt(9, road.index, attempt).is_err()));
        }
    }
    assert_eq!(Reason::ALL.map(|reason| reason as usize), std::array::from_fn(|index| index));
}

#[test]
fn a_cache_gives_the_same_roads_and_an_entry_that_is_wrong_is_not_believed() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path());
    let told = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
    let telling = told.clone();
    let watcher =
        move |progress: crate::files::cache::Progress| telling.lock().unwrap().push((progress.done, progress.total));
    let loading = Loading { cache: Some(&cache), watcher: &watcher, ..Loading::PLAIN };
    let distribution = Distribution::named("wide").unwrap();
    let texts = |indices: &[u32], loading: &Loading| -> Vec<(String, u32, Refused)> {
        distribution
            .roads(4, indices, loading)
            .unwrap()
            .into_iter()
            .map(|road| (road.text(), road.attempt, road.refused))
            .collect()
    };
    let plain = texts(&[1, 2, 3, 70, 100], &Loading::PLAIN);
    assert_eq!(texts(&[1, 2, 3], &loading), plain[..3]);
    // Entries of chunks known in part are completed.
    for _ in 0..2 {
        assert_eq!(texts(&[1, 2, 3, 70, 100], &loading), plain);
    }
    assert_eq!(told.lock().unwrap().iter().copied().max(), Some((5, 5)));
    // Attempts that are not valid, and counts that do not add up.
    let (attempt, refused) =
        plain.iter().map(|&(_, attempt, refused)| (attempt, refused)).find(|&(attempt, _)| 1 < attempt).unwrap();
    let mut fewer = Refused::default();
    fewer.note(Reason::Kerbs);
    for (attempt, refused) in [(1, fewer), (attempt + 500, refused), (attempt, Refused::default())] {
        let known = [1, 2, 3].map(|index: u32| (index, (attempt, refused)));
        cache.put(roads::KIND, &distribution.key(4, 0), &roads::bytes(&known.into_iter().collect()));
        let kept = texts(&[1, 2, 3], &loading);
        assert!(
            kept.iter()
                .zip(&plain)
                .all(|(kept, plain)| kept.0 == plain.0 || kept.1 != attempt || refused.total() == attempt),
            "{kept:?}"
        );
    }
}

#[test]
fn a_name_gives_distribution_seed_and_index_and_other_names_are_of_files() {
    assert_eq!(address("wide/7/12"), Some(("wide", 7, 12)));
    assert_eq!(address("my/own.toml/0/4294967295"), Some(("my/own.toml", 0, u32::MAX)));
    for other in [
        "wide",
        "wide/7",
        "/7/12",
        "wide/7/12/N-left-3",
        "wide/-7/12",
        "wide/+7/12",
        "wide/7/4294967296",
        "wide//12",
        "scenarios/roundabouts/16m.toml",
    ] {
        assert_eq!(address(other), None, "{other}");
    }
    let road = find("wide/7/12").unwrap();
    assert_eq!(road.name, "wide/7/12");
    let routes: Vec<String> = road.routes(40.0, 35.0, 2.0).unwrap().into_iter().map(|route| route.name).collect();
    let named = |name: &String| {
        name.starts_with("wide/7/12/")
            && ["E", "NE", "N", "NW", "W", "SW", "S", "SE"]
                .contains(&name["wide/7/12/".len()..].split('-').next().unwrap())
    };
    assert!(routes.iter().all(named), "{routes:?}");
    assert_eq!(find("16m").unwrap().name, "16m");
    assert!(
        find("narrow/7/12")
            .unwrap_err()
            .to_string()
            .contains("distribution: narrow; must be a path ending in .toml or one of mixed, wide")
    );
}

#[test]
fn the_truck_of_the_rules_is_that_of_daf_xf() {
    let text = crate::files::shipped::FILES.iter().find(|(path, _)| *path == "vehicles/daf_xf.toml").unwrap().1;
    let file: toml::Table = toml::from_str(text).unwrap();
    let value = |table: &str, key: &str| file[table][key].as_float().unwrap();
    // The middle of the wheelbase follows the lane.
    let ahead = value("tractor", "wheelbase") / 2.0 + value("tractor", "front_overhang");
    let behind =
        value("trailer", "kingpin_to_rear") - value("tractor", "fifth_wheel") + value("tractor", "wheelbase") / 2.0;
    for distribution in shipped() {
        let rules = distribution.rules();
        assert!(
            (0.0..0.01).contains(&(rules.truck_ahead - ahead)) && (0.0..0.01).contains(&(rules.truck_behind - behind)),
            "{ahead} {behind}"
        );
        assert_eq!(rules.truck_width, value("tractor", "width").max(value("trailer", "width")));
    }
}

#[test]
fn arms_are_named_by_the_compass_and_every_kind_is_drawn() {
    let [wide, mixed] = shipped();
    let roads = wide.roads(1, &(0..200).collect::<Vec<_>>(), &Loading::PLAIN).unwrap();
    let arms = |n: usize| roads.iter().filter(|road| road.roundabout.arms().count() == n).count();
    assert!([3, 4, 5].into_iter().all(|n| 2 <= arms(n)) && arms(3) + arms(4) + arms(5) == 200);
    assert!(roads.iter().all(|road| road.roundabout.lane_radii().len() == 2));
    let of = |find: &dyn Fn(&WrittenArm) -> bool| roads.iter().filter(|road| road.written.arm.iter().any(find)).count();
    for (what, n) in [
        ("splitters", of(&|arm| !arm.splitter.is_empty())),
        ("corners", of(&|arm| arm.corner.kerb_radius.is_some())),
        ("lanes of their own", of(&|arm| arm.entry.left.is_some())),
        ("S-bends", of(&|arm| 3 < arm.exit.kerb.points.len())),
    ] {
        assert!(20 < n && n < 200, "{n} of 200 roads have {what}");
    }
    let roads = mixed.roads(1, &(0..100).collect::<Vec<_>>(), &Loading::PLAIN).unwrap();
    let lanes = |n: usize| roads.iter().filter(|road| road.roundabout.lane_radii().len() == n).count();
    assert!([1, 2, 3].into_iter().all(|n| 10 <= lanes(n)), "{} {} {}", lanes(1), lanes(2), lanes(3));
    assert!(roads.iter().any(|road| road.roundabout.island_radius() < 3.0));
}

#[test]
fn every_wrong_value_of_a_distribution_is_named_with_what_would_do() {
    let shipped = crate::files::shipped::FILES.iter().find(|(path, _)| *path == "distributions/mixed.toml").unwrap().1;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("own.toml");
    let read = |text: &str| {
        std::fs::write(&path, text).unwrap();
        Distribution::read(&path).map(|_| ()).map_err(|error| error.to_string())
    };
    read(shipped).unwrap();
    let file: toml::Table = toml::from_str(shipped).unwrap();
    let mut keys = 0;
    for (table, values) in &file {
        for (key, value) in values.as_table().unwrap() {
            keys += 1;
            let line = shipped
                .split(&format!("[{table}]\n"))
                .nth(1)
                .unwrap()
                .lines()
                .find(|line| line.starts_with(&format!("{key} =")))
                .unwrap();
            let n = value.as_array().map_or(1, Vec::len);
            for wrong in ["-1e9", "1e9", "nan"] {
                let list = vec![wrong; n].join(", ");
                let value = if value.is_array() { format!("[{list}]") } else { wrong.to_owned() };
                let (before, after) = shipped.split_once(&format!("[{table}]\n")).unwrap();
                let text = format!("{before}[{table}]\n{}", after.replacen(line, &format!("{key} = {value}"), 1));
                let message = read(&text).unwrap_err();
                assert!(
                    message.contains("own.toml: ")
                        && message.contains(&format!("{table}.{key}"))
                        && message.contains("must lie in"),
                    "{message}"
                );
            }
        }
    }
    assert!(50 < keys, "{keys}");
    let without = |from: &str, to: &str| {
        assert!(shipped.contains(from), "{from}");
        read(&shipped.replacen(from, to, 1)).unwrap_err()
    };
    assert!(
        without("half_width = [0.0, 1.2]", "half_width = [1.2, 0.0]")
            .contains("median.half_width: [1.2, 0] m; the least value comes first")
    );
    assert!(
        without("shares = [0.3, 0.5, 0.2]", "shares = [0.0, 0.0, 0.0]")
            .contains("arms.shares: all 0; one of them must be above 0")
    );
    assert!(
        without("weights = [0.4, 0.35, 0.25]", "weights = [0.4, 0.35]")
            .contains("corners.weights: 2; corners.shares has 3")
    );
    assert!(
        without("length = [66.0, 66.0]", "length = [50.0, 66.0]")
            .contains("arms.length: 50 m; must be at least 52.984 m")
    );
    assert!(
        without("[single]\nisland_radius = [1.5, 20.0]\nlane_width = [4.5, 12.0]\nouter_radius = 14.5\n", "")
            .contains("single: missing; rings of one lane")
    );
    assert!(without("gutter =", "guter =").contains("guter"));
    assert!(
        Distribution::read(Path::new("no/such.toml")).unwrap_err().to_string().contains("no/such.toml: cannot be read")
    );
}

#[test]
fn a_distribution_of_which_no_draw_is_valid_is_refused_with_the_reasons() {
    let shipped = crate::files::shipped::FILES.iter().find(|(path, _)| *path == "distributions/wide.toml").unwrap().1;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("narrow.toml");
    std::fs::write(&path, shipped.replacen("lane_clearance = 1.6", "lane_clearance = 3.0", 1)).unwrap();
    let distribution = Distribution::read(&path).unwrap();
    let message = distribution.road(1, 2).unwrap_err().to_string();
    assert!(
        message.contains(
            "narrow.toml: road 2 of seed 1: none of 1000 draws is valid; wider ranges or milder rules are needed"
        ),
        "{message}"
    );
    assert!(message.contains("a route nearer to a kerb than the rules allow"), "{message}");
    assert!(distribution.roads(1, &[2], &Loading::PLAIN).is_err());
}
