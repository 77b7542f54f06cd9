//! `offtrack fits`: verdicts and exit codes, files with what they promise, resumption, and what is refused.

use std::process::{Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::place::{Place, offtrack, program, refusal, repository, succeed};

/// `fits` on one route of 16m with a narrow search.
fn fits(place: &Place, arguments: &[&str]) -> Output {
    command(place, arguments).output().unwrap()
}

fn command(place: &Place, arguments: &[&str]) -> Command {
    let mut command = program();
    let folder = place.text("fits");
    command.current_dir(repository()).args(["fits", "16m", "--widths", "64", "-o", &folder]).args(arguments);
    command
}

const EASY: [&str; 4] = ["--vehicle", "eu_4x2_13m6", "--route", "E-right-2"];
const HARD: [&str; 4] = ["--vehicle", "us_wb67", "--route", "E-right-1"];

fn text(place: &Place, name: &str) -> String {
    std::fs::read_to_string(place.file("fits").join(name)).unwrap()
}

#[test]
fn a_truck_that_fits_is_exit_code_0_with_table_json_csv_sheet_pdf_and_drawing() {
    let place = Place::new();
    let output = fits(&place, &EASY);
    succeed(&output);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("16m/E-right-2") && said.contains("1 of 1 fit: empty, 15 km/h"), "{said}");
    let json = place.json("fits/fits.json");
    for key in ["version", "program", "commit", "date", "machine", "asked", "assumptions", "inputs"] {
        assert!(!json[key].is_null(), "{key}: {json}");
    }
    let row = &json["rows"][0];
    assert_eq!(
        (&row["route"], &row["vehicle"], &row["fits"]),
        (&"16m/E-right-2".into(), &"eu_4x2_13m6".into(), &true.into())
    );
    for way in ["lane_centre", "way"] {
        assert!(2.5 < row[way]["swept_width"].as_f64().unwrap(), "{row}");
        assert!(row[way]["tractor"]["clearance"].is_f64() && row[way]["steer_angle_deg"].is_f64(), "{row}");
    }
    assert!((5.0..90.0).contains(&row["fastest_kmh"].as_f64().unwrap()));
    let csv = text(&place, "fits.csv");
    assert!(csv.starts_with("route,vehicle,fits,fastest_kmh,lane_centre_fits") && csv.lines().count() == 2, "{csv}");
    let verdicts = text(&place, "verdicts.csv");
    assert!(verdicts.starts_with("route,eu_4x2_13m6\n16m/E-right-2,lane centre "), "{verdicts}");
    let pdf = std::fs::read(place.file("fits/16m.pdf")).unwrap();
    assert!(pdf.starts_with(b"%PDF-"));
    let dxf = text(&place, "16m-eu_4x2_13m6.dxf");
    assert!(dxf.contains("E-RIGHT-2_SWEPT_TRAILER") && dxf.ends_with("EOF\n"));
    let features = place.json("fits/16m-eu_4x2_13m6.geojson");
    let of = |part: &str| {
        let all = features["features"].as_array().unwrap().iter();
        all.filter(|feature| feature["properties"]["part"] == part).cloned().collect::<Vec<_>>()
    };
    for part in ["swept_tractor", "swept_trailer", "front_axle", "drive_axle", "trailer_axles", "clearance"] {
        let [one] = of(part).try_into().unwrap();
        assert_eq!(
            (&one["properties"]["route"], &one["properties"]["vehicle"]),
            (&"E-right-2".into(), &"eu_4x2_13m6".into())
        );
    }
    assert!(10 < of("tractor").len() && of("tractor").len() == of("trailer").len() && of("lane").len() == 20);
}

#[test]
fn a_truck_that_does_not_fit_is_exit_code_1_and_says_where() {
    let place = Place::new();
    let output = fits(&place, &HARD);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("does not fit") && said.contains("0 of 1 fit"), "{said}");
    let row = &place.json("fits/fits.json")["rows"][0];
    assert!(row["fits"] == false && row["lane_centre"]["trailer"]["clearance"].as_f64().unwrap() < 0.0, "{row}");
    assert!(text(&place, "16m.svg").contains("does not fit"));
}

#[test]
fn a_clearance_that_no_way_keeps_makes_a_truck_not_fit_that_fits_without() {
    let place = Place::new();
    let output = fits(&place, &[&EASY[..], &["--clearance", "2"]].concat());
    assert_eq!(output.status.code(), Some(1));
    let row = &place.json("fits/fits.json")["rows"][0];
    let clearance = row["way"]["trailer"]["clearance"].as_f64().unwrap();
    assert!((0.0..2.0).contains(&clearance) && row["searched_clearance"] == 0.0, "{row}");
}

#[test]
fn the_same_command_keeps_what_is_there_and_answers_the_rest() {
    let place = Place::new();
    let both = [&EASY[..], &["--vehicle", "daf_xf"]].concat();
    succeed(&fits(&place, &both));
    let whole = place.json("fits/fits.json");
    // A row that was marked stays as it is, one that is missing comes back.
    let mut part = whole.clone();
    part["rows"][0]["fastest_kmh"] = 77.0.into();
    part["rows"].as_array_mut().unwrap().truncate(1);
    std::fs::write(place.file("fits/fits.json"), part.to_string()).unwrap();
    std::fs::remove_file(place.file("fits/16m.svg")).unwrap();
    succeed(&fits(&place, &both));
    let again = place.json("fits/fits.json");
    assert_eq!((&again["rows"][0]["fastest_kmh"], &again["rows"][1]), (&77.0.into(), &whole["rows"][1]));
    assert!(text(&place, "16m.svg").contains("daf_xf"));
    let said = refusal(&fits(&place, &[&both[..], &["--clearance", "0.1"]].concat()), 2);
    assert!(said.contains("fits.json") && said.contains("clearance: 0 there, 0.1 here"), "{said}");
    std::fs::write(place.file("fits/fits.json"), "{}").unwrap();
    assert!(refusal(&fits(&place, &both), 2).contains("is not a file of `offtrack fits`"));
}

#[test]
fn another_route_is_added_to_every_file_and_files_that_are_not_its_own_stay() {
    let place = Place::new();
    succeed(&fits(&place, &EASY));
    let output = fits(&place, &[EASY[0], EASY[1], "--route", "E-right-1"]);
    assert!(String::from_utf8_lossy(&output.stdout).contains(" of 1 fit: "), "{output:?}");
    let verdicts = text(&place, "verdicts.csv");
    assert_eq!((verdicts.lines().count(), text(&place, "fits.csv").lines().count()), (3, 3), "{verdicts}");
    for route in ["E-right-1", "E-right-2"] {
        assert!(verdicts.contains(route) && text(&place, "16m.svg").contains(route), "{route}");
        let drawn = format!("{}_SWEPT_TRAILER", route.to_uppercase());
        assert!(text(&place, "16m-eu_4x2_13m6.dxf").contains(&drawn), "{route}");
    }
    let other = Place::new();
    std::fs::create_dir(other.file("fits")).unwrap();
    std::fs::write(other.file("fits/16m.pdf"), "a plan").unwrap();
    let said = refusal(&fits(&other, &EASY), 2);
    assert!(said.contains("--output: ") && said.contains("16m.pdf; is there already, and no results"), "{said}");
    assert_eq!(text(&other, "16m.pdf"), "a plan");
}

#[test]
fn a_call_that_is_killed_goes_on_and_leaves_the_same_bytes_as_one_that_is_not() {
    let place = Place::new();
    // Long enough that the call is killed on its way on a busy machine too.
    let vehicles = ["--vehicle", "eu_4x2_13m6", "--vehicle", "us_wb62", "--vehicle", "us_wb67"];
    let rows = || match std::fs::read_to_string(place.file("fits/fits.json")) {
        Ok(text) => text.matches("\"searched_clearance\"").count(),
        Err(_) => 0,
    };
    let mut running = command(&place, &vehicles).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while rows() == 0 && running.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(5));
    }
    running.kill().unwrap();
    running.wait().unwrap();
    let left = rows();
    let resumed = fits(&place, &vehicles);
    let whole = place.text("whole");
    let at_once = program()
        .current_dir(repository())
        .args(["fits", "16m", "--widths", "64", "-o", &whole])
        .args(vehicles)
        .output()
        .unwrap();
    assert_eq!((resumed.status.code(), &resumed.stdout), (at_once.status.code(), &at_once.stdout));
    for name in ["fits.csv", "16m-eu_4x2_13m6.dxf", "16m-eu_4x2_13m6.geojson"] {
        let bytes = |folder: &str| std::fs::read(place.file(folder).join(name)).unwrap();
        assert!(bytes("fits") == bytes("whole"), "{name}");
    }
    // The date is that of the call.
    let (one, other) = (place.json("fits/fits.json"), place.json("whole/fits.json"));
    assert_eq!(one["rows"], other["rows"]);
    let all = other["rows"].as_array().unwrap().len();
    assert!(0 < left && left < all, "{left} of {all} rows");
}

#[test]
fn a_sheet_is_at_the_scale_that_it_states() {
    let place = Place::new();
    succeed(&fits(&place, &EASY));
    let svg = text(&place, "16m.svg");
    let scale = [250.0f64, 500.0, 1000.0].into_iter().find(|scale| svg.contains(&format!("Scale 1:{scale} on A3")));
    // The bar of 10 m, in pixels of 1/96 inch; the page is as wide in millimetres as it says.
    let bar = 10_000.0 / scale.unwrap() * 96.0 / 25.4;
    let bar = format!("v6h{}v-6", (bar * 100.0).round() / 100.0);
    assert!(svg.contains(&bar), "{bar}");
    assert!(svg.contains("width=\"420mm\"") && svg.contains("viewBox=\"0 0 1587.4 1122.52\""), "{}", &svg[..400]);
    for words in ["Assumed", "Designed", "1 of 1 fit with 0 m clearance", "offtrack 0."] {
        assert!(svg.contains(words), "{words}");
    }
}

#[test]
fn the_table_is_no_wider_than_the_terminal_and_has_feet_on_request() {
    let place = Place::new();
    for columns in ["40", "120"] {
        let output = command(&place, &EASY).env("COLUMNS", columns).output().unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        let table: Vec<&str> = said.lines().take(3).collect();
        assert!(table.iter().all(|line| line.chars().count() <= columns.parse().unwrap()), "{said}");
    }
    let said = String::from_utf8(fits(&place, &[&EASY[..], &["--feet"]].concat()).stdout).unwrap();
    assert!(said.contains(" ft") && said.contains("mph") && !said.contains("km/h"), "{said}");
    let (json, svg) = (place.json("fits/fits.json"), text(&place, "16m.svg"));
    let width = json["rows"][0]["lane_centre"]["swept_width"].as_f64().unwrap();
    assert!(svg.contains(&format!("swept {:.1} ft", width / 0.3048)) && svg.contains("30 ft"), "{width}");
    assert!(!svg.contains(" m long") && svg.contains(" ft long"));
}

#[test]
fn a_road_without_a_route_that_is_asked_for_has_no_files() {
    let place = Place::new();
    succeed(&fits(&place, &["20m", "--vehicle", "eu_4x2_13m6", "--route", "16m/E-right-2"]));
    assert!(place.file("fits/16m.svg").exists() && !place.file("fits/20m.svg").exists());
}

#[test]
fn coordinates_that_are_in_no_frame_are_said_to_be_in_none() {
    let place = Place::new();
    let map = std::fs::read_to_string(repository().join("tests/data/maps/plain_ring.xodr")).unwrap();
    let offset = "<offset x=\"1000\" y=\"2000\" z=\"0\" hdg=\"0.5\"/></header>";
    std::fs::write(place.file("moved.xodr"), map.replace("</header>", offset)).unwrap();
    let (map, folder, file) = (place.text("moved.xodr"), place.text("fits"), place.text("moved.geojson"));
    let frame = ["--crs", "urn:ogc:def:crs:EPSG::25832"];
    for command in [&["fits", &map, "--vehicle", "daf_xf", "-o", &folder][..], &["export", &map, "-o", &file]] {
        let said = refusal(&offtrack(&[command, &frame].concat()), 2);
        assert!(said.contains("--crs: urn:ogc:def:crs:EPSG::25832; the map's header has an offset"), "{said}");
    }
    assert!(!place.file("fits").exists() && !place.file("moved.geojson").exists());
}

#[test]
fn wrong_input_is_refused_by_flag_and_value() {
    let place = Place::new();
    for (arguments, expected) in [
        (&["--vehicle", "no_such"][..], "vehicle: no_such"),
        (&["--vehicle", "daf_xf", "--load", "wood"], "--load: wood; the vehicle has empty"),
        (&["--vehicle", "daf_xf", "--speed-kmh", "0"], "--speed-kmh: 0 km/h"),
        (&["--vehicle", "daf_xf", "--clearance", "-1"], "--clearance: -1 m"),
        (&["--vehicle", "daf_xf", "--clearance", "nan"], "--clearance"),
        (&["--vehicle", "daf_xf", "--route", "N-left-9"], "--route: N-left-9; the roads have 16m/E-left-2"),
        (&["--vehicle", "daf_xf", "--vehicle", "daf_xf"], "--vehicle: daf_xf; is named twice"),
        (&["--vehicle", "all", "--vehicle", "us_wb67"], "--vehicle: us_wb67; is named twice"),
        (&["--vehicle", "daf_xf", "--ring", "1,2"], "--ring: 1,2; is for an OpenDRIVE map"),
        (&["16m", "--vehicle", "daf_xf"], "ROAD: 16m; is named twice"),
    ] {
        let said = refusal(&fits(&place, arguments), 2);
        assert!(said.contains(expected), "{expected}: {said}");
    }
    // Two pairs of a road and a vehicle whose files would have one name.
    for (from, to) in [("roundabouts/16m", "r"), ("roundabouts/16m", "r-b"), ("vehicles/daf_xf", "c")] {
        let from = repository().join("scenarios").join(format!("{from}.toml"));
        std::fs::copy(from, place.file(&format!("{to}.toml"))).unwrap();
    }
    std::fs::copy(place.file("c.toml"), place.file("b-c.toml")).unwrap();
    let [r, r_b, c, b_c] = ["r.toml", "r-b.toml", "c.toml", "b-c.toml"].map(|name| place.text(name));
    let alike = offtrack(&["fits", &r, &r_b, "--vehicle", &c, "--vehicle", &b_c, "-o", &place.text("none")]);
    let said = refusal(&alike, 2);
    assert!(said.contains("ROAD-VEHICLE: r-b-c; is named twice"), "{said}");
    assert!(refusal(&fits(&place, &["--vehicle", "daf_xf", "--widths", "0"]), 2).contains("--widths"));
    let none = offtrack(&["fits", "16m", "-o", &place.text("none")]);
    assert!(refusal(&none, 2).contains("--vehicle"));
    assert!(!place.file("none").exists());
}

#[test]
fn a_drawing_becomes_a_road_through_which_trucks_are_driven_at_its_place_in_the_drawing() {
    let place = Place::new();
    // What one program writes: kerbs and lanes of 16m.
    succeed(&fits(&place, &EASY));
    let (drawing, road) = (place.text("fits/16m-eu_4x2_13m6.dxf"), place.text("site.outline.toml"));
    let text = std::fs::read_to_string(&drawing).unwrap();
    assert!(text.contains("$INSUNITS"));
    std::fs::write(place.file("no-unit.dxf"), text.replace("$INSUNITS", "$LUNITS")).unwrap();
    let said = refusal(&offtrack(&["import", &place.text("no-unit.dxf"), "-o", &road]), 2);
    assert!(said.contains("--unit m, mm, cm, ft, us-ft or in"), "{said}");
    let output = offtrack(&["import", &drawing, "-o", &road]);
    succeed(&output);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("4 arms, 20 routes") && said.contains("note: "), "{said}");
    let again = place.text("again");
    let arguments = ["fits", &road, "--widths", "64", "-o", &again];
    succeed(&offtrack(&[&arguments[..], &EASY].concat()));
    let clearance = |json: &Value| json["rows"][0]["lane_centre"]["trailer"]["clearance"].as_f64().unwrap();
    let (one, other) = (place.json("fits/fits.json"), place.json("again/fits.json"));
    assert!((clearance(&one) - clearance(&other)).abs() < 2e-3, "{one} {other}");
    for (arguments, expected) in [
        (&[drawing.as_str(), "--list"][..], "--list"),
        (&["scenarios/maps/sumo_ring22.xodr", "--unit", "m", "--list"], "is for a drawing"),
        (&[drawing.as_str(), "--unit", "m", "--lane-width", "0", "-o", road.as_str()], "--lane-width: 0 m"),
        (&[drawing.as_str(), "--unit", "m", "--kerb-layer", "CURB", "-o", road.as_str()], "layer CURB"),
    ] {
        let said = refusal(&offtrack(&[&["import"], arguments].concat()), 2);
        assert!(said.contains(expected), "{expected}: {said}");
    }
}

#[test]
fn where_a_trailer_needs_the_apron_table_files_sheet_and_picture_say_so() {
    let place = Place::new();
    let file = place.file("apron.toml");
    let road = std::fs::read_to_string(repository().join("scenarios/roundabouts/16m.toml")).unwrap();
    std::fs::write(&file, road.replace("[ring]", "[ring]\napron = 3.0")).unwrap();
    let (road, folder, picture) = (place.text("apron.toml"), place.text("fits"), place.text("road.json"));
    let case = ["--vehicle", "eu_4x2_13m6", "--route", "E-left-2"];
    let fits = program().args(["fits", &road, "--widths", "64", "-o", &folder]).args(case).output().unwrap();
    succeed(&fits);
    let said = String::from_utf8(fits.stdout).unwrap();
    assert!(said.contains("lane centre") && said.contains("on apron"), "{said}");
    let json = place.json("fits/fits.json");
    assert!(json["rows"][0]["lane_centre"]["apron_clearance"].as_f64().unwrap() < -0.1, "{json}");
    assert!(json["assumptions"].to_string().contains("trailers may drive on aprons"), "{json}");
    assert!(text(&place, "fits.csv").lines().next().unwrap().contains("lane_centre_apron_clearance"));
    let svg = text(&place, "apron.svg");
    assert!(svg.contains("m past the apron edge") && svg.contains("apron, for trailers alone"), "{}", svg.len());
    assert!(svg.contains("url(#trailer_solids)") && svg.contains("id=\"trailer_solids\""));
    assert!(text(&place, "apron-eu_4x2_13m6.dxf").contains("\nAPRON\n"));
    assert!(text(&place, "apron-eu_4x2_13m6.geojson").contains("\"part\":\"apron\""));
    let draw = ["draw", &road, "-o", &picture, "--speed-kmh", "15"];
    let draw = program().args(draw).args(case).output().unwrap();
    succeed(&draw);
    let said = String::from_utf8(draw.stdout).unwrap();
    assert!(said.contains("its own lane suffices") && said.contains(" m past an apron edge"), "{said}");
    let drawn = place.json("road.json");
    assert_eq!(drawn["aprons"][0].as_array().unwrap().len(), 2);
    assert!(drawn["sweep"]["apron_clearance"].as_f64().unwrap() < -0.1, "{}", drawn["sweep"]);
}

#[test]
fn the_verdicts_in_the_documents_are_those_of_the_program() {
    let place = Place::new();
    let folder = place.text("fits");
    let vehicle = "daf_xf";
    let output = program()
        .current_dir(repository())
        .args(["fits", "50m", "--vehicle", vehicle, "-o", &folder])
        .output()
        .unwrap();
    assert!(matches!(output.status.code(), Some(0 | 1)), "{output:?}");
    let kept = std::fs::read_to_string(repository().join("docs/fits/verdicts.csv")).unwrap();
    let rows: Vec<Vec<&str>> = kept.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!((rows.len(), rows[0].len()), (1 + 95, 1 + 10), "the five study rings, all vehicles");
    let column = rows[0].iter().position(|name| *name == vehicle).unwrap();
    let of_ring =
        rows.iter().filter(|row| row[0].starts_with("50m/")).map(|row| format!("{},{}\n", row[0], row[column]));
    assert_eq!(text(&place, "verdicts.csv"), format!("route,{vehicle}\n") + &of_ring.collect::<String>());
}
