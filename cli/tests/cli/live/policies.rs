//! Policies on the page: the kernel that acts, and files that cannot drive.

use std::collections::HashMap;

use bytemuck::cast_slice;
use offtrack::layout::{N_EXTRAS, N_VALUES};
use offtrack::scenario::Split;
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack_evaluation::live::Ground;
use offtrack_policy::{Activation, Frames, Layer, Padding, Policy};
use serde_json::{Value, json};

use super::page::{done, ground, written};
use super::served::Given;
use crate::place::Place;

/// Trucks of a batch that acts.
const N_ENVS: usize = 4096;
/// Outputs that lie nearer together than this may fall otherwise: a device need not fuse multiply-adds.
const TIE: f32 = 1e-4;
/// Largest difference of the outputs that the page's scripts compute for one truck: in 64-bit floats.
const NEAR: f32 = 2e-4;

/// Observations and extras that a policy has met on the way.
struct Seen {
    observations: Vec<[f32; N_VALUES]>,
    extras: Vec<[f32; N_EXTRAS]>,
}

impl Seen {
    fn of(ground: &Ground, policy: &Policy) -> Seen {
        let routes = RouteChoice::Drawn(ground.scenario.split(Split::Test).to_vec());
        let mut simulator = Simulator::new(ground.world.clone(), N_ENVS / 8, 5, routes).unwrap();
        let (mut observations, mut extras) = (Vec::new(), Vec::new());
        while observations.len() < N_ENVS {
            observations.extend(&simulator.batch().observation);
            extras.extend(&simulator.batch().extras);
            for _ in 0..12 {
                let batch = simulator.batch();
                let actions = policy.act_beside(&batch.observation, &batch.extras);
                simulator.step(&actions).unwrap();
            }
        }
        Seen { observations, extras }
    }
}

/// Rows for which the page chose an action whose output is clearly not the largest.
fn others(policy: &Policy, seen: &Seen, name: &str, given: &Given) -> usize {
    let logits = policy.logits_beside(&seen.observations, &seen.extras);
    let actions: &[u32] = cast_slice(&given[&format!("{name}.action")]);
    assert_eq!(actions.len(), N_ENVS);
    let rows = logits.chunks_exact(policy.actions.len()).zip(actions);
    rows.filter(|(row, action)| {
        let most = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        row[**action as usize] < most - TIE
    })
    .count()
}

/// A policy like another one, with its hidden layers so wide.
fn of_width(policy: &Policy, width: usize, activation: Activation) -> Policy {
    let weight = |index: usize| ((index * 2_654_435_761) % 1000) as f32 / 5000.0 - 0.1;
    let layer = |inputs: usize, outputs: usize| Layer {
        weights: (0..inputs * outputs).map(weight).collect(),
        biases: (0..outputs).map(weight).collect(),
    };
    let n_values = N_VALUES + policy.extras.len();
    let layers = vec![layer(n_values, width), layer(width, policy.actions.len())];
    Policy { layers, activation, ..policy.clone() }
}

fn job(kind: &str, name: &str, world: usize) -> Value {
    json!({ "kind": kind, "name": name, "file": name, "world": world, "n": N_ENVS })
}

#[test]
fn a_policy_chooses_in_a_browser_what_it_chooses_on_the_processor_and_a_wrong_number_of_it_is_noticed() {
    let place = Place::new();
    let grounds = ["attard2023", "laden2026"].map(ground);
    let [plain, laden] = ["attard2023", "laden2026"].map(|name| Policy::shipped(name).unwrap());
    let mut wrong = plain.clone();
    wrong.normalisation.factor.iter_mut().for_each(|factor| *factor *= 1.001);
    let policies = [
        ("plain", 0, plain.clone()),
        ("wrong", 0, wrong),
        ("laden", 1, laden.clone()),
        ("tanh", 0, of_width(&plain, 200, Activation::Tanh)),
        ("wide", 1, of_width(&laden, 500, Activation::Relu)),
        ("wider", 0, of_width(&plain, 1021, Activation::Relu)),
    ];
    let seen = [Seen::of(&grounds[0], &plain), Seen::of(&grounds[1], &laden)];
    let mut files = HashMap::new();
    for (name, world, policy) in &policies {
        files.insert((*name).to_owned(), policy.to_bytes());
        files.insert(format!("{name}.observation"), cast_slice(&seen[*world].observations).to_vec());
        files.insert(format!("{name}.extras"), cast_slice(&seen[*world].extras).to_vec());
    }
    let jobs: Vec<Value> = policies.iter().map(|(name, world, _)| job("act", name, *world)).collect();
    let page = written(grounds.into(), Vec::new(), &place.file("page.html"));
    let given = done(&page, &jobs, files);
    for (name, world, policy) in &policies {
        let expected = if *name == "wrong" { &plain } else { policy };
        let others = others(expected, &seen[*world], name, &given);
        assert_eq!(*name == "wrong", 0 < others, "{name}: {others} other actions");
        let logits = policy.logits_beside(&seen[*world].observations, &seen[*world].extras);
        let outputs: &[f32] = cast_slice(&given[&format!("{name}.outputs")]);
        let apart = outputs.iter().zip(&logits).map(|(here, there)| (here - there).abs()).fold(0.0, f32::max);
        assert!(64 * policy.actions.len() == outputs.len() && apart < NEAR, "{name}: outputs {apart} apart");
    }
}

#[test]
fn a_file_that_is_no_policy_for_the_benchmark_is_refused_in_words() {
    let place = Place::new();
    let [plain, laden] = ["attard2023", "laden2026"].map(|name| Policy::shipped(name).unwrap());
    let whole = plain.to_bytes();
    let mut damaged = whole.clone();
    *damaged.last_mut().unwrap() ^= 1;
    let mut turned = plain.clone();
    turned.actions[0].steering += 0.1;
    let mut cut = plain.clone();
    cut.layers.remove(0);
    let mut endless = plain.clone();
    endless.layers[0].biases[3] = f32::INFINITY;
    // A word of the header is another one of the same length.
    let reworded = |from: &str, to: &str| {
        let at = whole.windows(from.len()).position(|bytes| bytes == from.as_bytes()).unwrap();
        assert_eq!(from.len(), to.len());
        [&whole[..at], to.as_bytes(), &whole[at + from.len()..]].concat()
    };
    let stacked = Policy { frames: Frames { n: 2, padding: Padding::Zero }, ..plain.clone() };
    let cases: [(&str, Vec<u8>, &str); 19] = [
        ("whole", whole.clone(), "it drives"),
        ("empty", Vec::new(), "is not a policy file, or is damaged: it is too short"),
        ("text", b"policy = \"mine\"\n".to_vec(), "is not a policy file, or is damaged"),
        ("cut", whole[..whole.len() / 2].to_vec(), "does not lie in the file"),
        ("damaged", damaged, "is damaged: its checksum"),
        ("laden", laden.to_bytes(), "learned with other extras beside the observation"),
        ("among", Policy::shipped("traffic2026").unwrap().to_bytes(), "reads what other vehicles do, which attard2023"),
        ("stacked", stacked.to_bytes(), "has the key “frames”: a page drives by layers over the values of one step"),
        ("turned", turned.to_bytes(), "learned with another action table: 9 actions"),
        (
            "shape",
            of_width(&Policy { actions: plain.actions[1..].to_vec(), ..plain.clone() }, 8, Activation::Relu).to_bytes(),
            "learned with another action table: 8 actions",
        ),
        ("layers", cut.to_bytes(), "is of another shape"),
        ("version", reworded(r#"\"version\":1"#, r#"\"version\":3"#), "is a policy file of version 3"),
        // The end of the first row is no more.
        ("rows", reworded("],[", ",0,"), "is a damaged policy file: its action table has a row that is not a steer"),
        ("type", reworded(r#""F32""#, r#""F16""#), "must hold 32-bit floats"),
        ("header", reworded(r#""shape":[69]"#, r#""shape":{69}"#), "its header is no JSON"),
        ("nameless", reworded(r#"\"actions\""#, r#"\"actionz\""#), "no layers, far too many, or no actions"),
        ("description", reworded(r#"\"actions\":[["#, r#"\"actions\":7["#), "its description is no JSON"),
        ("endless", endless.to_bytes(), "is not finite"),
        (
            "wide",
            of_width(&plain, 1025, Activation::Relu).to_bytes(),
            "is too wide for this page: a layer has 1025 outputs, at most 1024 fit",
        ),
    ];
    let jobs: Vec<Value> = cases.iter().map(|(name, ..)| job("refuse", name, 0)).collect();
    let files = cases.iter().map(|(name, bytes, _)| ((*name).to_owned(), bytes.clone())).collect();
    let page = written(vec![ground("attard2023")], Vec::new(), &place.file("page.html"));
    let given = done(&page, &jobs, files);
    for (name, _, expected) in cases {
        let said = String::from_utf8_lossy(&given[&format!("{name}.said")]);
        assert!(said.contains(expected), "{name}: {said}");
    }
}
