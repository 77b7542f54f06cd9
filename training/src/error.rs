//! What can go wrong in a command, and the exit code that says so: 2 for wrong input, 1 for a failure.

use std::path::{Path, PathBuf};

use crate::device;

/// Why a command stopped.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file that was read is wrong: scenario, vehicle, roundabout, or one that cannot be read at all.
    #[error(transparent)]
    Input(#[from] offtrack::reader::Error),
    /// A scenario that no truck could be stepped in.
    #[error(transparent)]
    Scenario(#[from] offtrack::scenario::Invalid),
    /// A batch was asked for that cannot be.
    #[error(transparent)]
    Simulator(#[from] offtrack::simulator::Error),
    /// A command-line argument makes no sense.
    #[error("{flag}: {value}; {expected}")]
    Flag {
        /// The argument's name.
        flag: &'static str,
        /// What was given.
        value: String,
        /// What would do.
        expected: String,
    },
    /// A file that a command was pointed to has wrong contents.
    #[error("{}: {message}", file.display())]
    Contents {
        /// The file.
        file: PathBuf,
        /// What is wrong with it and what would do.
        message: String,
    },
    /// A file that a command was pointed to cannot be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A result cannot be written.
    #[error("{}: cannot be written: {source}", file.display())]
    Write {
        /// The file or folder.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A certificate's sequence does not do what the file says.
    #[error("{}: {route} from ({:+}, {:+}) of the largest start errors: the sequence does not arrive: {ended}", file.display(), start[0], start[1])]
    NotVerified {
        /// The certificate.
        file: PathBuf,
        /// The route.
        route: String,
        /// The start, as shares of the largest errors.
        start: [f32; 2],
        /// How the episode stood at the sequence's end.
        ended: &'static str,
    },
    /// The graphics device failed, or cannot do what the learner needs of it.
    #[cfg(feature = "gpu")]
    #[error("the graphics device: {0}")]
    Device(String),
    /// The learner's threads cannot be started.
    #[error("threads to learn with cannot be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The learner has broken down.
    #[error(
        "{what} is {value} after {env_steps} env steps{also}: the learner has broken down; {kept}; lower learning rates or a smaller reward_scale would do"
    )]
    Diverged {
        /// Which figure or parameter.
        what: String,
        /// Its value, no number.
        value: f32,
        /// Env steps taken.
        env_steps: u64,
        /// Where else it shows.
        also: String,
        /// What there is to go back to.
        kept: String,
    },
}

impl Error {
    /// What the process exits with.
    pub fn exit_code(&self) -> u8 {
        match self {
            error if device::has_failed(error) => 1,
            Error::Write { .. } | Error::Threads(_) | Error::Diverged { .. } | Error::NotVerified { .. } => 1,
            _ => 2,
        }
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
