//! What steps trucks: the processor, or a device and its name in results.
//!
//! In a program that was built without the feature `gpu` there is no device to open.

#[cfg(feature = "gpu")]
use offtrack::simulator;
use offtrack::simulator::Engine;

use crate::error::Error;
use crate::provenance;

/// The error text where a program without the feature is asked for a device.
#[cfg(not(feature = "gpu"))]
pub const NOT_BUILT_IN: &str =
    "this program was built without the feature gpu; `cargo build --release --features gpu` builds one that has it";

/// An engine and its name.
#[derive(Debug, Clone)]
pub struct Device {
    /// The engine.
    pub engine: Engine,
    /// Name for results: `cpu`, whose processor results name elsewhere, or the adapter with its interface and driver.
    pub name: String,
    /// None is the processor.
    adapter: Option<String>,
}

impl Device {
    /// The processor.
    pub fn processor() -> Device {
        Device { engine: Engine::Cpu, name: "cpu".to_owned(), adapter: None }
    }

    /// The adapter's own name, with which it can be opened again; none of the processor.
    pub fn adapter(&self) -> Option<&str> {
        self.adapter.as_deref()
    }

    /// `cpu` or `gpu`, in results.
    pub fn kind(&self) -> &'static str {
        if self.adapter.is_none() { "cpu" } else { "gpu" }
    }

    /// Name for people: of the processor or of the adapter.
    pub fn title(&self) -> String {
        if self.adapter.is_none() { provenance::machine() } else { self.name.clone() }
    }
}

/// Opens the first adapter whose name contains `adapter`.
#[cfg(feature = "gpu")]
pub fn open(adapter: Option<&str>) -> Result<Device, Error> {
    use offtrack::gpu;

    match gpu::Device::open(adapter) {
        Ok(device) => {
            let (name, adapter) = (device.name(), device.adapter.get_info().name);
            Ok(Device { engine: Engine::Gpu { device, columns: gpu::Columns::new() }, name, adapter: Some(adapter) })
        }
        Err(gpu::Error::UnknownAdapter { name, found }) => {
            let expected = format!("no adapter's name contains this; there is {}", found.join(", "));
            Err(Error::Setting { name: "--adapter", value: name, expected })
        }
        Err(error) => Err(simulator::Error::from(error).into()),
    }
}

/// Opens the first adapter whose name contains `adapter`.
#[cfg(not(feature = "gpu"))]
pub fn open(_: Option<&str>) -> Result<Device, Error> {
    Err(Error::Setting {
        name: "--device",
        value: "gpu".to_owned(),
        expected: format!("{NOT_BUILT_IN}, or leave --device out"),
    })
}
