//! What the world does to a policy: what it observes late, misplaced and noisy, and actions that come late. What is
//! stays what it is.

use std::sync::Arc;

use offtrack::layout::{N_RAYS, N_VALUES};
use offtrack::scenario::{Disturbances, Scenario};
use offtrack::simulator::{Batch, Engine, RouteChoice, Simulator};
use offtrack::world::World;

use crate::{batch_on, engines, scenarios};

/// Trucks, each on one of the routes.
const N_ENVS: usize = 256;

/// The trucks of laden2026 on the test routes of one roundabout.
fn world(disturbances: Disturbances) -> Arc<World> {
    let mut scenario = Scenario::named("laden2026").unwrap();
    scenario.retain(|_, route| route.name.starts_with("40m/"));
    scenario.disturbances = disturbances;
    Arc::new(World::bake(&scenario).unwrap())
}

fn simulator(engine: &Engine, world: &Arc<World>) -> Simulator {
    let routes = (0..world.routes.len() as u32).collect();
    batch_on(engine, world, N_ENVS, 5, RouteChoice::Drawn(routes))
}

/// The batch before the first step and after each of `n_steps`, in which a truck does what it did the step before, or
/// sometimes something else.
fn states(engine: &Engine, disturbances: Disturbances, n_steps: usize) -> Vec<Batch> {
    let mut simulator = simulator(engine, &world(disturbances));
    let mut states = vec![simulator.batch().clone()];
    for step in 0..n_steps {
        simulator.step(&actions(step)).unwrap();
        states.push(simulator.batch().clone());
    }
    states
}

/// Index of straight ahead at the highest speed, which trucks of laden2026 begin with.
const STRAIGHT: u32 = 40;

fn actions(step: usize) -> Vec<u32> {
    (0..N_ENVS).map(|env| STRAIGHT + [0, 1, 3, 4][(env + step / 3) % 4] - 2).collect()
}

/// Values of an observation that are ranges.
const RANGES: std::ops::Range<usize> = 30..30 + N_RAYS;

#[test]
fn what_is_observed_changes_neither_the_trucks_nor_their_progress_clearance_ends_and_rewards() {
    let all = Disturbances {
        range_noise: 0.1,
        dropped_rays: 0.1,
        position_offset: 0.3,
        heading_offset: 0.02,
        position_noise: 0.1,
        heading_noise: 0.01,
        map_offset: 0.4,
        observation_delay: [0, 3],
        action_delay: [0, 0],
    };
    for (name, engine) in engines() {
        let (plain, disturbed) = (states(&engine, Disturbances::default(), 60), states(&engine, all.clone(), 60));
        for (plain, disturbed) in plain.iter().zip(&disturbed) {
            assert!(plain.truck == disturbed.truck && plain.clearance == disturbed.clearance, "{name}");
            assert!(plain.progress == disturbed.progress && plain.ended == disturbed.ended, "{name}");
            assert!(plain.terms == disturbed.terms && plain.reward == disturbed.reward, "{name}");
            assert!(plain.extras == disturbed.extras, "{name}");
            assert!(plain.observation != disturbed.observation, "{name}");
            assert!(disturbed.observation.iter().flatten().all(|value| (-1.0..=1.0).contains(value)), "{name}");
            assert!(plain.poses.iter().flatten().all(|pose| *pose == Default::default()), "{name}");
        }
        assert!(plain.last().unwrap().truck.iter().any(|truck| 0 < truck.episode), "{name}: no episode ended");
    }
}

#[test]
fn an_observation_that_is_late_is_that_of_some_steps_before_and_at_first_that_of_the_start() {
    for (name, engine) in engines() {
        // A device may compute the progress of a pose in one kernel otherwise than in another.
        let bound = if name == "CPU" { 0.0 } else { 1e-6 };
        let plain = states(&engine, Disturbances::default(), 12);
        for delay in 1..=3 {
            let late = states(&engine, Disturbances { observation_delay: [delay; 2], ..Disturbances::default() }, 12);
            for step in 0..=12usize {
                // A truck that ends in these steps begins another episode.
                let before = step.saturating_sub(delay as usize);
                for env in (0..N_ENVS).filter(|&env| plain[step].truck[env].episode == 0) {
                    let (late, then) = (late[step].observation[env], plain[before].observation[env]);
                    let apart = late.iter().zip(then).map(|(late, then)| (late - then).abs()).fold(0.0, f32::max);
                    assert!(apart <= bound, "{name} {delay} {step}: {apart}");
                }
            }
        }
    }
}

#[test]
fn an_action_that_is_late_takes_effect_some_steps_after_and_a_truck_goes_straight_on_until_the_first() {
    for (name, engine) in engines() {
        for delay in 1..=3 {
            let late = states(&engine, Disturbances { action_delay: [delay; 2], ..Disturbances::default() }, 12);
            let mut expected = simulator(&engine, &world(Disturbances::default()));
            for step in 0..12usize {
                let before = step.checked_sub(delay as usize);
                expected.step(&before.map_or(vec![STRAIGHT; N_ENVS], actions)).unwrap();
                for env in (0..N_ENVS).filter(|&env| late[step + 1].truck[env].episode == 0) {
                    assert_eq!(late[step + 1].truck[env], expected.batch().truck[env], "{name} {delay} {step}");
                }
            }
        }
    }
}

#[test]
fn delays_are_drawn_with_each_episode_from_all_between_the_least_and_the_greatest() {
    let world = world(Disturbances { observation_delay: [1, 3], ..Disturbances::default() });
    for (name, engine) in engines() {
        let mut simulator = simulator(&engine, &world);
        (0..6).for_each(|step| simulator.step(&actions(step)).unwrap());
        let batch = simulator.batch();
        let mut counts = [0; 4];
        for env in (0..N_ENVS).filter(|&env| batch.truck[env].episode == 0) {
            let [seen, kept @ ..] = batch.poses[env];
            assert_eq!(kept[0].position, batch.truck[env].position, "{name}");
            // The latest is that of now; the one of three steps ago is seen before it is forgotten.
            counts[(0..3).find(|&n| kept[n] == seen).unwrap_or(3)] += 1;
        }
        assert_eq!(counts[0], 0, "{name}: {counts:?}");
        assert!(counts[1..].iter().all(|&count| 50 < count), "{name}: {counts:?}");
    }
}

/// Mean and standard deviation.
fn moments(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (mean, (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt())
}

#[test]
fn ranges_have_the_noise_and_the_gaps_that_are_asked_for_anew_in_each_step() {
    let noisy = Disturbances { range_noise: 0.05, dropped_rays: 0.1, ..Disturbances::default() };
    for (name, engine) in engines() {
        let (plain, noisy) = (states(&engine, Disturbances::default(), 20), states(&engine, noisy.clone(), 20));
        let (mut errors, mut found, mut dropped, mut again) = (Vec::new(), 0, 0, Vec::new());
        for (step, (plain, noisy)) in plain.iter().zip(&noisy).enumerate() {
            for (env, (plain, noisy)) in plain.ranges.iter().zip(&noisy.ranges).enumerate() {
                for (ray, (plain, noisy)) in plain.iter().zip(noisy).enumerate() {
                    // Noise that the limits cut off is not counted.
                    if (0.5..19.0).contains(plain) {
                        let error = f64::from(noisy - plain);
                        found += 1;
                        dropped += u32::from(*noisy == 20.0);
                        if *noisy != 20.0 {
                            errors.push(error);
                            again.push((env, step, ray, error));
                        }
                    }
                }
            }
        }
        let (mean, deviation) = moments(&errors);
        assert!(10_000 < errors.len() && mean.abs() < 2e-3 && (deviation - 0.05).abs() < 1e-3, "{mean} {deviation}");
        let fraction = f64::from(dropped) / f64::from(found);
        assert!((fraction - 0.1).abs() < 0.01, "{name}: {fraction}");
        // Neighbouring steps, trucks and rays have unrelated errors.
        let of = |shift: (usize, usize, usize)| {
            let known: std::collections::HashMap<_, f64> =
                again.iter().map(|&(env, step, ray, error)| ((env, step, ray), error)).collect();
            let pairs: Vec<f64> = again
                .iter()
                .filter_map(|&(env, step, ray, error)| {
                    Some(error * known.get(&(env + shift.0, step + shift.1, ray + shift.2))?)
                })
                .collect();
            (pairs.iter().sum::<f64>() / pairs.len() as f64 / deviation.powi(2), pairs.len())
        };
        for shift in [(1, 0, 0), (0, 1, 0), (0, 0, 1)] {
            let (correlation, n) = of(shift);
            assert!(correlation.abs() < 5.0 / (n as f64).sqrt(), "{name} {shift:?}: {correlation} of {n}");
        }
    }
}

#[test]
fn offsets_stay_in_an_episode_and_change_with_it_and_noise_comes_anew_in_each_step() {
    let offsets = Disturbances { position_offset: 0.2, heading_offset: 0.01, ..Disturbances::default() };
    let noise = Disturbances { position_noise: 0.1, heading_noise: 0.02, ..Disturbances::default() };
    for (name, engine) in engines() {
        let error = |batch: &Batch, env: usize| {
            let (truck, seen) = (&batch.truck[env], &batch.poses[env][0]);
            let turned = |seen: f32, heading: f32| f64::from(offtrack::layout::angle::wrapped(seen - heading));
            let aside = (seen.position - truck.position).as_dvec2();
            [aside.x, aside.y, turned(seen.heading, truck.heading), turned(seen.trailer_heading, truck.trailer_heading)]
        };
        let states_of = states(&engine, offsets.clone(), 60);
        let (mut first, mut n_changed) = (Vec::new(), 0);
        for env in 0..N_ENVS {
            let at_start = error(&states_of[0], env);
            first.push(at_start[0]);
            assert!(at_start[0].abs() <= 0.2001 && at_start[1].abs() <= 0.2001 && at_start[2].abs() <= 0.01001);
            // Both headings are off alike.
            assert!((at_start[2] - at_start[3]).abs() < 1e-5, "{name}");
            for state in &states_of {
                let now = error(state, env);
                let is_same = (0..4).all(|n| (now[n] - at_start[n]).abs() < 5e-5);
                assert_eq!(is_same, state.truck[env].episode == 0, "{name} {env}: {now:?} {at_start:?}");
                n_changed += u32::from(!is_same);
            }
        }
        assert!(0 < n_changed, "{name}: no episode ended");
        // Uniform in 0.2 m either way.
        let (mean, deviation) = moments(&first);
        assert!(mean.abs() < 0.04 && (deviation - 0.2 / 3f64.sqrt()).abs() < 0.02, "{name}: {mean} {deviation}");

        let states_of = states(&engine, noise.clone(), 20);
        for (value, expected) in [(0, 0.1), (1, 0.1), (2, 0.02), (3, 0.02)] {
            let of_steps = |from: usize| -> Vec<f64> {
                states_of[from..from + 19]
                    .iter()
                    .flat_map(|state| (0..N_ENVS).map(|env| error(state, env)[value]))
                    .collect()
            };
            let (now, next) = (of_steps(0), of_steps(1));
            let (mean, deviation) = moments(&now);
            assert!(mean.abs() < 0.08 * expected && (deviation / expected - 1.0).abs() < 0.03, "{mean} {deviation}");
            let products: Vec<f64> = now.iter().zip(&next).map(|(now, next)| now * next).collect();
            assert!(
                (moments(&products).0 / expected.powi(2)).abs() < 0.08,
                "{name}: noise of a step stays in the next"
            );
        }
    }
}

#[test]
fn a_misplaced_map_moves_the_route_and_not_the_kerbs() {
    for (name, engine) in engines() {
        let moved = Disturbances { map_offset: 0.4, ..Disturbances::default() };
        let (plain, moved) = (states(&engine, Disturbances::default(), 20), states(&engine, moved, 20));
        let mut lane_distances = Vec::new();
        for (plain, moved) in plain.iter().zip(&moved) {
            for (plain, moved) in plain.observation.iter().zip(&moved.observation) {
                assert_eq!(plain[RANGES], moved[RANGES], "{name}");
                // Speed and articulation are no matter of the map.
                assert_eq!((plain[0], plain[21]), (moved[0], moved[21]), "{name}");
                lane_distances.push(10.0 * f64::from(moved[5] - plain[5]));
            }
        }
        let most = lane_distances.iter().fold(0.0f64, |most, distance| most.max(distance.abs()));
        assert!(0.3 < most && most <= 0.4 * 2f64.sqrt() + 1e-3, "{name}: {most}");
    }
}

#[test]
fn what_is_observed_depends_on_neither_the_number_of_trucks_nor_a_trucks_place() {
    let world = world(Disturbances { range_noise: 0.1, position_noise: 0.1, ..Disturbances::default() });
    for (name, engine) in engines() {
        let routes: Vec<u32> = (0..world.routes.len() as u32).collect();
        let mut many = batch_on(&engine, &world, N_ENVS, 5, RouteChoice::Drawn(routes.clone()));
        let mut few = batch_on(&engine, &world, 7, 5, RouteChoice::Drawn(routes));
        for step in 0..10 {
            many.step(&actions(step)).unwrap();
            few.step(&actions(step)[..7]).unwrap();
            let same: [[f32; N_VALUES]; 7] = std::array::from_fn(|env| many.batch().observation[env]);
            assert_eq!(few.batch().observation, same, "{name}");
        }
    }
}

#[test]
fn disturbances_that_make_no_sense_are_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    let source = scenarios();
    let text = std::fs::read_to_string(source.join("laden2026.toml")).unwrap();
    let text = text.replace("\"roundabouts/", &format!("\"{}/roundabouts/", source.display()));
    let text = text.replace("\"vehicles/", &format!("\"{}/vehicles/", source.display()));
    let file = folder.path().join("own.toml");
    for (lines, expected) in [
        ("range_noise = -0.1", "disturbances.range_noise: -0.1 m; must lie in 0..5 m"),
        ("dropped_rays = nan", "disturbances.dropped_rays: NaN; must lie in 0..1"),
        ("observation_delay = [0, 4]", "disturbances.observation_delay[1]: 4 steps; must lie in 0..3 steps"),
        ("action_delay = [2, 1]", "disturbances.action_delay: [2, 1]; must be [least, greatest]"),
        ("rain = 1.0", "unknown field `rain`"),
    ] {
        std::fs::write(&file, format!("{text}\n[disturbances]\n{lines}\n")).unwrap();
        let error = Scenario::read(&file).unwrap_err().to_string();
        assert!(error.contains(expected), "{lines}: {error}");
    }
    // A scenario that was changed in memory is checked before it is baked.
    let mut scenario = Scenario::named("laden2026").unwrap();
    scenario.disturbances.action_delay = [0, 9];
    assert!(World::bake(&scenario).unwrap_err().to_string().contains("disturbances.action_delay: [0, 9]"));
}
