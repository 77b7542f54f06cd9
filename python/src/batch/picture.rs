//! A truck of a batch as it is now, from above.

use numpy::{PyArray1, PyArray3, PyArrayMethods};
use offtrack::layout::{Column, Ended, N_RAYS, Truck};
use offtrack::simulator::rows;
use offtrack_drawing::camera::{Camera, Shown};
use offtrack_evaluation::recording::Vehicle;
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;

use super::Batch;
use super::state::State;
use crate::errors;

impl Batch {
    /// RGB pixels, `[size, size, 3]`.
    pub(super) fn drawn<'py>(&self, py: Python<'py>, env: usize, size: u32) -> PyResult<Bound<'py, PyArray3<u8>>> {
        if self.n_envs <= env {
            return Err(PyIndexError::new_err(format!("env: {env}; the batch has trucks 0..{}", self.n_envs - 1)));
        }
        let mut state = self.state()?;
        state.check_process(&self.device)?;
        let State { simulator, camera, .. } = &mut *state;
        let camera = match camera.take_if(|camera| camera.side() == size) {
            Some(kept) => camera.insert(kept),
            None => {
                let made = Camera::new(self.place.scenario.clone(), &self.place.world, size);
                camera.insert(made.map_err(|error| PyValueError::new_err(format!("size: {error}")))?)
            }
        };
        let cars = self.place.world.traffic.is_some().then_some(Column::Cars);
        let columns: Vec<Column> = [Column::Truck, Column::Ranges, Column::Ended].into_iter().chain(cars).collect();
        let mut read = simulator.read(&columns).map_err(|error| errors::of_simulator(&error))?.into_iter();
        // As many as were asked for, in their order.
        let mut next = || read.next().unwrap_or_default();
        let trucks = rows::<Truck>(next());
        let truck = trucks[env];
        let ranges = rows::<[f32; N_RAYS]>(next())[env];
        let codes = rows::<u32>(next());
        // A truck that goes on in another episode has not ended.
        let code = if truck.held == 1 { codes[env] } else { Ended::Running as u32 };
        let ended = Ended::of_column(code);
        let vehicles = Vehicle::around(&self.place.world, &trucks, &rows(next()), env);
        let shown = Shown { truck: &truck, ranges: &ranges, ended, vehicles: &vehicles };
        let picture = camera.draw(&shown);
        PyArray1::from_slice(py, picture).reshape([size as usize, size as usize, 3])
    }
}
