"""A study in one file: any steer angle instead of nine, a reward of its own, distance sensors alone with four frames
stacked; PPO and SAC of Stable-Baselines3 with three seeds each; success with intervals, a table for a paper, a film.

    python study.py --out study

Needs ``offtrack-sim`` and ``stable-baselines3``. Every policy is a file that ``offtrack evaluate`` counts; ``offtrack
compare`` takes the seeds of each learner as one side, pairs episodes from the same starts, and writes the LaTeX table.
The sensors do not say which exit is asked for: ``--observe all`` gives the learner everything instead.
"""

import argparse
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from results import about, write_json
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnvWrapper, VecFrameStack, VecMonitor

import offtrack_sim
from offtrack_sim import export
from offtrack_sim.sb3 import RoundaboutVecEnv

FRAMES = 4
SENSORS = [values.name for values in offtrack_sim.OBSERVATION if values.name.endswith("range")]
#: What each learner is called and made with. Both see some 100 steps ahead.
LEARNERS: dict[str, tuple[type[BaseAlgorithm], int, dict[str, Any]]] = {
    "ppo": (PPO, 256, {"n_steps": 64, "batch_size": 2048, "n_epochs": 4, "gamma": 0.97, "ent_coef": 0.001}),
    "sac": (SAC, 64, {"batch_size": 256, "gamma": 0.97, "learning_starts": 20_000, "gradient_steps": 4}),
}


class Study(VecEnvWrapper):
    """The chosen values of the observation, and a reward of its own: progress, less leaving the lane and failing."""

    def __init__(self, trucks: RoundaboutVecEnv, names: list[str]) -> None:
        self.batch = trucks.batch
        groups = [values for values in offtrack_sim.OBSERVATION if values.name in names]
        self.rows = np.concatenate([np.arange(values.first, values.first + values.n) for values in groups])
        super().__init__(trucks, gymnasium.spaces.Box(-1.0, 1.0, (len(self.rows),), np.float32))

    def reset(self) -> Any:
        return self.venv.reset()[:, self.rows]

    def step_wait(self) -> Any:
        observations, _, dones, infos = self.venv.step_wait()
        terms = self.batch.columns("terms")["terms"]
        # `lane_distance` is a fraction of the benchmark's limit.
        rewards = terms["waypoints"] - 0.1 * terms["lane_distance"] - 10.0 * terms["failure"]
        for env in np.flatnonzero(dones):
            infos[env]["terminal_observation"] = infos[env]["terminal_observation"][self.rows]
        return observations[:, self.rows], rewards.astype(np.float32), dones, infos


class Clock(BaseCallback):
    """Ends a training after some minutes."""

    def __init__(self, minutes: float) -> None:
        super().__init__()
        self.end = time.perf_counter() + 60 * minutes

    def _on_step(self) -> bool:
        return time.perf_counter() < self.end


def offtrack(*arguments: object) -> None:
    """A command of the package."""
    command = [sys.executable, "-m", "offtrack_sim.command", *map(str, arguments)]
    subprocess.run(command, check=True)


def train(learner: str, seed: int, names: list[str], args: argparse.Namespace) -> int:
    """Trains a policy, writes it as a file and evaluates it; returns the env steps that it took."""
    kind, n_envs, settings = LEARNERS[learner]
    trucks = VecMonitor(Study(RoundaboutVecEnv(args.benchmark, n_envs, seed=seed), names))
    model = kind("MlpPolicy", VecFrameStack(trucks, FRAMES), seed=seed, device="cpu", **settings)  # type: ignore[arg-type]
    model.learn(args.steps, callback=Clock(args.minutes))
    file = args.out / learner / f"{seed}.safetensors"
    file.parent.mkdir(parents=True, exist_ok=True)
    export.save(file, model, scenario=args.benchmark, values=names)
    offtrack("evaluate", "--benchmark", args.benchmark, "--policy", file, "--json", file.with_suffix(".json"))
    return model.num_timesteps


def main() -> None:
    parser = argparse.ArgumentParser(description="PPO and SAC with continuous steering and stacked sensors")
    parser.add_argument("--benchmark", default="attard2023-continuous", help="a benchmark of continuous actions")
    parser.add_argument("--observe", choices=["sensors", "all"], default="sensors", help="what the learners see")
    parser.add_argument("--seeds", type=int, default=3, help="seeds of each learner")
    parser.add_argument("--steps", type=int, default=2_000_000, help="env steps of each training")
    parser.add_argument("--minutes", type=float, default=2.0, help="time after which a training ends earlier [min]")
    parser.add_argument("--film", default="40m/SW-right-1", help="route of the film")
    parser.add_argument("--out", type=Path, default=Path("study"), help="folder of all that is written")
    args = parser.parse_args()
    torch.set_num_threads(1)
    names = SENSORS if args.observe == "sensors" else [values.name for values in offtrack_sim.OBSERVATION]
    steps = {name: [train(name, seed, names, args) for seed in range(args.seeds)] for name in LEARNERS}
    table = args.out / "table.tex"
    sides = [args.out / name for name in LEARNERS]
    offtrack("compare", *sides, "--latex", table, "--json", args.out / "comparison.json")
    first = args.out / "ppo" / "0.safetensors"
    film = ["--benchmark", args.benchmark, "--policy", first, "--route", args.film, "-o", args.out / "film.gif"]
    offtrack("record", *film)
    about_it = about("numpy", "torch", "gymnasium", "stable-baselines3")
    settings = {name: str(value) for name, value in vars(args).items()}
    write_json(args.out / "study.json", {**about_it, "settings": settings, "env_steps": steps})
    print(f"wrote {table}, {args.out / 'film.gif'} and the policies")


if __name__ == "__main__":
    main()
