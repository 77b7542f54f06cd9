//! Shaders, compiled: a pipeline for each entry point of a module, one bind group layout for all.

use wgpu::{
    BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType, BufferBindingType, ComputePass, ComputePipeline,
    ComputePipelineDescriptor, PipelineLayoutDescriptor, ShaderModuleDescriptor, ShaderSource, ShaderStages,
};

use crate::cpu::WORKGROUP;
use crate::layout::N_RAYS;
use crate::layout::buffers::{Access, BUFFERS};
use crate::stages::{BESIDE, Kernel, SHADERS, STAGES, Threads};

/// Workgroups in a row of a dispatch: what every device takes.
const ROW: u32 = 65_535;

/// A module's kernels.
#[derive(Debug)]
pub struct Kernels {
    /// What they see: storage buffers in one bind group.
    pub layout: BindGroupLayout,
    pipelines: Vec<(&'static str, ComputePipeline)>,
}

impl Kernels {
    /// Compiles the entry points of `source`, whose bindings are buffers with these accesses, in their order.
    pub fn compile(
        device: &wgpu::Device,
        label: &str,
        source: String,
        accesses: impl IntoIterator<Item = Access>,
        entries: impl IntoIterator<Item = &'static str>,
    ) -> Kernels {
        let module = device.create_shader_module(ShaderModuleDescriptor { label: Some(label), source: ShaderSource::Wgsl(source.into()) });
        let bindings: Vec<BindGroupLayoutEntry> = (0..).zip(accesses).map(|(binding, access)| bound(binding, access)).collect();
        let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some(label), entries: &bindings });
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipelines = entries.into_iter().map(|entry| {
            let pipeline = device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            });
            (entry, pipeline)
        });
        Kernels { pipelines: pipelines.collect(), layout }
    }

    /// The kernels of a step and those beside it.
    pub(super) fn of_stages(device: &wgpu::Device) -> Kernels {
        let source = SHADERS.iter().flat_map(|(_, text)| [text, "\n"]).collect();
        let entries = STAGES.iter().flat_map(|stage| stage.kernels).chain(&BESIDE).map(|kernel| kernel.entry);
        Kernels::compile(device, "offtrack", source, BUFFERS.iter().map(|buffer| buffer.access), entries)
    }

    /// Adds a kernel of a step to a pass, over all trucks.
    pub(super) fn dispatch_over(&self, pass: &mut ComputePass, kernel: &Kernel, n_envs: u32) {
        let threads = match kernel.threads {
            Threads::Truck => u64::from(n_envs),
            Threads::Ray => u64::from(n_envs) * N_RAYS as u64,
        };
        self.dispatch(pass, kernel.entry, threads);
    }

    /// Adds a kernel to a pass, over so many threads, whose workgroups lie in rows: see `common/thread.wgsl`.
    pub fn dispatch(&self, pass: &mut ComputePass, entry: &str, threads: u64) {
        let Some((_, pipeline)) = self.pipelines.iter().find(|(known, _)| *known == entry) else { return };
        let groups = threads.div_ceil(WORKGROUP.into()) as u32;
        let columns = groups.min(ROW);
        pass.set_pipeline(pipeline);
        pass.dispatch_workgroups(columns, groups.div_ceil(columns), 1);
    }
}

fn bound(binding: u32, access: Access) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::COMPUTE,
        ty: BindingType::Buffer {
            ty: BufferBindingType::Storage { read_only: access == Access::Read },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}
