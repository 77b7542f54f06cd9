#!/usr/bin/env python3
"""Times a step of the live page's trucks in headless Chromium beside the program's own.

In the browser a software device, SwiftShader, computes the shaders on the processor; the program steps the same trucks
by the same shaders on another one, lavapipe, and by its CPU engine. All of them have the same cores, in turns, and none
is a graphics card: the table says what shaders cost without one. A step is 0.1 s of every truck, by actions that are
drawn at random or by the shipped policy. Needs Chromium, and for lavapipe a program with the feature gpu.

    python3 benches/live_speed.py --offtrack target/release/offtrack --json FILE
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from live_page import REPOSITORY, page_with, visited

# Size of the window (pixels).
WINDOW = (800, 600)
# Steps before the first one that is timed, and steps that the page submits at once.
BEFORE, AT_ONCE = 8, 4
MODES = ("random", "policy")
BROWSER, LAVAPIPE, CPU = "browser, SwiftShader", "program, lavapipe", "program, CPU engine"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--offtrack", type=Path, default=REPOSITORY / "target/release/offtrack", help="the program")
    parser.add_argument("--envs", type=int, default=4096, help="number of trucks")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=5.0, help="time for each mode and round [s]")
    parser.add_argument("--adapter", default="llvmpipe", help="the program's software device; nothing leaves it out")
    parser.add_argument("--json", type=Path, help="write the result to this file")
    args = parser.parse_args()
    if not args.offtrack.is_file():
        sys.exit(f"--offtrack: {args.offtrack}; no such file: build it with `cargo build --release` or name another")

    rounds = {name: [] for name in (BROWSER, LAVAPIPE, CPU)}
    machine = {}
    for number in range(args.rounds):
        rounds[BROWSER].append(in_browser(args))
        if args.adapter:
            rounds[LAVAPIPE].append(scaled(args, "--device", "gpu", "--adapter", args.adapter)[1])
        machine, times = scaled(args)
        rounds[CPU].append(times)
        print(f"round {number + 1} of {args.rounds}", file=sys.stderr)

    median = {
        name: {mode: statistics.median(times[mode] for times in found) for mode in MODES}
        for name, found in rounds.items()
        if found
    }
    print(f"A step of {args.envs} trucks on {machine['machine']} (ms), medians of {args.rounds} rounds\n")
    print("| | random actions | shipped policy |\n|---|---|---|")
    for name, times in median.items():
        print(f"| {name} | {times['random']:.1f} | {times['policy']:.1f} |")
    if args.json:
        result = {**machine, "envs": args.envs, "seconds": args.seconds, "step_ms": median, "rounds": rounds}
        args.json.write_text(json.dumps(result, indent=2) + "\n")


def in_browser(args):
    """Median time of a step on the page, by mode [ms]."""
    plan = {"envs": args.envs, "seconds": args.seconds, "before": BEFORE, "at_once": AT_ONCE}
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        page = page_with([args.offtrack], "live_speed.js", Path(folder))
        found = json.loads(visited(page, WINDOW, plan, folder)["/done"])
    if "swiftshader" not in found["adapter"]:
        sys.exit(f"the browser computes on {found['adapter']}, not on SwiftShader")
    return {mode: statistics.median(found[mode]) for mode in MODES}


def scaled(args, *device):
    """What `offtrack scale` says of the machine, and its time of a step by mode [ms]."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scale.json"
        command = [args.offtrack, "scale", "--envs", str(args.envs), "--mode", ",".join(MODES)]
        command += ["--seconds", str(args.seconds), "--json", file, *device]
        run = subprocess.run(command, capture_output=True, text=True)
        if run.returncode != 0:
            sys.exit(f"{run.stderr.strip()}\nwith --adapter '' the program's device is left out")
        found = json.loads(file.read_text())
    machine = {key: found[key] for key in ("machine", "threads", "commit", "date", "benchmark")}
    times = {run["mode"]: 1000 * args.envs / run["env_steps_per_second"] for run in found["runs"]}
    return machine, times


if __name__ == "__main__":
    main()
