//! Policies for tractor-trailers in roundabouts: the file that holds one, and the network that drives, in plain Rust.
//!
//! A [`Policy`] is a multilayer perceptron from an observation to one value an action, with all that is needed to drive
//! with it. Those that come with the project are part of the library; one trained elsewhere is a [`Policy`] too, once
//! its weights are in it or in a file as `docs/policies.md` describes it:
//!
//! ```
//! use offtrack::layout::N_VALUES;
//! use offtrack_policy::{Activation, Layer, Normalisation, Policy};
//!
//! # fn main() -> Result<(), offtrack_policy::Error> {
//! let shipped = Policy::shipped("attard2023")?;
//! let layer = |inputs, outputs| Layer { weights: vec![0.01; inputs * outputs], biases: vec![0.0; outputs] };
//! let own = Policy {
//!     name: "mine".into(),
//!     layers: vec![layer(N_VALUES, 64), layer(64, 64), layer(64, shipped.actions.len())],
//!     extras: Vec::new(),
//!     activation: Activation::Tanh,
//!     normalisation: Normalisation::none(N_VALUES),
//!     ..shipped
//! };
//! let read = Policy::from_bytes("mine", &own.to_bytes())?; // checks shapes and values
//! assert_eq!(read.act(&[[0.5; N_VALUES]]), [0]); // all actions are equal here: the first one is taken
//! # Ok(())
//! # }
//! ```
//!
//! One that sees several steps or has recurrent layers remembers. A [`Driver`] keeps what it remembers of each truck:
//!
//! ```
//! use offtrack::layout::{N_EXTRAS, N_VALUES};
//! use offtrack_policy::{Frames, Padding, Policy};
//!
//! # fn main() -> Result<(), offtrack_policy::Error> {
//! let mut policy = Policy::shipped("attard2023")?;
//! policy.frames = Frames { n: 2, padding: Padding::Zero };
//! policy.layers[0].weights = policy.layers[0].weights.repeat(2); // for the last step's values and the one's before
//! let mut driver = policy.driver(3);
//! let observations = [[0.5; N_VALUES]; 3];
//! let actions = driver.act(&[0, 1, 2], &observations, &[[0.0; N_EXTRAS]; 3]);
//! driver.begin(2); // its next observation is the first one of an episode
//! # assert_eq!(actions.len(), 3);
//! # Ok(())
//! # }
//! ```

mod bounds;
mod check;
#[cfg(feature = "gpu")]
pub mod device;
mod driver;
mod error;
mod file;
mod frames;
mod head;
pub mod kernel;
mod network;
mod normalisation;
mod policy;
mod recurrent;
mod selection;

pub use check::SAME_ACTION;
pub use driver::Driver;
pub use error::Error;
pub use file::{KEY, MOST_LAYERS, VERSIONS};
pub use frames::{Frames, Padding};
pub use head::{Head, Squash};
pub use network::{Activation, Layer};
pub use normalisation::{LIMIT, Normalisation};
pub use policy::{Choice, FILE_LIMIT, Policy, drawn, greedy, sampled};
pub use recurrent::{Cell, Gates, Recurrent};
pub use selection::Selection;
