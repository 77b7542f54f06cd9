//! The time of each stage on a device: by its own clock where it has one, otherwise by the host's.

use std::time::{Duration, Instant};

use wgpu::{BufferDescriptor, BufferUsages, ComputePassTimestampWrites, Features, QuerySetDescriptor, QueryType};

use super::{Batch, Error, Slice};
use crate::engine::stages::{N_STAGES, STAGES};

/// Steps a batch a stage at a time.
pub(super) fn step_by_stage(batch: &mut Batch) -> Result<[Duration; N_STAGES], Error> {
    if batch.device().device.features().contains(Features::TIMESTAMP_QUERY) { by_device(batch) } else { by_host(batch) }
}

fn by_device(batch: &mut Batch) -> Result<[Duration; N_STAGES], Error> {
    let device = batch.device().clone();
    let count = 2 * N_STAGES as u32;
    let set =
        device.device.create_query_set(&QuerySetDescriptor { label: Some("stages"), ty: QueryType::Timestamp, count });
    let size = u64::from(count) * size_of::<u64>() as u64;
    let usage = BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC;
    let resolved = device.device.create_buffer(&BufferDescriptor {
        label: Some("stages"),
        size,
        usage,
        mapped_at_creation: false,
    });
    batch.submit(|batch, encoder| {
        for (index, stage) in (0..).zip(STAGES) {
            let timestamp_writes = ComputePassTimestampWrites {
                query_set: &set,
                beginning_of_pass_write_index: Some(2 * index),
                end_of_pass_write_index: Some(2 * index + 1),
            };
            batch.add_pass(encoder, stage.kernels().iter().copied(), Some(timestamp_writes));
        }
        encoder.resolve_query_set(&set, 0..count, &resolved, 0);
    });
    let bytes = device.read(&[Slice { buffer: resolved, offset: 0, size }])?;
    // A byte vector need not be aligned for its words.
    let ticks: Vec<u64> = bytes[0].chunks_exact(size_of::<u64>()).map(bytemuck::pod_read_unaligned).collect();
    let period = f64::from(device.queue.get_timestamp_period());
    let lasted = |index: usize| ticks[2 * index + 1].saturating_sub(ticks[2 * index]) as f64 * period;
    Ok(std::array::from_fn(|index| Duration::from_nanos(lasted(index) as u64)))
}

fn by_host(batch: &mut Batch) -> Result<[Duration; N_STAGES], Error> {
    batch.device().wait()?;
    let mut times = [Duration::ZERO; N_STAGES];
    for (time, stage) in times.iter_mut().zip(STAGES) {
        let start = Instant::now();
        batch.submit(|batch, encoder| batch.add_pass(encoder, stage.kernels().iter().copied(), None));
        batch.device().wait()?;
        *time = start.elapsed();
    }
    Ok(times)
}
