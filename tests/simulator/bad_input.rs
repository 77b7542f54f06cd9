//! Wrong files: values of every key of the scenario files are broken in turn, and the reader must return an error that
//! names the file, never panic.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use offtrack::files::reader::Error;
use offtrack::layout::Ended;
use offtrack::map::procedural::Distribution;
use offtrack::map::{Gutter, Road};
use offtrack::scenario::Scenario;
use offtrack::simulator::{self, Engine, RouteChoice, Simulator};
use offtrack::vehicle::Vehicle;
use offtrack::world::World;
use proptest::prelude::*;

use crate::{batch_on, benchmark, engines, scenarios};

/// Benchmarks, roundabouts, vehicles and distributions (their names without `.toml`) that have no key but those of
/// another one.
const LIKE_OTHERS: &str = "
    attard2023-full attard2023-training laden2026 laden2026-50-random laden2026-50-training laden2026-continuous
    laden2026-odd-random laden2026-random laden2026-training random2026-1000 random2026-10000 random2026-as-run
    random2026-as-run-training maps2026 maps2026-crossing attard2023-maps attard2023-maps-as-run
    attard2023-maps-full 16m 16m-maps 20m-maps 32m 32m-maps 40m 40m-maps 50m traffic2026 traffic2026-aggressive
    traffic2026-distracted traffic2026-laden traffic2026-maps traffic2026-random traffic2026-refinement
    traffic2026-rude traffic2026-timid traffic2026-training transfer2026-30kmh transfer2026-50kmh transfer2026-8kmh
    transfer2026-attard2023 transfer2026-held-out transfer2026-no-slip transfer2026-no-slip-random transfer2026-random
    transfer2026-refinement transfer2026-refinement-any-slip transfer2026-training
    cn_18m1 eu_4x2_13m6 eu_4x2_13m6_steered eu_6x4_13m6 uk_15m5 uk_16m5 us_wb40 us_wb67 wide
";

/// Every scenario file, relative to `scenarios/`.
fn all_files() -> Vec<PathBuf> {
    let mut files = Vec::new();
    for folder in ["", "roundabouts", "vehicles", "distributions"] {
        for entry in std::fs::read_dir(scenarios().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "toml") {
                files.push(path.strip_prefix(scenarios()).unwrap().to_owned());
            }
        }
    }
    files.sort();
    files
}

/// Those that are broken: between them they have every key.
fn files() -> Vec<PathBuf> {
    let names: Vec<&str> = LIKE_OTHERS.split_whitespace().collect();
    let like_another = |path: &PathBuf| names.iter().any(|&name| path.file_stem().is_some_and(|stem| stem == name));
    let (others, files): (Vec<_>, Vec<_>) = all_files().into_iter().partition(like_another);
    assert_eq!(others.len(), names.len(), "each is there");
    assert_eq!(files.len(), 16, "two roundabouts, two vehicles, eleven benchmarks, a distribution");
    files
}

/// A scenario file's text, with three random roads where it has hundreds, which take seconds to draw.
fn text_of(file: &Path) -> String {
    let text = std::fs::read_to_string(scenarios().join(file)).unwrap();
    let fewer = [
        ("train = [0, 200]", "train = [0, 1]"),
        ("train = [0, 2000]", "train = [0, 1]"),
        ("[200, 240]", "[200, 201]"),
        ("[240, 340]", "[240, 241]"),
    ];
    fewer.into_iter().fold(text, |text, (many, few)| text.replace(many, few))
}

/// A text without its comments and blank lines: nothing changes where they do, and each reading takes its time.
fn without_comments(text: &str) -> String {
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or("").trim_end());
    lines.filter(|line| !line.is_empty()).map(|line| format!("{line}\n")).collect()
}

/// Reads a file of the kind that belongs in its folder.
fn read(path: &Path) -> Result<(), Error> {
    match path.parent().and_then(Path::file_name).and_then(|folder| folder.to_str()) {
        Some("roundabouts") => {
            let roundabout = Road::read(path)?;
            // An accepted roundabout must be usable.
            for gutter in [Gutter::Drivable, Gutter::Solid] {
                assert!(roundabout.kerbs(gutter).signed_distance(glam::DVec2::new(3.0, -7.0)).is_finite());
            }
            let _ = roundabout.routes(40.0, 35.0, 2.0);
            Ok(())
        }
        Some("vehicles") => Vehicle::read(path).map(|_| ()),
        Some("distributions") => {
            // An accepted distribution gives a road or says why it gives none. `mixed` has every key.
            let distribution = Distribution::read(path)?;
            let _ = (distribution.name == "mixed").then(|| distribution.road(7, 0));
            Ok(())
        }
        _ => Scenario::read(path).map(|_| ()),
    }
}

/// A copy of all scenario files, so that one file at a time can be broken.
fn copy() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in all_files() {
        let to = folder.path().join(&file);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::write(to, text_of(&file)).unwrap();
    }
    folder
}

/// Reads the broken text instead of `file`. An error must name a file of the folder.
fn broken(folder: &Path, file: &Path, text: &[u8]) -> Result<(), String> {
    let path = folder.join(file);
    put(&path, text);
    let outcome = read(&path).map_err(|error| error.to_string());
    if let Err(message) = &outcome {
        assert!(message.contains(folder.to_str().unwrap()), "{message}");
    }
    put(&path, text_of(file).as_bytes());
    outcome
}

/// Replaces a file by a new one: ext4 waits for the disk where a file is written over.
fn put(path: &Path, text: &[u8]) {
    std::fs::remove_file(path).unwrap();
    std::fs::write(path, text).unwrap();
}

/// Byte ranges of the values in a TOML text: what follows `=`, `[` or `,` up to the next of `,]}#` or the line's end.
fn values(text: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let code = line.split('#').next().unwrap_or("");
        if let Some(equals) = code.find('=').or(code.trim_start().starts_with(['"', '[', '{', '-']).then_some(0)) {
            let mut from = start + equals;
            for (offset, character) in code.char_indices().skip(equals).chain([(code.len(), '\n')]) {
                if ",]}[{=\n".contains(character) {
                    let value = &text[from..start + offset];
                    let trimmed = value.trim_matches(|c: char| c.is_whitespace() || ",[{=".contains(c));
                    if !trimmed.is_empty() && (trimmed.starts_with('"') || trimmed.parse::<f64>().is_ok()) {
                        let at = from + value.find(trimmed).unwrap();
                        found.push((at, at + trimmed.len()));
                    }
                    from = start + offset;
                }
            }
        }
        start += line.len();
    }
    found
}

/// The table that a TOML text ends in, the last key of a line in it, and behind that key the last of an inline table.
fn key_before(text: &str) -> [String; 3] {
    let mut key: [String; 3] = Default::default();
    for line in text.lines().map(|line| line.split('#').next().unwrap_or("")) {
        if line.starts_with('[') && line.trim_end().ends_with(']') {
            key = [line.trim().to_owned(), String::new(), String::new()];
        } else if let Some((first, rest)) = line.split_once('=') {
            let inline = rest.rfind('=').map_or("", |end| rest[..end].trim_end());
            let last = inline.rsplit(|c: char| c.is_whitespace() || "{,".contains(c)).next().unwrap_or("");
            [key[1], key[2]] = [first.trim().to_owned(), last.to_owned()];
        }
    }
    key
}

#[test]
fn no_wrong_value_of_any_key_makes_a_reader_panic() {
    let folder = copy();
    let nasty =
        ["0", "-1.0", "nan", "inf", "-inf", "1e300", "1000000000", "0.001", "\"text\"", "true", "[]", "{}", "\"\""];
    let (mut tried, mut refused) = (0, 0);
    for file in files() {
        let text = text_of(&file);
        let mut found = values(&text);
        assert!(10 < found.len(), "{}: {} values found", file.display(), found.len());
        // A key's values are read alike, and some keys have hundreds: the first four of each stand for all.
        let mut seen: HashMap<[String; 3], usize> = HashMap::new();
        found.retain(|&(from, _)| {
            let n = seen.entry(key_before(&text[..from])).or_default();
            *n += 1;
            *n <= 4
        });
        for (from, to) in found {
            for value in nasty {
                tried += 1;
                refused += usize::from(
                    broken(folder.path(), &file, format!("{}{value}{}", &text[..from], &text[to..]).as_bytes())
                        .is_err(),
                );
            }
        }
    }
    // Most of these values make no sense for any key: a reader that accepts them checks nothing.
    assert!(5000 < tried && 4 * tried < 5 * refused, "{refused} of {tried} refused");
}

#[test]
fn no_missing_line_cut_or_unknown_key_makes_a_reader_panic() {
    let folder = copy();
    for file in files() {
        let text = without_comments(&text_of(&file));
        let lines: Vec<&str> = text.lines().collect();
        for without in 0..lines.len() {
            let kept: Vec<&str> =
                lines.iter().enumerate().filter(|&(line, _)| line != without).map(|(_, line)| *line).collect();
            let _ = broken(folder.path(), &file, kept.join("\n").as_bytes());
        }
        for end in (0..text.len()).step_by(7) {
            let _ = broken(folder.path(), &file, &text.as_bytes()[..end]);
        }
        let message = broken(folder.path(), &file, format!("no_such_key = 1\n{text}").as_bytes()).unwrap_err();
        assert!(message.contains("no_such_key"), "{message}");
        broken(folder.path(), &file, &[0xff, 0xfe, 0]).unwrap_err();
        broken(folder.path(), &file, b"").unwrap_err();
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn no_scrambled_bytes_make_a_reader_panic(
        which in any::<prop::sample::Index>(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0x20u8..0x7f), 1..6),
    ) {
        let folder = copy();
        let files = files();
        let file = which.get(&files);
        let mut text = text_of(file).into_bytes();
        for (at, byte) in edits {
            let at = at.index(text.len());
            text[at] = byte;
        }
        let _ = broken(folder.path(), file, &text);
    }
}

#[test]
fn a_wrong_value_is_named_with_file_key_value_and_what_would_do() {
    let folder = copy();
    let file = Path::new("attard2023.toml");
    let text = std::fs::read_to_string(scenarios().join(file)).unwrap();
    let cases = [
        ("range = 20.0", "range = -4.0", ["sensors.range", "-4 m", "must lie in 1..50 m"]),
        ("speeds_kmh = [30.0]", "speeds_kmh = []", ["actions.speeds_kmh", "0", "must lie in 1..64"]),
        ("load = \"empty\"", "load = \"water\"", ["load", "\"water\"", "laden"]),
        ("\"E-left-2\"", "\"E-left-9\"", ["train[0]", "\"E-left-9\"", "E-left-3"]),
        ("[sensors]", "[routes]\napproach = 400.0\n\n[sensors]", ["routes.approach", "400 m", "at most"]),
    ];
    for (from, to, parts) in cases {
        assert!(text.contains(from), "{from}");
        let message = broken(folder.path(), file, text.replacen(from, to, 1).as_bytes()).unwrap_err();
        for part in parts {
            assert!(message.contains(part), "{part} is not in: {message}");
        }
    }
    let missing = Scenario::read(Path::new("no/such/file.toml")).unwrap_err().to_string();
    assert!(missing.contains("no/such/file.toml"), "{missing}");
}

#[test]
fn a_route_that_leaves_no_room_for_the_whole_truck_is_refused_with_the_longest_that_fits() {
    let folder = copy();
    let file = Path::new("attard2023.toml");
    let text = std::fs::read_to_string(scenarios().join(file)).unwrap();
    for (part, too_long, reach) in
        [("approach", 65.0, "13.02 m of the arm behind"), ("departure", 68.0, "3.18 m of the arm ahead")]
    {
        let with = |length: f64| text.replacen("[sensors]", &format!("[routes]\n{part} = {length}\n\n[sensors]"), 1);
        let message = broken(folder.path(), file, with(too_long).as_bytes()).unwrap_err();
        assert!(message.contains(&format!("routes.{part}: {too_long} m; the truck needs {reach}")), "{message}");
        // The first roundabout that is too small is named: follow the messages down to a length that fits all of them.
        let mut length = too_long;
        for _ in 0..5 {
            let Err(message) = broken(folder.path(), file, with(length).as_bytes()) else { break };
            length = message.split("at most ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        }
        assert!(40.0 < length && length < too_long, "{length}");
        broken(folder.path(), file, with(length).as_bytes()).unwrap();
        broken(folder.path(), file, with(length + 0.01).as_bytes()).unwrap_err();
        // At the longest approach the truck starts clear of the solid edge that ends its arm, whatever its heading
        // error.
        if part == "approach" {
            std::fs::write(folder.path().join("longest.toml"), with(length)).unwrap();
            let mut world = World::bake(&Scenario::read(&folder.path().join("longest.toml")).unwrap()).unwrap();
            // On some right lanes a truck that starts 0.3 m aside, turned by 2 deg, touches the kerb.
            world.params.start_offset = 0.0;
            let n_routes = world.routes.len() as u32;
            let routes: Vec<u32> = (0..8 * n_routes).map(|env| env % n_routes).collect();
            let n_envs = routes.len();
            let mut simulator = batch_on(&Engine::Cpu, &Arc::new(world), n_envs, 0, RouteChoice::Fixed(routes));
            simulator.step(&vec![4; n_envs]).unwrap();
            assert!(simulator.batch().ended.iter().all(|&ended| ended == Ended::Running as u32));
        }
    }
}

#[test]
fn a_missing_file_or_key_is_named_with_the_benchmark_and_the_key() {
    let folder = copy();
    let file = Path::new("attard2023.toml");
    let text = std::fs::read_to_string(scenarios().join(file)).unwrap();
    let benchmark = folder.path().join(file).display().to_string();
    for (from, to, expected) in [
        ("vehicles/daf_xf.toml", "vehicles/daf.toml", ": vehicle: \"vehicles/daf.toml\"; "),
        ("roundabouts/32m.toml", "roundabouts/17m.toml", ": roundabout[1].file: \"roundabouts/17m.toml\"; "),
        ("roundabouts/32m.toml", "roundabouts", ": roundabout[1].file: \"roundabouts\"; "),
        ("vehicle = \"vehicles/daf_xf.toml\"", "", ": missing field `vehicle` at the top level"),
        ("file = \"roundabouts/32m.toml\"", "", ": roundabout[1]: missing field `file`"),
    ] {
        assert!(text.contains(from), "{from}");
        let message = broken(folder.path(), file, text.replacen(from, to, 1).as_bytes()).unwrap_err();
        assert!(message.starts_with(&benchmark) && message.contains(expected), "{message}");
    }
}

#[test]
fn pipes_devices_folders_and_large_files_are_refused_as_every_kind_of_file() {
    let folder = tempfile::tempdir().unwrap();
    for kind in ["", "roundabouts", "vehicles", "distributions"] {
        let below = folder.path().join(kind);
        std::fs::create_dir_all(&below).unwrap();
        let [pipe, zero, directory, large] =
            ["pipe.toml", "zero.toml", "folder.toml", "large.toml"].map(|name| below.join(name));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        std::os::unix::fs::symlink("/dev/zero", &zero).unwrap();
        std::fs::create_dir(&directory).unwrap();
        std::fs::write(&large, vec![b'#'; 2 << 20]).unwrap();
        for path in [&pipe, &zero, &directory] {
            let message = read(path).unwrap_err().to_string();
            assert_eq!(message, format!("{}: is not a regular file; a file is needed", path.display()));
        }
        assert!(
            read(&large)
                .unwrap_err()
                .to_string()
                .ends_with("large.toml: is larger than 1 MiB, the most that is read of such a file")
        );
    }
}

#[test]
fn a_batch_that_cannot_be_is_refused_and_a_wrong_action_changes_nothing() {
    let world = std::sync::Arc::new(benchmark("attard2023").1);
    for (_, engine) in engines() {
        let new =
            |n_envs, choice| Simulator::on(engine.clone(), world.clone(), n_envs, 0, choice).map(|_| ()).unwrap_err();
        assert_eq!(new(0, RouteChoice::Drawn(vec![0])), simulator::Error::EmptyBatch);
        assert_eq!(new(4, RouteChoice::Drawn(vec![])), simulator::Error::NoRoutes);
        assert_eq!(new(4, RouteChoice::Drawn(vec![75])), simulator::Error::UnknownRoute { route: 75, n_routes: 75 });
        assert_eq!(new(4, RouteChoice::Fixed(vec![0])), simulator::Error::RouteCount { n_routes: 1, n_envs: 4 });
        let mut simulator = batch_on(&engine, &world, 2, 0, RouteChoice::Drawn(vec![0]));
        let before = simulator.batch().truck.clone();
        assert_eq!(simulator.step(&[0, 9]).unwrap_err().to_string(), "actions[1]: 9; must lie in 0..8");
        assert_eq!(simulator.step(&[0]).unwrap_err().to_string(), "actions: 1 for 2 trucks; one each is needed");
        let start = |offset| offtrack::layout::Start { offset, ..Default::default() };
        let refused =
            |starts: &[_]| batch_on(&engine, &world, 2, 0, RouteChoice::Drawn(vec![0])).reset_from(starts).unwrap_err();
        assert_eq!(refused(&[start(0.0)]).to_string(), "starts: 1 for 2 trucks; one each is needed");
        assert_eq!(
            refused(&[start(0.0), start(1.5)]).to_string(),
            "starts[1].offset: 1.5; must lie in -1..1, a fraction of the largest error or range"
        );
        assert_eq!(
            refused(&[start(f32::NAN), start(0.0)]).to_string(),
            "starts[0].offset: NaN; must lie in -1..1, a fraction of the largest error or range"
        );
        assert_eq!(simulator.gather(&[1, 2]).unwrap_err().to_string(), "indices[1]: 2; the batch has trucks 0..1");
        assert_eq!(simulator.gather(&[]).unwrap_err(), simulator::Error::EmptyBatch);
        assert_eq!(simulator.batch().truck, before);
    }
}

#[test]
fn a_load_whose_name_a_terminal_would_obey_or_a_table_could_not_hold_is_refused() {
    let text = std::fs::read_to_string(scenarios().join("vehicles/daf_xf.toml")).unwrap();
    assert!(text.contains("[loads.empty]"));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("vehicle.toml");
    let read = |name: &str| {
        std::fs::write(&file, text.replace("loads.empty", &format!("loads.\"{name}\""))).unwrap();
        Vehicle::read(&file).map(|vehicle| vehicle.loads.contains_key(name)).map_err(|error| error.to_string())
    };
    assert_eq!(read("à moitié"), Ok(true));
    for name in ["", "\\u001b[2J", "a\\nb", "\\u202e", &"x".repeat(41)] {
        let said = read(name).unwrap_err();
        assert!(
            said.contains("vehicle.toml: loads: ") && said.contains("1 to 40 characters, all of them visible"),
            "{said}"
        );
    }
}
