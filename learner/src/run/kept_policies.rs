//! The policies that a run keeps on its way: from its first update on, and from the first validation on at validations
//! alone, whenever its env steps have grown by a factor of about 1.4.
//!
//! So a large budget needs few of them. The first one is kept for ever, and of the others the latest, which begin at
//! about a hundredth of the run.

use std::path::{Path, PathBuf};
use std::time::Instant;

use offtrack_evaluation::kept::{self, Kept, MOST};

use super::progress::ROW_EVERY;
use crate::error::Error;
use crate::run::folder::Folder;
use offtrack_evaluation::files;
use offtrack_evaluation::run_file::RunFile;

/// The policies kept so far.
#[derive(Debug)]
pub struct KeptPolicies {
    run: PathBuf,
    list: Vec<Kept>,
    /// When one could not be written.
    failed: Option<Instant>,
}

impl KeptPolicies {
    /// None yet, of the run in this folder.
    pub fn new(folder: &Folder) -> KeptPolicies {
        KeptPolicies { run: folder.path().to_owned(), list: Vec::new(), failed: None }
    }

    /// The list's file.
    pub fn file(&self) -> PathBuf {
        RunFile::Kept.of(&self.run)
    }

    /// Whether it is time for the next one.
    pub fn is_due(&self, env_steps: u64) -> bool {
        let is_later = self.list.last().is_none_or(|last| half_powers(last.env_steps) < half_powers(env_steps));
        is_later && self.failed.is_none_or(|failed| ROW_EVERY <= failed.elapsed())
    }

    /// Keeps a policy, and lets go of one where there are too many. At any time the files of all that the list names
    /// are there.
    pub fn keep(&mut self, kept: Kept, policy: &[u8]) -> Result<(), Error> {
        let mut list = self.list.clone();
        list.push(kept);
        let dropped = (MOST < list.len()).then(|| list.remove(1));
        let written = self.write(&kept.file(&self.run), policy, &list);
        self.failed = written.is_err().then(Instant::now);
        written?;
        self.list = list;
        if let Some(dropped) = dropped {
            let _ = std::fs::remove_file(dropped.file(&self.run));
        }
        Ok(())
    }

    fn write(&self, file: &Path, policy: &[u8], list: &[Kept]) -> Result<(), Error> {
        let folder = kept::folder(&self.run);
        std::fs::create_dir_all(&folder).map_err(Error::write(&folder))?;
        files::write_whole(file, policy)?;
        Ok(files::write_json(&self.file(), &list).inspect_err(|_| drop(std::fs::remove_file(file)))?)
    }

    /// Continues after so many env steps: what the folder has of a later time will come again.
    pub fn continue_from(&mut self, env_steps: u64) -> Result<(), Error> {
        if !self.file().is_file() {
            return Ok(());
        }
        let mut list = kept::read(&self.run)?;
        list.retain(|kept| kept.env_steps <= env_steps);
        // A list that cannot be written still names files that are there; the next one takes its place.
        if files::write_json(&self.file(), &list).is_ok() {
            self.remove_others(&list);
        }
        self.list = list;
        Ok(())
    }

    /// Removes the policies that are not in the list, which a killed process may have left, too.
    fn remove_others(&self, list: &[Kept]) {
        let entries = std::fs::read_dir(kept::folder(&self.run)).into_iter().flatten().flatten();
        for path in entries.map(|entry| entry.path()) {
            let steps = path.file_stem().and_then(|stem| stem.to_str()?.parse().ok());
            let named = steps.map(|env_steps| Kept { env_steps, seconds: 0.0, validation: None }.file(&self.run));
            let is_listed = list.iter().any(|kept| Some(kept.env_steps) == steps);
            if named.is_some_and(|named| named == path) && !is_listed {
                let _ = std::fs::remove_file(path);
            }
        }
    }
}

/// The number of times that the square root of two is a factor of a number of env steps.
fn half_powers(env_steps: u64) -> u32 {
    u128::from(env_steps.max(1)).pow(2).ilog2()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    fn kept(env_steps: u64) -> Kept {
        Kept { env_steps, seconds: 1.0, validation: None }
    }

    /// Lets a run of 8 trucks go on to so many env steps.
    fn go_on(policies: &mut KeptPolicies, steps: std::ops::RangeInclusive<u64>) {
        for env_steps in steps.step_by(8) {
            if policies.is_due(env_steps) {
                policies.keep(kept(env_steps), &env_steps.to_le_bytes()).unwrap();
            }
        }
    }

    /// Names and bytes of the files.
    fn files(run: &Path) -> Vec<(String, Vec<u8>)> {
        let entries = std::fs::read_dir(kept::folder(run)).unwrap().map(|entry| entry.unwrap().path());
        let read =
            |path: PathBuf| (path.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(&path).unwrap());
        let mut files: Vec<_> = entries.map(read).collect();
        files.sort();
        files
    }

    fn run(place: &Path) -> (Folder, KeptPolicies) {
        let config = Config::read(Path::new("default")).unwrap();
        let folder = Folder::create(place, None, Path::new("default"), &config).unwrap();
        let policies = KeptPolicies::new(&folder);
        (folder, policies)
    }

    #[test]
    fn of_a_long_run_the_first_policy_and_the_latest_ones_are_kept_at_growing_distances_and_no_more() {
        let place = tempfile::tempdir().unwrap();
        let (folder, mut policies) = run(place.path());
        go_on(&mut policies, 400..=1_000_000);
        let list = kept::read(folder.path()).unwrap();
        assert_eq!((list.len(), list[0].env_steps), (MOST, 400));
        for pair in list[1..].windows(2) {
            let grown = pair[1].env_steps as f64 / pair[0].env_steps as f64;
            assert!((1.37..1.46).contains(&grown), "{list:?}");
        }
        assert!(list[1].env_steps < 10_000 && 700_000 < list[MOST - 1].env_steps, "{list:?}");
        assert_eq!(files(folder.path()).len(), MOST + 1);
        assert!(list.iter().all(|kept| kept.file(folder.path()).is_file()));
    }

    #[test]
    fn a_run_that_continues_from_an_earlier_checkpoint_keeps_what_one_never_stopped_keeps() {
        let place = tempfile::tempdir().unwrap();
        let (whole, mut policies) = run(place.path());
        go_on(&mut policies, 400..=300_000);
        let (parts, mut policies) = run(place.path());
        go_on(&mut policies, 400..=200_000);
        for checkpoint in [150_000, 20_000, 0] {
            // A process that was killed between two files leaves one that no list has.
            std::fs::write(kept(401).file(parts.path()), b"half").unwrap();
            let mut policies = KeptPolicies::new(&parts);
            policies.continue_from(checkpoint).unwrap();
            let list = kept::read(parts.path()).unwrap();
            assert!(list.iter().all(|kept| kept.env_steps <= checkpoint), "{list:?}");
            assert_eq!(files(parts.path()).len(), list.len() + 1);
            go_on(&mut policies, checkpoint.max(400)..=300_000);
            assert_eq!(files(parts.path()), files(whole.path()), "from {checkpoint}");
        }
    }

    #[test]
    fn a_policy_that_cannot_be_written_leaves_the_list_as_it_was_and_is_not_tried_again_at_once() {
        let place = tempfile::tempdir().unwrap();
        let (folder, mut policies) = run(place.path());
        go_on(&mut policies, 400..=1000);
        let before = files(folder.path());
        // A folder where the next policy is to be written.
        std::fs::create_dir(kept(2000).file(folder.path())).unwrap();
        let error = policies.keep(kept(2000), b"policy").unwrap_err().to_string();
        assert!(error.contains("000000002000.safetensors: cannot be written"), "{error}");
        assert!(!policies.is_due(4000));
        std::fs::remove_dir(kept(2000).file(folder.path())).unwrap();
        assert_eq!(files(folder.path()), before);
        policies.keep(kept(2000), b"policy").unwrap();
        assert!(policies.is_due(4000));
    }
}
