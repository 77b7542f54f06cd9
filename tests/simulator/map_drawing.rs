//! A drawing that another program wrote, ezdxf 1.4: light and old polylines, lines and arcs in millimetres, on layers
//! of its own, beside a text and a block.

use std::path::Path;

use glam::DVec2;
use offtrack::map::Road;
use offtrack::map::dxf::{self, Drawn, Layers};

/// Where the ring lies in the drawing (m).
const AT: DVec2 = DVec2::new(412.5, -88.25);

fn drawing(kerbs: &str) -> Result<Drawn, offtrack::files::reader::Error> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/maps/ezdxf_16m.dxf");
    let layers = Layers {
        kerbs: kerbs.into(),
        lanes: "C-LANE".into(),
        unit: None,
        lane_width: 4.0,
        ring: Some(AT),
        arms: Vec::new(),
    };
    dxf::read(&file, &layers)
}

#[test]
fn a_drawing_of_another_program_is_the_road_that_it_was_drawn_from_within_a_millimetre() {
    let Drawn { ground, notes } = drawing("C-KERB").unwrap();
    let road = Road::named("16m").unwrap();
    let own = road.ground();
    assert!(ground.origin.distance(AT) < 1e-3 && !ground.mirrored, "{}", ground.origin);
    assert_eq!((ground.arms.len(), ground.lines.len(), ground.faces.loops.len()), (4, 4, own.faces.loops.len()));
    // The island is drawn of arcs, and the entities of one more layer are left out.
    assert!(notes.iter().any(|note| note.contains("joined")), "{notes:?}");
    assert!(notes.iter().any(|note| note.contains("2 entities on 1 other layers")), "{notes:?}");
    for p in ground.faces.loops.iter().flat_map(|face| face.polyline(0.01)) {
        assert!(own.faces.distance(p) < 1e-3, "{p}");
    }
    for line in &ground.lines {
        assert!(own.lines.iter().any(|other| line.line.polyline(0.5).iter().all(|&p| other.line.distance(p) < 1e-3)));
    }
}

#[test]
fn a_layer_that_the_drawing_does_not_have_is_refused_with_those_that_it_has() {
    let said = drawing("CURB").unwrap_err().to_string();
    assert!(said.contains("ezdxf_16m.dxf: layer CURB: empty") && said.contains("C-KERB ("), "{said}");
}
