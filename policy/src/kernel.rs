//! The kernel that acts: its structs, buffers and shapes, declared once and printed for `act.wgsl`. It runs on a
//! device, and in a browser.

use offtrack::engine::stages::SHADERS;
use offtrack::engine::wgsl;
use offtrack::layout::buffers::Access;
use offtrack::layout::shared::Literal;

use crate::file::MOST_LAYERS;
use crate::normalisation::LIMIT;

offtrack::shared! {
    /// What a policy's actions depend on beside its numbers.
    pub struct Facts {
        /// Values that are observed: those of an observation, the extras behind them, and those of other vehicles.
        pub n_values: u32,
        /// Layers.
        pub n_layers: u32,
        /// Outputs of the last layer.
        pub n_actions: u32,
        /// Whether the hyperbolic tangent stands after each layer but the last, not the rectifier (0 or 1).
        pub is_tanh: u32,
        /// Whether actions are sampled (0 or 1).
        pub is_sampled: u32,
        /// Seed of the samples.
        pub seed: u32,
    }

    /// A layer. Its weights stand input by input, each with a row of columns.
    pub struct LayerRow {
        /// Inputs, padded to a multiple of four; the weights of the last ones are zeros.
        pub n_inputs: u32,
        /// Columns of four outputs each; the last is filled with zeros.
        pub n_columns: u32,
        /// Index of its weights.
        pub weights: u32,
        /// Index of its biases.
        pub biases: u32,
    }
}

offtrack::named! {
    /// The kernel's entry point.
    pub enum Kernel {
        /// Chooses an action for every truck.
        Act = "act",
    }
}

/// How a workgroup is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Threads side by side, for four outputs of a layer each.
    pub columns: u32,
    /// As many of them, each for trucks of its own.
    pub teams: u32,
    /// Half of the trucks of a team.
    pub trucks: u32,
}

/// The shapes, each of 16 KB, for narrow networks first: the more trucks, the fewer reads of weights for each.
pub const SHAPES: [Shape; 3] = [
    Shape { columns: 64, teams: 2, trucks: 4 },
    Shape { columns: 128, teams: 1, trucks: 4 },
    Shape { columns: 256, teams: 1, trucks: 2 },
];

impl Shape {
    /// Most outputs of a layer.
    pub const fn width(self) -> u32 {
        4 * self.columns
    }

    /// Trucks of a workgroup.
    pub const fn tile(self) -> u32 {
        2 * self.teams * self.trucks
    }

    /// Threads of a workgroup.
    pub const fn threads(self) -> u32 {
        self.teams * self.columns
    }

    /// Workgroup memory (bytes).
    pub const fn memory(self) -> u32 {
        self.tile() * self.width() * size_of::<f32>() as u32
    }

    /// The constants, a vector of so many trucks, and how it is read.
    fn printed(self) -> String {
        let constants = [
            ("COLUMNS", self.columns),
            ("TEAMS", self.teams),
            ("TRUCKS", self.trucks),
            ("WIDTH", self.width()),
            ("TILE", self.tile()),
        ];
        let constants = constants.map(|(name, value)| format!("const {name}: u32 = {};\n", value.literal())).concat();
        let each: Vec<String> = (0..self.trucks).map(|n| format!("normalised(first + {n}u, value)")).collect();
        format!(
            "{constants}const LIMIT: f32 = {};\nalias Trucks = vec{}<f32>;\n\n\
             fn observed(first: u32, value: u32) -> Trucks {{\n    return Trucks({});\n}}\n\n",
            LIMIT.literal(),
            self.trucks,
            each.join(", ")
        )
    }
}

/// The buffers that the kernel sees, in the order of their bindings: name, access, type, and what they hold.
pub const BUFFERS: [(&str, Access, &str, &str); 8] = [
    ("facts", Access::Uniform, "Facts", "What actions depend on beside the policy's numbers."),
    ("layers", Access::Uniform, "array<LayerRow, MOST_LAYERS>", "The layers."),
    ("normalisation", Access::Read, "array<vec2<f32>>", "Mean and factor of each value, [n_values]."),
    ("weights", Access::Read, "array<vec4<f32>>", "Weights and biases of all layers."),
    ("observation", Access::Read, "array<f32>", "The simulator's column of observations, [n_envs, N_VALUES]."),
    ("extras", Access::Read, "array<f32>", "The simulator's column of extras, [n_envs, N_EXTRAS]."),
    ("truck", Access::Read, "array<Truck>", "The simulator's trucks, [n_envs]."),
    ("action", Access::ReadWrite, "array<u32>", "The simulator's column of actions, [n_envs]."),
];

/// The buffer beside them of a policy that reads what other vehicles do.
const AROUND: (&str, Access, &str, &str) =
    ("around", Access::Read, "array<f32>", "The simulator's column of other vehicles, [n_envs, N_AROUND].");

/// The buffers that the kernel sees, of a policy that reads what other vehicles do or of another one.
pub fn buffers(reads_vehicles: bool) -> impl Iterator<Item = (&'static str, Access, &'static str, &'static str)> {
    BUFFERS.into_iter().chain(reads_vehicles.then_some(AROUND))
}

/// The module's text, for a policy that reads what other vehicles do or for another one.
pub fn source(shape: Shape, reads_vehicles: bool) -> String {
    let declared = buffers(reads_vehicles).enumerate().map(|(binding, (name, access, kind, doc))| {
        let space = match access {
            Access::Uniform => "uniform",
            Access::Read => "storage, read",
            Access::ReadWrite | Access::Count => "storage, read_write",
        };
        format!("// {doc}\n@group(0) @binding({binding}) var<{space}> {name}: {kind};\n")
    });
    let own = [
        wgsl::shared(),
        format!("const MOST_LAYERS: u32 = {};\n", MOST_LAYERS.literal()),
        printed_structs(),
        declared.collect(),
        shape.printed(),
    ];
    let common = SHADERS.iter().filter(|(name, _)| *name == "common/random").map(|(_, text)| *text);
    let beside =
        if reads_vehicles { include_str!("../shaders/vehicles.wgsl") } else { include_str!("../shaders/extras.wgsl") };
    own.iter().map(String::as_str).chain(common).chain([beside, "\n", include_str!("../shaders/act.wgsl")]).collect()
}
