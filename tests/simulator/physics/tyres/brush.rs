//! A tractor and its semitrailer on brush tyres, in f64 with RK4.
//!
//! Two rigid bodies in the plane, joined at the fifth wheel, by Kane's equations with the speed of the drive axle
//! given. Each axle has a tyre, or a pair, on either side. A tyre's cornering coefficient falls with its load, so a
//! pair loses stiffness as load moves from one side to the other, and its force saturates at its friction (brush model
//! of E. Fiala, 1954). Numbers are a generic truck tyre's: at rest they give the slip of the vehicle files.

use glam::DVec2;
use offtrack::vehicle::{GRAVITY, Vehicle};

/// Step of the integration (s).
const STEP: f64 = 5e-3;
/// Friction of a tyre.
const FRICTION: f64 = 0.75;
/// Cornering coefficient of a tyre without load (1/rad).
const COEFFICIENT: f64 = 7.7;

/// The tyres on a side of an axle.
#[derive(Clone, Copy)]
pub struct Tyres {
    /// How many.
    n: f64,
    /// Load at which one's cornering coefficient is half of what it is without (N).
    half_load: f64,
}

/// A wide one on either side.
pub const WIDE: Tyres = Tyres { n: 1.0, half_load: 58e3 };
/// A pair on either side.
pub const DUAL: Tyres = Tyres { n: 2.0, half_load: 44e3 };

/// An axle: where it is, what rests on it, and its tyres.
#[derive(Clone, Copy)]
struct Axle {
    /// Distance from the unit's origin: ahead of the drive axle, or behind the kingpin (m).
    at: f64,
    /// Weight on it (N).
    load: f64,
    tyres: Tyres,
}

impl Axle {
    /// Side force at a slip (tangent of the slip angle) and a load transfer ratio (N).
    fn force(&self, slip: f64, ratio: f64) -> f64 {
        [1.0 + ratio, 1.0 - ratio].into_iter().map(|part| self.side(slip, part.clamp(0.0, 2.0))).sum()
    }

    fn side(&self, slip: f64, part: f64) -> f64 {
        let load = 0.5 * self.load * part;
        if load == 0.0 {
            return 0.0;
        }
        let stiffness = COEFFICIENT * load / (1.0 + (load / self.tyres.n / self.tyres.half_load).powi(2));
        let limit = FRICTION * load;
        let slope = stiffness * slip.abs() / limit;
        let force = if slope < 3.0 { limit * (slope - slope * slope / 3.0 + slope.powi(3) / 27.0) } else { limit };
        -force * slip.signum()
    }
}

/// A unit as a body.
struct Unit {
    /// Mass (kg).
    mass: f64,
    /// Yaw inertia (kg m^2).
    inertia: f64,
    /// Its centre of gravity, measured as its axles are (m).
    centre: f64,
    /// Lateral acceleration at which its inner wheels lift (m/s^2).
    threshold: f64,
}

/// A truck.
pub struct Brush {
    tractor: Unit,
    trailer: Unit,
    /// From the drive axle ahead: front axle and fifth wheel (m).
    wheelbase: f64,
    hitch: f64,
    front: Axle,
    drive: Axle,
    /// Those of the trailer.
    axles: Vec<Axle>,
    /// Fraction of the load on the tractor's axles that is the trailer's.
    on_hitch: f64,
}

/// Side speed of the drive axle (m/s), yaw rates of tractor and trailer (rad/s), articulation (rad), load transfer
/// ratios of both, steer angle (rad).
type State = [f64; 7];

impl Brush {
    /// The truck of a vehicle's file, whose centre of gravity lies `ahead` of the middle of its trailer's axles, which
    /// are so far behind the kingpin (m). A tractor alone has 65 % of its weight on its front axle.
    pub fn of(vehicle: &Vehicle, load: &str, ahead: f64, axles: &[f64], tyres: Tyres) -> Brush {
        let (load, tractor, trailer) = (&vehicle.loads[load], &vehicle.tractor, &vehicle.trailer);
        let middle = axles.iter().sum::<f64>() / axles.len() as f64;
        let on_hitch = load.mass * ahead / middle;
        let centre = 0.65 * tractor.wheelbase;
        let front = (tractor.mass * centre + on_hitch * tractor.fifth_wheel) / tractor.wheelbase;
        let length = trailer.kingpin_to_front + trailer.kingpin_to_rear;
        let axle = |at: f64, mass: f64, tyres: Tyres| Axle { at, load: GRAVITY * mass, tyres };
        Brush {
            tractor: Unit {
                mass: tractor.mass,
                inertia: tractor.mass * (0.5 * tractor.wheelbase).powi(2),
                centre,
                threshold: GRAVITY * tractor.suspension.rollover_threshold(),
            },
            trailer: Unit {
                mass: load.mass,
                inertia: load.mass * length * length / 12.0,
                centre: middle - ahead,
                threshold: GRAVITY * load.suspension.rollover_threshold(),
            },
            wheelbase: tractor.wheelbase,
            hitch: tractor.fifth_wheel,
            front: axle(tractor.wheelbase, front, WIDE),
            drive: axle(0.0, tractor.mass + on_hitch - front, DUAL),
            axles: axles.iter().map(|&at| axle(at, (load.mass - on_hitch) / axles.len() as f64, tyres)).collect(),
            on_hitch: on_hitch / (tractor.mass + on_hitch),
        }
    }

    /// Fraction of the trailer's mass on the fifth wheel.
    pub fn fifth_wheel_load(&self) -> f64 {
        let carried = self.tractor.mass * self.on_hitch / (1.0 - self.on_hitch);
        carried / self.trailer.mass
    }

    /// What changes, per second, while the driver steers the front axle to a circle of this curvature (1/m).
    fn rates(&self, speed: f64, curvature: f64, state: &State) -> State {
        let [side, yaw, trailer_yaw, bent, ratio, trailer_ratio, steering] = *state;
        let (sin, cos) = bent.sin_cos();
        let (t, s, h) = (&self.tractor, &self.trailer, self.hitch);
        let hitch_side = side + h * yaw;
        let (ahead, across) = (speed * cos - hitch_side * sin, speed * sin + hitch_side * cos);
        // Forces: on the front axle across its wheels, on the others across their unit.
        let front_slip = ((side + self.wheelbase * yaw).atan2(speed) - steering).tan();
        let front = self.front.force(front_slip, ratio) * steering.cos();
        let shared = ratio + self.on_hitch * (trailer_ratio - ratio);
        let drive = self.drive.force(side / speed, shared);
        let mut sum = 0.0;
        let mut moment = 0.0;
        for axle in &self.axles {
            let force = axle.force((across - axle.at * trailer_yaw) / ahead, trailer_ratio);
            sum += force;
            moment -= axle.at * force;
        }
        // What there is of acceleration without any change of the speeds: turned frames.
        let fixed = (-yaw * hitch_side, speed * yaw);
        let fixed =
            (fixed.0 * cos - fixed.1 * sin + s.centre * trailer_yaw * trailer_yaw, fixed.0 * sin + fixed.1 * cos);
        let along_across = -fixed.0 * sin + fixed.1 * cos;
        // Unknown: rates of side speed, yaw rate, trailer's yaw rate.
        let rows = [
            [
                t.mass + s.mass,
                t.mass * t.centre + s.mass * h,
                -s.mass * s.centre * cos,
                front + drive + sum * cos - t.mass * speed * yaw - s.mass * along_across,
            ],
            [
                t.mass * t.centre + s.mass * h,
                t.mass * t.centre * t.centre + t.inertia + s.mass * h * h,
                -s.mass * s.centre * h * cos,
                front * self.wheelbase + h * sum * cos - t.mass * t.centre * speed * yaw - s.mass * h * along_across,
            ],
            [
                -s.mass * s.centre * cos,
                -s.mass * s.centre * h * cos,
                s.mass * s.centre * s.centre + s.inertia,
                moment + s.mass * s.centre * fixed.1,
            ],
        ];
        let [side_rate, yaw_rate, trailer_yaw_rate] = solved(rows);
        // Roll follows within a third of a second: how it does is no matter of a steady turn.
        let own = speed * yaw + side_rate + t.centre * yaw_rate;
        let trailers = fixed.1 + cos * (side_rate + h * yaw_rate) - s.centre * trailer_yaw_rate;
        let front_speed = speed.hypot(side + self.wheelbase * yaw);
        [
            side_rate,
            yaw_rate,
            trailer_yaw_rate,
            yaw - trailer_yaw,
            3.0 * (own / t.threshold - ratio),
            3.0 * (trailers / s.threshold - trailer_ratio),
            // The driver turns the wheel until the front axle is on its circle.
            0.5 * speed.min(8.0) * self.wheelbase * (curvature - yaw / front_speed),
        ]
    }

    /// Off-tracking in the steady turn with the front axle on a circle of `radius` (m), from straight ahead at a speed
    /// (m/s); `None` where the truck does not hold it: it slides, bends, or lifts a wheel.
    pub fn off_tracking(&self, speed: f64, radius: f64) -> Option<f64> {
        let mut state: State = [0.0; 7];
        let n_steps = ((150.0 / speed + 12.0) / STEP) as usize;
        let mut bending = 0.0f64;
        for step in 0..n_steps {
            // Over 30 m into the turn.
            let curvature = (step as f64 * STEP * speed / 30.0).min(1.0) / radius;
            let first = self.rates(speed, curvature, &state);
            let second = self.rates(speed, curvature, &plus(&state, &first, 0.5 * STEP));
            let third = self.rates(speed, curvature, &plus(&state, &second, 0.5 * STEP));
            let last = self.rates(speed, curvature, &plus(&state, &third, STEP));
            let mean = std::array::from_fn(|n| (first[n] + 2.0 * second[n] + 2.0 * third[n] + last[n]) / 6.0);
            state = plus(&state, &mean, STEP);
            let is_held = state[3].abs() < 1.3 && state[5].abs() < 1.0 && state[6].abs() < 0.7;
            if !is_held {
                return None;
            }
            if n_steps < step + (2.0 / STEP) as usize {
                bending = bending.max(mean[3].abs());
            }
        }
        let [side, yaw, trailer_yaw, bent, ..] = state;
        let front = DVec2::new(speed, side + self.wheelbase * yaw).length() / yaw;
        let middle = self.axles.iter().map(|axle| axle.at).sum::<f64>() / self.axles.len() as f64;
        let hitch = DVec2::from_angle(bent).rotate(DVec2::new(speed, side + self.hitch * yaw));
        let trailer = (hitch - DVec2::new(0.0, middle * trailer_yaw)).length() / trailer_yaw;
        let is_steady = (front / radius - 1.0).abs() < 0.005 && bending < 0.01;
        is_steady.then_some(front - trailer)
    }
}

/// Gauss elimination of three equations, the right-hand sides in the last column; the mass matrix needs no pivots.
fn solved(mut rows: [[f64; 4]; 3]) -> [f64; 3] {
    for column in 0..3 {
        for row in 0..3 {
            if row != column {
                let factor = rows[row][column] / rows[column][column];
                let pivot = rows[column];
                rows[row].iter_mut().zip(pivot).for_each(|(value, other)| *value -= factor * other);
            }
        }
    }
    std::array::from_fn(|index| rows[index][3] / rows[index][index])
}

fn plus(state: &State, rates: &State, duration: f64) -> State {
    std::array::from_fn(|index| state[index] + duration * rates[index])
}
