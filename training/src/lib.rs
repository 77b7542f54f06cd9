//! Policies for tractor-trailers in roundabouts: learned, loaded, evaluated.

pub mod device; // what steps the trucks
pub mod error;
pub mod evaluation; // how good a policy is
pub mod files; // results, written whole
pub mod learner; // how a policy is learned
pub mod policy; // a policy and its file
pub mod provenance; // machine and commit of a result
