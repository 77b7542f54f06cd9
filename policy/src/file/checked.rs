//! The policy of a file whose checksum is right. Shapes may still be those of another observation or action table, and
//! values may not be finite.

use offtrack::layout::shared::Named;
use offtrack::layout::{Action, EXTRAS, ObservationLayout};
use safetensors::tensor::TensorView;

use super::{Description, RecurrentDescription, floats, transposed};
use crate::bounds::overflowing;
use crate::frames::Frames;
use crate::head::Head;
use crate::network::{Activation, Layer};
use crate::normalisation::Normalisation;
use crate::policy::Policy;
use crate::recurrent::{Cell, Gates, Recurrent};
use crate::selection::Selection;

/// Most frames of a policy: more than two minutes of steps.
const MOST_FRAMES: usize = 1024;

/// Tensors by name.
type Tensors<'a, 'b> = &'a [(String, TensorView<'b>)];

/// The policy of a description and its tensors, in the order of [`super::names`]. The error is a sentence without the
/// file's name.
pub(super) fn policy(name: &str, description: Description, tensors: Tensors) -> Result<Policy, String> {
    let activation = word("the activation", description.activation.as_deref().unwrap_or(Activation::Relu.name()))?;
    let head = head(&description)?;
    for (name, tensor) in tensors {
        if let Some((index, value)) = floats(tensor).into_iter().enumerate().find(|(_, value)| !value.is_finite()) {
            return Err(format!(
                "is a policy that cannot drive: {name}[{index}] is {value}; every number must be finite; train it again"
            ));
        }
    }
    let values = values(&description)?;
    let frames = frames(&description)?;
    let vehicles = description.vehicles.unwrap_or_default();
    let all = ObservationLayout { n_extras: description.extras.len(), has_vehicles: vehicles };
    let n_values = values.as_ref().map_or(all.n_values(), |values| values.indices().len());
    let n_stacked = frames.n * n_values;
    let (statistics, layers) = tensors.split_at(2);
    check_statistics(statistics, n_values, frames)?;
    let (layers, cells) = layers.split_at(2 * description.layers);
    let recurrent = description.recurrent.as_ref().map(|recurrent| (recurrent, cells));
    let (layers, recurrent) = linked(n_stacked, layers, recurrent)?;
    let actions: Vec<Action> =
        description.actions.iter().map(|&[steering, speed]| Action { steering, speed }).collect();
    let policy = Policy {
        name: name.to_owned(),
        benchmark: description.benchmark,
        actions,
        head,
        values,
        extras: description.extras,
        vehicles,
        frames,
        normalisation: Normalisation { mean: floats(&statistics[0].1), factor: floats(&statistics[1].1) },
        layers,
        activation,
        recurrent,
    };
    let (n_outputs, n_needed) = (policy.layers.last().map_or(0, Layer::n_outputs), policy.n_outputs());
    if n_outputs != n_needed {
        let needed = match head {
            Head::Levels => format!("its action table {n_needed} actions"),
            Head::Continuous { .. } => format!("its actions ask for {n_needed} commands"),
        };
        return Err(format!("is a policy of another shape: its last layer has {n_outputs} outputs, and {needed}"));
    }
    if let Some((layer, most)) = overflowing(&policy.layers, activation, policy.recurrent.as_ref()) {
        return Err(format!(
            "is a policy that cannot drive: the outputs of {layer} may reach {most:.0e}, beyond 32-bit floats; train \
             it again"
        ));
    }
    Ok(policy)
}

/// One of a list of names.
fn word<T: Named>(key: &str, word: &str) -> Result<T, String> {
    T::named(word).ok_or_else(|| {
        let known: Vec<&str> = T::ALL.iter().map(|known| known.name()).collect();
        format!("is a policy with {key} {word:?}; must be {}", known.join(" or "))
    })
}

fn head(description: &Description) -> Result<Head, String> {
    match (description.head.as_deref(), &description.squash) {
        (Some("levels") | None, None) => Ok(Head::Levels),
        (Some("levels") | None, Some(squash)) => Err(format!(
            "is a policy with the squash {squash:?}, and its outputs are values of actions; leave it out, or its head \
             must be \"continuous\""
        )),
        (Some("continuous"), Some(squash)) => {
            if description.actions.len() != 2 {
                return Err(format!(
                    "is a policy of commands with {} actions; two are needed: what -1 and what 1 asks for",
                    description.actions.len()
                ));
            }
            Ok(Head::Continuous { squash: word("the squash", squash)? })
        }
        (Some("continuous"), None) => {
            Err("is a policy of commands without a squash; \"tanh\" or \"clip\" is needed".to_owned())
        }
        (Some(head), _) => Err(format!("is a policy with the head {head:?}; must be levels or continuous")),
    }
}

fn values(description: &Description) -> Result<Option<Selection>, String> {
    let extras = &description.extras;
    let Some(names) = &description.values else {
        if extras.iter().eq(EXTRAS.iter().map(|extra| extra.name).take(extras.len())) {
            return Ok(None);
        }
        let known: Vec<&str> = EXTRAS.iter().map(|extra| extra.name).collect();
        return Err(format!("is a policy with the extras {extras:?}; must be the first of {}", known.join(", ")));
    };
    if !extras.is_empty() {
        return Err("is a policy with the keys `values` and `extras`; the extras that it reads are among its values: \
                    leave `extras` out"
            .to_owned());
    }
    if description.vehicles.is_some() {
        return Err("is a policy with the keys `values` and `vehicles`; what it reads of other vehicles is among its \
                    values: leave `vehicles` out"
            .to_owned());
    }
    Selection::of(names).map(Some).map_err(|message| format!("is a policy with the values {message}"))
}

fn frames(description: &Description) -> Result<Frames, String> {
    let n = description.frames.unwrap_or(1);
    if !(1..=MOST_FRAMES).contains(&n) {
        return Err(format!("is a policy with {n} frames; must lie in 1..{MOST_FRAMES}"));
    }
    let Some(padding) = &description.padding else { return Ok(Frames { n, ..Frames::default() }) };
    if n == 1 {
        return Err(format!("is a policy with the padding {padding:?} and one frame; leave it out, or give `frames`"));
    }
    Ok(Frames { n, padding: word("the padding", padding)? })
}

/// Mean and factor of each value, or of each value of each frame.
fn check_statistics(statistics: Tensors, n_values: usize, frames: Frames) -> Result<(), String> {
    let n_found = |index: usize| match statistics[index].1.shape() {
        &[n] => Some(n),
        _ => None,
    };
    for (index, (name, tensor)) in statistics.iter().enumerate() {
        let is_known = n_found(index).is_some_and(|n| n == n_values || n == frames.n * n_values);
        let needed = match frames.n {
            1 => format!("an observation has {n_values} values"),
            n => format!("its frames have {n_values} values each, {} in all", n * n_values),
        };
        if !is_known || n_found(index) != n_found(0) {
            return Err(format!("is a policy of another shape: {name} is {:?}; {needed}", tensor.shape()));
        }
    }
    Ok(())
}

/// The layers, each with as many inputs as what stands before it has outputs.
fn linked(
    n_stacked: usize,
    layers: Tensors,
    recurrent: Option<(&RecurrentDescription, Tensors)>,
) -> Result<(Vec<Layer>, Option<Recurrent>), String> {
    let mut n_inputs = n_stacked;
    let mut linked: Vec<Layer> = Vec::new();
    let mut found = None;
    let n_layers = layers.len() / 2;
    if let Some((recurrent, _)) = &recurrent
        && n_layers <= recurrent.after
    {
        return Err(format!(
            "is a policy with recurrent layers after {} of {n_layers} layers; one at least must follow",
            recurrent.after
        ));
    }
    for (index, pair) in layers.chunks_exact(2).enumerate() {
        if let Some((recurrent, cells)) = recurrent.filter(|(recurrent, _)| recurrent.after == index) {
            let gates: Gates = word("the gates", &recurrent.gates)?;
            let mut read: Vec<Cell> = Vec::new();
            for parts in cells.chunks_exact(4) {
                let cell = cell(gates, n_inputs, parts)?;
                n_inputs = cell.n_units();
                read.push(cell);
            }
            found = Some(Recurrent { gates, after: index, cells: read });
        }
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
        linked.push(Layer { weights: floats(weight), biases: floats(bias) });
        n_inputs = n_outputs;
    }
    Ok((linked, found))
}

/// A recurrent layer of its four tensors, which are as PyTorch keeps them.
fn cell(gates: Gates, n_inputs: usize, parts: Tensors) -> Result<Cell, String> {
    let n_units = match parts[2].1.shape() {
        &[_, n_units] if 0 < n_units => n_units,
        shape => {
            let name = &parts[2].0;
            return Err(format!("is a policy of another shape: {name} is {shape:?}; [gates * units, units] is needed"));
        }
    };
    let n_outputs = gates.n().saturating_mul(n_units);
    let shapes = [vec![n_outputs, n_inputs], vec![n_outputs], vec![n_outputs, n_units], vec![n_outputs]];
    for ((name, tensor), needed) in parts.iter().zip(shapes) {
        if tensor.shape() != needed {
            return Err(format!(
                "is a policy of another shape: {name} is {:?}; {needed:?} is needed, {} gates of {n_units} units",
                tensor.shape(),
                gates.n()
            ));
        }
    }
    let layer = |weight: usize, n_inputs: usize| Layer {
        weights: transposed(&floats(&parts[weight].1), n_inputs),
        biases: floats(&parts[weight + 1].1),
    };
    Ok(Cell { input: layer(0, n_inputs), hidden: layer(2, n_units) })
}
