//! Lanes that pass beside a ring, from an arm's entry to its next exit: bypasses.
//!
//! Where such a lane crosses the circle far from its arms, it looks like an arm of its own at either end. It is made
//! the lane next to the kerb of the arms whose roads it comes from and leads to, or left out.

use glam::DVec2;

use super::crossings::{ArmLanes, BESIDE, Crossing};
use super::paths::Network;

/// Most entry lanes of an arm, with its bypass.
const MOST_ENTRIES: usize = 2;
/// Lanes whose outer ends are this near to each other belong to one road (m).
const ONE_ROAD: f64 = BESIDE;

/// A lane of an arm: the arm's index, and the lane's among those that enter or leave.
type Place = (usize, usize);

/// A bypass: where it begins and where it ends.
#[derive(Debug, Clone, Copy)]
struct Bypass {
    entry: Place,
    exit: Place,
}

/// What is found of a ring's lanes around it.
pub(super) struct Around<'a> {
    pub(super) network: &'a Network<'a>,
    /// Radius of the ring's outer kerb (m).
    pub(super) outer_radius: f64,
    /// Ways that pass farther than this from the centre are not the ring's (m).
    pub(super) reach: f64,
    /// How far the world reaches (m).
    pub(super) extent: f64,
}

impl Around<'_> {
    /// The arms without those that are ends of bypasses alone, and what became of these.
    pub(super) fn merged(&self, mut arms: Vec<ArmLanes>) -> (Vec<ArmLanes>, Vec<String>) {
        let all = self.bypasses(&arms);
        let is_entry = |arm: usize, lane: usize| all.iter().any(|bypass| bypass.entry == (arm, lane));
        let is_exit = |arm: usize, lane: usize| all.iter().any(|bypass| bypass.exit == (arm, lane));
        // An arm of bypasses alone is none.
        let alone: Vec<bool> = arms
            .iter()
            .enumerate()
            .map(|(i, arm)| {
                (0..arm.entries.len()).all(|lane| is_entry(i, lane))
                    && (0..arm.exits.len()).all(|lane| is_exit(i, lane))
            })
            .collect();
        let apart: Vec<Bypass> =
            all.iter().copied().filter(|bypass| alone[bypass.entry.0] || alone[bypass.exit.0]).collect();
        let (mut warnings, mut gone_entries, mut gone_exits) = (Vec::new(), Vec::new(), Vec::new());
        let mut entries: Vec<(usize, Crossing)> = Vec::new();
        let mut exits: Vec<(usize, Crossing)> = Vec::new();
        for &Bypass { entry, exit } in &apart {
            let (from, to) = (arms[entry.0].entries[entry.1].clone(), arms[exit.0].exits[exit.1].clone());
            let what = format!("{} passes beside the ring to {}", self.name(&from), self.name(&to));
            let n = arms.len();
            // Traffic enters on the arm before the bypass, counter-clockwise, and leaves on the arm after it.
            let before =
                (1..n).map(|step| (entry.0 + n - step) % n).find(|&arm| !alone[arm]).filter(|_| alone[entry.0]);
            let after = (1..n).map(|step| (exit.0 + step) % n).find(|&arm| !alone[arm]).filter(|_| alone[exit.0]);
            let comes = !alone[entry.0] || before.is_some_and(|arm| self.one_road(&from, &arms[arm].entries));
            let leads = !alone[exit.0] || after.is_some_and(|arm| self.one_road(&to, &arms[arm].exits));
            let joining = |arm: usize| entries.iter().filter(|(other, _)| *other == arm).count();
            let room = before.is_none_or(|arm| arms[arm].entries.len() + joining(arm) < MOST_ENTRIES);
            let reason = match (comes, leads, room) {
                (false, ..) => Some("it comes from the road of no arm"),
                (_, false, _) => Some("it leads to the road of no arm"),
                (.., false) => Some("its arm has two entry lanes without it"),
                _ => None,
            };
            // An end that lies in an arm already stays there, unless the bypass is left out.
            gone_entries.extend((reason.is_some() || before.is_some()).then_some(entry));
            gone_exits.extend((reason.is_some() || after.is_some()).then_some(exit));
            match reason {
                Some(reason) => warnings.push(format!("{what}, and is left out: {reason}")),
                None => {
                    entries.extend(before.map(|arm| (arm, from)));
                    exits.extend(after.map(|arm| (arm, to)));
                    warnings.push(format!("{what}: it is the lane next to the kerb of both arms"));
                }
            }
        }
        for (i, arm) in arms.iter_mut().enumerate() {
            arm.entries = without(&arm.entries, |lane| gone_entries.contains(&(i, lane)));
            arm.exits = without(&arm.exits, |lane| gone_exits.contains(&(i, lane)));
        }
        entries.into_iter().for_each(|(arm, lane)| arms[arm].entries.insert(0, lane));
        exits.into_iter().for_each(|(arm, lane)| arms[arm].exits.insert(0, lane));
        arms.retain(|arm| !arm.entries.is_empty() || !arm.exits.is_empty());
        (arms, warnings)
    }

    /// Lanes that lead to one exit alone, which no other lane leads to, outside the ring's kerb.
    fn bypasses(&self, arms: &[ArmLanes]) -> Vec<Bypass> {
        let mut ways: Vec<(Place, Place, bool)> = Vec::new();
        for (arm, lanes) in arms.iter().enumerate() {
            for (lane, entry) in lanes.entries.iter().enumerate() {
                for (exit, way) in self.network.ways(entry, arms) {
                    let nearest = self.network.nearest_to_centre(&way);
                    if nearest < self.reach {
                        ways.push(((arm, lane), exit, self.outer_radius < nearest));
                    }
                }
            }
        }
        let only = |entry: Place, exit: Place| ways.iter().all(|way| (way.0 == entry) == (way.1 == exit));
        let outside = ways.iter().filter(|(entry, exit, outside)| *outside && entry.0 != exit.0 && only(*entry, *exit));
        outside.map(|&(entry, exit, _)| Bypass { entry, exit }).collect()
    }

    /// Whether a lane shares a road with one of these farther out: a strip of both, or outer ends beside each other.
    fn one_road(&self, lane: &Crossing, others: &[Crossing]) -> bool {
        let far = |crossing: &Crossing| -> (Vec<usize>, Vec<DVec2>) {
            let Some(&strip) = crossing.strips.first() else { return Default::default() };
            let all = self.network.continued(&[strip], self.extent);
            let at = all.iter().position(|other| *other == strip).unwrap_or(0);
            let mut outer = if crossing.inwards { all[..=at].to_vec() } else { all[at..].to_vec() };
            if !crossing.inwards {
                outer.reverse();
            }
            let mut path: Vec<DVec2> = Vec::new();
            for &strip in &outer {
                let mut points = self.network.path(strip);
                if !crossing.inwards {
                    points.reverse();
                }
                path.extend(points);
            }
            // Within the world, the outermost point first.
            path.retain(|p| p.length() < self.extent);
            (outer, path)
        };
        let (strips, path) = far(lane);
        others.iter().map(far).any(|(other_strips, other_path)| {
            let near = |p: &DVec2, along: &[DVec2]| {
                along
                    .windows(2)
                    .any(|pair| crate::geometry::Piece::Segment { from: pair[0], to: pair[1] }.distance(*p) < ONE_ROAD)
            };
            let beside = path.first().is_some_and(|p| near(p, &other_path))
                || other_path.first().is_some_and(|p| near(p, &path));
            beside || strips.iter().any(|strip| other_strips.contains(strip))
        })
    }

    /// What the lane of a crossing is called.
    fn name(&self, crossing: &Crossing) -> String {
        crossing.strips.first().map_or(String::new(), |&strip| self.network.name(strip))
    }
}

/// The lanes of a list that are not gone, by index.
fn without(lanes: &[Crossing], gone: impl Fn(usize) -> bool) -> Vec<Crossing> {
    lanes.iter().enumerate().filter(|(lane, _)| !gone(*lane)).map(|(_, crossing)| crossing.clone()).collect()
}
