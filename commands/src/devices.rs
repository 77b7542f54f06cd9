//! `offtrack devices`, and the flags that choose one.

use offtrack_evaluation::device::{self, Device};
use offtrack_evaluation::error::Error;
#[cfg(feature = "gpu")]
use offtrack_evaluation::files;

/// List the devices that `--device gpu` can run on, best first; the default one is marked.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// What steps the trucks of a command.
#[derive(Debug, clap::Args)]
pub struct Choice {
    /// What steps the trucks: `cpu`, all cores of the processor, or `gpu`, compute shaders on a device.
    #[arg(long, default_value = "cpu", value_parser = ["cpu", "gpu"])]
    device: String,
    /// With --device gpu: part of an adapter's name, as `offtrack devices` lists it. Without it the first of that list.
    #[arg(long)]
    adapter: Option<String>,
}

impl Choice {
    /// Whether it is the processor.
    pub fn is_processor(&self) -> bool {
        self.device != "gpu"
    }

    /// Opens the device.
    pub fn open(&self) -> Result<Device, Error> {
        match (self.device.as_str(), &self.adapter) {
            ("gpu", adapter) => device::open(adapter.as_deref()),
            (_, None) => Ok(Device::processor()),
            (_, Some(name)) => {
                let expected = "the processor has no adapter: add --device gpu, or leave --adapter out".to_owned();
                Err(Error::Setting { name: "--adapter", value: name.clone(), expected })
            }
        }
    }
}

/// Runs the command.
#[cfg(feature = "gpu")]
pub fn run(_: &Args) -> Result<(), Error> {
    use offtrack::engine::stages::{N_STORAGE_BUFFERS, WORKGROUP_MEMORY};
    use offtrack::gpu::{self, Adapter};

    let adapters = gpu::adapters();
    if adapters.is_empty() {
        // The error names what was tried and what to install.
        device::open(None)?;
    }
    let buffers = format!("storage buffers ({N_STORAGE_BUFFERS} needed)");
    let memory = format!("workgroup memory ({} KiB needed)", WORKGROUP_MEMORY >> 10);
    let heads = ["", "adapter", "interface", "driver", "kind", "largest buffer", &buffers, &memory];
    let mut rows = vec![heads.map(str::to_owned)];
    rows.extend(adapters.into_iter().enumerate().map(|(index, adapter)| {
        let mark = if index == 0 { "*" } else { "" };
        let largest = format!("{} MiB", adapter.binding_max >> 20);
        let buffers = adapter.storage_buffers_max.to_string();
        let memory = format!("{} KiB", adapter.workgroup_memory_max >> 10);
        let Adapter { name, interface, driver, kind, .. } = adapter;
        [mark.to_owned(), name, interface, driver, kind.to_owned(), largest, buffers, memory]
    }));
    let widths: [usize; 8] =
        std::array::from_fn(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0));
    for row in rows {
        let cells: Vec<String> = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}")).collect();
        files::print(&format!("{}\n", cells.join("  ").trim_end()))?;
    }
    files::print("* the default, without --adapter\n")
}

/// Runs the command.
#[cfg(not(feature = "gpu"))]
pub fn run(_: &Args) -> Result<(), Error> {
    Err(Error::Setting {
        name: "devices",
        value: "none can be listed".to_owned(),
        expected: device::NOT_BUILT_IN.to_owned(),
    })
}
