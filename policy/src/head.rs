//! What a policy's last layer says: a value for each action of a table, or the commands themselves.

offtrack::named! {
    /// How an output becomes a command in -1..=1.
    pub enum Squash {
        /// By the hyperbolic tangent.
        Tanh = "tanh",
        /// By its nearest number in the range.
        Clip = "clip",
    }
}

/// What the outputs of a policy's last layer are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Head {
    /// A value for each action: the policy takes the action with the largest.
    #[default]
    Levels,
    /// A mean for each command: steer and, where a benchmark chooses speeds, speed. Squashed, -1 is the first of the
    /// policy's two actions and 1 the second, and between them a command is linear.
    Continuous {
        /// How a mean becomes a command.
        squash: Squash,
    },
}

impl Head {
    /// The name in a policy file.
    pub const fn name(self) -> &'static str {
        match self {
            Head::Levels => "levels",
            Head::Continuous { .. } => "continuous",
        }
    }

    /// The commands of outputs, each in -1..=1. Of levels there are none: the outputs stay as they are.
    pub fn commands(self, mut outputs: Vec<f32>) -> Vec<f32> {
        match self {
            Head::Levels => {}
            Head::Continuous { squash: Squash::Tanh } => outputs.iter_mut().for_each(|value| *value = value.tanh()),
            Head::Continuous { squash: Squash::Clip } => {
                outputs.iter_mut().for_each(|value| *value = value.clamp(-1.0, 1.0));
            }
        }
        outputs
    }
}
