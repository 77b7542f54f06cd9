//! The buffers of a batch on a device, and the bind groups that kernels see them through.

use bytemuck::{bytes_of, cast_slice};
use wgpu::{BindGroup, Buffer};

use super::{Device, Error};
use crate::engine;
use crate::engine::stages::Kernel;
use crate::engine::tables::{Tables, sizes};
use crate::engine::tally::N_SUMS;
use crate::layout::buffers::{BUFFERS, Buffer as Shared, N_TABLES, Table};
use crate::layout::shared::Named;
use crate::layout::{BatchFacts, BeginRow, Column, N_COLUMNS};
use crate::world::World;

/// Part of a buffer.
#[derive(Debug, Clone)]
pub struct Slice {
    /// The buffer; shaders may write to it, and it may be copied from and to.
    pub buffer: Buffer,
    /// Offset of the slice (bytes).
    pub offset: u64,
    /// Length of the slice (bytes).
    pub size: u64,
}

/// External columns: those that lie in memory of the caller. The others are the batch's own. Each is laid out as
/// [`crate::simulator::Batch`] has it; of two entries for one column the first counts.
pub type Columns = Vec<(Column, Slice)>;

/// Every buffer of a batch.
#[derive(Debug)]
pub(super) struct Buffers {
    /// Slices in the order of [`BUFFERS`].
    slices: Vec<Slice>,
    /// For each kernel those that it names; none for kernels of vehicles that the world does not have.
    groups: Vec<Option<BindGroup>>,
}

impl Buffers {
    /// Uploads the tables and makes the columns that are not external.
    pub(super) fn new(
        device: &Device,
        world: &World,
        batch: &engine::Batch,
        external: &Columns,
    ) -> Result<Buffers, Error> {
        let tables = Tables::new(world);
        let of_world = |table: Table| tables.bytes(table).map(|bytes| device.filled(table.name(), bytes));
        Buffers::around(device, world, batch, external, of_world)
    }

    /// Those of another batch in the same world, whose tables they share.
    pub(super) fn resized(&self, device: &Device, world: &World, batch: &engine::Batch) -> Result<Buffers, Error> {
        Buffers::around(device, world, batch, &Columns::new(), |table| Some(self.table(table).clone()))
    }

    /// The buffers of a batch beside the world's tables.
    fn around(
        device: &Device,
        world: &World,
        batch: &engine::Batch,
        external: &Columns,
        of_world: impl Fn(Table) -> Option<Slice>,
    ) -> Result<Buffers, Error> {
        let n_envs = batch.n_envs();
        let has_vehicles = world.traffic.is_some();
        let begins = (n_envs * size_of::<BeginRow>()) as u64;
        let made = BUFFERS.into_iter().map(|buffer| match buffer {
            Shared::Table(Table::Batch) => Ok(device.filled(buffer.name(), bytes_of(&BatchFacts::of(batch)))),
            Shared::Table(Table::Choice) => Ok(device.filled(buffer.name(), cast_slice(batch.choice().routes()))),
            Shared::Table(Table::Streams) => Ok(device.filled(buffer.name(), cast_slice(batch.streams()))),
            Shared::Table(Table::Begins) => Ok(device.empty(buffer.name(), begins)),
            Shared::Table(table) => Ok(of_world(table).unwrap_or_else(|| device.empty(table.name(), begins))),
            Shared::Column(column) => {
                let n_rows = column.n_rows(n_envs, has_vehicles);
                column_slice(device, column, n_rows, external)
            }
            Shared::Tally => Ok(device.empty(buffer.name(), (2 * N_SUMS * size_of::<u32>()) as u64)),
        });
        let slices: Vec<Slice> = made.collect::<Result<_, Error>>()?;
        let group = |&kernel: &Kernel| {
            if kernel.is_of_vehicles() && !has_vehicles {
                return None;
            }
            let named = kernel.buffers().iter().map(|buffer| (buffer.binding() as u32, &slices[buffer.binding()]));
            Some(device.kernels().bind(&device.device, kernel, named))
        };
        let groups = Kernel::ALL.iter().map(group).collect();
        device.check()?;
        Ok(Buffers { slices, groups })
    }

    /// The buffers that a kernel names; none if it is of vehicles that the world does not have.
    pub(super) fn group(&self, kernel: Kernel) -> Option<&BindGroup> {
        self.groups[kernel.index()].as_ref()
    }

    pub(super) fn table(&self, table: Table) -> &Slice {
        &self.slices[table.index()]
    }

    pub(super) fn column(&self, column: Column) -> &Slice {
        &self.slices[N_TABLES + column.index()]
    }

    /// All columns, in the order of [`Column`].
    pub(super) fn columns(&self) -> &[Slice] {
        &self.slices[N_TABLES..][..N_COLUMNS]
    }

    pub(super) fn tally(&self) -> &Slice {
        &self.slices[N_TABLES + N_COLUMNS]
    }
}

/// The caller's slice for a column, or a buffer of zeros.
fn column_slice(device: &Device, column: Column, n_rows: usize, external: &Columns) -> Result<Slice, Error> {
    let needed = (n_rows * column.width()) as u64;
    match external.iter().find(|(known, _)| *known == column) {
        None => Ok(device.empty(column.name(), needed)),
        Some((_, slice)) if needed <= slice.size => Ok(Slice { size: needed, ..slice.clone() }),
        Some((_, slice)) => Err(Error::ColumnSize { column: column.name(), found: slice.size, n_envs: n_rows, needed }),
    }
}

/// The adapter's largest buffer that a shader may see (bytes).
fn largest(device: &Device) -> u64 {
    let limits = device.device.limits();
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

/// An error if a table of the world is larger than that.
pub(super) fn check_world(device: &Device, world: &World) -> Result<(), Error> {
    let limit = largest(device);
    let n_roundabouts = world.fields.len();
    match sizes(world).into_iter().map(|(table, n_bytes)| (table, n_bytes as u64)).find(|(_, n_bytes)| limit < *n_bytes)
    {
        None => Ok(()),
        Some((table, n_bytes)) => Err(Error::WorldTooLarge {
            table: table.name(),
            n_roundabouts,
            n_bytes,
            adapter: device.adapter.get_info().name,
            limit,
            fitting: (u128::from(limit) * n_roundabouts as u128 / u128::from(n_bytes)) as u64,
        }),
    }
}

/// An error if a column of so many trucks is larger than the adapter's largest buffer.
pub(super) fn check_size(device: &Device, n_envs: usize, has_vehicles: bool) -> Result<(), Error> {
    let limit = largest(device);
    let n_bytes = |column: Column| (column.n_rows(n_envs, has_vehicles) as u64).saturating_mul(column.width() as u64);
    // By the largest column, the first of them, whose number of trucks fits into all others.
    let largest = Column::ALL.iter().rev().copied().max_by_key(|&column| n_bytes(column));
    match largest.map(|column| (column, n_bytes(column))) {
        Some((column, n_bytes)) if limit < n_bytes => {
            let (adapter, fitting) = (device.adapter.get_info().name, limit / column.width() as u64);
            Err(Error::TooManyTrucks { n_envs, buffer: column.name(), n_bytes, adapter, limit, fitting })
        }
        _ => Ok(()),
    }
}
