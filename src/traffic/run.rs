//! Cars alone on a road, step by step.

use super::arrivals::{self, Backlog, Event};
use super::clock::Clock;
use super::decide::MOST_CARS;
use super::{Car, Demand, Network, Nobody, Rules, Setting, step};
use crate::layout::Stream;

/// A row of cars and what drives them.
#[derive(Debug, Clone)]
pub struct Run<'a> {
    setting: Setting<'a>,
    clock: Clock,
    /// Slots, of which some have a car.
    pub cars: Vec<Car>,
    backlog: Backlog,
}

impl<'a> Run<'a> {
    /// An empty road with room for `n_slots` cars, at most 64; what is drawn is that of truck `env` of a batch.
    pub fn new(
        network: &'a Network,
        rules: &'a Rules,
        demand: &'a Demand,
        n_slots: usize,
        Stream { seed, env }: Stream,
    ) -> Run<'a> {
        let clock = Clock { seed, env, episode: 0, step: 0 };
        let setting = Setting { network, rules, demand };
        Run { setting, clock, cars: vec![Car::NONE; n_slots.min(MOST_CARS)], backlog: Backlog::default() }
    }

    /// One step: cars decide, all move, some leave and some come. `tell` hears of the latter.
    pub fn step(&mut self, mut tell: impl FnMut(Event, &[Car])) {
        step(self.setting, self.clock, &mut self.cars, &mut self.backlog, &Nobody, &mut tell);
        self.clock.step += 1;
    }

    /// Takes away all that stand in a blocked ring, of whatever kind. `tell` hears of them.
    pub fn take_away_stuck(&mut self, tell: impl FnMut(Event)) {
        arrivals::take_away_stuck(self.setting.network, &mut self.cars, tell);
    }

    /// Cars that wait outside.
    pub fn backlog(&self) -> Backlog {
        self.backlog
    }

    /// Number of pairs of cars that overlap: 0 where the model holds.
    pub fn overlaps(&self) -> usize {
        overlaps(self.setting.network, &self.cars)
    }

    /// Number of cars that wait outside at a source.
    pub fn waiting(&self, source: usize) -> usize {
        arrivals::waiting(&self.backlog, source) as usize
    }

    /// Has as many cars wait outside at a source as can.
    pub fn fill(&mut self, source: usize) {
        arrivals::fill(&mut self.backlog, source);
    }
}

/// Number of pairs of cars of a road that overlap.
pub fn overlaps(network: &Network, cars: &[Car]) -> usize {
    let there = cars.iter().filter(|car| car.is_there());
    let outlines: Vec<Vec<_>> = there.map(|car| car.outlines(network).collect()).collect();
    let pairs = (0..outlines.len()).flat_map(|one| (0..one).map(move |other| (one, other)));
    let touch = |&(one, other): &(usize, usize)| {
        outlines[one].iter().any(|unit| outlines[other].iter().any(|its| unit.overlaps(its)))
    };
    pairs.filter(touch).count()
}
