//! Aprons: strips of an island that a trailer may drive on and a tractor may not.
//!
//! The kerb faces of a road are what its tractors keep to, and what distance sensors see: an apron has a raised edge.
//! A trailer keeps to the same faces, but for those of islands with an apron: there it keeps to the apron's inner edge.

use glam::DVec2;

use super::ground::Ground;
use super::{Gutter, Road};
use crate::files::reader::{Error, Reader};
use crate::geometry::{Curve, Outline};

/// Radius of a circle around everything (m).
const AROUND: f64 = 1e5;

/// The edge of what each unit may drive on.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitKerbs {
    /// What the tractor keeps to.
    pub tractor: Outline,
    behind: Option<Behind>,
}

/// What there is where islands have aprons.
#[derive(Debug, Clone, PartialEq)]
struct Behind {
    /// What the trailer keeps to.
    trailer: Outline,
    /// The faces of the islands with aprons, alone.
    islands: Outline,
}

impl UnitKerbs {
    /// What the trailer keeps to.
    pub fn trailer(&self) -> &Outline {
        self.behind_aprons().unwrap_or(&self.tractor)
    }

    /// What the tractor and the trailer keep to.
    pub fn both(&self) -> [&Outline; 2] {
        [&self.tractor, self.trailer()]
    }

    /// What the trailer keeps to, if there is an apron.
    pub fn behind_aprons(&self) -> Option<&Outline> {
        self.behind.as_ref().map(|behind| &behind.trailer)
    }

    /// The outer edges of the aprons, if there are any: signed distances from them are negative on an apron, whatever
    /// other kerbs there are.
    pub fn apron_edges(&self) -> Option<&Outline> {
        self.behind.as_ref().map(|behind| &behind.islands)
    }
}

impl Road {
    /// Whether any of its islands has an apron.
    pub fn has_apron(&self) -> bool {
        !self.ground.aprons.is_empty()
    }

    /// The aprons, each an outline that contains what lies on it: its outer edge, then its inner one.
    pub fn aprons(&self) -> Vec<Outline> {
        let of = |apron: &Curve| {
            let face = self.ground.faces.loops.iter().find(|face| is_within(apron, face))?;
            Some(Outline::new(vec![face.clone(), apron.clone()]))
        };
        self.ground.aprons.iter().filter_map(of).collect()
    }

    /// The edge of what each unit may drive on; [`Road::kerbs`] is the tractor's.
    pub fn unit_kerbs(&self, gutter: Gutter) -> UnitKerbs {
        self.ground.unit_kerbs(self.kerbs(gutter))
    }

    /// The same with every arm prolonged, as [`Road::kerbs_beyond_ends`] does.
    pub fn unit_kerbs_beyond_ends(&self, gutter: Gutter) -> UnitKerbs {
        self.ground.unit_kerbs(self.kerbs_beyond_ends(gutter))
    }
}

impl Ground {
    /// The faces of the islands that have an apron.
    fn islands_with_aprons(&self) -> impl Iterator<Item = &Curve> {
        self.faces.loops.iter().filter(|face| self.has_apron_within(face))
    }

    fn has_apron_within(&self, island: &Curve) -> bool {
        self.aprons.iter().any(|apron| is_within(apron, island))
    }

    /// What the units keep to where the tractor keeps to `kerbs`. A solid gutter in front of an apron is the trailer's,
    /// too: it leads there.
    fn unit_kerbs(&self, kerbs: Outline) -> UnitKerbs {
        let behind = || {
            let others = kerbs.loops.iter().filter(|curve| !self.has_apron_within(curve));
            let around = Curve::circle(DVec2::ZERO, AROUND);
            Behind {
                trailer: Outline::new(others.chain(&self.aprons).cloned().collect()),
                islands: Outline::new(self.islands_with_aprons().chain([&around]).cloned().collect()),
            }
        };
        UnitKerbs { behind: (!self.aprons.is_empty()).then(behind), tractor: kerbs }
    }
}

/// Whether an apron's inner edge lies on the solid side of this loop of an outline, an island.
pub(super) fn is_within(apron: &Curve, island: &Curve) -> bool {
    // Loops have the drivable side on their left: islands run clockwise.
    island.signed_area() < 0.0 && Outline::new(vec![island.clone()]).contains(apron.point_at(0.0))
}

/// The inner edges of aprons, each with its place in the file: closed, and each alone within an island's face.
pub(super) fn checked(reader: &Reader, faces: &Outline, drawn: Vec<(String, Curve)>) -> Result<Vec<Curve>, Error> {
    let (mut aprons, mut islands) = (Vec::new(), Vec::new());
    for (key, apron) in drawn {
        if faces.loops.iter().any(|face| crosses(face, &apron)) {
            let expected = "must not cross or touch a kerb: an apron's inner edge lies within its island";
            return Err(reader.invalid(key, "crosses", expected));
        }
        let Some(island) = faces.loops.iter().position(|face| is_within(&apron, face)) else {
            let expected = "must lie within an island's kerb: it is the inner edge of that island's apron";
            return Err(reader.invalid(key, "in no island", expected));
        };
        if islands.contains(&island) {
            return Err(reader.invalid(key, "a second one", "an earlier apron lies within the same island"));
        }
        islands.push(island);
        aprons.push(apron);
    }
    Ok(aprons)
}

/// Whether two curves have a point in common.
pub(super) fn crosses(one: &Curve, other: &Curve) -> bool {
    one.pieces.iter().any(|piece| other.pieces.iter().any(|there| !piece.meetings(there).is_empty()))
}
