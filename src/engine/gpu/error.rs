//! What can go wrong with a device, and with a batch on it.

/// What can go wrong with a device.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No driver offers one.
    #[error(
        "no adapter: {looked_for} found none; install the graphics card's driver, or a software one (Debian: \
         mesa-vulkan-drivers), or run on the CPU"
    )]
    NoAdapter {
        /// The interfaces that were searched.
        looked_for: String,
    },
    /// No adapter has the name asked for.
    #[error("adapter {name:?}: not found; this machine has {}", .found.join(", "))]
    UnknownAdapter {
        /// Part of a name.
        name: String,
        /// The adapters there are.
        found: Vec<String>,
    },
    /// The adapter is too small for any batch.
    #[error("{adapter}: {limit} is {has}; at least {needed} is needed")]
    Limit {
        /// The adapter's name.
        adapter: String,
        /// What the adapter has too little of.
        limit: &'static str,
        /// Value of the limit on the adapter.
        has: u64,
        /// What is needed.
        needed: u64,
    },
    /// The adapter is too small for this batch.
    #[error(
        "n_envs: {n_envs}; {buffer} would take {n_bytes} bytes where {adapter} allows {limit} in a buffer: at most \
         {fitting} trucks fit"
    )]
    TooManyTrucks {
        /// Trucks asked for.
        n_envs: usize,
        /// The column that is too large.
        buffer: &'static str,
        /// What the column would take (bytes).
        n_bytes: u64,
        /// The adapter's name.
        adapter: String,
        /// The largest buffer that it binds.
        limit: u64,
        /// Trucks that would fit.
        fitting: u64,
    },
    /// The adapter is too small for this world.
    #[error(
        "world: the {table} of {n_roundabouts} roundabouts take {n_bytes} bytes where {adapter} allows {limit} in a \
         buffer: about {fitting} such roundabouts fit"
    )]
    WorldTooLarge {
        /// The table that is too large.
        table: &'static str,
        /// Roundabouts of the world.
        n_roundabouts: usize,
        /// What the table takes.
        n_bytes: u64,
        /// The adapter's name.
        adapter: String,
        /// The largest buffer that it binds.
        limit: u64,
        /// Roundabouts of this mean size that would fit.
        fitting: u64,
    },
    /// The driver refused, failed or lost the device.
    #[error("{adapter}: {message}")]
    Broken {
        /// The adapter's name.
        adapter: String,
        /// The driver's message.
        message: String,
    },
    /// An external column that is too small.
    #[error("{column}: {found} bytes; {n_envs} trucks need {needed}")]
    ColumnSize {
        /// The column.
        column: &'static str,
        /// The column's size (bytes).
        found: u64,
        /// Trucks in the batch.
        n_envs: usize,
        /// Bytes needed.
        needed: u64,
    },
    /// External columns cannot change their number of rows.
    #[error("the batch has external columns: its trucks cannot be gathered")]
    ExternalColumns,
}
