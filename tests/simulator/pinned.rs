//! Pinned results: what a published benchmark gives today, it gives tomorrow, bit for bit.
//!
//! The hashes are of the CPU engine. Whoever changes them changes published results.

use std::sync::Arc;

use offtrack::simulator::{Engine, RouteChoice};

use crate::{batch_on, benchmark};

/// Hashes of the columns, in the order of [`offtrack::layout::Column`]: 512 trucks on all routes of a benchmark, 300
/// random steps, seed 7.
const PINNED: [(&str, [u64; 11]); 3] = [
    (
        "attard2023",
        [
            0x7b4e_1f3c_9bdb_6117,
            0x3ca5_e2e4_237d_1d1b,
            0x74fc_6b44_3432_7e43,
            0xd37b_d32d_6f95_2621,
            0x383f_00c3_d183_a99d,
            0x9857_3fa3_b052_57a1,
            0xbded_95e0_0736_9b57,
            0xd168_35bf_7d53_cbb3,
            0x6bbf_2031_401a_e5c1,
            0x2014_dc82_9d7e_b490,
            0xdbae_dbb3_cea5_3d3e,
        ],
    ),
    (
        "attard2023-full",
        [
            0x0fbf_37b0_21ff_5b4f,
            0x03c7_6107_77f1_d618,
            0xf6c6_ff8b_5d8c_d12d,
            0x9222_de75_7287_d96d,
            0x1abb_e648_9459_d5e0,
            0x6766_5f50_a073_2576,
            0xc2b2_45f8_14b3_2785,
            0xc129_32d7_468b_c353,
            0xf904_6a60_d214_d8c6,
            0x793b_d8a0_be38_2a0f,
            0xd14b_3e12_4c9f_a932,
        ],
    ),
    (
        "attard2023-as-run",
        [
            0x33f9_aaef_eb00_bf72,
            0xdcb0_2b60_8b9d_f108,
            0x35b2_7a9a_d927_3cf6,
            0x0ab4_6f3b_ed30_145d,
            0x5afc_8a59_171a_a355,
            0x1909_87b4_4588_ca4c,
            0xb642_da6d_473e_e62b,
            0xac57_7c72_070d_667d,
            0xf7dd_093b_fe1b_d245,
            0xd427_0a4b_888f_a122,
            0x3b8b_29ff_ce66_e647,
        ],
    ),
];

/// 64-bit FNV-1a.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

#[test]
fn a_published_benchmark_gives_the_bytes_that_it_has_always_given() {
    for (name, pinned) in PINNED {
        let world = Arc::new(benchmark(name).1);
        let choice = RouteChoice::Drawn((0..world.routes.len() as u32).collect());
        let mut simulator = batch_on(&Engine::Cpu, &world, 512, 7, choice);
        (0..300).for_each(|_| simulator.step_at_random());
        for ((column, bytes), pinned) in simulator.batch().columns().into_iter().zip(pinned) {
            assert_eq!(hash(bytes), pinned, "{name}: {column:?}");
        }
    }
}
