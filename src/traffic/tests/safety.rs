//! Nobody overlaps, leaves his path, stands for ever or is faster than anybody may be.

use super::{even, map};
use crate::layout::Stream;
use crate::map::{Road, procedural};
use crate::traffic::model::FASTEST;
use crate::traffic::units::{probability, speed};
use crate::traffic::{Car, Demand, Drivers, Mix, Network, Rules, Run};

/// Steps of each run.
const STEPS: u32 = 2_000;
/// Nobody stands so long (steps).
const FOR_EVER: u32 = 600;

/// What must not be, over a run: steps with overlapping cars, the longest standing, cars beyond the ends of their path
/// or at speeds and accelerations that nothing decides; and how many cars there were.
#[derive(Debug, Default)]
struct Seen {
    overlaps: u32,
    standing: u32,
    off: u32,
    cars: usize,
}

fn driven(network: &Network, drivers: Drivers, total: f64, seed: u32) -> Seen {
    let (rules, demand) = (drivers.rules(), even(network, total));
    let mut run = Run::new(network, &rules, &demand, 24, Stream { seed, env: 0 });
    let mut seen = Seen::default();
    for _ in 0..STEPS {
        run.step(|_, _| {});
        seen.overlaps += u32::from(0 < run.overlaps());
        for car in run.cars.iter().filter(|car| car.is_there()) {
            let is_on = (0.0..=network.paths[car.path()].length()).contains(&car.station());
            let is_able = (0..=FASTEST).contains(&car.pace()) && (-8.001..=2.001).contains(&car.acceleration());
            seen.off += u32::from(!is_on || !is_able);
            seen.standing = seen.standing.max(car.standing());
            seen.cars += 1;
        }
    }
    seen
}

#[test]
fn no_car_overlaps_another_leaves_its_path_or_stands_for_ever_at_any_demand() {
    let mut roads: Vec<Road> = ["16m", "20m"].map(|name| Road::named(name).unwrap()).into();
    roads.extend(["zala8", "town03", "town03-crossing"].map(map));
    roads.extend((0..10).map(|index| procedural::find(&format!("mixed/2026/{index}")).unwrap()));
    let mut steps = 0;
    for (seed, road) in roads.iter().enumerate() {
        let network = Network::bake(road).unwrap();
        for total in [300.0, 900.0, 1500.0, 2100.0] {
            if 900.0 < total && !network.has_ring {
                continue;
            }
            let seen = driven(&network, Drivers::Fitted, total, seed as u32);
            let name = &road.name;
            assert!(seen.overlaps == 0 && seen.off == 0 && seen.standing < FOR_EVER, "{name} {total}: {seen:?}");
            // There were cars, and more at a higher demand.
            assert!(total * 0.002 * f64::from(STEPS) < seen.cars as f64, "{name} {total}: {seen:?}");
            steps += STEPS;
        }
    }
    assert!(100_000 < steps, "{steps}");
}

#[test]
fn no_car_of_other_drivers_overlaps_another_leaves_its_path_or_stands_for_ever() {
    let roads: Vec<Road> = (0..6).map(|index| procedural::find(&format!("mixed/2026/{index}")).unwrap()).collect();
    let roads: Vec<Road> = roads.into_iter().chain(["16m", "20m"].map(|name| Road::named(name).unwrap())).collect();
    for drivers in [Drivers::Aggressive, Drivers::Timid, Drivers::Distracted] {
        for (seed, road) in roads.iter().chain(&[map("zala8")]).enumerate() {
            let network = Network::bake(road).unwrap().driven_by(drivers);
            for total in [600.0, 1500.0] {
                let seen = driven(&network, drivers, total, seed as u32);
                let is_safe = seen.overlaps == 0 && seen.off == 0 && seen.standing < FOR_EVER;
                assert!(is_safe && 2000 < seen.cars, "{drivers:?} {} {total}: {seen:?}", road.name);
            }
        }
    }
}

#[test]
fn timid_drivers_take_longer_on_a_road_than_the_fitted_ones_and_aggressive_ones_less_time() {
    let on_road = [Drivers::Aggressive, Drivers::Fitted, Drivers::Timid].map(|drivers| {
        let network = super::baked("20m").driven_by(drivers);
        (0..4).map(|seed| driven(&network, drivers, 1500.0, seed).cars).sum::<usize>()
    });
    assert!(on_road[0] * 103 < on_road[1] * 100 && on_road[1] * 103 < on_road[2] * 100, "{on_road:?}");
}

#[test]
fn who_always_looks_away_holds_his_speed_until_something_looms_and_then_stops_before_it() {
    let network = super::baked("16m");
    let nobody = Demand::new(&network, &vec![0.0; network.paths.len()], Mix::default()).unwrap();
    let rules = Rules { lapses: probability(1.0), ..Rules::FITTED };
    let mut run = Run::new(&network, &rules, &nobody, 2, Stream::default());
    run.cars[0] = Car::entering(0, 7, speed(5.0));
    (0..20).for_each(|_| run.step(|_, _| {}));
    assert!((run.cars[0].speed() - 5.0).abs() < 1e-3, "{}", run.cars[0].speed());
    // Something stands on its way: it looks away too, and stays there.
    run.cars[1] = Car { station: 42 << 20, ..Car::entering(0, 7, 0) };
    let mut hardest = 0.0f32;
    for _ in 0..200 {
        run.step(|_, _| {});
        hardest = hardest.min(run.cars[0].acceleration());
        assert_eq!(run.overlaps(), 0);
    }
    assert!(run.cars[0].speed() < 0.01 && run.cars[0].station() < 38.0 && hardest < -3.0, "{hardest} m/s²");
    // The same without lapses speeds up first.
    let mut run = Run::new(&network, &Rules::FITTED, &nobody, 2, Stream::default());
    run.cars[0] = Car::entering(0, 7, speed(5.0));
    (0..20).for_each(|_| run.step(|_, _| {}));
    assert!(6.0 < run.cars[0].speed());
}

#[test]
fn cars_overlap_where_zones_are_shifted_by_a_car_length() {
    let network = baked_with_shifted_zones("20m");
    let seen = driven(&network, Drivers::Fitted, 1500.0, 1);
    assert!(0 < seen.overlaps, "{seen:?}");
}

/// The tables of a road of which every zone of two paths of different sources lies 5 m later on the first.
fn baked_with_shifted_zones(name: &str) -> Network {
    let mut network = super::baked(name);
    let n = network.paths.len();
    for a in 0..n {
        for b in 0..n {
            if network.paths[a].source == network.paths[b].source {
                continue;
            }
            let pair = network.pairs[a * n + b];
            for zone in &mut network.zones[usize::from(pair.first)..][..usize::from(pair.n)] {
                zone.a = zone.a.map(|s| s + 320);
                zone.delta -= 320;
            }
        }
    }
    network
}
