//! What can be wrong with a policy.

use std::path::PathBuf;

use offtrack::files::reader::{LONGEST_PATH, shortened, shown_path};

/// Most characters of a message about the contents of a file.
const LONGEST_MESSAGE: usize = 600;

/// Why there is no policy, or why it cannot drive in a world.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file cannot be read at all.
    #[error(transparent)]
    Unreadable(#[from] offtrack::files::reader::Error),
    /// The file is not a policy, is damaged, or holds a policy that cannot drive.
    #[error("{}: {}", shown_path(file), shortened(message, LONGEST_MESSAGE))]
    Contents {
        /// The file, or the policy's name.
        file: PathBuf,
        /// What is wrong and what would do.
        message: String,
    },
    /// None of the policies that come with the program can drive in a benchmark.
    #[error(
        "policy: missing; none that comes with the program can drive in {}: give a policy file, NAME.safetensors, or \
         pursuit or random; {why}",
        shortened(benchmark, LONGEST_PATH)
    )]
    NoneFits {
        /// The benchmark.
        benchmark: String,
        /// What the first of them lacks.
        why: String,
    },
    /// No policy of this name comes with the program.
    #[error("policy: {}; the program comes with {}; or give a path", shortened(name, LONGEST_PATH), known.join(", "))]
    UnknownName {
        /// The name that was asked for.
        name: String,
        /// The names of those that do.
        known: Vec<&'static str>,
    },
    /// A device that the policy cannot act on.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Device(#[from] offtrack::gpu::Error),
}

impl Error {
    /// A file has wrong contents.
    pub(crate) fn contents(name: &str, message: &str) -> Error {
        Error::Contents { file: name.into(), message: message.to_owned() }
    }
}
