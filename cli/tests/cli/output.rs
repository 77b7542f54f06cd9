//! What commands write to: regular files, links, pipes, standard output.
#![cfg(unix)]

use std::fs::{self, File, Permissions};
use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
use std::process::{Command, Stdio};

use crate::place::{Place, program, refusal, repository, succeed};

const VECTORS: &str = "tests/data/physics_vectors.json";

/// Flags that name a file to write, each with a name.
type Outputs = Vec<(&'static str, &'static str)>;

/// Every command that writes a file, with the flags that name it.
fn writers(benchmark: &str) -> Vec<(Vec<&str>, Outputs)> {
    let arguments = |text: &'static str| text.split(' ').collect::<Vec<&str>>();
    let on_benchmark = |text: &'static str| [arguments(text), vec!["--benchmark", benchmark]].concat();
    vec![
        (arguments("draw 16m"), vec![("-o", "svg")]),
        (arguments("draw 16m --size 200"), vec![("-o", "png")]),
        (arguments("draw 16m --route N-left-3"), vec![("-o", "json")]),
        (arguments("generate --count 1"), vec![("--plot", "svg")]),
        (
            arguments("import scenarios/maps/sumo_ring22.xodr --ring 140,140"),
            vec![("-o", "outline.toml"), ("--json", "json")],
        ),
        (arguments("trace tests/data/physics_vectors.json"), vec![("-o", "json")]),
        (on_benchmark("record --policy pursuit --route 20m/E-right-1"), vec![("-o", "json")]),
        (on_benchmark("evaluate --policy pursuit --episodes 1"), vec![("--json", "json"), ("--html", "html")]),
        (on_benchmark("certify --split train --widths 1 --hold 50"), vec![("--json", "json")]),
        (on_benchmark("scale --envs 1 --seconds 0.1"), vec![("--json", "json"), ("--plot", "svg")]),
        (arguments("bench --seconds 0.1 --hidden 4 --batch 2"), vec![("--json", "json")]),
    ]
}

#[test]
fn an_output_behind_a_link_is_written_where_the_link_leads_and_stays_private() {
    let place = Place::new();
    let benchmark = place.text("short.toml");
    fs::create_dir(place.file("disk")).unwrap();
    let mut n_files = 0;
    for (arguments, outputs) in writers(&benchmark) {
        let mut command = program();
        command.current_dir(repository()).args(&arguments);
        let mut files = Vec::new();
        for (flag, extension) in outputs {
            let (link, file) =
                (place.file(&format!("link{n_files}.{extension}")), place.file(&format!("disk/{n_files}.{extension}")));
            fs::write(&file, "").unwrap();
            fs::set_permissions(&file, Permissions::from_mode(0o600)).unwrap();
            symlink(&file, &link).unwrap();
            command.arg(flag).arg(&link);
            files.push((link, file));
            n_files += 1;
        }
        succeed(&command.output().unwrap());
        for (link, file) in files {
            assert!(fs::symlink_metadata(&link).unwrap().is_symlink(), "{arguments:?}");
            let written = fs::metadata(&file).unwrap();
            assert!(0 < written.len() && written.permissions().mode() & 0o777 == 0o600, "{arguments:?}: {written:?}");
        }
    }
    assert_eq!(n_files, 14);
    // And nothing but the files themselves.
    assert_eq!(fs::read_dir(place.file("disk")).unwrap().count(), n_files);
}

#[test]
fn an_output_that_is_a_pipe_is_written_into() {
    let place = Place::new();
    let pipe = place.file("pipe.json");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let mut command = program();
    command.current_dir(repository()).args(["trace", VECTORS, "-o"]).arg(&pipe);
    let writer = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let read = fs::read(&pipe).unwrap();
    succeed(&writer.wait_with_output().unwrap());
    assert!(fs::symlink_metadata(&pipe).unwrap().file_type().is_fifo());
    assert!(serde_json::from_slice::<serde_json::Value>(&read).is_ok());
}

#[test]
fn what_is_written_to_standard_output_by_its_path_and_what_is_printed_stand_one_after_the_other() {
    let place = Place::new();
    let file = place.file("said");
    let mut command = program();
    command.current_dir(repository()).args([
        "scale",
        "--benchmark",
        &place.text("short.toml"),
        "--envs",
        "1",
        "--seconds",
        "0.1",
    ]);
    assert!(command.args(["--json", "/dev/stdout"]).stdout(File::create(&file).unwrap()).status().unwrap().success());
    let said = fs::read_to_string(&file).unwrap();
    let (printed, json) = said.split_once("\n{").unwrap();
    assert!(printed.contains("env steps/s"), "{said}");
    assert!(serde_json::from_str::<serde_json::Value>(&format!("{{{json}")).is_ok(), "{said}");
}

#[test]
fn a_run_goes_on_in_a_folder_whose_files_are_links_and_keeps_them_private() {
    let place = Place::new();
    succeed(&place.train(&["--name", "run", "--steps", "800"]));
    fs::create_dir(place.file("disk")).unwrap();
    let names =
        ["checkpoint.safetensors", "policy.safetensors", "metrics.csv", "routes.csv", "report.json", "config.toml"];
    for name in names {
        let (file, link) = (place.file("disk").join(name), place.file("runs/run").join(name));
        fs::rename(&link, &file).unwrap();
        fs::set_permissions(&file, Permissions::from_mode(0o600)).unwrap();
        symlink(&file, &link).unwrap();
    }
    let before = names.map(|name| fs::read(place.file("disk").join(name)).unwrap());
    let mut command = program();
    succeed(&command.args(["train", "--resume", &place.text("runs/run"), "--steps", "1600"]).output().unwrap());
    for (name, before) in names.iter().zip(before) {
        let (file, link) = (place.file("disk").join(name), place.file("runs/run").join(name));
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink(), "{name}");
        assert!(fs::read(&file).unwrap() != before, "{name}");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600, "{name}");
    }
    assert_eq!(fs::read_dir(place.file("disk")).unwrap().count(), names.len());
}

#[test]
fn an_output_that_is_an_input_or_another_output_is_refused_before_anything_is_written() {
    let place = Place::new();
    let vehicle = place.file("own.toml");
    fs::copy(repository().join("scenarios/vehicles/daf_xf.toml"), &vehicle).unwrap();
    let text = fs::read(&vehicle).unwrap();
    symlink(&vehicle, place.file("link.svg")).unwrap();
    let refused = |arguments: &[&str], expected: &str| {
        let message = refusal(&program().args(arguments).output().unwrap(), 2);
        assert!(message.contains(expected), "{message}");
    };
    let (own, link) = (place.text("own.toml"), place.text("link.svg"));
    let draw = ["draw", "16m", "--route", "N-left-3", "--vehicle", &own, "-o", &link];
    refused(&draw, "is the file of --vehicle too");
    assert_eq!(fs::read(&vehicle).unwrap(), text);
    // The folder is not there yet.
    let (folder, sheet) = (place.text("roads"), place.text("roads/contact-sheet.svg"));
    refused(&["generate", "--count", "1", "-o", &folder, "--plot", &sheet], "--plot: ");
    assert!(!place.file("roads").exists());
}
