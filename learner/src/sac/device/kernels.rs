//! The kernels of an update on a device: structs and bindings declared once, printed for their shaders, and compiled.

use glam::Vec2;
use offtrack::engine::stages::SHADERS;
use offtrack::gpu::Kernels;
use offtrack::layout::buffers::Access;
use offtrack::layout::shared::Literal;
use wgpu::Device;

use crate::adam::DECAY;
use crate::device::{self, N_PRODUCTS};
use crate::network::NORM_EPSILON;
use crate::sac::entropy;

offtrack::shared! {
    /// What does not change from one update to the next. Places are indices in the learner's memory.
    pub struct Facts {
        /// Transitions of a batch.
        pub n_rows: u32,
        /// Values that the networks observe.
        pub n_values: u32,
        /// Outputs of the networks.
        pub n_actions: u32,
        /// Parameters of a network.
        pub n_parameters: u32,
        /// The critics' values are combined by their minimum, not their mean (0 or 1).
        pub takes_minimum: u32,
        /// The TD target includes the entropy of the next state (0 or 1).
        pub entropy_in_target: u32,
        /// Place of the moments, first and second, of all parameters that learn.
        pub moments: u32,
        /// Place of their gradients.
        pub gradients: u32,
        /// Place of the entropy coefficient's logarithm and its two moments.
        pub entropy: u32,
        /// Place of the sums of the four figures.
        pub sums: u32,
        /// Place of the four figures of each transition.
        pub figures: u32,
        /// Place of the batch's observations, and behind them of the next ones.
        pub observations: u32,
        /// Place of the outputs of all passes.
        pub outputs: u32,
        /// Place of the gradients by the outputs of the passes that learn.
        pub output_errors: u32,
    }

    /// What changes from one update to the next.
    pub struct Now {
        /// Learning rates of the actor and of the critics, corrected for the moments' beginning.
        pub rates: Vec2,
        /// What keeps their steps from dividing by 0, corrected likewise.
        pub epsilons: Vec2,
        /// How far the actor's EMA and the target critics follow.
        pub follow: Vec2,
        /// Corrections of the entropy coefficient's moments.
        pub entropy_corrections: Vec2,
        /// Learning rate of the entropy coefficient.
        pub entropy_rate: f32,
        /// Entropy that it is adapted to (nat).
        pub entropy_target: f32,
        /// It is adapted (0 or 1).
        pub adapts: u32,
        /// Fills the row.
        pub unused: u32,
    }

    /// A layer normalisation in a pass. Places are indices in the learner's memory.
    pub struct Norm {
        /// Rows.
        pub n_rows: u32,
        /// Values of a row.
        pub width: u32,
        /// Place of the sums, which become the normalised values.
        pub values: u32,
        /// Place of what the rectifier leaves.
        pub activations: u32,
        /// Place of the factor of each row.
        pub factors: u32,
        /// Place of the gradients by what the rectifier left, which become those by the sums.
        pub errors: u32,
        /// Place of the scale of each value.
        pub scale: u32,
        /// Place of the shift of each value.
        pub shift: u32,
        /// Place of the gradient by the scale.
        pub by_scale: u32,
        /// Place of the gradient by the shift.
        pub by_shift: u32,
        /// Fills the row.
        pub unused: u32,
        /// Fills it.
        pub unused_too: u32,
    }
}

/// Passes with layer normalisations: those of the critics first, then those of the target critics.
pub const N_NORMS: usize = 4;
/// Critics.
pub const N_CRITICS: usize = 2;
/// Networks that learn: the actor and the critics. Those that follow them are as many.
pub const N_LEARNING: usize = 3;
/// Columns of a workgroup of `sum_norms`.
pub const BESIDE: u32 = 8;

offtrack::named! {
    /// The passes of an update forward: the first ones learn.
    pub enum Pass {
        /// The actor on the observations.
        Actor = "ACTOR",
        /// The critics there.
        Critic1 = "CRITIC_1",
        /// The second one.
        Critic2 = "CRITIC_2",
        /// The actor on the next observations.
        ActorNext = "ACTOR_NEXT",
        /// The target critics there.
        Target1 = "TARGET_1",
        /// The second one.
        Target2 = "TARGET_2",
    }
}

offtrack::named! {
    /// The buffers that the kernels see, in the order of their bindings.
    pub enum Binding {
        /// What does not change.
        Facts = "facts",
        /// What changes from one update to the next.
        Now = "now",
        /// Products of a dispatch.
        Products = "products",
        /// Layer normalisations of a layer.
        Norms = "norms",
        /// All numbers of the learner: parameters first.
        Memory = "memory",
        /// The batch's observations.
        Observation = "observation",
        /// Its next observations.
        NextObservation = "next_observation",
        /// Its actions.
        Action = "action",
        /// Its n-step returns.
        Reward = "reward",
        /// Its discounts.
        Discount = "discount",
        /// Its importance-sampling weights.
        Weight = "weight",
        /// Absolute TD errors.
        TdError = "td_error",
    }
}

impl Binding {
    pub(super) fn access(self) -> Access {
        match self {
            Binding::Facts | Binding::Now | Binding::Products | Binding::Norms => Access::Uniform,
            Binding::Memory | Binding::TdError => Access::ReadWrite,
            _ => Access::Read,
        }
    }

    fn declaration(self) -> String {
        let kind = match self {
            Binding::Facts => "Facts".to_owned(),
            Binding::Now => "Now".to_owned(),
            Binding::Products => format!("array<Product, {N_PRODUCTS}>"),
            Binding::Norms => format!("array<Norm, {N_NORMS}>"),
            Binding::Action => "array<i32>".to_owned(),
            _ => "array<f32>".to_owned(),
        };
        let space = match self.access() {
            Access::Uniform => "uniform",
            Access::Read => "storage, read",
            _ => "storage, read_write",
        };
        format!("@group(0) @binding({}) var<{space}> {}: {kind};\n", self as u32, self.name())
    }
}

offtrack::named! {
    /// The kernels' entry points.
    pub enum Kernel {
        /// Copies a sample's observations to the passes' inputs.
        Gather = "gather",
        /// Makes products.
        Multiply = "multiply",
        /// Normalises the rows of a layer.
        Normalise = "normalise",
        /// Losses, and their gradients by the networks' outputs.
        FindErrors = "find_errors",
        /// Gradients by the scales and shifts of a layer.
        SumNorms = "sum_norms",
        /// Gradients by a layer's sums.
        NormaliseBack = "normalise_back",
        /// Adds up figures, and adapts the entropy coefficient.
        AddFigures = "add_figures",
        /// Moves all parameters.
        MoveParameters = "move_parameters",
    }
}

impl Kernel {
    /// The buffers that it is bound to: all that its shader names.
    pub(super) fn bindings(self) -> &'static [Binding] {
        use Binding::*;
        match self {
            Kernel::Gather => &[Facts, Memory, Observation, NextObservation],
            Kernel::Multiply => &[Products, Memory],
            Kernel::Normalise | Kernel::SumNorms | Kernel::NormaliseBack => &[Norms, Memory],
            Kernel::FindErrors => &[Facts, Memory, Action, Reward, Discount, Weight, TdError],
            Kernel::AddFigures | Kernel::MoveParameters => &[Facts, Now, Memory],
        }
    }
}

/// The module's text.
pub(in crate::sac) fn source() -> String {
    let constants = [
        ("N_NORMS", (N_NORMS as u32).literal()),
        ("N_CRITICS", (N_CRITICS as u32).literal()),
        ("N_LEARNING", (N_LEARNING as u32).literal()),
        ("BESIDE", BESIDE.literal()),
        ("NORM_EPSILON", (NORM_EPSILON as f32).literal()),
        ("DECAY_1", DECAY[0].literal()),
        ("DECAY_2", DECAY[1].literal()),
        ("ENTROPY_EPSILON", entropy::EPSILON.literal()),
    ];
    let mut constants: String = constants.map(|(name, value)| format!("const {name} = {value};\n")).concat();
    for pass in Pass::ALL {
        constants += &format!("const {} = {};\n", pass.name(), (pass as u32).literal());
    }
    let bindings: String = Binding::ALL.map(Binding::declaration).concat();
    let common = SHADERS.iter().filter(|(name, _)| *name == "common/thread").map(|(_, text)| *text);
    let own = [device::constants(), constants, device::printed_structs(), printed_structs(), bindings];
    let kernels = [include_str!("../../../shaders/learn.wgsl"), include_str!("../../../shaders/products.wgsl")];
    own.iter().map(String::as_str).chain(common).chain(kernels).collect()
}

/// Compiles the kernels.
pub(super) fn compile(device: &Device) -> Kernels<Kernel> {
    Kernels::compile(device, "learner", source(), |kernel: Kernel| {
        kernel.bindings().iter().map(|&binding| (binding as u32, binding.access())).collect()
    })
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
        device::assert_bound(&source(), Kernel::ALL.iter().map(bindings));
    }
}
