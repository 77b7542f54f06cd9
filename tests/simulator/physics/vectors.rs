//! The reference vectors: each kind is computed with the simulator's own functions and compared within the tolerances
//! of its file.

mod steady;

use std::sync::{Arc, OnceLock};

use bytemuck::bytes_of;
use glam::DVec2;
use offtrack::engine::stages::Stage;
use offtrack::layout::{Column, Rig, Truck};
use offtrack::physics::{Moving, motion_of};
use offtrack::simulator::{Engine, RouteChoice, Simulator};
use offtrack::world::World;
use offtrack_reference::trace::{Case, CaseVehicle, Command, Init, Traced, trace, trace_by};
use serde_json::Value;

use steady::{path_follow, rollover_static, single_track, steady_envelope, steady_state, steady_state_limit};

use crate::{batch_on, benchmark, engines};

/// The largest ratio of an error to its tolerance, and its quantity.
#[derive(Debug, Clone, Default)]
struct Worst {
    ratio: f64,
    what: String,
}

impl Worst {
    fn see(&mut self, what: &str, error: f64, tolerance: f64) {
        let ratio = error.abs() / tolerance;
        // NaN counts as the largest error.
        if ratio.is_nan() || self.ratio < ratio {
            *self = Worst {
                ratio: if ratio.is_nan() { f64::INFINITY } else { ratio },
                what: format!("{what}: {error:e} of {tolerance:e}"),
            };
        }
    }

    fn see_option(&mut self, what: &str, value: Option<f64>, expected: &Value, tolerance: f64) {
        match (value, expected.as_f64()) {
            (Some(value), Some(expected)) => self.see(what, value - expected, tolerance),
            (None, None) => {}
            _ => self.see(what, f64::NAN, tolerance),
        }
    }
}

fn cases() -> Vec<Value> {
    cases_of("physics_vectors.json")
}

fn cases_of(file: &str) -> Vec<Value> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(file);
    let file: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    file["cases"].as_array().unwrap().clone()
}

fn case(id: &str) -> Value {
    cases().into_iter().find(|case| case["id"] == id).unwrap()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} in {value}"))
}

fn point(value: &Value) -> DVec2 {
    DVec2::new(value[0].as_f64().unwrap(), value[1].as_f64().unwrap())
}

fn rows(case: &Value) -> &[Value] {
    case["rows"].as_array().unwrap()
}

/// A vehicle for cases that only give the positions of the axles.
fn kinematic(row: &Value) -> CaseVehicle {
    let any: CaseVehicle = serde_json::from_value(case("straight_30")["vehicle"].clone()).unwrap();
    CaseVehicle {
        L1: number(row, "L1"),
        a: number(row, "a"),
        L2: number(row, "L2"),
        K: 0.0,
        delta_max: 1.5,
        gamma_max: 10.0,
        ..any
    }
}

/// Drives a case on an engine, a sub-step at a time. Each is one drive stage of a world that has this rig.
fn traced(engine: &Engine, case: &Case) -> Traced {
    let mut simulators: Vec<(Rig, f32, Simulator)> = Vec::new();
    trace_by(case, |rig, substep, control, moving| {
        let known = simulators.iter().position(|(known, length, _)| (known, length) == (rig, &substep));
        let index = known.unwrap_or_else(|| {
            simulators.push((*rig, substep, alone(engine, rig, substep)));
            simulators.len() - 1
        });
        let simulator = &mut simulators[index].2;
        let batch = simulator.batch().clone();
        let given = |column| match column {
            Column::Control => bytes_of(control),
            Column::Truck => bytes_of(&moving.truck),
            other => batch.column(other),
        };
        simulator.restore(|column| Some(given(column))).unwrap();
        simulator.run_stage(Stage::Drive);
        let truck = simulator.batch().truck[0];
        Moving { truck, motion: motion_of(rig, &truck) }
    })
    .unwrap()
}

/// One truck with this rig, whose step is one sub-step.
fn alone(engine: &Engine, rig: &Rig, substep: f32) -> Simulator {
    static WORLD: OnceLock<World> = OnceLock::new();
    let mut world = WORLD.get_or_init(|| benchmark("attard2023").1).clone();
    (world.rigs[0], world.params.substep, world.params.n_substeps) = (*rig, substep, 1);
    batch_on(engine, &Arc::new(world), 1, 0, RouteChoice::Drawn(vec![0]))
}

/// The state that a truck reaches `t` seconds after `init` under one command.
fn driven(
    engine: &Engine,
    vehicle: CaseVehicle,
    init: Init,
    command: Command,
    t: f64,
) -> offtrack_reference::trace::State {
    let case = Case {
        id: String::new(),
        vehicle,
        dt: 0.05,
        control_step: 0.1,
        init,
        commands: vec![command],
        t_end: t,
        times: Some(vec![t]),
        expected: vec![],
    };
    traced(engine, &case).states[0]
}

fn trajectory(engine: &Engine, written: &Value, changed: impl Fn(&mut Case)) -> Worst {
    let mut case: Case = serde_json::from_value(written.clone()).unwrap();
    assert_eq!(case.dt, 0.05);
    changed(&mut case);
    let traced = traced(engine, &case);
    if matches!(engine, Engine::Cpu) {
        let chained = trace(&case).unwrap();
        // A stage begins with the roll of its truck, the next sub-step of one with that of the sub-step before.
        let is_alike = match case.vehicle.slip_growth == 0.0 {
            true => traced == chained,
            false => (compare(&traced, written).ratio - compare(&chained, written).ratio).abs() < 0.05,
        };
        assert!(is_alike, "{}: a trace differs from the drive stage", case.id);
    }
    compare(&traced, written)
}

fn compare(traced: &Traced, written: &Value) -> Worst {
    let mut worst = Worst::default();
    let tolerance = |key: &str| number(&written["tolerance"], key);
    let expected = written["expected"].as_array().unwrap();
    assert_eq!(traced.states.len(), expected.len());
    for (state, expected) in traced.states.iter().zip(expected) {
        assert_eq!(state.t, number(expected, "t"));
        let place = DVec2::new(number(expected, "x"), number(expected, "y"));
        worst.see("pos", DVec2::new(state.x, state.y).distance(place), tolerance("pos"));
        worst.see("hitch", DVec2::from(state.hitch).distance(point(&expected["hitch"])), tolerance("pos"));
        worst.see(
            "trailer_pos",
            DVec2::from(state.trailer_axle).distance(point(&expected["trailer_axle"])),
            tolerance("trailer_pos"),
        );
        worst.see("psi1", state.psi1 - number(expected, "psi1"), tolerance("psi1"));
        worst.see("psi2", state.psi2 - number(expected, "psi2"), tolerance("psi1") + tolerance("gamma"));
        worst.see("gamma", state.gamma - number(expected, "gamma"), tolerance("gamma"));
        worst.see("v", state.v - number(expected, "v"), tolerance("v"));
        worst.see("delta", state.delta - number(expected, "delta"), tolerance("delta"));
        worst.see("ay1", state.ay1 - number(expected, "ay1"), tolerance("ay"));
        worst.see("ay2", state.ay2 - number(expected, "ay2"), tolerance("ay"));
        worst.see("ltr1_qs", state.ltr1_qs - number(expected, "ltr1_qs"), tolerance("ltr"));
        worst.see("ltr2_qs", state.ltr2_qs - number(expected, "ltr2_qs"), tolerance("ltr"));
        worst.see("ltr2_dyn", state.ltr2_dyn - number(expected, "ltr2_dyn"), tolerance("ltr"));
    }
    if let Some(expected) = written["expected_peak"].as_object() {
        let peak = serde_json::to_value(traced.peak.unwrap()).unwrap();
        assert_eq!(expected.len(), 7);
        for (key, expected) in expected {
            let expected = expected.as_f64().unwrap();
            // A peak of nothing at all may still be the rounding of an f32.
            worst.see(
                &format!("peak {key}"),
                number(&peak, key) - expected,
                tolerance("peak_rel") * expected.abs() + 1e-6,
            );
        }
    }
    let jackknife_tolerance = written["tolerance"]["t_jackknife"].as_f64().unwrap_or(0.05);
    worst.see_option("t_jackknife", traced.t_jackknife, &written["t_jackknife"], jackknife_tolerance);
    worst
}

fn closed_form(engine: &Engine, written: &Value) -> Worst {
    let mut worst = Worst::default();
    let (pos, angle) = (number(&written["tolerance"], "pos"), number(&written["tolerance"], "angle"));
    for row in rows(written) {
        let (delta, v) = (number(row, "delta"), number(row, "v"));
        let init = Init { x: 0.0, y: 0.0, psi1: 0.0, psi2: -number(row, "gamma0"), v, delta };
        let state = driven(
            engine,
            kinematic(row),
            init,
            Command { t: 0.0, delta_cmd: delta, a_cmd: 0.0, v_cmd: None },
            number(row, "t"),
        );
        worst.see("pos", DVec2::new(state.x, state.y).distance(DVec2::new(number(row, "x"), number(row, "y"))), pos);
        worst.see("psi1", state.psi1 - number(row, "psi1"), angle);
        worst.see("gamma", state.gamma - number(row, "gamma"), angle);
        let steady = single_track(row).at_steering(delta).map(|steady| steady.articulation);
        worst.see_option("gamma_steady", steady, &row["gamma_steady"], angle);
    }
    worst
}

fn cross_check(engine: &Engine, written: &Value) -> Worst {
    let mut worst = Worst::default();
    let (pos, angle) = (number(&written["tolerance"], "pos"), number(&written["tolerance"], "angle"));
    let row = |lengths: [f64; 3]| serde_json::json!({"L1": lengths[0], "a": lengths[1], "L2": lengths[2]});
    for check in rows(written) {
        let [x, y, delta, v, psi1, alpha] = serde_json::from_value(check["x0_kst"].clone()).unwrap();
        let [steer_rate, a_cmd]: [f64; 2] = serde_json::from_value(check["u"].clone()).unwrap();
        let vehicle = CaseVehicle { delta_rate: steer_rate.abs(), ..kinematic(&row([3.6, 0.0, 8.1])) };
        let command = Command { t: 0.0, delta_cmd: 1.5_f64.copysign(steer_rate), a_cmd, v_cmd: None };
        let state =
            driven(engine, vehicle, Init { x, y, psi1, psi2: psi1 + alpha, v, delta }, command, number(check, "t"));
        worst.see(
            "pos",
            DVec2::new(state.x, state.y).distance(DVec2::new(number(check, "x"), number(check, "y"))),
            pos,
        );
        for (key, value) in [("psi1", state.psi1), ("gamma", state.gamma), ("delta", state.delta), ("v", state.v)] {
            worst.see(key, value - number(check, key), angle);
        }
    }
    worst
}

#[test]
fn every_reference_vector_holds_within_its_own_tolerance() {
    for (name, engine) in engines() {
        let mut checked = 0;
        for case in cases() {
            let worst = match case["kind"].as_str().unwrap() {
                "trajectory" => trajectory(&engine, &case, |_| {}),
                "closed_form" => closed_form(&engine, &case),
                "steady_state" => steady_state(&case),
                "steady_state_limit" => steady_state_limit(&case),
                "steady_envelope" => steady_envelope(&case),
                "rollover_static" => rollover_static(&case),
                "cross_check" => cross_check(&engine, &case),
                "path_follow" => path_follow(&case),
                other => panic!("no check for {other}"),
            };
            println!("{} on the {name}: {:.4} ({})", case["id"], worst.ratio, worst.what);
            assert!(worst.ratio <= 1.0, "{} on the {name}: {worst:?}", case["id"]);
            checked += 1;
        }
        assert_eq!(checked, 30);
    }
}

#[test]
fn target_speeds_loads_and_lags_give_the_trajectories_of_an_independent_integrator() {
    for (name, engine) in engines() {
        let cases = cases_of("load_vectors.json");
        assert_eq!(cases.len(), 28);
        for case in cases {
            let worst = trajectory(&engine, &case, |_| {});
            println!("{} on the {name}: {:.4} ({})", case["id"], worst.ratio, worst.what);
            assert!(worst.ratio <= 1.0, "{} on the {name}: {worst:?}", case["id"]);
        }
    }
    // Each of the model's parts is needed by a case.
    let changes: [fn(&mut CaseVehicle); 10] = [
        |vehicle| vehicle.yaw_lag = 0.0,
        |vehicle| vehicle.drive_lag = 0.0,
        |vehicle| vehicle.brake_lag = 0.0,
        |vehicle| vehicle.delta_delay = 0.0,
        |vehicle| vehicle.crossfall = 0.0,
        |vehicle| vehicle.kp = 0.75,
        |vehicle| vehicle.K *= 1.05,
        |vehicle| vehicle.slip_growth = 0.0,
        |vehicle| vehicle.understeer = 0.0,
        |vehicle| vehicle.fifth_wheel_load = 0.0,
    ];
    for (index, change) in changes.into_iter().enumerate() {
        let fails = |case: &Value| 1.0 < trajectory(&Engine::Cpu, case, |case| change(&mut case.vehicle)).ratio;
        assert!(cases_of("load_vectors.json").iter().any(fails), "change {index} fails no case");
    }
}

/// The smallest error ratio over all engines once something about the case is changed.
fn missed(id: &str, changed: impl Fn(&mut Case)) -> f64 {
    engines().iter().map(|(_, engine)| trajectory(engine, &case(id), &changed).ratio).fold(f64::INFINITY, f64::min)
}

#[test]
fn a_fifth_wheel_on_the_wrong_side_of_the_axle_fails_the_vectors() {
    assert!(1.0 < missed("hitch_positive_same_cmd", |case| case.vehicle.a = -case.vehicle.a));
}

#[test]
fn tyres_that_do_not_slip_fail_the_vectors() {
    assert!(1.0 < missed("slip_roundabout_S_30", |case| case.vehicle.K = 0.0));
}

#[test]
fn a_roll_with_the_wrong_damping_fails_the_vectors() {
    assert!(1.0 < missed("circle_R20_30", |case| case.vehicle.zeta2 *= 1.5));
}

#[test]
fn tyres_that_hold_seven_tenths_of_gravity_fail_the_one_vector_that_asks_for_more() {
    let failing = cases().into_iter().filter(|case| {
        case["kind"] == "trajectory" && 1.0 < trajectory(&Engine::Cpu, case, |case| case.vehicle.mu = Some(0.7)).ratio
    });
    let failing: Vec<String> = failing.map(|case| case["id"].as_str().unwrap().to_owned()).collect();
    assert_eq!(failing, ["circle_paper_R9p57_30"]);
}

#[test]
fn an_instant_between_two_sub_steps_lies_on_the_arc_and_changes_no_other() {
    let mut case: Case = serde_json::from_value(case("circle_R10_20")).unwrap();
    case.times = Some(vec![4.0]);
    let alone = trace(&case).unwrap();
    // A command between two sub-steps that repeats the one before it.
    case.commands.push(Command { t: 1.23, ..case.commands[0].clone() });
    case.times = Some(vec![0.07, 1.0 / 3.0, 4.0]);
    let among = trace(&case).unwrap();
    let radius = case.vehicle.L1 / case.init.delta.tan();
    for state in &among.states {
        let turned = case.init.v / radius * state.t;
        let place = radius * DVec2::new(turned.sin(), 1.0 - turned.cos());
        // The midpoint rule is off by 0.6 mm after 8 s.
        assert!(DVec2::new(state.x, state.y).distance(place) < 1e-3 && (state.psi1 - turned).abs() < 1e-4, "{state:?}");
    }
    // One sub-step more, in two parts, rounds differently.
    assert!(
        (among.states[2].x - alone.states[0].x).abs() < 1e-4
            && (among.states[2].psi2 - alone.states[0].psi2).abs() < 1e-5
    );
}

#[test]
fn explicit_euler_at_the_same_step_fails_the_vectors() {
    let written = case("circle_R20_30");
    let case: Case = serde_json::from_value(written.clone()).unwrap();
    let rig = case.vehicle.rig(case.dt);
    let Init { mut x, mut y, mut psi1, mut psi2, v, delta } = case.init;
    let expected = &written["expected"][1];
    for _ in 0..(number(expected, "t") / case.dt).round() as usize {
        let truck =
            Truck { speed: v as f32, steering: delta as f32, heading: (psi1 - psi2) as f32, ..Truck::default() };
        let motion = motion_of(&rig, &truck);
        (x, y) = (x + case.dt * v * psi1.cos(), y + case.dt * v * psi1.sin());
        psi1 += case.dt * f64::from(motion.yaw_rate);
        psi2 += case.dt * f64::from(motion.trailer_yaw_rate);
    }
    let off = DVec2::new(x, y).distance(DVec2::new(number(expected, "x"), number(expected, "y")));
    assert!(number(&written["tolerance"], "pos") < off, "{off}");
}
