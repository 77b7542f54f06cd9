//! Roads that are baked in the page: by names, of files, and what is said of those that cannot be.
//!
//! The baker is built where the compiler has its target; elsewhere the tests that need it check nothing, and say so.

use std::collections::HashMap;
use std::path::Path;
use std::process::Command;

use offtrack_evaluation::live::{Live, bake};
use offtrack_policy::Policy;
use serde_json::{Value, json};

use super::page::ground;
use super::visitor::visited;
use crate::page::read;
use crate::place::{Place, repository};

/// What is asked of a page, its file if it is one, what the page says of it, and the benchmark that it drives on then.
type Visit<'a> = (Value, Option<Vec<u8>>, &'a [&'a str], &'a str);

const TARGET: &str = "wasm32-unknown-unknown";

/// The baker as `web/build.sh` builds it; `None` where the compiler lacks its target.
fn baker(place: &Place) -> Option<Vec<u8>> {
    let output = Command::new("rustc").args(["--print", "sysroot"]).output().unwrap();
    let sysroot = String::from_utf8(output.stdout).unwrap();
    if !Path::new(sysroot.trim()).join("lib/rustlib").join(TARGET).is_dir() {
        eprintln!("not checked: the compiler has no target {TARGET}");
        return None;
    }
    let file = place.file("baker.wasm");
    let built = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap();
    let output = Command::new(repository().join("web/build.sh"))
        .arg(&file)
        .env("CARGO_TARGET_DIR", built)
        .current_dir(repository())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(std::fs::read(&file).unwrap())
}

/// A page of `attard2023` and its policy, with a baker or without.
fn page(place: &Place, baker: Option<Vec<u8>>) -> String {
    let (file, policies) = (place.file("trucks.html"), vec![Policy::shipped("attard2023").unwrap()]);
    Live { grounds: vec![ground("attard2023")], policies, run: None, baker, seed: 0 }.write(&file).unwrap();
    read(&file)
}

#[test]
fn a_road_that_is_baked_in_a_browser_has_the_bytes_of_the_world_that_is_baked_here() {
    let place = Place::new();
    let Some(baker) = baker(&place) else { return };
    let asked = json!({ "benchmark": { "name": "attard2023", "text": null }, "of": { "roads": "16m" } });
    let plan = json!({ "visit": "bytes", "asked": asked });
    let found = visited(&page(&place, Some(baker)), &plan, HashMap::new(), false);
    let here = bake::bake(asked.to_string().as_bytes()).unwrap();
    let end = here.iter().position(|&byte| byte == b'\n').unwrap();
    let facts: Value = serde_json::from_slice(&here[..end]).unwrap();
    for name in ["version", "layout", "world", "sections", "kinds"] {
        assert_eq!(as_floats(&found["facts"][name]), as_floats(&facts[name]));
    }
    let words =
        |bytes: &[u8]| -> Vec<u32> { bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect() };
    let (mut at, mut n_equal) = (end + 1, 0);
    for kind in facts["kinds"].as_array().unwrap() {
        let (name, length) = (kind[0].as_str().unwrap(), kind[1].as_u64().unwrap() as usize);
        let there: Vec<u32> = serde_json::from_value(found["words"][name].clone()).unwrap();
        let here = words(&here[at..at + length]);
        at += length;
        assert_eq!(there.len(), here.len(), "{name}");
        let others: Vec<(f32, f32)> = here
            .iter()
            .zip(&there)
            .filter(|(here, there)| here != there)
            .map(|(here, there)| (f32::from_bits(*here), f32::from_bits(*there)))
            .collect();
        n_equal += here.len() - others.len();
        // Sine and cosine are another library's there. Only the waypoints come of them.
        assert!(name == "routes" || others.is_empty(), "{name}: {others:?}");
        let is_near = |(here, there): &(f32, f32)| (here - there).abs() <= 1e-6;
        assert!(others.iter().all(is_near) && others.len() < here.len() / 100 + 1, "{name}: {others:?}");
    }
    assert!(100_000 < n_equal, "{n_equal}");
}

/// JSON with each of its numbers as a float: scripts have no others.
fn as_floats(value: &Value) -> Value {
    match value {
        Value::Number(number) => json!(number.as_f64()),
        Value::Array(all) => all.iter().map(as_floats).collect(),
        Value::Object(all) => all.iter().map(|(name, one)| (name.clone(), as_floats(one))).collect(),
        other => other.clone(),
    }
}

#[test]
fn random_roads_files_and_maps_are_baked_in_the_page_and_driven_on_and_bad_ones_are_refused_in_the_readers_words() {
    let place = Place::new();
    let Some(baker) = baker(&place) else { return };
    let file = |path: &str| std::fs::read(repository().join("scenarios").join(path)).unwrap();
    let benchmark = String::from_utf8(file("attard2023.toml")).unwrap();
    let slow = benchmark.replace("speeds_kmh = [30.0]", "speeds_kmh = [20.0]");
    let beside = benchmark.replace("roundabouts/16m.toml", "roads/mine.toml");
    let ring = String::from_utf8(file("roundabouts/16m.toml")).unwrap();
    let wrong = ring.replace("[ring]", "[ring]\nspeed = 3");
    assert!(wrong != ring && beside != benchmark && slow != benchmark);
    let visits: [Visit; 11] = [
        (json!({ "road": "wide/7/12" }), None, &["wide/7/12 now"], "attard2023 on wide/7/12"),
        (json!({ "road": "wide/7/12" }), None, &["wide/7/12 now."], "attard2023 on wide/7/12"),
        (json!({ "road": "narrow/7/12" }), None, &["distribution: narrow; must be"], "attard2023 on wide/7/12"),
        (json!({ "road": "mixed/3/0, wide/7/13" }), None, &["wide/7/13 now"], "attard2023 on mixed/3/0, wide/7/13"),
        (json!({ "file": "16m.toml" }), Some(ring.into_bytes()), &["16m.toml now"], "attard2023 on 16m.toml"),
        (json!({ "file": "bad.toml" }), Some(wrong.into_bytes()), &["bad.toml: ", "speed"], "attard2023 on 16m.toml"),
        (json!({ "file": "slow.toml" }), Some(slow.into_bytes()), &["slow.toml now, at random"], "slow of slow.toml"),
        (
            json!({ "file": "far.toml" }),
            Some(beside.into_bytes()),
            &["far.toml: ", "files beside"],
            "slow of slow.toml",
        ),
        (json!({ "file": "no.xodr" }), Some(b"<OpenDRIVE/>".to_vec()), &["no.xodr: "], "slow of slow.toml"),
        (
            json!({ "benchmark": 0, "file": "zala.xodr" }),
            Some(file("maps/zala_full.xodr")),
            &["zala.xodr now"],
            "attard2023 on zala.xodr",
        ),
        (json!({ "ring": 1 }), None, &["zala.xodr now"], "attard2023 on zala.xodr, ring 2"),
    ];
    let plan = json!({ "visit": "roads", "visits": visits.iter().map(|(visit, ..)| visit).collect::<Vec<_>>() });
    let files =
        visits.iter().filter_map(|(visit, bytes, ..)| Some((visit["file"].as_str()?.to_owned(), bytes.clone()?)));
    let found = visited(&page(&place, Some(baker)), &plan, files.collect(), false);
    let found = found.as_array().unwrap();
    assert_eq!(found.len(), visits.len());
    for ((_, _, words, benchmark), given) in visits.iter().zip(found) {
        let said = given["words"].as_str().unwrap();
        assert!(words.iter().all(|word| said.contains(word)), "{given}");
        assert_eq!(given["isBad"], !said.contains(" now"), "{given}");
        assert_eq!(given["benchmark"], *benchmark, "{given}");
        // What cannot be baked leaves those that drive as they are.
        assert!(0 < given["begun"].as_u64().unwrap(), "{given}");
    }
    assert_eq!(found[0]["listed"], found[1]["listed"], "a road is baked and listed once");
    let [whole, other] = [&found[9], &found[10]];
    assert!(1 < whole["rings"].as_u64().unwrap() && whole["rings"] == other["rings"], "{whole} {other}");
    assert_ne!(whole["bounds"], other["bounds"]);
    assert_eq!(found[6]["policy"], Value::Null, "a policy drives with actions that are not its own");
}

#[test]
fn the_page_that_comes_with_the_documents_bakes_a_random_road() {
    let page = read(&repository().join("docs/trucks.html"));
    let plan = json!({ "visit": "roads", "visits": [{ "road": "wide/7/12" }] });
    let found = visited(&page, &plan, HashMap::new(), false);
    assert_eq!(
        (&found[0]["isBad"], &found[0]["benchmark"]),
        (&json!(false), &json!("attard2023 on wide/7/12")),
        "{found}"
    );
    assert!(0 < found[0]["begun"].as_u64().unwrap(), "{found}");
}

#[test]
fn a_baker_that_breaks_off_leaves_the_page_driving_with_its_last_words() {
    let place = Place::new();
    let plan = json!({ "visit": "roads", "visits": [{ "road": "wide/7/12" }, { "road": "wide/7/13" }] });
    let found = visited(&page(&place, Some(broken())), &plan, HashMap::new(), false);
    for given in found.as_array().unwrap() {
        let said = given["words"].as_str().unwrap();
        assert!(said.contains("could not bake it") && said.ends_with("the fault"), "{given}");
        assert_eq!((&given["benchmark"], &given["isBad"]), (&json!("attard2023"), &json!(true)));
        assert!(0 < given["begun"].as_u64().unwrap(), "{given}");
    }
    let no_module = visited(&page(&place, Some(b"wasm".to_vec())), &plan, HashMap::new(), false);
    assert_eq!((&no_module[0]["isBad"], &no_module[1]["isBad"]), (&json!(true), &json!(true)), "{no_module}");
}

#[test]
fn a_page_without_a_baker_says_so_where_roads_would_be_typed() {
    let place = Place::new();
    let plan = json!({ "visit": "unbaked" });
    let without = visited(&page(&place, None), &plan, HashMap::new(), false);
    assert_eq!((&without["box"], &without["note"]), (&json!(false), &json!(true)), "{without}");
    let with = visited(&page(&place, Some(broken())), &plan, HashMap::new(), false);
    assert_eq!((&with["box"], &with["note"]), (&json!(true), &json!(false)), "{with}");
}

/// A module that stops in `bake` and leaves "the fault", as a panic does.
fn broken() -> Vec<u8> {
    [
        &b"\0asm\x01\0\0\0"[..],
        // Types: none to i32, i32 to i32. Functions of these; a memory.
        b"\x01\x0a\x02\x60\0\x01\x7f\x60\x01\x7f\x01\x7f",
        b"\x03\x05\x04\x01\0\0\0",
        b"\x05\x03\x01\0\x01",
        b"\x07\x31\x05\x06memory\x02\0\x04room\0\0\x04bake\0\x01\x06result\0\x02\x0dresult_length\0\x03",
        // Constants; `bake` is unreachable.
        b"\x0a\x15\x04\x05\0\x41\x80\x08\x0b\x03\0\0\x0b\x04\0\x41\x10\x0b\x04\0\x41\x09\x0b",
        b"\x0b\x0f\x01\0\x41\x10\x0b\x09the fault",
    ]
    .concat()
}
