//! The way that a search finds for a route, and the clearance that it keeps.

use std::sync::Arc;

use offtrack::layout::Start;
use offtrack::world::World;

use super::Case;
use super::way::{Refusal, Way};
use crate::certificate::attempt::attempt;
use crate::certificate::beam::Pass;
use crate::certificate::file::Found;
use crate::error::Error;

/// By how much a way may come nearer to a kerb than is asked for: positions of the simulator are f32 (m).
const SLACK: f64 = 1e-3;
/// How far a truck sees in a search, which observes nothing: rays to the usual range take half of its time (m).
const UNSEEN: f32 = 0.01;

/// The world with the truck's outline grown by a clearance (m), and without sensors.
pub(super) fn grown(world: &World, clearance: f64) -> Arc<World> {
    let mut grown = World::clone(world);
    grown.params.sensor_range = UNSEEN;
    let by = clearance as f32;
    for body in grown.rigs.iter_mut().flat_map(|rig| [&mut rig.tractor_body, &mut rig.trailer_body]) {
        (body.front, body.rear, body.half_width) = (body.front + by, body.rear - by, body.half_width + by);
    }
    grown.into()
}

impl Case {
    /// Whether this is the clearance that is asked for, or more (m).
    pub(super) fn keeps(&self, clearance: f64) -> bool {
        self.asked.clearance - SLACK <= clearance
    }

    /// What a search found, the clearance that it kept (m), and the way. Of searches that find none which keeps the
    /// clearance asked for, one for any way.
    pub(super) fn searched(
        &self,
        route: usize,
        found: &Found,
        passes: &[Pass],
    ) -> Result<(Found, f64, Option<Way>), Error> {
        let asked = self.asked.clearance;
        let again = |world: &Arc<World>, passes: &[Pass], before: &Found| {
            let found = attempt(world, route as u32, &Start::default(), passes, None)?;
            Ok::<Found, Error>(Found { env_steps: before.env_steps + found.env_steps, ..found })
        };
        if !found.arrived() {
            // How near would it come? The narrowest search says so soon.
            let nearer = if 0.0 < asked { Some(again(&self.world, &passes[..1], found)?) } else { None };
            return match nearer.filter(Found::arrived) {
                Some(nearer) => self.with_way(route, nearer, 0.0),
                None => Ok((found.clone(), asked, None)),
            };
        }
        let first = self.with_way(route, found.clone(), asked)?;
        let Some(way) = first.2.as_ref().filter(|way| !way.fits) else { return Ok(first) };
        // A search looks at its poses alone, and a nose is nearer between two of them: one that keeps more there.
        let more = 2.0 * asked - way.clearance();
        let second = again(&grown(&self.world, more), passes, found)?;
        if second.arrived() {
            let second = self.with_way(route, second, asked)?;
            if second.2.as_ref().is_some_and(|way| way.fits) {
                return Ok(second);
            }
        }
        Ok((first.0, 0.0, first.2))
    }

    fn with_way(&self, route: usize, found: Found, kept: f64) -> Result<(Found, f64, Option<Way>), Error> {
        let (path, asks) = self.driven(route, &found)?;
        let way = self.way(route, &path, &asks, |clearance| (!self.keeps(clearance)).then_some(Refusal::Kerb));
        Ok((found, kept, Some(way)))
    }
}

#[cfg(test)]
mod tests {
    use offtrack::geometry::{Curve, Outline};
    use offtrack::map::ground::{Ground, Kerb};
    use offtrack::map::{Gutter, Road};
    use offtrack::vehicle::Vehicle;
    use offtrack::vehicle::swept::{UnitClearance, nearest};

    use super::super::Asked;
    use super::super::case::wanted;
    use super::*;
    use crate::certificate::attempt::passes;

    #[test]
    fn a_way_that_touches_a_post_between_two_poses_gives_place_to_one_that_keeps_clear() {
        let (load, gutter) = ("empty".to_owned(), Gutter::Drivable);
        let asked = Asked { load, speed_kmh: 15.0, clearance: 0.0, gutter, widths: vec![64] };
        let case = |road: &Road| {
            let scenario = Case::scenario(&asked, road, &Vehicle::named("eu_4x2_13m6").unwrap()).unwrap();
            Case::new(&asked, "eu_4x2_13m6", &scenario, Arc::new(World::bake(&scenario).unwrap()))
        };
        let road = Road::named("20m").unwrap();
        let plain = case(&road);
        let route = wanted(&plain.routes, &["E-left-3".to_owned()])[0];
        let passes = passes(&asked.widths, 3).unwrap();
        let found = attempt(&grown(&plain.world, 0.0), route as u32, &Start::default(), &passes, None).unwrap();
        assert!(found.arrived());
        let units = plain.driven(route, &found).unwrap().0.corners();
        // Beside the path of the tractor's outer front corner, and clear of it at each pose.
        let post_at = |index: usize| {
            let [from, to] = [units[0][index][3], units[0][index + 1][3]];
            let centre = from.midpoint(to) - 0.185 * (to - from).normalize().perp();
            let post = Curve::circle(centre, 0.2);
            let alone = Outline::new(vec![Curve::circle(glam::DVec2::ZERO, 1e4), post.clone()]);
            let is_clear = units.iter().flatten().all(|corners| 0.03 < nearest(corners, &alone).1);
            let is_touched = UnitClearance::of(&units[0], &alone).least < -0.005;
            let is_free = 1.0 < plain.kerbs.tractor.signed_distance(centre);
            (is_clear && is_touched && is_free).then_some(post)
        };
        let post = (0..units[0].len() - 1).find_map(post_at).unwrap();
        let Ground { faces, kerbs, .. } = road.ground();
        let faces = Outline::new(faces.loops.iter().chain([&post]).cloned().collect());
        let kerbs = kerbs.iter().copied().chain([Kerb::Splitter(0)]).collect();
        let with_post = case(&Road::on("20m".into(), Ground { faces, kerbs, ..road.ground().clone() }));
        let touching = with_post.with_way(route, found.clone(), 0.0).unwrap().2.unwrap();
        assert!(!touching.fits && touching.tractor.clearance < -0.005, "{touching:?}");
        let (_, kept, way) = with_post.searched(route, &found, &passes).unwrap();
        assert!(kept == 0.0 && way.as_ref().is_some_and(|way| way.fits), "{way:?}");
    }
}
