//! A dynamic single track of a tractor and its semitrailer, in f64 with RK4.
//!
//! Newton and Euler for both units with the force in the hitch as an unknown; the hitch's acceleration is the same for
//! both. Tyre side force = cornering coefficient * axle load * slip angle.

use glam::DVec2;
use offtrack::vehicle::Vehicle;

/// Longest step (s).
const STEP: f64 = 2e-3;

/// A truck.
pub struct Reference {
    /// Masses (kg) and yaw inertias [kg m^2].
    mass: [f64; 2],
    inertia: [f64; 2],
    /// From the drive axle ahead: tractor's centre of gravity, front axle, hitch (m).
    centre: f64,
    pub wheelbase: f64,
    hitch: f64,
    /// From the kingpin back: trailer's centre of gravity, axle group (m).
    trailer_centre: f64,
    pub trailer_wheelbase: f64,
    /// Cornering stiffness of front, drive and trailer axles [N/rad].
    stiffness: [f64; 3],
}

/// The truck's motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    /// Middle of the drive axle (m).
    pub position: DVec2,
    pub heading: f64,
    pub trailer_heading: f64,
    /// Of the drive axle, to the left (m/s).
    pub side_speed: f64,
    pub yaw_rate: f64,
    pub trailer_yaw_rate: f64,
}

/// What changes, per second; and the lateral acceleration of the trailer's centre of gravity (m/s^2).
struct Rates {
    state: State,
    trailer_lateral_acceleration: f64,
}

impl Reference {
    pub fn of(vehicle: &Vehicle, load: &str) -> Reference {
        let load = &vehicle.loads[load];
        let (tractor, trailer) = (&vehicle.tractor, &vehicle.trailer);
        let mass = [tractor.mass, load.mass];
        // A solo tractor has 65 % on its front axle; a trailer's mass lies so that 30 % rest on the hitch.
        let (centre, trailer_centre) = (0.65 * tractor.wheelbase, 0.70 * trailer.wheelbase);
        let on_hitch = 0.30 * mass[1];
        let front = (mass[0] * centre + on_hitch * tractor.fifth_wheel) / tractor.wheelbase;
        let loads = [front, mass[0] + on_hitch - front, mass[1] - on_hitch];
        let length = trailer.kingpin_to_front + trailer.kingpin_to_rear;
        Reference {
            mass,
            inertia: [mass[0] * (0.5 * tractor.wheelbase).powi(2), mass[1] * length * length / 12.0],
            centre,
            wheelbase: tractor.wheelbase,
            hitch: tractor.fifth_wheel,
            trailer_centre,
            trailer_wheelbase: trailer.wheelbase,
            // K = 1 / (g CC), so that stiffness = CC * load * g = load / K.
            stiffness: loads.map(|axle| axle / load.slip),
        }
    }

    /// What a state with this speed of the drive axle and this steer angle turns into.
    fn rates(&self, state: &State, speed: f64, steering: f64) -> Rates {
        let State { side_speed, yaw_rate, trailer_yaw_rate, heading, trailer_heading, .. } = *state;
        let articulation = heading - trailer_heading;
        let at_hitch = DVec2::new(speed, side_speed + self.hitch * yaw_rate);
        let trailer = DVec2::from_angle(articulation).rotate(at_hitch);
        let axle_side = trailer.y - self.trailer_wheelbase * trailer_yaw_rate;
        let front = -self.stiffness[0] * ((side_speed + self.wheelbase * yaw_rate).atan2(speed) - steering);
        let drive = -self.stiffness[1] * side_speed.atan2(speed);
        let axle = -self.stiffness[2] * axle_side.atan2(trailer.x);
        let (sin, cos) = articulation.sin_cos();
        // Unknown: side acceleration of the drive axle, both yaw accelerations, force of the trailer on the tractor
        // along and across the tractor.
        let ([m1, m2], [i1, i2]) = (self.mass, self.inertia);
        let (c1, h, c2, l2) = (self.centre, self.hitch, self.trailer_centre, self.trailer_wheelbase);
        let front_side = front * steering.cos();
        let mut rows = [
            // Tractor, across: m (v' + c r' + u r).
            [m1, m1 * c1, 0.0, 0.0, -1.0, front_side + drive - m1 * speed * yaw_rate],
            // Tractor, about its centre.
            [0.0, i1, 0.0, 0.0, -(h - c1), front_side * (self.wheelbase - c1) - drive * c1],
            [0.0; 6],
            [0.0; 6],
            // Trailer, about its centre: its own axle, and the hitch's force on it, which is the opposite.
            [0.0, 0.0, i2, c2 * sin, c2 * cos, -axle * (l2 - c2)],
        ];
        // Acceleration of the hitch in the tractor's frame: (-r (v + h r), v' + h r' + u r); turned into the trailer's.
        let fixed = DVec2::from_angle(articulation).rotate(DVec2::new(-yaw_rate * at_hitch.y, speed * yaw_rate));
        // Of the trailer's centre: that, and (c r2², -c r2').
        rows[2] = [-m2 * sin, -m2 * sin * h, 0.0, cos, -sin, -m2 * (fixed.x + c2 * trailer_yaw_rate.powi(2))];
        rows[3] = [m2 * cos, m2 * cos * h, -m2 * c2, sin, cos, axle - m2 * fixed.y];
        let [side, yaw, trailer_yaw, along, across] = solved(rows);
        let force_across = -(sin * along + cos * across);
        Rates {
            state: State {
                position: DVec2::from_angle(heading).rotate(DVec2::new(speed, side_speed)),
                heading: yaw_rate,
                trailer_heading: trailer_yaw_rate,
                side_speed: side,
                yaw_rate: yaw,
                trailer_yaw_rate: trailer_yaw,
            },
            trailer_lateral_acceleration: (axle + force_across) / m2,
        }
    }

    /// The state after `duration` seconds with a steer angle that changes linearly, and the trailer's lateral
    /// acceleration there (m/s^2).
    pub fn driven(&self, mut state: State, speed: f64, from: f64, to: f64, duration: f64) -> (State, f64) {
        let n = (duration / STEP).ceil().max(1.0);
        let step = duration / n;
        for index in 0..n as usize {
            let steering = |fraction: f64| from + (to - from) * (index as f64 + fraction) / n;
            let first = self.rates(&state, speed, steering(0.0)).state;
            let second = self.rates(&state.plus(&first, 0.5 * step), speed, steering(0.5)).state;
            let third = self.rates(&state.plus(&second, 0.5 * step), speed, steering(0.5)).state;
            let last = self.rates(&state.plus(&third, step), speed, steering(1.0)).state;
            state = state
                .plus(&first, step / 6.0)
                .plus(&second, step / 3.0)
                .plus(&third, step / 3.0)
                .plus(&last, step / 6.0);
        }
        (state, self.rates(&state, speed, to).trailer_lateral_acceleration)
    }

    /// Off-tracking in the steady turn with the front axle on a circle of `radius` (m).
    pub fn off_tracking(&self, speed: f64, radius: f64) -> f64 {
        let (mut tight, mut wide) = (0.6, 0.01);
        let mut found = 0.0;
        for _ in 0..22 {
            let steering = 0.5 * (tight + wide);
            let (state, _) = self.driven(State::default(), speed, steering, steering, 60.0 / speed + 4.0);
            let front = DVec2::new(speed, state.side_speed + self.wheelbase * state.yaw_rate).length() / state.yaw_rate;
            found = front - self.trailer_velocity(&state, speed).length() / state.yaw_rate;
            if front < radius { tight = steering } else { wide = steering }
        }
        found
    }

    /// Velocity of the trailer's axle group in its frame (m/s).
    fn trailer_velocity(&self, state: &State, speed: f64) -> DVec2 {
        let at_hitch = DVec2::new(speed, state.side_speed + self.hitch * state.yaw_rate);
        DVec2::from_angle(state.heading - state.trailer_heading).rotate(at_hitch)
            - DVec2::new(0.0, self.trailer_wheelbase * state.trailer_yaw_rate)
    }

    /// Middle of the trailer's axle group (m).
    pub fn trailer_position(&self, state: &State) -> DVec2 {
        state.position + self.hitch * DVec2::from_angle(state.heading)
            - self.trailer_wheelbase * DVec2::from_angle(state.trailer_heading)
    }
}

impl State {
    fn plus(&self, rates: &State, duration: f64) -> State {
        State {
            position: self.position + duration * rates.position,
            heading: self.heading + duration * rates.heading,
            trailer_heading: self.trailer_heading + duration * rates.trailer_heading,
            side_speed: self.side_speed + duration * rates.side_speed,
            yaw_rate: self.yaw_rate + duration * rates.yaw_rate,
            trailer_yaw_rate: self.trailer_yaw_rate + duration * rates.trailer_yaw_rate,
        }
    }
}

/// Gauss elimination with pivots of five equations, the right-hand sides in the last column.
fn solved(mut rows: [[f64; 6]; 5]) -> [f64; 5] {
    for column in 0..5 {
        let pivot = (column..5).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs())).unwrap();
        rows.swap(column, pivot);
        for row in 0..5 {
            if row != column {
                let factor = rows[row][column] / rows[column][column];
                let eliminated = rows[column];
                rows[row].iter_mut().zip(eliminated).for_each(|(value, other)| *value -= factor * other);
            }
        }
    }
    std::array::from_fn(|index| rows[index][5] / rows[index][index])
}
