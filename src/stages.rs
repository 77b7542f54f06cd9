//! One step, in order. Every engine runs these stages under these names.

use crate::cpu::{self, Row};
use crate::world::World;

/// A stage: its name and its CPU entry point.
#[derive(Debug, Clone, Copy)]
pub struct Stage {
    /// What it does, a verb.
    pub name: &'static str,
    /// Does it to one truck.
    pub cpu: fn(&World, &mut Row),
}

/// The stages of a step, first to last.
pub const STAGES: [Stage; 8] = [
    Stage { name: "steer", cpu: cpu::steer::steer },
    Stage { name: "drive", cpu: cpu::drive::drive },
    Stage { name: "collide", cpu: cpu::collide::collide },
    Stage { name: "follow", cpu: cpu::follow::follow },
    Stage { name: "sense", cpu: cpu::sense::sense },
    Stage { name: "observe", cpu: cpu::observe::observe },
    Stage { name: "judge", cpu: cpu::judge::judge },
    Stage { name: "reset", cpu: cpu::reset::reset },
];
