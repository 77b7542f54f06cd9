//! Why an episode ended.

/// Why an episode ended. Failure wins over arrival, everything wins over the time limit.
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Ended {
    /// It goes on.
    Running,
    /// The last waypoint was passed.
    Arrived,
    /// The tractor's outline touched a kerb.
    TractorCollided,
    /// The trailer's outline touched a kerb.
    TrailerCollided,
    /// A unit's wheels lifted.
    RolledOver,
    /// The articulation passed its limit.
    Jackknifed,
    /// The next waypoint is too far away.
    Strayed,
    /// The time limit was reached.
    TimedOut,
}

impl Ended {
    /// Every code, in the order of its number.
    pub const ALL: [Ended; 8] = [
        Ended::Running,
        Ended::Arrived,
        Ended::TractorCollided,
        Ended::TrailerCollided,
        Ended::RolledOver,
        Ended::Jackknifed,
        Ended::Strayed,
        Ended::TimedOut,
    ];

    /// The code as reports name it.
    pub fn name(self) -> &'static str {
        match self {
            Ended::Running => "running",
            Ended::Arrived => "arrived",
            Ended::TractorCollided => "tractor_collided",
            Ended::TrailerCollided => "trailer_collided",
            Ended::RolledOver => "rolled_over",
            Ended::Jackknifed => "jackknifed",
            Ended::Strayed => "strayed",
            Ended::TimedOut => "timed_out",
        }
    }

    /// The code with this number in an `ended` column.
    pub fn from_code(code: u32) -> Option<Ended> {
        Ended::ALL.get(code as usize).copied()
    }

    /// The task itself is over: the value of the state after it is 0.
    pub fn terminated(self) -> bool {
        !matches!(self, Ended::Running | Ended::TimedOut)
    }

    /// Only the time limit was reached: the value of the state after it is that of `next_observation`.
    pub fn truncated(self) -> bool {
        self == Ended::TimedOut
    }

    /// The episode ended by anything but arrival and the time limit.
    pub fn failed(self) -> bool {
        self.terminated() && self != Ended::Arrived
    }
}

/// The codes as WGSL constants.
pub(crate) fn printed_codes() -> String {
    let codes = Ended::ALL.map(|ended| format!("const {}: u32 = {}u;\n", ended.name().to_uppercase(), ended as u32));
    format!("// Why an episode ended.\n{}", codes.concat())
}
