//! The shipped vehicles against the publications that their lengths are from: the table of scenarios/README.md,
//! computed.

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use glam::DVec2;
use offtrack::geometry::{Curve, Piece};
use offtrack::layout::{Control, Truck};
use offtrack::physics::{driven, motion_of};
use offtrack::vehicle::swept::{Pose, swept_path};
use offtrack::vehicle::{GRAVITY, Model, Vehicle};

use super::vehicle;

const FOOT: f64 = 0.3048;

/// The swept path without slip, the front axle on a straight, an arc of `radius` to the left by `turn`, and a straight
/// [m, rad].
fn turned(vehicle: &Vehicle, radius: f64, turn: f64) -> Vec<Pose> {
    let mut rig = vehicle.rig("empty", 0.05, None);
    rig.slip = 0.0;
    let arc = |from: f64, sweep: f64| Piece::Arc { centre: DVec2::ZERO, radius, from, sweep };
    let (one, two) = (arc(-FRAC_PI_2, turn / 2.0), arc(-FRAC_PI_2 + turn / 2.0, turn / 2.0));
    let approach = Piece::Segment { from: one.start() - DVec2::X, to: one.start() };
    let departure = Piece::Segment { from: two.end(), to: two.end() + 30.0 * DVec2::from_angle(turn) };
    swept_path(&rig, &Curve { pieces: vec![approach, one, two, departure] }, 1.0, 0.05)
}

/// Overall length of tractor and trailer in line (m).
fn length(vehicle: &Vehicle) -> f64 {
    let (tractor, trailer) = (&vehicle.tractor, &vehicle.trailer);
    tractor.front_overhang + tractor.wheelbase - tractor.fifth_wheel + trailer.kingpin_to_rear
}

/// AASHTO's design vehicles, with their overall length, the trailer's length, the radius of the front axle's middle in
/// the minimum turn, and the inside radius there (ft).
const AASHTO: [(&str, [f64; 4]); 3] =
    [("us_wb40", [45.5, 33.0, 36.0, 19.3]), ("us_wb67", [73.5, 53.0, 41.0, 1.9]), ("us_wb62", [69.0, 48.0, 41.0, 7.4])];

/// The table of turning widths of the United Kingdom's CD 116, before it TD 16: outer circle of its design vehicle and
/// the inner one there (m).
const CD_116: [[f64; 2]; 8] =
    [[13.0, 3.0], [13.4, 4.0], [13.9, 5.0], [14.4, 6.0], [15.0, 7.0], [15.6, 8.0], [16.3, 9.0], [17.0, 10.0]];

/// Vehicles that keep the turning circle of Directive 96/53/EC and of the United Kingdom's regulations, which have the
/// same.
const EUROPEAN: [&str; 4] = ["eu_4x2_13m6", "eu_4x2_13m6_steered", "eu_6x4_13m6", "uk_16m5"];

/// Distance of the trailer's front corners from the kingpin (m).
fn front_corners(vehicle: &Vehicle) -> f64 {
    vehicle.trailer.kingpin_to_front.hypot(0.5 * vehicle.trailer.width)
}

/// Least distance of the trailer's inner rear wheels from the centre of AASHTO's minimum turn: half a turn, the front
/// axle on this radius (m).
fn inside_radius(vehicle: &Vehicle, radius: f64) -> f64 {
    let wheel = |pose: &Pose| {
        (pose.trailer_position + 0.5 * vehicle.trailer.width * DVec2::from_angle(pose.trailer_heading).perp()).length()
    };
    turned(vehicle, radius, PI).iter().map(wheel).fold(f64::INFINITY, f64::min)
}

/// Off-tracking once it is steady, the front axle on 20 m: by driving on, and by SAE J695 from the sum of squares (m).
fn off_tracking(vehicle: &Vehicle) -> [f64; 2] {
    const RADIUS: f64 = 20.0;
    // Two turns, and no way out of them.
    let poses = turned(vehicle, RADIUS, 4.0 * PI - 1e-9);
    let steady = &poses[poses.len() - 1 - (30.5 / 0.05) as usize];
    let (first, second, third) = (vehicle.tractor.wheelbase, vehicle.tractor.fifth_wheel, vehicle.trailer.wheelbase);
    [
        RADIUS - steady.trailer_position.length(),
        RADIUS - (RADIUS.powi(2) - first.powi(2) + second.powi(2) - third.powi(2)).sqrt(),
    ]
}

fn metres(value: f64) -> String {
    format!("{value:.2} m")
}

/// The rows of the table: vehicle, what, published, ours.
fn rows() -> Vec<[String; 4]> {
    let [us, daf] = ["us_wb62", "daf_xf"].map(vehicle);
    let row = |cells: [&str; 3], ours: String| [cells[0].to_owned(), cells[1].to_owned(), cells[2].to_owned(), ours];
    let feet = |value: f64| format!("{:.1} ft, {value:.2} m", value / FOOT);
    let circle = |vehicle: &Vehicle| metres(vehicle.turning_circle_inner_radius(12.5).unwrap());
    let of_aashto = |(name, [whole, trailer, radius, inside]): (&str, [f64; 4])| {
        let us = vehicle(name);
        let row = |what: &str, published: f64, ours: f64| {
            [format!("`{name}`"), what.to_owned(), format!("{published:.1} ft"), feet(ours)]
        };
        [
            row("overall length", whole, length(&us)),
            row("length of the trailer", trailer, us.trailer.kingpin_to_front + us.trailer.kingpin_to_rear),
            row("radius of the front axle at the lock", radius, us.tractor.wheelbase / us.tractor.steer_max.sin()),
            row("inside radius of half a turn on it", inside, inside_radius(&us, radius * FOOT)),
        ]
    };
    let mut rows: Vec<[String; 4]> = AASHTO.into_iter().flat_map(of_aashto).collect();
    for name in EUROPEAN {
        let (eu, named) = (vehicle(name), format!("`{name}`"));
        let corners = format!("{:.3} m", front_corners(&eu));
        rows.extend([
            row([&named, "overall length", "at most 16.50 m"], metres(length(&eu))),
            row([&named, "kingpin to the trailer's rear", "at most 12.00 m"], metres(eu.trailer.kingpin_to_rear)),
            row([&named, "kingpin to the trailer's front corners", "at most 2.04 m"], corners),
            row([&named, "wheelbase of the trailer", "at most 8.135 m"], metres(eu.trailer.wheelbase)),
            row([&named, "inner circle, the outer one of 12.50 m", "at least 5.30 m"], circle(&eu)),
        ]);
    }
    rows.push(row(["`daf_xf`", "the same", "at least 5.30 m"], circle(&daf)));
    let uk = vehicle("uk_15m5");
    rows.push(row(["`uk_15m5`", "overall length", "15.50 m"], metres(length(&uk))));
    for [outer, inner] in CD_116 {
        let what = format!("inner circle, the outer one of {outer:.2} m");
        let found = uk.turning_circle_inner_radius(outer).unwrap();
        rows.push(row(["`uk_15m5`", &what, &metres(inner)], metres(found)));
    }
    let cn = vehicle("cn_18m1");
    rows.push(row(["`cn_18m1`", "overall length", "18.10 m"], metres(length(&cn))));
    let trailer = cn.trailer.kingpin_to_front + cn.trailer.kingpin_to_rear;
    rows.push(row(["`cn_18m1`", "length of the trailer", "at most 14.60 m"], metres(trailer)));
    let eu = vehicle("eu_4x2_13m6");
    for (name, vehicle) in [("`us_wb62`", &us), ("`eu_4x2_13m6`", &eu), ("`daf_xf`", &daf)] {
        let [driven, published] = off_tracking(vehicle).map(metres);
        rows.push([name.to_owned(), "steady off-tracking, the front axle on 20 m".to_owned(), published, driven]);
    }
    rows
}

#[test]
fn the_readme_has_the_vehicles_beside_their_sources_as_they_are_computed() {
    let readme = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/README.md")).unwrap();
    for cells in rows() {
        let row = format!("| {} |", cells.join(" | "));
        assert!(readme.contains(&row), "scenarios/README.md lacks {row}");
    }
}

#[test]
fn aashtos_vehicles_are_as_long_as_published_and_not_by_a_whole_trailer_behind_the_kingpin() {
    for (name, [whole, trailer, ..]) in AASHTO {
        let us = vehicle(name);
        // Lengths are to the centimetre, and there are four of them.
        assert!((length(&us) - whole * FOOT).abs() < 0.02, "{name}: {}", length(&us));
        let behind = us.trailer.kingpin_to_rear - us.trailer.wheelbase;
        assert!((behind - 4.5 * FOOT).abs() < 0.01, "{name}: {behind}");
        let length = us.trailer.kingpin_to_front + us.trailer.kingpin_to_rear;
        assert!((length - trailer * FOOT).abs() < 0.01, "{name}: {length}");
    }
}

#[test]
fn aashtos_vehicles_turn_inside_the_radius_that_is_published() {
    for (name, [.., radius, inside]) in AASHTO {
        let us = vehicle(name);
        let found = inside_radius(&us, radius * FOOT) / FOOT;
        // AASHTO rounds to a tenth of a foot, the file to a centimetre.
        assert!((found - inside).abs() < 0.1, "{name}: {found}");
        assert!((us.tractor.wheelbase / us.tractor.steer_max.sin() / FOOT - radius).abs() < 0.1, "{name}");
    }
}

#[test]
fn the_united_kingdoms_design_vehicle_turns_on_the_circles_of_its_manuals_table() {
    let uk = vehicle("uk_15m5");
    for [outer, inner] in CD_116 {
        let found = uk.turning_circle_inner_radius(outer).unwrap();
        // The table rounds the outer circle to 0.1 m: at the tightest, 0.14 m of the inner one.
        assert!((found - inner).abs() < 0.05, "{outer} m: {found} m");
    }
    // One trailer wheelbase alone does it: a tenth of a metre off, and the tightest circle is missed by 0.3 m.
    let mut other = uk;
    other.trailer.wheelbase += 0.1;
    assert!(0.2 < CD_116[0][1] - other.turning_circle_inner_radius(CD_116[0][0]).unwrap());
}

#[test]
fn european_vehicles_keep_their_directive_and_the_longest_british_one_lies_on_its_limits() {
    for name in EUROPEAN {
        let eu = vehicle(name);
        assert!(length(&eu) <= 16.5 + 1e-9 && eu.trailer.kingpin_to_rear <= 12.0, "{name}: {}", length(&eu));
        // What the directive deems to keep the circle: sqrt((12.5 - 2.04)^2 - (5.3 + width / 2)^2).
        let longest = (10.46f64.powi(2) - (5.3 + 0.5 * eu.trailer.width).powi(2)).sqrt();
        assert!(eu.trailer.wheelbase <= longest && 5.3 <= eu.turning_circle_inner_radius(12.5).unwrap(), "{name}");
    }
    let uk = vehicle("uk_16m5");
    assert!((length(&uk) - 16.5).abs() < 1e-9 && (front_corners(&uk) - 2.04).abs() < 1e-3);
    assert!((uk.turning_circle_inner_radius(12.5).unwrap() - 5.3).abs() < 0.005);
}

#[test]
fn a_steered_rearmost_axle_leaves_the_trailer_to_turn_about_the_middle_of_the_other_two() {
    let (fixed, steered) = (vehicle("eu_4x2_13m6"), vehicle("eu_4x2_13m6_steered"));
    // Three axles 1.31 m apart: without the last their middle is half of that farther ahead.
    assert!((fixed.trailer.wheelbase - steered.trailer.wheelbase - 0.5 * 1.31).abs() < 1e-9);
    let mut same = fixed;
    same.trailer.wheelbase = steered.trailer.wheelbase;
    assert_eq!((same.tractor, same.trailer), (steered.tractor, steered.trailer));
}

#[test]
fn chinas_design_vehicle_has_the_lengths_of_its_standard_which_add_up_to_its_overall_length() {
    let cn = vehicle("cn_18m1");
    let parts = [
        cn.tractor.front_overhang,
        cn.tractor.wheelbase,
        cn.trailer.wheelbase,
        cn.trailer.kingpin_to_rear - cn.trailer.wheelbase,
    ];
    // JTG B01-2014: front overhang, 3.3 + 11, rear overhang; 18.1 m in all.
    for (part, published) in parts.into_iter().zip([1.5, 3.3, 11.0, 2.3]) {
        assert!((part - published).abs() < 1e-9, "{part} m, {published} m");
    }
    assert!((length(&cn) - 18.1).abs() < 1e-9 && cn.turning_circle_inner_radius(12.5).is_none());
}

#[test]
fn off_tracking_in_a_steady_turn_is_that_of_sae_j695() {
    for name in super::VEHICLES {
        let [driven, published] = off_tracking(&vehicle(name));
        assert!((driven - published).abs() < 0.005, "{name}: {driven} {published}");
    }
}

#[test]
fn chronos_kraz_turns_and_bends_as_its_lengths_and_1_2_degrees_of_understeer_a_g_say() {
    // Project Chrono's Kraz 64431 with its trailer, held at 16.463 m/s and 0.03733 rad in its step steer: yaw rate
    // 0.11452 rad/s, articulation 0.05171 rad, roll 0.0461 rad. Lengths by its files: rear axles 4.08 and 5.48 m behind
    // the front one, fifth wheel 4.64 m behind it, the trailer's middle axle 7.59 m behind the kingpin.
    let (speed, steering) = (16.463f32, 0.03733f32);
    let mut kraz = vehicle("daf_xf");
    (kraz.tractor.wheelbase, kraz.tractor.fifth_wheel, kraz.trailer.wheelbase) = (4.78, 0.14, 7.59);
    if let Some(laden) = kraz.loads.get_mut("laden") {
        laden.slip = 0.0187;
        laden.suspension.roll_gain = 0.0461 / (16.463 * 0.11452 / GRAVITY);
    }
    let mut held = |understeer: f64| {
        let understeer = understeer.to_radians();
        kraz.model = Model { slip_lever: 4.0, understeer, ..Model::default() };
        let rig = kraz.rig("laden", 0.05, None);
        let control = Control { steering, ..Control::default() };
        let truck = driven(&rig, 0.05, 1200, &control, &Truck { speed, steering, ..Truck::default() });
        (truck, motion_of(&rig, &truck))
    };
    let (truck, motion) = held(1.2);
    assert!((motion.yaw_rate / 0.11452 - 1.0).abs() < 0.005, "{} rad/s", motion.yaw_rate);
    let bent = truck.heading - truck.trailer_heading;
    assert!((bent / 0.05171 - 1.0).abs() < 0.01, "{bent} rad");
    assert!((truck.trailer_roll / 0.0461 - 1.0).abs() < 0.01, "{} rad", truck.trailer_roll);
    // Without understeer it would turn a tenth faster.
    assert!(0.12 < held(0.0).1.yaw_rate);
}

#[test]
fn rollover_thresholds_lie_where_tilt_tables_and_regulations_have_them() {
    let threshold = |name: &str, load: &str| vehicle(name).loads[load].suspension.rollover_threshold();
    for name in ["daf_xf", "eu_4x2_13m6"] {
        // Of 17 tankers on a tilt table 7 were below 0.35 g and 14 below 0.40 g (Billing and Patten); a tank, and the
        // worst of them.
        assert!((0.35..0.40).contains(&threshold(name, "laden_high")));
        assert!((0.30..0.35).contains(&threshold(name, "laden_worst")));
        // Regulations ask for 0.35 g, and for 0.40 g with dangerous goods: a load of ordinary height keeps both.
        assert!((0.40..0.45).contains(&threshold(name, "laden")));
        assert!(
            threshold(name, "laden") < threshold(name, "half") && threshold(name, "half") < threshold(name, "empty")
        );
    }
}
