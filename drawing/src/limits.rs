//! Where a path asks for more than the truck has: in words, as lines beside the path, as JSON.

use std::ops::Range;

use glam::DVec2;
use offtrack::layout::Rig;
use offtrack::vehicle::swept::{Demand, Limit};
use serde::Serialize;
use svg::node::element::{Circle, Group, Path};

use crate::legend::{Entry, Swatch};
use crate::view::{View, number};

/// Distance between the lines beside a path, and from the path to the first (px).
const BESIDE: f64 = 5.0;
/// Width of such a line (px).
const WIDTH: f64 = 3.0;

/// A limit of the truck beside what a path needs of it, in the limit's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Need {
    /// The limit.
    pub limit: Limit,
    /// What the truck has.
    pub has: f64,
    /// The most that the path needs.
    pub needs: f64,
    /// Index of the pose that needs most.
    worst: usize,
    /// Indices of the poses that need more than the truck has, in stretches.
    beyond: Vec<Range<usize>>,
}

/// A need as JSON has it.
#[derive(Serialize)]
pub(crate) struct WrittenNeed {
    limit: &'static str,
    unit: &'static str,
    has: f64,
    needs: f64,
    exceeded: bool,
    /// First and last station of each stretch where it is (m).
    stretches: Vec<[f64; 2]>,
}

impl Need {
    /// What these poses need of each limit.
    pub(crate) fn of_all(rig: &Rig, demands: &[Demand]) -> Vec<Need> {
        Limit::ALL.into_iter().map(|limit| Need::of(limit, rig, demands)).collect()
    }

    fn of(limit: Limit, rig: &Rig, demands: &[Demand]) -> Need {
        let mut need = Need { limit, has: limit.of(rig), needs: 0.0, worst: 0, beyond: Vec::new() };
        for (index, demanded) in demands.iter().map(|demand| limit.demanded(demand)).enumerate() {
            if need.needs < demanded {
                (need.needs, need.worst) = (demanded, index);
            }
            if need.has < demanded {
                match need.beyond.last_mut().filter(|stretch| stretch.end == index) {
                    Some(stretch) => stretch.end = index + 1,
                    None => need.beyond.push(index..index + 1),
                }
            }
        }
        need
    }

    /// Whether the path needs more than the truck has.
    pub fn is_exceeded(&self) -> bool {
        self.has < self.needs
    }

    /// "steer angle 35.6 of 28.4 deg".
    fn words(&self) -> String {
        let digits = if matches!(self.limit, Limit::Lock | Limit::SteerRate) { 1 } else { 2 };
        // What is exceeded by less than a digit shows must not look as if it were not.
        let digits =
            if self.is_exceeded() && self.needs - self.has < 0.5 * 10f64.powi(-digits) { digits + 2 } else { digits }
                as usize;
        let Need { needs, has, .. } = self;
        let words = format!("{} {needs:.digits$} of {has:.digits$} {}", self.limit.quantity(), self.limit.unit());
        words.trim_end().to_owned()
    }

    fn colour(&self) -> &'static str {
        // Of P. Tol's "muted" scheme: none is a colour of the map.
        match self.limit {
            Limit::Lock => "#882255",
            Limit::SteerRate => "#117733",
            Limit::Tyres => "#999933",
            Limit::Rollover => "#332288",
        }
    }

    pub(crate) fn written(&self, demands: &[Demand]) -> WrittenNeed {
        let Need { limit, has, needs, ref beyond, .. } = *self;
        let station = |index: usize| rounded(1e4, demands[index].station);
        WrittenNeed {
            limit: limit.name(),
            unit: limit.unit(),
            has: rounded(1e4, has),
            needs: rounded(1e4, needs),
            exceeded: self.is_exceeded(),
            stretches: beyond.iter().map(|stretch| [station(stretch.start), station(stretch.end - 1)]).collect(),
        }
    }
}

/// What is needed beyond the limits and what within them, in words.
pub(crate) fn words(needs: &[Need]) -> String {
    let (beyond, within): (Vec<&Need>, Vec<&Need>) = needs.iter().partition(|need| need.is_exceeded());
    let list = |needs: &[&Need]| needs.iter().map(|need| need.words()).collect::<Vec<_>>().join(", ");
    match (beyond.as_slice(), within.as_slice()) {
        ([], _) => format!("Within the truck's limits: {}.", list(&within)),
        (_, []) => format!("Too much for the truck: {}.", list(&beyond)),
        _ => format!("Too much for the truck: {}; within its limits: {}.", list(&beyond), list(&within)),
    }
}

/// Lines beside the path of the front axle, `front` at each pose, where limits are exceeded, and a dot where most is
/// needed.
pub(crate) fn lines(view: &View, needs: &[Need], front: &[DVec2]) -> Group {
    let mut group = Group::new();
    for (place, need) in needs.iter().filter(|need| need.is_exceeded()).enumerate() {
        let aside = (place + 1) as f64 * BESIDE;
        let points: Vec<DVec2> = front.iter().map(|&p| view.point(p)).collect();
        let beside = |index: usize| {
            let ahead = points[(index + 1).min(points.len() - 1)] - points[index.saturating_sub(1)];
            // The page's y points down: this is the path's right side.
            points[index] + aside * ahead.normalize_or_zero().perp()
        };
        for stretch in &need.beyond {
            // A stretch of one pose is as long as the way to its neighbours.
            let shown = stretch.start.saturating_sub(1)..(stretch.end + 1).min(points.len());
            let data: Vec<String> = shown.map(&beside).map(|p| format!("{} {}", number(p.x), number(p.y))).collect();
            let line =
                Path::new().set("d", format!("M{}", data.join("L"))).set("fill", "none").set("stroke", need.colour());
            group = group.add(line.set("stroke-width", WIDTH).set("stroke-linecap", "round"));
        }
        let worst = beside(need.worst);
        let dot =
            Circle::new().set("cx", number(worst.x)).set("cy", number(worst.y)).set("r", 5).set("fill", need.colour());
        group = group.add(dot.set("stroke", "white").set("stroke-width", 1.2));
    }
    group
}

/// The legend's lines for them.
pub(crate) fn legend(needs: &[Need]) -> impl Iterator<Item = Entry> {
    let words = |need: &Need| match need.limit {
        Limit::Lock => "beyond the lock (dot: worst)",
        Limit::SteerRate => "beyond the steer rate (dot: worst)",
        Limit::Tyres => "beyond the tyres' grip (dot: worst)",
        Limit::Rollover => "wheels lift (dot: worst)",
    };
    needs
        .iter()
        .filter(|need| need.is_exceeded())
        .map(move |need| Entry::new(Swatch::Line(need.colour(), WIDTH, ""), words(need)))
}

fn rounded(parts: f64, value: f64) -> f64 {
    (value * parts).round() / parts
}

/// What each pose needs, for JSON: station (m), steer angle (deg), steer rate [deg/s], lateral acceleration (g),
/// load transfer ratio; left positive.
pub(crate) fn rows(demands: &[Demand]) -> Vec<[f64; 5]> {
    let row = |demand: &Demand| {
        let Demand { station, steering, steer_rate, lateral_acceleration, load_transfer_ratio } = *demand;
        let lateral = lateral_acceleration / offtrack::vehicle::GRAVITY;
        [station, steering.to_degrees(), steer_rate.to_degrees(), lateral, load_transfer_ratio]
            .map(|value| rounded(1e4, value))
    };
    demands.iter().map(row).collect()
}
