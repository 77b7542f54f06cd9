//! The parts of a route: entry arm, ring, exit arm; and how wide its lane is on each.

use offtrack::map::Road;
use offtrack::map::route::Route;
use offtrack::scenario::{Place, Scenario};

/// A part of a route.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Entry,
    Ring,
    Exit,
}

/// Stations at which a route's ring and its exit begin (m).
fn ring_and_exit(scenario: &Scenario, route: &Route) -> [f64; 2] {
    [scenario.approach, route.centre_line.length() - scenario.departure]
}

impl Part {
    /// The part of `route` at `station` metres from its beginning. A route that passes outside the ring has no ring.
    pub(super) fn at(scenario: &Scenario, route: &Route, station: f64) -> Part {
        Part::from(ring_and_exit(scenario, route), station)
    }

    /// The part at a station of a route whose ring and exit begin at these (m).
    fn from([ring, exit]: [f64; 2], station: f64) -> Part {
        match station {
            station if station < ring => Part::Entry,
            station if station < exit => Part::Ring,
            _ => Part::Exit,
        }
    }

    /// The part's name in reports.
    pub(super) fn name(self, roundabout: &Road) -> &'static str {
        match self {
            Part::Entry => "entry",
            Part::Ring => roundabout.between_arms(),
            Part::Exit => "exit",
        }
    }
}

/// Half of the width of a route's lane, from its centre to its edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct LaneWidths {
    /// Distance between waypoints (m).
    spacing: f64,
    /// Stations at which the ring and the exit begin (m).
    from: [f64; 2],
    /// Half widths on the entry arm, in the ring, on the exit arm (m).
    half_widths: [f32; 3],
}

impl LaneWidths {
    pub(super) fn of(scenario: &Scenario, place: &Place, route: &Route) -> LaneWidths {
        LaneWidths {
            spacing: scenario.spacing,
            from: ring_and_exit(scenario, route),
            half_widths: place.roundabout.lane_widths(route).map(|width| (0.5 * width) as f32),
        }
    }

    /// The part of the route at `station` metres from its beginning.
    pub(super) fn part(&self, station: f64) -> Part {
        Part::from(self.from, station)
    }

    /// Where `waypoint` is the next one to pass: on the segment that ends there (m).
    pub(super) fn half_width(&self, waypoint: u32) -> f32 {
        let middle = (f64::from(waypoint) - 0.5) * self.spacing;
        self.half_widths[self.from.iter().filter(|&&from| from <= middle).count()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lane_has_the_width_of_the_part_that_a_waypoint_ends() {
        let scenario = Scenario::named("attard2023").unwrap();
        let (place, route) = scenario.routes().map(|(index, route)| (&scenario.places[index], route)).next().unwrap();
        let mut lane = LaneWidths::of(&scenario, place, route);
        lane.half_widths = [1.0, 2.0, 3.0];
        let at = |station: f64| (station / scenario.spacing).ceil() as u32;
        let end = route.centre_line.length();
        // The ring begins 40 m along the route and ends 35 m before its end.
        let parts = [1.0, 39.9, 40.1, end - 34.9].map(|station| lane.part(station));
        assert_eq!(parts, [Part::Entry, Part::Entry, Part::Ring, Part::Exit]);
        let found = [1.0, 38.5, 42.5, end - 38.5, end - 32.5, end + 2.0].map(|station| lane.half_width(at(station)));
        assert_eq!(found, [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
        let parts = [1.0, 39.9, 40.1, end - 35.1, end - 34.9, end].map(|station| Part::at(&scenario, route, station));
        assert_eq!(parts, [Part::Entry, Part::Entry, Part::Ring, Part::Ring, Part::Exit, Part::Exit]);
    }
}
