//! Buffers and kernels of a graphics device that trucks and learner share.

mod forward;
/// The simulator's tests have it too.
#[cfg(test)]
#[cfg(target_os = "linux")]
#[path = "../../tests/simulator/machine_code/null_device.rs"]
pub(crate) mod null_device;
mod products;

use bytemuck::cast_slice;
use offtrack::gpu::{Device, Error, Slice};
#[cfg(test)]
use offtrack::layout::buffers::Access;

use crate::network::Mlp;

pub(crate) use forward::Forward;
pub(crate) use products::{N_PRODUCTS, NONE, Product, constants, printed_structs};

/// Bytes of a number.
pub(crate) const NUMBER: u64 = size_of::<f32>() as u64;

/// A sample of the replay buffer. B is the number of its transitions.
#[derive(Debug, Clone)]
pub struct Batch {
    /// Observations that the actions were chosen for, normalised, `[B, values]`.
    pub observation: Slice,
    /// Indices of the actions, `[B]`.
    pub action: Slice,
    /// n-step returns without the value of the last observation, `[B]`.
    pub reward: Slice,
    /// Discounts of that value, and 0 where the episode terminated, `[B]`.
    pub discount: Slice,
    /// Observations after the last step, normalised, `[B, values]`.
    pub next_observation: Slice,
    /// Importance-sampling weights in the critics' loss, `[B]`.
    pub weight: Slice,
}

/// A perceptron's parameters, in the order of [`Mlp::parameters`].
#[derive(Debug, Clone)]
pub struct Network {
    /// Where they are.
    pub parameters: Slice,
    /// Sizes of the observation and of all layers.
    pub sizes: Vec<usize>,
}

impl Network {
    /// A network's parameters, but for normalisations, on a device.
    pub fn of(gpu: &Device, network: &Mlp) -> Network {
        let layers = network.plain_layers();
        let outputs = layers.iter().map(|layer| layer.biases.len());
        let n_inputs = layers.first().map_or(0, |layer| layer.weights.len() / layer.biases.len().max(1));
        let parameters: Vec<f32> =
            layers.iter().flat_map(|layer| [&layer.weights[..], &layer.biases[..]].concat()).collect();
        Network {
            parameters: gpu.filled("network", cast_slice(&parameters)),
            sizes: std::iter::once(n_inputs).chain(outputs).collect(),
        }
    }

    /// Number of its parameters.
    pub(crate) fn n_parameters(&self) -> usize {
        self.sizes.windows(2).map(|ends| (ends[0] + 1) * ends[1]).sum()
    }
}

/// The first device with the limits that every device of WebGPU has.
#[cfg(test)]
pub fn least() -> Device {
    let asked = |_: &wgpu::Adapter| (wgpu::Features::empty(), wgpu::Limits::default());
    Device::open_with(None, asked).unwrap_or_else(|error| panic!("{error}"))
}

/// Each kernel, by its name, is bound to what it names in `source`, and to no more storage buffers than every device of
/// WebGPU has.
#[cfg(test)]
pub(crate) fn assert_bound(source: &str, kernels: impl Iterator<Item = (&'static str, Vec<(u32, Access)>)>) {
    use wgpu::naga::front::wgsl::parse_str;
    use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
    let module = parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module).unwrap();
    for (kernel, bindings) in kernels {
        let index = module.entry_points.iter().position(|entry| entry.name == kernel).unwrap();
        let used = info.get_entry_point(index);
        let named = module.global_variables.iter().filter(|(handle, _)| !used[*handle].is_empty());
        let mut named: Vec<u32> = named.filter_map(|(_, variable)| Some(variable.binding.as_ref()?.binding)).collect();
        named.sort_unstable();
        let declared: Vec<u32> = bindings.iter().map(|&(binding, _)| binding).collect();
        assert_eq!(named, declared, "{kernel}");
        let storage = bindings.iter().filter(|(_, access)| *access != Access::Uniform).count();
        assert!(storage <= wgpu::Limits::default().max_storage_buffers_per_shader_stage as usize, "{kernel}");
    }
}

/// The numbers of a buffer. Waits for the device.
pub(crate) fn numbers(gpu: &Device, slice: &Slice) -> Result<Vec<f32>, Error> {
    let bytes = gpu.read(std::slice::from_ref(slice))?;
    // Bytes need not be aligned as floats are.
    Ok(bytes[0].chunks_exact(size_of::<f32>()).map(bytemuck::pod_read_unaligned).collect())
}

/// So many numbers of a buffer from the `first` on.
pub(crate) fn part(of: &Slice, first: usize, n: usize) -> Slice {
    Slice { buffer: of.buffer.clone(), offset: of.offset + first as u64 * NUMBER, size: n as u64 * NUMBER }
}
