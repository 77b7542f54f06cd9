//! What a truck was asked for and does not do yet, where it answers late.

use offtrack::layout::{Control, Rig};
use offtrack::world::World;

use super::beam::STEER_BIN;

/// Steps that a delay of steering, or of actions, reaches back to at most.
const STEPS: usize = 3;

/// Cell of what is pending: the actions on their way, each by its word, and then the steer angles that the front axle
/// does not follow yet. What is not pending has a 0.
pub(super) type Cell = [i32; 2 * STEPS];

/// What a truck of `rig` was asked for by `control` and does not do yet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pending<'a> {
    world: &'a World,
    rig: &'a Rig,
    control: &'a Control,
}

impl<'a> Pending<'a> {
    /// Of a truck after a step, by its control in that step.
    pub(super) fn new(world: &'a World, rig: &'a Rig, control: &'a Control) -> Pending<'a> {
        Pending { world, rig, control }
    }

    /// Trucks alike in all else go on alike if this is equal.
    pub(super) fn cell(&self) -> Cell {
        let mut cell = [0; 2 * STEPS];
        let words = self.words().into_iter().take(self.late_actions()).map(|word| word as i32);
        cell.iter_mut().zip(words).for_each(|(cell, word)| *cell = word);
        let late = self.rig.steer_delay.div_ceil(self.world.params.n_substeps) as usize;
        let angles = self.angles().into_iter().take(late).map(|angle| (angle / STEER_BIN).round() as i32);
        cell[STEPS..].iter_mut().zip(angles).for_each(|(cell, angle)| *cell = angle);
        cell
    }

    /// Steer angle that the front axle has once all of that has taken effect, from `steering` on (rad).
    pub(super) fn followed(&self, steering: f32) -> f32 {
        let (n_substeps, late) = (self.world.params.n_substeps, self.late_actions());
        // By how many steps ago it was asked for: the actions on their way, then what the axle follows late.
        let asked = |steps: usize| match steps.checked_sub(late + 1) {
            Some(before) => self.angles()[before],
            None => match self.words()[steps - 1] {
                0 => 0.0,
                word => self.world.actions[word as usize - 1].steering,
            },
        };
        let reach = self.rig.steer_rate * self.world.params.substep;
        let delay = late as u32 * n_substeps + self.rig.steer_delay;
        (1..=delay).rev().fold(steering, |steering, ago| {
            asked(ago.div_ceil(n_substeps) as usize).clamp(steering - reach, steering + reach)
        })
    }

    /// Number of steps by which actions come late.
    fn late_actions(&self) -> usize {
        self.world.disturbances.action_delay as usize
    }

    /// Actions asked for, latest first.
    fn words(&self) -> [u32; STEPS] {
        let Control { action_before, action_earlier, action_earliest, .. } = *self.control;
        [action_before, action_earlier, action_earliest]
    }

    /// Steer angles that the axle was to have, latest first.
    fn angles(&self) -> [f32; STEPS] {
        let Control { steering, steering_before, steering_earlier, .. } = *self.control;
        [steering, steering_before, steering_earlier]
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use offtrack::layout::Start;
    use offtrack::scenario::Scenario;
    use offtrack::simulator::{RouteChoice, Simulator};

    use super::*;
    use crate::certificate::beam::{Pass, search};

    /// One route for trucks that answer to a steer angle so late (s), and to an action so late (steps).
    fn late(steering: f64, action: u32) -> Arc<World> {
        let mut scenario = Scenario::named("attard2023").unwrap();
        scenario.retain(|_, route| route.name == "20m/N-right-1");
        scenario.vehicle.model.steer_delay = steering;
        scenario.disturbances.action_delay = [action; 2];
        Arc::new(World::bake(&scenario).unwrap())
    }

    #[test]
    fn what_was_asked_for_is_what_the_axle_follows_whatever_is_asked_for_next() {
        for (steering, action, steps) in [(0.0, 0, 0), (0.2, 0, 2), (0.3, 0, 3), (0.0, 3, 3), (0.1, 2, 3), (0.3, 3, 6)]
        {
            let world = late(steering, action);
            let mut simulator = Simulator::new(world.clone(), 9, 0, RouteChoice::Fixed(vec![0; 9])).unwrap();
            simulator.reset_from(&[Start::default(); 9]).unwrap();
            let followed = |simulator: &Simulator, env: usize| {
                let batch = simulator.batch();
                let pending = Pending::new(&world, &world.rigs[0], &batch.control[env]);
                (pending.followed(batch.truck[env].steering), pending.cell())
            };
            for action in [8, 0, 5, 3, 7, 2, 6] {
                simulator.step(&[action; 9]).unwrap();
                let (expected, cell) = followed(&simulator, 0);
                assert_eq!(cell != Cell::default(), steps != 0, "{steering} s, {action}");
                let mut copies = Simulator::new(world.clone(), 9, 0, RouteChoice::Fixed(vec![0; 9])).unwrap();
                copies.restore(|column| Some(simulator.batch().column(column))).unwrap();
                for _ in 0..steps {
                    copies.step(&(0..9).collect::<Vec<u32>>()).unwrap();
                }
                for (env, truck) in copies.batch().truck.iter().enumerate() {
                    assert!((truck.steering - expected).abs() < 1e-6, "{steering} s, {action}, {env}: {expected}");
                }
            }
        }
    }

    #[test]
    fn a_route_is_completed_by_trucks_that_answer_as_late_as_an_action_is_held() {
        // Where trucks answer late, candidates that do alike yet share the beam.
        let width = 512;
        for (steering, action, hold) in
            [(0.0, 0, 1), (0.1, 0, 1), (0.3, 0, 1), (0.3, 0, 3), (0.0, 1, 1), (0.0, 3, 1), (0.0, 3, 3), (0.3, 3, 3)]
        {
            let outcome = search(&late(steering, action), 0, &Start::default(), Pass { width, hold }, None).unwrap();
            assert!(!outcome.actions.is_empty(), "{steering} s, {action}, held {hold}: {outcome:?}");
        }
    }
}
