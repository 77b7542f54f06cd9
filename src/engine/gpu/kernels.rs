//! Shaders, compiled: a pipeline and a bind group layout for each entry point of a module.

use std::num::NonZero;

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry,
    BindingResource, BindingType, BufferBinding, BufferBindingType, ComputePass, ComputePipeline,
    ComputePipelineDescriptor, PipelineCompilationOptions, PipelineLayoutDescriptor, ShaderModuleDescriptor,
    ShaderSource, ShaderStages,
};

use super::Slice;
use crate::engine::stages::{Kernel, Threads, module};
use crate::engine::tables::{ROW, team};
use crate::layout::buffers::Access;
use crate::layout::shared::Named;
use crate::layout::{N_CARS, N_VALUES, WORKGROUP};
use crate::traffic::N_TURNS;

/// The kernels of a module, named by `K`.
#[derive(Debug)]
pub struct Kernels<K> {
    /// For each of [`Named::ALL`] the buffers that it is bound to, and its pipeline.
    compiled: Vec<(BindGroupLayout, ComputePipeline)>,
    names: std::marker::PhantomData<K>,
}

impl<K: Named> Kernels<K> {
    /// Compiles an entry point of `source` for each of `K`, with the bindings that the shader names for it, and what it
    /// may do to them.
    pub fn compile(
        device: &wgpu::Device,
        label: &str,
        source: String,
        bindings: impl Fn(K) -> Vec<(u32, Access)>,
    ) -> Kernels<K> {
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: Some(label),
            source: ShaderSource::Wgsl(source.into()),
        });
        let compiled = K::ALL.iter().map(|&kernel| {
            let label = Some(kernel.name());
            let entries: Vec<BindGroupLayoutEntry> =
                bindings(kernel).into_iter().map(|(binding, access)| bound(binding, access)).collect();
            let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor { label, entries: &entries });
            let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
                label,
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
            let pipeline = device.create_compute_pipeline(&ComputePipelineDescriptor {
                label,
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: label,
                // A kernel writes what it reads of the workgroup's memory.
                compilation_options: PipelineCompilationOptions {
                    zero_initialize_workgroup_memory: false,
                    ..Default::default()
                },
                cache: None,
            });
            (layout, pipeline)
        });
        Kernels { compiled: compiled.collect(), names: std::marker::PhantomData }
    }

    /// Binds a kernel to the buffers that it names, each with its binding.
    pub fn bind<'a>(
        &self,
        device: &wgpu::Device,
        kernel: K,
        slices: impl IntoIterator<Item = (u32, &'a Slice)>,
    ) -> BindGroup {
        let entries = slices.into_iter().map(|(binding, slice)| BindGroupEntry {
            binding,
            resource: BindingResource::Buffer(BufferBinding {
                buffer: &slice.buffer,
                offset: slice.offset,
                size: NonZero::new(slice.size),
            }),
        });
        device.create_bind_group(&BindGroupDescriptor {
            label: Some(kernel.name()),
            layout: &self.compiled[kernel.index()].0,
            entries: &entries.collect::<Vec<_>>(),
        })
    }

    /// Adds a kernel to a pass, bound to `group`, over so many threads. Their workgroups lie in rows: see
    /// `common/thread.wgsl`.
    pub fn dispatch(&self, pass: &mut ComputePass, kernel: K, group: &BindGroup, threads: u64) {
        let groups = threads.div_ceil(WORKGROUP.into()) as u32;
        let columns = groups.min(ROW);
        pass.set_pipeline(&self.compiled[kernel.index()].1);
        pass.set_bind_group(0, group, &[]);
        pass.dispatch_workgroups(columns, groups.div_ceil(columns), 1);
    }
}

/// The kernels of a step and those beside it.
pub(super) fn of_stages(device: &wgpu::Device) -> Kernels<Kernel> {
    let bindings =
        |kernel: Kernel| kernel.buffers().iter().map(|buffer| (buffer.binding() as u32, buffer.access())).collect();
    Kernels::compile(device, "offtrack", module(), bindings)
}

/// Threads that a kernel of a step needs for so many trucks.
pub(super) fn threads(kernel: Kernel, n_envs: usize) -> u64 {
    let n_envs = n_envs as u64;
    match kernel.threads() {
        Threads::Truck => n_envs,
        Threads::Value => n_envs * N_VALUES as u64,
        Threads::Car => n_envs * N_CARS as u64,
        Threads::Turn => n_envs * N_TURNS as u64,
        Threads::Team => n_envs.div_ceil(team(n_envs as usize).into()) * u64::from(WORKGROUP),
    }
}

fn bound(binding: u32, access: Access) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::COMPUTE,
        ty: BindingType::Buffer {
            ty: match access {
                Access::Uniform => BufferBindingType::Uniform,
                _ => BufferBindingType::Storage { read_only: access == Access::Read },
            },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}
