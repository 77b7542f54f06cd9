//! Which kernels have anything to do.

use super::{DISTURBED_STEP, Kernel, STEP, Stage};
use crate::engine::Autoreset;
use crate::layout::Disturbances;
use crate::world::World;

/// What decides which kernels have anything to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Case {
    /// What is observed differs from what is, or actions come late.
    pub disturbed: bool,
    /// Extras are observed.
    pub extras: bool,
    /// There are other vehicles.
    pub vehicles: bool,
    /// They are observed.
    pub around: bool,
    /// Trucks share roads.
    pub grouped: bool,
    /// The reward weighs how far trailers are on aprons.
    pub aprons: bool,
    /// What follows the end of an episode.
    pub autoreset: Autoreset,
}

impl Case {
    /// That of a batch in a world.
    pub fn of(world: &World, autoreset: Autoreset) -> Case {
        let Disturbances { of_observation, of_action, .. } = world.disturbances;
        Case {
            disturbed: of_observation == 1 || of_action == 1,
            extras: 0 < world.params.n_extras,
            vehicles: world.traffic.is_some(),
            around: world.observes_vehicles(),
            grouped: 1 < world.group(),
            aprons: world.reward.apron != 0.0,
            autoreset,
        }
    }

    /// The kernels of a step, one after the other.
    pub fn step(self) -> impl Iterator<Item = Kernel> + Clone {
        let kernels: &[Kernel] = if self.disturbed { &DISTURBED_STEP } else { &STEP };
        // Judging among vehicles leaves no buffer to count with, and what an apron weighs is added before.
        use Kernel::{Count, Judge, JudgeAmong, JudgeAndCount, WeighApron};
        let apart = self.vehicles || self.aprons;
        let judges: &[Kernel] = if apart { &[Judge, JudgeAmong, WeighApron, Count] } else { &[JudgeAndCount] };
        self.working(kernels.iter().chain(judges).chain(Stage::Reset.kernels()))
    }

    /// Those of some kernels that have anything to do.
    pub fn working<'a>(
        self,
        kernels: impl Iterator<Item = &'a Kernel> + Clone,
    ) -> impl Iterator<Item = Kernel> + Clone {
        kernels.copied().filter(move |kernel| kernel.works(self))
    }
}

impl Kernel {
    /// Whether it works on the other vehicles alone.
    pub const fn is_of_vehicles(self) -> bool {
        use Kernel::{JudgeAmong, Meet, Surround, SurroundAfterReset, TrafficArrive, TrafficDecide, TrafficMove};
        let surrounds = matches!(self, Surround | SurroundAfterReset);
        let moves = matches!(self, TrafficDecide | TrafficMove | TrafficArrive | Meet | JudgeAmong);
        surrounds || moves || self.observes_vehicles()
    }

    /// Whether it is about what is observed of them.
    const fn observes_vehicles(self) -> bool {
        use Kernel::{AroundAfterReset, AroundBoth, CopyAround, ForgetAround, ObserveAround};
        matches!(self, ObserveAround | CopyAround | AroundBoth | AroundAfterReset | ForgetAround)
    }

    /// Whether it has anything to do.
    const fn works(self, case: Case) -> bool {
        match self {
            Kernel::PerceiveAfterReset => case.disturbed,
            Kernel::WeighApron => case.aprons,
            Kernel::Assemble => case.grouped,
            Kernel::Judge | Kernel::JudgeAndCount => !case.vehicles,
            _ if self.observes_vehicles() => case.around,
            _ if self.is_of_vehicles() => case.vehicles,
            Kernel::ObserveExtras | Kernel::ExtrasAfterReset | Kernel::ExtrasBoth => case.extras,
            Kernel::ForgetAfterReset => matches!(case.autoreset, Autoreset::NextStep),
            _ => true,
        }
    }
}
