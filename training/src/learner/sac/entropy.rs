//! The weight of the entropy beside the reward: fixed, or led to where the policy has the entropy asked for.

use crate::learner::config::Entropy;

/// Adam's decay of the first and the second moment, and what keeps it from dividing by 0.
pub(super) const DECAY: [f32; 2] = [0.9, 0.999];
pub(super) const EPSILON: f32 = 1e-8;

/// The weight, kept as its logarithm so that it stays positive, and the state of D. Kingma and J. Ba's Adam (2015) for that one number.
#[derive(Debug)]
pub(super) struct EntropyWeight {
    pub(super) log_weight: f32,
    /// Entropy to be led to [nat]; none keeps the weight.
    pub(super) goal: Option<f32>,
    pub(super) rate: f32,
    pub(super) moments: [f32; 2],
    pub(super) updates: i32,
}

impl EntropyWeight {
    pub(super) fn new(entropy: &Entropy, n_actions: usize) -> EntropyWeight {
        EntropyWeight {
            log_weight: (entropy.weight as f32).ln(),
            goal: entropy.share.map(|share| share as f32 * (n_actions as f32).ln()),
            rate: entropy.rate as f32,
            moments: [0.0; 2],
            updates: 0,
        }
    }

    pub(super) fn value(&self) -> f32 {
        self.log_weight.exp()
    }

    /// Less weight where the policy has more entropy than asked for, and the other way about.
    pub(super) fn update(&mut self, entropy: f32) {
        let Some(goal) = self.goal else { return };
        let gradient = self.value() * (entropy - goal);
        self.updates = self.updates.saturating_add(1);
        let mut corrected = [gradient, gradient * gradient];
        for ((moment, value), decay) in self.moments.iter_mut().zip(&mut corrected).zip(DECAY) {
            *moment = decay * *moment + (1.0 - decay) * *value;
            *value = *moment / (1.0 - decay.powi(self.updates));
        }
        self.log_weight -= self.rate * corrected[0] / (corrected[1].sqrt() + EPSILON);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weight_rises_while_the_entropy_is_too_low_and_falls_while_it_is_too_high() {
        let mut weight = EntropyWeight::new(&Entropy { in_target: true, share: Some(0.5), weight: 0.1, rate: 0.01 }, 9);
        let goal = 0.5 * 9f32.ln();
        weight.update(goal - 0.3);
        // Adam's first step is the rate itself whatever the gradient: the logarithm moves by 0.01.
        assert!((weight.value() - 0.1 * 0.01f32.exp()).abs() < 1e-6);
        for _ in 0..200 {
            weight.update(goal + 0.3);
        }
        assert!(weight.value() < 0.1);
    }

    #[test]
    fn a_fixed_weight_stays() {
        let mut weight = EntropyWeight::new(&Entropy { in_target: true, share: None, weight: 0.1, rate: 0.01 }, 9);
        weight.update(0.0);
        assert!((weight.value() - 0.1).abs() < 1e-7);
    }
}
