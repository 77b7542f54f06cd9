//! The entropy coefficient: fixed, or adapted until the policy has the entropy asked for.

use super::scalar::Scalar;
use crate::config::Entropy;

/// Adam's decay rates of the first and the second moment.
const DECAY: [f32; 2] = [0.9, 0.999];
/// Keeps Adam from dividing by 0.
const EPSILON: f32 = 1e-8;

/// The coefficient, kept as its logarithm so that it stays positive, and the state of D. Kingma and J. Ba's Adam (2015)
/// for that one number.
#[derive(Debug)]
pub(super) struct EntropyCoefficient {
    pub(super) log: Scalar,
    /// Entropy that it is adapted to (nat); none keeps it.
    target: Option<f32>,
    learning_rate: f32,
    pub(super) moments: [Scalar; 2],
    pub(super) n_updates: i32,
}

impl EntropyCoefficient {
    /// `scalar` puts a number where the learner is.
    pub(super) fn new(entropy: &Entropy, n_actions: usize, scalar: impl Fn(f32) -> Scalar) -> EntropyCoefficient {
        EntropyCoefficient {
            log: scalar((entropy.coefficient as f32).ln()),
            target: entropy.target_fraction.map(|fraction| fraction as f32 * (n_actions as f32).ln()),
            learning_rate: entropy.learning_rate as f32,
            moments: [0.0; 2].map(scalar),
            n_updates: 0,
        }
    }

    pub(super) fn value(&self) -> Scalar {
        self.log.exp()
    }

    /// Lowers the coefficient where the policy has more entropy than asked for, and raises it where it has less.
    pub(super) fn update(&mut self, entropy: &Scalar) {
        let Some(target) = self.target else { return };
        let gradient = self.value().times(&entropy.plus_number(-target));
        self.n_updates = self.n_updates.saturating_add(1);
        let given = [gradient.clone(), gradient.times(&gradient)];
        let [first, second] = std::array::from_fn(|n| {
            let decay = DECAY[n];
            self.moments[n] = self.moments[n].times_number(decay).plus(&given[n].times_number(1.0 - decay));
            self.moments[n].over_number(1.0 - decay.powi(self.n_updates))
        });
        self.log = self.log.minus(&first.times_number(self.learning_rate).over(&second.sqrt().plus_number(EPSILON)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coefficient(target_fraction: Option<f64>) -> EntropyCoefficient {
        let entropy = Entropy { in_target: true, target_fraction, coefficient: 0.1, learning_rate: 0.01 };
        EntropyCoefficient::new(&entropy, 9, Scalar::Host)
    }

    #[test]
    fn the_coefficient_rises_while_the_entropy_is_too_low_and_falls_while_it_is_too_high() {
        let mut coefficient = coefficient(Some(0.5));
        let target = 0.5 * 9f32.ln();
        coefficient.update(&Scalar::Host(target - 0.3));
        // Adam's first step is the learning rate itself whatever the gradient: the logarithm moves by 0.01.
        assert!((coefficient.value().read() - 0.1 * 0.01f32.exp()).abs() < 1e-6);
        for _ in 0..200 {
            coefficient.update(&Scalar::Host(target + 0.3));
        }
        assert!(coefficient.value().read() < 0.1);
    }

    #[test]
    fn a_fixed_coefficient_stays() {
        let mut coefficient = coefficient(None);
        coefficient.update(&Scalar::Host(0.0));
        assert!((coefficient.value().read() - 0.1).abs() < 1e-7);
    }
}
