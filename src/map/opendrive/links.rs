//! What a map says of the lanes that follow a lane, and where it says nothing although the roads are linked.

use super::lanes::Strip;
use super::records::{Connection, Link, Records, RoadRecord};
use super::xml::shown;

/// A section of a road that a lane leads to or comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Contact {
    pub(super) road: usize,
    pub(super) section: usize,
    /// The lane there that the map names; `None` where it names none.
    pub(super) lane: Option<i32>,
}

/// The section at the beginning or the end of a road.
fn end_of(road: &RoadRecord, at_start: bool) -> usize {
    if at_start { 0 } else { road.sections.len().saturating_sub(1) }
}

/// What the map says follows a lane in its direction of travel, or precedes it.
pub(super) fn contacts(records: &Records, strip: &Strip, follow: bool) -> Vec<Contact> {
    let road = &records.roads[strip.road];
    let Some(lane) = road.sections[strip.section].lanes.iter().find(|lane| lane.id == strip.id) else {
        return Vec::new();
    };
    let forward = strip.backward != follow;
    let to = if forward { lane.successor } else { lane.predecessor };
    if forward && strip.section + 1 < road.sections.len() {
        return vec![Contact { road: strip.road, section: strip.section + 1, lane: to }];
    }
    if !forward && 0 < strip.section {
        return vec![Contact { road: strip.road, section: strip.section - 1, lane: to }];
    }
    let at = |road: usize, at_start: bool, lane: Option<i32>| Contact {
        road,
        section: end_of(&records.roads[road], at_start),
        lane,
    };
    match if forward { &road.successor } else { &road.predecessor } {
        None => Vec::new(),
        Some(Link::RoadRecord(id, at_start)) => {
            records.by_id.get(id).map(|&next| at(next, *at_start, to)).into_iter().collect()
        }
        Some(Link::Junction(id)) => {
            let all =
                records.junctions.get(id).into_iter().flatten().filter(|connection| connection.incoming == road.id);
            let mut found = Vec::new();
            for connection in all {
                let Some(&next) = records.by_id.get(&connection.connecting) else { continue };
                if connection.lanes.is_empty() {
                    found.push(at(next, connection.at_start, None));
                }
                for (_, to) in connection.lanes.iter().filter(|(from, _)| *from == strip.id) {
                    found.push(at(next, connection.at_start, Some(*to)));
                }
            }
            found
        }
    }
}

impl Records {
    /// What speaks against the hand of traffic: most lanes that the connections of junctions begin at lead away from
    /// them. None where they agree.
    pub(super) fn against_hand(&self) -> Option<String> {
        let ways = self.junctions.iter().flat_map(|(id, connections)| connections.iter().map(move |way| (id, way)));
        let leads = ways.filter(|(_, way)| !way.direct).flat_map(|(id, way)| self.leads_in(id, way));
        let [away, all] = leads.fold([0, 0], |[away, all], leads_in| [away + usize::from(!leads_in), all + 1]);
        let (hand, other) = if self.mirrored { ("left", "right") } else { ("right", "left") };
        (all < 2 * away).then(|| {
            format!(
                "{away} of {all} lanes that connections of junctions begin at lead away from them in {hand}-hand \
                 traffic: `--hand {other}` would do"
            )
        })
    }

    /// Whether each lane that a junction's connection begins at leads to the junction.
    fn leads_in(&self, junction: &str, way: &Connection) -> Vec<bool> {
        let Some(&road) = self.by_id.get(&way.incoming) else { return Vec::new() };
        let road = &self.roads[road];
        let is_at = |link: &Option<Link>| matches!(link, Some(Link::Junction(id)) if id == junction);
        // A road from the junction to itself says nothing.
        let [at_start, at_end] = [&road.predecessor, &road.successor].map(is_at);
        if at_start == at_end {
            return Vec::new();
        }
        let section = &road.sections[end_of(road, at_start)];
        let from = way.lanes.iter().filter_map(|(from, _)| section.lanes.iter().find(|lane| lane.id == *from));
        // Lanes to the right of the reference line are travelled along it.
        from.map(|lane| ((lane.id < 0) != lane.reversed) == at_end).collect()
    }

    /// What a lane is called in messages, by its number in the map.
    pub(super) fn lane_name(&self, strip: &Strip) -> String {
        let id = if self.mirrored { -strip.id } else { strip.id };
        format!("road {} lane {id}", shown(&self.roads[strip.road].id))
    }
}

/// Why no lane follows one in its direction of travel, or none precedes it, as the map has it.
pub(super) fn reason(records: &Records, strip: &Strip, follow: bool) -> String {
    let road = &records.roads[strip.road];
    let lane = records.lane_name(strip);
    let forward = strip.backward != follow;
    let (verb, beside, inner) = if forward {
        ("leads on to", "next", strip.section + 1 < road.sections.len())
    } else {
        ("comes from", "previous", 0 < strip.section)
    };
    if inner {
        return format!("{lane} has no link that fits to a lane of the road's {beside} section");
    }
    match if forward { &road.successor } else { &road.predecessor } {
        None => format!("road {} is linked to no road there", shown(&road.id)),
        Some(Link::RoadRecord(id, _)) if !records.by_id.contains_key(id) => {
            format!("{lane} {verb} road {}, which the map does not have", shown(id))
        }
        Some(Link::RoadRecord(id, _)) => format!("{lane} has no link that fits to a lane of road {}", shown(id)),
        Some(Link::Junction(id)) => format!("junction {} has no connection that fits for {lane}", shown(id)),
    }
}
