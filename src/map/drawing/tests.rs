//! Drawings as other programs write them, and drawings that are refused.

mod parts;
mod unseen;

use std::fmt::Write;
use std::path::Path;

use glam::DVec2;

use super::*;
use crate::geometry::{Curve, Piece};
use crate::map::Road;

const HEADER: &str = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n6\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n";
const END: &str = "0\nENDSEC\n0\nEOF\n";

fn layers() -> Layers {
    Layers {
        kerbs: "KERB".into(),
        lanes: "LANE".into(),
        aprons: "APRON".into(),
        unit: None,
        lane_width: 4.0,
        ring: None,
        arms: Vec::new(),
    }
}

fn read(entities: &str, layers: &Layers) -> Result<Drawn, String> {
    parse(Path::new("site.dxf"), &format!("{HEADER}{entities}{END}"), layers).map_err(|error| error.to_string())
}

/// Where the road of these drawings lies (m).
const AT: DVec2 = DVec2::new(3000.0, -500.0);

/// A curve as a light polyline with bulges, its coordinates divided by `unit`.
fn polyline(layer: &str, curve: &Curve, is_closed: bool, unit: f64) -> String {
    let mut text = format!("0\nLWPOLYLINE\n8\n{layer}\n90\n0\n70\n{}\n", u8::from(is_closed));
    let mut vertex = |p: DVec2, bulge: f64| {
        let p = (AT + p) / unit;
        let _ = write!(text, "10\n{}\n20\n{}\n42\n{bulge}\n", p.x, p.y);
    };
    for piece in &curve.pieces {
        match *piece {
            Piece::Segment { from, .. } => vertex(from, 0.0),
            Piece::Arc { sweep, .. } => {
                // Three parts of a whole circle have bulges below 1.
                for part in 0..3 {
                    vertex(piece.point_at(piece.length() * f64::from(part) / 3.0), (sweep / 12.0).tan());
                }
            }
        }
    }
    if let Some(last) = curve.pieces.last().filter(|_| !is_closed) {
        vertex(last.end(), 0.0);
    }
    text
}

/// The drawing of a road.
fn drawn(road: &Road, unit: f64) -> String {
    let ground = road.ground();
    let kerbs = ground.faces.loops.iter().map(|curve| polyline("KERB", curve, true, unit));
    let lanes = ground.lines.iter().map(|line| polyline("Lane", &line.line, false, unit));
    kerbs.chain(lanes).collect()
}

#[test]
fn a_drawing_of_a_road_is_that_road_within_a_millimetre_at_its_place() {
    for name in ["16m", "20m", "50m"] {
        let road = Road::named(name).unwrap();
        let Drawn { ground, notes } = read(&drawn(&road, 1.0), &layers()).unwrap();
        let own = road.ground();
        assert_eq!(notes, Vec::<String>::new());
        assert!(ground.origin.distance(AT) < 1e-3 && !ground.mirrored, "{name}: {}", ground.origin);
        assert!((ground.island_radius - own.island_radius).abs() < 1e-3);
        // The ring's outer kerb is looked for between the mouths of the arms, which reach into it.
        assert!((ground.outer_radius - own.outer_radius).abs() < 3.0, "{name}: {}", ground.outer_radius);
        let names = |ground: &crate::map::ground::Ground| {
            let name = |line: &crate::map::ground::Line| {
                format!("{}-{}-{}-{}", line.entry, line.lane.name(), line.exit, line.exit_arm)
            };
            ground.lines.iter().map(name).collect::<Vec<_>>()
        };
        assert_eq!(names(&ground).len(), names(own).len());
        for face in &ground.faces.loops {
            for p in face.polyline(0.01) {
                assert!(own.faces.distance(p) < 1e-3, "{name}: {p}");
            }
        }
        for line in &ground.lines {
            assert!(own.lines.iter().any(|other| {
                line.line.polyline(0.5).into_iter().all(|p| other.line.distance(p) < 1e-3)
                    && (line.lane, line.exit) == (other.lane, other.exit)
            }));
        }
        // The outline form keeps it.
        ground.checked_text(Path::new("site.outline.toml"), &[]).unwrap();
    }
}

#[test]
fn feet_are_metres_and_a_drawing_that_does_not_say_its_unit_is_refused_with_the_flag() {
    let road = Road::named("16m").unwrap();
    let feet = Layers { unit: Some(Unit::Foot), ..layers() };
    let Drawn { ground, .. } = read(&drawn(&road, 0.3048), &feet).unwrap();
    assert!((ground.island_radius - road.island_radius()).abs() < 1e-3 && ground.origin.distance(AT) < 1e-3);
    let unknown = HEADER.replace("70\n6\n", "70\n0\n") + &drawn(&road, 1.0) + END;
    let said = parse(Path::new("site.dxf"), &unknown, &layers()).unwrap_err().to_string();
    assert!(said.contains("line 8") && said.contains("--unit m, mm, cm, ft, us-ft or in"), "{said}");
    // A unit that is not read, and one that the flag contradicts.
    let text = |code: &str| HEADER.replace("70\n6\n", &format!("70\n{code}\n")) + &drawn(&road, 1.0) + END;
    let said = parse(Path::new("site.dxf"), &text("14"), &layers()).unwrap_err().to_string();
    assert!(said.contains("14; $INSUNITS is a unit that is not read: scale the drawing to m, mm"), "{said}");
    let metres = Layers { unit: Some(Unit::Metre), ..layers() };
    for (code, expected) in [("6", None), ("0", None), ("14", Some("14, another unit;")), ("4", Some("4, mm;"))] {
        let notes = parse(Path::new("site.dxf"), &text(code), &metres).unwrap().notes;
        let noted = notes.iter().find_map(|note| note.strip_prefix("$INSUNITS is "));
        assert_eq!(noted, expected.map(|said| format!("{said} lengths are taken as m")).as_deref(), "{notes:?}");
    }
    // Metres that are said to be millimetres, and the other way round.
    for (code, drawn) in [("4", drawn(&road, 1.0)), ("6", drawn(&road, 0.001))] {
        let text = HEADER.replace("70\n6\n", &format!("70\n{code}\n")) + &drawn + END;
        let said = parse(Path::new("site.dxf"), &text, &layers()).unwrap_err().to_string();
        assert!(said.contains("site.dxf: kerbs: reach over ") && said.contains("is its unit right?"), "{said}");
    }
    // Feet of surveys, of which 2 millionths more make a metre 500 km from the frame's origin.
    let surveyed = HEADER.replace("70\n6\n", "70\n21\n") + &drawn(&road, 1200.0 / 3937.0) + END;
    let Drawn { ground, .. } = parse(Path::new("site.dxf"), &surveyed, &layers()).unwrap();
    assert!((ground.island_radius - road.island_radius()).abs() < 1e-3 && ground.origin.distance(AT) < 1e-3);
}

#[test]
fn the_mirror_image_of_a_drawing_has_left_hand_traffic_and_is_driven_as_the_road() {
    let road = Road::named("20m").unwrap();
    let mirrored = Road::on("m".into(), crate::map::ground::Ground { mirrored: true, ..road.ground().clone() }).seen();
    let Drawn { ground, notes } = read(&drawn(&mirrored, 1.0), &layers()).unwrap();
    assert!(ground.mirrored && notes.iter().any(|note| note.contains("left-hand")), "{notes:?}");
    assert!(ground.lines.iter().all(|line| {
        road.ground()
            .lines
            .iter()
            .any(|other| line.line.polyline(0.5).into_iter().all(|p| other.line.distance(p) < 1e-3))
    }));
}

#[test]
fn an_apron_is_the_same_by_either_of_its_edges_or_both_and_by_either_as_the_islands_kerb() {
    let road = Road::named("20m").unwrap();
    let island = road.island_radius();
    let [outer, inner] = [island, island - 2.0].map(|radius| Curve::circle(DVec2::ZERO, radius));
    let faces = || road.ground().faces.loops.iter();
    let is_island = |face: &&Curve| (face.point_at(0.0).length() - island).abs() < 1e-6;
    let lanes: String = road.ground().lines.iter().map(|line| polyline("LANE", &line.line, false, 1.0)).collect();
    let others: String =
        faces().filter(|face| !is_island(face)).map(|face| polyline("KERB", face, true, 1.0)).collect();
    let with = |kerb: &Curve, aprons: &[&Curve]| {
        let aprons: String = aprons.iter().map(|apron| polyline("Apron", apron, true, 1.0)).collect();
        read(&(others.clone() + &polyline("KERB", kerb, true, 1.0) + &aprons + &lanes), &layers())
    };
    let drawings: [(&Curve, &[&Curve]); 5] = [
        (&outer, &[&inner]),
        (&outer, &[&outer, &inner]),
        (&inner, &[&outer]),
        (&inner, &[&outer, &inner]),
        (&inner, &[&inner, &outer]),
    ];
    for (index, (kerb, aprons)) in drawings.into_iter().enumerate() {
        let ground = with(kerb, aprons).unwrap().ground;
        assert_eq!((ground.aprons.len(), ground.faces.loops.len()), (1, faces().count()), "{index}");
        assert!((ground.island_radius - island).abs() < 1e-3, "{index}: {}", ground.island_radius);
        assert!(ground.aprons[0].polyline(0.01).into_iter().all(|p| inner.distance(p) < 1e-3), "{index}");
        ground.checked_text(Path::new("site.outline.toml"), &[]).unwrap();
    }
    assert_eq!(with(&outer, &[]).unwrap().ground.aprons, []);
    let [beside, across] = [2.0, 0.7].map(|out| Curve::circle(DVec2::new(out * island, 0.0), 0.5 * island));
    let open = inner.part(0.0, 3.0);
    let open = others.clone() + &polyline("KERB", &outer, true, 1.0) + &polyline("APRON", &open, false, 1.0) + &lanes;
    for (said, expected) in [
        (with(&outer, &[&beside]).unwrap_err(), "layer APRON: in no island; must lie within an island's kerb"),
        (with(&outer, &[&across]).unwrap_err(), "layer APRON: crosses; must not cross or touch a kerb"),
        (with(&outer, &[&inner, &Curve::circle(DVec2::ZERO, 1.0)]).unwrap_err(), "layer APRON: a second one"),
        (read(&open, &layers()).unwrap_err(), "those on layer APRON must be closed"),
    ] {
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn lines_and_arcs_whose_ends_meet_are_joined_and_those_that_do_not_are_refused_by_place() {
    let road = Road::named("16m").unwrap();
    let whole = drawn(&road, 1.0);
    let island = road.ground().island_radius;
    let n = whole.matches("LWPOLYLINE\n8\nKERB").count();
    let parts: Vec<&str> = whole.split("0\nLWPOLYLINE").collect();
    let index = road.ground().faces.loops.iter().position(|curve| {
        curve.pieces.iter().all(|piece| matches!(piece, Piece::Arc { radius, .. } if (radius - island).abs() < 1e-6))
    });
    let without: String = parts
        .iter()
        .enumerate()
        .filter(|(part, _)| Some(part.wrapping_sub(1)) != index)
        .map(|(part, text)| if part == 0 { (*text).to_owned() } else { format!("0\nLWPOLYLINE{text}") })
        .collect();
    assert_eq!(without.matches("LWPOLYLINE\n8\nKERB").count(), n - 1);
    let arc = |from: f64, to: f64| {
        format!("0\nARC\n8\nKERB\n10\n{}\n20\n{}\n40\n{island}\n50\n{from}\n51\n{to}\n", AT.x, AT.y)
    };
    let halves = without.clone() + &arc(10.0, 190.0) + &arc(190.0, 10.0);
    let Drawn { ground, notes } = read(&halves, &layers()).unwrap();
    assert!((ground.island_radius - island).abs() < 1e-3 && notes[0].starts_with("2 open lines"), "{notes:?}");
    let said = read(&(without + &arc(10.0, 180.0)), &layers()).unwrap_err();
    assert!(said.contains("open at (") && said.contains("layer KERB"), "{said}");
}

#[test]
fn drawings_that_would_be_another_road_are_refused_by_line() {
    let road = Road::named("16m").unwrap();
    let whole = drawn(&road, 1.0);
    let refusal = |text: &str, expected: &str| {
        let said = parse(Path::new("site.dxf"), text, &layers()).unwrap_err().to_string();
        assert!(said.contains("line ") && said.contains(expected), "{said}");
    };
    refusal(&format!("{HEADER}{whole}"), "is the file whole?");
    let way = polyline("Lane", &road.ground().lines[0].line, false, 1.0);
    let reversed = polyline("Lane", &road.ground().lines[0].line.reversed(), false, 1.0);
    refusal(&format!("{HEADER}{}{END}", whole.replacen(&way, &reversed, 1)), "reverse it");
    // A bow tie beside the road.
    let vertices = [(60.0, 60.0), (70.0, 70.0), (70.0, 60.0), (60.0, 70.0)];
    let vertices = vertices.map(|(x, y)| format!("10\n{}\n20\n{}\n", AT.x + x, AT.y + y)).concat();
    let bow_tie = format!("0\nLWPOLYLINE\n8\nKERB\n90\n4\n70\n1\n{vertices}");
    refusal(&format!("{HEADER}{whole}{bow_tie}{END}"), "crosses itself at (3065.000, -435.000) m");
    let tilted = format!("0\nCIRCLE\n8\nKERB\n10\n{}\n20\n{}\n40\n3\n230\n0.866\n", AT.x, AT.y);
    refusal(&format!("{HEADER}{whole}{tilted}{END}"), "tilted plane");
}

#[test]
fn an_outline_that_is_drawn_twice_is_left_out_and_said() {
    let road = Road::named("16m").unwrap();
    let whole = drawn(&road, 1.0);
    let again: String = road.ground().faces.loops.iter().map(|curve| polyline("KERB", curve, true, 1.0)).collect();
    let Drawn { ground, notes } = read(&(whole.clone() + &again), &layers()).unwrap();
    assert_eq!(ground.faces, read(&whole, &layers()).unwrap().ground.faces);
    assert!(notes.len() == road.ground().faces.loops.len() && notes[0].contains("is there already"), "{notes:?}");
}

#[test]
fn what_is_neither_a_line_nor_an_arc_is_refused_by_its_line_and_other_layers_are_left_out() {
    let road = drawn(&Road::named("16m").unwrap(), 1.0);
    for (entity, expected) in [
        ("0\nSPLINE\n8\nKERB\n", "convert it to a polyline"),
        ("0\nINSERT\n8\nLANE\n2\nTREE\n", "explode it"),
        ("0\nPOLYLINE\n8\nKERB\n66\n1\n70\n8\n0\nSEQEND\n8\nKERB\n", "plane polyline"),
        ("0\nLINE\n8\nKERB\n10\n1\n20\n1\n11\n1\n21\n1\n230\n-1\n", "extrusion"),
        ("0\nLINE\n8\nKERB\n10\nnan\n20\n1\n11\n1\n21\n1\n", "finite number"),
        ("0\nCIRCLE\n8\nKERB\n10\n0\n20\n0\n40\n0\n", "must be positive"),
    ] {
        let said = read(&(road.clone() + entity), &layers()).unwrap_err();
        assert!(said.contains(expected) && said.contains("line "), "{said}");
        let other = entity.replace("8\nKERB", "8\nTREES").replace("8\nLANE", "8\nTREES");
        let Drawn { notes, .. } = read(&(road.clone() + &other), &layers()).unwrap();
        assert!(notes[0].contains("on 1 other layers"), "{notes:?}");
    }
    let said = read(&road, &Layers { kerbs: "CURB".into(), ..layers() }).unwrap_err();
    assert!(said.contains("layer CURB") && said.contains("KERB ("), "{said}");
    let line = "0\nLINE\n8\nKERB\n10\n1\n20\n1\n11\n2\n21\n1\n";
    let said = read(&(road.clone() + &line.repeat(5000)), &layers()).unwrap_err();
    assert!(said.contains("lines on layer KERB: 5006; must lie in 1..5000"), "{said}");
    let without_lanes: String = road.replace("8\nLane", "8\nElsewhere");
    assert!(read(&without_lanes, &layers()).unwrap_err().contains("layer LANE: empty"));
}

#[test]
fn a_block_with_kerbs_is_refused_on_any_layer_and_at_any_depth_and_other_blocks_are_left_out() {
    let road = drawn(&Road::named("16m").unwrap(), 1.0);
    let line = "0\nLINE\n8\nKerb\n10\n0\n20\n0\n11\n1\n21\n0\n";
    let blocks = format!(
        "0\nSECTION\n2\nBLOCKS\n\
         0\nBLOCK\n8\n0\n2\nOUTER\n0\nINSERT\n8\n0\n2\nINNER\n0\nENDBLK\n\
         0\nBLOCK\n8\n0\n2\nINNER\n{line}0\nENDBLK\n\
         0\nBLOCK\n8\n0\n2\nTREE\n0\nCIRCLE\n8\n0\n40\n1\n0\nENDBLK\n0\nENDSEC\n"
    );
    let with = |name: &str| {
        let text = HEADER.replace("0\nSECTION\n2\nENTITIES\n", &format!("{blocks}0\nSECTION\n2\nENTITIES\n"));
        let insert = format!("0\nINSERT\n8\n0\n2\n{name}\n10\n5\n20\n5\n");
        parse(Path::new("site.dxf"), &(text + &road + &insert + END), &layers()).map_err(|error| error.to_string())
    };
    // Names are the same in capitals.
    for name in ["OUTER", "INNER", "Inner"] {
        let said = with(name).unwrap_err();
        assert!(said.contains(&format!("INSERT of {name}; kerbs, lanes or aprons lie in this block")), "{said}");
    }
    assert_eq!(with("TREE").unwrap().notes, ["1 entities on 1 other layers are left out"]);
}

#[test]
fn what_has_no_outline_and_what_lies_on_paper_is_left_out_and_said() {
    let road = drawn(&Road::named("16m").unwrap(), 1.0);
    let hatch = "0\nHATCH\n8\nKERB\n10\n0\n20\n0\n";
    let text = "0\nTEXT\n8\nLANE\n1\nA 1\n";
    let frame = "0\nLINE\n67\n1\n8\nKERB\n10\n0\n20\n0\n11\n297\n21\n0\n";
    let Drawn { ground, notes } = read(&(road.clone() + hatch + text + hatch + frame), &layers()).unwrap();
    assert_eq!(ground.faces.loops.len(), read(&road, &layers()).unwrap().ground.faces.loops.len());
    let said = "3 entities on these layers that are no outlines are left out: HATCH, TEXT";
    assert_eq!(notes, ["1 entities in paper space are left out", said]);
}

#[test]
fn a_text_cut_anywhere_is_an_error_or_a_road_and_never_a_panic() {
    let text = format!("{HEADER}{}{END}", drawn(&Road::named("16m").unwrap(), 1.0));
    for at in (0..text.len()).step_by(997) {
        let _ = parse(Path::new("site.dxf"), &text[..at], &layers());
    }
    for wrong in ["", "AutoCAD Binary DXF\r\n", "PK\u{3}\u{4}", "1\n2\n", "0\nSECTION\n2\n"] {
        assert!(parse(Path::new("site.dxf"), wrong, &layers()).is_err(), "{wrong}");
    }
}

#[test]
fn given_names_of_arms_go_round_from_east_as_the_road_is_seen_on_either_hand() {
    let road = Road::named("20m").unwrap();
    let mirrored = Road::on("m".into(), crate::map::ground::Ground { mirrored: true, ..road.ground().clone() }).seen();
    let n = road.ground().arms.len();
    let names: Vec<String> = (1..=n).map(|index| format!("A{index}")).collect();
    for (drawing, hand) in [(drawn(&road, 1.0), 1.0), (drawn(&mirrored, 1.0), -1.0)] {
        let Drawn { ground, .. } = read(&drawing, &Layers { arms: names.clone(), ..layers() }).unwrap();
        let bearing = |name: &String| {
            let arm = ground.arms.iter().find(|arm| arm.name == *name).unwrap();
            (hand * arm.bearing + std::f64::consts::FRAC_PI_8).rem_euclid(std::f64::consts::TAU)
        };
        assert!(names.is_sorted_by(|one, other| bearing(one) < bearing(other)), "{:?}", ground.arms);
    }
    for wrong in [vec!["A1".to_owned(); n], vec!["B".to_owned()]] {
        let said = read(&drawn(&road, 1.0), &Layers { arms: wrong, ..layers() }).unwrap_err();
        assert!(said.contains("site.dxf: arms: ["), "{said}");
    }
}

#[test]
fn a_way_leads_from_an_arm_through_the_ring_to_an_arm_and_one_over_a_kerb_is_noted() {
    let road = Road::named("20m").unwrap();
    let whole = drawn(&road, 1.0);
    let line = &road.ground().lines[0].line;
    let outer = Curve::circle(DVec2::ZERO, road.ground().outer_radius + 20.0);
    for (curve, is_closed, said) in [
        (line.part(0.1, 0.5 * line.length()), false, "m from the ring's centre; each way is one line from an arm"),
        (outer.part(0.0, 1.0), false, "beside the ring; each way"),
        (outer.clone(), true, "closed; each way"),
    ] {
        let found = read(&(whole.clone() + &polyline("LANE", &curve, is_closed, 1.0)), &layers()).unwrap_err();
        assert!(found.contains("site.dxf: line ") && found.contains(said), "{found}");
    }
    let dot = "0\nLINE\n8\nKERB\n10\n3030\n20\n-500\n11\n3030.01\n21\n-500\n";
    let notes = read(&(whole.clone() + dot), &layers()).unwrap().notes;
    assert_eq!(notes, ["1 lines on layer KERB that are shorter than 0.02 m are left out"]);
    // Without the ways that leave at an arm that one only enters.
    let ground = road.ground();
    let kerbs = ground.faces.loops.iter().map(|curve| polyline("KERB", curve, true, 1.0));
    let stay =
        ground.lines.iter().filter(|line| line.exit_arm != 0).map(|line| polyline("LANE", &line.line, false, 1.0));
    let notes = read(&kerbs.chain(stay).collect::<String>(), &layers()).unwrap().notes;
    assert_eq!(
        notes,
        [format!("no way ends on arm {}: ends more than 20 deg apart are of two arms", ground.arms[0].name)]
    );
    let across: String = road
        .ground()
        .faces
        .loops
        .iter()
        .map(|curve| polyline("KERB", curve, true, 1.0))
        .chain(road.ground().lines.iter().map(|line| {
            let aside = line.line.pieces.iter().map(|piece| match *piece {
                Piece::Segment { from, to } => Piece::Segment { from: from + DVec2::Y * 3.0, to: to + DVec2::Y * 3.0 },
                Piece::Arc { centre, radius, from, sweep } => {
                    Piece::Arc { centre: centre + DVec2::Y * 3.0, radius, from, sweep }
                }
            });
            polyline("LANE", &Curve { pieces: aside.collect() }, false, 1.0)
        }))
        .collect();
    let notes = read(&across, &layers()).unwrap().notes;
    assert!(notes.iter().any(|note| note.starts_with("line ") && note.contains("m from a kerb at (")), "{notes:?}");
}

#[test]
fn a_drawing_may_begin_with_a_byte_order_mark_and_names_of_layers_may_be_in_the_usual_code_page() {
    let file = Path::new("site.dxf");
    let text = format!("{HEADER}{}{END}", drawn(&Road::named("16m").unwrap(), 1.0));
    assert_eq!(super::text(file, format!("\u{feff}{text}").as_bytes()), text);
    let bytes: Vec<u8> = text.replace("KERB", "Bordüre").chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
    let named = Layers { kerbs: "BORDüRE".into(), ..layers() };
    assert!(std::str::from_utf8(&bytes).is_err() && parse(file, &super::text(file, &bytes), &named).is_ok());
}
