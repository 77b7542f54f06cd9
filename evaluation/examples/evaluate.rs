//! The shipped policy on the routes of a benchmark that it never saw in training, every episode counted.
//!
//! `cargo run --release -p offtrack-evaluation --example evaluate`

use std::error::Error;
use std::sync::Arc;

use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use offtrack_evaluation::Evaluation;
use offtrack_evaluation::device::Device;
use offtrack_policy::Policy;

fn main() -> Result<(), Box<dyn Error>> {
    let mut scenario = Scenario::named("attard2023")?;
    scenario.keep(&[Split::Test]);
    let world = Arc::new(World::bake(&scenario)?);
    let mut policy = Policy::shipped("attard2023")?;
    let evaluation = Evaluation {
        scenario: &scenario,
        world: &world,
        split: Split::Test,
        episodes: 2,
        seed: 0,
        record: false,
        device: &Device::processor(),
    };
    let (report, _) = evaluation.report(&mut policy, &mut |_, _| ())?;
    print!("{}", report.table(100));
    Ok(())
}
