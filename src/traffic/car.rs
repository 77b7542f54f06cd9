//! A car: sixteen bytes, of which its pose follows, and its outline.
//!
//! A car has neither heading nor lateral position: it is where its path is, so it cannot leave it.

use bytemuck::{Pod, Zeroable};
use glam::Vec2;

use super::clock::falls_below;
use super::demand::Mix;
use super::{Network, STEP};

/// Path of a slot without a car.
const NO_PATH: u32 = 1023;
/// Where the style begins in a car's word, and where the steps begin for which it has been standing.
const STYLE: u32 = 10;
const STANDING: u32 = 20;
/// Most steps that are counted.
const MOST_STANDING: u32 = 4095;
/// Bits of a style: temperament in 16 steps, length in 4, the kind, and whether the driver is rude.
const TEMPERAMENT: u32 = 15;
const LENGTH: u32 = 4;
const VAN: u32 = 1 << 6;
const RUDE: u32 = 1 << 7;
/// Length of the shortest car, and from one to the next longer (m).
const SHORTEST: f32 = 4.2;
const LONGER: f32 = 0.3;
/// Length of a van (m).
const VAN_LENGTH: f32 = 7.0;
/// Half the width of a car and of a van (m).
const HALF_WIDTH: f32 = 0.9;
const VAN_HALF_WIDTH: f32 = 1.05;
/// Part of the length before the front axle, and behind the rear one.
const OVERHANG: f32 = 0.2;
/// Below this speed a car stands (m/s).
const STANDS: f32 = 0.1;

/// A car, or a slot without one.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Car {
    /// Station of its front on its path (m).
    pub station: f32,
    /// Its speed (m/s).
    pub speed: f32,
    /// Path in 10 bits, style in 10, steps for which it has been standing in 12.
    pub what: u32,
    /// What it decided last (m/s²).
    pub acceleration: f32,
}

impl Car {
    /// A slot without a car.
    pub const NONE: Car = Car { station: 0.0, speed: 0.0, what: NO_PATH, acceleration: 0.0 };

    /// A car of some style at the beginning of its path.
    pub(super) fn entering(path: usize, style: u32, speed: f32) -> Car {
        Car { station: length(style), speed, what: path as u32 | (style << STYLE), acceleration: 0.0 }
    }

    /// Whether there is a car in this slot.
    pub fn is_there(&self) -> bool {
        self.what & NO_PATH != NO_PATH
    }

    /// Index of its path.
    pub fn path(&self) -> usize {
        (self.what & NO_PATH) as usize
    }

    fn style(&self) -> u32 {
        (self.what >> STYLE) & NO_PATH
    }

    /// Steps for which it has been standing.
    pub fn standing(&self) -> u32 {
        self.what >> STANDING
    }

    /// Its length (m).
    pub fn length(&self) -> f32 {
        length(self.style())
    }

    /// Half its width (m).
    pub fn half_width(&self) -> f32 {
        if self.style() & VAN == VAN { VAN_HALF_WIDTH } else { HALF_WIDTH }
    }

    /// From -1, who drives slowly and keeps his distance, to 1.
    pub fn temperament(&self) -> f32 {
        ((self.style() & TEMPERAMENT) as f32 - 7.5) * (1.0 / 7.5)
    }

    /// Whether the driver lets nobody in.
    pub fn is_rude(&self) -> bool {
        self.style() & RUDE == RUDE
    }

    /// The car after a step with its acceleration, which it held: the ballistic update of M. Treiber and A. Kesting,
    /// "Traffic Flow Dynamics" (2013), section 10.2, which stops exactly where the speed reaches 0.
    pub(super) fn moved(&self) -> Car {
        let speed = self.speed + self.acceleration * STEP;
        let (way, speed) = if speed < 0.0 {
            (0.5 * self.speed * self.speed / -self.acceleration, 0.0)
        } else {
            (0.5 * (self.speed + speed) * STEP, speed)
        };
        let standing = if speed < STANDS { (self.standing() + 1).min(MOST_STANDING) } else { 0 };
        let what = (self.what & ((1 << STANDING) - 1)) | (standing << STANDING);
        Car { station: self.station + way, speed, what, ..*self }
    }

    /// The ground that it covers: both axles are on the path, so in bends its ends swing out and its middle cuts in.
    pub fn outline(&self, network: &Network) -> Outline {
        let length = self.length();
        let axle = |overhang: f32| network.pose(self.path(), self.station - overhang * length).0;
        let [front, rear] = [axle(OVERHANG), axle(1.0 - OVERHANG)];
        let (middle, along) = (0.5 * (front + rear), (front - rear).normalize_or_zero());
        Outline { middle, along, half_length: 0.5 * length, half_width: self.half_width() }
    }
}

fn length(style: u32) -> f32 {
    if style & VAN == VAN { VAN_LENGTH } else { SHORTEST + LONGER * ((style >> LENGTH) & 3) as f32 }
}

/// A style drawn from random words.
pub(super) fn style(words: [u32; 2], mix: &Mix) -> u32 {
    let [kind, driver] = words;
    let flag = |word: u32, probability: f32, flag: u32| if falls_below(word, probability) { flag } else { 0 };
    // Upper bits tell the kind, lower ones length and temperament.
    (kind & (VAN - 1)) | flag(kind, mix.vans, VAN) | flag(driver, mix.rude, RUDE)
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

    /// Whether two rectangles overlap: none of their sides' directions separates them.
    pub fn overlaps(&self, other: &Outline) -> bool {
        let between = other.middle - self.middle;
        [self.along, self.along.perp(), other.along, other.along.perp()]
            .into_iter()
            .all(|axis| between.dot(axis).abs() < self.reach(axis) + other.reach(axis))
    }
}
