#!/usr/bin/env python3
"""Chooses the ten routes of dev10 from the 40 validation roads of random2026, and writes board/dev10/.

    offtrack train --seed 1 --steps 800000 --name dev10      # a weak policy, which ablations look like
    python3 board/dev10.py --offtrack target/release/offtrack --weak runs/dev10/policy.safetensors

No test road is looked at. A route is taken where all of this holds, of two evaluations with 30 starts each, of which
the seeds are 0 and 1:

- possible: each of three trained policies arrives in all 60 episodes;
- hard: the weak policy arrives in at most 80 % of its 60, and in 10 % at least;
- of low variance: its two evaluations differ by at most three of 30 episodes.

Of these the hardest ten, one a road. Standard library only.
"""

import argparse
import json
import shutil
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
STRONG = ["attard2023", "attard2023-lane", str(ROOT / "board/best-71.safetensors")]
HEAD = """\
# Ten routes of ten validation roads of random2026, hard and of low variance, for ablations: dev10.py chose them, and
# says how. Otherwise as random2026.toml; policies are trained on its training roads.
vehicle = "../../scenarios/vehicles/daf_xf.toml"
load = "empty"
gutter = "drivable"

[actions]
steer_levels = [-0.8, -0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8]
speeds_kmh = [30.0]

[sensors]
range = 20.0

[reward]
waypoint = 100.0
lane_distance = -1.5
lane_distance_limit = 4.0
failure = -500.0
"""


def arrivals(offtrack, policy, seed):
    """How many of 30 episodes arrive, by route."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "report.json"
        command = [offtrack, "evaluate", "--benchmark", "random2026", "--split", "validation", "--policy", policy]
        command += ["--episodes", "30", "--seed", str(seed), "--json", str(file)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        routes = json.loads(file.read_text())["outcomes"]["routes"]
        return {route["name"]: route["ended"].count(".") for route in routes}


def chosen(offtrack, weak):
    """Name and arrivals in both evaluations of each route taken, the hardest first."""
    strong = [arrivals(offtrack, policy, seed) for policy in STRONG for seed in (0, 1)]
    one, other = (arrivals(offtrack, weak, seed) for seed in (0, 1))
    possible = [name for name in one if all(found[name] == 30 for found in strong)]
    steady = [name for name in possible if abs(one[name] - other[name]) <= 3]
    hard = [name for name in steady if 6 <= one[name] + other[name] <= 48]
    print(f"{len(one)} routes, {len(possible)} possible, {len(steady)} of low variance, {len(hard)} hard")
    taken = {}
    for name in sorted(hard, key=lambda name: (one[name] + other[name], name)):
        taken.setdefault(name.rsplit("/", 1)[0], (name, one[name], other[name]))
    return list(taken.values())[:10]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--offtrack", default="offtrack", help="the program")
    parser.add_argument("--weak", required=True, help="the weak policy's file")
    args = parser.parse_args()
    routes = chosen(args.offtrack, args.weak)
    if len(routes) < 10:
        parser.error(f"only {len(routes)} roads have such a route")
    folder = ROOT / "board/dev10"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    text = HEAD
    for name, one, other in sorted(routes):
        _, seed, index, route = name.split("/")
        file = f"wide-{seed}-{index}.toml"
        with tempfile.TemporaryDirectory() as drawn:
            command = [args.offtrack, "generate", "--seed", seed, "--first", index, "--count", "1", "-o", drawn]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            shutil.copy(Path(drawn) / file, folder / file)
        text += f"\n# The weak policy: {one} and {other} of 30.\n"
        text += f'[[roundabout]]\nfile = "{file}"\ntest = ["{route}"]\n'
    (folder / "dev10.toml").write_text(text)


if __name__ == "__main__":
    main()
