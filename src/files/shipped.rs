//! The scenario files that come with the library: every TOML file under `scenarios/`, embedded, so that a name finds
//! the same file wherever the program runs.
//!
//! An embedded file refers to others by relative path, as a file on disk does; such a path is resolved among the
//! embedded files.

use std::fmt;
use std::path::{Component, Path, PathBuf};

use crate::files::reader::{Error, TEXT_LIMIT, printable, read_text};

/// Pairs of a file's path below `scenarios/` and its text.
macro_rules! embedded {
    ($($path:literal),* $(,)?) => { &[$(($path, include_str!(concat!("../../scenarios/", $path)))),*] };
}

/// Path below `scenarios/` and text of every shipped file.
pub const FILES: &[(&str, &str)] = embedded![
    "attard2023.toml",
    "attard2023-as-run.toml",
    "attard2023-as-run-training.toml",
    "attard2023-continuous.toml",
    "attard2023-full.toml",
    "attard2023-maps.toml",
    "attard2023-maps-as-run.toml",
    "attard2023-maps-full.toml",
    "attard2023-training.toml",
    "distributions/mixed.toml",
    "distributions/wide.toml",
    "laden2026.toml",
    "laden2026-50.toml",
    "laden2026-50-random.toml",
    "laden2026-50-training.toml",
    "laden2026-continuous.toml",
    "laden2026-odd.toml",
    "laden2026-odd-random.toml",
    "laden2026-random.toml",
    "laden2026-training.toml",
    "maps/sumo22.outline.toml",
    "maps/town03-crossing.outline.toml",
    "maps/town03.outline.toml",
    "maps/zala25.outline.toml",
    "maps/zala8.outline.toml",
    "maps2026.toml",
    "maps2026-crossing.toml",
    "random2026.toml",
    "random2026-as-run.toml",
    "random2026-as-run-training.toml",
    "random2026-1000.toml",
    "random2026-10000.toml",
    "random2026-training.toml",
    "roundabouts/16m.toml",
    "roundabouts/20m.toml",
    "roundabouts/32m.toml",
    "roundabouts/40m.toml",
    "roundabouts/50m.toml",
    "roundabouts/16m-maps.toml",
    "roundabouts/20m-maps.toml",
    "roundabouts/32m-maps.toml",
    "roundabouts/40m-maps.toml",
    "roundabouts/50m-maps.toml",
    "traffic2026.toml",
    "traffic2026-random.toml",
    "traffic2026-training.toml",
    "traffic2026-refinement.toml",
    "traffic2026-aggressive.toml",
    "traffic2026-timid.toml",
    "traffic2026-distracted.toml",
    "traffic2026-rude.toml",
    "traffic2026-laden.toml",
    "traffic2026-large.toml",
    "traffic2026-maps.toml",
    "transfer2026.toml",
    "transfer2026-30kmh.toml",
    "transfer2026-50kmh.toml",
    "transfer2026-8kmh.toml",
    "transfer2026-attard2023.toml",
    "transfer2026-held-out.toml",
    "transfer2026-no-slip.toml",
    "transfer2026-no-slip-random.toml",
    "transfer2026-random.toml",
    "transfer2026-refinement.toml",
    "transfer2026-refinement-any-slip.toml",
    "transfer2026-refinement-home.toml",
    "transfer2026-training.toml",
    "vehicles/cn_18m1.toml",
    "vehicles/daf_xf.toml",
    "vehicles/eu_4x2_13m6.toml",
    "vehicles/eu_4x2_13m6_steered.toml",
    "vehicles/eu_6x4_13m6.toml",
    "vehicles/uk_15m5.toml",
    "vehicles/uk_16m5.toml",
    "vehicles/us_wb40.toml",
    "vehicles/us_wb62.toml",
    "vehicles/us_wb67.toml",
];

/// What a scenario file describes. Each kind has a folder of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Roundabouts, routes, vehicle, actions and reward: `scenarios/*.toml`.
    Benchmark,
    /// Ring and arms: `scenarios/roundabouts/*.toml`.
    Roundabout,
    /// Tractor, trailer and loads: `scenarios/vehicles/*.toml`.
    Vehicle,
    /// Ranges of random roundabouts: `scenarios/distributions/*.toml`.
    Distribution,
}

impl Kind {
    /// The word for it in messages.
    pub fn noun(self) -> &'static str {
        match self {
            Kind::Benchmark => "benchmark",
            Kind::Roundabout => "roundabout",
            Kind::Vehicle => "vehicle",
            Kind::Distribution => "distribution",
        }
    }

    /// The kind's folder below `scenarios/`, with the slash that ends it; empty for benchmarks.
    pub fn folder(self) -> &'static str {
        match self {
            Kind::Benchmark => "",
            Kind::Roundabout => "roundabouts/",
            Kind::Vehicle => "vehicles/",
            Kind::Distribution => "distributions/",
        }
    }

    /// The names of the shipped files of this kind: their stems.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        let names = FILES.iter().filter_map(move |(path, _)| path.strip_prefix(self.folder())?.strip_suffix(".toml"));
        names.filter(|name| !name.contains('/'))
    }
}

/// A scenario file: on disk or embedded in the library. Displayed as errors name it, `scenarios/attard2023.toml (built
/// in)`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// A file on disk.
    Disk(PathBuf),
    /// An embedded file, by its path below `scenarios/`.
    Embedded(PathBuf),
    /// A text in memory.
    Text {
        /// What stands in place of a file's stem.
        name: String,
        /// The text.
        text: String,
        /// The folder on disk that its paths are relative to; without one they are those of embedded files below
        /// `scenarios/`, and else relative to the process's folder.
        folder: Option<PathBuf>,
    },
}

impl Source {
    /// The shipped file of this kind and name.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`], which lists the known names.
    pub fn named(kind: Kind, name: &str) -> Result<Source, Error> {
        match kind.names().find(|known| *known == name) {
            Some(name) => Ok(Source::Embedded(format!("{}{name}.toml", kind.folder()).into())),
            None => Err(Error::UnknownName { what: kind.noun(), name: name.to_owned(), known: kind.names().collect() }),
        }
    }

    /// The shipped file of that name, so that names work wherever the program runs; else a file on disk, where
    /// `name_or_path` ends in `.toml` or is the path of a file.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`]. Whether a path can be read is found out by [`Source::text`].
    pub fn find(kind: Kind, name_or_path: &str) -> Result<Source, Error> {
        let path = Path::new(name_or_path);
        let is_path = || path.extension().is_some_and(|extension| extension == "toml") || path.is_file();
        match Source::named(kind, name_or_path) {
            Err(_) if is_path() => Ok(Source::Disk(path.to_owned())),
            found => found,
        }
    }

    /// The file that this one refers to by `path`, relative to its own folder: on disk from a file on disk, embedded
    /// from an embedded one, and from a text as its folder says.
    pub fn relative(&self, path: &Path) -> Source {
        let folder = |file: &Path| file.parent().unwrap_or(Path::new("")).to_owned();
        match self {
            Source::Disk(file) => Source::Disk(folder(file).join(path)),
            Source::Embedded(file) => Source::Embedded(resolved(folder(file), path)),
            Source::Text { folder: Some(folder), .. } => Source::Disk(folder.join(path)),
            Source::Text { folder: None, .. } => {
                let embedded = resolved(PathBuf::new(), path);
                let is_embedded = FILES.iter().any(|(known, _)| Path::new(known) == embedded);
                if is_embedded { Source::Embedded(embedded) } else { Source::Disk(path.to_owned()) }
            }
        }
    }

    /// The file's name without its extension, as results and messages show it.
    pub fn stem(&self) -> String {
        match self {
            Source::Disk(file) | Source::Embedded(file) => {
                file.file_stem().map(|stem| printable(&stem.to_string_lossy()).into_owned()).unwrap_or_default()
            }
            Source::Text { name, .. } => printable(name).into_owned(),
        }
    }

    /// The file's text.
    ///
    /// # Errors
    ///
    /// The errors of [`read_text`] with a limit of [`TEXT_LIMIT`].
    pub fn text(&self) -> Result<String, Error> {
        match self {
            Source::Disk(file) => read_text(file, TEXT_LIMIT),
            Source::Embedded(file) => match FILES.iter().find(|(path, _)| Path::new(path) == file) {
                Some((_, text)) => Ok((*text).to_owned()),
                None => Err(Error::Unreadable { file: self.shown(), source: std::io::ErrorKind::NotFound.into() }),
            },
            Source::Text { text, .. } if TEXT_LIMIT < text.len() as u64 => {
                Err(Error::TooLarge { file: self.shown(), limit: TEXT_LIMIT })
            }
            Source::Text { text, .. } => Ok(text.clone()),
        }
    }

    /// The file's name for errors.
    pub fn shown(&self) -> PathBuf {
        match self {
            Source::Disk(file) => file.clone(),
            Source::Embedded(_) | Source::Text { .. } => self.to_string().into(),
        }
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Source::Disk(file) => file.display().fmt(f),
            Source::Embedded(file) => write!(f, "scenarios/{} (built in)", file.display()),
            Source::Text { name, .. } => write!(f, "{} (a text)", printable(name)),
        }
    }
}

/// The path of `path` from `folder`, without a link followed.
fn resolved(mut folder: PathBuf, path: &Path) -> PathBuf {
    for component in path.components() {
        match component {
            Component::ParentDir => drop(folder.pop()),
            Component::CurDir => {}
            component => folder.push(component),
        }
    }
    folder
}
