//! Tables that are kept in a cache, by the lines that they were baked from.

use bytemuck::{bytes_of, cast_slice, pod_collect_to_vec};

use super::{Error, Network};
use crate::files::cache::Cache;
use crate::map::Road;

/// Counted up whenever the same lines give other tables, so that older entries are not used.
const FORM: u32 = 4;

impl Network {
    /// What [`Network::bake`] gives, [with large vehicles](Network::with_large) if there are some, from the cache if it
    /// was kept there before; else it is kept now.
    ///
    /// # Errors
    ///
    /// Those of [`Network::bake`].
    pub fn cached(road: &Road, has_large: bool, cache: Option<&Cache>) -> Result<Network, Error> {
        let baked = || {
            let network = Network::bake(road)?;
            if has_large { network.with_large(road) } else { Ok(network) }
        };
        let Some(cache) = cache else { return baked() };
        let (key, folder) = (key(road), if has_large { "traffic-large" } else { "traffic" });
        let kept = cache.get(folder, &key).filter(|bytes| bytes.len().is_multiple_of(4));
        if let Some(network) = kept.and_then(|bytes| Network::parsed(&pod_collect_to_vec::<u8, u32>(&bytes))) {
            return Ok(network);
        }
        let network = baked()?;
        cache.put(folder, &key, cast_slice(&network.words()));
        Ok(network)
    }
}

/// Everything that the tables are computed from.
fn key(road: &Road) -> Vec<u8> {
    let ground = road.ground();
    let mut key = bytes_of(&FORM).to_vec();
    let mut add = |numbers: &[f64]| key.extend_from_slice(cast_slice(numbers));
    add(&[ground.outer_radius, f64::from(u8::from(road.has_ring())), ground.arms.len() as f64]);
    for line in &ground.lines {
        add(&[line.entry as f64, line.lane.index() as f64, line.exit.into(), line.exit_arm as f64]);
        add(&line.line.numbers());
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kept_tables_are_the_baked_ones_and_another_road_has_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path());
        for name in ["16m", "20m"] {
            let road = Road::named(name).unwrap();
            let baked = Network::bake(&road).unwrap();
            assert_eq!(Network::cached(&road, false, Some(&cache)).unwrap(), baked);
            assert_eq!(Network::cached(&road, false, Some(&cache)).unwrap(), baked);
            assert_eq!(Network::cached(&road, false, None).unwrap(), baked);
            let large = Network::cached(&road, true, Some(&cache)).unwrap();
            assert!(large.large.is_some() && large == Network::cached(&road, true, Some(&cache)).unwrap());
            let kept = cache.get("traffic", &key(&road)).unwrap();
            assert_eq!(Network::parsed(&pod_collect_to_vec::<u8, u32>(&kept)), Some(baked));
        }
        assert_eq!(folder.path().read_dir().unwrap().count(), 4);
    }

    #[test]
    fn words_that_are_no_tables_are_refused() {
        let network = Network::bake(&Road::named("16m").unwrap()).unwrap();
        let words = network.words();
        assert_eq!(Network::parsed(&words).as_ref(), Some(&network));
        assert_eq!(Network::parsed(&words[..words.len() - 1]), None);
        assert_eq!(Network::parsed(&[&words[..], &[0]].concat()), None);
        // A word of the head, the first path's samples, its source.
        for (at, value) in [(0, 2), (1, u32::MAX), (2, u32::MAX), (6, u32::MAX), (7, 1), (11, 99)] {
            let mut changed = words.clone();
            changed[at] = value;
            assert_eq!(Network::parsed(&changed), None, "word {at}");
        }
    }
}
