//! What can go wrong while learning, above what can go wrong while evaluating
//! ([`offtrack_evaluation::error::Error`]), which has files and settings.

use std::path::Path;

/// Why training stopped. [`Error::is_wrong_input`] tells wrong input from a failure.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file, a setting, a world, a batch, threads or an evaluation.
    #[error(transparent)]
    Evaluation(offtrack_evaluation::error::Error),
    /// The graphics device failed, or cannot do what the learner needs of it.
    #[error("the graphics device: {0}")]
    Device(String),
    /// Training has diverged.
    #[error(
        "{what} is {value} after {env_steps} env steps{also}: training has diverged; {kept}; lower learning rates or a \
        smaller reward_scale would do"
    )]
    Diverged {
        /// Which figure or parameter.
        what: String,
        /// Value of the figure or parameter, no number.
        value: f32,
        /// Env steps taken.
        env_steps: u64,
        /// Where else it shows.
        also: String,
        /// What there is to go back to.
        kept: String,
    },
}

/// Errors of an evaluation, and all that it makes its own: those of files, policies, worlds, batches and threads.
impl<E: Into<offtrack_evaluation::error::Error>> From<E> for Error {
    fn from(error: E) -> Error {
        Error::Evaluation(error.into())
    }
}

impl Error {
    /// Whether the input was wrong: a file, a setting or a batch asked for. Otherwise something failed on valid input:
    /// a device, a disk, or the learner.
    pub fn is_wrong_input(&self) -> bool {
        matches!(self, Error::Evaluation(error) if error.is_wrong_input())
    }

    /// Whether a graphics device failed.
    pub fn is_device_failure(&self) -> bool {
        match self {
            Error::Device(_) => true,
            Error::Evaluation(error) => error.is_device_failure(),
            Error::Diverged { .. } => false,
        }
    }

    /// A setting is out of range or unknown; `expected` says what is allowed.
    pub fn setting(name: &'static str, value: impl Into<String>, expected: impl Into<String>) -> Error {
        let (value, expected) = (value.into(), expected.into());
        offtrack_evaluation::error::Error::Setting { name, value, expected }.into()
    }

    /// A file has wrong contents.
    pub fn contents(file: &Path, message: impl Into<String>) -> Error {
        offtrack_evaluation::error::Error::contents(file, message).into()
    }

    /// For `map_err` on a file being written.
    pub fn write(file: &Path) -> impl FnOnce(std::io::Error) -> Error {
        let error = offtrack_evaluation::error::Error::write(file);
        move |source| error(source).into()
    }

    /// For `map_err` on a file being read.
    pub fn read(file: &Path) -> impl FnOnce(std::io::Error) -> Error {
        let error = offtrack_evaluation::error::Error::read(file);
        move |source| error(source).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_setting_is_wrong_input_and_what_fails_on_valid_input_is_not() {
        let full = Error::write(Path::new("a"))(std::io::Error::from(std::io::ErrorKind::StorageFull));
        let diverged = Error::Diverged {
            what: "critic_loss".to_owned(),
            value: f32::NAN,
            env_steps: 1,
            also: String::new(),
            kept: String::new(),
        };
        for failed in [full, diverged, Error::Device("is lost".to_owned())] {
            assert!(!failed.is_wrong_input(), "{failed}");
        }
        assert!(Error::setting("--name", "", "a name is needed").is_wrong_input());
        assert!(Error::Device("is lost".to_owned()).is_device_failure());
        assert!(!Error::contents(Path::new("a"), "is wrong").is_device_failure());
    }
}
