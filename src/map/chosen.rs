//! A roundabout from an OpenDRIVE map: which of its rings, and how it is named.

use std::path::Path;

use glam::DVec2;

use super::Road;
use crate::files::reader::{Error, Reader};
use crate::map::opendrive::{Hand, Imported, Map, Options, Ring, Way};

/// Farthest that a point which chooses a ring may lie from its island's edge (m).
pub(super) const FARTHEST: f64 = 100.0;

/// Which ring of a map, and how it is imported.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// A point of the map near the ring; needed where the map has several (m).
    pub ring: Option<DVec2>,
    /// The map's hand of traffic.
    pub hand: Hand,
    /// The roundabout's name; the file's stem without one.
    pub name: Option<String>,
    /// Names of the arms, counter-clockwise from east; by compass without them.
    pub arms: Vec<String>,
    /// Ways through a junction in place of a ring.
    pub ways: Vec<Way>,
}

/// Whether a file is an OpenDRIVE map by its name.
pub fn is_map(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("xodr"))
}

impl Choice {
    /// The ring that is meant.
    ///
    /// # Errors
    ///
    /// A map without a ring, with several where none is chosen, or without one near the point that chooses it.
    pub fn of(&self, file: &Path, map: &Map) -> Result<Ring, Error> {
        let rings = map.rings();
        let listed = || {
            let centres = rings.iter().map(|ring| format!("{:.1},{:.1}", ring.centre.x, ring.centre.y));
            centres.collect::<Vec<String>>().join("  ")
        };
        let nearest = map.nearest(self.ring.unwrap_or(DVec2::ZERO))?;
        match self.ring {
            None if 1 < rings.len() => {
                let expected = format!("the map has several; one of {}", listed());
                Err(Reader::of(file).invalid("ring", "missing", expected))
            }
            Some(p) if FARTHEST < nearest.centre.distance(p) - nearest.radius => {
                let expected =
                    format!("must be within {FARTHEST} m of a roundabout's island; the map has {}", listed());
                Err(Reader::of(file).invalid("ring", format_args!("({}, {})", p.x, p.y), expected))
            }
            _ => Ok(nearest),
        }
    }

    /// The ring or the ways that are meant, with arms and routes.
    ///
    /// # Errors
    ///
    /// A ring and ways at once, and those of [`Choice::of`], [`Map::ground`] and [`Map::through`].
    pub fn imported(&self, file: &Path, map: &Map) -> Result<Imported, Error> {
        let options = Options { arms: self.arms.clone() };
        match (self.ways.as_slice(), self.ring) {
            ([], _) => map.ground(&self.of(file, map)?, &options),
            (ways, None) => map.through(ways, &options),
            (_, Some(p)) => {
                let expected = "is for a roundabout, and the ways are through a junction; leave one of them out";
                Err(Reader::of(file).invalid("ring", format_args!("({}, {})", p.x, p.y), expected))
            }
        }
    }
}

impl Road {
    /// A ring of an OpenDRIVE map, or ways through a junction of it.
    ///
    /// # Errors
    ///
    /// The errors of [`Map::read`] and [`Road::in_map`].
    pub fn from_map(file: &Path, choice: &Choice) -> Result<Road, Error> {
        Road::in_map(file, &Map::read(file, choice.hand)?, choice)
    }

    /// A ring, or ways through a junction, of a map that is read already; `file` names it in errors.
    ///
    /// # Errors
    ///
    /// The errors of [`Choice::imported`], and a name that no route could have.
    pub fn in_map(file: &Path, map: &Map, choice: &Choice) -> Result<Road, Error> {
        let stem = || file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let name = choice.name.clone().unwrap_or_else(stem);
        if name.is_empty() || 40 < name.chars().count() || name.contains('/') || name.chars().any(char::is_control) {
            let rename = if choice.name.is_none() { "; rename the file" } else { "" };
            let expected = format!("must be 1 to 40 characters without a slash{rename}");
            return Err(Reader::of(file).invalid("name", format!("{name:?}"), expected));
        }
        Ok(Road::on(name, choice.imported(file, map)?.ground))
    }
}
