//! The capacity of an entry: what enters from a queue without end beside a circulating flow.

use super::{Counts, Survey};
use crate::layout::Stream;
use crate::traffic::units::BEYOND;
use crate::traffic::{Demand, Error, Mix};

/// A flow too small to matter: cars of a full source come from its queue, in these shares (veh/h).
const SHARES: f64 = 1e-3;

/// One arm whose queue never ends, and the flow that passes it from all other arms.
pub struct Saturated {
    demand: Demand,
    /// Sources of the arm.
    pub sources: Vec<usize>,
    /// Of each whether its cars meet those of the arm's other lanes on their way, as on an approach that is narrow:
    /// then these limit it too, not the circulating flow alone.
    pub lanes_meet: Vec<bool>,
}

impl Survey<'_> {
    /// A queue without end at `arm` beside a flow of `circulating` (veh/h). Cars of the flow pass the arm and leave.
    /// The arm's own leave before they come to an arm that feeds the flow, each lane's by exits of its own where there
    /// are such: where two lanes leave by one, the exit is the limit.
    ///
    /// `None` where no car can pass the arm, or none of its own can leave so early.
    ///
    /// # Errors
    ///
    /// Those of [`Demand::new`].
    pub fn saturated(&self, arm: usize, circulating: f64, mix: Mix) -> Result<Option<Saturated>, Error> {
        let network = self.network;
        let all = 0..network.paths.len();
        let feeds: Vec<usize> =
            all.clone().filter(|&path| self.goes_past(path, arm) && !self.is_u_turn(path)).collect();
        let clears = |path: usize| {
            let passes_feeding = || feeds.iter().any(|&other| self.goes_past(path, self.entry(other)));
            self.entry(path) == arm && !self.is_u_turn(path) && !passes_feeding()
        };
        let own: Vec<usize> = all.filter(|&path| clears(path)).collect();
        let mut sources: Vec<usize> = own.iter().map(|&path| network.paths[path].source as usize).collect();
        sources.dedup();
        if sources.is_empty() || feeds.is_empty() {
            return Ok(None);
        }
        let shares_exit = |path: &usize| {
            let path = &network.paths[*path];
            own.iter()
                .map(|&other| &network.paths[other])
                .any(|other| other.source != path.source && other.exit == path.exit)
        };
        let mut flows = vec![0.0; network.paths.len()];
        for &source in &sources {
            let of = || own.iter().copied().filter(|&path| network.paths[path].source as usize == source);
            let all_share = of().all(|path| shares_exit(&path));
            of().filter(|path| all_share || !shares_exit(path)).for_each(|path| flows[path] = SHARES);
        }
        let is_used = |path: &usize| 0.0 < flows[*path];
        let meets = |&source: &usize| {
            let used = || own.iter().copied().filter(is_used);
            let (its, others): (Vec<usize>, Vec<usize>) =
                used().partition(|&path| network.paths[path].source as usize == source);
            its.iter().any(|&path| others.iter().any(|&other| !network.zones_of(path, other).is_empty()))
        };
        let lanes_meet = sources.iter().map(meets).collect();
        let mut feeding: Vec<u32> = feeds.iter().map(|&path| network.paths[path].source).collect();
        feeding.dedup();
        for &path in &feeds {
            let source = network.paths[path].source;
            let in_source = feeds.iter().filter(|&&other| network.paths[other].source == source).count();
            flows[path] = circulating / (feeding.len() * in_source) as f64;
        }
        Ok(Some(Saturated { demand: Demand::new(network, &flows, mix)?, sources, lanes_meet }))
    }

    fn entry(&self, path: usize) -> usize {
        self.network.source_of(path).entry as usize
    }

    fn goes_past(&self, path: usize, arm: usize) -> bool {
        self.passes[path * self.network.n_arms + arm] < BEYOND
    }

    fn is_u_turn(&self, path: usize) -> bool {
        self.network.paths[path].exit_arm as usize == self.entry(path)
    }

    /// What is counted at the arm's lanes over so many steps.
    pub fn saturated_counts(&self, saturated: &Saturated, steps: u32, stream: Stream) -> Vec<Counts> {
        let counts = self.counted(&saturated.demand, steps, stream, &saturated.sources);
        saturated.sources.iter().map(|&source| counts[source].clone()).collect()
    }
}
