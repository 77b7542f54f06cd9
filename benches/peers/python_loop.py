"""Env steps per second of driving environments through one Python loop, in turns on the same machine.

The loop is `envs.step(actions)` of a vector environment with actions drawn beforehand, uniformly at random. A round
times every peer once; medians over the rounds are reported, and each peer's ratio to offtrack in the same round. What
a step is differs: the result says it of each, see README.md beside this file. A peer that cannot be made is reported
with the reason.
"""

import argparse
import datetime
import json
import os
import platform
import statistics
import subprocess
import sys
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import gymnasium
import numpy as np

CORES = os.cpu_count()


def offtrack(n_envs):
    import offtrack_sim

    envs = offtrack_sim.make_vec(num_envs=n_envs, autoreset_mode="same_step")
    envs.reset(seed=0)
    return envs


def highway(vectorised, n_envs):
    import highway_env

    gymnasium.register_envs(highway_env)
    gymnasium.logger.min_level = gymnasium.logger.ERROR
    envs = vectorised([lambda: gymnasium.make("roundabout-v0")] * n_envs)
    envs.reset(seed=0)
    return envs


def pool(n_envs):
    import envpool

    envs = envpool.make_gymnasium("Roundabout-v0", num_envs=n_envs, num_threads=CORES)
    envs.reset()
    return envs


def metadrive(n_envs):
    def make():
        from metadrive.envs.metadrive_env import MetaDriveEnv

        class Env(MetaDriveEnv):
            def reset(self, *, seed=None, options=None):
                return super().reset()

        config = dict(
            map="O", num_scenarios=1, traffic_density=0.0, use_render=False, log_level=50, discrete_action=True
        )
        return Env(config)

    envs = gymnasium.vector.AsyncVectorEnv([make] * n_envs)
    envs.reset(seed=0)
    return envs


# Name, package, number of environments, how they are made, simulated seconds a step, what a step is.
TRUCK = "a tractor-trailer for 0.1 s in two sub-steps, both bodies against the kerbs, 29 rays, 69 values"
CAR = (
    "a car among 4 others for 1 s in 15 sub-steps, a controller steers it; positions and speeds of 5 vehicles, no rays"
)
PEERS = [
    ("offtrack, vector environment", "offtrack_sim", 1024, lambda: offtrack(1024), 0.1, TRUCK),
    ("offtrack, vector environment", "offtrack_sim", 64, lambda: offtrack(64), 0.1, TRUCK),
    (
        "highway-env roundabout-v0, SyncVectorEnv",
        "highway_env",
        8,
        lambda: highway(gymnasium.vector.SyncVectorEnv, 8),
        1.0,
        CAR,
    ),
    (
        "highway-env roundabout-v0, AsyncVectorEnv",
        "highway_env",
        CORES,
        lambda: highway(gymnasium.vector.AsyncVectorEnv, CORES),
        1.0,
        CAR,
    ),
    ("EnvPool Roundabout-v0", "envpool", 64, lambda: pool(64), 1.0, CAR + "; in C++"),
    ("EnvPool Roundabout-v0", "envpool", 1024, lambda: pool(1024), 1.0, CAR + "; in C++"),
    (
        "MetaDrive, map O, AsyncVectorEnv",
        "metadrive-simulator",
        CORES,
        lambda: metadrive(CORES),
        0.1,
        "a car alone, 0.1 s in 5 sub-steps of a physics engine; 240 lidar rays",
    ),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=2.0, help="time for each peer and round [s]")
    parser.add_argument("--json", type=Path, help="write the result to this file")
    args = parser.parse_args()

    made, failed = [], []
    for peer in PEERS:
        try:
            made.append((peer, peer[3]()))
        except Exception as error:  # whatever a peer's own code raises
            failed.append(
                {"name": peer[0], "version": installed(peer[1]), "reason": f"{type(error).__name__}: {error}"[:300]}
            )
            print(f"{peer[0]}: cannot be made: {failed[-1]['reason']}", file=sys.stderr)
    rounds = []
    for number in range(args.rounds):
        rounds.append([timed(envs, peer[2], args.seconds) for peer, envs in made])
        print(f"round {number + 1} of {args.rounds}", file=sys.stderr)
    runs = []
    for index, (peer, _) in enumerate(made):
        name, package, n_envs, _, seconds, step = peer
        speeds = [found[index] for found in rounds]
        runs.append(
            {
                "name": name,
                "version": installed(package),
                "n_envs": n_envs,
                "step": step,
                "simulated_seconds_per_step": seconds,
                "env_steps_per_second": round(statistics.median(speeds)),
                "slowest_round": round(min(speeds)),
                "fastest_round": round(max(speeds)),
                "simulated_seconds_per_second": round(statistics.median(speeds) * seconds),
                "offtrack_is_faster": round(statistics.median(found[0] / found[index] for found in rounds), 2),
            }
        )
        speed, ratio = runs[-1]["env_steps_per_second"], runs[-1]["offtrack_is_faster"]
        print(f"{name}, {n_envs} environments: {speed} env steps/s; offtrack with 1,024 makes {ratio} times as many")
    result = {
        "machine": processor(),
        "cores": CORES,
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "commit": commit(),
        "python": platform.python_version(),
        "gymnasium": gymnasium.__version__,
        "rounds": args.rounds,
        "runs": runs,
        "could_not_be_made": failed,
    }
    if args.json:
        args.json.parent.mkdir(parents=True, exist_ok=True)
        args.json.write_text(json.dumps(result, indent=2) + "\n")


def timed(envs, n_envs, seconds):
    """Env steps a second of the loop."""
    space = getattr(envs, "single_action_space", None) or envs.action_space
    actions = np.random.default_rng(0).integers(0, space.n, (64, n_envs))
    step, start = 0, time.perf_counter()
    while (passed := time.perf_counter() - start) < seconds:
        envs.step(actions[step % 64])
        step += 1
    return step * n_envs / passed


def installed(package):
    try:
        return version(package.replace("_", "-"))
    except PackageNotFoundError:
        return None


def processor():
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor())


def commit():
    """The commit that the sources are at, with `-dirty` where they differ from it."""
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--abbrev=12"]
    said = subprocess.run(command, capture_output=True, text=True)
    return said.stdout.strip() if said.returncode == 0 else "unknown"


if __name__ == "__main__":
    main()
