//! Post-encroachment times: from when one of a truck and a vehicle has left the place where their paths meet until the
//! other arrives there.
//!
//! The measure is that of B. Allen, B. Shin and P. Cooper, "Analysis of traffic conflicts and collisions",
//! Transportation Research Record 667, 1978. The places are the zones of both paths: where they cross the whole zone,
//! where they run together the point at which that begins. Vehicles of the truck's own arm follow it or lead, and have
//! none with it.

use std::collections::HashMap;

use offtrack::traffic::units::metres;
use offtrack::traffic::{Car, Kind, Network, Row, View, Zone};

/// Stations at which one arrives at the place with its front and has left it with its rear, on either path (m).
#[derive(Debug, Clone, Copy)]
struct Place {
    truck: [f32; 2],
    car: [f32; 2],
}

impl Place {
    /// The place of a zone, if the paths meet there.
    fn of(zone: &Zone) -> Option<Place> {
        let zone = zone.stretch();
        let ends = match zone.kind {
            Kind::Follow => [zone.a_in, zone.b_in],
            Kind::Cross => [zone.a_out, zone.b_out],
            Kind::Soft | Kind::Wide => return None,
        };
        let [truck, car] = [[zone.a_in, ends[0]], [zone.b_in, ends[1]]].map(|stations| stations.map(metres));
        Some(Place { truck, car })
    }
}

/// When a truck and the vehicles have left the places where their paths meet.
#[derive(Debug, Clone)]
pub(crate) struct Encroachments {
    /// Station of the truck's front before the last step (m).
    front: f32,
    /// Station of its rear after each step, at least that after the step before (m).
    rears: Vec<f32>,
    /// The vehicles before the last step.
    cars: Vec<Car>,
    /// The step in which a vehicle left last, by its path and the zone's number.
    left: HashMap<(usize, usize), usize>,
}

impl Encroachments {
    /// At an episode's start.
    pub(crate) fn new() -> Encroachments {
        Encroachments { front: f32::INFINITY, rears: Vec::new(), cars: Vec::new(), left: HashMap::new() }
    }

    /// Adds a step, after which truck and vehicles are these; gives the least post-encroachment time that ends with it,
    /// if one does (steps). It is 0 while both are at a place.
    pub(crate) fn follow(&mut self, network: &Network, view: &View, row: &Row) -> Option<usize> {
        let front = metres(view.station);
        let rear = (front - metres(view.length)).max(self.rears.last().copied().unwrap_or(f32::NEG_INFINITY));
        let now = self.rears.len();
        self.rears.push(rear);
        let mut times = Vec::new();
        let arm = network.source_of(view.path).entry;
        let comes_from_there = |car: &Car| network.source_of(car.path()).entry == arm;
        for (slot, car) in row.cars.iter().enumerate().filter(|(_, car)| car.is_there() && !comes_from_there(car)) {
            // A slot's next car is farther back.
            let is_same = |before: &&Car| before.path() == car.path() && before.station <= car.station;
            let before = self.cars.get(slot).filter(is_same);
            for (number, zone) in network.zones_of(view.path, car.path()).iter().enumerate() {
                let Some(Place { truck: [begins, ends], car: [arrives, leaves] }) = Place::of(zone) else { continue };
                let is_at_place = arrives <= car.station() && rear_of(car) < leaves;
                if is_at_place && begins <= front && rear < ends {
                    times.push(0);
                }
                let Some(before) = before else { continue };
                if before.station() < arrives && arrives <= car.station() && ends <= rear {
                    times.push(now - self.rears.partition_point(|&rear| rear < ends));
                }
                if rear_of(before) < leaves && leaves <= rear_of(car) {
                    self.left.insert((car.path(), number), now);
                }
            }
        }
        // Also behind a vehicle that left in this step.
        for (&(path, number), &left) in &self.left {
            let place = network.zones_of(view.path, path).get(number).and_then(Place::of);
            times.extend(
                place.filter(|place| self.front < place.truck[0] && place.truck[0] <= front).map(|_| now - left),
            );
        }
        self.front = front;
        self.cars = row.cars.to_vec();
        times.into_iter().min()
    }
}

/// Station of a vehicle's rear (m).
fn rear_of(car: &Car) -> f32 {
    car.station() - car.length()
}
