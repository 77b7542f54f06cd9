//! Exact geometry against brute force on dense polylines.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use proptest::prelude::*;

use super::*;

/// A square of 60 m with rounded corners, two of them fillets of 4 m and 0.3 m turning into the road, around a round
/// island and a splitter.
fn outline() -> Outline {
    let bend = |x: f64, y: f64, radius: f64| Bend { at: DVec2::new(x, y), radius };
    let square = [
        bend(-30.0, -30.0, 6.0),
        bend(30.0, -30.0, 0.3),
        bend(30.0, 10.0, 4.0),
        bend(22.0, 10.0, 2.0),
        bend(22.0, 30.0, 0.0),
        bend(-30.0, 30.0, 9.0),
    ];
    let splitter = [bend(14.0, -2.0, 0.3), bend(22.0, 0.0, 0.2), bend(14.0, 2.5, 0.5)];
    Outline::new(vec![
        rounded(&square, true).unwrap(),
        Curve::circle(DVec2::new(1.0, -2.0), 8.0),
        rounded(&splitter, true).unwrap(),
    ])
}

/// The outline's polylines; chords leave the arcs by at most a hundredth of a millimetre.
fn chords(outline: &Outline) -> Vec<(DVec2, DVec2)> {
    let lines = outline.loops.iter().map(|curve| curve.polyline(1e-5));
    lines.flat_map(|line| line.windows(2).map(|ends| (ends[0], ends[1])).collect::<Vec<_>>()).collect()
}

fn point() -> impl Strategy<Value = DVec2> {
    (-35.0..35.0, -35.0..35.0).prop_map(|(x, y)| DVec2::new(x, y))
}

proptest! {
    #[test]
    fn distances_are_those_to_a_dense_polyline(p in point()) {
        let outline = outline();
        let to_chord = |&(from, to): &(DVec2, DVec2)| Piece::Segment { from, to }.distance(p);
        let brute = chords(&outline).iter().map(to_chord).fold(f64::INFINITY, f64::min);
        // The polyline's sagitta.
        prop_assert!((outline.distance(p) - brute).abs() < 1.1e-5);
    }

    #[test]
    fn the_drivable_side_is_that_of_the_winding_polyline(p in point()) {
        let outline = outline();
        prop_assume!(1e-4 < outline.distance(p));
        let is_right = |(a, b): &&(DVec2, DVec2)| {
            (a.y <= p.y) != (b.y <= p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
        };
        let crossings = chords(&outline).iter().filter(is_right).count();
        prop_assert_eq!(outline.contains(p), crossings % 2 == 1);
    }

    #[test]
    fn what_is_near_gives_the_distances_of_the_whole(
        centre in point(), radius in 0.0..6.0, angle in 0.0..TAU, fraction in 0.0..1.0,
    ) {
        let outline = outline();
        let p = centre + DVec2::from_angle(angle) * radius * fraction;
        prop_assert_eq!(outline.near(centre, radius).signed_distance(p), outline.signed_distance(p));
    }

    #[test]
    fn a_ray_reaches_the_first_chord_in_its_way(origin in point(), angle in 0.0..TAU) {
        let outline = outline();
        let direction = DVec2::from_angle(angle);
        let ray = outline.ray(origin, direction, 20.0);
        if outline.contains(origin) {
            // No chord is crossed before the ray's end, and the end lies on the outline: grazing rays have no sharper
            // test.
            let seen = Piece::Segment { from: origin, to: origin + direction * (ray - 0.01).max(0.0) };
            let clear = |&(from, to): &(DVec2, DVec2)| seen.meetings(&Piece::Segment { from, to }).is_empty();
            prop_assert!(ray < 0.02 || chords(&outline).iter().all(clear));
            prop_assert!(ray == 20.0 || outline.distance(origin + direction * ray) < 1e-9);
        } else {
            prop_assert_eq!(ray, 0.0);
        }
    }

    #[test]
    fn a_rectangle_meets_a_solid_just_when_one_of_its_points_is_solid(
        centre in point(), angle in 0.0..TAU, length in 1.0..20.0, width in 1.0..3.0,
    ) {
        let outline = outline();
        let (along, across) = (DVec2::from_angle(angle), DVec2::from_angle(angle).perp());
        let at = |x: f64, y: f64| centre + along * x * length / 2.0 + across * y * width / 2.0;
        let corners = [at(1.0, 1.0), at(-1.0, 1.0), at(-1.0, -1.0), at(1.0, -1.0)];
        let steps = || (-40..=40).map(|step| f64::from(step) / 40.0);
        let points = steps().flat_map(|x| steps().map(move |y| (x, y)));
        let room = points.map(|(x, y)| outline.signed_distance(at(x, y))).fold(f64::INFINITY, f64::min);
        // Between the sampled points the distance changes by at most half their spacing.
        let unsure = length / 40.0;
        prop_assume!(unsure < room || room < 0.0);
        prop_assert_eq!(outline.intersects_rectangle(&corners), room < 0.0);
    }

    #[test]
    fn an_offset_outline_keeps_its_distance_everywhere(distance in 0.05..1.4) {
        let outline = outline();
        let grown = outline.offset(distance);
        prop_assert_eq!(grown.loops.len(), 3);
        for p in grown.loops.iter().flat_map(|curve| curve.polyline(1e-3)) {
            // Parts are joined to within a micrometre.
            prop_assert!((outline.signed_distance(p) - distance).abs() < 2e-6, "{p} {}", outline.signed_distance(p));
        }
    }

    #[test]
    fn a_straight_is_led_into_a_circle_without_a_kink(y in -20.0..20.0, radius in 1.0..60.0, circle in 5.0..20.0) {
        let origin = DVec2::new(-150.0, y);
        let led = to_circle(origin, DVec2::X, circle, radius);
        // Cases without such an arc are not counted.
        prop_assume!(led.is_some());
        let (arc, arrival) = led.unwrap();
        prop_assert!(wrapped(arc.heading_at(0.0)).abs() < 1e-9);
        prop_assert!((arc.start().y - y).abs() < 1e-9);
        prop_assert!(arc.end().distance(DVec2::from_angle(arrival) * circle) < 1e-9 * radius.max(circle));
        // Travelled counter-clockwise, a circle runs at right angles to its radius.
        prop_assert!(wrapped(arc.heading_at(arc.length()) - arrival - FRAC_PI_2).abs() < 1e-6);
    }

    #[test]
    fn corners_are_rounded_tangentially(x in 5.0..30.0, y in -30.0..30.0, radius in 0.1..4.0) {
        let bends = [(-30.0, 0.0), (0.0, 0.0), (x, y), (x + 40.0, y)];
        let bends = bends.map(|(x, y)| Bend { at: DVec2::new(x, y), radius });
        let rounded = rounded(&bends, false);
        // Cases in which no such arc fits are not counted.
        prop_assume!(rounded.is_ok());
        let curve = rounded.unwrap();
        for joint in curve.pieces.windows(2) {
            prop_assert!(joint[0].end().distance(joint[1].start()) < 1e-9);
            prop_assert!(wrapped(joint[0].heading_at(joint[0].length()) - joint[1].heading_at(0.0)).abs() < 1e-6);
        }
    }
}

#[test]
fn a_bend_too_wide_says_which_radius_fits() {
    let bends = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)].map(|(x, y)| Bend { at: DVec2::new(x, y), radius: 12.0 });
    let misfit = rounded(&bends, false).unwrap_err();
    assert!(misfit.bend == 1 && (misfit.largest - 10.0).abs() < 1e-12, "{misfit:?}");
}

#[test]
fn a_fillet_smaller_than_the_offset_leaves_a_corner() {
    let grown = outline().offset(0.5);
    // The corner at (30, -30) had a radius of 0.3 m: its neighbours now meet at right angles.
    assert!(grown.distance(DVec2::new(29.5, -29.5)) < 1e-9);
}

#[test]
fn a_rectangle_around_a_whole_island_is_not_free() {
    let island = Curve::circle(DVec2::new(10.0, 0.0), 0.5);
    let outline = Outline::new(vec![Curve::circle(DVec2::ZERO, 30.0), island]);
    let around = |x: f64| {
        [DVec2::new(x + 2.0, 2.0), DVec2::new(x - 2.0, 2.0), DVec2::new(x - 2.0, -2.0), DVec2::new(x + 2.0, -2.0)]
    };
    assert!(outline.intersects_rectangle(&around(10.0)));
    assert!(!outline.intersects_rectangle(&around(14.0)));
    assert!(outline.intersects_rectangle(&around(40.0)));
}

#[test]
fn bounds_reach_the_bulge_of_arcs() {
    let (low, high) = Outline::new(vec![Curve::circle(DVec2::new(3.0, 4.0), 5.0)]).bounds();
    assert!(low.distance(DVec2::new(-2.0, -1.0)) < 1e-12 && high.distance(DVec2::new(8.0, 9.0)) < 1e-12);
}

#[test]
fn a_curve_is_walked_by_arc_length() {
    let curve = rounded(
        &[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)].map(|(x, y)| Bend { at: DVec2::new(x, y), radius: 4.0 }),
        false,
    )
    .unwrap();
    assert!((curve.length() - (12.0 + 2.0 * PI)).abs() < 1e-12);
    assert_eq!(curve.point_at(3.0), DVec2::new(3.0, 0.0));
    assert!((curve.heading_at(6.0 + PI) - PI / 4.0).abs() < 1e-12);
    assert_eq!(curve.point_at(100.0), DVec2::new(10.0, 10.0));
    let middle = curve.part(5.0, 9.0);
    assert!((middle.length() - 4.0).abs() < 1e-12 && middle.point_at(0.0) == DVec2::new(5.0, 0.0));
    assert!((curve.station(curve.point_at(8.0)) - 8.0).abs() < 1e-9);
}

#[test]
fn nearly_straight_arcs_metres_apart_do_not_meet_and_those_that_touch_do() {
    // Of a radius of 300 km: beside each other, and one behind the other, like two sides of a lane.
    let arc = |centre: DVec2, radius: f64| Curve::circle(centre, radius).pieces[0];
    let radius = 3e5;
    let meet = |one: Piece, other: Piece| !one.meetings(&other).is_empty();
    for apart in [1e-3, 0.5, 8.0] {
        assert!(!meet(arc(DVec2::ZERO, radius), arc(DVec2::new(2.0 * radius + apart, 0.0), radius)), "{apart}");
        assert!(!meet(arc(DVec2::ZERO, radius), arc(DVec2::new(1.0, 0.0), radius - 1.0 - apart)), "{apart}");
    }
    let right = |centre: f64, radius: f64, to: f64| Piece::Arc {
        centre: DVec2::new(centre, 0.0),
        radius,
        from: to - 0.5,
        sweep: 1.0,
    };
    assert!(meet(right(0.0, radius, 0.0), right(2.0 * radius, radius, PI)));
    assert!(meet(right(0.0, 20.0, 0.0), right(1.0, 19.0, 0.0)));
}
