//! A policy: a network with all that is needed to drive with it.

use std::borrow::Cow;
use std::path::Path;

use offtrack::files::reader::{self, shown_path};
use offtrack::layout::random::{self, Draw};
use offtrack::layout::{Action, N_AROUND, N_EXTRAS, N_VALUES, ObservationLayout, Truck};
use offtrack::world::World;

use crate::driver::Driver;
use crate::error::Error;
use crate::frames::Frames;
use crate::head::Head;
use crate::network::{Activation, Layer, Pass};
use crate::normalisation::Normalisation;
use crate::recurrent::Recurrent;
use crate::selection::{Selection, VEHICLES_AT};

/// Most bytes of a policy file that is read: two hundred times the shipped ones.
pub const FILE_LIMIT: u64 = 64 << 20;

/// The policies that come with the project, by name. One with a benchmark's name drives there unless another is asked
/// for.
const SHIPPED: [(&str, &[u8]); 8] = [
    ("attard2023", include_bytes!("../shipped/attard2023/policy.safetensors")),
    ("attard2023-lane", include_bytes!("../shipped/attard2023-lane/policy.safetensors")),
    ("attard2023-as-run", include_bytes!("../shipped/attard2023-as-run/policy.safetensors")),
    ("laden2026", include_bytes!("../shipped/laden2026/policy.safetensors")),
    ("laden2026-50", include_bytes!("../shipped/laden2026-50/policy.safetensors")),
    ("transfer2026", include_bytes!("../shipped/transfer2026/policy.safetensors")),
    ("traffic2026", include_bytes!("../shipped/traffic2026/policy.safetensors")),
    ("traffic2026-laden", include_bytes!("../shipped/traffic2026-laden/policy.safetensors")),
];

/// How a policy chooses among its actions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// The one with the largest output, of equals the first.
    Best,
    /// One sampled from the softmax of the outputs, as a function of (seed, env, episode, step).
    Sampled {
        /// Seed.
        seed: u32,
    },
}

/// A network that can drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Policy {
    /// Name for reports and errors: the file, or the shipped policy's name and `(shipped)`. Not part of the file.
    pub name: String,
    /// The benchmark it learned on.
    pub benchmark: String,
    /// The action table that its outputs refer to. Where they are commands it has two actions: what -1 and what 1 of
    /// each command asks for.
    pub actions: Vec<Action>,
    /// What its outputs are.
    pub head: Head,
    /// The values that it reads; with `None` all 69 and, behind them, `extras` and `vehicles`.
    pub values: Option<Selection>,
    /// Names of the extras that it observes beside the 69 values, the first of [`offtrack::layout::EXTRAS`]. None for a
    /// policy that names its values.
    pub extras: Vec<String>,
    /// Whether it observes other vehicles behind these: all of [`offtrack::layout::VEHICLE_VALUES`]. False for a policy
    /// that names its values.
    pub vehicles: bool,
    /// How many steps' values it sees at once.
    pub frames: Frames,
    /// How observations are normalised for it: each frame by itself or, where it has numbers for the values of all
    /// frames, the frames side by side.
    pub normalisation: Normalisation,
    /// The layers, from the observation on: the first has an input for each value of each frame, the last an output an
    /// action or a command.
    pub layers: Vec<Layer>,
    /// What stands after each layer but the last.
    pub activation: Activation,
    /// Layers that remember, before, between or behind the others but before the last.
    pub recurrent: Option<Recurrent>,
}

impl Policy {
    /// Reads a policy file.
    ///
    /// # Errors
    ///
    /// A file that cannot be read; one that is cut, changed or of another format; and one whose shapes do not fit, that
    /// has a number that is not finite, or numbers so large that its outputs may not be.
    pub fn load(file: &Path) -> Result<Policy, Error> {
        Policy::from_bytes(&shown_path(file), &reader::read_bytes(file, FILE_LIMIT)?)
    }

    /// The policy of this name that comes with the project: a benchmark's, or `attard2023-lane`, which drives nearer to
    /// its lane's centre on `attard2023`.
    ///
    /// # Errors
    ///
    /// Where there is none: the name, and those that there are.
    pub fn shipped(name: &str) -> Result<Policy, Error> {
        let Some((_, bytes)) = SHIPPED.iter().find(|(known, _)| *known == name) else {
            return Err(Error::UnknownName { name: name.to_owned(), known: Policy::shipped_names().to_vec() });
        };
        Policy::from_bytes(&format!("{name} (shipped)"), bytes)
    }

    /// The policy that comes with the project for this benchmark, whose world is `world`. Where there is none it is the
    /// first one that can drive there: other benchmarks may share actions and extras.
    ///
    /// # Errors
    ///
    /// Where none can; it says what the first one, that for `attard2023`, lacks.
    pub fn shipped_for(benchmark: &str, world: &World) -> Result<Policy, Error> {
        if Policy::shipped_names().contains(&benchmark) {
            return Policy::shipped(benchmark);
        }
        let mut policies =
            Policy::shipped_names().into_iter().map(Policy::shipped).collect::<Result<Vec<Policy>, Error>>()?;
        if let Some(fits) = policies.iter().position(|policy| policy.check(world).is_ok()) {
            return Ok(policies.swap_remove(fits));
        }
        let why = policies[0].check(world).map_or_else(|error| error.to_string(), |()| String::new());
        Err(Error::NoneFits { benchmark: benchmark.to_owned(), why })
    }

    /// Names of the policies that come with the project.
    pub fn shipped_names() -> [&'static str; SHIPPED.len()] {
        SHIPPED.map(|(name, _)| name)
    }

    /// One value an action for each observation, `[n_envs * n_actions]`, of a policy without extras: the last layer's
    /// outputs. Those of an observation do not depend on the others, on its place among them, or on the number of
    /// threads, to the last bit.
    ///
    /// # Panics
    ///
    /// Where the layers do not fit each other; those of a policy that was read do. And where it reads extras or has a
    /// memory: a [`Driver`] keeps that.
    pub fn logits(&self, observations: &[[f32; N_VALUES]]) -> Vec<f32> {
        assert!(self.observation_layout().n_extras == 0, "the policy observes extras: they must be given");
        assert!(!self.reads_vehicles(), "the policy observes other vehicles: they must be given");
        self.logits_beside(observations, &[])
    }

    /// One value an action for each observation, `[n_envs * n_actions]`, with the extras beside each observation, of
    /// which the policy takes those that it reads, `[n_envs]` each.
    ///
    /// # Panics
    ///
    /// Where the layers do not fit each other; those of a policy that was read do. And where it has a memory.
    pub fn logits_beside(&self, observations: &[[f32; N_VALUES]], extras: &[[f32; N_EXTRAS]]) -> Vec<f32> {
        self.logits_among(observations, extras, &[])
    }

    /// The same, with what is observed of other vehicles beside each observation, `[n_envs]`; empty for a policy that
    /// does not read it.
    ///
    /// # Panics
    ///
    /// As [`Policy::logits_beside`], and where it reads what is not given.
    pub fn logits_among(
        &self,
        observations: &[[f32; N_VALUES]],
        extras: &[[f32; N_EXTRAS]],
        around: &[[f32; N_AROUND]],
    ) -> Vec<f32> {
        assert!(!self.has_memory(), "the policy has a memory: a Driver keeps it");
        self.pass(&self.layers).outputs(&self.read(observations, extras, around))
    }

    /// The index of the most probable action for each observation, `[n_envs]`.
    ///
    /// # Panics
    ///
    /// As [`Policy::logits`], and where the outputs are commands.
    pub fn act(&self, observations: &[[f32; N_VALUES]]) -> Vec<u32> {
        self.assert_levels();
        greedy(&self.logits(observations), self.actions.len())
    }

    /// The index of the most probable action for each observation with the extras beside it, `[n_envs]`.
    ///
    /// # Panics
    ///
    /// As [`Policy::logits_beside`], and where the outputs are commands.
    pub fn act_beside(&self, observations: &[[f32; N_VALUES]], extras: &[[f32; N_EXTRAS]]) -> Vec<u32> {
        self.assert_levels();
        greedy(&self.logits_beside(observations, extras), self.actions.len())
    }

    /// The commands for each observation, `[n_envs * n_commands]`, each in -1..=1, of a policy whose outputs are those.
    ///
    /// # Panics
    ///
    /// As [`Policy::logits`], and where the outputs are values of actions.
    pub fn commands(&self, observations: &[[f32; N_VALUES]]) -> Vec<f32> {
        self.assert_continuous();
        self.head.commands(self.logits(observations))
    }

    /// The commands for each observation with the extras beside it, `[n_envs * n_commands]`, each in -1..=1.
    ///
    /// # Panics
    ///
    /// As [`Policy::logits_beside`], and where the outputs are values of actions.
    pub fn commands_beside(&self, observations: &[[f32; N_VALUES]], extras: &[[f32; N_EXTRAS]]) -> Vec<f32> {
        self.assert_continuous();
        self.head.commands(self.logits_beside(observations, extras))
    }

    /// Whether what it does depends on earlier observations: then a [`Driver`] drives.
    pub fn has_memory(&self) -> bool {
        self.frames.n != 1 || self.recurrent.is_some()
    }

    /// Whether it is a perceptron of all values of one step, with a value an action: what `offtrack train` writes,
    /// unless it refines by several frames, and continues with.
    pub fn is_plain(&self) -> bool {
        self.acts_on_device() && self.values.is_none()
    }

    /// Whether it is a perceptron of values of one step, with a value an action: what a kernel on a device acts by.
    pub fn acts_on_device(&self) -> bool {
        !self.has_memory() && self.head == Head::Levels
    }

    /// The policy at the wheel of `n_envs` trucks.
    pub fn driver(self, n_envs: usize) -> Driver {
        Driver::new(self, n_envs)
    }

    /// Number of the policy's outputs: its actions, or its commands.
    pub fn n_outputs(&self) -> usize {
        match self.head {
            Head::Levels => self.actions.len(),
            // A speed is chosen where the two actions differ in it.
            Head::Continuous { .. } => 1 + usize::from(self.actions.windows(2).any(|two| two[0].speed != two[1].speed)),
        }
    }

    /// Numbers that a [`Driver`] remembers of each truck.
    pub fn n_remembered(&self) -> usize {
        let n_stack = if self.frames.n == 1 { 0 } else { self.n_stacked() };
        n_stack + self.recurrent.as_ref().map_or(0, Recurrent::n_kept)
    }

    /// What must be observed at least for it to drive.
    pub fn observation_layout(&self) -> ObservationLayout {
        let all = ObservationLayout { n_extras: self.extras.len(), has_vehicles: self.vehicles };
        self.values.as_ref().map_or(all, Selection::observation_layout)
    }

    /// Values that it reads of a step.
    pub(crate) fn n_values(&self) -> usize {
        self.values.as_ref().map_or_else(|| self.observation_layout().n_values(), |values| values.indices().len())
    }

    /// Whether it reads what other vehicles do.
    pub fn reads_vehicles(&self) -> bool {
        self.observation_layout().has_vehicles
    }

    /// Values of all frames that it sees.
    pub(crate) fn n_stacked(&self) -> usize {
        self.frames.n * self.n_values()
    }

    /// Whether each frame is normalised before it is stacked.
    pub(crate) fn normalises_frames(&self) -> bool {
        self.normalisation.mean.len() == self.n_values()
    }

    /// The values that it reads of each observation, `[n_envs * values]`.
    pub(crate) fn read<'a>(
        &self,
        observations: &'a [[f32; N_VALUES]],
        extras: &[[f32; N_EXTRAS]],
        around: &[[f32; N_AROUND]],
    ) -> Cow<'a, [f32]> {
        let layout = self.observation_layout();
        match &self.values {
            None if layout.is_plain() => Cow::Borrowed(observations.as_flattened()),
            None => {
                let mut rows = vec![0.0; observations.len() * layout.n_values()];
                for (env, row) in rows.chunks_exact_mut(layout.n_values()).enumerate() {
                    layout.join(row, env, observations, extras, around);
                }
                Cow::Owned(rows)
            }
            Some(selection) => {
                let mut rows = Vec::with_capacity(observations.len() * self.n_values());
                for (row, values) in observations.iter().enumerate() {
                    let value = |&index: &usize| match index {
                        ..N_VALUES => values[index],
                        N_VALUES..VEHICLES_AT => extras[row][index - N_VALUES],
                        _ => around[row][index - VEHICLES_AT],
                    };
                    rows.extend(selection.indices().iter().map(value));
                }
                Cow::Owned(rows)
            }
        }
    }

    /// A pass through some of its layers, with the normalisation unless frames were normalised before.
    pub(crate) fn pass<'a>(&'a self, layers: &'a [Layer]) -> Pass<'a> {
        let was_normalised = self.frames.n != 1 && self.normalises_frames();
        let normalisation = (!was_normalised).then_some(&self.normalisation);
        Pass { normalisation, layers, activation: self.activation, activates_last: false }
    }

    pub(crate) fn assert_levels(&self) {
        assert!(self.head == Head::Levels, "the policy's outputs are commands: it chooses none of the actions");
    }

    pub(crate) fn assert_continuous(&self) {
        assert!(self.head != Head::Levels, "the policy's outputs are values of actions: it gives no commands");
    }
}

/// The best action of each row of `logits`, `(rows)`; the first of equals.
pub fn greedy(logits: &[f32], n_actions: usize) -> Vec<u32> {
    let best = |row: &[f32]| (1..n_actions).fold(0, |best, action| if row[best] < row[action] { action } else { best });
    logits.chunks_exact(n_actions).map(|row| best(row) as u32).collect()
}

/// An action sampled from the softmax of each row of `logits`, `(rows)`. `drawn` gives a uniform number of [0, 1) for a
/// row.
pub fn sampled(logits: &[f32], n_actions: usize, mut drawn: impl FnMut(usize) -> f32) -> Vec<u32> {
    let one = |(index, row): (usize, &[f32])| {
        let most = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let sum: f32 = row.iter().map(|logit| (logit - most).exp()).sum();
        let mut left = sum * drawn(index);
        let reached = row.iter().position(|logit| {
            left -= (logit - most).exp();
            left < 0.0
        });
        // Rounding can leave a remainder after the last action.
        reached.unwrap_or(n_actions - 1) as u32
    };
    logits.chunks_exact(n_actions).enumerate().map(one).collect()
}

/// The uniform number of [0, 1) that truck `env` samples its next action by: a function of (seed, env, episode, step).
pub fn drawn(seed: u32, env: u32, truck: &Truck) -> f32 {
    let [word, ..] = random::words(seed, env, truck.episode, (Draw::Action as u32).wrapping_add(truck.steps));
    0.5 * (random::signed_unit(word) + 1.0)
}
