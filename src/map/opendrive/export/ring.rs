//! The ring's lanes as two roads, each half of it, that lead into each other. The routes lie on them too, as connecting
//! roads do on a junction.

use std::f64::consts::PI;

use glam::DVec2;

use super::{Kind, Link, Width, Written, WrittenLane, lane_id};
use crate::geometry::{Curve, Piece};
use crate::map::ground::{Ground, Hand};

/// The two halves of the ring, numbered from `first` on; none where lanes go round no island.
pub(super) fn ring(seen: &Ground, hand: Hand, first: usize) -> Vec<Written> {
    let widths = seen.lines.iter().map(|line| line.widths[1]);
    let width = widths.fold(f64::INFINITY, f64::min);
    let (Some(inner), Some(outer)) = (seen.lane_radii.first(), seen.lane_radii.last()) else { return Vec::new() };
    let mut edges = vec![(inner - width / 2.0).max(seen.island_radius)];
    edges.extend(seen.lane_radii.windows(2).map(|pair| pair[0].midpoint(pair[1])));
    edges.push((outer + width / 2.0).min(seen.outer_radius));
    // The island is on the left of who circulates counter-clockwise.
    let lane = lane_id(hand);
    let lanes = || {
        let of = |(index, pair): (usize, &[f64])| WrittenLane {
            id: lane * (1 + index as i32),
            kind: Kind::Ring,
            widths: Width::constant(pair[1] - pair[0]),
        };
        let mut lanes: Vec<WrittenLane> = edges.windows(2).enumerate().map(of).collect();
        // Lanes stand from left to right.
        lanes.sort_by_key(|lane| -lane.id);
        lanes
    };
    let sweep = if hand == Hand::Left { -PI } else { PI };
    let half = |index: usize| {
        let arc = Piece::Arc { centre: DVec2::ZERO, radius: edges[0], from: index as f64 * PI, sweep };
        let other = first + 1 - index;
        Written {
            id: first + index,
            name: "ring".into(),
            is_connecting: false,
            offset: 0.0,
            line: Curve { pieces: vec![arc] },
            lanes: lanes(),
            predecessor: Some(Link::EndOf(other)),
            successor: Some(Link::StartOf(other)),
        }
    };
    vec![half(0), half(1)]
}
