//! What only a device can do: drift from the CPU, be missing, be too small, be lost, hold external columns.

use std::sync::{Arc, OnceLock};

use offtrack::gpu::{Columns, Device, Error, Slice, adapters};
use offtrack::layout::angle::wrapped;
use offtrack::layout::{Column, Truck};
use offtrack::simulator::{self, Engine, RouteChoice, Simulator};
use offtrack::world::World;

use crate::{batch_on, benchmark};

/// The one device of all tests but the one that loses it: it offers what every device of WebGPU does, and no more.
fn device() -> &'static Device {
    static DEVICE: OnceLock<Device> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let least = |_: &wgpu::Adapter| (wgpu::Features::empty(), wgpu::Limits::default());
        Device::open_with(None, least).unwrap_or_else(|error| panic!("{error}"))
    })
}

/// The engine on it.
pub fn engine() -> Engine {
    Engine::Gpu { device: device().clone(), columns: Columns::new() }
}

fn full() -> (Arc<World>, RouteChoice) {
    let world = Arc::new(benchmark("attard2023-full").1);
    let choice = RouteChoice::Drawn((0..world.routes.len() as u32).collect());
    (world, choice)
}

#[test]
fn after_400_steps_every_truck_is_in_the_same_step_of_the_same_episode_as_on_the_cpu() {
    let (world, choice) = full();
    let n_envs = 4096;
    let mut device = batch_on(&engine(), &world, n_envs, 5, choice.clone());
    let mut cpu = batch_on(&Engine::Cpu, &world, n_envs, 5, choice);
    for _ in 0..400 {
        device.step_at_random();
        cpu.step_at_random();
    }
    let (here, there) = (cpu.batch(), device.batch());
    let trucks = || here.truck.iter().zip(&there.truck);
    let moment = |truck: &Truck| (truck.route, truck.episode, truck.steps, truck.held);
    let shared = trucks().filter(|(here, there)| moment(here) == moment(there)).count();
    let distance = trucks().map(|(here, there)| here.position.distance(there.position)).fold(0.0, f32::max);
    let turned = |angle: fn(&Truck) -> f32| {
        trucks().map(|(here, there)| wrapped(angle(here) - angle(there)).abs()).fold(0.0, f32::max)
    };
    let angle = turned(|truck| truck.heading).max(turned(|truck| truck.trailer_heading));
    println!("{shared} of {n_envs} in the same step of the same episode, at most {distance} m and {angle} rad apart");
    assert_eq!(shared, n_envs);
    let (here, there) = (cpu.tally().unwrap(), device.tally().unwrap());
    assert!(10 * n_envs < here.episodes() as usize, "too few episodes to say anything");
    assert_eq!(here.sums[..8], there.sums[..8]);
    // Engines sum in different orders: a few units in the last place a step.
    assert!(distance < 1e-3 && angle < 1e-3, "{distance} m, {angle} rad");
}

#[test]
fn an_adapter_that_is_not_there_is_refused_with_those_that_are() {
    let names: Vec<String> = adapters().into_iter().map(|adapter| adapter.name).collect();
    let error = Device::open(Some("no such adapter")).unwrap_err();
    assert_eq!(error, Error::UnknownAdapter { name: "no such adapter".to_owned(), found: names.clone() });
    assert!(
        error.to_string().contains("no such adapter") && names.iter().all(|name| error.to_string().contains(name)),
        "{error}"
    );
    // Part of a name in any case will do.
    let part: String = names[0].chars().take(6).collect();
    assert!(Device::open(Some(&part.to_uppercase())).unwrap().name().starts_with(&part));
}

#[test]
fn a_batch_too_large_for_the_adapter_is_refused_with_what_would_fit() {
    let (world, choice) = full();
    let limits = device().device.limits();
    let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    // The widest columns have 69 values of 4 bytes.
    let largest = (limit / (69 * 4)) as usize;
    let new = |n_envs| Simulator::on(engine(), world.clone(), n_envs, 0, choice.clone());
    let error = new(largest + 1).unwrap_err();
    let simulator::Error::Gpu(Error::TooManyTrucks { n_envs, buffer, n_bytes, limit: found, fitting, .. }) = &error
    else {
        panic!("{error}")
    };
    assert_eq!((*n_envs, *buffer, *n_bytes, *found), (largest + 1, "observation", (largest as u64 + 1) * 276, limit));
    assert_eq!(*fitting as usize, largest);
    let message = error.to_string();
    assert!(
        [&(largest + 1).to_string(), "observation", &limit.to_string(), &largest.to_string()]
            .iter()
            .all(|part| message.contains(*part))
    );
    // The number of bytes does not wrap around.
    for absurd in [1 << 62, usize::MAX] {
        assert!(matches!(new(absurd), Err(simulator::Error::Gpu(Error::TooManyTrucks { .. }))));
    }
    // The device still works.
    assert!(new(8).is_ok());
}

/// An external column.
fn slice(n_bytes: u64) -> Slice {
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    let descriptor = wgpu::BufferDescriptor { label: None, size: n_bytes, usage, mapped_at_creation: false };
    Slice { buffer: device().device.create_buffer(&descriptor), offset: 0, size: n_bytes }
}

#[test]
fn a_world_too_large_for_the_adapter_is_refused_with_the_number_of_roundabouts_that_would_fit() {
    let (world, choice) = full();
    let limits = device().device.limits();
    let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let mut large = World::clone(&world);
    // One field that is larger than the limit stands for many. Its zeros are never touched, so they take no memory.
    large.fields[0].values = vec![0; limit as usize / 4 + 1];
    let error = Simulator::on(engine(), Arc::new(large), 16, 0, choice).unwrap_err();
    let simulator::Error::Gpu(Error::WorldTooLarge { table, n_roundabouts, n_bytes, limit: found, fitting, .. }) =
        &error
    else {
        panic!("{error}");
    };
    assert_eq!((*table, *n_roundabouts, *found), ("corners", 5, limit));
    assert!(limit < *n_bytes && *fitting < 5, "{error}");
    assert!(error.to_string().contains("about 4 such roundabouts fit"), "{error}");
}

#[test]
fn external_columns_are_stepped_in_place_and_refused_when_too_small_or_gathered() {
    let (world, choice) = full();
    let with = |columns| {
        Simulator::on(Engine::Gpu { device: device().clone(), columns }, world.clone(), 100, 4, choice.clone())
    };
    let error = with(vec![(Column::Reward, slice(396))]).unwrap_err();
    assert_eq!(error, Error::ColumnSize { column: "reward", found: 396, n_envs: 100, needed: 400 }.into());
    assert_eq!(error.to_string(), "reward: 396 bytes; 100 trucks need 400");

    let mut external = with(vec![(Column::Observation, slice(100 * 276)), (Column::Action, slice(1024))]).unwrap();
    let mut own = batch_on(&engine(), &world, 100, 4, choice.clone());
    for simulator in [&mut external, &mut own] {
        (0..60).for_each(|_| simulator.step_at_random());
    }
    assert!(external.batch().observation == own.batch().observation && external.batch().truck == own.batch().truck);
    assert_eq!(external.gather(&[1, 2]).unwrap_err(), Error::ExternalColumns.into());
    assert!(external.batch().truck == own.batch().truck && external.step(&[0; 100]).is_ok());
}

#[test]
fn a_lost_device_fails_the_next_step_and_every_other_request() {
    let (world, choice) = full();
    let device = Device::open(None).unwrap();
    let new = || {
        Simulator::on(
            Engine::Gpu { device: device.clone(), columns: Columns::new() },
            world.clone(),
            64,
            0,
            choice.clone(),
        )
    };
    let mut simulator = new().unwrap();
    simulator.step(&[4; 64]).unwrap();
    // A device with work under way is lost once that is done.
    simulator.wait().unwrap();
    device.device.destroy();
    let error = simulator.step(&[4; 64]).unwrap_err();
    assert!(matches!(error, simulator::Error::Gpu(Error::Broken { .. })), "{error}");
    assert!(error.to_string().contains("lost"), "{error}");
    simulator.step_at_random();
    simulator.reset();
    let _ = simulator.batch();
    assert!(simulator.step_at_random_by_stage().is_err() && simulator.tally().is_err() && simulator.wait().is_err());
    assert!(
        simulator.reset_from(&[Default::default(); 64]).is_err() && simulator.gather(&[0]).is_err() && new().is_err()
    );
}
