//! The mirror image of a map's records: left-hand traffic becomes right-hand traffic.

use super::records::{Records, Shape};

impl Records {
    /// The mirror image in the x axis: right-hand traffic from left-hand traffic.
    pub(super) fn mirror(&mut self) {
        let negated = |factors: &mut [f64; 4]| factors.iter_mut().for_each(|factor| *factor = -*factor);
        for road in &mut self.roads {
            for geometry in &mut road.plan {
                geometry.origin.y = -geometry.origin.y;
                geometry.heading = -geometry.heading;
                match &mut geometry.shape {
                    Shape::Line => {}
                    Shape::Arc(curvature) => *curvature = -*curvature,
                    Shape::Spiral(from, to) => (*from, *to) = (-*from, -*to),
                    Shape::Poly3(v) | Shape::ParamPoly3 { v, .. } => negated(v),
                }
            }
            road.offsets.iter_mut().for_each(|offset| negated(&mut offset.factors));
            for section in &mut road.sections {
                section.lanes.reverse();
                for lane in &mut section.lanes {
                    lane.id = -lane.id;
                    lane.predecessor = lane.predecessor.map(|id| id.wrapping_neg());
                    lane.successor = lane.successor.map(|id| id.wrapping_neg());
                    if lane.bordered {
                        lane.widths.iter_mut().for_each(|border| negated(&mut border.factors));
                    }
                }
            }
            road.islands.iter_mut().flat_map(|island| &mut island.corners).for_each(|corner| corner.y = -corner.y);
        }
        for (from, to) in self.junctions.values_mut().flatten().flat_map(|connection| &mut connection.lanes) {
            (*from, *to) = (from.wrapping_neg(), to.wrapping_neg());
        }
    }
}
