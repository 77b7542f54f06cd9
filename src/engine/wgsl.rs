//! What shaders share with Rust, printed as WGSL.

use crate::engine::stages::SHADERS;
use crate::engine::{autoreset, cpu, tables, tally};
use crate::field;
use crate::layout::{self, buffers};
use crate::layout::{angle, random};
use crate::traffic;

/// `shaders/layout.wgsl`: constants, structs and the buffers of a step.
pub fn layout() -> String {
    [shared(), buffers::printed()].concat()
}

/// What shaders of a picture know of a batch: constants, structs, tables and columns by the bindings that they have in
/// a step, to be read alone, and the functions that a step's shaders share, of other vehicles too.
pub fn picture() -> String {
    let common = SHADERS
        .iter()
        .filter(|(name, _)| name.starts_with("common/") || ["traffic/cars", "traffic/large"].contains(name));
    [shared(), buffers::printed_to_read()].into_iter().chain(common.map(|(_, text)| format!("\n{text}"))).collect()
}

/// Constants and structs alone, for shaders with buffers of their own.
pub fn shared() -> String {
    [
        "// What shaders share with Rust. Printed by src/engine/wgsl.rs from the layout and the constants beside each\n// stage: change those.\n\n"
            .to_owned(),
        layout::printed_constants(),
        angle::printed_constants(),
        field::printed_constants(),
        random::printed_constants(),
        cpu::steer::printed_constants(),
        cpu::drive::printed_constants(),
        cpu::collide::printed_constants(),
        cpu::perceive::printed_constants(),
        cpu::sense::printed_constants(),
        cpu::observe::printed_constants(),
        traffic::printed_constants(),
        cpu::traffic::printed_constants(),
        cpu::around::printed_constants(),
        cpu::along::printed_constants(),
        tables::printed_constants(),
        tally::printed_constants(),
        autoreset::printed_constants(),
        "\n".to_owned(),
        layout::printed_codes(),
        "\n".to_owned(),
        layout::printed_structs(),
    ]
    .concat()
}
