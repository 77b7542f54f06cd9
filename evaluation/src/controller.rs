//! What chooses the actions of an evaluation.

use offtrack::simulator::{Actions, Batch, Error, Simulator};
use offtrack::world::World;

/// Chooses an action for every truck of a batch.
pub trait Controller: Send {
    /// Name for reports: a policy file, a shipped policy, `pursuit` or `random`.
    fn name(&self) -> &str;

    /// Each truck's action, `[n_envs]`: an index into the world's action table or, where the world's actions are
    /// continuous, a command.
    fn choose(&mut self, world: &World, batch: &Batch) -> Actions;

    /// Chooses and makes a step of every truck. The batch's column of actions, or that of commands, has what was chosen
    /// for those that drive.
    ///
    /// # Errors
    ///
    /// As for [`Simulator::step_any`].
    fn step(&mut self, simulator: &mut Simulator) -> Result<(), Error> {
        let world = simulator.world().clone();
        let actions = self.choose(&world, simulator.batch());
        simulator.step_any(&actions)
    }
}
