//! Ways and kerbs that are drawn in parts, and what a point chooses.

use std::path::Path;

use glam::DVec2;

use super::{AT, END, HEADER, drawn, layers, polyline, read};
use crate::geometry::{Curve, Piece};
use crate::map::Road;
use crate::map::drawing::{Drawn, Layers, parse};
use crate::map::ground::Ground;

/// These ways of a road, each as these entities, beside all kerbs.
fn with_ways(road: &Road, ways: &[&Curve], entities: impl Fn(&Curve) -> String) -> String {
    let kerbs = road.ground().faces.loops.iter().map(|curve| polyline("KERB", curve, true, 1.0));
    kerbs.chain(ways.iter().map(|way| entities(way))).collect()
}

/// These ways, which share no end of a part, are the same when they are joined of parts.
fn assert_joined(road: &Road, ways: &[&Curve], entities: impl Fn(&Curve) -> String) {
    let whole = read(&with_ways(road, ways, |line| polyline("LANE", line, false, 1.0)), &layers()).unwrap();
    let cut = read(&with_ways(road, ways, entities), &layers()).unwrap();
    assert_eq!((cut.ground.lines.len(), cut.ground.arms.len()), (whole.ground.lines.len(), whole.ground.arms.len()));
    assert!(cut.notes.iter().any(|note| note.contains("lines on layer LANE are joined to ")), "{:?}", cut.notes);
    for (one, other) in cut.ground.lines.iter().zip(&whole.ground.lines) {
        assert!((one.line.length() - other.line.length()).abs() < 1e-6);
    }
}

#[test]
fn ways_in_parts_are_joined_where_one_ends_and_one_begins() {
    let road = Road::named("20m").unwrap();
    // Of each arm's ways the first ones share their way in.
    let ways: Vec<&Curve> = road.ground().lines.iter().step_by(5).map(|line| &line.line).collect();
    assert_joined(&road, &ways, |curve| {
        let length = curve.length() / 3.0;
        // The last one first.
        let part = |k: usize| curve.part(length * k as f64, length * (k + 1) as f64);
        (0..3).rev().map(|k| polyline("LANE", &part(k), false, 1.0)).collect()
    });
}

#[test]
fn an_arc_that_turns_right_is_joined_though_a_file_has_it_counter_clockwise() {
    let road = Road::named("20m").unwrap();
    let turns_right = |piece: &Piece| matches!(piece, Piece::Arc { sweep, .. } if *sweep < 0.0);
    let way = &road.ground().lines[0].line;
    assert!(way.pieces.iter().any(turns_right));
    assert_joined(&road, &[way], |curve| {
        let entity = |piece: &Piece| match *piece {
            Piece::Segment { from, to } => {
                let (from, to) = (AT + from, AT + to);
                format!("0\nLINE\n8\nLANE\n10\n{}\n20\n{}\n11\n{}\n21\n{}\n", from.x, from.y, to.x, to.y)
            }
            Piece::Arc { centre, radius, from, sweep } => {
                let centre = AT + centre;
                let [from, to] = [from + sweep.min(0.0), from + sweep.max(0.0)].map(f64::to_degrees);
                let place = format!("10\n{}\n20\n{}\n40\n{radius}\n50\n{from}\n51\n{to}\n", centre.x, centre.y);
                format!("0\nARC\n8\nLANE\n{place}")
            }
        };
        curve.pieces.iter().map(entity).collect()
    });
}

#[test]
fn a_kerb_in_a_block_is_said_whether_its_own_layer_or_that_of_an_insertion_is_the_kerbs() {
    let road = drawn(&Road::named("16m").unwrap(), 1.0);
    let circle = "0\nCIRCLE\n8\n0\n10\n0\n20\n0\n40\n3\n";
    let blocks = format!(
        "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n8\n0\n2\nINNER\n{circle}0\nENDBLK\n\
         0\nBLOCK\n8\n0\n2\nOUTER\n0\nINSERT\n8\nKERB\n2\nINNER\n0\nENDBLK\n0\nENDSEC\n"
    );
    let text = format!("{blocks}{HEADER}{road}0\nINSERT\n8\n0\n2\nOUTER\n10\n5\n20\n5\n{END}");
    let said = parse(Path::new("site.dxf"), &text, &layers()).unwrap_err().to_string();
    assert!(said.contains("INSERT of OUTER; kerbs, lanes or aprons lie in this block"), "{said}");
}

#[test]
fn a_point_far_from_every_island_chooses_none() {
    let road = drawn(&Road::named("16m").unwrap(), 1.0);
    let near = |x: f64| read(&road, &Layers { ring: Some(AT + DVec2::new(x, 0.0)), ..layers() });
    assert!(near(100.0).is_ok());
    let said = near(5000.0).unwrap_err();
    assert!(
        said.contains("ring: (8000, -500); must be within 100 m of the island; the nearest is at (3000.0"),
        "{said}"
    );
}

#[test]
fn outlines_in_an_island_are_left_out_and_those_around_beside_or_across_the_road_are_refused_by_their_place() {
    let road = Road::named("16m").unwrap();
    let text = drawn(&road, 1.0);
    let circle = |radius: f64, at: DVec2| Curve::circle(at, radius);
    let with = |curve: &Curve| read(&(text.clone() + &polyline("KERB", curve, true, 1.0)), &layers());
    // The back of the central island's kerb.
    let Drawn { ground, notes } = with(&circle(road.island_radius() - 0.3, DVec2::ZERO)).unwrap();
    assert_eq!(ground.faces.loops.len(), road.ground().faces.loops.len());
    assert_eq!(notes.len(), 1);
    assert!(
        notes[0].starts_with("line ") && notes[0].ends_with(": an outline inside an island is left out"),
        "{notes:?}"
    );
    for (curve, said) in [
        (circle(500.0, DVec2::ZERO), "around the road; lies around the outer kerb, line "),
        (circle(2.0, DVec2::new(400.0, 0.0)), "outside; must lie in the outer kerb, line "),
        (circle(1.0, DVec2::new(0.0, road.island_radius())), "crosses another outline; must not cross that of line "),
    ] {
        let message = with(&curve).unwrap_err();
        assert!(message.contains(": line ") && message.contains(said), "{message}");
    }
    // Without the outer kerb, which is the longest.
    let Ground { faces, lines, .. } = road.ground();
    assert!(faces.loops[1..].iter().all(|kerb| kerb.length() < faces.loops[0].length()));
    let kerbs = faces.loops[1..].iter().map(|kerb| polyline("KERB", kerb, true, 1.0));
    let ways = lines.iter().map(|line| polyline("LANE", &line.line, false, 1.0));
    let message = read(&kerbs.chain(ways).collect::<String>(), &layers()).unwrap_err();
    assert!(message.contains("the road's outer kerb is needed"), "{message}");
}
