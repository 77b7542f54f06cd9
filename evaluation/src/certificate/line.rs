//! The paths of a certificate as lines to follow: where the drive axle of the truck that completed a route was beside
//! each waypoint.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use glam::Vec2;
use offtrack::layout::{Ended, WaypointRow};
use offtrack::scenario::Scenario;
use offtrack::world::World;

use super::verify::{self, Sequence};
use crate::error::Error;

/// Lines by the index of their route in the world: a row for each of the route's waypoints.
pub type Lines = HashMap<u32, Vec<WaypointRow>>;

/// The lines of the world's routes that the certificate completes: of each, the path from the first start that it
/// completed. The sequences are driven again first. Each of the world's routes must be in the file.
pub fn lines(path: &Path, scenario: &Scenario, world: &Arc<World>) -> Result<Lines, Error> {
    let routes: Vec<u32> = (0..world.route_names.len() as u32).collect();
    let (_, mut sequences) = super::verified(path, scenario, world, &routes)?;
    sequences.dedup_by_key(|sequence| sequence.route);
    let mut driven = vec![Vec::new(); sequences.len()];
    verify::follow(&super::emptied(world), &sequences, |index, batch| {
        if batch.ended[index] == Ended::Running as u32 {
            driven[index].push(batch.truck[index].position);
        }
    })?;
    let line = |(sequence, driven): (&Sequence, &Vec<Vec2>)| {
        (sequence.route, beside(world.route_waypoints(sequence.route), driven))
    };
    Ok(sequences.iter().zip(&driven).map(line).collect())
}

/// The point of a driven path beside each waypoint, and the direction there. Where the path is not beside one, before
/// its start and after its end, the line is the lane's centre.
fn beside(waypoints: &[WaypointRow], driven: &[Vec2]) -> Vec<WaypointRow> {
    let point = |waypoint: &WaypointRow| {
        let along = |p: Vec2| (p - waypoint.position).dot(waypoint.direction);
        let crossing = driven.windows(2).filter_map(|pair| {
            let (from, to) = (along(pair[0]), along(pair[1]));
            (from <= 0.0 && 0.0 < to).then(|| pair[0].lerp(pair[1], from / (from - to)))
        });
        let off = |p: &Vec2| p.distance(waypoint.position);
        crossing.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(waypoint.position)
    };
    let points: Vec<Vec2> = waypoints.iter().map(point).collect();
    let row = |index: usize| {
        let (before, after) = (index.saturating_sub(1), (index + 1).min(points.len() - 1));
        let direction = (points[after] - points[before]).normalize_or(waypoints[index].direction);
        WaypointRow { position: points[index], direction }
    };
    (0..points.len()).map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_where_the_path_crosses_the_normal_of_each_waypoint_and_the_lanes_centre_where_it_does_not() {
        // A lane to the east, and a path 0.5 m to its left from x = 1 to x = 5.
        let lane = |x: f32| WaypointRow { position: Vec2::new(x, 0.0), direction: Vec2::X };
        let waypoints: Vec<WaypointRow> = [0.0, 2.0, 4.0, 6.0].map(lane).to_vec();
        let driven: Vec<Vec2> = [1.0, 1.7, 2.4, 3.1, 3.8, 4.5, 5.0].map(|x| Vec2::new(x, 0.5)).to_vec();
        let line = beside(&waypoints, &driven);
        let expected = [[0.0, 0.0], [2.0, 0.5], [4.0, 0.5], [6.0, 0.0]].map(Vec2::from);
        for (row, expected) in line.iter().zip(expected) {
            assert!(row.position.distance(expected) < 1e-5, "{row:?}");
        }
        assert!(line[1].direction.distance(Vec2::new(4.0, 0.5).normalize()) < 1e-5, "{line:?}");
        // A path that turns back beside a waypoint far off, as in a ring, counts where it is nearest.
        let ring = [[-1.0, 40.0], [1.0, 40.0], [9.0, 20.0], [-1.0, 0.3], [1.0, 0.3]].map(Vec2::from);
        assert!(beside(&waypoints[..2], &ring)[0].position.distance(Vec2::new(0.0, 0.3)) < 1e-5);
    }
}
