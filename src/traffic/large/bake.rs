//! Bakes the zones of large vehicles: where what they sweep on one path and what others need on another one overlap.
//!
//! Lanes that run beside each other are not of one length in a bend: a zone in which vehicles follow each other from
//! lane to lane says how the stations of one change with those of the other, and is split where that is not even.

use glam::DVec2;

use super::tables::{Band, LargeTables, Trail};
use super::trail::Driven;
use super::{Large, N_CLASSES, N_LARGE};
use crate::map::Road;
use crate::traffic::bake::{BEFORE_ZONE, ENTRY, SHALLOW, met as cars_met, outwards, too_large};
use crate::traffic::meetings::{FINE, Interval, Points, components};
use crate::traffic::network::{Kind, MOST_ZONES, Network, Pair, RATIO_ONE, SPACING, UNIT, Zone};
use crate::traffic::paths::courses;
use crate::traffic::units::{length, metres};
use crate::traffic::{Error, Path};

/// Half the width of what a car or a van needs, whose ends swing out in bends (m).
const OF_CAR: f64 = 1.25;
/// Room between what two vehicles sweep (m).
const ROOM: f64 = 0.3;
/// Farthest that two stations are from those that a zone takes for beside each other (m).
const UNEVEN: f64 = 0.75;
/// How much less room is kept between lanes of opposite directions, which lie close together (m).
const LESS_IF_OPPOSITE: f64 = 0.2;
/// How far before a zone a front corner may be ahead of the front (m).
const CORNER: f64 = 0.5;
/// Farthest that the line of a large vehicle is before that of cars (m).
const LINE_MOVES: f64 = 6.0;
/// Fewest points of a part that is divided where paths that run together begin to cross, and of each of its runs.
const SHORTEST_LONG: usize = 60;
const SHORTEST_RUN: usize = 16;
/// Shortest piece that a zone is split into (points).
const SHORTEST: usize = 8;
/// Stations that change alike to within this part of them are taken to change alike.
const ALIKE: f64 = 0.02;

/// Of every path what a class of vehicles sweeps to the left and to the right, at its points (m).
type Bands = Vec<[Vec<f64>; 2]>;

/// Where paths a and b meet, in metres.
#[derive(Clone)]
struct Meeting {
    a: [f64; 2],
    b: [f64; 2],
    /// Station on b less that on a where the zone begins on b.
    delta: f64,
    /// How far a goes with each metre of b.
    ratio: f64,
    kind: Kind,
    /// Whether b runs the other way.
    is_opposite: bool,
}

impl Network {
    /// The same tables, with those of large vehicles.
    ///
    /// # Errors
    ///
    /// [`Error::TooLarge`], of a road with more zones than the tables hold.
    pub fn with_large(mut self, road: &Road) -> Result<Network, Error> {
        let fine: Vec<Points> = courses(road.ground()).iter().map(|course| Points::of(&course.line)).collect();
        let driven: Vec<[Driven; N_LARGE]> =
            fine.iter().map(|centre| Large::ALL.map(|kind| Driven::new(centre, kind))).collect();
        let bands: [Bands; N_CLASSES] = std::array::from_fn(|class| {
            let of_path = |(points, of): (&Points, &[Driven; N_LARGE])| bands(points, of, class);
            fine.iter().zip(&driven).map(of_path).collect()
        });
        let n = fine.len();
        let mut met: Vec<Vec<Vec<Meeting>>> = Vec::new();
        for classes in 0..N_CLASSES * N_CLASSES {
            let [one, other] = [classes / N_CLASSES, classes % N_CLASSES];
            let found = match (one, other) {
                (0, 0) => Vec::new(),
                _ if other < one => transposed(&met[other * N_CLASSES + one], n),
                _ => meetings(&fine, [&bands[one], &bands[other]], one == other),
            };
            met.push(found);
        }
        // What needs the lanes of those who come the other way does not come, but where even cars are too near to them.
        let of_cars = cars_met(&fine, road.ground().outer_radius);
        let mut fits = vec![true; N_CLASSES * n];
        for (classes, met) in met.iter_mut().enumerate() {
            let [one, other] = [classes / N_CLASSES, classes % N_CLASSES];
            for (pair, zones) in met.iter_mut().enumerate() {
                let has = |zone: &Meeting| self.stretches(pair).any(|[a, b]| overlap(zone.a, a) && overlap(zone.b, b));
                let (kept, oncoming): (Vec<_>, Vec<_>) =
                    zones.drain(..).partition(|zone| !zone.is_opposite || has(zone));
                *zones = kept;
                let are_near = |zone: &Meeting| {
                    let mut oncoming = of_cars[pair].iter().filter(|of| of.is_oncoming);
                    oncoming.any(|of| overlap(zone.a, of.a) && overlap(zone.b, of.b))
                };
                fits[one * n + pair / n] &= one < other || oncoming.iter().all(are_near);
            }
        }
        let n_zones = met.iter().flatten().map(Vec::len).sum();
        if MOST_ZONES < n_zones {
            return Err(too_large(road, "zones of large vehicles", n_zones, MOST_ZONES));
        }
        let mut tables = LargeTables {
            lines: Vec::new(),
            fits: Vec::new(),
            trails: Vec::new(),
            bands: Vec::new(),
            pairs: Vec::new(),
            zones: vec![],
        };
        for class in 0..N_CLASSES {
            let of = |a: usize| self.line_of_class(a, (0..N_CLASSES).map(|other| &met[class * N_CLASSES + other]));
            let lines: Vec<[i32; 2]> = (0..n).map(of).collect();
            // One that is longer than the way to its line would begin beyond that.
            let longest = Large::ALL.iter().filter(|kind| kind.class() == class).map(|kind| kind.extent()).max();
            let longest = longest.unwrap_or(0);
            let fits = fits[class * n..][..n].iter().zip(&lines);
            tables.fits.extend(fits.map(|(&fits, &[line, _])| u32::from(fits && longest <= line)));
            tables.lines.extend(lines);
        }
        for (path, driven) in self.paths.iter().zip(&driven) {
            for k in 0..path.n as usize {
                tables.trails.push(driven.each_ref().map(|driven| trail(driven, k)));
                tables.bands.push(driven.each_ref().map(|driven| band(driven, k)));
            }
        }
        for of_pair in met[1..].iter().flatten() {
            let first = tables.zones.len() as u16;
            tables.zones.extend(of_pair.iter().map(packed));
            let [a, b] = [outwards(of_pair.iter().map(|zone| zone.a)), outwards(of_pair.iter().map(|zone| zone.b))];
            let n = of_pair.len() as u8;
            tables.pairs.push(Pair { first, n, n_all: n, a, b });
        }
        self.large = Some(tables);
        Ok(self)
    }

    /// Where cars have zones, of the pair of paths with this index, on both (m).
    fn stretches(&self, pair: usize) -> impl Iterator<Item = [[f64; 2]; 2]> {
        let Pair { first, n, .. } = self.pairs[pair];
        let of_cars = self.zones[usize::from(first)..][..usize::from(n)].iter().map(Zone::stretch);
        let ends = |low: i32, high: i32| [low, high].map(|s| f64::from(metres(s)));
        of_cars.filter(|of| of.kind != Kind::Soft).map(move |of| [ends(of.a_in, of.a_out), ends(of.b_in, of.b_out)])
    }

    /// The line of a path for a class, and where the lanes are clear that it crosses: the nearer of what cars and what
    /// large vehicles need (2^-10 m).
    fn line_of_class<'a>(&self, a: usize, met: impl Iterator<Item = &'a Vec<Vec<Meeting>>>) -> [i32; 2] {
        let n = self.paths.len();
        let Path { line, clear, .. } = self.paths[a];
        let entry = self.source_of(a).entry;
        let others = |b: &usize| self.source_of(*b).entry != entry;
        let zones: Vec<&Meeting> = met
            .filter(|met| !met.is_empty())
            .flat_map(|met| (0..n).filter(others).flat_map(move |b| &met[a * n + b]))
            .collect();
        // What begins farther before the line lies beside the arm.
        let near = f64::from(metres(line)) - LINE_MOVES;
        let starts = zones.iter().map(|zone| zone.a[0]).filter(|&start| near < start);
        let first = starts.fold(f64::INFINITY, f64::min);
        let nearest = line.min(length((first - BEFORE_ZONE).max(0.0) as f32));
        let crossed =
            zones.iter().filter(|zone| zone.kind == Kind::Cross && (near..first + ENTRY).contains(&zone.a[0]));
        [nearest, crossed.map(|zone| length(zone.a[1] as f32)).fold(clear, i32::max)]
    }
}

fn overlap(one: [f64; 2], other: [f64; 2]) -> bool {
    one[0] <= other[1] && other[0] <= one[1]
}

/// What a class sweeps of a path.
fn bands(points: &Points, driven: &[Driven; N_LARGE], class: usize) -> [Vec<f64>; 2] {
    let of_class = || Large::ALL.iter().zip(driven).filter(move |(kind, _)| kind.class() == class);
    [0, 1].map(|side| {
        let widest = |k: usize| of_class().map(|(_, driven)| driven.bands[side][k]).fold(OF_CAR, f64::max);
        (0..points.len()).map(widest).collect()
    })
}

/// The zones of every pair of paths for two classes; `same` if both are one.
fn meetings(fine: &[Points], bands: [&Bands; 2], same: bool) -> Vec<Vec<Meeting>> {
    let n = fine.len();
    let mut met = vec![Vec::new(); n * n];
    for a in 0..n {
        for b in if same { a..n } else { 0..n } {
            let found = of_pair(&fine[a], &fine[b], [&bands[0][a], &bands[1][b]]);
            if same && a != b {
                met[b * n + a] = found.iter().map(exchanged).collect();
            }
            met[a * n + b] = found;
        }
    }
    met
}

fn transposed(met: &[Vec<Meeting>], n: usize) -> Vec<Vec<Meeting>> {
    let of = |index: usize| met[(index % n) * n + index / n].iter().map(exchanged).collect();
    (0..n * n).map(of).collect()
}

/// The same zone with the paths exchanged.
fn exchanged(zone: &Meeting) -> Meeting {
    let Meeting { a, b, delta, ratio, .. } = *zone;
    // Beside the beginning on a is this station of b.
    let begins = b[0] + (a[0] - (b[0] - delta)) / ratio;
    Meeting { a: b, b: a, delta: a[0] - begins, ratio: 1.0 / ratio, ..*zone }
}

fn of_pair(a: &Points, b: &Points, bands: [&[Vec<f64>; 2]; 2]) -> Vec<Meeting> {
    let widest = |sides: &[Vec<f64>; 2]| sides.iter().flatten().copied().fold(0.0, f64::max);
    let most = widest(bands[0]) + widest(bands[1]) + ROOM;
    let within = |row: usize, index: usize| {
        let between = b.point(index) - a.point(row);
        let side = |along: DVec2, to: DVec2| usize::from(along.perp_dot(to) < 0.0);
        let own = bands[0][side(a.along(row), between)][row];
        let all = own + bands[1][side(b.along(index), -between)][index] + ROOM;
        if a.is_opposite(row, b, index) { all - LESS_IF_OPPOSITE } else { all }
    };
    let mut found = Vec::new();
    for part in components(a, b, most, within, 0..usize::MAX) {
        let is_along = |interval: &Interval| a.angle(interval.row, b, interval.nearest) < SHALLOW;
        for piece in runs(&part, is_along) {
            let Some(nearest) = piece.iter().min_by(|one, other| one.distance.total_cmp(&other.distance)) else {
                continue;
            };
            if is_along(nearest) {
                pieces(piece, &mut found);
            } else {
                let (ends_a, ends_b) = ends(piece);
                let is_opposite = a.is_opposite(nearest.row, b, nearest.nearest);
                found.push(Meeting { a: ends_a, b: ends_b, delta: 0.0, ratio: 1.0, kind: Kind::Cross, is_opposite });
            }
        }
    }
    found
}

/// A long part in runs in which paths run together or cross. A short run is one with that before it: it would only
/// divide who is first through what is one conflict.
fn runs(part: &[Interval], is_along: impl Fn(&Interval) -> bool) -> Vec<&[Interval]> {
    let mut ends = vec![0];
    let mut is_last_along = None;
    if SHORTEST_LONG < part.len() {
        let mut at = 0;
        for run in part.chunk_by(|one, next| is_along(one) == is_along(next)) {
            let along = is_along(&run[0]);
            let is_other = is_last_along.is_some_and(|last| last != along);
            if SHORTEST_RUN < run.len() {
                if is_other {
                    ends.push(at);
                }
                is_last_along = Some(along);
            }
            at += run.len();
        }
    }
    ends.push(part.len());
    ends.windows(2).map(|ends| &part[ends[0]..ends[1]]).collect()
}

/// Where a part begins and ends on both paths (m).
fn ends(part: &[Interval]) -> ([f64; 2], [f64; 2]) {
    let of = |values: fn(&Interval) -> [usize; 2]| {
        let low = part.iter().map(|interval| values(interval)[0]).min().unwrap_or(0);
        let high = part.iter().map(|interval| values(interval)[1]).max().unwrap_or(0);
        [low as f64 * FINE, high as f64 * FINE]
    };
    let earlier = |[from, to]: [f64; 2]| [(from - CORNER).max(0.0), to];
    (earlier(of(|interval| [interval.row; 2])), earlier(of(|interval| [interval.low, interval.high])))
}

/// The zones of a part in which vehicles follow each other.
fn pieces(part: &[Interval], found: &mut Vec<Meeting>) {
    let (mean_a, mean_b, ratio) = fitted(part);
    let off = |interval: &Interval| {
        let [a, b] = [interval.row, interval.nearest].map(|index| index as f64 * FINE);
        (a - mean_a - ratio * (b - mean_b)).abs()
    };
    let worst = part.iter().map(off).fold(0.0, f64::max);
    if UNEVEN < worst && 2 * SHORTEST <= part.len() {
        let (front, back) = part.split_at(part.len() / 2);
        pieces(front, found);
        pieces(back, found);
        return;
    }
    let (a, b) = ends(part);
    let begins = mean_a + ratio * (b[0] - mean_b);
    found.push(Meeting { a, b, delta: b[0] - begins, ratio, kind: Kind::Follow, is_opposite: false });
}

/// The line through the nearest points of both paths: their means, and how far a goes with each metre of b (m).
fn fitted(part: &[Interval]) -> (f64, f64, f64) {
    let n = part.len() as f64;
    let at = |interval: &Interval| [interval.row, interval.nearest].map(|index| index as f64 * FINE);
    let mean = |which: usize| part.iter().map(|interval| at(interval)[which]).sum::<f64>() / n;
    let [mean_a, mean_b] = [mean(0), mean(1)];
    let sum = |of: fn(f64, f64) -> f64| part.iter().map(at).map(|[a, b]| of(a - mean_a, b - mean_b)).sum::<f64>();
    let (both, of_b) = (sum(|a, b| a * b), sum(|_, b| b * b));
    let ratio = if 0.0 < both && 0.0 < of_b { (both / of_b).clamp(0.4, 2.5) } else { 1.0 };
    (mean_a, mean_b, if (ratio - 1.0).abs() < ALIKE { 1.0 } else { ratio })
}

fn packed(zone: &Meeting) -> Zone {
    let station = |s: f64| (s / f64::from(UNIT)).round() as u16;
    let slower = ((1.0 - zone.ratio) * f64::from(RATIO_ONE)).round() as i16;
    Zone {
        a: zone.a.map(station),
        b: zone.b.map(station),
        delta: (zone.delta / f64::from(UNIT)).round() as i16,
        kind: zone.kind as u16 | (slower << 2).cast_unsigned(),
    }
}

/// The point of a path that a sample is.
fn point_of(driven: &Driven, sample: usize) -> usize {
    ((sample as f64 * f64::from(SPACING) / FINE) as usize).min(driven.offsets.len() - 1)
}

fn trail(driven: &Driven, sample: usize) -> Trail {
    let k = point_of(driven, sample);
    let unit = |value: f64| (value * 32_767.0).round() as i16;
    let along = driven.directions[k];
    Trail { direction: [unit(along.x), unit(along.y)], offset: length(driven.offsets[k] as f32) }
}

fn band(driven: &Driven, sample: usize) -> Band {
    let k = point_of(driven, sample);
    let [left, right] = [0, 1].map(|side| (driven.bands[side][k] * 1024.0).ceil() as u16);
    Band { left, right }
}
