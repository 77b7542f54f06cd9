//! Acting, stepping, remembering and sampling: what the training loop asks of the trucks and their replay buffer.
//!
//! On the host or on a graphics device.

#[cfg(feature = "gpu")]
pub mod device;
pub mod host;

use offtrack::layout::Ended;
use offtrack::simulator::Simulator;
use offtrack_policy::Normalisation;

use crate::checkpoint::{Columns, Stored};
use crate::config::Refinement;
use crate::error::Error;
use crate::exchange::{Actor, Sample, TdErrors};
use crate::mirror::Mirror;
use crate::network::Mlp;
use crate::ppo::steps::Steps;

/// Some episodes that ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Episodes {
    /// Number of episodes.
    pub count: u64,
    /// Episodes that arrived.
    pub arrived: u64,
    /// Sum of the episodes' rewards; of several trucks counted together, of all steps since the last count.
    pub reward: f64,
}

/// An episode that ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RouteEnd {
    /// The episode's route, an index in the world.
    pub route: u32,
    /// Why the episode ended.
    pub ended: Ended,
}

/// Trucks that are stepped together, and the replay buffer of their transitions.
pub trait Rollout {
    /// The trucks.
    fn simulator(&self) -> &Simulator;

    /// Transitions held.
    fn n_transitions(&self) -> usize;

    /// Whether any held transition can be sampled: one that enough steps follow.
    fn can_sample(&self) -> bool;

    /// The normalisation of the observations held and, where there is a mirror, of their images. Waits for a device.
    fn found_normalisation(&self, mirror: Option<&Mirror>) -> Result<Normalisation, Error>;

    /// Normalises observations this way from here on, for acting and for samples.
    fn set_normalisation(&mut self, normalisation: &Normalisation);

    /// One step of every truck with random actions, remembered.
    fn step_at_random(&mut self) -> Result<(), Error>;

    /// One step of every truck with actions sampled from the actor's distribution, remembered. `env_steps` were made
    /// before.
    fn step(&mut self, actor: &Actor, env_steps: u64) -> Result<(), Error>;

    /// A refinement's steps of every truck with actions sampled from the actor's distribution, for learning from them
    /// at once: not remembered. The lane distance counts as far as the world's limit.
    fn collect(&mut self, actor: &Mlp, settings: &Refinement) -> Result<Steps, Error>;

    /// One step of every truck with actions sampled from the actor's distribution, not kept at all.
    fn drive(&mut self, actor: &Actor) -> Result<(), Error>;

    /// Samples a batch.
    fn sample(&mut self) -> Result<Sample, Error>;

    /// Sets priorities from the absolute TD errors of the latest sample.
    fn set_td_errors(&mut self, errors: TdErrors) -> Result<(), Error>;

    /// The episodes that ended since this was last called. Where counting them means waiting for a device, none unless
    /// `wait`.
    fn take_episodes(&mut self, wait: bool) -> Result<Vec<Episodes>, Error>;

    /// The episodes that ended since this was last called, one by one. A device has them with level replay alone, and
    /// only up to its latest list of routes.
    fn take_route_ends(&mut self) -> Vec<RouteEnd>;

    /// Waits until all that was asked for is done.
    fn wait(&self) -> Result<(), Error>;

    /// An error if the device failed.
    fn check(&self) -> Result<(), Error>;

    /// Adds what continues bit for bit; on a device, the scores of level replay alone.
    fn save<'a>(&'a self, columns: &mut Columns<'a>);

    /// Continues after `n_updates` from what [`Rollout::save`] added; on a device with an empty replay buffer and new
    /// episodes.
    fn restore(&mut self, stored: &Stored, n_updates: u64) -> Result<(), Error>;
}

/// The normalisation of these observations: what is learned from with a mirror is symmetric.
fn normalisation_of<const N: usize>(mut observations: Vec<[f32; N]>, mirror: Option<&Mirror>) -> Normalisation {
    if let Some(mirror) = mirror {
        let images: Vec<_> = observations.iter().map(|observation| mirror.observation(observation)).collect();
        observations.extend(images);
    }
    Normalisation::of(&observations)
}
