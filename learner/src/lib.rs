//! The learner: discrete soft actor-critic, its replay buffer, and the training loop, on the processor or on a graphics
//! device; and proximal policy optimisation, which can refine its policy.
//!
//! Start with [`train()`], which does all of it, then [`session`], the loop, then [`sac`] and [`ppo`], the algorithms.
//! [`rollout`] is what differs between processor and device.

pub mod error; // what can go wrong
pub mod session; // the loop: act, learn
pub mod exchange; // what trucks and learner give each other
pub mod sac; // soft actor-critic
pub mod ppo; // proximal policy optimisation, which refines its policy
pub mod network; // multi-layer perceptrons
pub mod pass; // their gradients on the processor
pub mod adam; // the optimizer
pub mod shards; // a batch on several threads
#[cfg(feature = "gpu")]
pub mod device; // buffers and kernels of a device that both share
pub mod rollout; // acting, stepping, remembering, sampling: on the host, on a device
pub mod replay_buffer; // transitions on the host
pub mod mirror; // mirror augmentation
pub mod exploration; // random actions among the policy's
pub mod level_replay; // routes that fail are drawn more often
pub mod memory; // what a run takes of it, before it begins
pub mod backend; // the choice of processor or device
pub mod panics; // of libraries, where a device fails
pub mod config; // a training file
pub mod run; // a training run in its folder
pub mod train; // from a config to a report, in a folder
pub mod checkpoint; // all state in a file
pub mod columns; // networks and optimizers there
pub mod generator; // random numbers with a state

pub use train::{resume, train};

/// The repository, whose files tests read.
#[cfg(test)]
fn repository() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a crate's folder lies in it").to_owned()
}
