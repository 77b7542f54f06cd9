//! Trucks of several kinds in one benchmark: vehicles and loads by shares, and ranges that their dimensions are drawn
//! from.
//!
//! A table of vehicles is drawn once, before anything is baked. An episode draws a row of it, so that vehicle and load
//! belong together.

mod draw;
mod read;

use std::collections::BTreeMap;

use super::Scenario;
use crate::layout::Rig;
use crate::vehicle::Vehicle;
pub use draw::{Drawn, Ranges};
pub(super) use read::vehicles;

/// Rows of the table where a benchmark does not say.
pub const N_VEHICLES: usize = 4096;

/// The vehicles of a benchmark.
#[derive(Debug, Clone, PartialEq)]
pub struct Fleet {
    /// The kinds of vehicle.
    pub members: Vec<Member>,
    /// What is drawn for each row of the table.
    pub draw: Ranges,
    /// Maximum number of rows of the table; without ranges it has as few as give every share.
    pub n_vehicles: usize,
}

/// One kind of vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    /// Stem of its file.
    pub name: String,
    /// The vehicle as its file has it.
    pub vehicle: Vehicle,
    /// How often it is drawn, in proportion to those of the others.
    pub share: f64,
    /// How often each load is drawn, in proportion to those of the others.
    pub loads: BTreeMap<String, f64>,
    /// Whether its trucks are drawn from the ranges; otherwise each is as its file has it.
    pub drawn: bool,
}

impl Member {
    /// The load that stands for all where one is needed: the first that is ever drawn.
    pub(super) fn first_load(&self) -> Option<&String> {
        self.loads.iter().find(|(_, share)| 0.0 < **share).map(|(load, _)| load)
    }
}

/// A vehicle with a load, as reports group episodes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Class {
    /// Stem of the vehicle's file; empty where a benchmark has one vehicle.
    pub vehicle: String,
    /// Name of the load.
    pub load: String,
}

/// A row of the table of vehicles.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Index of its class.
    pub class: usize,
    /// The vehicle as it was drawn.
    pub vehicle: Vehicle,
}

impl Fleet {
    /// Every vehicle with every load that is drawn, and its probability.
    fn shares(&self) -> Vec<(&Member, &str, f64)> {
        let members: f64 = self.members.iter().map(|member| member.share).sum();
        let of_member = |member: &'_ Member| member.loads.values().sum::<f64>();
        let all = self
            .members
            .iter()
            .flat_map(|member| member.loads.iter().map(move |(load, share)| (member, load.as_str(), *share)));
        let shares =
            all.map(|(member, load, share)| (member, load, member.share / members * share / of_member(member)));
        shares.filter(|(.., share)| 0.0 < *share).collect()
    }

    /// The classes, in the order of the file.
    pub fn classes(&self) -> Vec<Class> {
        self.shares()
            .into_iter()
            .map(|(member, load, _)| Class { vehicle: member.name.clone(), load: load.to_owned() })
            .collect()
    }

    /// The table of vehicles, class by class: a function of the fleet alone.
    pub fn table(&self) -> Vec<Entry> {
        let shares = self.shares();
        let entry = |(row, class): (usize, usize)| {
            let (member, load, _) = shares[class];
            Entry { class, vehicle: self.truck(member, load, &Drawn::of_row(row as u32)) }
        };
        self.rows(&shares).into_iter().enumerate().map(entry).collect()
    }

    /// A truck of one kind with one load, as it is drawn.
    fn truck(&self, member: &Member, load: &str, drawn: &Drawn) -> Vehicle {
        let of_file = Ranges::default();
        let ranges = if member.drawn { &self.draw } else { &of_file };
        ranges.applied(&member.vehicle, load, drawn)
    }

    /// The class of each row of the table.
    fn rows(&self, shares: &[(&Member, &str, f64)]) -> Vec<usize> {
        let n_rows = self.n_rows(shares);
        let mut rows = Vec::with_capacity(n_rows);
        let mut end = 0.0;
        for (class, (.., share)) in shares.iter().enumerate() {
            end += share;
            // The middle of row i lies at (i + 1/2) / n of all shares.
            while rows.len() < n_rows && (rows.len() as f64 + 0.5) / (n_rows as f64) < end {
                rows.push(class);
            }
        }
        // The sum of all shares may be a little less than 1.
        if let Some(&last) = rows.last() {
            rows.resize(n_rows, last);
        }
        rows
    }

    /// A vehicle with a load that is too seldom to have a row of the table, its probability, and the number of rows.
    pub(super) fn without_row(&self) -> Option<(&Member, &str, f64, usize)> {
        let shares = self.shares();
        let rows = self.rows(&shares);
        let missing = (0..shares.len()).find(|class| rows.binary_search(class).is_err())?;
        let (member, load, share) = shares[missing];
        Some((member, load, share, rows.len()))
    }

    /// Rows of the table.
    fn n_rows(&self, shares: &[(&Member, &str, f64)]) -> usize {
        let whole =
            |n: &usize| shares.iter().all(|(.., share)| (share * *n as f64 - (share * *n as f64).round()).abs() < 1e-9);
        if self.draw.is_empty() { (1..self.n_vehicles).find(whole).unwrap_or(self.n_vehicles) } else { self.n_vehicles }
    }

    /// The vehicles with all ranges at their ends: if they make sense, so does every row.
    pub(super) fn extremes(&self) -> impl Iterator<Item = (&Member, Vehicle)> {
        let loads = self.members.iter().flat_map(|member| member.loads.keys().map(move |load| (member, load)));
        loads.flat_map(move |(member, load)| {
            Drawn::ends().into_iter().map(move |drawn| (member, self.truck(member, load, &drawn)))
        })
    }
}

impl Scenario {
    /// The classes of its vehicles: one where it has one vehicle.
    pub fn classes(&self) -> Vec<Class> {
        let one = || Vec::from([Class { vehicle: String::new(), load: self.load.clone() }]);
        self.fleet.as_ref().map_or_else(one, Fleet::classes)
    }

    /// The table of its vehicles: one row where it has one vehicle.
    pub fn vehicles(&self) -> Vec<Entry> {
        let one = || Vec::from([Entry { class: 0, vehicle: self.vehicle.clone() }]);
        self.fleet.as_ref().map_or_else(one, Fleet::table)
    }

    /// This benchmark with every vehicle as its file has it: none of its dimensions is drawn.
    pub fn typical(&self) -> Scenario {
        let undrawn = |fleet: &Fleet| Fleet { draw: Ranges::default(), ..fleet.clone() };
        Scenario { fleet: self.fleet.as_ref().map(undrawn), ..self.clone() }
    }

    /// Each class as its file has it, in their order.
    pub fn typical_rigs(&self, substep: f32) -> Vec<Rig> {
        let rig = |vehicle: &Vehicle, load: &str| vehicle.rig(load, substep, self.steer_max);
        match &self.fleet {
            None => Vec::from([rig(&self.vehicle, &self.load)]),
            Some(fleet) => fleet.shares().into_iter().map(|(member, load, _)| rig(&member.vehicle, load)).collect(),
        }
    }

    /// The furthest reach of its vehicles at the start: see [`Vehicle::reach`] (m).
    pub fn reach(&self) -> (f64, f64) {
        let drawn = self.fleet.iter().flat_map(Fleet::extremes).map(|(_, vehicle)| vehicle.reach(self.start_heading));
        drawn.fold(self.vehicle.reach(self.start_heading), |(a, b), (c, d)| (a.max(c), b.max(d)))
    }

    /// The lock that steer levels are fractions of (rad).
    pub(super) fn lock_of_levels(&self) -> f64 {
        self.lock_of_levels.or(self.steer_max).unwrap_or(self.vehicle.tractor.steer_max)
    }

    /// This benchmark for those of its vehicles and loads alone for which `keeps` holds; `None` if there are none.
    pub fn with_classes(&self, keeps: impl Fn(&Class) -> bool) -> Option<Scenario> {
        let mut scenario = self.clone();
        let Some(fleet) = &mut scenario.fleet else {
            return keeps(&self.classes()[0]).then_some(scenario);
        };
        for member in &mut fleet.members {
            let name = member.name.clone();
            member.loads.retain(|load, _| keeps(&Class { vehicle: name.clone(), load: load.clone() }));
        }
        fleet.members.retain(|member| member.loads.values().any(|share| 0.0 < *share));
        let first = fleet.members.first()?;
        scenario.lock_of_levels = Some(self.lock_of_levels());
        (scenario.vehicle, scenario.load) = (first.vehicle.clone(), first.first_load()?.clone());
        Some(scenario)
    }
}

#[cfg(test)]
mod tests;
