//! The baked distance against the exact outlines of every roundabout, and helpers for the tests of the stages that use
//! it.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails as the test itself does")]

use std::f32::consts::PI;
use std::path::Path;
use std::sync::Arc;

use glam::{DVec2, Vec2};
use offtrack::engine::stages::Stage;
use offtrack::field::Field;
use offtrack::geometry::Outline;
use offtrack::layout::random::{signed_unit, words};
use offtrack::layout::{Column, Truck};
use offtrack::map::{Gutter, Road};
use offtrack::scenario::FIELD_CELL;
use offtrack::simulator::{Engine, RouteChoice, Simulator};
use offtrack::world::World;
use rayon::prelude::*;

use crate::batch_on;

/// Every roundabout of the repository, its kerbs and their field.
pub(crate) fn places(gutter: Gutter) -> Vec<(String, Outline, Field)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/roundabouts");
    let mut files: Vec<_> = folder.read_dir().unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert_eq!(files.len(), 10, "{files:?}");
    let place = |file: &Path| {
        let roundabout = Road::read(file).unwrap();
        let kerbs = roundabout.kerbs(gutter);
        let field = Field::bake(&kerbs, FIELD_CELL);
        (roundabout.name, kerbs, field)
    };
    files.iter().map(|file| place(file)).collect()
}

/// A truck at a random pose with its drive axle on the road or at most `beyond` behind a kerb; a function of `index`
/// (m).
pub(crate) fn pose(kerbs: &Outline, index: u32, beyond: f64) -> Truck {
    let (low, high) = kerbs.bounds();
    let mut tries = (0..).map(|attempt| words(11, index, attempt, 0).map(signed_unit));
    let [x, y, heading, articulation] =
        tries.find(|[x, y, ..]| -beyond <= kerbs.signed_distance(between(low, high, *x, *y))).unwrap();
    Truck {
        position: between(low, high, x, y).as_vec2(),
        heading: PI * heading,
        trailer_heading: PI * heading - articulation,
        ..Truck::default()
    }
}

/// Trucks among the kerbs of `field` after one stage on an engine.
pub(crate) fn after_stage(engine: &Engine, world: &World, field: &Field, trucks: &[Truck], stage: Stage) -> Simulator {
    let mut world = world.clone();
    world.fields = vec![field.clone()];
    world.routes.iter_mut().for_each(|route| route.roundabout = 0);
    let mut simulator = batch_on(engine, &Arc::new(world), trucks.len(), 0, RouteChoice::Drawn(vec![0]));
    let batch = simulator.batch().clone();
    simulator
        .restore(|column| {
            Some(if column == Column::Truck { bytemuck::cast_slice(trucks) } else { batch.column(column) })
        })
        .unwrap();
    simulator.run_stage(stage);
    simulator
}

fn between(low: DVec2, high: DVec2, x: f32, y: f32) -> DVec2 {
    low + (high - low) * (DVec2::new(f64::from(x), f64::from(y)) + 1.0) / 2.0
}

/// Random points at most 5 m from a kerb with the exact distance there and the field's.
pub(crate) fn near_kerbs(kerbs: &Outline, field: &Field) -> Vec<(DVec2, f64, f64)> {
    let (low, high) = kerbs.bounds();
    let point = |index: u32| {
        let [x, y, ..] = words(5, index, 0, 0).map(signed_unit);
        let p = between(low, high, x, y).as_vec2();
        (p.as_dvec2(), kerbs.signed_distance(p.as_dvec2()), f64::from(field.distance(p)))
    };
    (0..200_000).into_par_iter().map(point).filter(|(_, exact, _)| exact.abs() < 5.0).collect()
}

/// Whether the exact distance has a kink near `p`. Where it is smooth, its gradient has length 1.
fn kinked(kerbs: &Outline, p: DVec2) -> bool {
    let at = |x: f64, y: f64| kerbs.signed_distance(p + DVec2::new(x, y));
    (-5..=5).any(|i| {
        (-5..=5).any(|j| {
            let (x, y, h) = (f64::from(i) * 0.1, f64::from(j) * 0.1, 0.05);
            let slope = DVec2::new(at(x + h, y) - at(x - h, y), at(x, y + h) - at(x, y - h)).length() / (2.0 * h);
            slope < 0.99
        })
    })
}

#[test]
fn a_field_is_within_three_centimetres_of_the_exact_distance_and_within_one_away_from_kinks() {
    for gutter in [Gutter::Drivable, Gutter::Solid] {
        for (name, kerbs, field) in places(gutter) {
            let points = near_kerbs(&kerbs, &field);
            assert!(20_000 < points.len(), "{name}: {}", points.len());
            let wrong = |limit: f64| points.iter().filter(move |(_, exact, baked)| limit < (exact - baked).abs());
            assert_eq!(wrong(0.03).count(), 0, "{name}: {:?}", wrong(0.03).next());
            let smooth = wrong(0.01).find(|(p, ..)| !kinked(&kerbs, *p));
            assert_eq!(smooth, None, "{name}");
            let mut errors: Vec<f64> = points.iter().map(|(_, exact, baked)| (exact - baked).abs()).collect();
            errors.sort_by(f64::total_cmp);
            let last = errors.len() - 1;
            println!(
                "{name} {gutter:?}: max {:.4} 99.9 % {:.4} median {:.5} m, {} bytes",
                errors[last],
                errors[last * 999 / 1000],
                errors[last / 2],
                field.bytes()
            );
        }
    }
}

#[test]
fn a_field_of_other_kerbs_fails_the_comparison() {
    let (_, kerbs, _) = places(Gutter::Drivable).swap_remove(0);
    let other = Field::bake(&kerbs.offset(0.05), FIELD_CELL);
    let points = near_kerbs(&kerbs, &other);
    // At corners of the kerb, growing moves the outline less.
    let off = points.iter().filter(|(_, exact, baked)| 0.03 < (exact - baked).abs()).count();
    assert!(points.len() * 9 / 10 < off, "{off} of {}", points.len());
}

#[test]
fn the_size_of_a_cell_changes_the_layout_and_not_the_accuracy() {
    let (name, kerbs, _) = places(Gutter::Drivable).swap_remove(0);
    for cell in [0.1, 0.25, 1.0] {
        let field = Field::bake(&kerbs, cell);
        let worst =
            near_kerbs(&kerbs, &field).iter().map(|(_, exact, baked)| (exact - baked).abs()).fold(0.0, f64::max);
        assert!(worst < 0.03, "{name}, {cell} m: {worst}");
    }
}

#[test]
fn beyond_the_grid_everything_is_solid_and_the_distance_keeps_falling() {
    let (_, kerbs, field) = places(Gutter::Drivable).swap_remove(0);
    let (low, high) = kerbs.bounds();
    for direction in (0..64).map(|i| Vec2::from_angle(i as f32 * 0.1)) {
        let mut last = 0.0;
        for step in 1..40 {
            let out = (0.75 * (high - low).length() as f32 + 10.0 * step as f32) * direction;
            let distance = field.distance(out);
            assert!(distance.is_finite() && distance < last, "{out}: {distance} after {last}");
            last = distance;
        }
    }
}

#[test]
fn a_point_that_is_not_finite_reads_as_solid() {
    let (.., field) = places(Gutter::Drivable).swap_remove(0);
    for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN] {
        for point in [Vec2::new(x, 1.0), Vec2::new(1.0, x), Vec2::splat(x)] {
            // NaN fails this comparison too.
            assert!(field.distance(point) < 0.0, "{point}: {}", field.distance(point));
        }
    }
}
