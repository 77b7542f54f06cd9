//! Many roads at once, on all cores. A cache keeps which attempts were valid.

use std::collections::BTreeMap;
use std::sync::Mutex;

use rayon::prelude::*;

use super::{Distribution, RandomRoad, Reason, Refused};
use crate::files::cache::Loading;
use crate::files::reader::Error;

/// Indices that share an entry of the cache.
const CHUNK: u32 = 64;
/// Words of a road in an entry: index, attempt and the counts of refused draws.
const WORDS: usize = 2 + Reason::ALL.len();
/// Kind and version of the entries.
pub(super) const KIND: &str = "roads-1";

/// Roads of a cache's entry: the attempt that was valid, and the draws refused before it.
type Known = BTreeMap<u32, (u32, Refused)>;

impl Distribution {
    /// The roads of these indices, in their order: each the same as [`Distribution::road`] gives.
    ///
    /// # Errors
    ///
    /// The errors of [`Distribution::road`], and [`Error::Stopped`].
    pub fn roads(&self, seed: u32, indices: &[u32], loading: &Loading) -> Result<Vec<RandomRoad>, Error> {
        let mut chunks: BTreeMap<u32, Known> = indices.iter().map(|&index| (index / CHUNK, Known::new())).collect();
        if let Some(cache) = loading.cache {
            for (&chunk, known) in &mut chunks {
                *known = cache.get(KIND, &self.key(seed, chunk)).map(|bytes| parsed(&bytes)).unwrap_or_default();
            }
        }
        let done = Mutex::new(0);
        let road = |&index: &u32| {
            loading.check()?;
            let road = match chunks.get(&(index / CHUNK)).and_then(|known| known.get(&index)) {
                Some(&(attempt, refused)) => {
                    self.known(seed, index, attempt, refused).map_or_else(|| self.road(seed, index), Ok)
                }
                None => self.road(seed, index),
            };
            loading.count("drawing roads", &done, indices.len());
            road
        };
        let roads: Vec<RandomRoad> = indices.par_iter().map(road).collect::<Result<_, _>>()?;
        if let Some(cache) = loading.cache {
            let mut changed = BTreeMap::<u32, Known>::new();
            for road in &roads {
                let known = &chunks[&(road.index / CHUNK)];
                if known.get(&road.index) != Some(&(road.attempt, road.refused)) {
                    let entry = changed.entry(road.index / CHUNK).or_insert_with(|| known.clone());
                    entry.insert(road.index, (road.attempt, road.refused));
                }
            }
            for (chunk, known) in changed {
                cache.put(KIND, &self.key(seed, chunk), &bytes(&known));
            }
        }
        Ok(roads)
    }

    /// The road of an attempt that was valid before, if it is.
    fn known(&self, seed: u32, index: u32, attempt: u32, refused: Refused) -> Option<RandomRoad> {
        let (roundabout, written) = (refused.total() == attempt).then(|| self.attempt(seed, index, attempt).ok())??;
        Some(RandomRoad { roundabout, seed, index, attempt, refused, written })
    }

    /// All that the roads of a chunk depend on.
    pub(super) fn key(&self, seed: u32, chunk: u32) -> Vec<u8> {
        [self.text.as_bytes(), &seed.to_le_bytes(), &chunk.to_le_bytes()].concat()
    }
}

pub(super) fn bytes(known: &Known) -> Vec<u8> {
    let words =
        known.iter().flat_map(|(&index, &(attempt, Refused(counts)))| [index, attempt].into_iter().chain(counts));
    words.flat_map(u32::to_le_bytes).collect()
}

fn parsed(bytes: &[u8]) -> Known {
    let words: Vec<u32> =
        bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
    let entry = |entry: &[u32]| {
        let mut refused = Refused::default();
        refused.0.copy_from_slice(&entry[2..]);
        (entry[0], (entry[1], refused))
    };
    words.chunks_exact(WORDS).map(entry).collect()
}
