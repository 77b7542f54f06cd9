//! Whole runs: 64 trucks, 300 steps, from the same seed.

use std::collections::HashMap;
use std::sync::Arc;

use bytemuck::cast_slice;
use offtrack::layout::Column;
use offtrack::simulator::{Autoreset, RouteChoice, Simulator};
use offtrack::world::World;
use offtrack_evaluation::live::Ground;
use offtrack_policy::{Policy, greedy};
use serde_json::{Value, json};

use super::compare::agreements;
use super::page::{columns, done, ground, own_columns, written};
use super::served::Given;
use crate::page::read;
use crate::place::{Place, offtrack, succeed};

pub const N_ENVS: usize = 64;
pub const N_STEPS: usize = 300;
pub const SEED: u32 = 3;

/// Largest difference of what is observed of other vehicles: positions of the middle of a crowd, in f32.
const AROUND: f32 = 1e-4;

/// A run: the index of its benchmark and its policy on the page, what follows an end, the only demand.
#[derive(Clone, Copy)]
pub struct Run {
    pub world: usize,
    pub policy: Option<usize>,
    pub autoreset: Autoreset,
    pub demand: Option<usize>,
}

impl Run {
    pub fn name(&self) -> String {
        format!("{}-{:?}-{:?}-{:?}", self.world, self.policy, self.autoreset, self.demand)
    }

    /// What the page is to do.
    pub fn job(&self) -> Value {
        let autoreset = match self.autoreset {
            Autoreset::SameStep => "same_step",
            Autoreset::NextStep => "next_step",
            Autoreset::Disabled => "disabled",
        };
        json!({
            "kind": "run", "name": self.name(), "world": self.world, "policy": self.policy, "autoreset": autoreset,
            "n": N_ENVS, "steps": N_STEPS, "seed": SEED, "demand": self.demand,
        })
    }

    /// Where the page's run is another one than that of the CPU engine.
    pub fn difference(&self, world: &Arc<World>, policies: &[Policy], given: &Given) -> Result<(), String> {
        let routes = (0..world.routes.len() as u32).collect();
        let mut simulator = Simulator::new(world.clone(), N_ENVS, SEED, RouteChoice::Drawn(routes)).unwrap();
        simulator.set_autoreset(self.autoreset);
        let part = |part: &str| given[&format!("{}.{part}", self.name())].as_slice();
        self.agrees("before the first step", &simulator, &[false; N_ENVS], part("first"))?;
        let stepped: Vec<Column> = [Column::Truck, Column::Action, Column::Ended, Column::Cars]
            .into_iter()
            .filter(|column| 0 < column.n_rows(1, world.traffic.is_some()))
            .collect();
        let size = N_ENVS * stepped.iter().map(|column| column.width()).sum::<usize>();
        let steps: Vec<&[u8]> = part("steps").chunks_exact(size).collect();
        assert_eq!(steps.len(), N_STEPS);
        let mut held = [false; N_ENVS];
        for (step, bytes) in steps.into_iter().enumerate() {
            held = std::array::from_fn(|env| simulator.batch().truck[env].held == 1);
            match self.policy {
                None => simulator.step_at_random(),
                Some(index) => {
                    let batch = simulator.batch();
                    let outputs = policies[index].logits_among(&batch.observation, &batch.extras, &batch.around);
                    simulator.step(&greedy(&outputs, world.actions.len())).unwrap();
                }
            }
            let mut rest = bytes;
            for &column in &stepped {
                let there = rest.split_off(..N_ENVS * column.width()).unwrap_or_default();
                self.compared(&format!("step {step}"), &simulator, &held, column, there)?;
            }
        }
        self.agrees("after the last step", &simulator, &held, part("last"))?;
        let sums: Vec<String> = serde_json::from_slice(part("tally")).unwrap();
        let expected = simulator.tally().unwrap().sums.map(|sum| sum.to_string());
        if sums == expected { Ok(()) } else { Err(format!("{}: the tally {sums:?}, not {expected:?}", self.name())) }
    }

    fn agrees(&self, when: &str, simulator: &Simulator, held: &[bool], bytes: &[u8]) -> Result<(), String> {
        let has_vehicles = !simulator.batch().cars.is_empty();
        let there = columns(bytes, N_ENVS, has_vehicles);
        own_columns(has_vehicles).try_for_each(|column| self.compared(when, simulator, held, column, there[&column]))
    }

    /// Compares a column after a step in which some trucks were `held`.
    fn compared(
        &self,
        when: &str,
        simulator: &Simulator,
        held: &[bool],
        column: Column,
        there: &[u8],
    ) -> Result<(), String> {
        let here = simulator.batch().column(column);
        if column.is_of_vehicles() {
            return self.compared_vehicles(when, column, here, there);
        }
        // The action of a truck that is held may be any.
        let counted: Vec<bool> = held.iter().map(|held| column != Column::Action || !held).collect();
        match agreements(column, here, there, &counted).iter().find(|agreement| !agreement.holds()) {
            Some(agreement) => Err(format!("{}, {when}: {agreement}", self.name())),
            None => Ok(()),
        }
    }

    /// Compares a column of other vehicles: cars to the last bit, as they are integers.
    fn compared_vehicles(&self, when: &str, column: Column, here: &[u8], there: &[u8]) -> Result<(), String> {
        let apart = |(here, there): (&f32, &f32)| (here - there).abs();
        let is_alike = |(here, there): (&[u8], &[u8])| match column {
            Column::Cars => here == there,
            _ => cast_slice(here).iter().zip(cast_slice(there)).map(apart).all(|apart| apart < AROUND),
        };
        let width = column.width();
        let rows = here.chunks_exact(width).zip(there.chunks_exact(width));
        let unlike = rows.filter(|&rows| !is_alike(rows)).count();
        assert_eq!(here.len(), there.len(), "{column:?}");
        if unlike == 0 { Ok(()) } else { Err(format!("{}, {when}: {unlike} rows of {column:?}", self.name())) }
    }
}

#[test]
fn trucks_in_a_browser_drive_as_on_the_processor_at_random_and_by_the_policy_whatever_follows_an_end() {
    let place = Place::new();
    let names = ["attard2023", "laden2026", "transfer2026"];
    let file = place.text("page.html");
    let mut arguments = vec!["web", "-o", &file];
    for name in names {
        arguments.extend(["--benchmark", name, "--policy", name]);
    }
    succeed(&offtrack(&arguments));
    let modes = [Autoreset::SameStep, Autoreset::NextStep, Autoreset::Disabled];
    let mut runs: Vec<Run> = modes.map(|autoreset| Run { world: 0, policy: None, autoreset, demand: None }).into();
    runs.extend(modes.map(|autoreset| Run { world: 0, policy: Some(0), autoreset, demand: None }));
    for world in 1..names.len() {
        runs.extend([None, Some(world)].map(|policy| Run {
            world,
            policy,
            autoreset: Autoreset::SameStep,
            demand: None,
        }));
    }
    let jobs: Vec<Value> = runs.iter().map(Run::job).collect();
    let given = done(&read(&place.file("page.html")), &jobs, HashMap::new());
    let grounds = names.map(ground);
    let policies = names.map(|name| Policy::shipped(name).unwrap());
    for run in runs {
        run.difference(&grounds[run.world].world, &policies, &given).unwrap();
    }
}

#[test]
fn a_world_with_a_number_that_is_off_by_a_thousandth_drives_otherwise_in_a_browser() {
    let place = Place::new();
    let right = ground("attard2023");
    let mut world = World::clone(&right.world);
    world.rigs[0].slip *= 1.001;
    let wrong = Ground { scenario: right.scenario.clone(), world: Arc::new(world), text: None, is_whole: false };
    let policies = vec![Policy::shipped("attard2023").unwrap()];
    let page = written(vec![wrong], policies.clone(), &place.file("page.html"));
    let runs = [None, Some(0)].map(|policy| Run { world: 0, policy, autoreset: Autoreset::SameStep, demand: None });
    let given = done(&page, &runs.map(|run| run.job()), HashMap::new());
    for run in runs {
        let difference = run.difference(&right.world, &policies, &given).unwrap_err();
        assert!(difference.contains("step") && difference.contains("truck."), "{difference}");
    }
}
