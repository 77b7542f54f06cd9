//! Ranges against rays on the exact outlines, from poses all over every roundabout.

use glam::{DVec2, Vec2};
use offtrack::cpu::sense::ranges;
use offtrack::field::Field;
use offtrack::geometry::Outline;
use offtrack::layout::{N_RAYS, N_TRAILER_RAYS, Truck};
use offtrack::roundabout::Gutter;
use offtrack::world::World;
use rayon::prelude::*;

use crate::benchmark;
use crate::field::{places, pose};

/// Error that a range may have [m].
const TOLERANCE: f64 = 0.02;

/// Where a truck's ray begins and its unit vector.
fn placed(world: &World, truck: &Truck, ray: usize) -> (DVec2, DVec2) {
    let trailer = (truck.trailer_position(&world.params.rig), truck.trailer_heading);
    let (place, heading) = if ray < N_TRAILER_RAYS { trailer } else { (truck.position, truck.heading) };
    let heading = Vec2::from_angle(heading);
    let ray = world.rays[ray];
    ((place + heading.rotate(ray.origin)).as_dvec2(), heading.rotate(ray.direction).as_dvec2().normalize())
}

/// Whether the ray comes within 2 cm of a kerb at less than 5 deg to it, or leaves it again, before or where it ends.
fn grazes(kerbs: &Outline, origin: DVec2, direction: DVec2, end: f64) -> bool {
    let distance = |step: u32| kerbs.signed_distance(origin + direction * 0.005 * f64::from(step));
    let last = (end / 0.005) as u32;
    (0..last).any(|step| {
        let (here, there) = (distance(step), distance(step + 1));
        here.min(there).abs() < 0.02 && here - there < 0.005 * 5.0f64.to_radians().sin()
    })
}

/// Rays in error, rays in error that graze a kerb, and rays that met one, for `n` trucks sensing `field` among `kerbs`.
fn errors(world: &World, kerbs: &Outline, field: &Field, n: u32) -> [usize; 3] {
    let reach = world.params.sensor_range;
    let count = |index: u32| {
        let truck = pose(kerbs, index, 0.0);
        let found = ranges(field, &world.params.rig, &world.rays, &truck, reach);
        let mut counts = [0; 3];
        for (ray, found) in found.into_iter().enumerate() {
            let (origin, direction) = placed(world, &truck, ray);
            let exact = kerbs.ray(origin, direction, f64::from(reach));
            counts[2] += usize::from(0.0 < exact && exact < f64::from(reach));
            // A sensor within a millimetre of a kerb may be on either side of it in f32.
            if TOLERANCE < (exact - f64::from(found)).abs() && 0.001 < kerbs.distance(origin) {
                let grazing = grazes(kerbs, origin, direction, exact.max(f64::from(found)));
                counts[usize::from(grazing)] += 1;
            }
        }
        counts
    };
    (0..n).into_par_iter().map(count).reduce(|| [0; 3], |a, b| std::array::from_fn(|i| a[i] + b[i]))
}

#[test]
fn a_range_is_the_distance_along_the_ray_to_the_kerb_to_two_centimetres() {
    let world = benchmark("attard2023").1;
    let n_trucks = 100_000 / N_RAYS as u32 + 1;
    for gutter in [Gutter::Drivable, Gutter::Solid] {
        for (name, kerbs, field) in places(gutter) {
            let [wrong, grazing, met] = errors(&world, &kerbs, &field, n_trucks);
            println!("{name} {gutter:?}: {wrong} wrong, {grazing} graze, {met} meet a kerb");
            assert_eq!(wrong, 0, "{name}");
            assert!(grazing < 300, "{name}: {grazing} of {} are excused", n_trucks as usize * N_RAYS);
            assert!(n_trucks as usize * N_RAYS / 3 < met, "{name}: {met}");
        }
    }
}

#[test]
fn ranges_to_kerbs_five_centimetres_off_are_found_out() {
    let world = benchmark("attard2023").1;
    let (_, kerbs, _) = places(Gutter::Drivable).swap_remove(0);
    let other = Field::bake(&kerbs.offset(0.05), 0.5);
    let [wrong, _, met] = errors(&world, &kerbs, &other, 30);
    assert!(met * 3 / 4 < wrong, "{wrong} of {met}");
}

#[test]
fn a_sensor_inside_a_kerb_reads_nothing_and_one_in_the_open_its_reach() {
    let world = benchmark("attard2023").1;
    let (_, _, field) = places(Gutter::Drivable).swap_remove(0);
    // The middle of a roundabout is solid.
    let inside = ranges(&field, &world.params.rig, &world.rays, &Truck::default(), 20.0);
    assert!(inside[N_TRAILER_RAYS..].iter().all(|&range| range == 0.0), "{inside:?}");
    let truck = Truck { position: Vec2::new(30.0, 4.0), ..Truck::default() };
    let short = ranges(&field, &world.params.rig, &world.rays, &truck, 0.1);
    assert!(short[N_TRAILER_RAYS..].iter().all(|&range| range == 0.1), "{short:?}");
}

#[test]
fn a_truck_that_is_nowhere_still_gets_ranges() {
    let world = benchmark("attard2023").1;
    let (_, _, field) = places(Gutter::Drivable).swap_remove(0);
    for x in [f32::NAN, f32::INFINITY, 1e9] {
        let truck = Truck { position: Vec2::new(x, 0.0), ..Truck::default() };
        let found = ranges(&field, &world.params.rig, &world.rays, &truck, 20.0);
        assert!(found.iter().all(|range| (0.0..=20.0).contains(range)), "{found:?}");
    }
}
