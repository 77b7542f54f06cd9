//! Drives cars alone on many roads and prints what must be 0, what is served, and the time of a step.
//!
//! `cargo run --release --example traffic -- [STEPS] [VANS] [LARGE]`: 20,000 steps on each road at each demand, no vans
//! and no buses, rigid trucks and tractor-trailers, of which there are as many each, unless stated. Roads are the
//! study's, those of the shipped maps, and random ones: wide/2026/240 to 269 and mixed/2026/0 to 49. The time is that
//! of one core, with 24 slots.

use std::error::Error;
use std::path::Path;
use std::time::{Duration, Instant};

use offtrack::layout::Stream;
use offtrack::map::{Road, procedural};
use offtrack::traffic::{Car, Demand, Event, Mix, Network, Rules, Run};
use rayon::prelude::*;

const DEMANDS: [f64; 4] = [300.0, 900.0, 1500.0, 2100.0];
const MAPS: [&str; 5] = ["town03", "town03-crossing", "zala8", "zala25", "sumo22"];
const SLOTS: usize = 24;

/// What was seen on a road, or on several.
#[derive(Debug, Default, Clone)]
struct Seen {
    steps: u64,
    steps_with_overlaps: u64,
    longest_standing: u32,
    off: u64,
    cars: u64,
    came: u64,
    stayed: u64,
    left: u64,
    removed: u64,
    stepping: Duration,
}

impl Seen {
    fn add(&mut self, other: &Seen) {
        self.steps += other.steps;
        self.steps_with_overlaps += other.steps_with_overlaps;
        self.longest_standing = self.longest_standing.max(other.longest_standing);
        self.off += other.off;
        self.cars += other.cars;
        self.came += other.came;
        self.stayed += other.stayed;
        self.left += other.left;
        self.removed += other.removed;
        self.stepping += other.stepping;
    }

    fn line(&self, name: &str, demand: f64) -> String {
        let steps = self.steps as f64;
        format!(
            "{name:16} {demand:5} veh/h: {:9} steps, {} with overlaps, longest standing {:.0} s, {} off their path, \
             {:.1} cars, served {:.0} veh/h, stayed away {:.2} %, {} removed, {:.2} us a step",
            self.steps,
            self.steps_with_overlaps,
            f64::from(self.longest_standing) * 0.1,
            self.off,
            self.cars as f64 / steps,
            self.left as f64 * 36_000.0 / steps,
            100.0 * self.stayed as f64 / self.came.max(1) as f64,
            self.removed,
            self.stepping.as_secs_f64() * 1e6 / steps
        )
    }
}

fn driven(network: &Network, demand: &Demand, steps: u64, seed: u32) -> Seen {
    let mut run = Run::new(network, &Rules::FITTED, demand, SLOTS, Stream { seed, env: 0 });
    let mut seen = Seen::default();
    for _ in 0..steps {
        let begun = Instant::now();
        run.step(|event, _| match event {
            Event::Came(_) => seen.came += 1,
            Event::Stayed(_) => (seen.came, seen.stayed) = (seen.came + 1, seen.stayed + 1),
            Event::Left(_) => seen.left += 1,
            Event::Removed(_) => seen.removed += 1,
            Event::Entered(..) => {}
        });
        seen.stepping += begun.elapsed();
        let there = run.cars.iter().filter(|car| car.is_there());
        seen.steps += 1;
        seen.steps_with_overlaps += u64::from(0 < run.overlaps());
        seen.cars += there.clone().count() as u64;
        seen.longest_standing = there.clone().map(Car::standing).fold(seen.longest_standing, u32::max);
        let is_on = |car: &Car| (0.0..=network.paths[car.path()].length()).contains(&car.station());
        seen.off += there.filter(|car| !is_on(car)).count() as u64;
    }
    seen
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let steps = arguments.next().map_or(Ok(20_000), |word| word.parse::<u64>())?;
    let vans = arguments.next().map_or(Ok(0.0), |word| word.parse::<f32>())?;
    let large = arguments.next().map_or(Ok(0.0), |word| word.parse::<f32>())?;
    let mix = Mix { vans, rude: 0.0, large: [large / 3.0; 3] };
    let maps = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/maps");
    let mut groups: Vec<(String, Vec<Road>)> = Vec::new();
    for name in ["16m", "20m", "32m", "40m", "50m"] {
        groups.push((name.to_owned(), vec![Road::named(name)?]));
    }
    for name in MAPS {
        groups.push((name.to_owned(), vec![Road::read(&maps.join(name).with_extension("outline.toml"))?]));
    }
    for (distribution, range) in [("wide", 240..270), ("mixed", 0..50)] {
        let roads = range.into_par_iter().map(|index| procedural::find(&format!("{distribution}/2026/{index}")));
        groups.push((distribution.to_owned(), roads.collect::<Result<_, _>>()?));
    }
    let mut worst = Seen::default();
    for (name, roads) in &groups {
        let baked = |road: &Road| Network::cached(road, mix.has_large(), None);
        let networks = roads.par_iter().map(baked).collect::<Result<Vec<Network>, _>>()?;
        for demand in DEMANDS {
            let seen = networks.par_iter().enumerate().filter_map(|(index, network)| {
                let flows = Demand::even(network, demand);
                let demand = Demand::new(network, &flows, mix).ok()?;
                let seen = driven(network, &demand, steps, index as u32);
                (0 < seen.steps_with_overlaps).then(|| println!("  overlaps: {name} {index} seed {index}"));
                Some(seen)
            });
            let all = seen.collect::<Vec<Seen>>().iter().fold(Seen::default(), |mut sum, one| {
                sum.add(one);
                sum
            });
            if 0 < all.steps {
                println!("{}", all.line(name, demand));
                worst.add(&all);
            }
        }
    }
    println!("{}", worst.line("all", f64::NAN));
    Ok(())
}
