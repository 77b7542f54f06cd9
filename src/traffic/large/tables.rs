//! What the tables of a road have more where large vehicles drive on it: words of a buffer as all tables.

use bytemuck::{Pod, Zeroable, cast_slice, pod_collect_to_vec};
use glam::Vec2;

use super::{Large, N_CLASSES, N_LARGE};
use crate::layout::shared::constants;
use crate::traffic::network::{MOST_ZONES, Pair, Zone};
use crate::traffic::units::metres;
use crate::traffic::{Car, Network, Path};

constants! {
    /// Words before the tables of large vehicles: how many zones there are.
    const LARGE_HEAD: usize = 1;
    /// Words of a line and of where crossed lanes are clear behind it.
    const LINE_WORDS: usize = 2;
    /// Words of the trails of a sample.
    const TRAIL_WORDS: usize = N_LARGE * size_of::<Trail>() / 4;
    /// Words of the bands of a sample.
    const BAND_WORDS: usize = N_LARGE * size_of::<Band>() / 4;
    /// Pairs of classes of which one is of large vehicles.
    const LARGE_PAIRS: usize = N_CLASSES * N_CLASSES - 1;
    /// Units of a trail's direction in 1.
    const TRAIL_UNITS: f32 = 32_767.0;
    /// Units of a band in a metre.
    const BAND_UNITS: f32 = 1024.0;
}

/// Where a large vehicle is when the point that its last unit follows is beside a sample.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Trail {
    /// Unit vector along the last unit (1/32767).
    pub direction: [i16; 2],
    /// How far that point is to the left of the path (2^-10 m).
    pub offset: i32,
}

impl Trail {
    /// Along the last unit; not quite of length 1.
    pub(in crate::traffic) fn along(&self) -> Vec2 {
        Vec2::from(self.direction.map(f32::from)) / TRAIL_UNITS
    }

    /// How far the point is to the left of the path (m).
    pub(in crate::traffic) fn offset(&self) -> f32 {
        metres(self.offset)
    }
}

/// The room that a large vehicle sweeps beside a sample.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Band {
    /// To the left (1/1024 m).
    pub left: u16,
    /// To the right (1/1024 m).
    pub right: u16,
}

impl Band {
    /// How far its middle is to the left of the path, and half its width (m).
    pub(in crate::traffic) fn middle(&self) -> (f32, f32) {
        let [left, right] = [self.left, self.right].map(|side| f32::from(side) / BAND_UNITS);
        (0.5 * (left - right), 0.5 * (left + right))
    }
}

/// The tables of large vehicles on a road.
#[derive(Debug, Clone, PartialEq)]
pub struct LargeTables {
    /// Line of each path, and where lanes that it crosses are clear, of class c and path p at index c n + p (2^-10 m).
    pub lines: Vec<[i32; 2]>,
    /// Whether a class can take a path without the lanes of those who come the other way, at the same indices: 0 or 1.
    pub fits: Vec<u32>,
    /// Of each sample the trail of each kind.
    pub trails: Vec<[Trail; N_LARGE]>,
    /// Of each sample the band of each kind.
    pub bands: Vec<[Band; N_LARGE]>,
    /// Of a pair of classes, of which one at least is of large vehicles, the pairs of paths.
    pub pairs: Vec<Pair>,
    /// Their zones.
    pub zones: Vec<Zone>,
}

impl LargeTables {
    /// The zones of path a for a vehicle of a class with path b for one of another, in a road with so many paths; one
    /// of both classes at least is not 0.
    pub(in crate::traffic) fn pair(&self, n_paths: usize, classes: [usize; 2], [a, b]: [usize; 2]) -> &Pair {
        let of_classes = classes[0] * N_CLASSES + classes[1] - 1;
        &self.pairs[(of_classes * n_paths + a) * n_paths + b]
    }

    pub(in crate::traffic) fn words(&self) -> Vec<u32> {
        let LargeTables { lines, fits, trails, bands, pairs, zones } = self;
        let tables = [
            &[zones.len() as u32],
            cast_slice(lines),
            fits,
            cast_slice(trails),
            cast_slice(bands),
            &pod_collect_to_vec::<Pair, u32>(pairs),
            &pod_collect_to_vec::<Zone, u32>(zones),
        ];
        tables.concat()
    }

    /// The tables that these words begin with, for a road with so many paths and samples; `None` if they are none.
    pub(in crate::traffic) fn taken(words: &mut &[u32], n_paths: usize, n_samples: usize) -> Option<LargeTables> {
        let (head, rest) = words.split_at_checked(LARGE_HEAD)?;
        *words = rest;
        let tables = LargeTables {
            lines: taken(words, N_CLASSES * n_paths)?,
            fits: taken(words, N_CLASSES * n_paths)?,
            trails: taken(words, n_samples)?,
            bands: taken(words, n_samples)?,
            pairs: taken(words, LARGE_PAIRS * n_paths * n_paths)?,
            zones: taken(words, head[0] as usize)?,
        };
        let is_whole = |pair: &Pair| usize::from(pair.first) + usize::from(pair.n_all) <= tables.zones.len();
        (tables.zones.len() <= MOST_ZONES && tables.pairs.iter().all(|pair| is_whole(pair) && pair.n == pair.n_all))
            .then_some(tables)
    }
}

impl Network {
    /// Where the line is that a kind of large vehicle follows, at a station of a path, and the direction of its last
    /// unit when that has come there: linear between samples (m).
    pub(in crate::traffic) fn trail(&self, path: usize, station: f32, kind: Large) -> (Vec2, Vec2) {
        let (position, along) = self.pose(path, station);
        let Some(large) = &self.large else { return (position, along) };
        let (k, t) = self.span(path, station);
        let [from, to] = [k, k + 1].map(|k| &large.trails[k][kind as usize - 1]);
        let offset = from.offset() + t * (to.offset() - from.offset());
        let direction = from.along() + t * (to.along() - from.along());
        (position + offset * along.perp(), direction.normalize_or(along))
    }

    /// The room that a kind of large vehicle sweeps beside a sample of a path: how far its middle is to the left, and
    /// half its width (m).
    pub(in crate::traffic) fn band(&self, path: usize, sample: usize, kind: Large) -> (f32, f32) {
        let at = self.paths[path].first as usize + sample;
        self.large.as_ref().map_or((0.0, kind.shape().half_width), |large| large.bands[at][kind as usize - 1].middle())
    }

    /// Station of the line of a car, and where it is clear of the lanes that it crosses on its way in (2^-10 m).
    pub(in crate::traffic) fn line_of(&self, car: &Car) -> [i32; 2] {
        let Path { line, clear, .. } = self.paths[car.path()];
        let of = |large: &LargeTables| large.lines[car.class() * self.paths.len() + car.path()];
        self.large.as_ref().map_or([line, clear], of)
    }

    /// Whether a large vehicle, or a car, can take a path without the lanes of those who come the other way, and
    /// begins before its line.
    pub(in crate::traffic) fn fits(&self, car: &Car) -> bool {
        let index = car.class() * self.paths.len() + car.path();
        self.large.as_ref().is_none_or(|large| large.fits[index] == 1)
    }
}

/// The next `n` values of a table, of which `words` then has the rest.
pub(in crate::traffic) fn taken<T: Pod>(words: &mut &[u32], n: usize) -> Option<Vec<T>> {
    let n_words = n.checked_mul(size_of::<T>())?.checked_div(4)?;
    let (table, rest) = words.split_at_checked(n_words)?;
    *words = rest;
    Some(pod_collect_to_vec(table))
}
