//! The single-track equations with their repairs against a dynamic single track: masses, tyre forces, a hitch force.
//!
//! The reference is integrated here and shares no line with the simulator. Linear tyres whose stiffness is a multiple
//! of their axle's load, as the slip coefficient K = 1 / (g CC) assumes; constant speed of the drive axle.

mod reference;

use glam::DVec2;
use offtrack::layout::{Control, Rig, Truck};
use offtrack::physics::{driven, motion_of};
use offtrack::vehicle::{GRAVITY, Model, Suspension, Vehicle};

use super::vehicle;
use reference::{Reference, State};

const SUBSTEP: f64 = 0.05;
/// Lateral acceleration beyond which no truck drives: an empty trailer rolls over at 0.77 g, tyres hold 0.7 g (m/s^2).
const GRIP: f64 = 6.5;

/// The truck with its repairs: the slip lever's bound, and the yaw that follows the front wheels.
fn repaired(name: &str, slip_lever: f64, yaw_lag: f64) -> Vehicle {
    let mut vehicle = vehicle(name);
    vehicle.model = Model { slip_lever, yaw_lag, ..Model::default() };
    vehicle
}

/// Off-tracking of the simulator's truck in the steady turn with its front axle on a circle of `radius` (m).
pub fn off_tracking(rig: &Rig, speed: f64, radius: f64) -> f64 {
    let (mut tight, mut wide) = (0.45f32, 0.02f32);
    let mut found = 0.0;
    for _ in 0..25 {
        let steering = 0.5 * (tight + wide);
        let control = Control { steering, ..Control::default() };
        let start = Truck { speed: speed as f32, steering, ..Truck::default() };
        let truck = driven(rig, SUBSTEP as f32, (400.0 / (speed * SUBSTEP)) as u32, &control, &start);
        let motion = motion_of(rig, &truck);
        let yaw_rate = f64::from(motion.yaw_rate);
        let front =
            DVec2::new(speed, f64::from(motion.side_speed) + f64::from(rig.wheelbase) * yaw_rate).length() / yaw_rate;
        // Velocity of the trailer's axle group: the hitch's, less the trailer's turning.
        let articulation = f64::from(truck.heading - truck.trailer_heading);
        let hitch = DVec2::new(speed, f64::from(motion.side_speed) + f64::from(rig.fifth_wheel) * yaw_rate);
        let axle = DVec2::from_angle(articulation).rotate(hitch)
            - DVec2::new(0.0, f64::from(rig.trailer_wheelbase) * f64::from(motion.trailer_yaw_rate));
        found = front - axle.length() / yaw_rate;
        if front < radius { tight = steering } else { wide = steering }
    }
    found
}

/// Every speed and radius that a truck can hold: km/h, m.
fn circles() -> Vec<(f64, f64)> {
    let speeds = [5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0];
    let all = speeds.into_iter().flat_map(|speed| [12.0, 15.0, 18.0, 21.0, 25.0, 30.0].map(|radius| (speed, radius)));
    all.filter(|(speed, radius)| (speed / 3.6f64).powi(2) / radius < GRIP).collect()
}

#[test]
fn off_tracking_in_a_circle_is_that_of_a_dynamic_single_track() {
    let mut checked = 0;
    for name in ["daf_xf", "eu_4x2_13m6"] {
        for load in ["empty", "laden"] {
            let vehicle = repaired(name, 4.0, 1.0);
            let rig = Rig { lateral_acceleration_max: 1e6, ..vehicle.rig(load, SUBSTEP as f32, None) };
            let reference = Reference::of(&vehicle, load);
            for (speed, radius) in circles() {
                let found = off_tracking(&rig, speed / 3.6, radius);
                let expected = reference.off_tracking(speed / 3.6, radius);
                let bound = if speed <= 30.0 { 0.05 } else { 0.10 };
                println!(
                    "{name} {load} {speed} km/h {radius} m: {found:.3} m, reference {expected:.3} m, {:.3}",
                    found - expected
                );
                assert!(
                    (found - expected).abs() <= bound,
                    "{name} {load} {speed} km/h {radius} m: {found} m, reference {expected} m"
                );
                checked += 1;
            }
        }
    }
    assert!(100 < checked, "{checked}");
}

#[test]
fn without_the_repairs_both_comparisons_fail() {
    let plain = repaired("daf_xf", 1.5, 0.0);
    let rig = Rig { lateral_acceleration_max: 1e6, ..plain.rig("laden", SUBSTEP as f32, None) };
    let reference = Reference::of(&plain, "laden");
    assert!(0.3 < off_tracking(&rig, 40.0 / 3.6, 21.0) - reference.off_tracking(40.0 / 3.6, 21.0));
    let (trailer, ..) = bend(&plain, "laden", 30.0);
    assert!(0.4 < trailer, "{trailer}");
}

/// Steer angle of an S at a time: to one side, to the other, and back (rad).
fn s_bend(t: f64, most: f64, rate: f64) -> f64 {
    let (ramp, hold) = (most / rate, 2.5);
    let first = t.min(ramp) - (t - ramp - hold).clamp(0.0, 2.0 * ramp) + (t - 3.0 * ramp - 2.0 * hold).clamp(0.0, ramp);
    rate * first
}

/// Both trucks steered through the same S at a speed (km/h): the largest distance of their trailers' axles (m), the
/// largest off-tracking of each (m), the peak of each trailer's load transfer ratio.
fn bend(vehicle: &Vehicle, load: &str, speed: f64) -> (f64, [f64; 2], [f64; 2]) {
    let (rig, reference) = (vehicle.rig(load, SUBSTEP as f32, None), Reference::of(vehicle, load));
    let speed = speed / 3.6;
    // Steady lateral acceleration of 0.2 g, and 12 degrees at most.
    let most = (vehicle.tractor.wheelbase * 0.2 * GRAVITY / (speed * speed)).atan().min(12f64.to_radians());
    // A ramp takes half a second at least: a step at 50 km/h makes the ratio of an empty trailer 7 % too large.
    let rate = vehicle.tractor.steer_rate.min(15f64.to_radians()).min(2.0 * most);
    let mut truck = Truck { speed: speed as f32, ..Truck::default() };
    let (mut state, mut roll) = (State::default(), [0.0, 0.0]);
    let (mut apart, mut ratios) = (0.0f64, [0.0f64; 2]);
    let mut paths: [Vec<[DVec2; 2]>; 2] = Default::default();
    for step in 0..(12.0 / SUBSTEP) as usize {
        let [from, to] = [step, step + 1].map(|index| s_bend(index as f64 * SUBSTEP, most, rate));
        truck = driven(&rig, SUBSTEP as f32, 1, &Control { steering: to as f32, ..Control::default() }, &truck);
        let acceleration;
        (state, acceleration) = reference.driven(state, speed, from, to, SUBSTEP);
        let suspension = &vehicle.loads[load].suspension;
        let ratio = rolled(suspension, &mut roll, acceleration);
        ratios = [ratios[0].max(truck.trailer_load_transfer_ratio.abs().into()), ratios[1].max(ratio.abs())];
        let trailers = [truck.trailer_position(&rig).as_dvec2(), reference.trailer_position(&state)];
        apart = apart.max(trailers[0].distance(trailers[1]));
        let ahead = |heading: f64| vehicle.tractor.wheelbase * DVec2::from_angle(heading);
        let fronts = [truck.position.as_dvec2() + ahead(truck.heading.into()), state.position + ahead(state.heading)];
        (0..2).for_each(|index| paths[index].push([fronts[index], trailers[index]]));
    }
    (apart, paths.map(|path| largest_off_tracking(&path)), ratios)
}

/// One sub-step of the roll by RK4 with a held lateral acceleration (m/s^2), and the load transfer ratio after it.
fn rolled(suspension: &Suspension, state: &mut [f64; 2], acceleration: f64) -> f64 {
    let Suspension { centre_of_gravity, roll_centre, track, roll_gain, roll_frequency, roll_damping } = *suspension;
    let natural = std::f64::consts::TAU * roll_frequency;
    let rates = |[roll, rate]: [f64; 2]| {
        [rate, natural * natural * (roll_gain * acceleration / GRAVITY - roll) - 2.0 * roll_damping * natural * rate]
    };
    let plus = |a: [f64; 2], b: [f64; 2], h: f64| [a[0] + h * b[0], a[1] + h * b[1]];
    let h = SUBSTEP;
    let first = rates(*state);
    let second = rates(plus(*state, first, 0.5 * h));
    let third = rates(plus(*state, second, 0.5 * h));
    let last = rates(plus(*state, third, h));
    *state = plus(plus(plus(plus(*state, first, h / 6.0), second, h / 3.0), third, h / 3.0), last, h / 6.0);
    let lever = centre_of_gravity - roll_centre;
    let settled =
        lever * (1.0 + 1.0 / roll_gain) * state[0] + 2.0 * roll_damping * lever / (roll_gain * natural) * state[1];
    2.0 / track * (roll_centre * acceleration / GRAVITY + settled)
}

/// Largest distance of a trailer's axle from the path of the front axle, of (front, trailer) positions (m).
fn largest_off_tracking(path: &[[DVec2; 2]]) -> f64 {
    let before = std::iter::once(path[0][0] - 20.0 * DVec2::X);
    let front: Vec<DVec2> = before.chain(path.iter().map(|pair| pair[0])).collect();
    let nearest = |point: DVec2| {
        front.windows(2).map(|pair| distance_to_segment(point, pair[0], pair[1])).fold(f64::MAX, f64::min)
    };
    path.iter().map(|&[_, trailer]| nearest(trailer)).fold(0.0, f64::max)
}

fn distance_to_segment(point: DVec2, from: DVec2, to: DVec2) -> f64 {
    let along = to - from;
    let fraction = (point - from).dot(along) / along.length_squared().max(1e-12);
    point.distance(from + fraction.clamp(0.0, 1.0) * along)
}

#[test]
fn an_s_bend_is_that_of_a_dynamic_single_track_with_equal_steering() {
    for name in ["daf_xf", "eu_4x2_13m6"] {
        for load in ["empty", "laden"] {
            let vehicle = repaired(name, 4.0, 1.0);
            for speed in [5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0] {
                let (trailer, [found, expected], [ratio, reference]) = bend(&vehicle, load, speed);
                let case = format!("{name} {load} {speed} km/h");
                println!(
                    "{case}: {trailer:.3} m, off-tracking {found:.3} of {expected:.3} m, ratio {ratio:.3} of \
                     {reference:.3}"
                );
                let bound = if speed <= 30.0 { 0.05 } else { 0.10 };
                assert!((found - expected).abs() <= bound, "{case}: off-tracking {found} m, reference {expected} m");
                // Where no wheel is near to lifting the point that lateral acceleration is taken at counts for more.
                assert!(
                    (ratio - reference).abs() <= 0.05 * reference.max(0.3),
                    "{case}: ratio {ratio}, reference {reference}"
                );
            }
        }
    }
}
