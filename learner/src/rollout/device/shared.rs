//! A graphics device that the simulator and the tensor library share, and the buffers behind tensors.

use std::sync::{Arc, Mutex};

use burn::backend::Wgpu;
use burn::cubecl::client::Client;
use burn::cubecl::server::Handle;
use burn::cubecl::wgpu::{AutoCompiler, WgpuServer, WgpuSetup};
use burn::tensor::{DType, Device, Int, Tensor};
use offtrack::gpu::{self, Slice};

use crate::error::Error;

/// The device, as either knows it.
#[derive(Clone)]
pub struct Shared {
    /// The device for the simulator.
    pub gpu: gpu::Device,
    /// The device for tensors.
    pub tensors: Device,
    /// Skips the flush, to show that it is needed.
    #[cfg(test)]
    pub(super) skips_flush: bool,
}

impl Shared {
    /// Opens the first adapter whose name contains `adapter`, and gives it to the tensor library too.
    pub fn open(adapter: Option<&str>) -> Result<Shared, Error> {
        Shared::of(gpu::Device::open(adapter).map_err(offtrack::simulator::Error::from)?)
    }

    /// The first adapter with the limits that every device of WebGPU has.
    #[cfg(test)]
    pub fn least() -> Result<Shared, Error> {
        let asked = |adapter: &wgpu::Adapter| {
            // The tensor library asks the adapter for its features, not the device.
            let left_out = wgpu::Features::MAPPABLE_PRIMARY_BUFFERS | wgpu::Features::all_experimental_mask();
            (adapter.features() - left_out, wgpu::Limits::default())
        };
        Shared::of(gpu::Device::open_with(None, asked).map_err(offtrack::simulator::Error::from)?)
    }

    /// Gives an open device to the tensor library too.
    fn of(gpu: gpu::Device) -> Result<Shared, Error> {
        let setup = WgpuSetup {
            instance: gpu.instance.clone(),
            adapter: gpu.adapter.clone(),
            device: gpu.device.clone(),
            queue: gpu.queue.clone(),
            backend: gpu.adapter.get_info().backend,
        };
        let tensors = Device::wgpu_options().setup(setup).init().map_err(|error| Error::Device(error.to_string()))?;
        Ok(Shared {
            gpu,
            tensors,
            #[cfg(test)]
            skips_flush: false,
        })
    }

    /// Submits the tensor operations that the library has queued, so that the next submission comes after them.
    pub(super) fn flush(&self) -> Result<(), Error> {
        #[cfg(test)]
        if self.skips_flush {
            return Ok(());
        }
        self.tensors.flush().map_err(|error| Error::Device(error.to_string()))
    }

    /// Waits for both, the simulator and the tensors.
    pub fn wait(&self) -> Result<(), Error> {
        // Queued tensor operations would not be waited for.
        self.tensors.flush().map_err(|error| Error::Device(error.to_string()))?;
        Ok(self.gpu.wait().map_err(offtrack::simulator::Error::from)?)
    }

    /// An error if the device has failed.
    pub fn check(&self) -> Result<(), Error> {
        Ok(self.gpu.check().map_err(offtrack::simulator::Error::from)?)
    }
}

/// A buffer that a tensor owns. It is not moved while this is held.
pub(super) struct Owned {
    pub(super) slice: Slice,
    _held: Arc<dyn Send + Sync>,
}

/// The buffer of a contiguous tensor of 32-bit values.
fn owned(tensor: Located) -> Result<Owned, Error> {
    let Located { client, handle, contiguous } = tensor;
    if !contiguous {
        return Err(Error::Device("a tensor is not contiguous, or not of 32-bit values".to_owned()));
    }
    let held =
        client.get_resource::<WgpuServer<AutoCompiler>>(handle).map_err(|error| Error::Device(error.to_string()))?;
    let resource = held.resource();
    let slice = Slice { buffer: resource.buffer.clone(), offset: resource.offset, size: resource.size };
    Ok(Owned { slice, _held: Arc::new(Mutex::new(held)) })
}

/// What finds a tensor's buffer.
struct Located {
    client: Client,
    handle: Handle,
    contiguous: bool,
}

/// The buffer of a tensor of floats.
pub(super) fn floats<const D: usize>(tensor: &Tensor<D>) -> Result<Owned, Error> {
    let primitive = tensor.clone().try_into_primitive::<Wgpu>().map_err(|error| Error::Device(format!("{error:?}")))?;
    let contiguous = primitive.is_contiguous() && primitive.dtype == DType::F32;
    owned(Located { contiguous, client: primitive.client, handle: primitive.handle })
}

/// The buffer of a tensor of integers.
pub(super) fn integers<const D: usize>(tensor: &Tensor<D, Int>) -> Result<Owned, Error> {
    let primitive = tensor.clone().try_into_primitive::<Wgpu>().map_err(|error| Error::Device(format!("{error:?}")))?;
    let contiguous = primitive.is_contiguous() && primitive.dtype == DType::I32;
    owned(Located { contiguous, client: primitive.client, handle: primitive.handle })
}
