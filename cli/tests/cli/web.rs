//! `offtrack web`: what it writes and what it refuses; `live.rs` opens the page.

use serde_json::Value;

use crate::page::{block, read};
use crate::place::{Place, offtrack, refusal, repository, succeed};

/// Most bytes of the page that comes without any flag.
const MOST: usize = 3_200_000;

fn facts(page: &str) -> Value {
    serde_json::from_str(block(page, "facts")).unwrap()
}

fn names(of: &Value) -> Vec<&str> {
    of.as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect()
}

#[test]
fn the_default_page_is_one_small_file_without_an_address_and_its_parts_are_said() {
    let place = Place::new();
    let output = offtrack(&["web", "-o", &place.text("trucks.html")]);
    succeed(&output);
    let page = read(&place.file("trucks.html"));
    assert!(page.len() < MOST, "{}", page.len());
    // The only address is the name space of SVG: the page loads no other file.
    let addresses = page.matches("http://").count() + page.matches("https://").count();
    assert_eq!(addresses, page.matches("\"http://www.w3.org/2000/svg\"").count());
    assert!(page.contains("default-src 'none';"));
    let said = String::from_utf8(output.stdout).unwrap();
    let weights = said.lines().map(|line| line.split_whitespace().rev().nth(1).unwrap().parse::<f64>().unwrap());
    let weights: Vec<f64> = weights.collect();
    let (all, parts) = weights.split_last().unwrap();
    // What is not listed are the page's own elements.
    assert!((1e3 * all - page.len() as f64).abs() < 100.0 && (all - parts.iter().sum::<f64>()).abs() < 30.0, "{said}");
    let facts = facts(&page);
    assert_eq!(names(&facts["worlds"]), ["attard2023", "laden2026"]);
    let policies = ["attard2023 (shipped)", "attard2023-lane (shipped)", "laden2026 (shipped)"];
    assert_eq!(names(&facts["policies"]), policies);
    let able: Vec<&Value> = facts["worlds"].as_array().unwrap().iter().map(|world| &world["policies"]).collect();
    assert_eq!(able, [&serde_json::json!([0, 1]), &serde_json::json!([2])]);
    assert_eq!(whole(&facts), [true, true]);
}

/// Whether each benchmark is one to which reported results belong.
fn whole(facts: &Value) -> Vec<bool> {
    facts["worlds"].as_array().unwrap().iter().map(|world| world["is_whole"].as_bool().unwrap()).collect()
}

#[test]
fn a_page_has_the_roads_and_routes_that_are_asked_for_and_random_ones_by_name() {
    let place = Place::new();
    let file = place.text("trucks.html");
    let web = |flags: &[&str]| {
        succeed(&offtrack(&[&["web", "--benchmark", "attard2023", "-o", &file], flags].concat()));
        facts(&read(&place.file("trucks.html")))
    };
    let all = web(&["--road", "wide/7/12", "--road", "20m/N-left-4", "--policy", "attard2023", "--seed", "9"]);
    let world = &all["worlds"][0];
    assert_eq!(names(&world["roads"]), ["20m", "wide/7/12"]);
    assert_eq!(names(&world["routes"])[0], "20m/N-left-4");
    assert!(names(&world["routes"])[1..].iter().all(|name| name.starts_with("wide/7/12/")), "{world}");
    assert_eq!((&all["seed"], names(&all["policies"])), (&Value::from(9), vec!["attard2023 (shipped)"]));
    assert_eq!(whole(&all), [false]);
    let test = web(&["--split", "test"]);
    assert_eq!(names(&test["worlds"][0]["roads"]), ["20m", "40m"]);
    assert_eq!(test["worlds"][0]["splits"].as_object().unwrap().keys().collect::<Vec<_>>(), ["test"]);
}

#[test]
fn a_page_of_a_training_run_has_its_benchmark_and_its_policies_in_their_order_and_with_them_what_is_asked_for() {
    let place = Place::new();
    succeed(&place.train(&["--name", "run"]));
    let (run, file) = (place.text("runs/run"), place.text("trucks.html"));
    let web = |flags: &[&str]| {
        let output = offtrack(&[&["web", "--run", &run, "-o", &file], flags].concat());
        succeed(&output);
        (String::from_utf8(output.stdout).unwrap(), facts(&read(&place.file("trucks.html"))))
    };
    let (said, alone) = web(&[]);
    assert!(said.lines().any(|line| line.starts_with("run ")) && !said.contains("policies"), "{said}");
    assert_eq!(names(&alone["worlds"]), ["short"]);
    let list = place.json("runs/run/policies/policies.json");
    let list = list.as_array().unwrap();
    let shown = alone["run"]["policies"].as_array().unwrap();
    assert!(4 < list.len() && shown.len() == list.len() + 1, "{list:?}");
    for (index, (shown, kept)) in shown.iter().zip(list.iter().chain([&Value::Null])).enumerate() {
        assert_eq!((&shown["policy"], &shown["kept"]), (&index.into(), kept));
    }
    let files = names(&alone["policies"]);
    assert!(
        files[0].ends_with("000000000408.safetensors") && files.last().unwrap().ends_with("run/policy.safetensors")
    );
    // Beside the others of its benchmark, or of one that has its actions.
    let (said, more) = web(&["--policy", &place.text("runs/run/policy.safetensors"), "--road", "20m"]);
    assert!(said.contains("policies"), "{said}");
    assert_eq!(more["run"]["policies"][0]["policy"], 1);
    assert_eq!(names(&more["worlds"][0]["roads"]), ["20m"]);
}

#[test]
fn a_folder_that_is_no_run_or_has_no_policies_for_the_benchmark_is_refused_with_what_would_do() {
    let place = Place::new();
    succeed(&place.train(&["--name", "run", "--steps", "800"]));
    let (run, file) = (place.text("runs/run"), place.text("trucks.html"));
    let refused = |flags: &[&str], words: &[&str]| {
        let said = refusal(&offtrack(&[&["web"], flags].concat()), 2);
        assert!(said.lines().count() == 1 && words.iter().all(|word| said.contains(word)), "{flags:?}: {said}");
        assert!(!place.file("trucks.html").exists(), "{flags:?}");
    };
    let to = ["-o", file.as_str()];
    refused(&[&["--run", &place.text("runs")], &to[..]].concat(), &["--run", "the folder of a run is needed"]);
    let other = ["--run", &run, "--benchmark", "attard2023", "--benchmark", "laden2026"];
    refused(
        &[&other, &to[..]].concat(),
        &["--benchmark: attard2023, laden2026; ", "another action table", "without it the page has the run's own"],
    );
    // The first update follows on a step more than the warmup.
    let first = place.text("runs/run/policies/000000000408.safetensors");
    refused(&["--run", &run, "-o", &first], &["--output", "is the file of --run too"]);
    std::fs::remove_file(&first).unwrap();
    refused(&[&["--run", &run], &to[..]].concat(), &[&first, "cannot be read"]);
    let list = place.text("runs/run/policies/policies.json");
    std::fs::write(&list, "[{}]").unwrap();
    refused(&[&["--run", &run], &to[..]].concat(), &[&list, "is not the list of a run's policies", "missing field"]);
    std::fs::remove_dir_all(place.file("runs/run/policies")).unwrap();
    let left = place.text("runs/run/policy.safetensors");
    refused(&[&["--run", &run], &to[..]].concat(), &["--run", "keeps no policies", &format!("--policy {left}")]);
    // A page observes one step.
    crate::resume::refine(&place);
    succeed(&place.train(&["--name", "framed", "--steps", "4000"]));
    let framed = place.text("runs/framed");
    refused(&[&["--run", &framed], &to[..]].concat(), &["--run", "its policy sees 3 observations"]);
    let policy = place.text("runs/framed/policy.safetensors");
    refused(&[&["--policy", &policy], &to[..]].concat(), &["--policy", "has a memory, sees several steps, reads some"]);
}

#[test]
fn a_baker_of_this_version_goes_into_the_page_which_else_allows_no_webassembly() {
    let place = Place::new();
    let (file, baker) = (place.text("trucks.html"), place.text("baker.wasm"));
    let web = |flags: &[&str]| {
        offtrack(&[&["web", "--benchmark", "attard2023", "--road", "16m", "-o", &file], flags].concat())
    };
    let stamp = concat!("offtrack baker ", env!("CARGO_PKG_VERSION"));
    for (bytes, words) in [("offtrack baker", "is no WebAssembly"), ("\0asm of another", "another program or version")]
    {
        std::fs::write(&baker, bytes).unwrap();
        let said = refusal(&web(&["--baker", &baker]), 2);
        assert!([words, "--baker", "web/build.sh"].iter().all(|word| said.contains(word)), "{said}");
    }
    let said = refusal(&web(&["--baker", &place.text("none.wasm")]), 2);
    assert!(said.contains("none.wasm: cannot be read"), "{said}");
    let said = refusal(&offtrack(&["web", "--baker", &file, "-o", &file]), 2);
    assert!(said.contains("--output") && said.contains("is the file of --baker too"), "{said}");
    std::fs::write(&baker, format!("\0asm {stamp}")).unwrap();
    let output = web(&["--baker", &baker]);
    succeed(&output);
    assert!(String::from_utf8(output.stdout).unwrap().lines().any(|line| line.starts_with("baker ")));
    let page = read(&place.file("trucks.html"));
    assert!(page.contains("script-src 'unsafe-inline' 'wasm-unsafe-eval'; worker-src blob:\""));
    assert!(facts(&page)["baker"].is_u64() && block(&page, "worker").contains("WebAssembly.instantiate"));
    succeed(&web(&[]));
    let page = read(&place.file("trucks.html"));
    assert!(page.contains("script-src 'unsafe-inline'\"") && block(&page, "worker").is_empty());
    assert_eq!(facts(&page)["baker"], Value::Null);
    // A benchmark of one's own, with a vehicle of its own and the name of another.
    let (own, truck) = (place.file("attard2023.toml"), repository().join("scenarios/vehicles/daf_xf.toml"));
    let text = read(&place.file("short.toml")).replace(truck.to_str().unwrap(), "truck.toml");
    std::fs::copy(truck, place.file("truck.toml")).unwrap();
    std::fs::write(&own, text).unwrap();
    let output = offtrack(&["web", "--benchmark", own.to_str().unwrap(), "--baker", &baker, "-o", &file]);
    succeed(&output);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        ["note: ", "attard2023.toml", "vehicle truck.toml", "--baker"].iter().all(|word| said.contains(word)),
        "{said}"
    );
    let all = facts(&read(&place.file("trucks.html")));
    assert_eq!((&all["baker"], whole(&all)), (&Value::Null, vec![false]));
}

#[test]
fn what_no_page_can_show_is_refused() {
    let place = Place::new();
    let file = place.text("trucks.html");
    let refused = |flags: &[&str], words: &[&str]| {
        let said = refusal(&offtrack(&[&["web", "-o", &file], flags].concat()), 2);
        assert!(words.iter().all(|word| said.contains(word)), "{flags:?}: {said}");
        assert!(!place.file("trucks.html").exists(), "{flags:?}");
    };
    let one = ["--benchmark", "attard2023"];
    refused(&["--policy", "attard2023-as-run"], &["attard2023-as-run (shipped)", "another action table"]);
    refused(&["--policy", "pursuit"], &["pursuit", "the program comes with attard2023"]);
    refused(&[&one[..], &["--road", "20m/N-left-9"]].concat(), &["--road", "20m/N-left-9", "N-left-4"]);
    refused(&[&one[..], &["--split", "validation"]].concat(), &["--split", "validation"]);
    for rule in ["yields:traffic2026", "follows:mine.safetensors", "yields"] {
        refused(&["--benchmark", "traffic2026", "--policy", rule], &["--policy", rule, "on the processor", "--html"]);
    }
    refused(&[&one[..], &one[..]].concat(), &["--benchmark: attard2023; is given twice"]);
    let policy = ["--policy", "attard2023"];
    refused(&[&one[..], &policy, &policy].concat(), &["--policy: attard2023; is given twice"]);
    refused(&["--world"], &["--benchmark", "attard2023, laden2026", "name one"]);
    refused(&[&one[..], &["--world", "--seed", "1"]].concat(), &["--world", "--seed"]);
    refused(&[&one[..], &["--world", "--run", "runs/mine"]].concat(), &["--world", "--run"]);
    refused(&["--benchmark", &file], &["--output", "is the file of --benchmark too"]);
}
