use std::io::Read;
use std::path::PathBuf;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::*;

/// Facts, and the bytes of each kind of sections.
type Parts = (Value, Vec<(String, Vec<u8>)>);

/// What a page asks for on a benchmark that comes with the program.
fn asked(of: Value) -> String {
    format!("{}\n", json!({ "benchmark": { "name": "attard2023" }, "of": of }))
}

fn parts(baked: &[u8]) -> Parts {
    let end = baked.iter().position(|&byte| byte == b'\n').unwrap();
    let facts: Value = serde_json::from_slice(&baked[..end]).unwrap();
    let mut rest = &baked[end + 1..];
    let mut kinds = Vec::new();
    for kind in facts["kinds"].as_array().unwrap() {
        let (bytes, others) = rest.split_at(kind[1].as_u64().unwrap() as usize);
        kinds.push((kind[0].as_str().unwrap().to_owned(), bytes.to_vec()));
        rest = others;
    }
    assert!(rest.is_empty());
    (facts, kinds)
}

fn road(name: &str) -> Parts {
    parts(&bake(asked(json!({ "roads": name })).as_bytes()).unwrap())
}

/// What a page gets for a file.
fn dropped(name: &str, ring: usize, bytes: &[u8]) -> Result<Parts, String> {
    let asked = [asked(json!({ "file": { "name": name, "ring": ring } })).as_bytes(), bytes].concat();
    bake(&asked).map(|baked| parts(&baked)).map_err(|error| error.to_string())
}

fn names(of: &Value) -> Vec<&str> {
    of.as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect()
}

fn file(path: &str) -> Vec<u8> {
    std::fs::read(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..").join(path)).unwrap()
}

#[test]
fn a_baked_road_has_the_bytes_of_the_world_file_that_is_written_of_it() {
    for benchmark in ["attard2023", "traffic2026"] {
        agrees(benchmark);
    }
}

/// Whether a benchmark on 16m is baked as it is written.
fn agrees(benchmark: &str) {
    let scenario = Scenario::named(benchmark).unwrap().on(Road::named("16m").unwrap()).unwrap();
    let world = World::bake(&scenario).unwrap().into();
    let folder = tempfile::tempdir().unwrap();
    let written = folder.path().join("16m.world");
    Ground { scenario, world, text: None, is_whole: false }.write(&written).unwrap();
    let text = std::fs::read_to_string(&written).unwrap();
    let mut lines = text.lines().skip(1);
    let facts: Value = serde_json::from_str(lines.next().unwrap()).unwrap();
    let inflated = |line: &str| {
        let (kind, packed) = line.split_once(' ').unwrap();
        let packed = STANDARD.decode(packed).unwrap();
        let mut bytes = Vec::new();
        flate2::read::GzDecoder::new(&packed[..]).read_to_end(&mut bytes).unwrap();
        (kind.to_owned(), bytes)
    };
    let asked = json!({ "benchmark": { "name": benchmark }, "of": { "roads": "16m" } });
    let (baked, kinds) = parts(&bake(format!("{asked}\n").as_bytes()).unwrap());
    for name in ["version", "layout", "world", "sections"] {
        assert_eq!(baked[name], facts[name]);
    }
    assert_eq!(kinds, lines.map(inflated).collect::<Vec<_>>());
    assert!(kinds.iter().all(|(_, bytes)| !bytes.is_empty()) && 4 <= kinds.len());
}

#[test]
fn random_roads_are_baked_by_their_names_in_their_order() {
    let (facts, _) = road(" wide/7/12, mixed/3/0");
    assert_eq!(names(&facts["world"]["roads"]), ["wide/7/12", "mixed/3/0"]);
    assert_eq!((&facts["rings"], &facts["is_benchmark"]), (&json!([]), &json!(false)));
    assert!(names(&facts["world"]["routes"]).iter().any(|name| name.starts_with("mixed/3/0/")));
}

#[test]
fn a_road_is_baked_for_the_benchmark_that_drives_by_its_name_or_its_text() {
    let bytes = |benchmark: Value| {
        let asked = json!({ "benchmark": benchmark, "of": { "roads": "16m" } });
        parts(&bake(asked.to_string().as_bytes()).unwrap())
    };
    let text = Scenario::text_of("laden2026").unwrap();
    let [by_name, by_text] = [json!({ "name": "laden2026" }), json!({ "name": "laden2026", "text": text })].map(bytes);
    assert_eq!(by_name.1, by_text.1);
    assert_eq!(by_name.0["world"]["extras"].as_array().unwrap().len(), 8);
    assert_eq!(by_text.0["world"]["source"]["text"], text);
}

#[test]
fn a_dropped_file_is_a_road_an_outline_or_a_benchmark() {
    let (facts, kinds) = dropped("16m.toml", 0, &file("scenarios/roundabouts/16m.toml")).unwrap();
    assert_eq!((&facts["world"]["roads"][0]["name"], &facts["is_benchmark"]), (&json!("16m"), &json!(false)));
    assert_eq!(kinds, road("16m").1);
    let (facts, _) = dropped("zala8.outline.toml", 0, &file("scenarios/maps/zala8.outline.toml")).unwrap();
    assert_eq!(names(&facts["world"]["roads"]), ["zala8"]);
    let text = Scenario::text_of("attard2023").unwrap().replace("speeds_kmh = [30.0]", "speeds_kmh = [20.0]");
    let (facts, _) = dropped("slow.toml", 0, text.as_bytes()).unwrap();
    assert_eq!((&facts["world"]["name"], &facts["is_benchmark"]), (&json!("slow"), &json!(true)));
    assert_eq!(facts["world"]["source"], json!({ "name": "slow", "text": text }));
    assert_eq!(names(&facts["world"]["roads"]).len(), 5);
}

#[test]
fn of_a_map_the_ring_asked_for_is_driven_and_all_are_listed() {
    let map = file("scenarios/maps/zala_full.xodr");
    let [first, second] = [0, 1].map(|ring| dropped("zala.xodr", ring, &map).unwrap());
    let rings = first.0["rings"].as_array().unwrap();
    assert!(2 <= rings.len() && 1.0 < rings[0]["radius"].as_f64().unwrap(), "{rings:?}");
    assert_eq!(rings, second.0["rings"].as_array().unwrap());
    assert_eq!(names(&first.0["world"]["roads"]), ["zala"]);
    assert_ne!(first.1, second.1);
}

#[test]
fn what_cannot_be_baked_is_refused_in_the_readers_words() {
    let refused = |of: Value, words: &[&str]| {
        let said = bake(asked(of).as_bytes()).map(drop).unwrap_err().to_string();
        assert!(words.iter().all(|word| said.contains(word)), "{said}");
    };
    refused(json!({ "roads": "narrow/7/12" }), &["distribution: narrow; ", "mixed, wide"]);
    refused(json!({ "roads": "30m" }), &["roundabout: 30m; ", "16m, 20m"]);
    refused(json!({ "roads": "16m, 16m" }), &["roads: 16m, 16m; ", "each once"]);
    let many: Vec<String> = (0..=MOST_ROADS).map(|index| format!("wide/7/{index}")).collect();
    refused(json!({ "roads": many.join(",") }), &["24 at most"]);
    let refused = |name: &str, text: &str, words: &[&str]| {
        let said = dropped(name, 0, text.as_bytes()).map(drop).unwrap_err();
        assert!(words.iter().all(|word| said.contains(word)), "{said}");
    };
    refused("mine.toml", "[ring]\nisland_radius = -4.0", &["mine.toml: "]);
    refused("mine.toml", "ring", &["mine.toml: "]);
    refused("mine.xodr", "<OpenDRIVE/>", &["mine.xodr: "]);
    let text = |name: &str| Scenario::text_of(name).unwrap();
    refused("far.toml", &text("random2026"), &["far.toml: procedural: 340 roads; ", "24 at most"]);
    let continuous = text("attard2023-continuous");
    refused("smooth.toml", &continuous, &["smooth", "steer_levels"]);
    let wrong = text("attard2023").replace("spacing", "spacings").replace("range = 20.0", "range = -1.0");
    refused("mine.toml", &wrong, &["mine.toml: sensors.range: "]);
}

#[test]
fn a_vehicle_of_a_file_that_does_not_come_with_the_program_is_beyond_a_page() {
    assert_eq!(vehicle_beyond(&Source::named(Kind::Benchmark, "laden2026").unwrap()), None);
    let folder = tempfile::tempdir().unwrap();
    let (text, truck) = (Scenario::text_of("attard2023").unwrap(), file("scenarios/vehicles/daf_xf.toml"));
    let beyond = |vehicle: &str| {
        let file = folder.path().join("mine.toml");
        std::fs::write(&file, text.replace("vehicles/daf_xf.toml", vehicle)).unwrap();
        vehicle_beyond(&Source::Disk(file))
    };
    std::fs::create_dir(folder.path().join("vehicles")).unwrap();
    std::fs::write(folder.path().join("vehicles/daf_xf.toml"), &truck).unwrap();
    assert_eq!(beyond("daf_xf"), None);
    assert_eq!(beyond("vehicles/daf_xf.toml"), None, "the page has the same");
    assert_eq!(beyond("truck.toml"), Some("truck.toml".to_owned()));
    std::fs::write(folder.path().join("vehicles/daf_xf.toml"), [&truck[..], b"\n# longer\n"].concat()).unwrap();
    assert_eq!(beyond("vehicles/daf_xf.toml"), Some("vehicles/daf_xf.toml".to_owned()));
}
