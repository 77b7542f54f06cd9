//! Steady turns of a tractor and its trailer without slip, from geometry alone.
//!
//! All axles turn about one centre, so each radius follows from a right-angled triangle (SAE J695; sum of squares of
//! the Western Highway Institute).

/// The lengths that decide the trailer's path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingleTrack {
    /// Front axle ahead of the drive axle (m).
    pub wheelbase: f64,
    /// Fifth wheel ahead of the drive axle, negative when behind (m).
    pub fifth_wheel: f64,
    /// Kingpin ahead of the trailer's axle group (m).
    pub trailer_wheelbase: f64,
}

/// A steady turn: radii of the axles' middles about the common centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steady {
    /// Steer angle, left positive (rad).
    pub steering: f64,
    /// Tractor's heading minus the trailer's (rad).
    pub articulation: f64,
    /// Radius of the drive axle (m).
    pub tractor_radius: f64,
    /// Radius of the front axle (m).
    pub front_radius: f64,
    /// Radius of the fifth wheel (m).
    pub fifth_wheel_radius: f64,
    /// Radius of the trailer's axle group (m).
    pub trailer_radius: f64,
}

impl Steady {
    /// Distance between the paths of the front axle and the trailer's axle group (m).
    pub fn off_tracking(&self) -> f64 {
        self.front_radius - self.trailer_radius
    }
}

impl SingleTrack {
    /// The steady turn with the drive axle on a circle of `radius` (m), to the left; `None` if the trailer would
    /// jackknife instead.
    pub fn at_tractor_radius(&self, radius: f64) -> Option<Steady> {
        let SingleTrack { wheelbase, fifth_wheel, trailer_wheelbase } = *self;
        let fifth_wheel_radius = radius.hypot(fifth_wheel);
        // NaN fails both comparisons.
        if !(0.0 < radius && trailer_wheelbase <= fifth_wheel_radius) {
            return None;
        }
        Some(Steady {
            steering: (wheelbase / radius).atan(),
            articulation: (trailer_wheelbase / fifth_wheel_radius).asin() - (fifth_wheel / radius).atan(),
            tractor_radius: radius,
            front_radius: radius.hypot(wheelbase),
            fifth_wheel_radius,
            trailer_radius: (fifth_wheel_radius.powi(2) - trailer_wheelbase.powi(2)).sqrt(),
        })
    }

    /// The steady turn with the front axle on a circle of `radius` (m), to the left.
    pub fn at_front_radius(&self, radius: f64) -> Option<Steady> {
        self.at_tractor_radius((radius.powi(2) - self.wheelbase.powi(2)).sqrt())
    }

    /// The steady turn at a steer angle (rad); a right turn mirrors a left one, with steer angle and articulation
    /// negative.
    pub fn at_steering(&self, steering: f64) -> Option<Steady> {
        let steady = self.at_tractor_radius(self.wheelbase / steering.abs().tan())?;
        Some(Steady { steering, articulation: steady.articulation * steering.signum(), ..steady })
    }

    /// Steer angle above which there is no steady turn: held there, the truck jackknifes even when it drives forward
    /// (rad).
    pub fn critical_steering(&self) -> f64 {
        (self.wheelbase / (self.trailer_wheelbase.powi(2) - self.fifth_wheel.powi(2)).sqrt()).atan()
    }

    /// Articulation after `distance` of straight driving, from `articulation` (rad). The distance is negative in
    /// reverse (m).
    pub fn articulation_after_straight(&self, articulation: f64, distance: f64) -> f64 {
        2.0 * ((0.5 * articulation).tan() * (-distance / self.trailer_wheelbase).exp()).atan()
    }
}
