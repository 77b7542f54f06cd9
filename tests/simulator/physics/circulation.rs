//! Steady circulation in a roundabout's lane: off-tracking and load transfer of the trailer.

use offtrack::layout::{Control, Rig, Truck};
use offtrack::physics::{driven, motion_of};

use super::vehicle;

const SUBSTEP: f32 = 0.05;
const SPEED: f32 = 30.0 / 3.6;

/// A truck in steady circulation at [`SPEED`], and the radii of its front axle and its trailer's axle group (m).
fn circulating(rig: &Rig, steering: f32) -> (Truck, f32, f32) {
    let control = Control { steering, ..Control::default() };
    let truck = driven(rig, SUBSTEP, 1200, &control, &Truck { speed: SPEED, ..Truck::default() });
    // `driven` reports the largest ratio among its sub-steps, which in a long drive is that of its beginning.
    let truck = driven(rig, SUBSTEP, 1, &control, &truck);
    let turning = motion_of(rig, &truck);
    let front_side_speed = turning.side_speed + rig.wheelbase * turning.yaw_rate;
    let trailer_speed = turning.trailer_lateral_acceleration / turning.trailer_yaw_rate;
    let trailer_side_speed = rig.slip * trailer_speed * trailer_speed.abs() * turning.trailer_yaw_rate;
    (
        truck,
        SPEED.hypot(front_side_speed) / turning.yaw_rate,
        trailer_speed.hypot(trailer_side_speed) / turning.yaw_rate,
    )
}

/// The truck with its front axle on a circle of `radius` (m), and the off-tracking of its trailer's axle group (m).
fn on_circle(rig: &Rig, radius: f32) -> (Truck, f32) {
    let (mut tight, mut wide) = (0.4f32, 0.02f32);
    for _ in 0..25 {
        let middle = 0.5 * (tight + wide);
        if circulating(rig, middle).1 < radius { tight = middle } else { wide = middle }
    }
    let (truck, front, trailer) = circulating(rig, wide);
    assert!((front - radius).abs() < 0.01, "{front} for {radius}");
    (truck, front - trailer)
}

#[test]
fn slip_reduces_the_off_tracking_of_pure_kinematics() {
    let rig = vehicle("eu_4x2_13m6").rig("laden", SUBSTEP, None);
    // Reference at 30 km/h: 1.28 m with slip, 1.96 m from geometry alone. The reference does not say whether the side
    // speed of a slipping axle counts, which is 0.03 m of its radius.
    let (_, slipping) = on_circle(&rig, 19.3);
    assert!((slipping - 1.28).abs() < 0.04, "{slipping}");
    let (_, rolling) = on_circle(&Rig { slip: 0.0, ..rig }, 19.3);
    assert!((rolling - 1.96).abs() < 0.01, "{rolling}");
}

#[test]
fn a_heavier_trailer_has_a_larger_load_transfer_in_the_same_lane() {
    let vehicle = vehicle("daf_xf");
    // The trailer's load transfer ratio at 30 km/h, to two decimals, for the radii of the front axle in four lanes.
    let expected = [
        (13.59, [0.56, 0.77, 1.07, 1.21]),
        (19.32, [0.44, 0.60, 0.83, 0.93]),
        (22.31, [0.39, 0.53, 0.73, 0.82]),
        (27.57, [0.32, 0.43, 0.60, 0.68]),
    ];
    for (radius, ratios) in expected {
        for (load, ratio) in ["empty", "half", "laden", "laden_high"].into_iter().zip(ratios) {
            // The reference is for a trailer 0.4 m longer.
            let rig = Rig { trailer_wheelbase: 8.174, ..vehicle.rig(load, SUBSTEP, None) };
            let (truck, _) = on_circle(&rig, radius);
            let found = truck.trailer_load_transfer_ratio;
            // The table has two decimals, some of them truncated rather than rounded.
            assert!((found - ratio).abs() < 0.011, "{load} at {radius} m: {found}, expected {ratio}");
        }
    }
}

#[test]
fn an_articulation_decays_straight_ahead_and_grows_in_reverse_by_the_closed_form() {
    let vehicle = vehicle("eu_4x2_13m6");
    let rig = Rig { slip: 0.0, ..vehicle.rig("empty", SUBSTEP, None) };
    for (speed, articulation) in [(8.0f32, 0.8f32), (-1.5, 0.035)] {
        let truck = driven(
            &rig,
            SUBSTEP,
            100,
            &Control::default(),
            &Truck { speed, trailer_heading: -articulation, ..Truck::default() },
        );
        let expected = vehicle.single_track().articulation_after_straight(articulation.into(), f64::from(speed) * 5.0);
        let found = f64::from(truck.heading - truck.trailer_heading);
        // The error of the midpoint rule at 0.05 s.
        assert!((found - expected).abs() < 1e-4, "{found}, expected {expected}");
    }
}
