//! The tables of single roads, and how fast they are driven.

use super::{baked, even, map};
use crate::layout::Stream;
use crate::map::Road;
use crate::map::ground::Ground;
use crate::map::procedural;
use crate::traffic::bake::met;
use crate::traffic::meetings::Points;
use crate::traffic::paths::courses;
use crate::traffic::units::{metres, speed};
use crate::traffic::{Car, Demand, Error, Event, Kind, Mix, Network, Rules, Run, demand, speed_limit};

/// Numbers of zones by kind.
fn counts(network: &Network) -> [usize; 4] {
    Kind::ALL.map(|kind| network.zones.iter().filter(|zone| zone.stretch().kind == kind).count())
}

#[test]
fn the_zones_of_a_study_ring_a_map_and_a_junction_are_those_that_their_lanes_make() {
    let roads = [
        (Road::named("16m").unwrap(), 20, 8, [180, 86, 30, 181]),
        (map("zala8"), 16, 4, [256, 0, 0, 132]),
        (map("town03-crossing"), 14, 6, [54, 48, 10, 32]),
    ];
    for (road, n_paths, n_sources, expected) in roads {
        let network = Network::bake(&road).unwrap();
        let found = (network.paths.len(), network.sources.len(), counts(&network));
        assert_eq!(found, (n_paths, n_sources, expected), "{}", road.name);
    }
    // Cars wait at most 3 m before the ring, whose outer kerb is 50 m from where they come. A right lane's first exit
    // crosses nothing; a left lane crosses the outer lane of the ring, 7 to 20 m behind the line.
    let network = baked("16m");
    for (index, path) in network.paths.iter().enumerate() {
        assert!((47.0..50.0).contains(&path.line()), "{path:?}");
        let crossed = metres(path.clear) - path.line();
        match (network.source_of(index).lane, path.exit) {
            (0, 1) => assert_eq!(path.clear, 0, "{path:?}"),
            (1, _) => assert!((7.0..20.0).contains(&crossed), "{path:?}"),
            _ => {}
        }
    }
}

#[test]
fn the_lines_of_every_road_are_at_its_ring_and_not_where_both_lanes_of_an_arm_are_near_each_other() {
    let mut roads: Vec<Road> = ["sumo22", "town03", "zala8", "zala25"].map(map).to_vec();
    for (distribution, first) in [("wide", 40), ("wide", 256), ("wide", 290), ("mixed", 200)] {
        roads.extend((first..first + 12).map(|k| procedural::find(&format!("{distribution}/2026/{k}")).unwrap()));
    }
    let mut n_narrow = 0;
    for road in roads {
        let network = Network::bake(&road).unwrap();
        let outer_radius = road.ground().outer_radius;
        for (index, path) in network.paths.iter().enumerate() {
            let beyond = f64::from(network.pose(index, path.line()).0.length()) - outer_radius;
            assert!(
                (-10.0..10.0).contains(&beyond),
                "{}: the line of path {index} is {beyond} m from the ring",
                road.name
            );
        }
        let fine: Vec<Points> = courses(road.ground()).iter().map(|course| Points::of(&course.line)).collect();
        let met = met(&fine, outer_radius);
        n_narrow += usize::from(met.iter().flatten().any(|meeting| meeting.is_oncoming));
    }
    // Eight random roads and a map, at least, have an arm whose lanes are that near.
    assert!(9 <= n_narrow, "{n_narrow}");
}

#[test]
fn what_one_path_meets_of_another_is_what_that_meets_of_the_first() {
    // The last one has an arm whose lanes lie near each other.
    let narrow = procedural::find("wide/2026/256").unwrap();
    for network in [baked("20m"), Network::bake(&map("town03")).unwrap(), Network::bake(&narrow).unwrap()] {
        let n = network.paths.len();
        for (a, b) in (0..n).flat_map(|a| (0..n).map(move |b| (a, b))) {
            let hard = |a: usize, b: usize| {
                let zones = network.zones_of(a, b).iter();
                let hard = zones.filter(|zone| matches!(zone.stretch().kind, Kind::Follow | Kind::Cross));
                let mut hard: Vec<_> = hard.map(|zone| (zone.a, zone.b, zone.delta, zone.kind)).collect();
                hard.sort_unstable();
                hard
            };
            let mut exchanged: Vec<_> =
                hard(b, a).into_iter().map(|(b, a, delta, kind)| (a, b, -delta, kind)).collect();
            exchanged.sort_unstable();
            assert_eq!(hard(a, b), exchanged, "{a} {b}");
        }
        // Entries and the ring behind them: most pairs meet.
        assert!(n * n < 2 * network.pairs.iter().filter(|pair| 0 < pair.n).count());
    }
}

#[test]
fn a_left_hand_road_has_the_tables_and_cars_of_its_mirror_image_to_the_last_bit() {
    let ground = Road::named("16m").unwrap().ground().clone();
    let left = Road::on("left".to_owned(), Ground { mirrored: true, ..ground.clone() });
    let networks = [Network::bake(&Road::on("right".to_owned(), ground)).unwrap(), Network::bake(&left).unwrap()];
    assert_eq!(networks[0].words(), networks[1].words());
    let driven = |network: &Network| {
        let (rules, demand) = (Rules::FITTED, even(network, 1800.0));
        let mut run = Run::new(network, &rules, &demand, 24, Stream { seed: 4, env: 2 });
        (0..2_000).for_each(|_| run.step(|_, _| {}));
        bytemuck::cast_slice::<Car, u32>(&run.cars).to_vec()
    };
    assert_eq!(driven(&networks[0]), driven(&networks[1]));
    // As it is seen, it lies on the other side: the same zones at the same stations, and every point mirrored.
    let seen = Network::bake(&left.seen()).unwrap();
    assert_eq!(seen.zones, networks[1].zones);
    let mirrored = |p: glam::Vec2| [p.x.to_bits(), (-p.y).to_bits()];
    for (one, other) in seen.samples.iter().zip(&networks[1].samples) {
        assert_eq!([one.position.x, one.position.y].map(f32::to_bits), mirrored(other.position));
    }
    assert_ne!(seen.samples, networks[1].samples);
}

/// Mean speed on a ring lane of a car that nobody hinders, over the paths that lead to an exit from an entry lane
/// (km/h).
fn speed_in_ring(network: &Network, lane: u32, exit: u32, radius: f64) -> f64 {
    let nobody = Demand::new(network, &vec![0.0; network.paths.len()], Mix::default()).unwrap();
    let mut speeds = Vec::new();
    for (index, path) in network.paths.iter().enumerate() {
        if network.source_of(index).lane != lane || path.exit != exit {
            continue;
        }
        let rules = Rules::FITTED;
        let mut run = Run::new(network, &rules, &nobody, 1, Stream::default());
        run.cars[0] = Car::entering(index, 7, speed(8.0));
        while run.cars[0].is_there() {
            let (place, _) = network.pose(index, run.cars[0].station());
            if (f64::from(place.length()) - radius).abs() < 0.1 {
                speeds.push(3.6 * f64::from(run.cars[0].speed()));
            }
            run.step(|_, _| {});
        }
    }
    assert!(20 < speeds.len(), "{radius}: {}", speeds.len());
    speeds.iter().sum::<f64>() / speeds.len() as f64
}

#[test]
fn cars_go_round_the_study_rings_as_fast_as_nchrp_1043_has_it() {
    // Speeds by equation 9.3 on the inner lane and on the outer one (km/h).
    let published = [
        ("16m", [20.0, 23.0]),
        ("20m", [23.0, 25.0]),
        ("32m", [26.0, 27.0]),
        ("40m", [27.0, 29.0]),
        ("50m", [29.0, 31.0]),
    ];
    for (name, expected) in published {
        let (radii, network) = (Road::named(name).unwrap().lane_radii(), baked(name));
        for ((lane, exit), (radius, expected)) in [(1, 3), (0, 2)].into_iter().zip(radii.into_iter().zip(expected)) {
            let found = speed_in_ring(&network, lane, exit, radius);
            assert!((found / expected - 1.0).abs() < 0.1, "{name}, lane {lane}: {found} km/h, not {expected}");
        }
    }
    // The lateral limit binds only where a ring is tighter than any of these.
    let at = |radius: f64| 3.6 * speed_limit(1.0 / radius);
    assert!((at(6.0) - 3.6 * 18f64.sqrt()).abs() < 1e-9 && (at(20.0) - 8.617 * 20f64.powf(0.3673)).abs() < 1e-9);
    assert!((3.6 * speed_limit(-1.0 / 20.0) - 8.760 * 20f64.powf(0.3861)).abs() < 1e-9);
    assert_eq!(at(200.0), 36.0);
}

#[test]
fn a_junction_without_a_ring_takes_900_cars_an_hour_and_no_more_and_no_flow_is_negative() {
    let crossing = Network::bake(&map("town03-crossing")).unwrap();
    let of = |total: f64| Demand::new(&crossing, &Demand::even(&crossing, total), Mix::default());
    assert!(of(demand::MOST_WITHOUT_RING).is_ok());
    // Of parts whose sum is more in the last bit.
    let mut flows = vec![0.0; crossing.paths.len()];
    flows[..2].copy_from_slice(&[899.9, 0.100_000_000_000_1]);
    assert!(900.0 < flows.iter().sum::<f64>() && Demand::new(&crossing, &flows, Mix::default()).is_ok());
    let error = of(1500.0).unwrap_err();
    assert!(matches!(error, Error::NoRing { .. }), "{error}");
    assert_eq!(
        error.to_string(),
        "1500 veh/h on a road without a ring, whose junction locks under that many; must lie in 0..900 veh/h"
    );
    let ring = baked("16m");
    for flow in [-1.0, f64::NAN, f64::INFINITY, 40_000.0] {
        let flows: Vec<f64> = (0..ring.paths.len()).map(|path| if path == 0 { flow } else { 0.0 }).collect();
        assert!(matches!(Demand::new(&ring, &flows, Mix::default()), Err(Error::Flow { .. })), "{flow}");
    }
}

#[test]
fn where_slots_are_short_no_lane_is_starved() {
    let network = Network::bake(&Road::named("20m").unwrap()).unwrap();
    let demand = Demand::new(&network, &vec![1.0; network.paths.len()], Mix::default()).unwrap();
    let mut run = Run::new(&network, &Rules::FITTED, &demand, 64, Stream::default());
    let n = network.sources.len();
    let mut entered = vec![0; n];
    for _ in 0..6000 {
        (0..n).for_each(|source| run.fill(source));
        run.step(|event, _| {
            if let Event::Entered(source, _) = event {
                entered[source] += 1;
            }
        });
    }
    let right: Vec<u32> = (0..n).filter(|&at| network.sources[at].lane == 0).map(|at| entered[at]).collect();
    let (least, most) = (right.iter().min().unwrap(), right.iter().max().unwrap());
    assert!(2 <= right.len() && *most < least + least / 5, "{entered:?}");
}

#[test]
fn as_many_cars_come_and_take_each_exit_as_are_asked_for() {
    let network = baked("16m");
    let asked = Demand::even(&network, 1200.0);
    let (rules, demand) = (Rules::FITTED, even(&network, 1200.0));
    let mut run = Run::new(&network, &rules, &demand, 64, Stream { seed: 5, env: 0 });
    let mut left = vec![0.0; network.paths.len()];
    let (mut came, mut vans, mut rude) = (0.0, 0.0, 0.0);
    let hours = 10.0;
    for _ in 0..(hours * 36_000.0) as u32 {
        run.step(|event, cars| match event {
            Event::Came(_) => came += 1.0,
            Event::Left(slot) => {
                left[cars[slot].path()] += 1.0;
                vans += f64::from(u8::from(cars[slot].length() == 7.0));
                rude += f64::from(u8::from(cars[slot].is_rude()));
            }
            _ => {}
        });
    }
    let all: f64 = left.iter().sum();
    // Four deviations of a count.
    let is_near = |count: f64, expected: f64| (count - expected).abs() < 4.0 * expected.sqrt();
    assert!(is_near(came, 1200.0 * hours) && (came - all) < 64.0, "{came} came, {all} left");
    assert!(is_near(vans, 0.25 * all) && is_near(rude, 0.1 * all), "{vans} vans, {rude} rude of {all}");
    for (path, (&left, &asked)) in left.iter().zip(&asked).enumerate() {
        assert!(is_near(left, asked * hours), "{path}: {left} of {}", asked * hours);
    }
}
