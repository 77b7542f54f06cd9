//! A benchmark as the page drives on it: its names as JSON, its tables as sections.

use bytemuck::cast_slice;
use offtrack::engine::Autoreset;
use offtrack::engine::stages::{BEGIN, Case, Kernel, Stage};
use offtrack::engine::tables::{Tables, levels};
use offtrack::layout::buffers::Table;
use offtrack::map::route::Route;
use offtrack::world::World;
use offtrack_policy::Policy;
use serde_json::{Map, Value, json};

use super::packed::Packed;
use super::{Ground, journal, splits};

/// The facts, with the tables as sections.
pub(super) fn printed(ground: &Ground, policies: &[&Policy], packed: &mut Packed) -> Value {
    let Ground { scenario, world, text, is_whole } = ground;
    let routes: Vec<(usize, &Route)> = scenario.routes().collect();
    let roads = scenario.places.iter().zip(&world.fields).enumerate().map(|(index, (place, field))| {
        let extent = [field.columns, field.rows].map(|cells| cells as f32 / field.cells_per_metre);
        let road = &place.roundabout;
        json!({
            "name": road.name,
            "between_arms": road.between_arms(),
            "mirrored": road.is_mirrored(),
            "island_radius": road.island_radius(),
            "outer_radius": road.outer_radius(),
            "apron": world.trailer_fields[index].is_some(),
            "bounds": [field.origin.x, field.origin.y, field.origin.x + extent[0], field.origin.y + extent[1]],
            "routes": (0..routes.len()).filter(|&route| routes[route].0 == index).collect::<Vec<_>>(),
        })
    });
    let can_drive = |index: &usize| policies[*index].check(world).is_ok();
    json!({
        "name": scenario.name,
        "source": { "name": scenario.name, "text": text },
        "is_whole": is_whole,
        "step": scenario.step,
        "sensor_range": world.params.sensor_range,
        "n_actions": world.params.n_actions,
        "changes_speed": world.params.changes_speed == 1,
        "target_speeds": [world.params.target_speed_min, world.params.target_speed_max],
        "actions": world.actions.iter().map(|action| [action.steering, action.speed]).collect::<Vec<_>>(),
        "extras": world.observation_layout().extra_names(),
        "disturbed": Case::of(world, Autoreset::SameStep).disturbed,
        "roads": roads.collect::<Vec<_>>(),
        "routes": routes
            .iter()
            .map(|(road, route)| json!({ "name": route.name, "road": road, "n_waypoints": route.waypoints.len() }))
            .collect::<Vec<_>>(),
        "splits": splits(scenario)
            .map(|(split, routes)| (split.name().to_owned(), json!(routes)))
            .collect::<Map<_, _>>(),
        "classes": world
            .classes
            .iter()
            .map(|class| json!({ "vehicle": class.vehicle, "load": class.load }))
            .collect::<Vec<_>>(),
        "vehicles": world.rigs.iter().map(|rig| rig.class_index).collect::<Vec<_>>(),
        "policies": (0..policies.len()).filter(can_drive).collect::<Vec<_>>(),
        "traffic": traffic(ground),
        "steps": steps(world),
        "begin": names(Case::of(world, Autoreset::SameStep).working(BEGIN.iter())),
        "tables": tables(world, packed),
    })
}

/// Other vehicles: the demands that episodes draw (veh/h) and where those lie, for each road the first word in the
/// table of lanes and the words of each demand; nothing where there are no vehicles.
fn traffic(Ground { scenario, world, .. }: &Ground) -> Value {
    let (Some(of), Some(shared)) = (&scenario.traffic, &world.traffic) else { return Value::Null };
    let has_large = of.large.iter().any(|&fraction| 0.0 < fraction);
    json!({
        "demand": of.demand,
        "levels": levels(world),
        "observed": shared.is_observed,
        "vans": 0.0 < of.vans || has_large,
        "trailers": has_large,
        "rude": 0.0 < of.rude[1],
    })
}

/// The kernels of a step for each [`Autoreset`], with the page's own before the reset.
fn steps(world: &World) -> Map<String, Value> {
    let modes =
        [("same_step", Autoreset::SameStep), ("next_step", Autoreset::NextStep), ("disabled", Autoreset::Disabled)];
    let step = |autoreset: Autoreset| {
        let mut step = names(Case::of(world, autoreset).step());
        let resets = |name: &&str| Stage::Reset.kernels().iter().any(|kernel| kernel.name() == *name);
        let before = step.iter().position(resets).unwrap_or(step.len());
        step.insert(before, journal::kernel(world.traffic.is_some()));
        step
    };
    modes.map(|(name, autoreset)| (name.to_owned(), json!(step(autoreset)))).into_iter().collect()
}

fn names(kernels: impl Iterator<Item = Kernel>) -> Vec<&'static str> {
    kernels.map(Kernel::name).collect()
}

/// The sections of each table, one after the other: a field is a section of its own, which benchmarks may share.
fn tables(world: &World, packed: &mut Packed) -> Map<String, Value> {
    let tables = Tables::new(world);
    let cells: Vec<usize> = world.all_fields().map(|field| packed.add("roads", cast_slice(&field.cells))).collect();
    let corners: Vec<usize> = world.all_fields().map(|field| packed.add_distances(&field.values)).collect();
    let table = |&table: &Table| {
        let sections = match table {
            Table::Cells => cells.clone(),
            Table::Corners => corners.clone(),
            _ => vec![packed.add(kind(table, world), tables.bytes(table)?)],
        };
        Some((table.name().to_owned(), json!(sections)))
    };
    Table::ALL.iter().filter_map(table).collect()
}

/// What a table's bytes are, as the parts of a page are listed.
fn kind(table: Table, world: &World) -> &'static str {
    match table {
        Table::Lanes if world.traffic.is_some() => "traffic",
        Table::Roads | Table::Limits => "routes",
        Table::Vehicles => "vehicles",
        _ => "benchmarks",
    }
}
