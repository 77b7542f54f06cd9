//! Slip that grows with the load transfer ratio against a truck on brush tyres, which lose stiffness by load transfer
//! and saturate.

mod brush;

use offtrack::layout::Rig;
use offtrack::vehicle::{Model, Vehicle};

use super::dynamic::off_tracking;
use super::vehicle;
use brush::{Brush, DUAL, WIDE};

/// The trailer's axles behind the kingpin (m) and whether they have pairs of tyres.
const TRAILERS: [(&str, &[f64], brush::Tyres); 2] =
    [("eu_4x2_13m6", &[6.39, 7.7, 9.01], WIDE), ("daf_xf", &[6.517, 8.995], DUAL)];
/// Loads, how far ahead of the axles their centre of gravity lies (m), and the slip of the trailer's tyres under them
/// (rad/(m/s^2)).
const LOADS: [(&str, f64, f64); 4] =
    [("empty", 2.3, 0.0136), ("half", 2.15, 0.0157), ("laden", 2.0, 0.0185), ("laden_high", 2.0, 0.0185)];

/// A vehicle whose load slips so much, with growth or without.
fn slipping(name: &str, load: &str, slip: f64, model: Model) -> Vehicle {
    let mut vehicle = vehicle(name);
    vehicle.model = model;
    if let Some(load) = vehicle.loads.get_mut(load) {
        load.slip = slip;
    }
    vehicle
}

/// How far the off-tracking of circles is off.
#[derive(Debug, Default)]
struct Errors {
    n: usize,
    squares: f64,
    worst: f64,
}

impl Errors {
    fn add(&mut self, error: f64) {
        self.n += 1;
        self.squares += error * error;
        self.worst = self.worst.max(error.abs());
    }

    fn rms(&self) -> f64 {
        (self.squares / self.n as f64).sqrt()
    }
}

/// Errors on every circle of 12.5 to 30 m at 5 km/h up to `fastest` that the truck on brush tyres holds, with the
/// growth and without.
fn errors(
    name: &str,
    axles: &[f64],
    tyres: brush::Tyres,
    (load, ahead, slip): (&str, f64, f64),
    fastest: u32,
) -> [Errors; 2] {
    let reference = Brush::of(&vehicle(name), load, ahead, axles, tyres);
    let grown =
        Model { slip_lever: 4.0, slip_growth: 1.0, fifth_wheel_load: reference.fifth_wheel_load(), ..Model::default() };
    let models = [grown, Model { slip_lever: 4.0, ..Model::default() }];
    // What the brush tyres hold is the limit, and not the file's friction.
    let rigs = models
        .map(|model| Rig { lateral_acceleration_max: 1e6, ..slipping(name, load, slip, model).rig(load, 0.05, None) });
    let mut errors: [Errors; 2] = Default::default();
    for speed in (5..=fastest).step_by(5) {
        for radius in [12.5, 16.0, 20.0, 25.0, 30.0] {
            let speed = f64::from(speed) / 3.6;
            let Some(expected) = reference.off_tracking(speed, radius) else { continue };
            for (rig, errors) in rigs.iter().zip(&mut errors) {
                errors.add(off_tracking(rig, speed, radius) - expected);
            }
        }
    }
    errors
}

#[test]
fn with_slip_growth_a_trailer_cuts_in_as_much_as_on_tyres_that_lose_stiffness_and_saturate() {
    for (name, axles, tyres) in TRAILERS {
        for load in LOADS {
            let [grown, plain] = errors(name, axles, tyres, load, 50);
            let case = format!("{name}, {}: {} circles", load.0, grown.n);
            println!(
                "{case}: rms {:.3} m, worst {:.3} m; without growth {:.3}, {:.3} m",
                grown.rms(),
                grown.worst,
                plain.rms(),
                plain.worst
            );
            assert!(29 <= grown.n, "{case}");
            // Empty it holds 0.65 g, near the end of its tyres; and the two axles of daf_xf lie so far apart that they
            // scrub in a tight turn, which a single track does not.
            let (rms, worst) = if load.0 == "empty" { (0.12, 0.33) } else { (0.10, 0.25) };
            assert!(grown.rms() <= rms && grown.worst <= worst, "{case}: {} m, {} m", grown.rms(), grown.worst);
            assert!(2.0 * grown.rms() < plain.rms() && 0.24 < plain.rms(), "{case}: without growth it would pass");
        }
    }
}
