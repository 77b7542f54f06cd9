//! Flags that may be given several times, each time with another value.

use std::collections::HashSet;

use offtrack_evaluation::error::Error;

/// An error for the first value that `flag` has twice; `expected` says what would do.
pub(crate) fn once(flag: &'static str, values: impl Iterator<Item = String>, expected: &str) -> Result<(), Error> {
    let mut seen = HashSet::new();
    for value in values {
        if !seen.insert(value.clone()) {
            return Err(Error::Setting { name: flag, value, expected: expected.to_owned() });
        }
    }
    Ok(())
}
