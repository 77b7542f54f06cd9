//! Whole runs: 64 trucks, 300 steps, from the same seed.

use std::collections::HashMap;
use std::sync::Arc;

use offtrack::layout::{Column, Truck};
use offtrack::simulator::{Autoreset, RouteChoice, Simulator};
use offtrack::world::World;
use offtrack_evaluation::live::Ground;
use offtrack_policy::Policy;
use serde_json::{Value, json};

use super::compare::agreements;
use super::page::{columns, done, ground, written};
use super::served::Given;
use crate::page::read;
use crate::place::{Place, offtrack, succeed};

pub const N_ENVS: usize = 64;
pub const N_STEPS: usize = 300;
pub const SEED: u32 = 3;

/// A run: the index of its benchmark and its policy on the page, what follows an end.
#[derive(Clone, Copy)]
pub struct Run {
    pub world: usize,
    pub policy: Option<usize>,
    pub autoreset: Autoreset,
}

impl Run {
    pub fn name(&self) -> String {
        format!("{}-{:?}-{:?}", self.world, self.policy, self.autoreset)
    }

    /// What the page is to do.
    fn job(&self) -> Value {
        let autoreset = match self.autoreset {
            Autoreset::SameStep => "same_step",
            Autoreset::NextStep => "next_step",
            Autoreset::Disabled => "disabled",
        };
        json!({
            "kind": "run", "name": self.name(), "world": self.world, "policy": self.policy, "autoreset": autoreset,
            "n": N_ENVS, "steps": N_STEPS, "seed": SEED,
        })
    }

    /// Where the page's run is another one than that of the CPU engine.
    pub fn difference(&self, world: &Arc<World>, policies: &[Policy], given: &Given) -> Result<(), String> {
        let routes = (0..world.routes.len() as u32).collect();
        let mut simulator = Simulator::new(world.clone(), N_ENVS, SEED, RouteChoice::Drawn(routes)).unwrap();
        simulator.set_autoreset(self.autoreset);
        let part = |part: &str| given[&format!("{}.{part}", self.name())].as_slice();
        self.agrees("before the first step", &simulator, &[false; N_ENVS], part("first"))?;
        let size = N_ENVS * (size_of::<Truck>() + 2 * size_of::<u32>());
        let steps: Vec<&[u8]> = part("steps").chunks_exact(size).collect();
        assert_eq!(steps.len(), N_STEPS);
        let mut held = [false; N_ENVS];
        for (step, bytes) in steps.into_iter().enumerate() {
            held = std::array::from_fn(|env| simulator.batch().truck[env].held == 1);
            match self.policy {
                None => simulator.step_at_random(),
                Some(index) => {
                    let batch = simulator.batch();
                    simulator.step(&policies[index].act_beside(&batch.observation.clone(), &batch.extras)).unwrap();
                }
            }
            let (trucks, rest) = bytes.split_at(N_ENVS * size_of::<Truck>());
            let (actions, ended) = rest.split_at(N_ENVS * size_of::<u32>());
            for (column, there) in [(Column::Truck, trucks), (Column::Action, actions), (Column::Ended, ended)] {
                self.compared(&format!("step {step}"), &simulator, &held, column, there)?;
            }
        }
        self.agrees("after the last step", &simulator, &held, part("last"))?;
        let sums: Vec<String> = serde_json::from_slice(part("tally")).unwrap();
        let expected = simulator.tally().unwrap().sums.map(|sum| sum.to_string());
        if sums == expected { Ok(()) } else { Err(format!("{}: the tally {sums:?}, not {expected:?}", self.name())) }
    }

    fn agrees(&self, when: &str, simulator: &Simulator, held: &[bool], bytes: &[u8]) -> Result<(), String> {
        let there = columns(bytes, N_ENVS);
        Column::of_trucks().try_for_each(|column| self.compared(when, simulator, held, column, there[&column]))
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
        // The action of a truck that is held may be any.
        let counted: Vec<bool> = held.iter().map(|held| column != Column::Action || !held).collect();
        match agreements(column, here, there, &counted).iter().find(|agreement| !agreement.holds()) {
            Some(agreement) => Err(format!("{}, {when}: {agreement}", self.name())),
            None => Ok(()),
        }
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
    let mut runs: Vec<Run> = modes.map(|autoreset| Run { world: 0, policy: None, autoreset }).into();
    runs.extend(modes.map(|autoreset| Run { world: 0, policy: Some(0), autoreset }));
    for world in 1..names.len() {
        runs.extend([None, Some(world)].map(|policy| Run { world, policy, autoreset: Autoreset::SameStep }));
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
    let wrong = Ground { scenario: right.scenario.clone(), world: Arc::new(world), text: None };
    let policies = vec![Policy::shipped("attard2023").unwrap()];
    let page = written(vec![wrong], policies.clone(), &place.file("page.html"));
    let runs = [None, Some(0)].map(|policy| Run { world: 0, policy, autoreset: Autoreset::SameStep });
    let given = done(&page, &runs.map(|run| run.job()), HashMap::new());
    for run in runs {
        let difference = run.difference(&right.world, &policies, &given).unwrap_err();
        assert!(difference.contains("step") && difference.contains("truck."), "{difference}");
    }
}
