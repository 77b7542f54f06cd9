//! Episodes that the caller begins.

use offtrack::layout::{Start, Stream};
use offtrack::simulator::Begin;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::Batch;
use super::state::State;
use crate::errors;

/// Offset, heading error and speed of a start as fractions, the index of its vehicle, and how far along its route it
/// is.
pub(super) type GivenStart = (f32, f32, f32, u32, f32);

impl Batch {
    /// Begins an episode of each of these trucks; streams, routes and starts are one a truck.
    pub(super) fn begin(
        &self,
        py: Python,
        envs: &[usize],
        streams: Option<&[Option<(u32, u32)>]>,
        routes: Option<&[Option<String>]>,
        starts: Option<&[Option<GivenStart>]>,
    ) -> PyResult<()> {
        let n = envs.len();
        let lengths = [streams.map(<[_]>::len), routes.map(<[_]>::len), starts.map(<[_]>::len)];
        for (name, found) in ["streams", "routes", "starts"].into_iter().zip(lengths) {
            if found.is_some_and(|found| found != n) {
                return Err(PyValueError::new_err(format!(
                    "{name}: {} of them; {n} are needed, one a truck",
                    found.unwrap_or(0)
                )));
            }
        }
        let start =
            |(offset, heading, speed, vehicle, along): GivenStart| Start { offset, heading, speed, along, vehicle };
        let request = |(index, &env): (usize, &usize)| {
            let route = routes.and_then(|routes| routes[index].as_deref());
            Ok(Begin {
                env,
                stream: streams.and_then(|streams| streams[index]).map(|(seed, env)| Stream { seed, env }),
                route: route.map(|name| self.route("routes", name)).transpose()?,
                start: starts.and_then(|starts| starts[index]).map(start),
            })
        };
        let requests = envs.iter().enumerate().map(request).collect::<PyResult<Vec<Begin>>>()?;
        let mut state = self.state()?;
        state.check_process(&self.device)?;
        let State { simulator, pool, .. } = &mut *state;
        pool.run(py, || simulator.begin(&requests))?.map_err(|error| errors::of_simulator(&error))?;
        state.look()
    }

    /// Index of a route by its name, which stands in this argument.
    pub(super) fn route(&self, argument: &str, name: &str) -> PyResult<u32> {
        self.place.route(argument, name, "the batch drives")
    }
}
