//! What a vehicle's motion takes into account beyond slip and geometry: lags, limits, the road's fall.
//!
//! Everything is off by default: then the tractor turns in at once, and accelerates as it is asked to.

use super::GRAVITY;
use crate::layout::Lag;

/// Bound of the slip lever where a file does not say (m): below 32 km/h it is never reached.
pub const SLIP_LEVER: f64 = 1.5;
/// Power over mass of a truck whose file gives no power: far beyond any truck's (W/kg).
const UNLIMITED: f64 = 1e9;

/// What a vehicle's motion takes into account.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Bound of the shift of a no-slip point by tyre slip (m).
    pub slip_lever: f64,
    /// Time constant of the tractor's yaw behind its front wheels, as a multiple of slip times speed; 0 is at once.
    pub yaw_lag: f64,
    /// Time constant of the drive (s).
    pub drive_lag: f64,
    /// Time constant of the brakes (s).
    pub brake_lag: f64,
    /// Time from a steer command to the first movement of the wheels (s).
    pub steer_delay: f64,
    /// Engine power, where it limits the drive (W).
    pub power: Option<f64>,
    /// Whether drive and braking take lateral grip.
    pub friction_ellipse: bool,
    /// Fall of the road to the right, as a tangent.
    pub crossfall: f64,
    /// Increase of each unit's slip with its load transfer ratio: slip times `1 + slip_growth |ratio|`.
    pub slip_growth: f64,
    /// Understeer: increase of the steer angle that a path needs, per lateral acceleration in units of gravity (rad).
    pub understeer: f64,
    /// Fraction of the trailer's weight on the fifth wheel that counts in the tractor's load transfer ratio.
    pub fifth_wheel_load: f64,
}

impl Default for Model {
    fn default() -> Model {
        Model {
            slip_lever: SLIP_LEVER,
            yaw_lag: 0.0,
            drive_lag: 0.0,
            brake_lag: 0.0,
            steer_delay: 0.0,
            power: None,
            friction_ellipse: false,
            crossfall: 0.0,
            slip_growth: 0.0,
            understeer: 0.0,
            fifth_wheel_load: 0.0,
        }
    }
}

impl Model {
    /// Power over the mass of the whole truck (W/kg).
    pub(super) fn specific_power(&self, gross_mass: f64) -> f64 {
        self.power.map_or(UNLIMITED, |power| power / gross_mass)
    }

    /// The factor of `1 - factor acceleration²` for tyres that hold so much (m/s^2).
    pub(super) fn ellipse(&self, grip: f64) -> f64 {
        if self.friction_ellipse { grip.powi(-2) } else { 0.0 }
    }

    /// Lateral acceleration that the road's fall adds to the roll (m/s^2).
    pub(super) fn fall(&self) -> f64 {
        GRAVITY * self.crossfall
    }
}

impl Lag {
    /// A lag with this time constant, 0 for none, in sub-steps of `substep` (s).
    pub fn of(time: f64, substep: f64) -> Lag {
        if time == 0.0 {
            return Lag::default();
        }
        let left = (-substep / time).exp();
        Lag { left: left as f32, mean: (time / substep * (1.0 - left)) as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_leaves_what_the_exponential_leaves() {
        let Lag { left, mean } = Lag::of(0.5, 0.05);
        assert!((left - 0.904_837_4).abs() < 1e-6);
        // The mean of exp(-t / 0.5) over 0.05 s.
        assert!((mean - 0.951_625_8).abs() < 1e-6);
        assert_eq!(Lag::of(0.0, 0.05), Lag { left: 0.0, mean: 0.0 });
    }
}
