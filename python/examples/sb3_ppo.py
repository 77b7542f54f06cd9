"""PPO of Stable-Baselines3.

    python sb3_ppo.py --out sb3

Needs ``offtrack-sim`` and ``stable-baselines3`` (which brings torch). Writes ``sb3.zip``, which ``PPO.load`` reads;
``sb3.safetensors``, which ``offtrack evaluate --policy sb3.safetensors`` drives; and ``sb3.json`` with the curve and
the success on the test routes. Ctrl-C ends the training early; what was learned is kept.

``VecNormalize`` scales the rewards, which are -500 to +100; observations lie in -1..1 already. With its ``norm_obs``
the policy file would take over its statistics.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from results import about, prepare, write_json, written
from stable_baselines3 import PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

import offtrack_sim
from offtrack_sim import export
from offtrack_sim.sb3 import RoundaboutVecEnv


class Curve(BaseCallback):
    """Success of the training episodes since the last row, printed as it goes; ends the training after some minutes."""

    def __init__(self, minutes: float) -> None:
        super().__init__()
        self.seconds = 60 * minutes
        self.rows: list[dict[str, float]] = []
        self.successes: list[bool] = []
        self.last = (time.perf_counter(), 0)
        self.start = self.last[0]

    def _on_step(self) -> bool:
        self.successes += [info["is_success"] for info in self.locals["infos"] if "is_success" in info]
        return time.perf_counter() - self.start < self.seconds

    def _on_rollout_end(self) -> None:
        now, (before, steps) = time.perf_counter(), self.last
        # The time between two ends of rollouts holds an update too.
        row = {
            "env_steps": self.num_timesteps,
            "seconds": round(now - self.start, 2),
            "env_steps_per_second": round((self.num_timesteps - steps) / (now - before)),
            "success": round(float(np.mean(self.successes)), 4) if self.successes else 0.0,
        }
        self.rows.append(row)
        print("  ".join(f"{name} {value:,}" for name, value in row.items()), flush=True)
        self.successes, self.last = [], (now, self.num_timesteps)


def arguments(description: str, *, benchmark: str, steps: int, envs: int, out: str) -> argparse.ArgumentParser:
    """What the examples of this library have in common, with these defaults."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument(
        "--scenario", default=benchmark, help="benchmark to train on; its actions are those of --benchmark"
    )
    parser.add_argument("--benchmark", default=benchmark, help="benchmark whose test routes the policy is evaluated on")
    parser.add_argument("--steps", type=int, default=steps, help="env steps of all trucks together")
    parser.add_argument("--minutes", type=float, default=1e9, help="time after which training ends earlier [min]")
    parser.add_argument("--envs", type=int, default=envs, help="number of trucks")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--split", default="test", help="routes of the evaluation at the end: test, or train while choosing settings"
    )
    parser.add_argument("--out", type=Path, default=Path(out), help="files to write, without their endings")
    return parser


def trucks(args: argparse.Namespace, gamma: float) -> VecNormalize:
    """The trucks to learn on, with rewards that a critic can fit."""
    prepare(args)
    # Networks this small gain little from more threads, and wait for them on a busy machine.
    torch.set_num_threads(1)
    env = VecMonitor(RoundaboutVecEnv(args.scenario, args.envs, seed=args.seed))
    return VecNormalize(env, norm_obs=False, norm_reward=True, gamma=gamma)


def learn(example: str, model: BaseAlgorithm, curve: Curve, args: argparse.Namespace, settings: dict[str, Any]) -> None:
    """Trains, writes the model and the policy file, evaluates the policy once, and writes the results."""
    try:
        model.learn(args.steps, callback=curve)
    except KeyboardInterrupt:
        print("interrupted: what was learned is kept", flush=True)
    seconds = time.perf_counter() - curve.start

    file = written(args, ".safetensors")
    model.save(written(args, ".zip"))
    export.save(file, model, scenario=args.scenario)
    result = {
        "example": example,
        **about("numpy", "torch", "gymnasium", "stable-baselines3"),
        "settings": {name: str(value) if isinstance(value, Path) else value for name, value in vars(args).items()}
        | settings,
        "env_steps": model.num_timesteps,
        "seconds": round(seconds, 1),
        "env_steps_per_second": round(model.num_timesteps / seconds),
        "env_steps_per_second_median": float(np.median([row["env_steps_per_second"] for row in curve.rows] or [0])),
        "evaluation": offtrack_sim.evaluate(offtrack_sim.Policy.load(file), args.benchmark, split=args.split).as_dict(),
        "curve": curve.rows,
    }
    write_json(written(args, ".json"), result)
    found = result["evaluation"]
    print(f"{args.split} routes: {found['arrived']} of {found['episodes']} arrived, {found['success']:.1%}")
    print(f"wrote {file}, {written(args, '.zip')} and {written(args, '.json')}")


def main() -> None:
    args = arguments(
        "PPO of Stable-Baselines3", benchmark="attard2023", steps=3_000_000, envs=256, out="sb3"
    ).parse_args()
    settings = {
        "n_steps": 64,
        "batch_size": 2048,
        "n_epochs": 4,
        "gamma": 0.97,
        "gae_lambda": 0.95,
        "ent_coef": 0.005,
        "policy_kwargs": {"net_arch": [128, 128]},
    }
    env = trucks(args, settings["gamma"])
    # The learning rate falls to zero linearly.
    model = PPO("MlpPolicy", env, learning_rate=lambda left: 1e-3 * left, seed=args.seed, device="cpu", **settings)
    learn("sb3_ppo", model, Curve(args.minutes), args, settings)


if __name__ == "__main__":
    main()
