//! An entry of the board: a policy or recorded actions, what it cost to train, and what it claims to come to.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use offtrack::files::reader::{self, Reader, printable, shortened};
use offtrack::scenario::Split;
use serde::Deserialize;

use crate::comparison::Asked;
use crate::error::Error;
use crate::files;
use crate::outcomes::{Outcomes, end_of};

/// Most characters of a row's name.
const LONGEST_NAME: usize = 100;

/// An entry, as its file has it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// The row's name.
    pub name: String,
    /// A policy file beside this one, or a policy that comes with the program: `pursuit`, `random`, a shipped one.
    pub policy: Option<String>,
    /// In place of a policy: a file of recorded actions beside this one.
    pub actions: Option<PathBuf>,
    /// Where code, or a description, is.
    pub link: Option<String>,
    /// Commit of the program with which it was trained or driven.
    pub commit: Option<String>,
    /// What it cost; `None` for a policy that was not trained.
    pub training: Option<Training>,
    /// Where it is reported.
    pub home: Drive,
    /// The same policy where it was not trained for.
    pub elsewhere: Option<Drive>,
}

/// What training cost.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Env steps.
    pub env_steps: u64,
    /// Time (min).
    pub minutes: f64,
    /// Cores, of a processor.
    pub cores: u32,
}

/// An evaluation that an entry names.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// The benchmark's name, or its file beside the entry.
    pub benchmark: String,
    /// The routes that are driven.
    #[serde(default = "test")]
    pub split: Split,
    /// Seed of the starts.
    #[serde(default)]
    pub seed: u32,
    /// Episodes on each route.
    pub episodes: usize,
    /// What it comes to; `None` in an entry that is being made.
    pub claim: Option<Claim>,
}

fn test() -> Split {
    Split::Test
}

/// What an evaluation comes to, to the last bit.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// As in [`Outcomes`].
    pub digest: String,
    /// Episodes that arrived.
    pub arrived: usize,
    /// The letters of the ends of each route's episodes.
    pub ends: BTreeMap<String, String>,
}

impl Entry {
    /// Reads an entry.
    ///
    /// # Errors
    ///
    /// A file that is none, with key, value and what would do.
    pub fn read(file: &Path) -> Result<Entry, Error> {
        let (reader, entry): (Reader, Entry) = Reader::read(file)?;
        if entry.name.trim().is_empty() {
            return Err(reader.invalid("name", "\"\"", "the row's name is needed").into());
        }
        if LONGEST_NAME < entry.name.chars().count() || *printable(&entry.name) != *entry.name {
            let expected =
                format!("must have at most {LONGEST_NAME} characters that can be seen: it is a table's cell");
            return Err(reader.invalid("name", format_args!("{:?}", shortened(&entry.name, 40)), expected).into());
        }
        match (&entry.policy, &entry.actions) {
            (None, None) => return Err(reader.invalid("policy", "missing", "`policy` or `actions` is needed").into()),
            (Some(policy), Some(_)) => {
                return Err(reader.invalid("policy", policy, "leave it out, or `actions`: one of them drives").into());
            }
            (None, Some(actions)) if entry.elsewhere.is_some() => {
                let expected = "recorded actions drive at home alone: leave `elsewhere` out";
                return Err(reader.invalid("actions", actions.display(), expected).into());
            }
            _ => {}
        }
        if let Some(Training { minutes, cores, .. }) = entry.training {
            reader.within("training.minutes", minutes, 0.0..=1e7, "min")?;
            reader.count("training.cores", cores as usize, 1..=1_000_000)?;
        }
        for (key, drive) in [("home", Some(&entry.home)), ("elsewhere", entry.elsewhere.as_ref())] {
            let Some(Drive { episodes, claim, .. }) = drive else { continue };
            reader.count(&format!("{key}.episodes"), *episodes, 1..=100_000)?;
            let unknown = |letters: &String| letters.chars().any(|letter| end_of(letter).is_none());
            let wrong = claim.iter().flat_map(|claim| &claim.ends).find(|(_, letters)| unknown(letters));
            if let Some((route, letters)) = wrong {
                let key = format!("{key}.claim.ends.{route}");
                return Err(reader.invalid(key, letters, "must be letters of `ends` in `evaluate --json`").into());
            }
        }
        Ok(entry)
    }

    /// Adds claims, as [`Claim::toml`] gives them, to the entry in `file`.
    ///
    /// # Errors
    ///
    /// A file to whose tables nothing can be added at its end, or that cannot be written.
    pub fn add(file: &Path, claims: &str) -> Result<(), Error> {
        let text = reader::read_text(file, reader::TEXT_LIMIT)?;
        let text = format!("{}\n{claims}", text.trim_end());
        if let Err(error) = toml::from_str::<Entry>(&text) {
            let message = format!("no claim can be added: {error}; write `home` and `elsewhere` as [tables]");
            return Err(Error::contents(file, message));
        }
        files::write_whole(file, text.as_bytes())
    }

    /// The file of the policy or of the actions, if it is a file: beside `file`, that of the entry.
    pub fn driving_file(&self, file: &Path) -> Option<PathBuf> {
        let own = self.actions.as_deref().or(self.policy.as_deref().map(Path::new))?;
        Some(beside(file, own)).filter(|path| path.is_file() || self.actions.is_some())
    }

    /// What the evaluation of `drive` is asked; `file` is that of the entry.
    pub fn asked(&self, file: &Path, drive: &Drive) -> Asked {
        let own = |name: &String| {
            let path = beside(file, Path::new(name));
            if path.is_file() { path.display().to_string() } else { name.clone() }
        };
        Asked {
            benchmark: own(&drive.benchmark),
            policy: self.policy.as_ref().map(own),
            look_ahead: None,
            line: None,
            load: None,
            route: Vec::new(),
        }
    }
}

/// A path that an entry names, from its own folder.
fn beside(entry: &Path, path: &Path) -> PathBuf {
    entry.parent().unwrap_or(Path::new("")).join(path)
}

impl Claim {
    /// What was simulated differs: the first thing, claimed and simulated.
    pub fn differs(&self, outcomes: &Outcomes) -> Option<String> {
        let arrived = outcomes.arrived();
        if self.arrived != arrived {
            return Some(format!("arrived: {} claimed, {arrived} simulated", self.arrived));
        }
        if self.ends.len() != outcomes.routes.len() {
            let (claimed, simulated) = (self.ends.len(), outcomes.routes.len());
            return Some(format!("ends: of {claimed} routes claimed, of {simulated} simulated"));
        }
        for route in &outcomes.routes {
            let claimed = self.ends.get(&route.name).map_or("", String::as_str);
            if claimed != route.ended {
                let n = claimed.chars().zip(route.ended.chars()).take_while(|(claimed, own)| claimed == own).count();
                let end = |letters: &str| {
                    let letter = letters.chars().nth(n);
                    letter.and_then(end_of).map_or("no episode", offtrack::layout::Ended::name)
                };
                let (claimed, simulated) = (end(claimed), end(&route.ended));
                return Some(format!("ends, {}, episode {n}: {claimed} claimed, {simulated} simulated", route.name));
            }
        }
        let (claimed, simulated) = (&self.digest, &outcomes.digest);
        let other =
            || format!("digest: {claimed} claimed, {simulated} simulated: the ends are equal, and not every bit");
        (claimed != simulated).then(other)
    }

    /// The claim of an evaluation as TOML, under a key.
    pub fn toml(key: &str, outcomes: &Outcomes) -> String {
        let Outcomes { digest, routes, .. } = outcomes;
        let arrived = outcomes.arrived();
        let mut text = format!("\n[{key}.claim]\ndigest = \"{digest}\"\narrived = {arrived}\n\n[{key}.claim.ends]\n");
        // Names and letters need no escapes: a name is quoted as TOML has it.
        text.extend(
            routes.iter().map(|route| format!("{} = \"{}\"\n", toml::Value::from(route.name.as_str()), route.ended)),
        );
        text
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::outcomes::tests::outcomes;

    pub(in super::super) const ENTRY: &str =
        "name = \"a\"\npolicy = \"pursuit\"\n[home]\nbenchmark = \"b\"\nepisodes = 2\n";

    fn read(text: &str) -> Result<Entry, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("entry.toml");
        std::fs::write(&file, text).unwrap();
        Entry::read(&file).map_err(|error| error.to_string())
    }

    #[test]
    fn a_claim_is_read_back_and_what_differs_is_named_by_route_and_episode_or_by_key() {
        let simulated = outcomes(&[".t", ".."]);
        let claim = read(&(ENTRY.to_owned() + &Claim::toml("home", &simulated))).unwrap().home.claim.unwrap();
        assert_eq!((claim.arrived, claim.differs(&simulated)), (3, None));
        let differs = |change: fn(&mut Outcomes)| {
            let mut other = simulated.clone();
            change(&mut other);
            claim.differs(&other).unwrap()
        };
        assert_eq!(differs(|other| other.routes[0].ended = "..".into()), "arrived: 3 claimed, 4 simulated");
        assert_eq!(
            differs(|other| other.routes[0].ended = "a.".into()),
            "ends, 16/N-left-1, episode 0: arrived claimed, trailer_collided simulated"
        );
        assert!(differs(|other| other.digest = "0".into()).starts_with("digest: 01234567 claimed, 0 simulated"));
        assert!(differs(|other| other.routes[1].name = "c".into()).contains("c, episode 0: no episode claimed"));
        assert!(differs(|other| other.routes.truncate(1)).starts_with("arrived: 3 claimed, 1"));
    }

    #[test]
    fn a_claim_that_an_entry_cannot_hold_is_refused_and_the_file_is_left_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("entry.toml");
        let inline = "name = \"a\"\npolicy = \"pursuit\"\nhome = { benchmark = \"b\", episodes = 2 }\n";
        std::fs::write(&file, inline).unwrap();
        let said = Entry::add(&file, &Claim::toml("home", &outcomes(&[".t"]))).unwrap_err().to_string();
        assert!(said.contains("entry.toml: no claim can be added") && said.contains("as [tables]"), "{said}");
        assert_eq!(std::fs::read_to_string(&file).unwrap(), inline);
    }

    #[test]
    fn an_entry_that_cannot_drive_is_refused_by_key() {
        assert!(read(ENTRY).is_ok());
        let refused = |text: &str, expected: &str| {
            let said = read(text).unwrap_err();
            assert!(said.contains("entry.toml") && said.contains(expected), "{said}");
        };
        refused(&ENTRY.replace("policy = \"pursuit\"\n", ""), "policy: missing; `policy` or `actions` is needed");
        refused(&ENTRY.replace("[home]", "actions = \"b\"\n[home]"), "policy: pursuit; leave it out, or `actions`");
        refused(&ENTRY.replace("episodes = 2", "episodes = 0"), "home.episodes: 0; must lie in 1..100000");
        refused(&(ENTRY.to_owned() + "split = \"all\"\n"), "home: unknown variant `all`, expected one of `train`");
        refused(&(ENTRY.to_owned() + "stars = 5\n"), "stars");
        let claim = "[home.claim]\ndigest = \"\"\narrived = 0\nends = { a = \"x\" }\n";
        refused(&(ENTRY.to_owned() + claim), "home.claim.ends.a: x; must be letters");
        let training = "[training]\nenv_steps = 1\nminutes = -1.0\ncores = 1\n";
        refused(&(ENTRY.to_owned() + training), "training.minutes");
    }
}
