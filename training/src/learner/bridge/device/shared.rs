//! A device that the simulator and the tensor library share, and the buffers behind tensors.

use std::sync::{Arc, Mutex};

use burn::backend::Wgpu;
use burn::cubecl::client::Client;
use burn::cubecl::server::Handle;
use burn::cubecl::wgpu::{AutoCompiler, WgpuServer, WgpuSetup};
use burn::tensor::{DType, Device, Int, Tensor};
use offtrack::gpu::{self, Slice};

use crate::error::Error;

/// A graphics device with both on it.
#[derive(Clone)]
pub struct Shared {
    /// As the simulator knows it.
    pub gpu: gpu::Device,
    /// As the tensor library knows it.
    pub tensors: Device,
    /// Hands nothing over, to see what comes of it.
    #[cfg(test)]
    pub(super) is_careless: bool,
}

impl Shared {
    /// Opens a device and hands it to the tensor library too.
    pub fn open(adapter: Option<&str>) -> Result<Shared, Error> {
        let gpu = gpu::Device::open(adapter).map_err(offtrack::simulator::Error::from)?;
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
            is_careless: false,
        })
    }

    /// Hands over what the tensor library has gathered, so that what is submitted next comes after it.
    pub(super) fn hand_over(&self) -> Result<(), Error> {
        #[cfg(test)]
        if self.is_careless {
            return Ok(());
        }
        self.tensors.flush().map_err(|error| Error::Device(error.to_string()))
    }

    /// An error if the device has failed.
    pub fn check(&self) -> Result<(), Error> {
        Ok(self.gpu.check().map_err(offtrack::simulator::Error::from)?)
    }
}

/// A buffer that a tensor owns. It stays where it is as long as this is held.
pub(super) struct Owned {
    pub(super) slice: Slice,
    _held: Arc<dyn Send + Sync>,
}

/// Where a tensor's values lie: 32-bit ones, one after the other.
fn owned(tensor: Handleful) -> Result<Owned, Error> {
    let Handleful { client, handle, contiguous } = tensor;
    if !contiguous {
        return Err(Error::Device("a tensor's values do not lie one after the other".to_owned()));
    }
    let held = client.get_resource::<WgpuServer<AutoCompiler>>(handle).map_err(|error| Error::Device(error.to_string()))?;
    let resource = held.resource();
    let slice = Slice { buffer: resource.buffer.clone(), offset: resource.offset, size: resource.size };
    Ok(Owned { slice, _held: Arc::new(Mutex::new(held)) })
}

/// What is taken of a tensor to find its buffer.
struct Handleful {
    client: Client,
    handle: Handle,
    contiguous: bool,
}

/// The buffer behind a tensor of numbers.
pub(super) fn floats<const D: usize>(tensor: &Tensor<D>) -> Result<Owned, Error> {
    let primitive = tensor.clone().try_into_primitive::<Wgpu>().map_err(|error| Error::Device(format!("{error:?}")))?;
    let contiguous = primitive.is_contiguous() && primitive.dtype == DType::F32;
    owned(Handleful { contiguous, client: primitive.client, handle: primitive.handle })
}

/// The buffer behind a tensor of whole numbers.
pub(super) fn integers<const D: usize>(tensor: &Tensor<D, Int>) -> Result<Owned, Error> {
    let primitive = tensor.clone().try_into_primitive::<Wgpu>().map_err(|error| Error::Device(format!("{error:?}")))?;
    let contiguous = primitive.is_contiguous() && primitive.dtype == DType::I32;
    owned(Handleful { contiguous, client: primitive.client, handle: primitive.handle })
}
