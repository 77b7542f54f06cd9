//! A policy: a network with all that is needed to drive with it.

use std::path::Path;

use offtrack::files::reader::{self, shown_path};
use offtrack::layout::random::{self, Draw};
use offtrack::layout::{Action, EXTRAS, N_EXTRAS, N_VALUES, Truck};
use offtrack::world::World;

use crate::error::Error;
use crate::network::{self, Activation, Layer};
use crate::normalisation::Normalisation;

/// Largest relative difference of two entries of an action table that count as equal: f32 rounds at 6e-8.
pub const SAME_ACTION: f32 = 1e-5;
/// Most bytes of a policy file: two hundred times the shipped ones.
const FILE_LIMIT: u64 = 64 << 20;

/// The policies that come with the project, by name. One with a benchmark's name drives there unless another is asked
/// for.
const SHIPPED: [(&str, &[u8]); 6] = [
    ("attard2023", include_bytes!("../shipped/attard2023/policy.safetensors")),
    ("attard2023-lane", include_bytes!("../shipped/attard2023-lane/policy.safetensors")),
    ("attard2023-as-run", include_bytes!("../shipped/attard2023-as-run/policy.safetensors")),
    ("laden2026", include_bytes!("../shipped/laden2026/policy.safetensors")),
    ("laden2026-50", include_bytes!("../shipped/laden2026-50/policy.safetensors")),
    ("transfer2026", include_bytes!("../shipped/transfer2026/policy.safetensors")),
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
    /// The action table that its output refers to.
    pub actions: Vec<Action>,
    /// How observations are normalised for it.
    pub normalisation: Normalisation,
    /// Names of the extras that it observes beside the 69 values, in the order of [`EXTRAS`]: its first ones.
    pub extras: Vec<String>,
    /// The layers, from the observation on: the first has an input for each of the [`N_VALUES`] and the extras, the
    /// last an output an action.
    pub layers: Vec<Layer>,
    /// What stands after each layer but the last.
    pub activation: Activation,
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
    /// first one that can drive there: other benchmarks may share actions and extras. Where none can it is the one for
    /// `attard2023`, and [`Policy::check`] says what that lacks.
    ///
    /// # Errors
    ///
    /// None as long as the policies that come with the project can be read.
    pub fn shipped_for(benchmark: &str, world: &World) -> Result<Policy, Error> {
        if Policy::shipped_names().contains(&benchmark) {
            return Policy::shipped(benchmark);
        }
        let mut policies =
            Policy::shipped_names().into_iter().map(Policy::shipped).collect::<Result<Vec<Policy>, Error>>()?;
        let fits = policies.iter().position(|policy| policy.check(world).is_ok());
        Ok(policies.swap_remove(fits.unwrap_or_default()))
    }

    /// Names of the policies that come with the project.
    pub fn shipped_names() -> [&'static str; SHIPPED.len()] {
        SHIPPED.map(|(name, _)| name)
    }

    /// One value an action for each observation, `[n_envs * n_actions]`, of a policy without extras. Those of an
    /// observation do not depend on the others, on its place among them, or on the number of threads, to the last bit.
    ///
    /// # Panics
    ///
    /// Where the layers do not fit each other; those of a policy that was read do. And where it has extras.
    pub fn logits(&self, observations: &[[f32; N_VALUES]]) -> Vec<f32> {
        assert!(self.extras.is_empty(), "the policy observes extras: they must be given");
        network::forward(&self.normalisation, &self.layers, self.activation, observations.as_flattened())
    }

    /// One value an action for each observation, `[n_envs * n_actions]`, with the extras beside each observation, of
    /// which the policy takes the first, `[n_envs]` each.
    ///
    /// # Panics
    ///
    /// Where the layers do not fit each other; those of a policy that was read do.
    pub fn logits_beside(&self, observations: &[[f32; N_VALUES]], extras: &[[f32; N_EXTRAS]]) -> Vec<f32> {
        if self.extras.is_empty() {
            return self.logits(observations);
        }
        let rows = observations
            .iter()
            .zip(extras)
            .flat_map(|(values, extras)| values.iter().chain(&extras[..self.extras.len()]));
        network::forward(&self.normalisation, &self.layers, self.activation, &rows.copied().collect::<Vec<f32>>())
    }

    /// The index of the most probable action for each observation, `[n_envs]`.
    ///
    /// # Panics
    ///
    /// As [`Policy::logits`].
    pub fn act(&self, observations: &[[f32; N_VALUES]]) -> Vec<u32> {
        greedy(&self.logits(observations), self.actions.len())
    }

    /// The index of the most probable action for each observation with the extras beside it, `[n_envs]`.
    ///
    /// # Panics
    ///
    /// As [`Policy::logits_beside`].
    pub fn act_beside(&self, observations: &[[f32; N_VALUES]], extras: &[[f32; N_EXTRAS]]) -> Vec<u32> {
        greedy(&self.logits_beside(observations, extras), self.actions.len())
    }

    /// Whether the policy can drive in `world`.
    ///
    /// # Errors
    ///
    /// Other extras than the world's, or another action table.
    pub fn check(&self, world: &World) -> Result<(), Error> {
        let observed = EXTRAS[..world.params.n_extras as usize].iter().map(|extra| extra.name);
        if !observed.clone().eq(self.extras.iter().map(String::as_str)) {
            let listed = |names: Vec<&str>| if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            let message = format!(
                "learned with other extras beside the observation: {} here, {} in the benchmark; the key \
                 observation.extras must be equal",
                listed(self.extras.iter().map(String::as_str).collect()),
                listed(observed.collect()),
            );
            return Err(Error::contents(&self.name, &message));
        }
        let near = |a: f32, b: f32| (a - b).abs() <= SAME_ACTION * a.abs().max(1.0);
        let same = |(a, b): (&Action, &Action)| near(a.steering, b.steering) && near(a.speed, b.speed);
        if self.actions.len() == world.actions.len() && self.actions.iter().zip(&world.actions).all(same) {
            return Ok(());
        }
        let message = format!(
            "learned with another action table: {} here, {} in the benchmark; {}",
            described(&self.actions),
            described(&world.actions),
            "a policy that learned with the same actions and the same vehicle lock is needed"
        );
        Err(Error::contents(&self.name, &message))
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

/// An action table in a few words.
fn described(actions: &[Action]) -> String {
    let range = |value: fn(&Action) -> f32| {
        let values = actions.iter().map(value);
        (values.clone().fold(f32::INFINITY, f32::min), values.fold(f32::NEG_INFINITY, f32::max))
    };
    let (right, left) = range(|action| action.steering.to_degrees());
    let (slow, fast) = range(|action| action.speed * 3.6);
    format!("{} actions, {right:.1}..{left:.1} deg, {slow:.1}..{fast:.1} km/h", actions.len())
}
