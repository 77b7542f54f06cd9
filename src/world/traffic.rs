//! Other vehicles as all trucks share them: each road's paths, how many come, and the states that episodes begin in.

use std::sync::Mutex;

use bytemuck::cast_slice;
use rayon::prelude::*;

use super::{Error, World};
use crate::files::cache::Loading;
use crate::map::route::Route;
use crate::scenario::{self, Invalid, Place, Scenario};
use crate::traffic::units::probability;
use crate::traffic::{self, Demand, Mix, Network, Row, Rules, Snapshots};

/// What all trucks share of other vehicles.
#[derive(Debug, Clone, PartialEq)]
pub struct Traffic {
    /// The driver model's numbers.
    pub rules: Rules,
    /// Least and greatest fraction of rude drivers; each episode draws one (2^-16).
    pub rude: [u32; 2],
    /// Distance between the waypoints of a route (m).
    pub spacing: f32,
    /// Whether trucks observe other vehicles.
    pub is_observed: bool,
    /// Reward, each step, for each m/s² beyond 2 m/s² with which a vehicle brakes for the truck.
    pub hindrance: f32,
    /// Neighbouring trucks of a batch that share a road and its vehicles.
    pub group: usize,
    /// Every road, in the order of the world's fields.
    pub roads: Vec<TrafficRoad>,
    /// Where each of the world's routes runs.
    pub routes: Vec<TrafficRoute>,
}

/// Other vehicles on one road.
#[derive(Debug, Clone, PartialEq)]
pub struct TrafficRoad {
    /// The road's paths, and where they meet.
    pub network: Network,
    /// By the demand that an episode draws.
    pub levels: Vec<Level>,
}

/// Other vehicles on one road at one demand.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// How many come, and where they want to go.
    pub demand: Demand,
    /// What is on the road when an episode begins: each draws one.
    pub snapshots: Vec<Row>,
}

/// A truck's route as other vehicles see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrafficRoute {
    /// Index of its path.
    pub path: u32,
    /// Station of its beginning there (m).
    pub begins: f32,
}

impl World {
    /// Neighbouring trucks of a batch that share a road and its vehicles: 1 where none do.
    pub fn group(&self) -> usize {
        self.traffic.as_ref().map_or(1, |traffic| traffic.group)
    }
}

impl Traffic {
    /// The road of a route of the world that this is a part of.
    pub fn road(&self, world: &World, route: u32) -> &TrafficRoad {
        &self.roads[world.routes[route as usize].roundabout as usize]
    }

    /// Every table as words, one road after the other.
    pub(super) fn words(&self) -> impl Iterator<Item = Vec<u32>> {
        let Traffic { rules, rude, spacing, is_observed, hindrance, group, roads, routes } = self;
        // A world of trucks that are alone has the words that it had before there were groups.
        let group = (1 < *group).then_some(*group as u32);
        let shared =
            [&rules.all_words()[..], rude, &[*spacing, *hindrance].map(f32::to_bits), &[u32::from(*is_observed)]]
                .concat();
        let routes = routes.iter().flat_map(|&TrafficRoute { path, begins }| [path, begins.to_bits()]).collect();
        [shared, group.into_iter().collect(), routes].into_iter().chain(roads.iter().map(TrafficRoad::words))
    }

    /// What a scenario's trucks share; none where its roads are empty.
    pub(super) fn baked(scenario: &Scenario, loading: &Loading) -> Result<Option<Traffic>, Error> {
        let Some(of) = &scenario.traffic else { return Ok(None) };
        let rules = Rules { courtesy: probability(of.courtesy), ..of.drivers.rules() };
        // Whether a driver is rude is drawn when an episode begins, and when a car comes.
        let mix = Mix { vans: of.vans as f32, rude: 0.0, large: of.large.map(|fraction| fraction as f32) };
        let done = Mutex::new(0);
        let road = |place: &Place| {
            loading.check()?;
            let road = TrafficRoad::baked(place, of, mix, &rules, loading)?;
            loading.count("baking traffic", &done, scenario.places.len());
            Ok(road)
        };
        let roads = scenario.places.par_iter().map(road).collect::<Result<_, Error>>()?;
        let routes = scenario.places.iter().flat_map(|place| {
            let begins = traffic::begins(place.roundabout.ground(), scenario.approach);
            place.routes.iter().map(move |route| {
                let path = path_of(place, route);
                TrafficRoute { path: path as u32, begins: begins[path] as f32 }
            })
        });
        let rude = of.rude.map(|rude| (rude * f64::from(1 << 16)).round() as u32);
        Ok(Some(Traffic {
            rules,
            rude,
            spacing: scenario.spacing as f32,
            is_observed: scenario.observes_vehicles,
            hindrance: of.hindrance as f32,
            group: of.group,
            roads,
            routes: routes.collect(),
        }))
    }
}

/// Index of a route among all of its road, which have a path each.
fn path_of(place: &Place, route: &Route) -> usize {
    let lines = &place.roundabout.ground().lines;
    let same =
        lines.iter().position(|line| (line.entry, line.lane, line.exit) == (route.entry, route.lane, route.exit));
    same.unwrap_or_default()
}

impl TrafficRoad {
    /// The tables as words: of the network, and of each level the demand and the snapshots.
    pub(crate) fn words(&self) -> Vec<u32> {
        let TrafficRoad { network, levels } = self;
        let level = |Level { demand, snapshots }: &Level| [&demand.words(), cast_slice(snapshots)].concat();
        [network.words(), levels.iter().flat_map(level).collect()].concat()
    }

    fn baked(
        place: &Place,
        of: &scenario::Traffic,
        mix: Mix,
        rules: &Rules,
        loading: &Loading,
    ) -> Result<TrafficRoad, Error> {
        let road = &place.roundabout.name;
        let invalid = |error: traffic::Error| {
            let (key, would_do) = match error {
                traffic::Error::TooLarge { .. } => ("traffic".to_owned(), "leave [traffic] out, or the road"),
                _ => (format!("traffic.demand on {road}"), "demand less, or leave the road out"),
            };
            Error::Invalid(Invalid { key, value: error.to_string(), expected: would_do.to_owned() })
        };
        let network = Network::cached(&place.roundabout, mix.has_large(), loading.cache);
        let network = network.map_err(invalid)?.driven_by(of.drivers);
        let level = |&total: &f64| {
            loading.check()?;
            let demand = Demand::new(&network, &Demand::even(&network, total), mix).map_err(invalid)?;
            let of = Snapshots { network: &network, rules, demand: &demand };
            let snapshots = loading.cache.map_or_else(|| of.baked(), |cache| of.cached(cache));
            Ok(Level { demand, snapshots })
        };
        let levels = of.demand.iter().map(level).collect::<Result<_, Error>>()?;
        Ok(TrafficRoad { network, levels })
    }
}
