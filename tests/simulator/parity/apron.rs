//! Aprons: the device finds each unit's clearance from what that unit keeps to.

use std::sync::Arc;

use offtrack::engine::stages::Stage;
use offtrack::field::Field;
use offtrack::layout::Truck;
use offtrack::map::Gutter;
use offtrack::physics;
use offtrack::world::World;

use super::assert_noticed;
use super::states::{varied, world};
use crate::benchmark;

/// Every route of every roundabout, two of which have an apron.
fn world_with_aprons() -> Arc<World> {
    let mut with_aprons = World::clone(&world(Gutter::Drivable));
    let scenario = benchmark("attard2023-full").0;
    for (index, place) in scenario.places.iter().enumerate().filter(|(index, _)| index % 2 == 1) {
        let road = crate::apron::road(&place.roundabout.name);
        let kerbs = road.unit_kerbs(Gutter::Drivable);
        with_aprons.trailer_fields[index] = Some(Field::bake(kerbs.trailer(), scenario.cell));
    }
    assert_eq!(with_aprons.trailer_fields.iter().flatten().count(), 2);
    Arc::new(with_aprons)
}

#[test]
fn clearances_beside_aprons_agree_and_would_not_without_them_or_with_those_of_another_road() {
    let world = world_with_aprons();
    let (choice, before) = varied(&world, false);
    for change in
        [|world: &mut World| world.trailer_fields.fill(None), |world: &mut World| world.trailer_fields.swap(1, 3)]
    {
        assert_noticed(&world, &choice, &before, ("trailer_fields", Stage::Collide, change));
    }
}

#[test]
fn what_an_apron_weighs_agrees_and_would_not_with_another_weight_or_without_aprons() {
    let mut world = World::clone(&world_with_aprons());
    world.reward.apron = -2.0;
    let world = Arc::new(world);
    let (choice, before) = varied(&world, false);
    let is_on_one = |truck: &&Truck| 0.0 < physics::depth_on_apron(&world, truck);
    let n_on = before.truck.iter().filter(is_on_one).count();
    assert!(500 < n_on, "{n_on} trailers are on an apron");
    let changes: [fn(&mut World); 3] = [
        |world| world.reward.apron *= 1.01,
        |world| world.trailer_fields.fill(None),
        |world| world.rigs[0].trailer_body.half_width += 0.05,
    ];
    for change in changes {
        assert_noticed(&world, &choice, &before, ("reward.apron", Stage::Judge, change));
    }
}
