//! A truck driven open loop by the simulator's own [`drive`](offtrack::physics), for comparison with reference
//! trajectories.
//!
//! `tests/data/physics_vectors.json` holds such cases. A state between two instants of the sub-step grid is computed on
//! a copy, from the grid instant before it, so that a request for a state never changes later ones.

mod case;

use glam::Vec2;
use offtrack::layout::angle::wrapped;
use offtrack::layout::{Action, Control, Rig, Truck};
use offtrack::physics::controlled;
use offtrack::physics::{Moving, load_transfer_ratio, motion_of, moved};
use serde::Serialize;

pub use case::{Case, CaseVehicle, Command, Error, Init, Instant};

/// Instants closer together than this are the same (s).
const SAME_INSTANT: f64 = 1e-7;

/// The result of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Traced {
    /// The case's name.
    pub id: String,
    /// The truck at the requested instants.
    pub states: Vec<State>,
    /// Largest magnitudes over all sub-steps; `None` if the truck jackknifed, because they mean nothing after that.
    pub peak: Option<Peak>,
    /// Time at which the articulation passed its limit, interpolated within the sub-step (s).
    pub t_jackknife: Option<f64>,
}

/// The truck at an instant. Headings are unwrapped: they continue from the case's initial headings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct State {
    /// Time (s).
    pub t: f64,
    /// Middle of the drive axle (m).
    pub x: f64,
    /// Middle of the drive axle (m).
    pub y: f64,
    /// Tractor's heading (rad).
    pub psi1: f64,
    /// Trailer's heading (rad).
    pub psi2: f64,
    /// Articulation, `psi1 - psi2` (rad).
    pub gamma: f64,
    /// Speed (m/s).
    pub v: f64,
    /// Steer angle (rad).
    pub delta: f64,
    /// Fifth wheel (m).
    pub hitch: [f64; 2],
    /// Middle of the trailer's axle group (m).
    pub trailer_axle: [f64; 2],
    /// Lateral acceleration of the tractor (m/s^2).
    pub ay1: f64,
    /// Lateral acceleration of the trailer (m/s^2).
    pub ay2: f64,
    /// Quasi-static load transfer ratio of the tractor.
    pub ltr1_qs: f64,
    /// Quasi-static load transfer ratio of the trailer.
    pub ltr2_qs: f64,
    /// Load transfer ratio of the trailer.
    pub ltr2_dyn: f64,
}

/// Largest magnitudes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Peak {
    /// Lateral acceleration of the tractor (m/s^2).
    pub ay1: f64,
    /// Lateral acceleration of the trailer (m/s^2).
    pub ay2: f64,
    /// Quasi-static load transfer ratio of the tractor.
    pub ltr1_qs: f64,
    /// Quasi-static load transfer ratio of the trailer.
    pub ltr2_qs: f64,
    /// Load transfer ratio of the tractor.
    pub ltr1_dyn: f64,
    /// Load transfer ratio of the trailer.
    pub ltr2_dyn: f64,
    /// Articulation (rad).
    pub gamma: f64,
}

/// Drives a case with the simulator's own equations.
///
/// # Errors
///
/// The first value of the case that makes no sense.
pub fn trace(case: &Case) -> Result<Traced, Error> {
    trace_by(case, moved)
}

/// Drives a case with the caller's replacement for [`moved`]. Its arguments are the rig, the length of the sub-step
/// (s), the control and the truck.
///
/// # Errors
///
/// The first value of the case that makes no sense.
pub fn trace_by(case: &Case, mut moved: impl FnMut(&Rig, f32, &Control, &Moving) -> Moving) -> Result<Traced, Error> {
    let times = case.checked_times()?;
    let mut pending = times.iter().copied().peekable();
    let mut run = Run::new(case);
    let mut traced =
        Traced { id: case.id.clone(), states: Vec::with_capacity(times.len()), peak: None, t_jackknife: None };
    let mut peak = Peak::default();
    loop {
        let here = run.state();
        peak = peak.grown(&here, run.tractor_ratio());
        let next = run.next_instant();
        // At the end every remaining request is answered by the last instant.
        let until = next.unwrap_or(f64::INFINITY);
        while let Some(t) = pending.next_if(|&t| t < until - SAME_INSTANT) {
            traced.states.push(if t - run.t <= SAME_INSTANT {
                State { t, ..here }
            } else {
                run.after(t, &mut moved).state()
            });
        }
        let Some(next) = next else { break };
        run = run.after(next, &mut moved);
        let (before, after) = (here.gamma.abs(), run.state().gamma.abs());
        if traced.t_jackknife.is_none() && case.vehicle.gamma_max < after {
            traced.t_jackknife =
                Some(here.t + (run.t - here.t) * ((case.vehicle.gamma_max - before) / (after - before)).max(0.0));
        }
    }
    traced.peak = traced.t_jackknife.is_none().then_some(peak);
    Ok(traced)
}

/// A case in progress.
#[derive(Clone)]
struct Run<'a> {
    case: &'a Case,
    /// Current time (s).
    t: f64,
    /// Index of the last sub-step of the grid that has begun.
    grid: u32,
    moving: Moving,
    /// What the speed control asked for last, and when it decides next (s).
    asked: Control,
    decides: f64,
    /// Unwrapped headings, in addition to the truck's wrapped ones (rad).
    psi1: f64,
    psi2: f64,
}

impl Run<'_> {
    fn new(case: &Case) -> Run<'_> {
        let init = &case.init;
        let truck = Truck {
            // From where it begins: so far from the origin as a case may be, single precision would lose its way.
            position: Vec2::ZERO,
            heading: wrapped(init.psi1 as f32),
            trailer_heading: wrapped(init.psi2 as f32),
            speed: init.v as f32,
            steering: init.delta as f32,
            ..Truck::default()
        };
        let motion = motion_of(&case.vehicle.rig(case.dt), &truck);
        let asked = Control::default();
        Run {
            case,
            t: 0.0,
            grid: 0,
            asked,
            decides: 0.0,
            moving: Moving { truck, motion },
            psi1: init.psi1,
            psi2: init.psi2,
        }
    }

    /// The end of the next sub-step: the grid's next instant, or a command or the case's end before it. `None` at the
    /// end.
    fn next_instant(&self) -> Option<f64> {
        let later = |&t: &f64| self.t + SAME_INSTANT < t;
        let grid = f64::from(self.grid + 1) * self.case.dt;
        let delay = self.case.vehicle.delta_delay;
        let of_commands = self.case.commands.iter().flat_map(|command| [command.t, command.t + delay]);
        let controls = self.case.commands.iter().any(|command| command.v_cmd.is_some());
        let instants = of_commands.chain(controls.then_some(self.decides)).filter(later);
        Some(instants.fold(grid, f64::min).min(self.case.t_end)).filter(later)
    }

    /// The run at `t`, at most a sub-step from now.
    fn after(&self, t: f64, moved: &mut impl FnMut(&Rig, f32, &Control, &Moving) -> Moving) -> Self {
        let in_force = |since: f64| self.case.commands.iter().rfind(|command| command.t <= since + SAME_INSTANT);
        // Before the first command the steer angle and the speed stay as they are.
        let steering = in_force(self.t - self.case.vehicle.delta_delay)
            .map_or(self.moving.truck.steering, |command| command.delta_cmd as f32);
        let command = in_force(self.t);
        let (mut asked, mut decides) = (self.asked, self.decides);
        if decides <= self.t + SAME_INSTANT {
            decides += self.case.control_step;
            if let Some(speed) = command.and_then(|command| command.v_cmd) {
                let (action, step) = (Action { steering: 0.0, speed: speed as f32 }, self.case.control_step as f32);
                asked = controlled(
                    &self.case.vehicle.rig(self.case.dt),
                    step,
                    &action,
                    self.moving.truck.speed,
                    &self.asked,
                );
            }
        }
        let control = match command {
            Some(Command { v_cmd: Some(_), .. }) => Control { steering, ..asked },
            command => Control {
                steering,
                acceleration: command.map_or(0.0, |command| command.a_cmd as f32),
                ..Control::default()
            },
        };
        let duration = t - self.t;
        // A whole sub-step uses the simulator's own `dt`, not a difference of instants, which would round differently.
        let duration = if (duration - self.case.dt).abs() < SAME_INSTANT { self.case.dt } else { duration };
        let moving = moved(&self.case.vehicle.rig(duration), duration as f32, &control, &self.moving);
        let turned = |after: f32, before: f32| f64::from(wrapped(after - before));
        Run {
            t,
            grid: ((t + SAME_INSTANT) / self.case.dt) as u32,
            psi1: self.psi1 + turned(moving.truck.heading, self.moving.truck.heading),
            psi2: self.psi2 + turned(moving.truck.trailer_heading, self.moving.truck.trailer_heading),
            moving,
            asked,
            decides,
            ..*self
        }
    }

    fn state(&self) -> State {
        let Moving { truck, motion } = &self.moving;
        let vehicle = &self.case.vehicle;
        let Init { x, y, .. } = self.case.init;
        let (x, y) = (x + f64::from(truck.position.x), y + f64::from(truck.position.y));
        let hitch = [x + vehicle.a * self.psi1.cos(), y + vehicle.a * self.psi1.sin()];
        let (ay1, ay2) = (f64::from(motion.lateral_acceleration), f64::from(motion.trailer_lateral_acceleration));
        State {
            t: self.t,
            x,
            y,
            psi1: self.psi1,
            psi2: self.psi2,
            gamma: self.psi1 - self.psi2,
            v: truck.speed.into(),
            delta: truck.steering.into(),
            hitch,
            trailer_axle: [hitch[0] - vehicle.L2 * self.psi2.cos(), hitch[1] - vehicle.L2 * self.psi2.sin()],
            ay1,
            ay2,
            ltr1_qs: vehicle.leaning_on(
                vehicle.tractor_suspension().quasi_static_load_transfer_ratio(ay1),
                vehicle.trailer_suspension().quasi_static_load_transfer_ratio(ay2),
            ),
            ltr2_qs: vehicle.trailer_suspension().quasi_static_load_transfer_ratio(ay2),
            ltr2_dyn: self.trailer_ratio(),
        }
    }

    /// Lateral acceleration that the road's fall adds (m/s^2).
    fn fall(&self) -> f32 {
        self.case.vehicle.rig(self.case.dt).crossfall
    }

    fn tractor_ratio(&self) -> f64 {
        let Moving { truck, motion } = &self.moving;
        let roll = self.case.vehicle.tractor_suspension().roll(self.case.dt);
        let leaning = Vec2::new(truck.tractor_roll, truck.tractor_roll_rate);
        let own = load_transfer_ratio(&roll, leaning, motion.lateral_acceleration + self.fall());
        self.case.vehicle.leaning_on(own.into(), self.trailer_ratio())
    }

    fn trailer_ratio(&self) -> f64 {
        let Moving { truck, motion } = &self.moving;
        let roll = self.case.vehicle.trailer_suspension().roll(self.case.dt);
        let leaning = Vec2::new(truck.trailer_roll, truck.trailer_roll_rate);
        load_transfer_ratio(&roll, leaning, motion.trailer_lateral_acceleration + self.fall()).into()
    }
}

impl Peak {
    fn grown(&self, state: &State, tractor_ratio: f64) -> Peak {
        Peak {
            ay1: self.ay1.max(state.ay1.abs()),
            ay2: self.ay2.max(state.ay2.abs()),
            ltr1_qs: self.ltr1_qs.max(state.ltr1_qs.abs()),
            ltr2_qs: self.ltr2_qs.max(state.ltr2_qs.abs()),
            ltr1_dyn: self.ltr1_dyn.max(tractor_ratio.abs()),
            ltr2_dyn: self.ltr2_dyn.max(state.ltr2_dyn.abs()),
            gamma: self.gamma.max(state.gamma.abs()),
        }
    }
}
