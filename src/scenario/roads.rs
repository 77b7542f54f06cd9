//! The roundabouts of a benchmark, from files and at random, and which of their routes are in which split.

use std::ops::Range;

use glam::DVec2;

use super::benchmark_keys::{WrittenChoice, WrittenProcedural, WrittenRoundabout};
use super::referred::referred;
use super::{Place, Scenario, Split};
use crate::files::cache::Loading;
use crate::files::reader::{Error, Exactly, Reader, shown};
use crate::files::shipped::{Kind, Source};
use crate::map::Road;
use crate::map::chosen::{Choice, is_map};
use crate::map::opendrive::{Hand, Way};
use crate::map::procedural::Distribution;
use crate::map::route::Route;

/// Maximum number of roundabouts that are read, listed or drawn. One takes about 0.1 MB before it is baked.
pub(super) const MOST_ROADS: usize = 100_000;
/// Maximum number of roads in a seed of which a benchmark uses some.
const MOST_INDICES: usize = 1_000_000;
/// Largest coordinate of a ring in its map (m).
const FARTHEST_RING: f64 = 1e8;

/// Random roads of a benchmark, by split.
pub(super) struct Procedural {
    distribution: Distribution,
    seed: u32,
    /// Ranges of indices in the order of [`Split::ALL`].
    ranges: [Range<u32>; 3],
}

impl Procedural {
    /// Reads the distribution and checks the ranges. No road is drawn.
    pub(super) fn checked(reader: &Reader, source: &Source, written: &WrittenProcedural) -> Result<Procedural, Error> {
        let WrittenProcedural { distribution, seed, count, train, validation, test } = written;
        let distribution = referred(
            reader,
            "procedural.distribution",
            source,
            Kind::Distribution,
            distribution,
            Distribution::from_source,
        )?;
        reader.count("procedural.count", *count, 1..=MOST_INDICES)?;
        let mut ranges: [Range<u32>; 3] = Default::default();
        let given = [train, validation, test].map(Option::as_ref);
        for (split, &Exactly([from, to])) in
            Split::ALL.into_iter().zip(given).filter_map(|(split, range)| Some((split, range?)))
        {
            let key = format!("procedural.{}", split.name());
            let value = format!("[{from}, {to}]");
            if to <= from || *count < to as usize {
                let expected =
                    format!("must be [first, last + 1] with first < last + 1 <= procedural.count, which is {count}");
                return Err(reader.invalid(key, value, expected));
            }
            let shares = |other: &Split| from < ranges[*other as usize].end && ranges[*other as usize].start < to;
            if let Some(other) = Split::ALL.iter().find(|other| shares(other)) {
                let expected = format!("shares roads with procedural.{}; a road is in one split", other.name());
                return Err(reader.invalid(key, value, expected));
            }
            ranges[split as usize] = from..to;
        }
        let n_roads: usize = ranges.iter().map(Range::len).sum();
        if n_roads == 0 {
            let expected = "at least one of `train`, `validation` and `test` is needed, each as [first, last + 1]";
            return Err(reader.invalid("procedural", "no roads", expected));
        }
        if MOST_ROADS < n_roads {
            let expected = format!("train, validation and test together may have {MOST_ROADS}, which take about 10 GB");
            return Err(reader.invalid("procedural", format_args!("{n_roads} roads"), expected));
        }
        Ok(Procedural { distribution, seed: *seed, ranges })
    }
}

impl Scenario {
    /// Adds a roundabout of the file, written under `key`, and its routes.
    pub(super) fn add_file(
        &mut self,
        reader: &Reader,
        key: &str,
        source: &Source,
        written: &WrittenRoundabout,
    ) -> Result<(), Error> {
        let read = |source: &Source| match source {
            Source::Disk(file) if is_map(file) => {
                let WrittenRoundabout { hand, name, arms, .. } = written;
                for (index, value) in written.ring.iter().flat_map(|ring| ring.0).enumerate() {
                    reader.within(&format!("{key}.ring[{index}]"), value, -FARTHEST_RING..=FARTHEST_RING, "m")?;
                }
                let ring = written.ring.map(|ring| DVec2::from(ring.0));
                let ways =
                    written.way.iter().map(|way| Way { from: (&way.from).into(), to: (&way.to).into() }).collect();
                Road::from_map(file, &Choice { ring, hand: *hand, name: name.clone(), arms: arms.clone(), ways })
            }
            source => Road::from_source(source),
        };
        if !is_map(&written.file) {
            let given = [
                ("ring", written.ring.is_some()),
                ("hand", written.hand != Hand::Map),
                ("name", written.name.is_some()),
                ("arms", !written.arms.is_empty()),
                ("way", !written.way.is_empty()),
            ];
            if let Some((name, _)) = given.into_iter().find(|(_, given)| *given) {
                return Err(reader.invalid(
                    format!("{key}.{name}"),
                    "given",
                    "is for a map, a file that ends in .xodr; leave it out",
                ));
            }
        }
        let roundabout = referred(reader, &format!("{key}.file"), source, Kind::Roundabout, &written.file, read)?;
        if self.places.iter().any(|other| other.roundabout.name == roundabout.name) {
            return Err(reader.invalid(
                format!("{key}.file"),
                written.file.display(),
                format!(
                    "each roundabout may be listed once, and {} is: leave it out, or give a map another `name`",
                    roundabout.name
                ),
            ));
        }
        let routes = self.routes_of(reader, &roundabout)?;
        let mut splits = vec![None; routes.len()];
        let choices = [&written.train, &written.validation, &written.test];
        for (split, choice) in Split::ALL.into_iter().zip(choices) {
            for index in chosen(reader, &format!("{key}.{}", split.name()), choice, &routes)? {
                if let Some(other) = splits[index].replace(split) {
                    let (key, name) = (format!("{key}.{}", split.name()), &routes[index].name);
                    return Err(reader.invalid(
                        key,
                        name,
                        format!("is listed under `{}` too; a route is in one split", other.name()),
                    ));
                }
            }
        }
        self.place(reader, roundabout, routes.into_iter().zip(splits))
    }

    /// Draws the random roads and adds them with all their routes, in the order of their indices.
    pub(super) fn add_random(
        &mut self,
        reader: &Reader,
        procedural: &Procedural,
        loading: &Loading,
    ) -> Result<(), Error> {
        let mut split_of: Vec<(u32, Split)> = Vec::new();
        for split in Split::ALL {
            split_of.extend(procedural.ranges[split as usize].clone().map(|index| (index, split)));
        }
        split_of.sort_unstable_by_key(|&(index, _)| index);
        let indices: Vec<u32> = split_of.iter().map(|&(index, _)| index).collect();
        for (road, (_, split)) in
            procedural.distribution.roads(procedural.seed, &indices, loading)?.into_iter().zip(split_of)
        {
            loading.check()?;
            let routes = self.routes_of(reader, &road.roundabout)?;
            self.place(reader, road.roundabout, routes.into_iter().map(|route| (route, Some(split))))?;
        }
        Ok(())
    }

    /// All routes of a roundabout.
    pub(super) fn routes_of(&self, reader: &Reader, roundabout: &Road) -> Result<Vec<Route>, Error> {
        roundabout.routes(self.approach, self.departure, self.spacing).map_err(|leaves| {
            reader.invalid(
                format!("routes.{}", leaves.part),
                format_args!("{} m", shown(leaves.asked)),
                leaves.to_string(),
            )
        })
    }

    /// Adds a roundabout with those of its routes that are in a split.
    pub(super) fn place(
        &mut self,
        reader: &Reader,
        roundabout: Road,
        routes: impl Iterator<Item = (Route, Option<Split>)>,
    ) -> Result<(), Error> {
        let mut next: u32 = self.splits.iter().map(|split| split.len() as u32).sum();
        let mut kept = Vec::new();
        for (route, split) in routes {
            let Some(split) = split else { continue };
            self.splits[split as usize].push(next);
            next += 1;
            kept.push(route);
        }
        self.whole_truck_on_arms(reader, &kept)?;
        self.places.push(Place { roundabout, routes: kept });
        Ok(())
    }

    /// Every route leaves room for the whole truck on its arms: behind the route's beginning at the start pose, and
    /// ahead of its end on arrival.
    fn whole_truck_on_arms(&self, reader: &Reader, routes: &[Route]) -> Result<(), Error> {
        let (behind, ahead) = self.reach();
        let starts = routes.iter().map(|route| (route.before - behind, route));
        let ends = routes.iter().map(|route| (route.after - ahead, route));
        let nearest = |(a, first), (b, second)| if b < a { (b, second) } else { (a, first) };
        for (part, asked, reach, side, room) in [
            ("approach", self.approach, behind, "behind its start", starts.reduce(nearest)),
            ("departure", self.departure, ahead, "ahead of its end", ends.reduce(nearest)),
        ] {
            let Some((room, route)) = room.filter(|(room, _)| *room < 0.0) else { continue };
            // Rounded down, so that the length in the message does fit.
            let longest = ((asked + room) * 100.0).floor() / 100.0;
            let expected =
                format!("the truck needs {reach:.2} m of the arm {side}: at most {longest} m fit {}", route.name);
            return Err(reader.invalid(format!("routes.{part}"), format_args!("{} m", shown(asked)), expected));
        }
        Ok(())
    }
}

/// Indices of the routes that a split lists.
fn chosen(reader: &Reader, key: &str, choice: &WrittenChoice, routes: &[Route]) -> Result<Vec<usize>, Error> {
    let names = match choice {
        WrittenChoice::Word(word) if word == "all" => return Ok((0..routes.len()).collect()),
        WrittenChoice::Word(word) => {
            return Err(reader.invalid(key, format_args!("{word:?}"), "must be \"all\" or a list of route names"));
        }
        WrittenChoice::Names(names) => names,
    };
    let mut indices = Vec::new();
    for (number, name) in names.iter().enumerate() {
        let key = format!("{key}[{number}]");
        let found = routes.iter().position(|route| route.name.rsplit('/').next() == Some(name));
        let index = found.ok_or_else(|| {
            let known: Vec<&str> = routes.iter().filter_map(|route| route.name.rsplit('/').next()).collect();
            reader.invalid(&key, format_args!("{name:?}"), format!("the roundabout has {}", known.join(", ")))
        })?;
        if indices.contains(&index) {
            return Err(reader.invalid(&key, format_args!("{name:?}"), "is listed twice"));
        }
        indices.push(index);
    }
    Ok(indices)
}
