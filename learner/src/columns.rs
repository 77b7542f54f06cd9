//! Networks and optimizers as columns of a checkpoint.

use burn::tensor::Device;

use super::adam::State;
use super::checkpoint::Stored;
use super::network::Mlp;
use crate::error::Error;

/// Columns by their names.
pub type Named = Vec<(String, Vec<f32>)>;

/// A network's parameters with the names of their columns, in the order in which its optimizer has them.
pub fn named(network: &str, parameters: &Mlp) -> Named {
    parameters.parameters().into_iter().map(|(name, values)| (format!("{network}, {name}"), values)).collect()
}

/// The first number that is not finite: its name and value.
pub fn first_broken(columns: Named) -> Option<(String, f32)> {
    columns.into_iter().find_map(|(name, values)| Some((name, values.into_iter().find(|value| !value.is_finite())?)))
}

/// The moments of an optimizer whose parameters these are; none before its first step.
pub fn moments(parameters: &Named, state: State) -> Named {
    let pairs = parameters.iter().zip(state.moments);
    pairs.flat_map(|((name, _), moments)| moment_names(name).into_iter().zip(moments)).collect()
}

/// A network of the sizes of `like`.
pub fn network(stored: &Stored, name: &str, like: &Mlp, device: &Device) -> Result<Mlp, Error> {
    let parameters: Result<_, Error> = like
        .parameters()
        .iter()
        .map(|(part, values)| stored.exactly(&format!("{name}, {part}"), values.len()))
        .collect();
    Ok(like.with_parameters(parameters?, device))
}

/// The state of an optimizer that made so many steps and whose parameters these are. `column` says how many.
pub fn optimizer(stored: &Stored, column: &str, n_steps: u32, parameters: &Named) -> Result<State, Error> {
    let n_steps = i32::try_from(n_steps).map_err(|_| stored.error(format!("its column `{column}` says {n_steps}")))?;
    let moments = parameters.iter().filter(|_| 0 < n_steps).map(|(name, values)| {
        let [first, second] = moment_names(name).map(|name| stored.exactly(&name, values.len()));
        Ok([first?, second?])
    });
    Ok(State { n_steps, moments: moments.collect::<Result<_, Error>>()? })
}

fn moment_names(parameter: &str) -> [String; 2] {
    ["first", "second"].map(|which| format!("{parameter}, {which} moment"))
}
