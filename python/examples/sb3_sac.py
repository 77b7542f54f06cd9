"""SAC or TD3 of Stable-Baselines3, which steer by any angle.

    python sb3_sac.py --algorithm sac --out sac

Needs ``offtrack-sim`` and ``stable-baselines3`` (which brings torch). Writes ``sac.zip``, which ``SAC.load`` reads;
``sac.safetensors``, which ``offtrack evaluate --benchmark attard2023-continuous --policy sac.safetensors`` drives; and
``sac.json`` with the curve and the success on the test routes. Ctrl-C ends the training early; what was learned is
kept.

Both learn from a replay buffer: a transition is used many times, so of the trucks' steps far fewer are needed than by
PPO, and each costs more. Rewards are scaled by ``VecNormalize``, -500 to +100 being more than a critic fits.
"""

from __future__ import annotations

import numpy as np
from sb3_ppo import Curve, arguments, learn, trucks
from stable_baselines3 import SAC, TD3
from stable_baselines3.common.noise import NormalActionNoise, VectorizedActionNoise
from stable_baselines3.common.vec_env import VecNormalize

#: Env steps between two rows of the curve.
ROW = 20_000
#: Settings of all that learn from a replay buffer.
SETTINGS = {
    "learning_starts": 10_000,
    "batch_size": 512,
    "train_freq": 1,
    "gradient_steps": 4,
    "gamma": 0.97,
    "policy_kwargs": {"net_arch": [128, 128]},
}


class OffPolicyCurve(Curve):
    """The same for learners whose rollouts are a step long."""

    def _on_rollout_end(self) -> None:
        if ROW <= self.num_timesteps - self.last[1]:
            super()._on_rollout_end()


def main() -> None:
    benchmark = "attard2023-continuous"
    parser = arguments("SAC or TD3 of Stable-Baselines3", benchmark=benchmark, steps=1_000_000, envs=64, out="sac")
    parser.add_argument("--algorithm", choices=["sac", "td3"], default="sac")
    args = parser.parse_args()
    env = trucks(args, SETTINGS["gamma"])
    kind, more = (SAC, {}) if args.algorithm == "sac" else (TD3, {"action_noise": _noise(env)})
    model = kind("MlpPolicy", env, learning_rate=1e-3, seed=args.seed, device="cpu", **SETTINGS, **more)
    learn(f"sb3_{args.algorithm}", model, OffPolicyCurve(args.minutes), args, SETTINGS)


def _noise(env: VecNormalize) -> VectorizedActionNoise:
    """What TD3 explores with: noise of its own for each truck."""
    n_commands = env.action_space.shape[0]
    return VectorizedActionNoise(NormalActionNoise(np.zeros(n_commands), np.full(n_commands, 0.2)), env.num_envs)


if __name__ == "__main__":
    main()
