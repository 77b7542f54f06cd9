//! What the repository tracks, and whether its documents name every file that they list.

use std::fs;
use std::path::Path;

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_scenarios_readme_names_every_file_of_the_library() {
    let scenarios = repository().join("scenarios");
    let readme = fs::read_to_string(scenarios.join("README.md")).unwrap();
    let mut n_files = 0;
    for folder in ["", "roundabouts", "distributions", "vehicles"] {
        for entry in fs::read_dir(scenarios.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "toml") {
                let [name, stem] = [path.file_name(), path.file_stem()].map(|name| name.unwrap().to_str().unwrap());
                // A benchmark has a row of its own; its name begins those of others.
                let named =
                    if folder.is_empty() { readme.contains(&format!("| `{name}` |")) } else { readme.contains(stem) };
                assert!(named, "{folder}/{name}");
                n_files += 1;
            }
        }
    }
    assert!(39 <= n_files, "{n_files}");
}

#[cfg(unix)]
#[test]
fn a_tracked_link_a_path_of_one_machine_and_a_source_above_400_lines_are_refused() {
    let clone = tempfile::tempdir().unwrap();
    let git = |arguments: &[&str]| {
        let done = std::process::Command::new("git").current_dir(clone.path()).args(arguments).output().unwrap();
        assert!(done.status.success(), "{arguments:?}: {done:?}");
    };
    let refusal = || {
        git(&["add", "--all"]);
        let checked =
            std::process::Command::new(repository().join(".ci/tracked")).current_dir(clone.path()).output().unwrap();
        (checked.status.success(), String::from_utf8(checked.stderr).unwrap())
    };
    git(&["init", "--quiet"]);
    let text = clone.path().join("text.md");
    // Written in parts: this file is tracked.
    let [home, work, root] = ["home", "work", "root"];
    let others =
        format!("https://example.org/{home}/x, ../{work}/x, ~/{work}/x, $HOME/{work}/x, and/or/{root}/x, /dev/null\n");
    fs::write(&text, others).unwrap();
    assert_eq!(refusal(), (true, String::new()));
    for (before, folder) in [("", "root"), ("`", "home"), ("\"", "work"), ("(", "Users")] {
        let path = format!("{before}/{folder}/x");
        fs::write(&text, format!("It lies in {path}.\n")).unwrap();
        let (passed, said) = refusal();
        assert!(!passed && said.contains("text.md:1:It lies in"), "{path}: {said}");
    }
    fs::write(&text, "").unwrap();
    let source = clone.path().join("source.rs");
    fs::write(&source, "\n".repeat(400)).unwrap();
    assert_eq!(refusal(), (true, String::new()));
    fs::write(&source, "\n".repeat(401)).unwrap();
    let (passed, said) = refusal();
    assert!(!passed && said.contains("source.rs:401"), "{said}");
    fs::remove_file(&source).unwrap();
    std::os::unix::fs::symlink("text.md", clone.path().join("resources")).unwrap();
    let (passed, said) = refusal();
    assert!(!passed && said.contains("resources"), "{said}");
}
