//! A platoon behind a leader follows the closed form of the intelligent driver model.

use glam::Vec2;

use crate::traffic::clock::Clock;
use crate::traffic::decide::Crowd;
use crate::traffic::network::{Pair, Path, Sample, Source, Zone};
use crate::traffic::units::{length, speed};
use crate::traffic::{Car, Network, Nobody, Rules, STEP};

/// Style of all cars: 4.2 m long and nearly in the middle of the temperaments.
const STYLE: u32 = 7;
const FREE: f64 = 10.0;
/// Acceleration and comfortable braking (m/s²).
const ACCELERATION: f64 = 2.0;
const BRAKING: f64 = 2.5;
/// Cars decide every second step and hold what they decided.
const HELD: f64 = 2.0 * STEP as f64;

/// A straight road of one lane.
fn straight() -> Network {
    let n = 260;
    let sample = |index: u32| Sample {
        position: Vec2::new(2.0 * index as f32, 0.0),
        direction: Vec2::X,
        limit: speed(FREE as f32),
    };
    Network {
        has_ring: true,
        n_arms: 1,
        paths: vec![Path {
            first: 0,
            n,
            length: length(500.0),
            line: length(-500.0),
            clear: 0,
            source: 0,
            exit: 1,
            exit_arm: 0,
        }],
        samples: (0..n).map(sample).collect(),
        pairs: vec![Pair { first: 0, n: 1, n_all: 1, a: [0, 255], b: [0, 255] }],
        zones: vec![Zone { a: [0, u16::MAX], b: [0, u16::MAX], delta: 0, kind: 0 }],
        sources: vec![Source { entry: 0, lane: 0, first: 0, n: 1 }],
        large: None,
    }
}

/// The model's numbers for these cars: headway (s), gap (m), free speed (m/s).
fn numbers(rules: &Rules) -> (f64, f64, f64) {
    let temperament = f64::from(Car::entering(0, STYLE, 0).temperament()) / 15.0;
    let headway = f64::from(rules.headway) / 256.0 * f64::from(STEP) * (1.0 - 0.15 * temperament);
    (headway, f64::from(rules.gap) / 1024.0, FREE * (1.0 + 0.1 * temperament))
}

/// Gap of a car that follows another at a constant speed (m).
fn equilibrium(rules: &Rules, v: f64) -> f64 {
    let (headway, gap, free) = numbers(rules);
    (gap + v * headway) / (1.0 - (v / free).powi(4)).sqrt()
}

/// Amplitude of a follower's speed over its leader's, of small oscillations of frequency `w` about a speed (rad/s,
/// m/s): the transfer function of the linearised model with decisions held for [`HELD`].
fn gain(rules: &Rules, v: f64, w: f64) -> f64 {
    let ((headway, gap, free), a, p) = (numbers(rules), ACCELERATION, 0.5 / (ACCELERATION * BRAKING).sqrt());
    let (there, wished) = (equilibrium(rules, v), gap + v * headway);
    let by_gap = 2.0 * a * wished * wished / there.powi(3);
    let by_leader = 2.0 * a * wished / there.powi(2) * v * p;
    let by_speed = -4.0 * a / free * (v / free).powi(3) - 2.0 * a * wished / there.powi(2) * (headway + v * p);
    let multiplied = |(a, b): (f64, f64), (c, d): (f64, f64)| (a * c - b * d, a * d + b * c);
    let divided = |x: (f64, f64), (c, d): (f64, f64)| {
        let (re, im) = multiplied(x, (c, -d));
        (re / (c * c + d * d), im / (c * c + d * d))
    };
    let (cos, sin) = ((w * HELD).cos(), (w * HELD).sin());
    // x (z - 1) = v HELD (z + 1) / 2, and v (z - 1) / HELD = by_gap (x_leader - x) + by_leader v_leader + by_speed v.
    let way = divided((0.5 * HELD * (cos + 1.0), 0.5 * HELD * sin), (cos - 1.0, sin));
    let above = (by_gap * way.0 + by_leader, by_gap * way.1);
    let below = ((cos - 1.0) / HELD + by_gap * way.0 - by_speed, sin / HELD + by_gap * way.1);
    let found = divided(above, below);
    found.0.hypot(found.1)
}

/// A platoon behind a leader with this speed over time, for so many steps: what `see` makes of it after each, in m and
/// m/s, stations and speeds.
fn driven(rules: &Rules, v: f64, at: impl Fn(f64) -> f64, steps: u32, mut see: impl FnMut(f64, &[Car])) {
    let network = straight();
    let state = |station: f64, v: f64, car: Car| Car {
        station: (station * f64::from(1 << 20)).round() as i32,
        speed: (v * f64::from(STEP) * f64::from(1 << 19)).round() as i32,
        ..car
    };
    let first = Car::entering(0, STYLE, 0);
    let apart = equilibrium(rules, v) + f64::from(first.length());
    let mut cars: Vec<Car> = (0..6).map(|index| state(450.0 - apart * f64::from(index), v, first)).collect();
    let mut leader = 450.0;
    for step in 0..steps {
        let crowd = Crowd::new(&network, rules, Clock { seed: 0, env: 0, episode: 0, step }, &cars);
        let decided: Vec<i32> = (0..6)
            .map(|slot| {
                let decides = (slot as u32 + step).is_multiple_of(2);
                if decides { crowd.decided(slot, &Nobody) } else { cars[slot].acceleration }
            })
            .collect();
        for (car, acceleration) in cars.iter_mut().zip(decided).skip(1) {
            *car = Car { acceleration, ..*car }.moved();
        }
        let time = f64::from(step + 1) * f64::from(STEP);
        leader += 0.5 * f64::from(STEP) * (at(time - f64::from(STEP)) + at(time));
        cars[0] = state(leader, at(time), cars[0]);
        // The road goes on for ever.
        if 480.0 < leader {
            leader -= 128.0;
            cars.iter_mut().for_each(|car| car.station -= 128 << 20);
        }
        see(time, &cars);
    }
}

#[test]
fn a_platoon_keeps_the_gap_of_the_closed_form_within_1_percent() {
    let rules = Rules::FITTED;
    for v in [2.0, 4.0, 6.0, 8.0] {
        let mut gap = 0.0;
        driven(&rules, v, |_| v, 4_000, |_, cars| gap = cars[4].station() - cars[4].length() - cars[5].station());
        let expected = equilibrium(&rules, v);
        assert!((f64::from(gap) / expected - 1.0).abs() < 0.01, "{v} m/s: {gap}, closed form {expected}");
        // The comparison can fail: a tenth of the headway more.
        let other = equilibrium(&Rules { headway: rules.headway * 11 / 10, ..rules }, v);
        assert!(0.01 < (f64::from(gap) / other - 1.0).abs(), "{v} m/s");
    }
}

#[test]
fn oscillations_die_out_along_a_platoon_as_the_closed_form_has_it_within_1_percent() {
    let rules = Rules::FITTED;
    for v in [4.0, 6.0, 8.0] {
        for w in [0.2, 0.4, 0.7, 1.0] {
            let mut waves = [[0.0f64; 2]; 6];
            driven(
                &rules,
                v,
                |time| v + 0.05 * (w * time).sin(),
                12_000,
                |time, cars| {
                    if 600.0 < time {
                        for (wave, car) in waves.iter_mut().zip(cars) {
                            let u = f64::from(car.speed()) - v;
                            wave[0] += u * (w * time).sin();
                            wave[1] += u * (w * time).cos();
                        }
                    }
                },
            );
            let amplitude = |index: usize| waves[index][0].hypot(waves[index][1]);
            let (found, expected) = (amplitude(2) / amplitude(1), gain(&rules, v, w));
            assert!((found / expected - 1.0).abs() < 0.01, "{v} m/s, {w} rad/s: {found}, closed form {expected}");
            assert!(found < 1.0, "{v} m/s, {w} rad/s: {found}");
        }
    }
}
