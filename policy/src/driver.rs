//! A policy at the wheel of several trucks: what it remembers of each, from one step to the next.

use std::borrow::Cow;

use offtrack::layout::{N_AROUND, N_EXTRAS, N_VALUES};

use crate::network::Pass;
use crate::policy::{Policy, greedy};
use crate::recurrent::Recurrent;

/// A policy that drives `n_envs` trucks. Of one without a memory it remembers nothing.
///
/// What it gives for a truck depends on what that truck has observed since its episode began, and on nothing else: not
/// on the other trucks, on its place among them, or on the number of threads, to the last bit.
#[derive(Debug, Clone)]
pub struct Driver {
    policy: Policy,
    /// Whether the next observation of a truck is the first of an episode, `[n_envs]`.
    begins: Vec<bool>,
    /// The last frames of each truck, `[n_envs * frames * values]`; empty where a policy sees one.
    stacks: Vec<f32>,
    /// What the recurrent layers keep of each truck, `[n_envs * kept]`.
    kept: Vec<f32>,
}

impl Driver {
    /// Puts a policy at the wheel of trucks whose episodes begin.
    ///
    /// # Panics
    ///
    /// As [`Policy::logits`], where it acts.
    pub fn new(policy: Policy, n_envs: usize) -> Driver {
        let n_kept = policy.recurrent.as_ref().map_or(0, Recurrent::n_kept);
        let n_stack = policy.n_remembered() - n_kept;
        Driver {
            policy,
            begins: vec![true; n_envs],
            stacks: vec![0.0; n_envs * n_stack],
            kept: vec![0.0; n_envs * n_kept],
        }
    }

    /// The policy.
    pub fn policy(&self) -> &Policy {
        &self.policy
    }

    /// Number of trucks.
    pub fn n_envs(&self) -> usize {
        self.begins.len()
    }

    /// Forgets what it remembers of a truck: its next observation is the first one of an episode.
    ///
    /// # Panics
    ///
    /// Where there is no such truck.
    pub fn begin(&mut self, env: usize) {
        self.begins[env] = true;
    }

    /// The last layer's outputs for what the trucks `envs` observe now, `[envs * outputs]`, with the extras beside it.
    /// Each truck stands among them once at most.
    ///
    /// # Panics
    ///
    /// Where there is no such truck, without an observation or extras for each, and as [`Policy::logits`].
    pub fn outputs(
        &mut self,
        envs: &[usize],
        observations: &[[f32; N_VALUES]],
        extras: &[[f32; N_EXTRAS]],
    ) -> Vec<f32> {
        self.outputs_among(envs, observations, extras, &[])
    }

    /// The same, with what is observed of other vehicles, `[envs]`; empty for a policy that does not read it.
    ///
    /// # Panics
    ///
    /// As [`Driver::outputs`], and where the policy reads what is not given.
    pub fn outputs_among(
        &mut self,
        envs: &[usize],
        observations: &[[f32; N_VALUES]],
        extras: &[[f32; N_EXTRAS]],
        around: &[[f32; N_AROUND]],
    ) -> Vec<f32> {
        assert!(envs.len() == observations.len() && envs.len() == extras.len(), "an observation and extras a truck");
        let Driver { policy, begins, stacks, kept } = self;
        let mut rows = policy.read(observations, extras, around);
        if policy.frames.n != 1 {
            if policy.normalises_frames() {
                rows = Cow::Owned(policy.normalisation.apply_rows(&rows));
            }
            let (n_values, n_stacked) = (policy.n_values(), policy.n_stacked());
            let mut stacked = Vec::with_capacity(envs.len() * n_stacked);
            for (&env, frame) in envs.iter().zip(rows.chunks_exact(n_values)) {
                let stack = &mut stacks[env * n_stacked..][..n_stacked];
                policy.frames.push(stack, frame, begins[env]);
                stacked.extend_from_slice(stack);
            }
            rows = Cow::Owned(stacked);
        }
        let outputs = if let Some(recurrent) = &policy.recurrent {
            let n_kept = recurrent.n_kept();
            let (before, behind) = policy.layers.split_at(recurrent.after);
            let pass = Pass { activates_last: true, ..policy.pass(before) };
            let mut gathered = Vec::with_capacity(envs.len() * n_kept);
            for &env in envs {
                let kept = &mut kept[env * n_kept..][..n_kept];
                if begins[env] {
                    kept.fill(0.0);
                }
                gathered.extend_from_slice(kept);
            }
            let hidden = recurrent.step(&pass.outputs(&rows), &mut gathered);
            for (&env, gathered) in envs.iter().zip(gathered.chunks_exact(n_kept)) {
                kept[env * n_kept..][..n_kept].copy_from_slice(gathered);
            }
            Pass { normalisation: None, ..policy.pass(behind) }.outputs(&hidden)
        } else {
            policy.pass(&policy.layers).outputs(&rows)
        };
        envs.iter().for_each(|&env| begins[env] = false);
        outputs
    }

    /// The index of the most probable action for what the trucks `envs` observe now, `[envs]`.
    ///
    /// # Panics
    ///
    /// As [`Driver::outputs`], and for a policy whose outputs are commands.
    pub fn act(&mut self, envs: &[usize], observations: &[[f32; N_VALUES]], extras: &[[f32; N_EXTRAS]]) -> Vec<u32> {
        self.policy.assert_levels();
        greedy(&self.outputs(envs, observations, extras), self.policy.actions.len())
    }

    /// The commands for what the trucks `envs` observe now, `[envs * commands]`, each in -1..=1.
    ///
    /// # Panics
    ///
    /// As [`Driver::outputs`], and for a policy whose outputs are values of actions.
    pub fn commands(
        &mut self,
        envs: &[usize],
        observations: &[[f32; N_VALUES]],
        extras: &[[f32; N_EXTRAS]],
    ) -> Vec<f32> {
        self.policy.assert_continuous();
        let outputs = self.outputs(envs, observations, extras);
        self.policy.head.commands(outputs)
    }
}
