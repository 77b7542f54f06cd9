//! The rows and constants that both engines share: defined here and nowhere else.
//!
//! Each struct is plain data without padding (vectors first, then scalars), so that a column of them can be copied to a
//! device as it is. SI units and radians throughout; headings lie in (-pi, pi].

pub mod shared; // macros for what Rust and WGSL share
pub mod angle; // angles in plain f32
pub mod random; // numbers from (seed, env, episode, draw)
pub mod buffers;
pub(crate) mod columns;
mod ended;
mod extras;
mod observation;
mod truck;

use glam::Vec2;

use crate::layout::shared::constants;
pub use columns::{Column, N_COLUMNS};
pub use ended::Ended;
pub(crate) use ended::printed_codes;
pub use extras::{EXTRAS, Extra, ObservedExtras};
pub(crate) use observation::first_of;
pub use observation::{OBSERVATION, Values};

constants! {
    /// Threads of a workgroup.
    pub const WORKGROUP: u32 = 64;
    /// Values in an observation.
    pub const N_VALUES: usize = 69;
    /// Distance sensors on the trailer, left and right alternating, front to rear.
    pub const N_TRAILER_RAYS: usize = 16;
    /// Distance sensors on the tractor, from left 90 deg to right 90 deg.
    pub const N_TRACTOR_RAYS: usize = 13;
    /// Distance sensors in all: the trailer's first, then the tractor's, as the observation has them.
    pub const N_RAYS: usize = N_TRAILER_RAYS + N_TRACTOR_RAYS;
    /// Values of an observation that depend on the waypoint alone: future and current curvature, radius ahead.
    pub const N_PREVIEW: usize = 18;
    /// Values that may be observed beside those.
    pub const N_EXTRAS: usize = 12;
    /// Bit of [`BeginRow::what`]: the truck begins an episode.
    pub const BEGINS: u32 = 1;
    /// Bit: the episode is the first of the truck's stream, not the next one.
    pub const IS_FIRST: u32 = 2;
    /// Bit: its route is stated.
    pub const HAS_ROUTE: u32 = 4;
    /// Bit: its start is stated.
    pub const HAS_START: u32 = 8;
}

crate::shared! {
    /// What the steer stage asks of a truck for a step: a steer angle and an acceleration.
    pub struct Control {
        /// Steer angle asked for (rad).
        pub steering: f32,
        /// Acceleration asked for (m/s^2).
        pub acceleration: f32,
        /// Integral of the speed error (m).
        pub speed_error_integral: f32,
        /// Steer angle asked for in the step before (rad).
        pub steering_before: f32,
        /// Steer angle asked for in the step before that (rad).
        pub steering_earlier: f32,
        /// Target speed (m/s).
        pub target_speed: f32,
        /// Whether the target speed is 0: once the truck stands, the brakes hold it (0 or 1).
        pub holds: u32,
    }

    /// One tractor and its trailer.
    pub struct Truck {
        /// Middle of the drive axle (m).
        pub position: Vec2,
        /// Heading of the tractor, counter-clockwise from +x (rad).
        pub heading: f32,
        /// Heading of the trailer, counter-clockwise from +x (rad).
        pub trailer_heading: f32,
        /// Speed of the drive axle along the tractor's heading (m/s).
        pub speed: f32,
        /// Steer angle of the front axle, left positive (rad).
        pub steering: f32,
        /// Roll angle of the tractor (rad).
        pub tractor_roll: f32,
        /// Roll rate of the tractor (rad/s).
        pub tractor_roll_rate: f32,
        /// Roll angle of the trailer (rad).
        pub trailer_roll: f32,
        /// Roll rate of the trailer (rad/s).
        pub trailer_roll_rate: f32,
        /// Load transfer ratio of the tractor, the largest of the step in magnitude, signed (1).
        pub tractor_load_transfer_ratio: f32,
        /// Load transfer ratio of the trailer, the largest of the step in magnitude, signed (1).
        pub trailer_load_transfer_ratio: f32,
        /// Index of the route in the world.
        pub route: u32,
        /// Index of the episode, counted for each truck from 0.
        pub episode: u32,
        /// Steps taken in this episode.
        pub steps: u32,
        /// Whether the truck's episode has ended and no other has begun, so that no stage changes it (0 or 1).
        pub held: u32,
        /// Acceleration along the tractor's heading (m/s^2).
        pub acceleration: f32,
        /// Curvature that the tractor's path has beyond that of the steer angle, because it turns in late (1/m).
        pub curvature_lag: f32,
        /// Lateral acceleration of the trailer's axle group, to the left (m/s^2).
        pub lateral_acceleration: f32,
        /// Index of the vehicle in the world.
        pub vehicle: u32,
    }

    /// How a truck begins its route: fractions of the largest start errors and of half the range of speeds, each in
    /// -1..=1, and its vehicle. Zeros are the first vehicle on the lane centre at the middle of the speeds.
    pub struct Start {
        /// Fraction of the largest lateral offset, left positive.
        pub offset: f32,
        /// Fraction of the largest heading error, counter-clockwise positive.
        pub heading: f32,
        /// Fraction of half the range of speeds, from its middle.
        pub speed: f32,
        /// Index of the vehicle in the world.
        pub vehicle: u32,
    }

    /// The stream of random numbers that a truck draws routes, starts and random actions from: a truck with the stream
    /// (seed, env) drives as truck `env` of a batch with that seed.
    pub struct Stream {
        /// Seed.
        pub seed: u32,
        /// Index of a truck in a batch of that seed.
        pub env: u32,
    }

    /// What the caller asks of a truck: whether and how it begins an episode.
    pub struct BeginRow {
        /// Start of the episode, where [`HAS_START`] is set.
        pub start: Start,
        /// Index of the episode's route in the world, where [`HAS_ROUTE`] is set.
        pub route: u32,
        /// Bits: [`BEGINS`], [`IS_FIRST`], [`HAS_ROUTE`], [`HAS_START`].
        pub what: u32,
    }

    /// Distance from a unit's outline to the nearest solid edge, at most 0 where they touch (m).
    ///
    /// Contact is exact to 2 cm. Otherwise the value is at least the true distance less the field's error, and at most
    /// twice the true distance plus 2 cm: far from a kerb fewer points are sampled.
    pub struct Clearance {
        /// Clearance of the tractor (m).
        pub tractor: f32,
        /// Clearance of the trailer (m).
        pub trailer: f32,
    }

    /// How far along its route a truck is.
    pub struct Progress {
        /// Distance from the reference point to the lane centre (m).
        pub lane_distance: f32,
        /// Distance from the reference point to the next waypoint (m).
        pub waypoint_distance: f32,
        /// Index of the next waypoint to pass on the route; the route's number of waypoints once all are passed.
        pub waypoint: u32,
        /// Waypoints passed in this step.
        pub passed: u32,
    }

    /// The physical amounts that the reward weighs.
    pub struct RewardTerms {
        /// Waypoints passed in this step.
        pub waypoints: f32,
        /// Distance to the lane centre, limited and scaled to 0..1.
        pub lane_distance: f32,
        /// Depth of the nearer unit in the margin kept from kerbs, from 0 outside it to 1 at a kerb.
        pub clearance: f32,
        /// 1 when the episode failed in this step.
        pub failure: f32,
    }

    /// One distance sensor, fixed to a unit. A tractor's frame starts at the drive axle, a trailer's at its axle group.
    pub struct Ray {
        /// Mount in the unit's frame, x forward, y left (m).
        pub origin: Vec2,
        /// Unit vector in the unit's frame.
        pub direction: Vec2,
    }

    /// A rectangle fixed to a unit's frame.
    pub struct Body {
        /// Front end, ahead of the frame's origin (m).
        pub front: f32,
        /// Rear end, ahead of the frame's origin (negative when behind) (m).
        pub rear: f32,
        /// Half of the width (m).
        pub half_width: f32,
    }

    /// One unit's roll model, discretised for a sub-step: `next = transition * state + input * lateral acceleration`.
    pub struct Roll {
        /// Row-major transition of (roll, roll rate) over one sub-step.
        pub transition: [f32; 4],
        /// Change of (roll, roll rate) by a lateral acceleration of 1 m/s^2 held through the sub-step.
        pub input: [f32; 2],
        /// Load transfer ratio per m/s^2 of lateral acceleration.
        pub per_acceleration: f32,
        /// Load transfer ratio per rad of roll.
        pub per_roll: f32,
        /// Load transfer ratio per rad/s of roll rate.
        pub per_roll_rate: f32,
    }

    /// A first-order lag, discretised for a sub-step in which what is asked for is constant. Zeros are no lag.
    pub struct Lag {
        /// Fraction of the deviation that is left at the sub-step's end.
        pub left: f32,
        /// Mean of that fraction over the sub-step.
        pub mean: f32,
    }

    /// The vehicle as the stages need it.
    pub struct Rig {
        /// Front axle ahead of the drive axle (m).
        pub wheelbase: f32,
        /// Fifth wheel ahead of the drive axle (m).
        pub fifth_wheel: f32,
        /// Kingpin ahead of the trailer's axle group (m).
        pub trailer_wheelbase: f32,
        /// Slip factor (rad/(m/s^2)).
        pub slip: f32,
        /// Largest steer angle (rad).
        pub steer_max: f32,
        /// Fastest change of the steer angle (rad/s).
        pub steer_rate: f32,
        /// Strongest braking, negative (m/s^2).
        pub acceleration_min: f32,
        /// Strongest drive (m/s^2).
        pub acceleration_max: f32,
        /// Lateral acceleration that the tyres can hold (m/s^2).
        pub lateral_acceleration_max: f32,
        /// Speed control: acceleration per speed error (1/s).
        pub speed_gain: f32,
        /// Speed control: acceleration per integral of the speed error (1/s^2).
        pub speed_integral_gain: f32,
        /// Speed control: speed error beyond which the integral is reset to 0 (m/s).
        pub speed_integral_band: f32,
        /// Speed control: strongest braking it asks for, negative (m/s^2).
        pub speed_braking: f32,
        /// The tractor's outline.
        pub tractor_body: Body,
        /// The trailer's outline.
        pub trailer_body: Body,
        /// The tractor's roll.
        pub tractor_roll: Roll,
        /// The trailer's roll.
        pub trailer_roll: Roll,
        /// Largest shift of a no-slip point by tyre slip (m).
        pub slip_lever_max: f32,
        /// Time constant, per speed, with which the tractor's yaw follows the steer angle; 0 for at once (s/(m/s)).
        pub yaw_lag: f32,
        /// How the acceleration follows what is asked for when that is drive.
        pub drive_lag: Lag,
        /// How the acceleration follows what is asked for when that is braking.
        pub brake_lag: Lag,
        /// Engine power over the mass of the whole truck (W/kg).
        pub power: f32,
        /// Friction ellipse: the lateral grip is that of free rolling times `sqrt(1 - friction_ellipse acceleration²)`;
        /// 0 where drive and braking take no lateral grip ((s^2/m)^2).
        pub friction_ellipse: f32,
        /// Lateral acceleration that the road's fall to the right adds to the roll (m/s^2).
        pub crossfall: f32,
        /// Sub-steps from a steer command to the first movement of the wheels.
        pub steer_delay: u32,
        /// Mass of the trailer with its load (kg).
        pub trailer_mass: f32,
        /// Constant lateral acceleration at which the trailer's inner wheels lift, in units of gravity.
        pub rollover_threshold: f32,
        /// Index of its distance sensors among those of all vehicles.
        pub chassis: u32,
        /// Index of vehicle and load, as reports and the clock group them.
        pub class_index: u32,
    }

    /// One entry of the action table.
    pub struct Action {
        /// Steer angle asked for (rad).
        pub steering: f32,
        /// Speed asked for or, with [`Params::changes_speed`], by how much the target speed changes (m/s).
        pub speed: f32,
    }

    /// The weights of the reward's terms and the limits of two of them, by the keys of a benchmark's `[reward]`.
    pub struct Reward {
        /// Reward for each waypoint passed.
        pub waypoint: f32,
        /// Reward for the lane-distance term, each step.
        pub lane_distance: f32,
        /// Distance to the lane centre at which that term is 1 (m).
        pub lane_distance_limit: f32,
        /// Reward for the clearance term, each step.
        pub clearance: f32,
        /// Margin kept from kerbs, within which that term counts (m).
        pub clearance_limit: f32,
        /// Reward when the episode fails.
        pub failure: f32,
    }

    /// Time and weights, shared by all trucks.
    pub struct Params {
        /// Time of one sub-step (s).
        pub substep: f32,
        /// Sub-steps in a step.
        pub n_substeps: u32,
        /// Entries of the action table.
        pub n_actions: u32,
        /// Vehicles that an episode draws from.
        pub n_vehicles: u32,
        /// Range of a distance sensor (m).
        pub sensor_range: f32,
        /// Largest lateral offset at the start (m).
        pub start_offset: f32,
        /// Largest heading error at the start (rad).
        pub start_heading: f32,
        /// Middle of the speeds at the start (m/s).
        pub start_speed: f32,
        /// Half of their range (m/s).
        pub start_speed_range: f32,
        /// Lowest target speed (m/s).
        pub target_speed_min: f32,
        /// Highest target speed (m/s).
        pub target_speed_max: f32,
        /// Whether an action changes the target speed by its speed, rather than states it (0 or 1).
        pub changes_speed: u32,
        /// Classes of vehicles.
        pub n_classes: u32,
        /// Extras that are observed, the first ones; the others stay 0.
        pub n_extras: u32,
        /// Distance to the next waypoint beyond which it cannot be passed and the truck has strayed (m).
        pub stray_distance: f32,
        /// Articulation beyond which the truck is jackknifed (rad).
        pub jackknife_angle: f32,
        /// Load transfer ratio from which the truck has rolled over.
        pub rollover_ratio: f32,
        /// Weights and limits of the reward.
        pub reward: Reward,
    }

    /// One waypoint of one route.
    pub struct WaypointRow {
        /// Position on the lane centre (m).
        pub position: Vec2,
        /// Unit vector along the lane.
        pub direction: Vec2,
    }

    /// The values of an observation that depend on the next waypoint alone.
    pub struct PreviewRow {
        /// Heading of the lane (rad).
        pub heading: f32,
        /// Scaled as observed: 4 future curvatures, 4 current ones, 10 radii ahead.
        pub values: [f32; N_PREVIEW],
    }

    /// One route in the world's table of waypoints.
    pub struct RouteRow {
        /// The route's first waypoint in the table.
        pub first: u32,
        /// The route's number of waypoints.
        pub n_waypoints: u32,
        /// The route's roundabout.
        pub roundabout: u32,
        /// Reach of a waypoint's crossing line to the left (m).
        pub crossing_left: f32,
        /// Reach of a waypoint's crossing line to the right (m).
        pub crossing_right: f32,
    }

    /// One roundabout's field among the tables of all fields.
    pub struct FieldRow {
        /// South-west corner of the grid (m).
        pub origin: Vec2,
        /// Cells in a metre (1/m).
        pub cells_per_metre: f32,
        /// Slope of the distance where it rises by one stored unit across a cell.
        pub slope: f32,
        /// Cells from west to east.
        pub columns: u32,
        /// Cells from south to north.
        pub rows: u32,
        /// Index of its first cell.
        pub first_cell: u32,
        /// Index of the first pair of its blocks.
        pub first_pair: u32,
    }

    /// Facts that the trucks of a batch share.
    pub struct BatchFacts {
        /// Trucks.
        pub n_envs: u32,
        /// Routes to draw from.
        pub n_routes: u32,
        /// Whether each truck runs the route of its own index (0 or 1).
        pub fixed: u32,
        /// What follows the end of an episode: SAME_STEP, NEXT_STEP or DISABLED.
        pub autoreset: u32,
    }
}
