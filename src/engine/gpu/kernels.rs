//! Shaders, compiled: a pipeline for each entry point of a module, one bind group layout for all.

use wgpu::{
    BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType, BufferBindingType, ComputePass,
    ComputePipeline, ComputePipelineDescriptor, PipelineLayoutDescriptor, ShaderModuleDescriptor, ShaderSource,
    ShaderStages,
};

use crate::engine::stages::{Kernel, SHADERS, Threads};
use crate::layout::buffers::{Access, BUFFERS};
use crate::layout::shared::Named;
use crate::layout::{N_RAYS, N_VALUES, WORKGROUP};

/// Workgroups in a row of a dispatch: the most that every device takes.
const ROW: u32 = 65_535;

/// The kernels of a module, named by `K`.
#[derive(Debug)]
pub struct Kernels<K> {
    /// The kernels' bindings: storage buffers in one bind group.
    pub layout: BindGroupLayout,
    /// A pipeline for each of [`Named::ALL`].
    pipelines: Vec<ComputePipeline>,
    names: std::marker::PhantomData<K>,
}

impl<K: Named> Kernels<K> {
    /// Compiles an entry point of `source` for each of `K`. The bindings are storage buffers with these accesses, in
    /// their order.
    pub fn compile(
        device: &wgpu::Device,
        label: &str,
        source: String,
        accesses: impl IntoIterator<Item = Access>,
    ) -> Kernels<K> {
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: Some(label),
            source: ShaderSource::Wgsl(source.into()),
        });
        let bindings: Vec<BindGroupLayoutEntry> =
            (0..).zip(accesses).map(|(binding, access)| bound(binding, access)).collect();
        let layout =
            device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some(label), entries: &bindings });
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipelines = K::ALL.iter().map(|kernel| {
            device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some(kernel.name()),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(kernel.name()),
                compilation_options: Default::default(),
                cache: None,
            })
        });
        Kernels { pipelines: pipelines.collect(), layout, names: std::marker::PhantomData }
    }

    /// Adds a kernel to a pass, over so many threads. Their workgroups lie in rows: see `common/thread.wgsl`.
    pub fn dispatch(&self, pass: &mut ComputePass, kernel: K, threads: u64) {
        let groups = threads.div_ceil(WORKGROUP.into()) as u32;
        let columns = groups.min(ROW);
        pass.set_pipeline(&self.pipelines[kernel.index()]);
        pass.dispatch_workgroups(columns, groups.div_ceil(columns), 1);
    }
}

/// The kernels of a step and those beside it.
pub(super) fn of_stages(device: &wgpu::Device) -> Kernels<Kernel> {
    let source = SHADERS.iter().flat_map(|(_, text)| [text, "\n"]).collect();
    Kernels::compile(device, "offtrack", source, BUFFERS.iter().map(|buffer| buffer.access()))
}

/// Threads that a kernel of a step needs for so many trucks.
pub(super) fn threads(kernel: Kernel, n_envs: usize) -> u64 {
    let width = match kernel.threads() {
        Threads::Truck => 1,
        Threads::Ray => N_RAYS,
        Threads::Value => N_VALUES,
    };
    n_envs as u64 * width as u64
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
