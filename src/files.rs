//! Files: reading with errors that name file, key and value; results kept for the next time; the scenario files that
//! come with the library; writing whole or not at all.

pub mod cache; // results kept for the next time, and progress
pub mod reader; // errors with file, key, value and what would do
pub mod shipped; // the scenario files that come with the library
pub mod writer; // files written whole or not at all
pub(crate) mod windows_1252; // texts of one byte a character
