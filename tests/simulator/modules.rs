//! The order of modules, and where the feature `gpu` and both engines are named.

use std::fs;
use std::path::{Path, PathBuf};

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Every Rust file of the simulator.
fn files() -> Vec<(String, String)> {
    let files = files_below(&source());
    assert!(50 <= files.len(), "{}", files.len());
    files
}

/// Every Rust file below a folder, as its path there and its text without comments.
fn files_below(folder: &Path) -> Vec<(String, String)> {
    fn walk(folder: &Path, files: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { walk(&path, files) } else { files.push(path) }
        }
    }
    let mut found = Vec::new();
    walk(folder, &mut found);
    found.retain(|path| path.extension().is_some_and(|extension| extension == "rs"));
    found.sort_unstable();
    let text = |path: &Path| fs::read_to_string(path).unwrap().lines().map(code).collect::<Vec<_>>().join("\n");
    let name = |path: &Path| path.strip_prefix(folder).unwrap().to_str().unwrap().replace('\\', "/");
    found.iter().map(|path| (name(path), text(path))).collect()
}

/// Files that name the feature `gpu`, and how often.
fn naming_gpu(files: Vec<(String, String)>) -> Vec<(String, usize)> {
    let counts = files.into_iter().map(|(file, text)| (file, text.matches("feature = \"gpu\"").count()));
    counts.filter(|(_, count)| 0 < *count).collect()
}

/// A line without its comment.
fn code(line: &str) -> &str {
    line.split_once("//").map_or(line, |(code, _)| code)
}

/// The modules of `lib.rs` in their order.
fn modules() -> Vec<String> {
    let lib = fs::read_to_string(source().join("lib.rs")).unwrap();
    let modules =
        lib.lines().filter_map(|line| code(line).trim().strip_prefix("pub mod ")?.strip_suffix(';').map(str::to_owned));
    modules.collect()
}

/// Names after `crate::` in a text, also those in braces.
fn used(text: &str) -> Vec<String> {
    let name = |text: &str| {
        text.trim().chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect::<String>()
    };
    let mut used = Vec::new();
    for part in text.split("crate::").skip(1) {
        match part.strip_prefix('{') {
            None => used.push(name(part)),
            Some(list) => {
                let mut depth = 0;
                let list = list.split_once("};").map_or(list, |(list, _)| list);
                let top = list.split(|letter| {
                    depth += i32::from(letter == '{') - i32::from(letter == '}');
                    letter == ',' && depth == 0
                });
                used.extend(top.map(name));
            }
        }
    }
    used
}

#[test]
fn a_module_uses_only_those_above_it_in_lib_rs() {
    let modules = modules();
    assert!(8 <= modules.len(), "{modules:?}");
    let position = |name: &str| {
        // Both are names for a part of `engine`.
        let name = if name == "cpu" || name == "gpu" { "engine" } else { name };
        modules.iter().position(|module| module == name)
    };
    let mut uses = 0;
    for (file, text) in files().iter().filter(|(file, _)| file != "lib.rs") {
        let own = file.split(['/', '.']).next().unwrap();
        let own_position = position(own).unwrap_or_else(|| panic!("{file} belongs to no module of lib.rs"));
        for used in used(text) {
            let Some(position) = position(&used) else { continue };
            assert!(position <= own_position, "{file} uses {used}, which stands below {own} in lib.rs");
            uses += usize::from(position != own_position);
        }
    }
    assert!(60 < uses, "{uses}");
}

#[test]
fn names_after_crate_are_found_also_in_braces() {
    assert_eq!(used("use crate::angle::wrapped;\nlet x = crate::cpu::drive();"), ["angle", "cpu"]);
    assert_eq!(used("use crate::{angle, field::{self, Field}, random};"), ["angle", "field", "random"]);
}

#[test]
fn the_feature_gpu_is_named_only_where_an_engine_or_device_is_chosen() {
    let expected =
        |files: &[(&str, usize)]| files.iter().map(|&(file, count)| (file.to_owned(), count)).collect::<Vec<_>>();
    let simulator = [("engine/error.rs", 2), ("engine.rs", 1), ("lib.rs", 1), ("simulator.rs", 4)];
    assert_eq!(naming_gpu(files()), expected(&simulator));
    let crates = [
        // The choice of a device, its failure, and a policy there.
        ("evaluation/src", 30, &[("device.rs", 4), ("error.rs", 2), ("placed.rs", 2)][..]),
        // Backends, what both give each other, what a device alone counts, and tests there.
        (
            "learner/src",
            50,
            &[
                ("backend.rs", 14),
                ("exchange.rs", 11),
                ("level_replay.rs", 2),
                ("lib.rs", 1),
                ("replay_buffer.rs", 1),
                ("rollout.rs", 1),
                ("run/lost_device_tests.rs", 1),
                ("sac/device_tests.rs", 1),
                ("sac.rs", 1),
            ],
        ),
        // The list of devices, and the default training file.
        ("cli/src", 8, &[("commands/train.rs", 1)]),
        ("commands/src", 15, &[("devices.rs", 3)]),
        ("drawing/src", 15, &[]),
        // The kernel, and its failure.
        ("policy/src", 5, &[("error.rs", 1), ("lib.rs", 1)]),
        ("reference/src", 3, &[]),
    ];
    for (folder, least, chosen) in crates {
        let files = files_below(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder));
        assert!(least <= files.len(), "{folder}: {}", files.len());
        assert_eq!(naming_gpu(files), expected(chosen), "{folder}");
    }
}

#[test]
fn neither_engine_names_the_other_and_one_module_chooses() {
    let (mut engines, mut choosing) = (0, Vec::new());
    for (file, text) in files() {
        let [cpu, gpu] = ["cpu::", "gpu::"].map(|name| text.contains(name));
        if file.starts_with("engine/cpu") {
            assert!(!gpu, "{file} names the device");
            engines += 1;
        } else if file.starts_with("engine/gpu") {
            assert!(!cpu, "{file} names the CPU engine");
            engines += 1;
        } else if text.contains("gpu::Batch::new") {
            choosing.push(file);
        }
    }
    assert!(15 <= engines, "{engines}");
    assert_eq!(choosing, ["simulator.rs"]);
}
