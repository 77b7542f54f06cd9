//! Rows of the columns of a batch, and what a caller asks of a truck.

use glam::Vec2;

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
        /// Steer angle asked for three steps before (rad).
        pub steering_earliest: f32,
        /// With a delay of actions: the action of the step before, its index plus 1 or its command in a word; 0 before
        /// the first.
        pub action_before: u32,
        /// The action of the step before that, likewise.
        pub action_earlier: u32,
        /// The action of three steps before, likewise.
        pub action_earliest: u32,
    }

    /// What is asked of a truck for a step where a benchmark's actions are continuous: each in -1..=1.
    pub struct Command {
        /// Steer angle over the lock, left positive.
        pub steering: f32,
        /// Where the target speed, or its change, lies from the benchmark's lowest, at -1, to its highest.
        pub speed: f32,
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

    /// Where a truck was at the end of a step.
    pub struct Pose {
        /// Middle of the drive axle (m).
        pub position: Vec2,
        /// Heading of the tractor (rad).
        pub heading: f32,
        /// Heading of the trailer (rad).
        pub trailer_heading: f32,
        /// Speed of the drive axle along the tractor's heading (m/s).
        pub speed: f32,
        /// Index of the next waypoint to pass on the route.
        pub waypoint: u32,
    }

    /// How a truck begins its route: fractions of the largest start errors and of half the range of speeds, each in
    /// -1..=1, its vehicle, and where along the route. Zeros are the first vehicle on the lane centre at the first
    /// waypoint and the middle of the speeds.
    ///
    /// Beyond the first waypoint both units stand as if the truck had followed the lane to there, with the wheels and
    /// the lean that the bend asks for; the errors move and turn it as a whole. The clock begins: the episode has the
    /// whole route's time. The start itself is not judged: a truck that touches a kerb there ends with its first step.
    pub struct Start {
        /// Fraction of the largest lateral offset, left positive.
        pub offset: f32,
        /// Fraction of the largest heading error, counter-clockwise positive.
        pub heading: f32,
        /// Fraction of half the range of speeds, from its middle.
        pub speed: f32,
        /// Fraction of the route that lies behind, in 0..=1: the truck begins at the nearest waypoint, the last but one
        /// at most.
        pub along: f32,
        /// Index of the vehicle in the world.
        pub vehicle: u32,
    }

    /// The stream of random numbers that all of a truck's are from: routes, starts, loads, disturbances, vehicles,
    /// random actions. A truck with the stream (seed, env) drives as truck `env` of a batch with that seed.
    pub struct Stream {
        /// Seed.
        pub seed: u32,
        /// Index of a truck in a batch of that seed.
        pub env: u32,
    }

    /// What the caller asks of a truck: whether and how it begins an episode.
    pub struct BeginRow {
        /// Start of the episode, where [`crate::layout::HAS_START`] is set.
        pub start: Start,
        /// Index of the episode's route in the world, where [`crate::layout::HAS_ROUTE`] is set.
        pub route: u32,
        /// Bits: [`crate::layout::BEGINS`], [`crate::layout::IS_FIRST`], [`crate::layout::HAS_ROUTE`],
        /// [`crate::layout::HAS_START`], [`crate::layout::IS_CENTRED`].
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
}
