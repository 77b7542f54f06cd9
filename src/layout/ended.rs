//! Why an episode ended.

crate::named! {
    /// Why an episode ended, by the number and the name that reports have. Failure wins over a vehicle that drove into
    /// the truck, that over arrival, everything over the time limit.
    #[repr(u32)]
    pub enum Ended {
        /// The episode goes on.
        Running = "running",
        /// The last waypoint was passed.
        Arrived = "arrived",
        /// The tractor's outline touched a kerb.
        TractorCollided = "tractor_collided",
        /// The trailer's outline touched a kerb.
        TrailerCollided = "trailer_collided",
        /// A unit's wheels lifted.
        RolledOver = "rolled_over",
        /// The articulation passed its limit.
        Jackknifed = "jackknifed",
        /// The next waypoint is too far away.
        Strayed = "strayed",
        /// The time limit was reached.
        TimedOut = "timed_out",
        /// The truck touched another vehicle, and is at fault.
        MetVehicle = "met_vehicle",
        /// The truck touched another vehicle that is at fault.
        WasMet = "was_met",
    }
}

impl Ended {
    /// The ends of episodes on roads without other vehicles.
    pub const WITHOUT_VEHICLES: [Ended; 8] = [
        Ended::Running,
        Ended::Arrived,
        Ended::TractorCollided,
        Ended::TrailerCollided,
        Ended::RolledOver,
        Ended::Jackknifed,
        Ended::Strayed,
        Ended::TimedOut,
    ];

    /// The code with this number in an `ended` column.
    pub fn from_code(code: u32) -> Option<Ended> {
        Ended::ALL.get(code as usize).copied()
    }

    /// What this number of an `ended` column says. Columns that were made or checked here hold known ones alone.
    pub fn of_column(code: u32) -> Ended {
        let ended = Ended::from_code(code);
        debug_assert!(ended.is_some(), "ended: {code}");
        ended.unwrap_or(Ended::Running)
    }

    /// The task itself is over: the value of the state after it is 0.
    pub fn terminated(self) -> bool {
        !matches!(self, Ended::Running | Ended::TimedOut)
    }

    /// Only the time limit was reached: the value of the state after it is that of `next_observation`.
    pub fn truncated(self) -> bool {
        self == Ended::TimedOut
    }

    /// The truck's driver failed: the episode ended by anything but arrival, the time limit and another's fault.
    pub fn failed(self) -> bool {
        self.terminated() && !matches!(self, Ended::Arrived | Ended::WasMet)
    }
}

/// The codes as WGSL constants.
pub(crate) fn printed_codes() -> String {
    let codes = Ended::ALL.map(|ended| format!("const {}: u32 = {}u;\n", ended.name().to_uppercase(), ended as u32));
    format!("// Why an episode ended.\n{}", codes.concat())
}
