//! Where a training run is: on the processor, or on a graphics device. The one place of the learner that chooses.

use std::sync::Arc;

use offtrack::layout::{N_AROUND, N_VALUES, ObservedExtras};
use offtrack::world::World;

use crate::config::{Config, Device};
use crate::error::Error;
use crate::memory;
use crate::mirror::Mirror;
#[cfg(feature = "gpu")]
use crate::rollout::device::{DeviceRollout, Shared};
use crate::rollout::{Rollout, host::HostRollout};
use crate::sac::Placement;

/// The processor, or an opened device.
#[derive(Clone)]
pub enum Backend {
    /// Trucks, replay buffer and learner in the processor's memory.
    Host,
    /// All of them on one device.
    #[cfg(feature = "gpu")]
    Device(Box<Shared>),
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
        Ok(Backend::Device(Box::new(Shared::open(adapter)?)))
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
            Backend::Device(shared) => shared.gpu.name(),
        }
    }

    /// Where the learner's tensors are.
    pub fn placement(&self) -> Placement {
        match self {
            Backend::Host => Placement::Host,
            #[cfg(feature = "gpu")]
            Backend::Device(shared) => Placement::Device(shared.tensors.clone()),
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
        const BLIND: usize = N_VALUES + ObservedExtras::Blind.n_extras();
        const MASS: usize = N_VALUES + ObservedExtras::Mass.n_extras();
        const ORACLE: usize = N_VALUES + ObservedExtras::Oracle.n_extras();
        const AMONG: usize = N_VALUES + N_AROUND;
        const BLIND_AMONG: usize = BLIND + N_AROUND;
        const MASS_AMONG: usize = MASS + N_AROUND;
        const ORACLE_AMONG: usize = ORACLE + N_AROUND;
        match world.n_observed() {
            BLIND => self.rollout_of::<BLIND>(config, world, routes, mirror),
            MASS => self.rollout_of::<MASS>(config, world, routes, mirror),
            ORACLE => self.rollout_of::<ORACLE>(config, world, routes, mirror),
            AMONG => self.rollout_of::<AMONG>(config, world, routes, mirror),
            BLIND_AMONG => self.rollout_of::<BLIND_AMONG>(config, world, routes, mirror),
            MASS_AMONG => self.rollout_of::<MASS_AMONG>(config, world, routes, mirror),
            ORACLE_AMONG => self.rollout_of::<ORACLE_AMONG>(config, world, routes, mirror),
            _ => self.rollout_of::<N_VALUES>(config, world, routes, mirror),
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
            Backend::Device(shared) => Box::new(DeviceRollout::<N>::new(shared, config, world, routes, mirror)?),
        })
    }

    /// The result of `work`. On a device a panic of the tensor library becomes an error: it panics where a device
    /// fails.
    pub fn guarded<T>(&self, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        match self {
            Backend::Host => work(),
            #[cfg(feature = "gpu")]
            Backend::Device(shared) => {
                crate::panics::caught(work, || shared.check().err()).map_err(|error| match error {
                    // What the driver reported says more than the panic that followed.
                    Error::Device(message) => {
                        Error::Device(shared.check().err().map_or(message, |error| error.to_string()))
                    }
                    error => error,
                })
            }
        }
    }
}
