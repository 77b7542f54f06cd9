use crate::episode::wilson;

use super::*;

/// A number of [0, 1) of its own for each counter.
fn uniform(experiment: u32, route: u32, episode: u32) -> f64 {
    f64::from(random::words(77, experiment, route, episode)[0]) / 4_294_967_296.0
}

/// Episodes of routes that differ: on each the policy arrives with a probability of its own, 0.72 in the mean.
fn clustered(experiment: u32, n_routes: u32) -> Vec<(u32, f64)> {
    let arrives = |route: u32| {
        move |episode: u32| {
            let probability = 0.44 + 0.56 * uniform(experiment, route, 1000);
            (route, f64::from(u8::from(uniform(experiment, route, episode) < probability)))
        }
    };
    (0..n_routes).flat_map(|route| (0..30).map(arrives(route))).collect()
}

fn of_experiment(experiment: u32, n_routes: u32) -> Cells {
    Cells::of_routes(clustered(experiment, n_routes).into_iter())
}

fn variance(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64
}

#[test]
fn the_variance_of_resampled_means_is_that_of_route_means_over_their_number() {
    let cells = of_experiment(0, 23);
    let means: Vec<f64> = cells.cells.iter().map(|cell| cell.sum / cell.n).collect();
    let expected = variance(&means) / 23.0;
    let found = variance(&resamples(&[(1.0, &cells)]));
    // A variance of 10,000 numbers is off by 1.4 % (one standard deviation).
    assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
    // Independent episodes would have less than a third of it.
    let mean = cells.mean().unwrap();
    assert!(3.0 * mean * (1.0 - mean) / 690.0 < found);
}

#[test]
fn the_variance_with_several_seeds_is_the_sum_of_that_over_seeds_and_that_over_routes() {
    let mut cells = Cells::new(8, 20);
    for (seed, route) in (0..8).flat_map(|seed| (0..20).map(move |route| (seed, route))) {
        cells.add(seed, route, uniform(1, seed as u32, 0) + uniform(2, route as u32, 0));
    }
    let of = |experiment: u32, n: u32| variance(&(0..n).map(|index| uniform(experiment, index, 0)).collect::<Vec<_>>());
    let expected = of(1, 8) / 8.0 + of(2, 20) / 20.0;
    let found = variance(&resamples(&[(1.0, &cells)]));
    assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
}

/// How many of `n` intervals hold the true mean.
fn coverage(n: u32, n_routes: u32, interval: impl Fn(&Cells) -> (f64, f64)) -> f64 {
    let holds = |&experiment: &u32| {
        let (low, high) = interval(&of_experiment(experiment, n_routes));
        low <= 0.72 && 0.72 <= high
    };
    (0..n).filter(holds).count() as f64 / f64::from(n)
}

#[test]
fn of_clustered_episodes_nineteen_in_twenty_intervals_over_routes_hold_the_mean_and_far_fewer_of_wilsons() {
    for n_routes in [10, 23] {
        let found = coverage(400, n_routes, |cells| cells.interval().unwrap());
        // 400 experiments give 0.95 to 0.011 (one standard deviation).
        assert!((0.92..=0.98).contains(&found), "{n_routes} routes: {found}");
    }
    let of_wilson = coverage(400, 23, |cells| wilson(cells.total().sum as usize, cells.episodes()));
    assert!(of_wilson < 0.8, "{of_wilson}");
}

#[test]
fn equal_figures_have_equal_intervals_on_any_number_of_threads() {
    let cells = of_experiment(3, 23);
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let one = alone.install(|| resamples(&[(1.0, &cells)]));
    let all = resamples(&[(1.0, &cells)]);
    assert!(one.len() == RESAMPLES && one.iter().zip(&all).all(|(one, other)| one.to_bits() == other.to_bits()));
    assert_eq!(cells.interval(), cells.interval());
}

#[test]
fn what_is_equal_on_every_route_has_an_interval_without_width_and_one_route_has_none() {
    let alike =
        |n_routes: u32| Cells::of_routes((0..30 * n_routes).map(|index| (index / 30, 0.1 * f64::from(index % 3))));
    let (low, high) = alike(23).interval().unwrap();
    assert!(low == high && (low - 0.1).abs() < 1e-12, "{low} {high}");
    assert_eq!(alike(1).interval(), None);
    assert_eq!((alike(0).interval(), alike(0).mean()), (None, None));
}

#[test]
fn of_few_seeds_the_interval_is_students_within_what_there_can_be() {
    // The first seed arrives on a part of the routes, the others on all but one and on all.
    let cells = |of_first: u32| {
        let mut cells = Cells::new(3, 20);
        for route in 0..20 {
            for (seed, arrives) in [route < of_first, route < 19, true].into_iter().enumerate() {
                cells.add(seed, route as usize, f64::from(u8::from(arrives)));
            }
        }
        cells
    };
    assert_eq!(cells(6).interval(), Some((0.0, 1.0)));
    // Both sides' seeds differ here: there is no more than all of them.
    let (low, high) = cells(20).interval_of_difference(&cells(6)).unwrap();
    assert!(-1.0 < low && low < 0.0 && high == 1.0, "{low} {high}");
    let close = cells(18);
    let (low, high) = close.interval().unwrap();
    // Of seeds alone it is 4.303 standard errors of three fractions, 0.9, 0.95 and 1; routes add to it.
    let mean = close.mean().unwrap();
    assert!(high == 1.0 && 4.3 * 0.05 / 3.0_f64.sqrt() < mean - low, "{low} {mean} {high}");
}

#[test]
fn a_paired_difference_is_known_better_than_either_mean() {
    let cells = of_experiment(5, 23);
    // The other arrives on two more episodes of every third route.
    let mut other = cells.clone();
    other.cells.iter_mut().step_by(3).for_each(|cell| cell.sum += 2.0);
    let (low, high) = other.interval_of_difference(&cells).unwrap();
    let (from, to) = cells.interval().unwrap();
    assert!(0.0 < low && low < 16.0 / 690.0 && 16.0 / 690.0 < high, "{low} {high}");
    assert!(4.0 * (high - low) < to - from, "{low} {high} {from} {to}");
    assert_eq!(cells.interval_of_difference(&cells), Some((0.0, 0.0)));
    let (back, forth) = cells.interval_of_difference(&other).unwrap();
    assert!((back + high).abs() < 1e-9 && (forth + low).abs() < 1e-9, "another order is another sign");
}

#[test]
fn tails_of_the_normal_distribution_are_the_published_ones() {
    for (x, tail) in [(0.0, 0.5), (1.0, 0.158_655), (1.959_964, 0.025), (3.0, 0.001_349_9)] {
        assert!((normal_tail(x) - tail).abs() < 2e-7 + 1e-6 * tail, "{x}: {}", normal_tail(x));
    }
}
