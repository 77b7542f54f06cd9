//! Poses, telemetry and observations of many trucks, as rows of arrays.

use std::slice::from_ref;

use numpy::ndarray::ArrayView1;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use offtrack::layout::ObservationLayout;
use offtrack::observer::{Observed, Observer, Pose, Telemetry};
use offtrack::simulator::Error;
use offtrack::world::World;
use pyo3::prelude::*;
use rayon::prelude::*;

use super::of_truck;

/// Trucks that a thread observes at least.
const ROWS_MIN: usize = 16;

/// Values `[k, n_values]`, distance to the lane, next waypoint, clearances of tractor and trailer `[k, 2]`, end code.
pub(super) type Seen<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<i64>>,
);

/// What some trucks, or all, are observed by: a pose each and, but at a beginning, telemetry.
pub(super) struct Rows<'a> {
    pub(super) trucks: Option<&'a [usize]>,
    pub(super) poses: &'a [Pose],
    pub(super) telemetry: &'a [Telemetry],
    /// Waypoints that they begin near, where these are known.
    pub(super) waypoints: &'a [u32],
}

impl Rows<'_> {
    fn truck(&self, row: usize) -> usize {
        self.trucks.map_or(row, |trucks| trucks[row])
    }

    /// An error for the first number that no truck can have.
    pub(super) fn check(&self, observers: &[Observer]) -> PyResult<()> {
        for (row, pose) in self.poses.iter().enumerate() {
            let telemetry = self.telemetry.get(row).copied().unwrap_or_default();
            let observer = &observers[self.truck(row)];
            observer.check(pose, &telemetry).map_err(|error| of_truck(row, error))?;
            let near = self.waypoints.get(row).map_or(Ok(()), |&waypoint| observer.check_waypoint(waypoint));
            near.map_err(|error| of_truck(row, error))?;
        }
        Ok(())
    }

    /// What is observed, a row each.
    pub(super) fn observed(&self, observers: &mut [Observer]) -> Result<Vec<Observed>, Error> {
        let observed = |observer: &mut Observer, row: usize| match (self.telemetry.get(row), self.waypoints.get(row)) {
            (Some(telemetry), _) => observer.observe(&self.poses[row], telemetry),
            (None, Some(&waypoint)) => observer.begin_near(&self.poses[row], waypoint),
            (None, None) => observer.begin(&self.poses[row]),
        };
        match self.trucks {
            Some(trucks) => {
                trucks.iter().enumerate().map(|(row, &truck)| observed(&mut observers[truck], row)).collect()
            }
            None if is_few(observers.len()) => {
                observers.iter_mut().enumerate().map(|(row, observer)| observed(observer, row)).collect()
            }
            None => {
                let rows = observers.par_iter_mut().enumerate().with_min_len(ROWS_MIN);
                rows.map(|(row, observer)| observed(observer, row)).collect()
            }
        }
    }
}

/// Whether so many trucks are observed sooner than threads are woken.
pub(super) fn is_few(n_trucks: usize) -> bool {
    n_trucks <= 2 * ROWS_MIN
}

/// What an observer's observations consist of in a world: it sees no other vehicles.
pub(super) fn layout(world: &World) -> ObservationLayout {
    ObservationLayout { has_vehicles: false, ..world.observation_layout() }
}

/// Position, heading, trailer's heading, speed.
pub(super) fn pose_of(row: ArrayView1<f64>) -> Pose {
    Pose { position: [row[0], row[1]].into(), heading: row[2], trailer_heading: row[3], speed: row[4] as f32 }
}

/// In the order of the fields.
pub(super) fn telemetry_of(row: ArrayView1<f32>) -> Telemetry {
    Telemetry {
        steering: row[0],
        target_speed: row[1],
        acceleration: row[2],
        lateral_acceleration: row[3],
        trailer_roll: row[4],
        trailer_roll_rate: row[5],
        load_transfer_ratios: [row[6], row[7]],
    }
}

/// Observations as arrays.
pub(super) fn arrays<'py>(py: Python<'py>, seen: &[Observed], layout: ObservationLayout) -> PyResult<Seen<'py>> {
    let n_values = layout.n_values();
    let mut values = vec![0.0; seen.len() * n_values];
    for (row, seen) in values.chunks_exact_mut(n_values).zip(seen) {
        layout.join(row, 0, from_ref(&seen.values), from_ref(&seen.extras), &[]);
    }
    let clearance: Vec<f32> = seen.iter().flat_map(|seen| [seen.clearance.tractor, seen.clearance.trailer]).collect();
    Ok((
        PyArray1::from_vec(py, values).reshape([seen.len(), n_values])?,
        PyArray1::from_iter(py, seen.iter().map(|seen| seen.progress.lane_distance)),
        PyArray1::from_iter(py, seen.iter().map(|seen| i64::from(seen.progress.waypoint))),
        PyArray1::from_vec(py, clearance).reshape([seen.len(), 2])?,
        PyArray1::from_iter(py, seen.iter().map(|seen| i64::from(seen.ended as u32))),
    ))
}
