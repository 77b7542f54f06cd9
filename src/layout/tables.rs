//! What trucks share: vehicles, actions, time and weights, routes and fields.

use glam::Vec2;

use super::{N_PREVIEW, N_RAYS};

crate::shared! {
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
        /// Increase of each unit's slip with its load transfer ratio: slip times `1 + slip_growth |ratio|`.
        pub slip_growth: f32,
        /// Understeer: increase of the steer angle that a path needs, per lateral acceleration (rad/(m/s^2)).
        pub understeer: f32,
        /// Fraction of the load on the tractor's axles that the trailer puts on the fifth wheel: by it the trailer's
        /// load transfer ratio counts in the tractor's.
        pub fifth_wheel_load: f32,
    }

    /// The vehicle with its distance sensors, as a device has them side by side.
    pub struct VehicleRow {
        /// The distance sensors, trailer's first.
        pub rays: [Ray; N_RAYS],
        /// The vehicle.
        pub rig: Rig,
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
        /// Reward for each metre that the trailer is on an apron, each step.
        pub apron: f32,
    }

    /// What the world does to a policy, by the keys of a benchmark's `[disturbances]`. Zeros are nothing.
    pub struct Disturbances {
        /// Standard deviation of a distance sensor, each step (m).
        pub range_noise: f32,
        /// Fraction of the rays that find nothing, each step.
        pub dropped_rays: f32,
        /// Largest error of the position in either direction, constant in an episode (m).
        pub position_offset: f32,
        /// Largest error of the headings, constant in an episode (rad).
        pub heading_offset: f32,
        /// Standard deviation of the position in either direction, each step (m).
        pub position_noise: f32,
        /// Standard deviation of each unit's heading, each step (rad).
        pub heading_noise: f32,
        /// Largest error of the route's place in either direction, constant in an episode (m).
        pub map_offset: f32,
        /// Least age of what is observed (steps).
        pub observation_delay: u32,
        /// Number of ages from there on that are drawn from.
        pub n_observation_delays: u32,
        /// Least number of steps by which an action comes late.
        pub action_delay: u32,
        /// Number of such delays from there on that are drawn from.
        pub n_action_delays: u32,
        /// Whether what is observed differs from what is (0 or 1).
        pub of_observation: u32,
        /// Whether actions come late (0 or 1).
        pub of_action: u32,
    }

    /// Time and limits, shared by all trucks.
    pub struct Params {
        /// Time of one sub-step (s).
        pub substep: f32,
        /// Sub-steps in a step.
        pub n_substeps: u32,
        /// Entries of the action table; 0 where actions are continuous, whose table is the ends of their ranges.
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
        /// Largest fraction of the route that lies behind at a drawn start.
        pub start_along: f32,
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

    /// One roundabout's field among the cells and blocks of all fields.
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
        /// Trucks whose rays a workgroup shares.
        pub team: u32,
        /// Neighbouring trucks that share a road and its vehicles.
        pub group: u32,
    }
}
