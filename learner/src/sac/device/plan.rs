//! Where the learner's numbers lie in its memory, and the kernels of an update in their order.

use offtrack::layout::WORKGROUP;

use super::kernels::{BESIDE, Facts, Kernel, N_CRITICS, N_LEARNING, N_NORMS, Norm, Pass};
use crate::device::{N_PRODUCTS, NONE, Product};

/// Networks: those that learn, and those that follow them.
pub(super) const N_NETWORKS: usize = 2 * N_LEARNING;
/// Logarithm of the entropy coefficient, and its moments.
pub(super) const N_ENTROPY: usize = 3;
/// Sums of figures.
pub(super) const N_SUMS: usize = 4;

/// A kernel, what it is bound to beside the facts, and its workgroups.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dispatch {
    pub(super) kernel: Kernel,
    pub(super) of: Of,
    pub(super) groups: u32,
}

/// What a dispatch is of.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Of {
    /// The whole batch, or all parameters.
    All,
    /// These products.
    Products(Box<[Product; N_PRODUCTS]>),
    /// These layer normalisations.
    Norms([Norm; N_NORMS]),
}

/// A plan for networks of one shape and batches of one size.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plan {
    pub(super) facts: Facts,
    /// Numbers in the memory.
    pub(super) length: usize,
    /// The kernels of an update.
    pub(super) dispatches: Vec<Dispatch>,
}

/// Places of the parameters of one layer in those of a network.
struct Layer {
    n_inputs: u32,
    n_outputs: u32,
    weights: u32,
    biases: u32,
    /// Scale and shift of its normalisation; none where it has none.
    norm: Option<[u32; 2]>,
}

/// Numbers of a hidden layer in all passes, one pass after the other.
struct Hidden {
    values: u32,
    activations: u32,
    factors: u32,
    /// Of the passes that learn.
    errors: u32,
}

/// Takes places, one after the other.
struct Places(u32);

impl Places {
    fn take(&mut self, n: usize) -> u32 {
        let place = self.0;
        // What does not fit into a buffer is refused before it is used.
        self.0 = self.0.saturating_add(u32::try_from(n).unwrap_or(u32::MAX));
        place
    }
}

impl Pass {
    /// The network of the pass, by its place in the memory.
    fn network(self) -> u32 {
        match self {
            Pass::Actor | Pass::ActorNext => 0,
            Pass::Critic1 => 1,
            Pass::Critic2 => 2,
            Pass::Target1 => N_LEARNING as u32 + 1,
            Pass::Target2 => N_LEARNING as u32 + 2,
        }
    }

    fn is_next(self) -> bool {
        matches!(self, Pass::ActorNext | Pass::Target1 | Pass::Target2)
    }

    fn is_critic(self) -> bool {
        !matches!(self, Pass::Actor | Pass::ActorNext)
    }
}

impl Plan {
    /// For networks between layers of these sizes, with normalisations in the critics or without, and batches of
    /// `n_rows` transitions. How values are combined is for the caller to fill in.
    pub(super) fn new(sizes: &[usize], has_norms: bool, n_rows: usize) -> Plan {
        let (layers, n_parameters) = layers(sizes, has_norms);
        let n_actions = sizes[sizes.len() - 1];
        let (all, learning) = (Pass::ALL.len(), N_LEARNING);
        let mut places = Places(0);
        places.take(N_NETWORKS * n_parameters);
        let moments = places.take(2 * learning * n_parameters);
        let gradients = places.take(learning * n_parameters);
        let (entropy, sums) = (places.take(N_ENTROPY), places.take(N_SUMS));
        let figures = places.take(N_SUMS * n_rows);
        let observations = places.take(2 * n_rows * sizes[0]);
        let outputs = places.take(all * n_rows * n_actions);
        let output_errors = places.take(learning * n_rows * n_actions);
        let hidden: Vec<Hidden> = sizes[1..sizes.len() - 1]
            .iter()
            .map(|width| Hidden {
                values: places.take(all * n_rows * width),
                activations: places.take(all * n_rows * width),
                factors: places.take(all * n_rows),
                errors: places.take(learning * n_rows * width),
            })
            .collect();
        let facts = Facts {
            n_rows: n_rows as u32,
            n_values: sizes[0] as u32,
            n_actions: n_actions as u32,
            n_parameters: n_parameters as u32,
            takes_minimum: 0,
            entropy_in_target: 0,
            moments,
            gradients,
            entropy,
            sums,
            figures,
            observations,
            outputs,
            output_errors,
        };
        let shape = Shape { facts, layers, hidden };
        // Places would not be numbers of 32 bits.
        let is_too_long = places.0 == u32::MAX;
        let dispatches = if is_too_long { Vec::new() } else { shape.dispatches() };
        Plan { facts, length: places.0 as usize, dispatches }
    }
}

/// The layers of a network, in the order of [`crate::network::Mlp::parameters`], and how many parameters they have.
fn layers(sizes: &[usize], has_norms: bool) -> (Vec<Layer>, usize) {
    let mut places = Places(0);
    let layer = |ends: &[usize]| Layer {
        n_inputs: ends[0] as u32,
        n_outputs: ends[1] as u32,
        weights: places.take(ends[0] * ends[1]),
        biases: places.take(ends[1]),
        norm: None,
    };
    let mut layers: Vec<Layer> = sizes.windows(2).map(layer).collect();
    if has_norms {
        let n_hidden = layers.len() - 1;
        for layer in &mut layers[..n_hidden] {
            layer.norm = Some([0; 2].map(|_| places.take(layer.n_outputs as usize)));
        }
    }
    (layers, places.0 as usize)
}

/// What dispatches are made from.
struct Shape {
    facts: Facts,
    layers: Vec<Layer>,
    hidden: Vec<Hidden>,
}

impl Shape {
    /// The kernels of an update: the passes forward, what they are worth, the passes back, and the steps.
    fn dispatches(&self) -> Vec<Dispatch> {
        let Facts { n_rows, n_values, n_parameters, .. } = self.facts;
        let all = |kernel: Kernel, n: u32| Dispatch { kernel, of: Of::All, groups: n.div_ceil(WORKGROUP) };
        let mut dispatches = vec![all(Kernel::Gather, n_rows * n_values)];
        for index in 0..self.layers.len() {
            dispatches.push(products(Pass::ALL.iter().map(|&pass| self.forward(pass, index)).collect()));
            dispatches.extend(self.norms(index).map(|norms| Dispatch {
                kernel: Kernel::Normalise,
                of: Of::Norms(norms),
                groups: N_NORMS as u32 * n_rows,
            }));
        }
        dispatches.push(all(Kernel::FindErrors, n_rows));
        dispatches.push(all(Kernel::AddFigures, 1));
        for index in (0..self.layers.len()).rev() {
            let learning = &Pass::ALL[..N_LEARNING];
            let by_weights = learning.iter().map(|&pass| self.by_weights(pass, index));
            let by_inputs = learning.iter().filter_map(|&pass| self.by_inputs(pass, index));
            dispatches.push(products(by_weights.chain(by_inputs).collect()));
            let Some(norms) = index.checked_sub(1).and_then(|below| self.norms(below)) else { continue };
            let width = self.layers[index - 1].n_outputs;
            let critics = N_CRITICS as u32;
            dispatches.push(Dispatch {
                kernel: Kernel::SumNorms,
                of: Of::Norms(norms),
                groups: critics * width.div_ceil(BESIDE),
            });
            dispatches.push(Dispatch { kernel: Kernel::NormaliseBack, of: Of::Norms(norms), groups: critics * n_rows });
        }
        dispatches.push(all(Kernel::MoveParameters, N_LEARNING as u32 * n_parameters));
        dispatches
    }

    /// A pass's inputs of a layer.
    fn inputs(&self, pass: Pass, index: usize) -> u32 {
        match index.checked_sub(1) {
            None => self.facts.observations + u32::from(pass.is_next()) * self.facts.n_rows * self.facts.n_values,
            Some(below) => self.of_pass(pass, below, self.hidden[below].activations),
        }
    }

    /// Numbers of a pass among those of a hidden layer.
    fn of_pass(&self, pass: Pass, index: usize, first: u32) -> u32 {
        first + pass as u32 * self.facts.n_rows * self.layers[index].n_outputs
    }

    /// The gradients by a layer's outputs.
    fn errors(&self, pass: Pass, index: usize) -> u32 {
        self.of_pass(pass, index, self.hidden.get(index).map_or(self.facts.output_errors, |hidden| hidden.errors))
    }

    fn parameter(&self, pass: Pass, place: u32) -> u32 {
        pass.network() * self.facts.n_parameters + place
    }

    fn gradient(&self, pass: Pass, place: u32) -> u32 {
        self.facts.gradients + self.parameter(pass, place)
    }

    fn has_norm(&self, pass: Pass, index: usize) -> bool {
        pass.is_critic() && self.layers[index].norm.is_some()
    }

    /// A layer's outputs: sums where they are normalised next.
    fn forward(&self, pass: Pass, index: usize) -> Product {
        let layer = &self.layers[index];
        let (result, is_rectified) = match self.hidden.get(index) {
            None => (self.facts.outputs, false),
            Some(hidden) if self.has_norm(pass, index) => (hidden.values, false),
            Some(hidden) => (hidden.activations, true),
        };
        Product {
            is_rectified: is_rectified.into(),
            ..Product::layer(
                [self.facts.n_rows, layer.n_inputs],
                self.inputs(pass, index),
                self.parameter(pass, layer.weights),
                self.parameter(pass, layer.biases),
                [self.of_pass(pass, index, result), layer.n_outputs],
            )
        }
    }

    /// The gradients by a layer's weights: inputs, transposed, times the gradients by outputs. The sums of the latter
    /// are the gradients by its biases.
    fn by_weights(&self, pass: Pass, index: usize) -> Product {
        let layer = &self.layers[index];
        Product {
            n_rows: layer.n_inputs,
            n_columns: layer.n_outputs,
            n_inner: self.facts.n_rows,
            left: self.inputs(pass, index),
            left_row: 1,
            left_inner: layer.n_inputs,
            right: self.errors(pass, index),
            right_inner: layer.n_outputs,
            right_column: 1,
            result: self.gradient(pass, layer.weights),
            sums: self.gradient(pass, layer.biases),
            ..Product::NONE
        }
    }

    /// The gradients by a layer's inputs, where another layer is below: those by outputs times the weights, transposed.
    fn by_inputs(&self, pass: Pass, index: usize) -> Option<Product> {
        let layer = &self.layers[index];
        let below = index.checked_sub(1)?;
        Some(Product {
            n_rows: self.facts.n_rows,
            n_columns: layer.n_inputs,
            n_inner: layer.n_outputs,
            left: self.errors(pass, index),
            left_row: layer.n_outputs,
            left_inner: 1,
            right: self.parameter(pass, layer.weights),
            right_inner: 1,
            right_column: layer.n_outputs,
            result: self.errors(pass, below),
            mask: if self.has_norm(pass, below) { NONE } else { self.inputs(pass, index) },
            ..Product::NONE
        })
    }

    /// The normalisations of a layer, where it has them.
    fn norms(&self, index: usize) -> Option<[Norm; N_NORMS]> {
        let hidden = self.hidden.get(index)?;
        let width = self.layers[index].n_outputs;
        let [scale, shift] = self.layers[index].norm?;
        let normed = [Pass::Critic1, Pass::Critic2, Pass::Target1, Pass::Target2];
        Some(normed.map(|pass| {
            // Nothing reads those of a target critic.
            let learns = (pass as usize) < N_LEARNING;
            let learned = |place: u32| if learns { place } else { NONE };
            Norm {
                n_rows: self.facts.n_rows,
                width,
                values: self.of_pass(pass, index, hidden.values),
                activations: self.of_pass(pass, index, hidden.activations),
                factors: hidden.factors + pass as u32 * self.facts.n_rows,
                errors: if learns { self.errors(pass, index) } else { NONE },
                scale: self.parameter(pass, scale),
                shift: self.parameter(pass, shift),
                by_scale: learned(self.gradient(pass, scale)),
                by_shift: learned(self.gradient(pass, shift)),
                unused: 0,
                unused_too: 0,
            }
        }))
    }
}

/// A dispatch of products.
fn products(each: Vec<Product>) -> Dispatch {
    let (products, groups) = Product::together(each);
    Dispatch { kernel: Kernel::Multiply, of: Of::Products(Box::new(products)), groups }
}
