//! Units of a drawing's coordinates, and whether a drawing is as large as a roundabout in its own.

use std::ops::RangeInclusive;

use glam::DVec2;

use super::Entity;
use crate::files::reader::{Error, Reader};
use crate::geometry::Piece;

/// Least and most that kerbs reach over (m).
const REACH: RangeInclusive<f64> = 10.0..=20_000.0;

/// The unit of a drawing's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unit {
    /// Metres.
    Metre,
    /// Millimetres.
    Millimetre,
    /// Centimetres.
    Centimetre,
    /// Feet of 0.3048 m.
    Foot,
    /// Feet of the United States' surveys, of 1200 / 3937 m.
    SurveyFoot,
    /// Inches.
    Inch,
}

impl Unit {
    /// The units by the words of a flag.
    pub const NAMED: [(&'static str, Unit); 6] = [
        ("m", Unit::Metre),
        ("mm", Unit::Millimetre),
        ("cm", Unit::Centimetre),
        ("ft", Unit::Foot),
        ("us-ft", Unit::SurveyFoot),
        ("in", Unit::Inch),
    ];

    /// Its word of a flag.
    pub fn name(self) -> &'static str {
        Unit::NAMED.iter().find(|(_, unit)| *unit == self).map_or("", |(name, _)| name)
    }

    /// Those of these units, as an error lists them.
    pub(super) fn listed(named: &[(&str, Unit)]) -> String {
        let names: Vec<&str> = named.iter().map(|(name, _)| *name).collect();
        names.split_last().map_or_else(String::new, |(last, others)| format!("{} or {last}", others.join(", ")))
    }

    /// The unit's length (m).
    pub fn metres(self) -> f64 {
        match self {
            Unit::Metre => 1.0,
            Unit::Millimetre => 1e-3,
            Unit::Centimetre => 1e-2,
            Unit::Foot => 0.3048,
            Unit::SurveyFoot => 1200.0 / 3937.0,
            Unit::Inch => 0.0254,
        }
    }

    /// By the value of `$INSUNITS`.
    pub(super) fn of_code(code: &str) -> Option<Unit> {
        match code {
            "1" => Some(Unit::Inch),
            "2" => Some(Unit::Foot),
            "4" => Some(Unit::Millimetre),
            "5" => Some(Unit::Centimetre),
            "6" => Some(Unit::Metre),
            "21" => Some(Unit::SurveyFoot),
            _ => None,
        }
    }
}

/// A drawing of a roundabout reaches over tens or hundreds of metres; one whose unit is not what it says does not.
pub(super) fn reach(reader: &Reader, kerbs: &[Entity]) -> Result<(), Error> {
    // A circle ends where it begins.
    let along = |piece: &Piece| [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| piece.point_at(part * piece.length()));
    let ends = kerbs.iter().flat_map(|kerb| kerb.curve.pieces.iter().flat_map(along));
    let (low, high) = ends.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let over = (high - low).max_element();
    if REACH.contains(&over) {
        return Ok(());
    }
    let (least, most, units) = (REACH.start(), REACH.end(), Unit::listed(&Unit::NAMED));
    let expected = format!("must lie in {least}..{most} m; is its unit right? --unit {units} says another");
    Err(reader.invalid("kerbs", format!("reach over {over:.2} m"), expected))
}
