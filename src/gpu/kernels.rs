//! The shaders, compiled: one module of all files, a pipeline for each entry point, one bind group layout for all.

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

/// All kernels.
#[derive(Debug)]
pub(super) struct Kernels {
    /// What they see.
    pub layout: BindGroupLayout,
    pipelines: Vec<(&'static str, ComputePipeline)>,
}

impl Kernels {
    /// Compiles them.
    pub fn compile(device: &wgpu::Device) -> Kernels {
        let source: String = SHADERS.iter().flat_map(|(_, text)| [text, "\n"]).collect();
        let module =
            device.create_shader_module(ShaderModuleDescriptor { label: Some("offtrack"), source: ShaderSource::Wgsl(source.into()) });
        let entries: Vec<BindGroupLayoutEntry> = (0..).zip(&BUFFERS).map(|(binding, buffer)| entry(binding, buffer.access)).collect();
        let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some("offtrack"), entries: &entries });
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("offtrack"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipelines = STAGES.iter().flat_map(|stage| stage.kernels).chain(&BESIDE).map(|kernel| {
            let pipeline = device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some(kernel.entry),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(kernel.entry),
                compilation_options: Default::default(),
                cache: None,
            });
            (kernel.entry, pipeline)
        });
        Kernels { pipelines: pipelines.collect(), layout }
    }

    /// Adds a kernel to a pass, over all trucks.
    pub fn dispatch(&self, pass: &mut ComputePass, kernel: &Kernel, n_envs: u32) {
        let Some((_, pipeline)) = self.pipelines.iter().find(|(entry, _)| *entry == kernel.entry) else { return };
        let threads = match kernel.threads {
            Threads::Truck => u64::from(n_envs),
            Threads::Ray => u64::from(n_envs) * N_RAYS as u64,
        };
        let groups = threads.div_ceil(WORKGROUP.into()) as u32;
        let columns = groups.min(ROW);
        pass.set_pipeline(pipeline);
        pass.dispatch_workgroups(columns, groups.div_ceil(columns), 1);
    }
}

fn entry(binding: u32, access: Access) -> BindGroupLayoutEntry {
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
