//! How trucks drive, by vehicle and load: rollovers, load transfer, speed against what is feasible, comfort.

use std::collections::HashMap;

use offtrack::layout::{Ended, Truck};
use offtrack::scenario::Scenario;
use offtrack::vehicle::GRAVITY;
use offtrack::vehicle::profile::Profile;
use offtrack::world::World;
use serde::Serialize;

use super::driving::{Driving, JERK_BIN, LATERAL_BIN, N_BINS};
use super::episode::{Episode, success_over_routes, wilson};
use super::rank::nearest_rank;

/// The episodes of a vehicle with a load.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClassReport {
    /// Stem of the vehicle's file; empty where the benchmark has one vehicle.
    pub vehicle: String,
    /// Name of the load.
    pub load: String,
    /// Episodes run.
    pub episodes: usize,
    /// Episodes that arrived.
    pub arrived: usize,
    /// Fraction that arrived.
    pub success: f64,
    /// Lower end of the 95 % [interval over routes](crate::interval) of `success`; `None` on one route alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub success_low_over_routes: Option<f64>,
    /// Upper end of the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub success_high_over_routes: Option<f64>,
    /// Episodes whose own start is shown to be possible; `None` where nobody asked for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub possible: Option<usize>,
    /// Episodes that ended with a rollover.
    pub rolled_over: usize,
    /// Fraction of the episodes that ended with a rollover.
    pub rolled_over_fraction: f64,
    /// Upper end of the 95 % Wilson interval of the fraction that ended with a rollover.
    pub rolled_over_high: f64,
    /// Largest load transfer ratio of an episode: half of the episodes have at most this.
    pub load_transfer_ratio_p50: f64,
    /// Largest load transfer ratio of an episode: nine in ten of the episodes have at most this.
    pub load_transfer_ratio_p90: f64,
    /// Largest load transfer ratio of an episode: 99 in 100 of the episodes have at most this.
    pub load_transfer_ratio_p99: f64,
    /// Mean time of an episode with a load transfer ratio of at least 0.9 (s).
    pub time_at_limit_mean: f64,
    /// Mean speed of all steps (km/h).
    pub speed_mean_kmh: f64,
    /// Time over that of the feasible speed profile of the episode's vehicle on its route, mean of the episodes that
    /// arrived; `None` if none did.
    pub time_over_feasible_mean: Option<f64>,
    /// Lateral acceleration of the trailer: half of the steps have at most this (g).
    pub lateral_acceleration_p50: f64,
    /// Lateral acceleration of the trailer: 95 in 100 of the steps have at most this (g).
    pub lateral_acceleration_p95: f64,
    /// Lateral acceleration of the trailer: 99 in 100 of the steps have at most this (g).
    pub lateral_acceleration_p99: f64,
    /// Change of the acceleration that 95 in 100 steps have at most (m/s^3).
    pub jerk_p95: f64,
    /// Changes of the target speed in a second.
    pub switches_per_second: f64,
    /// Mean speed at contact of the episodes in which the tractor touched a kerb (km/h).
    pub tractor_contact_speed_kmh: Option<f64>,
    /// Mean speed at contact of the episodes in which the trailer touched a kerb (km/h).
    pub trailer_contact_speed_kmh: Option<f64>,
}

/// Whether classes of vehicles are reported: where the benchmark has several vehicles or speeds.
pub(super) fn has_classes(scenario: &Scenario) -> bool {
    scenario.fleet.is_some() || scenario.speeds.len() != 1 || !scenario.speed_changes.is_empty()
}

/// The report of each class of vehicles in these episodes; none without [`has_classes`]. `possible` says of each
/// episode whether its start is shown to be possible.
pub(super) fn classes(
    scenario: &Scenario,
    world: &World,
    episodes: &[Episode],
    possible: Option<&[bool]>,
) -> Vec<ClassReport> {
    if !has_classes(scenario) {
        return Vec::new();
    }
    let mut profiles: HashMap<(u32, u32), f64> = HashMap::new();
    let mut feasible = |truck: &Truck| {
        let profile =
            || Profile::of(world.rig(truck), world.route_waypoints(truck.route), world.params.target_speed_max.into());
        *profiles.entry((truck.route, truck.vehicle)).or_insert_with(|| profile().time)
    };
    let class = |index: usize| {
        let is_own = |episode: &Episode| world.rig(&episode.last).class_index as usize == index;
        let own: Vec<&Episode> = episodes.iter().filter(|episode| is_own(episode)).collect();
        let shown = |possible: &[bool]| {
            episodes.iter().zip(possible).filter(|&(episode, &possible)| possible && is_own(episode)).count()
        };
        let shown = possible.map(shown);
        (!own.is_empty())
            .then(|| ClassReport { possible: shown, ..class_report(scenario, world, index, &own, &mut feasible) })
    };
    (0..world.classes.len()).filter_map(class).collect()
}

fn class_report(
    scenario: &Scenario,
    world: &World,
    index: usize,
    episodes: &[&Episode],
    feasible: &mut dyn FnMut(&Truck) -> f64,
) -> ClassReport {
    let n = episodes.len();
    let ended = |code: Ended| episodes.iter().filter(move |episode| episode.ended == code);
    let (arrived, rolled_over) = (ended(Ended::Arrived).count(), ended(Ended::RolledOver).count());
    let over_routes = success_over_routes(episodes.iter().copied());
    let ratios: Vec<Option<f64>> = ended(Ended::Arrived)
        .map(|episode| Some(f64::from(episode.steps) * scenario.step / feasible(&episode.last)))
        .collect();
    let mut peaks: Vec<f64> = episodes.iter().map(|episode| episode.load_transfer_ratio_peak).collect();
    let mut peak = |fraction: f64| nearest_rank(&mut peaks, fraction).unwrap_or(0.0);
    let steps: f64 = episodes.iter().map(|episode| f64::from(episode.steps)).sum();
    let sum = |value: fn(&Driving) -> f64| {
        episodes.iter().filter_map(|episode| episode.driving.as_ref()).map(value).sum::<f64>()
    };
    let lateral =
        |fraction| LATERAL_BIN * percentile(episodes, |driving| &driving.lateral_accelerations, fraction) / GRAVITY;
    let contact = |code| mean(ended(code).map(|episode| f64::from(episode.last.speed) * 3.6));
    ClassReport {
        vehicle: world.classes[index].vehicle.clone(),
        load: world.classes[index].load.clone(),
        episodes: n,
        arrived,
        success: arrived as f64 / n as f64,
        success_low_over_routes: over_routes.map(|(low, _)| low),
        success_high_over_routes: over_routes.map(|(_, high)| high),
        possible: None,
        rolled_over,
        rolled_over_fraction: rolled_over as f64 / n as f64,
        rolled_over_high: wilson(rolled_over, n).1,
        load_transfer_ratio_p50: peak(0.5),
        load_transfer_ratio_p90: peak(0.9),
        load_transfer_ratio_p99: peak(0.99),
        time_at_limit_mean: scenario.step * sum(|driving| driving.steps_at_limit.into()) / n as f64,
        speed_mean_kmh: 3.6 * sum(|driving| driving.speed_sum) / steps,
        time_over_feasible_mean: mean(ratios.into_iter().flatten()),
        lateral_acceleration_p50: lateral(0.5),
        lateral_acceleration_p95: lateral(0.95),
        lateral_acceleration_p99: lateral(0.99),
        jerk_p95: JERK_BIN * percentile(episodes, |driving| &driving.jerks, 0.95),
        switches_per_second: sum(|driving| driving.switches.into()) / (steps * scenario.step),
        tractor_contact_speed_kmh: contact(Ended::TractorCollided),
        trailer_contact_speed_kmh: contact(Ended::TrailerCollided),
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The upper end, in bins, of the bin that a fraction of all steps lies in or below.
fn percentile(episodes: &[&Episode], bins: impl Fn(&Driving) -> &[u16], fraction: f64) -> f64 {
    let all = || episodes.iter().filter_map(|episode| episode.driving.as_ref());
    let count = |bin: usize| all().map(|driving| u64::from(bins(driving)[bin])).sum::<u64>();
    let counts: Vec<u64> = (0..N_BINS).map(count).collect();
    let needed = fraction * counts.iter().sum::<u64>() as f64;
    let mut below = 0;
    let bin = counts.iter().position(|count| {
        below += count;
        needed <= below as f64
    });
    (bin.unwrap_or(N_BINS - 1) + 1) as f64
}

/// A line for each class, under a heading.
pub(super) fn lines(classes: &[ClassReport]) -> Vec<String> {
    let heading = "vehicle and load             arrived       % rolled over   % (to)      LTR p50  p90  p99  km/h  \
        time  ay g p50  p95  switches/s";
    let line = |class: &ClassReport| {
        let name =
            if class.vehicle.is_empty() { class.load.clone() } else { format!("{} {}", class.vehicle, class.load) };
        let time = class.time_over_feasible_mean.map_or("-".to_owned(), |time| format!("{time:.2}"));
        format!(
            "{name:<27} {:>4}/{:<5} {:>5.1} {:>7} {:>6.2} ({:>5.2}) {:>9.2} {:>4.2} {:>4.2} {:>5.1} {time:>5} {:>9.2} \
             {:>4.2} {:>9.2}",
            class.arrived,
            class.episodes,
            100.0 * class.success,
            class.rolled_over,
            100.0 * class.rolled_over_fraction,
            100.0 * class.rolled_over_high,
            class.load_transfer_ratio_p50,
            class.load_transfer_ratio_p90,
            class.load_transfer_ratio_p99,
            class.speed_mean_kmh,
            class.lateral_acceleration_p50,
            class.lateral_acceleration_p95,
            class.switches_per_second,
        )
    };
    let note = "LTR: of episodes; time: over that of the feasible speed profile, of episodes that arrived; ay: of \
                steps, the trailer's.";
    if classes.is_empty() {
        Vec::new()
    } else {
        std::iter::once(heading.to_owned()).chain(classes.iter().map(line)).chain([note.to_owned()]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::tests::episode;

    #[test]
    fn a_percentile_of_steps_is_the_bin_that_reaches_it() {
        let mut one = episode(Ended::Arrived);
        let driving = one.driving.as_mut().unwrap();
        (driving.jerks[2], driving.jerks[10]) = (95, 5);
        let found = [0.5, 0.95, 0.96].map(|fraction| percentile(&[&one], |driving| &driving.jerks, fraction));
        assert!(
            found.iter().zip([3.0, 3.0, 11.0]).all(|(found, expected)| (found - expected).abs() < 1e-9),
            "{found:?}"
        );
    }

    #[test]
    fn classes_are_reported_where_a_benchmark_has_speeds_or_vehicles_alone() {
        let mut scenario = Scenario::named("attard2023").unwrap();
        let world = World::bake(&scenario).unwrap();
        let episodes = [
            episode(Ended::Arrived),
            episode(Ended::RolledOver),
            episode(Ended::TrailerCollided),
            episode(Ended::Arrived),
        ];
        assert_eq!(classes(&scenario, &world, &episodes, None), []);
        scenario.speeds.push(5.0);
        let found = classes(&scenario, &world, &episodes, None);
        assert_eq!(
            (found.len(), found[0].arrived, found[0].rolled_over, found[0].rolled_over_fraction),
            (1, 2, 1, 0.25)
        );
        assert_eq!((found[0].load_transfer_ratio_p50, found[0].load.as_str()), (1.5, "empty"));
        // 999 steps on a route that takes some 16 s at 30 km/h.
        assert!((4.0..9.0).contains(&found[0].time_over_feasible_mean.unwrap()), "{found:?}");
        assert_eq!(found[0].possible, None);
        // All on one route.
        assert_eq!(found[0].success_low_over_routes, None);
        let mut on_two = episodes.clone();
        on_two[1].last.route = 1;
        on_two[2].last.route = 1;
        let found = classes(&scenario, &world, &on_two, None).remove(0);
        assert_eq!((found.success_low_over_routes, found.success_high_over_routes), (Some(0.0), Some(1.0)));
        let found = classes(&scenario, &world, &episodes, None);
        assert_eq!(classes(&scenario, &world, &episodes, Some(&[true, false, true, true]))[0].possible, Some(3));
        assert_eq!(lines(&found).len(), 3);
        assert!(lines(&[]).is_empty());
    }
}
