//! How fast a vehicle can drive a route: a speed at every waypoint, from the lateral acceleration that its tyres and
//! its load hold, and from its brakes and its drive.
//!
//! Forward and backward passes over a speed limit are the usual profile of minimum time (J. Bobrow et al., 1985). The
//! tractor follows the lane's centre; its trailer cuts the bend and still turns where the tractor drives straight
//! again. Lock and steer rate are not part of it: [`crate::vehicle::swept::demands`] says where a line asks for more
//! than they give.

use std::f64::consts::PI;

use crate::layout::{Rig, WaypointRow};
use crate::vehicle::GRAVITY;

/// Load transfer ratio that a steady turn may reach: what is left is for the roll to swing.
const LOAD_TRANSFER_MAX: f64 = 0.7;
/// Fraction of the tyres' grip that a bend may take: what is left is for steering.
const GRIP_MAX: f64 = 0.8;
/// Least that a road's fall leaves of what the trailer's load holds: a truck that it nearly tips crawls (m/s^2).
const HELD_MIN: f64 = 0.005 * GRAVITY;
/// Mean braking that the speed control reaches where it asks for more as the error grows (m/s^2).
const BRAKING: f64 = 1.2;
/// Lowest speed of a profile whose highest is not lower still (m/s).
const SLOWEST: f64 = 1.0;

/// Speeds along a route.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Speed at each waypoint (m/s).
    pub speeds: Vec<f64>,
    /// Time from the first waypoint to the last (s).
    pub time: f64,
}

impl Profile {
    /// The fastest of a vehicle on a route, at most `fastest` (m/s). The route has at least two waypoints.
    pub fn of(rig: &Rig, waypoints: &[WaypointRow], fastest: f64) -> Profile {
        let lengths: Vec<f64> =
            waypoints.windows(2).map(|pair| f64::from(pair[0].position.distance(pair[1].position))).collect();
        let slowest = SLOWEST.min(fastest);
        let mut speeds: Vec<f64> =
            limits(rig, waypoints, &lengths).into_iter().map(|limit| limit.clamp(slowest, fastest)).collect();
        let braking = BRAKING.min(-f64::from(rig.speed_braking));
        for index in (0..lengths.len()).rev() {
            speeds[index] = speeds[index].min((speeds[index + 1].powi(2) + 2.0 * braking * lengths[index]).sqrt());
        }
        for index in 0..lengths.len() {
            let drive = f64::from(rig.acceleration_max).min(f64::from(rig.power) / speeds[index]);
            speeds[index + 1] = speeds[index + 1].min((speeds[index].powi(2) + 2.0 * drive * lengths[index]).sqrt());
        }
        let time = lengths.iter().zip(speeds.windows(2)).map(|(length, pair)| 2.0 * length / (pair[0] + pair[1])).sum();
        Profile { speeds, time }
    }

    /// The lowest speed of the waypoints from `from` on, as far as `distance` (m) reaches, where they are `spacing`
    /// (m) apart (m/s).
    pub fn lowest_ahead(&self, from: usize, distance: f64, spacing: f64) -> f64 {
        let from = from.min(self.speeds.len() - 1);
        // Two waypoints of a planned line may coincide: the quotient is infinite then.
        let to = from.saturating_add((distance / spacing).ceil() as usize).saturating_add(1).min(self.speeds.len());
        self.speeds[from..to].iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// The speed at each waypoint that neither the tractor's grip nor the trailer's load allow to exceed (m/s).
fn limits(rig: &Rig, waypoints: &[WaypointRow], lengths: &[f64]) -> Vec<f64> {
    let heading = |index: usize| f64::from(waypoints[index].direction.y).atan2(waypoints[index].direction.x.into());
    let turn = |from: f64, to: f64| (to - from + 3.0 * PI).rem_euclid(2.0 * PI) - PI;
    let grip = GRIP_MAX * f64::from(rig.lateral_acceleration_max);
    let (level, fall) = (LOAD_TRANSFER_MAX * f64::from(rig.rollover_threshold) * GRAVITY, f64::from(rig.crossfall));
    let last = waypoints.len() - 1;
    let mut articulation = 0.0f64;
    let limit = |index: usize| {
        let (before, after) = (index.saturating_sub(1), (index + 1).min(last));
        let curvature =
            turn(heading(before), heading(after)).abs() / lengths[before..after].iter().sum::<f64>().max(1e-6);
        if 0 < index {
            // The trailer turns towards the tractor by the sine of the articulation over its wheelbase.
            let turned = turn(heading(index - 1), heading(index));
            let followed = articulation.sin() * lengths[index - 1] / f64::from(rig.trailer_wheelbase);
            articulation += turned - followed;
        }
        // A road that falls to the right takes from what a bend to the left may have, and gives it to one to the right.
        let held = (level - articulation.signum() * fall).max(HELD_MIN);
        let trailer_curvature = (articulation.sin() * articulation.cos()).abs() / f64::from(rig.trailer_wheelbase);
        (grip / curvature.max(1e-6)).min(held / trailer_curvature.max(1e-6)).sqrt()
    };
    (0..waypoints.len()).map(limit).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::vehicle::Vehicle;

    /// 100 m straight, three quarters of a circle of 20 m, 100 m straight.
    fn waypoints() -> Vec<WaypointRow> {
        let mut rows = Vec::new();
        let (mut position, mut heading) = (Vec2::ZERO, 0.0f32);
        for index in 0..147 {
            let direction = Vec2::from_angle(heading);
            rows.push(WaypointRow { position, direction });
            position += 2.0 * direction;
            heading += if (50..97).contains(&index) { 2.0 / 20.0 } else { 0.0 };
        }
        rows
    }

    fn profile(load: &str) -> Profile {
        Profile::of(&Vehicle::named("daf_xf").unwrap().rig(load, 0.05, None), &waypoints(), 50.0 / 3.6)
    }

    #[test]
    fn a_laden_truck_slows_down_for_a_bend_and_accelerates_out_of_it() {
        let Profile { speeds, time } = profile("laden");
        // The trailer's path has a radius of sqrt(20² - 7.756²) = 18.4 m in a steady turn at 0.7 of 0.41 g. Its own
        // lateral acceleration is v² sin cos / wheelbase = v² 0.388 0.922 / 7.756.
        let slowest = speeds[80];
        let expected = (0.7 * 0.412 * GRAVITY * 7.756 / (0.388 * 0.922)).sqrt();
        assert!((slowest - expected).abs() < 0.15, "{slowest} {expected}");
        assert!(speeds[0] == 50.0 / 3.6 && speeds[40] < speeds[30] && speeds[98] < speeds[140]);
        for pair in speeds.windows(2) {
            let acceleration = (pair[1].powi(2) - pair[0].powi(2)) / 4.0;
            // Positions are f32: 4e-6 m of 2 m.
            assert!((-BRAKING - 1e-4..=0.7 + 1e-4).contains(&acceleration), "{acceleration}");
        }
        let mean = 292.0 / time;
        assert!(slowest < mean && mean < speeds[0], "{mean}");
    }

    #[test]
    fn a_road_that_falls_outwards_slows_a_bend_down_and_one_that_falls_inwards_does_not() {
        let mut vehicle = Vehicle::named("daf_xf").unwrap();
        let mut slowest = |crossfall: f64| {
            vehicle.model.crossfall = crossfall;
            let rig = vehicle.rig("laden", 0.05, None);
            Profile::of(&rig, &waypoints(), 50.0 / 3.6).speeds[80].powi(2)
        };
        // The bend is to the left, and a positive fall to the right.
        let [outwards, level, inwards] = [0.04, 0.0, -0.04].map(&mut slowest);
        let held = 0.7 * 0.412;
        assert!((outwards / level - (held - 0.04) / held).abs() < 2e-3, "{outwards} {level}");
        assert!((inwards / level - (held + 0.04) / held).abs() < 2e-3, "{inwards} {level}");
    }

    #[test]
    fn an_empty_truck_is_faster_than_a_laden_one_and_that_than_a_high_one() {
        let times = ["empty", "half", "laden", "laden_high", "laden_worst"].map(|load| profile(load).time);
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "{times:?}");
    }

    #[test]
    fn a_benchmark_slower_than_the_slowest_profile_is_driven_at_its_own_speed() {
        let rig = Vehicle::named("daf_xf").unwrap().rig("laden", 0.05, None);
        for fastest in [0.01, 1.0 / 3.6, 3.5 / 3.6] {
            let Profile { speeds, time } = Profile::of(&rig, &waypoints(), fastest);
            assert!(speeds.iter().all(|&speed| speed == fastest), "{fastest}");
            assert!((time * fastest - 292.0).abs() < 1e-3, "{fastest}: {time}");
        }
    }

    #[test]
    fn waypoints_in_one_place_have_every_later_one_within_reach() {
        let profile = Profile { speeds: vec![9.0, 8.0, 7.0], time: 0.0 };
        assert_eq!([profile.lowest_ahead(1, 3.0, 0.0), profile.lowest_ahead(0, 0.0, 0.0)], [7.0, 9.0]);
    }

    #[test]
    fn the_lowest_speed_ahead_is_that_of_the_waypoints_within_reach() {
        let profile = Profile { speeds: vec![9.0, 8.0, 7.0, 6.0, 7.0], time: 0.0 };
        assert_eq!(
            [profile.lowest_ahead(0, 0.0, 2.0), profile.lowest_ahead(0, 3.0, 2.0), profile.lowest_ahead(9, 3.0, 2.0)],
            [9.0, 7.0, 7.0]
        );
    }
}
