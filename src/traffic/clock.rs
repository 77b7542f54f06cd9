//! Random numbers of traffic by step and purpose: pure functions of (seed, env, episode, draw) as everywhere.

use crate::layout::random::words;
use crate::layout::shared::constants;

constants! {
    /// Arrivals: the step is added.
    const ARRIVAL: u32 = 0x8000_0000;
    /// Path and style of a car that enters: 16 times the step and the source are added.
    const ENTERING: u32 = 0xA000_0000;
    /// Kind of the large vehicle that comes next: source, slot and style of the car before it are added.
    const NEXT_KIND: u32 = 0xB000_0000;
    /// Who of two that stand goes first: the period and both slots are added.
    const COIN: u32 = 0xC000_0000;
    /// Whether one lets another in: the period and both slots are added.
    const COURTESY: u32 = 0xD000_0000;
    /// Whether one looks away: the period and its slot are added.
    const LAPSE: u32 = 0xE000_0000;
    /// Steps for which a coin falls the same way.
    const COIN_PERIOD: u32 = 10;
    /// Steps for which a car is as courteous to another.
    const COURTESY_PERIOD: u32 = 32;
    /// Steps for which one looks away.
    const LAPSE_PERIOD: u32 = 20;
    /// Numbers of slots that differ in a draw.
    const SLOTS: u32 = 64;
    /// Bits of a style in a draw.
    const STYLE_BITS: u32 = 10;
}

/// The step that a truck's traffic is at, and its stream of random numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Clock {
    /// The batch's seed.
    pub seed: u32,
    /// The truck's index in it.
    pub env: u32,
    /// Its episode.
    pub episode: u32,
    /// Step of the episode.
    pub step: u32,
}

impl Clock {
    fn draw(&self, draw: u32) -> [u32; 4] {
        words(self.seed, self.env, self.episode, draw)
    }

    /// Whether and where a car arrives.
    pub(super) fn arrival(&self) -> u32 {
        self.draw(ARRIVAL.wrapping_add(self.step))[0]
    }

    /// Path and style of the car that enters from a source.
    pub(super) fn entering(&self, source: usize) -> [u32; 4] {
        self.draw(ENTERING.wrapping_add(16 * self.step + source as u32))
    }

    /// Which kind of vehicle comes next at a source, behind a car in a slot of some style: the same while it waits for
    /// room, so that none that takes more of it gives way to one that takes less.
    pub(super) fn next_kind(&self, source: usize, slot: u32, style: u32) -> u32 {
        let place = (source as u32 * SLOTS + slot) << STYLE_BITS;
        self.draw(NEXT_KIND.wrapping_add(place + style))[0]
    }

    /// Whether of two cars that stand the one in the lower slot goes first. Both see the same.
    pub(super) fn lower_goes_first(&self, one: u32, other: u32) -> bool {
        let pair = SLOTS * one.min(other) + one.max(other);
        self.draw(COIN.wrapping_add((self.step / COIN_PERIOD) * SLOTS * SLOTS + pair))[0] & 1 == 1
    }

    /// How courteous the car in slot `inside` is to the one in slot `waiting`. Both see the same.
    pub(super) fn courtesy(&self, inside: u32, waiting: u32) -> u32 {
        let pair = SLOTS * inside + waiting;
        self.draw(COURTESY.wrapping_add((self.step / COURTESY_PERIOD) * SLOTS * SLOTS + pair))[0]
    }

    /// How attentive the driver in a slot is. The slots' periods begin one after the other.
    pub(super) fn lapse(&self, slot: u32) -> u32 {
        self.draw(LAPSE.wrapping_add(((self.step + slot) / LAPSE_PERIOD) * SLOTS + slot))[0]
    }
}
