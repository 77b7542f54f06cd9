//! Which contacts with other vehicles could have been avoided: from some time before each the truck's actions are
//! searched for others, among the same vehicles, which react.
//!
//! What no search avoids may be avoidable all the same.

use std::collections::BTreeMap;

use offtrack::layout::{Ended, Stream};
use offtrack::scenario::Scenario;
use offtrack::world::World;
use serde::Serialize;

use super::Evaluation;
use super::certificate;
use super::certificate::attempt::each;
use super::certificate::avoidance::{Again, Contact};
use super::certificate::beam::Pass;
use super::episode::Episode;
use super::sequences::Sequences;
use crate::error::Error;

/// Time after that of the contact until which the truck must drive on without a failure (s).
const AFTER: f64 = 3.0;
/// Earliest time before a contact that is searched from (s).
const EARLIEST: f64 = 30.0;
/// Searches made in turn until one avoids the contact.
const PASSES: [Pass; 2] = [Pass { width: 4, hold: 10 }, Pass { width: 24, hold: 5 }];

/// The contacts of an evaluation, and which of them could have been avoided.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Avoidable {
    /// From each time before the contacts.
    pub from: Vec<AvoidableFrom>,
    /// Time after that of the contact until which the truck drives on without a failure, or arrives (s).
    pub after: f64,
    /// Searches made in turn until one avoided the contact.
    pub passes: Vec<Pass>,
    /// Env steps of all searches.
    pub env_steps: u64,
    /// Each contact, in the order of the episodes.
    pub contacts: Vec<AvoidableContact>,
}

/// The contacts that could have been avoided from one time before each.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AvoidableFrom {
    /// That time (s); from the start of an episode that had not yet begun.
    pub seconds: f64,
    /// Contacts.
    pub contacts: usize,
    /// Those that could have been avoided.
    pub avoidable: usize,
    /// Contacts, and those that could have been avoided, by the end of the episode: `met_vehicle` or `was_met`.
    pub ends: BTreeMap<&'static str, [usize; 2]>,
}

/// One contact.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AvoidableContact {
    /// The route's name.
    pub route: String,
    /// Number of the episode among those of its route.
    pub episode: usize,
    /// `met_vehicle` or `was_met`.
    pub ended: &'static str,
    /// The least of the times before it from which a search avoided it (s); `None` if from none.
    pub avoidable_from: Option<f64>,
}

impl Avoidable {
    fn of(seconds: &[f64], contacts: Vec<AvoidableContact>, env_steps: u64) -> Avoidable {
        let from = seconds.iter().map(|&seconds| {
            let is_avoidable = |contact: &AvoidableContact| contact.avoidable_from.is_some_and(|from| from <= seconds);
            let mut ends: BTreeMap<&str, [usize; 2]> =
                [Ended::MetVehicle, Ended::WasMet].map(|ended| (ended.name(), [0, 0])).into();
            for contact in &contacts {
                let [all, avoidable] = ends.entry(contact.ended).or_default();
                *all += 1;
                *avoidable += usize::from(is_avoidable(contact));
            }
            let avoidable = contacts.iter().filter(|contact| is_avoidable(contact)).count();
            AvoidableFrom { seconds, contacts: contacts.len(), avoidable, ends }
        });
        Avoidable { from: from.collect(), after: AFTER, passes: PASSES.to_vec(), env_steps, contacts }
    }

    /// What was found, in words.
    pub(super) fn note(&self) -> String {
        let from = self.from.iter().map(|from| {
            let ends = from.ends.iter().map(|(end, [all, avoidable])| format!("{end} {avoidable} of {all}"));
            let ends = ends.collect::<Vec<_>>().join(", ");
            format!("{} from {:.1} s before ({ends})", from.avoidable, from.seconds)
        });
        format!(
            "Of {} contacts a search avoided {}, for {:.1} s after; what it did not avoid may be avoidable all the \
             same.",
            self.contacts.len(),
            from.collect::<Vec<_>>().join("; "),
            self.after
        )
    }
}

/// An error for a benchmark without contacts or without a table of actions, and for times that no search is made from.
pub fn check(scenario: &Scenario, world: &World, seconds: &[f64]) -> Result<(), Error> {
    let wrong = |value: String, expected: String| Err(Error::Setting { name: "--avoidable", value, expected });
    if world.traffic.is_none() {
        let expected = "asks about contacts with other vehicles: a benchmark with [traffic] is needed, as traffic2026";
        return wrong(scenario.name.clone(), expected.to_owned());
    }
    certificate::check_table(world)?;
    let range = scenario.step..=EARLIEST;
    match seconds.iter().find(|seconds| !range.contains(*seconds)) {
        Some(seconds) => wrong(seconds.to_string(), format!("must lie in {}..{EARLIEST} s", scenario.step)),
        None => Ok(()),
    }
}

/// Indices of the episodes that a contact ended.
pub fn contacts(finished: &[Episode]) -> impl Iterator<Item = usize> {
    (0..finished.len()).filter(|&index| matches!(finished[index].ended, Ended::MetVehicle | Ended::WasMet))
}

impl Evaluation<'_> {
    /// Searches from these times before each contact (s); episodes and their actions stand as [`Evaluation::drive`]
    /// gives them. Each episode is driven again to its contact first, and each sequence found from its start on. `done`
    /// is called after each contact, from any thread.
    pub fn avoidable(
        &self,
        finished: &[Episode],
        sequences: &Sequences,
        seconds: &[f64],
        done: &(dyn Fn() + Sync),
    ) -> Result<Avoidable, Error> {
        check(self.scenario, self.world, seconds)?;
        let Sequences::Indices(sequences) = sequences else { return Err(certificate::needs_levels()) };
        let searched: Vec<usize> = contacts(finished).collect();
        let mut seconds = seconds.to_vec();
        seconds.sort_by(|a, b| b.total_cmp(a));
        seconds.dedup();
        let found = each(searched.len(), &|nth| {
            let index = searched[nth];
            let found = self.avoided(index, &finished[index], &sequences[index], &seconds)?;
            done();
            Ok(found)
        })?;
        let routes = self.routes();
        let contact = |(&index, &(avoidable_from, _)): (&usize, &(Option<f64>, u64))| AvoidableContact {
            route: routes[index / self.episodes].2.name.clone(),
            episode: index % self.episodes,
            ended: finished[index].ended.name(),
            avoidable_from,
        };
        let contacts = searched.iter().zip(&found).map(contact).collect();
        Ok(Avoidable::of(&seconds, contacts, found.iter().map(|(_, env_steps)| env_steps).sum()))
    }

    /// The least of these times, longest first, from which a search avoids the contact of an episode, and the env steps
    /// of all searches. What avoids it later avoids it from before, too.
    fn avoided(
        &self,
        index: usize,
        episode: &Episode,
        actions: &[u32],
        seconds: &[f64],
    ) -> Result<(Option<f64>, u64), Error> {
        let (route, start) = self.start(index);
        let stream = Stream { seed: self.seed, env: index as u32 };
        let contact = Contact { stream, route, start, actions, ended: episode.ended, last: episode.last };
        let again = Again { world: self.world, engine: &self.device.engine, contact };
        let n_steps = |seconds: f64| (seconds / self.scenario.step).round() as usize;
        let until = actions.len() + n_steps(AFTER);
        let mut env_steps = 0;
        for &seconds in seconds.iter().rev() {
            let step = actions.len().saturating_sub(n_steps(seconds));
            if !again.is_the_same(step)? {
                return Err(Error::NotRepeated {
                    route: self.world.route_names[route as usize].clone(),
                    episode: index % self.episodes,
                });
            }
            for pass in PASSES {
                let (found, tried) = again.avoided(step, until, pass)?;
                env_steps += tried;
                let Some(found) = found else { continue };
                if again.comes_through(&[&actions[..step], &found].concat())? {
                    return Ok((Some(seconds), env_steps));
                }
            }
        }
        Ok((None, env_steps))
    }
}

#[cfg(test)]
mod tests;
