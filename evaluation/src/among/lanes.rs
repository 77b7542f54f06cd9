//! Which lanes beside its own a truck takes on its way.
//!
//! The classes are those of the pooled study of Minnesota and Wisconsin on oversize and large vehicles at roundabouts:
//! I, trucks take the other lane on entry or exit too; II, in the ring alone; III, they stay in their lane throughout.

use glam::Vec2;
use offtrack::traffic::car::Outline;
use offtrack::traffic::{Network, SPACING, Sample};
use offtrack::world::World;
use serde::Serialize;

use crate::part::{LaneWidths, Part};

/// Distances of the centre line of a lane beside from that of the own (m).
const BESIDE: [f32; 2] = [3.0, 7.0];
/// Cosine of the angle between both up to which they lead the same way: ways that part from the own, or join it, are at
/// larger angles once they are so far from it.
const SAME_WAY: f32 = 0.985;
/// Most that a point of a lane beside may lie ahead of the point of the own that it is beside (m).
const AHEAD: f32 = 1.5;
/// A unit so near to a lane's centre line leaves no room there for a car (m).
const TAKES: f32 = 0.9;

/// Points in the middle of the lanes beside a route's own, each with the part of the route that it is beside.
#[derive(Debug, Clone, Default)]
pub(crate) struct LanesBeside(Vec<(Vec2, Part)>);

impl LanesBeside {
    /// Those of a route of a world with other vehicles; none where there are none.
    pub(crate) fn of(world: &World, route: u32, lane: &LaneWidths) -> LanesBeside {
        let Some(shared) = &world.traffic else { return LanesBeside::default() };
        let network = &shared.road(world, route).network;
        let on = shared.routes[route as usize];
        let own = samples(network, on.path as usize);
        let part = |index: usize| lane.part(f64::from(SPACING) * index as f64 - f64::from(on.begins));
        let others = (0..network.paths.len()).filter(|&path| path != on.path as usize);
        let points = others.flat_map(|path| samples(network, path)).filter_map(|sample| {
            let distance = |own: &Sample| own.position.distance_squared(sample.position);
            let nearest = (0..own.len()).min_by(|&a, &b| distance(&own[a]).total_cmp(&distance(&own[b])))?;
            let Sample { position, direction, .. } = own[nearest];
            let from = sample.position - position;
            let is_beside = (BESIDE[0]..BESIDE[1]).contains(&from.perp_dot(direction).abs())
                && from.dot(direction).abs() < AHEAD
                && SAME_WAY < sample.direction.dot(direction);
            is_beside.then(|| (sample.position, part(nearest)))
        });
        LanesBeside(points.collect())
    }

    /// Whether there is a lane beside the own anywhere.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The parts on which units take a lane beside their own, by entry, ring, exit.
    pub(crate) fn taken(&self, units: &[Outline; 2]) -> [bool; 3] {
        let takes =
            |&&(point, _): &&(Vec2, Part)| units.iter().any(|unit| unit.distance_squared(point) < TAKES * TAKES);
        let mut taken = [false; 3];
        self.0.iter().filter(takes).for_each(|&(_, part)| taken[part as usize] = true);
        taken
    }
}

fn samples(network: &Network, path: usize) -> &[Sample] {
    let path = &network.paths[path];
    &network.samples[path.first as usize..][..path.n as usize]
}

/// Fractions of the passages of each class.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LaneClasses {
    /// Another lane on entry or exit.
    pub i: f64,
    /// Another lane in the ring alone.
    pub ii: f64,
    /// The own lane throughout.
    pub iii: f64,
}

impl LaneClasses {
    /// Of passages by the parts on which each took another lane; `None` of none.
    pub(super) fn of(passages: &[[bool; 3]]) -> Option<LaneClasses> {
        let fraction = |is: fn(&[bool; 3]) -> bool| {
            passages.iter().filter(|taken| is(taken)).count() as f64 / passages.len() as f64
        };
        (!passages.is_empty()).then(|| LaneClasses {
            i: fraction(|&[entry, _, exit]| entry || exit),
            ii: fraction(|&taken| taken == [false, true, false]),
            iii: fraction(|&taken| taken == [false; 3]),
        })
    }
}
