use offtrack::layout::Ended;
use offtrack::scenario::Scenario;
use offtrack::traffic::units::speed;
use offtrack::world::World;

use super::*;
use crate::episode::tests::episode;

const STEP: f64 = 0.1;

fn among(change: fn(&mut Among)) -> Episode {
    let mut among = Among::new(900.0);
    change(&mut among);
    Episode { among: Some(among), ..episode(Ended::Arrived) }
}

/// A world with other vehicles, its first truck on a straight piece of road, and a row without vehicles.
fn world() -> World {
    let text = Scenario::text_of("traffic2026").unwrap();
    let mut scenario = Scenario::parse("among", &text, None, &offtrack::files::cache::Loading::PLAIN).unwrap();
    scenario.retain(|_, route| route.name == "20m/N-left-2");
    World::bake(&scenario).unwrap()
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
