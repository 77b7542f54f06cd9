//! A batch's state as Python keeps it: columns as bytes, and what else goes into a copy.

use std::borrow::Cow;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use offtrack::layout::{Column, Ended, Stream};
use offtrack::simulator::Tally;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::Batch;
use super::arguments::{column_of, unfit};
use super::state::State;
use crate::errors;
use crate::infos::{End, Episode};
use crate::observed::N_VALUES_MAX;

/// What `last_ended` gives: trucks, codes, routes, observations, vehicles.
pub(super) type GivenEnds<'py> = (Vec<usize>, Vec<u32>, Vec<u32>, PyReadonlyArray2<'py, f32>, Vec<u32>);

impl Batch {
    /// Columns as bytes, `[num_envs, width]`.
    pub(super) fn columns<'py>(&self, py: Python<'py>, names: &[String]) -> PyResult<Vec<Bound<'py, PyArray2<u8>>>> {
        let columns = names.iter().map(|name| column_of(name)).collect::<PyResult<Vec<Column>>>()?;
        let state = self.state()?;
        state.check_process(&self.device)?;
        let read = state.simulator.read(&columns).map_err(|error| errors::of_simulator(&error))?;
        let shaped =
            |bytes: &Cow<[u8]>| PyArray1::from_slice(py, bytes).reshape([self.n_envs, bytes.len() / self.n_envs]);
        read.iter().map(shaped).collect()
    }

    /// Goes on from every column's bytes and from streams, or stays as it was.
    pub(super) fn restore(
        &self,
        py: Python,
        columns: &[(String, PyReadonlyArray1<u8>)],
        streams: &[(u32, u32)],
    ) -> PyResult<()> {
        let mut given = Vec::new();
        for (name, bytes) in columns {
            given.push((column_of(name)?, bytes.as_slice().map_err(|_| unfit(name, "contiguous"))?));
        }
        let streams: Vec<Stream> = streams.iter().map(|&(seed, env)| Stream { seed, env }).collect();
        let mut state = self.state()?;
        state.check_process(&self.device)?;
        let State { simulator, pool, .. } = &mut *state;
        let bytes_of = |column| given.iter().find(|(known, _)| *known == column).map(|(_, bytes)| *bytes);
        let restored = pool.run(py, || {
            let before = simulator.streams();
            simulator.set_streams(&streams)?;
            simulator.restore(bytes_of).inspect_err(|_| drop(simulator.set_streams(&before)))
        })?;
        restored.map_err(|error| errors::of_simulator(&error))?;
        state.look()
    }

    /// Sums over all steps.
    pub(super) fn sums(&self) -> PyResult<Tally> {
        let state = self.state()?;
        state.check_process(&self.device)?;
        state.tally()
    }

    /// Counts on from the sums of another batch's tally in the same world, and tells the episodes that its last step
    /// ended.
    pub(super) fn take_up(&self, sums: &[i64], ends: Option<GivenEnds>) -> PyResult<()> {
        let mut state = self.state()?;
        state.check_process(&self.device)?;
        let before = state.simulator.tally().map_err(|error| errors::of_simulator(&error))?;
        if sums.len() != before.sums.len() {
            return Err(PyValueError::new_err("progress: the sums of a tally are needed"));
        }
        let ends = ends.map(|ends| self.ends(&ends)).transpose()?;
        state.earlier.sums = std::array::from_fn(|index| sums[index].wrapping_sub(before.sums[index]));
        state.ends = ends.unwrap_or_default();
        Ok(())
    }

    fn ends(&self, (envs, codes, routes, observations, vehicles): &GivenEnds) -> PyResult<Vec<End>> {
        let wrong = || PyValueError::new_err("ends: what last_ended gives is needed");
        let (n, n_values) = (envs.len(), self.n_values());
        let values = observations.as_slice().map_err(|_| wrong())?;
        let fits = observations.shape() == [n, n_values] && observations.is_c_contiguous();
        if [codes.len(), routes.len(), vehicles.len()] != [n; 3] || !fits {
            return Err(wrong());
        }
        let end = |index: usize| {
            let (env, code) = (envs[index], codes[index]);
            let episode = Episode { route: routes[index], vehicle: vehicles[index] };
            let (n_routes, n_vehicles) = (self.place.world.routes.len(), self.place.world.rigs.len());
            let fits =
                env < self.n_envs && (episode.route as usize) < n_routes && (episode.vehicle as usize) < n_vehicles;
            if !fits || Ended::from_code(code).is_none() {
                return Err(wrong());
            }
            let mut observation = [0.0; N_VALUES_MAX];
            observation[..n_values].copy_from_slice(&values[index * n_values..][..n_values]);
            Ok(End { env, code, episode, observation })
        };
        (0..n).map(end).collect()
    }
}
