//! The columns of a batch, declared once.
//!
//! [`columns!`] hands the list to a macro: here to the one that makes [`Column`], in `engine/batch.rs` to the one that
//! makes a batch and a row of it. The buffers on a device, their WGSL declarations and the tests' tables follow from
//! [`Column`].

use super::{
    Clearance, Command, Control, N_AROUND, N_CAR_WORDS, N_EXTRAS, N_POSES, N_RAYS, N_VALUES, Pose, Progress,
    RewardTerms, Truck,
};
use crate::layout::shared::{Named, Shared};

/// Calls `$then` with every column: doc, variant of [`Column`], name, type of a row. The types are those of `layout`.
/// Behind the semicolon stand those that have rows only where a benchmark has other vehicles.
macro_rules! columns {
    ($then:ident) => {
        $then! {
            /// Index into the action table
            Action action: u32,
            /// Steer angle and acceleration asked of each truck
            Control control: Control,
            /// The trucks
            Truck truck: Truck,
            /// Distances to the kerbs (m)
            Clearance clearance: Clearance,
            /// Progress along the routes
            Progress progress: Progress,
            /// Distance sensors (m)
            Ranges ranges: [f32; N_RAYS],
            /// The observation before the next action
            Observation observation: [f32; N_VALUES],
            /// The observation after the last action, another one only where an episode ended
            NextObservation next_observation: [f32; N_VALUES],
            /// Codes of [`crate::layout::Ended`] for the last step
            Ended ended: u32,
            /// Physical amounts that the reward weighs
            Terms terms: RewardTerms,
            /// Rewards of the last step; of a truck that waits for its group, of its own last one
            Reward reward: f32,
            /// What is observed beside the observation before the next action; zeros beyond what the benchmark observes
            Extras extras: [f32; N_EXTRAS],
            /// What is observed beside the observation after the last action
            NextExtras next_extras: [f32; N_EXTRAS],
            /// With disturbances: the pose that is observed, and those of the last three steps; zeros without
            Poses poses: [Pose; N_POSES],
            /// Commands, where actions are continuous; zeros where they are indices
            Command command: Command,
            ;
            /// The cars on the road of each truck, and what is counted of them: words of a `traffic::Row`
            Cars cars: [u32; N_CAR_WORDS],
            /// What is observed of other vehicles before the next action; zeros where the benchmark observes none
            Around around: [f32; N_AROUND],
            /// What is observed of other vehicles after the last action
            NextAround next_around: [f32; N_AROUND],
        }
    };
}

pub(crate) use columns;

macro_rules! column_names {
    (
        $($(#[doc = $doc:literal])* $variant:ident $name:ident: $type:ty,)*;
        $($(#[doc = $doc_of:literal])* $variant_of:ident $name_of:ident: $type_of:ty,)*
    ) => {
        column_names! {
            @all $($(#[doc = $doc])* $variant $name: $type,)* $($(#[doc = $doc_of])* $variant_of $name_of: $type_of,)*
        }

        impl Column {
            /// Whether it has rows only where a benchmark has other vehicles.
            pub const fn is_of_vehicles(self) -> bool {
                matches!(self, $(Column::$variant_of)|*)
            }
        }
    };
    (@all $($(#[doc = $doc:literal])* $variant:ident $name:ident: $type:ty,)*) => {
        /// A column of a batch.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Column {
            $($(#[doc = $doc])* $variant,)*
        }

        impl Column {
            /// The column's name.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Column::$variant => stringify!($name),)*
                }
            }

            /// Bytes of a row.
            pub const fn width(self) -> usize {
                match self {
                    $(Column::$variant => size_of::<$type>(),)*
                }
            }

            /// What its rows hold, with the unit.
            pub const fn doc(self) -> &'static str {
                match self {
                    $(Column::$variant => concat!($($doc),*),)*
                }
            }

            /// Type of an element in WGSL, where arrays lie flat.
            pub fn element(self) -> String {
                match self {
                    $(Column::$variant => <$type>::element(),)*
                }
            }

            /// The column's shape.
            pub(super) fn shape(self) -> String {
                match self {
                    $(Column::$variant => format!("[n_envs{}]", <$type>::lengths()),)*
                }
            }
        }

        impl Named for Column {
            const ALL: &'static [Column] = &[$(Column::$variant,)*];

            fn name(self) -> &'static str {
                Column::name(self)
            }

            fn index(self) -> usize {
                self as usize
            }
        }
    };
}

columns!(column_names);

/// Columns of a batch.
pub const N_COLUMNS: usize = Column::ALL.len();

impl Column {
    /// Those that every batch has rows of.
    pub fn of_trucks() -> impl Iterator<Item = Column> {
        Column::ALL.iter().copied().filter(|column| !column.is_of_vehicles())
    }

    /// Its rows in a batch of so many trucks: none where it is one of the vehicles that the batch does not have.
    pub const fn n_rows(self, n_envs: usize, has_vehicles: bool) -> usize {
        if has_vehicles || !self.is_of_vehicles() { n_envs } else { 0 }
    }
}

/// Bytes of all columns for each truck.
pub(crate) fn row_bytes(has_vehicles: bool) -> usize {
    Column::ALL.iter().map(|column| column.n_rows(column.width(), has_vehicles)).sum()
}
