//! What a car does at its line about a truck: it yields to one that has entered, longer than to a car, and does not
//! enter beside it.

use super::view::View;
use crate::layout::shared::constants;
use crate::traffic::decide::{Driver, GONE_BEFORE, LEAST_CROSSING, LEAST_SPEED, LEFT, SIGHT, SIGHT_OF_OTHERS};
use crate::traffic::model::time;
use crate::traffic::network::{Kind, Stretch};
use crate::traffic::units::time as ticks;

constants! {
    /// A truck takes longer to pass than a car: so much is added to the lag (1/256 step).
    const LAG_OF_TRUCK: i32 = ticks(1.5);
}

/// Takes a truck's place on its path into account.
pub(super) fn mind(view: &View, driver: &mut Driver) {
    let me = driver.me;
    // A truck that can still wait is no more in the way than a car that does.
    if view.waits || !me.waits || me.is_rude {
        return;
    }
    let zones = driver.network().zones_of(driver.car().path(), view.path);
    if zones.iter().any(|zone| is_in_the_way(view, driver, &zone.stretch())) {
        driver.wait_at_line();
    }
}

/// Whether a car at its line waits for a truck in a zone of their paths.
fn is_in_the_way(view: &View, driver: &Driver, zone: &Stretch) -> bool {
    let me = driver.me;
    let is_of_entry = zone.kind == Kind::Wide || driver.is_of_entry(zone);
    let out_of_sight = SIGHT < zone.a_in - me.station || SIGHT_OF_OTHERS < zone.b_in - view.station;
    let rear = view.station - view.length;
    if !is_of_entry || zone.a_in <= me.station || out_of_sight || zone.b_out + LEFT < rear {
        return false;
    }
    let to_line = driver.time_to_line();
    if view.station < zone.b_in {
        let speed = view.speed.max(LEAST_SPEED);
        let comes = time(zone.b_in - view.station, speed);
        let gone = comes + time(zone.b_out - zone.b_in + view.length, speed);
        // Beside a truck a car needs as much time as where their paths meet.
        return comes < driver.lag(Kind::Follow) + LAG_OF_TRUCK + to_line && to_line < gone;
    }
    match zone.kind {
        // It may need the lanes beside its own.
        Kind::Soft | Kind::Wide => true,
        Kind::Cross => to_line + GONE_BEFORE < time((zone.b_out - rear).max(0), view.speed.max(LEAST_CROSSING)),
        // Once its rear has passed, it is followed as what is in the corridor.
        Kind::Follow => zone.beside(rear) < zone.a_in,
    }
}
