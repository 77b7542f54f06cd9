//! Where a training run is: on the processor, or on a graphics device. The one place of the learner that chooses.

use std::sync::Arc;

#[cfg(feature = "gpu")]
use offtrack::gpu;
use offtrack::layout::{N_VALUES, ObservationLayout, ObservedExtras};
use offtrack::world::World;

use crate::config::{Config, Device};
#[cfg(feature = "gpu")]
use crate::device::Network;
use crate::error::Error;
use crate::exchange::Actor;
use crate::memory;
use crate::mirror::Mirror;
use crate::network::Mlp;
#[cfg(feature = "gpu")]
use crate::rollout::device::DeviceRollout;
use crate::rollout::{Rollout, host::HostRollout};
#[cfg(feature = "gpu")]
use crate::sac::device::DeviceSac;
use crate::sac::{Learner, Sac};

/// The processor, or an opened device.
#[derive(Clone)]
pub enum Backend {
    /// Trucks, replay buffer and learner in the processor's memory.
    Host,
    /// All of them on one device.
    #[cfg(feature = "gpu")]
    Device(Box<gpu::Device>),
}

impl Backend {
    /// What a training file asks for.
    pub fn open(config: &Config) -> Result<Backend, Error> {
        match config.device {
            Device::Cpu => Ok(Backend::Host),
            Device::Gpu => Backend::on_device(config.adapter.as_deref()),
        }
    }

    /// The first device whose adapter's name contains `adapter`.
    #[cfg(feature = "gpu")]
    pub fn on_device(adapter: Option<&str>) -> Result<Backend, Error> {
        let device = gpu::Device::open(adapter).map_err(offtrack::simulator::Error::from)?;
        Ok(Backend::Device(Box::new(device)))
    }

    /// An error: this program has no devices.
    #[cfg(not(feature = "gpu"))]
    pub fn on_device(_: Option<&str>) -> Result<Backend, Error> {
        let expected = format!("{}; or set device = \"cpu\"", offtrack_evaluation::device::NOT_BUILT_IN);
        Err(Error::setting("device", "\"gpu\"", expected))
    }

    /// The backend's name in results: `cpu`, or the adapter's with its interface and driver.
    pub fn name(&self) -> String {
        match self {
            Backend::Host => "cpu".to_owned(),
            #[cfg(feature = "gpu")]
            Backend::Device(device) => device.name(),
        }
    }

    /// A learner there, with random weights.
    pub fn learner(&self, config: &Config, n_values: usize, n_actions: usize) -> Result<Box<dyn Learner>, Error> {
        let (learning, seed) = (&config.learning, u64::from(config.seed));
        Ok(match self {
            Backend::Host => Box::new(Sac::new(learning, n_values, n_actions, seed)?),
            #[cfg(feature = "gpu")]
            Backend::Device(device) => Box::new(DeviceSac::new(device, learning, n_values, n_actions, seed)?),
        })
    }

    /// A network there, to act.
    pub fn actor(&self, network: Mlp) -> Actor {
        match self {
            Backend::Host => Actor::Host(network),
            #[cfg(feature = "gpu")]
            Backend::Device(device) => Actor::Device(Network::of(device, &network)),
        }
    }

    /// An error if a run there does not fit into the host's memory. A device says what it has no room for when it is
    /// asked.
    pub fn check_memory(&self, config: &Config, n_values: usize, n_actions: usize) -> Result<(), Error> {
        match self {
            Backend::Host => memory::check(config, n_values, n_actions),
            #[cfg(feature = "gpu")]
            Backend::Device(_) => Ok(()),
        }
    }

    /// Trucks and a replay buffer there, for as many values as the world's benchmark observes.
    pub fn rollout(
        &self,
        config: &Config,
        world: &Arc<World>,
        routes: Vec<u32>,
        mirror: Option<Mirror>,
    ) -> Result<Box<dyn Rollout>, Error> {
        const fn width(extras: ObservedExtras, has_vehicles: bool) -> usize {
            ObservationLayout { n_extras: extras.n_extras(), has_vehicles }.n_values()
        }
        const BLIND: usize = width(ObservedExtras::Blind, false);
        const MASS: usize = width(ObservedExtras::Mass, false);
        const ORACLE: usize = width(ObservedExtras::Oracle, false);
        const AMONG: usize = width(ObservedExtras::None, true);
        const BLIND_AMONG: usize = width(ObservedExtras::Blind, true);
        const MASS_AMONG: usize = width(ObservedExtras::Mass, true);
        const ORACLE_AMONG: usize = width(ObservedExtras::Oracle, true);
        match world.observation_layout().n_values() {
            BLIND => self.rollout_of::<BLIND>(config, world, routes, mirror),
            MASS => self.rollout_of::<MASS>(config, world, routes, mirror),
            ORACLE => self.rollout_of::<ORACLE>(config, world, routes, mirror),
            AMONG => self.rollout_of::<AMONG>(config, world, routes, mirror),
            BLIND_AMONG => self.rollout_of::<BLIND_AMONG>(config, world, routes, mirror),
            MASS_AMONG => self.rollout_of::<MASS_AMONG>(config, world, routes, mirror),
            ORACLE_AMONG => self.rollout_of::<ORACLE_AMONG>(config, world, routes, mirror),
            N_VALUES => self.rollout_of::<N_VALUES>(config, world, routes, mirror),
            n => unreachable!("a benchmark observes {n} values"),
        }
    }

    /// Trucks and a replay buffer on this backend, where the networks observe `N` values.
    fn rollout_of<const N: usize>(
        &self,
        config: &Config,
        world: &Arc<World>,
        routes: Vec<u32>,
        mirror: Option<Mirror>,
    ) -> Result<Box<dyn Rollout>, Error> {
        Ok(match self {
            Backend::Host => Box::new(HostRollout::<N>::new(config, world, routes, mirror)?),
            #[cfg(feature = "gpu")]
            Backend::Device(device) => Box::new(DeviceRollout::<N>::new(device, config, world, routes, mirror)?),
        })
    }

    /// The result of `work`. On a device a panic of a library becomes an error where the device has failed, and so do
    /// numbers that cannot be read there.
    pub fn guarded<T>(&self, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        match self {
            Backend::Host => work(),
            #[cfg(feature = "gpu")]
            Backend::Device(device) => {
                crate::panics::caught(work, || failure(device)).map_err(|error| match error {
                    // What the driver reported says more than the panic that followed.
                    Error::Device(message) => Error::Device(failure(device).map_or(message, |error| error.to_string())),
                    error => error,
                })
            }
        }
    }
}

/// What a device failed by, if it did.
#[cfg(feature = "gpu")]
fn failure(device: &gpu::Device) -> Option<Error> {
    device.check().err().map(|error| offtrack::simulator::Error::from(error).into())
}
