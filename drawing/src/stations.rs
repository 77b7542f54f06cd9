//! How far along a route a truck is, from state to state.

use glam::DVec2;

use offtrack_evaluation::polygons::Polygon;

/// How far ahead on its route a truck is looked for from one state to the next (m).
const AHEAD: f64 = 12.0;

/// The distance along a route of each of these positions, which does not go back (m): that of the nearest point of the
/// route's centre line. Before its beginning and after its end the line goes straight on.
pub(crate) fn stations(centre_line: &Polygon, positions: &[[f32; 2]]) -> Vec<f64> {
    let points: Vec<DVec2> = centre_line.iter().copied().map(DVec2::from).collect();
    let mut lengths = vec![0.0];
    for pair in points.windows(2) {
        lengths.push(lengths[lengths.len() - 1] + pair[0].distance(pair[1]));
    }
    let (mut segment, mut station) = (0, f64::NEG_INFINITY);
    let advance = |position: &[f32; 2]| {
        let p = DVec2::new(position[0].into(), position[1].into());
        let mut nearest = (f64::INFINITY, station, segment);
        for index in segment..points.len() - 1 {
            let length = lengths[index + 1] - lengths[index];
            if station.max(0.0) + AHEAD < lengths[index] {
                break;
            }
            if length <= 0.0 {
                continue;
            }
            let ahead = (points[index + 1] - points[index]) / length;
            let from = if index == 0 { f64::NEG_INFINITY } else { 0.0 };
            let to = if index + 2 == points.len() { f64::INFINITY } else { length };
            let along = (p - points[index]).dot(ahead).clamp(from, to);
            let distance = p.distance(points[index] + along * ahead);
            if distance < nearest.0 {
                nearest = (distance, lengths[index] + along, index);
            }
        }
        station = station.max(nearest.1);
        segment = nearest.2;
        station
    };
    positions.iter().map(advance).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_truck_beside_its_route_is_as_far_as_the_nearest_point_and_does_not_jump_to_a_part_that_returns() {
        // 50 m east, 4 m north, 50 m west: after the bend the route comes back beside its beginning.
        let route = vec![[0.0, 0.0], [50.0, 0.0], [50.0, 4.0], [0.0, 4.0]];
        let positions = [[-3.0, 1.0], [2.0, 2.5], [9.0, -1.0], [8.0, 0.0], [20.0, 0.5]];
        let expected = [-3.0, 2.0, 9.0, 9.0, 20.0];
        for (found, expected) in stations(&route, &positions).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
        // Eleven metres a step, through the bend and beyond the end.
        let positions = [
            [30.0f32, 0.0],
            [40.0, 0.0],
            [50.5, 2.0],
            [44.0, 4.0],
            [34.0, 4.0],
            [24.0, 4.0],
            [14.0, 4.0],
            [4.0, 4.0],
            [-6.0, 5.0],
        ];
        let found = stations(&route, &[&[[0.0f32, 0.0], [10.0, 0.0], [20.0, 0.0]], &positions[..]].concat());
        let expected = [0.0, 10.0, 20.0, 30.0, 40.0, 52.0, 60.0, 70.0, 80.0, 90.0, 100.0, 110.0];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }
}
