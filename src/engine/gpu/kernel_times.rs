//! The time of kernels on a device: by its own clock where it has one, otherwise by the host's.

use std::time::{Duration, Instant};

use wgpu::{BufferDescriptor, BufferUsages, ComputePassTimestampWrites, Features, QuerySetDescriptor, QueryType};

use super::{Batch, Error, Slice};
use crate::engine::stages::Kernel;

/// Runs kernels one group after the other, and says how long each group lasted.
pub(super) fn lasted(batch: &mut Batch, groups: &[Vec<Kernel>]) -> Result<Vec<Duration>, Error> {
    if batch.device().device.features().contains(Features::TIMESTAMP_QUERY) {
        by_device(batch, groups)
    } else {
        by_host(batch, groups)
    }
}

fn by_device(batch: &mut Batch, groups: &[Vec<Kernel>]) -> Result<Vec<Duration>, Error> {
    let device = batch.device().clone();
    let count = 2 * groups.len() as u32;
    let set =
        device.device.create_query_set(&QuerySetDescriptor { label: Some("kernels"), ty: QueryType::Timestamp, count });
    let size = u64::from(count) * size_of::<u64>() as u64;
    let usage = BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC;
    let resolved = device.device.create_buffer(&BufferDescriptor {
        label: Some("kernels"),
        size,
        usage,
        mapped_at_creation: false,
    });
    batch.submit(|batch, encoder| {
        for (index, kernels) in (0..).zip(groups) {
            let timestamp_writes = ComputePassTimestampWrites {
                query_set: &set,
                beginning_of_pass_write_index: Some(2 * index),
                end_of_pass_write_index: Some(2 * index + 1),
            };
            batch.add_pass(encoder, kernels.iter().copied(), Some(timestamp_writes));
        }
        encoder.resolve_query_set(&set, 0..count, &resolved, 0);
    });
    let bytes = device.read(&[Slice { buffer: resolved, offset: 0, size }])?;
    // A byte vector need not be aligned for its words.
    let ticks: Vec<u64> = bytes[0].chunks_exact(size_of::<u64>()).map(bytemuck::pod_read_unaligned).collect();
    let period = f64::from(device.queue.get_timestamp_period());
    let lasted = ticks.chunks_exact(2).map(|ticks| ticks[1].saturating_sub(ticks[0]) as f64 * period);
    Ok(lasted.map(|nanoseconds| Duration::from_nanos(nanoseconds as u64)).collect())
}

fn by_host(batch: &mut Batch, groups: &[Vec<Kernel>]) -> Result<Vec<Duration>, Error> {
    batch.device().wait()?;
    let mut times = Vec::with_capacity(groups.len());
    for kernels in groups {
        let start = Instant::now();
        batch.submit(|batch, encoder| batch.add_pass(encoder, kernels.iter().copied(), None));
        batch.device().wait()?;
        times.push(start.elapsed());
    }
    Ok(times)
}
