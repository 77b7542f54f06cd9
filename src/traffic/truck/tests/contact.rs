//! Whose fault a contact is.

use super::*;
use crate::traffic::units::metres;
use crate::traffic::{Contact, Entry, Met, touched};

/// The truck's path.
const PATH: usize = 0;

fn contact(network: &Network, truck: &Truck, steps: Option<u32>, cars: &[Car]) -> Option<Contact> {
    let entry = Entry { arm: network.source_of(PATH).entry, steps };
    touched(network, &Met { rig: &rig(), truck, entry }, cars)
}

/// Whether the truck is at fault of its contact with a car.
fn is_trucks_fault(network: &Network, truck: &Truck, steps: Option<u32>, car: Car) -> bool {
    contact(network, truck, steps, &[car]).expect("they touch").is_trucks_fault
}

#[test]
fn a_truck_is_met_by_what_drives_into_it_from_behind_and_meets_what_it_drives_into() {
    let network = baked("20m");
    let (standing, driving) = (truck_at(&network, PATH, 40.0, 0.0), truck_at(&network, PATH, 40.0, 5.0));
    let rear = 40.0 - 16.118;
    let behind = car_at(PATH, rear + 0.2, 3.0, false);
    let ahead = |v: f32| {
        let car = car_at(PATH, 0.0, v, false);
        car_at(PATH, 40.0 + car.length() - 0.2, v, false)
    };
    assert!(!is_trucks_fault(&network, &standing, None, behind));
    assert!(!is_trucks_fault(&network, &driving, None, behind));
    assert!(is_trucks_fault(&network, &driving, None, ahead(0.0)));
    assert!(is_trucks_fault(&network, &driving, None, ahead(2.0)));
    // Who stands hits nobody.
    assert!(is_trucks_fault(&network, &standing, None, car_at(PATH, rear + 0.2, 0.0, false)));
}

#[test]
fn a_truck_that_has_entered_lately_is_at_fault_and_one_that_has_long_been_in_the_ring_is_not_where_a_car_cuts_in() {
    let network = baked("20m");
    let longest = (0..network.paths.len()).max_by_key(|&path| network.paths[path].length).unwrap();
    let arm = network.source_of(longest).entry;
    let of = |truck: &Truck, steps: u32, car: Car| {
        touched(&network, &Met { rig: &rig(), truck, entry: Entry { arm, steps: Some(steps) } }, &[car])
            .map(|contact| contact.is_trucks_fault)
    };
    let (mut n_was_there, mut n_cuts_in, mut n_ahead) = (0, 0, 0);
    let paths = (0..network.paths.len()).filter(|&path| network.source_of(path).entry != arm);
    for (path, front) in paths.flat_map(|path| (60..120).step_by(4).map(move |front| (path, front as f32))) {
        let [truck, before] = [front, front - 5.0].map(|front| truck_at(&network, longest, front, 5.0));
        for k in 1..120 {
            let behind_line = 0.5 * k as f32;
            let car = car_at(path, metres(network.paths[path].line) + behind_line, 2.0, false);
            let Some(trucks_fault) = of(&truck, 100, car) else { continue };
            assert_eq!(of(&truck, 10, car), Some(true), "it entered a second ago");
            // At 2 m/s a car has entered lately within the 9 m that one drives from standing.
            if behind_line <= 9.0 {
                assert!(!trucks_fault, "path {path}, {behind_line} m behind the line");
                n_cuts_in += 1;
            } else if of(&before, 100, car).is_some() {
                // The truck was there a second ago but for the error of driving it back.
                n_was_there += usize::from(!trucks_fault);
            } else {
                n_ahead += usize::from(trucks_fault);
            }
        }
    }
    assert!(20 < n_was_there && 5 < n_cuts_in && 20 < n_ahead, "{n_was_there} {n_cuts_in} {n_ahead}");
}

#[test]
fn of_several_contacts_the_one_counts_for_which_the_truck_is_at_fault() {
    let network = baked("20m");
    let truck = truck_at(&network, PATH, 40.0, 5.0);
    let (behind, into) = (car_at(PATH, 24.2, 6.0, false), car_at(PATH, 44.0, 0.0, false));
    let of = |cars: &[Car]| contact(&network, &truck, None, cars);
    assert_eq!(of(&[Car::NONE, behind]), Some(Contact { slot: 1, is_trucks_fault: false }));
    assert_eq!(of(&[behind, Car::NONE, into]), Some(Contact { slot: 2, is_trucks_fault: true }));
    // Beside it, a hand's breadth away, and far.
    assert_eq!(of(&[car_at(PATH, 23.8, 6.0, false), Car::NONE, car_at(PATH, 46.0, 0.0, false)]), None);
    assert_eq!(of(&[]), None);
}

#[test]
fn a_contacts_word_tells_slot_and_fault_and_0_is_none() {
    for slot in [0, 23, 62] {
        for is_trucks_fault in [false, true] {
            let contact = Contact { slot, is_trucks_fault };
            assert_eq!(Contact::from_code(contact.code()), Some(contact));
        }
    }
    assert_eq!([0, 64].map(Contact::from_code), [None; 2]);
}
