//! A shipped policy drives a truck that the simulator does not move: a kinematic one, in the map's frame.
//!
//! `cargo run --release -p offtrack-evaluation --example observer`

use std::error::Error;
use std::sync::Arc;

use glam::DVec2;
use offtrack::layout::{Ended, Rig};
use offtrack::observer::{Observer, Pose, Telemetry};
use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use offtrack_policy::Policy;

/// Time that the truck's own equations are integrated by (s).
const STEP: f64 = 0.01;

/// Moves the truck: wheels that never slip, on both units.
fn drive(rig: &Rig, steering: f32, pose: &mut Pose, telemetry: &mut Telemetry) {
    let turn = rig.steer_rate * STEP as f32;
    telemetry.steering += (steering - telemetry.steering).clamp(-turn, turn);
    pose.speed += telemetry.acceleration * STEP as f32;
    let (speed, articulation) = (f64::from(pose.speed), pose.heading - pose.trailer_heading);
    let yaw_rate = speed * f64::from(telemetry.steering).tan() / f64::from(rig.wheelbase);
    let hitch = f64::from(rig.fifth_wheel) * yaw_rate;
    let trailer_yaw_rate = (speed * articulation.sin() + hitch * articulation.cos()) / f64::from(rig.trailer_wheelbase);
    pose.position += STEP * speed * DVec2::from_angle(pose.heading);
    pose.heading += STEP * yaw_rate;
    pose.trailer_heading += STEP * trailer_yaw_rate;
    telemetry.lateral_acceleration = (speed * trailer_yaw_rate) as f32;
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut scenario = Scenario::named("laden2026")?.typical();
    scenario.keep(&[Split::Test]);
    let (world, policy) = (Arc::new(World::bake(&scenario)?), Policy::shipped("laden2026")?);
    policy.check(&world)?;
    let mut observer = Observer::new(world.clone(), 0, 0)?;
    let (start, heading) = observer.waypoints().next().ok_or("a route has waypoints")?;
    let position = start - 0.5 * f64::from(observer.rig().wheelbase) * DVec2::from_angle(heading);
    let mut pose = Pose { position, heading, trailer_heading: heading, speed: 8.0 };
    let mut telemetry = Telemetry { target_speed: pose.speed, ..Telemetry::default() };
    let (mut seen, mut steps, mut farthest) = (observer.begin(&pose)?, 0, 0.0_f32);
    while seen.ended == Ended::Running {
        let action = policy.act_beside(&[seen.values], &[seen.extras])[0];
        let command = observer.command(action, telemetry.target_speed)?;
        telemetry.target_speed = command.speed;
        telemetry.acceleration = observer.speed_control(pose.speed, command.speed)?;
        let rig = *observer.rig();
        (0..10).for_each(|_| drive(&rig, command.steering, &mut pose, &mut telemetry));
        seen = observer.observe(&pose, &telemetry)?;
        (steps, farthest) = (steps + 1, farthest.max(seen.progress.lane_distance));
    }
    let (name, time) = (&world.route_names[0], f64::from(steps) / 10.0);
    println!("{name}: {} after {time:.1} s, at most {farthest:.1} m from its lane's centre", seen.ended.name());
    Ok(())
}
