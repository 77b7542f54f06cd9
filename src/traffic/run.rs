//! Cars alone on a road, step by step.

use super::arrivals::{self, Event, exchange};
use super::clock::Clock;
use super::decide::{Crowd, MOST_CARS};
use super::{Car, Demand, Network, Rules};
use crate::layout::Stream;

/// Steps between two decisions of a car; slots take turns.
const DECIDES_EVERY: u32 = 2;

/// A row of cars and what drives them.
#[derive(Debug, Clone)]
pub struct Run<'a> {
    network: &'a Network,
    rules: &'a Rules,
    demand: &'a Demand,
    clock: Clock,
    /// Slots, of which some have a car.
    pub cars: Vec<Car>,
    /// Cars that wait outside: four bits a source.
    backlog: u64,
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
        Run { network, rules, demand, clock, cars: vec![Car::NONE; n_slots.min(MOST_CARS)], backlog: 0 }
    }

    /// One step: cars decide, all move, some leave and some come. `tell` hears of the latter.
    pub fn step(&mut self, tell: impl FnMut(Event, &[Car])) {
        step(self.network, self.rules, self.demand, self.clock, &mut self.cars, &mut self.backlog, tell);
        self.clock.step += 1;
    }

    /// Cars that wait outside: four bits a source.
    pub fn backlog(&self) -> [u32; 2] {
        [self.backlog as u32, (self.backlog >> 32) as u32]
    }

    /// Number of pairs of cars that overlap: 0 where the model holds.
    pub fn overlaps(&self) -> usize {
        let outlines = self.cars.iter().filter(|car| car.is_there()).map(|car| car.outline(self.network));
        let outlines: Vec<_> = outlines.collect();
        let pairs = (0..outlines.len()).flat_map(|one| (0..one).map(move |other| (one, other)));
        pairs.filter(|&(one, other)| outlines[one].overlaps(&outlines[other])).count()
    }

    /// Number of cars that wait outside at a source.
    pub fn waiting(&self, source: usize) -> usize {
        arrivals::waiting(self.backlog, source) as usize
    }

    /// Has as many cars wait outside at a source as can.
    pub fn fill(&mut self, source: usize) {
        self.backlog = arrivals::filled(self.backlog, source);
    }
}

/// One step of a row of cars: they decide, all move, some leave and some come. `tell` hears of the latter.
pub fn step(
    network: &Network,
    rules: &Rules,
    demand: &Demand,
    clock: Clock,
    cars: &mut [Car],
    backlog: &mut u64,
    mut tell: impl FnMut(Event, &[Car]),
) {
    let crowd = Crowd::new(network, rules, clock, cars);
    let decides = |slot: usize| (slot as u32 + clock.step).is_multiple_of(DECIDES_EVERY);
    let mut next = [Car::NONE; MOST_CARS];
    for (slot, car) in cars.iter().enumerate().filter(|(_, car)| car.is_there()) {
        let acceleration = if decides(slot) { crowd.decided(slot) } else { car.acceleration };
        next[slot] = Car { acceleration, ..*car }.moved();
    }
    let n_slots = cars.len();
    cars.copy_from_slice(&next[..n_slots]);
    exchange(network, rules, demand, clock, cars, backlog, &mut tell);
}
