//! What is drawn and not seen, names of layers, degrees, and ends of arms.

use super::*;

/// A circle on the road, on a layer, with further pairs of a code and a value.
fn circle(layer: &str, pairs: &str) -> String {
    format!("0\nCIRCLE\n8\n{layer}\n{pairs}10\n{}\n20\n{}\n40\n1\n", AT.x, AT.y + 13.0)
}

/// The drawing with a table of layers, each with its pairs of a code and a value.
fn with_layers(entities: &str, layers: &[(&str, &str)]) -> String {
    let layer = |(name, pairs): &(&str, &str)| format!("0\nLAYER\n2\n{name}\n{pairs}");
    let table: String = layers.iter().map(layer).collect();
    let table = format!("0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n70\n9\n{table}0\nENDTAB\n0\nENDSEC\n");
    HEADER.replace("0\nSECTION\n2\nENTITIES\n", &format!("{table}0\nSECTION\n2\nENTITIES\n")) + entities + END
}

#[test]
fn what_is_invisible_or_on_a_layer_that_is_off_or_frozen_is_left_out_and_said() {
    let road = drawn(&Road::named("16m").unwrap(), 1.0);
    let whole = read(&road, &layers()).unwrap();
    assert_eq!(read(&(road.clone() + &circle("KERB", "")), &layers()).unwrap().ground.faces.loops.len(), 7);
    let Drawn { ground, notes } = read(&(road.clone() + &circle("KERB", "60\n1\n")), &layers()).unwrap();
    assert_eq!(ground.faces.loops.len(), whole.ground.faces.loops.len());
    let said = "entities on these layers that are invisible, or whose layer is off or frozen, are left out";
    assert_eq!(notes, [format!("1 {said}")]);
    let aprons = road.clone() + &circle("Apron", "");
    let parsed = |text: &str| parse(Path::new("site.dxf"), text, &layers()).map_err(|error| error.to_string());
    assert!(parsed(&with_layers(&aprons, &[("APRON", "70\n0\n62\n7\n")])).unwrap_err().contains("APRON"));
    for pairs in ["70\n0\n62\n-7\n", "70\n1\n62\n7\n", "70\n5\n62\n7\n"] {
        assert_eq!(parsed(&with_layers(&aprons, &[("APRON", pairs)])).unwrap().notes, [format!("1 {said}")]);
    }
    let refused = parsed(&with_layers(&road, &[("KERB", "70\n1\n62\n7\n")])).unwrap_err();
    assert!(refused.contains("layer KERB: empty") && refused.contains("off, frozen or invisible"), "{refused}");
}

#[test]
fn names_of_layers_are_the_same_in_capitals_whatever_their_letters() {
    let road = drawn(&Road::named("16m").unwrap(), 1.0).replace("KERB", "BORD\u{dc}RE");
    assert!(read(&road, &Layers { kerbs: "Bord\u{fc}re".into(), ..layers() }).is_ok());
}

#[test]
fn kerbs_in_degrees_are_told_by_their_coordinates_on_either_side_of_the_meridian_of_180_degrees() {
    let refused = |west: f64, unit: Option<Unit>| {
        let ring = [(0.0, 0.0), (0.002, 0.0), (0.002, 0.001), (0.0, 0.001), (0.0, 0.0)].map(|(x, y)| {
            let x: f64 = west + x;
            [if 180.0 < x { x - 360.0 } else { x }, -17.0 + y]
        });
        let geometry = serde_json::json!({"type": "Polygon", "coordinates": [ring]});
        let kerb = serde_json::json!({"type": "Feature", "properties": {"part": "KERB"}, "geometry": geometry});
        let text = serde_json::json!({"type": "FeatureCollection", "features": [kerb]}).to_string();
        parse(Path::new("site.geojson"), &text, &Layers { unit, ..layers() }).unwrap_err().to_string()
    };
    for (west, unit) in [(179.999, None), (12.0, None), (179.999, Some(Unit::Foot))] {
        let said = refused(west, unit);
        let expected = "kerbs: reach over 0.002000 by 0.001000; coordinates must be metres, not degrees";
        assert!(said.contains(expected), "{west}: {said}");
    }
}

#[test]
fn an_arm_just_below_360_degrees_comes_first_and_is_written_as_0() {
    let road = Road::named("16m").unwrap();
    let turn = |by: f64| {
        let faces = road.ground().faces.loops.iter().map(move |curve| polyline("KERB", &curve.turned(by), true, 1.0));
        let lines = road.ground().lines.iter().map(move |line| polyline("LANE", &line.line.turned(by), false, 1.0));
        read(&faces.chain(lines).collect::<String>(), &layers()).unwrap().ground
    };
    let east = turn(0.0).arms.iter().find(|arm| arm.name == "E").unwrap().bearing;
    for by in [-0.001, 0.0, 0.001] {
        assert_eq!(turn(by - east).arms[0].name, "E", "{by}");
    }
    let text = turn(-1e-7 - east).text(&[]);
    assert!(text.contains("bearing_deg = 0.0\n") && !text.contains("360.0"), "{text}");
}

#[test]
fn an_arm_whose_lines_end_near_the_ring_is_noted() {
    let road = Road::named("16m").unwrap();
    let ground = road.ground();
    let outer = read(&drawn(&road, 1.0), &layers()).unwrap().ground.outer_radius;
    let short = |line: &crate::map::ground::Line| {
        let length = line.line.length();
        let near = (0..10_000).map(|step| f64::from(step) * 0.01);
        let from = near.take_while(|&s| outer + 5.0 < line.line.point_at(s).length()).last().unwrap_or(0.0);
        polyline("LANE", &line.line.part(if line.entry == 0 { from } else { 0.0 }, length), false, 1.0)
    };
    let kerbs = ground.faces.loops.iter().map(|curve| polyline("KERB", curve, true, 1.0));
    let Drawn { notes, .. } =
        read(&kerbs.chain(ground.lines.iter().map(short)).collect::<String>(), &layers()).unwrap();
    let name = &ground.arms[0].name;
    assert_eq!(notes, [format!("arm {name}: its lines end 5 m from the ring; trucks need 23 m or more")]);
}
