#!/usr/bin/env python3
"""Times many random roads: until a world is ready, its memory, and the speed of a step beside few roads.

Each speed is a run of `offtrack scale`. What is compared runs in turns, and the median of the rounds' ratios is
reported: load from other programs changes more slowly than the rounds. Standard library only.

    python3 benches/roads.py --json docs/results/roads.json
    python3 benches/roads.py --other OTHER/offtrack --json docs/results/roads.json    # and beside another build
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
# The benchmark of five roundabouts that many roads are compared with.
FEW = "attard2023-full"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--offtrack", type=Path, default=REPOSITORY / "target/release/offtrack", help="the program")
    parser.add_argument("--other", type=Path, help="another build of it: five roundabouts are stepped in turns by both")
    parser.add_argument("--device", default="cpu", choices=["cpu", "gpu"])
    parser.add_argument("--distribution", default="wide")
    parser.add_argument(
        "--ready", type=int, default=1000, help="roads that are made ready, without a cache and from it; 0 for none"
    )
    parser.add_argument("--roads", type=int, default=256, help="roads that are stepped; 0 for none")
    parser.add_argument("--envs", default="1024", help="number of trucks")
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--seconds", type=float, default=2.0, help="time for each speed and round [s]")
    parser.add_argument("--json", type=Path, help="write the result to this file")
    args = parser.parse_args()
    for program in filter(None, [args.offtrack, args.other]):
        if not program.is_file():
            sys.exit(f"{program}: no such file; build it with `cargo build --release` or name another")

    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        os.environ["OFFTRACK_CACHE"] = str(folder / "cache")
        result = {}
        if args.ready:
            result["ready"] = ready(args, folder)
        pairs = {}
        if args.roads:
            benchmark = written(args, folder, args.roads)
            pairs[f"{args.roads} roads"] = ((args.offtrack, FEW), (args.offtrack, benchmark))
        if args.other:
            pairs["another build"] = ((args.other, FEW), (args.offtrack, FEW))
        for name, (first, second) in pairs.items():
            runs = []
            for number in range(args.rounds):
                runs.append((scaled(args, folder, *first), scaled(args, folder, *second)))
                print(f"{name}: round {number + 1} of {args.rounds}", file=sys.stderr)
            result[name] = compared(runs)
            result.update({key: runs[0][1][key] for key in ("machine", "threads", "device", "commit", "date", "step")})
        print(json.dumps(result, indent=2))
        if args.json:
            args.json.write_text(json.dumps(result, indent=2) + "\n")


def written(args, folder, count):
    """A benchmark of `count` random roads."""
    scenarios = REPOSITORY / "scenarios"
    text = (scenarios / "random2026.toml").read_text().split("[procedural]")[0]
    text = text.replace('vehicle = "', f'vehicle = "{scenarios}/')
    distribution = scenarios / "distributions" / f"{args.distribution}.toml"
    file = folder / f"random-{count}.toml"
    file.write_text(
        f'{text}[procedural]\ndistribution = "{distribution}"\nseed = 2026\ncount = {count}\ntrain = [0, {count}]\n'
    )
    return file


def scaled(args, folder, program, benchmark, seconds=None):
    """The result of `offtrack scale`."""
    file = folder / "scale.json"
    command = [program, "scale", "--device", args.device, "--envs", args.envs, "--benchmark", benchmark, "--json", file]
    command += ["--seconds", str(seconds or args.seconds)]
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, cwd=REPOSITORY)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stderr}")
    return json.loads(file.read_text())


def ready(args, folder):
    """Time until many roads can be stepped, without a cache and from it."""
    benchmark = written(args, folder, args.ready)
    found = {}
    for name in ("first_time", "from_cache"):
        scale = scaled(args, folder, args.offtrack, benchmark, seconds=0.1)
        found[name] = {
            "seconds_to_read": round(scale["seconds_to_read"], 2),
            "seconds_to_bake": round(scale["seconds_to_bake"], 2),
        }
    cache = sum(file.stat().st_size for file in (folder / "cache").iterdir())
    return found | {
        "roads": args.ready,
        "routes": scale["routes"],
        "world_bytes": scale["world_bytes"],
        "cache_bytes": cache,
    }


def compared(runs):
    """Speeds of two things that ran in turns, with their stages."""
    runs = [tuple(one["runs"][0] for one in run) for run in runs]
    for run in runs:
        for one in run:
            if "error" in one:
                sys.exit(one["error"])
    ratios = sorted(second["env_steps_per_second"] / first["env_steps_per_second"] for first, second in runs)
    speed = lambda index: round(statistics.median(run[index]["env_steps_per_second"] for run in runs))
    stages = {
        stage: [round(statistics.median(run[index]["stages"][stage] for run in runs), 1) for index in (0, 1)]
        for stage in runs[0][1]["stages"]
        if stage in runs[0][0]["stages"]
    }
    return {
        "env_steps_per_second": [speed(0), speed(1)],
        "ratio": round(statistics.median(ratios), 3),
        "lowest": round(ratios[0], 3),
        "highest": round(ratios[-1], 3),
        "stages_ns_a_truck": stages,
    }


if __name__ == "__main__":
    main()
