//! Training from a configuration to a report.

pub mod alike;
