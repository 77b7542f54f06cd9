//! The two engines, and what they share: the columns of a batch, their sums, and the errors.
//!
//! Neither engine knows the other. [`crate::simulator`] chooses one and drives it through `EngineBatch`.

pub mod stages; // one step, in order
pub mod wgsl; // what shaders share with Rust, printed
pub mod tables; // what trucks share, as the bytes that shaders read
pub(crate) mod autoreset;
mod batch;
pub(crate) mod cpu; // the CPU engine: all cores, a truck at a time
mod error;
pub(crate) mod group; // trucks that share a road
pub(crate) mod limits; // of what the numbers of a truck can be
#[cfg(feature = "gpu")]
pub mod gpu; // the engine of compute shaders
mod memory;
mod order;
pub(crate) mod tally;

use std::any::Any;
use std::borrow::Cow;
use std::fmt::Debug;
use std::time::Duration;

use crate::engine::stages::{N_STAGES, Stage};
use crate::layout::{BeginRow, Column, Command, Stream};
use crate::world::World;
pub use autoreset::Autoreset;
pub(crate) use batch::Row;
pub use batch::{Batch, RouteChoice, check_size};
pub use error::Error;
pub use group::Mate;
pub use memory::available as available_memory;
pub use tally::Tally;

/// A batch on its engine. The caller has checked every index and number of rows; `world` is the one that the batch was
/// made for.
pub(crate) trait EngineBatch: Any + Debug + Send + Sync {
    /// Trucks in the batch.
    fn n_envs(&self) -> usize;

    /// Memory of the columns (bytes).
    fn bytes(&self) -> usize;

    /// The columns on the host.
    fn columns(&self) -> &Batch;

    /// Sums since the batch was made.
    fn tally(&self) -> Result<Tally, Error>;

    /// What each truck draws from, `[n_envs]`.
    fn streams(&self) -> Vec<Stream>;

    /// Begins an episode of the trucks whose row says so, one row for each truck, after the streams have changed.
    fn begin(&mut self, world: &World, begins: &[BeginRow], streams: Option<&[Stream]>) -> Result<(), Error>;

    /// Sets what follows the end of an episode.
    fn set_autoreset(&mut self, autoreset: Autoreset);

    /// The bytes of some columns, `[n_envs]` rows each: no other column is read from a device.
    fn read(&self, columns: &[Column]) -> Result<Vec<Cow<'_, [u8]>>, Error>;

    /// Makes the batch one of the rows `indices`.
    fn gather(&mut self, world: &World, indices: &[u32]) -> Result<(), Error>;

    /// Draws the routes of later episodes from others, as many as before.
    fn draw_from(&mut self, routes: &[u32]);

    /// Replaces the columns.
    fn replace(&mut self, batch: Batch) -> Result<(), Error>;

    /// One step of every truck.
    fn step(&mut self, world: &World, actions: &[u32]) -> Result<(), Error>;

    /// One step of every truck, by commands.
    fn step_with(&mut self, world: &World, commands: &[Command]) -> Result<(), Error>;

    /// Steps of every truck with random actions.
    fn steps_at_random(&mut self, world: &World, n_steps: usize);

    /// One step of every truck with random actions, a stage at a time: the time of each stage.
    fn step_at_random_by_stage(&mut self, world: &World) -> Result<[Duration; N_STAGES], Error>;

    /// One step of every truck with random actions, a kernel at a time: the time of each kernel. None on the CPU, which
    /// has no kernels: no step is made.
    fn step_at_random_by_kernel(&mut self) -> Result<Vec<(&'static str, Duration)>, Error>;

    /// One stage over every truck.
    fn run_stage(&mut self, world: &World, stage: Stage);

    /// Waits until every step asked for is done.
    fn wait(&self) -> Result<(), Error>;
}
