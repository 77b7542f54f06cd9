//! Where the parts of a large vehicle are along a path: what follows its front axle, or its kingpin, as a tractrix.

use glam::DVec2;

use super::{Large, Shape, TRACTOR};
use crate::traffic::meetings::{FINE, Points};

/// Rounds in which the line of the front is moved until what is swept lies evenly on both sides of the lane's middle,
/// and the part of the difference that each takes away.
const ROUNDS: usize = 6;
const MOVED: f64 = 0.6;
/// Points on each side over which that is smoothed.
const SMOOTHED: usize = 8;
/// Farthest that the front leaves the lane's middle (m).
const FARTHEST: f64 = 1.6;
/// Steps of the tractrix from one point to the next.
const SUBSTEPS: usize = 4;
/// Distance of the points of a side whose place is asked for (m).
const SIDE: f64 = 0.5;

/// A path as a kind of large vehicle drives it: at points every [`FINE`] of its centre line.
pub(super) struct Driven {
    /// How far to the left of the centre line the point drives that the last unit follows (m).
    pub offsets: Vec<f64>,
    /// Direction of the last unit when that point is there.
    pub directions: Vec<DVec2>,
    /// The room that the vehicle sweeps to the left and to the right of the centre line (m).
    pub bands: [Vec<f64>; 2],
}

impl Points {
    /// A point beside the line, between its points and before the first of them (m).
    fn beside(&self, offsets: &[f64], station: f64) -> DVec2 {
        let last = self.len() - 1;
        let at = (station / FINE).clamp(0.0, last as f64);
        let (k, t) = ((at as usize).min(last - 1), at - (at as usize).min(last - 1) as f64);
        let of = |k: usize| self.point(k) + offsets[k] * self.along(k).perp();
        of(k).lerp(of(k + 1), t) + (station - at * FINE) * self.along(if station < 0.0 { 0 } else { last })
    }

    /// The point of the line nearest to another one, searched from a first guess on; and how far that is to its left
    /// (m).
    fn nearest(&self, point: DVec2, guess: usize) -> (usize, f64) {
        let mut k = guess.min(self.len() - 1);
        let ahead = |k: usize| (point - self.point(k)).dot(self.along(k));
        while 0 < k && ahead(k) < -0.5 * FINE {
            k -= 1;
        }
        while k + 1 < self.len() && 0.5 * FINE < ahead(k) {
            k += 1;
        }
        (k, self.along(k).perp_dot(point - self.point(k)))
    }
}

impl Driven {
    /// Of a centre line.
    pub(super) fn new(centre: &Points, kind: Large) -> Driven {
        let shape = kind.shape();
        let n = centre.len();
        let mut driven = Driven { offsets: vec![0.0; n], directions: Vec::new(), bands: [Vec::new(), Vec::new()] };
        for round in 0..=ROUNDS {
            driven.directions = trailed(centre, &driven.offsets, &shape);
            driven.bands = [vec![0.0; n], vec![0.0; n]];
            driven.sweep(centre, &shape);
            if round < ROUNDS {
                let [left, right] = &driven.bands;
                let aside = left.iter().zip(right).map(|(left, right)| 0.5 * (left - right));
                let moved: Vec<f64> =
                    driven.offsets.iter().zip(aside).map(|(own, aside)| own - MOVED * aside).collect();
                driven.offsets = smoothed(&moved);
            }
        }
        driven
    }

    /// Notes what every unit covers from every station.
    fn sweep(&mut self, centre: &Points, shape: &Shape) {
        let (half_width, rear) = (f64::from(shape.half_width), f64::from(shape.ahead - shape.body()));
        for k in 0..centre.len() {
            let hinge = centre.point(k) + self.offsets[k] * centre.along(k).perp();
            self.cover(centre, k, hinge, self.directions[k], [rear, shape.ahead.into()], half_width);
            if shape.has_tractor {
                let front = k as f64 * FINE + f64::from(shape.hinge);
                let [steered, driven, length] = TRACTOR.map(f64::from);
                let axles = [steered, driven].map(|behind| centre.beside(&self.offsets, front - behind));
                let along = (axles[0] - axles[1]).normalize_or(centre.along(k));
                self.cover(centre, k, axles[0], along, [steered - length, steered], half_width);
            }
        }
    }

    /// Notes a unit: a point of it and the direction along it, from where to where it reaches, and half its width.
    fn cover(&mut self, centre: &Points, guess: usize, point: DVec2, along: DVec2, ends: [f64; 2], half: f64) {
        let n = ((ends[1] - ends[0]) / SIDE).ceil() as usize;
        for index in 0..=n {
            let ahead = ends[0] + (ends[1] - ends[0]) * index as f64 / n as f64;
            let guess = (guess as f64 + ahead / FINE).max(0.0) as usize;
            for side in [half, -half] {
                let (k, left) = centre.nearest(point + ahead * along + side * along.perp(), guess);
                for k in k.saturating_sub(1)..(k + 2).min(centre.len()) {
                    self.bands[0][k] = self.bands[0][k].max(left);
                    self.bands[1][k] = self.bands[1][k].max(-left);
                }
            }
        }
    }
}

/// Directions of the last unit: it points to the point that it follows, and its rear axle does not slide.
fn trailed(centre: &Points, offsets: &[f64], shape: &Shape) -> Vec<DVec2> {
    let wheelbase = f64::from(shape.wheelbase);
    let mut rear = centre.beside(offsets, 0.0) - wheelbase * centre.along(0);
    let mut directions = vec![centre.along(0)];
    for k in 1..centre.len() {
        let mut along = directions[k - 1];
        for step in 1..=SUBSTEPS {
            let lead = centre.beside(offsets, (k as f64 - 1.0 + step as f64 / SUBSTEPS as f64) * FINE);
            along = (lead - rear).normalize_or(along);
            rear = lead - wheelbase * along;
        }
        directions.push(along);
    }
    directions
}

/// The mean over neighbouring points, no farther than a front may leave the lane's middle (m).
fn smoothed(offsets: &[f64]) -> Vec<f64> {
    let n = offsets.len();
    let mean = |k: usize| {
        let around = &offsets[k.saturating_sub(SMOOTHED)..(k + SMOOTHED + 1).min(n)];
        (around.iter().sum::<f64>() / around.len() as f64).clamp(-FARTHEST, FARTHEST)
    };
    (0..n).map(mean).collect()
}
