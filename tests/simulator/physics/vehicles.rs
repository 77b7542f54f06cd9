//! The vehicle files, and the errors of wrong ones.

use std::f32::consts::FRAC_PI_2;
use std::path::Path;

use glam::{DVec2, Vec2};
use offtrack::geometry::Curve;
use offtrack::layout::{N_RAYS, N_TRAILER_RAYS, Truck};
use offtrack::physics::motion_of;
use offtrack::vehicle::Vehicle;
use offtrack::vehicle::swept::{demands, swept_path};

use super::{VEHICLES, vehicle, vehicle_file};

#[test]
fn every_vehicle_file_reads_and_has_the_five_loads() {
    let folder = vehicle_file("daf_xf").parent().unwrap().read_dir().unwrap();
    assert_eq!(folder.count(), VEHICLES.len());
    for name in VEHICLES {
        let loads: Vec<String> = vehicle(name).loads.into_keys().collect();
        assert_eq!(loads, ["empty", "half", "laden", "laden_high", "laden_worst"]);
    }
}

#[test]
fn a_rig_has_the_files_dimensions_in_metres_and_radians() {
    let rig = vehicle("daf_xf").rig("empty", 0.05, None);
    assert_eq!([rig.wheelbase, rig.fifth_wheel, rig.trailer_wheelbase, rig.slip], [3.543, 0.408, 7.756, 0.0136]);
    assert!((rig.steer_max - 0.698_131_7).abs() < 1e-6 && (rig.steer_rate - 0.349_065_85).abs() < 1e-6);
    assert!(
        (rig.tractor_body.front - 4.906).abs() < 1e-5
            && rig.tractor_body.rear == -0.958
            && rig.tractor_body.half_width == 1.25
    );
    assert!((rig.trailer_body.front - 9.846).abs() < 1e-5 && (rig.trailer_body.rear + 3.864).abs() < 1e-5);
    let agile = vehicle("daf_xf").rig("empty", 0.05, Some(70.0f64.to_radians()));
    assert!((agile.steer_max - 1.221_730_5).abs() < 1e-6);
}

#[test]
fn the_european_set_keeps_the_directives_turning_circle_free_and_a_longer_trailer_does_not() {
    let european = vehicle("eu_4x2_13m6");
    // Reference to the centimetre for the directive's outer circle of 12.50 m; it requires 5.30 m.
    let inner = european.turning_circle_inner_radius(12.5).unwrap();
    assert!((inner - 5.41).abs() < 0.005, "{inner}");
    let mut longer = european;
    (longer.tractor.wheelbase, longer.tractor.fifth_wheel, longer.trailer.wheelbase) = (3.543, 0.408, 8.174);
    let inner = longer.turning_circle_inner_radius(12.5).unwrap();
    assert!((inner - 4.85).abs() < 0.005, "{inner}");
    assert_eq!(longer.turning_circle_inner_radius(5.0), None);
}

#[test]
fn critical_steering_angles_are_those_of_the_reference() {
    let critical = |name| vehicle(name).single_track().critical_steering().to_degrees();
    // The reference has one decimal.
    assert!((critical("eu_4x2_13m6") - 25.1).abs() < 0.05, "{}", critical("eu_4x2_13m6"));
    // AASHTO's long trailer has no steady turn at full lock.
    let american = vehicle("us_wb62");
    assert_eq!(american.single_track().at_steering(american.tractor.steer_max), None);
}

#[test]
fn units_roll_over_at_the_thresholds_of_the_presets() {
    for name in VEHICLES {
        let vehicle = vehicle(name);
        // The table rounds 0.858 down.
        assert!((vehicle.tractor.suspension.rollover_threshold() - 0.85).abs() < 0.01);
        for (load, threshold) in
            [("empty", 0.77), ("half", 0.57), ("laden", 0.41), ("laden_high", 0.37), ("laden_worst", 0.324)]
        {
            assert!((vehicle.loads[load].suspension.rollover_threshold() - threshold).abs() < 0.005, "{load}");
        }
    }
    assert_eq!(vehicle("daf_xf").gross_mass(&vehicle("daf_xf").loads["laden"]), 40_000.0);
}

#[test]
fn sensors_are_where_an_observation_expects_them() {
    let vehicle = vehicle("daf_xf");
    let rays = vehicle.rays();
    let body = vehicle.trailer_body();
    assert_eq!(rays[0].origin, Vec2::new(body.front, body.half_width));
    assert_eq!(rays[1].origin, Vec2::new(body.front, -body.half_width));
    assert!((rays[N_TRAILER_RAYS - 1].origin - Vec2::new(body.rear, -body.half_width)).length() < 1e-5);
    let gap = rays[0].origin.x - rays[2].origin.x;
    for pair in 0..8 {
        assert_eq!([rays[2 * pair].direction, rays[2 * pair + 1].direction], [Vec2::Y, Vec2::NEG_Y]);
        // An f32 of 10 m has an ulp of 1e-6.
        assert!((rays[2 * pair].origin.x - (body.front - pair as f32 * gap)).abs() < 1e-5);
    }
    for (mount, ray) in rays[N_TRAILER_RAYS..].iter().enumerate() {
        assert_eq!(ray.origin, Vec2::new(vehicle.tractor_body().front, 0.0));
        let angle = FRAC_PI_2 - mount as f32 * 15.0f32.to_radians();
        assert!((ray.direction - Vec2::from_angle(angle)).length() < 1e-6, "{mount}");
    }
    assert_eq!(rays.len(), N_RAYS);
}

/// The error for the study's truck with `from` replaced by `to` in its file.
fn refusal(from: &str, to: &str) -> String {
    let text = std::fs::read_to_string(vehicle_file("daf_xf")).unwrap();
    assert!(text.contains(from), "{from}");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("truck.toml");
    std::fs::write(&file, text.replacen(from, to, 1)).unwrap();
    Vehicle::read(&file).unwrap_err().to_string()
}

#[test]
fn a_wrong_vehicle_file_is_refused_with_its_key_its_value_and_what_would_do() {
    let wrong = [
        ("wheelbase = 3.543", "wheelbase = -3.5", "tractor.wheelbase: -3.5 m; must lie in 2..10 m"),
        ("wheelbase = 3.543", "wheelbase = nan", "tractor.wheelbase: NaN m"),
        ("steer_max_deg = 40.0", "steer_max_deg = 90.0", "tractor.steer_max_deg: 90 deg; must lie in 1..80 deg"),
        ("slip = 0.0136", "slip = 1.36", "loads.empty.slip: 1.36 rad/(m/s^2); must lie in 0..0.1"),
        ("roll_centre = 0.75", "roll_centre = 1.5", "loads.empty.suspension.roll_centre: 1.5 m; must lie in 0..1.25 m"),
        ("width = 2.5", "widht = 2.5", "unknown field `widht`"),
        ("mass = 7800.0\n", "", "missing field `mass`"),
        (
            "[loads.empty]",
            "[sensors]\ntractor_mounts = [[4.0, 0.0]]\n[loads.empty]",
            "sensors.tractor_mounts: 1 mount; must be 13",
        ),
        (
            "[loads.empty]",
            "[sensors]\ntrailer_first = 8.0\ntrailer_last = 3.0\n[loads.empty]",
            "sensors.trailer_last: 3 m; must lie in 8..13.7",
        ),
        (
            "kingpin_to_rear = 11.62",
            "kingpin_to_rear = 7.0",
            "trailer.kingpin_to_rear: 7 m; its axles would be behind it: must be at least the wheelbase, 7.756 m",
        ),
        (
            "[loads.empty]",
            "[speed_control]\ngain = 0.0\n[loads.empty]",
            "speed_control.gain: 0 1/s; must lie in 0.01..10 1/s",
        ),
    ];
    // The sum of the trailer's two lengths as decimals is the last place.
    let text = std::fs::read_to_string(vehicle_file("daf_xf")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("truck.toml");
    std::fs::write(&file, text.replacen("[loads.empty]", "[sensors]\ntrailer_last = 13.71\n[loads.empty]", 1)).unwrap();
    let (as_shipped, at_end) = (Vehicle::read(&vehicle_file("daf_xf")).unwrap(), Vehicle::read(&file).unwrap());
    assert_eq!(at_end.sensors.trailer_last, as_shipped.sensors.trailer_last);
    for (from, to, expected) in wrong {
        let message = refusal(from, to);
        assert!(message.contains("truck.toml") && message.contains(expected), "{message}");
    }
    let missing = Vehicle::read(Path::new("no/such/truck.toml")).unwrap_err().to_string();
    assert!(missing.contains("no/such/truck.toml: cannot be read"), "{missing}");
}

#[test]
fn the_ends_of_ranges_that_are_sums_are_those_of_decimals() {
    let text = std::fs::read_to_string(vehicle_file("daf_xf")).unwrap();
    let changes = [("wheelbase = 3.543", "wheelbase = 3.61"), ("front_overhang = 1.363", "front_overhang = 1.33")];
    let longer = changes.iter().fold(text, |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    });
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("truck.toml");
    // Both sums lie below these as floats.
    let mounts = format!("[sensors]\ntractor_mounts = [{}]\n", vec!["[4.94, 0.0]"; 13].join(", "));
    std::fs::write(&file, longer.clone() + "\n" + &mounts).unwrap();
    assert_eq!(Vehicle::read(&file).unwrap().sensors.tractor_mounts[12].x, 3.61 + 1.33);
    let short = longer.replacen("wheelbase = 7.756", "wheelbase = 4.1", 1);
    for (lever, accepted) in [(3.1, true), (3.11, false)] {
        std::fs::write(&file, format!("{short}\n[model]\nslip_lever = {lever}\n")).unwrap();
        assert_eq!(Vehicle::read(&file).is_ok(), accepted, "{lever}");
    }
}

#[test]
fn a_file_can_move_its_sensors() {
    let text = std::fs::read_to_string(vehicle_file("daf_xf")).unwrap();
    let mounts: Vec<String> = (0..13).map(|mount| format!("[4.5, {}]", 1.2 - 0.2 * f64::from(mount))).collect();
    let sensors =
        format!("[sensors]\ntrailer_first = 1.0\ntrailer_last = 8.0\ntractor_mounts = [{}]\n", mounts.join(", "));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("truck.toml");
    std::fs::write(&file, format!("{text}\n{sensors}")).unwrap();
    let vehicle = Vehicle::read(&file).unwrap();
    let (rays, front) = (vehicle.rays(), vehicle.trailer_body().front);
    assert_eq!(rays[0].origin.x, front - 1.0);
    assert_eq!(rays[14].origin.x, front - 8.0);
    assert_eq!(rays[N_TRAILER_RAYS].origin, Vec2::new(4.5, 1.2));
}

#[test]
fn on_a_circle_that_the_front_axle_follows_both_units_turn_as_in_a_step() {
    const SPACING: f64 = 0.25;
    let mut vehicle = vehicle("daf_xf");
    vehicle.model.slip_lever = 4.0;
    for (load, radius, kmh) in [("laden", 12.0, 15.0), ("laden", 12.0, 20.0), ("empty", 20.0, 30.0)] {
        let speed = kmh / 3.6;
        let rig = vehicle.rig(load, (SPACING / speed) as f32, None);
        let circle = Curve::circle(DVec2::ZERO, radius);
        let line = Curve { pieces: [circle.pieces.clone(), circle.pieces].concat() };
        let path = swept_path(&rig, &line, speed, SPACING);
        let last = *demands(&rig, &line, &path, speed, SPACING).last().unwrap();
        let pose = path.last().unwrap();
        let truck = Truck {
            heading: pose.heading as f32,
            trailer_heading: pose.trailer_heading as f32,
            steering: last.steering as f32,
            speed: (speed * (line.heading_at(last.station) - pose.heading).cos()) as f32,
            ..Truck::default()
        };
        let motion = motion_of(&rig, &truck);
        // In a steady turn both turn at the rate of the front axle on its circle.
        let yaw = (speed / radius) as f32;
        assert!((motion.yaw_rate - yaw).abs() < 1e-3 && (motion.trailer_yaw_rate - yaw).abs() < 1e-3, "{motion:?}");
        assert!((motion.lateral_acceleration - last.lateral_acceleration as f32).abs() < 1e-2, "{motion:?}");
    }
}
