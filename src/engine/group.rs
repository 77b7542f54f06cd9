//! Trucks that share a road and its vehicles: a group of neighbours in the batch.
//!
//! All trucks of a group go through a stage before any goes through the next, so that each reads where the others are
//! after the same stage. Each has the group's vehicles in a row of its own, and finds the same of them as the others:
//! nothing is written that another truck reads in the same stage. Their episodes begin together, once all have ended;
//! until then the trucks whose episodes have ended are taken away.

use rayon::prelude::*;

use super::batch::Block;
use super::cpu::{entry, reset};
use super::stages::Stage;
use super::{Autoreset, Batch, RouteChoice, Row, Tally};
use crate::layout::{BEGINS, BeginRow, Ended, MOST_IN_GROUP, Progress, Stream, Truck};
use crate::world::World;

/// A truck as the others of its group read it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mate {
    /// The truck's index in the batch.
    pub env: u32,
    /// What its episodes are drawn from.
    pub stream: Stream,
    /// Where it is.
    pub truck: Truck,
    /// Where it is on its route.
    pub progress: Progress,
    /// Why its episode ended.
    pub ended: u32,
    /// The step of the episode in which it entered, plus 1; 0 before.
    pub entered: u32,
}

impl Mate {
    /// Whether it is on the road: a truck whose episode has ended is taken away until its group begins another one.
    pub fn is_there(&self) -> bool {
        self.truck.held == 0
    }
}

/// The trucks of a group while they go through a step.
struct Group<'a, 'b> {
    block: &'a mut Block<'b>,
    /// Its trucks are `n` in the order of the block from this one on.
    first: usize,
    n: usize,
    /// How they were when they were last looked at; of `n` the first.
    mates: [Mate; MOST_IN_GROUP],
    tally: Tally,
}

impl Group<'_, '_> {
    /// Looks at how the trucks are.
    fn look(&mut self) {
        self.mates = seen(self.block, self.first, self.n);
    }

    /// Works on each truck, with what was last seen of the others.
    fn each(&mut self, mut work: impl FnMut(&mut Row)) {
        for n in self.first..self.first + self.n {
            let mut row = self.block.row(self.block.places[n], &self.mates[..self.n]);
            work(&mut row);
            self.tally = self.tally.plus(row.tally);
        }
    }

    /// Begins episodes of these trucks.
    fn begin(&mut self, world: &World, begins: impl Fn(&Row) -> BeginRow, has_last_step: bool) {
        self.each(|row| reset::put(world, row, &begins(row)));
        self.look();
        self.each(|row| {
            reset::look(world, row);
            if !has_last_step {
                reset::forget(row);
            }
        });
    }

    /// Begins the next episodes where all have ended, or holds those whose episodes have.
    fn reset(&mut self, world: &World) {
        let autoreset = self.block.autoreset;
        let has_ended = |mate: &Mate| !mate.is_there() || mate.ended != Ended::Running as u32;
        let mates = &self.mates[..self.n];
        let begins = match autoreset {
            Autoreset::SameStep => mates.iter().all(has_ended),
            Autoreset::NextStep => !mates.iter().any(Mate::is_there),
            Autoreset::Disabled => false,
        };
        if begins {
            self.begin(world, |_| reset::NEXT, autoreset == Autoreset::SameStep);
        } else {
            self.each(|row| row.truck.held = u32::from(row.truck.held == 1 || *row.ended != Ended::Running as u32));
        }
    }
}

/// How the `n` trucks of a group are, from a place in the order of a block on; the last one fills the rest.
fn seen(block: &Block, first: usize, n: usize) -> [Mate; MOST_IN_GROUP] {
    std::array::from_fn(|index| block.mate(block.places[first + index.min(n - 1)]))
}

/// Does stages to every truck that is not held, and resets the groups.
pub(super) fn run_all(world: &World, batch: &mut Batch, stages: &[Stage]) {
    let tally = on_groups(world, batch, |group| {
        for &stage in stages {
            group.look();
            if stage == Stage::Reset {
                group.reset(world);
            } else {
                group.each(|row| {
                    if row.truck.held == 0 {
                        entry(stage)(world, row);
                    }
                });
            }
        }
    });
    batch.tally = batch.tally.plus(tally);
}

/// Begins an episode of the groups that the caller says, each as a whole.
pub(super) fn begin_all(world: &World, batch: &mut Batch, begins: &[BeginRow]) {
    on_groups(world, batch, |group| {
        if group.mates[..group.n].iter().all(|mate| begins[mate.env as usize].what & BEGINS != 0) {
            group.begin(world, |row| begins[row.env as usize], false);
        }
    });
}

/// Works on every group, on all cores; returns what the rows add to the tally.
fn on_groups(world: &World, batch: &mut Batch, work: impl Fn(&mut Group) + Sync) -> Tally {
    let n = world.group();
    let tallies = batch.blocks(world).map(|mut block| {
        let mut tally = Tally::default();
        for first in (0..block.places.len()).step_by(n) {
            let mates = seen(&block, first, n);
            let mut group = Group { block: &mut block, first, n, mates, tally };
            work(&mut group);
            tally = group.tally;
        }
        tally
    });
    tallies.reduce(Tally::default, Tally::plus)
}

/// The route of a truck's episode: that of the group's first truck is drawn from all, those of the others from what
/// begins on another arm of its road than theirs before it, or at least in another lane.
pub(super) fn route_of(world: &World, routes: &[u32], row: &Row, episode: u32) -> u32 {
    let drawn = |mate: &Mate, n: usize| reset::drawn_below(mate.stream, episode, n);
    let first = routes[drawn(&row.mates[0], routes.len())];
    let road = |route: u32| world.routes[route as usize].roundabout;
    // Those on its road that begin on none of these arms and in none of these lanes.
    let free = |arms: u32, lanes: u32| {
        let is_free = move |&route: &u32| {
            let [arm, lane] = begins_in(world, route);
            arms >> arm & 1 == 0 && lanes >> lane & 1 == 0
        };
        routes.iter().copied().filter(move |&route| road(route) == road(first)).filter(is_free)
    };
    let (mut route, mut arms, mut lanes) = (first, 0, 0);
    for mate in row.mates.iter().take_while(|mate| mate.env <= row.env).skip(1) {
        let [arm, lane] = begins_in(world, route);
        (arms, lanes) = (arms | 1 << arm, lanes | 1 << lane);
        let taken = if free(arms, 0).next().is_some() { [arms, 0] } else { [0, lanes] };
        let free = || free(taken[0], taken[1]);
        // The batch was made with as many lanes as trucks.
        route = free().nth(drawn(mate, free().count())).unwrap_or(first);
    }
    route
}

/// Whether some trucks of the row's group, one of which begins on this route, begin on one arm: there are more of them
/// than arms.
pub(super) fn shares_arms(world: &World, row: &Row, route: u32) -> bool {
    if row.mates.is_empty() {
        return false;
    }
    let road = |route: u32| world.routes[route as usize].roundabout;
    let n = row.mates.len();
    match row.choice {
        RouteChoice::Fixed(routes) => exceed_arms(world, n, row.mates.iter().map(|mate| routes[mate.env as usize])),
        RouteChoice::Drawn(routes) => {
            exceed_arms(world, n, routes.iter().copied().filter(|&other| road(other) == road(route)))
        }
    }
}

/// Whether there are more trucks than arms on which these routes begin.
pub(crate) fn exceed_arms(world: &World, n_trucks: usize, routes: impl Iterator<Item = u32>) -> bool {
    let arms = routes.fold(0u32, |arms, route| arms | 1 << begins_in(world, route)[0]);
    (arms.count_ones() as usize) < n_trucks
}

/// Where a route begins among other vehicles: index of the arm, and of the lane among all of the road; zeros where
/// there are none.
pub(crate) fn begins_in(world: &World, route: u32) -> [u32; 2] {
    let Some(traffic) = &world.traffic else { return [0; 2] };
    let network = &traffic.road(world, route).network;
    let source = network.paths[traffic.routes[route as usize].path as usize].source;
    [network.sources[source as usize].entry, source]
}

/// Number of lanes in which some routes of a road begin.
pub(crate) fn n_lanes(world: &World, routes: impl IntoIterator<Item = u32>) -> usize {
    let lanes = routes.into_iter().fold(0u32, |lanes, route| lanes | 1 << begins_in(world, route)[1]);
    lanes.count_ones() as usize
}
