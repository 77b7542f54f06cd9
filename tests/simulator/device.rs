//! The device beside the processor.

use std::sync::{Arc, OnceLock};

use offtrack::angle::wrapped;
use offtrack::gpu::{Columns, Device};
use offtrack::layout::Truck;
use offtrack::simulator::{Engine, RouteChoice, Simulator};
use offtrack::world::World;

/// The one device of all tests.
pub fn device() -> &'static Device {
    static DEVICE: OnceLock<Device> = OnceLock::new();
    DEVICE.get_or_init(|| Device::open(None).unwrap_or_else(|error| panic!("{error}")))
}

fn on_device(world: &Arc<World>, n_envs: usize, seed: u32, choice: &RouteChoice) -> Simulator {
    let engine = Engine::Gpu { device: device().clone(), columns: Columns::new() };
    Simulator::on(engine, world.clone(), n_envs, seed, choice.clone()).unwrap()
}

/// Largest difference between two angles or places.
fn apart(a: f32, b: f32) -> f32 {
    (a - b).abs()
}

#[test]
fn after_400_steps_every_truck_is_in_the_same_step_of_the_same_episode_as_on_the_processor() {
    let world = Arc::new(crate::benchmark("attard2023-full").1);
    let choice = RouteChoice::Drawn((0..world.routes.len() as u32).collect());
    let n_envs = 4096;
    let mut device = on_device(&world, n_envs, 5, &choice);
    let mut processor = Simulator::new(world.clone(), n_envs, 5, choice).unwrap();
    for _ in 0..400 {
        device.step_at_random();
        processor.step_at_random();
    }
    let (here, there) = (processor.batch(), device.batch());
    let same = |(here, there): &(&Truck, &Truck)| {
        (here.route, here.episode, here.steps, here.held) == (there.route, there.episode, there.steps, there.held)
    };
    let trucks = || here.truck.iter().zip(&there.truck);
    let shared = trucks().filter(same).count();
    let place = trucks().map(|(here, there)| here.position.distance(there.position)).fold(0.0, f32::max);
    let angle = |(here, there): (&Truck, &Truck)| {
        apart(wrapped(here.heading - there.heading), 0.0).max(apart(wrapped(here.trailer_heading - there.trailer_heading), 0.0))
    };
    let angle = trucks().map(angle).fold(0.0, f32::max);
    println!("{shared} of {n_envs} in the same step of the same episode, at most {place} m and {angle} rad apart");
    assert_eq!(shared, n_envs);
    assert!(10 * n_envs < processor.tally().unwrap().episodes() as usize, "too few episodes to say anything");
    // A millimetre and a milliradian are asked for; sums in another order cost a few units in the last place a step.
    assert!(place < 1e-3 && angle < 1e-3, "{place} m, {angle} rad");
}
