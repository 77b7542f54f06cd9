//! The actions of every episode of an evaluation in a file, with which it is driven again without its policy.
//!
//! A sequence is run-length encoded, as in a [certificate](crate::certificate::file): `4x12 5x3`.

use std::path::Path;

use offtrack::files::reader;
use offtrack::simulator::{Actions, Batch};
use offtrack::world::World;
use serde::{Deserialize, Serialize};

use crate::certificate::file::{actions, runs};
use crate::controller::Controller;
use crate::error::Error;
use crate::files;

/// Version of the format.
const VERSION: u32 = 1;
/// Most bytes of a file: that of about 300,000 episodes.
const FILE_LIMIT: u64 = 64 << 20;

/// The file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    version: u32,
    /// Number of actions of the benchmark's table.
    n_actions: u32,
    /// Each episode, in the order of the evaluation.
    episodes: Vec<String>,
}

/// Drives each truck of an evaluation by its own sequence of actions.
#[derive(Debug)]
pub struct Recorded {
    name: String,
    sequences: Vec<Vec<u32>>,
}

impl Recorded {
    /// Reads the sequences of an evaluation of `n_episodes` in `world`.
    ///
    /// # Errors
    ///
    /// A file that is none of these, or is one of other episodes or actions; a world whose actions are continuous.
    pub fn read(file: &Path, world: &World, n_episodes: usize) -> Result<Recorded, Error> {
        check_levels(world)?;
        let wrong =
            |message: String| Error::contents(file, format!("{message}; `evaluate --actions` writes such files"));
        let text = reader::read_text(file, FILE_LIMIT)?;
        let written: Written = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        let n_actions = world.params.n_actions;
        let numbers = [
            ("version", written.version as usize, VERSION as usize),
            ("n_actions", written.n_actions as usize, n_actions as usize),
            ("episodes", written.episodes.len(), n_episodes),
        ];
        if let Some((key, found, expected)) = numbers.into_iter().find(|(_, found, expected)| found != expected) {
            return Err(wrong(format!("{key}: {found}; {expected} are needed")));
        }
        let limit = world.most_steps_of_all();
        let sequence = |(episode, text): (usize, &String)| {
            actions(text, n_actions, limit).map_err(|message| wrong(format!("episodes, {episode}: {message}")))
        };
        let sequences = written.episodes.iter().enumerate().map(sequence).collect::<Result<_, _>>()?;
        Ok(Recorded { name: reader::shown_path(file), sequences })
    }
}

impl Controller for Recorded {
    fn name(&self) -> &str {
        &self.name
    }

    fn choose(&mut self, _: &World, batch: &Batch) -> Actions {
        let at = |(sequence, step): (&Vec<u32>, u32)| sequence.get(step as usize).copied().unwrap_or(0);
        Actions::Indices(self.sequences.iter().zip(batch.truck.iter().map(|truck| truck.steps)).map(at).collect())
    }
}

/// An error for a world whose actions are continuous: a file holds indices.
pub fn check_levels(world: &World) -> Result<(), Error> {
    if !world.is_continuous() {
        return Ok(());
    }
    let expected = "files of actions hold indices: the same benchmark with actions.steer_levels is needed".to_owned();
    Err(Error::Setting { name: "actions.kind", value: "continuous".to_owned(), expected })
}

/// Writes the sequences of an evaluation's episodes, a line each.
pub(crate) fn write(file: &Path, world: &World, sequences: &[Vec<u32>]) -> Result<(), Error> {
    let lines: Vec<String> = sequences.iter().map(|sequence| format!("\"{}\"", runs(sequence))).collect();
    let n_actions = world.params.n_actions;
    let text =
        format!("{{\"version\":{VERSION},\"n_actions\":{n_actions},\"episodes\":[\n{}\n]}}\n", lines.join(",\n"));
    files::write_whole(file, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use offtrack::scenario::{Scenario, Split};

    use super::*;
    use crate::device::Device;
    use crate::policies::UniformRandom;
    use crate::{Driven, Evaluation};

    #[test]
    fn an_evaluation_is_driven_again_by_its_recorded_actions_to_the_last_bit() {
        let mut scenario = Scenario::named("attard2023").unwrap();
        scenario.retain(|_, route| ["40m/E-left-1", "40m/SW-right-1"].contains(&route.name.as_str()));
        let (world, device) = (Arc::new(World::bake(&scenario).unwrap()), Device::processor());
        let (split, episodes, seed, record) = (Split::Test, 3, 4, false);
        let evaluation =
            Evaluation { scenario: &scenario, world: &world, split, episodes, seed, record, device: &device };
        let drive = |policy: &mut dyn Controller| evaluation.drive(policy, &mut |_, _| ()).unwrap();
        let Driven { episodes: finished, sequences, .. } = drive(&mut UniformRandom { seed: 4 });
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("actions.json");
        sequences.write(&file, &world).unwrap();
        let again = drive(&mut Recorded::read(&file, &world, 6).unwrap());
        assert_eq!(evaluation.outcomes(&again.episodes), evaluation.outcomes(&finished));
        let refused = |n_episodes: usize| Recorded::read(&file, &world, n_episodes).unwrap_err().to_string();
        assert!(refused(7).contains("actions.json: episodes: 6; 7 are needed"), "{}", refused(7));
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, text.replacen("[\n\"", "[\n\"9x1 ", 1)).unwrap();
        assert!(refused(6).contains("episodes, 0: actions: \"9x1\""), "{}", refused(6));
        std::fs::write(&file, "{}").unwrap();
        assert!(refused(6).contains("`evaluate --actions` writes such files"));
    }

    #[test]
    fn the_action_of_the_step_in_which_time_is_over_is_driven_again_too() {
        let mut scenario = Scenario::named("attard2023").unwrap();
        scenario.retain(|_, route| route.name == "40m/E-left-1");
        let mut world = World::bake(&scenario).unwrap();
        world.step_limits.fill(3);
        let (world, device) = (Arc::new(world), Device::processor());
        let (split, episodes, seed, record) = (Split::Test, 8, 4, false);
        let evaluation =
            Evaluation { scenario: &scenario, world: &world, split, episodes, seed, record, device: &device };
        let first = evaluation.drive(&mut UniformRandom { seed: 4 }, &mut |_, _| ()).unwrap();
        assert!(first.episodes.iter().all(|episode| episode.steps == 4));
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("actions.json");
        first.sequences.write(&file, &world).unwrap();
        let mut recorded = Recorded::read(&file, &world, 8).unwrap();
        assert_eq!(evaluation.drive(&mut recorded, &mut |_, _| ()).unwrap().episodes, first.episodes);
    }
}
