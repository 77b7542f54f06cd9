//! Several seeds of one config, one after another, each in its own folder, and what they came to together.
//!
//! The same call goes on where it was stopped: a seed that has finished is kept, one that was begun is resumed.

use std::path::{Path, PathBuf};

use offtrack::files::reader::read_text;
use offtrack_evaluation::files;
use offtrack_evaluation::run_file::RunFile;
use offtrack_evaluation::seeds::{SeedReport, Seeds};
use serde::Deserialize;

use super::event::{Caller, Event};
use super::{Opened, Training};
use crate::config::Config;
use crate::error::Error;
use crate::run::folder::{self, Folder, REPORT_LIMIT};
use crate::run::resume::Resumed;

/// What several seeds came to.
#[derive(Debug)]
pub struct SeedsOutcome {
    /// The folder with a folder for each seed, and `seeds.json`.
    pub folder: PathBuf,
    /// Number of the seeds that have finished; the others were not begun, or were stopped.
    pub n_finished: usize,
    /// The seeds that have finished, compared.
    pub seeds: Seeds,
}

/// The folder with a folder for each seed.
struct Group(PathBuf);

/// What is read of an earlier `seeds.json`.
#[derive(Deserialize)]
struct Earlier {
    seeds: Vec<u32>,
}

impl Training {
    /// Trains these seeds in place of the config's, each in its own folder `seed-N` in the folder `runs/name`; without
    /// a name that of `file`, the training file, with the first free number. The same call with the same name
    /// continues.
    pub fn run_seeds(
        &self,
        seeds: &[u32],
        runs: &Path,
        name: Option<&str>,
        file: &Path,
        caller: Caller,
    ) -> Result<SeedsOutcome, Error> {
        let of_seed = |seed: u32| Config { seed, ..self.config.clone() };
        let earlier = name.filter(|name| folder::is_plain(name)).map(|name| Group(runs.join(name)));
        let earlier = earlier.filter(Group::is_earlier);
        if let Some(group) = &earlier {
            group.check(seeds, &self.config)?;
        }
        let next = match &earlier {
            Some(group) => group.unfinished(seeds)?,
            None => seeds.first().copied(),
        };
        // All that can be wrong with the input is found before a folder is made.
        let mut prepared = next.map(|seed| self.prepare(&of_seed(seed), true)).transpose()?;
        let group = match earlier {
            Some(group) => {
                group.write(seeds)?;
                group
            }
            None => {
                let group = Group(folder::make(runs, name, file)?);
                // An empty folder would only be in the way of the next attempt.
                group.write(seeds).inspect_err(|_| drop(std::fs::remove_dir(&group.0)))?;
                group
            }
        };
        for (index, &seed) in seeds.iter().enumerate() {
            if caller.stops() {
                break;
            }
            if group.finished(seed)?.is_some() {
                continue;
            }
            let config = of_seed(seed);
            let prepared = match prepared.take() {
                Some(prepared) => prepared,
                None => self.prepare(&config, true)?,
            };
            let opened = group.open(seed, file, &config)?;
            caller.tell(Event::Seed { seed, index, n_seeds: seeds.len() });
            self.run(&config, prepared, opened, caller)?;
            group.write(seeds)?;
        }
        let finished = group.all_finished(seeds)?;
        Ok(SeedsOutcome { n_finished: finished.len(), seeds: Seeds::of(seeds, &finished), folder: group.0 })
    }
}

/// Seeds as a message names them: `20..24`, both included, or `3,7,9`.
fn shown(seeds: &[u32]) -> String {
    match seeds {
        [first, .., last] if seeds.windows(2).all(|pair| pair[0].checked_add(1) == Some(pair[1])) => {
            format!("{first}..{last}")
        }
        _ => seeds.iter().map(u32::to_string).collect::<Vec<_>>().join(","),
    }
}

impl Group {
    fn file(&self) -> PathBuf {
        self.0.join("seeds.json")
    }

    fn folder_name(seed: u32) -> String {
        format!("seed-{seed}")
    }

    fn folder(&self, seed: u32) -> PathBuf {
        self.0.join(Group::folder_name(seed))
    }

    /// Whether the folder is of an earlier call: it has `seeds.json` or, if that was lost or could not be written,
    /// nothing but seeds' folders.
    fn is_earlier(&self) -> bool {
        self.file().is_file() || self.seeds_of_folders().is_some()
    }

    /// The seeds whose folders are all that the folder has; none where it has anything else.
    fn seeds_of_folders(&self) -> Option<Vec<u32>> {
        let seed = |entry: std::fs::DirEntry| {
            let (name, path) = (entry.file_name().into_string().ok()?, entry.path());
            let seed = name.strip_prefix("seed-")?.parse().ok()?;
            (path.is_dir() && name == Group::folder_name(seed)).then_some(seed)
        };
        let mut seeds: Vec<u32> =
            std::fs::read_dir(&self.0).ok()?.map(|entry| seed(entry.ok()?)).collect::<Option<_>>()?;
        seeds.sort_unstable();
        Some(seeds)
    }

    /// The seeds of the earlier call.
    fn earlier_seeds(&self) -> Result<Vec<u32>, Error> {
        let file = self.file();
        if let Some(seeds) = self.seeds_of_folders() {
            return Ok(seeds);
        }
        let earlier: Earlier = serde_json::from_str(&read_text(&file, REPORT_LIMIT)?).map_err(|error| {
            Error::contents(&file, format!("{error}; it must be as `train --seeds` has written it"))
        })?;
        Ok(earlier.seeds)
    }

    /// Whether a call with these seeds and this config, whatever its seed, can go on in this folder.
    fn check(&self, seeds: &[u32], config: &Config) -> Result<(), Error> {
        if let Some(missing) = self.earlier_seeds()?.iter().find(|seed| !seeds.contains(seed)) {
            let expected =
                format!("{} has seed {missing} too: name it as well, or choose another --name", self.0.display());
            return Err(Error::setting("--seeds", shown(seeds), expected));
        }
        for &seed in seeds {
            let file = RunFile::Config.of(&self.folder(seed));
            if !file.is_file() {
                continue;
            }
            if let Some((key, before, now)) = Config::read(&file)?.first_difference(&Config { seed, ..config.clone() })
            {
                let message = format!(
                    "{key}: {before}; now it would be {now}: give the same training file and flags, or another --name"
                );
                return Err(Error::contents(&file, message));
            }
        }
        Ok(())
    }

    /// A seed's report if it has been trained and evaluated.
    fn finished(&self, seed: u32) -> Result<Option<SeedReport>, Error> {
        let file = RunFile::Report.of(&self.folder(seed));
        if !file.is_file() {
            return Ok(None);
        }
        let report: SeedReport = serde_json::from_str(&read_text(&file, REPORT_LIMIT)?)
            .map_err(|error| Error::contents(&file, format!("{error}; it must be as `train` has written it")))?;
        Ok(Some(report).filter(|report| !report.interrupted))
    }

    /// The first seed that has yet to be trained or evaluated.
    fn unfinished(&self, seeds: &[u32]) -> Result<Option<u32>, Error> {
        for &seed in seeds {
            if self.finished(seed)?.is_none() {
                return Ok(Some(seed));
            }
        }
        Ok(None)
    }

    fn all_finished(&self, seeds: &[u32]) -> Result<Vec<SeedReport>, Error> {
        seeds.iter().filter_map(|&seed| self.finished(seed).transpose()).collect()
    }

    /// Writes `seeds.json`.
    fn write(&self, seeds: &[u32]) -> Result<(), Error> {
        Ok(files::write_json(&self.file(), &Seeds::of(seeds, &self.all_finished(seeds)?))?)
    }

    /// A seed's folder: a new one, or that of a run that was begun.
    fn open(&self, seed: u32, file: &Path, config: &Config) -> Result<Opened, Error> {
        let path = self.folder(seed);
        if RunFile::Config.of(&path).is_file() {
            return Ok(Resumed::open(&path, None, None)?.into());
        }
        // A run that was killed as it made its folder left it empty.
        let _ = std::fs::remove_dir(&path);
        Opened::new(Folder::create(&self.0, Some(&Group::folder_name(seed)), file, config)?)
    }
}

#[cfg(test)]
mod tests {
    use super::shown;

    #[test]
    fn seeds_are_named_as_a_command_line_would_name_them() {
        assert_eq!(shown(&[20, 21, 22]), "20..22");
        assert_eq!((shown(&[5]), shown(&[3, 7, 9])), ("5".to_owned(), "3,7,9".to_owned()));
        assert_eq!(shown(&[u32::MAX, 0]), "4294967295,0");
    }
}
