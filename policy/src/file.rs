//! A policy file's bytes: safetensors, with a description and a checksum in its metadata. `docs/policies.md` describes
//! it for programs that write one.

mod checked;

use std::collections::HashMap;

use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView, serialize};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::frames::{Frames, Padding};
use crate::head::Head;
use crate::network::Activation;
use crate::policy::Policy;
use crate::recurrent::Recurrent;

/// Key of a policy file's one entry in its metadata.
pub const KEY: &str = "offtrack";
/// Versions of what that entry means: the second is that of one with any of the keys that came with it.
pub const VERSIONS: [u32; 2] = [1, 2];
/// Most layers of a policy: more than any training file asks for.
pub const MOST_LAYERS: usize = 64;

/// The metadata's entry.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    version: u32,
    benchmark: String,
    /// Steer angle (rad) and speed (m/s) of each action.
    actions: Vec<[f32; 2]>,
    layers: usize,
    /// Names of the extras observed beside the 69 values; none where it is absent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    extras: Vec<String>,
    /// Whether other vehicles are observed behind these; not where it is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    vehicles: Option<bool>,
    /// A rectifier where it is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    activation: Option<String>,
    /// Values of actions where it is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    head: Option<String>,
    /// How outputs become commands, where they are those.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    squash: Option<String>,
    /// Names of the values that it reads; all where it is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    values: Option<Vec<String>>,
    /// 1 where it is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    frames: Option<usize>,
    /// What stands before an episode's first frame, where there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    padding: Option<String>,
    /// No recurrent layers where it is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    recurrent: Option<RecurrentDescription>,
    /// CRC-32 of the description's text with a 0 here, followed by the tensors' bytes in the order of reading.
    checksum: u32,
}

/// What the description says of recurrent layers.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecurrentDescription {
    gates: String,
    layers: usize,
    /// Layers of the actor before them.
    #[serde(default)]
    after: usize,
}

impl Description {
    /// The first key that version 1 has not.
    fn newer_key(&self) -> Option<&'static str> {
        let keys = [
            ("head", self.head.is_some()),
            ("squash", self.squash.is_some()),
            ("values", self.values.is_some()),
            ("vehicles", self.vehicles.is_some()),
            ("frames", self.frames.is_some()),
            ("padding", self.padding.is_some()),
            ("recurrent", self.recurrent.is_some()),
        ];
        keys.into_iter().find_map(|(key, is_there)| is_there.then_some(key))
    }

    /// The policy's own, without its checksum.
    fn of(policy: &Policy) -> Description {
        let Frames { n, padding } = policy.frames;
        let squash = match policy.head {
            Head::Levels => None,
            Head::Continuous { squash } => Some(squash.name().to_owned()),
        };
        let mut description = Description {
            version: VERSIONS[0],
            benchmark: policy.benchmark.clone(),
            actions: policy.actions.iter().map(|action| [action.steering, action.speed]).collect(),
            layers: policy.layers.len(),
            extras: policy.extras.clone(),
            vehicles: policy.vehicles.then_some(true),
            activation: (policy.activation != Activation::Relu).then(|| policy.activation.name().to_owned()),
            head: squash.is_some().then(|| policy.head.name().to_owned()),
            squash,
            values: policy.values.as_ref().map(|values| values.names().to_vec()),
            frames: (n != 1).then_some(n),
            padding: (n != 1 && padding != Padding::Zero).then(|| padding.name().to_owned()),
            recurrent: policy.recurrent.as_ref().map(|Recurrent { gates, after, cells }| RecurrentDescription {
                gates: gates.name().to_owned(),
                layers: cells.len(),
                after: *after,
            }),
            checksum: 0,
        };
        if description.newer_key().is_some() {
            description.version = VERSIONS[1];
        }
        description
    }
}

impl Policy {
    /// The file's bytes. Equal policies give equal bytes, whatever their names.
    ///
    /// # Panics
    ///
    /// Where a layer has no outputs, or not one weight for each of them and each of its inputs. Shapes that do not fit
    /// each other are written; reading them is an error.
    pub fn to_bytes(&self) -> Vec<u8> {
        let tensors = self.tensors();
        let mut description = Description::of(self);
        let text = |description: &Description| {
            serde_json::to_string(description).expect("numbers and words can be written as JSON")
        };
        description.checksum = checksum(&text(&description), tensors.iter().map(|tensor| tensor.bytes.as_slice()));
        let views = tensors.iter().map(|tensor| {
            let view = TensorView::new(Dtype::F32, tensor.shape.clone(), &tensor.bytes);
            (tensor.name.as_str(), view.expect("a layer has a weight for each input and output"))
        });
        let metadata = HashMap::from([(KEY.to_owned(), text(&description))]);
        serialize(views, Some(metadata)).expect("a header of a few names and shapes can be written")
    }

    /// The policy of a file's bytes, by the name that reports and errors will have.
    ///
    /// # Errors
    ///
    /// The errors of [`Policy::load`] about contents.
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Policy, Error> {
        read(name, bytes).map_err(|message| Error::contents(name, &message))
    }

    /// Every tensor in the order of [`names`].
    fn tensors(&self) -> Vec<Named> {
        let named = |name: String, shape: Vec<usize>, values: &[f32]| Named {
            name,
            shape,
            bytes: values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        };
        let [mean, factor] = [&self.normalisation.mean, &self.normalisation.factor];
        let mut tensors = vec![
            named("observation.mean".to_owned(), vec![mean.len()], mean),
            named("observation.factor".to_owned(), vec![factor.len()], factor),
        ];
        for (index, layer) in self.layers.iter().enumerate() {
            let (n_inputs, n_outputs) = (layer.n_inputs(), layer.n_outputs());
            tensors.push(named(format!("actor.{index}.weight"), vec![n_inputs, n_outputs], &layer.weights));
            tensors.push(named(format!("actor.{index}.bias"), vec![n_outputs], &layer.biases));
        }
        for (index, cell) in self.recurrent.iter().flat_map(|recurrent| recurrent.cells.iter().enumerate()) {
            for (part, layer) in [("ih", &cell.input), ("hh", &cell.hidden)] {
                let (n_inputs, n_outputs) = (layer.n_inputs(), layer.n_outputs());
                let weights = transposed(&layer.weights, n_outputs);
                tensors.push(named(format!("recurrent.{index}.weight_{part}"), vec![n_outputs, n_inputs], &weights));
                tensors.push(named(format!("recurrent.{index}.bias_{part}"), vec![n_outputs], &layer.biases));
            }
        }
        tensors
    }
}

/// What helps where a file is damaged.
const AGAIN: &str = "download it or train it again";

/// The error is a sentence without the file's name.
fn read(name: &str, bytes: &[u8]) -> Result<Policy, String> {
    let unreadable = |error| format!("is not a policy file, or is damaged: {error}; {AGAIN}");
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(unreadable)?;
    let tensors = SafeTensors::deserialize(bytes).map_err(unreadable)?;
    let text = header.metadata().as_ref().and_then(|metadata| metadata.get(KEY));
    let text = text.ok_or_else(|| {
        format!("is not a policy file: its metadata has no entry `{KEY}`; `offtrack train` writes one")
    })?;
    let description: Description = serde_json::from_str(text)
        .map_err(|error| format!("is not a policy file, or is damaged: its description: {error}; {AGAIN}"))?;
    let Description { version, layers, .. } = description;
    if !VERSIONS.contains(&version) {
        let known = VERSIONS.map(|version| version.to_string()).join(" and ");
        return Err(format!("is a policy file of version {version}; this program reads versions {known}"));
    }
    if let Some(key) = description.newer_key().filter(|_| version == VERSIONS[0]) {
        return Err(format!("is a policy file of version 1 with the key `{key}`; its version must be 2"));
    }
    let n_recurrent = description.recurrent.as_ref().map(|recurrent| recurrent.layers);
    let is_usual = |n: &usize| (1..=MOST_LAYERS).contains(n);
    if !is_usual(&layers) || !n_recurrent.iter().all(is_usual) || description.actions.is_empty() {
        return Err(format!("is a damaged policy file: it has no layers, far too many, or no actions; {AGAIN}"));
    }
    let mut read = Vec::new();
    for name in names(layers, n_recurrent.unwrap_or_default()) {
        let tensor = tensors.tensor(&name).map_err(|error| format!("is a damaged policy file: {error}; {AGAIN}"))?;
        if tensor.dtype() != Dtype::F32 {
            return Err(format!("is a damaged policy file: {name} must hold 32-bit floats; {AGAIN}"));
        }
        read.push((name, tensor));
    }
    let found = description.checksum;
    let expected = checksum(&unsigned(text), read.iter().map(|(_, tensor)| tensor.data()));
    if found != expected {
        return Err(format!("is damaged: its checksum is {found:08x} and its contents give {expected:08x}; {AGAIN}"));
    }
    checked::policy(name, description, &read)
}

/// A tensor to be written.
struct Named {
    name: String,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

/// Names of a policy's tensors in the order of reading.
fn names(n_layers: usize, n_recurrent: usize) -> impl Iterator<Item = String> {
    let normalisation = ["observation.mean", "observation.factor"].map(str::to_owned);
    let layers = (0..n_layers).flat_map(|index| ["weight", "bias"].map(|part| format!("actor.{index}.{part}")));
    let parts = ["weight_ih", "bias_ih", "weight_hh", "bias_hh"];
    let recurrent = (0..n_recurrent).flat_map(move |index| parts.map(|part| format!("recurrent.{index}.{part}")));
    normalisation.into_iter().chain(layers).chain(recurrent)
}

/// A matrix `[rows * columns]` as `[columns * rows]`.
fn transposed(values: &[f32], n_columns: usize) -> Vec<f32> {
    (0..n_columns).flat_map(|column| values.iter().skip(column).step_by(n_columns)).copied().collect()
}

fn floats(tensor: &TensorView) -> Vec<f32> {
    tensor.data().as_chunks().0.iter().map(|&chunk| f32::from_le_bytes(chunk)).collect()
}

/// A description's text with a 0 as its checksum, and otherwise as it was written.
fn unsigned(text: &str) -> String {
    // Quotation marks within a string are escaped, so these are around a key or a whole string.
    let quoted = text.match_indices("\"checksum\"").map(|(at, word)| text.split_at(at + word.len()));
    let Some((before, after)) = quoted.into_iter().find(|(_, after)| after.trim_start().starts_with(':')) else {
        return text.to_owned();
    };
    let digits = after.trim_start_matches(|letter: char| !letter.is_ascii_digit());
    let between = &after[..after.len() - digits.len()];
    format!("{before}{between}0{}", digits.trim_start_matches(|letter: char| letter.is_ascii_digit()))
}

/// CRC-32 of an unsigned description and the tensors' bytes.
fn checksum<'a>(unsigned: &str, tensors: impl Iterator<Item = &'a [u8]>) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(unsigned.as_bytes());
    tensors.for_each(|bytes| hasher.update(bytes));
    hasher.finalize()
}
