//! The figures of episodes under way, one a truck, from their starts to their ends.

use offtrack::layout::{Control, Ended, Truck};
use offtrack::physics::{depth_on_apron, seen_by_vehicles};
use offtrack::scenario::Scenario;
use offtrack::simulator::{Error, Simulator};
use offtrack::traffic::Row;
use offtrack::world::World;

use crate::among::Among;
use crate::among::lanes::LanesBeside;
use crate::classes;
use crate::driving::Driving;
use crate::episode::Episode;
use crate::evaluation::routes_of;
use crate::part::LaneWidths;
use crate::running::{Around, Running};
use crate::seen::Seen;

/// The figures of each episode so far.
pub struct Figures<'a> {
    world: &'a World,
    /// Of each route.
    lanes: Vec<LaneWidths>,
    /// Of each route.
    beside: Vec<LanesBeside>,
    per_route: usize,
    running: Vec<Running>,
    finished: Vec<Option<Episode>>,
}

impl<'a> Figures<'a> {
    /// Of trucks at their starts, `per_route` on each of these routes, route by route.
    ///
    /// # Errors
    ///
    /// That of a device that failed.
    pub fn begin(
        scenario: &Scenario,
        world: &'a World,
        routes: &[u32],
        per_route: usize,
        simulator: &Simulator,
    ) -> Result<Figures<'a>, Error> {
        let lane = |(_, place, route)| LaneWidths::of(scenario, place, route);
        let lanes: Vec<LaneWidths> = routes_of(scenario, routes).into_iter().map(lane).collect();
        let seen = Seen::of(simulator)?;
        let has_classes = classes::has_classes(scenario);
        let levels = scenario.traffic.as_ref().map(|traffic| traffic.demand.as_slice());
        let new = |(env, (truck, control)): (usize, (&Truck, &Control))| {
            let driving = has_classes.then(|| Driving::new(truck, control.target_speed));
            let row = seen.cars.as_ref().and_then(|cars| cars.get(env)).map(Row::of);
            let demand = levels.zip(row).and_then(|(levels, row)| levels.get(row.level as usize));
            Running::new(world.rig(truck), truck, driving, demand.map(|&demand| Among::new(demand)), scenario.step)
        };
        Ok(Figures {
            world,
            beside: routes.iter().zip(&lanes).map(|(&route, lane)| LanesBeside::of(world, route, lane)).collect(),
            lanes,
            per_route,
            running: seen.truck.iter().zip(seen.control.iter()).enumerate().map(new).collect(),
            finished: vec![None; simulator.n_envs()],
        })
    }

    /// Adds the last step.
    ///
    /// # Errors
    ///
    /// That of a device that failed.
    pub fn follow(&mut self, simulator: &Simulator) -> Result<(), Error> {
        self.add(&Seen::of(simulator)?);
        Ok(())
    }

    /// Adds the last step, after which this was seen, and gives the number of episodes that it ended.
    pub(crate) fn add(&mut self, seen: &Seen) -> usize {
        let mut n_ended = 0;
        for (env, (running, finished)) in self.running.iter_mut().zip(&mut self.finished).enumerate() {
            if finished.is_some() {
                continue;
            }
            let (truck, route) = (&seen.truck[env], env / self.per_route);
            let view = seen_by_vehicles(self.world, truck, &seen.progress[env]);
            let around = self.world.traffic.as_ref().zip(view).map(|(shared, view)| Around {
                network: &shared.road(self.world, truck.route).network,
                view,
                lanes: &self.beside[route],
            });
            let apron = self.world.has_apron(truck.route).then(|| depth_on_apron(self.world, truck));
            if running.follow(self.world.rig(truck), &self.lanes[route], around.as_ref(), apron, seen, env) {
                *finished = Some(running.finish(Ended::of_column(seen.ended[env])));
                n_ended += 1;
            }
        }
        n_ended
    }

    /// The episodes that have ended, `None` for the others.
    pub(crate) fn finished(&self) -> &[Option<Episode>] {
        &self.finished
    }

    /// The figures of the episodes, all of which have ended.
    pub fn finish(self) -> Vec<Episode> {
        self.finished.into_iter().flatten().collect()
    }
}
