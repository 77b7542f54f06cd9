//! The columns of a batch on the host, and one truck's row of them.

use bytemuck::{cast_slice, cast_slice_mut};
use rayon::iter::{Either, repeat_n};
use rayon::prelude::*;

use super::order::{Order, Place};
use super::{Autoreset, Error, Mate, Tally, memory};
use crate::layout::columns::{columns, row_bytes};
use crate::layout::{
    Clearance, Column, Command, Control, N_AROUND, N_CAR_WORDS, N_COLUMNS, N_EXTRAS, N_POSES, N_RAYS, N_VALUES, Pose,
    Progress, RewardTerms, Stream, Truck,
};
use crate::traffic;
use crate::world::World;

/// Which route an episode runs on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RouteChoice {
    /// Drawn uniformly at random for every episode. Episodes follow each other in the same step, unless
    /// [`crate::simulator::Simulator::set_autoreset`] says otherwise.
    Drawn(Vec<u32>),
    /// Truck `env` runs `routes[env]` once, unless `set_autoreset` says otherwise: when its episode has ended it is
    /// held until the batch is reset.
    Fixed(Vec<u32>),
}

impl RouteChoice {
    /// The routes to draw from, or one for each truck.
    pub fn routes(&self) -> &[u32] {
        let (RouteChoice::Drawn(routes) | RouteChoice::Fixed(routes)) = self;
        routes
    }

    /// What follows the end of an episode where the caller does not say.
    pub fn autoreset(&self) -> Autoreset {
        match self {
            RouteChoice::Drawn(_) => Autoreset::SameStep,
            RouteChoice::Fixed(_) => Autoreset::Disabled,
        }
    }
}

/// Blocks of the rows of some columns side by side, in pairs of pairs: a tuple of more than twelve would be none of
/// rayon's.
macro_rules! zipped {
    ($batch:ident, $n:ident; $last:ident) => { $batch.$last.par_chunks_mut($n) };
    ($batch:ident, $n:ident; $name:ident $($rest:ident)+) => {
        $batch.$name.par_chunks_mut($n).zip(zipped!($batch, $n; $($rest)+))
    };
}

/// The names of one such block.
macro_rules! nested {
    ($last:ident) => { $last };
    ($name:ident $($rest:ident)+) => { ($name, nested!($($rest)+)) };
}

/// Blocks of the rows of a column that may have none: then empty ones.
fn blocks_of<T: Send>(rows: &mut [T], n: usize, n_envs: usize) -> impl IndexedParallelIterator<Item = &mut [T]> {
    if rows.is_empty() {
        Either::Right(repeat_n((), n_envs.div_ceil(n)).map(|()| [].as_mut_slice()))
    } else {
        Either::Left(rows.par_chunks_mut(n))
    }
}

macro_rules! batch {
    (
        $($(#[doc = $doc:literal])* $variant:ident $name:ident: $type:ty,)*;
        $($(#[doc = $doc_of:literal])* $variant_of:ident $name_of:ident: $type_of:ty,)*
    ) => {
        /// One truck's row of the columns while a stage works on it.
        #[derive(Debug)]
        pub struct Row<'a> {
            /// What the truck's routes, starts and random actions are drawn from.
            pub stream: Stream,
            /// The truck's index in the batch.
            pub env: u32,
            /// What follows the end of an episode.
            pub autoreset: Autoreset,
            /// Routes that episodes run on, as indices into the world's table.
            pub choice: &'a RouteChoice,
            /// All trucks of its group, itself among them; none where it is alone.
            pub mates: &'a [Mate],
            /// What this truck adds to the batch's tally.
            pub tally: Tally,
            $($(#[doc = $doc])* pub $name: &'a mut $type,)*
            $($(#[doc = $doc_of])* pub $name_of: Option<&'a mut $type_of>,)*
        }

        /// Neighbouring rows of the columns, for one thread to work on.
        #[derive(Debug)]
        pub(crate) struct Block<'a> {
            /// Index of the first truck.
            first: usize,
            /// The order in which the trucks are worked on.
            pub places: &'a mut [Place],
            streams: &'a [Stream],
            choice: &'a RouteChoice,
            /// What follows the end of an episode.
            pub autoreset: Autoreset,
            $($(#[doc = $doc])* pub $name: &'a mut [$type],)*
            $($(#[doc = $doc_of])* pub $name_of: &'a mut [$type_of],)*
        }

        impl Block<'_> {
            /// The truck at a place as the others of its group read it.
            pub(crate) fn mate(&self, place: Place) -> Mate {
                let index = place.index as usize;
                Mate {
                    env: (self.first + index) as u32,
                    stream: self.streams[self.first + index],
                    truck: self.truck[index],
                    progress: self.progress[index],
                    ended: self.ended[index],
                    entered: self.cars.get(index).map_or(0, |words| traffic::Row::of(words).entered),
                }
            }

            /// The row of the truck at a place, among these of its group.
            pub(crate) fn row<'a>(&'a mut self, place: Place, mates: &'a [Mate]) -> Row<'a> {
                let index = place.index as usize;
                Row {
                    stream: self.streams[self.first + index],
                    env: (self.first + index) as u32,
                    autoreset: self.autoreset,
                    choice: self.choice,
                    mates,
                    tally: Tally::default(),
                    $($name: &mut self.$name[index],)*
                    $($name_of: self.$name_of.get_mut(index),)*
                }
            }
        }

        /// The columns of a batch: `n_envs` rows each, of those of vehicles none where there are no vehicles.
        #[derive(Debug, Clone)]
        pub struct Batch {
            seed: u32,
            choice: RouteChoice,
            autoreset: Autoreset,
            streams: Vec<Stream>,
            order: Order,
            has_vehicles: bool,
            group: usize,
            /// Sums since the batch was made.
            pub(crate) tally: Tally,
            $($(#[doc = $doc])* pub $name: Vec<$type>,)*
            $($(#[doc = $doc_of])* pub $name_of: Vec<$type_of>,)*
        }

        impl Batch {
            /// `n_envs` trucks that have yet to be reset, among other vehicles or not, so many to a road.
            pub(crate) fn new(
                n_envs: usize,
                seed: u32,
                choice: RouteChoice,
                has_vehicles: bool,
                group: usize,
            ) -> Result<Batch, Error> {
                check_fits(n_envs, has_vehicles)?;
                // The system may refuse although it said that so much was free.
                let refused = || too_large(n_envs, has_vehicles, 0);
                let mut streams: Vec<Stream> = zeros(n_envs).ok_or_else(refused)?;
                (0..).zip(&mut streams).for_each(|(env, stream)| *stream = Stream { seed, env });
                let order = Order::new(zeros(n_envs).ok_or_else(refused)?, group);
                Ok(Batch {
                    seed,
                    autoreset: choice.autoreset(),
                    choice,
                    streams,
                    order,
                    tally: Tally::default(),
                    has_vehicles,
                    group,
                    $($name: zeros(n_envs).ok_or_else(refused)?,)*
                    $($name_of: zeros(Column::$variant_of.n_rows(n_envs, has_vehicles)).ok_or_else(refused)?,)*
                })
            }

            /// The rows `indices` of this batch, in that order and as often as they are named: row `i` goes on as row
            /// `indices[i]` was.
            pub(crate) fn gathered(&self, indices: &[u32]) -> Result<Batch, Error> {
                let choice = match &self.choice {
                    RouteChoice::Fixed(routes) => {
                        RouteChoice::Fixed(indices.iter().map(|&index| routes[index as usize]).collect())
                    }
                    RouteChoice::Drawn(routes) => RouteChoice::Drawn(routes.clone()),
                };
                let batch = Batch::new(indices.len(), self.seed, choice, self.has_vehicles, self.group)?;
                let mut batch = Batch { tally: self.tally, autoreset: self.autoreset, ..batch };
                $(
                    for (row, &index) in batch.$name.iter_mut().zip(indices) {
                        *row = self.$name[index as usize];
                    }
                )*
                $(
                    for (row, &index) in batch.$name_of.iter_mut().zip(indices) {
                        *row = self.$name_of[index as usize];
                    }
                )*
                Ok(batch)
            }

            /// Every column as its bytes: with them a batch goes on where it was, see
            /// [`crate::simulator::Simulator::restore`].
            pub fn columns(&self) -> [(Column, &[u8]); N_COLUMNS] {
                [
                    $((Column::$variant, cast_slice(&self.$name)),)*
                    $((Column::$variant_of, cast_slice(&self.$name_of)),)*
                ]
            }

            /// Every column's bytes, to be written to.
            pub(crate) fn columns_mut(&mut self) -> [(Column, &mut [u8]); N_COLUMNS] {
                [
                    $((Column::$variant, cast_slice_mut(&mut self.$name)),)*
                    $((Column::$variant_of, cast_slice_mut(&mut self.$name_of)),)*
                ]
            }

            /// Every row, in blocks that are divided among all cores; in each the rows are in the order of the trucks'
            /// roads.
            pub(crate) fn blocks(&mut self, world: &World) -> impl ParallelIterator<Item = Block<'_>> {
                let n = self.order.renewed(world, &self.truck);
                let (streams, choice, autoreset) = (&self.streams, &self.choice, self.autoreset);
                let order = &mut self.order;
                let n_envs = streams.len();
                let of_vehicles = ($(blocks_of(&mut self.$name_of, n, n_envs),)*).into_par_iter();
                let blocks = order.blocks().zip(zipped!(self, n; $($name)*)).zip(of_vehicles).enumerate();
                blocks.map(move |(block, ((places, nested!($($name)*)), ($($name_of,)*)))| Block {
                    first: block * n,
                    places,
                    streams,
                    choice,
                    autoreset,
                    $($name,)*
                    $($name_of,)*
                })
            }
        }
    };
}

columns!(batch);

impl Batch {
    /// Trucks in the batch.
    pub fn n_envs(&self) -> usize {
        self.truck.len()
    }

    /// Seed of its routes, poses and random actions, where no truck was given a stream of its own.
    pub fn seed(&self) -> u32 {
        self.seed
    }

    /// Which routes its episodes run on.
    pub fn choice(&self) -> &RouteChoice {
        &self.choice
    }

    /// Neighbouring trucks that share a road and its vehicles.
    pub fn group(&self) -> usize {
        self.group
    }

    /// What follows the end of an episode.
    pub fn autoreset(&self) -> Autoreset {
        self.autoreset
    }

    /// What each truck draws from, `[n_envs]`.
    pub fn streams(&self) -> &[Stream] {
        &self.streams
    }

    /// Has the order of the rows renewed: many trucks have other roads.
    pub(crate) fn outdate_order(&mut self) {
        self.order.outdate();
    }

    pub(crate) fn set_autoreset(&mut self, autoreset: Autoreset) {
        self.autoreset = autoreset;
    }

    pub(crate) fn set_streams(&mut self, streams: &[Stream]) {
        self.streams.copy_from_slice(streams);
    }

    /// Draws the routes of later episodes from these.
    pub(crate) fn set_drawn(&mut self, routes: &[u32]) {
        self.choice = RouteChoice::Drawn(routes.to_vec());
    }

    /// Sums over all steps since the batch was made.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// A batch of as many trucks with the same streams, routes and tally as this one, and all columns zero.
    pub(crate) fn blank(&self) -> Result<Batch, Error> {
        let batch = Batch::new(self.n_envs(), self.seed, self.choice.clone(), self.has_vehicles, self.group)?;
        Ok(Batch { tally: self.tally, autoreset: self.autoreset, streams: self.streams.clone(), ..batch })
    }

    /// The bytes of a column.
    pub fn column(&self, column: Column) -> &[u8] {
        self.columns()[column as usize].1
    }
}

/// An error if the columns of so many trucks, without other vehicles, do not fit into the host's memory. More than a
/// `u32` counts never fit.
pub fn check_size(n_envs: usize) -> Result<(), Error> {
    check_fits(n_envs, false)
}

fn check_fits(n_envs: usize, has_vehicles: bool) -> Result<(), Error> {
    let available = memory::available().unwrap_or(u64::MAX);
    let fitting = (available / row_bytes(has_vehicles) as u64).min(u32::MAX.into());
    if n_envs as u64 <= fitting { Ok(()) } else { Err(too_large(n_envs, has_vehicles, fitting)) }
}

fn too_large(n_envs: usize, has_vehicles: bool, fitting: u64) -> Error {
    Error::BatchTooLarge { n_envs, n_bytes: n_envs as u128 * row_bytes(has_vehicles) as u128, fitting }
}

/// A column of zeros, whose memory is taken page by page when it is first written to.
fn zeros<T: bytemuck::Zeroable>(n_rows: usize) -> Option<Vec<T>> {
    bytemuck::allocation::try_zeroed_vec(n_rows).ok()
}
