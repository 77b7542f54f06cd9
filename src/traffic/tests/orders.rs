//! Nothing depends on an order: of cars, of rows, of threads.

use rayon::prelude::*;

use super::{baked, even};
use crate::layout::Stream;
use crate::traffic::clock::Clock;
use crate::traffic::decide::Crowd;
use crate::traffic::{Backlog, Car, Nobody, Rules, Run, Setting, Survey, arrive};

const STEPS: u32 = 3_000;

fn bits(cars: &[Car]) -> Vec<u32> {
    bytemuck::cast_slice(cars).to_vec()
}

/// The cars after some steps in which they decide and move one after the other in an order of their own; each sees the
/// cars of the step before, or those that have moved already.
fn in_order(order: impl Fn(usize, u32) -> usize, sees_moved: bool) -> Vec<u32> {
    let (network, rules) = (baked("16m"), Rules::FITTED);
    let demand = even(&network, 1800.0);
    let setting = Setting { network: &network, rules: &rules, demand: &demand };
    let (mut cars, mut backlog) = (vec![Car::NONE; 24], Backlog::default());
    for step in 0..STEPS {
        let clock = Clock { seed: 3, env: 0, episode: 0, step };
        let before = cars.clone();
        for k in 0..cars.len() {
            let slot = order(k, step);
            let car = before[slot];
            if !car.is_there() {
                continue;
            }
            let seen = if sees_moved { cars.clone() } else { before.clone() };
            let crowd = Crowd::new(&network, &rules, clock, &seen);
            let decides = (slot as u32 + step).is_multiple_of(2);
            let acceleration = if decides { crowd.decided(slot, &Nobody) } else { car.acceleration };
            cars[slot] = Car { acceleration, ..car }.moved();
        }
        arrive(setting, clock, &mut cars, &mut backlog, &Nobody, &mut |_, _| {});
    }
    bits(&cars)
}

#[test]
fn the_order_in_which_cars_decide_and_move_changes_no_bit() {
    let (network, rules) = (baked("16m"), Rules::FITTED);
    let demand = even(&network, 1800.0);
    let mut run = Run::new(&network, &rules, &demand, 24, Stream { seed: 3, env: 0 });
    (0..STEPS).for_each(|_| run.step(|_, _| {}));
    let expected = bits(&run.cars);
    assert!(3 < run.cars.iter().filter(|car| car.is_there()).count());
    assert_eq!(in_order(|k, step| (7 * k + step as usize) % 24, false), expected);
    assert_eq!(in_order(|k, step| (23 - k + step as usize) % 24, false), expected);
    // Cars that saw those who have moved already would be elsewhere.
    assert_ne!(in_order(|k, _| k, true), expected);
}

#[test]
fn the_order_of_runs_and_the_number_of_threads_change_no_count() {
    let (network, rules) = (baked("20m"), Rules::FITTED);
    let demand = even(&network, 1500.0);
    let survey = Survey::new(&network, &rules).unwrap();
    let run = |env: u32| survey.counted(&demand, 1_000, Stream { seed: 7, env }, &[]);
    let counted = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (0..4).into_par_iter().map(run).collect::<Vec<_>>())
    };
    let alone: Vec<_> = (0..4).rev().map(run).collect();
    assert_eq!(counted(1), counted(3));
    assert_eq!(counted(3), alone.iter().rev().cloned().collect::<Vec<_>>());
    assert_ne!(alone[0], alone[1]);
}
