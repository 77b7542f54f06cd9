//! The truck's physics: reference vectors, properties that hold for any control, and the vehicle files.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails as the test itself does")]

mod circulation;
mod dynamic;
mod lags;
mod properties;
mod sources;
mod speed_control;
mod tyres;
mod vectors;
mod vehicles;

use std::path::PathBuf;

use offtrack::vehicle::Vehicle;

/// The vehicle files of the project.
const VEHICLES: [&str; 10] = [
    "cn_18m1",
    "daf_xf",
    "eu_4x2_13m6",
    "eu_4x2_13m6_steered",
    "eu_6x4_13m6",
    "uk_15m5",
    "uk_16m5",
    "us_wb40",
    "us_wb62",
    "us_wb67",
];

fn vehicle_file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("scenarios/vehicles/{name}.toml"))
}

pub fn vehicle(name: &str) -> Vehicle {
    Vehicle::read(&vehicle_file(name)).unwrap()
}
