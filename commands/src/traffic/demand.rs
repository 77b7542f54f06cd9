//! A demand as the flag has it: of the whole road, of arms, or from arm to arm.

use std::collections::HashSet;

use offtrack::traffic::demand::{MOST, share};
use offtrack::traffic::{Demand, Mix};
use offtrack_evaluation::error::Error;

use super::{Place, setting};

impl Place {
    /// The demand that the flag asks for, and its flow by path (veh/h).
    pub(super) fn demand(&self, text: &str, mix: Mix) -> Result<(Demand, Vec<f64>), Error> {
        let flows = match text.parse() {
            Ok(total) if !(0.0..=MOST).contains(&total) => return Err(self.beyond(text, text)),
            Ok(total) => Demand::even(&self.network, total),
            Err(_) => self.by_arm(text)?,
        };
        let demand = Demand::new(&self.network, &flows, mix)
            .map_err(|error| setting("--demand", text, &format!("{}: {error}", self.road.name)))?;
        Ok((demand, flows))
    }

    /// Flows by path of a list of N=400 and N-E=120.
    fn by_arm(&self, text: &str) -> Result<Vec<f64>, Error> {
        let arms: Vec<&str> = self.road.arms().collect();
        let mut flows = vec![0.0; self.network.paths.len()];
        let mut seen = HashSet::new();
        for item in text.split(',') {
            let known = item.split_once('=').and_then(|(key, flow)| Some((key, flow.parse::<f64>().ok()?)));
            let Some((key, flow)) = known else { return Err(self.unknown(text, item)) };
            if !seen.insert(key) {
                return Err(setting("--demand", text, &format!("`{key}` is given twice on {}", self.road.name)));
            }
            if !(0.0..=MOST).contains(&flow) {
                return Err(self.beyond(text, item));
            }
            let mut has_path = false;
            for (from, entry) in arms.iter().enumerate() {
                let whole = *entry == key;
                let to = arms.iter().position(|exit| format!("{entry}-{exit}") == key);
                if whole || to.is_some() {
                    let of: Vec<(usize, f64)> = self.weights(from, to);
                    let all: f64 = of.iter().map(|(_, weight)| weight).sum();
                    of.iter().for_each(|&(path, weight)| flows[path] += flow * weight / all);
                    has_path |= !of.is_empty();
                }
            }
            if !has_path {
                return Err(self.unknown(text, item));
            }
        }
        Ok(flows)
    }

    /// Paths from an arm, to another or to all, and their parts of the flow.
    fn weights(&self, from: usize, to: Option<usize>) -> Vec<(usize, f64)> {
        let network = &self.network;
        let of = |&path: &usize| {
            network.source_of(path).entry as usize == from
                && to.is_none_or(|to| network.paths[path].exit_arm as usize == to)
        };
        let weight = |path: usize| if to.is_some() { 1.0 } else { share(network, path) };
        (0..network.paths.len()).filter(of).map(|path| (path, weight(path))).collect()
    }

    fn beyond(&self, text: &str, item: &str) -> Error {
        setting("--demand", text, &format!("`{item}` of {} must lie in 0..{MOST} cars an hour", self.road.name))
    }

    fn unknown(&self, text: &str, item: &str) -> Error {
        let arms: Vec<&str> = self.road.arms().collect();
        let expected = format!(
            "`{item}` of {} must be cars an hour, or ARM=V or ARM-ARM=V where a route leads; its arms are {}",
            self.road.name,
            arms.join(", ")
        );
        setting("--demand", text, &expected)
    }
}

#[cfg(test)]
mod tests {
    use offtrack::map::Road;

    use super::*;

    #[test]
    fn a_demand_is_a_total_or_flows_of_arms_and_from_arm_to_arm() {
        let place = Place::new(Road::named("16m").unwrap(), Mix::default()).unwrap();
        let of = |text: &str| place.demand(text, Mix::default()).map(|(_, flows)| flows);
        let from = |flows: &[f64], arm: usize| -> f64 {
            let paths = (0..flows.len()).filter(|&path| place.network.source_of(path).entry as usize == arm);
            paths.map(|path| flows[path]).sum()
        };
        let arms: Vec<&str> = place.road.arms().collect();
        let (first, second) = (arms[0], arms[1]);
        let total = of("1200").unwrap();
        assert!((0..arms.len()).all(|arm| (from(&total, arm) - 1200.0 / arms.len() as f64).abs() < 1e-9));
        let flows = of(&format!("{first}=300,{second}-{first}=120")).unwrap();
        assert!((from(&flows, 0) - 300.0).abs() < 1e-9 && (from(&flows, 1) - 120.0).abs() < 1e-9);
        let leads_elsewhere = |path: usize| {
            place.network.source_of(path).entry == 1 && place.network.paths[path].exit_arm != 0 && 0.0 < flows[path]
        };
        assert!(!(0..flows.len()).any(leads_elsewhere));
        for wrong in ["", "N", "X=3", "N=x", "-5", "1e9", "N=1e9", "N=10,N=20"] {
            let message = of(wrong).unwrap_err().to_string();
            assert!(message.starts_with(&format!("--demand: {wrong}; ")) && message.contains("16m"), "{message}");
        }
    }
}
