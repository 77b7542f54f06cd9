//! How a truck drives through an episode: speed, load transfer, comfort.

use offtrack::layout::{Control, Truck};

/// Load transfer ratio from which a truck is at its limit.
const AT_LIMIT: f32 = 0.9;
/// Width of a bin of lateral accelerations (m/s^2) and of jerks (m/s^3), and their number.
pub(super) const LATERAL_BIN: f64 = 0.1;
pub(super) const JERK_BIN: f64 = 0.25;
pub(super) const N_BINS: usize = 120;
/// Target speeds that differ by less are the same (m/s).
const SAME_SPEED: f32 = 1e-3;

/// What is kept of one episode, from step to step.
#[derive(Debug, Clone, PartialEq)]
pub struct Driving {
    /// Sum of the speeds after each step (m/s).
    pub(super) speed_sum: f64,
    /// Steps after which the load transfer ratio was at its limit.
    pub(super) steps_at_limit: u32,
    /// Changes of the target speed.
    pub(super) switches: u32,
    /// Steps by lateral acceleration of the trailer, and by jerk, in bins.
    pub(super) lateral_accelerations: Vec<u16>,
    pub(super) jerks: Vec<u16>,
    /// Acceleration and target speed after the last step (m/s², m/s).
    acceleration: f32,
    target_speed: f32,
}

impl Driving {
    /// How a truck drives, at the start of an episode.
    pub fn new(truck: &Truck, target_speed: f32) -> Driving {
        Driving {
            speed_sum: 0.0,
            steps_at_limit: 0,
            switches: 0,
            lateral_accelerations: vec![0; N_BINS],
            jerks: vec![0; N_BINS],
            acceleration: truck.acceleration,
            target_speed,
        }
    }

    /// Adds the last step, after which truck and control are these; a step takes `step` seconds.
    pub fn follow(&mut self, truck: &Truck, control: &Control, step: f64) {
        let ratio = truck.load_transfer_ratio();
        self.speed_sum += f64::from(truck.speed);
        self.steps_at_limit += u32::from(AT_LIMIT <= ratio);
        self.switches += u32::from(SAME_SPEED < (control.target_speed - self.target_speed).abs());
        let jerk = f64::from((truck.acceleration - self.acceleration).abs()) / step;
        let lateral = f64::from(truck.lateral_acceleration.abs());
        for (bins, bin) in
            [(&mut self.lateral_accelerations, lateral / LATERAL_BIN), (&mut self.jerks, jerk / JERK_BIN)]
        {
            let count = &mut bins[(bin as usize).min(N_BINS - 1)];
            *count = count.saturating_add(1);
        }
        (self.acceleration, self.target_speed) = (truck.acceleration, control.target_speed);
    }
}
