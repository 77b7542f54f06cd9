//! `report.html`, opened in a browser: with `#selftest` the page checks itself and writes the result into its document.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::page::{block, read};
use crate::place::{Place, offtrack, repository, succeed};

/// A Chromium, whatever its name.
pub fn browser() -> PathBuf {
    let folders: Vec<PathBuf> = std::env::var_os("PATH").iter().flat_map(std::env::split_paths).collect();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let found =
        names.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name))).find(|file| file.is_file());
    found.expect("a browser opens the page in this test: install the package `chromium`")
}

/// The outcome of the page's checks of itself.
fn selftest(page: &Path) -> String {
    let document = opened(page);
    let (_, outcome) =
        document.rsplit_once("<pre id=\"selftest\">").unwrap_or_else(|| panic!("no outcome in {document}"));
    outcome.to_owned()
}

/// The document that the page has made of itself after its checks.
fn opened(page: &Path) -> String {
    let profile = tempfile::tempdir().unwrap();
    let output = Command::new(browser())
        // The sandbox cannot start for root, as in most containers; the page is our own.
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run"])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        // Milliseconds of the page's clock, which does not wait for real time.
        .args(["--virtual-time-budget=60000", "--dump-dom"])
        .arg(format!("file://{}#selftest", page.display()))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.stdout.is_empty(), "{said}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// How wide the page's contents are where the window has so many pixels. A headless window is never narrower than 500
/// pixels; a frame is.
pub fn widths(page: &Path, window: u32) -> (u32, u32) {
    let report = "<script>addEventListener('load', () => setTimeout(() => { const page = document.documentElement; \
                  parent.postMessage(`${page.clientWidth} ${page.scrollWidth}`, '*') }, 1000))</script></body>";
    let [framed, frame] = ["framed.html", "frame.html"].map(|name| page.with_file_name(name));
    std::fs::write(&framed, read(page).replace("</body>", report)).unwrap();
    let outer = format!(
        "<iframe src=\"framed.html\" style=\"border: 0; width: {window}px; height: 9000px\"></iframe>\
         <script>addEventListener('message', \
         event => document.body.append(Object.assign(document.createElement('pre'), {{ id: 'selftest', textContent: \
         event.data }})))</script>"
    );
    std::fs::write(&frame, outer).unwrap();
    let outcome = selftest(&frame);
    let (width, contents) = outcome.split_once('<').unwrap().0.split_once(' ').unwrap();
    (width.parse().unwrap(), contents.parse().unwrap())
}

/// A benchmark of `n` roundabouts with 20 test routes each, and its name.
fn large(place: &Place, n: usize) -> String {
    let scenarios = repository().join("scenarios");
    let short = read(&place.file("short.toml"));
    let (head, _) = short.split_once("[[roundabout]]").unwrap();
    // With finer steer levels pure pursuit arrives now and then.
    let mut benchmark =
        head.replace("[-0.8, -0.4, 0.0, 0.4, 0.8]", "[-0.8, -0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8]");
    std::fs::create_dir(place.file("roads")).unwrap();
    for index in 0..n {
        let name = format!("roads/r{index}.toml");
        let file = ["20m", "40m"][index % 2];
        std::fs::copy(scenarios.join(format!("roundabouts/{file}.toml")), place.file(&name)).unwrap();
        benchmark += &format!("[[roundabout]]\nfile = \"{name}\"\ntest = \"all\"\n");
    }
    std::fs::write(place.file("large.toml"), benchmark).unwrap();
    place.text("large.toml")
}

#[test]
fn a_training_run_leaves_a_page_that_holds_its_report_and_passes_its_own_checks() {
    let place = Place::new();
    succeed(&place.train(&["--name", "run"]));
    let page = place.file("runs/run/report.html");
    let text = read(&page);
    assert_eq!(serde_json::from_str::<Value>(block(&text, "report")).unwrap(), place.json("runs/run/report.json"));
    assert_eq!(
        serde_json::from_str::<Value>(block(&text, "metrics")).unwrap(),
        read(&place.file("runs/run/metrics.csv"))
    );
    let outcome = selftest(&page);
    assert!(outcome.starts_with("selftest passed\n"), "{outcome}");
    // The page's only address is the name space of SVG: the page loads no other file.
    assert_eq!(
        text.matches("http://").count() + text.matches("https://").count(),
        text.matches("\"http://www.w3.org/2000/svg\"").count()
    );
}

#[test]
fn a_page_of_an_evaluation_alone_passes_its_own_checks_and_one_with_a_wrong_figure_fails_them() {
    let place = Place::new();
    let page = place.file("page.html");
    let arguments = [
        "--policy",
        "pursuit",
        "--episodes",
        "2",
        "--html",
        &place.text("page.html"),
        "--json",
        &place.text("report.json"),
    ];
    succeed(&place.evaluate(&arguments));
    let text = read(&page);
    // The page has machine and commit elsewhere, and every step of the episodes.
    let mut report = place.json("report.json");
    for key in ["machine", "device", "commit", "asked", "outcomes"] {
        assert!(report.as_object_mut().unwrap().remove(key).is_some(), "{key}");
    }
    assert_eq!(serde_json::from_str::<Value>(block(&text, "report")).unwrap()["evaluation"], report);
    let outcome = selftest(&page);
    assert!(outcome.starts_with("selftest passed\n"), "{outcome}");

    // A changed character of the recorded episodes, and a figure of the report that is two centimetres off.
    let tracks = block(&text, "tracks");
    let middle = tracks.len() / 2;
    let other = if tracks.as_bytes()[middle] == b'A' { "B" } else { "A" };
    let changed = format!("{}{other}{}", &tracks[..middle], &tracks[middle + 1..]);
    let mean = place.json("report.json")["lane_distance_mean"].as_f64().unwrap();
    let key = |mean: f64| format!("\"lane_distance_mean\":{mean}");
    for (from, to, expected) in [
        (tracks, changed.as_str(), "fails: the page is read"),
        (&key(mean), &key(mean + 0.02), "fails: the recorded frames give the report's figures: distance"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(&page, text.replace(from, to)).unwrap();
        let outcome = selftest(&page);
        assert!(outcome.starts_with("selftest failed\n") && outcome.contains(expected), "{outcome}");
    }
}

#[test]
fn a_page_of_many_routes_shows_groups_and_of_many_episodes_those_that_failed_and_a_sample_of_the_others() {
    let place = Place::new();
    let (benchmark, page) = (large(&place, 6), place.file("page.html"));
    let evaluate = |episodes: &str| {
        let output = offtrack(
            &[
                &["evaluate", "--benchmark", &benchmark, "--policy", "pursuit", "--episodes", episodes],
                &["--html", &place.text("page.html"), "--json", &place.text("report.json")][..],
            ]
            .concat(),
        );
        succeed(&output);
        (String::from_utf8_lossy(&output.stdout).into_owned(), place.json("report.json"), opened(&page))
    };
    let says = |document: &str, text: &str| assert!(document.contains(text), "{text} is not in the page");

    let (table, report, document) = evaluate("1");
    says(&document, "selftest passed");
    let n_routes = report["routes"].as_array().unwrap().len();
    assert!(100 <= n_routes && table.contains("exit 3") && table.contains("lane left"), "{table}");
    assert!(table.matches("-left-").count() + table.matches("-right-").count() <= 20, "{table}");
    assert_eq!(report["groups"]["roundabout"].as_array().unwrap().len(), 6);
    assert!(report["routes"][0]["island_radius"].is_f64());

    // More episodes than are all shown; of those that failed there may be more, too.
    let episodes = 4000 / n_routes + 1;
    let (_, report, document) = evaluate(&episodes.to_string());
    says(&document, "selftest passed");
    let [count, arrived] = ["episodes", "arrived"].map(|key| report[key].as_u64().unwrap());
    let failed = count - arrived;
    assert!(4000 < count && 1000 < failed && 400 < arrived, "{failed} of {count} failed");
    says(&document, "1,400 of ");
    says(&document, &format!("1,000 of {},{:03} that failed and 400 of ", failed / 1000, failed % 1000));
    assert!(std::fs::metadata(&page).unwrap().len() < 8 << 20);
}

#[test]
fn only_a_page_of_the_studys_benchmark_has_a_column_for_the_study() {
    let place = Place::new();
    let page = place.file("page.html");
    let column = |document: &str| document.contains("<th scope=\"col\">Attard and Bajada (2023), SAC</th>");
    succeed(&place.evaluate(&["--policy", "random", "--episodes", "1", "--html", &place.text("page.html")]));
    let document = opened(&page);
    assert!(document.contains("selftest passed") && !column(&document));
    assert!(!document.contains("<tr class=\"class\">"), "one vehicle at one speed has no classes");
    succeed(&offtrack(&["evaluate", "--policy", "random", "--episodes", "1", "--html", &place.text("page.html")]));
    let document = opened(&page);
    assert!(document.contains("selftest passed") && column(&document));
}

#[test]
fn a_page_has_a_row_for_each_further_evaluation_and_their_routes_are_left_to_the_report() {
    let place = Place::new();
    let also = format!("also_evaluate=[\"{}/train\"]", place.text("short.toml"));
    succeed(&place.train(&["--name", "run", "--set", &also]));
    let page = place.file("runs/run/report.html");
    let further = |report: &Value| report["also"][0].as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    let shown = further(&serde_json::from_str(block(&read(&page), "report")).unwrap());
    let mut all = further(&place.json("runs/run/report.json"));
    all.retain(|name| name != "routes" && name != "groups");
    assert_eq!(shown, all);
    let document = opened(&page);
    assert!(
        document.contains("Success, short, train routes (1 of them trained on)")
            && document.contains("selftest passed\n"),
        "{document}"
    );
}

#[test]
fn a_page_of_a_fleet_shows_each_episode_with_its_own_truck_and_names_vehicle_and_load() {
    let place = Place::new();
    let (page, route) = (place.file("page.html"), "20m/E-right-1");
    let flags = ["--route", route, "--episodes", "12", "--policy", "pursuit", "--html", &place.text("page.html")];
    succeed(&offtrack(&[&["evaluate", "--benchmark", "laden2026"], &flags[..]].concat()));
    let document = opened(&page);
    assert!(
        document.contains("selftest passed") && document.contains("holds: the replay shows the truck that was driven"),
        "{document}"
    );
    let (_, line) = document.split_once("id=\"truck\"").unwrap();
    let (_, words) = line.split_once('>').unwrap();
    let (words, _) = words.split_once('<').unwrap();
    let (vehicle, load) = words.split_once(", ").unwrap();
    assert!(
        ["daf_xf", "eu_4x2_13m6"].contains(&vehicle) && ["empty", "half", "laden", "laden_high"].contains(&load),
        "{words}"
    );
    assert!(
        document.matches("<tr class=\"class\">").count() > 2 && document.contains("the route open in the replay"),
        "{document}"
    );
    // With the dimensions of another truck, its rays do not end at kerbs.
    let text = read(&page);
    let own = "ground.vehicles[episode.vehicle ?? 0]";
    assert!(text.contains(own));
    std::fs::write(&page, text.replace(own, "ground.vehicles[((episode.vehicle ?? 0) + 1) % ground.vehicles.length]"))
        .unwrap();
    let outcome = selftest(&page);
    assert!(outcome.contains("fails: the replay shows the truck that was driven: rays of episode"), "{outcome}");
}

#[test]
fn a_page_is_as_wide_as_its_window_on_a_telephone_a_tablet_and_a_desk() {
    let place = Place::new();
    let road = "a-roundabout-with-a-rather-long-name";
    let scenarios = repository().join("scenarios");
    std::fs::copy(scenarios.join("roundabouts/16m.toml"), place.file(&format!("{road}.toml"))).unwrap();
    let benchmark = read(&place.file("short.toml"));
    let own = format!("{}/roundabouts/16m.toml", scenarios.display());
    assert!(benchmark.contains(&own));
    std::fs::write(place.file("short.toml"), benchmark.replace(&own, &format!("{road}.toml"))).unwrap();
    succeed(&place.train(&["--name", "run"]));
    let fleet =
        ["--route", "20m/E-right-1", "--episodes", "4", "--policy", "pursuit", "--html", &place.text("fleet.html")];
    succeed(&offtrack(&[&["evaluate", "--benchmark", "laden2026"], &fleet[..]].concat()));
    for page in ["runs/run/report.html", "fleet.html"] {
        let page = place.file(page);
        for window in [400, 780, 1200] {
            let (width, contents) = widths(&page, window);
            // A bar to scroll with takes a few pixels of the window.
            assert!(
                contents <= width && (window - 20..=window).contains(&width),
                "{}: {contents} of {width}",
                page.display()
            );
        }
    }
    assert!(opened(&place.file("runs/run/report.html")).contains(&format!("{road}/E-right-1")));
}

#[test]
fn the_page_of_a_comparison_plays_pairs_from_the_same_start_of_which_one_side_arrives() {
    let place = Place::new();
    let [a, b, page] = ["a.json", "b.json", "page.html"].map(|name| place.text(name));
    for (policy, file) in [("attard2023", &a), ("pursuit", &b)] {
        let routes = ["--route", "20m/N-left-2", "--route", "40m/NW-left-3", "--episodes", "3"];
        succeed(&offtrack(&[&["evaluate", "--policy", policy, "--json", file], &routes[..]].concat()));
    }
    succeed(&offtrack(&["compare", &a, &b, "--html", &page]));
    let outcome = selftest(page.as_ref());
    assert!(outcome.starts_with("selftest passed\n"), "{outcome}");
    // A pair whose second half is another start's.
    let text = read(page.as_ref());
    let pairs: Value = serde_json::from_str(block(&text, "pairs")).unwrap();
    assert!(2 <= pairs["names"].as_array().unwrap().len(), "{pairs}");
    let wrong = text.replace("2 * index, 2 * index + 2", "2 * index + 1, 2 * index + 3");
    assert_ne!(wrong, text);
    std::fs::write(&page, wrong).unwrap();
    assert!(selftest(page.as_ref()).starts_with("selftest failed"));
}
