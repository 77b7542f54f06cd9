//! The entropy coefficient: fixed, or adapted until the policy has the entropy asked for.

use crate::adam::DECAY;
use crate::config::Entropy;

/// Keeps Adam from dividing by 0.
pub(super) const EPSILON: f32 = 1e-8;

/// The coefficient, kept as its logarithm so that it stays positive, and the state of D. Kingma and J. Ba's Adam (2015)
/// for that one number.
#[derive(Debug)]
pub(super) struct EntropyCoefficient {
    pub(super) log: f32,
    /// Entropy that it is adapted to (nat); none keeps it.
    pub(super) target: Option<f32>,
    pub(super) learning_rate: f32,
    pub(super) moments: [f32; 2],
    pub(super) n_updates: i32,
}

impl EntropyCoefficient {
    pub(super) fn new(entropy: &Entropy, n_actions: usize) -> EntropyCoefficient {
        EntropyCoefficient {
            log: (entropy.coefficient as f32).ln(),
            target: entropy.target_fraction.map(|fraction| fraction as f32 * (n_actions as f32).ln()),
            learning_rate: entropy.learning_rate as f32,
            moments: [0.0; 2],
            n_updates: 0,
        }
    }

    pub(super) fn value(&self) -> f32 {
        self.log.exp()
    }

    /// Lowers the coefficient where the policy has more entropy than asked for, and raises it where it has less.
    pub(super) fn update(&mut self, entropy: f32) {
        let Some(target) = self.target else { return };
        let gradient = self.value() * (entropy + -target);
        self.n_updates = self.n_updates.saturating_add(1);
        let given = [gradient, gradient * gradient];
        let [first, second] = std::array::from_fn(|n| {
            let decay = DECAY[n];
            self.moments[n] = self.moments[n] * decay + given[n] * (1.0 - decay);
            self.moments[n] / (1.0 - decay.powi(self.n_updates))
        });
        self.log -= first * self.learning_rate / (second.sqrt() + EPSILON);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coefficient(target_fraction: Option<f64>) -> EntropyCoefficient {
        let entropy = Entropy { in_target: true, target_fraction, coefficient: 0.1, learning_rate: 0.01 };
        EntropyCoefficient::new(&entropy, 9)
    }

    #[test]
    fn the_coefficient_rises_while_the_entropy_is_too_low_and_falls_while_it_is_too_high() {
        let mut coefficient = coefficient(Some(0.5));
        let target = 0.5 * 9f32.ln();
        coefficient.update(target - 0.3);
        // Adam's first step is the learning rate itself whatever the gradient: the logarithm moves by 0.01.
        assert!((coefficient.value() - 0.1 * 0.01f32.exp()).abs() < 1e-6);
        for _ in 0..200 {
            coefficient.update(target + 0.3);
        }
        assert!(coefficient.value() < 0.1);
    }

    #[test]
    fn a_fixed_coefficient_stays() {
        let mut coefficient = coefficient(None);
        coefficient.update(0.0);
        assert!((coefficient.value() - 0.1).abs() < 1e-7);
    }
}
