//! A car, or a larger vehicle: sixteen bytes, of which its pose follows, and its outlines.
//!
//! A car has neither heading nor lateral position: it is where its path is, so it cannot leave it.

use bytemuck::{Pod, Zeroable};
use glam::Vec2;

use super::large::{LARGE, Large, Shape, TRACTOR};
use super::units::{FINER_SPEED, FINER_STATION, falls_below, length as in_units, metres};
use super::{Demand, Network, STEP};
use crate::layout::shared::constants;

constants! {
    /// Path of a slot without a car.
    const NO_PATH: u32 = 1023;
    /// Bit of a car's word at which its style begins.
    const STYLE: u32 = 10;
    /// Bit at which the steps begin for which it has been standing.
    const STANDING: u32 = 20;
    /// Most steps that are counted.
    const MOST_STANDING: u32 = 4095;
    /// Bits of a style: temperament in 16 steps.
    const TEMPERAMENT: u32 = 15;
    /// Lowest of the two bits of the length.
    const LENGTH: u32 = 4;
    /// Bit of a van.
    const VAN: u32 = 1 << 6;
    /// Bit of a driver who is rude.
    const RUDE: u32 = 1 << 7;
    /// Length of the shortest car (2^-10 m).
    const SHORTEST: i32 = in_units(4.2);
    /// From one length to the next (2^-10 m).
    const LONGER: i32 = in_units(0.3);
    /// Length of a van (2^-10 m).
    const VAN_LENGTH: i32 = in_units(7.0);
    /// Half the width of a car (m).
    const HALF_WIDTH: f32 = 0.9;
    /// Half the width of a van (m).
    const VAN_HALF_WIDTH: f32 = 1.05;
    /// Part of the length before the front axle, and behind the rear one.
    const OVERHANG: f32 = 0.2;
    /// Units of a state's station in a metre.
    const STATE_METRE: f32 = 1_048_576.0;
    /// Units of its speed in a m/s.
    const STATE_SPEED: f32 = METRE_A_STEP * STEP;
    /// Units of its acceleration in a m/s².
    const STATE_ACCELERATION: f32 = METRE_A_STEP * STEP * STEP;
    /// Below this speed a car stands: 0.1 m/s (2^-19 m a step).
    const STANDS: i32 = 5243;
}

/// Units of a state's speed in a metre a step.
const METRE_A_STEP: f32 = 524_288.0;

/// A car, or a slot without one: integers, in which a step of motion is exact.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Car {
    /// Station of its front on its path (2^-20 m).
    pub station: i32,
    /// Its speed (2^-19 m a step).
    pub speed: i32,
    /// Path in 10 bits, style in 10, steps for which it has been standing in 12.
    pub what: u32,
    /// What it decided last (2^-19 m a step²).
    pub acceleration: i32,
}

impl Car {
    /// A slot without a car.
    pub const NONE: Car = Car { station: 0, speed: 0, what: NO_PATH, acceleration: 0 };

    /// No car is faster, and no speed that one decides about (m/s).
    pub const FASTEST: f32 = 12.5;
    /// None brakes or speeds up harder (m/s²).
    pub const HARDEST: f32 = 8.0;

    /// A car of some style at the beginning of its path, at a speed (2^-14 m a step).
    pub(super) fn entering(path: usize, style: u32, pace: i32) -> Car {
        Car {
            station: extent(style) << FINER_STATION,
            speed: pace << FINER_SPEED,
            what: path as u32 | (style << STYLE),
            acceleration: 0,
        }
    }

    /// Station of its front on its path (m).
    pub fn station(&self) -> f32 {
        self.station as f32 / STATE_METRE
    }

    /// Its speed (m/s).
    pub fn speed(&self) -> f32 {
        self.speed as f32 / STATE_SPEED
    }

    /// What it decided last (m/s²).
    pub fn acceleration(&self) -> f32 {
        self.acceleration as f32 / STATE_ACCELERATION
    }

    /// Station of its front, as decisions read it (2^-10 m).
    pub(super) fn front(&self) -> i32 {
        self.station >> FINER_STATION
    }

    /// Station of its rear, as decisions read it (2^-10 m).
    pub(super) fn rear(&self) -> i32 {
        self.front() - self.extent()
    }

    /// Its length, as decisions read it (2^-10 m).
    pub(super) fn extent(&self) -> i32 {
        extent(self.style())
    }

    /// Its speed, as decisions read it (2^-14 m a step).
    pub(super) fn pace(&self) -> i32 {
        self.speed >> FINER_SPEED
    }

    /// Whether there is a car in this slot.
    pub fn is_there(&self) -> bool {
        self.what & NO_PATH != NO_PATH
    }

    /// Index of its path.
    pub fn path(&self) -> usize {
        (self.what & NO_PATH) as usize
    }

    pub(super) fn style(&self) -> u32 {
        (self.what >> STYLE) & NO_PATH
    }

    /// A large vehicle of this kind in its place, or a car or a van if it is none.
    pub(super) fn replaced_by(&self, large: u32) -> Car {
        let style = (self.style() & ((1 << LARGE) - 1)) | (large << LARGE);
        Car { station: extent(style) << FINER_STATION, what: self.path() as u32 | (style << STYLE), ..*self }
    }

    /// Steps for which it has been standing.
    pub fn standing(&self) -> u32 {
        self.what >> STANDING
    }

    /// Its length (m).
    pub fn length(&self) -> f32 {
        metres(self.extent())
    }

    /// Half its width (m).
    pub fn half_width(&self) -> f32 {
        match self.large() {
            Some(large) => large.shape().half_width,
            None if self.style() & VAN == VAN => VAN_HALF_WIDTH,
            None => HALF_WIDTH,
        }
    }

    /// Which large vehicle it is; none of a car or a van.
    pub fn large(&self) -> Option<Large> {
        kind(self.style())
    }

    /// Whether it is one.
    pub(super) fn is_large(&self) -> bool {
        self.style() >> LARGE != 0
    }

    /// Its class by the room that it needs; 0 of a car or a van.
    pub(super) fn class(&self) -> usize {
        self.large().map_or(0, Large::class)
    }

    /// From -15, who drives slowly and keeps his distance, to 15, in steps of 2.
    pub fn temperament(&self) -> i32 {
        2 * (self.style() & TEMPERAMENT) as i32 - TEMPERAMENT as i32
    }

    /// Whether the driver lets nobody in.
    pub fn is_rude(&self) -> bool {
        self.style() & RUDE == RUDE
    }

    /// The car with a rude driver, or with a polite one.
    pub fn driven(self, is_rude: bool) -> Car {
        let rude = RUDE << STYLE;
        Car { what: if is_rude { self.what | rude } else { self.what & !rude }, ..self }
    }

    /// The car after a step with its acceleration, which it held: the ballistic update of M. Treiber and A. Kesting,
    /// "Traffic Flow Dynamics" (2013), section 10.2, which stops where the speed reaches 0.
    pub(super) fn moved(&self) -> Car {
        let speed = self.speed + self.acceleration;
        // What stops within the step is slower than its braking in a step: the square fits.
        let (way, speed) =
            if speed < 0 { (self.speed * self.speed / -self.acceleration, 0) } else { (self.speed + speed, speed) };
        let standing = if speed < STANDS { (self.standing() + 1).min(MOST_STANDING) } else { 0 };
        let what = (self.what & ((1 << STANDING) - 1)) | (standing << STANDING);
        Car { station: self.station + way, speed, what, ..*self }
    }

    /// The ground that its units cover: one, or a tractor and its trailer.
    pub fn outlines(&self, network: &Network) -> impl Iterator<Item = Outline> + Clone + use<> {
        self.units(network).into_iter().flatten()
    }

    /// The same, of which the second is none where there is one unit.
    pub fn units(&self, network: &Network) -> [Option<Outline>; 2] {
        let Some(large) = self.large() else { return [Some(self.outline_of_car(network)), None] };
        let shape = large.shape();
        let last = Some(self.last_unit(network, large, &shape));
        if shape.has_tractor { [Some(self.tractor(network, large)), last] } else { [last, None] }
    }

    /// A car: both axles are on the path, so in bends its ends swing out and its middle cuts in.
    fn outline_of_car(&self, network: &Network) -> Outline {
        let length = self.length();
        let axle = |overhang: f32| network.position(self.path(), self.station() - overhang * length);
        let [front, rear] = [axle(OVERHANG), axle(1.0 - OVERHANG)];
        let (middle, along) = (0.5 * (front + rear), (front - rear).normalize_or_zero());
        Outline { middle, along, half_length: 0.5 * length, half_width: self.half_width() }
    }

    /// The unit of a large vehicle whose rear axle follows as a tractrix.
    fn last_unit(&self, network: &Network, large: Large, shape: &Shape) -> Outline {
        let (hinge, along) = network.trail(self.path(), self.station() - shape.hinge, large);
        let half_length = 0.5 * shape.body();
        Outline {
            middle: hinge + (shape.ahead - half_length) * along,
            along,
            half_length,
            half_width: shape.half_width,
        }
    }

    /// A tractor: both axles follow the same line.
    fn tractor(&self, network: &Network, large: Large) -> Outline {
        let [steered, driven, length] = TRACTOR;
        let axle = |behind: f32| network.trail(self.path(), self.station() - behind, large).0;
        let [front, rear] = [axle(steered), axle(driven)];
        let along = (front - rear).normalize_or_zero();
        let half_length = 0.5 * length;
        Outline { middle: front + (steered - half_length) * along, along, half_length, half_width: self.half_width() }
    }
}

fn kind(style: u32) -> Option<Large> {
    Large::ALL.get((style >> LARGE).wrapping_sub(1) as usize).copied()
}

fn extent(style: u32) -> i32 {
    if let Some(large) = kind(style) {
        large.extent()
    } else if style & VAN == VAN {
        VAN_LENGTH
    } else {
        SHORTEST + LONGER * ((style >> LENGTH) & 3) as i32
    }
}

/// A style drawn from random words: for the kind, for length and temperament, and for whether the driver is rude.
pub(super) fn style([kind, own, driver]: [u32; 3], demand: &Demand) -> u32 {
    let flag = |word: u32, probability: u32, flag: u32| if falls_below(word, probability) { flag } else { 0 };
    // The first and the second may be one word: its upper bits tell the kind, its lower ones length and temperament.
    (own & (VAN - 1)) | flag(kind, demand.vans, VAN) | flag(driver, demand.rude, RUDE)
}

/// The code of a large vehicle drawn from a random word; 0 is none.
pub(super) fn large(word: u32, demand: &Demand) -> u32 {
    let kind = demand.large.iter().position(|&until| falls_below(word, until)).map_or(0, |index| index as u32 + 1);
    if falls_below(word, demand.vans) { 0 } else { kind }
}

/// A rectangle on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outline {
    /// Its middle (m).
    pub middle: Vec2,
    /// Unit vector along it.
    pub along: Vec2,
    /// Half its length (m).
    pub half_length: f32,
    /// Half its width (m).
    pub half_width: f32,
}

impl Outline {
    /// How far it reaches from its middle in a direction (m).
    fn reach(&self, direction: Vec2) -> f32 {
        self.half_length * self.along.dot(direction).abs() + self.half_width * self.along.perp_dot(direction).abs()
    }

    /// Square of the distance of a point from it, 0 inside (m²).
    pub fn distance_squared(&self, point: Vec2) -> f32 {
        let from = point - self.middle;
        let ahead = (from.dot(self.along).abs() - self.half_length).max(0.0);
        let aside = (from.perp_dot(self.along).abs() - self.half_width).max(0.0);
        ahead * ahead + aside * aside
    }

    /// Whether two rectangles overlap: none of their sides' directions separates them.
    pub fn overlaps(&self, other: &Outline) -> bool {
        let between = other.middle - self.middle;
        [self.along, self.along.perp(), other.along, other.along.perp()]
            .into_iter()
            .all(|axis| between.dot(axis).abs() < self.reach(axis) + other.reach(axis))
    }
}

#[cfg(test)]
mod tests {
    use super::super::units::speed as pace;
    use super::*;

    fn moved(metres: i32, metres_per_second: f32, acceleration: i32) -> Car {
        Car { station: metres << 20, acceleration, ..Car::entering(3, 7, pace(metres_per_second)) }.moved()
    }

    #[test]
    fn a_step_of_motion_is_exact_at_both_ends_of_a_road_and_of_the_accelerations() {
        for (station, v, a) in [(0, 0.0, 10_486), (508, 12.5, -41_943), (1000, 12.5, 10_486), (7, 1.0, -41_943)] {
            let before = pace(v) << FINER_SPEED;
            let car = moved(station, v, a);
            let speed = i64::from(before) + i64::from(a);
            let way = i64::from(before) + speed;
            assert_eq!((i64::from(car.station), i64::from(car.speed)), ((i64::from(station) << 20) + way, speed));
        }
        // 1 m/s for 0.1 s, and half of 2 m/s² in its square.
        assert!((moved(0, 1.0, 10_486).station() - 0.11).abs() < 1e-4);
    }

    #[test]
    fn a_point_is_as_far_from_a_rectangle_as_from_its_nearest_side_or_corner() {
        let along = Vec2::new(0.6, 0.8);
        let outline = Outline { middle: Vec2::new(5.0, 2.0), along, half_length: 2.0, half_width: 1.0 };
        let at = |ahead: f32, left: f32| outline.middle + ahead * along + left * along.perp();
        for (ahead, left, squared) in [(5.0, 0.5, 9.0), (-1.0, -3.0, 4.0), (-5.0, 5.0, 25.0), (1.9, 0.9, 0.0)] {
            assert!((outline.distance_squared(at(ahead, left)) - squared).abs() < 1e-4, "{ahead} {left}");
        }
    }

    #[test]
    fn who_drives_a_car_changes_nothing_else_of_it() {
        let car = moved(3, 4.0, 0);
        assert_eq!([true, false].map(|is_rude| car.driven(is_rude).is_rude()), [true, false]);
        assert_eq!(car.driven(true).driven(false), car);
    }

    #[test]
    fn a_car_that_stops_within_a_step_stands_after_its_braking_distance_and_is_counted_as_standing() {
        let hardest = -41_943;
        // The fastest that still stops: its square is the largest that is formed.
        for (v, a) in [(0.79f32, hardest), (0.05, hardest), (0.05, -10_000), (0.0, -1)] {
            let car = moved(9, v, a);
            let way = v * v / (2.0 * -Car { acceleration: a, ..Car::NONE }.acceleration());
            assert!((car.station() - 9.0 - way).abs() < 1e-4, "{v} m/s: {} m", car.station() - 9.0);
            assert_eq!((car.speed, car.standing(), car.moved().standing()), (0, 1, 2));
        }
        assert_eq!(moved(9, 5.0, 0).standing(), 0);
    }
}
