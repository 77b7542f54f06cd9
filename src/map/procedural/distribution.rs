//! A distribution of roads: a file's ranges, and the road that they give for a seed and an index.

use std::path::{Path, PathBuf};

use super::distribution_keys::Keys;
use super::draw::drawn;
use super::draws::Draws;
use super::{RandomRoad, Reason, Refused};
use crate::files::reader::{Error, Reader};
use crate::files::shipped::{Kind, Source};
use crate::map::Road;
use crate::map::parametric::Stage;
use crate::map::parametric::written::Written;

/// Attempts at a road before the distribution is said to give none.
const MOST_ATTEMPTS: u32 = 1000;

/// What random roads look like: ranges and shares of every dimension, and rules that a road must keep.
#[derive(Debug, Clone)]
pub struct Distribution {
    /// The file's stem.
    pub name: String,
    /// Length of the routes before the ring for which start poses keep clear of kerbs (m).
    pub approach: f64,
    /// Length of the routes after the ring (m).
    pub departure: f64,
    file: PathBuf,
    pub(super) text: String,
    keys: Keys,
}

impl Distribution {
    /// Reads a distribution file.
    ///
    /// # Errors
    ///
    /// The file and, for a value that makes no sense, its key, the value and what would do.
    pub fn read(path: &Path) -> Result<Distribution, Error> {
        Distribution::from_source(&Source::Disk(path.to_owned()))
    }

    /// A distribution that comes with the library: `wide`.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`], which lists the known names.
    pub fn named(name: &str) -> Result<Distribution, Error> {
        Distribution::from_source(&Source::named(Kind::Distribution, name)?)
    }

    /// Reads a file where `name_or_path` ends in `.toml` or is the path of a file; else the same as
    /// [`Distribution::named`].
    ///
    /// # Errors
    ///
    /// The errors of [`Distribution::read`] and [`Distribution::named`].
    pub fn find(name_or_path: &str) -> Result<Distribution, Error> {
        Distribution::from_source(&Source::find(Kind::Distribution, name_or_path)?)
    }

    pub(crate) fn from_source(source: &Source) -> Result<Distribution, Error> {
        let (file, text) = (source.shown(), source.text()?);
        let (reader, keys) = Reader::parse::<Keys>(&file, &text)?;
        keys.check(&reader)?;
        let (approach, departure) = (keys.rules.approach, keys.rules.departure);
        Ok(Distribution { name: source.stem(), approach, departure, text, keys, file })
    }

    /// Road `index` of `seed`.
    ///
    /// # Errors
    ///
    /// A distribution of which no draw is a road, with the reasons.
    pub fn road(&self, seed: u32, index: u32) -> Result<RandomRoad, Error> {
        let mut refused = Refused::default();
        for attempt in 0..MOST_ATTEMPTS {
            match self.attempt(seed, index, attempt) {
                Ok((roundabout, written)) => {
                    return Ok(RandomRoad { roundabout, seed, index, attempt, refused, written });
                }
                Err(reason) => refused.note(reason),
            }
        }
        let mut reasons: Vec<Reason> = Reason::ALL.into_iter().filter(|&reason| 0 < refused.count(reason)).collect();
        reasons.sort_by_key(|&reason| std::cmp::Reverse(refused.count(reason)));
        let reasons: Vec<String> =
            reasons.into_iter().map(|reason| format!("{} {}", refused.count(reason), reason.words())).collect();
        let expected = format!("wider ranges or milder rules are needed; refused were {}", reasons.join(", "));
        Err(Reader::of(&self.file).invalid(
            format!("road {index} of seed {seed}"),
            format_args!("none of {MOST_ATTEMPTS} draws is valid"),
            expected,
        ))
    }

    /// The road of one attempt.
    pub(super) fn attempt(&self, seed: u32, index: u32, attempt: u32) -> Result<(Road, Written), Reason> {
        let written = drawn(&self.keys, &Draws { seed, road: index, attempt })?;
        let name = format!("{}/{seed}/{index}", self.name);
        let roundabout =
            Road::staged(name, Reader::of(&self.file), written.clone(), 0.0).map_err(|(stage, _)| match stage {
                Stage::Values => Reason::Values,
                Stage::Kerbs => Reason::Kerbs,
                Stage::Lanes => Reason::Lanes,
                Stage::Clear => Reason::LaneNearKerb,
                Stage::Beside => Reason::LanesTooNear,
            })?;
        self.keys.rules.keeps(&roundabout)?;
        Ok((roundabout, written))
    }

    /// The distribution's rules, for tests of the roads drawn.
    #[cfg(test)]
    pub(super) fn rules(&self) -> &super::distribution_keys::Rules {
        &self.keys.rules
    }
}
