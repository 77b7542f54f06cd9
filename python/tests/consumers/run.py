"""Trains with each learning library for a while, each in an environment of its own, and writes what was measured.

    python tests/consumers/run.py --minutes 2 --json ../docs/results/python-consumers.json

Environments are made in ``--cache`` with pip and kept. PyTorch, of 5 GB, is installed once, with Stable-Baselines3: the
others see it through a .pth file. Needs Python 3.11 or later and, with ``--offtrack``, the command-line program, which
must evaluate each policy file as Python does.

PufferLib 3.0.0 builds without its own environments with ``NO_OCEAN=1``; its setup then reads a name that it has not
set, which a sitecustomize.py supplies.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).resolve().parent
PYTHON = HERE.parents[1]


class Consumer(NamedTuple):
    """A learning library and the example that uses it."""

    name: str
    environment: str
    n_envs: int
    arguments: list[str]
    example: str | None = None
    """The example's name, where it is not the consumer's."""


CONSUMERS = [
    Consumer("sb3_ppo", "sb3", 256, []),
    Consumer("cleanrl_ppo", "sb3", 256, []),
    Consumer("cleanrl_ppo_continuous", "sb3", 256, []),
    Consumer("sb3_sac", "sb3", 64, ["--algorithm", "sac"]),
    Consumer("sb3_td3", "sb3", 64, ["--algorithm", "td3"], "sb3_sac"),
    Consumer("sb3_dqn", "sb3", 64, []),
    Consumer("puffer_ppo", "puffer", 256, []),
    Consumer("ray_actors", "ray", 256, ["--actors", "2", "--envs", "128"]),
    Consumer("rllib_ppo", "ray", 128, ["--runners", "2", "--envs", "64", "--steps", "3000000"]),
]
PACKAGES = {
    "sb3": ["stable-baselines3", "minari[arrow]", "pillow", "sb3-contrib", "matplotlib", "moviepy", "pytest"],
    "ray": ["ray[rllib]", "gymnasium==1.2.2"],
    # All that PufferLib 3.0.0 names, besides torch.
    "puffer": [
        "numpy<2", "gymnasium==0.29.1", "gym<=0.23", "pettingzoo<=1.24.1", "shimmy[gym-v21]", "cython", "setuptools",
        "wheel", "psutil", "pynvml", "rich", "rich_argparse", "imageio", "pyro-ppl", "heavyball", "neptune", "wandb",
    ],
}  # fmt: skip

NATIVE = """
import sys, time
import numpy as np
from offtrack_sim import Batch
n, seconds = int(sys.argv[1]), float(sys.argv[2])
batch = Batch(num_envs=n, seed=1)
random = np.random.default_rng(0)
actions = random.integers(0, len(batch.action_table), (64, n))
outputs = np.zeros((n, 69), np.float32), np.zeros(n, np.float32), np.zeros(n, bool), np.zeros(n, bool)
speeds, end = [], time.perf_counter() + seconds
while time.perf_counter() < end:
    before = time.perf_counter()
    for row in actions:
        batch.step_into(row, *outputs)
    speeds.append(actions.size / (time.perf_counter() - before))
print(round(float(np.median(speeds))))
"""

PLOT = """
import json, sys
import matplotlib
matplotlib.use("svg")
matplotlib.rcParams["svg.fonttype"] = "none"
from matplotlib import pyplot
figure, axes = pyplot.subplots(figsize=(7, 4), layout="constrained")
for run in json.load(open(sys.argv[1]))["consumers"]:
    rows = run.get("curve", [])
    axes.plot([row["env_steps"] / 1e6 for row in rows], [100 * row["success"] for row in rows], label=run["name"])
axes.set(xlabel="env steps [million]", ylabel="training episodes that arrived [%]", ylim=(0, 100))
axes.grid(alpha=0.3)
axes.legend()
figure.savefig(sys.argv[2], metadata={"Date": None})
"""


def make(cache: Path, name: str) -> Path:
    """The Python of an environment, which is made where it is missing."""
    folder = cache / name
    python = folder / "bin" / "python"
    if (folder / "ready").exists():
        return python
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    site = folder / "lib" / version / "site-packages"
    if name != "sb3":
        make(cache, "sb3")
        (site / "zz_torch.pth").write_text(str(cache / "sb3" / "lib" / version / "site-packages") + "\n")
    install: list[str | Path] = [python, "-m", "pip", "install", "--quiet"]
    # Without this what the .pth file shows would count as installed.
    own = ["--ignore-installed"] if name == "puffer" else []
    if name == "puffer":
        subprocess.run([*install, *own, *PACKAGES[name][:8]], check=True)
        subprocess.run([*install, *PACKAGES[name]], check=True)
        with tempfile.TemporaryDirectory() as shim:
            (Path(shim) / "sitecustomize.py").write_text("import builtins\nbuiltins.c_extension_paths = []\n")
            environment = os.environ | {"NO_OCEAN": "1", "MAX_JOBS": "1", "PYTHONPATH": shim}
            build = [*install, "--no-build-isolation", "--no-deps", "pufferlib==3.0.0"]
            subprocess.run(build, check=True, env=environment)
    else:
        subprocess.run([*install, *PACKAGES[name]], check=True)
    (folder / "ready").touch()
    return python


def native(python: Path, n_envs: int, seconds: float) -> int:
    """Env steps a second of the simulator alone, with random actions drawn before and all arrays reused."""
    command: list[str | Path] = [python, "-c", NATIVE, str(n_envs), str(seconds)]
    return int(subprocess.run(command, check=True, capture_output=True, text=True, env=with_package()).stdout)


def with_package() -> dict[str, str]:
    return os.environ | {"PYTHONPATH": str(PYTHON), "PYTHONWARNINGS": "ignore", "RAY_USAGE_STATS_ENABLED": "0"}


def run(consumer: Consumer, args: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """One training run: what it wrote, and the simulator's own speed right before and after."""
    python = make(args.cache, consumer.environment)
    out = folder / consumer.name
    before = native(python, consumer.n_envs, 3.0)
    command: list[str | Path] = [
        python,
        PYTHON / "examples" / f"{consumer.example or consumer.name}.py",
        "--minutes",
        str(args.minutes),
        "--out",
        out,
        *consumer.arguments,
    ]
    found = subprocess.run(command, env=with_package(), timeout=60 * args.minutes + 240, capture_output=True, text=True)
    if found.returncode != 0:
        return {"name": consumer.name, "failed": (found.stderr or found.stdout).strip().splitlines()[-1:]}
    result = json.loads(out.with_suffix(".json").read_text())
    del result["example"], result["date"], result["processor"], result["step"]
    result = {
        "name": consumer.name,
        "trucks": consumer.n_envs,
        "native_env_steps_per_second": {"before": before},
        **result,
    }
    result["native_env_steps_per_second"]["after"] = native(python, consumer.n_envs, 3.0)
    if args.offtrack is not None:
        report = folder / "report.json"
        policy = out.with_suffix(".safetensors")
        subprocess.run(
            [
                *(args.offtrack, "evaluate", "--benchmark", result["settings"]["benchmark"]),
                *("--policy", policy, "--json", report),
            ],
            check=True,
            capture_output=True,
        )
        theirs = json.loads(report.read_text())
        result["offtrack_evaluate_agrees"] = theirs["ends"] == result["evaluation"]["ends"]
    return result


def main() -> None:
    parser = argparse.ArgumentParser(formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("--minutes", type=float, default=2.0, help="longest training of each [min]")
    parser.add_argument("--only", nargs="+", choices=[consumer.name for consumer in CONSUMERS], help="these alone")
    parser.add_argument(
        "--cache", type=Path, default=Path.home() / ".cache" / "offtrack-consumers", help="folder of the environments"
    )
    parser.add_argument("--offtrack", type=Path, help="the command-line program, to compare evaluations with")
    parser.add_argument("--json", type=Path, required=True, help="file to write, again after each; a picture beside it")
    args = parser.parse_args()
    args.cache = args.cache.resolve()
    args.cache.mkdir(parents=True, exist_ok=True)

    content: dict[str, Any] = {
        "date": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "commit": commit(),
        "processor": f"{processor()}, {os.cpu_count()} cores",
        "step": {"seconds": 0.1, "substeps": 2, "rays": 29},
        "speeds": "env steps a second of training: medians over the rows of the curve, updates included; native: the "
        "simulator alone with as many trucks and all cores, random actions, right before and after",
        "success": "in the curve, of training episodes with actions drawn at random; in the evaluation, greedy",
        "consumers": [],
    }
    # The tests that need a learning library: the adapter of Stable-Baselines3, exports, and the whole tutorial.
    tests: list[str | Path] = [
        make(args.cache, "sb3"),
        "-m",
        "pytest",
        "-q",
        "--noconftest",
        "-p",
        "no:cacheprovider",
        HERE,
    ]
    subprocess.run(tests, check=True, env=with_package(), cwd=HERE)
    with tempfile.TemporaryDirectory() as folder:
        for consumer in CONSUMERS:
            if args.only is not None and consumer.name not in args.only:
                continue
            try:
                result = run(consumer, args, Path(folder))
            except (subprocess.SubprocessError, OSError) as error:
                result = {"name": consumer.name, "failed": [str(error)]}
            content["consumers"].append(result)
            speed = result.get("env_steps_per_second_median")
            print(
                consumer.name,
                result.get("failed") or f"{speed:,.0f} env steps/s, {result['evaluation']['success']:.1%}",
                flush=True,
            )
            part = args.json.with_suffix(".part")
            part.write_text(json.dumps(content, indent=2) + "\n")
            part.replace(args.json)
    subprocess.run([make(args.cache, "sb3"), "-c", PLOT, args.json, args.json.with_suffix(".svg")], check=True)
    sys.exit(any("failed" in result for result in content["consumers"]))


def processor() -> str:
    """Its name, as Linux gives it."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "unknown")


def commit() -> str:
    """The commit that the sources are at, with `-dirty` where they differ from it."""
    command = ["git", "-C", str(HERE), "describe", "--always", "--dirty", "--abbrev=12"]
    said = subprocess.run(command, capture_output=True, text=True)
    return said.stdout.strip() if said.returncode == 0 else "unknown"


if __name__ == "__main__":
    main()
