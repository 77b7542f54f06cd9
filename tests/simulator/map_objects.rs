//! Maps that contradict themselves or say more than is read: what is said of it, and what is left alone.

use glam::DVec2;
use offtrack::geometry::Curve;
use offtrack::map::opendrive::Options;

use crate::map_kinds::{imported, in_road_1, parsed, plain};

/// The ring with a road far from it, 100 m long, that has these objects.
fn beside(x: f64, objects: &str) -> String {
    let lane = "<lane id=\"-1\" type=\"driving\"><width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane>";
    let road = format!(
        "<road id=\"777\" junction=\"-1\" length=\"100\"><planView><geometry s=\"0\" x=\"{x}\" y=\"-200\" hdg=\"0\" \
         length=\"100\"><line/></geometry></planView><lanes><laneSection s=\"0\"><center><lane id=\"0\" \
         type=\"none\"/></center><right>{lane}</right></laneSection></lanes><objects>{objects}</objects></road>"
    );
    plain().replace("</OpenDRIVE>", &format!("{road}</OpenDRIVE>"))
}

const ISLAND: &str = "<object id=\"1\" type=\"trafficIsland\" s=\"50\" t=\"9\" hdg=\"0\"";

#[test]
fn a_traffic_island_far_from_the_ring_changes_nothing_of_it() {
    let near = imported(&parsed(&plain()));
    let with_far = imported(&parsed(&beside(5000.0, &format!("{ISLAND} length=\"4\" width=\"1\"/>"))));
    let [one, other] = [&near, &with_far].map(|imported| &imported.ground.faces.loops);
    assert_eq!((one.len(), &near.warnings), (other.len(), &with_far.warnings));
    for (one, other) in one.iter().zip(other) {
        assert!((one.length() - other.length()).abs() < 1e-6, "{} {}", one.length(), other.length());
    }
}

#[test]
fn a_round_island_is_a_circle_within_millimetres() {
    let radius = imported(&parsed(&plain())).ground.island_radius + 0.5;
    let object = format!("<object id=\"1\" type=\"trafficIsland\" s=\"50\" t=\"200\" radius=\"{radius}\"/>");
    let ground = imported(&parsed(&beside(-50.0, &object))).ground;
    let off = |curve: &Curve| curve.polyline(1e-4).iter().map(|p| (p.length() - radius).abs()).fold(0.0, f64::max);
    assert!((ground.island_radius - radius).abs() < 5e-3, "{}", ground.island_radius);
    assert!(ground.faces.loops.iter().any(|curve| off(curve) < 5e-3), "{radius}");
}

#[test]
fn an_island_of_several_outlines_is_read_whole_and_one_that_is_repeated_is_warned_of() {
    let square = |u: f64| {
        let corner = |u: f64, v: f64| format!("<cornerLocal u=\"{u}\" v=\"{v}\" z=\"0\"/>");
        let corners = [corner(u, 0.0), corner(u + 1.0, 0.0), corner(u + 1.0, 1.0), corner(u, 1.0)].concat();
        format!("<outline>{corners}</outline>")
    };
    let text = plain();
    let arm = text.lines().find(|line| line.contains(" id=\"1\" junction")).unwrap();
    let on_arm = |objects: &str| {
        let with = arm.replace("</lanes>", &format!("</lanes><objects>{objects}</objects>"));
        imported(&parsed(&text.replace(arm, &with))).ground.faces
    };
    let island = |outlines: &str| {
        format!("<object id=\"1\" type=\"trafficIsland\" s=\"20\" t=\"-0.5\"><outlines>{outlines}</outlines></object>")
    };
    let (one, other) = (square(0.0), square(6.0));
    let both = on_arm(&island(&[one.clone(), other.clone()].concat()));
    assert_eq!(both, on_arm(&[island(&one), island(&other)].concat()));
    assert_ne!(both, on_arm(&island(&one)));
    // One kerb does not make a map whose kerbs lie around all that is solid: its splitter islands stay.
    assert_eq!(on_arm(&island(&one)).loops.len(), on_arm("").loops.len() + 1);
    let repeated = format!(
        "{ISLAND} length=\"4\" width=\"1\"><repeat s=\"10\" length=\"20\" distance=\"5\" tStart=\"0\" tEnd=\"0\"/>\
         </object>"
    );
    let map = parsed(&beside(5000.0, &repeated));
    assert!(map.warnings().any(|warning| warning.contains("is repeated along the road; it is read once")));
}

#[test]
fn pieces_whose_stations_do_not_follow_each_other_are_warned_of() {
    let text = plain();
    let road = text.lines().find(|line| line.contains(" id=\"1\" junction")).unwrap();
    let cut = |s: &str, length: &str| {
        let pieces = format!(
            "length=\"35\"><line/></geometry><geometry s=\"{s}\" x=\"73\" y=\"0\" hdg=\"0\" length=\"{length}\">\
             <line/></geometry></planView>"
        );
        text.replace(road, &road.replace("length=\"70\"><line/></geometry></planView>", &pieces))
    };
    let says = "a piece begins at s 0.00 m and has 35.00 m, the next begins at s 3.00 m";
    assert!(parsed(&cut("3", "67")).warnings().any(|warning| warning.contains(says)));
    assert!(!parsed(&cut("35", "35")).warnings().any(|warning| warning.contains("a piece begins")));
}

#[test]
fn a_link_of_an_unknown_kind_is_warned_of() {
    let text = plain();
    let link = "elementType=\"junction\" elementId=\"900\"";
    assert!(text.contains(link));
    let map = parsed(&text.replacen(link, "elementId=\"900\"", 1));
    let says = "must be road or junction, and is not read";
    assert_eq!(map.warnings().filter(|warning| warning.contains(says)).count(), 1);
    assert!(!parsed(&text).warnings().any(|warning| warning.contains(says)));
}

#[test]
fn a_junction_that_is_not_listed_is_no_dead_end() {
    let text = plain();
    let (before, rest) = text.split_once("<junction ").unwrap();
    let after = rest.split_once("</junction>").unwrap().1;
    let map = parsed(&format!("{before}{after}"));
    let missing: Vec<&str> = map.warnings().filter(|warning| warning.contains("is linked to junction")).collect();
    assert!(!missing.is_empty() && missing.iter().all(|warning| warning.ends_with("which the file does not have")));
}

/// The ring twice, so far apart (m): the eastern arm of one is the western arm of the other.
fn dumbbell(apart: f64) -> String {
    let ids = (1..=4).chain([100, 200, 300, 400, 900].into_iter().flat_map(|first| first..first + 4));
    let ids: Vec<u32> = ids.filter(|&id| id != 3).collect();
    let moved = |line: &str| {
        // The common arm is road 1, whose end is there.
        let mut line = line.replace("elementId=\"3\" contactPoint=\"start\"", "elementId=\"+\" contactPoint=\"end\"");
        line = line.replace("incomingRoad=\"3\"", "incomingRoad=\"+\"");
        for id in &ids {
            for (before, after) in [
                ("elementId=\"", "\""),
                ("incomingRoad=\"", "\""),
                ("connectingRoad=\"", "\""),
                (" id=\"", "\" junction"),
                ("name=\"\" id=\"", "\">"),
                ("junction=\"", "\""),
            ] {
                line = line.replace(&format!("{before}{id}{after}"), &format!("{before}{}{after}", id + 5000));
            }
        }
        if let Some((before, after)) = line.split_once("<geometry s=\"0\" x=\"") {
            let (x, rest) = after.split_once('"').unwrap();
            line = format!("{before}<geometry s=\"0\" x=\"{}\"{rest}", x.parse::<f64>().unwrap() + apart);
        }
        let turned = match &line {
            line if line.contains(" id=\"5302\"") => line.replace("<successor id=\"-1\"/>", "<successor id=\"1\"/>"),
            line if line.contains(" id=\"5402\"") => {
                line.replace("<predecessor id=\"1\"/>", "<predecessor id=\"-1\"/>")
            }
            line if line.contains("id=\"5902\">") => line.replace("from=\"1\"", "from=\"-1\""),
            line => line.clone(),
        };
        turned.replace("\"+\"", "\"1\"")
    };
    let text = plain();
    let parts = text.lines().filter(|line| line.starts_with("<road") || line.starts_with("<junction"));
    let other: Vec<String> = parts.filter(|line| !line.contains(" id=\"3\" junction")).map(moved).collect();
    let arm = text.lines().find(|line| line.contains(" id=\"1\" junction")).unwrap();
    let link = "<successor elementType=\"junction\" elementId=\"5902\"/></link><planView>";
    let length = format!("length=\"{}\"", apart - 76.0);
    let common = arm.replace("length=\"70\"", &length).replacen("</link><planView>", link, 1);
    text.replace(arm, &common).replace("</OpenDRIVE>", &format!("{}\n</OpenDRIVE>", other.join("\n")))
}

#[test]
fn an_arm_that_leads_into_another_ring_nearby_is_said_to_end_there_and_not_to_lack_a_link() {
    let map = parsed(&dumbbell(80.0));
    assert_eq!(map.rings().len(), 2);
    for ring in map.rings() {
        let imported = map.ground(&ring, &Options::default()).unwrap();
        assert_eq!(imported.ground.lines.len(), 16);
        assert_eq!(imported.warnings.len(), 3, "{:?}", imported.warnings);
        assert!(
            imported.warnings.iter().all(|warning| warning.contains("closes a ring there")),
            "{:?}",
            imported.warnings
        );
    }
    // Farther apart the arm reaches the edge of what is driven.
    let apart = parsed(&dumbbell(100.0));
    assert_eq!(apart.ground(&apart.rings()[0], &Options::default()).unwrap().warnings, [""; 0]);
}

#[test]
fn a_raised_strip_is_a_kerb_by_its_width_whether_widths_or_borders_say_so() {
    // Along the eastern arm, in its lane in: right of a line, or left of one that leads the other way.
    const KERB: DVec2 = DVec2::new(55.0, -3.0);
    let faces = |wide: f64, element: &str, side: f64| {
        let (x, heading) = if side < 0.0 { (45.0, 0.0) } else { (65.0, std::f64::consts::PI) };
        // The second lane of its side: a border is where it ends, a width how wide it is.
        let at = |width: f64, border: f64| {
            let value = if element == "width" { width } else { side * border };
            format!("<{element} sOffset=\"0\" a=\"{value}\" b=\"0\" c=\"0\" d=\"0\"/>")
        };
        let ids = [side, 2.0 * side];
        let inner = format!("<lane id=\"{}\" type=\"none\">{}</lane>", ids[0], at(1.5, 1.5));
        let height = "<height sOffset=\"0\" inner=\"0.15\" outer=\"0.15\"/>";
        let outer = format!("<lane id=\"{}\" type=\"sidewalk\">{}{height}</lane>", ids[1], at(wide, 1.5 + wide));
        let (name, lanes) = if side < 0.0 { ("right", inner + &outer) } else { ("left", outer + &inner) };
        let road = format!(
            "<road id=\"777\" junction=\"-1\" length=\"20\"><planView><geometry s=\"0\" x=\"{x}\" y=\"-1.5\" \
             hdg=\"{heading}\" length=\"20\"><line/></geometry></planView><lanes><laneSection s=\"0\"><center><lane \
             id=\"0\" type=\"none\"/></center><{name}>{lanes}</{name}></laneSection></lanes></road>"
        );
        imported(&parsed(&plain().replace("</OpenDRIVE>", &format!("{road}</OpenDRIVE>")))).ground.faces
    };
    for side in [-1.0, 1.0] {
        let [kerb, walk] = [0.3, 2.5].map(|wide| faces(wide, "width", side));
        // A kerb wins over the lane that it lies in, a walk does not.
        assert!(kerb.distance(KERB) < 0.01 && 1.0 < walk.distance(KERB), "{side}");
        assert_eq!([0.3, 2.5].map(|wide| faces(wide, "border", side)), [kerb, walk], "{side}");
    }
}

#[test]
fn an_offset_of_the_header_is_said_not_to_be_applied() {
    let offset = "<offset x=\"1000\" y=\"2000\" z=\"0\" hdg=\"0.5\"/></header>";
    let text = plain();
    let map = parsed(&text.replace("</header>", offset));
    assert_eq!(map.header_offset(), Some([1000.0, 2000.0, 0.0, 0.5]));
    let said =
        |warnings: &[String]| warnings.iter().any(|warning| warning.contains("offset (1000, 2000, 0) m, 0.5 rad"));
    assert!(said(&imported(&map).warnings), "{:?}", imported(&map).warnings);
    assert_eq!((parsed(&text).header_offset(), said(&imported(&parsed(&text)).warnings)), (None, false));
}

/// The ring with a road of one lane that leads north over its eastern arm, at this height.
fn passed_at(height: f64) -> String {
    let lane = "<lane id=\"-1\" type=\"driving\"><width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane>";
    let road = format!(
        "<road id=\"7000\" junction=\"-1\" length=\"120\"><planView><geometry s=\"0\" x=\"62\" y=\"-60\" \
         hdg=\"1.5707963267949\" length=\"120\"><line/></geometry></planView><elevationProfile><elevation s=\"0\" \
         a=\"{height}\" b=\"0\" c=\"0\" d=\"0\"/></elevationProfile><lanes><laneSection s=\"0\"><center><lane id=\"0\" \
         type=\"none\"/></center><right>{lane}</right></laneSection></lanes></road>"
    );
    plain().replace("</OpenDRIVE>", &format!("{road}</OpenDRIVE>"))
}

#[test]
fn a_road_that_passes_above_another_is_warned_of_by_its_height() {
    let said = |height: f64| {
        let warnings = imported(&parsed(&passed_at(height))).warnings;
        warnings.into_iter().filter(|warning| warning.contains(" above ")).collect::<Vec<_>>().join("\n")
    };
    assert!(
        said(8.0).ends_with(": road 7000 passes 8.0 m above road 1; the simulated road is level, and both are paved"),
        "{}",
        said(8.0)
    );
    assert!(
        said(-6.0).ends_with("road 1 passes 6.0 m above road 7000; the simulated road is level, and both are paved")
    );
    assert_eq!([said(1.0), said(0.0)], ["", ""].map(str::to_owned));
}

#[test]
fn lanes_that_forbid_trucks_and_widths_that_are_odd_are_warned_of() {
    let said = |from: &str, to: &str| parsed(&in_road_1(&plain(), from, to)).warnings().collect::<Vec<_>>().join("\n");
    let width = "<width sOffset=\"0\" a=\"4\" b=\"0\" c=\"0\" d=\"0\"/>";
    let deny = format!("{width}<access sOffset=\"0\" rule=\"deny\" restriction=\"truck\"/>");
    for (to, expected) in [
        (deny.as_str(), "forbids trucks; it is driven on as other lanes are"),
        (&width.replace("sOffset=\"0\"", "sOffset=\"2\""), "its width begins at sOffset 2 m"),
        (&format!("{width}{}", width.replace("\"0\" a=\"4\"", "\"60\" a=\"-1\"")), "width at sOffset 60 m is -1 m"),
    ] {
        let said = said(width, to);
        assert!(said.contains("road 1") && said.contains(expected), "{expected}: {said}");
    }
}

#[test]
fn the_hand_of_traffic_is_read_in_any_case_and_an_unknown_rule_is_warned_of() {
    let of = |rule: &str| parsed(&plain().replace("<road ", &format!("<road rule=\"{rule}\" ")));
    let [lower, upper, right] = ["lht", "LHT", "RHT"].map(|rule| of(rule).lane_centres(0.01));
    assert!(lower == upper && lower != right);
    let said = of("left").warnings().collect::<Vec<_>>().join("\n");
    assert!(said.contains("its rule left is neither RHT nor LHT; it counts as RHT"), "{said}");
}
