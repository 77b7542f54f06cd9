//! Level replay on a device: kernels count episodes by route, and the host reads the counts before it makes a new list.

use offtrack::layout::Ended;

use super::DeviceRollout;
use super::memory_kernels::Binding;
use crate::error::Error;
use crate::rollout::RouteEnd;

impl<const N: usize> DeviceRollout<N> {
    /// Draws routes anew where it is time to, by the episodes since the last time. Only then the device is waited for.
    pub(super) fn replay_levels(&mut self) -> Result<(), Error> {
        let Some(replay) = &mut self.level_replay else { return Ok(()) };
        if !replay.stepped() {
            return Ok(());
        }
        let counts = std::slice::from_ref(self.buffers.slice(Binding::route_ends));
        let bytes = self.gpu.read(counts).map_err(offtrack::simulator::Error::from)?;
        let counts: Vec<u32> = bytes[0].chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
        let n_ends = Ended::ALL.len();
        let routes = counts.chunks_exact(n_ends).zip(self.counted_ends.chunks_exact(n_ends));
        for (route, (counts, before)) in (0..).zip(routes) {
            let ends = Ended::ALL.into_iter().zip(counts.iter().zip(before));
            let ends =
                ends.flat_map(|(ended, (count, before))| (*before..*count).map(move |_| RouteEnd { route, ended }));
            let first = self.route_ends.len();
            self.route_ends.extend(ends);
            replay.count_unordered(route, &self.route_ends[first..]);
        }
        self.counted_ends = counts;
        replay.renew();
        Ok(self.simulator.draw_from(replay.list())?)
    }
}
