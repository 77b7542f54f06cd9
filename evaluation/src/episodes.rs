//! One episode a truck, on stated routes, until every one has ended: what an evaluation counts, from the command line
//! and from Python.

use std::sync::Arc;

use offtrack::layout::Ended;
use offtrack::simulator::{Engine, Error, RouteChoice, Simulator, check_size};
use offtrack::world::World;

use crate::seen;

/// Episodes under way, one a truck.
#[derive(Debug)]
pub struct Episodes {
    simulator: Simulator,
}

impl Episodes {
    /// `per_route` episodes on each of these routes of the world, route by route. Episode `i` has the first start of
    /// the stream (`seed`, `i`).
    ///
    /// # Errors
    ///
    /// As for [`Simulator::on`].
    pub fn begin(
        engine: Engine,
        world: Arc<World>,
        routes: &[u32],
        per_route: usize,
        seed: u32,
    ) -> Result<Episodes, Error> {
        let group = world.group();
        if 1 < group {
            return Err(Error::NotInGroups { what: "an evaluation, whose trucks drive alone", group });
        }
        // Before the list of them is made: many would not fit into memory either.
        check_size(routes.len().saturating_mul(per_route))?;
        let trucks: Vec<u32> = routes.iter().flat_map(|&route| std::iter::repeat_n(route, per_route)).collect();
        Ok(Episodes { simulator: Simulator::on(engine, world, trucks.len(), seed, RouteChoice::Fixed(trucks))? })
    }

    /// The trucks at their starts.
    pub fn simulator(&self) -> &Simulator {
        &self.simulator
    }

    /// The trucks at their starts, for a caller who steps them otherwise.
    pub fn into_simulator(self) -> Simulator {
        self.simulator
    }

    /// Calls `step` until every episode has ended, and gives the end of each. `step` chooses an action for each truck
    /// and steps the simulator once. A truck is held where its episode ended, whatever action it is given.
    ///
    /// # Errors
    ///
    /// The first one of `step`, or that of a device that failed.
    pub fn drive<E: From<Error>>(
        mut self,
        mut step: impl FnMut(&mut Simulator) -> Result<(), E>,
    ) -> Result<Vec<Ended>, E> {
        while seen::ended(&self.simulator)?.contains(&(Ended::Running as u32)) {
            step(&mut self.simulator)?;
        }
        // A device that failed in the last step reports it here.
        self.simulator.wait()?;
        let codes = seen::ended(&self.simulator)?;
        Ok(codes.iter().map(|&code| Ended::of_column(code)).collect())
    }
}
