//! The buffers that shaders see: one bind group, a binding each, in this order.

use glam::Vec2;

use super::shared::{Shared, comment};
use super::{
    Action, BatchFacts, Clearance, Control, FieldRow, Params, PreviewRow, Progress, Ray, RewardTerms, RouteRow, Truck, WaypointRow,
};

/// What shaders may do to a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Read it.
    Read,
    /// Read and write it.
    ReadWrite,
    /// Count in it.
    Count,
}

/// One buffer.
#[derive(Debug, Clone, Copy)]
pub struct Buffer {
    /// Its name in WGSL; that of the column for those of a batch.
    pub name: &'static str,
    /// What it holds.
    pub doc: &'static str,
    /// Type of an element in WGSL.
    pub element: fn() -> String,
    /// Whether it is one element rather than an array of them.
    pub single: bool,
    /// What shaders may do.
    pub access: Access,
}

const fn single(name: &'static str, doc: &'static str, element: fn() -> String) -> Buffer {
    Buffer { name, doc, element, single: true, access: Access::Read }
}

const fn table(name: &'static str, doc: &'static str, element: fn() -> String) -> Buffer {
    Buffer { name, doc, element, single: false, access: Access::Read }
}

const fn column(name: &'static str, doc: &'static str, element: fn() -> String) -> Buffer {
    Buffer { name, doc, element, single: false, access: Access::ReadWrite }
}

/// Buffers in the bind group.
pub const N_BUFFERS: usize = 23;
/// The first column of a batch. Before it stand the tables of the world, then the batch's facts and routes.
pub const FIRST_COLUMN: usize = 11;

/// Every buffer; its place is its binding.
pub const BUFFERS: [Buffer; N_BUFFERS] = [
    single("params", "Vehicle, time and weights.", Params::wgsl),
    table("actions", "The action table.", Action::wgsl),
    table("rays", "The distance sensors, trailer's first.", Ray::wgsl),
    table("fields", "A field for each roundabout.", FieldRow::wgsl),
    table("cells", "Cells of all fields: of each first its own, then those for marching.", u32::wgsl),
    table("corners", "Blocks of distances of all fields; a pair is the southern and the northern one [m].", Vec2::wgsl),
    table("waypoints", "Every route's waypoints, one route after the other.", WaypointRow::wgsl),
    table("previews", "What is observed at each of them.", PreviewRow::wgsl),
    table("routes", "Every route.", RouteRow::wgsl),
    single("batch", "What the trucks of a batch share.", BatchFacts::wgsl),
    table("choice", "Routes that episodes run on: to be drawn from, or one a truck.", u32::wgsl),
    column("action", "Index into the action table, [n_envs].", u32::wgsl),
    column("control", "What drives each truck, [n_envs].", Control::wgsl),
    column("truck", "The trucks, [n_envs].", Truck::wgsl),
    column("clearance", "Distances to the kerbs, [n_envs].", Clearance::wgsl),
    column("progress", "Places along the routes, [n_envs].", Progress::wgsl),
    column("ranges", "Distance sensors [m], [n_envs, N_RAYS].", f32::wgsl),
    column("observation", "What the next action sees, [n_envs, N_VALUES].", f32::wgsl),
    column("next_observation", "What the last action led to, [n_envs, N_VALUES].", f32::wgsl),
    column("ended", "Why each episode ended in the step just made, [n_envs].", u32::wgsl),
    column("terms", "What the reward weighs, [n_envs].", RewardTerms::wgsl),
    column("reward", "Rewards of the step just made, [n_envs].", f32::wgsl),
    Buffer {
        name: "tally",
        doc: "Sums over all steps, 64 bits each, the lower half first, [N_SUMS, 2].",
        element: u32::wgsl,
        single: false,
        access: Access::Count,
    },
];

/// The declarations in WGSL.
pub(super) fn printed() -> String {
    let mut printed = String::new();
    for (binding, Buffer { name, doc, element, single, access }) in BUFFERS.iter().enumerate() {
        let element = if *access == Access::Count { format!("atomic<{}>", element()) } else { element() };
        let mode = if *access == Access::Read { "read" } else { "read_write" };
        let kind = if *single { element } else { format!("array<{element}>") };
        printed += &comment("", &[&format!(" {doc}")]);
        printed += &format!("@group(0) @binding({binding}) var<storage, {mode}> {name}: {kind};\n");
    }
    printed
}
