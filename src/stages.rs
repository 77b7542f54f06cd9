//! One step, in order. Every engine runs these stages under these names.

use crate::cpu::{self, Row};
use crate::world::World;

/// A stage: its name, its CPU entry point and its kernels.
#[derive(Debug, Clone, Copy)]
pub struct Stage {
    /// What it does, a verb.
    pub name: &'static str,
    /// Does it to one truck.
    pub cpu: fn(&World, &mut Row),
    /// Do it to all trucks, one after the other.
    pub kernels: &'static [Kernel],
}

/// An entry point of a shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kernel {
    /// Its name.
    pub entry: &'static str,
    /// What a thread works on.
    pub threads: Threads,
}

/// What a thread of a kernel works on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Threads {
    /// A truck.
    Truck,
    /// One of a truck's rays.
    Ray,
}

const fn per_truck(entry: &'static str) -> Kernel {
    Kernel { entry, threads: Threads::Truck }
}

const fn per_ray(entry: &'static str) -> Kernel {
    Kernel { entry, threads: Threads::Ray }
}

/// The stages of a step, first to last. The step is counted with `judge`; before `reset` what the last action led to is copied to what the
/// next one sees, and trucks that begin anew are sensed and observed once more.
pub const STAGES: [Stage; 8] = [
    Stage { name: "steer", cpu: cpu::steer::steer, kernels: &[per_truck("steer")] },
    Stage { name: "drive", cpu: cpu::drive::drive, kernels: &[per_truck("drive")] },
    Stage { name: "collide", cpu: cpu::collide::collide, kernels: &[per_truck("collide")] },
    Stage { name: "follow", cpu: cpu::follow::follow, kernels: &[per_truck("follow")] },
    Stage { name: "sense", cpu: cpu::sense::sense, kernels: &[per_ray("sense")] },
    Stage { name: "observe", cpu: cpu::observe::observe, kernels: &[per_truck("observe")] },
    Stage { name: "judge", cpu: cpu::judge::judge, kernels: &[per_truck("judge"), per_truck("count")] },
    Stage { name: "reset", cpu: cpu::reset::reset, kernels: &[per_truck("reset"), per_ray("sense_begun"), per_truck("observe_begun")] },
];

/// Kernels beside a step: actions by chance, and the beginning of every truck's first episode.
pub const BESIDE: [Kernel; 2] = [DRAW, RESTART];
/// Draws an action for every truck.
pub const DRAW: Kernel = per_truck("draw");
/// Begins episode 0 of every truck.
pub const RESTART: Kernel = per_truck("restart");

/// The shader files in the order in which they make one module.
pub const SHADERS: [(&str, &str); 16] = [
    ("layout", include_str!("../shaders/layout.wgsl")),
    ("common/thread", include_str!("../shaders/common/thread.wgsl")),
    ("common/angle", include_str!("../shaders/common/angle.wgsl")),
    ("common/random", include_str!("../shaders/common/random.wgsl")),
    ("common/field", include_str!("../shaders/common/field.wgsl")),
    ("common/truck", include_str!("../shaders/common/truck.wgsl")),
    ("draw", include_str!("../shaders/draw.wgsl")),
    ("steer", include_str!("../shaders/steer.wgsl")),
    ("drive", include_str!("../shaders/drive.wgsl")),
    ("collide", include_str!("../shaders/collide.wgsl")),
    ("follow", include_str!("../shaders/follow.wgsl")),
    ("sense", include_str!("../shaders/sense.wgsl")),
    ("observe", include_str!("../shaders/observe.wgsl")),
    ("judge", include_str!("../shaders/judge.wgsl")),
    ("count", include_str!("../shaders/count.wgsl")),
    ("reset", include_str!("../shaders/reset.wgsl")),
];
