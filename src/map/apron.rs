//! Aprons: strips of an island that a trailer may drive on and a tractor may not.
//!
//! The kerb faces of a road are what its tractors keep to, and what distance sensors see: an apron has a raised edge.
//! A trailer keeps to the same faces, but for those of islands with an apron: there it keeps to the apron's inner edge.

use super::ground::Ground;
use super::{Gutter, Road};
use crate::geometry::{Curve, Outline};

/// The edge of what each unit may drive on.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitKerbs {
    /// What the tractor keeps to.
    pub tractor: Outline,
    /// What the trailer keeps to, where that is something else.
    behind_aprons: Option<Outline>,
}

impl UnitKerbs {
    /// What the trailer keeps to.
    pub fn trailer(&self) -> &Outline {
        self.behind_aprons.as_ref().unwrap_or(&self.tractor)
    }

    /// What the tractor and the trailer keep to.
    pub fn both(&self) -> [&Outline; 2] {
        [&self.tractor, self.trailer()]
    }

    /// What the trailer keeps to, if there is an apron.
    pub fn behind_aprons(&self) -> Option<&Outline> {
        self.behind_aprons.as_ref()
    }
}

impl Road {
    /// Whether any of its islands has an apron.
    pub fn has_apron(&self) -> bool {
        !self.ground.aprons.is_empty()
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
    /// What the units keep to where the tractor keeps to `kerbs`. A solid gutter in front of an apron is the trailer's,
    /// too: it leads there.
    fn unit_kerbs(&self, kerbs: Outline) -> UnitKerbs {
        let is_apron = |curve: &&Curve| self.aprons.iter().any(|apron| is_within(apron, curve));
        let behind = || {
            let others = kerbs.loops.iter().filter(|curve| !is_apron(curve));
            Outline::new(others.chain(&self.aprons).cloned().collect())
        };
        UnitKerbs { behind_aprons: (!self.aprons.is_empty()).then(behind), tractor: kerbs }
    }
}

/// Whether an apron's inner edge lies on the solid side of this loop of an outline, an island.
fn is_within(apron: &Curve, island: &Curve) -> bool {
    // Loops have the drivable side on their left: islands run clockwise.
    island.signed_area() < 0.0 && Outline::new(vec![island.clone()]).contains(apron.point_at(0.0))
}
