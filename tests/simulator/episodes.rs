//! Whole episodes: determinism, ten million random steps, and what a step promises.

use std::sync::Arc;

use glam::Vec2;
use offtrack::engine::stages::STAGES;
use offtrack::layout::random;
use offtrack::layout::{Column, Ended, N_RAYS, Start};
use offtrack::scenario::Split;
use offtrack::simulator::{Batch, Engine, RouteChoice, Simulator};
use offtrack::world::World;

use crate::{batch_on, benchmark, engines, groups};

pub(crate) fn all_routes(world: &World) -> RouteChoice {
    RouteChoice::Drawn((0..world.routes.len() as u32).collect())
}

/// Every byte of a batch of `n_envs` trucks after `n_steps` random steps on `threads` threads, truck by truck.
fn driven(
    engine: &Engine,
    world: &Arc<World>,
    n_envs: usize,
    n_steps: usize,
    seed: u32,
    threads: usize,
) -> Vec<Vec<u8>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut simulator = batch_on(engine, world, n_envs, seed, all_routes(world));
        (0..n_steps).for_each(|_| simulator.step_at_random());
        rows(simulator.batch())
    })
}

/// Every byte of each truck but its action, which is the caller's.
pub(crate) fn rows(batch: &Batch) -> Vec<Vec<u8>> {
    let n_envs = batch.n_envs();
    let columns = batch.columns().into_iter().filter(|(column, _)| *column != Column::Action).collect::<Vec<_>>();
    let row = |env: usize| -> Vec<u8> {
        columns
            .iter()
            .flat_map(|(_, bytes)| bytes.chunks((bytes.len() / n_envs).max(1)).nth(env))
            .flatten()
            .copied()
            .collect()
    };
    (0..n_envs).map(row).collect()
}

#[test]
fn the_same_seed_gives_the_same_bytes_whatever_threads_batch_size_and_repetition() {
    let world = Arc::new(benchmark("attard2023-full").1);
    for (name, engine) in engines() {
        // A software device is ten times slower; after 100 steps most trucks are in their second or third episode.
        let n_steps = if name == "CPU" { 300 } else { 100 };
        let many = driven(&engine, &world, 4096, n_steps, 5, 1);
        for n_envs in [1, 7, 64] {
            assert!(driven(&engine, &world, n_envs, n_steps, 5, 2) == many[..n_envs], "{n_envs} trucks on the {name}");
        }
        assert!(many == driven(&engine, &world, 4096, n_steps, 5, 2), "two threads and the {name}");
        assert!(many == driven(&engine, &world, 4096, n_steps, 5, 1), "the {name} again");
        assert!(many[..7] != driven(&engine, &world, 7, n_steps, 6, 1), "another seed must differ");
    }
}

#[test]
fn on_many_roads_the_order_in_which_trucks_are_stepped_changes_nothing() {
    let world = Arc::new(benchmark("attard2023-full").1);
    for (name, engine) in engines() {
        let many = driven(&engine, &world, 500, 150, 6, 2);
        // Other numbers of trucks and threads make other blocks, each with an order of its own.
        for (n_envs, threads) in [(1, 1), (40, 3), (500, 1)] {
            assert!(
                driven(&engine, &world, n_envs, 150, 6, threads) == many[..n_envs],
                "{n_envs} trucks, {threads} threads on the {name}"
            );
        }
    }
}

#[test]
fn a_trucks_index_in_the_batch_and_its_neighbours_change_nothing() {
    let world = Arc::new(benchmark("attard2023-full").1);
    let n_routes = world.routes.len();
    for (name, engine) in engines() {
        // Every route twice, in opposite orders, and another truck between.
        let routes: Vec<usize> = (0..n_routes).chain([3]).chain((0..n_routes).rev()).collect();
        let of_routes = |value: &dyn Fn(usize) -> u32| routes.iter().map(|&route| value(route)).collect::<Vec<u32>>();
        let mut simulator =
            batch_on(&engine, &world, routes.len(), 8, RouteChoice::Fixed(of_routes(&|route| route as u32)));
        let starts: Vec<Start> = routes
            .iter()
            .map(|&route| Start { offset: route as f32 / 100.0, heading: -0.5, ..Start::default() })
            .collect();
        simulator.reset_from(&starts).unwrap();
        for step in 0..80 {
            simulator.step(&of_routes(&|route| random::words(1, route as u32, step, 0)[0] % 9)).unwrap();
        }
        let rows = rows(simulator.batch());
        for (route, row) in rows[..n_routes].iter().enumerate() {
            assert!(*row == rows[2 * n_routes - route], "route {route} on the {name}");
        }
        assert!(rows[0] != rows[1] && rows[3] == rows[n_routes]);
    }
}

#[test]
fn stepping_a_stage_at_a_time_gives_the_same_bytes() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let [mut whole, mut timed, mut staged] = [0; 3].map(|_| batch_on(&engine, &world, 256, 3, all_routes(&world)));
        for _ in 0..150 {
            whole.step_at_random();
            timed.step_at_random_by_stage().unwrap();
            // The same actions, a stage at a time.
            let action = whole.batch().action.clone();
            let before = staged.batch().clone();
            staged
                .restore(|column| {
                    Some(if column == Column::Action { bytemuck::cast_slice(&action) } else { before.column(column) })
                })
                .unwrap();
            STAGES.iter().for_each(|&stage| staged.run_stage(stage));
        }
        for other in [&timed, &staged] {
            assert!(rows(whole.batch()) == rows(other.batch()), "{name}");
            assert_eq!(whole.tally().unwrap(), other.tally().unwrap(), "{name}");
        }
    }
}

#[test]
fn ten_million_random_steps_stay_finite_in_range_and_inside_the_world() {
    let (scenario, world) = benchmark("attard2023-full");
    let world = Arc::new(world);
    let n_envs = 8192;
    let bounds: Vec<_> = scenario
        .places
        .iter()
        .map(|place| place.roundabout.kerbs(scenario.gutter).bounds())
        .map(|(low, high)| (low.as_vec2(), high.as_vec2()))
        .collect();
    for (name, engine) in engines() {
        // A software device would need minutes for as many.
        let least = if name == "CPU" { 10_000_000usize } else { 1_000_000 };
        let mut simulator = batch_on(&engine, &world, n_envs, 1, all_routes(&world));
        let mut ends = [0i64; Ended::ALL.len()];
        for _ in 0..least.div_ceil(n_envs) {
            simulator.step_at_random();
            assert_in_range(&world, &bounds, simulator.batch());
            simulator.batch().ended.iter().for_each(|&code| ends[code as usize] += 1);
        }
        assert!(least as i64 <= ends.iter().sum());
        assert_eq!(simulator.tally().unwrap().sums[..ends.len()], ends, "{name}");
        // Random actions bring both units into contact with the kerbs.
        let touched = [Ended::TractorCollided, Ended::TrailerCollided].map(|code| ends[code as usize]);
        assert!(touched.iter().all(|&count| least as i64 / 10_000 < count), "{ends:?}");
    }
}

/// Every truck is inside its roundabout's bounds, and every value in its range.
fn assert_in_range(world: &World, bounds: &[(Vec2, Vec2)], batch: &Batch) {
    for env in 0..batch.n_envs() {
        let truck = &batch.truck[env];
        let (low, high) = bounds[world.routes[truck.route as usize].roundabout as usize];
        assert!(low.cmple(truck.position).all() && truck.position.cmple(high).all(), "{truck:?}");
        let pi = std::f32::consts::PI;
        assert!(truck.heading.abs() <= pi && truck.trailer_heading.abs() <= pi, "{truck:?}");
        assert!((0.0..30.0).contains(&truck.speed) && truck.steering.abs() <= world.rigs[0].steer_max, "{truck:?}");
        let finite =
            [truck.tractor_roll, truck.trailer_roll_rate, truck.trailer_load_transfer_ratio, batch.reward[env]];
        assert!(finite.into_iter().all(f32::is_finite), "{truck:?}");
        assert!(batch.clearance[env].tractor.is_finite() && batch.clearance[env].trailer.is_finite());
        for values in [&batch.observation[env], &batch.next_observation[env]] {
            for (index, value) in values.iter().enumerate() {
                let least = if (6..22).contains(&index) { -1.0 } else { 0.0 };
                assert!((least..=1.0).contains(value), "value {index}: {value}");
            }
        }
    }
}

#[test]
fn observation_and_next_observation_differ_only_where_an_episode_ended() {
    let world = Arc::new(benchmark("attard2023").1);
    for (_, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 512, 9, all_routes(&world));
        let mut ended = 0;
        for _ in 0..400 {
            simulator.step_at_random();
            let batch = simulator.batch();
            for env in 0..512 {
                let over = batch.ended[env] != Ended::Running as u32;
                assert_eq!(over, batch.observation[env] != batch.next_observation[env]);
                assert_eq!(over, batch.truck[env].steps == 0);
                ended += usize::from(over);
            }
        }
        assert!(100 < ended, "{ended}");
    }
}

#[test]
fn a_truck_on_a_fixed_route_drives_it_once_and_is_held() {
    let (scenario, world) = benchmark("attard2023");
    let world = Arc::new(world);
    for (_, engine) in engines() {
        let routes = scenario.split(Split::Test).to_vec();
        let mut simulator = batch_on(&engine, &world, routes.len(), 2, RouteChoice::Fixed(routes.clone()));
        let mut last = None;
        for _ in 0..1500 {
            simulator.step_at_random();
            if simulator.batch().truck.iter().all(|truck| truck.held == 1) {
                last.get_or_insert_with(|| rows(simulator.batch()));
            }
        }
        let batch = simulator.batch();
        assert!(batch.truck.iter().zip(&routes).all(|(truck, &route)| truck.route == route && truck.episode == 0));
        assert!(last == Some(rows(batch)), "a held truck moved");
        simulator.reset();
        assert!(simulator.batch().truck.iter().all(|truck| truck.held == 0 && truck.steps == 0));
    }
}

#[test]
fn a_truck_that_only_drives_straight_leaves_its_route_and_the_reward_says_so() {
    let world = Arc::new(benchmark("attard2023").1);
    for (_, engine) in engines() {
        let route = world.route_names.iter().position(|name| name == "20m/N-left-4").unwrap() as u32;
        let mut simulator = batch_on(&engine, &world, 1, 0, RouteChoice::Fixed(vec![route]));
        let (mut passed, mut reward, mut terms) = (0, 0.0, 0.0);
        while simulator.batch().truck[0].held == 0 {
            simulator.step(&[4]).unwrap();
            let batch = simulator.batch();
            passed += batch.progress[0].passed;
            reward += batch.reward[0];
            let weighed = batch.terms[0];
            terms += 100.0 * weighed.waypoints - 1.5 * weighed.lane_distance - 500.0 * weighed.failure;
        }
        assert_eq!(simulator.batch().ended[0], Ended::TractorCollided as u32);
        assert_eq!(reward, terms);
        // The truck passes the approach of 40 m, a waypoint every 2 m, meets the island and pays for it.
        assert!((15..35).contains(&passed), "{passed}");
        assert!((100.0 * passed as f32 - 550.0..100.0 * passed as f32 - 500.0).contains(&reward), "{reward}");
    }
}

#[test]
fn the_sensors_see_the_road_ahead_at_the_start_of_every_route() {
    let world = Arc::new(benchmark("attard2023-full").1);
    for (_, engine) in engines() {
        let n = world.routes.len();
        let simulator = batch_on(&engine, &world, n, 0, RouteChoice::Fixed((0..n as u32).collect()));
        for (env, ranges) in simulator.batch().ranges.iter().enumerate() {
            // The tractor's middle ray looks down its own lane, which may bend; the first trailer rays meet the kerbs a
            // few metres aside.
            assert!(10.0 < ranges[N_RAYS - 7], "{}: {}", world.route_names[env], ranges[N_RAYS - 7]);
            assert!(0.3 < ranges[0] && 0.3 < ranges[1], "{}", world.route_names[env]);
        }
    }
}

#[test]
fn a_step_allocates_nothing() {
    // The counter watches one thread, so one thread does all the work.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for world in [Arc::new(benchmark("attard2023").1), groups::world(3).1] {
        let (steps, collecting) = pool.install(|| {
            let mut simulator = Simulator::new(world.clone(), 63, 4, all_routes(&world)).unwrap();
            // As fast as it goes, straight on: over 100 steps episodes end and begin, too.
            let straight = world.actions.iter().zip(0..).filter(|(action, _)| action.steering == 0.0);
            let fastest = straight.max_by(|a, b| a.0.speed.total_cmp(&b.0.speed)).unwrap().1;
            let actions = vec![fastest; 63];
            let steps = allocation_counter::measure(|| (0..100).for_each(|_| simulator.step(&actions).unwrap()));
            assert!(simulator.batch().truck.iter().any(|truck| 0 < truck.episode));
            (steps, allocation_counter::measure(|| drop(simulator.batch().reward.clone())))
        });
        assert_eq!(steps.count_total, 0);
        assert_eq!(collecting.count_total, 1, "the counter counts");
    }
}
