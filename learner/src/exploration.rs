//! Epsilon-greedy exploration: random actions replace some of the policy's. Their fraction falls over time and differs
//! between trucks.

use rand::Rng;

use crate::config::Exploration;

impl Exploration {
    /// Fraction of random actions of truck `env`, when all `n_envs` trucks together have made `env_steps`.
    ///
    /// A fraction per truck follows D. Horgan and others ("Distributed Prioritized Experience Replay", 2018).
    pub fn fraction(&self, env_steps: u64, env: usize, n_envs: usize) -> f64 {
        let progress = (env_steps as f64 / self.steps as f64).min(1.0);
        let common = self.initial_fraction + progress * (self.final_fraction - self.initial_fraction);
        common.powf(1.0 + self.spread * env as f64 / (n_envs - 1).max(1) as f64)
    }

    /// Replaces some of the `actions`, `[n_envs]`, by random ones of `n_actions`.
    pub fn explore(&self, env_steps: u64, n_actions: usize, actions: &mut [u32], rng: &mut impl Rng) {
        let n_envs = actions.len();
        for (env, action) in actions.iter_mut().enumerate() {
            if rng.random_bool(self.fraction(env_steps, env, n_envs)) {
                *action = rng.random_range(0..n_actions as u32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand::rngs::SmallRng;

    #[test]
    fn the_fraction_falls_to_its_final_value_and_spreads_over_the_trucks() {
        let exploration = Exploration { initial_fraction: 1.0, final_fraction: 0.25, steps: 100, spread: 2.0 };
        assert_eq!([0, 50, 100, 1000].map(|steps| exploration.fraction(steps, 0, 3)), [1.0, 0.625, 0.25, 0.25]);
        assert_eq!([0, 1, 2].map(|env| exploration.fraction(100, env, 3)), [0.25, 0.0625, 0.015625]);
        assert_eq!(exploration.fraction(100, 0, 1), 0.25);
    }

    #[test]
    fn that_fraction_of_the_actions_is_replaced_by_random_ones() {
        let exploration = Exploration { initial_fraction: 0.5, final_fraction: 0.5, steps: 1, spread: 0.0 };
        let mut actions = vec![9; 40_000];
        exploration.explore(0, 4, &mut actions, &mut SmallRng::seed_from_u64(1));
        let count = |action: u32| actions.iter().filter(|&&found| found == action).count() as f64;
        // Half stays; a quarter of the rest each. The standard deviations of such counts are 100 and 70.
        assert!((count(9) - 20_000.0).abs() < 500.0);
        assert!((0..4).all(|action| (count(action) - 5_000.0).abs() < 350.0));
    }
}
