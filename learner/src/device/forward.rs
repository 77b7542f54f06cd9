//! A network's pass forward for all trucks, on a device.

use bytemuck::cast_slice;
use offtrack::gpu::{Device, Kernels, Slice};
use offtrack::layout::WORKGROUP;
use offtrack::layout::buffers::Access;
use wgpu::{BindGroup, CommandEncoder, ComputePassDescriptor};

use super::{NUMBER, Network, Product, constants, printed_structs};

/// Most bytes that the pass takes at a time, where an adapter allows as many.
const MOST: u64 = 1 << 30;
/// Bindings of the products and of the buffer that they are in.
const BINDINGS: [(u32, Access); 2] = [(0, Access::Uniform), (1, Access::ReadWrite)];

offtrack::named! {
    /// The kernel's entry point.
    pub enum Kernel {
        /// Makes products.
        Multiply = "multiply",
    }
}

/// The pass, for one number of trucks.
pub(crate) struct Forward {
    gpu: Device,
    kernels: Kernels<Kernel>,
    n_rows: usize,
    /// Most bytes that it takes at a time.
    most: u64,
    /// For networks of the sizes that were last asked for.
    built: Option<Built>,
}

/// What a pass of networks of some sizes needs.
struct Built {
    sizes: Vec<usize>,
    /// Trucks at a time.
    rows: usize,
    /// Inputs of those, outputs, parameters, and two rows of hidden values in turns.
    memory: Slice,
    outputs: u64,
    parameters: u64,
    /// Each layer's, and its workgroups.
    layers: Vec<(BindGroup, u32)>,
}

impl Forward {
    pub(crate) fn new(gpu: &Device, n_rows: usize) -> Forward {
        let kernels = Kernels::compile(&gpu.device, "forward", source(), |_: Kernel| BINDINGS.to_vec());
        Forward { gpu: gpu.clone(), kernels, n_rows, most: MOST, built: None }
    }

    /// Adds the pass from `seen`, `[n_rows, values]`, to `logits`, `[n_rows, actions]`.
    pub(crate) fn add(&mut self, encoder: &mut CommandEncoder, network: &Network, seen: &Slice, logits: &Slice) {
        if self.built.as_ref().is_none_or(|built| built.sizes != network.sizes) {
            self.built = Some(self.build(network));
        }
        let Some(built) = &self.built else { return };
        let memory = &built.memory.buffer;
        let parameters = &network.parameters;
        let size = network.n_parameters() as u64 * NUMBER;
        encoder.copy_buffer_to_buffer(&parameters.buffer, parameters.offset, memory, built.parameters, size);
        let [n_values, n_actions] = ends(&built.sizes).map(|size| size as u64 * NUMBER);
        for first in (0..self.n_rows).step_by(built.rows) {
            let n_rows = built.rows.min(self.n_rows - first) as u64;
            let (from, to) = (first as u64 * n_values, first as u64 * n_actions);
            encoder.copy_buffer_to_buffer(&seen.buffer, seen.offset + from, memory, 0, n_rows * n_values);
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
            for (group, n) in &built.layers {
                let threads = u64::from(*n) * u64::from(WORKGROUP);
                self.kernels.dispatch(&mut pass, Kernel::Multiply, group, threads);
            }
            drop(pass);
            let size = n_rows * n_actions;
            encoder.copy_buffer_to_buffer(memory, built.outputs, &logits.buffer, logits.offset + to, size);
        }
    }

    fn build(&self, network: &Network) -> Built {
        let sizes = network.sizes.clone();
        let limits = self.gpu.device.limits();
        let most = self.most.min(limits.max_storage_buffer_binding_size).min(limits.max_buffer_size) / NUMBER;
        let [n_values, n_actions] = ends(&sizes);
        let width = sizes[1..sizes.len() - 1].iter().copied().max().unwrap_or_default();
        let a_row = n_values + n_actions + 2 * width;
        let n_parameters = network.n_parameters();
        let rows = (most as usize).saturating_sub(n_parameters) / a_row;
        let rows = rows.clamp(1, self.n_rows);
        let outputs = rows * n_values;
        let parameters = outputs + rows * n_actions;
        let hidden = [parameters + n_parameters, parameters + n_parameters + rows * width];
        let length = hidden[1] + rows * width;
        let memory = self.gpu.empty("forward", length as u64 * NUMBER);
        let (mut inputs, mut weights) = (0, parameters);
        let last = sizes.len() - 2;
        let layers = sizes.windows(2).enumerate().map(|(index, ends)| {
            let [n_inputs, n_outputs] = [ends[0], ends[1]];
            let result = if index == last { outputs } else { hidden[index % 2] };
            let place = |place: usize| place as u32;
            let product = Product {
                is_rectified: (index < last).into(),
                ..Product::layer(
                    [rows, n_inputs].map(place),
                    place(inputs),
                    place(weights),
                    place(weights + n_inputs * n_outputs),
                    [result, n_outputs].map(place),
                )
            };
            (inputs, weights) = (result, weights + (n_inputs + 1) * n_outputs);
            let (products, groups) = Product::together([product]);
            let products = self.gpu.filled("products", cast_slice(&products));
            let slices = [(BINDINGS[0].0, &products), (BINDINGS[1].0, &memory)];
            (self.kernels.bind(&self.gpu.device, Kernel::Multiply, slices), groups)
        });
        let layers = layers.collect();
        let bytes = |place: usize| place as u64 * NUMBER;
        Built { sizes, rows, outputs: bytes(outputs), parameters: bytes(parameters), layers, memory }
    }
}

/// Values and actions of a network of these sizes.
fn ends(sizes: &[usize]) -> [usize; 2] {
    [sizes.first(), sizes.last()].map(|size| size.copied().unwrap_or_default())
}

/// The module's text.
fn source() -> String {
    let bindings = format!(
        "@group(0) @binding(0) var<uniform> products: array<Product, {}>;\n\
         @group(0) @binding(1) var<storage, read_write> memory: array<f32>;\n\n",
        super::N_PRODUCTS
    );
    [&constants(), &printed_structs(), &bindings, include_str!("../../shaders/products.wgsl")]
        .map(String::from)
        .concat()
}

#[cfg(test)]
mod tests;
