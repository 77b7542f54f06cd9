"""A sweep over settings and seeds on Ray Tune, with the board's table at its end.

    python tune.py --out sweep --learning-rates 3e-4 1e-3 --seeds 0 1 2

Needs ``offtrack-sim``, ``ray[tune]`` and ``torch``. Every trial is cleanrl_ppo.py with other settings, on one core of
any machine of the Ray cluster; ``--address`` takes one that runs, as ray_actors.py says, whose machines share the
folder ``--out``. A trial's policy is a file, and an entry of the board beside it: ``offtrack board`` simulates all of
them again and prints the table, so a sweep reports as the board does. A setting is judged by all of its seeds.
``--benchmark`` is where policies are compared: validation roads, not the test routes.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import ray
import torch
from cleanrl_ppo import Agent, arguments, train
from ray import tune

import offtrack_sim
from offtrack_sim import export

ENTRY = """name = "learning rate {learning_rate:g}, entropy {entropy:g}, seed {seed}"
policy = "{policy}"
link = "tune.py"
commit = "{commit}"

[training]
env_steps = {env_steps}
minutes = {minutes:.2f}
cores = 1

[home]
benchmark = "{benchmark}"
split = "{split}"
episodes = {episodes}
"""


def trial(config: dict[str, Any]) -> None:
    """Trains one policy, writes it with its entry, and reports its success."""
    args: argparse.Namespace = argparse.Namespace(**config)
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    envs = offtrack_sim.make_vec(
        args.scenario, args.envs, seed=args.seed, autoreset_mode="same_step", copy=False, num_threads=1
    )
    agent = Agent(envs.single_observation_space.shape[0], int(envs.single_action_space.n), args.hidden)
    start = time.perf_counter()
    progress = train(args, envs, agent)
    minutes = (time.perf_counter() - start) / 60
    name = f"rate-{args.learning_rate:g}-entropy-{args.entropy:g}-seed-{args.seed}"
    file = args.out / f"{name}.safetensors"
    export.save(file, agent.actor, scenario=args.scenario)
    values = vars(args) | {"policy": file.name, "env_steps": progress.env_steps, "minutes": minutes}
    (args.out / f"{name}.toml").write_text(ENTRY.format(**values), encoding="utf-8")
    policy = offtrack_sim.Policy.load(file)
    found = offtrack_sim.evaluate(policy, args.benchmark, split=args.split, episodes=args.episodes)
    tune.report({"success": found.success, "env_steps": progress.env_steps, "minutes": minutes})


def main() -> None:
    parser = arguments("A sweep over settings and seeds on Ray Tune")
    parser.set_defaults(out=Path("sweep"), benchmark="random2026", split="validation", envs=128)
    parser.add_argument("--learning-rates", type=float, nargs="+", default=[3e-4, 1e-3], help="settings to compare")
    parser.add_argument("--entropies", type=float, nargs="+", default=[0.005], help="settings to compare")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2], help="seeds of each setting")
    parser.add_argument("--episodes", type=int, default=4, help="episodes of the comparison on each route")
    parser.add_argument("--address", help="of a running Ray, HOST:PORT or auto; without it one is started for this run")
    args = parser.parse_args()
    args.out = args.out.resolve()
    args.out.mkdir(parents=True, exist_ok=True)
    # Workers import this file's neighbours wherever they run.
    here = str(Path(__file__).resolve().parent)
    ray.init(address=args.address, runtime_env={"env_vars": {"PYTHONPATH": here}}, log_to_driver=False)
    swept = {
        "learning_rate": tune.grid_search(args.learning_rates),
        "entropy": tune.grid_search(args.entropies),
        "seed": tune.grid_search(args.seeds),
    }
    space = vars(args) | swept | {"commit": "unknown"}
    results = tune.Tuner(tune.with_resources(trial, {"cpu": 1}), param_space=space).fit()
    nodes = len(ray.nodes())
    ray.shutdown()
    failed = [str(result.error) for result in results if result.error is not None]
    if failed:
        sys.exit(f"{len(failed)} of {len(results)} trials failed: {failed[0]}")
    print(f"{len(results)} trials on {nodes} Ray nodes", flush=True)
    entries = sorted(args.out.glob("rate-*.toml"))
    command = [sys.executable, "-m", "offtrack_sim.command", "board", "--claim", *map(str, entries)]
    subprocess.run([*command, "--markdown", str(args.out / "table.md")], check=True)


if __name__ == "__main__":
    main()
