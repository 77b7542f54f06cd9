//! Trucks among other vehicles on the page.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use offtrack::files::cache::Loading;
use offtrack::layout::N_CARS;
use offtrack::scenario::Scenario;
use offtrack::simulator::{Autoreset, RouteChoice, Simulator};
use offtrack::traffic::units::length;
use offtrack::traffic::{Contact, Row, outlines};
use offtrack::world::World;
use offtrack_evaluation::live::Ground;
use offtrack_evaluation::recording::Vehicle;
use offtrack_policy::Policy;
use serde_json::{Value, json};

use super::page::{done, ground, written};
use super::runs::Run;
use super::visitor::{between, visited};
use crate::page::read;
use crate::place::{Place, offtrack, succeed};

const AMONG: &str = "traffic2026";

fn run(policy: Option<usize>, demand: Option<usize>) -> Run {
    Run { world: 0, policy, autoreset: Autoreset::SameStep, demand }
}

/// The world in which every episode has one of its demands.
fn at_demand(world: &World, demand: usize) -> Arc<World> {
    let mut world = world.clone();
    for road in &mut world.traffic.as_mut().unwrap().roads {
        road.levels = vec![road.levels[demand].clone(); road.levels.len()];
    }
    Arc::new(world)
}

#[test]
fn trucks_among_vehicles_in_a_browser_and_these_vehicles_drive_as_on_the_processor_at_any_demand_to_the_last_bit() {
    let place = Place::new();
    succeed(&offtrack(&["web", "--benchmark", AMONG, "--policy", AMONG, "-o", &place.text("page.html")]));
    let ground = ground(AMONG);
    let policies = [Policy::shipped(AMONG).unwrap()];
    let runs = [run(None, None), run(Some(0), None), run(Some(0), Some(3))];
    let jobs: Vec<Value> = runs.iter().map(Run::job).collect();
    let given = done(&read(&place.file("page.html")), &jobs, HashMap::new());
    for run in runs {
        let world = run.demand.map_or_else(|| ground.world.clone(), |demand| at_demand(&ground.world, demand));
        run.difference(&world, &policies, &given).unwrap();
    }
    // Drawn demands are others.
    assert!(runs[2].difference(&ground.world, &policies, &given).unwrap_err().contains("before the first step"));
}

#[test]
fn vehicles_that_keep_a_gap_an_inch_off_drive_otherwise_in_a_browser() {
    let place = Place::new();
    let right = ground(AMONG);
    let mut world = World::clone(&right.world);
    world.traffic.as_mut().unwrap().rules.gap += length(0.0254);
    let wrong = Ground { scenario: right.scenario.clone(), world: Arc::new(world), text: None, is_whole: false };
    let page = written(vec![wrong], Vec::new(), &place.file("page.html"));
    let run = run(None, None);
    let given = done(&page, &[run.job()], HashMap::new());
    let difference = run.difference(&right.world, &[], &given).unwrap_err();
    assert!(difference.contains("step") && difference.contains("Cars"), "{difference}");
}

/// Three routes among many vehicles, of which some are vans and some drivers rude.
fn crowded() -> Ground {
    among("rude = 0.4")
}

/// Three routes among many vehicles, of which some are vans, with these keys.
fn among(keys: &str) -> Ground {
    let traffic = format!("\n[traffic]\ndemand = [1500, 2100]\nvans = 0.3\n{keys}\n[observation]\nvehicles = true\n");
    let text = Scenario::text_of("attard2023").unwrap() + &traffic;
    let mut scenario = Scenario::parse("among", &text, None, &Loading::PLAIN).unwrap();
    scenario.retain(|_, route| route.name.starts_with("20m/N"));
    let world = Arc::new(World::bake(&scenario).unwrap());
    Ground { scenario, world, text: None, is_whole: false }
}

/// The trucks of the page on the CPU engine.
fn simulator(world: &Arc<World>) -> Simulator {
    let routes = (0..world.routes.len() as u32).collect();
    Simulator::new(world.clone(), N_SEEN, 0, RouteChoice::Drawn(routes)).unwrap()
}

/// Trucks of a page that is looked at.
const N_SEEN: usize = 32;
/// A vehicle nearer to a truck's units may lie under one (m).
const APART: f32 = 12.0;
/// Width of the picture in which vehicles are looked at (m).
const WIDTH: f64 = 60.0;

/// What is to be seen of a vehicle: a point of its body, of a brake light, and of its left edge.
fn parts(vehicle: &Vehicle) -> [[f32; 2]; 3] {
    vehicle.at([[-0.1, 0.0], [-0.46, 0.34], [0.0, 0.5]])
}

#[test]
fn vehicles_have_the_colours_of_their_kind_lit_brakes_and_an_edge_where_drivers_are_rude() {
    let place = Place::new();
    let ground = crowded();
    let mut simulator = simulator(&ground.world);
    (0..20).for_each(|_| simulator.step_at_random());
    let batch = simulator.batch();
    let is_apart = |vehicle: &Vehicle, env: usize| {
        let truck = &batch.truck[env];
        let [tractor, trailer] = [truck.position, truck.trailer_position(ground.world.rig(truck))];
        [tractor, trailer].iter().all(|unit| APART < unit.distance(vehicle.position.into()))
    };
    let around = |env: usize| -> Vec<Vehicle> {
        let all = Vehicle::around(&ground.world, &batch.truck, &batch.cars, env);
        all.into_iter()
            .filter(|vehicle| is_apart(vehicle, env) && vehicle.position.iter().all(|at| at.abs() < 40.0))
            .collect()
    };
    // The truck with most kinds of vehicles around it.
    let kinds = |env: &usize| {
        let each = around(*env);
        let kind = |vehicle: &Vehicle| [vehicle.is_van(), vehicle.brakes(), vehicle.is_rude];
        each.iter().map(kind).collect::<HashSet<_>>().len()
    };
    let env = (0..N_SEEN).max_by_key(kinds).unwrap();
    let vehicles = around(env);
    let points: Vec<Value> = vehicles
        .iter()
        .flat_map(|vehicle| {
            let [body, light, edge] = parts(vehicle);
            let inwards = [vehicle.heading.sin(), -vehicle.heading.cos()];
            [(body, [0.0; 2]), (light, [0.0; 2]), (edge, inwards)]
        })
        .map(|(point, inwards)| json!({ "road": 0, "point": point, "inwards": inwards, "width": WIDTH }))
        .collect();
    let plan = json!({
        "visit": "colouring", "n": N_SEEN, "steps": 20, "followed": env, "points": points,
        "names": ["car", "van", "brakes", "rude", "panel", "road"],
    });
    let page = written(vec![ground], Vec::new(), &place.file("trucks.html"));
    let found = visited(&page, &plan, HashMap::new(), false);
    let colours = &found["colours"];
    let mut seen = found["seen"].as_array().unwrap().iter();
    let (mut n_vans, mut n_lit, mut n_rude) = (0, 0, 0);
    for vehicle in &vehicles {
        let [body, light, edge] = std::array::from_fn(|_| seen.next().unwrap());
        let kind = if vehicle.is_van() { "van" } else { "car" };
        let is_like = |seen: &Value, name: &str, most: i64| between(seen, &colours[name]) < most;
        assert!(is_like(body, kind, 8), "{vehicle:?}: {body} of {colours}");
        assert_eq!(is_like(light, "brakes", 30), vehicle.brakes(), "{vehicle:?}: {light} of {colours}");
        assert_eq!(is_like(edge, "rude", 30), vehicle.is_rude, "{vehicle:?}: {edge} of {colours}");
        n_vans += usize::from(vehicle.is_van());
        n_lit += usize::from(vehicle.brakes());
        n_rude += usize::from(vehicle.is_rude);
    }
    for n in [n_vans, n_lit, n_rude] {
        assert!(
            0 < n && n < vehicles.len(),
            "{n_vans} vans, {n_lit} brake and {n_rude} are rude of {}",
            vehicles.len()
        );
    }
    let legend = found["legend"].as_str().unwrap();
    for words in ["car", "van", "edge of who is rude"] {
        assert!(legend.lines().any(|line| line.trim() == words), "{legend}");
    }
}

#[test]
fn buses_and_trucks_with_trailers_are_drawn_where_both_units_are() {
    let place = Place::new();
    let ground = among("buses = 0.2\ntractor_trailers = 0.4");
    let mut simulator = simulator(&ground.world);
    (0..20).for_each(|_| simulator.step_at_random());
    let around = |env: usize| -> Vec<Vehicle> {
        let batch = simulator.batch();
        let all = Vehicle::around(&ground.world, &batch.truck, &batch.cars, env).into_iter();
        all.filter(|vehicle| vehicle.is_large() && vehicle.position.iter().all(|at| at.abs() < 40.0)).collect()
    };
    let env = (0..N_SEEN).max_by_key(|&env| around(env).len()).unwrap();
    let vehicles = around(env);
    let points: Vec<Value> = vehicles
        .iter()
        .map(|vehicle| json!({ "road": 0, "point": parts(vehicle)[0], "inwards": [0.0, 0.0], "width": WIDTH }))
        .collect();
    let plan = json!({
        "visit": "colouring", "n": N_SEEN, "steps": 20, "followed": env, "points": points, "names": ["van"],
    });
    let page = written(vec![ground], Vec::new(), &place.file("trucks.html"));
    let found = visited(&page, &plan, HashMap::new(), false);
    let trailers = vehicles.iter().filter(|vehicle| N_CARS <= vehicle.slot).count();
    assert!(1 < trailers && trailers < vehicles.len(), "{vehicles:?}");
    for (vehicle, seen) in vehicles.iter().zip(found["seen"].as_array().unwrap()) {
        assert!(between(seen, &found["colours"]["van"]) < 8, "{vehicle:?}: {seen}");
    }
    assert!(found["legend"].as_str().unwrap().contains("van, bus, truck"), "{}", found["legend"]);
}

#[test]
fn the_page_says_among_how_many_vehicles_a_truck_drives_what_it_observes_of_them_and_which_one_it_met() {
    let place = Place::new();
    let ground = crowded();
    let mut simulator = simulator(&ground.world);
    simulator.set_autoreset(Autoreset::Disabled);
    simulator.step_at_random();
    let row = Row::of(&simulator.batch().cars[2]);
    let n = row.cars.iter().filter(|car| car.is_there()).count();
    let slow = if row.hindered == 0 { String::new() } else { format!("; {} slowed by it", row.hindered.count_ones()) };
    let words = format!("among {n} vehicles of {} an hour{slow}", ["1,500", "2,100"][row.level as usize]);
    let steps = 160;
    (1..steps).for_each(|_| simulator.step_at_random());
    let batch = simulator.batch();
    let plan = json!({ "visit": "among", "n": N_SEEN, "steps": steps, "demand": 1 });
    let page = written(vec![ground], Vec::new(), &place.file("trucks.html"));
    let found = visited(&page, &plan, HashMap::new(), false);
    assert_eq!(found["followed"]["words"], json!(words), "{found}");
    assert_eq!(found["followed"]["values"], "The 111 values that it observes", "{found}");
    let names = found["names"].as_array().unwrap();
    for name in ["entry arrival ×2", "gap", "vehicle left ×6"] {
        assert!(names.contains(&json!(name)), "{names:?}");
    }
    assert!(found["sentence"].as_str().unwrap().starts_with("Each drives among vehicles of its own"), "{found}");
    // What a first episode met, as the CPU engine's row has it.
    let world = simulator.world();
    let failures = found["failures"].as_array().unwrap();
    let firsts = failures.iter().filter(|failure| failure["episode"] == 0);
    let (mut n_met, mut kinds) = (0, HashSet::new());
    for failure in firsts {
        let env = failure["env"].as_u64().unwrap() as usize;
        let row = Row::of(&batch.cars[env]);
        let truck = &batch.truck[env];
        let contact = Contact::from_code(row.met).map(|contact| {
            let network = &world.traffic.as_ref().unwrap().road(world, truck.route).network;
            let car = &row.cars[contact.slot];
            let by_tractor = car.outlines(network).any(|its| outlines(world.rig(truck), truck)[0].overlaps(&its));
            let has_entered = network.paths[car.path()].line() < car.station();
            (1 + u64::from(6.0 < car.length()), u64::from(by_tractor) + 2 * u64::from(has_entered))
        });
        let given = ["met", "contact"].map(|key| failure[key].as_u64().unwrap());
        assert_eq!(given, contact.map_or([0, 0], |(met, contact)| [met, contact]), "{failure}");
        n_met += usize::from(contact.is_some());
        kinds.insert(given);
    }
    assert!(4 < n_met && 2 < kinds.len(), "{n_met} {kinds:?}");
    let listed = found["listed"].as_array().unwrap();
    let says = |words: &str| listed.iter().any(|line| line.as_str().unwrap().contains(words));
    assert!(says("met vehicle") && says(" on a car ") && says("tractor on a "), "{listed:?}");
    assert!(found["again"].as_str().unwrap().ends_with("as before"), "{found}");
    assert_eq!(found["offered"], json!(["drawn each episode", "1,500 an hour", "2,100 an hour"]));
    assert!(found["chosen"].as_str().unwrap().contains(" vehicles of 2,100 an hour"), "{found}");
    assert!(found["ends"].as_str().unwrap().contains("met vehicle"), "{found}");
}
