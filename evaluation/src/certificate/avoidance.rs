//! Searches from before a contact with another vehicle for actions after which the truck touches nothing: a beam over
//! the action table.
//!
//! Candidates are copies of the truck and of the vehicles around it. All draw from the stream of the episode, so that
//! vehicles come and react as they would have in it.

use std::sync::Arc;

use bytemuck::bytes_of;
use offtrack::layout::{Ended, Rig, Start, Stream, Truck};
use offtrack::simulator::{self, Batch, Engine, RouteChoice, Simulator};
use offtrack::traffic::car::Outline;
use offtrack::traffic::{Row, outlines};
use offtrack::world::World;

use super::beam::{Candidate, Pass, ROOT, branched, cost, nearest_to_straight, selected};
use crate::error::Error;

/// Room to other vehicles before and behind each unit, and beside it, without which a candidate has a cost (m).
const ROOM_ALONG: f32 = 3.0;
const ROOM_BESIDE: f32 = 0.5;
/// Cost of a step without that room; that of touching a kerb is 1.
const ROOM_WEIGHT: f32 = 0.5;

/// An episode that a contact ended.
#[derive(Debug, Clone, Copy)]
pub struct Contact<'a> {
    /// What the episode's vehicles were drawn from.
    pub stream: Stream,
    /// Index of the route in the world.
    pub route: u32,
    /// Where the truck began.
    pub start: Start,
    /// Its action at each step.
    pub actions: &'a [u32],
    /// The end.
    pub ended: Ended,
    /// The truck after its last step.
    pub last: Truck,
}

/// What drives a contact's episode again.
#[derive(Debug, Clone, Copy)]
pub struct Again<'a> {
    /// The world that it was driven in.
    pub world: &'a Arc<World>,
    /// The engine that it was driven on.
    pub engine: &'a Engine,
    /// The episode.
    pub contact: Contact<'a>,
}

impl Again<'_> {
    /// Whether the recorded actions give the recorded end to the last bit, `step` steps from the start on in a copy of
    /// the truck and its vehicles.
    pub fn is_the_same(&self, step: usize) -> Result<bool, Error> {
        let mut copies = self.after(step)?;
        self.gather(&mut copies, &[0, 0])?;
        for &action in &self.contact.actions[step..] {
            copies.step(&[action; 2])?;
        }
        let Batch { ended, truck, .. } = copies.batch();
        let Contact { ended: end, last, .. } = &self.contact;
        Ok(ended.iter().zip(truck).all(|(&ended, truck)| ended == *end as u32 && bytes_of(truck) == bytes_of(last)))
    }

    /// Whether the truck still drives after these actions from its start on, has arrived, or has driven until its time
    /// was over.
    pub fn comes_through(&self, actions: &[u32]) -> Result<bool, Error> {
        let mut copies = self.begun()?;
        actions.iter().try_for_each(|&action| copies.step(&[action]))?;
        Ok(copies.batch().ended[0] == Ended::Running as u32 || is_over(copies.batch().ended[0]))
    }

    /// Searches for actions from `step` steps after the start on after which the truck still drives `until` steps after
    /// its start, or its episode has ended without a failure: none where a beam finds none. Beside it are the env steps
    /// of the search.
    pub fn avoided(&self, step: usize, until: usize, pass: Pass) -> Result<(Option<Vec<u32>>, u64), Error> {
        let recorded = &self.contact.actions[step..];
        let straight = nearest_to_straight(self.world);
        let mut copies = self.after(step)?;
        let mut env_steps = 0;
        // The first candidate goes on as the episode did.
        let mut beam = vec![Candidate { parent: ROOT, actions: Vec::new(), held: None, cost: 0.0 }];
        for depth in (0..until - step).step_by(pass.hold) {
            let (rows, mut children) = branched(self.world, copies.batch(), &beam, straight, pass.hold);
            self.gather(&mut copies, &rows)?;
            for depth in depth..(depth + pass.hold).min(until - step) {
                let as_recorded = recorded.get(depth).copied().unwrap_or(straight);
                let actions: Vec<u32> = children.iter().map(|child| child.held.unwrap_or(as_recorded)).collect();
                env_steps += copies.batch().truck.iter().filter(|truck| truck.held == 0).count() as u64;
                copies.step(&actions)?;
                let batch = copies.batch();
                for (env, child) in children.iter_mut().enumerate().filter(|&(env, _)| batch.truck[env].held == 0) {
                    let near = if self.lacks_room(batch, env) { ROOM_WEIGHT } else { 0.0 };
                    child.follow(actions[env], cost(self.world, batch, env, 0.0) + near);
                }
                if let Some(env) = batch.ended.iter().position(|&ended| is_over(ended)) {
                    children[env].actions.push(actions[env]);
                    return Ok((Some(children.swap_remove(env).actions), env_steps));
                }
            }
            let survivors = selected(self.world, copies.batch(), &children, pass.width);
            if survivors.is_empty() {
                return Ok((None, env_steps));
            }
            self.gather(&mut copies, &survivors)?;
            beam = survivors.iter().map(|&row| children[row as usize].clone()).collect();
        }
        Ok((beam.into_iter().next().map(|candidate| candidate.actions), env_steps))
    }

    /// One truck at the episode's start.
    fn begun(&self) -> Result<Simulator, simulator::Error> {
        let Contact { stream, route, start, .. } = self.contact;
        let choice = RouteChoice::Fixed(vec![route]);
        let mut simulator = Simulator::on(self.engine.clone(), self.world.clone(), 1, stream.seed, choice)?;
        simulator.set_streams(&[stream])?;
        simulator.reset_from(&[start])?;
        Ok(simulator)
    }

    /// The truck so many recorded steps later.
    fn after(&self, step: usize) -> Result<Simulator, simulator::Error> {
        let mut simulator = self.begun()?;
        self.contact.actions[..step].iter().try_for_each(|&action| simulator.step(&[action]))?;
        Ok(simulator)
    }

    /// Makes copies go on from these rows, each in the stream of the episode.
    fn gather(&self, copies: &mut Simulator, rows: &[u32]) -> Result<(), simulator::Error> {
        copies.gather(rows)?;
        copies.set_streams(&vec![self.contact.stream; rows.len()])
    }

    /// Whether a vehicle is in the room around a truck.
    fn lacks_room(&self, batch: &Batch, env: usize) -> bool {
        let (Some(traffic), Some(words)) = (&self.world.traffic, batch.cars.get(env)) else { return false };
        let truck = &batch.truck[env];
        let network = &traffic.road(self.world, truck.route).network;
        let units = roomy(self.world.rig(truck), truck);
        let mut cars = Row::of(words).cars.iter().filter(|car| car.is_there()).flat_map(|car| car.outlines(network));
        cars.any(|car| units.iter().any(|unit| unit.overlaps(&car)))
    }
}

/// Whether an episode has ended without a failure: the truck has arrived, or its time is over.
fn is_over(ended: u32) -> bool {
    [Ended::Arrived, Ended::TimedOut].map(|end| end as u32).contains(&ended)
}

/// Both units with the room around them.
fn roomy(rig: &Rig, truck: &Truck) -> [Outline; 2] {
    outlines(rig, truck).map(|unit| Outline {
        half_length: unit.half_length + ROOM_ALONG,
        half_width: unit.half_width + ROOM_BESIDE,
        ..unit
    })
}
