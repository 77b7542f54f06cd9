#!/usr/bin/env python3
"""Times the vector environment of Python against the native program, in turns on the same machine.

A round is one run of `offtrack scale` and one of each loop in Python; a ratio is Python's speed over the native one of
the same round, and the median of the rounds is reported: load from other programs changes more slowly than the rounds.
Beside it stands the ratio of each one's fastest window of a quarter of a second, which other programs disturb least. A
step is 0.1 s of every truck: two physics sub-steps, 29 rays, 69 values, reward, another episode in the same step
where one ended; actions are drawn uniformly at random, for Python beforehand. Needs the package offtrack_sim.

    python3 benches/python_speed.py --offtrack target/release/offtrack --json docs/results/python-speed.json
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import gymnasium
import numpy

import offtrack_sim

REPOSITORY = Path(__file__).resolve().parents[1]
# The window of `offtrack scale` [s].
WINDOW = 0.25


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--offtrack", type=Path, default=REPOSITORY / "target/release/offtrack", help="the program")
    parser.add_argument("--envs", default="64,1024,4096", help="numbers of trucks, separated by commas")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--seconds", type=float, default=2.0, help="time for each loop and round [s]")
    parser.add_argument("--json", type=Path, help="write the result to this file")
    args = parser.parse_args()
    if not args.offtrack.is_file():
        sys.exit(f"--offtrack: {args.offtrack}; no such file: build it with `cargo build --release` or name another")

    sizes = []
    for n_envs in map(int, args.envs.split(",")):
        loops = {
            "vector": vector(n_envs),
            "vector_without_copies": vector(n_envs, copy=False),
            "batch_step_into": batch(n_envs),
            "batch_step_at_random": at_random(n_envs),
        }
        rounds = []
        for number in range(args.rounds):
            machine, native = scaled(args, n_envs)
            rounds.append(
                {"native": native, **{name: timed(loop, n_envs, args.seconds) for name, loop in loops.items()}}
            )
            print(f"{n_envs} trucks, round {number + 1} of {args.rounds}", file=sys.stderr)
        medians = {name: statistics.median(found[name]["median"] for found in rounds) for name in rounds[0]}
        fastest = {name: max(found[name]["fastest"] for found in rounds) for name in rounds[0]}
        ratios = {
            name: statistics.median(found[name]["median"] / found["native"]["median"] for found in rounds)
            for name in loops
        }
        of_fastest = {name: fastest[name] / fastest["native"] for name in loops}
        sizes.append(
            {
                "n_envs": n_envs,
                "env_steps_per_second": medians,
                "fastest_window": fastest,
                "ratio": ratios,
                "ratio_of_fastest": of_fastest,
                "rounds": rounds,
            }
        )
        shown = ", ".join(f"{name} {ratios[name]:.1%} ({of_fastest[name]:.1%})" for name in loops)
        print(f"{n_envs} trucks: native {medians['native'] / 1e3:.0f} k env steps/s; {shown}")
    if args.json:
        result = {
            **machine,
            "versions": {
                "python": sys.version.split()[0],
                "gymnasium": gymnasium.__version__,
                "numpy": numpy.__version__,
                "offtrack_sim": offtrack_sim.__version__,
            },
            "rounds": args.rounds,
            "ratio": "Python's env steps a second over those of `offtrack scale` of the same round, their median",
            "ratio_of_fastest": "the same of the fastest window of all rounds, which other programs disturb least",
            "sizes": sizes,
        }
        args.json.parent.mkdir(parents=True, exist_ok=True)
        args.json.write_text(json.dumps(result, indent=2) + "\n")


def scaled(args, n_envs):
    """What `offtrack scale` says of the machine, and its env steps a second."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scale.json"
        command = [args.offtrack, "scale", "--envs", str(n_envs), "--seconds", str(args.seconds), "--json", file]
        subprocess.run(command, check=True, capture_output=True)
        found = json.loads(file.read_text())
        run = found["runs"][0]
    machine = {key: found[key] for key in ("machine", "threads", "commit", "date", "benchmark", "step")}
    return machine, {"median": run["env_steps_per_second"], "fastest": run["fastest_window"]}


def actions(n_envs):
    return numpy.random.default_rng(0).integers(0, 9, (64, n_envs))


def vector(n_envs, **arguments):
    env = offtrack_sim.make_vec(num_envs=n_envs, autoreset_mode="same_step", **arguments)
    env.reset(seed=0)
    drawn = actions(n_envs)
    return lambda step: env.step(drawn[step % 64])


def batch(n_envs):
    trucks = offtrack_sim.Batch(num_envs=n_envs)
    drawn = actions(n_envs)
    room = (
        numpy.zeros((n_envs, 69), "f4"),
        numpy.zeros(n_envs, "f4"),
        numpy.zeros(n_envs, bool),
        numpy.zeros(n_envs, bool),
    )
    return lambda step: trucks.step_into(drawn[step % 64], *room)


def at_random(n_envs):
    """The native step with native actions, asked for from Python: nothing is handed over."""
    trucks = offtrack_sim.Batch(num_envs=n_envs)
    return lambda _: trucks.step_at_random()


def timed(loop, n_envs, seconds):
    """Env steps a second of a loop, in windows."""
    speeds, step, end = [], 0, time.perf_counter() + seconds
    while time.perf_counter() < end:
        first, start = step, time.perf_counter()
        while (passed := time.perf_counter() - start) < WINDOW:
            loop(step)
            step += 1
        speeds.append((step - first) * n_envs / passed)
    return {"median": statistics.median(speeds), "fastest": max(speeds)}


if __name__ == "__main__":
    main()
