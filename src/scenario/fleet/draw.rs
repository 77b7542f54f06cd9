//! What is drawn for each vehicle of a fleet: additions to lengths, factors, and lags, each uniformly from its range.

use crate::layout::random;
use crate::vehicle::Vehicle;

/// Seed of all draws: a table is a function of its benchmark alone.
const SEED: u32 = 2026;

/// Ranges, each `[least, greatest]`; what has none stays as its file has it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ranges {
    /// Added to the trailer's wheelbase; its rear end moves with it (m).
    pub trailer_wheelbase: Option<[f64; 2]>,
    /// Added to the tractor's wheelbase; its front end moves with it (m).
    pub tractor_wheelbase: Option<[f64; 2]>,
    /// Added to the fifth wheel's distance ahead of the drive axle (m).
    pub fifth_wheel: Option<[f64; 2]>,
    /// Added to the height of the loaded trailer's centre of gravity (m).
    pub centre_of_gravity: Option<[f64; 2]>,
    /// Factor of the trailer's roll gain.
    pub roll_gain: Option<[f64; 2]>,
    /// Factor of the trailer's roll frequency.
    pub roll_frequency: Option<[f64; 2]>,
    /// Factor of the trailer's roll damping.
    pub roll_damping: Option<[f64; 2]>,
    /// Factor of the slip coefficient.
    pub slip: Option<[f64; 2]>,
    /// Factor of the tyres' friction.
    pub friction: Option<[f64; 2]>,
    /// Factor of the steer rate.
    pub steer_rate: Option<[f64; 2]>,
    /// Factor of the strongest drive.
    pub acceleration_max: Option<[f64; 2]>,
    /// Time from a steer command to the first movement of the wheels (s).
    pub steer_delay: Option<[f64; 2]>,
    /// Time constant of the drive (s).
    pub drive_lag: Option<[f64; 2]>,
    /// Time constant of the brakes (s).
    pub brake_lag: Option<[f64; 2]>,
    /// Time constant of the tractor's yaw, as a multiple of slip times speed.
    pub yaw_lag: Option<[f64; 2]>,
    /// Increase of each unit's slip with its load transfer ratio.
    pub slip_growth: Option<[f64; 2]>,
    /// Understeer, per lateral acceleration in units of gravity (rad).
    pub understeer: Option<[f64; 2]>,
}

/// Number of ranges.
const N_RANGES: usize = 17;

/// Where in each range a vehicle lies, from 0 at its least to 1 at its greatest, in the order of [`Ranges::all`].
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn([f64; N_RANGES]);

impl Drawn {
    /// Where the vehicle of a row of the table lies in each range: a function of row and range alone.
    pub fn of_row(row: u32) -> Drawn {
        let mut places = [0.0; N_RANGES];
        for (group, places) in (0..).zip(places.chunks_mut(4)) {
            let words = random::words(SEED, row, 0, group);
            places
                .iter_mut()
                .zip(words)
                .for_each(|(place, word)| *place = 0.5 * (f64::from(random::signed_unit(word)) + 1.0));
        }
        Drawn(places)
    }

    /// All ranges at their least and at their greatest, and the lengths, which are the first three, at any end.
    pub(super) fn ends() -> Vec<Drawn> {
        let end = |bits: usize| {
            let bit = |index: usize| f64::from(u32::from(bits >> index.min(3) & 1 == 1));
            Drawn(std::array::from_fn(bit))
        };
        (0..16).map(end).collect()
    }
}

impl Ranges {
    /// Every range with its key.
    pub fn all(&self) -> [(&'static str, Option<[f64; 2]>); N_RANGES] {
        [
            ("trailer_wheelbase", self.trailer_wheelbase),
            ("tractor_wheelbase", self.tractor_wheelbase),
            ("fifth_wheel", self.fifth_wheel),
            ("centre_of_gravity", self.centre_of_gravity),
            ("roll_gain", self.roll_gain),
            ("roll_frequency", self.roll_frequency),
            ("roll_damping", self.roll_damping),
            ("slip", self.slip),
            ("friction", self.friction),
            ("steer_rate", self.steer_rate),
            ("acceleration_max", self.acceleration_max),
            ("steer_delay", self.steer_delay),
            ("drive_lag", self.drive_lag),
            ("brake_lag", self.brake_lag),
            ("yaw_lag", self.yaw_lag),
            ("slip_growth", self.slip_growth),
            ("understeer", self.understeer),
        ]
    }

    /// Whether nothing is drawn.
    pub fn is_empty(&self) -> bool {
        self.all().iter().all(|(_, range)| range.is_none())
    }

    /// The vehicle with one load alone, as it is drawn.
    pub fn applied(&self, vehicle: &Vehicle, load: &str, drawn: &Drawn) -> Vehicle {
        let values = self.all().map(|(_, range)| range);
        let value = |index: usize| values[index].map(|[least, greatest]| least + (greatest - least) * drawn.0[index]);
        let added = |index: usize| value(index).unwrap_or(0.0);
        let factor = |index: usize| value(index).unwrap_or(1.0);
        let mut vehicle = vehicle.clone();
        vehicle.loads.retain(|name, _| name == load);
        vehicle.lengthen_trailer(added(0));
        vehicle.lengthen_tractor(added(1));
        vehicle.tractor.fifth_wheel += added(2);
        vehicle.tractor.friction *= factor(8);
        vehicle.tractor.steer_rate *= factor(9);
        for load in vehicle.loads.values_mut() {
            load.suspension.centre_of_gravity += added(3);
            load.suspension.roll_gain *= factor(4);
            load.suspension.roll_frequency *= factor(5);
            load.suspension.roll_damping *= factor(6);
            load.slip *= factor(7);
            load.acceleration_max *= factor(10);
        }
        let model = &mut vehicle.model;
        model.steer_delay = value(11).unwrap_or(model.steer_delay);
        model.drive_lag = value(12).unwrap_or(model.drive_lag);
        model.brake_lag = value(13).unwrap_or(model.brake_lag);
        model.yaw_lag = value(14).unwrap_or(model.yaw_lag);
        model.slip_growth = value(15).unwrap_or(model.slip_growth);
        model.understeer = value(16).unwrap_or(model.understeer);
        vehicle
    }
}
