//! Which roundabout files are accepted, and how the others are refused.

mod gutters;
mod kinds;

use proptest::prelude::*;

use super::*;
use crate::map::route::Lane;
use crate::map::{Gutter, Kerb};

/// A roundabout with four straight arms and only the required keys.
fn plain() -> String {
    let mut text = String::from("[ring]\nisland_radius = 15.0\ngutter = 0.5\nlane_width = 3.7\n");
    for (index, name) in ["E", "N", "W", "S"].iter().enumerate() {
        text += &format!("\n[[arm]]\nname = \"{name}\"\nbearing_deg = {:.1}\nlength = 100.0\n", index as f64 * 90.0);
        for (way, offset) in [("entry", 8.5), ("exit", -8.5)] {
            text +=
                &format!("[arm.{way}.kerb]\npoints = [{{ along = 30.0, offset = {offset} }}]\nring_radius = 15.0\n");
        }
    }
    text
}

fn read(text: &str) -> Result<Road, Error> {
    Road::from_toml("plain", text)
}

/// The message for the plain roundabout with its `nth` occurrence of `from` replaced.
fn refusal(from: &str, nth: usize, to: &str) -> String {
    let text = plain();
    let (at, _) = text.match_indices(from).nth(nth).unwrap();
    let changed = format!("{}{to}{}", &text[..at], &text[at + from.len()..]);
    read(&changed).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn the_required_keys_give_a_roundabout_with_lanes_beside_its_kerbs() {
    let roundabout = read(&plain()).unwrap();
    let kerbs = roundabout.kerbs(Gutter::Drivable);
    // After the lanes around the ring come the first arm's entry lanes, the left one first.
    let right = roundabout.lanes()[roundabout.lane_radii().len() + 1].clone();
    // From the arm's solid end on, the lane's middle keeps half a lane and the gutter from the kerb all the way.
    for step in 12..(right.length() * 4.0) as usize {
        assert!((kerbs.distance(right.point_at(step as f64 / 4.0)) - 2.35).abs() < 1e-9);
    }
    assert_eq!(kerbs.loops.len(), 2);
}

/// A ring of 12 m with two lanes of 2.5 m and two arms whose kerbs lie this far from their bearings (m).
fn narrow(offset: f64) -> Result<Road, Error> {
    let mut text = String::from("[ring]\nisland_radius = 12.0\ngutter = 0.5\nlane_width = 2.5\nlanes = 2\n");
    for (name, bearing) in [("E", 0.0), ("W", 180.0)] {
        text += &format!("\n[[arm]]\nname = \"{name}\"\nbearing_deg = {bearing:.1}\nlength = 150.0\n");
        for (way, side) in [("entry", 1.0), ("exit", -1.0)] {
            let point = format!("{{ along = 60.0, offset = {:.1} }}", side * offset);
            text += &format!("[arm.{way}]\nlanes = 2\n[arm.{way}.kerb]\npoints = [{point}]\nring_radius = 20.0\n");
        }
    }
    Road::from_toml("narrow", &text)
}

#[test]
fn lanes_may_be_as_narrow_as_the_least_width() {
    for offset in [16.0, 16.3, 16.5, 17.0] {
        assert!(narrow(offset).is_ok(), "{offset}: {}", narrow(offset).unwrap_err());
    }
}

#[test]
fn a_kerb_that_passes_the_ring_by_is_refused_for_its_way_into_it() {
    let message = narrow(20.0).unwrap_err().to_string();
    assert!(message.contains("kerb.ring_radius: 20 m; no such arc leads the last straight into the ring"), "{message}");
}

#[test]
fn every_entry_has_five_routes_with_names() {
    let names: Vec<String> =
        read(&plain()).unwrap().routes(40.0, 35.0, 2.0).unwrap().into_iter().map(|route| route.name).collect();
    let of_north: Vec<&str> = names
        .iter()
        .filter_map(|name| name.split_once('/'))
        .map(|(_, way)| way)
        .filter(|way| way.starts_with("N-"))
        .collect();
    assert_eq!(of_north, ["N-left-2", "N-left-3", "N-left-4", "N-right-1", "N-right-2"]);
    assert_eq!(names.len(), 20);
}

#[test]
fn three_arms_give_the_left_lane_all_three_exits() {
    assert_eq!(
        lane::exits(3, 2),
        [(Lane::Left, 1), (Lane::Left, 2), (Lane::Left, 3), (Lane::Right, 1), (Lane::Right, 2)]
    );
}

#[test]
fn a_route_has_the_requested_approach_and_departure() {
    let roundabout = read(&plain()).unwrap();
    let outer = roundabout.outer_radius();
    for route in roundabout.routes(40.0, 35.0, 2.0).unwrap() {
        let (reaches, leaves) = lane::ring_stations(&route.centre_line, outer);
        assert!(
            (reaches - 40.0).abs() < 1e-6 && (route.centre_line.length() - leaves - 35.0).abs() < 1e-6,
            "{}",
            route.name
        );
    }
}

#[test]
fn the_kerb_nearest_to_a_point_is_named() {
    // Splitter islands on the arms N and S, the second and the fourth.
    let corners = [(24.0, -0.6), (34.0, 0.0), (24.0, 0.6)]
        .map(|(a, o)| format!("{{ along = {a:.1}, offset = {o:.1}, radius = 0.3 }}"));
    let splitter = format!("length = 100.0\nsplitter = [{}]", corners.join(", "));
    let text = plain();
    let mut arms: Vec<String> = text.split("length = 100.0").map(str::to_owned).collect();
    let rest = arms.split_off(1);
    let filled = rest.iter().enumerate().map(|(index, part)| {
        if index % 2 == 1 { format!("{splitter}{part}") } else { format!("length = 100.0{part}") }
    });
    let roundabout = read(&(arms.concat() + &filled.collect::<String>())).unwrap();
    for (x, y, kerb) in [
        (14.0, 0.0, Kerb::Island),
        (0.0, 16.0, Kerb::Island),
        (18.0, 18.0, Kerb::Outer),
        (50.0, 8.0, Kerb::Outer),
        (0.0, 25.5, Kerb::Splitter(1)),
        (0.5, -25.5, Kerb::Splitter(3)),
    ] {
        assert_eq!(roundabout.nearest_kerb(DVec2::new(x, y)), kerb, "({x}, {y})");
    }
}

#[test]
fn a_routes_lane_has_the_widths_of_its_arms_and_of_the_ring() {
    let text = plain()
        .replace("name = \"N\"", "name = \"N\"\nlane_width = 3.5")
        .replace("name = \"W\"", "name = \"W\"\nlane_width = 3.6");
    let roundabout = read(&text).unwrap();
    let routes = roundabout.routes(40.0, 35.0, 2.0).unwrap();
    let widths =
        |name: &str| roundabout.lane_widths(routes.iter().find(|route| route.name == format!("plain/{name}")).unwrap());
    assert_eq!(widths("N-right-1"), [3.5, 3.7, 3.6]);
    assert_eq!(widths("E-left-4"), [3.7, 3.7, 3.7]);
    assert_eq!(widths("W-left-3"), [3.6, 3.7, 3.5]);
}

#[test]
fn an_approach_longer_than_the_arm_is_refused_with_the_longest_that_fits() {
    let roundabout = read(&plain()).unwrap();
    let refused = roundabout.routes(300.0, 35.0, 2.0).unwrap_err();
    assert_eq!((refused.part, refused.asked), ("approach", 300.0));
    assert!(roundabout.routes(refused.longest - 1e-6, 35.0, 2.0).is_ok());
}

#[test]
fn unknown_and_missing_keys_are_refused() {
    assert!(refusal("gutter = 0.5", 0, "guter = 0.5").contains("guter"));
    assert!(refusal("ring_radius = 15.0", 0, "").contains("ring_radius"));
}

#[test]
fn an_apron_lies_within_its_island_and_one_that_leaves_less_than_half_a_metre_is_refused_by_its_key() {
    let apron = |width: &str| plain().replace("gutter = 0.5", &format!("gutter = 0.5\napron = {width}"));
    let road = read(&apron("14.5")).unwrap();
    let [drivable, solid] = [Gutter::Drivable, Gutter::Solid].map(|gutter| {
        let kerbs = road.unit_kerbs(gutter);
        assert_eq!(kerbs.both().map(|outline| outline.loops.len()), [2; 2]);
        kerbs.both().map(|outline| outline.signed_distance(DVec2::new(3.0, 0.0)))
    });
    assert!(drivable[0] < -11.9 && solid[0] < -12.4);
    assert!((drivable[1] - 2.5).abs() < 1e-9 && (solid[1] - 2.5).abs() < 1e-9);
    assert_eq!(road.kerbs(Gutter::Drivable), read(&plain()).unwrap().kerbs(Gutter::Drivable));
    assert!(road.has_apron() && !read(&apron("0.0")).unwrap().has_apron());
    for (width, said) in [("14.51", "14.51 m"), ("-0.1", "-0.1 m"), ("nan", "NaN m")] {
        let message = read(&apron(width)).unwrap_err().to_string();
        assert!(message.contains(&format!("ring.apron: {said}; must lie in 0..14.5 m")), "{message}");
    }
    let written: Written = toml::from_str(&apron("2.5")).unwrap();
    assert_eq!(toml::from_str::<Written>(&written.to_string()).unwrap(), written);
    assert!(written.to_string().contains("apron = 2.5"));
}

#[test]
fn values_out_of_range_are_refused_by_their_key() {
    for (from, nth, to, expected) in [
        ("island_radius = 15.0", 0, "island_radius = 0.0", "ring.island_radius: 0 m; must lie in 1.5..200 m"),
        ("island_radius = 15.0", 0, "island_radius = nan", "ring.island_radius: NaN m"),
        ("island_radius = 15.0", 0, "island_radius = -3.0", "ring.island_radius: -3 m"),
        ("ring_radius = 15.0", 3, "ring_radius = inf", "arm[1].exit.kerb.ring_radius: inf m"),
        ("length = 100.0", 2, "length = 12.0", "arm[2].length: 12 m"),
        ("offset = 8.5", 1, "offset = 1e300", "arm[1].entry.kerb.points[0].offset"),
        ("bearing_deg = 90.0", 0, "bearing_deg = 190.0", "counter-clockwise"),
        ("name = \"N\"", 0, "name = \"E\"", "arm[1].name: E; arm[0] has this name already"),
        ("name = \"N\"", 0, "name = \"N/1\"", "arm[1].name"),
    ] {
        let message = refusal(from, nth, to);
        assert!(message.contains(expected), "{to}: {message}");
    }
}

#[test]
fn an_island_too_large_for_the_arms_is_refused() {
    // Grown to 60 m the ring swallows most of the 100 m arms, yet they still fit; at 95 m they do not.
    assert!(refusal("island_radius = 15.0", 0, "island_radius = 95.0").contains("arm[0].length"));
}

#[test]
fn nine_arms_are_too_many() {
    let arm = &plain()[plain().find("[[arm]]").unwrap()..];
    let text = plain() + "\n" + arm + "\n" + arm;
    assert!(read(&text).map(|_| ()).unwrap_err().to_string().contains("arm: 12 tables; must lie in 2..8"));
}

#[test]
fn an_arc_that_does_not_fit_is_refused_with_the_largest_that_does() {
    let bent = "points = [{ along = 60.0, offset = 8.5, radius = 2000.0 }, { along = 40.0, offset = 11.0 }]";
    let point = "points = [{ along = 30.0, offset = 8.5 }]";
    let message = refusal(point, 1, &bent.replace("2000.0", "900.0"));
    assert!(message.contains("arm[1].entry.kerb.points[0].radius: 900 m; does not fit"), "{message}");
    assert!(refusal(point, 1, bent).contains("must lie in 0..1000 m"));
}

#[test]
fn arms_that_overlap_are_named() {
    let message = refusal("bearing_deg = 90.0", 0, "bearing_deg = 20.0");
    assert!(message.contains("arms E and N overlap"), "{message}");
}

#[test]
fn a_splitter_on_a_lane_or_in_the_ring_is_refused() {
    let splitter = |along: f64, offset: f64| {
        let corner = |a: f64, o: f64| format!("{{ along = {}, offset = {}, radius = 0.3 }}", along + a, offset + o);
        format!("length = 100.0\nsplitter = [{}, {}, {}]", corner(0.0, -0.6), corner(6.0, 0.0), corner(0.0, 0.6))
    };
    assert!(refusal("length = 100.0", 0, &splitter(20.0, 0.0)).contains("arm[0].splitter: "));
    assert!(refusal("length = 100.0", 0, &splitter(30.0, 2.0)).contains("arm[0].entry.left: "));
    assert!(refusal("length = 100.0", 0, &splitter(30.0, 8.5)).contains("meets a kerb"));
}

#[test]
fn a_splitter_is_one_whatever_its_arms_bearing() {
    let [near, far] = [(28.0, 0.8, 0.5), (45.0, 0.0, 0.3)];
    let corner = |(along, offset, radius): (f64, f64, f64), side: f64| {
        format!("{{ along = {along:.1}, offset = {:.1}, radius = {radius} }}", side * offset)
    };
    let corners = [corner(near, -1.0), corner(far, 1.0), corner(near, 1.0)].join(", ");
    let text = with_kerbs_at(9.5).replace("length = 100.0", &format!("length = 100.0\nsplitter = [{corners}]"));
    for turn in 0..12 {
        let turned = |text: String, bearing: u32| {
            let there = format!("bearing_deg = {bearing}.0\n");
            assert!(text.contains(&there));
            text.replace(&there, &format!("bearing_deg = {bearing}.{:02}\n", 8 * turn))
        };
        let text = [0, 90, 180, 270].into_iter().fold(text.clone(), turned);
        assert_eq!(read(&text).map(|_| ()).map_err(|error| error.to_string()), Ok(()));
    }
}

#[test]
fn a_lane_that_runs_into_a_kerb_is_refused() {
    let lane = "[arm.entry.right]\npoints = [{ along = 30.0, offset = 8.0 }]\nring_radius = 15.0\n[arm.exit.kerb]";
    assert!(refusal("[arm.exit.kerb]", 0, lane).contains("arm[0].entry.right: "));
}

/// The plain roundabout with `offset` in place of the offset of every kerb.
fn with_kerbs_at(offset: f64) -> String {
    plain()
        .replace("offset = 8.5", &format!("offset = {offset}"))
        .replace("offset = -8.5", &format!("offset = -{offset}"))
}

#[test]
fn kerbs_too_near_to_each_other_for_four_lanes_are_refused() {
    // At 4.5 m the left lanes lie 1.55 m beyond the middle of the arm, each on the other's carriageway.
    let message = read(&with_kerbs_at(4.5)).unwrap_err().to_string();
    let expected = "plain: arm[0].entry.left: -1.55 m left of the bearing at the arm's end; must lie at least 2.5 m \
                    left of exit.left, which is at 1.55 m";
    assert!(message.contains(expected), "{message}");
    // The left lanes' centre lines are twice (offset - gutter - 1.5 lanes) apart.
    assert!(read(&with_kerbs_at(7.29)).unwrap_err().to_string().contains("arm[0].entry.left"));
    assert!(read(&with_kerbs_at(7.31)).is_ok());
}

#[test]
fn lanes_of_one_carriageway_in_the_wrong_order_are_refused() {
    let lane = |name: &str, offset: f64| {
        format!("[arm.entry.{name}]\npoints = [{{ along = 30.0, offset = {offset} }}]\nring_radius = 15.0\n")
    };
    let swapped = lane("left", 6.15) + &lane("right", 2.45) + "[arm.exit.kerb]";
    assert!(refusal("[arm.exit.kerb]", 0, &swapped).contains("arm[0].entry.right: 2.45 m left of the bearing"));
}

#[test]
fn a_lane_that_crosses_the_oncoming_one_on_the_way_is_refused() {
    // In order at the arm's end, then over to the other carriageway.
    let points = "points = [{ along = 70.0, offset = 2.45, radius = 20.0 }, { along = 40.0, offset = -3.0 }]";
    let lane = format!("[arm.entry.left]\n{points}\nring_radius = 15.0\n[arm.exit.kerb]");
    let message = refusal("[arm.exit.kerb]", 0, &lane);
    assert!(message.contains("arm[0].entry.left: ") && message.contains("m from exit.left at ("), "{message}");
}

#[test]
fn lanes_of_the_shipped_roundabouts_fail_once_a_carriageway_is_moved_over_the_other() {
    for (path, text) in crate::files::shipped::FILES.iter().filter(|(path, _)| path.starts_with("roundabouts/")) {
        let arms = text.matches("[[arm]]").count();
        let mut refused = 0;
        for (at, _) in text.match_indices("[arm.entry.left]\n") {
            // At the arm's end the left entry lane moves by a lane's width, onto the left exit lane.
            let from = at + text[at..].find("offset = ").unwrap() + "offset = ".len();
            let to = from + text[from..].find('}').unwrap();
            let (offset, radius) =
                text[from..to].split_once(',').map_or((&text[from..to], ""), |(offset, _)| (offset, ", radius = 2.0"));
            let offset = offset.trim().parse::<f64>().unwrap() - 3.7;
            let changed = format!("{}{offset}{radius} {}", &text[..from], &text[to..]);
            let message = read(&changed).unwrap_err().to_string();
            refused += usize::from(message.contains("must lie at least 2.5 m left of exit.left"));
        }
        // On other arms the moved lane meets a splitter island or misses the ring, which is found first; so it is on
        // every arm of 16m with the map's larger islands.
        assert!((0 < refused) != path.ends_with("/16m-maps.toml"), "{path}: {refused} of {arms}");
    }
}

proptest! {
    #[test]
    fn no_numbers_in_a_file_make_reading_it_panic(
        numbers in prop::collection::vec(prop_oneof![any::<f64>(), -100.0..100.0, 0.0..40.0], 8),
        at in prop::collection::vec(0usize..40, 8),
    ) {
        let mut lines: Vec<String> = plain().lines().map(str::to_owned).collect();
        for (number, at) in numbers.iter().zip(at) {
            let line = &mut lines[at];
            let is_number = |(key, _): &(&str, &str)| *key != "name" && *key != "points";
            if let Some((key, _)) = line.clone().split_once(" = ").filter(is_number) {
                *line = format!("{key} = {number:?}").replace("NaN", "nan");
            } else if line.starts_with("points") {
                let (radius, offset) = (numbers[0], numbers[1]);
                let first = format!("{{ along = 60.0, offset = {number:?}, radius = {radius:?} }}");
                let last = format!("{{ along = 20.0, offset = {offset:?} }}");
                *line = format!("points = [{first}, {last}]").replace("NaN", "nan");
            }
        }
        if let Ok(roundabout) = read(&lines.join("\n")) {
            let _ = roundabout.kerbs(Gutter::Solid);
            let _ = roundabout.routes(40.0, 35.0, 2.0);
        }
    }
}
