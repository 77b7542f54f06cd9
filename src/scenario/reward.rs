//! The reward of a benchmark: its keys with their ranges, and other values for some of them.
//!
//! The keys are listed here and, as they are on a device, in [`crate::layout::Reward`].

use serde::{Deserialize, Serialize};

use crate::files::reader::{Error, Reader};
use crate::layout;

/// Range of a weight.
const WEIGHT: [f64; 2] = [-1e6, 1e6];

/// A key of `[reward]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RewardKey {
    /// The key's name.
    pub name: &'static str,
    /// Least and greatest value that a file may give.
    pub range: [f64; 2],
    /// The key's unit; empty for a weight.
    pub unit: &'static str,
}

macro_rules! reward {
    ($($(#[doc = $doc:literal])* $(#[serde($($serde:tt)*)])? $key:ident: $range:expr, $unit:literal;)*) => {
        /// The weights of a reward's terms and the limits of two of them.
        #[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct Reward {
            $($(#[doc = $doc])* $(#[serde($($serde)*)])? pub $key: f64,)*
        }

        /// Other values for some keys of a benchmark's `[reward]`; what is none stays as the benchmark has it.
        #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct RewardChanges {
            $($(#[doc = $doc])* #[serde(default, skip_serializing_if = "Option::is_none")] pub $key: Option<f64>,)*
        }

        /// The keys of `[reward]`, in their order.
        pub const REWARD_KEYS: &[RewardKey] = &[$(RewardKey { name: stringify!($key), range: $range, unit: $unit },)*];

        impl Reward {
            /// The reward's values in the order of [`REWARD_KEYS`].
            pub fn values(&self) -> Vec<f64> {
                vec![$(self.$key),*]
            }
        }

        impl From<&Reward> for layout::Reward {
            fn from(reward: &Reward) -> layout::Reward {
                layout::Reward { $($key: reward.$key as f32,)* }
            }
        }

        impl RewardChanges {
            /// The changed values in the order of [`REWARD_KEYS`]; `None` where a key does not change.
            fn values(&self) -> Vec<Option<f64>> {
                vec![$(self.$key),*]
            }

            /// Changes the reward of a scenario.
            pub fn apply(&self, reward: &mut Reward) {
                $(reward.$key = self.$key.unwrap_or(reward.$key);)*
            }

            /// Changes the reward of a world.
            pub fn apply_to_world(&self, reward: &mut layout::Reward) {
                $(reward.$key = self.$key.map_or(reward.$key, |value| value as f32);)*
            }
        }
    };
}

reward! {
    /// Reward for each waypoint passed.
    waypoint: WEIGHT, "";
    /// Weight of the lane-distance term in the reward of each step.
    lane_distance: WEIGHT, "";
    /// Distance to the lane centre at which that term is 1 (m).
    lane_distance_limit: [0.1, 50.0], "m";
    /// Weight of the clearance term in the reward of each step.
    #[serde(default)]
    clearance: WEIGHT, "";
    /// Clearance to a kerb below which that term counts (m).
    #[serde(default = "half_a_metre")]
    clearance_limit: [0.01, 10.0], "m";
    /// Reward for a failure.
    failure: WEIGHT, "";
    /// Weight of how far the trailer is on an apron, in the reward of each step; no term of reports.
    #[serde(default)]
    apron: WEIGHT, "";
}

fn half_a_metre() -> f64 {
    0.5
}

impl Reward {
    /// # Errors
    ///
    /// The first value out of its range, with its key.
    pub(super) fn check(&self, reader: &Reader) -> Result<(), Error> {
        check(reader, "reward", self.values().into_iter().map(Some))
    }
}

impl RewardChanges {
    /// Whether nothing changes.
    pub fn is_empty(&self) -> bool {
        *self == RewardChanges::default()
    }

    /// # Errors
    ///
    /// The first value out of the range that a benchmark file may give, with its key in `table`.
    pub fn check(&self, reader: &Reader, table: &str) -> Result<(), Error> {
        check(reader, table, self.values().into_iter())
    }
}

fn check(reader: &Reader, table: &str, values: impl Iterator<Item = Option<f64>>) -> Result<(), Error> {
    REWARD_KEYS.iter().zip(values).try_for_each(|(key, value)| {
        let [least, greatest] = key.range;
        let within = |value| reader.within(&format!("{table}.{}", key.name), value, least..=greatest, key.unit);
        value.map_or(Ok(()), |value| within(value).map(drop))
    })
}
