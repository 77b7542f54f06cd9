//! The journal: a kernel of the page that notes the episodes that failed, where the truck was and which they were, so
//! that a picture shows them and a click drives one again.

use glam::Vec2;
use offtrack::engine::wgsl;
use offtrack::layout::Column;
use offtrack::layout::buffers::{Buffer, N_BUFFERS, Table};
use serde_json::{Map, Value, json};

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
        /// The other vehicle that it met: 0 is none, 1 a car, 2 a van, 3 a bus or a truck.
        pub met: u32,
        /// 1 if its tractor met it, or else its trailer; 2 more if the vehicle was beyond its line.
        pub contact: u32,
    }
}

/// The kernel of trucks alone: its name, and the buffers that it reads, by the bindings of a step.
const ALONE: (&str, &[Buffer]) =
    ("note", &[Buffer::Table(Table::Batch), Buffer::Column(Column::Truck), Buffer::Column(Column::Ended)]);
/// That of trucks among vehicles.
const AMONG: (&str, &[Buffer]) = (
    "note_among",
    &[
        Buffer::Table(Table::Vehicles),
        Buffer::Table(Table::Lanes),
        Buffer::Table(Table::Batch),
        Buffer::Column(Column::Truck),
        Buffer::Column(Column::Ended),
        Buffer::Column(Column::Cars),
    ],
);
/// Failures that are kept: the latest ones.
const ROOM: u32 = 256;
/// Bytes before the first of them: the count of all, and what aligns them.
const HEAD: usize = 8;

/// The name of the kernel that notes, of trucks among vehicles or alone.
pub(super) const fn kernel(has_vehicles: bool) -> &'static str {
    if has_vehicles { AMONG.0 } else { ALONE.0 }
}

/// The kernels' module.
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

/// What a host must know of it: of each kernel the bindings that it reads.
pub(super) fn facts() -> Value {
    let bindings = |read: &[Buffer]| -> Vec<usize> { read.iter().map(|buffer| buffer.binding()).collect() };
    let kernels: Map<_, _> =
        [ALONE, AMONG].map(|(name, read)| (name.to_owned(), bindings(read).into())).into_iter().collect();
    json!({
        "kernels": kernels,
        "binding": N_BUFFERS,
        "room": ROOM,
        "head": HEAD,
        "bytes": HEAD + ROOM as usize * size_of::<Failure>(),
    })
}
