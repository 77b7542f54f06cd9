//! Tractor-trailers among the cars: what cars see of one, what they do about it, and who is at fault where they touch.
//!
//! A truck is no car of the row: it needs more than its lane, and where it drives is its driver's choice. Cars know it
//! by the ground that both units cover, now and soon, and by its place on its path. Four rules follow from that. Cars
//! follow what is in their corridor, slow for what will be, brake for what they would touch ([`corridor`]), and wait at
//! their line for a truck that has entered, or drives beside it ([`line`]). Who is rude keeps to the first and the
//! third.
//!
//! Cars see a list of trucks, so that several on one road are seen the same way.

mod contact; // who touches whom, and whose fault it is
mod corridor; // rules by the ground that units cover
mod line; // the rule at a car's line
#[cfg(test)]
mod tests;
mod view; // a truck as cars see it

use std::cell::Cell;

pub(super) use contact::printed_constants as printed_contact;
pub use contact::{Contact, ENTERED_BEFORE, Entry, Met, may_be_within, touched, touched_by};
pub(super) use corridor::printed_constants as printed_corridor;
pub(super) use line::printed_constants as printed_line;
pub(super) use view::printed_constants as printed_view;
pub use view::{View, outlines, stretched};

use super::decide::Driver;
use super::units::length;
use super::{Car, Network, Others};
use crate::layout::shared::constants;

constants! {
    /// A truck that comes is this far from where cars enter, or two seconds, when they stay away (2^-10 m).
    const COMING: i32 = length(3.0);
}

/// The trucks of a road, as its cars see them.
#[derive(Debug)]
pub struct Trucks<'a> {
    network: &'a Network,
    views: &'a [Option<View>],
    /// Index of the one that is told whom it hinders.
    own: usize,
    hindered: Cell<u32>,
}

impl<'a> Trucks<'a> {
    /// Trucks on a road, of which some may not be there, and a bit for each slot whose car the one with index `own`
    /// hindered when it last decided.
    pub fn new(network: &'a Network, views: &'a [Option<View>], own: usize, hindered: u32) -> Trucks<'a> {
        Trucks { network, views, own, hindered: Cell::new(hindered) }
    }

    /// A bit for each slot whose car slows for this truck more than for anything else, since it last decided.
    pub fn hindered(&self) -> u32 {
        self.hindered.get()
    }
}

impl Others for Trucks<'_> {
    fn hinder(&self, driver: &mut Driver) {
        // The same car, if this truck were not there.
        let mut without = *driver;
        for (index, view) in self.views.iter().enumerate().filter_map(|(index, view)| Some((index, view.as_ref()?))) {
            let mind = |driver: &mut Driver| {
                line::mind(view, driver);
                corridor::mind(view, driver);
            };
            mind(driver);
            if index != self.own {
                mind(&mut without);
            }
        }
        let bit = 1 << driver.me.slot;
        let others = self.hindered.get() & !bit;
        self.hindered.set(if without.interaction() < driver.interaction() { others | bit } else { others });
    }

    fn ahead(&self, car: &Car) -> Option<(i32, i32)> {
        let of = |view: &View| {
            let is_coming = self.network.paths[view.path].source == self.network.paths[car.path()].source
                && (-COMING - view.way_of_two_seconds()..0).contains(&view.station);
            if is_coming { Some((0, view.speed)) } else { corridor::ahead(view, self.network, car) }
        };
        self.views.iter().flatten().filter_map(of).min_by_key(|&(rear, _)| rear)
    }
}
