use std::sync::Arc;

use offtrack::scenario::Split;

use super::*;
use crate::device::Device;
use crate::evaluation::Driven;
use crate::policies::rule::Rule;

/// Trucks on one route that enter blind, and what they met.
struct Blind {
    scenario: Scenario,
    world: Arc<World>,
    device: Device,
    driven: Driven,
}

impl Blind {
    fn new() -> Blind {
        let mut scenario = Scenario::named("traffic2026").unwrap();
        scenario.retain(|_, route| route.name == "20m/N-left-2");
        let (world, device) = (Arc::new(World::bake(&scenario).unwrap()), Device::processor());
        let mut rule = Rule::new("follows", &world).unwrap();
        let driven = evaluation(&scenario, &world, &device).drive(&mut rule, &mut |_, _| {}).unwrap();
        assert!(3 <= contacts(&driven.episodes).count(), "{}", contacts(&driven.episodes).count());
        Blind { scenario, world, device, driven }
    }

    fn avoidable(&self, seconds: &[f64]) -> Result<Avoidable, Error> {
        let Driven { episodes, sequences, .. } = &self.driven;
        evaluation(&self.scenario, &self.world, &self.device).avoidable(episodes, sequences, seconds, &|| ())
    }

    /// Each contact, to be driven again.
    fn again(&self) -> Vec<Again<'_>> {
        let Sequences::Indices(sequences) = &self.driven.sequences else { panic!("levels") };
        let again = |index: usize| {
            let (route, start) = evaluation(&self.scenario, &self.world, &self.device).start(index);
            let Episode { ended, last, .. } = self.driven.episodes[index];
            let stream = Stream { seed: SEED, env: index as u32 };
            let contact = Contact { stream, route, start, actions: &sequences[index], ended, last };
            Again { world: &self.world, engine: &self.device.engine, contact }
        };
        contacts(&self.driven.episodes).map(again).collect()
    }
}

const SEED: u32 = 0;

fn evaluation<'a>(scenario: &'a Scenario, world: &'a Arc<World>, device: &'a Device) -> Evaluation<'a> {
    Evaluation { scenario, world, split: Split::Test, episodes: 24, seed: SEED, record: false, device }
}

#[test]
fn recorded_actions_give_the_recorded_end_from_a_copy_among_vehicles_of_the_same_stream_alone() {
    let blind = Blind::new();
    let mut differ = 0;
    for again in blind.again() {
        let contact = again.contact;
        let n = contact.actions.len();
        for step in [0, n - 30, n - 1] {
            assert!(again.is_the_same(step).unwrap(), "{step} of {n}");
        }
        let stream = Stream { env: contact.stream.env + 1, ..contact.stream };
        let elsewhere = Again { contact: Contact { stream, ..contact }, ..again };
        differ += usize::from(!elsewhere.is_the_same(n - 30).unwrap());
        let ended = Ended::WasMet;
        assert!(!Again { contact: Contact { ended, ..contact }, ..again }.is_the_same(n - 1).unwrap());
        assert!(!again.comes_through(contact.actions).unwrap());
    }
    assert_eq!(differ, blind.again().len());
}

#[test]
fn a_contact_that_braking_avoids_is_avoidable_and_one_a_step_away_at_speed_is_not() {
    let blind = Blind::new();
    let brakes = (0..blind.world.params.n_actions).find(|&action| {
        let asked = &blind.world.actions[action as usize];
        asked.steering == 0.0 && asked.speed == 0.0
    });
    let (again, found) = (blind.again(), blind.avoidable(&[3.0, 1.0, 0.1]).unwrap());
    assert_eq!(found.contacts.len(), again.len());
    let (mut braked, mut near) = (0, 0);
    for (again, found) in again.iter().zip(&found.contacts) {
        let actions = again.contact.actions;
        let before = actions[..actions.len() - 30].iter().copied();
        let braking: Vec<u32> = before.chain(std::iter::repeat_n(brakes.unwrap(), 60)).collect();
        if again.comes_through(&braking).unwrap() {
            assert!(found.avoidable_from.is_some(), "{found:?}");
            braked += 1;
        }
        if 3.0 < again.contact.last.speed {
            assert_ne!(found.avoidable_from, Some(0.1), "{found:?}");
            near += 1;
        }
    }
    assert!(0 < braked && 0 < near, "{braked} {near}");
    let counts: Vec<(f64, usize)> = found.from.iter().map(|from| (from.seconds, from.avoidable)).collect();
    let [(3.0, earliest), (1.0, later), (0.1, last)] = counts[..] else { panic!("{counts:?}") };
    assert!(last <= later && later <= earliest && braked <= earliest, "{counts:?}");
}

#[test]
fn a_truck_that_touches_nothing_until_its_time_is_over_has_avoided_the_contact() {
    let blind = Blind::new();
    let found = blind.avoidable(&[3.0]).unwrap();
    let pairs = blind.again().into_iter().zip(found.contacts).filter(|(_, found)| found.avoidable_from.is_some());
    let mut n_tried = 0;
    for (again, _) in pairs {
        let n = again.contact.actions.len();
        let mut world = World::clone(&blind.world);
        world.step_limits.iter_mut().for_each(|limit| *limit = n as u32 + 1);
        let again = Again { world: &Arc::new(world), ..again };
        let found = PASSES.iter().find_map(|&pass| again.avoided(n - 30, n + 30, pass).unwrap().0).unwrap();
        let actions = [&again.contact.actions[..n - 30], &found].concat();
        // The step in which its time is over is the first beyond the limit.
        assert_eq!(actions.len(), n + 2);
        assert!(again.comes_through(&actions).unwrap());
        n_tried += 1;
    }
    assert!(0 < n_tried);
}

#[test]
fn the_same_contacts_are_found_avoidable_whatever_the_number_of_threads() {
    let blind = Blind::new();
    let found = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| blind.avoidable(&[1.0, 3.0]).unwrap())
    };
    assert_eq!(found(1), found(3));
}

#[test]
fn contacts_are_told_by_time_and_end() {
    let contact = |ended: Ended, avoidable_from| AvoidableContact {
        route: "20m/N-left-2".to_owned(),
        episode: 0,
        ended: ended.name(),
        avoidable_from,
    };
    let contacts = vec![
        contact(Ended::MetVehicle, Some(1.0)),
        contact(Ended::MetVehicle, Some(3.0)),
        contact(Ended::MetVehicle, None),
        contact(Ended::WasMet, Some(3.0)),
    ];
    let told = Avoidable::of(&[3.0, 1.0], contacts, 7).note();
    let expected = "Of 4 contacts a search avoided 3 from 3.0 s before (met_vehicle 2 of 3, was_met 1 of 1); \
                    1 from 1.0 s before (met_vehicle 1 of 3, was_met 0 of 1), for 3.0 s after;";
    assert!(told.starts_with(expected), "{told}");
}

#[test]
fn an_episode_that_ends_otherwise_when_driven_again_is_an_error_that_names_it() {
    let mut blind = Blind::new();
    let index = contacts(&blind.driven.episodes).next().unwrap();
    blind.driven.episodes[index].last.steps += 1;
    let said = blind.avoidable(&[3.0]).unwrap_err();
    let expected = format!("20m/N-left-2, episode {index}: driven again it ends otherwise");
    assert!(said.to_string().contains(&expected) && !said.is_wrong_input(), "{said}");
}

#[test]
fn a_benchmark_without_vehicles_and_times_that_no_search_is_made_from_are_refused() {
    let blind = Blind::new();
    for seconds in [0.0, 0.05, 31.0, f64::NAN] {
        let said = check(&blind.scenario, &blind.world, &[3.0, seconds]).unwrap_err().to_string();
        assert!(said.contains(&format!("--avoidable: {seconds}; must lie in 0.1..30 s")), "{said}");
    }
    assert!(check(&blind.scenario, &blind.world, &[0.1, 30.0]).is_ok());
    let mut scenario = Scenario::named("attard2023").unwrap();
    scenario.retain(|_, route| route.name == "20m/N-left-2");
    let said = check(&scenario, &World::bake(&scenario).unwrap(), &[3.0]).unwrap_err().to_string();
    assert!(said.contains("--avoidable: attard2023; asks about contacts") && said.contains("[traffic]"), "{said}");
}
