//! Trucks of several kinds in one batch: drawn alike on every engine, and each drives as it would alone.

use std::sync::Arc;

use offtrack::files::cache::Loading;
use offtrack::layout::{Start, Truck};
use offtrack::physics::drawn_start;
use offtrack::scenario::{Fleet, Member, Ranges, Scenario};
use offtrack::simulator::{Begin, Engine, Error, RouteChoice, Simulator};
use offtrack::vehicle::Model;
use offtrack::world::World;

use crate::physics::vehicle;
use crate::{batch_on, benchmark, engines, scenarios};

/// A fleet of 512 vehicles in which everything that can be drawn is, with every lag and limit.
pub fn all_drawn() -> Fleet {
    let member = |name: &str, share: f64| {
        let mut vehicle = vehicle(name);
        vehicle.model = Model {
            slip_lever: 3.0,
            yaw_lag: 1.0,
            power: Some(330_000.0),
            friction_ellipse: true,
            crossfall: 0.01,
            fifth_wheel_load: 0.26,
            ..Model::default()
        };
        let loads = ["empty", "half", "laden", "laden_high"].map(|load| (load.to_owned(), 1.0)).into();
        Member { name: name.to_owned(), vehicle, share, loads, drawn: true }
    };
    let draw = Ranges {
        trailer_wheelbase: Some([-0.5, 0.4]),
        tractor_wheelbase: Some([-0.1, 0.3]),
        fifth_wheel: Some([-0.1, 0.2]),
        centre_of_gravity: Some([-0.12, 0.15]),
        roll_gain: Some([0.85, 1.15]),
        roll_frequency: Some([0.85, 1.15]),
        roll_damping: Some([0.7, 1.5]),
        slip: Some([0.85, 1.15]),
        friction: Some([0.6, 1.1]),
        steer_rate: Some([0.75, 1.25]),
        acceleration_max: Some([0.8, 1.2]),
        steer_delay: Some([0.0, 0.3]),
        drive_lag: Some([0.3, 0.6]),
        brake_lag: Some([0.2, 0.5]),
        yaw_lag: Some([0.8, 1.6]),
        slip_growth: Some([0.0, 1.5]),
        understeer: Some([-0.01, 0.03]),
    };
    Fleet { members: Vec::from([member("daf_xf", 2.0), member("eu_4x2_13m6", 1.0)]), draw, n_vehicles: 512 }
}

fn world() -> Arc<World> {
    let mut scenario = benchmark("attard2023").0;
    scenario.fleet = Some(all_drawn());
    Arc::new(World::bake(&scenario).unwrap())
}

fn all_routes(world: &World) -> RouteChoice {
    RouteChoice::Drawn((0..world.routes.len() as u32).collect())
}

#[test]
fn each_episode_draws_its_vehicle_alike_on_every_engine() {
    let world = world();
    assert_eq!((world.rigs.len(), world.classes.len()), (512, 8));
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 512, 7, all_routes(&world));
        (0..200).for_each(|_| simulator.step_at_random());
        let batch = simulator.batch();
        let drawn = |env: u32, truck: &Truck| drawn_start(&world.params, 7, env, truck.episode).vehicle;
        assert!((0..).zip(&batch.truck).all(|(env, truck)| truck.vehicle == drawn(env, truck)), "{name}");
        // Two thirds are of the first kind, a quarter has each load; 512 draws deviate by 6 % at most (3 sigma).
        let part = |keeps: &dyn Fn(u32) -> bool| {
            batch.truck.iter().filter(|truck| keeps(world.rig(truck).class_index)).count() as f64 / 512.0
        };
        assert!((part(&|class| class < 4) - 2.0 / 3.0).abs() < 0.063, "{}", part(&|class| class < 4));
        assert!((part(&|class| class % 4 == 0) - 0.25).abs() < 0.058);
        assert!(batch.truck.iter().any(|truck| 0 < truck.episode), "no truck began another episode");
    }
}

/// Steps of one truck on route 3 from a start, turning left after a while.
fn driven(engine: &Engine, world: &Arc<World>, start: Start, n_steps: usize) -> (Truck, Vec<f32>) {
    let mut simulator = batch_on(engine, world, 1, 0, RouteChoice::Fixed(vec![3]));
    simulator.reset_from(&[start]).unwrap();
    (0..n_steps).for_each(|step| simulator.step(&[if step < 12 { 4 } else { 6 }]).unwrap());
    (simulator.batch().truck[0], simulator.batch().observation[0].to_vec())
}

#[test]
fn a_truck_among_others_drives_as_it_would_alone() {
    let all = world();
    for (name, engine) in engines() {
        let mut last = Vec::new();
        for vehicle in [0u32, 100, 300, 511] {
            let (rig, rays) = (all.rigs[vehicle as usize], *all.rays_of(&all.rigs[vehicle as usize]));
            let mut alone = World::clone(&all);
            alone.rigs = vec![offtrack::layout::Rig { chassis: 0, ..rig }];
            alone.rays = vec![rays];
            alone.params.n_vehicles = 1;
            let start = Start { offset: 0.4, heading: -0.3, vehicle, ..Start::default() };
            let (truck, observation) = driven(&engine, &all, start, 20);
            let (own, expected) = driven(&engine, &Arc::new(alone), Start { vehicle: 0, ..start }, 20);
            assert_eq!(truck, Truck { vehicle, ..own }, "{name}");
            assert_eq!(observation, expected, "{name}");
            assert!(truck.steps == 20 && !last.contains(&observation), "{name}: another vehicle drives alike");
            last.push(observation);
        }
    }
}

#[test]
fn a_vehicle_moves_with_its_truck_and_an_unknown_one_is_refused() {
    let world = world();
    for (_, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 4, 1, all_routes(&world));
        let before: Vec<u32> = simulator.batch().truck.iter().map(|truck| truck.vehicle).collect();
        simulator.gather(&[2, 2, 0]).unwrap();
        let after: Vec<u32> = simulator.batch().truck.iter().map(|truck| truck.vehicle).collect();
        assert_eq!(after, [before[2], before[2], before[0]]);
        let wrong = Start { vehicle: 512, ..Start::default() };
        let error = simulator.begin(&[Begin { start: Some(wrong), ..Begin::default() }]).unwrap_err();
        assert_eq!(error, Error::UnknownVehicle { vehicle: 512, n_vehicles: 512 });
    }
}

/// A benchmark file with these lines in place of `vehicle` and `load`.
fn written(lines: &str) -> Result<Scenario, String> {
    let folder = tempfile::tempdir().unwrap();
    let source = scenarios();
    let text = std::fs::read_to_string(source.join("attard2023.toml")).unwrap();
    let text = text
        .replace("vehicle = \"vehicles/daf_xf.toml\"\nload = \"empty\"\n", "")
        .replace("roundabouts/", &format!("{}/roundabouts/", source.display()));
    let file = folder.path().join("fleet.toml");
    let (head, tables) = lines.split_at(lines.find('[').unwrap_or(0));
    std::fs::write(&file, format!("{head}\n{text}\n{tables}")).unwrap();
    Scenario::read(&file).map_err(|error| error.to_string().replace(&file.display().to_string(), "fleet.toml"))
}

#[test]
fn a_benchmark_states_vehicles_shares_and_ranges() {
    let scenario = written(
        "[[vehicle]]\nfile = \"daf_xf\"\nloads = { empty = 1, laden = 3 }\n[[vehicle]]\nfile = \"us_wb62\"\n\
         loads = { half = 1 }\nshare = 3\n[draw]\nn_vehicles = 64\nslip = [0.9, 1.1]",
    );
    let scenario = scenario.unwrap();
    let counts: Vec<usize> =
        (0..3).map(|class| scenario.vehicles().iter().filter(|entry| entry.class == class).count()).collect();
    assert_eq!((counts, scenario.load.as_str()), (Vec::from([4, 12, 48]), "empty"));
    // One vehicle and load, drawn from ranges.
    let one = written("vehicle = \"daf_xf\"\nload = \"laden\"\n[draw]\nfriction = [0.6, 1.1]").unwrap();
    assert_eq!((one.vehicles().len(), one.classes()[0].load.as_str()), (4096, "laden"));
    assert!(one.vehicles()[0].vehicle.tractor.friction != one.vehicles()[1].vehicle.tractor.friction);
}

#[test]
fn a_load_alone_has_the_actions_of_the_whole_benchmark() {
    let folder = tempfile::tempdir().unwrap();
    let narrow = std::fs::read_to_string(format!("{}/scenarios/vehicles/eu_4x2_13m6.toml", env!("CARGO_MANIFEST_DIR")));
    let narrow: String = narrow
        .unwrap()
        .lines()
        .map(
            |line| {
                if line.starts_with("steer_max_deg") { "steer_max_deg = 20.0\n".into() } else { format!("{line}\n") }
            },
        )
        .collect();
    let file = folder.path().join("narrow.toml");
    std::fs::write(&file, narrow).unwrap();
    let scenario = written(&format!(
        "[[vehicle]]\nfile = \"daf_xf\"\nloads = {{ empty = 1 }}\n[[vehicle]]\nfile = \"{}\"\nloads = {{ laden = 1 }}",
        file.display()
    ));
    let scenario = scenario.unwrap();
    let laden = scenario.with_classes(|class| class.load == "laden").unwrap();
    let [whole, laden] = [&scenario, &laden].map(|scenario| World::bake(scenario).unwrap());
    assert_eq!(whole.actions, laden.actions);
    assert!(laden.rigs[0].steer_max < whole.rigs[0].steer_max);
}

#[test]
fn what_is_wrong_with_a_fleet_is_named() {
    let member = "[[vehicle]]\nfile = \"daf_xf\"\nloads = { empty = 1 }\n";
    for (lines, expected) in [
        ("".to_owned(), "missing field `vehicle`"),
        (
            "[[vehicle]]\nfile = \"daf_xf\"\nloads = { water = 1 }".to_owned(),
            "fleet.toml: vehicle[0].loads: \"water\"; the vehicle has empty",
        ),
        (
            "[[vehicle]]\nfile = \"daf_xf\"\nloads = { empty = -1 }".to_owned(),
            "vehicle[0].loads.empty: -1; must lie in 0..1",
        ),
        (
            "[[vehicle]]\nfile = \"daf_xf\"\nloads = { empty = 0 }".to_owned(),
            "vehicle[0].loads: none; at least one is needed",
        ),
        ("[[vehicle]]\nfile = \"tank\"\nloads = { empty = 1 }".to_owned(), "vehicle[0].file: \"tank\""),
        ("[[vehicle]]\nfile = \"daf_xf\"\nloads = { empty = 1 }\nshares = 2".to_owned(), "unknown field `shares`"),
        (format!("{member}model = {{ slip_lever = 9.0 }}"), "vehicle[0].model.slip_lever: 9 m; must lie in 0..4 m"),
        (format!("{member}share = 0"), "vehicle[0].share: 0; must lie in"),
        (format!("{member}[draw]\nslip = [1.1, 0.9]"), "draw.slip: [1.1, 0.9]; must be [least, greatest]"),
        (format!("{member}[draw]\nslip = [0.9, 1.0, 1.1]"), "invalid length 3, expected 2 values"),
        (format!("{member}[draw]\nslip = [0.9, 100]"), "draw.slip[1]: 100; must lie in 0..10"),
        (
            format!("{member}[[vehicle]]\nfile = \"us_wb62\"\nloads = {{ empty = 1 }}\nshare = 0.0001"),
            "draw.n_vehicles: 4096 vehicles, of which us_wb62 empty is 1.0e-4; none would be one",
        ),
        (format!("{member}[draw]\nn_vehicles = 0"), "draw.n_vehicles: 0; must lie in 1..65536"),
        (
            format!("{member}[draw]\nsteer_delay = [0.0, 0.5]"),
            "time.step: 0.1 s; the vehicle's steer delay is up to 0.5 s",
        ),
        (format!("{member}[draw]\nmass = [1, 2]"), "unknown field `mass`"),
        (
            format!("{member}[draw]\nroll_damping = [1, 10]"),
            "draw.roll_damping: loads.empty.suspension.roll_damping 2; of daf_xf",
        ),
        (format!("{member}[draw]\nfifth_wheel = [-0.1, nan]"), "draw.fifth_wheel[1]: NaN m; must lie in -3..3 m"),
    ] {
        let Err(error) = written(&lines) else { panic!("{lines} was accepted") };
        assert!(error.contains(expected), "{lines}: {error}");
    }
}

#[test]
fn a_simulator_of_one_vehicle_has_one_row() {
    let world = Arc::new(benchmark("attard2023").1);
    let simulator = Simulator::new(world.clone(), 3, 0, all_routes(&world)).unwrap();
    assert!(
        world.rigs.len() == 1
            && world.rays.len() == 1
            && simulator.batch().truck.iter().all(|truck| truck.vehicle == 0)
    );
}

#[test]
fn what_no_vehicle_file_may_have_is_not_drawn_either() {
    let folder = scenarios();
    let text = std::fs::read_to_string(folder.join("transfer2026.toml")).unwrap();
    let refused = |key: &str, range: &str| {
        let line = text.lines().find(|line| line.starts_with(&format!("{key} = "))).unwrap();
        let changed = text.replacen(line, &format!("{key} = {range}"), 1);
        Scenario::parse("mine", &changed, Some(&folder), &Loading::PLAIN).unwrap_err().to_string()
    };
    for (key, range, said) in [
        ("trailer_wheelbase", "[-3.0, 0.0]", "draw: model.slip_lever 4; of daf_xf with all ranges at their ends"),
        ("centre_of_gravity", "[-1.0, 0.0]", "draw.centre_of_gravity: loads.empty.suspension.centre_of_gravity "),
        ("tractor_wheelbase", "[-3.0, 0.0]", "draw.tractor_wheelbase: tractor.wheelbase "),
    ] {
        let found = refused(key, range);
        assert!(found.contains(said) && found.contains("must lie in "), "{found}");
    }
}
