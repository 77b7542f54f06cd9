//! A truck that follows and yields, among cars: acceptance of what cars do about it.

#[expect(clippy::unwrap_used, reason = "a helper of tests fails as the test itself does")]
mod driver;

use driver::{driven, world};

#[test]
fn no_polite_car_drives_into_a_truck_that_follows_and_yields_on_any_of_the_studys_routes() {
    let (_, world) = world("demand = [1500]\nvans = 0.25\nwaiting = 90\n");
    assert_eq!(world.routes.len(), 95);
    let ends = driven(&world, 1, 7);
    assert_eq!((ends.was_met, ends.overlaps), (0, 0), "{ends:?}");
    assert!(85 < ends.arrived, "{ends:?}");
}
