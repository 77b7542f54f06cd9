//! What can go wrong while evaluating: one error type for this crate and for pictures, above those of the
//! simulator's edges ([`offtrack::files::reader::Error`] for files, [`offtrack::simulator::Error`] for batches and
//! devices).
//!
//! Names and values are bounded and made harmless where they are shown, so that none can be forgotten.

use std::path::{Path, PathBuf};

use offtrack::files::reader::{LONGEST_PATH, shortened, shown_path};
#[cfg(feature = "gpu")]
use offtrack::{gpu, simulator};

/// Most characters of a message about the contents of a file.
const LONGEST_MESSAGE: usize = 600;
/// Most characters of what a flag may be.
const LONGEST_EXPECTED: usize = 1000;

/// Why an evaluation or a command stopped. [`Error::is_wrong_input`] tells wrong input from a failure.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read, or is a wrong scenario, vehicle or roundabout.
    #[error(transparent)]
    Input(#[from] offtrack::files::reader::Error),
    /// A policy cannot be read, or cannot drive in the world.
    #[error(transparent)]
    Policy(#[from] offtrack_policy::Error),
    /// No truck could be stepped in this scenario.
    #[error(transparent)]
    Scenario(#[from] offtrack::scenario::Invalid),
    /// No world could be baked.
    #[error(transparent)]
    World(#[from] offtrack::world::Error),
    /// A batch cannot be made or stepped.
    #[error(transparent)]
    Simulator(#[from] offtrack::simulator::Error),
    /// A setting is out of range or unknown: a command-line argument, or a key of the same meaning.
    #[error("{name}: {}; {}", shortened(value, LONGEST_PATH), shortened(expected, LONGEST_EXPECTED))]
    Setting {
        /// The argument's name.
        name: &'static str,
        /// The value given.
        value: String,
        /// What is allowed.
        expected: String,
    },
    /// A file has wrong contents.
    #[error("{}: {}", shown_path(file), shortened(message, LONGEST_MESSAGE))]
    Contents {
        /// The file.
        file: PathBuf,
        /// What is wrong and what would do.
        message: String,
    },
    /// A file of a run cannot be read.
    #[error("{}: cannot be read: {source}", shown_path(file))]
    Read {
        /// The file.
        file: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A result cannot be written.
    #[error("{}: cannot be written: {source}", shown_path(file))]
    Write {
        /// The file or folder.
        file: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// Threads to work with cannot be started: the system does not give as many as the machine has cores, or as
    /// `RAYON_NUM_THREADS` asks for.
    #[error("threads cannot be started: {0}; set RAYON_NUM_THREADS to fewer")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// An action sequence of a certificate does not arrive.
    #[error("{}: {} from ({:+}, {:+}) of the largest start errors: the sequence does not arrive: {ended}", shown_path(file), shortened(route, LONGEST_PATH), start[0], start[1])]
    NotVerified {
        /// The certificate.
        file: PathBuf,
        /// The route.
        route: String,
        /// The start: lateral offset and heading error as fractions of the largest ones.
        start: [f32; 2],
        /// The end code after the last action of the sequence.
        ended: &'static str,
    },
    /// The recorded actions of an episode do not give its end again.
    #[error(
        "{}, episode {episode}: driven again it ends otherwise; leave --avoidable out",
        shortened(route, LONGEST_PATH)
    )]
    NotRepeated {
        /// The route.
        route: String,
        /// Number of the episode among those of its route.
        episode: usize,
    },
}

impl Error {
    /// Whether the input was wrong: a file, a setting or a batch asked for. Otherwise something failed on valid input:
    /// a device, a disk, threads, a certificate, or an episode driven again.
    pub fn is_wrong_input(&self) -> bool {
        let failed = matches!(
            self,
            Error::Write { .. } | Error::Threads(_) | Error::NotVerified { .. } | Error::NotRepeated { .. }
        );
        !failed && !self.is_device_failure()
    }

    /// Whether a graphics device failed.
    pub fn is_device_failure(&self) -> bool {
        match self {
            #[cfg(feature = "gpu")]
            Error::Simulator(simulator::Error::Gpu(gpu::Error::NoAdapter { .. } | gpu::Error::Broken { .. })) => true,
            _ => false,
        }
    }

    /// A file has wrong contents.
    pub fn contents(file: &Path, message: impl Into<String>) -> Error {
        Error::Contents { file: file.to_owned(), message: message.into() }
    }

    /// For `map_err` on a file being written.
    pub fn write(file: &Path) -> impl FnOnce(std::io::Error) -> Error {
        let file = file.to_owned();
        move |source| Error::Write { file, source }
    }

    /// For `map_err` on a file being read.
    pub fn read(file: &Path) -> impl FnOnce(std::io::Error) -> Error {
        let file = file.to_owned();
        move |source| Error::Read { file, source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_file_is_wrong_input_and_a_full_disk_is_not() {
        let wrong = Error::Contents { file: "a".into(), message: "is wrong".into() };
        let full = Error::write(Path::new("a"))(std::io::Error::from(std::io::ErrorKind::StorageFull));
        assert!(wrong.is_wrong_input() && !full.is_wrong_input());
    }
}
