"""DQN of Stable-Baselines3, by the nine steer angles.

    python sb3_dqn.py --out dqn

Needs ``offtrack-sim`` and ``stable-baselines3`` (which brings torch). Writes ``dqn.zip``, which ``DQN.load`` reads;
``dqn.safetensors``, which ``offtrack evaluate --policy dqn.safetensors`` drives; and ``dqn.json`` with the curve and
the success on the test routes. Ctrl-C ends the training early; what was learned is kept.

Exploration falls from random actions to 2 % of them within the first third of the steps.
"""

from __future__ import annotations

from sb3_ppo import arguments, learn, trucks
from sb3_sac import SETTINGS, OffPolicyCurve
from stable_baselines3 import DQN


def main() -> None:
    args = arguments(
        "DQN of Stable-Baselines3", benchmark="attard2023", steps=1_000_000, envs=64, out="dqn"
    ).parse_args()
    settings = {
        **SETTINGS,
        "target_update_interval": 1_000,
        "exploration_fraction": 0.33,
        "exploration_final_eps": 0.02,
    }
    env = trucks(args, settings["gamma"])
    model = DQN("MlpPolicy", env, learning_rate=1e-3, seed=args.seed, device="cpu", **settings)
    learn("sb3_dqn", model, OffPolicyCurve(args.minutes), args, settings)


if __name__ == "__main__":
    main()
