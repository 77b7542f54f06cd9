//! Buses, rigid trucks and tractor-trailers: their parts roll as they must, and nobody is in their way.

use glam::Vec2;

use super::{baked, map};
use crate::layout::Stream;
use crate::map::ground::{Ground, Line};
use crate::map::{Road, procedural};
use crate::traffic::car::Outline;
use crate::traffic::{Car, Demand, Event, Large, Mix, Network, Rules, Run};

const MIX: Mix = Mix { vans: 0.2, rude: 0.1, large: [0.05; 3] };
/// Steps of each run.
const STEPS: u32 = 2_000;

fn with_large(road: &Road) -> Network {
    Network::bake(road).unwrap().with_large(road).unwrap()
}

fn named(name: &str) -> Network {
    with_large(&Road::named(name).unwrap())
}

fn demand(network: &Network, total: f64) -> Demand {
    Demand::new(network, &Demand::even(network, total), MIX).unwrap()
}

/// Steps with overlaps, the longest standing (steps), how many of each kind there were, and how many were taken away.
#[derive(Debug, Default)]
struct Seen {
    overlaps: u32,
    standing: u32,
    kinds: [usize; 3],
    removed: u32,
}

fn driven(network: &Network, total: f64, seed: u32) -> Seen {
    let (rules, demand) = (Rules::FITTED, demand(network, total));
    let mut run = Run::new(network, &rules, &demand, 24, Stream { seed, env: 0 });
    let mut seen = Seen::default();
    for _ in 0..STEPS {
        run.step(|event, _| seen.removed += u32::from(matches!(event, Event::Removed(_))));
        seen.overlaps += u32::from(0 < run.overlaps());
        for car in run.cars.iter().filter(|car| car.is_there()) {
            seen.standing = seen.standing.max(car.standing());
            if let Some(kind) = car.large() {
                seen.kinds[kind as usize - 1] += 1;
            }
        }
    }
    seen
}

/// A vehicle of a kind with its front at a station of a path (m).
fn at(path: usize, station: f32, kind: Large) -> Car {
    Car { station: (station * 1_048_576.0) as i32, ..Car::entering(path, (kind as u32) << 8, 0) }
}

/// The last unit of a vehicle, and where its rear axle is.
fn rear_axle(network: &Network, car: &Car, kind: Large) -> (Outline, Vec2) {
    let unit = car.outlines(network).last().unwrap();
    let shape = kind.shape();
    let ahead = unit.half_length - shape.ahead - shape.wheelbase;
    (unit, unit.middle + ahead * unit.along)
}

#[test]
fn nobody_overlaps_a_large_vehicle_or_stands_for_ever() {
    let mut roads: Vec<Road> = ["16m", "20m", "50m"].map(|name| Road::named(name).unwrap()).into();
    roads.extend(["zala8", "sumo22"].map(map));
    roads.extend((0..8).map(|index| procedural::find(&format!("mixed/2026/{index}")).unwrap()));
    let mut kinds = [0; 3];
    for (seed, road) in roads.iter().enumerate() {
        let network = with_large(road);
        for total in [600.0, 1500.0] {
            let seen = driven(&network, total, seed as u32);
            assert!(seen.overlaps == 0 && seen.standing < 600 && seen.removed == 0, "{} {total}: {seen:?}", road.name);
            kinds.iter_mut().zip(seen.kinds).for_each(|(sum, n)| *sum += n);
        }
    }
    assert!(kinds.iter().all(|&n| 4_000 < n), "{kinds:?}");
}

#[test]
fn each_kind_is_the_fraction_of_all_vehicles_that_is_asked_for() {
    let network = named("50m");
    let mix = Mix { vans: 0.5, rude: 0.0, large: [0.1, 0.2, 0.0] };
    let demand = Demand::new(&network, &Demand::even(&network, 600.0), mix).unwrap();
    let (mut vans, mut large, mut all) = (0, [0; 3], 0);
    for seed in 0..16 {
        let mut run = Run::new(&network, &Rules::FITTED, &demand, 24, Stream { seed, env: 0 });
        for _ in 0..36_000 {
            run.step(|event, cars| {
                let Event::Left(slot) = event else { return };
                all += 1;
                vans += u32::from(cars[slot].length() == 7.0);
                if let Some(kind) = cars[slot].large() {
                    large[kind as usize - 1] += 1;
                }
            });
        }
    }
    let found = [vans, large[0], large[1], large[2]].map(|n| f64::from(n) / f64::from(all));
    for (found, expected) in found.into_iter().zip([0.5, 0.1, 0.2, 0.0]) {
        assert!((found - expected).abs() < 0.02, "{found} of {all}, not {expected}");
    }
}

#[test]
fn they_overlap_where_their_zones_are_those_of_cars() {
    let mut network = named("16m");
    let large = network.large.as_mut().unwrap();
    for (index, pair) in large.pairs.iter_mut().enumerate() {
        *pair = network.pairs[index % network.pairs.len()];
    }
    large.zones.clone_from(&network.zones);
    let overlaps: u32 = (0..3).map(|seed| driven(&network, 1800.0, seed).overlaps).sum();
    assert!(20 < overlaps, "{overlaps}");
}

#[test]
fn a_rear_axle_does_not_slide() {
    let network = named("16m");
    for kind in Large::ALL {
        let (mut worst, mut turned) = (0.0f32, 0.0f32);
        for path in 0..network.paths.len() {
            let mut before: Option<(Outline, Vec2)> = None;
            let n = (2.0 * (network.paths[path].length() - 22.0)) as usize;
            for k in 0..n {
                let here = rear_axle(&network, &at(path, 21.0 + 0.5 * k as f32, kind), kind);
                if let Some((unit, axle)) = before {
                    let (way, along) = (here.1 - axle, 0.5 * (unit.along + here.0.along));
                    worst = worst.max(way.perp_dot(along).abs());
                    turned += unit.along.perp_dot(here.0.along).abs();
                }
                before = Some(here);
            }
        }
        // Of half a metre; the trails are kept every 2 m.
        assert!(worst < 0.06 && 20.0 < turned, "{kind:?}: {worst} m, {turned} rad");
    }
}

#[test]
fn both_units_of_a_tractor_trailer_meet_at_its_kingpin_and_have_their_lengths() {
    let network = named("20m");
    let kind = Large::TractorTrailer;
    for path in 0..network.paths.len() {
        for station in [25.0, 55.0, 60.0, 70.0] {
            let units: Vec<Outline> = at(path, station, kind).outlines(&network).collect();
            let [tractor, trailer] = units[..] else { panic!("{} units", units.len()) };
            let on_tractor = tractor.middle + (tractor.half_length - 4.498) * tractor.along;
            let kingpin = trailer.middle + (trailer.half_length - 2.09) * trailer.along;
            // Both are near the same line, of which one is a chord.
            let apart = on_tractor.distance(kingpin);
            assert!(apart < 0.4, "path {path} at {station}: {apart} m");
            let length = 2.0 * (tractor.half_length + trailer.half_length) - 5.864 + 4.498 - 2.09;
            assert!((length - 16.118).abs() < 1e-3);
        }
    }
    let one = |kind: Large| at(0, 30.0, kind).outlines(&network).map(|unit| 2.0 * unit.half_length).collect::<Vec<_>>();
    assert!((one(Large::Bus)[0] - 12.0).abs() < 1e-4 && (one(Large::RigidTruck)[0] - 10.0).abs() < 1e-4);
}

#[test]
fn what_a_vehicle_covers_lies_within_what_it_is_said_to_sweep_evenly_on_both_sides() {
    let network = named("16m");
    let large = network.large.as_ref().unwrap();
    for kind in Large::ALL {
        for (index, path) in network.paths.iter().enumerate() {
            let samples = path.first as usize..(path.first + path.n) as usize;
            for k in 10..path.n as usize - 3 {
                let car = at(index, 2.0 * k as f32, kind);
                for unit in car.outlines(&network) {
                    let across = unit.half_width * unit.along.perp();
                    let corners = [1.0, -1.0].map(|side| unit.middle + unit.half_length * unit.along + side * across);
                    for corner in corners {
                        let nearest = samples.clone().min_by(|&a, &b| {
                            let to = |k: usize| network.samples[k].position.distance(corner);
                            to(a).total_cmp(&to(b))
                        });
                        let sample = nearest.unwrap();
                        let left =
                            network.samples[sample].direction.perp_dot(corner - network.samples[sample].position);
                        let (middle, half_width) = large.bands[sample][kind as usize - 1].middle();
                        assert!((left - middle).abs() < half_width + 0.25, "{kind:?} path {index} sample {sample}");
                    }
                }
            }
            // The front swings out as far as the rear cuts in.
            let aside = large.bands[samples].iter().map(|bands| bands[kind as usize - 1].middle().0.abs());
            assert!(aside.fold(0.0, f32::max) < 0.6, "{kind:?} path {index}");
        }
    }
}

#[test]
fn of_two_in_a_zone_both_find_the_same_ahead_and_stations_beside_each_other_lead_back() {
    let network = named("16m");
    let (n, large) = (network.paths.len(), network.large.as_ref().unwrap());
    let (mut n_uneven, mut worst, mut sum, mut n_stations) = (0, 0, 0, 0);
    for classes in [[0, 2], [1, 2], [2, 2], [1, 0]] {
        for (a, b) in (0..n).flat_map(|a| (0..n).map(move |b| (a, b))) {
            let zones = |classes: [usize; 2], paths: [usize; 2]| {
                let pair = large.pair(n, classes, paths);
                large.zones[usize::from(pair.first)..][..usize::from(pair.n)].iter().map(|zone| zone.stretch())
            };
            let here = zones(classes, [a, b]);
            let there = zones([classes[1], classes[0]], [b, a]);
            for (one, other) in here.zip(there).filter(|(one, _)| one.kind == crate::traffic::Kind::Follow) {
                assert_eq!(
                    [one.a_in, one.a_out, one.b_in, one.b_out],
                    [other.b_in, other.b_out, other.a_in, other.a_out]
                );
                n_uneven += usize::from(one.slower != 0);
                for k in 0..16 {
                    let mine = one.a_in + (one.a_out - one.a_in) * k / 16;
                    let its = one.b_in + (one.b_out - one.b_in) * (15 - k) / 16;
                    assert_ne!(one.is_ahead(mine, its, false), other.is_ahead(its, mine, true));
                    if (4..12).contains(&k) {
                        let back = one.beside(other.beside(mine));
                        worst = worst.max((back - mine).abs());
                        (sum, n_stations) = (sum + i64::from((back - mine).abs()), n_stations + 1);
                    }
                }
            }
        }
    }
    assert!(500 < n_uneven && worst < 3 * 1024 && sum < 150 * n_stations, "{n_uneven} {worst} {sum} {n_stations}");
}

#[test]
fn a_network_without_large_vehicles_is_that_of_cars_and_their_words_read_back() {
    let [cars, network] = [baked("20m"), named("20m")];
    assert_eq!(Network { large: None, ..network.clone() }, cars);
    let words = network.words();
    assert_eq!(Network::parsed(&words), Some(network));
    assert_eq!(words[1..cars.words().len()], cars.words()[1..]);
    assert_eq!(Network::parsed(&words[..words.len() - 1]), None);
    let mut changed = words.clone();
    changed[0] -= 2;
    assert_eq!(Network::parsed(&changed), None);
}

#[test]
fn a_vehicle_that_is_longer_than_the_way_to_its_line_does_not_come() {
    let road = Road::named("20m").unwrap();
    let shorter = |line: &Line| {
        let (from, to) = (line.line.point_at(0.0).length() - road.ground().outer_radius, line.line.length());
        Line { line: line.line.part((from - 14.0).max(0.0), to), ..line.clone() }
    };
    let lines = road.ground().lines.iter().map(shorter).collect();
    let short = Road::on("short".into(), Ground { lines, ..road.ground().clone() });
    let (whole, cut) = (with_large(&road), with_large(&short));
    let comes = |network: &Network, kind| (0..network.paths.len()).any(|path| network.fits(&at(path, 0.0, kind)));
    assert!(Large::ALL.into_iter().all(|kind| comes(&whole, kind)));
    assert!(!Large::ALL.into_iter().any(|kind| comes(&cut, kind)));
}
