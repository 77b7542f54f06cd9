//! The twin critics.

use burn::module::Module;

use crate::network::Mlp;

/// Two critics with weights of their own: their errors differ, so that their mean or minimum is less biased than
/// either.
#[derive(Module, Debug, Default)]
pub(super) struct Twins {
    pub(super) first: Mlp,
    pub(super) second: Mlp,
}
