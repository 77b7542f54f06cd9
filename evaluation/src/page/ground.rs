//! Roundabouts, routes, truck and episodes, as the page's scripts read them.

use std::collections::HashMap;

use crate::recording::{self, Class, Measures, Track};
use offtrack::map::Road;
use offtrack::map::route::Route;
use offtrack::scenario::Scenario;
use offtrack::world::World;
use serde::Serialize;
use serde_json::Value;

use super::tracks::Column;
use super::vehicles::Vehicles;
use crate::provenance;

/// Points of a line in whole centimetres: x and y of the first one, then of each the differences to the one before.
type Line = Vec<i64>;

/// See the module.
#[derive(Serialize)]
pub(super) struct Ground<'a> {
    /// Time between two frames (s).
    step: f64,
    /// Length of a route before its ring, and after it (m).
    approach: f64,
    departure: f64,
    /// Measures of the trucks that are shown, each once.
    vehicles: Vec<Measures>,
    /// Names of vehicle and load; empty where the benchmark has one vehicle.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    classes: Vec<Class>,
    n_rays: usize,
    maps: Vec<Map>,
    routes: Vec<RouteLine<'a>>,
    /// Name and unit of each column of the recorded episodes, in the order of the data.
    columns: Vec<(&'a str, f64)>,
    episodes: Vec<Episode>,
    /// Other vehicles, whose bytes stand behind those of the columns.
    #[serde(skip_serializing_if = "Option::is_none")]
    others: Option<Vehicles>,
    /// The report's routes where it does not have them itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) route_reports: Option<Value>,
    machine: String,
    commit: String,
}

#[derive(Serialize)]
struct Map {
    /// What lies between the arms: "ring" or "junction".
    between_arms: &'static str,
    drivable: Vec<Line>,
    lanes: Vec<Line>,
}

#[derive(Serialize)]
struct RouteLine<'a> {
    name: &'a str,
    /// Index into `maps`.
    roundabout: usize,
    centre_line: Line,
}

#[derive(Serialize)]
struct Episode {
    /// Index into `routes`.
    route: usize,
    /// Which of the route's episodes, from 0.
    number: usize,
    /// Index into `vehicles`.
    #[serde(skip_serializing_if = "is_first")]
    vehicle: usize,
    /// Index into `classes`.
    #[serde(skip_serializing_if = "Option::is_none")]
    class: Option<usize>,
    ended: &'static str,
    /// One for the start and one for each step.
    n_frames: usize,
}

/// The episodes that a page shows.
pub(super) struct Shown<'a> {
    pub(super) scenario: &'a Scenario,
    pub(super) world: &'a World,
    /// Name of each route of the evaluation.
    pub(super) routes: Vec<&'a str>,
    /// Episodes of the evaluation on each.
    pub(super) per_route: usize,
    /// Those shown; `env` is the index of an episode among all.
    pub(super) tracks: &'a [Track],
}

impl<'a> Ground<'a> {
    /// Of the episodes that a page shows.
    pub(super) fn of(page: &Shown<'a>, columns: &'a [Column], others: Option<Vehicles>) -> Ground<'a> {
        let per_route = page.per_route;
        let by_name: HashMap<&str, (usize, &Route)> =
            page.scenario.routes().map(|(place, route)| (route.name.as_str(), (place, route))).collect();
        // Places and routes in the order of their first episodes.
        let (mut places, mut shown): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
        let (mut routes, mut episodes) = (Vec::new(), Vec::new());
        let mut fleet = Fleet::default();
        for track in page.tracks {
            let index = track.env / per_route;
            let (place, route) = by_name[page.routes[index]];
            if shown.last() != Some(&index) {
                shown.push(index);
                if places.last() != Some(&place) {
                    places.push(place);
                }
                routes.push(RouteLine {
                    name: &route.name,
                    roundabout: places.len() - 1,
                    centre_line: line(&recording::centre_line(&page.scenario.places[place].roundabout, route)),
                });
            }
            let (route, number) = (routes.len() - 1, track.env % per_route);
            let (vehicle, class) = fleet.index(page.world, track.vehicle, &page.scenario.places[place].roundabout);
            episodes.push(Episode {
                route,
                number,
                vehicle,
                class,
                ended: track.ended.name(),
                n_frames: track.frames.len(),
            });
        }
        let map = |&place: &usize| {
            let roundabout = &page.scenario.places[place].roundabout;
            let map = recording::Map::of(roundabout, page.scenario.gutter);
            Map { between_arms: roundabout.between_arms(), drivable: lines(&map.drivable), lanes: lines(&map.lanes) }
        };
        Ground {
            step: page.scenario.step,
            approach: page.scenario.approach,
            departure: page.scenario.departure,
            vehicles: fleet.vehicles,
            classes: fleet.classes,
            n_rays: page.world.rays[0].len(),
            maps: places.iter().map(map).collect(),
            routes,
            columns: columns.iter().map(|column| (column.name.as_str(), column.unit)).collect(),
            episodes,
            others,
            route_reports: None,
            machine: provenance::machine(),
            commit: provenance::commit(),
        }
    }
}

/// The trucks that are shown.
#[derive(Default)]
struct Fleet {
    vehicles: Vec<Measures>,
    classes: Vec<Class>,
    /// Indices of a row of the world's `rigs`, once it was met, by the hand of the road.
    met: HashMap<(u32, bool), (usize, Option<usize>)>,
}

impl Fleet {
    /// Indices of a row of the world's `rigs` on a road into `vehicles` and `classes`. Trucks that differ in their load
    /// alone have the same dimensions.
    fn index(&mut self, world: &World, row: u32, road: &Road) -> (usize, Option<usize>) {
        let Fleet { vehicles, classes, met } = self;
        *met.entry((row, road.is_mirrored())).or_insert_with(|| {
            let class = Class::of(world, row).map(|class| position(classes, class));
            (position(vehicles, Measures::of(world, row).seen(road)), class)
        })
    }
}

/// The index of an item, which is added where it is new.
fn position<T: PartialEq>(items: &mut Vec<T>, item: T) -> usize {
    items.iter().position(|known| *known == item).unwrap_or_else(|| {
        items.push(item);
        items.len() - 1
    })
}

fn is_first(index: &usize) -> bool {
    *index == 0
}

fn lines(polygons: &[Vec<[f64; 2]>]) -> Vec<Line> {
    polygons.iter().map(|points| line(points)).collect()
}

fn line(points: &[[f64; 2]]) -> Line {
    let mut before = [0; 2];
    let mut differences = Vec::with_capacity(2 * points.len());
    for point in points {
        let here = point.map(|value| (100.0 * value).round() as i64);
        differences.extend([here[0] - before[0], here[1] - before[1]]);
        before = here;
    }
    differences
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_its_first_point_and_differences_that_do_not_add_up_their_rounding() {
        assert_eq!(line(&[[1.0, -2.0], [1.004, -2.5], [1.008, -2.5], [1.012, 0.0]]), [100, -200, 0, -50, 1, 0, 0, 250]);
    }
}
