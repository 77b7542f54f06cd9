//! The engine of compute shaders: a device, and the kernels of `shaders/` compiled for it.
//!
//! A device is opened once and shared: by the batches of this crate, and by whoever else computes on it and hands its buffers in.

mod batch;
mod kernels;
mod tables;

use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

use wgpu::{Backends, BufferDescriptor, BufferUsages, DeviceType, Features, Instance, InstanceDescriptor, Limits, MapMode, PollType};

use crate::layout::buffers::N_BUFFERS;
pub use batch::{Batch, Columns, Slice};
pub use kernels::Kernels;

/// What can be wrong with a device.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// No driver offers one.
    #[error(
        "no adapter: {looked_for} found none; install the graphics card's driver, or a software one (Debian: mesa-vulkan-drivers), \
         or run on the CPU"
    )]
    NoAdapter {
        /// The interfaces that were asked.
        looked_for: String,
    },
    /// None has the name asked for.
    #[error("adapter {name:?}: not there; this machine has {}", .found.join(", "))]
    UnknownAdapter {
        /// Part of a name.
        name: String,
        /// What there is.
        found: Vec<String>,
    },
    /// The adapter is too small for any batch.
    #[error("{adapter}: {limit} is {has}; at least {needed} is needed")]
    Limit {
        /// Its name.
        adapter: String,
        /// What it has too little of.
        limit: &'static str,
        /// What it has.
        has: u64,
        /// What is needed.
        needed: u64,
    },
    /// The adapter is too small for this batch.
    #[error(
        "n_envs: {n_envs}; {buffer} would take {n_bytes} bytes where {adapter} allows {limit} in a buffer: at most {fitting} trucks fit"
    )]
    TooManyTrucks {
        /// Trucks asked for.
        n_envs: usize,
        /// The column that is too large.
        buffer: &'static str,
        /// What it would take.
        n_bytes: u64,
        /// The adapter's name.
        adapter: String,
        /// The largest buffer that it binds.
        limit: u64,
        /// Trucks that would fit.
        fitting: u64,
    },
    /// The driver refused, broke down or lost the device.
    #[error("{adapter}: {message}")]
    Broken {
        /// The adapter's name.
        adapter: String,
        /// What the driver said.
        message: String,
    },
    /// A column that its owner made too small.
    #[error("{column}: {found} bytes; {n_envs} trucks need {needed}")]
    ColumnSize {
        /// The column.
        column: &'static str,
        /// Its size.
        found: u64,
        /// Trucks in the batch.
        n_envs: usize,
        /// Bytes needed.
        needed: u64,
    },
    /// The rows of a batch whose columns belong to someone else cannot become more or fewer.
    #[error("the batch's columns are bound to memory that belongs to another: its trucks cannot be gathered")]
    ForeignColumns,
}

/// An adapter as it presents itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Adapter {
    /// Its name.
    pub name: String,
    /// The interface it is reached by.
    pub interface: String,
    /// Its driver and that one's version.
    pub driver: String,
    /// Discrete, integrated, virtual or software.
    pub kind: &'static str,
    /// The largest buffer that a shader may see [bytes].
    pub binding_max: u64,
}

/// The interfaces that are asked for adapters. OpenGL is none of them: asked for whatever there is, a machine without a driver would come
/// up with it and compute wrongly or not at all.
const BACKENDS: Backends = Backends::VULKAN.union(Backends::METAL).union(Backends::DX12);

/// Longer than it takes to answer that a buffer is mapped, once all work is done.
const ANSWER_TIME: Duration = Duration::from_secs(10);

/// An opened device.
#[derive(Debug, Clone)]
pub struct Device {
    /// What the adapter was found through.
    pub instance: Instance,
    /// What the device was opened on.
    pub adapter: wgpu::Adapter,
    /// The device.
    pub device: wgpu::Device,
    /// Its one queue.
    pub queue: wgpu::Queue,
    broken: Arc<Mutex<Option<String>>>,
    kernels: Arc<OnceLock<Kernels>>,
}

fn instance() -> Instance {
    Instance::new(InstanceDescriptor { backends: BACKENDS, ..InstanceDescriptor::new_without_display_handle() })
}

fn described(adapter: &wgpu::Adapter) -> Adapter {
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
    }
}

/// The adapters in the order in which one is chosen: the graphics card first, software last.
fn found(instance: &Instance) -> Vec<wgpu::Adapter> {
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

/// The adapters of this machine, the one that is chosen unasked first.
pub fn adapters() -> Vec<Adapter> {
    found(&instance()).iter().map(described).collect()
}

impl Device {
    /// Opens the first adapter whose name contains `name`, whatever the case; without a name the first of [`adapters`].
    pub fn open(name: Option<&str>) -> Result<Device, Error> {
        let instance = instance();
        let adapters = found(&instance);
        let names: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
        let wanted = name.unwrap_or_default().to_lowercase();
        let Some(adapter) = adapters.into_iter().find(|adapter| adapter.get_info().name.to_lowercase().contains(&wanted)) else {
            return Err(match name {
                Some(name) if !names.is_empty() => Error::UnknownAdapter { name: name.to_owned(), found: names },
                _ => Error::NoAdapter { looked_for: format!("{BACKENDS:?}").replace("Backends(", "").replace(')', "") },
            });
        };
        check_limits(&adapter)?;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("offtrack"),
            // Whoever shares the device may want any of them.
            required_features: adapter.features() - Features::MAPPABLE_PRIMARY_BUFFERS - Features::all_experimental_mask(),
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let opened = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = opened.map_err(|error| Error::Broken { adapter: adapter.get_info().name, message: error.to_string() })?;
        let broken = Arc::new(Mutex::new(None));
        let note = |message: String, broken: &Mutex<Option<String>>| {
            broken.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(message);
        };
        let on_error = broken.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| note(error.to_string(), &on_error)));
        let on_loss = broken.clone();
        device.set_device_lost_callback(move |reason, message| note(format!("the device was lost: {reason:?} {message}"), &on_loss));
        Ok(Device { instance, adapter, device, queue, broken, kernels: Arc::default() })
    }

    /// The adapter's name, interface and driver, as results name it.
    pub fn name(&self) -> String {
        let Adapter { name, interface, driver, .. } = described(&self.adapter);
        format!("{name} ({interface}, {driver})")
    }

    /// An error if the driver reported one since the device was opened: what was computed since is not to be trusted.
    pub fn check(&self) -> Result<(), Error> {
        // Some losses are told to who polls alone; an error of the poll itself is told to who waits.
        let _ = self.device.poll(wgpu::PollType::Poll);
        match &*self.broken.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(message) => Err(self.broken(message.clone())),
            None => Ok(()),
        }
    }

    /// The bytes of some slices, once all work before is done.
    pub fn read(&self, slices: &[Slice]) -> Result<Vec<Vec<u8>>, Error> {
        self.check()?;
        let size = slices.iter().map(|slice| slice.size).sum();
        let usage = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let staging = self.device.create_buffer(&BufferDescriptor { label: Some("staging"), size, usage, mapped_at_creation: false });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut at = 0;
        for slice in slices {
            encoder.copy_buffer_to_buffer(&slice.buffer, slice.offset, &staging, at, slice.size);
            at += slice.size;
        }
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        staging.map_async(MapMode::Read, .., move |mapped| {
            let _ = sender.send(mapped);
        });
        self.wait()?;
        // Another thread that polls the device may be the one that is about to answer.
        match receiver.recv_timeout(ANSWER_TIME) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(self.broken(error.to_string())),
            Err(_) => return Err(self.broken("the driver never answered".to_owned())),
        }
        let mapped = staging.get_mapped_range(..).map_err(|error| self.broken(error.to_string()))?;
        let mut rest = &mapped[..];
        let parts = slices.iter().map(|slice| {
            let (part, others) = rest.split_at(slice.size as usize);
            rest = others;
            part.to_vec()
        });
        Ok(parts.collect())
    }

    /// A buffer of so many bytes, all 0, for shaders to read and write, and to be copied from and to.
    pub fn empty(&self, label: &str, size: u64) -> Slice {
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let buffer = self.device.create_buffer(&BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false });
        Slice { buffer, offset: 0, size }
    }

    /// The same with something in it.
    pub fn filled(&self, label: &str, contents: &[u8]) -> Slice {
        // Not created with its contents: on a lost device that would panic.
        let slice = self.empty(label, contents.len() as u64);
        self.queue.write_buffer(&slice.buffer, 0, contents);
        slice
    }

    /// Waits until all that was asked of the device is done.
    pub fn wait(&self) -> Result<(), Error> {
        self.device.poll(PollType::wait_indefinitely()).map_err(|error| self.broken(error.to_string()))?;
        self.check()
    }

    /// The shaders, compiled when they are first asked for.
    fn kernels(&self) -> &Kernels {
        self.kernels.get_or_init(|| Kernels::of_stages(&self.device))
    }

    fn broken(&self, message: String) -> Error {
        Error::Broken { adapter: self.adapter.get_info().name, message }
    }
}

/// What every batch takes of an adapter.
fn check_limits(adapter: &wgpu::Adapter) -> Result<(), Error> {
    let Limits { max_storage_buffers_per_shader_stage, max_compute_invocations_per_workgroup, .. } = adapter.limits();
    let needs = [
        ("the number of storage buffers a shader may see", max_storage_buffers_per_shader_stage, N_BUFFERS as u32),
        ("the number of threads in a workgroup", max_compute_invocations_per_workgroup, crate::cpu::WORKGROUP),
    ];
    match needs.into_iter().find(|(_, has, needed)| has < needed) {
        None => Ok(()),
        Some((limit, has, needed)) => Err(Error::Limit { adapter: adapter.get_info().name, limit, has: has.into(), needed: needed.into() }),
    }
}
