//! The tables of a road: plain data of u32 words, as a buffer of a device holds them.

use std::ops::Range;

use bytemuck::{Pod, Zeroable, cast_slice, pod_collect_to_vec};
use glam::Vec2;

use super::Drivers;
use super::drivers::PACE_PARTS;
use super::large::{LargeTables, taken};
use super::units::{FINER_STATION, metres};
use crate::layout::shared::constants;

/// Unit of the stations of zones (m).
pub(super) const UNIT: f32 = 1.0 / 64.0;
/// Unit of the stations of pairs (m).
pub(super) const CELL: f32 = 2.0;

constants! {
    /// Distance between samples of a path (m).
    pub const SPACING: f32 = 2.0;
    /// Bits of a state's station below the distance between samples.
    const SPACING_BITS: u32 = 21;
    /// Bits of a station of decisions below the unit of zones.
    const UNIT_BITS: u32 = 4;
    /// Bits of a station of decisions below the unit of pairs.
    const CELL_BITS: u32 = 11;
    /// Bits of a zone's ratio below 1.
    const ZONE_RATIO_BITS: u32 = 12;
    /// Bit of a zone's kind at which its ratio begins.
    const ZONE_RATIO: u32 = 2;
    /// Bits of a length by which stations along a zone are compared below those of decisions.
    const COARSER: u32 = 5;
    /// Bit of a network's first word that says that there are tables of large vehicles.
    const HAS_LARGE: u32 = 2;
    /// Words before the tables of a road.
    const NETWORK_HEAD: usize = 6;
    /// Words of a path.
    const PATH_WORDS: usize = size_of::<Path>() / 4;
    /// Words of a sample.
    const SAMPLE_WORDS: usize = size_of::<Sample>() / 4;
    /// Words of a pair.
    const PAIR_WORDS: usize = size_of::<Pair>() / 4;
    /// Words of a zone.
    const ZONE_WORDS: usize = size_of::<Zone>() / 4;
    /// Words of a source.
    const SOURCE_WORDS: usize = size_of::<Source>() / 4;
    /// Cars follow each other: code of a zone's kind.
    const FOLLOW: u32 = Kind::Follow as u32;
    /// One car at a time.
    const CROSS: u32 = Kind::Cross as u32;
    /// Who enters yields.
    const SOFT: u32 = Kind::Soft as u32;
    /// Only a vehicle that may need the lanes beside its own yields.
    const WIDE: u32 = Kind::Wide as u32;
}

/// Most paths of a road: a car names its path in ten bits, of which one value means that there is no car.
pub const MOST_PATHS: usize = 1023;
/// Most sources of a road: each has four bits of the backlog.
pub const MOST_SOURCES: usize = 16;
/// Most zones of a road: a pair names its first in 16 bits.
pub(super) const MOST_ZONES: usize = 1 << 16;
/// Units of a zone's ratio in 1.
pub(super) const RATIO_ONE: i16 = 1 << ZONE_RATIO_BITS;

/// A route as cars drive it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Path {
    /// Index of its first sample.
    pub first: u32,
    /// Number of its samples.
    pub n: u32,
    /// Its length (2^-10 m).
    pub length: i32,
    /// Station of the front of a car that waits to enter (2^-10 m).
    pub line: i32,
    /// Station of the rear of a car that has left the last lane which it crosses on its way in; 0 where it crosses none
    /// (2^-10 m).
    pub clear: i32,
    /// Index of its source.
    pub source: u32,
    /// Exit number, counted from the entry.
    pub exit: u32,
    /// Index of the exit arm.
    pub exit_arm: u32,
}

impl Path {
    /// Its length (m).
    pub fn length(&self) -> f32 {
        metres(self.length)
    }

    /// Station of the front of a car that waits to enter (m).
    pub fn line(&self) -> f32 {
        metres(self.line)
    }
}

/// A point of a path.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Sample {
    /// On the centre line (m).
    pub position: Vec2,
    /// Unit vector along the path.
    pub direction: Vec2,
    /// Speed of a car that nothing hinders (2^-14 m a step).
    pub limit: i32,
}

/// How two paths meet.
#[repr(u16)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// They run together, or cross at a small angle: cars follow each other.
    Follow,
    /// They cross: one car at a time.
    Cross,
    /// They stay apart, but who enters yields.
    Soft,
    /// They stay apart; only a vehicle that may need the lanes beside its own yields.
    Wide,
}

impl Kind {
    /// Every kind, in the order of their codes.
    pub const ALL: [Kind; 4] = [Kind::Follow, Kind::Cross, Kind::Soft, Kind::Wide];
}

/// Where path a meets path b.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Zone {
    /// Where the zone begins and ends on a (1/64 m).
    pub a: [u16; 2],
    /// Where it begins and ends on b (1/64 m).
    pub b: [u16; 2],
    /// In a zone that is followed: station on b less that on a (1/64 m).
    pub delta: i16,
    /// Code of its [`Kind`]; above it how far a station on a goes less than a metre for each metre on b (2^-12).
    pub kind: u16,
}

/// A zone in the units of decisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stretch {
    /// Where it begins on a (2^-10 m).
    pub a_in: i32,
    /// Where it ends on a (2^-10 m).
    pub a_out: i32,
    /// Where it begins on b (2^-10 m).
    pub b_in: i32,
    /// Where it ends on b (2^-10 m).
    pub b_out: i32,
    /// Station on b less that on a (2^-10 m).
    pub delta: i32,
    /// How far a station on a goes less than a metre for each metre on b, within the zone (2^-12).
    pub slower: i32,
    /// How the paths meet.
    pub kind: Kind,
}

impl Stretch {
    /// The station on a that is beside one on b (2^-10 m).
    pub(super) fn beside(&self, station: i32) -> i32 {
        let within = station.clamp(self.b_in, self.b_out) - self.b_in;
        station - self.delta - (((within >> 2) * self.slower) >> (ZONE_RATIO_BITS - 2))
    }

    /// Whether a vehicle on b, with its front at a station, is ahead of one on a; both find the same (2^-10 m).
    pub(super) fn is_ahead(&self, own: i32, its: i32, its_slot_is_lower: bool) -> bool {
        let [mine, its] = if self.slower == 0 {
            [own, its - self.delta]
        } else {
            // By the parts of the zone that they have driven: what both find is alike to the last bit.
            let part = |own: i32, length: i32| (own >> COARSER) * (length >> COARSER);
            [part(own - self.a_in, self.b_out - self.b_in), part(its - self.b_in, self.a_out - self.a_in)]
        };
        mine < its || (mine == its && its_slot_is_lower)
    }
}

impl Zone {
    /// The zone in the units of decisions.
    pub fn stretch(&self) -> Stretch {
        let [a_in, a_out, b_in, b_out] =
            [self.a[0], self.a[1], self.b[0], self.b[1]].map(|s| i32::from(s) << UNIT_BITS);
        let kind = Kind::ALL[usize::from(self.kind & 3)];
        let slower = i32::from(self.kind.cast_signed() >> ZONE_RATIO);
        Stretch { a_in, a_out, b_in, b_out, delta: i32::from(self.delta) << UNIT_BITS, slower, kind }
    }
}

/// The cell of a pair's ends that a station lies in, or the first or last one (2^-10 m).
pub(super) fn cell(station: i32) -> u8 {
    (station >> CELL_BITS).clamp(0, 255) as u8
}

/// The zones of an ordered pair of paths.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Pair {
    /// Index of the first.
    pub first: u16,
    /// How many of them are for cars.
    pub n: u8,
    /// How many there are with those of the kind [`Kind::Wide`], which stand last.
    pub n_all: u8,
    /// Where the first begins and the last ends on a (2 m, outwards).
    pub a: [u8; 2],
    /// The same on b.
    pub b: [u8; 2],
}

/// A lane of an arm, from which cars come.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Source {
    /// Index of the arm.
    pub entry: u32,
    /// The lane, counted from the kerb.
    pub lane: u32,
    /// Index of the first of its paths, which stand together.
    pub first: u32,
    /// Number of its paths.
    pub n: u32,
}

/// A road's tables.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Whether its lanes go round a central island.
    pub has_ring: bool,
    /// Number of arms.
    pub n_arms: usize,
    /// In the order of the road's routes.
    pub paths: Vec<Path>,
    /// Those of one path after those of the path before it.
    pub samples: Vec<Sample>,
    /// Of paths a and b at index a n + b.
    pub pairs: Vec<Pair>,
    /// Those of one pair after those of the pair before it.
    pub zones: Vec<Zone>,
    /// In the order of their paths.
    pub sources: Vec<Source>,
    /// Those of large vehicles, where there may be some.
    pub large: Option<LargeTables>,
}

impl Network {
    /// Position and direction of travel at a station of a path: cubic between samples (m).
    pub fn pose(&self, path: usize, station: f32) -> (Vec2, Vec2) {
        let (k, t) = self.span(path, station);
        let [from, to] = [&self.samples[k], &self.samples[k + 1]];
        (between(from, to, t), (from.direction + t * (to.direction - from.direction)).normalize_or_zero())
    }

    /// The position of [`pose`](Self::pose) alone (m).
    pub fn position(&self, path: usize, station: f32) -> Vec2 {
        let (k, t) = self.span(path, station);
        between(&self.samples[k], &self.samples[k + 1], t)
    }

    /// The sample before a station of a path, and the fraction of the way from it to the next.
    pub(super) fn span(&self, path: usize, station: f32) -> (usize, f32) {
        let Path { first, n, .. } = self.paths[path];
        let along = (station / SPACING).clamp(0.0, n as f32 - 1.001);
        let k = along as usize;
        (first as usize + k, along - k as f32)
    }

    /// Speed of a car that nothing hinders, at a station of a path: linear between samples (2^-14 m a step, 2^-20 m).
    pub fn limit(&self, path: usize, station: i32) -> i32 {
        let Path { first, n, .. } = self.paths[path];
        let k = (station >> SPACING_BITS).clamp(0, n as i32 - 2);
        let whole = 1 << CELL_BITS;
        let t = ((station - (k << SPACING_BITS)) >> FINER_STATION).clamp(0, whole);
        let k = first as usize + k as usize;
        (self.samples[k].limit * (whole - t) + self.samples[k + 1].limit * t) >> CELL_BITS
    }

    /// The same road, on which all drive at another speed where nothing hinders them.
    pub(crate) fn driven_by(mut self, drivers: Drivers) -> Network {
        self.samples.iter_mut().for_each(|sample| sample.limit = sample.limit * drivers.pace() / PACE_PARTS);
        self
    }

    /// The zones of an ordered pair of paths, those for a truck alone among them.
    pub fn zones_of(&self, a: usize, b: usize) -> &[Zone] {
        let Pair { first, n_all, .. } = self.pairs[a * self.paths.len() + b];
        &self.zones[usize::from(first)..][..usize::from(n_all)]
    }

    /// The source of a path.
    pub fn source_of(&self, path: usize) -> &Source {
        &self.sources[self.paths[path].source as usize]
    }

    /// Indices of the paths of a source.
    pub fn paths_of(&self, source: usize) -> Range<usize> {
        let Source { first, n, .. } = self.sources[source];
        first as usize..(first + n) as usize
    }

    /// The tables as one buffer of words: how much there is of each, then paths, samples, pairs, zones and sources.
    pub fn words(&self) -> Vec<u32> {
        let counts = [self.paths.len(), self.samples.len(), self.zones.len(), self.sources.len(), self.n_arms];
        let head = counts.map(|count| count as u32);
        let large = self.large.as_ref().map(LargeTables::words);
        let has_large = if large.is_some() { HAS_LARGE } else { 0 };
        let tables = [
            &[u32::from(self.has_ring) | has_large],
            &head[..],
            cast_slice(&self.paths),
            cast_slice(&self.samples),
            &pod_collect_to_vec::<Pair, u32>(&self.pairs),
            &pod_collect_to_vec::<Zone, u32>(&self.zones),
            cast_slice(&self.sources),
            &large.unwrap_or_default(),
        ];
        tables.concat()
    }

    /// The tables that these words are; `None` if they are none.
    pub(super) fn parsed(words: &[u32]) -> Option<Network> {
        let (head, mut rest) = words.split_at_checked(NETWORK_HEAD)?;
        let [flags, n_paths, n_samples, n_zones, n_sources, n_arms] = head else { return None };
        let n_paths = *n_paths as usize;
        if MOST_PATHS < n_paths || 1 | HAS_LARGE < *flags {
            return None;
        }
        let mut network = Network {
            has_ring: flags & 1 == 1,
            n_arms: *n_arms as usize,
            paths: taken(&mut rest, n_paths)?,
            samples: taken(&mut rest, *n_samples as usize)?,
            pairs: taken(&mut rest, n_paths * n_paths)?,
            zones: taken(&mut rest, *n_zones as usize)?,
            sources: taken(&mut rest, *n_sources as usize)?,
            large: None,
        };
        if flags & HAS_LARGE == HAS_LARGE {
            network.large = Some(LargeTables::taken(&mut rest, n_paths, *n_samples as usize)?);
        }
        (rest.is_empty() && network.is_whole()).then_some(network)
    }

    /// Whether every index lies in its table.
    fn is_whole(&self) -> bool {
        let (n_samples, n_zones, n_sources) = (self.samples.len(), self.zones.len(), self.sources.len());
        let within = |first: u32, n: u32, of: usize| first as usize + n as usize <= of;
        self.paths.iter().all(|path| 2 <= path.n && within(path.first, path.n, n_samples))
            && self.paths.iter().all(|path| (path.source as usize) < n_sources)
            && self
                .pairs
                .iter()
                .all(|pair| pair.n <= pair.n_all && within(pair.first.into(), pair.n_all.into(), n_zones))
            && self.sources.iter().all(|source| within(source.first, source.n, self.paths.len()))
            && n_sources <= MOST_SOURCES
    }
}

/// The position this fraction of the way from one sample to the next (m).
fn between(from: &Sample, to: &Sample, t: f32) -> Vec2 {
    let (t2, t3) = (t * t, t * t * t);
    (2.0 * t3 - 3.0 * t2 + 1.0) * from.position
        + (t3 - 2.0 * t2 + t) * SPACING * from.direction
        + (3.0 * t2 - 2.0 * t3) * to.position
        + (t3 - t2) * SPACING * to.direction
}
