#!/usr/bin/env python3
"""Times each stage of a step on the CPU and on a device, in turns on the same machine.

A round is one run of `offtrack scale` on each engine. A ratio is the device's time over the CPU's in the same round,
and the median of the rounds is reported: load from other programs changes more slowly than the rounds. Standard library
only.

    python3 benches/engines.py --offtrack target/release/offtrack --json docs/results/engines.json
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
# Both engines do the same work in a stage. A ratio beyond this needs an explanation.
FAIR = 3.0


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "--offtrack",
        type=Path,
        default=REPOSITORY / "target/release/offtrack",
        help="the program, built with --features gpu",
    )
    parser.add_argument("--adapter", help="part of an adapter's name, see `offtrack devices`")
    parser.add_argument("--envs", default="1024,16384", help="numbers of trucks, separated by commas")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument(
        "--seconds", type=float, default=2.0, help="time for each number of trucks, engine and round [s]"
    )
    parser.add_argument("--json", type=Path, help="write the result to this file")
    args = parser.parse_args()
    if not args.offtrack.is_file():
        sys.exit(
            f"--offtrack: {args.offtrack}; no such file: build it with `cargo build --release --features gpu` or name "
            "another"
        )

    rounds = []
    for number in range(args.rounds):
        rounds.append({engine: scaled(args, engine) for engine in ("cpu", "gpu")})
        print(f"round {number + 1} of {args.rounds}", file=sys.stderr)
    cpu, gpu = rounds[0]["cpu"], rounds[0]["gpu"]
    result = {
        "machine": cpu["machine"],
        "threads": cpu["threads"],
        "device": gpu["device"],
        "commit": gpu["commit"],
        "date": gpu["date"],
        "benchmark": gpu["benchmark"],
        "step": gpu["step"],
        "rounds": args.rounds,
        "times": "ns a truck, medians over rounds; on a device by its own clock",
        "ratio": "the device's time over the CPU's: the median of the rounds' ratios, with the lowest and the highest",
        "ratio_of_fastest": "the same for each engine's fastest round, which other programs disturb least",
        "sizes": [compared(rounds, index) for index in range(len(cpu["runs"]))],
    }
    for size in result["sizes"]:
        show(size)
    if args.json:
        args.json.write_text(json.dumps(result, indent=2) + "\n")


def scaled(args, engine):
    """The result of `offtrack scale` on an engine."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scale.json"
        command = [
            args.offtrack,
            "scale",
            "--device",
            engine,
            "--envs",
            args.envs,
            "--seconds",
            str(args.seconds),
            "--json",
            file,
        ]
        if engine == "gpu" and args.adapter:
            command += ["--adapter", args.adapter]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, cwd=REPOSITORY)
        if done.returncode != 0:
            sys.exit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stderr}")
        return json.loads(file.read_text())


def compared(rounds, index):
    """One number of trucks: the whole step, and each stage."""
    runs = [{engine: one[engine]["runs"][index] for engine in one} for one in rounds]
    for run in runs:
        for engine in run:
            if "error" in run[engine]:
                sys.exit(f"{engine}, {run[engine]['envs']} trucks: {run[engine]['error']}")
    stages = {name: pair(runs, lambda run, name=name: run["stages"][name]) for name in runs[0]["cpu"]["stages"]}
    return {
        "envs": runs[0]["cpu"]["envs"],
        "step": pair(runs, lambda run: 1e9 / run["env_steps_per_second"]),
        "stages": stages,
        "beyond_three_times": [name for name, stage in stages.items() if not 1 / FAIR <= stage["ratio"] <= FAIR],
    }


def pair(runs, time):
    """Both engines' times and their ratio."""
    ratios = sorted(time(run["gpu"]) / time(run["cpu"]) for run in runs)
    return {
        "cpu": round(statistics.median(time(run["cpu"]) for run in runs), 1),
        "gpu": round(statistics.median(time(run["gpu"]) for run in runs), 1),
        "ratio": round(statistics.median(ratios), 2),
        "lowest": round(ratios[0], 2),
        "highest": round(ratios[-1], 2),
        "ratio_of_fastest": round(min(time(run["gpu"]) for run in runs) / min(time(run["cpu"]) for run in runs), 2),
    }


def show(size):
    print(f"{size['envs']} trucks{'CPU':>16}{'device':>12}{'ratio':>8}{'fastest':>9}   lowest to highest")
    for name, row in [("whole step", size["step"]), *size["stages"].items()]:
        mark = " *" if name in size["beyond_three_times"] else ""
        print(
            f"  {name:12}{row['cpu']:12.1f} ns{row['gpu']:9.1f} ns{row['ratio']:8.2f}{row['ratio_of_fastest']:9.2f}"
            f"   {row['lowest']:.2f} to {row['highest']:.2f}{mark}"
        )


if __name__ == "__main__":
    main()
