//! Pages to open, with the test's script in place of the last one.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use offtrack::engine::stages::{N_STORAGE_BUFFERS, WORKGROUP_MEMORY};
use offtrack::layout::Column;
use offtrack::layout::shared::Named;
use offtrack::scenario::Scenario;
use offtrack::world::World;
use offtrack_evaluation::live::{Ground, Live, shown};
use offtrack_policy::Policy;
use serde_json::Value;

use super::served::{Given, given_by};
use crate::page::read;
use crate::place::repository;

/// Does on a page what `jobs` ask for, with the files that they name, and gives what came of it. No compiler says
/// anything of a shader.
pub fn done(page: &str, jobs: &[Value], mut files: HashMap<String, Vec<u8>>) -> Given {
    files.insert("plan".to_owned(), Value::from(jobs).to_string().into_bytes());
    let main = read(&repository().join("evaluation/src/live/main.js"));
    assert!(!main.is_empty() && page.contains(&main), "the page has another last script");
    let given = given_by(&page.replace(&main, include_str!("selftest.js")), files, false);
    // The device was opened with the limits that every device of WebGPU has.
    let limits: Value = serde_json::from_slice(&given["limits"]).unwrap();
    assert_eq!(limits["buffers"], N_STORAGE_BUFFERS);
    assert_eq!(limits["memory"], WORKGROUP_MEMORY);
    assert_eq!(String::from_utf8_lossy(&given["messages"]), "[]", "the compiler says something of the shaders");
    given
}

/// A benchmark as pages have it, baked: one of the program or a file.
pub fn ground(benchmark: &str) -> Ground {
    let scenario = shown(Scenario::find(benchmark).unwrap());
    let world = Arc::new(World::bake(&scenario).unwrap());
    Ground { scenario, world, text: None, is_whole: Scenario::named(benchmark).is_ok() }
}

/// The text of a page of these benchmarks and policies.
pub fn written(grounds: Vec<Ground>, policies: Vec<Policy>, file: &Path) -> String {
    Live { grounds, policies, run: None, baker: None, seed: 0 }.write(file).unwrap();
    read(file)
}

/// The columns of a page's batch, those of other vehicles where it has some.
pub fn own_columns(has_vehicles: bool) -> impl Iterator<Item = Column> {
    Column::ALL.iter().copied().filter(move |column| 0 < column.n_rows(1, has_vehicles))
}

/// The columns of `n_envs` trucks that lie one after the other.
pub fn columns(bytes: &[u8], n_envs: usize, has_vehicles: bool) -> HashMap<Column, &[u8]> {
    let mut rest = bytes;
    let each = own_columns(has_vehicles).map(|column| {
        let (own, others) = rest.split_at(n_envs * column.width());
        rest = others;
        (column, own)
    });
    let all = each.collect();
    assert!(rest.is_empty(), "{} bytes more", rest.len());
    all
}
