use offtrack::layout::Ended;
use offtrack::scenario::Scenario;
use offtrack::traffic::units::{metres, speed};
use offtrack::traffic::{Kind, View};
use offtrack::world::World;

use super::encroachment::Encroachments;
use super::*;
use crate::episode::tests::episode;
use crate::part::LaneWidths;

const STEP: f64 = 0.1;

fn among(change: fn(&mut Among)) -> Episode {
    let mut among = Among::new(900.0);
    change(&mut among);
    Episode { among: Some(among), ..episode(Ended::Arrived) }
}

/// A world with other vehicles, its first truck on a straight piece of road, and a row without vehicles.
fn world() -> World {
    World::bake(&scenario()).unwrap()
}

/// The benchmark of that world.
fn scenario() -> Scenario {
    let text = Scenario::text_of("traffic2026").unwrap();
    let mut scenario = Scenario::parse("among", &text, None, &offtrack::files::cache::Loading::PLAIN).unwrap();
    scenario.retain(|_, route| route.name == "20m/N-left-2");
    scenario
}

/// The shortest car with its front at a station of a path (m, m/s).
fn car(path: usize, station: f32, pace: f32) -> Car {
    Car { station: (station * 1_048_576.0) as i32, speed: speed(pace) << 5, what: path as u32, acceleration: 0 }
}

/// A truck at a station of its path, as fast as `speed` (m, m/s).
fn truck(world: &World, station: f32, speed: f32) -> Truck {
    let shared = world.traffic.as_ref().unwrap();
    let (network, path) = (&shared.road(world, 0).network, shared.routes[0].path as usize);
    let (position, along) = network.pose(path, station);
    let heading = along.to_angle();
    Truck { position, heading, trailer_heading: heading, speed, ..Truck::default() }
}

/// What one step among these vehicles of the truck's own path gives: station, speed, and whether each is hindered.
fn after(world: &World, truck: &Truck, cars: &[(f32, f32, bool)]) -> Among {
    let shared = world.traffic.as_ref().unwrap();
    let (network, path) = (&shared.road(world, 0).network, shared.routes[0].path as usize);
    let mut row = Row { entered: 1, ..Row::EMPTY };
    for (slot, &(station, pace, is_hindered)) in cars.iter().enumerate() {
        row.cars[slot] = car(path, station, pace);
        row.hindered |= u32::from(is_hindered) << slot;
    }
    let mut among = Among::new(900.0);
    among.follow(world.rig(truck), truck, network, &row, STEP);
    among
}

#[test]
fn time_to_collision_is_room_over_closing_speed_and_counts_what_is_ahead_alone() {
    let world = world();
    let truck = truck(&world, 20.0, 8.0);
    let front = 20.0 + world.rig(&truck).tractor_body.front;
    let ahead = |room: f32, pace: f32| {
        after(&world, &truck, &[(front + room + car(0, 0.0, 0.0).length(), pace, false)]).time_to_collision
    };
    for (room, pace) in [(4.0, 0.0), (12.0, 4.0), (8.0, 6.0)] {
        let expected = f64::from(room / (8.0 - pace));
        assert!((ahead(room, pace) - expected).abs() <= 0.11, "{room} m, {pace} m/s: {}", ahead(room, pace));
    }
    assert_eq!(ahead(8.0, 8.0), 5.0);
    // One that comes from behind is not the truck's to avoid.
    assert_eq!(after(&world, &truck, &[(front - 20.0, 10.0, false)]).time_to_collision, 5.0);
}

#[test]
fn a_truck_that_stands_is_counted_and_foresees_nothing() {
    let world = world();
    let seen = after(&world, &truck(&world, 20.0, 0.1), &[(33.0, 0.0, false)]);
    assert_eq!((seen.standing, seen.time_to_collision), (STEP, 5.0));
    assert_eq!(after(&world, &truck(&world, 20.0, 0.5), &[]).standing, 0.0);
}

#[test]
fn only_vehicles_that_brake_for_the_truck_brake_at_its_expense() {
    let world = world();
    let truck = truck(&world, 20.0, 8.0);
    let shared = world.traffic.as_ref().unwrap();
    let network = &shared.road(&world, 0).network;
    let path = shared.routes[0].path as usize;
    let mut row = Row::EMPTY;
    // 5 m/s² in 2^-19 m a step².
    row.cars[0] = Car { acceleration: -26_214, ..car(path, 5.0, 6.0) };
    for (hindered, expected) in [(0, 0.0), (1, STEP)] {
        row.hindered = hindered;
        let mut among = Among::new(900.0);
        among.follow(world.rig(&truck), &truck, network, &row, STEP);
        assert_eq!(among.braking, expected);
    }
}

#[test]
fn the_contact_that_ends_an_episode_tells_the_unit_and_whether_the_vehicle_had_entered() {
    let world = world();
    let truck = truck(&world, 20.0, 8.0);
    let shared = world.traffic.as_ref().unwrap();
    let network = &shared.road(&world, 0).network;
    let path = shared.routes[0].path as usize;
    for (station, by_tractor) in [(21.0, true), (11.0, false)] {
        // In the second slot, at the truck's fault.
        let mut row = Row { met: 64 + 2, ..Row::EMPTY };
        row.cars[1] = car(path, station, 0.0);
        let mut among = Among::new(900.0);
        among.follow(world.rig(&truck), &truck, network, &row, STEP);
        let has_entered = network.paths[path].line() < station;
        assert_eq!(among.met, Some(Met { by_tractor, has_entered }), "{station} m");
    }
}

#[test]
fn a_summary_has_means_and_quantiles_of_the_episodes_with_vehicles_alone() {
    let near = |among: &mut Among| (among.standing, among.time_to_collision) = (20.0, 0.9);
    let blocks = |among: &mut Among| among.blocked = 10.1;
    let episodes = [among(near), among(blocks), among(|_| {}), among(|_| {}), episode(Ended::Arrived)];
    let summary = AmongSummary::of(episodes.iter()).unwrap();
    assert_eq!((summary.standing_mean, summary.standing_p95), (5.0, 20.0));
    assert_eq!((summary.blocked, summary.too_near, summary.time_to_collision_p5), (0.25, 0.25, 0.9));
    assert_eq!(AmongSummary::of(episodes[4..].iter()), None);
}

/// Another arm's path that meets the truck's once, in this way: it, and where one is at that place on the truck's path
/// and on it: from the station of its front to that of its rear (m).
fn meeting(world: &World, kind: Kind) -> (usize, [f32; 2], [f32; 2]) {
    let shared = world.traffic.as_ref().unwrap();
    let (network, own) = (&shared.road(world, 0).network, shared.routes[0].path as usize);
    let of = |path: usize| {
        let stretches = network.zones_of(own, path).iter().map(|zone| zone.stretch());
        let hard: Vec<_> = stretches.filter(|zone| matches!(zone.kind, Kind::Follow | Kind::Cross)).collect();
        let [zone] = hard[..] else { return None };
        let is_other = network.source_of(path).entry != network.source_of(own).entry;
        let ends = if kind == Kind::Cross { [zone.a_out, zone.b_out] } else { [zone.a_in, zone.b_in] };
        let [a_in, b_in, a_out, b_out] = [zone.a_in, zone.b_in, ends[0], ends[1]].map(metres);
        (is_other && zone.kind == kind).then_some((path, [a_in, a_out], [b_in, b_out]))
    };
    (0..network.paths.len()).find_map(of).unwrap()
}

/// What is found of these stations of both fronts, step by step.
fn encroached(world: &World, path: usize, fronts: &[(f32, f32)]) -> Vec<Option<usize>> {
    let shared = world.traffic.as_ref().unwrap();
    let (network, own) = (&shared.road(world, 0).network, shared.routes[0].path as usize);
    let mut encroachments = Encroachments::new();
    let mut found = |&(front, of_car): &(f32, f32)| {
        let truck = truck(world, 20.0, 3.0);
        let mut row = Row::EMPTY;
        row.cars[3] = car(path, of_car, 3.0);
        encroachments.follow(network, &View::new(network, world.rig(&truck), &truck, own, front), &row)
    };
    fronts.iter().map(&mut found).collect()
}

#[test]
fn post_encroachment_time_is_that_from_when_one_has_left_the_place_until_the_other_comes() {
    let world = world();
    let own = truck(&world, 20.0, 0.0);
    let shared = world.traffic.as_ref().unwrap();
    let network = &shared.road(&world, 0).network;
    let length = metres(View::new(network, world.rig(&own), &own, shared.routes[0].path as usize, 0.0).length);
    let car_length = car(0, 0.0, 0.0).length();
    for kind in [Kind::Cross, Kind::Follow] {
        let (path, at, of_car) = meeting(&world, kind);
        let (before, after) = (at[0] - 3.0, at[1] + length + 0.5);
        let (car_before, car_after) = (of_car[0] - 3.0, of_car[1] + car_length + 0.5);
        // The vehicle leaves in the second step, the truck comes in the fifth.
        let fronts = [(before, car_before), (before, car_after), (before, car_after), (before, car_after)];
        let last = [(at[0] + 0.1, car_after), (at[0] + 0.2, car_after)];
        let found = encroached(&world, path, &[&fronts[..], &last].concat());
        assert_eq!(found, [None, None, None, None, Some(3), None], "{kind:?}");
        // The vehicle leaves in the step in which the truck comes.
        let fronts = [(before, car_before), (at[0] + 0.1, car_after), (at[0] + 0.2, car_after)];
        assert_eq!(encroached(&world, path, &fronts), [None, Some(0), None], "{kind:?}");
        // The truck leaves in the second step, the vehicle comes in the fourth.
        let fronts = [(before, car_before), (after, car_before), (after, car_before), (after, of_car[0] + 0.1)];
        assert_eq!(encroached(&world, path, &fronts), [None, None, None, Some(2)], "{kind:?}");
        // Both are there.
        let fronts = [(before, car_before), (at[0] + 0.1, car_before), (at[0] + 0.1, of_car[0] + 0.1)];
        assert_eq!(encroached(&world, path, &fronts), [None, None, Some(0)], "{kind:?}");
        // Nobody of the truck's own arm is met so.
        let own = shared.routes[0].path as usize;
        assert_eq!(encroached(&world, own, &[(before, before + 6.0), (after, after + 6.0)]), [None, None]);
    }
    // The least time of an episode counts.
    let mut among = Among::new(900.0);
    [1.3, 0.7, 2.0].into_iter().for_each(|time| among.encroach(time));
    assert_eq!((among.post_encroachment_time, Among::new(900.0).post_encroachment_time), (0.7, 5.0));
}

#[test]
fn a_truck_takes_a_lane_beside_its_own_where_no_car_has_room_there_beside_it() {
    let (scenario, world) = (scenario(), world());
    let (index, route) = scenario.routes().next().unwrap();
    let lanes = LanesBeside::of(&world, 0, &LaneWidths::of(&scenario, &scenario.places[index], route));
    assert!(!lanes.is_empty());
    let on = &world.traffic.as_ref().unwrap().routes[0];
    let begins = f64::from(on.begins);
    let taken = |station: f64, to_right: f32| {
        let mut truck = truck(&world, (begins + station) as f32, 3.0);
        truck.position -= to_right * glam::Vec2::from_angle(truck.heading).perp();
        let mut among = Among::new(900.0);
        among.take(world.rig(&truck), &truck, &lanes);
        among.lanes_taken.unwrap()
    };
    // The left lane of the approach and the inner one of the ring; the others are to the right of them.
    assert_eq!(taken(24.0, 0.0), [false; 3]);
    assert_eq!(taken(24.0, 3.0), [true, false, false]);
    let in_ring = 40.0 + 0.5 * (route.centre_line.length() - 75.0);
    assert!(taken(in_ring, 3.5)[1]);
}

#[test]
fn lane_classes_are_fractions_of_the_passages_that_arrived_on_roads_with_several_lanes() {
    let took = |lanes: Option<[bool; 3]>, ended: Ended| Episode {
        among: Some(Among { lanes_taken: lanes, ..Among::new(900.0) }),
        ..episode(ended)
    };
    let episodes = [
        took(Some([true, true, false]), Ended::Arrived),
        took(Some([false, false, true]), Ended::Arrived),
        took(Some([false, true, false]), Ended::Arrived),
        took(Some([false; 3]), Ended::Arrived),
        took(Some([true; 3]), Ended::MetVehicle),
        took(None, Ended::Arrived),
    ];
    let summary = AmongSummary::of(episodes.iter()).unwrap();
    assert_eq!(summary.lane_classes, Some(LaneClasses { i: 0.5, ii: 0.25, iii: 0.25 }));
    assert_eq!(AmongSummary::of(episodes[5..].iter()).unwrap().lane_classes, None);
    assert!(summary.line_of_lanes("900 veh/h").ends_with("5.0   5.0      50.0     25.0    25.0"));
}
