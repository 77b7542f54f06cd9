//! The journal: a kernel of the page that notes the episodes that failed, where the truck was and which they were, so
//! that a picture shows them and a click drives one again.

use glam::Vec2;
use offtrack::engine::wgsl;
use offtrack::layout::Column;
use offtrack::layout::buffers::{Buffer, N_BUFFERS, Table};
use serde_json::{Value, json};

offtrack::shared! {
    /// An episode that failed.
    pub struct Failure {
        /// Middle of the drive axle at its end (m).
        pub position: Vec2,
        /// Index of the truck.
        pub env: u32,
        /// Index of the truck's episode.
        pub episode: u32,
        /// Why it ended.
        pub ended: u32,
        /// Index of the route.
        pub route: u32,
        /// Index of the vehicle.
        pub vehicle: u32,
        /// Steps of the episode.
        pub steps: u32,
    }
}

/// The kernel's name.
pub(super) const NAME: &str = "note";
/// Failures that are kept: the latest ones.
const ROOM: u32 = 256;
/// Bytes before the first of them: the count of all, and what aligns them.
const HEAD: usize = 8;
/// The buffers that the kernel reads, by the bindings of a step.
const READ: [Buffer; 3] = [Buffer::Table(Table::Batch), Buffer::Column(Column::Truck), Buffer::Column(Column::Ended)];

/// The kernel's module.
pub(super) fn module() -> String {
    [wgsl::picture().as_str(), &declared("atomic<u32>", "read_write"), include_str!("journal.wgsl")].concat()
}

/// The journal as a picture sees it.
pub(super) fn declared_to_read() -> String {
    declared("u32", "read")
}

fn declared(count: &str, access: &str) -> String {
    format!(
        "{}// The failures, as a ring.\nstruct Journal {{\n    // All, of which the latest are kept.\n    \
         count: {count},\n    failures: array<Failure>,\n}}\n\n\
         @group(0) @binding({N_BUFFERS}) var<storage, {access}> journal: Journal;\n",
        printed_structs()
    )
}

/// What a host must know of it.
pub(super) fn facts() -> Value {
    json!({
        "kernel": NAME,
        "bindings": READ.map(Buffer::binding),
        "binding": N_BUFFERS,
        "room": ROOM,
        "head": HEAD,
        "bytes": HEAD + ROOM as usize * size_of::<Failure>(),
    })
}
