//! The engine of compute shaders: a device, and the kernels of `shaders/` compiled for it.
//!
//! A device is opened once and shared: by the batches of this crate, and by other code that computes on it and passes
//! its buffers in.

mod adapter;
mod batch;
mod buffers;
mod error;
mod kernel_times;
mod kernels;

use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

use wgpu::{BufferDescriptor, BufferUsages, Features, Instance, MapMode, PollType};

use crate::engine::stages::Kernel;
pub use adapter::{Adapter, adapters};
use adapter::{check_limits, described, found, instance, interfaces};
pub use batch::Batch;
pub use buffers::{Columns, Slice};
pub use error::Error;
pub use kernels::Kernels;

/// Longest time that mapping a buffer may take after all work is done.
const MAPPING_TIME: Duration = Duration::from_secs(10);

/// An opened device.
#[derive(Debug, Clone)]
pub struct Device {
    /// What the adapter was found through.
    pub instance: Instance,
    /// What the device was opened on.
    pub adapter: wgpu::Adapter,
    /// The device.
    pub device: wgpu::Device,
    /// The device's one queue.
    pub queue: wgpu::Queue,
    broken: Arc<Mutex<Option<String>>>,
    kernels: Arc<OnceLock<Kernels<Kernel>>>,
}

impl Device {
    /// Opens the first adapter whose name contains `name`, whatever the case; without a name the first of [`adapters`].
    pub fn open(name: Option<&str>) -> Result<Device, Error> {
        // Other users of the device may need any of its features and limits.
        Device::open_with(name, |adapter| {
            let features = adapter.features() - Features::MAPPABLE_PRIMARY_BUFFERS - Features::all_experimental_mask();
            (features, adapter.limits())
        })
    }

    /// Opens an adapter as [`Device::open`] does, with the features and limits that `asked` names for it: the kernels
    /// of a step work with no feature and with the limits that every device of WebGPU has, [`wgpu::Limits::default`].
    pub fn open_with(
        name: Option<&str>,
        asked: impl FnOnce(&wgpu::Adapter) -> (Features, wgpu::Limits),
    ) -> Result<Device, Error> {
        let instance = instance();
        let adapters = found(&instance);
        let names: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
        let wanted = name.unwrap_or_default().to_lowercase();
        let Some(adapter) =
            adapters.into_iter().find(|adapter| adapter.get_info().name.to_lowercase().contains(&wanted))
        else {
            return Err(match name {
                Some(name) if !names.is_empty() => Error::UnknownAdapter { name: name.to_owned(), found: names },
                _ => Error::NoAdapter { looked_for: interfaces() },
            });
        };
        check_limits(&adapter)?;
        let (required_features, required_limits) = asked(&adapter);
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("offtrack"),
            required_features,
            required_limits,
            ..Default::default()
        };
        let opened = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) =
            opened.map_err(|error| Error::Broken { adapter: adapter.get_info().name, message: error.to_string() })?;
        let broken = Arc::new(Mutex::new(None));
        let note = |message: String, broken: &Mutex<Option<String>>| {
            broken.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(message);
        };
        let on_error = broken.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| note(error.to_string(), &on_error)));
        let on_loss = broken.clone();
        device.set_device_lost_callback(move |reason, message| {
            note(format!("the device was lost: {reason:?} {message}"), &on_loss)
        });
        Ok(Device { instance, adapter, device, queue, broken, kernels: Arc::default() })
    }

    /// The adapter's name, interface and driver, as results name it.
    pub fn name(&self) -> String {
        let Adapter { name, interface, driver, .. } = described(&self.adapter);
        format!("{name} ({interface}, {driver})")
    }

    /// An error if the driver reported one since the device was opened: later results cannot be trusted.
    pub fn check(&self) -> Result<(), Error> {
        // Some device losses surface only when polling; an error of the poll itself surfaces in `wait`.
        let _ = self.device.poll(PollType::Poll);
        match &*self.broken.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(message) => Err(self.broken(message.clone())),
            None => Ok(()),
        }
    }

    /// The bytes of some slices, after all work submitted before. What does not fit into one buffer is read in parts.
    pub fn read(&self, slices: &[Slice]) -> Result<Vec<Vec<u8>>, Error> {
        let largest = self.device.limits().max_buffer_size;
        let mut contents = Vec::with_capacity(slices.len());
        while contents.len() < slices.len() {
            let rest = &slices[contents.len()..];
            let n = n_fitting(rest.iter().map(|slice| slice.size), largest);
            contents.extend(self.read_at_once(&rest[..n])?);
        }
        Ok(contents)
    }

    /// The bytes of slices that fit into one buffer.
    fn read_at_once(&self, slices: &[Slice]) -> Result<Vec<Vec<u8>>, Error> {
        self.check()?;
        let size = slices.iter().map(|slice| slice.size).sum();
        let usage = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let staging = self.device.create_buffer(&BufferDescriptor {
            label: Some("staging"),
            size,
            usage,
            mapped_at_creation: false,
        });
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
        // The callback may run in another thread that polls the device.
        match receiver.recv_timeout(MAPPING_TIME) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(self.broken(error.to_string())),
            Err(_) => return Err(self.broken("the driver did not answer".to_owned())),
        }
        let mapped = staging.get_mapped_range(..).map_err(|error| self.broken(error.to_string()))?;
        let mut rest = &mapped[..];
        let contents = slices.iter().map(|slice| {
            let (bytes, others) = rest.split_at(slice.size as usize);
            rest = others;
            bytes.to_vec()
        });
        Ok(contents.collect())
    }

    /// A buffer of `size` bytes, all 0, that shaders may read and write and that may be copied from and to.
    pub fn empty(&self, label: &str, size: u64) -> Slice {
        let usage = BufferUsages::STORAGE | BufferUsages::UNIFORM | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let buffer =
            self.device.create_buffer(&BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false });
        Slice { buffer, offset: 0, size }
    }

    /// A buffer like that of [`Device::empty`], but with contents.
    pub fn filled(&self, label: &str, contents: &[u8]) -> Slice {
        // Not created with its contents: on a lost device that would panic.
        let slice = self.empty(label, contents.len() as u64);
        self.queue.write_buffer(&slice.buffer, 0, contents);
        slice
    }

    /// Waits until all submitted work is done.
    pub fn wait(&self) -> Result<(), Error> {
        self.device.poll(PollType::wait_indefinitely()).map_err(|error| self.broken(error.to_string()))?;
        self.check()
    }

    /// The kernels of a step, compiled at their first use.
    fn kernels(&self) -> &Kernels<Kernel> {
        self.kernels.get_or_init(|| kernels::of_stages(&self.device))
    }

    fn broken(&self, message: String) -> Error {
        Error::Broken { adapter: self.adapter.get_info().name, message }
    }
}

/// How many of these sizes, the first ones, are at most `largest` together; at least one.
fn n_fitting(sizes: impl Iterator<Item = u64>, largest: u64) -> usize {
    let mut sum = 0u64;
    let fits = |size: &u64| {
        sum = sum.saturating_add(*size);
        sum <= largest
    };
    sizes.take_while(fits).count().max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_at_once_fits_into_one_buffer_and_all_is_read() {
        let sizes = [40, 60, 1, 100, 99, 2, u64::MAX];
        let (mut read, mut parts) = (0, Vec::new());
        while read < sizes.len() {
            let n = n_fitting(sizes[read..].iter().copied(), 100);
            parts.push(&sizes[read..read + n]);
            read += n;
        }
        assert_eq!(parts, [&[40, 60][..], &[1], &[100], &[99], &[2], &[u64::MAX]]);
    }
}
