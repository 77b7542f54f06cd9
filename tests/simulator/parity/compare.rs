//! Differences between the columns of two engines, value by value, and their bounds.

use std::fmt;

use bytemuck::cast_slice;
use offtrack::engine::stages::Stage;
use offtrack::layout::{Column, N_EXTRAS, N_RAYS};
use offtrack::world::World;

/// Bound of the difference between two engines in a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Bound of all values but one in a thousand; 0 for values that are equal to the last bit.
    usual: f32,
    /// Bound of all values.
    rarely: f32,
    /// Period: two values that differ by it are the same.
    turn: f32,
}

/// Equal to the last bit: integers, flags, and copied values.
const SAME: Bound = within(0.0);
/// Five units in the last place of a position up to 128 m from the middle, of 7.6e-6 m each: engines sum in different
/// orders.
const POSITION: Bound = within(4e-5);
/// Eight units in the last place of an angle in (-pi, pi], of 2.4e-7 rad each.
const ANGLE: Bound = Bound { turn: std::f32::consts::TAU, ..within(2e-6) };
/// As [`ANGLE`], of angles as fractions of half a turn.
const TURN: Bound = Bound { turn: 2.0, ..ANGLE };
/// Eight units of values below 2.
const SMALL: Bound = within(1e-6);
/// Twice that of what is observed beside the rest: load transfer ratios follow a steer angle in which a truck begins.
const EXTRA: Bound = within(2e-6);
/// Eight units of speeds, accelerations, roll rates and other values below 16.
const MIDDLING: Bound = within(8e-6);
/// Eight units of lateral accelerations below 64 m/s^2: a truck at 16 m/s that is bent by 140 deg has such.
const LARGE: Bound = within(3e-5);
/// A span that only one engine halves may reduce a clearance of up to 2 m by half.
const CLEARANCE: Bound = Bound { rarely: 1.0, ..POSITION };
/// A ray along a kerb may end a sample later on one engine; each ends within 2 cm of the kerb.
const RANGE: Bound = Bound { rarely: 0.05, ..within(1e-4) };
/// As [`RANGE`], of ranges as fractions of a reach of 20 m.
const SCALED_RANGE: Bound = Bound { rarely: 2.5e-3, ..within(5e-6) };
/// The angle at a waypoint to a truck that stands on it depends on the last bits of the truck's position.
const BEARING: Bound = Bound { usual: 1e-4, rarely: 1e-2, ..TURN };
/// Differences of positions over 10 m or 20 m.
const SCALED_POSITION: Bound = within(4e-6);
/// 100 for a waypoint, 500 for a failure: four units in the last place.
const REWARD: Bound = within(1.2e-4);

const fn within(bound: f32) -> Bound {
    Bound { usual: bound, rarely: bound, turn: f32::INFINITY }
}

/// The values of a column's row: name, number of values, bound.
pub fn values(column: Column) -> &'static [(&'static str, usize, Bound)] {
    match column {
        Column::Action | Column::Ended => &[("", 1, SAME)],
        // Trucks alone have no rows of these.
        Column::Cars | Column::Around | Column::NextAround => &[],
        Column::Control => &[
            ("steering", 1, SMALL),
            ("acceleration", 1, MIDDLING),
            ("speed_error_integral", 1, MIDDLING),
            ("steering_before", 1, SMALL),
            ("steering_earlier", 1, SMALL),
            ("target_speed", 1, SMALL),
            ("holds", 1, SAME),
            ("steering_earliest", 1, SMALL),
            ("actions_before", 3, SAME),
        ],
        Column::Truck => &[
            ("position", 2, POSITION),
            ("heading", 1, ANGLE),
            ("trailer_heading", 1, ANGLE),
            ("speed", 1, MIDDLING),
            ("steering", 1, SMALL),
            ("tractor_roll", 1, SMALL),
            ("tractor_roll_rate", 1, MIDDLING),
            ("trailer_roll", 1, SMALL),
            ("trailer_roll_rate", 1, MIDDLING),
            ("tractor_load_transfer_ratio", 1, MIDDLING),
            ("trailer_load_transfer_ratio", 1, MIDDLING),
            ("route", 1, SAME),
            ("episode", 1, SAME),
            ("steps", 1, SAME),
            ("held", 1, SAME),
            ("acceleration", 1, MIDDLING),
            ("curvature_lag", 1, SMALL),
            ("lateral_acceleration", 1, LARGE),
            ("vehicle", 1, SAME),
        ],
        Column::Clearance => &[("tractor", 1, CLEARANCE), ("trailer", 1, CLEARANCE)],
        Column::Progress => &[
            ("lane_distance", 1, POSITION),
            ("waypoint_distance", 1, POSITION),
            ("waypoint", 1, SAME),
            ("passed", 1, SAME),
        ],
        Column::Ranges => &[("", N_RAYS, RANGE)],
        Column::Observation | Column::NextObservation => &[
            ("speed", 1, SMALL),
            ("distances", 2, SCALED_POSITION),
            ("crossings", 2, SCALED_POSITION),
            ("lane", 1, SCALED_POSITION),
            ("bearings", 5, BEARING),
            ("headings", 5, TURN),
            ("trailer_headings", 5, TURN),
            ("articulation", 1, TURN),
            ("curvatures", 8, SAME),
            ("ranges", N_RAYS, SCALED_RANGE),
            ("radii", 10, SAME),
        ],
        Column::Terms => &[
            ("waypoints", 1, SAME),
            ("lane_distance", 1, SCALED_POSITION),
            ("clearance", 1, CLEARANCE),
            ("failure", 1, SAME),
        ],
        Column::Reward => &[("", 1, REWARD)],
        Column::Extras | Column::NextExtras => &[("", N_EXTRAS, EXTRA)],
        Column::Poses => &[
            ("seen.position", 2, POSITION),
            ("seen.headings", 2, ANGLE),
            ("seen.speed", 1, MIDDLING),
            ("seen.waypoint", 1, SAME),
            ("before.position", 2, POSITION),
            ("before.headings", 2, ANGLE),
            ("before.speed", 1, MIDDLING),
            ("before.waypoint", 1, SAME),
            ("earlier.position", 2, POSITION),
            ("earlier.headings", 2, ANGLE),
            ("earlier.speed", 1, MIDDLING),
            ("earlier.waypoint", 1, SAME),
            ("earliest.position", 2, POSITION),
            ("earliest.headings", 2, ANGLE),
            ("earliest.speed", 1, MIDDLING),
            ("earliest.waypoint", 1, SAME),
        ],
        Column::Command => &[("", 2, SAME)],
    }
}

/// The comparison of all values of one name.
#[derive(Debug, Clone)]
pub struct Agreement {
    /// Column and name.
    pub value: String,
    /// Compared.
    pub n: usize,
    /// Equal to the last bit.
    pub equal: usize,
    /// Beyond the usual bound.
    pub unusual: usize,
    /// The largest difference; infinite between NaN and a number, and between integers.
    pub worst: f32,
    bound: Bound,
}

impl Agreement {
    /// Whether the differences are within the bound.
    pub fn holds(&self) -> bool {
        let bound = &self.bound;
        if *bound == SAME { self.equal == self.n } else { self.worst <= bound.rarely && 1000 * self.unusual <= self.n }
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Agreement { value, n, equal, unusual, worst, .. } = self;
        write!(
            f,
            "{value} | {:.2} % equal | at most {worst:.1e} | {unusual} of {n} unusual",
            100.0 * *equal as f64 / *n as f64
        )
    }
}

/// Difference between two words of a value.
fn apart(here: u32, there: u32, bound: Bound) -> f32 {
    if here == there {
        return 0.0;
    }
    let difference = (f32::from_bits(here) - f32::from_bits(there)).abs();
    let difference = difference.min((difference - bound.turn).abs());
    // NaN and another integer are infinitely far.
    if difference.is_nan() || bound == SAME { f32::INFINITY } else { difference }
}

/// Compares a column of two batches, in the rows where `counted` says so.
pub fn agreements(column: Column, here: &[u8], there: &[u8], counted: &[bool]) -> Vec<Agreement> {
    let (here, there): (&[u32], &[u32]) = (cast_slice(here), cast_slice(there));
    let width = here.len() / counted.len();
    let names = values(column);
    assert_eq!(names.iter().map(|(_, n, _)| n).sum::<usize>(), width, "{column:?}");
    assert_eq!(here.len(), there.len(), "{column:?}");
    let mut first = 0;
    let compared = names.iter().map(|&(name, n_words, bound)| {
        let value = if name.is_empty() { column.name().to_owned() } else { format!("{}.{name}", column.name()) };
        let mut agreement = Agreement { value, n: 0, equal: 0, unusual: 0, worst: 0.0, bound };
        for row in (0..counted.len()).filter(|&row| counted[row]) {
            for word in (row * width + first)..(row * width + first + n_words) {
                let difference = apart(here[word], there[word], bound);
                agreement.n += 1;
                agreement.equal += usize::from(here[word] == there[word]);
                agreement.unusual += usize::from(bound.usual < difference);
                agreement.worst = agreement.worst.max(difference);
            }
        }
        first += n_words;
        agreement
    });
    compared.collect()
}

/// Columns, and a change of the world.
pub type Written = (&'static [Column], Option<fn(&mut World)>);

/// What a stage writes, and one number of the world that it notices to be off by a thousandth. Three stages use no
/// number of the world.
pub fn written(stage: Stage) -> Written {
    match stage {
        Stage::Steer => {
            (&[Column::Control], Some(|world| world.rigs.iter_mut().for_each(|rig| rig.speed_gain *= 1.001)))
        }
        Stage::Drive => {
            (&[Column::Truck], Some(|world| world.rigs.iter_mut().for_each(|rig| rig.trailer_wheelbase *= 1.001)))
        }
        // Trucks alone: those among vehicles have tests of their own.
        Stage::Traffic => (&[], None),
        Stage::Collide => (
            &[Column::Clearance],
            Some(|world| world.rigs.iter_mut().for_each(|rig| rig.trailer_body.half_width *= 1.001)),
        ),
        Stage::Follow => (
            &[Column::Progress, Column::Poses],
            Some(|world| world.rigs.iter_mut().for_each(|rig| rig.wheelbase *= 1.001)),
        ),
        Stage::Sense => {
            (&[Column::Ranges], Some(|world| world.rays.iter_mut().flatten().for_each(|ray| ray.origin *= 1.001)))
        }
        Stage::Observe => {
            (&[Column::NextObservation, Column::NextExtras], Some(|world| world.params.sensor_range *= 1.001))
        }
        Stage::Judge => (
            &[Column::Truck, Column::Ended, Column::Terms, Column::Reward],
            Some(|world| world.reward.lane_distance_limit *= 1.001),
        ),
        Stage::Count => (&[], None),
        Stage::CopyObservation => (&[Column::Observation, Column::Extras], None),
        Stage::Reset => (
            &[
                Column::Truck,
                Column::Control,
                Column::Progress,
                Column::Poses,
                Column::Ranges,
                Column::Observation,
                Column::Extras,
            ],
            Some(|world| {
                world.params.start_offset *= 1.001;
            }),
        ),
    }
}
