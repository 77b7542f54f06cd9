//! One step, in order. Both engines run these stages: the CPU by the function, the device by the kernels of the same
//! name.

use crate::layout::Column;
use crate::layout::buffers::{Access, Buffer, Table};

crate::named! {
    /// A stage of a step, in the order of a step.
    pub enum Stage {
        /// Turns the action into a steer angle and an acceleration to hold for the step.
        Steer = "steer",
        /// Moves the truck.
        Drive = "drive",
        /// Measures the clearances.
        Collide = "collide",
        /// Follows the route.
        Follow = "follow",
        /// Measures the ranges.
        Sense = "sense",
        /// Writes the observation after the action.
        Observe = "observe",
        /// Decides whether and why the episode ended, and the reward.
        Judge = "judge",
        /// Adds the step to the tally.
        Count = "count",
        /// Copies the observation after the action to the one before the next action.
        CopyObservation = "copy_observation",
        /// Begins the next episode where one ended, and observes it.
        Reset = "reset",
    }
}

/// Stages of a step.
pub const N_STAGES: usize = Stage::ALL.len();

/// The stages of a step, first to last.
pub const STAGES: [Stage; N_STAGES] = Stage::ALL;

/// The kernels that begin an episode of the trucks that the caller named.
pub const BEGIN: [Kernel; 3] = [Kernel::Begin, Kernel::SenseAfterReset, Kernel::ObserveBegun];

crate::named! {
    /// An entry point of the shaders.
    pub enum Kernel {
        /// Draws a random action for every truck.
        Draw = "draw",
        /// Begins an episode of the trucks that the caller named.
        Begin = "begin",
        /// [`Stage::Steer`].
        Steer = "steer",
        /// [`Stage::Drive`].
        Drive = "drive",
        /// [`Stage::Collide`].
        Collide = "collide",
        /// [`Stage::Follow`].
        Follow = "follow",
        /// [`Stage::Sense`].
        Sense = "sense",
        /// [`Stage::Observe`].
        Observe = "observe",
        /// [`Stage::Judge`].
        Judge = "judge",
        /// [`Stage::Count`].
        Count = "count",
        /// [`Stage::CopyObservation`].
        CopyObservation = "copy_observation",
        /// [`Stage::Reset`]: route and pose.
        Reset = "reset",
        /// [`Stage::Reset`]: ranges of the trucks that began another episode.
        SenseAfterReset = "sense_after_reset",
        /// [`Stage::Reset`]: observations of the trucks that began another episode.
        ObserveAfterReset = "observe_after_reset",
        /// Observes the trucks that the caller named, once they have begun.
        ObserveBegun = "observe_begun",
    }
}

/// What a thread of a kernel works on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Threads {
    /// A truck.
    Truck,
    /// One of a truck's rays.
    Ray,
    /// One of the values of a truck's observation.
    Value,
}

impl Stage {
    /// The kernels that do it to all trucks, one after the other.
    pub const fn kernels(self) -> &'static [Kernel] {
        match self {
            Stage::Steer => &[Kernel::Steer],
            Stage::Drive => &[Kernel::Drive],
            Stage::Collide => &[Kernel::Collide],
            Stage::Follow => &[Kernel::Follow],
            Stage::Sense => &[Kernel::Sense],
            Stage::Observe => &[Kernel::Observe],
            Stage::Judge => &[Kernel::Judge],
            Stage::Count => &[Kernel::Count],
            Stage::CopyObservation => &[Kernel::CopyObservation],
            Stage::Reset => &[Kernel::Reset, Kernel::SenseAfterReset, Kernel::ObserveAfterReset],
        }
    }
}

/// Buffers by name: tables, columns, and the tally.
macro_rules! buffers {
    ($($table:ident)*; $($column:ident)* $(; $tally:ident)?) => {
        &[
            $(Buffer::Table(Table::$table),)*
            $(Buffer::Column(Column::$column),)*
            $(Buffer::$tally,)?
        ]
    };
}

impl Kernel {
    /// The buffers that it is bound to: all that its shader names, in the order of their bindings.
    pub const fn buffers(self) -> &'static [Buffer] {
        match self {
            Kernel::Draw => buffers![Params Batch Streams; Action Truck],
            Kernel::Begin => buffers![
                Params Rigs Waypoints Previews Routes Batch Choice Streams Begins; Control Truck Progress Ended Terms
                Reward Poses
            ],
            Kernel::Steer => buffers![Params Rigs Actions Batch Streams; Action Control Truck],
            Kernel::Drive => buffers![Params Rigs Batch; Control Truck],
            Kernel::Collide => buffers![Rigs Fields Cells Corners Routes Batch; Truck Clearance],
            Kernel::Follow => buffers![Params Rigs Waypoints Routes Batch Streams; Truck Progress Poses],
            Kernel::Sense | Kernel::SenseAfterReset => buffers![
                Params Rigs Rays Fields Cells Corners Routes Batch Streams; Truck Ranges Poses
            ],
            Kernel::Observe | Kernel::ObserveAfterReset => buffers![
                Params Rigs Waypoints Previews Routes Batch Streams; Control Truck Progress Ranges Observation
                NextObservation Extras NextExtras Poses
            ],
            Kernel::Judge => buffers![
                Params Rigs Routes StepLimits Batch; Truck Clearance Progress Ended Terms Reward
            ],
            Kernel::Count => buffers![Batch; Truck Ended Reward; Tally],
            Kernel::CopyObservation => buffers![Batch; Truck Observation NextObservation Extras NextExtras],
            Kernel::Reset => buffers![
                Params Rigs Waypoints Previews Routes Batch Choice Streams; Control Truck Progress Ended Terms Reward
                Poses
            ],
            Kernel::ObserveBegun => buffers![
                Params Rigs Waypoints Previews Routes Batch Streams Begins; Control Truck Progress Ranges Observation
                NextObservation Extras NextExtras Poses
            ],
        }
    }

    /// What a thread works on.
    pub const fn threads(self) -> Threads {
        match self {
            Kernel::Sense | Kernel::SenseAfterReset => Threads::Ray,
            Kernel::CopyObservation => Threads::Value,
            _ => Threads::Truck,
        }
    }
}

/// Storage buffers that a kernel is bound to at most: what a device must offer.
pub const N_STORAGE_BUFFERS: usize = {
    let (mut most, mut kernel) = (0, 0);
    while kernel < Kernel::ALL.len() {
        let buffers = Kernel::ALL[kernel].buffers();
        let (mut n, mut index) = (0, 0);
        while index < buffers.len() {
            n += !matches!(buffers[index].access(), Access::Uniform) as usize;
            index += 1;
        }
        most = if most < n { n } else { most };
        kernel += 1;
    }
    most
};

/// The shader files in the order in which they make one module.
pub const SHADERS: [(&str, &str); 18] = [
    ("layout", include_str!("../../shaders/layout.wgsl")),
    ("common/thread", include_str!("../../shaders/common/thread.wgsl")),
    ("common/angle", include_str!("../../shaders/common/angle.wgsl")),
    ("common/random", include_str!("../../shaders/common/random.wgsl")),
    ("common/field", include_str!("../../shaders/common/field.wgsl")),
    ("common/truck", include_str!("../../shaders/common/truck.wgsl")),
    ("draw", include_str!("../../shaders/draw.wgsl")),
    ("steer", include_str!("../../shaders/steer.wgsl")),
    ("drive", include_str!("../../shaders/drive.wgsl")),
    ("collide", include_str!("../../shaders/collide.wgsl")),
    ("follow", include_str!("../../shaders/follow.wgsl")),
    ("perceive", include_str!("../../shaders/perceive.wgsl")),
    ("sense", include_str!("../../shaders/sense.wgsl")),
    ("observe", include_str!("../../shaders/observe.wgsl")),
    ("judge", include_str!("../../shaders/judge.wgsl")),
    ("count", include_str!("../../shaders/count.wgsl")),
    ("copy_observation", include_str!("../../shaders/copy_observation.wgsl")),
    ("reset", include_str!("../../shaders/reset.wgsl")),
];
