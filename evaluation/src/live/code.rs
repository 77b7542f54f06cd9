//! What a host must know of the shaders: their texts, kernels, buffers, layouts and constants.

use std::mem::offset_of;

use offtrack::engine::stages::{Kernel, Threads, module};
use offtrack::engine::tables::{MANY, ROW, team};
use offtrack::engine::{Autoreset, wgsl};
use offtrack::layout::buffers::{Access, BUFFERS, Buffer};
use offtrack::layout::shared::{Field, Literal, Named, Struct};
use offtrack::layout::{
    self, BEGINS, Column, EXTRAS, Ended, HAS_ROUTE, HAS_START, IS_FIRST, N_AROUND, N_CARS, N_EXTRAS, N_RAYS,
    N_TRAILER_RAYS, N_VALUES, OBSERVATION, ROUTE_ROWS, TEAM_MAX, VEHICLE_VALUES, Values, WORKGROUP,
};
use offtrack::simulator::Tally;
use offtrack::traffic::{Car, N_TURNS, Row};
use offtrack_policy::kernel::{self as act, SHAPES, Shape};
use offtrack_policy::{Activation, FILE_LIMIT, KEY, LIMIT, MOST_LAYERS, SAME_ACTION, VERSIONS};
use serde_json::{Map, Value, json};

use super::journal;
use super::packed::Packed;
use crate::recording::BRAKES;

/// The facts, with the texts as sections: each text is several, of which others may have some too.
pub(super) fn printed(packed: &mut Packed) -> Value {
    let (shared, picture) = (wgsl::shared(), wgsl::picture());
    let common = picture.strip_prefix(&shared).unwrap_or_default();
    let mut text = |text: String| -> Vec<usize> {
        let parts = parts(&text, &[&shared, common]);
        parts.into_iter().map(|part| packed.add("shaders", part.as_bytes())).collect()
    };
    // Of policies that read what other vehicles do the second ones.
    let acts = READS_VEHICLES.map(|reads| SHAPES.map(|shape| text(act::source(shape, reads))));
    let brakes = format!(
        "// Acceleration below which brake lights are lit (m/s^2).\nconst BRAKES: f32 = {};\n",
        BRAKES.literal()
    );
    let texts = json!({
        "step": text(module()),
        "act": acts,
        "journal": text(journal::module()),
        "picture": text([picture.clone(), brakes, journal::declared_to_read()].concat()),
    });
    let buffers_of_act = READS_VEHICLES.map(act_buffers);
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
        "n_around": N_AROUND,
        "cars": cars(),
        "roads": roads(),
        "begin": { "begins": BEGINS, "is_first": IS_FIRST, "has_route": HAS_ROUTE, "has_start": HAS_START },
        "ended": Ended::ALL.map(Ended::name),
        "autoreset": {
            "same_step": Autoreset::SameStep as u32,
            "next_step": Autoreset::NextStep as u32,
            "disabled": Autoreset::Disabled as u32,
        },
        "reward_units": Tally { sums: [1; _] }.reward().recip(),
        "observation": OBSERVATION.map(values),
        "around": VEHICLE_VALUES.map(values),
        "extras": EXTRAS.map(|extra| json!({ "name": extra.name, "doc": extra.doc })),
        "structs": structs(),
        "columns": columns(),
        "buffers": buffers(),
        "kernels": kernels(),
        "journal": journal::facts(),
        "act": {
            "buffers": buffers_of_act,
            "shapes": SHAPES.map(shape),
            "activations": Activation::ALL.map(Activation::name),
            "most_layers": MOST_LAYERS,
            "limit": LIMIT,
        },
        "policy": { "key": KEY, "versions": VERSIONS, "same_action": SAME_ACTION, "most_bytes": FILE_LIMIT },
    })
}

/// A number that differs where a page and a file were written by programs that lay out tables otherwise.
pub(super) fn fingerprint() -> u32 {
    let parts = [structs(), buffers(), roads(), columns(), cars()];
    crc32fast::hash(parts.map(|facts| facts.to_string()).concat().as_bytes())
}

/// How routes lie in their table.
fn roads() -> Value {
    json!({ "route_rows": ROUTE_ROWS, "row_bytes": size_of::<[u32; 4]>() })
}

fn columns() -> Value {
    Column::ALL.iter().copied().map(column).collect::<Map<_, _>>().into()
}

fn buffers() -> Value {
    BUFFERS.into_iter().map(buffer).collect()
}

/// Whether a policy reads what other vehicles do, in the order of what is printed for both.
const READS_VEHICLES: [bool; 2] = [false, true];

/// A text in parts, of which some are known ones, in this order.
fn parts<'a>(text: &'a str, known: &[&'a str]) -> Vec<&'a str> {
    let (mut parts, mut rest) = (Vec::new(), text);
    for part in known {
        if let Some((before, after)) = rest.split_once(part) {
            parts.extend([before, part]);
            rest = after;
        }
    }
    parts.push(rest);
    parts.retain(|part| !part.is_empty());
    parts
}

fn values(of: Values) -> Value {
    json!({ "name": of.name, "first": of.first, "n": of.n, "low": of.low, "doc": of.doc })
}

fn column(column: Column) -> (String, Value) {
    let (bytes, element, of_vehicles) = (column.width(), column.element(), column.is_of_vehicles());
    (column.name().to_owned(), json!({ "bytes": bytes, "element": element, "of_vehicles": of_vehicles }))
}

/// Words of a row of the column of cars: what a slot without a car has, and where each is.
fn cars() -> Value {
    json!({
        "n": N_CARS,
        "turns": N_TURNS,
        "words": size_of::<Car>() / 4,
        "what": offset_of!(Car, what) / 4,
        "none": Car::NONE.what,
        "level": offset_of!(Row, level) / 4,
        "hindered": offset_of!(Row, hindered) / 4,
    })
}

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

/// The buffers of the kernel that acts, of a policy that reads what other vehicles do or of another one.
fn act_buffers(reads_vehicles: bool) -> Vec<Value> {
    act::buffers(reads_vehicles).map(|(name, access, ..)| json!({ "name": name, "access": word(access) })).collect()
}

fn shape(shape: Shape) -> Value {
    json!({ "width": shape.width(), "tile": shape.tile(), "threads": shape.threads(), "memory": shape.memory() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_its_parts_one_after_the_other_and_texts_share_what_is_known() {
        let known = ["shared;", "common;"];
        for (text, expected) in [
            ("shared;common;own", vec!["shared;", "common;", "own"]),
            ("first;shared;own;", vec!["first;", "shared;", "own;"]),
            ("own;", vec!["own;"]),
        ] {
            assert_eq!(parts(text, &known), expected);
            assert_eq!(parts(text, &known).concat(), text);
        }
        // What the page holds of the step, the journal and the picture is theirs but what they share.
        let mut packed = Packed::default();
        let code = printed(&mut packed);
        let texts = ["step", "journal", "picture"].map(|name| code["texts"][name].as_array().unwrap().clone());
        assert!(texts.iter().all(|parts| texts[0][0] == parts[0] && 1 < parts.len()), "{texts:?}");
        assert_eq!(texts[1][1], texts[2][1]);
    }
}
