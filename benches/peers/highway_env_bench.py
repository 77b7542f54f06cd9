"""Env steps per second of highway-env's `roundabout-v0` and of `offtrack scale`, in turn on the same machine.

A step differs between the two: the result says what it is in each, see README.md beside this file.
"""

import argparse
import datetime
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from functools import partial
from importlib.metadata import version
from pathlib import Path

import gymnasium
import highway_env
import numpy as np

gymnasium.register_envs(highway_env)
gymnasium.logger.min_level = (
    gymnasium.logger.ERROR
)  # it recommends roundabout-v1, which differs in which cars see each other

REPOSITORY = Path(__file__).resolve().parents[2]
WINDOW = 0.5  # s; other programs disturb some windows, not most
# The cheapest observation that is enough to drive: times to collision, by lane and speed, over the next seconds.
CHEAPEST = {"type": "TimeToCollision", "horizon": 5}
VARIANTS = [
    ("defaults", {}),
    ("cheapest observation", {"observation": CHEAPEST}),
    ("cheapest observation, one sub-step a step", {"observation": CHEAPEST, "policy_frequency": 15}),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seconds", type=float, default=10.0, help="time for each peer's run [s]")
    parser.add_argument(
        "--offtrack", type=Path, default=REPOSITORY / "target/release/offtrack", help="the program to compare with"
    )
    parser.add_argument("--envs", type=int, default=1024, help="trucks in the program's batch")
    parser.add_argument("--offtrack-seconds", type=float, default=5.0, help="time for the program's run [s]")
    parser.add_argument("--json", type=Path, help="write the result to this file")
    args = parser.parse_args()
    if not args.offtrack.is_file():
        sys.exit(f"--offtrack: {args.offtrack}; no such file: build it with `cargo build --release` or name another")

    ours = offtrack(args)
    runs = []
    for name, config in VARIANTS:
        runs.append(measured(name, config, Single(config), args.seconds))
        runs.append(measured(name, config, Vector(config, os.cpu_count()), args.seconds))
    for run in runs:
        run["offtrack_is_faster"] = round(ours["env_steps_per_second"] / run["env_steps_per_second"])
        run["offtrack_simulates_faster"] = round(
            ours["simulated_seconds_per_second"] / run["simulated_seconds_per_second"]
        )

    result = {
        "machine": machine(),
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "versions": {
            "python": platform.python_version(),
            **{package: version(package) for package in ("highway-env", "gymnasium", "numpy")},
        },
        "commit": ours["commit"],
        "offtrack": ours,
        "peer_step": "1 / policy_frequency s in simulation_frequency / policy_frequency sub-steps: one car driven, 4 "
        "others simulated; random actions from an array; a new episode where one ended",
        "runs": runs,
    }
    show(result)
    if args.json:
        args.json.write_text(json.dumps(result, indent=2) + "\n")


def offtrack(args):
    """One run of `offtrack scale`, and what its step is."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scale.json"
        command = [
            args.offtrack,
            "scale",
            "--envs",
            str(args.envs),
            "--seconds",
            str(args.offtrack_seconds),
            "--json",
            file,
        ]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, cwd=REPOSITORY)
        scale = json.loads(file.read_text())
    run, step = scale["runs"][0], scale["step"]
    speed = run["env_steps_per_second"]
    return {
        "commit": scale["commit"],
        "benchmark": scale["benchmark"],
        "engine": scale["engine"],
        "threads": scale["threads"],
        "envs": run["envs"],
        "env_steps_per_second": speed,
        "simulated_seconds_per_second": round(speed * step["dt"]),
        "step": f"{step['dt']} s in {step['substeps']} sub-steps: one tractor and its trailer, {step['rays']} distance "
        f"sensors, {step['values']} observed values; random actions drawn inside; a new episode where one ended",
    }


def made(config):
    """One of the peer's environments, without the checks that Gymnasium adds to each step by default."""
    return gymnasium.make("roundabout-v0", config=config, disable_env_checker=True)


class Single:
    """One environment, stepped in a loop in this process."""

    def __init__(self, config):
        self.env = made(config)
        self.env.reset(seed=0)
        self.envs = 1
        self.actions = np.random.default_rng(0).integers(self.env.action_space.n, size=4096).tolist()

    def step(self, n):
        _, _, terminated, truncated, _ = self.env.step(self.actions[n % len(self.actions)])
        if terminated or truncated:
            self.env.reset()


class Vector:
    """Gymnasium's vector environment, a worker process each."""

    def __init__(self, config, envs):
        self.env = gymnasium.vector.AsyncVectorEnv([partial(made, config)] * envs)
        self.env.reset(seed=0)
        self.envs = envs
        self.actions = np.random.default_rng(0).integers(self.env.single_action_space.n, size=(4096, envs))

    def step(self, n):
        self.env.step(self.actions[n % len(self.actions)])


def measured(name, config, peer, seconds):
    """The median over windows of half a second, after one window of warm-up."""
    speeds, n = [], 0
    begun = time.perf_counter()
    while len(speeds) < 4 or time.perf_counter() - begun < seconds:
        window, first = time.perf_counter(), n
        while time.perf_counter() - window < WINDOW:
            peer.step(n)
            n += 1
        speeds.append((n - first) * peer.envs / (time.perf_counter() - window))
    peer.env.close()
    full = made(config).unwrapped.config
    speed = statistics.median(speeds[1:])
    return {
        "peer": "highway-env roundabout-v0",
        "variant": name,
        "observation": full["observation"]["type"],
        "stepped": "in a loop" if peer.envs == 1 else "gymnasium AsyncVectorEnv",
        "envs": peer.envs,
        "policy_frequency": full["policy_frequency"],
        "simulation_frequency": full["simulation_frequency"],
        "env_steps_per_second": round(speed, 1),
        "simulated_seconds_per_second": round(speed / full["policy_frequency"], 1),
        "windows": len(speeds) - 1,
    }


def machine():
    """The processor's name and number of cores."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        name = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.processor() or platform.machine()
    return f"{name}, {os.cpu_count()} cores"


def show(result):
    ours = result["offtrack"]
    print(result["machine"])
    print(
        f"offtrack, {ours['envs']} trucks, {ours['threads']} threads: {ours['env_steps_per_second']:,.0f} env steps/s"
    )
    print(f"  a step is {ours['step']}")
    print("highway-env roundabout-v0")
    print(f"  a step is {result['peer_step']}")
    print(f"{'':50}{'envs':>5}{'env steps/s':>14}{'offtrack':>12}{'simulated s/s':>16}{'offtrack':>12}")
    for run in result["runs"]:
        print(
            f"  {run['variant']:48}{run['envs']:5}{run['env_steps_per_second']:14,.0f}{run['offtrack_is_faster']:10,} x"
            f"{run['simulated_seconds_per_second']:16,.0f}{run['offtrack_simulates_faster']:10,} x"
        )


if __name__ == "__main__":
    main()
