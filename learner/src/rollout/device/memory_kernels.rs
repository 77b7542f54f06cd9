//! The kernels of the replay buffer on a device: structs and bindings declared once, printed for their shaders, and
//! compiled.

use offtrack::engine::stages::SHADERS;
use offtrack::engine::wgsl;
use offtrack::gpu::Kernels;
use offtrack::layout::buffers::Access;
use offtrack::layout::shared::Shared as _;
use offtrack::layout::{Ended, Truck, WORKGROUP};
use wgpu::{BindGroup, CommandEncoder, ComputePassDescriptor, Device};

use crate::replay_buffer::LEAST_ERROR;

offtrack::shared! {
    /// What does not change in a run.
    pub struct Facts {
        /// Trucks.
        pub n_envs: u32,
        /// Steps of all trucks that the buffer holds.
        pub n_slots: u32,
        /// Entries of the action table.
        pub n_actions: u32,
        /// Values that the networks observe: those of an observation, the extras behind them, and other vehicles.
        pub n_values: u32,
        /// Extras among them.
        pub n_extras: u32,
        /// Transitions in a sample.
        pub n_rows: u32,
        /// Steps of the n-step return.
        pub n_steps: u32,
        /// Seed of the actions.
        pub acting_seed: u32,
        /// Seed of samples, noise and mirroring.
        pub sampling_seed: u32,
        /// Blocks of transitions whose priorities are summed.
        pub n_blocks: u32,
        /// Half of the transitions are mirrored (0 or 1).
        pub mirrored: u32,
        /// Discount factor.
        pub gamma: f32,
        /// Added to the reward of a step that arrives.
        pub arrival: f32,
        /// Factor of the rewards.
        pub reward_scale: f32,
        /// Where normalised values are clipped.
        pub clip: f32,
        /// Fraction of the sum of priorities that one transition of a sample is drawn from.
        pub stratum: f32,
        /// Power of the TD error that makes a priority.
        pub exponent: f32,
        /// Power of the importance-sampling weights.
        pub correction: f32,
    }

    /// What changes from one dispatch to the next.
    pub struct Now {
        /// The slot to be written.
        pub slot: u32,
        /// The oldest slot.
        pub oldest: u32,
        /// Slots that enough others follow, from the oldest on.
        pub n_ready: u32,
        /// Another slot is followed by enough once this step is stored (0 or 1).
        pub has_ready: u32,
        /// Steps so far: another one gives other random actions.
        pub step: u32,
        /// Samples so far.
        pub sample: u32,
    }

    /// What a sample makes of a value.
    pub struct Value {
        /// Subtracted.
        pub mean: f32,
        /// Multiplied by then.
        pub factor: f32,
        /// Largest noise added then, uniform.
        pub noise: f32,
        /// Index of the value that its mirror image is made from.
        pub image: u32,
        /// Factor of that one.
        pub image_factor: f32,
    }
}

/// Transitions whose priorities are summed in one block.
pub(super) const BLOCK: u32 = 128;

/// Declares the bindings in order: name, element in WGSL, one element or an array, and what it holds.
macro_rules! bindings {
    ($($name:ident: $element:expr, $single:literal, $doc:literal;)*) => {
        /// The buffers that the kernels see.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[expect(non_camel_case_types, reason = "the names are those of the shader")]
        pub(super) enum Binding {
            $(#[doc = $doc] $name,)*
        }

        impl Binding {
            /// Every binding; its index is the shader's.
            pub(super) const ALL: [Binding; 0 $(+ { let _ = Binding::$name; 1 })*] = [$(Binding::$name),*];

            /// The binding's declaration in WGSL.
            fn declaration(self) -> String {
                let (name, element, single, doc): (_, String, bool, _) = match self {
                    $(Binding::$name => (stringify!($name), $element, $single, $doc),)*
                };
                let kind = if single { element } else { format!("array<{element}>") };
                let space = if self.access() == Access::Uniform { "uniform" } else { "storage, read_write" };
                format!("// {doc}\n@group(0) @binding({}) var<{space}> {name}: {kind};\n", self as u32)
            }
        }
    };
}

bindings! {
    facts: Facts::wgsl(), true, "What does not change in a run.";
    now: Now::wgsl(), true, "What changes from one dispatch to the next.";
    values: Value::wgsl(), false, "Normalisation, noise and mirror image of each value, [n_values].";
    action_images: "u32".to_owned(), false, "Mirror image of each action, [n_actions].";
    action: "u32".to_owned(), false, "The simulator's column of actions, [n_envs].";
    truck: Truck::wgsl(), false, "The simulator's column of trucks, [n_envs].";
    observation: "f32".to_owned(), false, "The simulator's column of observations, [n_envs, N_VALUES].";
    next_observation: "f32".to_owned(), false, "The simulator's column of next observations, [n_envs, N_VALUES].";
    extras: "f32".to_owned(), false, "The simulator's column of extras, [n_envs, N_EXTRAS].";
    next_extras: "f32".to_owned(), false, "The simulator's column of next extras, [n_envs, N_EXTRAS].";
    around: "f32".to_owned(), false, "The simulator's column of other vehicles, [n_envs, N_AROUND], where they count.";
    next_around: "f32".to_owned(), false, "The same after the step.";
    ended: "u32".to_owned(), false, "The simulator's column of end codes, [n_envs].";
    reward: "f32".to_owned(), false, "The simulator's column of rewards, [n_envs].";
    held_observation: "f32".to_owned(), false, "The ring: observations, [n_slots, n_envs, n_values].";
    held_next: "f32".to_owned(), false, "The ring: next observations, [n_slots, n_envs, n_values].";
    held_action: "u32".to_owned(), false, "The ring: actions, [n_slots, n_envs].";
    held_reward: "f32".to_owned(), false, "The ring: rewards, [n_slots, n_envs].";
    held_ended: "u32".to_owned(), false, "The ring: end codes, [n_slots, n_envs].";
    driven: "u32".to_owned(), false, "Routes of the step in hand, [n_envs].";
    route_ends: "atomic<u32>".to_owned(), false, "Episodes that ended, by route and end code, [n_routes, N_ENDS].";
    seen: "f32".to_owned(), false, "What the actor sees, normalised, [n_envs, n_values].";
    logits: "f32".to_owned(), false, "The actor's output, [n_envs, n_actions].";
    sampled_row: "u32".to_owned(), false, "A sample: where in the ring its transitions begin, [n_rows].";
    sampled_weight: "f32".to_owned(), false, "A sample: importance-sampling weights, [n_rows].";
    sampled_observation: "f32".to_owned(), false, "A sample: observations, [n_rows, n_values].";
    sampled_action: "i32".to_owned(), false, "A sample: actions, [n_rows].";
    sampled_reward: "f32".to_owned(), false, "A sample: rewards, [n_rows].";
    sampled_discount: "f32".to_owned(), false, "A sample: discounts, [n_rows].";
    sampled_next: "f32".to_owned(), false, "A sample: next observations, [n_rows, n_values].";
    td_error: "f32".to_owned(), false, "Absolute TD errors of the latest sample, [n_rows].";
    priority: "f32".to_owned(), false, "Priorities, 0 where nothing can be sampled, [n_slots, n_envs].";
    block_sum: "f32".to_owned(), false, "Sums of the priorities of each block, [n_blocks].";
    reached: "f32".to_owned(), false, "Sums of a block and all before it, [n_blocks].";
    largest: "atomic<u32>".to_owned(), true, "Bits of the largest priority that there ever was.";
}

impl Binding {
    /// What the kernels may do.
    fn access(self) -> Access {
        if matches!(self, Binding::facts | Binding::now) { Access::Uniform } else { Access::ReadWrite }
    }
}

offtrack::named! {
    /// The kernels' entry points.
    pub enum Kernel {
        /// Normalises what the actor sees.
        Look = "look",
        /// Samples an action for every truck from the actor's output.
        Choose = "choose",
        /// Stores observations and actions before a step.
        StoreBefore = "store_before",
        /// Stores what the step led to.
        StoreAfter = "store_after",
        /// Counts the episodes that ended.
        CountEnds = "count_ends",
        /// Lets the transitions that enough steps follow be sampled by priority.
        Admit = "admit",
        /// Sums the priorities of each block.
        SumBlocks = "sum_blocks",
        /// Adds up the blocks.
        AddUp = "add_up",
        /// Draws the rows of a sample uniformly.
        Pick = "pick",
        /// Draws them by priority.
        PickByPriority = "pick_by_priority",
        /// Weighs what was drawn by priority.
        Weigh = "weigh",
        /// Sets priorities from TD errors.
        SetPriorities = "set_priorities",
        /// Samples transitions: what was observed and done.
        Sample = "sample",
        /// What that led to.
        SampleNext = "sample_next",
    }
}

impl Kernel {
    /// The buffers that it is bound to: all that its shader names.
    pub(super) fn bindings(self) -> &'static [Binding] {
        use Binding::*;
        match self {
            Kernel::Look => &[facts, values, observation, extras, around, seen],
            Kernel::Choose => &[facts, now, action, logits],
            Kernel::StoreBefore => {
                &[facts, now, action, truck, observation, extras, around, held_observation, held_action, driven]
            }
            Kernel::CountEnds => &[facts, ended, driven, route_ends],
            Kernel::StoreAfter => &[
                facts,
                now,
                next_observation,
                next_extras,
                next_around,
                ended,
                reward,
                held_next,
                held_reward,
                held_ended,
            ],
            Kernel::Admit => &[facts, now, priority, largest],
            Kernel::SumBlocks => &[facts, priority, block_sum],
            Kernel::AddUp => &[facts, block_sum, reached],
            Kernel::Pick => &[facts, now, sampled_row],
            Kernel::PickByPriority => &[facts, now, sampled_row, priority, block_sum, reached],
            Kernel::Weigh => &[facts, sampled_row, sampled_weight, priority],
            Kernel::SetPriorities => &[facts, sampled_row, td_error, priority, largest],
            Kernel::Sample => &[
                facts,
                now,
                values,
                action_images,
                held_observation,
                held_action,
                sampled_row,
                sampled_observation,
                sampled_action,
            ],
            Kernel::SampleNext => &[
                facts,
                now,
                values,
                held_next,
                held_reward,
                held_ended,
                sampled_row,
                sampled_reward,
                sampled_discount,
                sampled_next,
            ],
        }
    }

    /// Threads that it needs: one a truck, a value, a transition or a block, or one workgroup.
    fn threads(self, facts: &Facts) -> u64 {
        let (envs, rows, values) = (u64::from(facts.n_envs), u64::from(facts.n_rows), u64::from(facts.n_values));
        match self {
            Kernel::Choose | Kernel::CountEnds | Kernel::Admit => envs,
            Kernel::Look | Kernel::StoreBefore | Kernel::StoreAfter => envs * values,
            Kernel::SumBlocks => facts.n_blocks.into(),
            Kernel::AddUp | Kernel::Weigh => WORKGROUP.into(),
            Kernel::Pick | Kernel::PickByPriority | Kernel::SetPriorities => rows,
            Kernel::Sample | Kernel::SampleNext => rows * values,
        }
    }
}

/// The module's text.
pub(super) fn source() -> String {
    let common =
        SHADERS.iter().filter(|(name, _)| ["common/thread", "common/random"].contains(name)).map(|(_, text)| *text);
    let bindings: String = Binding::ALL.map(Binding::declaration).concat();
    let constants = format!(
        "const BLOCK: u32 = {BLOCK}u;\nconst LEAST_ERROR: f32 = {LEAST_ERROR:?}f;\nconst INFINITE: u32 = {}u;\n\
         const N_ENDS: u32 = {}u;\n",
        f32::INFINITY.to_bits(),
        Ended::ALL.len()
    );
    let own = [wgsl::shared(), constants, printed_structs(), bindings];
    let kernels =
        [include_str!("../../../shaders/replay_buffer.wgsl"), include_str!("../../../shaders/priorities.wgsl")];
    own.iter().map(String::as_str).chain(common).chain(kernels).collect()
}

/// Compiles the kernels.
pub(super) fn compile(device: &Device) -> Kernels<Kernel> {
    Kernels::compile(device, "replay buffer", source(), |kernel: Kernel| {
        kernel.bindings().iter().map(|&binding| (binding as u32, binding.access())).collect()
    })
}

/// Adds a kernel to the commands, bound to its `group`.
pub(super) fn add(
    kernels: &Kernels<Kernel>,
    encoder: &mut CommandEncoder,
    group: &BindGroup,
    kernel: Kernel,
    facts: &Facts,
) {
    let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
    kernels.dispatch(&mut pass, kernel, group, kernel.threads(facts));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kernel_is_bound_to_what_its_shader_names_and_to_no_more_than_every_device_has() {
        let bindings = |&kernel: &Kernel| {
            let each = kernel.bindings().iter().map(|&binding| (binding as u32, binding.access()));
            (kernel.name(), each.collect())
        };
        crate::device::assert_bound(&source(), Kernel::ALL.iter().map(bindings));
    }
}
