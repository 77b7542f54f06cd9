//! The learner: discrete soft actor-critic, its replay buffer, and the loop that trains it.

pub mod bridge; // columns to tensors
pub mod checkpoint; // all of a run's state, in a file
pub mod config; // a training file
pub mod exploration; // random actions among the policy's
pub mod generator; // random numbers with a state
pub mod mirror; // transitions mirrored left to right
pub mod network; // multi-layer perceptrons
pub mod normalisation; // of observations
pub mod replay_buffer; // transitions
pub mod run; // the training loop
pub mod sac; // soft actor-critic
