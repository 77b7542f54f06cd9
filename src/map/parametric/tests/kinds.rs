//! Rings of one to three lanes, carriageways of one or two, and how wrong ones are refused.

use super::*;

/// The plain roundabout with a line added to its ring, and others to every entry and every exit.
fn with_lanes(ring: &str, entry: &str, exit: &str) -> String {
    let text = plain().replace("lane_width = 3.7\n", &format!("lane_width = 3.7\n{ring}\n"));
    let text = text.replace("[arm.entry.kerb]", &format!("[arm.entry]\n{entry}\n[arm.entry.kerb]"));
    text.replace("[arm.exit.kerb]", &format!("[arm.exit]\n{exit}\n[arm.exit.kerb]"))
}

fn refusal_of(text: &str) -> String {
    read(text).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn without_a_number_there_are_two_lanes_and_no_more_than_the_ring_has() {
    let n_routes = |text: &str| read(text).unwrap().routes(40.0, 35.0, 2.0).unwrap().len();
    assert_eq!(
        read(&plain()).unwrap().lanes(),
        read(&with_lanes("lanes = 2", "lanes = 2", "lanes = 2")).unwrap().lanes()
    );
    assert_eq!(read(&with_lanes("lanes = 1", "", "")).unwrap().lanes().len(), 1 + 4 + 4);
    assert_eq!(read(&with_lanes("lanes = 3", "", "")).unwrap().lanes().len(), 3 + 8 + 8);
    assert_eq!(n_routes(&with_lanes("lanes = 1", "", "")), 16);
    assert_eq!(n_routes(&with_lanes("lanes = 3", "", "")), 20);
}

#[test]
fn a_wrong_number_of_lanes_is_refused_by_its_key() {
    for (ring, entry, exit, expected) in [
        ("lanes = 0", "", "", "plain: ring.lanes: 0; must lie in 1..3"),
        ("lanes = 4", "", "", "plain: ring.lanes: 4; must lie in 1..3"),
        ("lanes = 3", "lanes = 3", "", "plain: arm[0].entry.lanes: 3; must lie in 1..2"),
        ("", "", "lanes = 0", "plain: arm[0].exit.lanes: 0; must lie in 1..2"),
        (
            "lanes = 1",
            "lanes = 2",
            "",
            "plain: arm[0].entry.lanes: 2; must be at most 1, as many lanes as the ring has",
        ),
        ("lanes = 1", "lanes = 1", "lanes = 2", "plain: arm[0].exit.lanes: 2; must be at most 1"),
    ] {
        let message = refusal_of(&with_lanes(ring, entry, exit));
        assert!(message.starts_with(expected), "{message}");
    }
    for wrong in ["lanes = -1", "lanes = 1.5", "lanes = \"two\""] {
        let message = refusal_of(&with_lanes(wrong, "", ""));
        assert!(message.starts_with("plain: ") && message.contains("lanes"), "{message}");
    }
}

#[test]
fn a_left_lane_on_a_carriageway_of_one_lane_is_refused() {
    let lane = "[arm.entry.left]\npoints = [{ along = 30.0, offset = 2.5 }]\nring_radius = 15.0\n[arm.exit.kerb]";
    let text = with_lanes("", "lanes = 1", "").replacen("[arm.exit]\n\n[arm.exit.kerb]", lane, 1);
    let message = refusal_of(&text);
    assert!(
        message.starts_with("plain: arm[0].entry.left: given; this carriageway has one lane, which is `right`"),
        "{message}"
    );
}

#[test]
fn lanes_of_an_arm_may_be_narrower_than_those_of_the_ring() {
    let narrow = plain().replace("length = 100.0", "length = 100.0\nlane_width = 3.0");
    let roundabout = read(&narrow).unwrap();
    // After the lanes around the ring come the first arm's entry lanes, the left one first.
    let start = |lane: usize| roundabout.lanes()[roundabout.lane_radii().len() + 1 - lane].point_at(0.0);
    // East of the centre an entry lies north of the bearing: 8.5 m less gutter and half a lane, and a lane more.
    assert!((start(0).y - 6.5).abs() < 1e-9 && (start(1).y - 3.5).abs() < 1e-9);
    assert_eq!(roundabout.lane_radii(), read(&plain()).unwrap().lane_radii());
    let message = refusal_of(&narrow.replacen("lane_width = 3.0", "lane_width = 13.0", 1));
    assert!(message.contains("arm[0].lane_width: 13 m; must lie in 2.5..12 m"), "{message}");
}

#[test]
fn the_lane_beside_a_corner_between_arms_of_different_lane_widths_needs_its_radius() {
    let corner = plain().replacen("length = 100.0", "length = 100.0\ncorner = { kerb_radius = 28.0 }", 1);
    assert!(read(&corner).is_ok(), "{}", refusal_of(&corner));
    let differing = corner.replacen("length = 100.0\ncorner", "length = 100.0\nlane_width = 3.5\ncorner", 1);
    let message = refusal_of(&differing);
    let expected =
        "plain: arm[0].corner.lane_radius: missing; lanes are 3.5 m wide on E and 3.7 m on N: give the radius";
    assert!(message.starts_with(expected), "{message}");
    assert!(read(&differing.replacen("kerb_radius = 28.0", "kerb_radius = 28.0, lane_radius = 30.0", 1)).is_ok());
}

#[test]
fn left_lanes_lead_into_an_exit_of_one_lane_or_are_refused_by_name() {
    let one_exit = with_lanes("", "", "lanes = 1");
    let names: Vec<String> =
        read(&one_exit).unwrap().routes(40.0, 35.0, 2.0).unwrap().into_iter().map(|route| route.name).collect();
    assert_eq!(
        names,
        read(&plain())
            .unwrap()
            .routes(40.0, 35.0, 2.0)
            .unwrap()
            .into_iter()
            .map(|route| route.name)
            .collect::<Vec<_>>()
    );
    // The exit's straight misses the inner ring lane, and its wide arc into the outer one is too narrow for a left
    // turn.
    let flared = "points = [{ along = 60.0, offset = -8.5, radius = 30.0 }, { along = 0.0, offset = -22.0 }]\n\
                  ring_radius = 15.0";
    let plain_exit = "points = [{ along = 30.0, offset = -8.5 }]\nring_radius = 15.0";
    let message = refusal_of(&one_exit.replacen(plain_exit, flared, 1).replace("270.0", "260.0"));
    let expected = "plain: arm[0].exit.right.ring_radius: 17.35 m; left lanes lead here by the ring lane of 17.35 m, \
                    and no such arc";
    assert!(message.starts_with(expected), "{message}");
    // Nobody takes that way where all entries have one lane.
    let one_lane = with_lanes("", "lanes = 1", "lanes = 1").replacen(plain_exit, flared, 1).replace("270.0", "260.0");
    assert!(read(&one_lane).is_ok(), "{}", refusal_of(&one_lane));
}

#[test]
fn a_file_with_every_kind_of_lane_is_written_as_it_was_read() {
    let text =
        with_lanes("lanes = 3", "lanes = 1", "lanes = 2").replace("length = 100.0", "length = 100.0\nlane_width = 4.0");
    let written: Written = toml::from_str(&text).unwrap();
    let again = toml::to_string(&written).unwrap();
    assert_eq!(toml::from_str::<Written>(&again).unwrap(), written, "{again}");
    assert!(again.contains("lanes = 3") && again.contains("lane_width = 4.0"), "{again}");
    assert!(!toml::to_string(&toml::from_str::<Written>(&plain()).unwrap()).unwrap().contains("lanes"));
}

proptest! {
    #[test]
    fn two_ring_lanes_lie_where_they_always_lay_to_the_last_bit(
        island in 1.5..200.0, gutter in 0.0..3.0, width in 2.5..8.0,
    ) {
        let ring = Ring { island_radius: island, gutter, lane_width: width, lanes: 2, apron: 0.0 };
        let (inner, half) = (island + gutter + width / 2.0, width / 2.0);
        prop_assert_eq!(ring.outer().to_bits(), (island + 2.0 * (gutter + width)).to_bits());
        prop_assert_eq!([0, 1].map(|lane| ring.lane_radius(lane).to_bits()), [inner + width, inner].map(f64::to_bits));
        prop_assert_eq!(ring.crossing(Lane::Left), (half, half + width));
        prop_assert_eq!(ring.crossing(Lane::Right), (half + width, half));
    }
}

proptest! {
    // Three of four draws are refused.
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn what_is_accepted_has_smooth_routes(
        lanes in (1usize..=3, 1usize..=2, 1usize..=2), island in 1.5..30.0, width in 2.5..12.0, arm_width in 2.5..5.0,
        offset in 4.0f64..12.0, aim in -10.0..25.0, ring_radius in 3.0..60.0,
    ) {
        let kerb = |side: f64| format!(
            "points = [{{ along = 90.0, offset = {:?}, radius = 30.0 }}, {{ along = 0.0, offset = {:?} }}]",
            side * offset, side * aim,
        );
        let [ring, entry, exit] = [lanes.0, lanes.1, lanes.2].map(|lanes| format!("lanes = {lanes}"));
        let text = with_lanes(&ring, &entry, &exit)
            .replace("lane_width = 3.7", &format!("lane_width = {width:?}"))
            .replace("length = 100.0", &format!("length = 200.0\nlane_width = {arm_width:?}"))
            .replace("island_radius = 15.0", &format!("island_radius = {island:?}"))
            .replace("points = [{ along = 30.0, offset = 8.5 }]", &kerb(1.0))
            .replace("points = [{ along = 30.0, offset = -8.5 }]", &kerb(-1.0))
            .replace("ring_radius = 15.0", &format!("ring_radius = {ring_radius:?}"));
        let Ok(roundabout) = read(&text) else { return Err(TestCaseError::reject("refused")) };
        let n_lines = if lanes.1 == 1 { 4 } else { 5 };
        let routes = roundabout.routes(40.0, 35.0, 2.0).unwrap();
        prop_assert_eq!(routes.len(), 4 * n_lines);
        for route in routes {
            for joint in route.centre_line.pieces.windows(2) {
                let turn = crate::geometry::wrapped(joint[1].heading_at(0.0) - joint[0].heading_at(joint[0].length()));
                // Angles are sums of several f64.
                prop_assert!(turn.abs() < 1e-6 && joint[0].end().distance(joint[1].start()) < 1e-6, "{}", route.name);
            }
        }
    }
}
