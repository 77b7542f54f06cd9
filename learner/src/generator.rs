//! Random numbers whose state can be kept in a checkpoint: xoshiro256++ of D. Blackman and S. Vigna, "Scrambled Linear
//! Pseudorandom Number Generators" (2021). The simulator needs none: its numbers are functions of where they are drawn.

use rand::{RngCore, SeedableRng};

use super::checkpoint::Stored;
use crate::error::Error;

/// What splitmix64 adds from one number to the next: 2^64 over the golden ratio.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The generator. Its state is all there is to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Generator {
    /// Four words, not all 0.
    pub state: [u64; 4],
}

impl Generator {
    /// The generator whose state is a column of a checkpoint. From all zeros every number would be zero: an error.
    pub fn stored(stored: &Stored, column: &str) -> Result<Generator, Error> {
        let generator = Generator { state: stored.array(column)? };
        if generator.state == [0; 4] {
            Err(stored.error(format!("its column `{column}` is all zeros")))
        } else {
            Ok(generator)
        }
    }
}

impl RngCore for Generator {
    fn next_u32(&mut self) -> u32 {
        (self.next_u64() >> 32) as u32
    }

    fn next_u64(&mut self) -> u64 {
        let [a, b, c, d] = &mut self.state;
        let drawn = a.wrapping_add(*d).rotate_left(23).wrapping_add(*a);
        let shifted = *b << 17;
        *c ^= *a;
        *d ^= *b;
        *b ^= *c;
        *a ^= *d;
        *c ^= shifted;
        *d = d.rotate_left(45);
        drawn
    }

    fn fill_bytes(&mut self, bytes: &mut [u8]) {
        for chunk in bytes.chunks_mut(8) {
            chunk.copy_from_slice(&self.next_u64().to_le_bytes()[..chunk.len()]);
        }
    }
}

impl SeedableRng for Generator {
    type Seed = [u8; 8];

    fn from_seed(seed: [u8; 8]) -> Generator {
        Generator::seed_from_u64(u64::from_le_bytes(seed))
    }

    /// Words of splitmix64, as the authors advise.
    fn seed_from_u64(mut seed: u64) -> Generator {
        let word = |_| {
            seed = seed.wrapping_add(GOLDEN);
            let mixed = (seed ^ (seed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            mixed ^ (mixed >> 31)
        };
        Generator { state: [0; 4].map(word) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_authors_reference() {
        let mut generator = Generator { state: [1, 2, 3, 4] };
        let expected = [41943041, 58720359, 3588806011781223, 3591011842654386, 9228616714210784205];
        assert_eq!(expected.map(|_| generator.next_u64()), expected);
        // The first two words that splitmix64 gives from 0.
        assert_eq!(Generator::seed_from_u64(0).state[..2], [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4]);
    }
}
