//! The observation against a plain, slow reference: each value computed on its own, in f64, from the route's own
//! waypoints.

use std::f64::consts::PI;

use glam::DVec2;
use offtrack::layout::random;
use offtrack::layout::{N_RAYS, Progress, Truck};
use offtrack::map::route::{Lane, Route};
use offtrack::physics::observed;
use offtrack::world::World;

use crate::benchmark;

fn wrapped(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

fn distance_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let fraction = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a + fraction * (b - a))
}

/// Everything that the truck is and sees, as the reference needs it.
struct View<'a> {
    route: &'a Route,
    next: usize,
    truck: Truck,
    wheelbase: f64,
    ranges: [f32; N_RAYS],
    range: f64,
}

impl View<'_> {
    fn w(&self, index: i64) -> DVec2 {
        self.route.waypoints[index.clamp(0, self.route.waypoints.len() as i64 - 1) as usize].position
    }

    fn heading(&self, index: i64) -> f64 {
        self.route.waypoints[index.clamp(0, self.route.waypoints.len() as i64 - 1) as usize].heading
    }

    fn interior_angle(&self, from: i64, at: i64, to: i64) -> f64 {
        let (a, b) = (self.w(from) - self.w(at), self.w(to) - self.w(at));
        if a.length() < 1e-9 || b.length() < 1e-9 {
            1.0
        } else {
            (a.dot(b) / (a.length() * b.length())).clamp(-1.0, 1.0).acos() / PI
        }
    }

    /// Where the bisectors of two chords meet: solve for the point that is as far from all three ends.
    fn radius(&self, chord: i64) -> f64 {
        let [a, b, c] = [0, 5, 10].map(|ahead| self.w(self.next as i64 + 5 * chord + ahead));
        let (u, v) = (b - a, c - b);
        let determinant = u.x * v.y - u.y * v.x;
        if determinant.abs() < 1e-9 {
            return 1.0;
        }
        let (p, q) = (u.dot(0.5 * (a + b)), v.dot(0.5 * (b + c)));
        let meeting = DVec2::new((p * v.y - q * u.y) / determinant, (u.x * q - v.x * p) / determinant);
        (meeting.distance(b) / 100.0).min(1.0)
    }

    fn value(&self, index: usize) -> f64 {
        let i = self.next as i64;
        let truck = &self.truck;
        let (heading, trailer) = (f64::from(truck.heading), f64::from(truck.trailer_heading));
        let tractor = truck.position.as_dvec2() + 0.5 * self.wheelbase * DVec2::from_angle(heading);
        let ahead = |n: usize| i + [0, 2, 5, 7, 10][n];
        let steps = |n: usize| [5, 7, 10, 12][n];
        match index {
            0 => (f64::from(truck.speed) / 27.8).clamp(0.0, 1.0),
            1 | 2 => (tractor.distance(self.w(i + index as i64 - 1)) / 20.0).min(1.0),
            3 | 4 => {
                let at = i + index as i64 - 3;
                let left = DVec2::from_angle(self.heading(at) + PI / 2.0);
                // Half a lane to the own lane's edge, a lane and a half to the other lane's.
                let (to_left, to_right) = if self.route.lane == Lane::Left { (1.85, 5.55) } else { (5.55, 1.85) };
                let (from, to) = (self.w(at) + to_left * left, self.w(at) - to_right * left);
                (distance_to_segment(tractor, from, to) / 20.0).min(1.0)
            }
            5 => (distance_to_segment(tractor, self.w(i - 1), self.w(i)) / 10.0).min(1.0),
            6..=10 => {
                let (to_waypoint, to_tractor) = (self.w(ahead(index - 6)) - self.w(i - 1), tractor - self.w(i - 1));
                wrapped(to_tractor.y.atan2(to_tractor.x) - to_waypoint.y.atan2(to_waypoint.x)) / PI
            }
            11..=15 => wrapped(heading - self.heading(ahead(index - 11))) / PI,
            16..=20 => wrapped(trailer - self.heading(ahead(index - 16))) / PI,
            21 => wrapped(heading - trailer) / PI,
            22..=25 => self.interior_angle(i, i + steps(index - 22), i + 2 * steps(index - 22)),
            26..=29 => self.interior_angle(i - steps(index - 26), i, i + steps(index - 26)),
            30..=58 => f64::from(self.ranges[index - 30]) / self.range,
            _ => self.radius(index as i64 - 59),
        }
    }
}

/// Largest difference from the reference over random states of every route, by index.
fn worst_differences(shift: usize) -> [f64; 69] {
    let (scenario, world): (_, World) = benchmark("attard2023-full");
    let mut worst = [0.0f64; 69];
    let mut states = 0;
    for (index, (_, route)) in scenario.routes().enumerate() {
        let (waypoints, previews) = (world.route_waypoints(index as u32), world.route_previews(index as u32));
        for state in 0..200 {
            let draws: Vec<f32> =
                (0..3).flat_map(|draw| random::words(11, index as u32, state, draw)).map(random::signed_unit).collect();
            let next = 1 + ((draws[0] + 1.0) * 0.5 * (waypoints.len() - 1) as f32) as usize;
            let near = &waypoints[next.min(waypoints.len() - 1)];
            let mut ranges = [0.0; N_RAYS];
            for (ray, range) in ranges.iter_mut().enumerate() {
                *range = 10.0 + 10.0 * random::signed_unit(random::words(12, index as u32, state, ray as u32)[0]);
            }
            let heading =
                offtrack::layout::angle::wrapped(previews[next.min(waypoints.len() - 1)].heading + 1.5 * draws[1]);
            let truck = Truck {
                route: index as u32,
                position: near.position + 4.0 * glam::Vec2::new(draws[2], draws[3]),
                heading,
                trailer_heading: offtrack::layout::angle::wrapped(heading + 1.5 * draws[4]),
                speed: 8.0 + 8.0 * draws[5],
                ..Truck::default()
            };
            let wheelbase = f64::from(world.rigs[0].wheelbase);
            let view = View {
                route,
                next: next.min(waypoints.len() - 1),
                truck,
                wheelbase,
                ranges,
                range: scenario.sensor_range,
            };
            let point = truck.position.as_dvec2() + 0.5 * wheelbase * DVec2::from_angle(f64::from(truck.heading));
            let lane_distance =
                distance_to_segment(point, view.w(view.next as i64 - 1), view.w(view.next as i64)) as f32;
            let progress = Progress { waypoint: next as u32, lane_distance, ..Progress::default() };
            let values = observed(&world, &truck, &progress, &ranges);
            for (value, worst) in worst.iter_mut().enumerate() {
                let difference = (f64::from(values[(value + shift) % 69]) - view.value(value)).abs();
                // An angle of -180 deg is one of 180 deg: its scaled value may be -1 here and 1 there.
                let difference = if (6..22).contains(&value) { difference.min(2.0 - difference) } else { difference };
                *worst = worst.max(difference);
            }
            states += 1;
        }
    }
    assert_eq!(states, 95 * 200);
    worst
}

#[test]
fn every_value_of_the_observation_is_what_its_definition_says() {
    // Positions reach 100 m, where an f32 is good to 4e-6 m; a chord's circumcentre multiplies that by radius over
    // chord, an angle at a waypoint 2 m away by a half.
    for (index, difference) in worst_differences(0).into_iter().enumerate() {
        assert!(difference < 2e-5, "value {index} is off by {difference}");
    }
}

#[test]
fn the_comparison_notices_values_that_are_shifted_by_one() {
    let noticed = worst_differences(1).into_iter().filter(|&difference| 1e-3 < difference).count();
    assert_eq!(noticed, 69);
}
