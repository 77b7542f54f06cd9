//! What passes the entries of a road while cars drive on it: as an observer beside each entry would count it.

mod saturated;

use std::collections::{BTreeMap, VecDeque};

use super::arrivals::Event;
use super::bake::ENTRY;
use super::decide::MOST_CARS;
use super::hcm::Lane;
use super::network::{Kind, Network};
use super::units::{BEYOND, FINER_SPEED, length, metres, speed};
use super::{Car, Demand, Error, Mix, Rules, Run, STEP};
use crate::layout::Stream;

pub use saturated::Saturated;

/// Steps before the counts begin: cars spread over an empty road.
const WARM_UP: u32 = 1_200;
/// Behind the line a car has lost all the time that the entry costs it, speeding up again included.
const UP_TO_SPEED: i32 = length(20.0);
/// More come than a lane can serve where this part of them stays away: a lane that just can loses less, since up to 15
/// wait outside.
const LOST_OVER_CAPACITY: f64 = 0.03;
/// Paths that pass an entry nearer to each other than this are of one ring lane (m).
const ONE_LANE: f32 = 1.5;
/// A car on its arm below this speed is queued.
const QUEUED: i32 = speed(2.0);

/// A road with its entries, to be counted at.
pub struct Survey<'a> {
    network: &'a Network,
    rules: &'a Rules,
    /// Station at which a path passes the entry of an arm, of path p and arm a at index p n_arms + a; [`BEYOND`] where
    /// it does not (2^-10 m).
    passes: Vec<i32>,
    nobody: Demand,
}

/// What was counted at one entry lane.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Counts {
    /// Cars that came.
    pub came: u64,
    /// Those of them that found 15 waiting outside, and stayed away.
    pub stayed: u64,
    /// Cars that came onto the road.
    pub entered: u64,
    /// Large vehicles among them.
    pub large: u64,
    /// Cars that passed the line.
    pub served: u64,
    /// Those of them that stood in a blocked ring for two minutes, and were taken away.
    pub removed: u64,
    /// Steps in which cars waited outside since as many as can be were on the road.
    pub crowded: u64,
    /// Ring cars that passed the arm's entry.
    pub circulating: u64,
    /// Sum of the control delays of cars that came up to speed behind the line (s).
    pub delay: f64,
    /// Number of these cars.
    pub delayed: u64,
    /// Sum of what those have lost so far who were not up to speed at the end (s).
    pub delay_so_far: f64,
    /// Number of these cars.
    pub unfinished: u64,
    /// Number of steps with so many cars queued, by the number of cars.
    pub queues: Vec<u64>,
}

impl Counts {
    /// Adds what was counted at the same lane in another run.
    pub fn add(&mut self, other: &Counts) {
        self.came += other.came;
        self.stayed += other.stayed;
        self.entered += other.entered;
        self.large += other.large;
        self.served += other.served;
        self.removed += other.removed;
        self.crowded += other.crowded;
        self.circulating += other.circulating;
        self.delay += other.delay;
        self.delayed += other.delayed;
        self.delay_so_far += other.delay_so_far;
        self.unfinished += other.unfinished;
        self.queues.resize(self.queues.len().max(other.queues.len()), 0);
        self.queues.iter_mut().zip(&other.queues).for_each(|(sum, &steps)| *sum += steps);
    }

    /// Mean control delay: time lost against a car of the same style that nobody hinders (s); none where no car came up
    /// to speed.
    pub fn mean_delay(&self) -> Option<f64> {
        // Speeds of a car alone are rounded, so what nobody hinders may come to less than none.
        (0 < self.delayed).then(|| (self.delay / self.delayed as f64).max(0.0))
    }

    /// The least that the mean delay of all cars can be, those included that have not come up to speed yet (s): more
    /// than [`Counts::mean_delay`] where the lane stands. None where nobody came.
    pub fn least_mean_delay(&self) -> Option<f64> {
        let n = self.delayed + self.unfinished;
        let of_all = (0 < n).then(|| (self.delay + self.delay_so_far) / n as f64);
        of_all.map(|of_all| of_all.max(self.mean_delay().unwrap_or(0.0)))
    }

    /// Fraction of large vehicles among those that came onto the road: less than asked for where cars came in their
    /// place.
    pub fn heavy(&self) -> f64 {
        self.large as f64 / self.entered.max(1) as f64
    }

    /// Whether more came than the lane could serve.
    pub fn is_over_capacity(&self) -> bool {
        LOST_OVER_CAPACITY * (self.came as f64) < self.stayed as f64
    }

    /// Queue that was exceeded in 5 % of the time (veh).
    pub fn queue_95(&self) -> usize {
        let all: u64 = self.queues.iter().sum();
        let mut below = 0;
        let reached = self.queues.iter().position(|&steps| {
            below += steps;
            0.95 * all as f64 <= below as f64
        });
        reached.unwrap_or(0)
    }

    fn add_unfinished(&mut self, steps: u32) {
        self.unfinished += 1;
        self.delay_so_far += f64::from(STEP) * f64::from(steps);
    }

    fn note_queue(&mut self, n: usize) {
        if self.queues.len() <= n {
            self.queues.resize(n + 1, 0);
        }
        self.queues[n] += 1;
    }
}

impl<'a> Survey<'a> {
    /// A road's entries.
    ///
    /// # Errors
    ///
    /// None of a baked network; those of [`Demand::new`].
    pub fn new(network: &'a Network, rules: &'a Rules) -> Result<Survey<'a>, Error> {
        let nobody = Demand::new(network, &vec![0.0; network.paths.len()], Mix::default())?;
        Ok(Survey { network, rules, passes: passes(network), nobody })
    }

    /// An entry lane in the terms of the Highway Capacity Manual.
    pub fn lane(&self, source: usize) -> Lane {
        let own = &self.network.sources[source];
        let entry_lanes = self.network.sources.iter().filter(|other| other.entry == own.entry).count();
        let at = |path: usize| self.passes[path * self.network.n_arms + own.entry as usize];
        let passing: Vec<usize> = (0..self.network.paths.len()).filter(|&path| at(path) < BEYOND).collect();
        let mut lanes: Vec<u32> = passing.iter().map(|&path| self.network.source_of(path).lane).collect();
        lanes.sort_unstable();
        lanes.dedup();
        // Lanes of an arm may lead into one of the ring.
        let mut radii: Vec<f32> =
            passing.iter().map(|&path| self.network.position(path, metres(at(path))).length()).collect();
        radii.sort_by(f32::total_cmp);
        radii.dedup_by(|after, before| {
            let is_beside = *after - *before < ONE_LANE;
            *before = *after;
            is_beside
        });
        Lane { entry_lanes, ring_lanes: lanes.len().min(radii.len()), lane: own.lane as usize }
    }

    /// Counts at every entry lane over so many steps after a warm-up; at sources that are `full` as many cars wait
    /// outside as can, and delays and queues mean nothing.
    pub fn counted(&self, demand: &Demand, steps: u32, stream: Stream, full: &[usize]) -> Vec<Counts> {
        let mut run = Run::new(self.network, self.rules, demand, MOST_CARS, stream);
        let mut observer = Observer::new(self);
        for step in 0..WARM_UP + steps {
            full.iter().for_each(|&source| run.fill(source));
            let before: Vec<Car> = run.cars.clone();
            let mut events = Vec::new();
            run.step(|event, _| events.push(event));
            run.take_away_stuck(|event| events.push(event));
            observer.observe(&run, &before, &events, step);
        }
        observer.count_unfinished(&run, WARM_UP + steps);
        observer.counts
    }

    /// Time that a car of this style takes to the end of its entry where nobody hinders it (steps).
    fn free_time(&self, entered: Car) -> u32 {
        let mut run = Run::new(self.network, self.rules, &self.nobody, 1, Stream::default());
        run.cars[0] = entered;
        let end = self.end_of_entry(entered.path());
        let mut steps = 0;
        while run.cars[0].is_there() && run.cars[0].front() < end {
            run.step(|_, _| {});
            steps += 1;
        }
        steps
    }

    fn end_of_entry(&self, path: usize) -> i32 {
        let path = &self.network.paths[path];
        (path.line + UP_TO_SPEED).min(path.length)
    }
}

/// Where every path passes every arm's entry: where its first zone with a path of this entry begins.
fn passes(network: &Network) -> Vec<i32> {
    let (n, n_arms) = (network.paths.len(), network.n_arms);
    let mut passes = vec![BEYOND; n * n_arms];
    for a in 0..n {
        let arm = network.source_of(a).entry;
        let line = network.paths[a].line;
        for b in (0..n).filter(|&b| network.source_of(b).entry != arm && network.paths[b].exit_arm != arm) {
            let zones = network.zones_of(a, b).iter().map(|zone| zone.stretch());
            let of_entry = zones.filter(|zone| {
                let is_behind_both = line <= zone.a_in && network.paths[b].line < zone.b_in;
                zone.kind != Kind::Wide && is_behind_both && zone.a_in <= line + length(ENTRY as f32)
            });
            let at = &mut passes[b * n_arms + arm as usize];
            *at = of_entry.map(|zone| zone.b_in).fold(*at, i32::min);
        }
    }
    passes
}

/// What is known of the car in a slot.
#[derive(Clone, Copy)]
struct Known {
    /// Step at which it came.
    came: u32,
    /// Time that it would take to the end of its entry unhindered (steps).
    free: u32,
}

struct Observer<'a> {
    survey: &'a Survey<'a>,
    counts: Vec<Counts>,
    /// Steps at which the cars came that wait outside, by source.
    outside: Vec<VecDeque<u32>>,
    known: [Option<Known>; MOST_CARS],
    /// Unhindered times by path and style.
    free: BTreeMap<u32, u32>,
}

impl<'a> Observer<'a> {
    fn new(survey: &'a Survey<'a>) -> Observer<'a> {
        let n = survey.network.sources.len();
        let (counts, outside) = (vec![Counts::default(); n], vec![Default::default(); n]);
        Observer { survey, counts, outside, known: [None; MOST_CARS], free: BTreeMap::new() }
    }

    fn observe(&mut self, run: &Run, before: &[Car], events: &[Event], step: u32) {
        let counts = WARM_UP <= step;
        // Cars that came in this step have passed nothing in it.
        let mut changed = [false; MOST_CARS];
        for &event in events {
            match event {
                Event::Came(source) => {
                    self.outside[source].push_back(step);
                    self.counts[source].came += u64::from(counts);
                }
                Event::Stayed(source) => {
                    self.counts[source].came += u64::from(counts);
                    self.counts[source].stayed += u64::from(counts);
                }
                Event::Entered(source, slot) => {
                    changed[slot] = true;
                    let car = run.cars[slot];
                    self.counts[source].entered += u64::from(counts);
                    self.counts[source].large += u64::from(counts && car.is_large());
                    let limit = self.survey.network.limit(car.path(), car.station);
                    let unhindered = Car { speed: limit << FINER_SPEED, ..car };
                    let free = *self.free.entry(car.what).or_insert_with(|| self.survey.free_time(unhindered));
                    self.known[slot] = self.outside[source].pop_front().map(|came| Known { came, free });
                }
                Event::Left(slot) => {
                    changed[slot] = true;
                    if counts {
                        // The line of a path that meets no other arm's is at its end.
                        let end = self.survey.network.paths[before[slot].path()].length;
                        self.count_passed(slot, &before[slot], end + 1, step);
                    }
                }
                Event::Removed(slot) => {
                    changed[slot] = true;
                    if counts {
                        let source = self.survey.network.paths[before[slot].path()].source as usize;
                        self.counts[source].removed += 1;
                        self.count_on_entry(slot, &before[slot], step);
                    }
                }
            }
        }
        if !counts {
            return;
        }
        if run.cars.iter().all(Car::is_there) {
            let waits = |source: &usize| 0 < run.waiting(*source);
            (0..self.counts.len()).filter(waits).for_each(|source| self.counts[source].crowded += 1);
        }
        let mut queued: Vec<usize> = (0..self.counts.len()).map(|source| run.waiting(source)).collect();
        for (slot, car) in run.cars.iter().enumerate().filter(|(slot, car)| car.is_there() && !changed[*slot]) {
            let network = self.survey.network;
            let path = &network.paths[car.path()];
            queued[path.source as usize] += usize::from(car.front() <= path.line && car.pace() < QUEUED);
            self.count_passed(slot, &before[slot], car.front(), step);
        }
        self.counts.iter_mut().zip(queued).for_each(|(counts, n)| counts.note_queue(n));
    }

    /// Counts what a car has passed that drove on from where it was to a station (2^-10 m).
    fn count_passed(&mut self, slot: usize, before: &Car, to: i32, step: u32) {
        let network = self.survey.network;
        let passed = |station: i32| before.front() <= station && station < to;
        let path = &network.paths[before.path()];
        let own = path.source as usize;
        self.counts[own].served += u64::from(passed(path.line));
        for (source, of) in network.sources.iter().enumerate() {
            let at = self.survey.passes[before.path() * network.n_arms + of.entry as usize];
            self.counts[source].circulating += u64::from(passed(at));
        }
        if passed(self.survey.end_of_entry(before.path()))
            && let Some(Known { came, free }) = self.known[slot]
        {
            self.counts[own].delayed += 1;
            self.counts[own].delay += f64::from(STEP) * (f64::from(step) - f64::from(came) - f64::from(free));
        }
    }

    /// Counts who waits outside or is on an entry after the last step, `end`.
    fn count_unfinished(&mut self, run: &Run, end: u32) {
        for (counts, outside) in self.counts.iter_mut().zip(&self.outside) {
            outside.iter().for_each(|came| counts.add_unfinished(end - came));
        }
        for (slot, car) in run.cars.iter().enumerate().filter(|(_, car)| car.is_there()) {
            self.count_on_entry(slot, car, end);
        }
    }

    /// Counts what a car has lost until a step, if it is on an entry yet.
    fn count_on_entry(&mut self, slot: usize, car: &Car, step: u32) {
        if let Some(Known { came, free }) = self.known[slot]
            && car.front() <= self.survey.end_of_entry(car.path())
        {
            let source = self.survey.network.paths[car.path()].source as usize;
            self.counts[source].add_unfinished((step - came).saturating_sub(free));
        }
    }
}
