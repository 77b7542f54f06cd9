//! The memory's kernels, compiled from `memory.wgsl`.

use offtrack::cpu::WORKGROUP;
use offtrack::layout::shared_wgsl;
use offtrack::stages::SHADERS;
use wgpu::{
    BindGroup, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType, BufferBindingType, CommandEncoder,
    ComputePassDescriptor, ComputePipeline, ComputePipelineDescriptor, PipelineLayoutDescriptor, ShaderModuleDescriptor, ShaderSource,
    ShaderStages,
};

/// Workgroups in a row of a dispatch.
const ROW: u32 = 65_535;
/// Buffers that the kernels see.
const N_BUFFERS: u32 = 21;

/// One of them.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kernel {
    Choose,
    Keep,
    Remember,
    Sample,
}

/// All of them.
pub(super) struct Pipelines {
    /// What they see.
    pub(super) layout: BindGroupLayout,
    pipelines: [ComputePipeline; 4],
}

impl Pipelines {
    /// Compiles them.
    pub(super) fn compile(device: &wgpu::Device) -> Pipelines {
        let random = SHADERS.iter().filter(|(name, _)| *name == "common/random").map(|(_, text)| *text);
        let source: String =
            [shared_wgsl()].iter().map(String::as_str).chain(random).chain([include_str!("../../../shaders/memory.wgsl")]).collect();
        let module =
            device.create_shader_module(ShaderModuleDescriptor { label: Some("memory"), source: ShaderSource::Wgsl(source.into()) });
        // A tensor's buffer is a slice of a page that other tensors lie in too, and a page is either read from or written to.
        let entry = |binding| BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Buffer {
                ty: BufferBindingType::Storage { read_only: false },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let entries: Vec<BindGroupLayoutEntry> = (0..N_BUFFERS).map(entry).collect();
        let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some("memory"), entries: &entries });
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("memory"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = |entry: &str| {
            device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        let pipelines = ["choose", "keep", "remember", "sample"].map(pipeline);
        Pipelines { layout, pipelines }
    }

    /// Adds a kernel to the commands, over so many threads.
    pub(super) fn add(&self, encoder: &mut CommandEncoder, group: &BindGroup, kernel: Kernel, threads: u32) {
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        pass.set_bind_group(0, group, &[]);
        pass.set_pipeline(&self.pipelines[kernel as usize]);
        let groups = threads.div_ceil(WORKGROUP);
        let columns = groups.min(ROW);
        pass.dispatch_workgroups(columns, groups.div_ceil(columns), 1);
    }
}
