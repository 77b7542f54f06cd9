//! Entries have the capacities of the Highway Capacity Manual.

use std::path::Path;

use super::{baked, map};
use crate::layout::Stream;
use crate::map::Road;
use crate::map::chosen::Choice;
use crate::map::opendrive::{RoadLane, Way};
use crate::traffic::hcm::Lane;
use crate::traffic::{Demand, Mix, Network, Rules, Survey};

/// Steps of each of the runs at a point: 13 minutes.
const STEPS: u32 = 7_800;
const RUNS: u32 = 2;

/// Of the lanes of one kind on a road: capacity found over that of the manual at the flow that circulated, and this
/// flow (veh/h).
fn ratio(network: &Network, rules: &Rules, lane: Lane, circulating: f64) -> (f64, f64) {
    let survey = Survey::new(network, rules).unwrap();
    let (mut entered, mut passed, mut expected) = (0.0, 0.0, 0.0);
    let mut n = 0.0;
    for arm in 0..network.n_arms {
        let Some(saturated) = survey.saturated(arm, circulating, Mix::default()).unwrap() else { continue };
        for run in 0..RUNS {
            let counts = survey.saturated_counts(&saturated, STEPS, Stream { seed: 0, env: run });
            let hour = 36_000.0 / f64::from(STEPS);
            for (&source, counts) in saturated.sources.iter().zip(&counts) {
                if survey.lane(source) == lane {
                    let passing = counts.circulating as f64 * hour;
                    entered += counts.served as f64 * hour;
                    passed += passing;
                    expected += lane.capacity(passing, 0.0);
                    n += 1.0;
                }
            }
        }
    }
    assert!(0.0 < n, "no lane is {lane:?}");
    (entered / expected, passed / n)
}

/// The largest deviation of a kind of lane from the manual, over flows (veh/h), which did circulate.
fn largest_deviation(network: &Network, rules: &Rules, lane: Lane, flows: &[f64]) -> f64 {
    let mut largest = 0.0f64;
    for &flow in flows {
        let (found, passed) = ratio(network, rules, lane, flow);
        assert!((passed - flow).abs() < 0.15 * flow.max(1.0), "{lane:?} at {flow}: {passed} passed");
        largest = largest.max((found - 1.0).abs());
    }
    largest
}

/// The rules with lags twice as long.
fn hesitant() -> Rules {
    let Rules { lags, soft_lags, .. } = Rules::FITTED;
    Rules { lags: lags.map(|lag| 2 * lag), soft_lags: soft_lags.map(|lag| 2 * lag), ..Rules::FITTED }
}

#[test]
fn capacities_of_two_lanes_into_two_are_the_manuals_within_15_percent_and_not_with_twice_the_lags() {
    let network = baked("32m");
    for lane in 0..2 {
        let lane = Lane { entry_lanes: 2, ring_lanes: 2, lane };
        let largest = largest_deviation(&network, &Rules::FITTED, lane, &[0.0, 600.0]);
        assert!(largest < 0.15, "{lane:?}: {largest}");
    }
    let right = Lane { entry_lanes: 2, ring_lanes: 2, lane: 0 };
    let largest = largest_deviation(&network, &hesitant(), right, &[600.0]);
    assert!(0.2 < largest, "{largest}");
}

#[test]
fn capacities_of_one_lane_into_one_are_the_manuals_within_15_percent_and_not_with_twice_the_headway() {
    let network = Network::bake(&map("zala25")).unwrap();
    let lane = Lane { entry_lanes: 1, ring_lanes: 1, lane: 0 };
    let largest = largest_deviation(&network, &Rules::FITTED, lane, &[0.0, 300.0, 700.0]);
    assert!(largest < 0.15, "{largest}");
    let sleepy = Rules { headway: 2 * Rules::FITTED.headway, ..Rules::FITTED };
    let largest = largest_deviation(&network, &sleepy, lane, &[0.0]);
    assert!(0.15 < largest, "{largest}");
}

#[test]
fn cars_on_a_path_that_meets_no_other_arms_are_counted_where_they_leave() {
    let lane = |road: &str, lane| RoadLane { road: road.into(), lane };
    let ways = [Way { from: lane("90", 1), to: lane("34", -1) }].into();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/maps/Town03.xodr");
    let road = Road::from_map(&file, &Choice { ways, ..Choice::default() }).unwrap();
    let (network, rules) = (Network::bake(&road).unwrap(), Rules::FITTED);
    assert_eq!(network.paths[0].line, network.paths[0].length);
    let survey = Survey::new(&network, &rules).unwrap();
    let demand = Demand::new(&network, &[400.0], Mix::default()).unwrap();
    let counts = &survey.counted(&demand, 18_000, Stream { seed: 3, env: 0 }, &[])[0];
    // All but those under way at both ends.
    assert!(150 < counts.came && counts.came.abs_diff(counts.served) < 8, "{counts:?}");
    assert_eq!((counts.delayed, counts.circulating), (counts.served, 0));
    assert!(counts.mean_delay().unwrap() < 1.5, "{counts:?}");
}
