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

import argparse
import time
from pathlib import Path

import numpy as np
import torch
from results import about, write_json
from sb3_ppo import Curve
from stable_baselines3 import SAC, TD3
from stable_baselines3.common.noise import NormalActionNoise, VectorizedActionNoise
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

import offtrack_sim
from offtrack_sim import export
from offtrack_sim.sb3 import RoundaboutVecEnv

#: Env steps between two rows of the curve.
ROW = 20_000


class OffPolicyCurve(Curve):
    """The same for learners whose rollouts are a step long."""

    def _on_rollout_end(self) -> None:
        if ROW <= self.num_timesteps - self.last[1]:
            super()._on_rollout_end()


def main() -> None:
    parser = argparse.ArgumentParser(
        description="SAC or TD3 of Stable-Baselines3", formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("--algorithm", choices=["sac", "td3"], default="sac")
    parser.add_argument("--scenario", default="attard2023-continuous", help="benchmark to train on")
    parser.add_argument(
        "--benchmark", default="attard2023-continuous", help="benchmark whose test routes the policy is evaluated on"
    )
    parser.add_argument("--steps", type=int, default=1_000_000, help="env steps of all trucks together")
    parser.add_argument("--minutes", type=float, default=1e9, help="time after which training ends earlier [min]")
    parser.add_argument("--envs", type=int, default=64, help="number of trucks")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--split", default="test", help="routes of the evaluation at the end: test, or train while choosing settings"
    )
    parser.add_argument("--out", type=Path, default=Path("sac"), help="files to write, without their endings")
    args = parser.parse_args()

    # Networks this small gain little from more threads, and wait for them on a busy machine.
    torch.set_num_threads(1)
    settings = {
        "learning_starts": 10_000,
        "batch_size": 512,
        "train_freq": 1,
        "gradient_steps": 4,
        "gamma": 0.97,
        "policy_kwargs": {"net_arch": [128, 128]},
    }
    env = VecMonitor(RoundaboutVecEnv(args.scenario, args.envs, seed=args.seed))
    env = VecNormalize(env, norm_obs=False, norm_reward=True, gamma=settings["gamma"])
    kind, more = (SAC, {}) if args.algorithm == "sac" else (TD3, {"action_noise": _noise(env)})
    model = kind("MlpPolicy", env, learning_rate=1e-3, seed=args.seed, device="cpu", **settings, **more)
    curve = OffPolicyCurve(args.minutes)
    try:
        model.learn(args.steps, callback=curve)
    except KeyboardInterrupt:
        print("interrupted: what was learned is kept", flush=True)
    seconds = time.perf_counter() - curve.start

    file = args.out.with_suffix(".safetensors")
    model.save(args.out.with_suffix(".zip"))
    export.save(file, model, scenario=args.scenario)
    result = {
        "example": f"sb3_{args.algorithm}",
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
    write_json(args.out.with_suffix(".json"), result)
    found = result["evaluation"]
    print(f"{args.split} routes: {found['arrived']} of {found['episodes']} arrived, {found['success']:.1%}")
    print(f"wrote {file}, {args.out.with_suffix('.zip')} and {args.out.with_suffix('.json')}")


def _noise(env: VecNormalize) -> VectorizedActionNoise:
    """What TD3 explores with: noise of its own for each truck."""
    n_commands = env.action_space.shape[0]
    return VectorizedActionNoise(NormalActionNoise(np.zeros(n_commands), np.full(n_commands, 0.2)), env.num_envs)


if __name__ == "__main__":
    main()
