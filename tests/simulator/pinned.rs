//! Pinned results: what a published benchmark gives today, it gives tomorrow, bit for bit.
//!
//! Whoever changes a hash changes published results. Numbers with a fraction are pinned on the CPU; on a device they
//! differ in the last digits from driver to driver, and what does not is pinned too.

use std::sync::Arc;

use offtrack::layout::Column;
use offtrack::layout::shared::Named;
use offtrack::scenario::Split;
use offtrack::simulator::{Batch, Engine, RouteChoice, Simulator};
use offtrack::world::World;

use crate::{batch_on, benchmark, engines};

/// Hashes of the columns, in the order of [`offtrack::layout::Column`]: 512 trucks on all routes of a benchmark, 300
/// random steps, seed 7.
const PINNED: [(&str, [u64; 11]); 3] = [
    (
        "attard2023",
        [
            0xe875_ad68_2e60_878f,
            0x8cd0_6265_5da3_3742,
            0x911d_f503_88de_b886,
            0x65c5_3135_3f51_12be,
            0x60f3_282f_14ac_1856,
            0x7442_39af_30f6_d48d,
            0x1fd9_93b5_92f0_a5bb,
            0x2158_870e_939f_81cc,
            0x6bbf_2031_401a_e5c1,
            0x9b4e_f716_898e_c8dd,
            0x56b9_9d0a_1461_6bd0,
        ],
    ),
    (
        "attard2023-full",
        [
            0xf4b0_fdf6_a067_87c7,
            0x80a4_01e0_89f9_8b98,
            0x258a_8cec_b7e5_208f,
            0xb26f_476f_2a35_2852,
            0xa952_0983_2d12_19ae,
            0x85c2_caed_963d_3674,
            0x7bd3_3eac_40a6_8d2d,
            0x66d1_8917_3f90_fb75,
            0xf904_6a60_d214_d8c6,
            0xdd23_d164_6d03_8c17,
            0xe1d4_6042_e572_2a9b,
        ],
    ),
    (
        "attard2023-as-run",
        [
            0xe074_800f_f907_f385,
            0x1dda_697e_10a2_3834,
            0xc169_41e3_b15e_c604,
            0xabef_7319_9aec_2034,
            0xdb46_ceab_5803_4b97,
            0x4893_e350_cd78_ab76,
            0x862a_ea60_6683_eae4,
            0xb3b1_ba65_daaf_dc9d,
            0xf7dd_093b_fe1b_d245,
            0x5a7d_e255_3f71_a8ce,
            0x19f9_cac2_0b6f_11db,
        ],
    ),
];

/// 64-bit FNV-1a.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

/// The bytes of a column as they were when they were pinned: fields that came later stand behind those in its rows.
fn published(batch: &Batch, column: Column) -> Vec<u8> {
    let width = match column {
        Column::Control => 12,
        Column::Truck => 64,
        _ => column.width(),
    };
    batch.column(column).chunks_exact(column.width()).flat_map(|row| &row[..width]).copied().collect()
}

/// Hashes of what both engines give to the last bit, of the same trucks: why episodes ended, route, episode and step of
/// each truck, and the waypoints passed.
const PINNED_INTEGERS: [(&str, u64); 3] = [
    ("attard2023", 0x48c8_cba1_098f_6d5b),
    ("attard2023-full", 0xea12_cc9f_5053_302c),
    ("attard2023-as-run", 0x4aa0_1029_58ab_16e9),
];

/// Hashes that python/tests/test_batch.py has too: what a step gives on the training routes of attard2023, to 512
/// trucks after 300 random steps with seed 7, on the CPU.
const PINNED_IN_PYTHON: [(Column, u64); 4] = [
    (Column::Observation, 0x7ff7_f3a1_8924_9b08),
    (Column::Reward, 0x389f_a7d6_00c4_78be),
    (Column::Ended, 0x09a0_a2a2_4afe_7f83),
    (Column::Truck, 0x4872_ed0c_ab20_f30a),
];

#[test]
fn python_sees_these_bytes() {
    let (mut scenario, _) = benchmark("attard2023");
    scenario.keep(&[Split::Train]);
    let world = Arc::new(World::bake(&scenario).unwrap());
    let routes = scenario.split(Split::Train).to_vec();
    let mut simulator = batch_on(&Engine::Cpu, &world, 512, 7, RouteChoice::Drawn(routes));
    (0..300).for_each(|_| simulator.step_at_random());
    let batch = simulator.batch();
    let found = PINNED_IN_PYTHON.map(|(column, _)| (column, hash(&published(batch, column))));
    assert!(found == PINNED_IN_PYTHON, "{found:#x?}");
}

fn after_300_steps(engine: &Engine, name: &str) -> Simulator {
    let world = Arc::new(benchmark(name).1);
    let choice = RouteChoice::Drawn((0..world.routes.len() as u32).collect());
    let mut simulator = batch_on(engine, &world, 512, 7, choice);
    (0..300).for_each(|_| simulator.step_at_random());
    simulator
}

#[test]
fn a_published_benchmark_gives_the_bytes_that_it_has_always_given() {
    for (name, pinned) in PINNED {
        let simulator = after_300_steps(&Engine::Cpu, name);
        let found: Vec<u64> = Column::ALL.iter().map(|&column| hash(&published(simulator.batch(), column))).collect();
        assert!(simulator.batch().extras.iter().flatten().all(|&value| value == 0.0));
        assert_eq!(found[..pinned.len()], pinned, "{name}: {found:#018x?}");
    }
}

#[test]
fn a_published_benchmark_gives_the_same_episodes_on_every_engine() {
    for (_, engine) in engines() {
        for (name, pinned) in PINNED_INTEGERS {
            let simulator = after_300_steps(&engine, name);
            let batch = simulator.batch();
            let rows = batch.truck.iter().zip(&batch.progress).zip(&batch.ended);
            let integers: Vec<u32> = rows
                .flat_map(|((truck, progress), ended)| {
                    [truck.route, truck.episode, truck.steps, progress.waypoint, progress.passed, *ended]
                })
                .collect();
            let found = hash(bytemuck::cast_slice(&integers));
            assert_eq!(found, pinned, "{name}: {found:#018x}");
        }
    }
}
