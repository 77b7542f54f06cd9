//! A part of a benchmark, and the same benchmark on another roundabout.

use std::collections::HashSet;
use std::path::Path;

use super::{Place, Scenario, Split};
use crate::files::reader::{Error, Reader};
use crate::map::Road;
use crate::map::route::Route;

impl Scenario {
    /// Drops the routes of all other splits, and roundabouts of which none is left. Indices of routes change.
    pub fn keep(&mut self, splits: &[Split]) {
        let dropped =
            Split::ALL.into_iter().filter(|split| !splits.contains(split)).flat_map(|split| self.split(split).to_vec());
        let dropped: HashSet<u32> = dropped.collect();
        self.retain(|index, _| !dropped.contains(&index));
    }

    /// Drops all routes but those for which `keeps` holds, by index in the world's table and route, and roundabouts of
    /// which none is left. Indices of routes change.
    pub fn retain(&mut self, mut keeps: impl FnMut(u32, &Route) -> bool) {
        let mut renumbered: Vec<Option<u32>> = Vec::new();
        let mut next = 0;
        for place in &mut self.places {
            place.routes.retain(|route| {
                let kept = keeps(renumbered.len() as u32, route);
                renumbered.push(kept.then_some(next));
                next += u32::from(kept);
                kept
            });
        }
        self.places.retain(|place| !place.routes.is_empty());
        for split in &mut self.splits {
            *split = split.iter().filter_map(|&route| renumbered[route as usize]).collect();
        }
    }

    /// This benchmark on the given roundabout alone, with all the roundabout's routes in the test split.
    ///
    /// # Errors
    ///
    /// The errors of [`Scenario::add`].
    pub fn on(&self, roundabout: Road) -> Result<Scenario, Error> {
        let mut scenario = Scenario { places: Vec::<Place>::new(), splits: Default::default(), ..self.clone() };
        scenario.add(roundabout, Split::Test)?;
        Ok(scenario)
    }

    /// Adds a roundabout that the benchmark does not have, with all its routes in one split.
    ///
    /// # Errors
    ///
    /// An arm too short for the benchmark's routes and vehicle; the roundabout's name stands for the file.
    pub fn add(&mut self, roundabout: Road, split: Split) -> Result<(), Error> {
        let name = roundabout.name.clone();
        let reader = Reader::of(Path::new(&name));
        let routes = self.routes_of(&reader, &roundabout)?;
        self.place(&reader, roundabout, routes.into_iter().map(|route| (route, Some(split))))
    }
}
