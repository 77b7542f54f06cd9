//! A truck that something else drives: what it observes on a route of a world, whether it touches a kerb, how far along
//! the route it is, and whether its episode has ended.
//!
//! Another simulator or a real truck says where it is, in the frame of the map that the road is from; nothing here
//! moves it. All that is observed is computed by the CPU engine's own functions, so it is the simulator's to the last
//! bit.
//!
//! ```
//! use std::sync::Arc;
//!
//! use glam::DVec2;
//! use offtrack::layout::Ended;
//! use offtrack::observer::{Observer, Pose, Telemetry};
//! use offtrack::scenario::Scenario;
//! use offtrack::world::World;
//!
//! let world = Arc::new(World::bake(&Scenario::named("attard2023")?)?);
//! let mut observer = Observer::new(world, 0, 0)?;
//! let (start, heading) = observer.waypoints().next().ok_or("a route has waypoints")?;
//! // The middle of the wheelbase stands on the first waypoint.
//! let position = start - 0.5 * f64::from(observer.rig().wheelbase) * DVec2::from_angle(heading);
//! let pose = Pose { position, heading, trailer_heading: heading, speed: 8.0 };
//! let seen = observer.begin(&pose)?;
//! assert!(seen.ended == Ended::Running && seen.progress.lane_distance < 0.01);
//! let telemetry = Telemetry { target_speed: 8.3, ..Telemetry::default() };
//! let seen = observer.observe(&pose, &telemetry)?; // a step later: `seen.values` are for a policy
//! # assert_eq!(seen.progress.passed, 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod checked; // poses and telemetry from outside
mod place; // where on a route a pose is

use std::sync::Arc;

use glam::DVec2;

use crate::engine::Error;
use crate::engine::cpu::collide::clearance_of;
use crate::engine::cpu::follow::{followed, reference_point};
use crate::engine::cpu::judge::ending;
use crate::engine::cpu::observe::{extras, observed};
use crate::engine::cpu::sense::ranges_of;
use crate::engine::cpu::steer::{commanded, controlled, targeted};
use crate::engine::limits::check_command;
use crate::layout::{Action, Clearance, Command, Control, Ended, N_EXTRAS, N_VALUES, Progress, Rig, Truck};
use crate::map::Frame;
use crate::world::World;
use place::next_waypoint;

/// Where a truck is, in the frame of the map that its road is from: x east, y north, angles counter-clockwise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose {
    /// Middle of the drive axle (m).
    pub position: DVec2,
    /// Heading of the tractor; any number of turns (rad).
    pub heading: f64,
    /// Heading of the trailer; any number of turns (rad).
    pub trailer_heading: f64,
    /// Speed of the drive axle along the tractor's heading, negative in reverse (m/s).
    pub speed: f32,
}

/// What a truck's electronics know beside its pose, left and right as on the map. Only the extras and the rollover are
/// computed from it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Telemetry {
    /// Steer angle of the front axle, left positive (rad).
    pub steering: f32,
    /// Target speed (m/s).
    pub target_speed: f32,
    /// Acceleration along the tractor's heading (m/s^2).
    pub acceleration: f32,
    /// Lateral acceleration of the trailer's axle group, to the left (m/s^2).
    pub lateral_acceleration: f32,
    /// Roll angle of the trailer, to the right (rad).
    pub trailer_roll: f32,
    /// Roll rate of the trailer (rad/s).
    pub trailer_roll_rate: f32,
    /// Load transfer ratios of tractor and trailer, to the right, the largest since the last observation.
    pub load_transfer_ratios: [f32; 2],
}

/// What is observed of a truck.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observed {
    /// What a policy observes, see [`OBSERVATION`](crate::layout::OBSERVATION). Left and right are those of the driven
    /// frame: exchanged on a left-hand road.
    pub values: [f32; N_VALUES],
    /// The extras of the world's benchmark, see [`EXTRAS`](crate::layout::EXTRAS); zeros behind them.
    pub extras: [f32; N_EXTRAS],
    /// How far along the route the truck is.
    pub progress: Progress,
    /// How near each unit is to a kerb.
    pub clearance: Clearance,
    /// Whether and why the episode has ended. The first end stands until another episode begins.
    pub ended: Ended,
}

/// A truck of a world that something else drives.
#[derive(Debug, Clone)]
pub struct Observer {
    world: Arc<World>,
    frame: Frame,
    route: u32,
    vehicle: u32,
    state: State,
}

/// How far an observer has come in its episode: with it another one of the same truck goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Observations of this episode after its first.
    pub steps: u32,
    /// Index of the next waypoint to pass; none before the first pose.
    pub waypoint: Option<u32>,
    /// Whether and why the episode has ended.
    pub ended: Ended,
    /// Integral of the speed control's error (m).
    pub speed_error_integral: f32,
}

impl State {
    /// That of an observer which has seen nothing.
    const NEW: State = State { steps: 0, waypoint: None, ended: Ended::Running, speed_error_integral: 0.0 };
}

impl Observer {
    /// A truck on a route of the world, which is one of the world's vehicles; both as indices into the world's tables.
    /// [`Scenario::typical`](crate::scenario::Scenario::typical) gives a world whose vehicles are as their files have
    /// them.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownRoute`] and [`Error::UnknownVehicle`].
    pub fn new(world: Arc<World>, route: u32, vehicle: u32) -> Result<Observer, Error> {
        let (n_routes, n_vehicles) = (world.routes.len(), world.rigs.len());
        if n_routes <= route as usize {
            return Err(Error::UnknownRoute { route, n_routes });
        }
        if n_vehicles <= vehicle as usize {
            return Err(Error::UnknownVehicle { vehicle, n_vehicles });
        }
        let frame = world.frame(route);
        Ok(Observer { world, frame, route, vehicle, state: State::NEW })
    }

    /// Begins an episode at any place along the route, with the wheels straight and the truck's speed as its target, as
    /// the simulator begins one: the clock begins, what lies behind counts as passed, and the start is not judged.
    /// Where a truck stands exactly at a waypoint, rounding decides whether that or the one after it is the next.
    ///
    /// A route may pass a place twice, such as one that leads round a ring and back: then the nearer lane is taken, and
    /// [`begin_near`](Observer::begin_near) says which is meant.
    ///
    /// # Errors
    ///
    /// [`Error::ImpossibleValue`] for a number that no pose can have; the observer is then as it was.
    pub fn begin(&mut self, pose: &Pose) -> Result<Observed, Error> {
        self.begin_by(pose, None)
    }

    /// The same where it is known near which waypoint the truck is, by its index along the route: such as the one that
    /// was the next of an episode that goes on. The next one is looked for from 16 waypoints before it to 16 behind it;
    /// a truck that is elsewhere has strayed at its next observation.
    ///
    /// # Errors
    ///
    /// Those of [`begin`](Observer::begin), and [`Error::OutsideWorld`] for a waypoint that the route does not have.
    pub fn begin_near(&mut self, pose: &Pose, waypoint: u32) -> Result<Observed, Error> {
        self.check_waypoint(waypoint)?;
        self.begin_by(pose, Some(waypoint))
    }

    /// Whether the route has this waypoint, or one before it.
    ///
    /// # Errors
    ///
    /// [`Error::OutsideWorld`] if not.
    pub fn check_waypoint(&self, waypoint: u32) -> Result<(), Error> {
        checked::waypoint(waypoint, self.world.routes[self.route as usize].n_waypoints)
    }

    fn begin_by(&mut self, pose: &Pose, known: Option<u32>) -> Result<Observed, Error> {
        let telemetry = Telemetry { target_speed: pose.speed, ..Telemetry::default() };
        let truck = self.placed(pose, &telemetry, 0)?;
        self.state = State::NEW;
        Ok(self.seen(&truck, telemetry.target_speed, known))
    }

    /// The truck a step of the world later. The first pose of an observer begins an episode where it is. Allocates
    /// nothing.
    ///
    /// # Errors
    ///
    /// [`Error::ImpossibleValue`] for a number that no truck can have; the observer is then as it was.
    pub fn observe(&mut self, pose: &Pose, telemetry: &Telemetry) -> Result<Observed, Error> {
        let steps = if self.state.waypoint.is_some() { self.state.steps.saturating_add(1) } else { 0 };
        let truck = self.placed(pose, telemetry, steps)?;
        Ok(self.seen(&truck, telemetry.target_speed, None))
    }

    /// Whether a truck can have these numbers.
    ///
    /// # Errors
    ///
    /// [`Error::ImpossibleValue`] for the first that no truck can have.
    pub fn check(&self, pose: &Pose, telemetry: &Telemetry) -> Result<(), Error> {
        checked::pose(&self.frame, pose)?;
        checked::telemetry(telemetry)
    }

    /// What an action asks for where the last target speed was `target_speed` (m/s): the steer angle on the map, left
    /// positive, and the next target speed.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownAction`], [`Error::NeedsCommands`] where actions are continuous, and [`Error::ImpossibleValue`]
    /// for a speed that no truck can have.
    pub fn command(&self, action: u32, target_speed: f32) -> Result<Action, Error> {
        if self.world.is_continuous() {
            return Err(Error::NeedsCommands);
        }
        let Some(asked) = self.world.actions.get(action as usize) else {
            return Err(Error::UnknownAction { env: 0, action, limit: self.world.params.n_actions });
        };
        self.targeted(asked, target_speed)
    }

    /// What a command asks for, where actions are continuous; as [`Observer::command`].
    ///
    /// # Errors
    ///
    /// [`Error::NeedsIndices`], [`Error::UnknownCommand`] and [`Error::ImpossibleValue`].
    pub fn commanded(&self, command: &Command, target_speed: f32) -> Result<Action, Error> {
        if !self.world.is_continuous() {
            return Err(Error::NeedsIndices);
        }
        check_command(0, command)?;
        let asked = commanded(&self.world.actions[0], &self.world.actions[1], command);
        self.targeted(&asked, target_speed)
    }

    /// What is asked for on the map where the last target speed was `target_speed` (m/s).
    fn targeted(&self, asked: &Action, target_speed: f32) -> Result<Action, Error> {
        checked::target(target_speed)?;
        let before = Control { target_speed, ..Control::default() };
        let Action { steering, speed } = targeted(&self.world.params, asked, &before);
        Ok(Action { steering: self.on_map(steering), speed })
    }

    /// The acceleration by which the simulator's speed control approaches a target from the present speed, both m/s, in
    /// the next step: for a truck that has pedals (m/s^2). It keeps an integral of the error until an episode begins,
    /// so it is asked once a step.
    ///
    /// # Errors
    ///
    /// [`Error::ImpossibleValue`] for a speed that no truck can have.
    pub fn speed_control(&mut self, speed: f32, target: f32) -> Result<f32, Error> {
        checked::speeds(speed, target)?;
        let action = Action { steering: 0.0, speed: target };
        let before = Control { speed_error_integral: self.state.speed_error_integral, ..Control::default() };
        let control = controlled(self.rig(), self.world.step(), &action, speed, &before);
        self.state.speed_error_integral = control.speed_error_integral;
        Ok(control.acceleration)
    }

    /// The world that it is observed in.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// The truck's dimensions and limits.
    pub fn rig(&self) -> &Rig {
        &self.world.rigs[self.vehicle as usize]
    }

    /// Index of the truck's route in the world.
    pub fn route(&self) -> u32 {
        self.route
    }

    /// How far it has come in its episode.
    pub fn state(&self) -> State {
        self.state
    }

    /// Goes on from the state of an observer of the same truck.
    ///
    /// # Errors
    ///
    /// [`Error::OutsideWorld`] for a waypoint that the route does not have, [`Error::ImpossibleValue`] for an integral
    /// that no controller has; the observer is then as it was.
    pub fn restore(&mut self, state: &State) -> Result<(), Error> {
        checked::state(state, self.world.routes[self.route as usize].n_waypoints)?;
        self.state = *state;
        Ok(())
    }

    /// Where the driven frame lies in the map.
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// The route's waypoints in the map's frame: position (m), and heading of the lane (rad).
    pub fn waypoints(&self) -> impl Iterator<Item = (DVec2, f64)> {
        let rows = self.world.route_waypoints(self.route).iter().zip(self.world.route_previews(self.route));
        rows.map(|(waypoint, preview)| {
            (self.frame.to_map(waypoint.position.as_dvec2()), self.frame.angle(preview.heading.into()))
        })
    }

    /// The truck at a pose, in the driven frame.
    fn placed(&self, pose: &Pose, telemetry: &Telemetry, steps: u32) -> Result<Truck, Error> {
        self.check(pose, telemetry)?;
        Ok(Truck {
            position: self.frame.to_driven(pose.position).as_vec2(),
            heading: checked::heading(self.frame.angle(pose.heading)),
            trailer_heading: checked::heading(self.frame.angle(pose.trailer_heading)),
            speed: pose.speed,
            steering: self.on_map(telemetry.steering),
            trailer_roll: self.on_map(telemetry.trailer_roll),
            trailer_roll_rate: self.on_map(telemetry.trailer_roll_rate),
            tractor_load_transfer_ratio: self.on_map(telemetry.load_transfer_ratios[0]),
            trailer_load_transfer_ratio: self.on_map(telemetry.load_transfer_ratios[1]),
            route: self.route,
            steps,
            acceleration: telemetry.acceleration,
            lateral_acceleration: self.on_map(telemetry.lateral_acceleration),
            vehicle: self.vehicle,
            ..Truck::default()
        })
    }

    /// A signed quantity of the driven frame on the map, or the other way round.
    fn on_map(&self, value: f32) -> f32 {
        self.frame.angle(value.into()) as f32
    }

    /// Observes and judges the truck, and goes on from there; where an episode begins, near a known waypoint.
    fn seen(&mut self, truck: &Truck, target_speed: f32, known: Option<u32>) -> Observed {
        let world = &*self.world;
        let params = &world.params;
        let (clearance, ranges) = (clearance_of(world, truck), ranges_of(world, truck));
        let waypoints = world.route_waypoints(truck.route);
        let point = reference_point(self.rig().wheelbase, truck);
        let next = self.state.waypoint.unwrap_or_else(|| next_waypoint(waypoints, point, truck.heading, known));
        let mut progress = followed(waypoints, point, next, params.stray_distance);
        let route = &world.routes[truck.route as usize];
        let ended = match self.state {
            State { waypoint: None, .. } => {
                progress.passed = 0;
                Ended::Running
            }
            State { ended: Ended::Running, .. } => {
                ending(params, route, world.step_limit(truck), truck, &clearance, &progress, None)
            }
            State { ended, .. } => ended,
        };
        let control = Control { target_speed, ..Control::default() };
        let (values, extras) = (observed(world, truck, &progress, &ranges), extras(world, truck, &control));
        self.state = State { steps: truck.steps, waypoint: Some(progress.waypoint), ended, ..self.state };
        Observed { values, extras, progress, clearance, ended }
    }
}
