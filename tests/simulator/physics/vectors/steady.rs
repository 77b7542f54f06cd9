//! Reference vectors of steady turns, static rollover and paths followed by the front axle: no engine, geometry in f64.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec2;
use offtrack::geometry::{Curve, Piece};
use offtrack::layout::{Rig, Truck};
use offtrack::physics::motion_of;
use offtrack::vehicle::swept::swept_path;
use offtrack::vehicle::{SingleTrack, Suspension};
use serde_json::Value;

use super::super::{VEHICLES, vehicle};
use super::{Worst, kinematic, number, rows};

const FOOT: f64 = 0.3048;

pub(super) fn single_track(row: &Value) -> SingleTrack {
    SingleTrack { wheelbase: number(row, "L1"), fifth_wheel: number(row, "a"), trailer_wheelbase: number(row, "L2") }
}

pub(super) fn steady_state(written: &Value) -> Worst {
    let mut worst = Worst::default();
    let (length, angle) = (number(&written["tolerance"], "length"), number(&written["tolerance"], "angle"));
    for row in rows(written) {
        let track = single_track(row);
        let steady = track.at_front_radius(number(row, "Rf"));
        worst.see_option("gamma", steady.map(|steady| steady.articulation), &row["gamma"], angle);
        worst.see_option("R2", steady.map(|steady| steady.trailer_radius), &row["R2"], length);
        worst.see_option("offtracking", steady.map(|steady| steady.off_tracking()), &row["offtracking"], length);
        if let Some(steady) = steady {
            worst.see("delta", steady.steering - number(row, "delta"), angle);
            worst.see("R1", steady.tractor_radius - number(row, "R1"), length);
            worst.see("RH", steady.fifth_wheel_radius - number(row, "RH"), length);
            // In a steady turn of the simulator's own both units turn at one rate.
            let (steering, heading) = (steady.steering as f32, steady.articulation as f32);
            let turning =
                motion_of(&kinematic(row).rig(0.05), &Truck { speed: 5.0, steering, heading, ..Truck::default() });
            worst.see("rates", f64::from(turning.yaw_rate - turning.trailer_yaw_rate), 1e-5);
        }
    }
    worst
}

pub(super) fn steady_state_limit(written: &Value) -> Worst {
    let mut worst = Worst::default();
    for row in rows(written) {
        let critical = single_track(row).critical_steering();
        worst.see("critical", critical - number(row, "delta_critical"), number(&written["tolerance"], "angle"));
        assert!(
            single_track(row).at_steering(critical - 1e-3).is_some()
                && single_track(row).at_steering(critical + 1e-3).is_none()
        );
    }
    worst
}

pub(super) fn steady_envelope(written: &Value) -> Worst {
    let mut worst = Worst::default();
    let length = number(&written["tolerance"], "length_m");
    for row in rows(written) {
        // The directive's construction has the kingpin above the drive axle.
        let track = SingleTrack { wheelbase: 3.6, fifth_wheel: 0.0, trailer_wheelbase: number(row, "L2") };
        let steady = track.at_tractor_radius(number(row, "RH")).unwrap();
        worst.see("R2", steady.trailer_radius - number(row, "R2"), length);
        worst.see("inner", steady.trailer_radius - 0.5 * number(row, "width") - number(row, "r_inner"), length);
    }
    worst
}

pub(super) fn rollover_static(written: &Value) -> Worst {
    let mut worst = Worst::default();
    let tolerance = |key: &str| number(&written["tolerance"], key);
    for row in rows(written) {
        for name in VEHICLES {
            let load = &vehicle(name).loads[row["preset"].as_str().unwrap()];
            assert_eq!(load.mass, number(row, "m2"));
            let suspension = load.suspension;
            let rigid = Suspension { roll_gain: 0.0, ..suspension };
            worst.see("rigid", rigid.rollover_threshold() - number(row, "srt_rigid_g"), tolerance("g"));
            worst.see("srt", suspension.rollover_threshold() - number(row, "srt_g"), tolerance("g"));
            let ratio = suspension.quasi_static_load_transfer_ratio(0.3 * 9.81);
            worst.see("ltr", ratio - number(row, "ltr_qs_at_0p3g"), tolerance("ltr"));
            let keys = ["fn2", "zeta2", "hr2", "T2", "Rphi2"].map(|key| number(row, key));
            let Suspension { roll_frequency, roll_damping, roll_centre, track, roll_gain, .. } = suspension;
            assert_eq!([roll_frequency, roll_damping, roll_centre, track, roll_gain], keys);
        }
    }
    worst
}

/// Least distances of a point on the drive axle and one on the trailer's axle group, both `aside` metres left of the
/// middle, from the centre of a left turn, the front axle on a straight, an arc and a straight (m).
fn least_radii(rig: &Rig, radius: f64, turn: f64, aside: f64) -> (f64, f64) {
    let arc = Piece::Arc { centre: DVec2::ZERO, radius, from: -FRAC_PI_2, sweep: turn };
    let approach = Piece::Segment { from: arc.start() - DVec2::X, to: arc.start() };
    let departure = Piece::Segment { from: arc.end(), to: arc.end() + 30.0 * DVec2::from_angle(turn) };
    let poses = swept_path(rig, &Curve { pieces: vec![approach, arc, departure] }, 1.0, 0.05);
    let radius = |axle: DVec2, heading: f64| (axle + aside * DVec2::from_angle(heading).perp()).length();
    let drive = poses.iter().map(|pose| radius(pose.position, pose.heading)).fold(f64::INFINITY, f64::min);
    let trailer =
        poses.iter().map(|pose| radius(pose.trailer_position, pose.trailer_heading)).fold(f64::INFINITY, f64::min);
    (drive, trailer)
}

pub(super) fn path_follow(written: &Value) -> Worst {
    let mut worst = Worst::default();
    for row in rows(written) {
        // A vehicle without a trailer is given one whose path is not compared.
        let length = |key: &str| row[key].as_f64().map(|feet| feet * FOOT);
        let rig = Rig {
            wheelbase: length("L1_ft").unwrap() as f32,
            fifth_wheel: length("a_ft").unwrap_or(0.0) as f32,
            trailer_wheelbase: length("L2_ft").unwrap_or(10.0) as f32,
            ..Rig::default()
        };
        let radius = length("CTR_ft").or(length("R_ft")).unwrap();
        let turn = number(row, "turn_deg") / 360.0 * TAU;
        if let Some(width) = length("width_ft") {
            let (drive, trailer) = least_radii(&rig, radius, turn, 0.5 * width);
            let inside = if row["L2_ft"].is_null() { drive } else { trailer } / FOOT;
            let tolerance = number(&written["tolerance"], "length_ft");
            worst.see(
                &format!("{} published", row["vehicle"]),
                inside - number(row, "published_min_inside_radius_ft"),
                tolerance,
            );
            // The reference is the same equation, sampled every 5 cm here; without a trailer it looks no further than
            // the turn's end, which leaves out the last 0.038 ft of a city bus.
            let sampling = if row["L2_ft"].is_null() { 0.05 } else { 0.01 };
            let error = inside - number(row, "reference_min_inside_radius_ft");
            worst.see(&format!("{} reference", row["vehicle"]), error, sampling);
        } else {
            let (drive, trailer) = least_radii(&rig, radius, turn, 0.0);
            let tolerance = number(&written["tolerance"], "length_in");
            let inches = |least: f64| (radius - least) / FOOT * 12.0;
            worst.see("drive axles", inches(drive) - number(row, "published_drive_in"), tolerance);
            worst.see("trailer axles", inches(trailer) - number(row, "published_trailer_in"), tolerance);
        }
    }
    worst
}
