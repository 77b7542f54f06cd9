#!/usr/bin/env python3
"""Installs a wheel into fresh environments, one for each interpreter and version of gymnasium, and uses it there.

    python3 python/tests/wheels.py python/dist/offtrack_sim-*.whl --python python3.10 python3.13 --json FILE

Standard library only. Vector environments are used where gymnasium has them (1.1 or later); before, that they say so.
"""

import argparse
import datetime
import json
import subprocess
import sys
import tempfile
from pathlib import Path

GYMNASIUM = ["0.29.1", "1.2.2", "1.4.0"]
USE = """
import json, sys
import gymnasium, numpy as np, offtrack_sim as sim
from gymnasium.utils.env_checker import check_env

env = gymnasium.make("offtrack_sim:offtrack/Roundabout-v0", render_mode="rgb_array")
check_env(env.unwrapped)
env.reset(seed=1)
assert env.render().shape == (480, 480, 3)
batch = sim.Batch(num_envs=64, seed=7)
for _ in range(100):
    batch.step(np.full(64, 3))
assert batch.tally()["episodes"] > 0
found = sim.evaluate(sim.Policy.shipped(), episodes=2)
assert found.success == 1.0, found
try:
    envs = sim.make_vec(num_envs=8)
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())
    vector = True
except ImportError as error:
    assert "vector environments need 1.1 or later" in str(error)
    vector = False
versions = dict(python=sys.version.split()[0], gymnasium=gymnasium.__version__, numpy=np.__version__, vector=vector)
print(json.dumps(versions))
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--python", nargs="+", default=["python3"], help="interpreters")
    parser.add_argument("--json", type=Path, help="write the result to this file")
    args = parser.parse_args()
    if not args.wheel.is_file():
        sys.exit(f"{args.wheel}: no such file; python/build-wheel.sh makes one")
    used = []
    for python in args.python:
        for gymnasium in GYMNASIUM:
            with tempfile.TemporaryDirectory() as folder:
                subprocess.run([python, "-m", "venv", folder], check=True)
                pip = [f"{folder}/bin/pip", "install", "--quiet", "--disable-pip-version-check"]
                # Before 1.0 gymnasium's checker does not know numpy 2.
                numpy = ["numpy<2"] if gymnasium.startswith("0.") and "3.13" not in python else []
                subprocess.run([*pip, str(args.wheel), f"gymnasium=={gymnasium}", *numpy], check=True)
                done = subprocess.run(
                    [f"{folder}/bin/python", "-W", "ignore", "-c", USE],
                    cwd=folder,
                    check=True,
                    capture_output=True,
                    text=True,
                )
            used.append(json.loads(done.stdout.splitlines()[-1]))
            print(used[-1])
    date = datetime.date.today().isoformat()
    size = args.wheel.stat().st_size
    result = {"date": date, "commit": commit(), "wheel": args.wheel.name, "bytes": size, "used": used}
    assert size < 5_000_000, f"{size} bytes; a wheel must stay below 5 MB"
    if args.json:
        args.json.write_text(json.dumps(result, indent=2) + "\n")


def commit() -> str:
    """The commit that the sources are at, with `-dirty` where they differ from it."""
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--abbrev=12"]
    said = subprocess.run(command, capture_output=True, text=True)
    return said.stdout.strip() if said.returncode == 0 else "unknown"


if __name__ == "__main__":
    main()
