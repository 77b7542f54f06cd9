//! The rule at a car's line.

use super::*;
use crate::traffic::network::Kind;
use crate::traffic::units::{length, metres};

/// Paths of two different arms: that of a car, and that of a truck.
fn pairs(network: &Network) -> impl Iterator<Item = (usize, usize)> {
    let n = network.paths.len();
    let arm = |path: usize| network.source_of(path).entry;
    (0..n).flat_map(move |a| (0..n).map(move |b| (a, b))).filter(move |&(a, b)| arm(a) != arm(b))
}

fn line(network: &Network, path: usize) -> f32 {
    metres(network.paths[path].line)
}

#[test]
fn a_polite_car_does_not_enter_beside_a_truck_that_only_needs_the_lane_next_to_its_own() {
    let network = baked("20m");
    let (mut n_soft, mut n_wide) = (0, 0);
    for (path, of_truck) in pairs(&network) {
        let zones: Vec<_> = network.zones_of(path, of_truck).iter().map(|zone| zone.stretch()).collect();
        let Some(zone) = zones.iter().find(|zone| matches!(zone.kind, Kind::Soft | Kind::Wide)) else { continue };
        let touch = zones.iter().any(|zone| matches!(zone.kind, Kind::Follow | Kind::Cross) && zone.a_in < zone.a_out);
        if touch {
            continue;
        }
        // Its front is at the zone's end, so its rear far before: any of it counts.
        let view = view_at(&network, of_truck, metres(zone.b_out), 0.0);
        let at_line = |is_rude| car_at(path, line(&network, path) - 0.1, 0.0, is_rude);
        let ([polite, alone], [rude, _]) =
            (beside(&network, view, at_line(false)), beside(&network, view, at_line(true)));
        if view.waits || rude < alone {
            continue;
        }
        assert!(0.5 < alone && polite < 0.0, "paths {path}, {of_truck}: {polite} {alone}");
        n_soft += usize::from(zone.kind == Kind::Soft);
        n_wide += usize::from(zone.kind == Kind::Wide);
    }
    assert!(0 < n_soft + n_wide, "{n_soft} {n_wide}");
}

#[test]
fn a_car_leaves_a_truck_that_comes_more_time_than_a_car() {
    let network = baked("20m");
    let (mut n, mut n_leave) = (0, 0);
    for (path, other) in pairs(&network) {
        let end = network.paths[path].line + length(12.0);
        let zones = network.zones_of(path, other).iter().map(|zone| zone.stretch());
        // The truck is there where the first zone of the entry begins, those beside it among them.
        let Some(first) = zones.filter(|zone| zone.a_in <= end).map(|zone| metres(zone.b_in)).reduce(f32::min) else {
            continue;
        };
        if first < line(&network, other) + 14.0 {
            continue;
        }
        let waiting = car_at(path, line(&network, path) - 0.1, 0.0, false);
        let waits = |seconds: f32| {
            let view = view_at(&network, other, first - 6.0 * seconds, 6.0);
            // Not for the ground that it will cover.
            let view = View { later: [view.now, view.now].concat().try_into().unwrap(), ..view };
            beside(&network, view, waiting)[0] < 0.0
        };
        // The lag of a car is 1.1 or 1.2 s, and it is at its line.
        n += 1;
        n_leave += usize::from(waits(2.2) && !waits(3.2));
    }
    assert!(20 < n && 9 * n < 10 * n_leave, "{n} {n_leave}");
}

#[test]
fn a_truck_that_waits_before_its_line_hinders_nobody_but_those_behind_it() {
    let network = baked("20m");
    for (path, of_truck) in pairs(&network) {
        let view = view_at(&network, of_truck, line(&network, of_truck) - 5.0, 3.0);
        assert!(view.waits);
        for k in 0..30 {
            let station = line(&network, path) - 10.0 + 3.0 * k as f32;
            let car = car_at(path, station, 5.0, false);
            let [beside, alone] = beside(&network, view, car);
            // Where a path leaves by the truck's arm it passes the truck on its other carriageway.
            assert!(alone <= beside || touches_swung(&network, &view, &car), "paths {path}, {of_truck} at {station}");
        }
    }
}

/// Whether a car's way ahead comes so near to the truck that it is in its corridor.
fn touches_swung(network: &Network, view: &View, car: &Car) -> bool {
    (0..20).any(|k| {
        let mut ahead = Car { station: car.station + (k << 21), ..*car }.outlines(network);
        ahead.any(|unit| {
            let grown = Outline { half_width: unit.half_width + 0.7, ..unit };
            view.now.iter().any(|unit| unit.overlaps(&grown))
        })
    })
}
