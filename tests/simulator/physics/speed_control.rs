//! The target speed is reached and held without overshoot.

use offtrack::layout::{Action, Control, Rig, Truck};
use offtrack::physics::controlled;
use offtrack::physics::driven;
use proptest::prelude::*;

use super::{VEHICLES, vehicle};

const SUBSTEP: f32 = 0.05;
const KMH: f32 = 1.0 / 3.6;
/// Largest overshoot (m/s).
const OVERSHOOT_MAX: f32 = 0.05 * KMH;

/// Drives at `target` for `seconds`: the truck, its control, and the largest overshoot (m/s).
fn approached(rig: &Rig, truck: Truck, control: Control, target: f32, seconds: f32) -> (Truck, Control, f32) {
    let from = truck.speed;
    let (mut truck, mut control, mut past) = (truck, control, 0.0f32);
    for _ in 0..(seconds / (2.0 * SUBSTEP)) as usize {
        control = controlled(rig, 2.0 * SUBSTEP, &Action { steering: 0.0, speed: target }, truck.speed, &control);
        truck = driven(rig, SUBSTEP, 2, &control, &truck);
        past = past.max((truck.speed - target) * (target - from).signum());
    }
    (truck, control, past)
}

#[test]
fn a_truck_reaches_its_target_speed_without_overshoot() {
    let mut checked = 0;
    for name in VEHICLES {
        let vehicle = vehicle(name);
        for load in vehicle.loads.keys() {
            let rig = vehicle.rig(load, SUBSTEP, None);
            for (from, to) in
                [(0.0, 30.0), (30.0, 0.0), (15.0, 30.0), (30.0, 15.0), (29.0, 30.0), (29.6, 30.0), (8.0, 8.3)]
            {
                let truck = Truck { speed: from * KMH, ..Truck::default() };
                let (truck, _, past) = approached(&rig, truck, Control::default(), to * KMH, 60.0);
                assert!(past <= OVERSHOOT_MAX, "{name} {load} {from} to {to} km/h: {} km/h past", past / KMH);
                assert!(
                    (truck.speed - to * KMH).abs() <= OVERSHOOT_MAX,
                    "{name} {load} {from} to {to} km/h: {} km/h",
                    truck.speed / KMH
                );
                checked += 1;
            }
        }
    }
    assert_eq!(checked, 10 * 5 * 7);
}

#[test]
fn an_integral_without_anti_windup_would_overshoot() {
    let rig = Rig { speed_integral_band: 1000.0, ..vehicle("daf_xf").rig("empty", SUBSTEP, None) };
    let (_, _, past) = approached(&rig, Truck::default(), Control::default(), 30.0 * KMH, 60.0);
    assert!(5.0 * OVERSHOOT_MAX < past, "{} km/h", past / KMH);
}

#[test]
fn a_constant_loss_of_drive_is_compensated_by_the_integral() {
    let rig = vehicle("daf_xf").rig("empty", SUBSTEP, None);
    let mut control = Control::default();
    let mut truck = Truck { speed: 30.0 * KMH, ..Truck::default() };
    for _ in 0..1200 {
        control = controlled(&rig, 2.0 * SUBSTEP, &Action { steering: 0.0, speed: 30.0 * KMH }, truck.speed, &control);
        // A slope or drag of 0.05 m/s^2: proportional control alone would settle 0.0625 m/s below the target.
        truck = driven(&rig, SUBSTEP, 2, &Control { acceleration: control.acceleration - 0.05, ..control }, &truck);
    }
    assert!((truck.speed - 30.0 * KMH).abs() < 0.005, "{} km/h", truck.speed / KMH);
}

#[test]
fn the_control_requests_no_more_than_the_truck_can_do() {
    let rig = vehicle("daf_xf").rig("laden", SUBSTEP, None);
    let ask =
        |speed, target| controlled(&rig, 0.1, &Action { steering: 0.3, speed: target }, speed, &Control::default());
    assert_eq!(ask(0.0, 8.0), Control { steering: 0.3, acceleration: 0.7, target_speed: 8.0, ..Control::default() });
    assert_eq!(ask(8.0, 0.0), Control { steering: 0.3, acceleration: -2.5, holds: 1, ..Control::default() });
}

proptest! {
    #[test]
    fn no_sequence_of_targets_makes_the_speed_overshoot(
        targets in prop::collection::vec((0.0f32..40.0, 0.1f32..30.0), 1..12),
        laden in any::<bool>(),
    ) {
        let rig = vehicle("daf_xf").rig(if laden { "laden" } else { "empty" }, SUBSTEP, None);
        let (mut truck, mut control) = (Truck::default(), Control::default());
        for (target, seconds) in targets {
            let (reached, last, past) = approached(&rig, truck, control, target * KMH, seconds);
            // A change by less than the band keeps the integral of the last approach, so the overshoot is at most twice
            // that of one approach.
            prop_assert!(past <= 2.0 * OVERSHOOT_MAX, "{} km/h past {target}", past / KMH);
            (truck, control) = (reached, last);
        }
    }
}
