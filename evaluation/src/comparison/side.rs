//! The files that are compared, as `offtrack evaluate --json` writes them, and whether they are of the same starts.

use std::path::{Path, PathBuf};

use offtrack::files::reader;
use offtrack::layout::Ended;
use offtrack::scenario::Split;
use serde::{Deserialize, Serialize};

use super::Figure;
use crate::error::Error;
use crate::interval::Cells;
use crate::outcomes::Outcomes;

/// Most bytes of a file: that of 100,000 routes.
const FILE_LIMIT: u64 = 256 << 20;

/// What `evaluate` was asked, as far as its episodes depend on it and the outcomes do not have it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Asked {
    /// The benchmark, as it was given.
    pub benchmark: String,
    /// The policy, as it was given; `None` for that of the benchmark.
    #[serde(default)]
    pub policy: Option<String>,
    /// Look-ahead distance of pure pursuit, where it was given (m).
    #[serde(default)]
    pub look_ahead: Option<f64>,
    /// The certificate whose paths pure pursuit followed.
    #[serde(default)]
    pub line: Option<PathBuf>,
    /// The one load.
    #[serde(default)]
    pub load: Option<String>,
    /// The routes or roads that the split was narrowed to.
    #[serde(default)]
    pub route: Vec<String>,
}

/// An evaluation's file, as far as it is compared.
#[derive(Debug, Clone, Deserialize)]
pub struct Evaluated {
    /// The benchmark's name.
    pub benchmark: String,
    /// The routes that are driven.
    pub split: Split,
    /// Name of the policy.
    pub policy: String,
    /// Seed of the starts.
    pub seed: u32,
    /// What was asked.
    pub asked: Asked,
    /// Each episode.
    pub outcomes: Outcomes,
}

impl Evaluated {
    /// Reads a file of `evaluate --json`.
    ///
    /// # Errors
    ///
    /// A file that is none of these, or one that was written before they had outcomes.
    pub fn read(file: &Path) -> Result<Evaluated, Error> {
        let again = "write it with `offtrack evaluate --json`";
        let text = reader::read_text(file, FILE_LIMIT)?;
        let wrong = |what: String| Error::contents(file, format!("{what}; {again}"));
        let value: serde_json::Value = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        if let Some(key) = ["outcomes", "asked"].into_iter().find(|&key| value.get(key).is_none()) {
            if value.get("runs").is_some() {
                let what = "is the table of a training's seeds: evaluate the policy.safetensors of each";
                return Err(Error::contents(file, format!("{what} with `offtrack evaluate --json`")));
            }
            return Err(wrong(match value.get("evaluation") {
                Some(_) => "is the report of a training run, which has no outcomes of single episodes".to_owned(),
                None => format!("{key}: is missing, as in reports of earlier versions"),
            }));
        }
        // From the text: its message has line and column.
        let evaluated: Evaluated = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        match evaluated.outcomes.fault() {
            Some(fault) => Err(wrong(format!("outcomes, {fault}"))),
            None => Ok(evaluated),
        }
    }

    /// The first thing in which the starts of two evaluations differ: key, value there and value here.
    fn differs(&self, other: &Evaluated) -> Option<(&'static str, String, String)> {
        let [own, others] = [self, other].map(|evaluated| &evaluated.outcomes);
        let texts = [
            ("benchmark", self.benchmark.clone(), other.benchmark.clone()),
            ("split", self.split.name().to_owned(), other.split.name().to_owned()),
            ("seed", self.seed.to_string(), other.seed.to_string()),
            ("episodes on each route", own.episodes.to_string(), others.episodes.to_string()),
            ("routes", own.routes.len().to_string(), others.routes.len().to_string()),
        ];
        let text = texts.into_iter().find(|(_, own, other)| own != other);
        let route = || {
            let mut pairs = own.routes.iter().zip(&others.routes);
            let (own, other) = pairs.find(|(own, other)| own.name != other.name)?;
            Some(("routes", own.name.clone(), other.name.clone()))
        };
        let world = || {
            let differs = own.world != others.world || own.step != others.step;
            differs.then(|| ("world (roads, vehicles, actions, reward)", own.world.clone(), others.world.clone()))
        };
        let class = || {
            let mut pairs = own.routes.iter().zip(&others.routes);
            let (own, _) = pairs.find(|(a, b)| a.class != b.class || own.classes != others.classes)?;
            Some(("vehicles of the starts on the route", own.name.clone(), own.name.clone()))
        };
        text.or_else(route).or_else(world).or_else(class)
    }
}

/// The evaluation of a policy, or those of several training seeds.
#[derive(Debug, Clone)]
pub struct Side {
    /// The stem of the file, or the name of the folder; the whole path where several would have the same.
    pub name: String,
    /// The files, sorted by name; at least one.
    pub files: Vec<(PathBuf, Evaluated)>,
    /// Whether each episode arrived, `[files][starts]`.
    pub(super) arrived: Vec<Vec<bool>>,
}

impl Side {
    /// Reads several sides: each a file, or a folder whose files `*.json` are those of several training seeds.
    ///
    /// # Errors
    ///
    /// Fewer than two sides, a file that cannot be compared, or files of different starts.
    pub fn read_all(paths: &[PathBuf]) -> Result<Vec<Side>, Error> {
        if paths.len() < 2 {
            let value = paths.first().map(|path| path.display().to_string()).unwrap_or_default();
            return Err(Error::Setting { name: "SIDE", value, expected: "two or more are compared".into() });
        }
        let mut sides = paths.iter().map(|path| Side::read(path)).collect::<Result<Vec<Side>, Error>>()?;
        let names: Vec<String> = sides.iter().map(|side| side.name.clone()).collect();
        for (side, path) in sides.iter_mut().zip(paths) {
            if 1 < names.iter().filter(|name| **name == side.name).count() {
                side.name = path.display().to_string();
            }
        }
        let mut files = sides.iter().flat_map(|side| &side.files);
        if let Some((first, expected)) = files.next() {
            for (file, evaluated) in files {
                if let Some((key, own, other)) = evaluated.differs(expected) {
                    let first = reader::shown_path(first);
                    let message = format!("{key}: {own}; {first} has {other}: starts are paired where all is equal");
                    return Err(Error::contents(file, message));
                }
            }
        }
        Ok(sides)
    }

    fn read(path: &Path) -> Result<Side, Error> {
        let mut files = vec![path.to_owned()];
        if path.is_dir() {
            let entries = std::fs::read_dir(path).and_then(|entries| entries.collect::<Result<Vec<_>, _>>());
            let entries = entries.map_err(Error::read(path))?.into_iter().map(|entry| entry.path());
            files = entries.filter(|file| file.extension().is_some_and(|ending| ending == "json")).collect();
            files.sort();
        }
        if files.is_empty() {
            return Err(Error::contents(path, "has no file *.json; a folder has one for each training seed"));
        }
        let name = if path.is_dir() { path.file_name() } else { path.file_stem() };
        let name = name.map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
        let read = |file: PathBuf| Evaluated::read(&file).map(|evaluated| (file, evaluated));
        let files = files.into_iter().map(read).collect::<Result<Vec<_>, _>>()?;
        for (index, (file, evaluated)) in files.iter().enumerate() {
            let is_same = |(_, other): &&(PathBuf, Evaluated)| other.outcomes == evaluated.outcomes;
            if let Some((other, _)) = files[..index].iter().find(is_same) {
                let other = reader::shown_path(other);
                let message = format!("is the evaluation that {other} is: a folder has one for each training seed");
                return Err(Error::contents(file, message));
            }
        }
        Ok(Side::new(name, files))
    }

    /// A side of these files.
    pub(super) fn new(name: String, files: Vec<(PathBuf, Evaluated)>) -> Side {
        let arrived = |(_, evaluated): &(PathBuf, Evaluated)| {
            let ends = evaluated.outcomes.routes.iter().flat_map(|route| route.each_end());
            ends.map(|ended| ended == Ended::Arrived).collect()
        };
        Side { arrived: files.iter().map(arrived).collect(), name, files }
    }

    /// The outcomes of a file.
    pub fn outcomes(&self, file: usize) -> &Outcomes {
        &self.files[file].1.outcomes
    }

    /// A figure of the episodes of these routes that are counted: by file, and by index of the start. Routes without
    /// such an episode are left out: nothing is drawn from them.
    pub(super) fn cells(&self, figure: Figure, routes: &[usize], counts: impl Fn(usize, usize) -> bool) -> Cells {
        // All files have the same starts.
        let episodes = self.outcomes(0).episodes;
        let is_counted = |&&route: &&usize| {
            (0..self.files.len()).any(|file| (0..episodes).any(|episode| counts(file, route * episodes + episode)))
        };
        let routes: Vec<usize> = routes.iter().filter(is_counted).copied().collect();
        let mut cells = Cells::new(self.files.len(), routes.len());
        for (file, (_, Evaluated { outcomes, .. })) in self.files.iter().enumerate() {
            for (index, &route) in routes.iter().enumerate() {
                for episode in 0..outcomes.episodes {
                    let start = route * outcomes.episodes + episode;
                    let of = &outcomes.routes[route];
                    let value = || match figure {
                        Figure::Success => f64::from(u8::from(self.arrived[file][start])),
                        Figure::LaneDistance => of.lane_distance[episode],
                        Figure::Time => outcomes.step * f64::from(of.steps[episode]),
                        Figure::Clearance => of.clearance[episode],
                        Figure::LoadTransferRatio => of.load_transfer_ratio[episode],
                    };
                    if counts(file, start) {
                        cells.add(file, index, value());
                    }
                }
            }
        }
        cells
    }
}
