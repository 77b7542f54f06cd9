//! The adapters of this machine: which there are, which is preferred, which are too small.

use wgpu::{Backends, DeviceType, Instance, InstanceDescriptor, Limits};

use super::Error;
use crate::engine::stages::{N_STORAGE_BUFFERS, WORKGROUP_MEMORY};
use crate::layout::WRITERS;

/// An adapter as it presents itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Adapter {
    /// The adapter's name.
    pub name: String,
    /// The interface it is reached by.
    pub interface: String,
    /// The adapter's driver and the driver's version.
    pub driver: String,
    /// Discrete, integrated, virtual or software.
    pub kind: &'static str,
    /// The largest buffer that a shader may see (bytes).
    pub binding_max: u64,
    /// Storage buffers that a shader may see; [`N_STORAGE_BUFFERS`] are needed.
    pub storage_buffers_max: u32,
    /// Memory that a workgroup's threads may share (bytes); [`WORKGROUP_MEMORY`] is needed.
    pub workgroup_memory_max: u32,
}

/// The interfaces that are searched for adapters. OpenGL is left out: a machine without a driver would offer it and
/// compute wrongly or not at all.
const BACKENDS: Backends = Backends::VULKAN.union(Backends::METAL).union(Backends::DX12);

/// The interfaces that were searched, as an error names them.
pub(super) fn interfaces() -> String {
    format!("{BACKENDS:?}").replace("Backends(", "").replace(')', "")
}

pub(super) fn instance() -> Instance {
    Instance::new(InstanceDescriptor { backends: BACKENDS, ..InstanceDescriptor::new_without_display_handle() })
}

pub(super) fn described(adapter: &wgpu::Adapter) -> Adapter {
    let info = adapter.get_info();
    Adapter {
        name: info.name,
        interface: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info),
        kind: match info.device_type {
            DeviceType::DiscreteGpu => "discrete",
            DeviceType::IntegratedGpu => "integrated",
            DeviceType::VirtualGpu => "virtual",
            DeviceType::Cpu => "software",
            DeviceType::Other => "unknown",
        },
        binding_max: adapter.limits().max_storage_buffer_binding_size,
        storage_buffers_max: adapter.limits().max_storage_buffers_per_shader_stage,
        workgroup_memory_max: adapter.limits().max_compute_workgroup_storage_size,
    }
}

/// The adapters in order of preference: graphics cards first, software last.
pub(super) fn found(instance: &Instance) -> Vec<wgpu::Adapter> {
    let mut adapters = pollster::block_on(instance.enumerate_adapters(BACKENDS));
    adapters.sort_by_key(|adapter| match adapter.get_info().device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    });
    adapters
}

/// The adapters of this machine in order of preference.
pub fn adapters() -> Vec<Adapter> {
    found(&instance()).iter().map(described).collect()
}

/// An error if the adapter is too small for any batch.
pub(super) fn check_limits(adapter: &wgpu::Adapter) -> Result<(), Error> {
    let Limits {
        max_storage_buffers_per_shader_stage,
        max_compute_invocations_per_workgroup,
        max_compute_workgroup_storage_size,
        ..
    } = adapter.limits();
    let needs = [
        (
            "the number of storage buffers a shader may see",
            max_storage_buffers_per_shader_stage,
            N_STORAGE_BUFFERS as u32,
        ),
        ("the number of threads in a workgroup", max_compute_invocations_per_workgroup, WRITERS),
        ("the memory of a workgroup (bytes)", max_compute_workgroup_storage_size, WORKGROUP_MEMORY),
    ];
    match needs.into_iter().find(|(_, has, needed)| has < needed) {
        None => Ok(()),
        Some((limit, has, needed)) => {
            Err(Error::Limit { adapter: adapter.get_info().name, limit, has: has.into(), needed: needed.into() })
        }
    }
}
