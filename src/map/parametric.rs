//! A roundabout by its parameters: ring, arms, kerbs, lanes and splitter islands, as arcs and segments.
//!
//! Traffic around an island at the origin; left-hand traffic is driven as its mirror image. Parameters that describe no
//! roundabout are refused when the file is read, so the kerbs and lanes of a [`Road`] never fail.

mod alignment;
mod check; // lanes clear of kerbs and of each other
mod corner;
mod ends; // arms prolonged
mod faults; // of the parts, as errors
mod gutter; // widths that differ
mod hand; // left-hand traffic
mod kerb;
pub(super) mod lane;
mod ring;
mod roundabout_keys;
#[cfg(test)]
mod tests;
mod text;

/// A roundabout as a file has it.
pub(crate) mod written {
    pub(crate) use super::corner::WrittenCorner;
    pub(crate) use super::roundabout_keys::{
        BEHIND_APRON, Written, WrittenAlignment, WrittenArm, WrittenPoint, WrittenRing, WrittenWay,
    };
}

use std::path::Path;

use glam::DVec2;

use crate::files::reader::{Error, Reader};
use crate::files::shipped::{Kind, Source};
use crate::geometry::{Curve, Outline};
use crate::map::ground::{self, Edges, Ground, Line};
use crate::map::{Road, chosen};
use lane::{Lanes, RouteLine};
use ring::Ring;
use roundabout_keys::{Arm, Written};

/// What rounding may take from a distance of a file that is just kept; roads that are drawn stay those of their names
/// (m).
const ROUNDING: f64 = 1e-9;

/// Stages of the check of a roundabout, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stage {
    /// Single values, and the order of the arms.
    Values,
    /// Kerbs that fit and do not cross, splitter islands on the road.
    Kerbs,
    /// Lanes that lead into the ring, and routes that follow it.
    Lanes,
    /// Lanes clear of kerbs.
    Clear,
    /// Lanes of an arm beside each other.
    Beside,
}

impl Road {
    /// Reads a roundabout file. Every fault that a roundabout can have is found here.
    ///
    /// # Errors
    ///
    /// The file and, for a value that makes no sense, its key, the value and what would do.
    pub fn read(path: &Path) -> Result<Road, Error> {
        Road::from_source(&Source::Disk(path.to_owned()))
    }

    /// A roundabout that comes with the library: `16m`, `20m`, `32m`, `40m` or `50m`.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`], which lists the known names.
    pub fn named(name: &str) -> Result<Road, Error> {
        Road::from_source(&Source::named(Kind::Roundabout, name)?)
    }

    /// Reads a file where `name_or_path` ends in `.toml` or is the path of a file: parameters, an outline
    /// (`.outline.toml`), or an OpenDRIVE map with one ring (`.xodr`); else the same as [`Road::named`].
    ///
    /// # Errors
    ///
    /// The errors of [`Road::read`] and [`Road::named`].
    pub fn find(name_or_path: &str) -> Result<Road, Error> {
        Road::from_source(&Source::find(Kind::Roundabout, name_or_path)?)
    }

    /// A roundabout from the text of a roundabout file. `name` is its name, and stands for the file in errors.
    ///
    /// # Errors
    ///
    /// The errors of [`Road::read`].
    pub fn from_toml(name: &str, text: &str) -> Result<Road, Error> {
        Road::parsed(name.to_owned(), Path::new(name), text)
    }

    /// A roundabout from the text of a file: parameters, or an outline where the file's name ends in `.outline.toml`.
    /// Nothing is read from `file`: its stem is the roundabout's name, and errors name it.
    ///
    /// # Errors
    ///
    /// The errors of [`Road::read`].
    pub fn from_text(file: &Path, text: &str) -> Result<Road, Error> {
        Road::of_text(Source::Disk(file.to_owned()).stem(), file, text)
    }

    pub(crate) fn from_source(source: &Source) -> Result<Road, Error> {
        if let Source::Disk(file) = source
            && chosen::is_map(file)
        {
            return Road::from_map(file, &chosen::Choice::default());
        }
        Road::of_text(source.stem(), &source.shown(), &source.text()?)
    }

    fn of_text(stem: String, file: &Path, text: &str) -> Result<Road, Error> {
        match stem.strip_suffix(".outline") {
            Some(name) => Ok(Road::on(name.to_owned(), Ground::parse(file, text)?)),
            None => Road::parsed(stem, file, text),
        }
    }

    fn parsed(name: String, file: &Path, text: &str) -> Result<Road, Error> {
        let (reader, written) = Reader::parse::<Written>(file, text)?;
        Road::checked(name, reader, written)
    }

    /// The roundabout that `written` describes, checked as a file is; `reader` names its origin in errors.
    pub(crate) fn checked(name: String, reader: Reader, written: Written) -> Result<Road, Error> {
        Road::staged(name, reader, written, ROUNDING).map_err(|(_, error)| error)
    }

    /// The road that `written` describes, checked; an error says in which stage of the check it was found. Distances
    /// that must be kept may lack `slack` (m).
    pub(crate) fn staged(name: String, reader: Reader, written: Written, slack: f64) -> Result<Road, (Stage, Error)> {
        if written.is_left_hand() {
            let roundabout = Road::staged(name, reader, written.mirrored(), slack);
            return roundabout
                .map(|Road { name, ground }| Road { name, ground: Ground { mirrored: true, ..ground } })
                .map_err(|(stage, error)| (stage, hand::as_written(error)));
        }
        let at = |stage: Stage| move |error: Error| (stage, error);
        let gutters = written.gutters(&reader).map_err(at(Stage::Values))?;
        let (ring, arms) = written.checked(&reader).map_err(at(Stage::Values))?;
        let (kerbs, corners) = kerb::kerbs(&reader, &ring, &arms, slack).map_err(at(Stage::Kerbs))?;
        let lanes = Lanes::new(&reader, &ring, &arms).map_err(at(Stage::Lanes))?;
        check::lanes_clear_of_kerbs(&reader, &kerbs, &arms, &lanes, slack).map_err(at(Stage::Clear))?;
        check::lanes_beside_each_other(&reader, &arms, &lanes, slack).map_err(at(Stage::Beside))?;
        let edges = match gutters {
            Some(gutters) => Edges::Own(gutters.edges(&reader, &ring, &kerbs, &corners).map_err(at(Stage::Clear))?),
            None => Edges::Beside(ring.gutter),
        };
        Ok(Road { name, ground: ground(&ring, &arms, kerbs, edges, &lanes) })
    }
}

/// What is driven on, from checked parameters.
fn ground(ring: &Ring, arms: &[Arm], kerbs: Outline, edges: Edges, lanes: &Lanes) -> Ground {
    let lane_radii: Vec<f64> = (0..ring.lanes).rev().map(|from_kerb| ring.lane_radius(from_kerb)).collect();
    let rings = lane_radii.iter().map(|&radius| Curve::circle(DVec2::ZERO, radius));
    let line = |&RouteLine { entry, lane, exit, ref line }: &RouteLine| {
        let exit_arm = (entry + exit as usize) % arms.len();
        let widths = [arms[entry].lane_width, ring.lane_width, arms[exit_arm].lane_width];
        Line {
            entry,
            lane,
            exit,
            exit_arm,
            line: line.clone(),
            crossing: ring.crossing(lane),
            widths,
            ends: [None, None],
        }
    };
    Ground {
        mirrored: false,
        origin: DVec2::ZERO,
        island_radius: ring.island_radius,
        outer_radius: ring.outer(),
        lanes: rings.chain(lanes.curves().cloned()).collect(),
        lane_radii,
        arms: arms.iter().map(|arm| ground::Arm { name: arm.name.clone(), bearing: arm.bearing }).collect(),
        faces: kerbs,
        kerbs: kerb::order(arms).collect(),
        edges,
        aprons: ring.behind_apron().map(|radius| Curve::circle(DVec2::ZERO, radius)).into_iter().collect(),
        lines: lanes.routes().iter().map(line).collect(),
    }
}
