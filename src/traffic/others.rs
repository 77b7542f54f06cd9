//! What cars mind besides each other.

use super::Car;
use super::decide::Driver;

/// Vehicles that are no cars of the row, as its cars see them.
pub trait Others {
    /// Adds to what a car that decides must mind, after the other cars were weighed.
    fn hinder(&self, _: &mut Driver) {}

    /// What stands nearest before a car that would enter: station of its rear on the car's path (2^-10 m), and its
    /// speed (2^-14 m a step).
    fn ahead(&self, _: &Car) -> Option<(i32, i32)> {
        None
    }
}

/// Cars alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Nobody;

impl Others for Nobody {}
