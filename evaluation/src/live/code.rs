//! What a host must know of the shaders: their texts, kernels, buffers, layouts and constants.

use offtrack::engine::stages::{Kernel, Threads, module};
use offtrack::engine::tables::{MANY, ROW, team};
use offtrack::engine::{Autoreset, wgsl};
use offtrack::layout::buffers::{Access, BUFFERS, Buffer};
use offtrack::layout::shared::{Field, Struct};
use offtrack::layout::{
    self, BEGINS, Column, EXTRAS, Ended, HAS_ROUTE, HAS_START, IS_FIRST, N_EXTRAS, N_RAYS, N_TRAILER_RAYS, N_VALUES,
    OBSERVATION, ROUTE_ROWS, TEAM_MAX, WORKGROUP,
};
use offtrack::simulator::Tally;
use offtrack_policy::kernel::{self as act, SHAPES, Shape};
use offtrack_policy::{Activation, KEY, LIMIT, MOST_LAYERS, SAME_ACTION, VERSION};
use serde_json::{Map, Value, json};

use super::journal;
use super::packed::Packed;

/// The facts, with the texts as sections.
pub(super) fn printed(packed: &mut Packed) -> Value {
    let mut text = |text: String| packed.add("shaders", text.as_bytes());
    let texts = json!({
        "step": text(module()),
        "act": SHAPES.map(|shape| text(act::source(shape, false))),
        "journal": text(journal::module()),
        "picture": text([wgsl::picture(), journal::declared_to_read()].concat()),
    });
    json!({
        "texts": texts,
        "workgroup": WORKGROUP,
        "row": ROW,
        // A team's trucks, from so many trucks of a batch on.
        "teams": [[0, team(0)], [MANY, TEAM_MAX]],
        "n_values": N_VALUES,
        "n_rays": N_RAYS,
        "n_trailer_rays": N_TRAILER_RAYS,
        "n_extras": N_EXTRAS,
        "roads": roads(),
        "begin": { "begins": BEGINS, "is_first": IS_FIRST, "has_route": HAS_ROUTE, "has_start": HAS_START },
        "ended": Ended::ALL.map(Ended::name),
        "autoreset": {
            "same_step": Autoreset::SameStep as u32,
            "next_step": Autoreset::NextStep as u32,
            "disabled": Autoreset::Disabled as u32,
        },
        "reward_units": Tally { sums: [1; _] }.reward().recip(),
        "observation": OBSERVATION
            .map(|of| json!({ "name": of.name, "first": of.first, "n": of.n, "low": of.low, "doc": of.doc })),
        "extras": EXTRAS.map(|extra| json!({ "name": extra.name, "doc": extra.doc })),
        "structs": structs(),
        "columns": Column::of_trucks()
            .map(|column| (column.name().to_owned(), json!({ "bytes": column.width(), "element": column.element() })))
            .collect::<Map<_, _>>(),
        "buffers": buffers(),
        "kernels": kernels(),
        "journal": journal::facts(),
        "act": {
            "buffers": act::BUFFERS.map(|(name, access, ..)| json!({ "name": name, "access": word(access) })),
            "shapes": SHAPES.map(shape),
            "activations": Activation::ALL.map(Activation::name),
            "most_layers": MOST_LAYERS,
            "limit": LIMIT,
        },
        "policy": { "key": KEY, "version": VERSION, "same_action": SAME_ACTION, "most_bytes": FILE_LIMIT },
    })
}

/// A number that differs where a page and a file were written by programs that lay out tables otherwise.
pub(super) fn fingerprint() -> u32 {
    crc32fast::hash([structs(), buffers(), roads()].map(|facts| facts.to_string()).concat().as_bytes())
}

/// How routes lie in their table.
fn roads() -> Value {
    json!({ "route_rows": ROUTE_ROWS, "row_bytes": size_of::<[u32; 4]>() })
}

fn buffers() -> Value {
    BUFFERS.into_iter().map(buffer).collect()
}

/// Most bytes of a policy file that is dropped on the page.
const FILE_LIMIT: usize = 64 << 20;

fn buffer(buffer: Buffer) -> Value {
    let kind = match buffer {
        Buffer::Table(_) => "table",
        Buffer::Column(_) => "column",
        Buffer::Tally => "tally",
    };
    json!({ "name": buffer.name(), "kind": kind, "access": word(buffer.access()) })
}

fn word(access: Access) -> &'static str {
    match access {
        Access::Uniform => "uniform",
        Access::Read => "read",
        Access::ReadWrite | Access::Count => "read_write",
    }
}

/// Bindings of each kernel, and what a thread of it works on.
fn kernels() -> Map<String, Value> {
    let kernel = |kernel: Kernel| {
        let threads = match kernel.threads() {
            Threads::Truck => "truck",
            Threads::Team => "team",
            Threads::Value => "value",
            Threads::Car => "car",
            Threads::Turn => "turn",
        };
        let bindings: Vec<usize> = kernel.buffers().iter().map(|buffer| buffer.binding()).collect();
        (kernel.name().to_owned(), json!({ "bindings": bindings, "threads": threads }))
    };
    Kernel::ALL.map(kernel).into_iter().collect()
}

fn structs() -> Value {
    let field = |field: &Field| {
        let doc = field.doc.trim();
        // A unit stands last, in parentheses.
        let unit = doc.strip_suffix(").").and_then(|doc| doc.rsplit_once(" (")).map(|(_, unit)| unit);
        (field.name.to_owned(), json!({ "at": field.offset, "type": field.wgsl, "unit": unit, "doc": doc }))
    };
    let one = |of: &Struct| {
        let fields: Map<_, _> = of.fields.iter().map(field).collect();
        (of.name.to_owned(), json!({ "size": of.size, "fields": fields }))
    };
    [layout::structs(), act::structs(), journal::structs()].concat().iter().map(one).collect::<Map<_, _>>().into()
}

fn shape(shape: Shape) -> Value {
    json!({ "width": shape.width(), "tile": shape.tile(), "threads": shape.threads(), "memory": shape.memory() })
}
