//! What chooses the actions of an evaluation.

use offtrack::simulator::{Batch, Error, Simulator};
use offtrack::world::World;

/// Chooses an action for every truck of a batch.
pub trait Controller: Send {
    /// Name for reports: a policy file, a shipped policy, `pursuit` or `random`.
    fn name(&self) -> &str;

    /// Writes the index of each truck's action in the world's action table, `[n_envs]`.
    fn choose(&mut self, world: &World, batch: &Batch, actions: &mut Vec<u32>);

    /// Chooses and makes a step of every truck. The batch's column of actions has what was chosen for those that drive.
    ///
    /// # Errors
    ///
    /// As for [`Simulator::step`].
    fn step(&mut self, simulator: &mut Simulator) -> Result<(), Error> {
        let (world, mut actions) = (simulator.world().clone(), Vec::new());
        self.choose(&world, simulator.batch(), &mut actions);
        simulator.step(&actions)
    }
}
