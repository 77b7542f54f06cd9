//! How many cars want to go where, and which kinds of them.

use super::Error;
use super::large::N_LARGE;
use super::network::Network;
use super::units::probability;

/// Largest flow of a road without a ring (veh/h).
pub const MOST_WITHOUT_RING: f64 = 900.0;
/// Largest flow: at most one car arrives in a step (veh/h).
pub const MOST: f64 = 36_000.0;
/// Weight of a U-turn among the exits, where nothing else is said.
const U_TURN: f64 = 0.1;

/// The sum of fractions of vans and of large vehicles, without what decimals lose in binary.
pub fn together(vans: f64, large: [f64; N_LARGE]) -> f64 {
    decimal(vans + large.iter().sum::<f64>())
}

fn decimal(sum: f64) -> f64 {
    (sum * 1e6).round() / 1e6
}

/// The kinds of cars, by their fractions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Mix {
    /// Fraction of vans, 7 m long and 2.1 m wide.
    pub vans: f32,
    /// Fraction of rude drivers, who let nobody in.
    pub rude: f32,
    /// Fractions of buses, rigid trucks and tractor-trailers; needs a network with tables of such.
    pub large: [f32; N_LARGE],
}

impl Mix {
    /// Whether there are large vehicles.
    pub fn has_large(&self) -> bool {
        self.large.iter().any(|&fraction| 0.0 < fraction)
    }

    /// Fraction of large vehicles.
    pub fn heavy(&self) -> f64 {
        together(0.0, self.large.map(f64::from))
    }
}

/// Arrivals at a road.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Demand {
    /// Of every source the sum of its probability of an arrival in a step and those of the sources before it (2^-24).
    pub(super) arrivals: Vec<u32>,
    /// Of every path the fraction of its source's cars that take it or one before it (2^-24).
    pub(super) shares: Vec<u32>,
    /// Fraction of vans (2^-24).
    pub(super) vans: u32,
    /// Fraction of rude drivers (2^-24).
    pub(super) rude: u32,
    /// Of every kind of large vehicles the fraction of those, of the kinds before it and of vans (2^-24); empty where
    /// there are none.
    pub(super) large: Vec<u32>,
}

impl Demand {
    /// The numbers as words: those of sources, of paths, of vans, of rude drivers, and of large vehicles if there are
    /// some.
    pub(crate) fn words(&self) -> Vec<u32> {
        let Demand { arrivals, shares, vans, rude, large } = self;
        arrivals.iter().chain(shares).chain([vans, rude]).chain(large).copied().collect()
    }

    /// Arrivals by path (veh/h).
    ///
    /// # Errors
    ///
    /// [`Error::Flow`] for a flow that is negative or larger than one car a step in all; [`Error::NoRing`] where the
    /// road has no ring and more cars arrive than [`MOST_WITHOUT_RING`].
    pub fn new(network: &Network, flows: &[f64], mix: Mix) -> Result<Demand, Error> {
        let total = decimal(flows.iter().sum());
        let wrong = flows.iter().copied().find(|flow| !(0.0..=MOST).contains(flow));
        if let Some(flow) = wrong.or((MOST < total).then_some(total)) {
            return Err(Error::Flow { flow, most: MOST });
        }
        if !network.has_ring && MOST_WITHOUT_RING < total {
            return Err(Error::NoRing { flow: total, most: MOST_WITHOUT_RING });
        }
        let [vans, rude] = [mix.vans, mix.rude].map(|fraction| probability(fraction.into()));
        let until = |kind: usize| f64::from(mix.vans) + mix.large[..=kind].iter().copied().map(f64::from).sum::<f64>();
        let large = (0..N_LARGE).filter(|_| mix.has_large()).map(|kind| probability(until(kind))).collect();
        let mut demand = Demand { arrivals: Vec::new(), shares: vec![0; flows.len()], vans, rude, large };
        let mut sum = 0.0;
        for source in 0..network.sources.len() {
            let paths = network.paths_of(source);
            let of_source: f64 = flows[paths.clone()].iter().sum();
            sum += of_source / MOST;
            demand.arrivals.push(probability(sum));
            let mut share = 0.0;
            for path in paths {
                share += flows[path];
                demand.shares[path] = probability(share / of_source.max(f64::MIN_POSITIVE));
            }
        }
        Ok(demand)
    }

    /// The same flow from every source, to all exits alike but for U-turns, of which there are a tenth (veh/h by path).
    pub fn even(network: &Network, total: f64) -> Vec<f64> {
        let each = total / network.sources.len() as f64;
        (0..network.paths.len()).map(|path| each * share(network, path)).collect()
    }
}

/// Fraction of its source's cars that take a path where nothing else is said.
pub fn share(network: &Network, path: usize) -> f64 {
    let weight = |path: usize| {
        let is_u_turn = network.paths[path].exit_arm == network.source_of(path).entry;
        if is_u_turn { U_TURN } else { 1.0 }
    };
    let all: f64 = network.paths_of(network.paths[path].source as usize).map(weight).sum();
    weight(path) / all
}
