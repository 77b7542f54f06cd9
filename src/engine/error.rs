//! What can go wrong with a batch.

#[cfg(feature = "gpu")]
use super::gpu;

/// What a caller can get wrong about a batch, and how a device can fail.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A batch needs a truck.
    #[error("n_envs: 0; a batch needs at least 1 truck")]
    EmptyBatch,
    /// Trucks that share a road are not split.
    #[error(
        "n_envs: {n_envs}; the benchmark has groups of {group} trucks (traffic.group): a multiple of that is needed"
    )]
    SplitGroup {
        /// Trucks asked for.
        n_envs: usize,
        /// Trucks of a group.
        group: usize,
    },
    /// A group of trucks is drawn on a road where each begins in a lane of its own.
    #[error(
        "routes: they begin in {n_lanes} of the lanes of {road}; a group of {group} trucks (traffic.group) needs as \
         many"
    )]
    NarrowGroup {
        /// The road.
        road: String,
        /// Lanes in which these routes begin.
        n_lanes: usize,
        /// Trucks of a group.
        group: usize,
    },
    /// Trucks of a group begin in lanes of their own.
    #[error("routes: trucks {first} and {other} of a group (traffic.group) begin in one lane; each needs its own")]
    SharedLane {
        /// The first truck that begins in the lane.
        first: usize,
        /// The next one.
        other: usize,
    },
    /// Trucks of a group begin on one road.
    #[error("routes: trucks {first} and {other} of a group (traffic.group) are on {roads:?}; a group shares one road")]
    SplitRoads {
        /// The group's first truck.
        first: usize,
        /// The first one that is on another road.
        other: usize,
        /// Names of their roads.
        roads: [String; 2],
    },
    /// Trucks of a group begin together.
    #[error(
        "envs: the group of truck {env} is not begun as a whole; all {group} begin together, each or none on a \
             stated route, each or none in a stream of its own"
    )]
    PartOfGroup {
        /// A truck of the group.
        env: usize,
        /// Trucks of a group.
        group: usize,
    },
    /// What is done to trucks one by one.
    #[error("{what}: not where trucks share a road (traffic.group is {group}); leave it out")]
    NotInGroups {
        /// What was asked for.
        what: &'static str,
        /// Trucks of a group.
        group: usize,
    },
    /// The columns do not fit into the host's memory.
    #[error(
        "n_envs: {n_envs}; the columns would take {n_bytes} bytes, more than this machine has free: at most {fitting} \
         trucks fit"
    )]
    BatchTooLarge {
        /// Trucks asked for.
        n_envs: usize,
        /// Bytes that their columns would take.
        n_bytes: u128,
        /// Trucks whose columns fit.
        fitting: u64,
    },
    /// An episode needs a route to run on.
    #[error("routes: empty; at least 1 route is needed")]
    NoRoutes,
    /// A vehicle that the world does not have.
    #[error("vehicles: {vehicle}; the world has vehicles 0..{}", .n_vehicles - 1)]
    UnknownVehicle {
        /// The index.
        vehicle: u32,
        /// Vehicles of the world.
        n_vehicles: usize,
    },
    /// A route that the world does not have.
    #[error("routes: {route}; the world has routes 0..{}", .n_routes - 1)]
    UnknownRoute {
        /// The index asked for.
        route: u32,
        /// Routes in the world.
        n_routes: usize,
    },
    /// Routes to draw from where none are drawn, or of another number than before.
    #[error(
        "routes: {n_routes} to draw from; this batch {}",
        .drawn.map_or("runs one fixed route a truck".to_owned(), |drawn| format!("draws from {drawn}, and needs as many"))
    )]
    DrawnCount {
        /// Routes given.
        n_routes: usize,
        /// Routes that the batch draws from, none where each truck has its own.
        drawn: Option<usize>,
    },
    /// Fixed routes must be one for each truck.
    #[error("routes: {n_routes} for {n_envs} trucks; one each is needed")]
    RouteCount {
        /// Routes given.
        n_routes: usize,
        /// Trucks in the batch.
        n_envs: usize,
    },
    /// Starts must be one for each truck.
    #[error("starts: {n_starts} for {n_envs} trucks; one each is needed")]
    StartCount {
        /// Starts given.
        n_starts: usize,
        /// Trucks in the batch.
        n_envs: usize,
    },
    /// Streams must be one for each truck.
    #[error("streams: {n_streams} for {n_envs} trucks; one each is needed")]
    StreamCount {
        /// Streams given.
        n_streams: usize,
        /// Trucks in the batch.
        n_envs: usize,
    },
    /// A start beyond the benchmark's largest errors.
    #[error("starts[{env}].{part}: {fraction}; must lie in -1..1, a fraction of the largest error or range")]
    UnknownStart {
        /// Index of its truck.
        env: usize,
        /// Which part of it: `offset`, `heading` or `speed`.
        part: &'static str,
        /// The fraction of the largest error.
        fraction: String,
    },
    /// A start that is not on its route.
    #[error("starts[{env}]: {fraction} of the way along the route; must lie in 0..1")]
    BeyondRoute {
        /// Index of its truck.
        env: usize,
        /// The fraction of the route that is to lie behind.
        fraction: String,
    },
    /// A row that the batch does not have.
    #[error("indices[{position}]: {index}; the batch has trucks 0..{}", .n_envs - 1)]
    UnknownTruck {
        /// Position of the unknown truck's index among the indices.
        position: usize,
        /// The index asked for.
        index: usize,
        /// Trucks in the batch.
        n_envs: usize,
    },
    /// A truck that begins twice at once.
    #[error("indices[{position}]: {index} again; each truck may be named once")]
    RepeatedTruck {
        /// Position at which it is named again.
        position: usize,
        /// Its index.
        index: usize,
    },
    /// Actions must be one for each truck.
    #[error("actions: {n_actions} for {n_envs} trucks; one each is needed")]
    ActionCount {
        /// Actions given.
        n_actions: usize,
        /// Trucks in the batch.
        n_envs: usize,
    },
    /// An action outside the table.
    #[error("actions[{env}]: {action}; must lie in 0..{}", .limit - 1)]
    UnknownAction {
        /// Index of its truck.
        env: usize,
        /// The action.
        action: u32,
        /// Entries of the action table.
        limit: u32,
    },
    /// Indices for a world whose actions are continuous.
    #[error("actions: indices; this benchmark's are continuous (actions.kind): commands are needed")]
    NeedsCommands,
    /// Commands for a world whose actions are indices.
    #[error("commands: this benchmark's actions are levels (actions.kind): indices are needed")]
    NeedsIndices,
    /// Commands must be one for each truck.
    #[error("commands: {n_commands} for {n_envs} trucks; one each is needed")]
    CommandCount {
        /// Commands given.
        n_commands: usize,
        /// Trucks in the batch.
        n_envs: usize,
    },
    /// A command outside its range, or none.
    #[error("commands[{env}].{field}: {value}; must lie in -1..1")]
    UnknownCommand {
        /// Index of its truck.
        env: usize,
        /// Which of its values.
        field: &'static str,
        /// The value.
        value: String,
    },
    /// A stored column that does not fit the batch.
    #[error(
        "{column}: {}; a batch of {n_envs} trucks needs {n_bytes} bytes",
        .found.map_or("missing".to_owned(), |found| format!("{found} bytes"))
    )]
    ColumnSize {
        /// The column's name.
        column: &'static str,
        /// Bytes given, none where the column is missing.
        found: Option<usize>,
        /// Trucks in the batch.
        n_envs: usize,
        /// Bytes needed.
        n_bytes: usize,
    },
    /// A stored truck that waits for its next episode, where that begins in the same step.
    #[error("truck[{env}].held: 1; no truck waits with the autoreset same_step: go on with next_step or disabled")]
    HeldInSameStep {
        /// Index of the truck.
        env: usize,
    },
    /// A stored truck that cannot be in this world.
    #[error("{column}[{env}]: {found}; the world has {limit}")]
    OutsideWorld {
        /// The column's name.
        column: &'static str,
        /// Index of the truck.
        env: usize,
        /// The index found there.
        found: u32,
        /// What the world has.
        limit: String,
    },
    /// A stored value that no truck of this world can have.
    #[error("{place}: {found}; must lie in {expected}")]
    ImpossibleValue {
        /// Column, truck and field: `truck[3].speed`.
        place: String,
        /// The value found there.
        found: String,
        /// The range that it must lie in.
        expected: String,
    },
    /// The device.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] gpu::Error),
}
