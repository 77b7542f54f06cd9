//! Lists of a fixed length.

use std::ops::Deref;

use serde::Deserialize;

/// A list of `N` values and no others: serde's arrays take longer lists, and drop what they have too much.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "Vec<T>", bound(deserialize = "T: Deserialize<'de>"))]
pub struct Exactly<T, const N: usize>(pub [T; N]);

impl<T, const N: usize> TryFrom<Vec<T>> for Exactly<T, N> {
    type Error = String;

    fn try_from(values: Vec<T>) -> Result<Self, String> {
        let found = values.len();
        values.try_into().map(Exactly).map_err(|_| format!("invalid length {found}, expected {N} values"))
    }
}

impl<T: Copy + Default, const N: usize> Default for Exactly<T, N> {
    fn default() -> Self {
        Exactly([T::default(); N])
    }
}

impl<T, const N: usize> Deref for Exactly<T, N> {
    type Target = [T; N];

    fn deref(&self) -> &[T; N] {
        &self.0
    }
}
