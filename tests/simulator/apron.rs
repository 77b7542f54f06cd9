//! Aprons: a trailer may drive on them, a tractor may not, on every engine.

use std::sync::Arc;

use glam::{DVec2, Vec2};
use offtrack::engine::stages::Stage;
use offtrack::field::Field;
use offtrack::layout::{Ended, Truck};
use offtrack::map::{Gutter, Road, UnitKerbs};
use offtrack::physics::closeness;
use offtrack::scenario::{FIELD_CELL, Scenario};
use offtrack::simulator::{Engine, RouteChoice};
use offtrack::vehicle::swept::Pose;
use offtrack::world::World;
use rayon::prelude::*;

use crate::episodes::{all_routes, rows};
use crate::field::{after_stage, pose};
use crate::left_hand::{left_hand, text, world};
use crate::{batch_on, benchmark, engines};

/// Width of the aprons (m).
const APRON: f64 = 2.5;

/// A shipped roundabout file's text with an apron.
fn with_apron(name: &str, width: f64) -> String {
    let text = text(name);
    assert_eq!(text.matches("[ring]\n").count(), 1);
    text.replace("[ring]\n", &format!("[ring]\napron = {width:?}\n"))
}

pub(crate) fn road(name: &str) -> Road {
    Road::from_toml(name, &with_apron(name, APRON)).unwrap()
}

/// A world whose trailers drive between the trailer's kerbs.
fn on_kerbs(kerbs: &UnitKerbs) -> (World, Field) {
    let mut world = benchmark("attard2023").1;
    world.trailer_fields = vec![Some(Field::bake(kerbs.trailer(), FIELD_CELL))];
    (world, Field::bake(&kerbs.tractor, FIELD_CELL))
}

/// Corners of both units' rectangles, grown by `margin` (m).
fn units(world: &World, truck: &Truck, margin: f32) -> [[DVec2; 4]; 2] {
    let mut rig = world.rigs[0];
    for body in [&mut rig.tractor_body, &mut rig.trailer_body] {
        (body.front, body.rear, body.half_width) = (body.front + margin, body.rear - margin, body.half_width + margin);
    }
    let pose = Pose {
        position: truck.position.as_dvec2(),
        heading: truck.heading.into(),
        trailer_position: truck.trailer_position(&rig).as_dvec2(),
        trailer_heading: truck.trailer_heading.into(),
    };
    [pose.tractor_corners(&rig), pose.trailer_corners(&rig)]
}

#[test]
fn each_unit_touches_what_it_may_not_drive_on_exactly_when_its_rectangle_does_to_two_centimetres() {
    for (name, gutter) in [("16m", Gutter::Drivable), ("40m-maps", Gutter::Drivable), ("40m-maps", Gutter::Solid)] {
        let kerbs = road(name).unit_kerbs(gutter);
        let (world, field) = on_kerbs(&kerbs);
        let trucks: Vec<Truck> = (0..20_000).into_par_iter().map(|index| pose(kerbs.trailer(), index, 0.5)).collect();
        let touches = |truck: &Truck, margin: f32| {
            let [tractor, trailer] = units(&world, truck, margin);
            [kerbs.tractor.intersects_rectangle(&tractor), kerbs.trailer().intersects_rectangle(&trailer)]
        };
        let exact = |margin: f32| -> Vec<[bool; 2]> { trucks.par_iter().map(|truck| touches(truck, margin)).collect() };
        let (less, more) = (exact(-0.02), exact(0.02));
        let is_on_apron = |truck: &Truck| kerbs.tractor.intersects_rectangle(&units(&world, truck, -0.02)[1]);
        let n_on_apron = trucks.iter().zip(&more).filter(|(truck, more)| !more[1] && is_on_apron(truck)).count();
        assert!(100 < n_on_apron, "{name}: {n_on_apron} trailers are on the apron");
        for (on, engine) in engines() {
            let mut simulator = after_stage(&engine, &world, &field, &trucks, Stage::Collide);
            simulator.run_stage(Stage::Judge);
            let batch = simulator.batch();
            for (index, found) in batch.clearance.iter().enumerate() {
                // What ends the episode, and the reward, go by the same.
                let ended = [Ended::TractorCollided, Ended::TrailerCollided].map(|ended| ended as u32);
                let touched = [found.tractor, found.trailer].into_iter().position(|clearance| clearance <= 0.0);
                assert_eq!(ended.iter().position(|&ended| ended == batch.ended[index]), touched, "{name} on the {on}");
                let term = closeness(&world.reward, found);
                assert!((batch.terms[index].clearance - term).abs() < 1e-5, "{name} on the {on}, {index}: {found:?}");
                for (unit, clearance) in [found.tractor, found.trailer].into_iter().enumerate() {
                    let (less, more) = (less[index][unit], more[index][unit]);
                    assert!(less != more || (clearance <= 0.0) == less, "{name} on the {on}, {index}: {found:?}");
                }
            }
        }
    }
}

#[test]
fn on_an_apron_a_trailer_stands_clear_and_a_tractor_does_not() {
    let kerbs = road("40m").unit_kerbs(Gutter::Drivable);
    let (world, field) = on_kerbs(&kerbs);
    // Straight along a tangent of the circle around the middle of the apron: both units lie on it.
    let radius = Road::named("40m").unwrap().island_radius();
    let at = |outwards: f64| Truck { position: Vec2::new(0.0, -(radius + outwards) as f32), ..Truck::default() };
    let trucks = [at(2.0), at(0.0)];
    for (name, engine) in engines() {
        let simulator = after_stage(&engine, &world, &field, &trucks, Stage::Collide);
        let [beside, on] = [simulator.batch().clearance[0], simulator.batch().clearance[1]];
        assert!(0.0 < beside.tractor && beside.tractor < 1.0, "{name}: {beside:?}");
        assert!(on.tractor <= 0.0 && 0.0 < on.trailer && on.trailer < APRON as f32, "{name}: {on:?}");
        assert!(beside.tractor + 0.5 * (APRON as f32) < beside.trailer, "{name}: {beside:?}");
    }
}

#[test]
fn the_reward_weighs_how_far_the_trailers_wheels_are_on_an_apron_and_nothing_else_does() {
    let kerbs = road("40m").unit_kerbs(Gutter::Drivable);
    let (mut world, field) = on_kerbs(&kerbs);
    let plain = Road::named("40m").unwrap();
    let (island, outer) = (plain.island_radius(), plain.ground().outer_radius);
    let rig = world.rigs[0];
    // The trailer stands along a tangent of the island, so far from its centre.
    let at = |radius: f64| {
        let front = Vec2::new(rig.trailer_wheelbase - rig.fifth_wheel, 0.0);
        Truck { position: Vec2::new(0.0, -radius as f32) + front, ..Truck::default() }
    };
    // Its left wheel is so far inside of the island's face or, last, its right one beyond the outer kerb.
    let depths = [-0.5, -0.02, 0.02, 0.3, 0.98, 1.4, -5.0];
    let half_width = f64::from(rig.trailer_body.half_width);
    let mut trucks = depths.map(|depth| at(island - depth + half_width));
    trucks[depths.len() - 1] = at(outer - half_width + 0.5);
    let rewards = |engine: &Engine, world: &World| {
        let mut simulator = after_stage(engine, world, &field, &trucks, Stage::Collide);
        simulator.run_stage(Stage::Judge);
        let batch = simulator.batch();
        (batch.reward.clone(), batch.terms.clone())
    };
    for (name, engine) in engines() {
        world.reward.apron = 0.0;
        let (before, terms) = rewards(&engine, &world);
        world.reward.apron = -4.0;
        let (after, same) = rewards(&engine, &world);
        assert_eq!(terms, same);
        for ((depth, before), after) in depths.into_iter().zip(before).zip(after) {
            let expected = -4.0 * depth.max(0.0) as f32;
            assert!((after - before - expected).abs() < 0.05, "{name}, {depth} m: {before} {after}");
        }
        let mut without = world.clone();
        without.trailer_fields = vec![None];
        let mut unweighed = without.clone();
        unweighed.reward.apron = 0.0;
        assert_eq!(rewards(&engine, &without), rewards(&engine, &unweighed), "{name}");
    }
}

#[test]
fn an_apron_moves_the_trailers_kerb_alone_and_neither_lanes_nor_what_sensors_see() {
    let folder = tempfile::tempdir().unwrap();
    for gutter in ["drivable", "solid"] {
        let [without, zero, with] = [text("40m-maps"), with_apron("40m-maps", 0.0), with_apron("40m-maps", APRON)]
            .map(|text| world(folder.path(), &text, gutter).1);
        assert_eq!(without.fingerprint(), zero.fingerprint());
        assert_ne!(without.fingerprint(), with.fingerprint());
        assert!(without.trailer_fields == [None] && with.fields == without.fields && with.routes == without.routes);
        let trailer = with.trailer_fields[0].as_ref().unwrap();
        let radius = Road::named("40m-maps").unwrap().island_radius();
        for angle in (0..60).map(|n| Vec2::from_angle(0.1 * n as f32)) {
            let edge = trailer.distance((radius - APRON) as f32 * angle);
            assert!(edge.abs() < 0.01, "{gutter}, {angle}: {edge}");
        }
    }
}

#[test]
fn a_left_hand_world_with_an_apron_is_the_mirrored_right_hand_one_to_the_last_bit() {
    let folder = tempfile::tempdir().unwrap();
    let text = with_apron("16m", APRON);
    let [right, left] = [text.clone(), left_hand(&text)].map(|text| world(folder.path(), &text, "drivable").1);
    for (name, engine) in engines() {
        let [mut one, mut other] = [&right, &left].map(|world| batch_on(&engine, world, 256, 7, all_routes(world)));
        (0..60).for_each(|_| [&mut one, &mut other].into_iter().for_each(|simulator| simulator.step_at_random()));
        assert!(rows(one.batch()) == rows(other.batch()), "{name}");
    }
    let road = Road::from_toml("road", &left_hand(&text)).unwrap();
    let p = DVec2::new(5.0, -3.0);
    let [driven, seen] = [&road, &road.seen()].map(|road| road.unit_kerbs(Gutter::Drivable));
    let there = seen.trailer().signed_distance(p * DVec2::new(1.0, -1.0));
    assert!((driven.trailer().signed_distance(p) - there).abs() < 1e-9 && driven.tractor.signed_distance(p) < -1.0);
}

#[test]
fn an_episode_that_ended_with_the_trailer_on_the_island_goes_on_where_there_is_an_apron() {
    let scenario = Scenario::named("attard2023-full").unwrap();
    let [without, with] = [Road::named("16m").unwrap(), road("16m")].map(|road| {
        let world = Arc::new(World::bake(&scenario.on(road).unwrap()).unwrap());
        let mut simulator = batch_on(&engines()[0].1, &world, 512, 7, RouteChoice::Drawn(vec![0, 1, 2, 3]));
        (0..100).for_each(|_| simulator.step_at_random());
        simulator.tally().unwrap()
    });
    let of_trailers = |tally: &offtrack::simulator::Tally| tally.ended(Ended::TrailerCollided);
    assert!(of_trailers(&with) < of_trailers(&without), "{with:?} {without:?}");
}

#[test]
fn an_outline_file_keeps_an_apron_and_one_that_lies_in_no_island_is_refused_by_its_key() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("road.outline.toml");
    let read = |text: &str| {
        std::fs::write(&file, text).unwrap();
        Road::read(&file)
    };
    let road = road("40m");
    let text = road.ground().text(&[]);
    let found = read(&text).unwrap();
    assert_eq!(found.ground().text(&[]), text);
    for p in found.ground().aprons[0].polyline(0.01) {
        assert!((p.length() - (road.island_radius() - APRON)).abs() < 1e-4, "{p}");
    }
    let apron = |radius: f64, x: f64| {
        let path = format!("path = [[{:?}, 0.0, 1.0], [{:?}, 0.0, 1.0]]", x - radius, x + radius);
        format!("{}\n[[apron]]\n{path}\n", text.split("\n[[apron]]").next().unwrap())
    };
    assert_eq!(read(&apron(2.0, 1.0)).unwrap().ground().aprons.len(), 1);
    let twice = apron(2.0, 1.0) + "[[apron]]\npath = [[-3.0, 0.0, 1.0], [-2.0, 0.0, 1.0]]\n";
    for (text, expected) in [
        (apron(2.0, 300.0), "apron[0].path: in no island; must lie within an island's kerb"),
        (apron(5.0, road.island_radius()), "apron[0].path: crosses; must not cross or touch a kerb"),
        (twice, "apron[1].path: a second one; an earlier apron lies within the same island"),
        (apron(2.0, 1.0).replace("[-1.0, 0.0, 1.0]", "[-1.0]"), "apron[0].path[0]: [-1.0]; must be [x, y]"),
    ] {
        let said = read(&text).map(drop).unwrap_err().to_string();
        assert!(said.contains("road.outline.toml: ") && said.contains(expected), "{said}");
    }
}
