//! Properties of the motion that hold for any control.

use std::f32::consts::PI;

use glam::Vec2;
use offtrack::layout::angle::wrapped;
use offtrack::layout::{Control, Rig, Truck};
use offtrack::physics::driven;
use proptest::prelude::*;

use super::{VEHICLES, vehicle};

const SUBSTEP: f32 = 0.05;

fn rigs() -> impl Strategy<Value = Rig> {
    let mut rigs: Vec<Rig> = Vec::new();
    for vehicle in VEHICLES.map(vehicle) {
        rigs.extend(vehicle.loads.keys().map(|load| vehicle.rig(load, SUBSTEP, None)));
    }
    prop::sample::select(rigs)
}

fn trucks(speeds: std::ops::Range<f32>, articulation: f32) -> impl Strategy<Value = Truck> {
    (-100.0f32..100.0, -100.0f32..100.0, -PI..PI, -articulation..articulation, speeds, -0.49f32..0.49).prop_map(
        |(x, y, heading, articulation, speed, steering)| Truck {
            position: Vec2::new(x, y),
            heading,
            trailer_heading: wrapped(heading - articulation),
            speed,
            steering,
            ..Truck::default()
        },
    )
}

fn controls(steering: f32, acceleration: f32, n: usize) -> impl Strategy<Value = Vec<Control>> {
    let control = (-steering..steering, -acceleration..acceleration);
    let control = control.prop_map(|(steering, acceleration)| Control { steering, acceleration, ..Control::default() });
    prop::collection::vec(control, n)
}

fn driven_through(rig: &Rig, truck: Truck, controls: &[Control]) -> Truck {
    controls.iter().fold(truck, |truck, control| driven(rig, SUBSTEP, 2, control, &truck))
}

/// Largest difference of two trucks' positions (m) and headings (rad).
fn apart(a: &Truck, b: &Truck) -> (f32, f32) {
    let headings = wrapped(a.heading - b.heading).abs().max(wrapped(a.trailer_heading - b.trailer_heading).abs());
    (a.position.distance(b.position), headings)
}

fn mirrored(truck: &Truck) -> Truck {
    Truck {
        position: truck.position * Vec2::new(1.0, -1.0),
        heading: wrapped(-truck.heading),
        trailer_heading: wrapped(-truck.trailer_heading),
        steering: -truck.steering,
        ..*truck
    }
}

proptest! {
    #[test]
    fn under_any_control_the_state_stays_finite_and_within_its_limits(
        rig in rigs(),
        truck in trucks(-5.0..25.0, PI),
        controls in controls(4.0, 30.0, 200),
    ) {
        // Some vehicles have less lock than the trucks are drawn with.
        let mut truck = Truck { steering: truck.steering.clamp(-rig.steer_max, rig.steer_max), ..truck };
        for control in controls {
            truck = driven(&rig, SUBSTEP, 2, &control, &truck);
            let Truck { position, heading, trailer_heading, speed, steering, .. } = truck;
            let rest = [truck.tractor_roll, truck.tractor_roll_rate, truck.trailer_roll, truck.trailer_roll_rate];
            let ratios = [truck.tractor_load_transfer_ratio, truck.trailer_load_transfer_ratio];
            prop_assert!(position.is_finite() && speed.is_finite(), "{truck:?}");
            prop_assert!(rest.iter().chain(&ratios).all(|value| value.is_finite()), "{truck:?}");
            prop_assert!(heading.abs() <= PI && trailer_heading.abs() <= PI, "{truck:?}");
            prop_assert!(steering.abs() <= rig.steer_max + 1e-6, "{truck:?}");
        }
    }

    #[test]
    fn a_mirrored_truck_drives_the_mirrored_path(
        rig in rigs(), truck in trucks(-2.0..12.0, 1.5), controls in controls(0.8, 3.0, 60),
    ) {
        let opposite = |control: &Control| Control { steering: -control.steering, ..*control };
        let opposite: Vec<Control> = controls.iter().map(opposite).collect();
        let here = driven_through(&rig, truck, &controls);
        let there = driven_through(&rig, mirrored(&truck), &opposite);
        let (position, heading) = apart(&mirrored(&here), &there);
        // Every rounding is mirrored too, except at -pi, which becomes pi; in reverse that error grows.
        prop_assert!(position < 1e-3 && heading < 1e-3, "{here:?} {there:?}");
        prop_assert!((here.trailer_load_transfer_ratio + there.trailer_load_transfer_ratio).abs() < 1e-3);
        prop_assert!((here.tractor_load_transfer_ratio + there.tractor_load_transfer_ratio).abs() < 1e-3);
    }

    #[test]
    fn a_truck_drives_the_same_path_from_any_position_in_any_direction(
        rig in rigs(),
        truck in trucks(5.0..10.0, 0.8),
        controls in controls(0.3, 0.5, 60),
        turn in -PI..PI,
        shift in (-50.0f32..50.0, -50.0f32..50.0),
    ) {
        let turned = |position: Vec2| Vec2::from_angle(turn).rotate(position) + Vec2::new(shift.0, shift.1);
        let moved = |truck: &Truck| Truck {
            position: turned(truck.position),
            heading: wrapped(truck.heading + turn),
            trailer_heading: wrapped(truck.trailer_heading + turn),
            ..*truck
        };
        let here = driven_through(&rig, truck, &controls);
        let there = driven_through(&rig, moved(&truck), &controls);
        let (position, heading) = apart(&moved(&here), &there);
        // 120 sub-steps of 1.5e-5 m (half an ulp at 200 m, twice) and 2.4e-7 rad (an ulp of pi), which turns 60 m of
        // way.
        prop_assert!(position < 4e-3 && heading < 1e-4, "{position} m {heading} rad");
        prop_assert!((here.trailer_load_transfer_ratio - there.trailer_load_transfer_ratio).abs() < 1e-3);
    }
}

#[test]
fn a_path_that_is_not_mirrored_fails_the_comparison() {
    let rig = vehicle("daf_xf").rig("empty", SUBSTEP, None);
    let controls = [Control { steering: 0.3, ..Control::default() }; 20];
    let truck = Truck { speed: 8.0, ..Truck::default() };
    let here = driven_through(&rig, truck, &controls);
    let (position, heading) = apart(&mirrored(&here), &driven_through(&rig, truck, &controls));
    assert!(1.0 < position && 0.1 < heading);
}

#[test]
fn a_step_reports_the_largest_load_transfer_among_its_sub_steps() {
    let rig = vehicle("eu_4x2_13m6").rig("laden", SUBSTEP, None);
    let control = Control { steering: -0.4, ..Control::default() };
    let truck = Truck { speed: 8.0, steering: 0.2, trailer_roll: 0.2, trailer_roll_rate: -1.0, ..Truck::default() };
    let one = driven(&rig, SUBSTEP, 1, &control, &truck);
    let other = driven(&rig, SUBSTEP, 1, &control, &one);
    let both = driven(&rig, SUBSTEP, 2, &control, &truck);
    assert!(other.trailer_load_transfer_ratio.abs() < one.trailer_load_transfer_ratio.abs());
    assert_eq!(both.trailer_load_transfer_ratio, one.trailer_load_transfer_ratio);
    assert_eq!(both.position, other.position);
}

#[test]
fn the_path_is_limited_to_what_the_tyres_can_hold() {
    let rig = vehicle("daf_xf").rig("empty", SUBSTEP, None);
    let control = Control { steering: rig.steer_max, ..Control::default() };
    let truck = Truck { speed: 30.0 / 3.6, steering: rig.steer_max, ..Truck::default() };
    let after = driven(&rig, SUBSTEP, 2, &control, &truck);
    // 40 deg at 30 km/h would be 1.7 g; 0.7 g turns the tractor by 0.7 * 9.81 / 8.333 rad/s.
    assert!((after.heading / 0.1 - 0.7 * 9.81 / (30.0 / 3.6)).abs() < 1e-3, "{}", after.heading);
}
