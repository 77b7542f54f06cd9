//! Observations of the last steps, side by side, for a policy that sees several.

offtrack::named! {
    /// What stands in place of the frames before an episode's first one.
    #[derive(Default)]
    pub enum Padding {
        /// Zeros, as in Stable-Baselines3's `VecFrameStack`.
        #[default]
        Zero = "zero",
        /// The first frame again, as in Gymnasium's `FrameStackObservation`.
        Reset = "reset",
    }
}

/// How many frames a policy sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frames {
    /// Their number, the last step's among them: 1 for a policy that sees no others.
    pub n: usize,
    /// What stands before an episode's first one.
    pub padding: Padding,
}

impl Default for Frames {
    fn default() -> Frames {
        Frames { n: 1, padding: Padding::Zero }
    }
}

impl Frames {
    /// Adds a truck's newest frame behind the others, which move up by one: the oldest goes. `stack` is
    /// `[frames * values]`, oldest first. Where an episode `begins`, what was there goes too.
    ///
    /// # Panics
    ///
    /// Where a frame is longer than the stack.
    pub fn push(self, stack: &mut [f32], frame: &[f32], begins: bool) {
        let newest = stack.len() - frame.len();
        match (begins, self.padding) {
            (false, _) => stack.copy_within(frame.len().., 0),
            (true, Padding::Zero) => stack.fill(0.0),
            (true, Padding::Reset) => stack.chunks_exact_mut(frame.len()).for_each(|old| old.copy_from_slice(frame)),
        }
        stack[newest..].copy_from_slice(frame);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_stand_oldest_first_and_before_the_first_one_there_are_zeros_or_itself() {
        let mut stack = [9.0; 6];
        let mut after = |padding, value: f32, begins| {
            Frames { n: 3, padding }.push(&mut stack, &[value, -value], begins);
            stack
        };
        assert_eq!(after(Padding::Zero, 1.0, true), [0.0, 0.0, 0.0, 0.0, 1.0, -1.0]);
        assert_eq!(after(Padding::Zero, 2.0, false), [0.0, 0.0, 1.0, -1.0, 2.0, -2.0]);
        assert_eq!(after(Padding::Zero, 3.0, false), [1.0, -1.0, 2.0, -2.0, 3.0, -3.0]);
        assert_eq!(after(Padding::Zero, 4.0, false), [2.0, -2.0, 3.0, -3.0, 4.0, -4.0]);
        assert_eq!(after(Padding::Reset, 5.0, true), [5.0, -5.0, 5.0, -5.0, 5.0, -5.0]);
        assert_eq!(after(Padding::Reset, 6.0, false), [5.0, -5.0, 5.0, -5.0, 6.0, -6.0]);
    }
}
