//! A policy on a graphics device: one kernel takes the observations of a batch where they lie and writes its actions.
//!
//! The widest network of a training file, 1,024 outputs, fits into the 16 KB of workgroup memory that every device has.
//! A wider one is refused: it acts on the processor.

use std::borrow::Cow;

use offtrack::gpu::{self, Kernels, Slice};
use offtrack::layout::{Column, WORKGROUP};
use offtrack::wgpu::{CommandEncoder, ComputePassDescriptor};
use offtrack::world::World;

use crate::error::Error;
use crate::file::MOST_LAYERS;
use crate::kernel::{Facts, Kernel, LayerRow, SHAPES, Shape, buffers, source};
use crate::network::{Activation, Layer};
use crate::normalisation::Normalisation;
use crate::policy::{Choice, Policy};
use crate::selection::VEHICLES_AT;

/// A policy whose numbers lie on a device.
#[derive(Debug)]
pub struct DevicePolicy {
    device: gpu::Device,
    kernels: Kernels<Kernel>,
    shape: Shape,
    /// The policy's own buffers, the first of [`buffers`].
    own: [Slice; 4],
    reads_vehicles: bool,
}

impl DevicePolicy {
    /// Brings a policy to the device of a batch in `world`.
    ///
    /// # Errors
    ///
    /// A policy that cannot drive in `world`, that a device does [not act by](Policy::acts_on_device), whose layers do
    /// not fit each other, that a file could not hold, or that is too wide for a workgroup; a device whose workgroups
    /// are too small.
    pub fn new(device: &gpu::Device, policy: &Policy, world: &World, choice: Choice) -> Result<DevicePolicy, Error> {
        policy.check(world)?;
        check_acts(policy)?;
        check_whole(policy)?;
        let policy = &*reading_all(policy);
        let shape = fitting(policy)?;
        check_limits(device, shape)?;
        let mut rows = [LayerRow::default(); MOST_LAYERS];
        let mut weights: Vec<f32> = Vec::new();
        for (row, layer) in rows.iter_mut().zip(&policy.layers) {
            let (n_inputs, n_columns) = (layer.n_inputs().next_multiple_of(4), layer.n_outputs().div_ceil(4));
            let first = weights.len() / 4;
            let biases = first + n_inputs * n_columns;
            let [n_inputs, n_columns, first, biases] = [n_inputs, n_columns, first, biases].map(|number| number as u32);
            *row = LayerRow { n_inputs, n_columns, weights: first, biases };
            for outputs in layer.weights.chunks_exact(layer.n_outputs()) {
                weights.extend(outputs);
                weights.resize(weights.len().next_multiple_of(4), 0.0);
            }
            weights.resize(4 * biases as usize, 0.0);
            weights.extend(&layer.biases);
            weights.resize(weights.len().next_multiple_of(4), 0.0);
        }
        check_size(device, policy, weights.len())?;
        let normals: Vec<[f32; 2]> = std::iter::zip(&policy.normalisation.mean, &policy.normalisation.factor)
            .map(|(&mean, &factor)| [mean, factor])
            .collect();
        let (is_sampled, seed) = match choice {
            Choice::Best => (0, 0),
            Choice::Sampled { seed } => (1, seed),
        };
        let facts = Facts {
            n_values: policy.normalisation.mean.len() as u32,
            n_layers: policy.layers.len() as u32,
            n_actions: policy.actions.len() as u32,
            is_tanh: (policy.activation == Activation::Tanh).into(),
            is_sampled,
            seed,
        };
        let contents = [
            bytemuck::bytes_of(&facts),
            bytemuck::cast_slice(&rows),
            bytemuck::cast_slice(&normals),
            bytemuck::cast_slice(&weights),
        ];
        let reads_vehicles = policy.reads_vehicles();
        Ok(DevicePolicy {
            kernels: Kernels::compile(&device.device, "policy", source(shape, reads_vehicles), |_: Kernel| {
                (0..).zip(buffers(reads_vehicles)).map(|(binding, (_, access, ..))| (binding, access)).collect()
            }),
            own: contents.map(|contents| device.filled("policy", contents)),
            device: device.clone(),
            shape,
            reads_vehicles,
        })
    }

    /// Adds the choice of an action for every truck that drives to the caller's commands; the action of one that is
    /// held may stay. The batch is one of the world and device that the policy was made for.
    pub fn add(&self, encoder: &mut CommandEncoder, batch: &gpu::Batch) {
        let columns = [Column::Observation, Column::Extras, Column::Truck, Column::Action];
        let columns = columns.map(|column| batch.column(column));
        let around = self.reads_vehicles.then(|| batch.column(Column::Around));
        let slices = (0..).zip(self.own.iter().chain(columns).chain(around));
        let group = self.kernels.bind(&self.device.device, Kernel::Act, slices);
        let n_envs = columns[3].size / size_of::<u32>() as u64;
        let n_groups = n_envs.div_ceil(self.shape.tile().into());
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        self.kernels.dispatch(&mut pass, Kernel::Act, &group, n_groups * u64::from(WORKGROUP));
    }

    /// Requests a step of every truck by the policy. The device may still be at it afterwards.
    ///
    /// # Errors
    ///
    /// That of a device that failed.
    pub fn step(&self, batch: &mut gpu::Batch) -> Result<(), gpu::Error> {
        self.device.check()?;
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        self.add(&mut encoder, batch);
        batch.add_step(&mut encoder);
        batch.stepped();
        self.device.queue.submit([encoder.finish()]);
        Ok(())
    }
}

/// An error for a policy that is more than the kernel acts by.
fn check_acts(policy: &Policy) -> Result<(), Error> {
    if policy.acts_on_device() {
        return Ok(());
    }
    let message = "is a policy with a memory or commands: a device acts by neither; let it drive on the processor";
    Err(Error::contents(&policy.name, message))
}

/// The policy as one that reads all values, the extras up to the last one that it reads and, if it reads any of them,
/// the values of other vehicles: those that it does not read have weights of 0.
fn reading_all(policy: &Policy) -> Cow<'_, Policy> {
    let Some(values) = &policy.values else { return Cow::Borrowed(policy) };
    let layout = values.observation_layout();
    let n_values = layout.n_values();
    let mut normalisation = Normalisation::none(n_values);
    let mut layers = policy.layers.clone();
    let n_outputs = layers[0].n_outputs();
    layers[0].weights = vec![0.0; n_values * n_outputs];
    for (input, &index) in values.indices().iter().enumerate() {
        let value = if index < VEHICLES_AT { index } else { layout.vehicles_at() + index - VEHICLES_AT };
        normalisation.mean[value] = policy.normalisation.mean[input];
        normalisation.factor[value] = policy.normalisation.factor[input];
        layers[0].weights[value * n_outputs..][..n_outputs]
            .copy_from_slice(&policy.layers[0].weights[input * n_outputs..][..n_outputs]);
    }
    let extras = layout.extra_names().into_iter().map(str::to_owned).collect();
    Cow::Owned(Policy { values: None, extras, vehicles: layout.has_vehicles, normalisation, layers, ..policy.clone() })
}

/// An error for a policy that no file could hold: one whose layers do not fit each other, or with numbers that are not
/// finite or so large that its outputs may not be.
fn check_whole(policy: &Policy) -> Result<(), Error> {
    let is_whole = |layer: &Layer| 0 < layer.n_outputs() && layer.weights.len().is_multiple_of(layer.n_outputs());
    match policy.layers.iter().enumerate().find(|(_, layer)| !is_whole(layer)) {
        None => Policy::from_bytes(&policy.name, &policy.to_bytes()).map(|_| ()),
        Some((index, Layer { weights, biases })) => {
            let message = format!(
                "is a policy of another shape: actor.{index} has {} weights for {} outputs; one for each of them and \
                 each input is needed",
                weights.len(),
                biases.len()
            );
            Err(Error::contents(&policy.name, &message))
        }
    }
}

/// The shape with the most trucks that the policy's widest layer fits into.
fn fitting(policy: &Policy) -> Result<Shape, Error> {
    let widths = || policy.layers.iter().map(Layer::n_outputs);
    let widest = widths().max().unwrap_or_default();
    SHAPES.into_iter().find(|shape| widest <= shape.width() as usize).ok_or_else(|| {
        let index = widths().position(|width| width == widest).unwrap_or_default();
        let most = SHAPES.map(Shape::width).into_iter().max().unwrap_or_default();
        Error::contents(
            &policy.name,
            &format!(
                "is a policy too wide for a device: actor.{index} has {widest} outputs, at most {most} fit into a \
                 workgroup; let it drive on the processor"
            ),
        )
    })
}

/// An error if the device's workgroups are too small.
fn check_limits(device: &gpu::Device, shape: Shape) -> Result<(), Error> {
    let limits = device.device.limits();
    let has = limits.max_compute_invocations_per_workgroup.min(limits.max_compute_workgroup_size_x);
    let needs = [
        ("the number of threads in a workgroup", has, shape.threads()),
        ("the memory of a workgroup", limits.max_compute_workgroup_storage_size, shape.memory()),
    ];
    match needs.into_iter().find(|(_, has, needed)| has < needed) {
        None => Ok(()),
        Some((limit, has, needed)) => {
            let adapter = device.adapter.get_info().name;
            Err(gpu::Error::Limit { adapter, limit, has: has.into(), needed: needed.into() }.into())
        }
    }
}

/// An error if so many weights do not fit into a buffer of the device.
fn check_size(device: &gpu::Device, policy: &Policy, n_weights: usize) -> Result<(), Error> {
    let limits = device.device.limits();
    let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let needed = (n_weights * size_of::<f32>()) as u64;
    if needed <= limit {
        return Ok(());
    }
    let adapter = device.adapter.get_info().name;
    let message = format!(
        "is a policy too large for a device: its weights take {needed} bytes where {adapter} allows {limit} in a \
         buffer; let it drive on the processor"
    );
    Err(Error::contents(&policy.name, &message))
}

#[cfg(test)]
mod tests;
