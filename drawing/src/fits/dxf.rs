//! Swept paths as DXF, to be put back into the drawing that a road is from: in metres, in the frame of its map.
//!
//! Release 12 in ASCII, which every CAD program reads: its names of layers have up to 31 capital letters, digits and
//! `-_$`. Of what that release does not have the unit alone is written: older programs skip it, and a comment says it
//! too.

use std::fmt::Write;

use glam::DVec2;
use offtrack::geometry::{Curve, Piece};
use offtrack::map::{Gutter, Road};
use offtrack::vehicle::swept::{Pose, front_path};

use super::panel::Shown;
use super::stations;

/// Longest name of a route in a layer's: the longest part has 14 characters more.
const LONGEST: usize = 17;
/// Parts of a route's drawing, a layer each, and their colours by AutoCAD's index.
const PARTS: [(&str, u8); 8] = [
    ("SWEPT_TRACTOR", 5),
    ("SWEPT_TRAILER", 30),
    ("FRONT_AXLE", 7),
    ("DRIVE_AXLE", 5),
    ("TRAILER_AXLES", 30),
    ("TRACTOR", 5),
    ("TRAILER", 30),
    ("CLEARANCE", 1),
];
/// Layers of the road itself.
const ROAD: [(&str, u8); 2] = [("KERB", 8), ("LANE", 9)];
const APRON: (&str, u8) = ("APRON", 32);
/// Height of the letters, and radius of the ring around a worst place (m).
const LETTERS: f64 = 0.8;
const RING: f64 = 0.6;

/// The swept paths of one vehicle on a road as it lies in the world, on the layers `ROUTE_PART`, with the road's kerbs
/// and the centre lines of its routes on `KERB` and `LANE`, and the inner edges of aprons on `APRON`, as `offtrack
/// import` reads them.
pub fn dxf(road: &Road, gutter: Gutter, shown: &[&Shown]) -> String {
    let mut drawing = Drawing { text: String::new(), origin: road.ground().origin };
    let mut names: Vec<String> = Vec::new();
    for (index, one) in shown.iter().enumerate() {
        names.push(own_layer(&names, one.row.movement(), index));
    }
    drawing.pair(999, "offtrack fits: lengths in metres");
    let head =
        [(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"), (9, "$INSUNITS"), (70, "6"), (0, "ENDSEC")];
    for (code, value) in head {
        drawing.pair(code, value);
    }
    drawing.layers(&names, road.has_apron());
    drawing.pair(0, "SECTION");
    drawing.pair(2, "ENTITIES");
    for curve in &road.kerbs(gutter).loops {
        drawing.curve("KERB", curve, true);
    }
    for line in &road.ground().lines {
        drawing.curve("LANE", &line.line, false);
    }
    for apron in &road.ground().aprons {
        drawing.curve(APRON.0, apron, true);
    }
    for (one, name) in shown.iter().zip(&names) {
        drawing.path(one, name);
    }
    drawing.pair(0, "ENDSEC");
    drawing.pair(0, "EOF");
    drawing.text
}

/// A route's name as a part of a layer's, unless another has it: layers know no lower case, names of arms do.
fn own_layer(others: &[String], movement: &str, index: usize) -> String {
    let name = layer_name(movement, index);
    if others.contains(&name) { numbered(index) } else { name }
}

/// A route's name as a part of a layer's.
fn layer_name(movement: &str, index: usize) -> String {
    let name = movement.to_ascii_uppercase();
    let is_usual = name.len() <= LONGEST && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
    if is_usual { name } else { numbered(index) }
}

fn numbered(index: usize) -> String {
    format!("ROUTE-{}", index + 1)
}

struct Drawing {
    text: String,
    /// The road's origin in its map (m).
    origin: DVec2,
}

impl Drawing {
    fn pair(&mut self, code: u32, value: impl std::fmt::Display) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{code:>3}\n{value}");
    }

    fn layers(&mut self, names: &[String], has_apron: bool) {
        let of_routes = names.iter().flat_map(|name| PARTS.map(|(part, colour)| (format!("{name}_{part}"), colour)));
        let layers: Vec<(String, u8)> = ROAD
            .into_iter()
            .chain(has_apron.then_some(APRON))
            .map(|(name, colour)| (name.to_owned(), colour))
            .chain(of_routes)
            .collect();
        for (code, value) in [(0, "SECTION"), (2, "TABLES"), (0, "TABLE"), (2, "LTYPE")] {
            self.pair(code, value);
        }
        for (code, value) in [(70, "1"), (0, "LTYPE"), (2, "CONTINUOUS"), (70, "0"), (3, "Solid line"), (72, "65")] {
            self.pair(code, value);
        }
        for (code, value) in [(73, "0"), (40, "0.0"), (0, "ENDTAB"), (0, "TABLE"), (2, "LAYER")] {
            self.pair(code, value);
        }
        self.pair(70, layers.len());
        for (name, colour) in layers {
            self.pair(0, "LAYER");
            self.pair(2, name);
            self.pair(70, 0);
            self.pair(62, colour);
            self.pair(6, "CONTINUOUS");
        }
        self.pair(0, "ENDTAB");
        self.pair(0, "ENDSEC");
    }

    fn path(&mut self, one: &Shown, name: &str) {
        let layer = |part: usize| format!("{name}_{}", PARTS[part].0);
        let units = one.path.corners();
        for (part, polygons) in one.areas().iter().enumerate() {
            for polygon in polygons {
                self.line(&layer(part), polygon, true);
            }
        }
        let poses = &one.path.poses;
        let points = |of: fn(&Pose) -> DVec2| poses.iter().map(of).collect::<Vec<_>>();
        self.line(&layer(2), &front_path(&one.path.rig, poses), false);
        self.line(&layer(3), &points(|pose| pose.position), false);
        self.line(&layer(4), &points(|pose| pose.trailer_position), false);
        for (index, _) in stations(poses) {
            self.line(&layer(5), &units[0][index], true);
            self.line(&layer(6), &units[1][index], true);
        }
        let (unit, nearest) = one.row.shown().nearest();
        let at = DVec2::new(nearest.x, nearest.y) - self.origin;
        self.pair(0, "CIRCLE");
        self.pair(8, layer(7));
        self.point(at);
        self.pair(40, RING);
        self.pair(0, "TEXT");
        self.pair(8, layer(7));
        self.point(at + DVec2::new(1.5 * RING, 0.0));
        self.pair(40, LETTERS);
        self.pair(1, format_args!("{unit} {:.2} m", nearest.clearance));
    }

    fn point(&mut self, p: DVec2) {
        let p = self.origin + p;
        self.pair(10, format_args!("{:.4}", p.x));
        self.pair(20, format_args!("{:.4}", p.y));
        self.pair(30, "0.0");
    }

    fn line(&mut self, layer: &str, points: &[DVec2], is_closed: bool) {
        let vertices: Vec<(DVec2, f64)> = points.iter().map(|&p| (p, 0.0)).collect();
        self.polyline(layer, &vertices, is_closed);
    }

    /// A curve whose arcs stay arcs.
    fn curve(&mut self, layer: &str, curve: &Curve, is_closed: bool) {
        let mut vertices = Vec::new();
        for piece in &curve.pieces {
            // A bulge of 1 is half a circle: longer arcs are cut.
            let parts = match piece {
                Piece::Arc { sweep, .. } => (sweep.abs() / 2.0).ceil().max(1.0),
                Piece::Segment { .. } => 1.0,
            };
            let bulge = match piece {
                Piece::Arc { sweep, .. } => (sweep / parts / 4.0).tan(),
                Piece::Segment { .. } => 0.0,
            };
            let of = |part: usize| (piece.point_at(piece.length() * part as f64 / parts), bulge);
            vertices.extend((0..parts as usize).map(of));
        }
        if let Some(last) = curve.pieces.last().filter(|_| !is_closed) {
            vertices.push((last.end(), 0.0));
        }
        self.polyline(layer, &vertices, is_closed);
    }

    /// A polyline of vertices, each with the bulge of the arc that leads to the next.
    fn polyline(&mut self, layer: &str, vertices: &[(DVec2, f64)], is_closed: bool) {
        self.pair(0, "POLYLINE");
        self.pair(8, layer);
        self.pair(66, 1);
        self.pair(70, u8::from(is_closed));
        for code in [10, 20, 30] {
            self.pair(code, "0.0");
        }
        for &(p, bulge) in vertices {
            self.pair(0, "VERTEX");
            self.pair(8, layer);
            self.point(p);
            if bulge != 0.0 {
                self.pair(42, format_args!("{bulge:.9}"));
            }
        }
        self.pair(0, "SEQEND");
        self.pair(8, layer);
    }
}

#[cfg(test)]
mod tests {
    use offtrack::map::drawing::{Layers, read};
    use offtrack::map::ground::Ground;

    use super::super::geojson;
    use super::*;

    #[test]
    fn kerbs_are_written_in_the_maps_frame_with_their_arcs_as_bulges() {
        let road = Road::named("16m").unwrap();
        let origin = DVec2::new(500_000.0, 4_000_000.0);
        let moved = Road::on("moved".into(), Ground { origin, ..road.ground().clone() });
        let text = dxf(&moved, Gutter::Drivable, &[]);
        let lines: Vec<&str> = text.lines().map(str::trim).collect();
        let pairs: Vec<(&str, &str)> = lines.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
        assert_eq!((lines.len() % 2, pairs.last()), (0, Some(&("0", "EOF"))));
        let kerbs = &road.kerbs(Gutter::Drivable).loops;
        let n_polylines = pairs.iter().filter(|pair| **pair == ("0", "POLYLINE")).count();
        assert_eq!(n_polylines, kerbs.len() + road.ground().lines.len());
        let n_arcs = kerbs[0].pieces.iter().filter(|piece| matches!(piece, Piece::Arc { .. })).count();
        let first = &pairs[..pairs.iter().position(|pair| *pair == ("0", "SEQEND")).unwrap()];
        assert!(n_arcs <= first.iter().filter(|(code, _)| *code == "42").count());
        let start = origin + kerbs[0].point_at(0.0);
        let vertex = first.iter().position(|pair| *pair == ("0", "VERTEX")).unwrap();
        let of =
            |code: &str| first[vertex..].iter().find(|(other, _)| *other == code).unwrap().1.parse::<f64>().unwrap();
        assert!(start.distance(DVec2::new(of("10"), of("20"))) < 1e-3, "{start}");
    }

    #[test]
    fn what_is_written_is_read_as_the_same_road_within_a_millimetre() {
        let road = Road::named("20m").unwrap();
        let origin = DVec2::new(-1234.5, 987.25);
        let moved = Road::on("moved".into(), Ground { origin, ..road.ground().clone() });
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("road.dxf");
        std::fs::write(&file, dxf(&moved, Gutter::Drivable, &[])).unwrap();
        let found = read(&file, &layers()).unwrap().ground;
        assert!(found.origin.distance(origin) < 1e-3 && found.lines.len() == road.ground().lines.len());
        for p in found.faces.loops.iter().flat_map(|curve| curve.polyline(0.01)) {
            assert!(road.ground().faces.distance(p) < 1e-3, "{p}");
        }
    }

    #[test]
    fn an_apron_is_written_on_a_layer_of_its_own_and_read_back_within_a_millimetre() {
        let text = include_str!("../../../scenarios/roundabouts/20m.toml").replace("[ring]", "[ring]\napron = 2.0");
        let road = Road::from_toml("apron", &text).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let crs = Some("EPSG:25832");
        for (name, text) in [
            ("road.dxf", dxf(&road, Gutter::Drivable, &[])),
            ("road.geojson", geojson(&road, Gutter::Drivable, &[], crs).unwrap()),
        ] {
            let file = folder.path().join(name);
            std::fs::write(&file, &text).unwrap();
            let found = read(&file, &layers()).unwrap().ground;
            assert!(found.aprons.len() == 1 && text.to_lowercase().contains("apron"), "{name}");
            let radius = road.island_radius() - 2.0;
            for p in found.aprons[0].polyline(0.01) {
                assert!((p.length() - radius).abs() < 2e-3, "{name}: {p}");
            }
            assert!((found.island_radius - road.island_radius()).abs() < 2e-3, "{name}");
        }
        assert!(!dxf(&Road::named("20m").unwrap(), Gutter::Drivable, &[]).contains("APRON"));
    }

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

    #[test]
    fn a_route_whose_name_no_layer_may_have_is_numbered() {
        assert_eq!(layer_name("N-left-3", 0), "N-LEFT-3");
        for name in ["a-very-long-arm-name-left-3", "Nörd-left-1"] {
            assert_eq!(layer_name(name, 4), "ROUTE-5");
        }
        let mut names = Vec::new();
        for (index, name) in ["N-left-1", "n-left-1", "E-left-1"].into_iter().enumerate() {
            names.push(own_layer(&names, name, index));
        }
        assert_eq!(names, ["N-LEFT-1", "ROUTE-2", "E-LEFT-1"]);
        let longest = PARTS.iter().map(|(part, _)| part.len()).max().unwrap();
        assert_eq!(LONGEST + 1 + longest, 31);
    }
}
