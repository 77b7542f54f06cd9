//! The buffers that the kernels of a step see: a binding each, in this order. A kernel is bound to those that it names.

use super::{Action, BatchFacts, BeginRow, Column, Disturbances, N_COLUMNS, Params, Reward, Stream, VehicleRow};
use crate::layout::shared::{Named, Shared, comment};

/// What shaders may do to a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Read it, as a uniform: a few values that do not count among the storage buffers.
    Uniform,
    /// Read it.
    Read,
    /// Read and write it.
    ReadWrite,
    /// Add to its words from all threads at once.
    Count,
}

/// What a buffer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Buffer {
    /// What trucks share.
    Table(Table),
    /// A column of the batch.
    Column(Column),
    /// Sums over all steps.
    Tally,
}

crate::named! {
    /// What trucks share: first the world, then what belongs to one batch.
    pub enum Table {
        /// Time and limits.
        Params = "params",
        /// What the reward weighs.
        Weights = "weights",
        /// What the world does to a policy.
        Disturbances = "disturbances",
        /// The vehicles with their distance sensors.
        Vehicles = "vehicles",
        /// The action table.
        Actions = "actions",
        /// Every route, its waypoints and what is observed there, and where its field lies.
        Roads = "roads",
        /// Cells of all fields.
        Cells = "cells",
        /// Blocks of distances of all fields.
        Corners = "corners",
        /// What ends an episode: waypoints and steps.
        Limits = "limits",
        /// Where other vehicles drive, and how.
        Lanes = "lanes",
        /// Facts that the trucks of a batch share.
        Batch = "batch",
        /// Routes that episodes run on.
        Choice = "choice",
        /// The stream of random numbers that each truck draws from.
        Streams = "streams",
        /// Which trucks begin an episode when the caller says so, and how.
        Begins = "begins",
    }
}

/// Tables.
pub const N_TABLES: usize = Table::ALL.len();
/// Buffers: tables, columns, tally.
pub const N_BUFFERS: usize = N_TABLES + N_COLUMNS + 1;

/// Every buffer; its index is its binding.
pub const BUFFERS: [Buffer; N_BUFFERS] = {
    let mut buffers = [Buffer::Tally; N_BUFFERS];
    let mut binding = 0;
    while binding < N_BUFFERS - 1 {
        buffers[binding] = if binding < N_TABLES {
            Buffer::Table(Table::ALL[binding])
        } else {
            Buffer::Column(Column::ALL[binding - N_TABLES])
        };
        binding += 1;
    }
    buffers
};

impl Buffer {
    /// The buffer's name in WGSL.
    pub fn name(self) -> &'static str {
        match self {
            Buffer::Table(table) => table.name(),
            Buffer::Column(column) => column.name(),
            Buffer::Tally => "tally",
        }
    }

    /// What shaders may do.
    pub const fn access(self) -> Access {
        match self {
            Buffer::Table(Table::Params | Table::Weights | Table::Disturbances | Table::Batch) => Access::Uniform,
            Buffer::Table(_) => Access::Read,
            Buffer::Column(_) => Access::ReadWrite,
            Buffer::Tally => Access::Count,
        }
    }

    /// The buffer's binding: its index in [`BUFFERS`].
    pub const fn binding(self) -> usize {
        match self {
            Buffer::Table(table) => table as usize,
            Buffer::Column(column) => N_TABLES + column as usize,
            Buffer::Tally => N_BUFFERS - 1,
        }
    }

    /// What the buffer holds, and the type of that in WGSL.
    fn declared(self) -> (String, String) {
        match self {
            Buffer::Table(table) => table.declared(),
            Buffer::Column(column) => {
                (format!("{}, {}.", column.doc().trim(), column.shape()), format!("array<{}>", column.element()))
            }
            Buffer::Tally => (
                "Sums over all steps, 64 bits each, the lower half first, [N_SUMS, 2].".to_owned(),
                "array<atomic<u32>>".to_owned(),
            ),
        }
    }
}

impl Table {
    fn declared(self) -> (String, String) {
        fn rows<T: Shared>() -> String {
            format!("array<{}>", T::element())
        }
        let (doc, kind) = match self {
            Table::Params => ("Time and limits.", Params::wgsl()),
            Table::Weights => ("What the reward weighs.", Reward::wgsl()),
            Table::Disturbances => ("What the world does to a policy.", Disturbances::wgsl()),
            Table::Vehicles => ("The vehicles with their distance sensors.", rows::<VehicleRow>()),
            Table::Actions => ("The action table.", rows::<Action>()),
            Table::Roads => (
                "Every route, all waypoints and what is observed at each of them, as common/road.wgsl reads them.",
                "array<vec4<u32>>".to_owned(),
            ),
            Table::Cells => ("Cells of all fields, two words each.", "array<vec2<u32>>".to_owned()),
            Table::Corners => (
                "Blocks of distances of all fields; a word is a pair, the southern one in its lower half, in units of \
                 STORED_UNIT.",
                rows::<u32>(),
            ),
            Table::Limits => (
                "Each vehicle's class; then each route's number of waypoints, and each class's steps until it times \
                 out; last, among other vehicles, what hindering them weighs.",
                rows::<u32>(),
            ),
            Table::Lanes => (
                "Of other vehicles: the driver model's numbers, for each route the first word of its road and where it \
                 runs there, and each road's tables, as traffic/cars.wgsl reads them.",
                rows::<u32>(),
            ),
            Table::Batch => ("Facts that the trucks of a batch share.", BatchFacts::wgsl()),
            Table::Choice => ("Routes that episodes run on: to be drawn from, or one for each truck.", rows::<u32>()),
            Table::Streams => ("The stream of random numbers that each truck draws from, [n_envs].", rows::<Stream>()),
            Table::Begins => {
                ("Which trucks begin an episode when the caller says so, and how, [n_envs].", rows::<BeginRow>())
            }
        };
        (doc.to_owned(), kind)
    }
}

/// The declarations in WGSL.
pub(crate) fn printed() -> String {
    BUFFERS.into_iter().map(|buffer| declaration(buffer, buffer.access())).collect()
}

/// Those of a picture, whose shaders read tables and columns and write none.
pub(crate) fn printed_to_read() -> String {
    let read = |buffer: Buffer| match buffer.access() {
        Access::Uniform => Some(declaration(buffer, Access::Uniform)),
        Access::Read | Access::ReadWrite => Some(declaration(buffer, Access::Read)),
        Access::Count => None,
    };
    BUFFERS.into_iter().filter_map(read).collect()
}

/// A buffer's declaration, with what shaders may do to it.
fn declaration(buffer: Buffer, access: Access) -> String {
    let (doc, kind) = buffer.declared();
    let space = match access {
        Access::Uniform => "uniform",
        Access::Read => "storage, read",
        Access::ReadWrite | Access::Count => "storage, read_write",
    };
    let (binding, name) = (buffer.binding(), buffer.name());
    comment("", &[&doc]) + &format!("@group(0) @binding({binding}) var<{space}> {name}: {kind};\n")
}
