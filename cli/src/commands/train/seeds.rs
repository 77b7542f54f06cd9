//! `train --seeds`: several seeds of one training file, one after another, each in its own folder, and what they came
//! to together.
//!
//! The same command goes on where it was stopped: a seed that has finished is kept, one that was begun is resumed.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use offtrack::files::reader::{read_text, shown_path};
use offtrack_evaluation::files;
use offtrack_evaluation::seeds::{SeedReport, Seeds};
use offtrack_learner::config::Config;
use offtrack_learner::error::Error;
use offtrack_learner::run::folder::{self, Folder};
use offtrack_learner::run::resume::Resumed;
use serde::Deserialize;

use super::{Args, Manner, Opened, Prepared, read, stop_flag, train};

/// Most seeds of a command.
const MOST: usize = 1000;
/// Most bytes of a report.
const REPORT_LIMIT: u64 = 64 << 20;

/// The folder with a folder for each seed.
struct Group(PathBuf);

/// What is read of an earlier `seeds.json`.
#[derive(Deserialize)]
struct Earlier {
    seeds: Vec<u32>,
}

/// Trains the seeds that `text` names.
pub fn run(args: &Args, file: &Path, text: &str) -> Result<(), Error> {
    let seeds = parsed(text)?;
    let (config, worlds) = read(args, file, seeds.len())?;
    let of_seed = |seed: u32| Config { seed, ..config.clone() };
    let runs = args.out.clone().unwrap_or_else(|| PathBuf::from("runs"));
    let earlier = args.name.as_ref().map(|name| Group(runs.join(name))).filter(|group| group.file().is_file());
    if let Some(group) = &earlier {
        group.check(text, &seeds, &config)?;
    }
    let next = match &earlier {
        Some(group) => group.unfinished(&seeds)?,
        None => seeds.first().copied(),
    };
    // All that can be wrong with the input is found before a folder is made.
    let mut prepared = next.map(|seed| Prepared::new(&of_seed(seed), &worlds)).transpose()?;
    let group = match earlier {
        Some(group) => group,
        None => Group(folder::make(&runs, args.name.as_deref(), file)?),
    };
    group.write(&seeds)?;
    let stop = stop_flag();
    for (index, &seed) in seeds.iter().enumerate() {
        if 0 < stop.load(Ordering::Relaxed) {
            break;
        }
        if group.finished(seed)?.is_some() {
            continue;
        }
        let config = of_seed(seed);
        let prepared = match prepared.take() {
            Some(prepared) => prepared,
            None => Prepared::new(&config, &worlds)?,
        };
        let opened = group.open(seed, file, &config)?;
        let label = format!("seed {seed}, {} of {}: ", index + 1, seeds.len());
        train(
            &config,
            &worlds,
            prepared,
            opened,
            &Manner { label: Some(label), tensorboard: args.tensorboard },
            &stop,
        )?;
        group.write(&seeds)?;
    }
    let finished = group.all_finished(&seeds)?;
    let table = if finished.is_empty() { String::new() } else { Seeds::of(&seeds, &finished).table() + "\n" };
    let (path, n, all) = (shown_path(&group.0), finished.len(), seeds.len());
    Ok(files::print(&match n == all {
        true => format!("{table}written: {path}\n"),
        false => format!(
            "{table}stopped: {n} of {all} seeds have finished; the same command with --name {} continues\n",
            group.name()
        ),
    })?)
}

/// The seeds that `20..24` (both included) or `3,7,9` names.
fn parsed(text: &str) -> Result<Vec<u32>, Error> {
    let wrong = |expected: String| Error::setting("--seeds", text, expected);
    let form = || {
        wrong("a range as in 20..24, both included, or numbers separated by commas, as in 3,7,9, are needed".to_owned())
    };
    let seed = |word: &str| word.trim().parse::<u32>().map_err(|_| form());
    let many = || wrong(format!("at most {MOST} seeds are trained by one command"));
    let mut seeds: Vec<u32> = Vec::new();
    for part in text.split(',') {
        let (first, last) = match part.split_once("..") {
            Some((first, last)) => (seed(first)?, seed(last)?),
            None => (seed(part)?, seed(part)?),
        };
        if last < first {
            return Err(form());
        }
        if MOST as u64 <= u64::from(last - first) + seeds.len() as u64 {
            return Err(many());
        }
        seeds.extend(first..=last);
    }
    match seeds.iter().enumerate().find(|(index, seed)| seeds[..*index].contains(seed)) {
        Some((_, twice)) => Err(wrong(format!("seed {twice} stands there twice: name it once"))),
        None => Ok(seeds),
    }
}

impl Group {
    fn name(&self) -> String {
        self.0.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    }

    fn file(&self) -> PathBuf {
        self.0.join("seeds.json")
    }

    fn folder_name(seed: u32) -> String {
        format!("seed-{seed}")
    }

    fn folder(&self, seed: u32) -> PathBuf {
        self.0.join(Group::folder_name(seed))
    }

    /// Whether a command with these seeds and this training file, whatever its seed, can go on in this folder.
    fn check(&self, text: &str, seeds: &[u32], config: &Config) -> Result<(), Error> {
        let file = self.file();
        let earlier: Earlier = serde_json::from_str(&read_text(&file, REPORT_LIMIT)?).map_err(|error| {
            Error::contents(&file, format!("{error}; it must be as `train --seeds` has written it"))
        })?;
        if let Some(missing) = earlier.seeds.iter().find(|seed| !seeds.contains(seed)) {
            let expected =
                format!("{} has seed {missing} too: name it as well, or choose another --name", self.0.display());
            return Err(Error::setting("--seeds", text, expected));
        }
        for &seed in seeds {
            let file = self.folder(seed).join("config.toml");
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
        let file = self.folder(seed).join("report.json");
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
        if path.join("config.toml").is_file() {
            return Ok(Opened::resumed(Resumed::open(&path, None, None)?, false));
        }
        // A run that was killed as it made its folder left it empty.
        let _ = std::fs::remove_dir(&path);
        Opened::new(Folder::create(&self.0, Some(&Group::folder_name(seed)), file, config)?)
    }
}

#[cfg(test)]
mod tests {
    use super::parsed;

    #[test]
    fn seeds_are_ranges_with_both_ends_and_lists() {
        let seeds = |text: &str| parsed(text).map_err(|error| error.to_string());
        assert_eq!(seeds("20..24"), Ok(vec![20, 21, 22, 23, 24]));
        assert_eq!(seeds("3, 7,9..10,4294967295"), Ok(vec![3, 7, 9, 10, 4_294_967_295]));
        assert_eq!(seeds("5..5"), Ok(vec![5]));
        for wrong in ["", "24..20", "1..", "..3", "1...3", "-1", "4294967296", "1,,2", "a"] {
            let message = seeds(wrong).unwrap_err();
            assert!(message.contains(&format!("--seeds: {wrong}; a range as in 20..24")), "{message}");
        }
        assert!(seeds("1..3,2").unwrap_err().contains("seed 2 stands there twice"));
        assert!(seeds("0..1000").unwrap_err().contains("at most 1000 seeds") && seeds("0..999").is_ok());
        assert!(seeds("0..4294967295").unwrap_err().contains("at most 1000 seeds"));
    }
}
