//! Threads that run in step: what a subgroup does when each of its threads has samples of its own to take.

use std::ops::AddAssign;

use offtrack::layout::{N_RAYS, WORKGROUP};
use serde_json::{Value, json};

use crate::field::{Path, Trace};

/// What subgroups do, summed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    /// Times that a subgroup runs its loop.
    pub iterations: usize,
    /// Threads that take a sample in it.
    pub lanes: usize,
    /// Iterations in which some thread reads a cell that is its own block.
    pub own: usize,
    /// Iterations in which some thread reads a block.
    pub block: usize,
    /// Iterations in which some thread reads a second one.
    pub second: usize,
    /// Iterations in which some thread takes another ray.
    pub refills: usize,
}

impl Counts {
    /// An iteration in which the threads take these ways.
    pub fn of(paths: impl Iterator<Item = Path>) -> Counts {
        let mut counts = Counts::default();
        for path in paths {
            counts.iterations = 1;
            counts.lanes += 1;
            match path {
                Path::Own => counts.own = 1,
                Path::Block => counts.block = 1,
                Path::Two => (counts.block, counts.second) = (1, 1),
            }
        }
        counts
    }

    /// Amounts a truck, and threads that are active on average.
    pub fn a_truck(&self, n_trucks: usize) -> Value {
        let a_truck = |count: usize| count as f64 / n_trucks as f64;
        json!({
            "active_threads": self.lanes as f64 / self.iterations as f64,
            "iterations": a_truck(self.iterations),
            "own_cells": a_truck(self.own),
            "blocks": a_truck(self.block),
            "second_blocks": a_truck(self.second),
            "refills": a_truck(self.refills),
        })
    }
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Counts) {
        self.iterations += other.iterations;
        self.lanes += other.lanes;
        self.own += other.own;
        self.block += other.block;
        self.second += other.second;
        self.refills += other.refills;
    }
}

/// A thread for each trace.
pub fn in_step(traces: &[Trace], width: usize) -> Counts {
    let mut counts = Counts::default();
    for subgroup in traces.chunks(width) {
        let longest = subgroup.iter().map(Vec::len).max().unwrap_or(0);
        for turn in 0..longest {
            counts += Counts::of(subgroup.iter().filter_map(|trace| trace.get(turn).copied()));
        }
    }
    counts
}

/// A workgroup for the rays of so many trucks: a thread that is done takes the next ray that waits.
pub fn queued(rays: &[Trace], n_trucks: usize, width: usize) -> Counts {
    let mut counts = Counts::default();
    for queue in rays.chunks(n_trucks * N_RAYS) {
        let mut waiting = queue.iter();
        // For each thread the samples of its ray that it has not taken. The subgroups of a workgroup take turns.
        let mut threads: Vec<std::slice::Iter<Path>> = vec![[].iter(); WORKGROUP as usize];
        loop {
            let before = counts.iterations;
            for subgroup in threads.chunks_mut(width) {
                let mut refilled = false;
                for thread in subgroup.iter_mut().filter(|thread| thread.len() == 0) {
                    if let Some(ray) = waiting.next() {
                        *thread = ray.iter();
                        refilled = true;
                    }
                }
                let mut turn = Counts::of(subgroup.iter_mut().filter_map(|thread| thread.next().copied()));
                turn.refills = usize::from(refilled);
                counts += turn;
            }
            if counts.iterations == before {
                break;
            }
        }
    }
    counts
}
