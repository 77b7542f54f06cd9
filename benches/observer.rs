//! Observations a second that one core makes of trucks which something else drives.
//!
//! `cargo run --release --example observe_speed -- [ROUNDS]`: 1,001 rounds unless stated; the fastest, which other
//! programs have slowed least, and the median are printed. Poses are those of trucks under way on all routes of the
//! benchmark, so that no two in a row lie near each other.

use std::error::Error;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use offtrack::observer::{Observer, Pose, Telemetry};
use offtrack::scenario::Scenario;
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::world::World;

/// Trucks of a round: a few milliseconds, which other programs often leave alone.
const N_TRUCKS: u32 = 512;
/// Steps that they have made.
const UNDER_WAY: usize = 40;

fn main() -> Result<(), Box<dyn Error>> {
    let rounds = std::env::args().nth(1).map_or(Ok(1_001), |word| word.parse::<usize>())?.max(1);
    for name in ["attard2023", "laden2026"] {
        let world = Arc::new(World::bake(&Scenario::named(name)?)?);
        let routes = RouteChoice::Drawn((0..world.routes.len() as u32).collect());
        let mut simulator = Simulator::new(world.clone(), N_TRUCKS as usize, 0, routes)?;
        (0..UNDER_WAY).for_each(|_| simulator.step_at_random());
        let mut observers = Vec::new();
        for truck in &simulator.batch().truck {
            let mut observer = Observer::new(world.clone(), truck.route, truck.vehicle)?;
            let pose = Pose {
                position: observer.frame().to_map(truck.position.as_dvec2()),
                heading: truck.heading.into(),
                trailer_heading: truck.trailer_heading.into(),
                speed: truck.speed,
            };
            observer.begin(&pose)?;
            observers.push((observer, pose));
        }
        let mut speeds = Vec::new();
        for _ in 0..rounds {
            let begun = Instant::now();
            for (observer, pose) in &mut observers {
                black_box(observer.observe(pose, &Telemetry::default())?);
            }
            speeds.push(f64::from(N_TRUCKS) / begun.elapsed().as_secs_f64());
        }
        speeds.sort_by(f64::total_cmp);
        let [fastest, median] = [speeds[rounds - 1], speeds[rounds / 2]].map(|speed| speed / 1e3);
        println!("{name}: {fastest:.0} k observations/s on one core, median {median:.0} k");
    }
    Ok(())
}
