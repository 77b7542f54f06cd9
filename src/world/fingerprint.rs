//! A number for all that trucks drive by: a run, and a copy of a batch, go on in the world that they began in.

use bytemuck::{bytes_of, cast_slice};
use crc32fast::Hasher;

use super::World;
use crate::field::Field;
use crate::scenario::Class;

impl World {
    /// CRC-32 of every table. One that is added to the world has to be named here.
    pub fn fingerprint(&self) -> u32 {
        let World {
            params,
            reward,
            disturbances,
            rigs,
            classes,
            rays,
            actions,
            fields,
            trailer_fields,
            // No truck drives by where its road lies in a map.
            frames: _,
            waypoints,
            previews,
            traffic,
            routes,
            route_names,
            step_limits,
        } = self;
        let mut hasher = Hasher::new();
        let tables: [&[u8]; 10] = [
            bytes_of(params),
            bytes_of(reward),
            bytes_of(disturbances),
            cast_slice(actions),
            cast_slice(rigs),
            cast_slice(rays),
            cast_slice(waypoints),
            cast_slice(previews),
            cast_slice(routes),
            cast_slice(step_limits),
        ];
        tables.into_iter().for_each(|table| hasher.update(table));
        traffic.iter().for_each(|traffic| traffic.words().for_each(|words| hasher.update(cast_slice(&words))));
        fields.iter().for_each(|field| add(&mut hasher, field));
        for (roundabout, field) in trailer_fields.iter().enumerate() {
            let Some(field) = field else { continue };
            add(&mut hasher, field);
            hasher.update(bytes_of(&(roundabout as u32)));
        }
        let classes = classes.iter().flat_map(|Class { vehicle, load }| [vehicle, load]);
        for name in classes.chain(route_names) {
            hasher.update(name.as_bytes());
            // Names end, so that two lists of other names are not the same text.
            hasher.update(&[0]);
        }
        hasher.finalize()
    }
}

fn add(hasher: &mut Hasher, Field { origin, cells_per_metre, columns, rows, cells, values }: &Field) {
    hasher.update(bytes_of(origin));
    hasher.update(bytes_of(cells_per_metre));
    hasher.update(bytes_of(&[*columns, *rows]));
    hasher.update(cast_slice(cells));
    hasher.update(cast_slice(values));
}

#[cfg(test)]
mod tests {
    use crate::files::cache::Loading;
    use crate::scenario::Scenario;
    use crate::traffic::{Demand, Mix};
    use crate::world::Traffic;

    use super::*;

    /// A table, and a change of it.
    type Change<T = World> = (&'static str, fn(&mut T));

    #[test]
    fn a_change_of_any_table_of_a_world_is_another_fingerprint() {
        let world = World::bake(&Scenario::named("attard2023").unwrap()).unwrap();
        let before = world.fingerprint();
        let changes: [Change; 22] = [
            ("params", |world| world.params.stray_distance += 1.0),
            ("params, kind of the actions", |world| world.params.n_actions = 0),
            ("reward", |world| world.reward.failure -= 1.0),
            ("reward, apron", |world| world.reward.apron -= 1.0),
            ("disturbances", |world| world.disturbances.map_offset += 0.1),
            ("rigs", |world| world.rigs[0].slip += 1e-6),
            ("classes, vehicle", |world| world.classes[0].vehicle += "x"),
            ("classes, load", |world| world.classes[0].load += "x"),
            ("rays", |world| world.rays[0][28].origin.x += 0.01),
            ("actions", |world| world.actions[8].steering += 0.001),
            ("fields, origin", |world| world.fields[4].origin.y += 0.5),
            ("fields, cells_per_metre", |world| world.fields[4].cells_per_metre = 2.0),
            ("fields, columns", |world| world.fields[4].columns += 4),
            ("fields, rows", |world| world.fields[4].rows += 2),
            ("fields, cells", |world| world.fields[4].cells[7][1] ^= 1),
            ("fields, values", |world| world.fields[4].values[7] ^= 1),
            ("trailer_fields", |world| world.trailer_fields[4] = Some(world.fields[4].clone())),
            ("waypoints", |world| world.waypoints[99].position.x += 0.01),
            ("previews", |world| world.previews[99].heading += 0.01),
            ("routes", |world| world.routes[3].n_waypoints -= 1),
            ("route_names", |world| world.route_names[3] += "x"),
            ("step_limits", |world| world.step_limits[3] += 1),
        ];
        for (table, change) in changes {
            let mut other = world.clone();
            change(&mut other);
            assert_ne!(other.fingerprint(), before, "{table}");
        }
        assert_eq!(world.clone().fingerprint(), before);
    }

    #[test]
    fn a_change_of_any_table_of_other_vehicles_is_another_fingerprint() {
        let text = Scenario::text_of("traffic2026").unwrap().replace("300.0, 900.0, 1500.0, 2100.0", "300.0");
        let scenario = Scenario::parse("traffic2026", &text, None, &Loading::PLAIN).unwrap();
        let world = World::bake(&scenario).unwrap();
        let before = world.fingerprint();
        let alone = World { traffic: None, ..world.clone() };
        assert_ne!(alone.fingerprint(), before);
        assert!(alone.bytes() + 100_000 < world.bytes(), "{} {}", alone.bytes(), world.bytes());
        let changes: [Change<Traffic>; 11] = [
            ("rules", |traffic| traffic.rules.courtesy += 1),
            ("rude", |traffic| traffic.rude[1] += 1),
            ("spacing", |traffic| traffic.spacing += 0.1),
            ("is_observed", |traffic| traffic.is_observed = !traffic.is_observed),
            ("hindrance", |traffic| traffic.hindrance -= 1.0),
            ("group", |traffic| traffic.group = 2),
            ("networks", |traffic| traffic.roads[1].network.paths[2].line += 1),
            ("demands", |traffic| {
                let network = &traffic.roads[1].network;
                let flows = Demand::even(network, 700.0);
                traffic.roads[1].levels[0].demand = Demand::new(network, &flows, Mix::default()).unwrap();
            }),
            ("snapshots", |traffic| traffic.roads[1].levels[0].snapshots[3].backlog[0] += 1),
            ("paths of routes", |traffic| traffic.routes[3].path += 1),
            ("beginnings of routes", |traffic| traffic.routes[3].begins += 0.1),
        ];
        for (table, change) in changes {
            let mut other = world.clone();
            change(other.traffic.as_mut().unwrap());
            assert_ne!(other.fingerprint(), before, "{table}");
        }
    }
}
