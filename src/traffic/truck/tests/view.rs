//! A truck as cars see it.

use super::*;
use crate::traffic::Sample;
use crate::traffic::model::FASTEST;
use crate::traffic::truck::view::outlines;
use crate::traffic::units::metres;

#[test]
fn a_truck_on_a_circle_is_foreseen_on_that_circle_with_its_trailer_behind_it() {
    let (network, rig) = (baked("20m"), rig());
    let (radius, v) = (20.0f32, 5.0f32);
    // Steady: the trailer's axle runs on a circle of its own.
    let hitch_angle = (rig.fifth_wheel / radius).atan();
    let articulation = (rig.trailer_wheelbase / radius.hypot(rig.fifth_wheel)).asin() - hitch_angle;
    let at = |angle: f32| Truck {
        position: radius * Vec2::from_angle(angle),
        heading: angle + std::f32::consts::FRAC_PI_2,
        trailer_heading: angle + std::f32::consts::FRAC_PI_2 - articulation,
        speed: v,
        steering: (rig.wheelbase / radius).atan(),
        ..Truck::default()
    };
    let beyond_line = metres(network.paths[0].line) + 5.0;
    let view = View::new(&network, &rig, &at(0.3), 0, beyond_line);
    let expected = [1.0, 2.0].map(|seconds| outlines(&rig, &at(0.3 + seconds * v / radius)));
    for (found, expected) in view.later.iter().zip(expected.as_flattened()) {
        assert!(found.middle.distance(expected.middle) < 0.15, "{found:?}, on the circle {expected:?}");
        assert!(found.along.dot(expected.along) > 0.999);
    }
    assert_eq!(view.now, outlines(&rig, &at(0.3)));
    assert!((metres(view.length) - 16.118).abs() < 0.001);
}

#[test]
fn a_truck_is_foreseen_only_once_it_cannot_stop_before_its_line_any_more() {
    let network = baked("20m");
    let line = metres(network.paths[0].line);
    // At 4 m/s it stops within 2 m, 2.5 m before the line.
    for (before, waits) in [(4.6, true), (4.4, false)] {
        let view = view_at(&network, 0, line - before, 4.0);
        assert_eq!(view.waits, waits);
        assert_eq!(view.later[2..] == view.now[..], waits);
    }
}

#[test]
fn everything_that_a_truck_covers_now_and_later_lies_in_the_circle_around_it() {
    let network = baked("20m");
    let view = view_at(&network, 0, metres(network.paths[0].line), 8.0);
    for unit in view.now.iter().chain(&view.later) {
        for (l, w) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let corner = unit.middle + l * unit.half_length * unit.along + w * unit.half_width * unit.along.perp();
            assert!(corner.distance(view.middle) <= view.radius);
        }
    }
}

#[test]
fn a_truck_that_is_faster_than_any_car_is_followed_as_the_fastest_and_one_that_comes_toward_it_as_one_that_stands() {
    let network = baked("20m");
    let view = view_at(&network, 0, 30.0, 25.0);
    let along = network.samples[network.paths[0].first as usize + 12];
    assert!(0.9 < along.direction.dot(view.velocity) / 25.0);
    assert_eq!(view.speed_along(&along), FASTEST);
    assert_eq!(view.speed_along(&Sample { direction: -along.direction, ..along }), 0);
    let slow = view_at(&network, 0, 30.0, 5.0);
    assert!(slow.speed_along(&along).abs_diff(speed(5.0)) < speed(0.2) as u32);
}
