//! Other vehicles on the roads of a benchmark: how many, and what their drivers are like.

use super::check::{Invalid, list, within};
use crate::layout::MOST_IN_GROUP;
use crate::traffic::{Drivers, together};

/// Largest demand (veh/h).
pub(super) const MOST_DEMAND: f64 = 3000.0;

/// Range of the weight of hindrance.
pub(super) const MOST_HINDRANCE: [f64; 2] = [-1e6, 1e6];

/// Keys of the fractions of large vehicles.
pub(super) const LARGE_KEYS: [&str; 3] = ["buses", "rigid_trucks", "tractor_trailers"];

/// Other vehicles on the roads.
#[derive(Debug, Clone, PartialEq)]
pub struct Traffic {
    /// How many come to a road, from all arms together: each episode draws one of these, all alike (veh/h).
    pub demand: Vec<f64>,
    /// Who drives them.
    pub drivers: Drivers,
    /// Fraction of vans, 7 m long.
    pub vans: f64,
    /// Fractions of buses, rigid trucks and tractor-trailers.
    pub large: [f64; 3],
    /// Least and greatest fraction of rude drivers, who let nobody in and do not yield to a truck that needs the lanes
    /// beside its own; drawn for each episode.
    pub rude: [f64; 2],
    /// Probability with which a driver in the ring lets in one that waits, where that takes gentle braking.
    pub courtesy: f64,
    /// Time to wait, which an episode's time limit has in addition (s).
    pub waiting: f64,
    /// Reward, each step, for each m/s² beyond 2 m/s² with which a vehicle brakes for the truck.
    pub hindrance: f64,
    /// Trucks that share a road and its vehicles.
    pub group: usize,
}

impl Traffic {
    /// An error if a value would make no sense.
    pub(super) fn check(&self) -> Result<(), Invalid> {
        list("traffic.demand", &self.demand, [0.0, MOST_DEMAND])?;
        let [least, greatest] = self.rude;
        let shares = [("vans", self.vans)].into_iter().chain(LARGE_KEYS.into_iter().zip(self.large));
        let drivers = [("rude[0]", least), ("rude[1]", greatest), ("courtesy", self.courtesy)];
        for (key, value) in shares.chain(drivers) {
            within(&format!("traffic.{key}"), value, [0.0, 1.0])?;
        }
        within("traffic.vans and larger vehicles together", together(self.vans, self.large), [0.0, 1.0])?;
        within("traffic.rude[1]", greatest, [least, 1.0])?;
        within("traffic.waiting", self.waiting, [0.0, 1e6])?;
        within("traffic.hindrance", self.hindrance, MOST_HINDRANCE)?;
        within("traffic.group", self.group as f64, [1.0, MOST_IN_GROUP as f64])
    }
}
