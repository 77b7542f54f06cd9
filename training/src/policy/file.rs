//! A policy file's bytes: safetensors, with a description and a checksum in its metadata.

use std::collections::HashMap;

use offtrack::layout::N_VALUES;
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView, serialize};
use serde::{Deserialize, Serialize};

use crate::learner::normalisation::Normalisation;

/// Key of the metadata's one entry.
const KEY: &str = "offtrack";
/// Version of the description's meaning.
const VERSION: u32 = 1;
/// Most layers of a policy: more than any training file asks for.
const MOST_LAYERS: usize = 64;

/// The file's contents as plain numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contents {
    pub(super) benchmark: String,
    /// Steer angle \[rad] and speed [m/s] of each action.
    pub(super) actions: Vec<[f32; 2]>,
    pub(super) normalisation: Normalisation,
    /// Weights `[inputs * outputs]`, inputs varying slowest, and biases `[outputs]`, from the observation on.
    pub(super) layers: Vec<(Vec<f32>, Vec<f32>)>,
}

/// The metadata's entry.
#[derive(Debug, Serialize, Deserialize)]
struct Description {
    version: u32,
    benchmark: String,
    actions: Vec<[f32; 2]>,
    layers: usize,
    /// CRC-32 of the description with a 0 here, followed by the tensors' bytes in the order of reading.
    checksum: u32,
}

impl Contents {
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let tensors = self.tensors();
        let mut description = Description {
            version: VERSION,
            benchmark: self.benchmark.clone(),
            actions: self.actions.clone(),
            layers: self.layers.len(),
            checksum: 0,
        };
        description.checksum = checksum(&description, tensors.iter().map(|tensor| tensor.bytes.as_slice()));
        let views = tensors.iter().map(|tensor| {
            let view = TensorView::new(Dtype::F32, tensor.shape.clone(), &tensor.bytes);
            (tensor.name.as_str(), view.expect("a tensor has as many bytes as its shape says: `named` made both from the same numbers"))
        });
        let metadata = HashMap::from([(KEY.to_owned(), text(&description))]);
        serialize(views, Some(metadata)).expect("a header of a few names and shapes can be written")
    }

    /// The error is a sentence without the file's name: the caller adds it.
    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Contents, String> {
        let unreadable = |error| format!("is not a policy file, or is damaged: {error}");
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(unreadable)?;
        let tensors = SafeTensors::deserialize(bytes).map_err(unreadable)?;
        let text = header.metadata().as_ref().and_then(|metadata| metadata.get(KEY));
        let text = text.ok_or_else(|| format!("is not a policy file: its metadata has no entry `{KEY}`; `offtrack train` writes one"))?;
        let mut description: Description =
            serde_json::from_str(text).map_err(|error| format!("is not a policy file, or is damaged: its description: {error}"))?;
        if description.version != VERSION {
            return Err(format!("is a policy file of version {}; this program reads version {VERSION}", description.version));
        }
        if !(1..=MOST_LAYERS).contains(&description.layers) || description.actions.is_empty() {
            return Err("is a damaged policy file: it has no layers, far too many, or no actions".into());
        }
        let mut read = Vec::new();
        for name in names(description.layers) {
            let tensor = tensors.tensor(&name).map_err(|error| format!("is a damaged policy file: {error}"))?;
            if tensor.dtype() != Dtype::F32 {
                return Err(format!("is a damaged policy file: {name} must hold 32-bit floats"));
            }
            read.push((name, tensor));
        }
        let found = std::mem::take(&mut description.checksum);
        let expected = checksum(&description, read.iter().map(|(_, tensor)| tensor.data()));
        if found != expected {
            return Err(format!(
                "is damaged: its checksum is {found:08x} and its contents give {expected:08x}; download it or train it again"
            ));
        }
        Contents::from_tensors(description, &read)
    }

    /// The numbers of a file whose checksum is right. Shapes may still be those of another observation or action table,
    /// and values may not be finite.
    fn from_tensors(description: Description, tensors: &[(String, TensorView)]) -> Result<Contents, String> {
        for (name, tensor) in tensors {
            if let Some((index, value)) = floats(tensor.data()).into_iter().enumerate().find(|(_, value)| !value.is_finite()) {
                return Err(format!(
                    "is a policy that cannot drive: {name}[{index}] is {value}; every number must be finite; train it again"
                ));
            }
        }
        if let Some((index, _)) = description.actions.iter().enumerate().find(|(_, action)| !action.iter().all(|value| value.is_finite())) {
            return Err(format!("is a policy that cannot drive: actions[{index}] is not finite; train it again"));
        }
        let mut sizes = vec![N_VALUES];
        let mut numbers = tensors.iter().map(|(_, tensor)| floats(tensor.data()));
        let mut next = || numbers.next().unwrap_or_default();
        let normalisation = Normalisation { mean: next(), factor: next() };
        let layers: Vec<_> = (0..description.layers).map(|_| (next(), next())).collect();
        sizes.extend(layers.iter().map(|(_, biases)| biases.len()));
        let fits = |((weights, _), ends): (&(Vec<f32>, Vec<f32>), &[usize])| 0 < ends[1] && weights.len() == ends[0] * ends[1];
        let chain = layers.iter().zip(sizes.windows(2)).all(fits);
        if normalisation.mean.len() != N_VALUES
            || normalisation.factor.len() != N_VALUES
            || !chain
            || sizes.last() != Some(&description.actions.len())
        {
            return Err(format!(
                "is a policy of another shape: {} observation values and layers of {:?}; {N_VALUES} values and {} actions are needed",
                normalisation.mean.len(),
                &sizes[1..],
                description.actions.len()
            ));
        }
        Ok(Contents { benchmark: description.benchmark, actions: description.actions, normalisation, layers })
    }

    /// Every tensor in the order of [`names`].
    fn tensors(&self) -> Vec<Named> {
        let vectors = [&self.normalisation.mean, &self.normalisation.factor].map(|values| (vec![values.len()], values));
        let layers = self.layers.iter().flat_map(|(weights, biases)| {
            let outputs = biases.len();
            [(vec![weights.len() / outputs.max(1), outputs], weights), (vec![outputs], biases)]
        });
        let shaped = vectors.into_iter().chain(layers);
        let named = |(name, (shape, values)): (String, (Vec<usize>, &Vec<f32>))| Named {
            name,
            shape,
            bytes: values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        };
        names(self.layers.len()).zip(shaped).map(named).collect()
    }
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

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks().0.iter().map(|&chunk| f32::from_le_bytes(chunk)).collect()
}

fn text(description: &Description) -> String {
    serde_json::to_string(description).expect("numbers and words can be written as JSON")
}

fn checksum<'a>(unsigned: &Description, tensors: impl Iterator<Item = &'a [u8]>) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(text(unsigned).as_bytes());
    tensors.for_each(|bytes| hasher.update(bytes));
    hasher.finalize()
}
