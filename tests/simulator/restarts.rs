//! How batches begin, branch and go on: stated starts, gathered rows, restored columns.

use std::sync::Arc;

use offtrack::layout::random::{self, Draw};
use offtrack::layout::{Column, Start};
use offtrack::simulator::RouteChoice;

use crate::episodes::{all_routes, rows};
use crate::{batch_on, benchmark, engines};

#[test]
fn a_truck_begins_at_the_stated_fractions_of_the_largest_start_errors() {
    let world = Arc::new(benchmark("attard2023-full").1);
    for (_, engine) in engines() {
        let route = 3;
        let starts = [(0.0, 0.0), (1.0, -1.0), (-0.5, 0.0)].map(|(offset, heading)| Start {
            offset,
            heading,
            ..Start::default()
        });
        let mut simulator = batch_on(&engine, &world, 3, 0, RouteChoice::Fixed(vec![route; 3]));
        simulator.reset_from(&starts).unwrap();
        let first = &world.route_waypoints(route)[0];
        for (truck, start) in simulator.batch().truck.iter().zip(&starts) {
            let point = offtrack::physics::reference_point(world.rigs[0].wheelbase, truck) - first.position;
            // The benchmark's largest errors: 0.3 m and 2 deg. Positions of about 50 m are exact to 4 um in f32.
            assert!((point.dot(first.direction.perp()) - 0.3 * start.offset).abs() < 2e-5, "{truck:?}");
            assert!(point.dot(first.direction).abs() < 2e-5, "{truck:?}");
            let heading =
                offtrack::layout::angle::wrapped(truck.heading - world.route_previews(route)[0].heading).to_degrees();
            assert!((heading - 2.0 * start.heading).abs() < 1e-4, "{heading}");
        }
    }
}

#[test]
fn a_stated_start_equal_to_the_drawn_one_is_the_same() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 64, 3, all_routes(&world));
        let drawn = simulator.batch().clone();
        let starts: Vec<Start> = (0..64)
            .map(|env| {
                let [offset, heading, ..] = random::words(3, env, 0, Draw::Pose as u32).map(random::signed_unit);
                Start { offset, heading, ..Start::default() }
            })
            .collect();
        simulator.step_at_random();
        simulator.reset_from(&starts).unwrap();
        // A reset keeps the clearance of the last step: only what the next action depends on is compared.
        let stated = simulator.batch();
        assert!(
            stated.truck == drawn.truck && stated.control == drawn.control && stated.progress == drawn.progress,
            "{name}"
        );
        assert!(stated.ranges == drawn.ranges && stated.observation == drawn.observation, "{name}");
        simulator.reset_from(&[Start::default(); 64]).unwrap();
        assert!(simulator.batch().observation != drawn.observation, "other starts must differ");
    }
}

#[test]
fn a_gathered_truck_goes_on_as_the_one_it_was() {
    let world = Arc::new(benchmark("attard2023").1);
    let all: Vec<u32> = (0..40).collect();
    // Each truck holds one action: those that steer straight (4, 13, ...) are still on the approach when others have
    // met a kerb.
    let actions = |trucks: &[u32]| -> Vec<u32> { trucks.iter().map(|truck| truck % 9).collect() };
    for (_, engine) in engines() {
        let driven = || {
            let mut simulator = batch_on(&engine, &world, 40, 2, RouteChoice::Fixed(all.clone()));
            (0..30).for_each(|_| simulator.step(&actions(&all)).unwrap());
            simulator
        };
        let (mut whole, mut gathered) = (driven(), driven());
        // In another order, one twice, one that has ended, and most not at all.
        let indices = [13, 39, 4, 4, 0];
        assert_eq!(indices.map(|index| whole.batch().truck[index as usize].held), [0, 1, 0, 0, 1]);
        gathered.gather(&indices).unwrap();
        assert_eq!(gathered.batch().n_envs(), indices.len());
        for _ in 0..10 {
            whole.step(&actions(&all)).unwrap();
            gathered.step(&actions(&indices)).unwrap();
        }
        whole.gather(&indices).unwrap();
        assert!(rows(gathered.batch()) == rows(whole.batch()));
        assert_eq!(gathered.batch().truck.iter().map(|truck| truck.steps).max(), Some(40));
        gathered.reset();
        let begun: Vec<u32> = gathered.batch().truck.iter().map(|truck| truck.route).collect();
        assert_eq!(begun, indices, "a fixed route moves with its truck");
    }
}

#[test]
fn later_episodes_draw_from_the_new_routes_and_wrong_ones_change_nothing() {
    let world = Arc::new(benchmark("attard2023").1);
    let n_routes = world.routes.len();
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 32, 4, RouteChoice::Drawn(vec![0, 1, 2]));
        let before = rows(simulator.batch());
        for (routes, expected) in [
            (vec![0, 1], "routes: 2 to draw from; this batch draws from 3, and needs as many".to_owned()),
            (vec![0, 1, n_routes as u32], format!("routes: {n_routes}; the world has routes 0..{}", n_routes - 1)),
        ] {
            assert_eq!(simulator.draw_from(&routes).unwrap_err().to_string(), expected, "{name}");
        }
        assert!(rows(simulator.batch()) == before);
        simulator.draw_from(&[7, 7, 9]).unwrap();
        assert!(rows(simulator.batch()) == before, "{name}: episodes under way stay on their routes");
        let mut drawn = Vec::new();
        for _ in 0..400 {
            simulator.step_at_random();
            let begun = simulator.batch().truck.iter().filter(|truck| 0 < truck.episode && truck.steps == 0);
            drawn.extend(begun.map(|truck| truck.route));
        }
        let seven = drawn.iter().filter(|&&route| route == 7).count();
        assert!(100 < drawn.len() && drawn.iter().all(|route| [7, 9].contains(route)), "{name}: {drawn:?}");
        // Two of three: 67 %, give or take four standard deviations of 200 draws.
        assert!((0.53..0.80).contains(&(seven as f64 / drawn.len() as f64)), "{name}: {seven} of {}", drawn.len());
        let mut fixed = batch_on(&engine, &world, 2, 4, RouteChoice::Fixed(vec![0, 1]));
        let message = fixed.draw_from(&[0, 1]).unwrap_err().to_string();
        assert_eq!(message, "routes: 2 to draw from; this batch runs one fixed route a truck", "{name}");
    }
}

#[test]
fn a_restored_batch_goes_on_bit_for_bit_and_wrong_columns_are_refused() {
    let world = Arc::new(benchmark("attard2023").1);
    for (_, engine) in engines() {
        let begun = |n_envs| batch_on(&engine, &world, n_envs, 3, all_routes(&world));
        let mut driven = begun(64);
        (0..150).for_each(|_| driven.step_at_random());
        let kept = driven.batch().clone();
        let find = |column| Some(kept.column(column));
        let mut restored = begun(64);
        restored.restore(find).unwrap();
        for simulator in [&mut driven, &mut restored] {
            (0..150).for_each(|_| simulator.step_at_random());
        }
        assert!(rows(driven.batch()) == rows(restored.batch()));
        assert!(rows(driven.batch()) != rows(begun(64).batch()));

        let wrong = |n_envs: usize, wrong: Option<Column>, changed: Option<Vec<u8>>| {
            let mut simulator = begun(n_envs);
            let before = rows(simulator.batch());
            let error = simulator
                .restore(|column| if Some(column) == wrong { changed.as_deref() } else { find(column) })
                .unwrap_err();
            assert!(rows(simulator.batch()) == before);
            error.to_string()
        };
        assert_eq!(
            wrong(64, Some(Column::Truck), None),
            format!("truck: missing; a batch of 64 trucks needs {} bytes", 64 * size_of::<offtrack::layout::Truck>())
        );
        assert_eq!(wrong(32, None, None), "action: 256 bytes; a batch of 32 trucks needs 128 bytes");
        // Indices outside every table.
        let action = wrong(64, Some(Column::Action), Some(vec![255; 64 * size_of::<u32>()]));
        assert!(action.starts_with("action[0]: 4294967295; the world has actions 0.."), "{action}");
        let truck = wrong(64, Some(Column::Truck), Some(vec![255; 64 * size_of::<offtrack::layout::Truck>()]));
        assert!(truck.starts_with("truck[0]: 4294967295; the world has routes 0.."), "{truck}");
        let progress = wrong(64, Some(Column::Progress), Some(vec![255; 64 * size_of::<offtrack::layout::Progress>()]));
        assert!(progress.starts_with("progress[0]: 4294967295; the world has "), "{progress}");
    }
}
