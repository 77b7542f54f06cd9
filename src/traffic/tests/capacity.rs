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

/// Of the lanes of one kind on some roads, but for those that meet others of their arm: capacity found over that of the
/// manual at the flow that circulated, and this flow (veh/h).
fn ratio(networks: &[Network], rules: &Rules, lane: Lane, circulating: f64) -> (f64, f64) {
    let (mut entered, mut passed, mut expected) = (0.0, 0.0, 0.0);
    let mut n = 0.0;
    for (network, arm) in networks.iter().flat_map(|network| (0..network.n_arms).map(move |arm| (network, arm))) {
        let survey = Survey::new(network, rules).unwrap();
        let Some(saturated) = survey.saturated(arm, circulating, Mix::default()).unwrap() else { continue };
        for run in 0..RUNS {
            let counts = survey.saturated_counts(&saturated, STEPS, Stream { seed: 0, env: run });
            let hour = 36_000.0 / f64::from(STEPS);
            for ((&source, counts), meets) in saturated.sources.iter().zip(&counts).zip(&saturated.lanes_meet) {
                if survey.lane(source) == lane && !meets {
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
fn largest_deviation(networks: &[Network], rules: &Rules, lane: Lane, flows: &[f64]) -> f64 {
    let mut largest = 0.0f64;
    for &flow in flows {
        let (found, passed) = ratio(networks, rules, lane, flow);
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
    let networks = ["16m", "20m", "32m", "50m"].map(baked);
    for lane in 0..2 {
        let lane = Lane { entry_lanes: 2, ring_lanes: 2, lane };
        let largest = largest_deviation(&networks, &Rules::FITTED, lane, &[0.0, 600.0]);
        assert!(largest < 0.15, "{lane:?}: {largest}");
    }
    let right = Lane { entry_lanes: 2, ring_lanes: 2, lane: 0 };
    let largest = largest_deviation(&networks, &hesitant(), right, &[600.0]);
    assert!(0.2 < largest, "{largest}");
}

#[test]
fn capacities_of_one_lane_into_one_are_the_manuals_within_15_percent_and_not_with_twice_the_headway() {
    let networks = [Network::bake(&map("zala25")).unwrap()];
    let lane = Lane { entry_lanes: 1, ring_lanes: 1, lane: 0 };
    let largest = largest_deviation(&networks, &Rules::FITTED, lane, &[0.0, 300.0, 700.0]);
    assert!(largest < 0.15, "{largest}");
    let sleepy = Rules { headway: 2 * Rules::FITTED.headway, ..Rules::FITTED };
    let largest = largest_deviation(&networks, &sleepy, lane, &[0.0]);
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

#[test]
fn lanes_of_an_arm_that_meet_on_their_way_are_told_from_those_that_do_not() {
    let meet = |road: &str| -> Vec<Vec<bool>> {
        let (network, rules) = (baked(road), Rules::FITTED);
        let survey = Survey::new(&network, &rules).unwrap();
        let of = |arm| survey.saturated(arm, 300.0, Mix::default()).unwrap().unwrap().lanes_meet;
        (0..network.n_arms).map(of).collect()
    };
    assert_eq!(meet("20m"), vec![vec![false; 2]; 4]);
    // The northern approach is narrow.
    assert_eq!(meet("32m"), [[false; 2], [true; 2], [false; 2], [false; 2]]);
}
