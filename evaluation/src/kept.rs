//! The policies that a training run keeps on its way, in `policies/` in its folder: a file each, and a list of them.
//!
//! What a policy was after so many env steps shows how it learned. The learner writes them; commands read them without
//! it.

use std::path::{Path, PathBuf};

use offtrack::files::reader::read_bytes;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::run_file::RunFile;

/// Most policies that a run keeps.
pub const MOST: usize = 16;
/// Most bytes of the list.
const LIST_LIMIT: u64 = 1 << 20;

/// A policy that was kept, as the list has it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    /// Env steps made until then.
    pub env_steps: u64,
    /// Training time until then (s).
    pub seconds: f64,
    /// Fraction of the episodes that arrived in its validation; none where it had none.
    pub validation: Option<f64>,
}

impl Kept {
    /// Its file in the folder of a run. Names sort as their env steps do.
    pub fn file(&self, run: &Path) -> PathBuf {
        folder(run).join(format!("{:012}.safetensors", self.env_steps))
    }
}

/// Where the run in this folder keeps them.
pub fn folder(run: &Path) -> PathBuf {
    run.join("policies")
}

/// The policies that the run in this folder keeps, by their env steps.
///
/// # Errors
///
/// No list, or one that is damaged.
pub fn read(run: &Path) -> Result<Vec<Kept>, Error> {
    let file = RunFile::Kept.of(run);
    let wrong = |what: String| {
        let would_do = format!("put a copy of it back, or remove {} to go without", folder(run).display());
        Error::contents(&file, format!("is not the list of a run's policies, or is damaged: {what}; {would_do}"))
    };
    let kept: Vec<Kept> =
        serde_json::from_slice(&read_bytes(&file, LIST_LIMIT)?).map_err(|error| wrong(error.to_string()))?;
    if MOST < kept.len() {
        return Err(wrong(format!("it names {} policies, and a run keeps at most {MOST}", kept.len())));
    }
    if !kept.is_sorted_by(|a, b| a.env_steps < b.env_steps) {
        return Err(wrong("its env_steps do not increase".to_owned()));
    }
    for Kept { env_steps, seconds, validation } in &kept {
        if !(0.0..=1.0).contains(&validation.unwrap_or_default()) || seconds.is_sign_negative() {
            return Err(wrong(format!("after {env_steps} env steps, validation must lie in 0..1, seconds above 0")));
        }
    }
    Ok(kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files;

    fn kept(env_steps: u64) -> Kept {
        Kept { env_steps, seconds: 0.5, validation: None }
    }

    /// What is said of a list with this text.
    fn refused(text: &str) -> String {
        let run = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder(run.path())).unwrap();
        std::fs::write(RunFile::Kept.of(run.path()), text).unwrap();
        read(run.path()).unwrap_err().to_string()
    }

    #[test]
    fn a_list_is_read_as_it_was_written_and_names_files_in_their_order() {
        let run = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder(run.path())).unwrap();
        let written = [kept(400), Kept { validation: Some(0.25), ..kept(1_000_000_000_000) }];
        files::write_json(&RunFile::Kept.of(run.path()), &written).unwrap();
        assert_eq!(read(run.path()).unwrap(), written);
        assert!(written.map(|kept| kept.file(run.path())).is_sorted());
    }

    #[test]
    fn a_list_that_no_run_writes_is_refused_with_its_file_and_what_would_do() {
        let many: Vec<Kept> = (0..=MOST as u64).map(kept).collect();
        for (text, expected) in [
            ("[{", "EOF"),
            (r#"[{"env_steps": 1, "seconds": 1, "validation": null, "file": "../x"}]"#, "unknown field `file`"),
            (&serde_json::to_string(&many).unwrap(), "17 policies, and a run keeps at most 16"),
            (&serde_json::to_string(&[kept(5), kept(5)]).unwrap(), "do not increase"),
            (r#"[{"env_steps": 7, "seconds": 1, "validation": 1.5}]"#, "after 7 env steps"),
            (r#"[{"env_steps": 7, "seconds": -1, "validation": 0.5}]"#, "after 7 env steps"),
        ] {
            let said = refused(text);
            assert!(said.contains("policies.json: ") && said.contains(expected), "{said}");
            assert!(said.contains("put a copy of it back"), "{said}");
        }
    }
}
