//! How many steps an episode may have.

use rayon::prelude::*;

use crate::files::cache::{Loading, Stopped};
use crate::layout::{RouteRow, WaypointRow};
use crate::map::route::Route;
use crate::scenario::{Clock, Scenario};
use crate::vehicle::profile::Profile;

/// Steps after which an episode is timed out, `[n_routes, n_classes]`: multiples of the time that a route takes at the
/// highest target speed, or of that of the feasible profile of the class as its file has it.
pub(super) fn step_limits(
    scenario: &Scenario,
    substep: f32,
    waypoints: &[WaypointRow],
    routes: &[RouteRow],
    loading: &Loading,
) -> Result<Vec<u32>, Stopped> {
    let waiting = scenario.traffic.as_ref().map_or(0.0, |traffic| traffic.waiting);
    let waiting = (waiting / scenario.step).ceil() as u32;
    // Conversions from floats saturate, and so does the sum.
    let steps = |time: f64| ((scenario.time_limit * time / scenario.step).ceil() as u32).saturating_add(waiting);
    match scenario.clock {
        Clock::HighestSpeed => {
            let n_classes = scenario.classes().len();
            let length = |route: &Route| route.centre_line.length();
            // In this order of operations for as long as there have been benchmarks.
            let limit = |route| {
                let steps = scenario.time_limit * length(route) / (scenario.cruising_speed() * scenario.step);
                (steps.ceil() as u32).saturating_add(waiting)
            };
            Ok(scenario.routes().flat_map(|(_, route)| std::iter::repeat_n(limit(route), n_classes)).collect())
        }
        Clock::Feasible => {
            let rigs = scenario.typical_rigs(substep);
            let fastest = scenario.cruising_speed();
            let of_route = |route: &RouteRow| {
                let waypoints = &waypoints[route.first as usize..][..route.n_waypoints as usize];
                loading.check()?;
                Ok(rigs.iter().map(|rig| steps(Profile::of(rig, waypoints, fastest).time)).collect())
            };
            Ok(routes.par_iter().map(of_route).collect::<Result<Vec<Vec<u32>>, Stopped>>()?.concat())
        }
    }
}
