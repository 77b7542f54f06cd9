//! The kernels as machine code of a graphics card, without a card.

pub mod null_device;

use null_device::{Stated, check, codes, stated};
use offtrack::engine::stages::{Kernel, SHADERS};

/// What a kernel may take that is not listed. Up to 48 registers leave room for the most subgroups that a unit of RDNA
/// 3 holds at a time, 96 for half of them.
const USUAL: Stated = stated("", 48, 0, 0);

/// What the others may take.
const OTHERS: [Stated; 16] = [
    stated("drive", 96, 0, 0),
    stated("advance", 96, 0, 0),
    stated("traffic_decide", 96, 0, 0),
    stated("traffic_arrive", 96, 0, 0),
    stated("meet", 96, 0, 0),
    stated("observe_around", 96, 0, 0),
    stated("around_both", 96, 0, 0),
    stated("around_after_reset", 96, 0, 0),
    // It keeps what each thread has found in registers, since in workgroup memory it let a third as many subgroups in.
    stated("collide", 120, 3_072, 0),
    stated("sense", 48, 2_560, 0),
    stated("sense_after_reset", 48, 2_560, 0),
    stated("observe", 48, 6_656, 0),
    stated("observe_after_reset", 48, 6_656, 0),
    stated("observe_both", 48, 6_656, 0),
    stated("count", 48, 1_024, 0),
    stated("judge_and_count", 48, 1_024, 0),
];

#[test]
fn no_kernel_takes_more_registers_and_memory_of_a_card_than_stated_and_none_spills() {
    let source: String = SHADERS.iter().flat_map(|(_, text)| [*text, "\n"]).collect();
    let kernels = Kernel::ALL.map(Kernel::name);
    assert!(OTHERS.iter().all(|other| kernels.contains(&other.kernel)));
    let of_kernel = |kernel| {
        let other = OTHERS.into_iter().find(|other| other.kernel == kernel);
        other.unwrap_or(Stated { kernel, ..USUAL })
    };
    let test = "machine_code::no_kernel_takes_more_registers_and_memory_of_a_card_than_stated_and_none_spills";
    check(test, &source, &kernels.map(of_kernel));
}

#[test]
fn registers_that_spill_arrays_that_no_register_holds_and_too_much_workgroup_memory_are_found() {
    let kernel = |name: &str, body: String| {
        format!("@compute @workgroup_size(64) fn {name}(@builtin(local_invocation_index) i: u32) {{ {body} }}\n")
    };
    let (loads, stores): (String, String) = (0..400)
        .map(|n| (format!("let v{n} = held[i + {n}u]; "), format!("held[v{n}] = v{} * v{n}; ", 399 - n)))
        .unzip();
    let array = "var a: array<u32, 512>; for (var n = 0u; n < held[0]; n++) { a[held[n] % 512u] += held[i]; }
                 held[i] = a[held[i] % 512u];";
    let source = [
        "@group(0) @binding(0) var<storage, read_write> held: array<u32>;
         var<workgroup> shared_by_all: array<u32, 8192>;"
            .to_owned(),
        kernel("spilling", format!("{loads} storageBarrier(); {stores}")),
        kernel("indexing", array.to_owned()),
        kernel(
            "sharing",
            "shared_by_all[i] = held[i]; workgroupBarrier(); held[i] = shared_by_all[63u - i];".to_owned(),
        ),
    ]
    .concat();
    let test =
        "machine_code::registers_that_spill_arrays_that_no_register_holds_and_too_much_workgroup_memory_are_found";
    let Some(codes) = codes(test, &source, &["spilling", "indexing", "sharing"]) else { return };
    let most = stated("kernel", 256, 65_536, 0);
    let found: Vec<String> = codes.iter().flat_map(|code| most.above(code)).collect();
    // What is spilled is scratch too.
    assert!(100 < codes[0].spilled_vgprs && 2048 <= codes[1].scratch, "{codes:?}");
    let parts = |part: &str| found.iter().filter(|found| found.contains(part)).count();
    assert_eq!([parts("spilled vector registers"), parts("bytes of scratch a thread")], [1, 2], "{found:?}");
    assert_eq!(found.last().unwrap(), "kernel: 32768 bytes of workgroup memory, 16384 stated");
}
