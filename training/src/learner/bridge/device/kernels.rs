//! The memory's kernels, compiled from `memory.wgsl`, and the structs that they share with the host.

use offtrack::gpu::Kernels;
use offtrack::layout::buffers::Access;
use offtrack::stages::SHADERS;
use offtrack::wgsl;
use wgpu::{BindGroup, CommandEncoder, ComputePassDescriptor};

/// Buffers that the kernels see.
const N_BUFFERS: usize = 21;

offtrack::shared! {
    /// What does not change in a run.
    pub struct Facts {
        /// Trucks.
        pub n_envs: u32,
        /// Steps of all trucks that are held.
        pub n_slots: u32,
        /// Entries of the action table.
        pub n_actions: u32,
        /// Transitions drawn at a time.
        pub n_rows: u32,
        /// Steps whose rewards are summed.
        pub n_steps: u32,
        /// What actions are drawn from.
        pub acting_seed: u32,
        /// What transitions, noise and mirrors are drawn from.
        pub sampling_seed: u32,
        /// Half of the transitions are seen in a mirror (0 or 1).
        pub mirrored: u32,
        /// Weight of the next step beside this one.
        pub discount: f32,
        /// What rewards are multiplied by.
        pub reward_scale: f32,
        /// Where scaled values are cut off.
        pub scaled_limit: f32,
    }

    /// What changes from one dispatch to the next.
    pub struct Now {
        /// The slot to be written.
        pub slot: u32,
        /// The oldest slot.
        pub oldest: u32,
        /// Slots that enough others follow, from the oldest on.
        pub n_drawable: u32,
        /// Steps so far: what makes one draw of actions differ from the next.
        pub step: u32,
        /// Samples so far.
        pub sample: u32,
    }

    /// How a value is scaled: what is subtracted and multiplied by, and the noise added then, evenly distributed up to this.
    pub struct Scale {
        /// Subtracted first.
        pub mean: f32,
        /// Multiplied by then.
        pub factor: f32,
        /// Added at last, up to this.
        pub noise: f32,
    }

    /// What stands in a value's place in the mirror.
    pub struct Image {
        /// Place of the value that comes to stand there.
        pub place: u32,
        /// Its factor.
        pub factor: f32,
    }
}

offtrack::named! {
    /// The memory's kernels.
    pub enum Kernel {
        /// Draws actions from the actor's output.
        Choose = "choose",
        /// Keeps the observations and actions of a step.
        Keep = "keep",
        /// Keeps the results of a step.
        Remember = "remember",
        /// Draws transitions.
        Sample = "sample",
    }
}

/// The module's text.
fn source() -> String {
    let common = SHADERS.iter().filter(|(name, _)| ["common/thread", "common/random"].contains(name)).map(|(_, text)| *text);
    let own = [wgsl::shared(), printed_structs()];
    own.iter().map(String::as_str).chain(common).chain([include_str!("../../../../shaders/memory.wgsl")]).collect()
}

/// Compiles them. A tensor's buffer is a slice of a page that other tensors lie in too, and a page is either read from or written to, so all
/// may be written to.
pub(super) fn compile(device: &wgpu::Device) -> Kernels<Kernel> {
    Kernels::compile(device, "memory", source(), [Access::ReadWrite; N_BUFFERS])
}

/// Adds a kernel to the commands, over so many threads.
pub(super) fn add(kernels: &Kernels<Kernel>, encoder: &mut CommandEncoder, group: &BindGroup, kernel: Kernel, threads: u32) {
    let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
    pass.set_bind_group(0, group, &[]);
    kernels.dispatch(&mut pass, kernel, threads.into());
}
