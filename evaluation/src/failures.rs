//! Why episodes did not arrive: which unit touched which kerb where, or what else ended them.
//!
//! A collision's kerb is the one nearest to the point of the unit that is deepest in the solid area after the last
//! step.

use std::collections::BTreeMap;

use glam::{DVec2, Vec2};
use offtrack::layout::{Body, Ended};
use offtrack::map::Kerb;
use rayon::prelude::*;
use serde::Serialize;

use super::Evaluation;
use super::among::Met;
use super::episode::Episode;
use super::groups::Evaluated;
use super::part::Part;

/// Largest distance between two points of a unit that are looked at (m).
const SPACING: f32 = 0.1;

/// Episodes that did not arrive for the same cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cause {
    /// `trailer on the island`, `tractor on the outer kerb of the exit`, `tractor on a vehicle beyond its line, in the
    /// ring`, `lost at start`, `strayed` and the like; on a crossing, which has no ring, `trailer on the outer kerb of
    /// the junction`.
    pub cause: String,
    /// Number of the episodes that did not arrive for this cause.
    pub episodes: usize,
    /// This cause's fraction of all episodes that did not arrive.
    pub share: f64,
    /// Episodes of this cause whose own start is shown to be possible; `None` where nobody asked for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub possible: Option<usize>,
    /// One episode of this cause, if there is one from a start that is shown to be possible.
    pub example: Example,
}

/// An episode to look at. `offtrack record` films it by route, episode and the evaluation's seed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Example {
    /// Index among all episodes of the evaluation.
    #[serde(skip)]
    pub index: usize,
    /// Name of the episode's route.
    pub route: String,
    /// Index among the episodes of the route.
    pub episode: usize,
    /// Lateral offset and heading error of the episode's start, as fractions of the largest ones.
    pub start: [f64; 2],
    /// Why the episode ended.
    pub ended: &'static str,
    /// The episode's number of steps.
    pub steps: u32,
    /// Middle of the tractor's drive axle at the episode's end, x east, y north (m).
    pub position: [f64; 2],
}

impl Evaluation<'_> {
    /// Causes of the episodes that did not arrive, the commonest first; the episodes stand as [`Evaluation::drive`]
    /// gives them. `possible` says of each whether its start is shown to be possible.
    pub fn failures(&self, finished: &[Episode], possible: Option<&[bool]>) -> Vec<Cause> {
        let routes = self.routes();
        let failed: Vec<usize> = (0..finished.len()).filter(|&index| finished[index].ended != Ended::Arrived).collect();
        let cause = |&index: &usize| (self.cause(&routes[index / self.episodes], &finished[index]), index);
        let mut members: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (cause, index) in failed.par_iter().map(cause).collect::<Vec<_>>() {
            members.entry(cause).or_default().push(index);
        }
        let of = |(cause, members): (String, Vec<usize>)| {
            let completed =
                possible.map(|possible| members.iter().copied().filter(|&index| possible[index]).collect::<Vec<_>>());
            let shown = completed.as_ref().filter(|completed| !completed.is_empty()).unwrap_or(&members);
            let example = self.example(&routes, finished, shown[shown.len() / 2]);
            let (episodes, share) = (members.len(), members.len() as f64 / failed.len() as f64);
            Cause { cause, episodes, share, possible: completed.map(|completed| completed.len()), example }
        };
        let mut causes: Vec<Cause> = members.into_iter().map(of).collect();
        causes.sort_by_key(|cause| std::cmp::Reverse(cause.episodes));
        causes
    }

    fn example(&self, routes: &[Evaluated], finished: &[Episode], index: usize) -> Example {
        let (episode, (_, start)) = (&finished[index], self.start(index));
        let (_, place, route) = routes[index / self.episodes];
        // As it lies in the world.
        let side = if place.roundabout.is_mirrored() { -1.0 } else { 1.0 };
        let [x, y] = episode.last.position.as_dvec2().to_array();
        Example {
            index,
            route: route.name.clone(),
            episode: index % self.episodes,
            start: [start.offset, start.heading].map(|fraction| side * f64::from(fraction)),
            ended: episode.ended.name(),
            steps: episode.steps,
            position: [x, side * y],
        }
    }

    /// The cause of an episode that did not arrive, in words.
    fn cause(&self, route: &Evaluated, episode: &Episode) -> String {
        let (rig, truck) = (self.world.rig(&episode.last), &episode.last);
        if episode.lost_at_start() {
            return "lost at start".to_owned();
        }
        let fields = self.world.unit_fields(truck.route);
        let (unit, field, body, position, heading) = match episode.ended {
            Ended::TractorCollided => ("tractor", fields[0], &rig.tractor_body, truck.position, truck.heading),
            Ended::TrailerCollided => {
                ("trailer", fields[1], &rig.trailer_body, truck.trailer_position(rig), truck.trailer_heading)
            }
            other => {
                let met = episode.among.and_then(|among| among.met);
                return met.map_or_else(|| other.name().replace('_', " "), |met| self.contact(route, episode, met));
            }
        };
        let points = points(body).map(|point| position + Vec2::from_angle(heading).rotate(point));
        let (_, contact) = points.fold((f32::INFINITY, position), |best, point| {
            let distance = field.distance(point);
            if distance < best.0 { (distance, point) } else { best }
        });
        format!("{unit} on the {}", self.kerb(route, contact.as_dvec2()))
    }

    /// A contact with another vehicle, in words.
    fn contact(&self, &(_, place, route): &Evaluated, episode: &Episode, met: Met) -> String {
        let (rig, truck) = (self.world.rig(&episode.last), &episode.last);
        let position = if met.by_tractor { truck.position } else { truck.trailer_position(rig) };
        let part = Part::at(self.scenario, route, route.centre_line.station(position.as_dvec2()));
        let unit = if met.by_tractor { "tractor" } else { "trailer" };
        let vehicle = if met.has_entered { "a vehicle beyond its line" } else { "a vehicle before its line" };
        let was_met = if episode.ended == Ended::WasMet { ", at its fault" } else { "" };
        format!("{unit} on {vehicle}, in the {}{was_met}", part.name(&place.roundabout))
    }

    /// The kerb of a route nearest to `p`, in words.
    fn kerb(&self, &(_, place, route): &Evaluated, p: DVec2) -> String {
        let station = route.centre_line.station(p);
        match place.roundabout.nearest_kerb(p) {
            Kerb::Island => "island".to_owned(),
            Kerb::Outer => {
                format!("outer kerb of the {}", Part::at(self.scenario, route, station).name(&place.roundabout))
            }
            Kerb::Splitter(arm) => {
                // A U-turn leaves by the arm that it enters by.
                let first_half = station < 0.5 * route.centre_line.length();
                match (arm == route.entry, arm == place.roundabout.exit_arm(route)) {
                    (true, true) if first_half => "splitter of the entry",
                    (true, false) => "splitter of the entry",
                    (_, true) => "splitter of the exit",
                    (false, false) => "splitter of another arm",
                }
                .to_owned()
            }
        }
    }
}

/// Points of a body in its frame: its centre line and its sides, from end to end, and its ends.
fn points(body: &Body) -> impl Iterator<Item = Vec2> {
    let along = (body.rear, body.front);
    let n = |length: f32| (length / SPACING).ceil() as usize;
    let (n_along, n_across) = (n(along.1 - along.0), n(2.0 * body.half_width));
    let half_width = body.half_width;
    let lines = [-half_width, 0.0, half_width].into_iter().flat_map(move |y| {
        (0..=n_along).map(move |index| Vec2::new(along.0 + (along.1 - along.0) * index as f32 / n_along as f32, y))
    });
    let ends = [along.0, along.1].into_iter().flat_map(move |x| {
        (0..=n_across).map(move |index| Vec2::new(x, half_width * (2.0 * index as f32 / n_across as f32 - 1.0)))
    });
    lines.chain(ends)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use offtrack::layout::Truck;
    use offtrack::scenario::{Scenario, Split};
    use offtrack::world::World;

    use super::super::among::Among;
    use super::super::episode::tests::episode;
    use super::*;
    use crate::device::Device;

    /// What `work` finds in an evaluation of two episodes on each of the test routes of 40m, which has splitter
    /// islands.
    fn on_40m<T>(work: impl FnOnce(&Evaluation) -> T) -> T {
        let mut scenario = Scenario::named("attard2023").unwrap();
        scenario.retain(|_, route| route.name.starts_with("40m/"));
        let world = Arc::new(World::bake(&scenario).unwrap());
        let device = Device::processor();
        work(&Evaluation {
            scenario: &scenario,
            world: &world,
            split: Split::Test,
            episodes: 2,
            seed: 0,
            record: false,
            device: &device,
        })
    }

    /// An episode of the route at `index` that ended this way with both units at a pose.
    fn ended(evaluation: &Evaluation, index: usize, ended: Ended, position: DVec2, heading: f64) -> Episode {
        let (position, heading) = (position.as_vec2(), heading as f32);
        let route = evaluation.scenario.split(Split::Test)[index];
        // The trailer stands in line behind the tractor.
        let last = Truck { position, heading, trailer_heading: heading, route, ..Truck::default() };
        Episode { last, ..episode(ended) }
    }

    #[test]
    fn a_contact_with_a_vehicle_is_named_by_unit_place_and_whose_fault_it_was() {
        on_40m(|evaluation| {
            let (_, _, route) = evaluation.routes()[0];
            let on_its_arm = route.centre_line.point_at(1.0);
            let named = |end: Ended, by_tractor: bool, has_entered: bool| {
                let among = Among { met: Some(Met { by_tractor, has_entered }), ..Among::new(900.0) };
                let episode = Episode { among: Some(among), ..ended(evaluation, 0, end, on_its_arm, 0.0) };
                evaluation.cause(&evaluation.routes()[0], &episode)
            };
            assert_eq!(named(Ended::MetVehicle, true, false), "tractor on a vehicle before its line, in the entry");
            let was_met = "trailer on a vehicle beyond its line, in the entry, at its fault";
            assert_eq!(named(Ended::WasMet, false, true), was_met);
        });
    }

    #[test]
    fn a_collision_is_named_by_unit_kerb_and_part_of_the_route() {
        on_40m(|evaluation| {
            let routes = evaluation.routes();
            let index = routes.iter().position(|(_, _, route)| route.lane.name() == "left" && route.exit == 3).unwrap();
            let route = &routes[index];
            let lane = route.1.roundabout.lane_widths(route.2)[0];
            let line = &route.2.centre_line;
            let cause = |unit: Ended, station: f64, across: f64| {
                let heading = line.heading_at(station);
                let position = line.point_at(station) + across * DVec2::from_angle(heading).perp();
                evaluation.cause(route, &ended(evaluation, index, unit, position, heading))
            };
            let ring = 0.5 * line.length();
            // To the right across the other lane until the wheels are on the kerb; to the left onto the island.
            assert_eq!(cause(Ended::TractorCollided, 20.0, -2.0 - lane), "tractor on the outer kerb of the entry");
            assert_eq!(
                cause(Ended::TractorCollided, line.length() - 10.0, -2.0 - lane),
                "tractor on the outer kerb of the exit"
            );
            assert_eq!(cause(Ended::TractorCollided, ring, 2.0), "tractor on the island");
            assert_eq!(cause(Ended::TrailerCollided, ring, 2.0), "trailer on the island");
            for (other, words) in
                [(Ended::Strayed, "strayed"), (Ended::TimedOut, "timed out"), (Ended::RolledOver, "rolled over")]
            {
                assert_eq!(cause(other, ring, 0.0), words);
            }
        });
    }

    #[test]
    fn a_splitter_is_named_by_the_arm_that_it_stands_on() {
        on_40m(|evaluation| {
            let routes = evaluation.routes();
            let mut found = std::collections::BTreeSet::new();
            for route in &routes {
                // Points along the arms' axes, inwards from where splitter islands begin.
                let line = &route.2.centre_line;
                for station in (0..line.length() as usize).map(|station| station as f64) {
                    let p = line.point_at(station) + 4.5 * DVec2::from_angle(line.heading_at(station)).perp();
                    found.insert((
                        evaluation.kerb(route, p),
                        Part::at(evaluation.scenario, route.2, station).name(&route.1.roundabout),
                    ));
                }
            }
            for expected in [("splitter of the entry", "entry"), ("splitter of the exit", "exit")] {
                assert!(found.iter().any(|(kerb, part)| (kerb.as_str(), *part) == expected), "{found:?}");
            }
        });
    }

    #[test]
    fn a_crossing_has_a_junction_and_no_ring() {
        let scenario = Scenario::named("maps2026-crossing").unwrap();
        let (world, device) = (Arc::new(World::bake(&scenario).unwrap()), Device::processor());
        let split = Split::Test;
        let evaluation = Evaluation {
            scenario: &scenario,
            world: &world,
            split,
            episodes: 1,
            seed: 0,
            record: false,
            device: &device,
        };
        let mut found = std::collections::BTreeSet::new();
        for route in &evaluation.routes() {
            let line = &route.2.centre_line;
            found.extend(
                (0..line.length() as usize).map(|station| evaluation.kerb(route, line.point_at(station as f64))),
            );
        }
        assert!(found.contains("outer kerb of the junction") && found.contains("outer kerb of the entry"), "{found:?}");
        assert!(!found.iter().any(|kerb| kerb.contains("ring")), "{found:?}");
        let routes = evaluation.routes();
        assert!(routes.iter().all(|route| super::super::groups::island_radius(route).1 == "none"));
    }

    #[test]
    fn causes_are_sorted_by_their_number_and_the_example_has_a_possible_start_if_there_is_one() {
        on_40m(|evaluation| {
            let n = 2 * evaluation.routes().len();
            let mut finished = vec![episode(Ended::Arrived); n];
            finished[1] = episode(Ended::Strayed);
            for index in [2, 5, 6] {
                finished[index] = episode(Ended::TimedOut);
            }
            finished[7] = Episode { steps: 1, ..episode(Ended::TractorCollided) };
            let mut possible = vec![true; n];
            (possible[2], possible[5]) = (false, false);
            let causes = evaluation.failures(&finished, Some(&possible));
            let told: Vec<_> =
                causes.iter().map(|cause| (cause.cause.as_str(), cause.episodes, cause.possible.unwrap())).collect();
            assert_eq!(told, [("timed out", 3, 1), ("lost at start", 1, 1), ("strayed", 1, 1)]);
            assert_eq!(causes.iter().map(|cause| cause.share).sum::<f64>(), 1.0);
            let example = &causes[0].example;
            assert_eq!((example.index, example.episode, &example.route), (6, 0, &evaluation.routes()[3].2.name));
            let unknown = evaluation.failures(&finished, None);
            assert_eq!((unknown[0].possible, unknown[0].example.index), (None, 5));
        });
    }
}
