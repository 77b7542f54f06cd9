//! One step, in order. Both engines run these stages: the CPU by the function, the device by the kernels of the same
//! name.

mod case;
mod shaders;

pub use case::Case;
pub use shaders::{SHADERS, module};

use crate::layout::Column;
use crate::layout::buffers::{Access, Buffer, Table};

crate::named! {
    /// A stage of a step, in the order of a step.
    pub enum Stage {
        /// Turns the action into a steer angle and an acceleration to hold for the step.
        Steer = "steer",
        /// Moves the truck.
        Drive = "drive",
        /// Moves the other vehicles.
        Traffic = "traffic",
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
pub const BEGIN: [Kernel; 9] = [
    Kernel::Begin,
    Kernel::Surround,
    Kernel::PerceiveAfterReset,
    Kernel::SenseAfterReset,
    Kernel::ObserveAfterReset,
    Kernel::ExtrasAfterReset,
    Kernel::AroundAfterReset,
    Kernel::Forget,
    Kernel::ForgetAround,
];

/// The kernels of a step before those that judge it: each does a stage, or several at once.
const STEP: [Kernel; 10] = [
    Kernel::Advance,
    Kernel::TrafficDecide,
    Kernel::TrafficMove,
    Kernel::TrafficArrive,
    Kernel::Collide,
    Kernel::Meet,
    Kernel::Sense,
    Kernel::ObserveBoth,
    Kernel::ExtrasBoth,
    Kernel::AroundBoth,
];

/// Those where disturbances come between the truck and the policy. Kernels that did more at once would need more
/// buffers.
const DISTURBED_STEP: [Kernel; 13] = [
    Kernel::Steer,
    Kernel::Drive,
    Kernel::TrafficDecide,
    Kernel::TrafficMove,
    Kernel::TrafficArrive,
    Kernel::Follow,
    Kernel::Collide,
    Kernel::Meet,
    Kernel::Sense,
    Kernel::Observe,
    Kernel::ObserveExtras,
    Kernel::CopyObservation,
    Kernel::AroundBoth,
];

crate::named! {
    /// An entry point of the shaders.
    pub enum Kernel {
        /// Draws a random action for every truck.
        Draw = "draw",
        /// Begins an episode of the trucks that the caller named.
        Begin = "begin",
        /// The vehicles around these trucks.
        Surround = "surround",
        /// [`Stage::Steer`].
        Steer = "steer",
        /// [`Stage::Drive`].
        Drive = "drive",
        /// [`Stage::Traffic`]: cars decide.
        TrafficDecide = "traffic_decide",
        /// [`Stage::Traffic`]: they move.
        TrafficMove = "traffic_move",
        /// [`Stage::Traffic`]: some leave and some come.
        TrafficArrive = "traffic_arrive",
        /// [`Stage::Collide`].
        Collide = "collide",
        /// [`Stage::Collide`]: which vehicle a truck touches.
        Meet = "meet",
        /// [`Stage::Follow`].
        Follow = "follow",
        /// [`Stage::Sense`].
        Sense = "sense",
        /// [`Stage::Observe`]: the observation.
        Observe = "observe",
        /// [`Stage::Observe`]: the extras.
        ObserveExtras = "observe_extras",
        /// [`Stage::Observe`]: other vehicles.
        ObserveAround = "observe_around",
        /// [`Stage::Judge`].
        Judge = "judge",
        /// [`Stage::Judge`] where there are other vehicles.
        JudgeAmong = "judge_among",
        /// [`Stage::Judge`]: what a trailer's way over an apron weighs.
        WeighApron = "weigh_apron",
        /// [`Stage::Count`].
        Count = "count",
        /// [`Stage::CopyObservation`].
        CopyObservation = "copy_observation",
        /// [`Stage::CopyObservation`]: of other vehicles.
        CopyAround = "copy_around",
        /// [`Stage::Reset`]: which groups of trucks begin their next episodes.
        Assemble = "assemble",
        /// [`Stage::Reset`]: route and pose.
        Reset = "reset",
        /// [`Stage::Reset`]: the vehicles around the trucks that began another episode.
        SurroundAfterReset = "surround_after_reset",
        /// [`Stage::Reset`]: poses that are observed of the trucks that began another episode.
        PerceiveAfterReset = "perceive_after_reset",
        /// [`Stage::Reset`]: their ranges.
        SenseAfterReset = "sense_after_reset",
        /// [`Stage::Reset`]: their observations.
        ObserveAfterReset = "observe_after_reset",
        /// [`Stage::Reset`]: their extras.
        ExtrasAfterReset = "extras_after_reset",
        /// [`Stage::Reset`]: what they observe of other vehicles.
        AroundAfterReset = "around_after_reset",
        /// [`Stage::Reset`]: that they have no last step, where they begin in a step of their own.
        ForgetAfterReset = "forget_after_reset",
        /// That the trucks that the caller named have no last step.
        Forget = "forget",
        /// The same of what they observe of other vehicles.
        ForgetAround = "forget_around",
        /// [`Stage::Steer`], [`Stage::Drive`] and [`Stage::Follow`] at once, where what is observed is what is.
        Advance = "advance",
        /// [`Stage::Observe`] and [`Stage::CopyObservation`] at once, there: the observation.
        ObserveBoth = "observe_both",
        /// The same of the extras.
        ExtrasBoth = "extras_both",
        /// The same of other vehicles, also with disturbances, which do not touch it.
        AroundBoth = "around_both",
        /// [`Stage::Judge`] and [`Stage::Count`] at once.
        JudgeAndCount = "judge_and_count",
    }
}

/// What a thread of a kernel works on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Threads {
    /// A truck.
    Truck,
    /// What a team of trucks leaves it to: a workgroup for each team.
    Team,
    /// One of the values of a truck's observation.
    Value,
    /// A slot of a truck's row of cars.
    Car,
    /// One that decides in the step.
    Turn,
}

impl Stage {
    /// The kernels that do it to all trucks, one after the other.
    pub const fn kernels(self) -> &'static [Kernel] {
        match self {
            Stage::Steer => &[Kernel::Steer],
            Stage::Drive => &[Kernel::Drive],
            Stage::Traffic => &[Kernel::TrafficDecide, Kernel::TrafficMove, Kernel::TrafficArrive],
            Stage::Collide => &[Kernel::Collide, Kernel::Meet],
            Stage::Follow => &[Kernel::Follow],
            Stage::Sense => &[Kernel::Sense],
            Stage::Observe => &[Kernel::Observe, Kernel::ObserveExtras, Kernel::ObserveAround],
            Stage::Judge => &[Kernel::Judge, Kernel::JudgeAmong, Kernel::WeighApron],
            Stage::Count => &[Kernel::Count],
            Stage::CopyObservation => &[Kernel::CopyObservation, Kernel::CopyAround],
            Stage::Reset => &[
                Kernel::Assemble,
                Kernel::Reset,
                Kernel::SurroundAfterReset,
                Kernel::PerceiveAfterReset,
                Kernel::SenseAfterReset,
                Kernel::ObserveAfterReset,
                Kernel::ExtrasAfterReset,
                Kernel::AroundAfterReset,
                Kernel::ForgetAfterReset,
            ],
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
            Kernel::Draw => buffers![Params Batch Streams; Action Truck Command],
            Kernel::Begin => buffers![
                Params Vehicles Roads Batch Choice Streams Begins; Control Truck Progress
            ],
            Kernel::Steer => buffers![
                Params Disturbances Vehicles Actions Batch Streams; Action Control Truck Command
            ],
            Kernel::Drive => buffers![Params Vehicles Batch; Control Truck],
            Kernel::TrafficDecide | Kernel::TrafficArrive => buffers![
                Params Vehicles Roads Lanes Batch Streams; Truck Progress Cars
            ],
            Kernel::Meet => buffers![Vehicles Lanes Batch; Truck Cars],
            Kernel::JudgeAmong => buffers![
                Params Weights Limits Batch; Truck Clearance Progress Ended Terms Reward Cars
            ],
            Kernel::TrafficMove => buffers![Batch; Truck Cars],
            Kernel::Surround => buffers![
                Params Vehicles Roads Lanes Batch Streams Begins; Truck Progress Cars
            ],
            Kernel::SurroundAfterReset => buffers![
                Params Vehicles Roads Lanes Batch Streams; Truck Progress Cars
            ],
            Kernel::Collide => buffers![Vehicles Roads Cells Corners Batch; Truck Clearance],
            Kernel::Follow => buffers![Params Disturbances Vehicles Roads Batch Streams; Truck Progress Poses],
            Kernel::Sense | Kernel::SenseAfterReset => buffers![
                Params Disturbances Vehicles Roads Cells Corners Batch Streams; Truck Ranges Poses
            ],
            Kernel::Observe => buffers![
                Params Disturbances Vehicles Roads Batch Streams; Truck Progress Ranges NextObservation Poses
            ],
            Kernel::ObserveAfterReset => buffers![
                Params Disturbances Vehicles Roads Batch Streams; Truck Progress Ranges Observation Poses
            ],
            Kernel::ObserveExtras => buffers![Params Vehicles Batch; Control Truck NextExtras],
            Kernel::ExtrasAfterReset => buffers![Params Vehicles Batch; Control Truck Extras],
            Kernel::ObserveAround | Kernel::AroundBoth | Kernel::AroundAfterReset => buffers![
                Params Vehicles Roads Lanes Batch; Truck Progress Cars Around NextAround
            ],
            Kernel::CopyAround => buffers![Batch; Truck Around NextAround],
            Kernel::ForgetAround => buffers![Batch Begins; Around NextAround],
            Kernel::Judge => buffers![Params Weights Limits Batch; Truck Clearance Progress Ended Terms Reward],
            Kernel::WeighApron => buffers![Weights Vehicles Roads Cells Corners Batch; Truck Reward],
            Kernel::Count => buffers![Batch; Truck Ended Reward; Tally],
            Kernel::CopyObservation => buffers![Batch; Truck Observation NextObservation Extras NextExtras],
            Kernel::Assemble => buffers![Batch; Truck Ended],
            Kernel::Reset => buffers![Params Vehicles Roads Batch Choice Streams; Control Truck Progress Ended],
            Kernel::PerceiveAfterReset => buffers![Disturbances Batch Streams; Truck Progress Poses],
            Kernel::ForgetAfterReset => buffers![
                Batch; Truck Observation NextObservation Ended Terms Reward Extras NextExtras
            ],
            Kernel::Advance => buffers![
                Params Vehicles Actions Roads Batch; Action Control Truck Progress Command
            ],
            Kernel::ObserveBoth => buffers![
                Params Vehicles Roads Batch; Truck Progress Ranges Observation NextObservation
            ],
            Kernel::ExtrasBoth => buffers![Params Vehicles Batch; Control Truck Extras NextExtras],
            Kernel::JudgeAndCount => buffers![
                Params Weights Limits Batch; Truck Clearance Progress Ended Terms Reward; Tally
            ],
            Kernel::Forget => buffers![
                Batch Begins; Observation NextObservation Ended Terms Reward Extras NextExtras
            ],
        }
    }

    /// What a thread works on.
    pub const fn threads(self) -> Threads {
        match self {
            Kernel::Sense | Kernel::SenseAfterReset => Threads::Team,
            Kernel::CopyObservation => Threads::Value,
            Kernel::TrafficDecide => Threads::Turn,
            Kernel::TrafficMove => Threads::Car,
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

/// Workgroup memory that a kernel takes at most (bytes): what every device of WebGPU has.
pub const WORKGROUP_MEMORY: u32 = 16_384;
