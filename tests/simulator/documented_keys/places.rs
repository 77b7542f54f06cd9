//! Where a key stands in a TOML document: `arm[].name` is at `arm[0].name`.
//!
//! In a key `[]` is the first element that has the rest of the key, NAME in capitals any key of a table, and `*` any
//! tables on the way.

use toml::Value;

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    Key(String),
    Element(usize),
}

/// A key as its parts: `arm[].name` is `arm`, `[]`, `name`.
pub fn parts(key: &str) -> Vec<&str> {
    let part = |part| if let Some(list) = str::strip_suffix(part, "[]") { vec![list, "[]"] } else { vec![part] };
    key.split('.').flat_map(part).collect()
}

fn is_any(part: &str) -> bool {
    !part.is_empty() && part.bytes().all(|letter| letter.is_ascii_uppercase())
}

/// Places one step further in.
fn behind(step: Step, places: Vec<Vec<Step>>) -> Vec<Vec<Step>> {
    places.into_iter().map(|place| [std::slice::from_ref(&step), &place].concat()).collect()
}

/// The places of a key in a document.
pub fn places(value: &Value, parts: &[&str]) -> Vec<Vec<Step>> {
    let [first, rest @ ..] = parts else { return vec![vec![]] };
    match value {
        Value::Array(list) if *first == "[]" => {
            let found =
                list.iter().enumerate().map(|(index, element)| behind(Step::Element(index), places(element, rest)));
            found.into_iter().find(|places| !places.is_empty()).unwrap_or_default()
        }
        // `*` goes through the first element of a list, too.
        Value::Array(list) if *first == "*" => {
            list.first().map(|element| behind(Step::Element(0), places(element, parts))).unwrap_or_default()
        }
        Value::Table(table) => {
            let of_child = |(key, child): (&String, &Value)| {
                let mut found = Vec::new();
                if *first == "*" {
                    found = places(child, parts);
                }
                if *first == "*" || is_any(first) || first == key {
                    found.extend(places(child, rest));
                }
                behind(Step::Key(key.clone()), found)
            };
            table.iter().flat_map(of_child).collect()
        }
        _ => Vec::new(),
    }
}

/// The part of a key that follows `place`, where the key goes through it.
pub fn next<'a>(parts: &[&'a str], place: &[Step]) -> Option<&'a str> {
    match (parts, place) {
        ([name, ..], []) => Some(name),
        (["[]", parts @ ..], [Step::Element(_), place @ ..]) => next(parts, place),
        (["*", rest @ ..], [_, place @ ..]) => next(rest, place).or_else(|| next(parts, place)),
        ([name, parts @ ..], [Step::Key(key), place @ ..]) if name == key || is_any(name) => next(parts, place),
        _ => None,
    }
}

/// Every table of a document; of a list of tables the first.
pub fn tables(value: &Value) -> Vec<Vec<Step>> {
    match value {
        Value::Table(table) => {
            let children = table.iter().flat_map(|(key, child)| behind(Step::Key(key.clone()), tables(child)));
            std::iter::once(vec![]).chain(children).collect()
        }
        Value::Array(list) => list.first().map(|first| behind(Step::Element(0), tables(first))).unwrap_or_default(),
        _ => Vec::new(),
    }
}

/// A place as errors write it: `arm[0].name`.
pub fn written(place: &[Step]) -> String {
    let part = |step: &Step| match step {
        Step::Key(key) => format!(".{key}"),
        Step::Element(index) => format!("[{index}]"),
    };
    place.iter().map(part).collect::<String>().trim_start_matches('.').to_owned()
}

pub fn at<'a>(document: &'a Value, place: &[Step]) -> &'a Value {
    place.iter().fold(document, |value, step| match step {
        Step::Key(key) => &value[key.as_str()],
        Step::Element(index) => &value[*index],
    })
}

fn at_mut<'a>(document: &'a mut Value, place: &[Step]) -> &'a mut Value {
    place.iter().fold(document, |value, step| match step {
        Step::Key(key) => &mut value[key.as_str()],
        Step::Element(index) => &mut value[*index],
    })
}

/// The document with another value at a place, whose last step may be a new key.
pub fn with(document: &Value, place: &[Step], value: Value) -> Value {
    let mut document = document.clone();
    let (last, tables) = place.split_last().unwrap();
    match (at_mut(&mut document, tables), last) {
        (Value::Table(table), Step::Key(key)) => drop(table.insert(key.clone(), value)),
        (Value::Array(list), Step::Element(index)) => list[*index] = value,
        (other, step) => panic!("{other} has no {step:?}"),
    }
    document
}

/// The document without the key at a place.
pub fn without(document: &Value, place: &[Step]) -> Value {
    let mut document = document.clone();
    let (last, tables) = place.split_last().unwrap();
    match (at_mut(&mut document, tables), last) {
        (Value::Table(table), Step::Key(key)) => drop(table.remove(key)),
        (other, step) => panic!("{other} has no {step:?}"),
    }
    document
}
