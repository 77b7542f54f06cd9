//! A learned policy: the actor with all that is needed to drive with it, in one file.
//!
//! The file is in the safetensors format, which other programs read too: the weights, and under the key `offtrack` of
//! its metadata the action table, the benchmark and a checksum over all of it. The policies that come with the project
//! are part of the library.

mod file;

use std::path::Path;

use burn::tensor::Device;
use offtrack::layout::{Action, N_VALUES};
use offtrack::reader;
use offtrack::world::World;
use rand::Rng;

use crate::error::Error;
use crate::learner::network::{Mlp, layer};
use crate::learner::normalisation::Normalisation;
use crate::learner::rollout::host::logits;
use file::Contents;

/// Largest relative difference of two entries of an action table that count as equal: f32 rounds at 6e-8.
const SAME_ACTION: f32 = 1e-5;
/// Most bytes of a policy file: two hundred times the shipped ones.
const FILE_LIMIT: u64 = 64 << 20;

/// The policies that come with the project, by the benchmark that they learned on.
const SHIPPED: [(&str, &[u8]); 2] = [
    ("attard2023", include_bytes!("../policies/attard2023/policy.safetensors")),
    ("attard2023-as-run", include_bytes!("../policies/attard2023-as-run/policy.safetensors")),
];

/// An actor that can drive.
#[derive(Debug)]
pub struct LearnedPolicy {
    /// Name for reports and errors: the file, or the benchmark's name and `(shipped)`.
    pub name: String,
    /// The benchmark it learned on.
    pub benchmark: String,
    /// The action table that its output refers to.
    pub actions: Vec<Action>,
    /// How observations are normalised for it.
    pub normalisation: Normalisation,
    /// The network, without gradients.
    pub actor: Mlp,
}

impl LearnedPolicy {
    /// The index of the most probable action for each observation, `[n_envs]`.
    pub fn act(&self, observations: &[[f32; N_VALUES]]) -> Vec<u32> {
        greedy(&logits(&self.actor, &self.normalisation, observations), self.actions.len())
    }

    /// Reads a policy file. One that is cut, changed, or of another format, and one with a number that is not finite,
    /// is refused.
    pub fn load(file: &Path) -> Result<LearnedPolicy, Error> {
        let bytes = reader::read_bytes(file, FILE_LIMIT)?;
        LearnedPolicy::from_bytes(&file.display().to_string(), &bytes).map_err(|message| Error::contents(file, message))
    }

    /// The policy of a file's bytes, by the name that reports will have. The error is a message without it.
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<LearnedPolicy, String> {
        Ok(LearnedPolicy::new(name.to_owned(), Contents::from_bytes(bytes)?))
    }

    /// The policy that comes with the project for this benchmark.
    pub fn shipped(benchmark: &str) -> Result<LearnedPolicy, Error> {
        let Some((_, bytes)) = SHIPPED.iter().find(|(name, _)| *name == benchmark) else {
            let expected = format!("policies come with the program for {}", LearnedPolicy::shipped_names().join(", "));
            return Err(Error::Flag { flag: "policy", value: benchmark.to_owned(), expected });
        };
        let name = format!("{benchmark} (shipped)");
        LearnedPolicy::from_bytes(&name, bytes).map_err(|message| Error::Contents { file: name.clone().into(), message })
    }

    /// The policy that comes with the project for this benchmark or, where there is none, the one for `attard2023`:
    /// other benchmarks may share its vehicle and actions.
    pub fn shipped_or_default(benchmark: &str) -> Result<LearnedPolicy, Error> {
        let known = LearnedPolicy::shipped_names().contains(&benchmark);
        LearnedPolicy::shipped(if known { benchmark } else { "attard2023" })
    }

    /// Names of the benchmarks that a policy comes with the project for.
    pub fn shipped_names() -> [&'static str; SHIPPED.len()] {
        SHIPPED.map(|(name, _)| name)
    }

    fn new(name: String, contents: Contents) -> LearnedPolicy {
        let device = Device::flex();
        LearnedPolicy {
            name,
            benchmark: contents.benchmark,
            actions: contents.actions.iter().map(|&[steering, speed]| Action { steering, speed }).collect(),
            normalisation: contents.normalisation,
            actor: Mlp {
                layers: contents.layers.into_iter().map(|(weights, biases)| layer(weights, biases, &device)).collect(),
                norms: Vec::new(),
            },
        }
    }

    /// The file's bytes. Equal policies give equal bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let values = |data: burn::tensor::TensorData| data.try_to_vec().expect("the layers' weights are f32");
        let layers = self.actor.layers.iter().map(|layer| {
            let biases = layer.bias.as_ref().map(|bias| values(bias.val().into_data()));
            (values(layer.weight.val().into_data()), biases.unwrap_or_default())
        });
        Contents {
            benchmark: self.benchmark.clone(),
            actions: self.actions.iter().map(|action| [action.steering, action.speed]).collect(),
            normalisation: self.normalisation.clone(),
            layers: layers.collect(),
        }
        .to_bytes()
    }

    /// Whether the policy can drive in `world`: its action table must be the world's.
    pub fn check(&self, world: &World) -> Result<(), Error> {
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
        Err(Error::Contents { file: self.name.clone().into(), message })
    }
}

/// The best action of each row of `logits`, `[rows]`; the first of equals.
pub fn greedy(logits: &[f32], n_actions: usize) -> Vec<u32> {
    let best = |row: &[f32]| (1..n_actions).fold(0, |best, action| if row[best] < row[action] { action } else { best });
    logits.chunks_exact(n_actions).map(|row| best(row) as u32).collect()
}

/// An action sampled from the softmax of each row of `logits`, `[rows]`.
pub fn sampled(logits: &[f32], n_actions: usize, rng: &mut impl Rng) -> Vec<u32> {
    let mut one = |row: &[f32]| {
        let most = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let sum: f32 = row.iter().map(|logit| (logit - most).exp()).sum();
        let mut left = sum * rng.random::<f32>();
        let reached = row.iter().position(|logit| {
            left -= (logit - most).exp();
            left < 0.0
        });
        // Rounding can leave a remainder after the last action.
        reached.unwrap_or(n_actions - 1) as u32
    };
    logits.chunks_exact(n_actions).map(&mut one).collect()
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

#[cfg(test)]
mod tests;
