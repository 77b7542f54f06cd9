//! Gutters that differ, and lanes that follow the ring beside kerbs that do not.

use super::*;

/// The plain roundabout with lines after `gutter` and after every arm's `length`.
fn with(ring: &str, arm: &str) -> String {
    plain()
        .replace("gutter = 0.5\n", &format!("gutter = 0.5\n{ring}"))
        .replace("length = 100.0\n", &format!("length = 100.0\n{arm}"))
}

const SPLITTER: &str = "splitter = [{ along = 30.0, offset = 0.8, radius = 0.3 }, { along = 45.0, offset = 0.0, \
                        radius = 0.2 }, { along = 30.0, offset = -0.8, radius = 0.3 }]\n";

#[test]
fn a_gutter_that_is_written_for_every_kerb_is_the_one_gutter() {
    let one = read(&with("", SPLITTER)).unwrap();
    let each = "splitter_gutter = 0.5\nkerb_gutter = [{ station = 0.0, width = 0.5 }]\n";
    let all =
        read(&with("island_gutter = [{ bearing_deg = 0.0, width = 0.5 }]\n", &format!("{SPLITTER}{each}"))).unwrap();
    assert_eq!(format!("{:?}", one.kerbs(Gutter::Drivable)), format!("{:?}", all.kerbs(Gutter::Drivable)));
    let (one, all) = (one.kerbs(Gutter::Solid), all.kerbs(Gutter::Solid));
    assert_eq!(one.loops.len(), all.loops.len());
    // Arcs are sampled to 1 mm and fitted within 4 mm.
    for p in all.loops.iter().flat_map(|curve| curve.polyline(0.01)) {
        assert!(one.distance(p) < 0.006, "{p}: {}", one.distance(p));
    }
    for p in one.loops.iter().flat_map(|curve| curve.polyline(0.01)) {
        assert!(all.distance(p) < 0.006, "{p}: {}", all.distance(p));
    }
}

#[test]
fn a_road_with_gutters_of_its_own_has_the_same_islands_whatever_its_bearing() {
    // The splitter islands' gutters are 0.1 to 0.4 m wide, those of the kerbs at their ends 0.2 to 0.8 m.
    let corners = "{ along = 28.0, offset = -0.9, radius = 0.31 }, { along = 47.0, offset = 0.05, radius = 0.17 }, \
                   { along = 28.5, offset = 0.8, radius = 0.29 }";
    let text = |turn: u32| {
        let island = [(turn, 0.3), (turn + 180, 0.9)]
            .map(|(bearing, width)| format!("{{ bearing_deg = {bearing}.0, width = {width} }}"));
        let ring = format!("gutter = 0.5\nisland_gutter = [{}]\n", island.join(", "));
        (0..4).fold(with_kerbs_at(9.5).replace("gutter = 0.5\n", &ring), |text, arm| {
            let kerb = format!("[{{ station = 0.0, width = 0.2 }}, {{ station = 60.0, width = 0.{} }}]", 2 * arm + 2);
            let own = format!("splitter = [{corners}]\nsplitter_gutter = 0.{}\nkerb_gutter = {kerb}\n", arm + 1);
            let (before, after) =
                (format!("= {}.0\nlength = 100.0\n", 90 * arm), format!("= {}.0\nlength", 90 * arm + turn));
            assert!(text.contains(&before));
            text.replace(&before, &format!("{after} = 100.0\n{own}"))
        })
    };
    for turn in (0..64).step_by(7) {
        let edges = read(&text(turn)).unwrap().kerbs(Gutter::Solid);
        let areas: Vec<f64> = edges.loops.iter().map(Curve::signed_area).collect();
        assert!(areas.len() == 6 && areas.iter().all(|area| 1.0 < area.abs()), "turned by {turn}: {areas:?}");
    }
}

#[test]
fn each_kerb_has_the_gutter_that_is_written_for_it() {
    let island = "island_gutter = [{ bearing_deg = 0.0, width = 0.0 }, { bearing_deg = 180.0, width = 1.0 }]\n";
    let mouth = "mouth_gutter = [{ bearing_deg = -5.0, width = 0.0 }, { bearing_deg = -4.9, width = 0.5 }, \
                 { bearing_deg = 4.9, width = 0.5 }, { bearing_deg = 5.0, width = 0.0 }]\n";
    let kerb =
        "splitter_gutter = 0.0\nkerb_gutter = [{ station = 20.0, width = 0.2 }, { station = 40.0, width = 0.6 }]\n";
    let roundabout = read(&with(&format!("{island}{mouth}"), &format!("{SPLITTER}{kerb}"))).unwrap();
    assert!(matches!(roundabout.ground().edges, Edges::Own(_)));
    let edges = roundabout.kerbs(Gutter::Solid);
    // From a point on the road towards a face.
    let gap = |p: DVec2, towards: DVec2, face: f64| face - edges.ray(p, towards, 10.0);
    let west = gap(DVec2::new(-18.0, 0.0), DVec2::X, 3.0);
    assert!((west - 1.0).abs() < 0.01, "{west}");
    let north = gap(DVec2::new(0.0, 18.0), DVec2::NEG_Y, 3.0);
    assert!((north - 0.5).abs() < 0.01, "half way between the points: {north}");
    // The kerb north of E: 10, 30 and 50 m from the arm's end.
    for (x, width) in [(90.0, 0.2), (70.0, 0.4), (50.0, 0.6)] {
        let found = gap(DVec2::new(x, 4.0), DVec2::Y, 4.5);
        assert!((found - width).abs() < 0.01, "{x}: {found}");
    }
    // The splitter island has none; the mouth of E has a painted one, that of N has none.
    let splitter = DVec2::new(29.0, 0.0);
    assert!(edges.distance(splitter) < 1.0 + 0.01, "{}", edges.distance(splitter));
    let outer = roundabout.outer_radius();
    assert!(!edges.contains(DVec2::new(outer - 0.25, 0.0)) && edges.contains(DVec2::new(outer + 0.25, 0.0)));
    assert!(edges.contains(DVec2::new(0.0, outer - 0.25)));
}

#[test]
fn gutters_that_make_no_sense_are_refused_with_their_keys() {
    let refused = |ring: &str, arm: &str, expected: &str| {
        let message = read(&with(ring, arm)).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    };
    refused("island_gutter = []\n", "", "ring.island_gutter: 0 points; must lie in 1..64");
    refused(
        "island_gutter = [{ bearing_deg = 0.0, width = 4.0 }]\n",
        "",
        "ring.island_gutter[0].width: 4 m; must lie in 0..3 m",
    );
    let turn = "mouth_gutter = [{ bearing_deg = -10.0, width = 0.0 }, { bearing_deg = 350.0, width = 0.5 }]\n";
    refused(
        turn,
        "",
        "ring.mouth_gutter[1].bearing_deg: 350 deg; must be more than -10 deg and less than a turn after the first",
    );
    let falling = "kerb_gutter = [{ station = 20.0, width = 0.2 }, { station = 20.0, width = 0.6 }]\n";
    refused("", falling, "arm[0].kerb_gutter[1].station: 20 m; must be more than 20 m");
    refused("", "splitter_gutter = 0.0\n", "arm[0].splitter_gutter: given; this arm has no splitter island");
    let wide = "kerb_gutter = [{ station = 0.0, width = 3.0 }]\n";
    let narrow = with("island_gutter = [{ bearing_deg = 0.0, width = 3.0 }]\n", wide)
        .replace("lane_width = 3.7", "lane_width = 2.6");
    let message = read(&narrow.replace("gutter = 0.5\n", "gutter = 0.1\n")).unwrap_err().to_string();
    assert!(message.contains("leave no way around the island"), "{message}");
    refused("", "corner = { lane = \"ring\" }\n", "arm[0].corner.lane: \"ring\"; is for a corner with kerb_radius");
}

#[test]
fn a_lane_can_follow_the_ring_beside_a_kerb_that_does_not() {
    let route = |corner: &str| read(&with("", corner)).unwrap().line("E", Lane::Right, 1).unwrap();
    let (follows, beside) = (route(""), route("corner = { kerb_radius = 40.0 }\n"));
    assert_eq!(route("corner = { kerb_radius = 40.0, lane = \"ring\" }\n"), follows);
    assert_ne!(beside, follows);
}
