//! Lags and limits of a vehicle's model, each by its closed form.

use offtrack::layout::{Action, Control, Rig, Truck};
use offtrack::physics::controlled;
use offtrack::physics::{drive_max, driven, motion_of};
use offtrack::vehicle::{GRAVITY, Model};

use super::vehicle;

const SUBSTEP: f32 = 0.05;

fn rig(model: Model) -> Rig {
    let mut vehicle = vehicle("daf_xf");
    vehicle.model = model;
    vehicle.rig("laden", SUBSTEP, None)
}

fn driving(rig: &Rig, control: &Control, truck: Truck, seconds: f32) -> Truck {
    driven(rig, SUBSTEP, (seconds / SUBSTEP).round() as u32, control, &truck)
}

#[test]
fn the_drive_and_the_brakes_come_with_their_own_lags() {
    let rig = rig(Model { drive_lag: 0.5, brake_lag: 0.25, ..Model::default() });
    let start = Truck { speed: 8.0, ..Truck::default() };
    for (asked, lag) in [(0.6f32, 0.5f32), (-2.0, 0.25)] {
        let truck = driving(&rig, &Control { acceleration: asked, ..Control::default() }, start, 0.5);
        let left = (-0.5 / lag).exp();
        assert!((truck.acceleration - asked * (1.0 - left)).abs() < 1e-5, "{}", truck.acceleration);
        // The integral of asked (1 - exp(-t / lag)).
        let gained = asked * (0.5 - lag * (1.0 - left));
        assert!((truck.speed - 8.0 - gained).abs() < 1e-5, "{}", truck.speed);
    }
}

#[test]
fn the_yaw_follows_a_step_of_the_wheels_with_its_time_constant() {
    let rig = rig(Model { yaw_lag: 1.0, ..Model::default() });
    let (speed, steering) = (8.0f32, 0.1f32);
    // The wheels have jumped: nothing of the curvature is there yet.
    let missing = -steering.tan() / rig.wheelbase;
    let start = Truck { speed, steering, curvature_lag: missing, ..Truck::default() };
    assert!(motion_of(&rig, &start).yaw_rate.abs() < 1e-6);
    let truck = driving(&rig, &Control { steering, ..Control::default() }, start, 0.2);
    let expected = missing * (-0.2 / (0.0185 * speed)).exp();
    // The Padé approximant of the exponential in four sub-steps.
    assert!((truck.curvature_lag - expected).abs() < 0.01 * missing.abs(), "{} {expected}", truck.curvature_lag);
    // Slowly or at a standstill the lag is none.
    let slow = driving(&rig, &Control { steering, ..Control::default() }, Truck { speed: 0.1, ..start }, 0.2);
    assert!(slow.curvature_lag.abs() < 1e-3 * missing.abs());
}

#[test]
fn while_the_wheels_turn_steadily_the_yaw_lags_by_their_rate_times_its_time_constant() {
    let rig = Rig { steer_rate: 0.05, ..rig(Model { yaw_lag: 1.0, ..Model::default() }) };
    let truck =
        driving(&rig, &Control { steering: 0.5, ..Control::default() }, Truck { speed: 8.0, ..Truck::default() }, 2.0);
    let rate = 0.05 / truck.steering.cos().powi(2) / rig.wheelbase;
    let expected = -rate * 0.0185 * 8.0;
    assert!((truck.curvature_lag - expected).abs() < 0.01 * expected.abs(), "{} {expected}", truck.curvature_lag);
}

#[test]
fn power_limits_the_drive_at_speed() {
    let rig = rig(Model { power: Some(340_000.0), ..Model::default() });
    // 340 kW over 40 t.
    assert_eq!(drive_max(&rig, 5.0), 0.7);
    assert!((drive_max(&rig, 17.0) - 0.5).abs() < 1e-6);
    let control = controlled(&rig, 0.1, &Action { steering: 0.0, speed: 25.0 }, 17.0, &Control::default());
    assert!((control.acceleration - 0.5).abs() < 1e-6 && control.speed_error_integral == 0.0);
    let truck = driving(
        &rig,
        &Control { acceleration: 9.0, ..Control::default() },
        Truck { speed: 17.0, ..Truck::default() },
        0.05,
    );
    assert!((truck.acceleration - 0.5).abs() < 1e-6);
}

#[test]
fn braking_takes_lateral_grip_by_the_friction_ellipse() {
    let ellipse = rig(Model { friction_ellipse: true, ..Model::default() });
    let grip = (0.7 * GRAVITY) as f32;
    let tight = Truck { speed: 10.0, steering: 0.6, ..Truck::default() };
    assert!((motion_of(&ellipse, &tight).lateral_acceleration - grip).abs() < 1e-4);
    let braking = Truck { acceleration: -5.0, ..tight };
    assert!((motion_of(&ellipse, &braking).lateral_acceleration - (grip * grip - 25.0).sqrt()).abs() < 1e-3);
    assert!((motion_of(&rig(Model::default()), &braking).lateral_acceleration - grip).abs() < 1e-4);
}

#[test]
fn a_steer_command_takes_effect_after_its_delay() {
    let (step, steps) = (0.1f32, 4);
    for (delay, expected) in [
        (0.0, [2, 4, 6, 8]),
        (0.05, [1, 3, 5, 7]),
        (0.1, [0, 2, 4, 6]),
        (0.15, [0, 1, 3, 5]),
        (0.2, [0, 0, 2, 4]),
        (0.25, [0, 0, 1, 3]),
        (0.3, [0, 0, 0, 2]),
    ] {
        let rig = rig(Model { steer_delay: delay, ..Model::default() });
        let (mut control, mut truck) = (Control::default(), Truck { speed: 8.0, ..Truck::default() });
        for expected in expected.into_iter().take(steps) {
            control = controlled(&rig, step, &Action { steering: 0.6, speed: 8.0 }, truck.speed, &control);
            truck = driven(&rig, SUBSTEP, 2, &control, &truck);
            // The wheels move by a degree a sub-step.
            assert!(
                (truck.steering.to_degrees() - expected as f32).abs() < 1e-4,
                "{delay} s: {}",
                truck.steering.to_degrees()
            );
        }
    }
}

#[test]
fn a_road_that_falls_to_the_right_loads_the_right_wheels() {
    let vehicle = vehicle("daf_xf");
    let rig = rig(Model { crossfall: 0.025, ..Model::default() });
    let truck = driving(&rig, &Control::default(), Truck { speed: 8.0, ..Truck::default() }, 60.0);
    let truck = driving(&rig, &Control::default(), truck, 0.05);
    let expected = vehicle.loads["laden"].suspension.quasi_static_load_transfer_ratio(0.025 * GRAVITY);
    assert!(
        (f64::from(truck.trailer_load_transfer_ratio) - expected).abs() < 1e-3,
        "{}",
        truck.trailer_load_transfer_ratio
    );
}

/// A truck that has turned steadily for a minute.
fn turning(rig: &Rig, speed: f32, steering: f32) -> Truck {
    let control = Control { steering, ..Control::default() };
    let truck = driving(rig, &control, Truck { speed, ..Truck::default() }, 60.0);
    // Its load transfer ratios are then those of the end, and not the largest on the way.
    driving(rig, &control, truck, SUBSTEP)
}

#[test]
fn each_units_slip_grows_with_its_load_transfer_ratio() {
    let (speed, steering) = (6.0f32, 0.2f32);
    let with = |growth: f64| {
        let rig = rig(Model { slip_lever: 4.0, slip_growth: growth, fifth_wheel_load: 0.26, ..Model::default() });
        let truck = turning(&rig, speed, steering);
        (rig, truck, motion_of(&rig, &truck))
    };
    let bent = |truck: &Truck| (truck.heading - truck.trailer_heading).abs();
    let (_, plain, _) = with(0.0);
    for growth in [0.5, 1.0, 2.0] {
        let (rig, truck, motion) = with(growth);
        let slip = |ratio: f32| rig.slip * (1.0 + growth as f32 * ratio.abs());
        // Slip shifts the points ahead about which the units turn, each by its own.
        let lever = slip(truck.tractor_load_transfer_ratio) * speed * speed;
        assert!((motion.side_speed + lever * motion.yaw_rate).abs() < 1e-4, "{growth}: {}", motion.side_speed);
        let trailer_speed = motion.trailer_lateral_acceleration / motion.trailer_yaw_rate;
        let lever = slip(truck.trailer_load_transfer_ratio) * trailer_speed * trailer_speed;
        let (sin, cos) = (truck.heading - truck.trailer_heading).sin_cos();
        let across = speed * sin + (motion.side_speed + rig.fifth_wheel * motion.yaw_rate) * cos;
        let yaw_rate = across / (rig.trailer_wheelbase - lever);
        assert!((motion.trailer_yaw_rate - yaw_rate).abs() < 1e-4, "{growth}: {yaw_rate}");
        assert!((motion.trailer_yaw_rate - motion.yaw_rate).abs() < 1e-4, "{growth}: the turn is not steady");
        assert!(bent(&truck) < bent(&plain) - 0.001 * growth as f32, "{growth}: it cuts in less");
    }
}

#[test]
fn understeer_takes_a_larger_steer_angle_by_the_square_of_the_speed() {
    let degrees = 1.2f64;
    let rig = rig(Model { understeer: degrees.to_radians(), ..Model::default() });
    for speed in [2.0f64, 8.0, 16.0] {
        let steering = 0.05f64;
        let motion = motion_of(&rig, &Truck { speed: speed as f32, steering: steering as f32, ..Truck::default() });
        // The steer angle of a path is that of its curvature, and so many degrees for each g of lateral acceleration.
        let curvature = f64::from(motion.yaw_rate) / speed;
        let needed = 3.543 * curvature + degrees.to_radians() * curvature * speed * speed / GRAVITY;
        assert!((needed - steering.tan()).abs() < 1e-6, "{speed} m/s: {needed}");
    }
    // A tractor with oversteer does not turn about itself, whatever its speed.
    let loose = Model { understeer: -5f64.to_radians(), ..Model::default() };
    let motion = motion_of(&self::rig(loose), &Truck { speed: 25.0, steering: 0.001, ..Truck::default() });
    assert!((motion.yaw_rate - 25.0 * 0.001 / (0.5 * 3.543)).abs() < 1e-5, "{}", motion.yaw_rate);
}

#[test]
fn the_load_on_the_fifth_wheel_leans_on_the_tractor() {
    let alone = turning(&rig(Model::default()), 6.0, 0.2);
    let truck = turning(&rig(Model { fifth_wheel_load: 0.26, ..Model::default() }), 6.0, 0.2);
    // 7.8 t of tractor, and 0.26 of 32.2 t on its fifth wheel.
    let (own, trailers) = (alone.tractor_load_transfer_ratio, alone.trailer_load_transfer_ratio);
    let expected = (7.8 * own + 0.26 * 32.2 * trailers) / (7.8 + 0.26 * 32.2);
    assert!((truck.tractor_load_transfer_ratio - expected).abs() < 1e-5);
    assert!(own.abs() < 0.8 * expected.abs() && truck.trailer_load_transfer_ratio == trailers);
}
