//! What trucks and learner give each other: samples, their TD errors, and the actor, in the processor's memory or in
//! that of a device.

use burn::tensor::Tensor;

#[cfg(feature = "gpu")]
use crate::device::{Batch, Network};
use crate::error::Error;
use crate::network::Mlp;
use crate::sac::Transitions;

/// A sample of the replay buffer.
#[derive(Debug)]
pub enum Sample {
    /// In shards.
    Host(Vec<Transitions>),
    /// In buffers of a device, until the next one is drawn.
    #[cfg(feature = "gpu")]
    Device(Box<Batch>),
}

/// Absolute TD errors of a sample.
#[derive(Debug)]
pub enum TdErrors {
    /// `[B, 1]` a shard.
    Host(Vec<Tensor<2>>),
    /// In a buffer of a device, `[B]`.
    #[cfg(feature = "gpu")]
    Device(offtrack::gpu::Slice),
}

/// The network that acts.
#[derive(Debug)]
pub enum Actor {
    /// In the processor's memory.
    Host(Mlp),
    /// In a buffer of a device.
    #[cfg(feature = "gpu")]
    Device(Network),
}

impl Sample {
    /// The shards.
    pub fn on_host(self) -> Result<Vec<Transitions>, Error> {
        match self {
            Sample::Host(shards) => Ok(shards),
            #[cfg(feature = "gpu")]
            Sample::Device(_) => Err(elsewhere("sample")),
        }
    }

    /// The buffers.
    #[cfg(feature = "gpu")]
    pub fn on_device(self) -> Result<Box<Batch>, Error> {
        match self {
            Sample::Host(_) => Err(elsewhere("sample")),
            Sample::Device(batch) => Ok(batch),
        }
    }
}

impl TdErrors {
    /// The tensors.
    pub fn on_host(self) -> Result<Vec<Tensor<2>>, Error> {
        match self {
            TdErrors::Host(errors) => Ok(errors),
            #[cfg(feature = "gpu")]
            TdErrors::Device(_) => Err(elsewhere("TD errors")),
        }
    }

    /// The buffer.
    #[cfg(feature = "gpu")]
    pub fn on_device(self) -> Result<offtrack::gpu::Slice, Error> {
        match self {
            TdErrors::Host(_) => Err(elsewhere("TD errors")),
            TdErrors::Device(errors) => Ok(errors),
        }
    }
}

impl Actor {
    /// The network.
    pub fn on_host(&self) -> Result<&Mlp, Error> {
        match self {
            Actor::Host(network) => Ok(network),
            #[cfg(feature = "gpu")]
            Actor::Device(_) => Err(elsewhere("actor")),
        }
    }

    /// The network's buffer.
    #[cfg(feature = "gpu")]
    pub fn on_device(&self) -> Result<&Network, Error> {
        match self {
            Actor::Host(_) => Err(elsewhere("actor")),
            Actor::Device(network) => Ok(network),
        }
    }
}

#[cfg(feature = "gpu")]
fn elsewhere(what: &str) -> Error {
    Error::Device(format!("the {what} must be where the trucks and the learner are: in one memory"))
}
