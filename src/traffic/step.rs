//! A step of a row of cars in its three parts: they decide, all move, some leave and some come.

use super::arrivals::{Backlog, Event, arrive};
use super::clock::Clock;
use super::decide::{Crowd, MOST_CARS};
use super::{Car, Demand, Network, Others, Rules};
use crate::layout::N_CARS;
use crate::layout::shared::constants;

constants! {
    /// Steps between two decisions of a car; slots take turns.
    const DECIDES_EVERY: u32 = 2;
    /// Slots of a row that decide in a step.
    pub const N_TURNS: usize = N_CARS / DECIDES_EVERY as usize;
}

/// What cars drive on, how, and how many come.
#[derive(Debug, Clone, Copy)]
pub struct Setting<'a> {
    /// The road's tables.
    pub network: &'a Network,
    /// How they drive.
    pub rules: &'a Rules,
    /// How many come, of which kinds.
    pub demand: &'a Demand,
}

/// Cars whose turn it is decide their acceleration, from the state of the step before; nothing else changes. Slots
/// beyond the 64th are not looked at.
pub fn decide(setting: Setting, clock: Clock, cars: &mut [Car], others: &impl Others) {
    let crowd = Crowd::new(setting.network, setting.rules, clock, cars);
    let mut decided = [0; MOST_CARS];
    for (slot, (car, decided)) in cars.iter().zip(&mut decided).enumerate() {
        let is_its_turn = (slot as u32).wrapping_add(clock.step).is_multiple_of(DECIDES_EVERY);
        *decided = if car.is_there() && is_its_turn { crowd.decided(slot, others) } else { car.acceleration };
    }
    cars.iter_mut().zip(decided).for_each(|(car, decided)| car.acceleration = decided);
}

/// All cars move by what they decided.
pub fn advance(cars: &mut [Car]) {
    cars.iter_mut().filter(|car| car.is_there()).for_each(|car| *car = car.moved());
}

/// One step: cars decide, all move, some leave and some come. `tell` hears of the latter.
pub fn step(
    setting: Setting,
    clock: Clock,
    cars: &mut [Car],
    backlog: &mut Backlog,
    others: &impl Others,
    tell: &mut impl FnMut(Event, &[Car]),
) {
    decide(setting, clock, cars, others);
    advance(cars);
    arrive(setting, clock, cars, backlog, others, tell);
}
