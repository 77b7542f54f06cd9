//! Rules by the ground that a truck covers.

use super::*;
use crate::traffic::arrivals::fill;
use crate::traffic::units::metres;
use crate::traffic::{Backlog, Event, arrive};

/// A path that begins at an arm's right lane.
const PATH: usize = 0;

#[test]
fn a_car_polite_or_rude_stops_behind_a_truck_that_stands_in_its_lane() {
    let network = baked("20m");
    let view = view_at(&network, PATH, 40.0, 0.0);
    for is_rude in [false, true] {
        let (kept_clear, car) = driven(&network, view, car_at(PATH, 5.0, 8.0, is_rude), 200);
        let gap = 40.0 - metres(view.length) - car.station();
        assert!(kept_clear && car.speed() == 0.0 && (0.5..4.5).contains(&gap), "rude {is_rude}: {gap} m");
    }
}

#[test]
fn a_car_follows_a_truck_that_drives_on_farther_than_one_that_stands() {
    let network = baked("20m");
    let of = |v: f32| beside(&network, view_at(&network, PATH, 40.0, v), car_at(PATH, 8.0, 6.0, false));
    let ([behind_standing, alone], [behind_driving, _]) = (of(0.0), of(6.0));
    assert!(
        behind_standing < behind_driving - 1.0 && behind_driving < alone,
        "{behind_standing} {behind_driving} {alone}"
    );
}

#[test]
fn a_polite_car_in_the_ring_slows_gently_for_where_a_truck_will_be_and_a_rude_one_does_not() {
    let network = baked("20m");
    let mut n_slow = 0;
    for path in 0..network.paths.len() {
        let line = metres(network.paths[path].line);
        let view = view_at(&network, path, line + 1.0, 6.0);
        assert!(!view.waits && view.later[2] != view.now[0]);
        for ring in (0..network.paths.len()).filter(|&ring| network.paths[ring].source != network.paths[path].source) {
            let beyond = metres(network.paths[ring].line) + 3.0;
            for k in 0..15 {
                let station = beyond + 4.0 * k as f32;
                let [polite, alone] = beside(&network, view, car_at(ring, station, 5.0, false));
                let [rude, _] = beside(&network, view, car_at(ring, station, 5.0, true));
                if polite < rude {
                    // 3 m/s² of a slow car, which would gain 2 m/s² alone.
                    assert!(alone - 5.01 < polite, "{polite} m/s² for what will be, {rude} for what is, {alone} alone");
                    n_slow += usize::from(polite < alone - 1.0 && rude == alone);
                }
            }
        }
    }
    assert!(100 < n_slow, "{n_slow}");
}

#[test]
fn a_car_that_would_brush_a_truck_beside_its_flank_brakes_and_one_with_more_room_drives_on() {
    let network = baked("20m");
    // The nose ends 3 m behind the car's front, where no sample of its corridor is near.
    let car = car_at(PATH, 30.0, 0.0, true);
    let view = view_at(&network, PATH, 27.0, 0.0);
    let side_by_side = 1.25 + car.half_width();
    let [near, alone] = beside(&network, aside(view, side_by_side + 0.1), car);
    let [far, _] = beside(&network, aside(view, side_by_side + 0.25), car);
    assert_eq!(far, alone);
    assert!((near + 8.0).abs() < 0.01 && 0.5 < alone, "{near} {alone}");
}

#[test]
fn nobody_enters_where_a_truck_stands_or_is_about_to_come() {
    let network = baked("20m");
    let demand = Demand::new(&network, &vec![0.0; network.paths.len()], Mix::default()).unwrap();
    let setting = Setting { network: &network, rules: &Rules::FITTED, demand: &demand };
    let entered = |view: View| {
        let (mut cars, mut backlog, mut entered) = (vec![Car::NONE; 24], Backlog::default(), Vec::new());
        (0..network.sources.len()).for_each(|source| fill(&mut backlog, source));
        let views = [Some(view)];
        let trucks = Trucks::new(&network, &views, 0, 0);
        arrive(setting, CLOCK, &mut cars, &mut backlog, &trucks, &mut |event, _| {
            if let Event::Entered(source, _) = event {
                entered.push(source);
            }
        });
        entered
    };
    let all: Vec<usize> = (0..network.sources.len()).collect();
    let but_one = &all[1..];
    assert_eq!(network.paths[PATH].source, 0);
    // Its rear is at 3.5 m, then at 14 m; then it comes, and then it is still far.
    assert_eq!(entered(view_at(&network, PATH, 20.0, 0.0)), but_one);
    assert_eq!(entered(view_at(&network, PATH, 30.5, 5.0)), all);
    let coming = |before: i32| View { station: -before * 1024, ..view_at(&network, PATH, 45.0, 5.0) };
    assert_eq!(entered(coming(12)), but_one);
    assert_eq!(entered(coming(14)), all);
}

#[test]
fn a_bit_tells_which_car_slows_for_the_truck_until_it_decides_again() {
    let network = baked("20m");
    let views = [Some(view_at(&network, PATH, 40.0, 0.0))];
    let trucks = Trucks::new(&network, &views, 0, 0b1010);
    let far = car_at(network.paths.len() - 1, 20.0, 6.0, false);
    // Slots 0 and 2 decide.
    let cars = [car_at(PATH, 12.0, 6.0, false), far, far, far];
    let demand = Demand::new(&network, &vec![0.0; network.paths.len()], Mix::default()).unwrap();
    let setting = Setting { network: &network, rules: &Rules::FITTED, demand: &demand };
    decide(setting, CLOCK, &mut cars.clone(), &trucks);
    assert_eq!(trucks.hindered(), 0b1011);
    decide(setting, Clock { step: 1, ..CLOCK }, &mut cars.clone(), &trucks);
    assert_eq!(trucks.hindered(), 0b0001);
}
