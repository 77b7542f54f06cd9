//! Drives the sequences of a certificate again, in one batch of the simulator: no claim of the file is believed
//! unchecked.

use std::path::Path;
use std::sync::Arc;

use offtrack::layout::{Ended, Start, Truck};
use offtrack::simulator::{self, Batch, RouteChoice, Simulator};
use offtrack::world::World;

use super::file::{self, Certificate};
use crate::error::Error;

/// One sequence to drive.
#[derive(Debug, Clone)]
pub struct Sequence {
    /// Index of the route in the world.
    pub route: u32,
    /// Where the truck begins.
    pub start: Start,
    /// The truck's action at each step.
    pub actions: Vec<u32>,
}

/// Drives sequences in one batch and gives the end code of each at its last step.
pub fn driven(world: &Arc<World>, sequences: &[Sequence]) -> Result<Vec<Ended>, simulator::Error> {
    // A truck drives on after its sequence, so its end code is taken at the sequence's last step.
    let mut ended = vec![Ended::Running; sequences.len()];
    follow(world, sequences, |index, batch| ended[index] = Ended::of_column(batch.ended[index]))?;
    Ok(ended)
}

/// Drives sequences in one batch. `seen` is called with the index of a sequence and the batch, whose truck of that
/// index drives it: at its start and after each of its steps.
pub fn follow(
    world: &Arc<World>,
    sequences: &[Sequence],
    mut seen: impl FnMut(usize, &Batch),
) -> Result<(), simulator::Error> {
    if sequences.is_empty() {
        return Ok(());
    }
    let routes: Vec<u32> = sequences.iter().map(|sequence| sequence.route).collect();
    let starts: Vec<Start> = sequences.iter().map(|sequence| sequence.start).collect();
    let mut simulator = Simulator::new(world.clone(), routes.len(), 0, RouteChoice::Fixed(routes))?;
    simulator.reset_from(&starts)?;
    for index in 0..sequences.len() {
        seen(index, simulator.batch());
    }
    for step in 0..sequences.iter().map(|sequence| sequence.actions.len()).max().unwrap_or(0) {
        let actions: Vec<u32> =
            sequences.iter().map(|sequence| sequence.actions.get(step).copied().unwrap_or(0)).collect();
        simulator.step(&actions)?;
        for (index, sequence) in sequences.iter().enumerate() {
            if step < sequence.actions.len() {
                seen(index, simulator.batch());
            }
        }
    }
    Ok(())
}

/// Drives the sequences of the routes that `wanted` accepts and gives them, or the first that does not arrive as an
/// error. Every such route must be one of the world's. They come in the order of the file: routes, and starts of each.
pub fn verify(
    certificate: &Certificate,
    world: &Arc<World>,
    path: &Path,
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<Sequence>, Error> {
    let wrong = |message: String| Error::contents(path, message);
    let mut sequences = Vec::new();
    for route in certificate.routes.iter().filter(|route| wanted(&route.name)) {
        let index = world.route_names.iter().position(|name| *name == route.name);
        let index =
            index.ok_or_else(|| wrong(format!("has a route {} that the benchmark does not have", route.name)))?;
        for (found, &[offset, heading]) in
            route.found.iter().zip(&certificate.starts).filter(|(found, _)| found.arrived())
        {
            let damaged = |message| wrong(format!("is a damaged certificate: {}: {message}", route.name));
            // Beyond the last step of an episode no action changes the outcome.
            let limit = world.most_steps(&Truck { route: index as u32, ..Truck::default() });
            let actions = file::actions(&found.actions, world.params.n_actions, limit).map_err(damaged)?;
            sequences.push(Sequence {
                route: index as u32,
                start: Start { offset, heading, ..Start::default() },
                actions,
            });
        }
    }
    let ended = driven(world, &sequences).map_err(|error| match error {
        simulator::Error::UnknownStart { .. } => wrong(format!("is a damaged certificate: {error}")),
        error => error.into(),
    })?;
    for (sequence, &ended) in sequences.iter().zip(&ended) {
        if ended != Ended::Arrived {
            return Err(Error::NotVerified {
                file: path.to_owned(),
                route: world.route_names[sequence.route as usize].clone(),
                start: [sequence.start.offset, sequence.start.heading],
                ended: ended.name(),
            });
        }
    }
    Ok(sequences)
}
