//! Random roundabouts: road `i` of a seed is the same for ever, alone or among others.
//!
//! A road is drawn from a [`Distribution`] until a draw passes the checks that files meet and the distribution's own
//! rules. Every number drawn is a function of (seed, index, attempt).

mod arm;
mod distribution;
mod distribution_keys;
mod draw;
mod draws;
mod line;
mod roads;
mod rules;
#[cfg(test)]
mod tests;

use crate::files::reader::Error;
use crate::files::shipped::Kind;
use crate::map::parametric::written::Written;
use crate::map::{Gutter, Road};

pub use distribution::Distribution;

/// A roundabout drawn at random.
#[derive(Debug, Clone)]
pub struct RandomRoad {
    /// The roundabout. Its name is the distribution's, the seed and the index: `wide/7/12`.
    pub roundabout: Road,
    /// Seed that it was drawn with.
    pub seed: u32,
    /// The road's index among the roads of the seed.
    pub index: u32,
    /// The attempt that was valid, from 0.
    pub attempt: u32,
    /// Why those before it were not.
    pub refused: Refused,
    written: Written,
}

impl RandomRoad {
    /// The text of a roundabout file that describes it: read again it gives the same roundabout, bit for bit.
    pub fn text(&self) -> String {
        self.written.to_string()
    }
}

/// Least distance of a route's centre line from a kerb, `NaN` where the arms are too short for such routes (m).
/// `approach` and `departure` are the lengths of the routes before and after the ring (m).
pub fn lane_clearance(roundabout: &Road, approach: f64, departure: f64) -> f64 {
    let Ok(routes) = roundabout.routes(approach, departure, 5.0) else { return f64::NAN };
    rules::lane_clearance(&roundabout.kerbs(Gutter::Drivable), &routes, 0.0)
}

/// Why a draw is no road.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// Two arms nearer to each other than the distribution allows.
    ArmsTooNear,
    /// A kerb bends too sharply for a lane beside it.
    TooSharp,
    /// No arc of the radius drawn leads a straight into the ring.
    NoArc,
    /// A value that no roundabout may have.
    Values,
    /// Kerbs that do not fit or that cross, or a splitter island on one.
    Kerbs,
    /// A lane that does not lead into the ring, or a route that would leave it before it arrives.
    Lanes,
    /// A lane nearer than 1.3 m to a kerb.
    LaneNearKerb,
    /// Lanes of an arm nearer than 2.5 m to each other.
    LanesTooNear,
    /// An arm too short for the routes and the truck on it.
    ArmTooShort,
    /// A start pose nearer to a kerb than the distribution allows.
    StartOnKerb,
    /// Gutters that leave no road between them, so that solid gutters would close the road.
    Gutter,
    /// A route nearer to a kerb than the distribution allows.
    RouteNearKerb,
}

impl Reason {
    /// All reasons, in the order in which they are looked for.
    pub const ALL: [Reason; 12] = [
        Reason::ArmsTooNear,
        Reason::TooSharp,
        Reason::NoArc,
        Reason::Values,
        Reason::Kerbs,
        Reason::Lanes,
        Reason::LaneNearKerb,
        Reason::LanesTooNear,
        Reason::ArmTooShort,
        Reason::StartOnKerb,
        Reason::Gutter,
        Reason::RouteNearKerb,
    ];

    /// The reason in words.
    pub fn words(self) -> &'static str {
        match self {
            Reason::ArmsTooNear => "two arms too near to each other",
            Reason::TooSharp => "a kerb too sharp for a lane beside it",
            Reason::NoArc => "no arc leads a straight into the ring",
            Reason::Values => "a value out of a roundabout's range",
            Reason::Kerbs => "kerbs that do not fit or that cross",
            Reason::Lanes => "a route that would leave the ring before it arrives",
            Reason::LaneNearKerb => "a lane nearer than 1.3 m to a kerb",
            Reason::LanesTooNear => "lanes of an arm nearer than 2.5 m to each other",
            Reason::ArmTooShort => "an arm too short for its routes",
            Reason::StartOnKerb => "a start pose too near to a kerb",
            Reason::Gutter => "kerbs that meet once moved by the gutter",
            Reason::RouteNearKerb => "a route nearer to a kerb than the rules allow",
        }
    }
}

/// Refused draws, counted by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Refused([u32; Reason::ALL.len()]);

impl Refused {
    /// Draws refused for this reason.
    pub fn count(&self, reason: Reason) -> u32 {
        self.0[reason as usize]
    }

    /// Draws refused.
    pub fn total(&self) -> u32 {
        self.0.iter().sum()
    }

    /// Adds the counts of another road.
    pub fn add(&mut self, other: &Refused) {
        for (sum, count) in self.0.iter_mut().zip(other.0) {
            *sum += count;
        }
    }

    fn note(&mut self, reason: Reason) {
        self.0[reason as usize] += 1;
    }
}

/// A random road by its name, `wide/7/12`, distribution, seed and index, or else a roundabout as [`Road::find`]
/// finds it. In place of the distribution's name may stand the path of its file.
///
/// # Errors
///
/// The errors of [`Distribution::find`], [`Distribution::road`] and [`Road::find`].
pub fn find(name_or_path: &str) -> Result<Road, Error> {
    match address(name_or_path) {
        Some((distribution, seed, index)) => Ok(Distribution::find(distribution)?.road(seed, index)?.roundabout),
        None => Road::find(name_or_path).map_err(|error| match error {
            Error::UnknownName { what, name, mut known } => {
                known.push("a random road's DISTRIBUTION/SEED/INDEX, as wide/7/12, of numbers in 0..4294967295");
                Error::UnknownName { what, name, known }
            }
            error => error,
        }),
    }
}

/// Distribution, seed and index of a random road's name; `None` for any other name.
pub fn address(name: &str) -> Option<(&str, u32, u32)> {
    // `+7` is a number too, but not one that names a road.
    let number = |text: &str| text.bytes().all(|digit| digit.is_ascii_digit()).then(|| text.parse().ok()).flatten();
    let (rest, index) = name.rsplit_once('/')?;
    let (distribution, seed) = rest.rsplit_once('/')?;
    (!distribution.is_empty()).then_some((distribution, number(seed)?, number(index)?))
}

/// The road and, if it names one, the route within it that a name means apart from any benchmark: a random road, a
/// shipped one, or that of a file; `None` for any other name.
pub fn road_of(name: &str) -> Option<(&str, Option<&str>)> {
    let is_road = |name: &str| {
        address(name).is_some() || Kind::Roundabout.names().any(|known| known == name) || name.ends_with(".toml")
    };
    let split = || name.rsplit_once('/').filter(|(road, _)| is_road(road)).map(|(road, route)| (road, Some(route)));
    if is_road(name) { Some((name, None)) } else { split() }
}
