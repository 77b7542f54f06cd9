//! A policy file's bytes: safetensors, with a description and a checksum in its metadata. `docs/policies.md` describes
//! it for programs that write one.

use std::collections::HashMap;

use offtrack::layout::{Action, EXTRAS, N_VALUES};
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView, serialize};
use serde::{Deserialize, Serialize};

use crate::bounds::overflowing;
use crate::error::Error;
use crate::network::{Activation, Layer};
use crate::normalisation::Normalisation;
use crate::policy::Policy;

/// Key of a policy file's one entry in its metadata.
pub const KEY: &str = "offtrack";
/// Version of what that entry means.
pub const VERSION: u32 = 1;
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
    /// A rectifier where it is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    activation: Option<String>,
    /// CRC-32 of the description's text with a 0 here, followed by the tensors' bytes in the order of reading.
    checksum: u32,
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
        let mut description = Description {
            version: VERSION,
            benchmark: self.benchmark.clone(),
            actions: self.actions.iter().map(|action| [action.steering, action.speed]).collect(),
            layers: self.layers.len(),
            extras: self.extras.clone(),
            activation: (self.activation != Activation::Relu).then(|| self.activation.name().to_owned()),
            checksum: 0,
        };
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
        let vectors = [&self.normalisation.mean, &self.normalisation.factor].map(|values| (vec![values.len()], values));
        let layers = self.layers.iter().flat_map(|layer| {
            let outputs = layer.n_outputs();
            [(vec![layer.n_inputs(), outputs], &layer.weights), (vec![outputs], &layer.biases)]
        });
        let named = |(name, (shape, values)): (String, (Vec<usize>, &Vec<f32>))| Named {
            name,
            shape,
            bytes: values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        };
        names(self.layers.len()).zip(vectors.into_iter().chain(layers)).map(named).collect()
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
    if description.version != VERSION {
        return Err(format!(
            "is a policy file of version {}; this program reads version {VERSION}",
            description.version
        ));
    }
    if !(1..=MOST_LAYERS).contains(&description.layers) || description.actions.is_empty() {
        return Err(format!("is a damaged policy file: it has no layers, far too many, or no actions; {AGAIN}"));
    }
    let mut read = Vec::new();
    for name in names(description.layers) {
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
    checked(name, description, &read)
}

/// The policy of a file whose checksum is right. Shapes may still be those of another observation or action table, and
/// values may not be finite.
fn checked(name: &str, description: Description, tensors: &[(String, TensorView)]) -> Result<Policy, String> {
    let activation = match &description.activation {
        None => Activation::Relu,
        Some(word) => Activation::ALL.into_iter().find(|activation| activation.name() == word).ok_or_else(|| {
            let known = Activation::ALL.map(Activation::name).join(" or ");
            format!("is a policy with the activation {word:?}; must be {known}")
        })?,
    };
    for (name, tensor) in tensors {
        if let Some((index, value)) = floats(tensor).into_iter().enumerate().find(|(_, value)| !value.is_finite()) {
            return Err(format!(
                "is a policy that cannot drive: {name}[{index}] is {value}; every number must be finite; train it again"
            ));
        }
    }
    if !description
        .extras
        .iter()
        .map(String::as_str)
        .eq(EXTRAS.iter().map(|extra| extra.name).take(description.extras.len()))
    {
        let known: Vec<&str> = EXTRAS.iter().map(|extra| extra.name).collect();
        return Err(format!(
            "is a policy with the extras {:?}; must be the first of {}",
            description.extras,
            known.join(", ")
        ));
    }
    let n_values = N_VALUES + description.extras.len();
    let (statistics, layers) = tensors.split_at(2);
    for (name, tensor) in statistics {
        if tensor.shape() != [n_values] {
            return Err(format!(
                "is a policy of another shape: {name} is {:?}; an observation has {n_values} values",
                tensor.shape()
            ));
        }
    }
    let mut n_inputs = n_values;
    for pair in layers.chunks_exact(2) {
        let [(weight_name, weight), (bias_name, bias)] = [&pair[0], &pair[1]];
        let &[n_outputs] = bias.shape() else {
            return Err(format!(
                "is a policy of another shape: {bias_name} is {:?}; one number an output is needed",
                bias.shape()
            ));
        };
        if n_outputs == 0 || weight.shape() != [n_inputs, n_outputs] {
            return Err(format!(
                "is a policy of another shape: {weight_name} is {:?}; [{n_inputs}, {n_outputs}] is needed, inputs \
                 before outputs",
                weight.shape()
            ));
        }
        n_inputs = n_outputs;
    }
    if n_inputs != description.actions.len() {
        return Err(format!(
            "is a policy of another shape: its last layer has {n_inputs} outputs, and its action table {} actions",
            description.actions.len()
        ));
    }
    let layers: Vec<Layer> =
        layers.chunks_exact(2).map(|pair| Layer { weights: floats(&pair[0].1), biases: floats(&pair[1].1) }).collect();
    if let Some((index, most)) = overflowing(&layers, activation) {
        return Err(format!(
            "is a policy that cannot drive: the outputs of actor.{index} may reach {most:.0e}, beyond 32-bit floats; \
             train it again"
        ));
    }
    Ok(Policy {
        name: name.to_owned(),
        benchmark: description.benchmark,
        actions: description.actions.iter().map(|&[steering, speed]| Action { steering, speed }).collect(),
        extras: description.extras,
        normalisation: Normalisation { mean: floats(&statistics[0].1), factor: floats(&statistics[1].1) },
        layers,
        activation,
    })
}

/// A tensor to be written.
struct Named {
    name: String,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

/// Names of a policy's tensors in the order of reading.
fn names(n_layers: usize) -> impl Iterator<Item = String> {
    let normalisation = ["observation.mean", "observation.factor"].map(str::to_owned);
    let layers = (0..n_layers).flat_map(|index| ["weight", "bias"].map(|part| format!("actor.{index}.{part}")));
    normalisation.into_iter().chain(layers)
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
