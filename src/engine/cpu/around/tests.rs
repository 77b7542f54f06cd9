//! What is observed of other vehicles, from crowds of cars on shipped roads.

use std::array::from_fn;

use super::*;
use crate::layout::{Stream, VEHICLE_VALUES};
use crate::map::Road;
use crate::traffic::{Demand, Mix, Row as TrafficRow, Rules, Run};

fn baked(road: &str) -> Network {
    Network::bake(&Road::named(road).unwrap()).unwrap()
}

/// What is on a road a minute after it was empty, and each half second from then on.
fn crowds(network: &Network, demand: f64, n: usize, mut look: impl FnMut([Car; N_CARS])) {
    let demand = Demand::new(network, &Demand::even(network, demand), Mix { vans: 0.25, ..Mix::default() }).unwrap();
    let mut run = Run::new(network, &Rules::FITTED, &demand, N_CARS, Stream { seed: 5, env: 0 });
    (0..600).for_each(|_| run.step(|_, _| ()));
    for _ in 0..n {
        (0..5).for_each(|_| run.step(|_, _| ()));
        let mut cars = TrafficRow::EMPTY.cars;
        cars.copy_from_slice(&run.cars);
        look(cars);
    }
}

/// A truck 16 m long whose front is at a station of a path, straight.
fn view(network: &Network, path: usize, front: f32) -> Observing<'_> {
    let (position, along) = network.pose(path, front);
    let unit = |ahead: f32, half_length: f32| Outline {
        middle: position + ahead * along,
        along,
        half_length,
        half_width: 1.275,
    };
    let units = [unit(-3.0, 3.0), unit(-9.5, 6.5)];
    Observing { network, path, front, length: 16.0, units, origin: position - 5.0 * along, along }
}

/// What a truck observes of these cars.
fn observed(view: &Observing, cars: &[Car; N_CARS]) -> [f32; N_AROUND] {
    let others: Vec<_> = view.cars(cars).map(Some).collect();
    view.of(&others)
}

fn value(seen: &[f32; N_AROUND], name: &str) -> f32 {
    seen[first_of_vehicles(name)]
}

#[test]
fn no_order_of_the_slots_changes_what_is_observed() {
    let network = baked("20m");
    let mut n_seen = 0;
    crowds(&network, 1500.0, 40, |cars| {
        let turned: [Car; N_CARS] = from_fn(|slot| cars[(7 * slot + 5) % N_CARS]);
        for (path, front) in [(0, 20.0), (3, 45.0), (8, 49.0), (11, 70.0)] {
            let view = view(&network, path, front);
            let (here, there) = (observed(&view, &cars), observed(&view, &turned));
            assert_eq!(here, there, "path {path}");
            n_seen += here[NEAREST_AT..][..N_NEAREST].iter().filter(|&&is_there| is_there == 1.0).count();
        }
    });
    assert!(400 < n_seen, "{n_seen}");
}

#[test]
fn a_mirrored_road_is_observed_by_the_mirror_factors() {
    let network = baked("16m");
    let mirror = |vector: Vec2| Vec2::new(vector.x, -vector.y);
    let mut mirrored = network.clone();
    for sample in &mut mirrored.samples {
        (sample.position, sample.direction) = (mirror(sample.position), mirror(sample.direction));
    }
    let factors: Vec<f32> =
        VEHICLE_VALUES.iter().flat_map(|values| std::iter::repeat_n(values.mirror, values.n)).collect();
    let mut changed = [false; N_AROUND];
    crowds(&network, 1500.0, 40, |cars| {
        for path in 0..network.paths.len() {
            let view = view(&network, path, 48.0);
            let turned = |unit: Outline| Outline { middle: mirror(unit.middle), along: mirror(unit.along), ..unit };
            let other = Observing {
                network: &mirrored,
                units: view.units.map(turned),
                origin: mirror(view.origin),
                along: mirror(view.along),
                ..view
            };
            let (here, there) = (observed(&view, &cars), observed(&other, &cars));
            for (index, (here, there)) in here.iter().zip(there).enumerate() {
                assert!((factors[index] * here - there).abs() < 1e-5, "path {path}, value {index}: {here} and {there}");
                changed[index] |= 1e-3 < (here - there).abs();
            }
        }
    });
    let sides: Vec<bool> = factors.iter().map(|&factor| factor == -1.0).collect();
    assert_eq!(changed[..], sides[..], "a value that has a side must have been beside 0");
}

#[test]
fn values_lie_in_their_ranges_and_those_that_may_be_1_or_0_are_at_times() {
    let network = baked("50m");
    let mut ends = [[false; 2]; N_AROUND];
    let lows: Vec<f32> = VEHICLE_VALUES.iter().flat_map(|values| std::iter::repeat_n(values.low, values.n)).collect();
    for demand in [300.0, 1500.0] {
        crowds(&network, demand, 60, |cars| {
            for (path, front) in (0..network.paths.len()).flat_map(|path| [5.0, 49.0, 70.0].map(|front| (path, front)))
            {
                for (index, value) in observed(&view(&network, path, front), &cars).into_iter().enumerate() {
                    assert!((lows[index]..=1.0).contains(&value), "value {index}: {value}");
                    ends[index][0] |= value < 0.2;
                    ends[index][1] |= 0.8 < value;
                }
            }
        });
    }
    assert!(ends[..LINE_AT].iter().all(|&[low, high]| low && high), "{ends:?}");
    assert!(ends[HAS_ENTERED_AT] == [true; 2] && ends[NEAREST_AT] == [true; 2]);
}

#[test]
fn a_vehicle_ahead_on_the_same_path_is_at_the_gap_between_them() {
    let network = baked("32m");
    let mut n_behind = 0;
    crowds(&network, 900.0, 80, |cars| {
        for leader in cars.iter().filter(|car| car.is_there()) {
            let (station, speed) = (leader.station(), leader.speed());
            // On the arm, where nothing else is between.
            let front = station - leader.length() - 4.0;
            let others = cars.iter().filter(|car| car.is_there() && car.station() < station).count();
            if front < 5.0 || 40.0 < station || 0 < others {
                continue;
            }
            let seen = observed(&view(&network, leader.path(), front), &cars);
            assert!((50.0 * value(&seen, "gap") - 4.0).abs() < 1e-3, "{seen:?}");
            assert!((15.0 * value(&seen, "gap_speed") - speed).abs() < 0.05 * speed + 1e-3, "{seen:?}");
            assert!((20.0 * value(&seen, "tractor_room") - 4.0).abs() < 0.2, "{seen:?}");
            assert!(60.0 * value(&seen, "vehicle_ahead") - 5.0 - 4.0 - 0.5 * leader.length() < 0.1);
            n_behind += 1;
        }
    });
    assert!(5 < n_behind, "{n_behind}");
}

#[test]
fn what_comes_to_the_entry_is_there_when_it_was_expected() {
    let network = baked("20m");
    // The left lane of an arm, which joins the inner lane of the ring.
    let path = 1;
    assert_eq!(network.source_of(path).lane, 1);
    let truck = view(&network, path, network.paths[path].line() - 1.0);
    // Each half second: when the next vehicle is expected, by how far it is.
    let mut seen: Vec<[f32; 2]> = Vec::new();
    crowds(&network, 900.0, 600, |cars| {
        let values = observed(&truck, &cars);
        assert_eq!(value(&values, "has_entered"), 0.0);
        assert!((50.0 * value(&values, "line_distance") - 1.0).abs() < 1e-3);
        seen.push([10.0 * values[ARRIVAL_AT + 1], 50.0 * values[DISTANCE_AT + 1]]);
        let gone = 10.0 * values[GONE_AT + 1];
        assert!(10.0 * values[ARRIVAL_AT + 1] <= gone, "{values:?}");
    });
    let approaches = seen.windows(2).filter(|two| 0.5 < two[1][1] && two[1][1] < two[0][1] && two[0][1] < 25.0);
    let errors: Vec<f32> = approaches.map(|two| (two[0][0] - two[1][0] - 0.5).abs()).collect();
    let mean = errors.iter().sum::<f32>() / errors.len() as f32;
    assert!(20 < errors.len() && mean < 0.15, "{} {mean}", errors.len());
    assert!(seen.iter().any(|&[arrival, _]| arrival == 0.0) && seen.iter().any(|&[arrival, _]| arrival == 10.0));
}
