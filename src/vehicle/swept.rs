//! The path that both units sweep when the front axle follows a lane's centre line exactly, and what that asks of the
//! truck.
//!
//! Both depend on vehicle, speed and line alone and are computed in f64. The path itself knows no limit: it turns as
//! sharply as the line does. Whether lock, steer rate, tyres and load allow that, [`demands`] says. Pictures and
//! reports use both.

mod clearance;
mod demand;
mod extent;

use glam::DVec2;

use crate::geometry::{Curve, Outline};
use crate::layout::{Body, Rig};
pub use clearance::{UnitClearance, nearest, swept_area};
pub use demand::{Demand, Limit, demands, steer_angle_max};
pub use extent::{Section, beside, front_path, off_tracking, sections};

/// Pose of both units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Middle of the drive axle (m).
    pub position: DVec2,
    /// Heading of the tractor (rad).
    pub heading: f64,
    /// Middle of the trailer's axle group (m).
    pub trailer_position: DVec2,
    /// Heading of the trailer (rad).
    pub trailer_heading: f64,
}

impl Pose {
    /// Corners of the tractor's outline, counter-clockwise from front left (m).
    pub fn tractor_corners(&self, rig: &Rig) -> [DVec2; 4] {
        corners(&rig.tractor_body, self.position, self.heading)
    }

    /// Corners of the trailer's outline, counter-clockwise from front left (m).
    pub fn trailer_corners(&self, rig: &Rig) -> [DVec2; 4] {
        corners(&rig.trailer_body, self.trailer_position, self.trailer_heading)
    }
}

/// The lengths that decide how the trailer follows, at one speed.
#[derive(Debug, Clone, Copy)]
struct Towing {
    /// Speed of the front axle (m/s).
    speed: f64,
    wheelbase: f64,
    fifth_wheel: f64,
    trailer_wheelbase: f64,
    /// Slip of the tyres (rad/(m/s^2)).
    slip: f64,
    /// Most by which slip moves a unit's turning point ahead (m).
    slip_lever_max: f64,
    /// Length by which each (m/s)² lengthens the wheelbase as which the tractor steers (s²/m).
    understeer: f64,
}

/// Motion of both units at one instant.
#[derive(Debug, Clone, Copy)]
struct Turning {
    /// Speed of the drive axle along the tractor (m/s).
    along: f64,
    /// Yaw rate of the tractor (rad/s).
    yaw: f64,
    /// Speed of the trailer's axle group along the trailer (m/s).
    trailer_along: f64,
    /// Yaw rate of the trailer (rad/s).
    trailer_yaw: f64,
}

impl Towing {
    fn of(rig: &Rig, speed: f64) -> Towing {
        let wheelbase = f64::from(rig.wheelbase);
        let (fifth_wheel, trailer_wheelbase) = (f64::from(rig.fifth_wheel), f64::from(rig.trailer_wheelbase));
        let (slip, slip_lever_max) = (f64::from(rig.slip), f64::from(rig.slip_lever_max));
        let understeer = rig.understeer.into();
        Towing { speed, wheelbase, fifth_wheel, trailer_wheelbase, slip, slip_lever_max, understeer }
    }

    /// Length by which slip moves the turning point of a unit ahead whose axles have this speed along it (m/s) (m).
    fn slip_lever(&self, along: f64) -> f64 {
        (self.slip * along * along.abs()).clamp(-self.slip_lever_max, self.slip_lever_max)
    }

    /// Distance from the tractor's turning point to its front axle where its drive axle has this speed (m/s) (m).
    fn tractor_lever(&self, along: f64) -> f64 {
        // A bound that the simulator does not need, as there the wheels steer: it keeps the lever positive.
        self.wheelbase - self.slip_lever(along).min(0.8 * self.wheelbase)
    }

    /// Motion where the front axle moves in a direction relative to the tractor, at an articulation (rad).
    fn turning(&self, direction: f64, articulation: f64) -> Turning {
        let along = self.speed * direction.cos();
        let lever = self.tractor_lever(along);
        let yaw = self.speed * direction.sin() / lever;
        let (sin, cos) = articulation.sin_cos();
        let hitch = (self.fifth_wheel - (self.wheelbase - lever)) * yaw;
        let trailer_along = along * cos - hitch * sin;
        let trailer_yaw = (along * sin + hitch * cos) / (self.trailer_wheelbase - self.slip_lever(trailer_along));
        Turning { along, yaw, trailer_along, trailer_yaw }
    }
}

/// Corners of a body in a frame at `origin` with `heading`, counter-clockwise from front left (m).
pub fn corners(body: &Body, origin: DVec2, heading: f64) -> [DVec2; 4] {
    let ahead = DVec2::from_angle(heading);
    let (front, rear, side) = (f64::from(body.front), f64::from(body.rear), f64::from(body.half_width) * ahead.perp());
    [
        origin + front * ahead + side,
        origin + rear * ahead + side,
        origin + rear * ahead - side,
        origin + front * ahead - side,
    ]
}

/// Poses every `spacing` metres of a truck whose front axle runs along `centre_line` at `speed`; both units start in
/// line with it.
///
/// The front axle's velocity points along the line; slip moves each unit's turning point ahead by `slip` times the
/// square of its axles' own speed, which shortens the lever of the turn, as in the single-track equations of
/// [`crate::engine::cpu::drive`].
pub fn swept_path(rig: &Rig, centre_line: &Curve, speed: f64, spacing: f64) -> Vec<Pose> {
    let towing = Towing::of(rig, speed);
    let Towing { wheelbase, fifth_wheel, trailer_wheelbase, .. } = towing;
    let rates = |line: f64, heading: f64, trailer_heading: f64| {
        let turning = towing.turning(line - heading, heading - trailer_heading);
        (turning.yaw, turning.trailer_yaw)
    };
    let pose = |station: f64, heading: f64, trailer_heading: f64| {
        let position = centre_line.point_at(station) - wheelbase * DVec2::from_angle(heading);
        let hitch = position + fifth_wheel * DVec2::from_angle(heading);
        let trailer_position = hitch - trailer_wheelbase * DVec2::from_angle(trailer_heading);
        Pose { position, heading, trailer_position, trailer_heading }
    };
    // Steps of 2 cm keep the midpoint rule's error below a millimetre on the tightest curve.
    let per_pose = (spacing / 0.02).ceil().max(1.0);
    let step = spacing / per_pose;
    let mut heading = centre_line.heading_at(0.0);
    let mut trailer_heading = heading;
    let mut poses = vec![pose(0.0, heading, trailer_heading)];
    let n_poses = (centre_line.length() / spacing).floor() as usize;
    for index in 0..n_poses {
        for part in 0..per_pose as usize {
            let station = index as f64 * spacing + part as f64 * step;
            let duration = step / speed;
            let (yaw, trailer_yaw) = rates(centre_line.heading_at(station), heading, trailer_heading);
            let line = centre_line.heading_at(station + 0.5 * step);
            let (yaw, trailer_yaw) =
                rates(line, heading + 0.5 * duration * yaw, trailer_heading + 0.5 * duration * trailer_yaw);
            heading += duration * yaw;
            trailer_heading += duration * trailer_yaw;
        }
        poses.push(pose((index + 1) as f64 * spacing, heading, trailer_heading));
    }
    poses
}

/// Whether no pose of the path touches what is solid to the tractor or to the trailer: then a truck that can steer it
/// need not leave its lane on this route. `kerbs` are those that each unit keeps to.
pub fn own_lane_suffices(rig: &Rig, [tractor, trailer]: [&Outline; 2], path: &[Pose]) -> bool {
    !path.iter().any(|pose| {
        tractor.intersects_rectangle(&pose.tractor_corners(rig))
            || trailer.intersects_rectangle(&pose.trailer_corners(rig))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::{Gutter, Road};
    use crate::vehicle::Vehicle;

    /// A ring of one lane and 17 m with four arms of this length (m).
    fn one_lane(length: u32) -> Road {
        let carriageway = |way: &str, offset: f64| {
            format!("[arm.{way}.kerb]\npoints = [{{ along = 30.0, offset = {offset:?} }}]\nring_radius = 15.0\n")
        };
        let arm = |(name, bearing): (&str, f64)| {
            let head = format!(
                "[[arm]]\nname = \"{name}\"\nbearing_deg = {bearing:?}\nlength = {length}.0\nlane_width = 4.0\n"
            );
            head + &carriageway("entry", 5.0) + &carriageway("exit", -5.0)
        };
        let arms: String = [("E", 0.0), ("N", 90.0), ("W", 180.0), ("S", 270.0)].map(arm).concat();
        let ring = "[ring]\nisland_radius = 10.0\ngutter = 0.5\nlane_width = 6.0\nlanes = 1\n";
        Road::from_toml("one", &format!("{ring}{arms}")).unwrap()
    }

    #[test]
    fn an_arm_too_short_for_the_truck_is_no_kerb_that_it_sweeps() {
        let rig = Vehicle::named("eu_4x2_13m6").unwrap().rig("empty", 0.05, None);
        let suffices = |length: u32, kerbs: fn(&Road) -> Outline| {
            let roundabout = one_lane(length);
            let routes = roundabout.routes(40.0, 35.0, 2.0).unwrap();
            let path = |line: &Curve| swept_path(&rig, line, 20.0 / 3.6, 0.25);
            let kerbs = kerbs(&roundabout);
            routes
                .iter()
                .map(|route| own_lane_suffices(&rig, [&kerbs; 2], &path(&route.centre_line)))
                .collect::<Vec<bool>>()
        };
        let beyond = |roundabout: &Road| roundabout.kerbs_beyond_ends(Gutter::Drivable);
        let (short, long) = (suffices(70, beyond), suffices(90, beyond));
        let n_own = long.iter().filter(|&&own| own).count();
        assert!((short == long) && long.len() == 16 && 0 < n_own && n_own < 16, "{short:?} {long:?}");
        // With the road's end as a kerb no lane would do.
        assert!(!suffices(70, |roundabout| roundabout.kerbs(Gutter::Drivable)).contains(&true));
    }
}
